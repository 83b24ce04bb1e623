//! The diagnosis of poses on effects that are withheld from it. The robots are put together here from a table of
//! Denavit and Hartenberg and from plain vectors: nothing of the library's kinematics or dynamics is used to make the rows.

mod made;

use excite::calibrate::gap::PoseDiagnosis;
use made::Withheld::{self, *};
use made::{arm, hexapod};

/// Effects that are claimed, with their places.
fn claims(d: &PoseDiagnosis) -> Vec<(String, Vec<String>)> {
    let own = d.found.findings.iter().filter(|f| f.confidence >= 0.5);
    own.map(|f| (f.effect.to_string(), f.places.clone()))
        .collect()
}

/// Named, at its place alone, and nothing else; and the gap on rows held out is gone.
fn named(d: &PoseDiagnosis, effect: &str, places: &[&str]) -> bool {
    let all = claims(d);
    let right = |(e, p): &(String, Vec<String>)| {
        e == effect && p.len() == 1 && places.contains(&p[0].as_str())
    };
    println!(
        "  {} {all:?}, held out {:?}",
        d.found.verdict, d.found.holdout
    );
    all.len() == 1
        && right(&all[0])
        && d.found.verdict == "explained"
        && d.found.holdout.is_some_and(|h| h > 0.9)
        && (d.found.findings[0].holdout).is_some_and(|h| h > 0.5)
}

const SEEDS: std::ops::RangeInclusive<u64> = 1..=4;

fn count(name: &str, wrong: &mut usize, made: impl Fn(u64) -> bool) {
    let right = SEEDS.filter(|s| made(*s)).count();
    let all = SEEDS.count();
    println!("{name}: {right} of {all}");
    *wrong += all - right;
}

#[test]
fn withheld_effects_of_an_arm_are_named() {
    let mut wrong = 0;
    let mut case = |what: Withheld, effect: &str, places: &[&str]| {
        count(&format!("arm {what:?}"), &mut wrong, |s| {
            named(&arm(what, s, 2.2), effect, places)
        });
    };
    case(Offset(2, 2e-3), "joint_offset", &["j3"]);
    // behind its joint in the table, before the next one in the file
    case(Table(1, 0, 8e-4), "link_geometry", &["j3"]);
    case(Table(2, 1, 2e-3), "link_geometry", &["j4"]);
    case(Eccentricity(1, 6e-4), "encoder_eccentricity", &["j2"]);
    case(Compliance(1, 2e-5), "joint_compliance", &["j2"]);
    case(Bend(1, 5e-5), "link_compliance", &["j3"]);
    case(Play(2, 8e-4), "backlash", &["j3"]);
    case(Sag(2, 8e-4), "backlash", &["j3"]);
    case(Base(1e-3), "base_pose", &["c"]);
    assert!(wrong <= 1, "{wrong} of 36 are not named");
}

#[test]
fn play_that_friction_and_gravity_close_together_is_named_and_nothing_else() {
    let (mut wrong, mut others) = (0, 0);
    for (joint, friction, place) in [(1, 40.0, "j2"), (2, 4.0, "j3"), (2, 10.0, "j3")] {
        let what = Held(joint, 1.6e-3, friction);
        let all: Vec<_> = SEEDS.map(|s| claims(&arm(what, s, 2.2))).collect();
        let play = |c: &(String, Vec<String>)| c.0 == "backlash" && c.1 == [place];
        println!("arm {what:?}: {all:?}");
        wrong += all.iter().filter(|c| !c.iter().any(play)).count();
        others += all.iter().flatten().filter(|c| !play(c)).count();
    }
    assert_eq!(others, 0, "effects that are not there are named");
    assert!(wrong <= 1, "{wrong} of 12 are not named");
}

#[test]
fn withheld_effects_of_a_hexapod_are_named() {
    let mut wrong = 0;
    let mut case = |what: Withheld, effect: &str, places: &[&str]| {
        count(&format!("hexapod {what:?}"), &mut wrong, |s| {
            named(&hexapod(what, s), effect, places)
        });
    };
    case(Leg(2, 1e-3), "leg_geometry", &["leg3"]);
    case(Offset(4, 1e-3), "joint_offset", &["leg5"]);
    case(Compliance(1, 3e-6), "leg_compliance", &["leg2"]);
    case(Play(3, 4e-4), "backlash", &["leg4"]);
    assert!(wrong <= 1, "{wrong} of 16 are not named");
}

#[test]
fn sound_robots_have_no_gap_and_a_square_wave_is_not_named() {
    let mut named = 0;
    for seed in 1..=8 {
        for d in [
            arm(Clean, seed, 2.2),
            arm(Clean, seed, 0.25),
            hexapod(Clean, seed),
        ] {
            assert!(
                d.found.verdict == "no_gap" && claims(&d).is_empty(),
                "{seed}: {:?}",
                claims(&d)
            );
        }
        let d = arm(Square(1, 8e-4), seed, 2.2);
        println!("square {seed}: {} {:?}", d.found.verdict, claims(&d));
        named += usize::from(!claims(&d).is_empty());
        assert_ne!(d.found.verdict, "no_gap");
        assert_ne!(d.found.verdict, "explained");
    }
    assert!(
        named <= 1,
        "a wave that no catalogue has is named in {named} of 8 cases"
    );
}

#[test]
fn postures_that_are_alike_leave_rivals_and_others_are_proposed() {
    let mut rivals = 0;
    for seed in 1..=4 {
        let d = arm(Compliance(1, 2e-5), seed, 0.2);
        for (effect, places) in claims(&d) {
            assert!(
                effect == "joint_compliance" && places == ["j2"],
                "{effect} {places:?}"
            );
        }
        if let Some(next) = &d.next {
            rivals += 1;
            println!("{seed}: {:?} {:?}", next.separates, next.overlap);
            assert!(next.overlap[1] < 0.9 * next.overlap[0]);
            assert!(next.csv().starts_with("q1,q2,q3,q4,q5,q6"));
        }
    }
    assert!(
        rivals > 0,
        "near postures tell compliance from an offset after all"
    );
}
