//! Layouts that are singular or impossible.

use super::*;

/// An H4 with arms at these azimuths, two on each bar.
fn layout(azimuths: [f64; 4], hinges: [[f64; 2]; 2]) -> Mechanism {
    let mut robot = h4(&reference("h4").0);
    for (i, chain) in robot.chains.iter_mut().enumerate() {
        let azimuth: f64 = azimuths[i].to_radians();
        let out = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
        chain.hinge = i / 2;
        let hinge = Vector3::new(hinges[i / 2][0], hinges[i / 2][1], 0.0);
        chain.motor = out * 0.14
            + if azimuths[i] == 270.0 {
                hinge
            } else {
                Vector3::zeros()
            };
        chain.rotation = motor_frame(azimuth);
        chain.attachment = out * 0.05;
    }
    robot.hinges = hinges.map(|h| Vector3::new(h[0], h[1], 0.0));
    robot.build().unwrap()
}

#[test]
fn singular_layouts_of_the_h4_are_seen_and_the_regular_one_is_not() {
    let across = [[0.06, 0.0], [-0.06, 0.0]];
    let actuation = layout([0.0, 180.0, 90.0, 270.0], across);
    let s = actuation.singularity(&actuation.home).unwrap();
    println!("0/180|90/270: {s:?}");
    assert!(s.actuation.is_singular() && s.actuation.condition() > 1e6);
    assert!(
        actuation
            .warnings
            .iter()
            .any(|w| w.message.contains("actuation Jacobian"))
    );

    let inner = layout([45.0, 135.0, 225.0, 315.0], [[0.0, 0.06], [0.0, -0.06]]);
    let s = inner.singularity(&inner.home).unwrap();
    println!("45/135|225/315: {s:?}");
    assert!(!s.actuation.is_singular());
    assert!(s.constraint.unwrap().is_singular());
    assert!(
        inner
            .warnings
            .iter()
            .any(|w| w.message.contains("constraint block"))
    );

    let regular = layout([0.0, 270.0, 180.0, 270.0], across);
    let s = regular.singularity(&regular.home).unwrap();
    println!("0/270|180/270: {s:?}");
    assert!(
        !s.is_singular() && regular.warnings.is_empty(),
        "{:?}",
        regular.warnings
    );
}

#[test]
fn hexapod_is_singular_at_a_yaw_of_a_right_angle() {
    // similar hexagons, aligned: Fichter's configuration
    let mut robot = hexapod(&reference("sg").0);
    for (i, leg) in robot.legs.iter_mut().enumerate() {
        let angle = (i / 2) as f64 * 2.0944 + if i % 2 == 0 { -0.3 } else { 0.3 };
        let at = Vector3::new(angle.cos(), angle.sin(), 0.0);
        (leg.base, leg.platform) = (at * 0.6, at * 0.35);
    }
    robot.home[5] = std::f64::consts::FRAC_PI_2;
    let m = robot.build().unwrap();
    assert!(
        m.warnings
            .iter()
            .any(|w| w.message.contains("singular at home")),
        "{:?}",
        m.warnings
    );
}

#[test]
fn bad_mechanisms_are_refused_with_the_number_that_shows_it() {
    let said = |e: excite::Result<Mechanism>| e.unwrap_err().to_string();
    let mut five = hexapod(&reference("sg").0);
    five.legs.pop();
    assert!(said(five.build()).contains("this one has 5"));
    let mut sps = hexapod(&reference("sg").0);
    sps.spherical = true;
    assert!(said(sps.build()).contains("axisymmetric"));
    let mut far = delta(&reference("delta").0);
    far.home[2] = -0.9;
    let e = said(far.build());
    assert!(e.contains("does not reach") && e.contains("0.9"), "{e}");
    let m = delta(&reference("delta").0).build().unwrap();
    let e = m.inverse(&[0.0, 0.0, -1.5]).unwrap_err().to_string();
    assert!(e.contains("chain 1 does not reach"), "{e}");
    let four = common::tripod::build(4, 1).unwrap();
    assert!(
        four.warnings
            .iter()
            .any(|w| w.message.contains("4 actuators for 3 freedoms"))
    );
    let e = common::tripod::build(2, 1).unwrap_err().to_string();
    assert!(e.contains("3 freedoms but 2 actuated"), "{e}");
    let m = hexapod(&reference("sg").0).build().unwrap();
    let e = m
        .inverse(&[0.0, 0.0, 0.9, 0.0, 1.56, 0.0])
        .unwrap_err()
        .to_string();
    assert!(e.contains("pitch is 1.560"), "{e}");
}
