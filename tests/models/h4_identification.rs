//! The figures of `examples/07_h4_identification.rs`: parameters within 2 %, torque within 1 %.

#![allow(dead_code)]

#[path = "../../examples/07_h4_identification.rs"]
mod h4;

#[test]
fn an_h4_comes_back_from_motor_positions_and_noisy_torques() {
    let figures = h4::figures(20).unwrap();
    let known: Vec<_> = figures.parameters.iter().filter(|p| p.std < 2.0).collect();
    assert!(known.len() >= 12, "{} are known to 2 %", known.len());
    let size = known.iter().fold(0.0f64, |m, p| m.max(p.truth.abs()));
    for p in &figures.parameters {
        let off = p.identified - p.truth;
        match p.std < 2.0 {
            true => assert!((off / p.truth).abs() < 0.02, "{}: {off}", p.combination),
            // what is not known is next to nothing, and stays so
            false => assert!(off.abs() < 0.01 * size, "{}: {off}", p.combination),
        }
    }
    let [rods, gravity, lumped] = &figures.errors[..] else {
        panic!("three models");
    };
    assert!(rods.measured < 0.01 && rods.applied < 0.005);
    // what lumping the forearms costs, noise or not
    assert!(
        (0.01..0.05).contains(&gravity.applied),
        "{}",
        gravity.applied
    );
    assert!((0.1..0.5).contains(&lumped.applied), "{}", lumped.applied);
}
