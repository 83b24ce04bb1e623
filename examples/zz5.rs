//! probe
use excite::design::*;
use std::sync::atomic::AtomicBool;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut r = excite::Robot::load(&a[1]).unwrap();
    if a.get(4).is_some_and(|s| s == "terms") {
        r = r.with_terms(&excite::robot::JointTerm::ALL[..3]);
    }
    let mut s = Settings {
        time_limit: a[2].parse().ok(),
        seed: a[3].parse().unwrap(),
        ..Default::default()
    };
    if let Ok(h) = std::env::var("HARM") {
        s.harmonics = h.parse().unwrap();
    }
    if let Ok(h) = std::env::var("STARTS") {
        s.starts = h.parse().ok();
    }
    let d = design(&r, &s, &AtomicBool::new(false), &|p| {
        if std::env::var("V").is_ok() {
            println!("  {:.1}s {} {:.4}", p.seconds, p.starts, p.best)
        }
    })
    .unwrap();
    let t = std::time::Instant::now();
    let q = excite::identifiability::Assessment::new(&d.robot, &d.trajectory).unwrap();
    let e = q.excitation.unwrap();
    println!(
        "{} opt {:.4} {:?} starts {} in {:.2}s; assessed in {:.2}s: {:?} satisfied {} worst {:?}",
        a[1],
        d.value,
        d.record.status,
        d.record.starts.len(),
        d.record.seconds,
        t.elapsed().as_secs_f64(),
        e.condition,
        e.certificate.satisfied,
        e.certificate.worst
    );
}
