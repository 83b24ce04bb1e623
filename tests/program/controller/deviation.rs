//! How far a controller leaves the motion between the points that are sent: the bounds, against what interpolation does.

use super::{Folder, altered, designed, motion};
use excite::controller::{AIM, Course, Interpolation, Leg};
use excite::moves::{Move, Settings};
use excite::trajectory::parts::Series;
use excite::trajectory::samples::times;
use excite::trajectory::{Fourier, Samples, Trajectory};
use excite::{Plant, Robot};
use rand::Rng;

const ALL: [Interpolation; 4] = [
    Interpolation::Hold,
    Interpolation::Linear,
    Interpolation::Cubic,
    Interpolation::Quintic,
];

/// The largest deviation of each joint, at so many instants between two points.
fn interpolated(course: &Course, way: Interpolation, rate: f64, between: usize) -> Vec<f64> {
    let sent = course
        .sample(&times(course.duration(), rate).unwrap())
        .unwrap();
    let n = course.joints().len();
    let mut worst = vec![0.0f64; n];
    for i in 1..sent.len() {
        let (t, h) = (sent.t[i - 1], sent.t[i] - sent.t[i - 1]);
        let fine: Vec<f64> = (0..=between)
            .map(|k| t + h * k as f64 / between as f64)
            .collect();
        let truth = course.sample(&fine).unwrap();
        for (j, worst) in worst.iter_mut().enumerate() {
            let state = |s: &Samples, i: usize| [s.q[j][i], s.qd[j][i], s.qdd[j][i]];
            for k in 0..=between {
                let u = k as f64 / between as f64;
                let q = way.between(u, h, state(&sent, i - 1), state(&sent, i));
                *worst = worst.max((q - truth.q[j][k]).abs());
            }
        }
    }
    worst
}

/// Random series at random rates, a hundred instants between two points: never beyond the bound, and near to it.
#[test]
fn bounds_hold_for_random_series() {
    let robot = Robot::load("planar2").unwrap();
    let r = &mut crate::common::rng(11);
    for case in 0..12 {
        let harmonics: Vec<u32> = (1..=r.random_range(1..7)).collect();
        let mut series = || {
            let wave = |r: &mut rand_chacha::ChaCha8Rng| {
                (0..harmonics.len())
                    .map(|_| r.random_range(-1.0..1.0))
                    .collect()
            };
            Series {
                constant: r.random_range(-1.0..1.0),
                sin: wave(r),
                cos: wave(r),
            }
        };
        let joints = vec![series(), series()];
        let top = f64::from(*harmonics.last().unwrap());
        let period = r.random_range(1.0..6.0);
        let f = Fourier::new(period, harmonics.clone(), joints).unwrap();
        let trajectory = Trajectory::new(&robot, f);
        let course = Course::new(&trajectory, None, 1, 1.0).unwrap();
        // ten to forty points a wave of the highest harmonic
        let rate = r.random_range(10.0..40.0) * top / period;
        for way in ALL {
            let bounds = course.deviations(way, rate).unwrap();
            for (bound, found) in bounds.iter().zip(interpolated(&course, way, rate, 100)) {
                assert!(bound.proven);
                assert!(
                    found <= bound.value * (1.0 + 1e-9) + 1e-13,
                    "{case} {way:?}: {found} {bound:?}"
                );
                assert!(
                    found >= 0.8 * bound.value,
                    "{case} {way:?}: {found} is far below {bound:?}"
                );
            }
        }
    }
}

/// A start and an end in motion, with jerk-limited moves in front of it and behind it.
fn moves(trajectory: &Trajectory, rate: f64) -> [Move; 2] {
    let plant = Plant::load("planar2").unwrap();
    let settings = Settings::default().with(|set| {
        set.scale = 1.0;
        set.rate = Some(rate);
    });
    let motion = &trajectory.fourier;
    let there = Move::approach(&plant, &[0.3, -0.2], motion, &settings, None).unwrap();
    let back = Move::retreat(&plant, motion, &[0.1, 0.4], &settings, None).unwrap();
    [there, back]
}

/// The same as they are sampled.
fn with_moves(trajectory: &Trajectory, rate: f64) -> (Leg, Leg) {
    let [there, back] = moves(trajectory, rate).map(|m| Leg::new(m.sample(rate).unwrap()).unwrap());
    (there, back)
}

/// The designed motion from a quarter of its period on: it starts and ends while it moves.
fn shifted(t: &mut Trajectory) {
    let f = &mut t.fourier;
    for series in &mut f.joints {
        for (k, &h) in f.harmonics.iter().enumerate() {
            let (s, c) = (series.sin[k], series.cos[k]);
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(h)).sin_cos();
            (series.sin[k], series.cos[k]) = (s * cos - c * sin, s * sin + c * cos);
        }
    }
}

