//! What looks wrong about a file of readings as a whole.

use super::row::{Row, Source, Value};
use crate::error::{Error, Result, Warning, WarningKind, agreeing, number};
use crate::median::median;

/// Joint angles beyond this many radians are suspected to be degrees.
const TURNS: f64 = 7.0;
/// Positions beyond this many metres are suspected to be millimetres.
const FAR: f64 = 30.0;
/// Readings of a gauge beyond this many metres are.
const DEEP: f64 = 0.1;
/// Deviation that poses leave of pictures, in stated standard deviations, beyond which the camera is doubted.
const ROUGH: f64 = 2.0;

/// What was met while a file was read.
#[derive(Default)]
pub struct Tally {
    /// line of each picture that tells no pose, and why
    pub lost: Vec<(usize, String)>,
    /// points that are seen where the target has none
    pub mistaken: usize,
    /// what the pose of each picture leaves, pixels rms
    pub rough: Vec<f64>,
    /// quaternions whose length is not one
    pub unnormalised: usize,
}

impl Tally {
    /// Says what is suspected.
    ///
    /// # Errors
    /// More pictures without a pose than with one; no rows at all.
    pub fn judge(self, source: &Source, rows: &[Row], warnings: &mut Vec<Warning>) -> Result<()> {
        self.nothing(source, rows)?;
        let subject = source.path.display().to_string();
        let mut warn =
            |kind, message: String| warnings.push(Warning::new(kind, subject.clone(), message));
        if let Some((line, why)) = self.lost.first() {
            warn(
                WarningKind::RowsLeftOut,
                format!(
                    "{} of {} pictures tell no pose and were left out, the first in line {line}: {why}",
                    self.lost.len(),
                    self.lost.len() + rows.len()
                ),
            );
        }
        let rough = median(self.rough.iter().copied());
        if let Some(o) = source.optics
            && rough > ROUGH * o.std
        {
            warn(
                WarningKind::UnitSuspect,
                format!(
                    "poses leave {} pixels of the points, {} are stated: camera or target are not quite those of the pictures, \
                     and what follows from them is worse than it says",
                    number(rough),
                    number(o.std)
                ),
            );
        }
        if self.mistaken > 0 {
            warn(
                WarningKind::RowsLeftOut,
                format!(
                    "{} seen where it has none, by more than five standard deviations: left out",
                    agreeing(
                        self.mistaken,
                        "point of the target is",
                        "points of the target are"
                    )
                ),
            );
        }
        if self.unnormalised > 0 {
            warn(
                WarningKind::UnitSuspect,
                format!(
                    "quaternions of {} of {} rows are not of length one; they were normalised",
                    self.unnormalised,
                    rows.len()
                ),
            );
        }
        if most(rows, |r| r.q.iter().any(|q| q.abs() > TURNS)) {
            warn(
                WarningKind::UnitSuspect,
                format!(
                    "joint readings go beyond {TURNS} rad; are they degrees? They are read as rad"
                ),
            );
        }
        if most(rows, far) {
            warn(
                WarningKind::UnitSuspect,
                "measured lengths are very large; are they millimetres? They are read as m".into(),
            );
        }
        Ok(())
    }

    fn nothing(&self, source: &Source, rows: &[Row]) -> Result<()> {
        if let (true, Some((line, why))) = (self.lost.len() > rows.len(), self.lost.first()) {
            return Err(source.bad(
                *line,
                format!(
                    "{why}; so are {} of {} pictures: are camera, target and the order of its points right?",
                    self.lost.len(),
                    self.lost.len() + rows.len()
                ),
            ));
        }
        if rows.is_empty() {
            let none = "it has a header and no rows under it";
            return Err(Error::file(source.path, "", none));
        }
        Ok(())
    }
}

/// Whether more than half of the rows are so.
fn most(rows: &[Row], so: impl Fn(&Row) -> bool) -> bool {
    2 * rows.iter().filter(|r| so(r)).count() > rows.len()
}

fn far(row: &Row) -> bool {
    match row.value {
        Value::Position(p) => p.norm() > FAR,
        Value::Pose(f) => f.p.norm() > FAR,
        Value::Reading(x) => x.abs() > DEEP,
        Value::Contact => false,
    }
}
