//! Logs that are read in parts.

use excite::Plant;
use excite::log::Record;
use excite::log::parts::Purpose;
use std::path::Path;

/// The parts of a log for the fit, `rows` rows each.
pub fn read(path: &Path, plant: &Plant, rows: usize) -> Vec<Record> {
    let mut parts = Vec::new();
    Record::read_parts(path, plant, Purpose::Fit, None, rows, &mut |part| {
        parts.push(part);
        Ok(())
    })
    .unwrap();
    parts
}

/// Whether the parts one after another hold the positions and torques of the whole log, bit for bit.
pub fn hold(parts: &[Record], whole: &Record, what: &str) {
    for j in 0..whole.actuators() {
        let channel = |of: fn(&Record) -> &Vec<Vec<f64>>| -> Vec<f64> {
            parts.iter().flat_map(|p| of(p)[j].clone()).collect()
        };
        assert_eq!(channel(|r| &r.q), whole.q[j], "{what}");
        assert_eq!(channel(|r| &r.tau), whole.tau[j], "{what}");
    }
}