#[test]
fn bounds_hold_over_moves_there_and_back() {
    let folder = Folder::new();
    let trajectory = Trajectory::read(altered(&folder, "planar2", shifted)).unwrap();
    // moves at another rate than that of the controller, so that their jumps of jerk fall between its points
    let (there, back) = with_moves(&trajectory, 333.0);
    let course = Course::new(&trajectory, None, 1, 1.0).unwrap();
    assert!(!course.moving_ends().unwrap().is_empty());
    let course = course
        .after(there.clone())
        .unwrap()
        .before(back.clone())
        .unwrap();
    assert_eq!(course.moving_ends().unwrap(), []);
    assert_eq!(course.parts(), [there.duration(), 10.0, back.duration()]);
    for rate in [50.0, 250.0] {
        for way in ALL {
            let bounds = course.deviations(way, rate).unwrap();
            for (bound, found) in bounds.iter().zip(interpolated(&course, way, rate, 50)) {
                assert!(
                    found <= bound.value * (1.0 + 1e-9) + 1e-12,
                    "{way:?}: {found} {bound:?}"
                );
            }
        }
    }
    // the samples of the moves are the moves
    let begin = course.sample(&[0.0, there.duration() / 2.0]).unwrap();
    for j in 0..2 {
        assert_eq!(begin.q[j][0], there.row(0, j)[0]);
        assert_eq!(begin.q[j][1], there.at(there.duration() / 2.0, j)[0]);
    }
}

/// The same through the program: three files, one motion.
#[test]
fn moves_are_in_the_file() {
    let folder = Folder::new();
    let path = altered(&folder, "planar2", shifted);
    let trajectory = Trajectory::read(&path).unwrap();
    let [there, back] = moves(&trajectory, 500.0);
    for (m, file) in [(&there, "there.csv"), (&back, "back.csv")] {
        let samples = m.sample(500.0).unwrap();
        samples.write(folder.path(file), false).unwrap();
    }
    let line = "--format ros2 --rate 500 --approach there.csv --return back.csv";
    let said = folder.export(&path, line, "a.yaml");
    assert!(
        said.contains("approach") && said.contains("at 500 Hz"),
        "{said}"
    );
    let q = super::bracketed(&folder.read("a.yaml"), "- positions: [");
    let ends = (q.first().unwrap(), q.last().unwrap());
    for (row, expected) in [(ends.0, [0.3, -0.2]), (ends.1, [0.1, 0.4])] {
        for (a, b) in row.iter().zip(expected) {
            assert!((a - b).abs() < 1e-9, "{row:?}");
        }
    }
    let seconds = there.duration + 10.0 + back.duration;
    assert_eq!(q.len(), times(seconds, 500.0).unwrap().len());
    // half of the speed takes twice the time
    let line = format!("{line} --speed 0.5");
    folder.export(&path, &line, "b.yaml");
    let slow = super::bracketed(&folder.read("b.yaml"), "- positions: [");
    assert_eq!(slow.len(), times(2.0 * seconds, 500.0).unwrap().len());
    for i in (0..q.len() - 1).step_by(97) {
        assert!((slow[2 * i][0] - q[i][0]).abs() < 1e-6, "{i}");
    }
}

/// Where no rate is named, the lowest one that keeps close enough is taken, and the next lower one does not.
#[test]
fn the_rate_follows_from_the_deviation() {
    let trajectory = Trajectory::read(designed("panda")).unwrap();
    let course = Course::new(&trajectory, None, 1, 1.0).unwrap();
    let folder = Folder::new();
    let worst = |way, rate| {
        let all = course.deviations(way, rate).unwrap();
        all.iter().map(|d| d.value).fold(0.0, f64::max)
    };
    let said = folder.export(&designed("panda"), "--format ros2", "a.yaml");
    let rate: f64 = said
        .split(" Hz")
        .next()
        .and_then(|s| s.rsplit(' ').next())
        .and_then(|s| s.parse().ok())
        .unwrap_or_else(|| panic!("{said}"));
    assert!(worst(Interpolation::Quintic, rate) <= AIM, "{said}");
    assert!(rate <= 50.0, "{said}");
    // straight lines need more
    let said = folder.export(&designed("panda"), "--format ros2 --columns q", "b.yaml");
    assert!(
        worst(Interpolation::Linear, 500.0) > AIM || said.contains("at 500 Hz"),
        "{said}"
    );
    // a series of one wave: h²/8 A (2π)² = 1e-5 at h = sqrt(8e-5 / (A 4π²))
    let mut one = Trajectory::new(&Robot::load("planar2").unwrap(), motion("planar2"));
    let wave = Series {
        constant: 0.0,
        sin: vec![0.0],
        cos: vec![0.5],
    };
    one.fourier = Fourier::new(1.0, vec![1], vec![wave.clone(), wave]).unwrap();
    let course = Course::new(&one, None, 1, 1.0).unwrap();
    let h = (8e-5 / (0.5 * std::f64::consts::TAU.powi(2))).sqrt();
    let at = |rate: f64| course.deviations(Interpolation::Linear, rate).unwrap()[0].value;
    assert!((at(1.0 / h) / AIM - 1.0).abs() < 1e-9);
}
