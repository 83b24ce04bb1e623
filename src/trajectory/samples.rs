//! Sampled motions as CSV: `t,q1..,dq1..,ddq1..[,tau1..]`.

use super::fourier::Fourier;
use super::torque::TorqueFn;
use crate::error::{Error, Result, number};
use crate::output::write_atomic;
use std::io::{self, Write};
use std::path::Path;

/// Most rows written into one file.
const ROWS_MAX: f64 = 1e7;

/// A sampled motion, column by column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// times, s
    pub t: Vec<f64>,
    /// positions, one column per joint, rad or m
    pub q: Vec<Vec<f64>>,
    /// velocities
    pub qd: Vec<Vec<f64>>,
    /// accelerations
    pub qdd: Vec<Vec<f64>>,
}

impl Samples {
    /// A motion of `dof` joints without samples, with room for `capacity`.
    pub fn with_capacity(dof: usize, capacity: usize) -> Self {
        let columns = || vec![Vec::with_capacity(capacity); dof];
        Samples {
            t: Vec::with_capacity(capacity),
            q: columns(),
            qd: columns(),
            qdd: columns(),
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.q.len()
    }

    /// Appends a sample.
    ///
    /// # Panics
    /// If a slice does not have one entry per joint.
    pub fn push(&mut self, t: f64, q: &[f64], qd: &[f64], qdd: &[f64]) {
        self.t.push(t);
        for (columns, row) in [(&mut self.q, q), (&mut self.qd, qd), (&mut self.qdd, qdd)] {
            assert_eq!(columns.len(), row.len(), "one entry per joint");
            columns
                .iter_mut()
                .zip(row)
                .for_each(|(column, &v)| column.push(v));
        }
    }

    /// Copies sample `i` into slices with one entry per joint.
    ///
    /// # Panics
    /// If there is no sample `i` or a slice has another length.
    pub fn row(&self, i: usize, q: &mut [f64], qd: &mut [f64], qdd: &mut [f64]) {
        for (columns, row) in [(&self.q, q), (&self.qd, qd), (&self.qdd, qdd)] {
            assert_eq!(columns.len(), row.len(), "one entry per joint");
            row.iter_mut()
                .zip(columns)
                .for_each(|(v, column)| *v = column[i]);
        }
    }

    /// Writes the motion (without torques), whole or not at all.
    ///
    /// # Errors
    /// As [`write_atomic`]; [`Error::Io`] if a number is not finite.
    pub fn write(&self, path: impl AsRef<Path>, force: bool) -> Result<()> {
        let columns: Vec<&[f64]> = [&self.q, &self.qd, &self.qdd]
            .into_iter()
            .flatten()
            .map(Vec::as_slice)
            .collect();
        let mut line = Line::default();
        write_atomic(path, force, |w| {
            line.header(w, self.dof(), false)?;
            for (i, &t) in self.t.iter().enumerate() {
                line.row(
                    w,
                    t,
                    columns
                        .iter()
                        .map(|c| c.get(i).copied().unwrap_or(f64::NAN)),
                )?;
            }
            Ok(())
        })
    }
}

/// Times `0, 1/f, 2/f …` up to the duration; the last one is the duration itself, so that the last
/// step may be shorter than the others.
///
/// # Errors
/// [`Error::Argument`] if rate or duration are not positive numbers or ask for more than 10⁷ rows.
pub fn times(duration: f64, rate: f64) -> Result<Vec<f64>> {
    if !(rate.is_finite() && rate > 0.0) {
        return Err(Error::Argument(format!(
            "the sample rate must be a positive number of hertz, not {rate}"
        )));
    }
    let steps = duration * rate;
    if !(duration >= 0.0 && steps < ROWS_MAX) {
        return Err(Error::Argument(format!(
            "{} s at {rate} Hz cannot be sampled; use a lower --rate or fewer --periods",
            number(duration)
        )));
    }
    // a whole number of steps but for rounding ends on the grid
    let whole = if (steps - steps.round()).abs() < 1e-6 {
        steps.round()
    } else {
        steps.ceil()
    };
    let mut t: Vec<f64> = (0..whole as usize).map(|i| i as f64 / rate).collect();
    t.push(duration);
    Ok(t)
}

/// Positions, velocities and accelerations at a time.
pub type StateFn<'a> = dyn Fn(f64, [&mut [f64]; 3]) + 'a;

/// Writes a motion of `dof` joints at these times as CSV, with torques where `torque` is given; whole or not at all.
/// Numbers have the fewest digits that read back as the same number.
///
/// # Errors
/// As [`write_atomic`]; [`Error::Io`] if a number is not finite.
pub fn write_along(
    path: impl AsRef<Path>,
    force: bool,
    dof: usize,
    times: &[f64],
    at: &StateFn,
    torque: Option<&TorqueFn>,
) -> Result<()> {
    write_atomic(path, force, |w| along(w, dof, times, at, torque))
}

/// Bytes of a trajectory as CSV at these times, without torques.
///
/// # Errors
/// [`Error::Argument`] if a number is not finite.
pub fn length_of_samples(trajectory: &Fourier, times: &[f64]) -> Result<usize> {
    struct Count(usize);
    impl Write for Count {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0 += bytes.len();
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let mut count = Count(0);
    let at = |t: f64, out: [&mut [f64]; 3]| trajectory.evaluate(t, out);
    along(&mut count, trajectory.dof(), times, &at, None)
        .map_err(|e| Error::Argument(e.to_string()))?;
    Ok(count.0)
}

fn along(
    w: &mut dyn Write,
    n: usize,
    times: &[f64],
    at: &StateFn,
    torque: Option<&TorqueFn>,
) -> io::Result<()> {
    let mut values = vec![0.0; if torque.is_some() { 4 * n } else { 3 * n }];
    let mut line = Line::default();
    line.header(w, n, torque.is_some())?;
    for &t in times {
        let (q, rest) = values.split_at_mut(n);
        let (qd, rest) = rest.split_at_mut(n);
        let (qdd, tau) = rest.split_at_mut(n);
        at(t, [&mut *q, &mut *qd, &mut *qdd]);
        if let Some(torque) = torque {
            torque(q, qd, qdd, tau);
        }
        line.row(w, t, values.iter().copied())?;
    }
    Ok(())
}

/// A line being put together, its memory kept.
#[derive(Default)]
pub(crate) struct Line(String);

impl Line {
    fn header(&mut self, w: &mut dyn Write, dof: usize, torque: bool) -> io::Result<()> {
        let names = ["q", "dq", "ddq", "tau"];
        let used = &names[..if torque { 4 } else { 3 }];
        let mut text = String::from("t");
        for name in used {
            (1..=dof).for_each(|j| text += &format!(",{name}{j}"));
        }
        writeln!(w, "{text}")
    }

    pub(crate) fn row(
        &mut self,
        w: &mut dyn Write,
        t: f64,
        values: impl Iterator<Item = f64>,
    ) -> io::Result<()> {
        use std::fmt::Write as _;
        self.0.clear();
        for (k, value) in std::iter::once(t).chain(values).enumerate() {
            if !value.is_finite() {
                let message = format!("a number that is not finite came up at t = {t} s");
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
            if k > 0 {
                self.0.push(',');
            }
            let size = value.abs();
            let written = if size == 0.0 || (1e-5..1e16).contains(&size) {
                write!(self.0, "{value}")
            } else {
                write!(self.0, "{value:e}")
            };
            written.map_err(io::Error::other)?;
        }
        self.0.push('\n');
        w.write_all(self.0.as_bytes())
    }
}

/// Reads a sampled motion of `dof` joints: columns `t`, `q1 … qn`, `dq1 … dqn`, `ddq1 … ddqn` by
/// name, in any order, spaces around names and numbers ignored, other columns too.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read; [`Error::File`] with file, line and column if a column
/// is missing or there twice, a line has another number of fields than the header, a field is not
/// a finite number, or there are no samples.
pub fn read_samples(path: impl AsRef<Path>, dof: usize) -> Result<Samples> {
    let names = std::iter::once("t".to_string()).chain(
        ["q", "dq", "ddq"]
            .iter()
            .flat_map(|p| (1..=dof).map(move |j| format!("{p}{j}"))),
    );
    let mut columns = read_columns(path, &names.collect::<Vec<_>>())?.into_iter();
    let t = columns.next().unwrap_or_default();
    let mut next = || columns.by_ref().take(dof).collect::<Vec<_>>();
    Ok(Samples {
        t,
        q: next(),
        qd: next(),
        qdd: next(),
    })
}

/// Names of the columns of a CSV file with a header.
///
/// # Errors
/// A file that cannot be read or is empty.
pub fn column_names(path: impl AsRef<Path>) -> Result<Vec<String>> {
    Ok(open(path.as_ref())?.1)
}

/// What is wrong with a file that is no CSV.
fn broken(path: &Path, e: csv::Error) -> Error {
    let place = e
        .position()
        .map_or(String::new(), |p| format!("line {}", p.line()));
    match e.into_kind() {
        csv::ErrorKind::Io(source) => Error::io(path, source),
        other => Error::file(path, place, format!("{other:?}")),
    }
}

/// A CSV file behind its header.
fn open(path: &Path) -> Result<(csv::Reader<std::fs::File>, Vec<String>)> {
    let file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .buffer_capacity(1 << 18)
        .from_reader(file);
    let mut record = csv::ByteRecord::new();
    let any = reader.read_byte_record(&mut record);
    if !any.map_err(|e| broken(path, e))? {
        return Err(Error::file(
            path,
            "",
            "is empty; a header with column names is needed",
        ));
    }
    let header = record
        .iter()
        .map(|name| {
            String::from_utf8_lossy(name)
                .trim_start_matches('\u{feff}')
                .trim()
                .to_string()
        })
        .collect();
    Ok((reader, header))
}

/// Reads the named columns of a CSV file with a header, in the order of `names`.
///
/// # Errors
/// As [`read_samples`].
pub fn read_columns(path: impl AsRef<Path>, names: &[String]) -> Result<Vec<Vec<f64>>> {
    let path = path.as_ref();
    let broken = |e| broken(path, e);
    let (mut reader, header) = open(path)?;
    let mut record = csv::ByteRecord::new();
    let mut places = Vec::with_capacity(names.len());
    for name in names {
        let mut found = (0..header.len()).filter(|&k| header[k] == *name);
        let Some(at) = found.next() else {
            // what is not a table at all is shown in part, and nothing that a terminal obeys
            let list: String = header.join(", ").escape_debug().take(300).collect();
            let message = format!("is missing; the columns are {list}");
            return Err(Error::file(path, format!("column {name}"), message));
        };
        if found.next().is_some() {
            return Err(Error::file(
                path,
                format!("column {name}"),
                "is there twice",
            ));
        }
        places.push(at);
    }
    let mut columns = vec![Vec::new(); names.len()];
    while reader.read_byte_record(&mut record).map_err(broken)? {
        let line = record.position().map_or(0, |p| p.line());
        if record.len() == 1 && header.len() > 1 && record[0].is_empty() {
            continue; // a blank line
        }
        if record.len() != header.len() {
            let message = format!(
                "{} fields, but the header has {}",
                record.len(),
                header.len()
            );
            return Err(Error::file(path, format!("line {line}"), message));
        }
        for ((column, &at), name) in columns.iter_mut().zip(&places).zip(names) {
            let field = record.get(at).unwrap_or_default();
            let value = std::str::from_utf8(field)
                .ok()
                .and_then(|f| f.parse::<f64>().ok());
            match value {
                Some(value) if value.is_finite() => column.push(value),
                _ => {
                    let text = String::from_utf8_lossy(field);
                    let message = format!("{text:?} is not a finite number");
                    return Err(Error::file(
                        path,
                        format!("line {line}, column {name}"),
                        message,
                    ));
                }
            }
        }
    }
    if columns.first().is_some_and(Vec::is_empty) {
        return Err(Error::file(path, "", "has a header but no samples"));
    }
    Ok(columns)
}

#[cfg(test)]
mod tests;
