//! What the report before the run states of the platform, the legs and the friction, with and without breakaway friction.

use excite::Plant;
use excite::design::parts::Question;
use excite::identifiability::assess;
use excite::identifiability::parts::Answer;
use excite::mechanism::{Mechanism, bundled};
use excite::regressor::term_factor;
use excite::robot::parts::JointTerm;
use excite::trajectory::parts::Series;
use excite::trajectory::{Fourier, Trajectory, sample_period};
use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;

const FORCE: f64 = 15.0;
const SPEED: f64 = 0.03;

/// The bundled hexapod with breakaway friction of leg 1, which its file says `identify` estimates.
fn plant(force: f64, speed: f64, stated: bool) -> Plant {
    let text = bundled::find("hexapod").unwrap().toml;
    let text = match stated {
        true => text
            .replace(
                "coulomb = 25.0\n",
                &format!("coulomb = 25.0\nstribeck = {force:?}\nstribeck_velocity = {speed:?}\n"),
            )
            .replace(
                "identify = [\"viscous\", \"coulomb\"]",
                "identify = [\"viscous\", \"coulomb\", \"stribeck\"]",
            ),
        false => text.to_string(),
    };
    Plant::from(Mechanism::from_toml_str(&text, "hexapod").unwrap())
}

fn trajectory(plant: &Plant, question: Question) -> Trajectory {
    let home = plant.home().unwrap();
    let series: Vec<Series> = home
        .iter()
        .enumerate()
        .map(|(k, c)| {
            let size = if k < 3 { 0.02 } else { 0.06 };
            let of = |h: usize| size * ((1 + k * 3 + h * 5) as f64).sin() / (h + 1) as f64;
            Series {
                constant: *c,
                sin: (0..6).map(of).collect(),
                cos: (0..6).map(|h| of(h + 7)).collect(),
            }
        })
        .collect();
    let fourier = Fourier::new(10.0, (1..=6).collect(), series).unwrap();
    Trajectory {
        space: plant.space(),
        periods: 3,
        settings: serde_json::to_value(question.settings()).unwrap(),
        ..Trajectory::new(plant.moved(), fourier)
    }
}

fn std(a: &Answer, name: &str) -> f64 {
    let found = a.expected.iter().find(|e| e.name == name);
    found.unwrap_or_else(|| panic!("{name}")).std.unwrap()
}

/// Standard deviations by least squares whose columns of breakaway friction are differences of the nominal torque.
#[test]
fn they_are_those_of_the_whole_system() {
    for stated in [true, false] {
        let plant = self::plant(FORCE, SPEED, stated);
        let t = trajectory(&plant, Question::Platform);
        let motion = sample_period(&t.fourier);
        let moved = plant.actuator_motion(&motion).unwrap();
        let noise = plant.torque_noise().0;
        let (na, n) = (noise.len(), motion.count);
        let ten = plant.body_columns(plant.tool().unwrap(), &motion).unwrap();
        let torque = |force: f64, speed: f64| {
            let plant = self::plant(force, speed, true);
            plant.nominal_torque(&motion).unwrap()
        };
        let (df, dv) = (1e-3, 1e-6);
        let force = (
            torque(FORCE + df, SPEED),
            torque(FORCE - df, SPEED),
            2.0 * df,
        );
        let speed = (
            torque(FORCE, SPEED + dv),
            torque(FORCE, SPEED - dv),
            2.0 * dv,
        );
        let columns = 10 + 3 * na + if stated { 2 * na } else { 0 };
        let a = Mat::from_fn(na * n, columns, |i, c| {
            let (j, s) = (i / n, i % n);
            let value = match c.checked_sub(10) {
                None => ten[(i, c)],
                Some(d) if d % na != j => 0.0,
                Some(d) => match d / na {
                    0 => term_factor(JointTerm::Coulomb, moved.at(j, s)),
                    1 => term_factor(JointTerm::Viscous, moved.at(j, s)),
                    2 => 1.0,
                    k => {
                        let (up, down, step) = if k == 3 { &force } else { &speed };
                        (up[i] - down[i]) / step
                    }
                },
            };
            value * f64::from(t.periods).sqrt() / noise[j]
        });
        let scale: Vec<f64> = (0..columns).map(|c| a.col(c).norm_l2()).collect();
        let unit = Mat::from_fn(na * n, columns, |i, c| a[(i, c)] / scale[c]);
        let inverse = (unit.transpose() * &unit).partial_piv_lu().inverse();
        let own = plant.robot().bodies[plant.tool().unwrap()].inertia;
        let slopes = own.quantity_slopes();
        let whole = assess(&plant, Some(&t)).unwrap().answer.unwrap();
        assert_eq!(whole.expected.len(), 10);
        for (q, e) in whole.expected.iter().enumerate() {
            let mut variance = 0.0;
            for i in 0..10 {
                for k in 0..10 {
                    variance +=
                        slopes[q][i] * slopes[q][k] * inverse[(i, k)] / (scale[i] * scale[k]);
                }
            }
            let ratio = e.std.unwrap() / variance.sqrt();
            assert!((ratio - 1.0).abs() < 1e-4, "{}: {ratio}", e.name);
        }
    }
}

