//! Parallel robots rehearsed and diagnosed: the simulated robot has what the model lacks.
//!
//! `cargo test --release --test diagnose parallel -- --nocapture` prints the table of
//! `docs/diagnosis.md`.

use crate::common::rehearse::{self, log, within, without_commands};
use excite::diagnose::{Diagnosis, Settings, of_logs};
use excite::log::Record;
use excite::mechanism::bundled;
use excite::plant::Plant;
use excite::robot::Inertia;
use excite::simulate::Effects;
use excite::simulate::effects::parse_payload;
use excite::simulate::parts::Field;
use excite::trajectory::Fourier;

/// A robot and a motion for it.
struct Rehearsal {
    /// its robot.toml
    text: String,
    motion: Fourier,
    /// of what the file states
    noise: f64,
}

fn plant(text: &str) -> Plant {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.toml");
    std::fs::write(&path, text).unwrap();
    Plant::load(path.to_str().unwrap()).unwrap()
}

impl Rehearsal {
    fn new(name: &str) -> Self {
        Rehearsal {
            text: bundled::find(name).unwrap().toml.into(),
            motion: rehearse::motion(name),
            noise: 1.0,
        }
    }

    /// Logs of the robot `text` at three speeds, ordinary errors of 3 % included; the last is not
    /// fitted to.
    fn logs(&self, robot: &Plant, effects: Effects) -> Vec<Record> {
        let speeds = [(5.0, true), (9.0, true), (6.5, false)];
        let settings = rehearse::simulation(effects.with(|set| set.perturb = 0.03));
        let one = |(period, fit): (f64, bool)| {
            let (motion, seed) = (within(&self.motion, period), (10.0 * period) as u64);
            without_commands(log(robot, &motion, fit, &settings, self.noise, seed))
        };
        speeds.map(one).into()
    }

    /// Diagnosis by the model `model` of the robot `real`.
    fn diagnose(&self, what: &str, real: &str, model: &str, effects: Effects) -> Diagnosis {
        let (real, model) = (plant(real), plant(model));
        let settings = Settings::default().with(|set| set.next = false);
        let d = of_logs(&model, &self.logs(&real, effects), &settings, &|_| {}).unwrap();
        let first = d.findings.first();
        println!(
            "{:8} {what:24} {:?}: {} {:.2} explains {:.2} holdout {:.2}",
            model.name(),
            d.verdict,
            first.map_or("-", |f| f.effect),
            first.map_or(0.0, |f| f.confidence),
            first.map_or(0.0, |f| f.explains),
            first.and_then(|f| f.holdout).unwrap_or(0.0),
        );
        d
    }

    /// The model as it is, of a robot with an effect.
    fn of(&self, what: &str, effects: Effects) -> Diagnosis {
        self.diagnose(what, &self.text, &self.text, effects)
    }

    /// Of a robot whose passive joints rub.
    fn passive(&self, joints: &[String], coulomb: f64, viscous: f64) -> Diagnosis {
        let mut real = self.text.clone();
        for name in joints {
            real.push_str(&format!(
                "\n[[joint]]\nname = \"{name}\"\ncoulomb = {coulomb}\nviscous = {viscous}\n"
            ));
        }
        self.diagnose(
            "passive_joint_friction",
            &real,
            &self.text,
            Effects::default(),
        )
    }

    /// By a model whose legs (rods) have no mass.
    fn massless(&self) -> Diagnosis {
        let line = |line: &str| match line {
            l if l.starts_with("rod = ") && self.text.contains("cylinder") => String::new(),
            l if l.starts_with("cylinder = ") => String::new(),
            l if l.starts_with("rod = ") => {
                "rod = { mass = 0.0, com = [0.0, 0.0, 0.0], inertia = [0.0, 0.0, 0.0] }".into()
            }
            l if l.starts_with("bodies = ") => "bodies = \"platform\"".into(),
            l => l.to_string(),
        };
        let model: Vec<String> = self.text.lines().map(line).collect();
        self.diagnose(
            "leg_inertia",
            &self.text,
            &model.join("\n"),
            Effects::default(),
        )
    }
}

