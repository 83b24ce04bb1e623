//! Units of columns.

use std::f64::consts::PI;

/// Units with the factor that makes them SI.
const UNITS: [(&str, f64); 26] = [
    ("s", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("ns", 1e-9),
    ("rad", 1.0),
    ("deg", PI / 180.0),
    ("rev", 2.0 * PI),
    ("m", 1.0),
    ("mm", 1e-3),
    ("rad/s", 1.0),
    ("deg/s", PI / 180.0),
    ("rpm", 2.0 * PI / 60.0),
    ("rev/s", 2.0 * PI),
    ("m/s", 1.0),
    ("mm/s", 1e-3),
    ("rad/s^2", 1.0),
    ("deg/s^2", PI / 180.0),
    ("m/s^2", 1.0),
    ("N m", 1.0),
    ("Nm", 1.0),
    ("mNm", 1e-3),
    ("N", 1.0),
    ("A", 1.0),
    ("mA", 1e-3),
    ("counts", 1.0),
    ("min", 60.0),
];

/// Factor of a unit, and its name as we write it.
pub(crate) fn unit(text: &str) -> Option<(&'static str, f64)> {
    let same = |a: &str| match a.trim() {
        "radian" | "radians" => "rad",
        "degree" | "degrees" | "°" | "Grad" => "deg",
        "µs" | "usec" => "us",
        "msec" => "ms",
        "nsec" => "ns",
        "sec" | "seconds" => "s",
        "N·m" | "N*m" | "N-m" | "N.m" | "nm" | "NM" => "N m",
        "ma" => "mA",
        "1/min" | "U/min" => "rpm",
        "°/s" | "Grad/s" => "deg/s",
        "a" | "amp" | "amps" => "A",
        "count" | "ticks" => "counts",
        _ => "",
    };
    let text = match same(text) {
        "" => text.trim(),
        known => known,
    };
    UNITS.into_iter().find(|(name, _)| *name == text)
}
