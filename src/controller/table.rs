//! Tables of numbers: the plain CSV, and those of controllers that read one.

use super::options::Column;
use super::playback::Playback;
use super::{Card, Choice, Format};
use crate::error::{Error, Result};
use crate::trajectory::samples::Line;

/// CSV with these columns: a header `t,q1,…,dq1,…`, joints by their number in the robot's order; numbers have the
/// fewest digits that read back as the same number.
pub(super) fn csv(playback: &Playback, columns: &[Column]) -> Result<Vec<u8>> {
    let s = &playback.samples;
    let mut names = Vec::new();
    let mut all: Vec<(&[f64], f64)> = Vec::new();
    for column in columns {
        let values = match column {
            Column::T => {
                names.push("t".to_string());
                all.push((&s.t, 1.0));
                continue;
            }
            Column::Q => &s.q,
            Column::Dq => &s.qd,
            Column::Ddq => &s.qdd,
        };
        for ((joint, values), scale) in playback.joints.iter().zip(values).zip(&playback.scale) {
            names.push(format!("{}{}", column.name(), joint.number));
            all.push((values, *scale));
        }
    }
    let mut out = names.join(",").into_bytes();
    out.push(b'\n');
    let mut line = Line::default();
    for i in 0..playback.len() {
        let mut values = all.iter().map(|(column, scale)| scale * column[i]);
        let first = values.next().unwrap_or(0.0);
        line.row(&mut out, first, values)
            .map_err(|e| Error::Infeasible(e.to_string()))?;
    }
    Ok(out)
}

/// Plain CSV.
pub struct Csv;

impl Format for Csv {
    fn card(&self) -> Card {
        Card {
            choice: Choice::Columns,
            ..Card::new(
                "csv",
                "csv",
                "plain CSV at any rate, order and unit (t, q, dq, ddq)",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        csv(playback, &playback.columns)
    }
}
