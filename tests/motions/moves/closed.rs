//! Moves of parallel robots between their samples.

use excite::dynamics::Samples;
use excite::moves::parts::State;
use excite::moves::{Move, Settings};
use excite::plant::Plant;
use excite::trajectory::parts::{Proof, Space};

/// The rows of a move at a rate.
fn rows(m: &Move, rate: f64) -> Samples {
    let s = m.sample(rate).unwrap();
    Samples {
        dof: s.dof(),
        count: s.len(),
        q: s.q.concat(),
        qd: s.qd.concat(),
        qdd: s.qdd.concat(),
    }
}

/// Nothing between the samples of the planner exceeds what it states, nor the limits: 20 kHz, another grid than its own.
fn check(name: &str, plant: &Plant, m: &Move, share: f64) -> f64 {
    let x = rows(m, 20_000.0);
    let mechanism = plant.mechanism().unwrap();
    let tau = plant.nominal_torque(&x).unwrap();
    let mut largest = 0.0_f64;
    for (a, t) in m.torques.iter().enumerate() {
        let most = tau[a * x.count..(a + 1) * x.count]
            .iter()
            .fold(0.0_f64, |m, t| m.max(t.abs()));
        let bound = t.bound.unwrap();
        assert!(
            most <= bound * (1.0 + 1e-9),
            "{name} {}: {most} {bound}",
            t.joint
        );
        assert!(
            bound <= t.limit.unwrap() * (1.0 + 1e-5),
            "{name} {}",
            t.joint
        );
        largest = largest.max(bound / t.limit.unwrap());
    }
    let closed = m.closed.as_ref().unwrap();
    let moved = match closed.proof {
        Proof::Enclosed => plant.actuator_motion(&x).unwrap(),
        _ => mechanism.platform_motion(&x).unwrap().into_owned(),
    };
    assert_eq!(closed.joints.len(), moved.dof, "{name}");
    for (a, joint) in closed.joints.iter().enumerate() {
        let mut most = [0.0_f64; 3];
        for s in 0..x.count {
            let [q, v, w] = moved.at(a, s);
            let [low, high] = joint.position.bounds;
            assert!(
                q >= low - 1e-12 && q <= high + 1e-12,
                "{name} {}",
                joint.joint
            );
            most[0] = most[0].max(v.abs());
            most[1] = most[1].max(w.abs());
        }
        // the slope of a chord is that of the curve somewhere between its ends
        for s in 1..x.count - 1 {
            most[2] = most[2].max((moved.at(a, s)[2] - moved.at(a, s - 1)[2]).abs() * 20_000.0);
        }
        let peaks = [&joint.velocity, &joint.acceleration, &joint.jerk];
        for (k, (most, peak)) in most.iter().zip(peaks).enumerate() {
            assert!(
                *most <= peak.bound * (1.0 + 1e-6) + 1e-9,
                "{name} {} {k}: {most} {}",
                joint.joint,
                peak.bound
            );
            if let Some(limit) = peak.limit {
                assert!(
                    peak.bound <= share * limit * (1.0 + 1e-5),
                    "{name} {} {k}",
                    joint.joint
                );
                largest = largest.max(peak.bound / limit / share);
            }
        }
        let (lower, upper) = (joint.position.lower.unwrap(), joint.position.upper.unwrap());
        assert!(joint.position.bounds[0] >= lower && joint.position.bounds[1] <= upper);
    }
    let platform = mechanism.platform();
    let poses = mechanism.platform_motion(&x).unwrap();
    let pairs = platform.pairs();
    assert!(!closed.pose.is_empty(), "{name}");
    for s in (0..x.count).step_by(7) {
        let pose: Vec<f64> = (0..poses.dof).map(|k| poses.at(k, s)[0]).collect();
        for (used, peak) in platform.pose_uses(&pose, &pairs).iter().zip(&closed.pose) {
            let off = (used.value - peak.value) * (peak.bound - peak.value).signum();
            assert!(
                off <= (peak.bound - peak.value).abs() + 1e-12,
                "{name} {}",
                peak.name
            );
        }
    }
    largest
}

#[test]
fn parallel_robots_keep_their_limits_between_the_samples_of_a_move() {
    for name in ["hexapod", "delta", "h4"] {
        let of_platform = Plant::load(name).unwrap();
        let of_actuators = of_platform
            .clone()
            .in_space(Some(Space::Actuators))
            .unwrap();
        for (plant, proof) in [
            (of_platform, Proof::Enclosed),
            (of_actuators, Proof::Stated),
        ] {
            let home = plant.home().unwrap().to_vec();
            // of the platform (m) or of the actuators (m or rad), some a little and some not at all
            let step = |k: usize| [0.03, 0.0, -0.02, 0.01, 0.0, 0.02][k % 6];
            let to: Vec<f64> = home.iter().enumerate().map(|(k, q)| q + step(k)).collect();
            for share in [0.2, 1.0] {
                let settings = Settings::default().with(|set| set.scale = share);
                let (from, to) = (State::rest(&home), State::rest(&to));
                let m = Move::plan(&plant, &from, &to, &settings, None).unwrap();
                assert_eq!(m.closed.as_ref().unwrap().proof, proof, "{name}");
                let used = check(name, &plant, &m, share);
                // no slower than some limit asks for
                let own = m.joints.iter().flat_map(|j| j.used).fold(0.0, f64::max) / share;
                assert!(used.max(own) > 0.9, "{name} {used} {own}");
            }
        }
    }
}

/// A drive that may change its acceleration slowly only makes the move slower, by the cube root of its share.
#[test]
fn the_jerk_of_an_actuator_that_is_no_coordinate_slows_a_move_down() {
    let plan = |jerk: f64| {
        let plant = Plant::load("delta").unwrap();
        let mut mechanism = plant.mechanism().unwrap().clone();
        let drives = mechanism.actuated.clone();
        for a in drives {
            mechanism.robot.joints[a].limits.jerk = jerk;
        }
        let plant = Plant::from(mechanism);
        let home = plant.home().unwrap().to_vec();
        let mut to = home.clone();
        to[0] += 0.05;
        let (from, to) = (State::rest(&home), State::rest(&to));
        Move::plan(&plant, &from, &to, &Settings::default(), None).unwrap()
    };
    let free = plan(f64::INFINITY);
    let peak = |m: &Move| {
        let joints = m.closed.as_ref().unwrap().joints.iter();
        joints.map(|j| j.jerk.bound).fold(0.0, f64::max)
    };
    let slow = plan(peak(&free));
    let ratio = slow.duration / free.duration;
    let right = 5.0_f64.cbrt();
    assert!(
        ratio >= 0.999 * right && ratio < 1.03 * right,
        "{ratio} {right}"
    );
    assert!(peak(&slow) <= 0.2 * peak(&free) * (1.0 + 1e-5));
}
