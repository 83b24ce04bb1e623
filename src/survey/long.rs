//! Logs that are longer than the memory: what their columns mean is found in the part in which they change most, and the
//! joints are followed through all of them.
//!
//! ```text
//! 1st time   part 1, part 2, …   ─▶ the liveliest, rows, gaps   ─▶ claims
//! 2nd time   part 1, part 2, …   ─▶ what each joint does
//! ```

use super::claim::Claim;
use super::frame::{Course, Frame, PAUSE, Ticks, richest};
use crate::error::{Result, Warning, WarningKind};
use crate::log::clock::is_gap;
use crate::log::formats::{self, Format, Request, csv};
use crate::log::outline::size;
use crate::log::record::long_enough;
use crate::plant::Plant;
use std::ops::ControlFlow;
use std::path::Path;

/// Rows of a part, where it has no more than [`COLUMNS`], and fewer where it has more.
const ROWS: usize = 400_000;
const COLUMNS: usize = 20;
/// Rows of a part at least.
const LEAST: usize = 20_000;
/// Size of a log that is read in parts, bytes.
const LONG: u64 = 500 << 20;

/// The part of a long log that is looked at.
pub(super) struct Part {
    pub frame: Frame,
    pub format: Format,
    pub topic: Option<String>,
    /// rows of the parts that it was read in
    pub rows: usize,
}

/// Hands the parts of a log to `each`, with when they begin, s from its start; returns the topic of a bag and what is said of
/// parts that cannot be looked at, and nothing where parts have other columns than the first.
fn follow(
    path: &Path,
    rows: usize,
    like: Option<(Ticks, Format)>,
    each: &mut dyn FnMut(Frame, Format) -> Result<()>,
) -> Result<Option<(Option<String>, Vec<Warning>)>> {
    let request = Request {
        skip: None,
        format: like.map(|(_, format)| format),
        topic: None,
        wanted: &|_| true,
    };
    // of the part before: its end, s from the start, the last stamp and the usual step
    let mut before: Option<[f64; 3]> = None;
    let mut names: Option<Vec<String>> = None;
    let mut ticks = like.map(|(ticks, _)| ticks);
    let (mut hopeless, mut why) = (Vec::new(), None);
    let mut alike = true;
    let topic = formats::read_parts(path, &request, rows, &mut |table, format| {
        alike = *names.get_or_insert_with(|| table.names.clone()) == table.names;
        if !alike {
            return Ok(ControlFlow::Break(()));
        }
        let first = table.before + 1;
        let last = table.before + table.rows();
        let mut frame = match Frame::new(vec![path.to_path_buf()], table, format, ticks) {
            Ok(frame) => frame,
            // as hopeless rows of a log that is read whole
            Err(e) => {
                let said = format!("rows {first} to {last} were left out: {e}");
                hopeless.push(Warning::new(
                    WarningKind::RowsLeftOut,
                    super::file_name(path),
                    said,
                ));
                why.get_or_insert(e);
                return Ok(ControlFlow::Continue(()));
            }
        };
        ticks.get_or_insert_with(|| frame.ticks());
        if let Some([end, last, step]) = before {
            let ahead = match frame.time {
                Some(_) => (frame.stamps[0] - last) * frame.factor,
                None => frame.step,
            };
            // stamps that do not go on are followed by the usual step, as those within a log are
            let ahead = if ahead > 0.0 { ahead } else { step };
            frame.start = end + ahead;
            frame
                .gaps
                .iter_mut()
                .flatten()
                .for_each(|t| *t += frame.start);
            if is_gap(ahead, step) {
                frame.gaps.insert(0, [end, frame.start]);
            }
        }
        before = Some([frame.looked_at()[1], frame.stamps[1], frame.step]);
        each(frame, format)?;
        Ok(ControlFlow::Continue(()))
    })?;
    if let (None, Some(e)) = (before, why) {
        return Err(e);
    }
    Ok(alike.then_some((topic, hopeless)))
}