fn claims(d: &Diagnosis) -> Vec<&'static str> {
    let claimed = d.findings.iter().filter(|f| f.confidence >= 0.5);
    claimed.map(|f| f.effect).collect()
}

fn first(d: &Diagnosis) -> Option<&'static str> {
    claims(d).first().copied()
}

fn rods(chains: usize) -> Vec<String> {
    (1..=chains)
        .flat_map(|k| ["a", "b"].map(|side| format!("rod{k}{side}")))
        .flat_map(|rod| ["gamma", "beta"].map(|angle| format!("{rod}_{angle}")))
        .collect()
}

fn load(text: &str) -> Option<Inertia> {
    Some(parse_payload(text).unwrap())
}

fn drive(robot: &str, field: Field, text: &str) -> Effects {
    let mut effects = Effects::default();
    let plant = Plant::load(robot).unwrap();
    effects.set(&plant, field, text).unwrap();
    effects
}

#[test]
fn a_delta_is_diagnosed() {
    let mut r = Rehearsal::new("delta");
    let clean = r.of("none", Effects::default());
    assert!(claims(&clean).is_empty(), "{:?}", claims(&clean));
    // effects that are a small part of the whole show where the noise is low
    r.noise = 0.4;
    let friction = r.passive(&rods(3), 0.1, 0.02);
    assert_eq!(first(&friction), Some("passive_joint_friction"));
    let legs = r.massless();
    assert_eq!(first(&legs), Some("leg_inertia"));
    // what the effect adds makes the simulated robot follow the log more closely
    let f = &legs.forward.records[0];
    let total = |m: usize| -> f64 { f.rms[m].as_ref().unwrap().iter().sum() };
    assert!(total(2) < 0.5 * total(1), "{} {}", total(1), total(2));
    let stribeck = r.of(
        "stribeck_friction",
        drive("delta", Field::Stribeck, "motor2=0.3,0.3"),
    );
    assert_eq!(first(&stribeck), Some("stribeck_friction"));
}

#[test]
fn a_load_on_a_known_delta_is_a_payload() {
    let mut r = Rehearsal::new("delta");
    r.text = format!("prior = \"identified\"\n{}", r.text);
    let effects = Effects::default().with(|set| set.payload = load("0.5,0.0,0.01,0.02"));
    let d = r.of("payload", effects);
    assert_eq!(first(&d), Some("payload"), "{:?}", claims(&d));
    let mass = d.findings[0].values.iter().find(|v| v.name == "mass");
    let mass = mass.unwrap().value;
    assert!((mass - 0.5).abs() < 0.1, "{mass} kg");
}

#[test]
fn an_h4_is_diagnosed() {
    let r = Rehearsal::new("h4");
    let clean = r.of("none", Effects::default());
    assert!(claims(&clean).is_empty(), "{:?}", claims(&clean));
    let friction = r.passive(&rods(4), 0.02, 0.005);
    assert_eq!(first(&friction), Some("passive_joint_friction"));
}

#[test]
fn a_hexapod_is_diagnosed() {
    let mut r = Rehearsal::new("hexapod");
    let clean = r.of("none", Effects::default());
    assert!(claims(&clean).is_empty(), "{:?}", claims(&clean));
    let joints: Vec<String> = (1..=6)
        .flat_map(|k| ["alpha", "beta"].map(|angle| format!("leg{k}_{angle}")))
        .collect();
    let friction = r.passive(&joints, 1.0, 0.5);
    assert_eq!(first(&friction), Some("passive_joint_friction"));
    // legs are a small part of the whole
    r.noise = 0.4;
    let legs = r.massless();
    assert_eq!(first(&legs), Some("leg_inertia"));
}
