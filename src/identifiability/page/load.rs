//! How well the motion will tell a load.

use crate::identifiability::{GAIN, LoadAccuracy};
use crate::report::format::{significant, with_unit};
use crate::report::html::Section;
use maud::html;

/// Names of the quantities, with their factor and unit.
const QUANTITIES: [(&str, f64, &str); 10] = [
    ("mass", 1.0, "kg"),
    ("centre of mass x", 1e3, "mm"),
    ("centre of mass y", 1e3, "mm"),
    ("centre of mass z", 1e3, "mm"),
    ("tensor xx", 1.0, "kg m²"),
    ("tensor xy", 1.0, "kg m²"),
    ("tensor xz", 1.0, "kg m²"),
    ("tensor yy", 1.0, "kg m²"),
    ("tensor yz", 1.0, "kg m²"),
    ("tensor zz", 1.0, "kg m²"),
];

/// Table of the quantities.
pub(super) fn section(l: &LoadAccuracy) -> Section {
    let of = |x: Option<f64>, factor: f64| match x {
        Some(x) => significant(1.96 * factor * x, 2),
        None => "not determined".into(),
    };
    let body = html! {
        p {
            "Expected for two records of " (with_unit(l.seconds, 3, "s")) " of this motion, empty and loaded, evaluated with "
            code { "excite load" } ". The load is "
            @if l.named { "the one that was named" } @else { "an ordinary one, since none was named (" code { "--payload" } ")" }
            ", in the frame of " (l.body) ". ± is the 95\u{a0}% interval at the torque noise of the robot file, white; friction of "
            "every drive is estimated along in each record."
        }
        @if let Some(why) = &l.broken {
            p { strong { "With the load the motion does not keep its limits: " (why) "." } }
        }
        table {
            thead { tr {
                th { "quantity" } th.n { "value" } th.n { "±, constants of the drives shared" } th.n { "±, constants free" }
                th.n { "± by gains that are off by " (significant(100.0 * GAIN, 1)) "\u{a0}% each" } th { "unit" }
            } }
            tbody {
                @for (k, (name, factor, unit)) in QUANTITIES.iter().enumerate() {
                    tr {
                        td { (name) }
                        td.n { (significant(factor * l.payload[k], 4)) }
                        td.n { (of(l.shared[k], *factor)) }
                        td.n { (of(l.free[k], *factor)) }
                        td.n { (of(l.gains[k], *factor)) }
                        td { (unit) }
                    }
                }
            }
        }
        p {
            "Constants of the drives count as shared where the records show that they did not move. Gains of the drives are in no "
            "±: only a record with a known load tells them."
        }
    };
    Section::new("What this motion tells of a load", body)
}
