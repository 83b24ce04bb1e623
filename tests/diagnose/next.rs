//! The next motion: what two effects, or an effect and the nominal model, have in common in the records
//! at hand, in the proposed motion as predicted, and once that motion is rehearsed.
//!
//! `cargo test --release --test diagnose next -- --nocapture` prints the table of `docs/diagnosis.md`.

use crate::common::rehearse::{self, log, within, without_commands};
use excite::diagnose::next::{NOMINAL, Proposal};
use excite::diagnose::{Diagnosis, Settings, json, of_logs, page};
use excite::identifiability::assess;
use excite::log::Record;
use excite::plant::Plant;
use excite::simulate::Effects;
use excite::simulate::parts::Field;
use excite::trajectory::{Fourier, Trajectory};

/// A robot, what it has that its model lacks, and the records of a designed motion.
struct Case {
    plant: Plant,
    effects: Effects,
    noise: f64,
    logs: Vec<Record>,
}

impl Case {
    /// `slower`: factor on the period; `only`: the one coordinate that moves.
    fn new(
        robot: &str,
        effect: Option<(Field, &str)>,
        noise: f64,
        slower: f64,
        only: Option<usize>,
    ) -> Self {
        let plant = Plant::load(robot).unwrap();
        let mut motion = rehearse::motion(robot);
        for (k, s) in motion.joints.iter_mut().enumerate() {
            if only.is_some_and(|o| o != k) {
                s.sin.iter_mut().chain(&mut s.cos).for_each(|v| *v = 0.0);
            }
        }
        let at = |factor: f64| within(&motion, 5.0 * slower * factor);
        let mut effects = Effects::default().with(|set| set.perturb = 0.03);
        if let Some((field, text)) = effect {
            effects.set(&plant, field, text).unwrap();
        }
        let mut case = Case {
            plant,
            effects,
            noise,
            logs: Vec::new(),
        };
        case.record(&at(1.0), true);
        case.record(&at(1.3), false);
        case
    }

    /// Simulates the robot along a motion, once, and adds its log to the records.
    fn record(&mut self, motion: &Fourier, fit: bool) {
        let settings = rehearse::simulation(self.effects.clone());
        let seed = (10.0 * motion.period) as u64;
        let seen = log(&self.plant, motion, fit, &settings, self.noise, seed);
        self.logs.push(without_commands(seen));
    }

    fn diagnose(&self, next: bool, tries: usize) -> Diagnosis {
        let settings = Settings::default().with(|set| {
            set.next = next;
            set.next_tries = tries;
        });
        of_logs(&self.plant, &self.logs, &settings, &|_| {}).unwrap()
    }

    /// The proposal, checked: inside all limits, read back, and in file and report.
    fn propose(&self) -> (Diagnosis, Proposal) {
        let begin = std::time::Instant::now();
        // a third of the usual number is enough for what is asked here
        let d = self.diagnose(true, Settings::default().next_tries / 3);
        let name = self.plant.name();
        let Some(n) = d.next.clone() else {
            panic!("{name}: no proposal");
        };
        println!(
            "{name:8} {} against {}: overlap {:.3} now, {:.3} predicted, period {:.1} s ({:.0} s)",
            n.separates[0],
            n.separates[1],
            n.overlap[0],
            n.overlap[1],
            n.trajectory.fourier.period,
            begin.elapsed().as_secs_f64()
        );
        assert!(n.overlap[1] < 0.95 * n.overlap[0], "{:?}", n.overlap);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("next.json");
        n.trajectory.write(&path, false).unwrap();
        let back = Trajectory::read(&path).unwrap();
        assert_eq!(back, n.trajectory);
        let seen = assess(&self.plant, Some(&back)).unwrap();
        let excitation = seen.excitation.unwrap();
        assert!(excitation.certificate.satisfied);
        if let Some(m) = self.plant.mechanism() {
            assert!(m.certify(&back.fourier, 1.0).unwrap().satisfied);
        }
        let file = json::json(&d, 1.0);
        assert_eq!(file["next_experiment"]["trajectory"], "next.json");
        assert!(page::html(&d).contains("next.json"));
        (d, n)
    }

    /// Diagnosis with the proposed motion rehearsed and added to the records.
    fn rehearsed(&mut self, next: &Proposal) -> Diagnosis {
        self.record(&next.trajectory.fourier, true);
        self.diagnose(false, 0)
    }
}

/// Confidence of an effect.
fn confidence(d: &Diagnosis, effect: &str) -> f64 {
    let of = d.findings.iter().filter(|f| f.effect == effect);
    of.map(|f| f.confidence).fold(0.0, f64::max)
}

/// How sure the first effect of a proposal is, and the second, before and after.
fn told(before: &Diagnosis, after: &Diagnosis, n: &Proposal) -> [[f64; 2]; 2] {
    let each = |d: &Diagnosis| [0, 1].map(|i| confidence(d, n.separates[i]));
    let all = [each(before), each(after)];
    println!(
        "         confidence {:.2?}, rehearsed {:.2?}",
        all[0], all[1]
    );
    all
}

#[test]
fn stribeck_and_viscous_friction_of_a_hexapod_are_told_apart() {
    // what more of it, and less noise, show without another motion
    let named = |text: &str| {
        let effect = Some((Field::Stribeck, text));
        let d = Case::new("hexapod", effect, 1.0, 0.4, None).diagnose(false, 0);
        let claims: Vec<_> = (d.findings.iter())
            .filter(|f| f.is_claim())
            .map(|f| (f.effect, f.joints[0].clone(), f.confidence > 0.8))
            .collect();
        assert_eq!(claims, [("stribeck_friction", "leg2".into(), true)]);
    };
    named("leg2=60,0.18");
    named("leg2=40,0.18");
    let effect = Some((Field::Stribeck, "leg2=30,0.15"));
    let mut case = Case::new("hexapod", effect, 1.5, 0.4, None);
    let (before, n) = case.propose();
    assert_eq!(
        n.separates,
        ["stribeck_friction", "nonlinear_viscous_friction"]
    );
    assert!(n.overlap[1] < 0.6 * n.overlap[0], "{:?}", n.overlap);
    let after = case.rehearsed(&n);
    let [[a, b], [later, rival]] = told(&before, &after, &n);
    assert!(later > a && rival < 0.5 * b, "{a} {b} {later} {rival}");
}

#[test]
fn what_the_records_of_an_arm_cannot_show_is_shown() {
    let mut case = Case::new("scara", None, 1.0, 1.0, Some(1));
    let (before, n) = case.propose();
    assert_eq!(n.separates[1], NOMINAL);
    let hidden = |d: &Diagnosis| {
        d.untestable
            .iter()
            .filter(|u| u.0 == n.separates[0])
            .count()
    };
    let after = case.rehearsed(&n);
    println!(
        "         untestable at {} places, then {}",
        hidden(&before),
        hidden(&after)
    );
    assert!(hidden(&after) < hidden(&before));
}

#[test]
fn the_same_seed_gives_the_same_motion_on_any_number_of_threads() {
    let case = Case::new("planar2", None, 1.0, 1.0, Some(1));
    let motion = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        let d = pool.install(|| case.diagnose(true, 8));
        d.next.map(|n| n.trajectory)
    };
    let one = motion(1);
    assert!(one.is_some());
    assert_eq!(one, motion(3));
}