/// What breakaway friction costs the friction beside it is counted, and its own force and speed are stated.
#[test]
fn breakaway_friction_is_counted() {
    let (with, without) = (plant(FORCE, SPEED, true), plant(FORCE, SPEED, false));
    let t = trajectory(&with, Question::Friction);
    let of = |p: &Plant| assess(p, Some(&t)).unwrap();
    let (a, b) = (of(&with), of(&without));
    let (with, without) = (a.answer.clone().unwrap(), b.answer.clone().unwrap());
    assert!(std(&with, "leg1.coulomb") > 1.3 * std(&without, "leg1.coulomb"));
    assert!(std(&with, "leg1.stribeck") > 0.0);
    assert!(std(&with, "leg1.stribeck_velocity") > 0.0);
    assert!(!without.expected.iter().any(|e| e.name.contains("stribeck")));
    // so do the predictions of all base parameters
    let predicted = |a: &excite::identifiability::Assessment| {
        let all = &a.excitation.as_ref().unwrap().predictions;
        all.iter()
            .find(|p| p.parameter == "leg1.coulomb")
            .unwrap()
            .std
    };
    assert!(predicted(&a) > 1.3 * predicted(&b));
}

/// A motion at which the peak is never passed tells neither its force nor its speed, and the report says so.
#[test]
fn a_peak_that_the_motion_does_not_show_is_not_determined() {
    let plant = self::plant(FORCE, 1e-7, true);
    let t = trajectory(&plant, Question::Friction);
    let found = assess(&plant, Some(&t)).unwrap().answer.unwrap();
    let own = |name: &str| found.expected.iter().find(|e| e.name == name).unwrap().std;
    assert_eq!(own("leg1.stribeck"), None);
    assert_eq!(own("leg1.stribeck_velocity"), None);
    assert!(own("leg1.coulomb").is_some());
}

#[test]
fn legs_have_their_own_table() {
    let plant = Plant::load("hexapod").unwrap().without_collisions();
    let mut t = trajectory(&plant, Question::Legs);
    let asked = Question::Legs.check(&plant).is_ok();
    let found = assess(&plant, Some(&t)).unwrap().answer;
    assert_eq!(found.is_some(), asked);
    if let Some(found) = found {
        assert!(!found.expected.is_empty());
        assert!(
            found
                .expected
                .iter()
                .all(|e| !e.name.starts_with("platform"))
        );
    }
    // a load takes two records: its table is another
    t.settings = serde_json::to_value(Question::Load.settings()).unwrap();
    let a = assess(&plant, Some(&t)).unwrap();
    assert!(a.answer.is_none() && a.load.is_some());
}
