//! What an identification cannot know, and says.

use super::*;

#[test]
fn bodies_stay_possible_when_the_data_are_poor() {
    let (plant, phi) = truth("panda", 4);
    let run = Run {
        noise: 20.0,
        periods: 1,
        rate: 100.0,
        rates: true,
        ..Run::default()
    };
    let r = record(&plant, &phi, Purpose::Fit, &run);
    for consistency in [Consistency::Entropic, Consistency::Lmi] {
        let settings = Settings::default().with(|set| {
            set.consistency = consistency;
            set.prior_strength = Some(1.0);
        });
        let id = identify(&plant, std::slice::from_ref(&r), &settings).unwrap();
        assert!(id.consistent, "{consistency:?} {:?}", id.margin);
        let robot = plant.with_values(&id.phi);
        for b in &robot.bodies {
            let (smallest, violated) = b.inertia.realizability();
            assert!(
                smallest > 0.0 && violated < 1e-9,
                "{}: {smallest} {violated}",
                b.name
            );
        }
        for j in &robot.joints {
            assert!(
                j.terms[..3].iter().all(|x| *x >= -1e-9),
                "{}: {:?}",
                j.name,
                j.terms
            );
        }
    }
    let free = Settings::default().with(|set| set.consistency = Consistency::Free);
    assert!(
        !identify(&plant, &[r], &free).unwrap().consistent,
        "this noise makes impossible bodies"
    );
}

#[test]
fn what_the_motion_does_not_show_is_named() {
    let (plant, phi) = truth("planar2", 4);
    let mut r = record(
        &plant,
        &phi,
        Purpose::Fit,
        &Run {
            rates: true,
            periods: 1,
            ..Run::default()
        },
    );
    r.period = None;
    // joint 1 stands still: its armature, viscous and Coulomb friction have no effect
    let n = r.len();
    r.q[0] = vec![0.3; n];
    r.dq.as_mut().unwrap()[0] = vec![0.0; n];
    r.ddq.as_mut().unwrap()[0] = vec![0.0; n];
    let x = excite::dynamics::Samples {
        dof: 2,
        count: n,
        q: r.q.concat(),
        qd: r.dq.as_ref().unwrap().concat(),
        qdd: r.ddq.as_ref().unwrap().concat(),
    };
    let tau = plant.torque(&x, &phi).unwrap();
    r.tau = tau.chunks_exact(n).map(<[f64]>::to_vec).collect();
    let id = identify(
        &plant,
        &[r],
        &Settings::default().with(|set| set.prior_strength = Some(1.0)),
    )
    .unwrap();
    let text: Vec<String> = id.warnings.iter().map(ToString::to_string).collect();
    let name = format!("{}.viscous", plant.robot().joints[0].name);
    assert!(
        text.iter()
            .any(|t| t.contains("says nothing") && t.contains(&name)),
        "{text:#?}"
    );
    assert!(id.phi.iter().all(|x| x.is_finite()) && id.consistent);
}

/// A joint that is held by its friction for half of the record, its encoder trembling, does not spoil the fit.
#[test]
fn standstill_is_left_out() {
    let (plant, phi) = truth("planar2", 4);
    let mut run = record(&plant, &phi, Purpose::Fit, &Run::default());
    run.period = None;
    let n = run.len();
    // the first joint runs through its motion, then stays where that began; the second goes on
    let half = n / 2;
    let fifth = run.q[0][0];
    let blend = |i: usize| {
        let x = ((i as f64 - half as f64) / 200.0).clamp(0.0, 1.0);
        1.0 - x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
    };
    run.q[0] = (0..n)
        .map(|i| fifth + (run.q[0][i] - fifth) * blend(i))
        .collect();
    let exact: Vec<Vec<f64>> = run.q.clone();
    let rates = |q: &[f64]| -> Vec<f64> {
        let at = |i: usize, d: isize| q[(i as isize + d).clamp(0, n as isize - 1) as usize];
        (0..n)
            .map(|i| (at(i, 1) - at(i, -1)) / (2.0 * run.step))
            .collect()
    };
    let qd: Vec<Vec<f64>> = exact.iter().map(|q| rates(q)).collect();
    let x = excite::dynamics::Samples {
        dof: 2,
        count: n,
        qdd: qd.iter().flat_map(|v| rates(v)).collect(),
        qd: qd.concat(),
        q: exact.concat(),
    };
    let tau = plant.torque(&x, &phi).unwrap();
    run.tau = tau.chunks_exact(n).map(<[f64]>::to_vec).collect();
    let index = |name: &str| {
        plant
            .parameters()
            .iter()
            .position(|p| p.name == name)
            .unwrap()
    };
    let joint = plant.robot().joints[0].name.clone();
    let coulomb = phi[index(&format!("{joint}.coulomb"))];
    for i in half + 200..n {
        // at rest friction holds most of what it can
        run.tau[0][i] += 0.9 * coulomb;
    }
    let r = &mut rng(8);
    for q in run.q.iter_mut().flatten() {
        *q += 2e-6 * normal(r);
    }
    let settings = Settings::default().with(|set| set.prior_strength = Some(1e-2));
    let id = identify(&plant, &[run], &settings).unwrap();
    let told: Vec<String> = id.warnings.iter().map(ToString::to_string).collect();
    assert!(
        told.iter()
            .any(|t| t.contains("standstill") && t.contains(&joint)),
        "{told:#?}"
    );
    let exact = id.base.project(&phi);
    for (k, (a, b)) in exact.iter().zip(&id.pi).enumerate() {
        let name = id.base.name(k);
        println!("{name}: {a:.4} {b:.4}");
        if name == format!("{joint}.offset") || name == format!("{joint}.coulomb") {
            assert!((a - b).abs() < 0.05 * coulomb, "{name}: {a} {b}");
        }
    }
}

#[test]
fn torques_in_other_units_are_suspected() {
    let (plant, phi) = truth("planar2", 4);
    let mut r = record(&plant, &phi, Purpose::Fit, &Run::default());
    r.tau[1].iter_mut().for_each(|x| *x *= -1.0);
    r.tau[0].iter_mut().for_each(|x| *x *= 0.01);
    let id = identify(&plant, &[r], &Settings::default()).unwrap();
    let text: Vec<String> = id.warnings.iter().map(ToString::to_string).collect();
    assert!(text.iter().any(|t| t.contains("opposite")), "{text:#?}");
    assert!(
        text.iter().any(|t| t.contains("times the model's")),
        "{text:#?}"
    );
}