/// Rows of the parts of a log, if it is so long that it should be read in parts, else 0.
pub(super) fn rows(path: &Path) -> Result<usize> {
    if size(path) < LONG {
        return Ok(0);
    }
    let columns = match formats::detect(path)?.text() {
        true => csv::names(path)?.len(),
        false => COLUMNS,
    };
    Ok((ROWS * COLUMNS / columns.max(COLUMNS)).max(LEAST))
}

/// Of a log of which parts can be read, the one in which the columns change most. It has the rows, gaps and
/// length of the whole log, and is silent where all of it is.
pub(super) fn liveliest(
    path: &Path,
    each: usize,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Part>> {
    long_enough(each)?;
    if !formats::divides(path)? {
        return Ok(None);
    }
    let mut best: Option<Frame> = None;
    let (mut rows, mut length, mut gaps, mut said) = (0, 0.0, Vec::new(), Vec::new());
    let mut silent: Option<Vec<usize>> = None;
    let mut kind = Format::Csv;
    let found = follow(path, each, None, &mut |mut frame, format| {
        kind = format;
        rows += frame.rows;
        length = frame.looked_at()[1];
        gaps.append(&mut frame.gaps);
        said.append(&mut frame.warnings);
        let all = silent.get_or_insert_with(|| frame.silent.clone());
        all.retain(|k| frame.silent.contains(k));
        best = Some(match best.take() {
            Some(first) => {
                // of two that are as rich the last one in the list, which is the earlier part
                let both = [frame, first];
                let later = richest(&both).is_some_and(|f| f.start == both[0].start);
                let [frame, first] = both;
                if later { frame } else { first }
            }
            None => frame,
        });
        Ok(())
    })?;
    let (Some((topic, hopeless)), Some(mut frame)) = (found, best) else {
        return Ok(None);
    };
    warnings.append(&mut said);
    warnings.extend(hopeless);
    let [from, to] = frame.looked_at();
    if frame.rows < rows {
        let seconds = match frame.time {
            Some(_) => format!("from {from:.1} s to {to:.1} s"),
            None => format!("from row {:.0} on", from / frame.step + 1.0),
        };
        warnings.push(Warning::new(
            WarningKind::ReadInParts,
            super::file_name(path),
            format!(
                "{rows} rows were read in parts: what each column means, and the figure, are of {} of them, {seconds}, in which the \
                 columns change most; ranges, motion, gaps and saturated samples are of all",
                frame.rows
            ),
        ));
    }
    (frame.rows, frame.length, frame.gaps) = (rows, length, gaps);
    frame.silent = silent.unwrap_or_default();
    Ok(Some(Part {
        frame,
        format: kind,
        topic,
        rows: each,
    }))
}

/// What each joint does in the whole log, of which this is the liveliest part.
pub(super) fn courses(
    part: &Frame,
    (format, rows): (Format, usize),
    claims: &[Claim],
    joints: usize,
    robot: Option<&Plant>,
) -> Result<Vec<Course>> {
    let strides = part.strides(claims, joints);
    let mut all: Vec<Course> = Vec::new();
    let path = part.paths[0].clone();
    let like = Some((part.ticks(), format));
    follow(&path, rows, like, &mut |frame, _| {
        let mut next = frame.courses(claims, joints, robot, &strides);
        next.iter_mut().for_each(|c| c.begin_at(frame.start));
        match all.is_empty() {
            true => all = next,
            false => (all.iter_mut().zip(next)).for_each(|(c, next)| c.go_on(next)),
        }
        Ok(())
    })?;
    Ok(all)
}

impl Course {
    fn begin_at(&mut self, start: f64) {
        self.moves.iter_mut().flatten().for_each(|t| *t += start);
    }

    /// What the joint does afterwards.
    fn go_on(&mut self, next: Course) {
        for [a, b] in next.moves {
            match self.moves.last_mut() {
                Some(last) if a - last[1] < PAUSE => last[1] = b,
                _ => self.moves.push([a, b]),
            }
        }
        self.range = match (self.range, next.range) {
            (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
            (one, other) => one.or(other),
        };
        let fastest = [self.fastest, next.fastest].into_iter().flatten();
        self.fastest = fastest.reduce(f64::max);
        self.saturated += next.saturated;
    }
}
