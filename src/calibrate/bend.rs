//! How links bend under gravity.
//!
//! The link before joint `i` is a beam of length `L` along `d`, from the joint before to this one, that holds force `F`
//! and moment `M` of gravity on everything beyond at its end. With one flexibility `η = 1/(E I)` a link,
//!
//! ```text
//! turn   θ = η (L M⊥ + ½ L² d × F⊥ + (1 + ν) L M∥)        shift   δ = η (½ L² M⊥ × d + ⅓ L³ F⊥)
//! ```
//!
//! (Euler-Bernoulli; a round tube twists by `G J = E I / (1 + ν)`.) In the axes of the joint's place they are added to
//! the six errors of its frame.

use super::effects::Gravity;
use super::feature::{Feature, Shape};
use super::unknown::{Part, Unknown};
use crate::collision::scene::append_poses;
use nalgebra::Vector3;

/// Turn of the end of a link under gravity that is expected where it bends most, rad.
const BEND: f64 = 5e-4;
/// Poisson's ratio of steel and aluminium.
const POISSON: f64 = 0.3;
/// A link that is shorter does not bend, m.
const SHORT: f64 = 0.02;

/// By row and joint of the chain: the six errors per unit of flexibility; `None` of links that do not bend.
pub type Bends = Vec<Vec<Option<[f64; 6]>>>;

/// Of these postures. `chain` are the names of the joints of the chain.
pub fn bends(gravity: &Gravity, chain: &[&str], postures: &[Vec<f64>]) -> Bends {
    let robot = &gravity.robot;
    let bodies: Vec<Option<usize>> = chain
        .iter()
        .map(|n| robot.bodies.iter().position(|b| b.joint_name == *n))
        .collect();
    let carries = |body: usize, mut other: usize| loop {
        if other == body {
            return true;
        }
        match robot.bodies[other].parent {
            Some(p) => other = p,
            None => return false,
        }
    };
    let one = |q: &Vec<f64>| -> Vec<Option<[f64; 6]>> {
        let mut all: Vec<f64> = robot
            .joints
            .iter()
            .map(|j| {
                let [low, high] = j.range();
                0.0_f64.clamp(low, high)
            })
            .collect();
        for (&j, v) in gravity.joints.iter().zip(q) {
            all[j] = *v;
        }
        let mut poses = Vec::new();
        append_poses(robot, &all, &mut poses);
        let bend = |body: usize| {
            let parent = robot.bodies[body].parent?;
            let end = poses[body].position;
            let along = end - poses[parent].position;
            let length = along.norm();
            if length < SHORT {
                return None;
            }
            let d = along / length;
            let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
            for (k, b) in robot.bodies.iter().enumerate() {
                if let Some(com) = b.inertia.com().filter(|_| carries(body, k)) {
                    let weight = robot.gravity * b.inertia.mass();
                    force += weight;
                    moment += (poses[k].apply(&com) - end).cross(&weight);
                }
            }
            let (f, m) = (force - d * d.dot(&force), moment - d * d.dot(&moment));
            let twist = d * d.dot(&moment);
            let turn = m * length
                + d.cross(&f) * (0.5 * length * length)
                + twist * ((1.0 + POISSON) * length);
            let shift = m.cross(&d) * (0.5 * length * length) + f * (length.powi(3) / 3.0);
            let axes = (poses[parent].rotation * robot.bodies[body].rotation).transpose();
            let (shift, turn) = (axes * shift, axes * turn);
            Some([shift.x, shift.y, shift.z, turn.x, turn.y, turn.z])
        };
        bodies.iter().map(|b| bend((*b)?)).collect()
    };
    postures.iter().map(one).collect()
}

/// A column for each link that bends.
pub fn features(chain: &[&str], bends: &Bends) -> Vec<Feature> {
    let turn = |row: &Vec<Option<[f64; 6]>>, i: usize| {
        row[i].map_or(0.0, |b| Vector3::new(b[3], b[4], b[5]).norm())
    };
    let each = chain.iter().enumerate().filter_map(|(i, name)| {
        let most = bends.iter().map(|row| turn(row, i)).fold(0.0, f64::max);
        let prior = BEND / most;
        (most > 0.0 && prior.is_finite()).then(|| Feature {
            joint: i,
            part: Part::Bending,
            shape: Shape::Bend,
            soft: 1.0,
            unknown: Unknown::new(format!("{name}.bending"), "1/(N m²)", Part::Bending, prior),
        })
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::bundled;

    /// Against the closed form of a cantilever with a weight beyond its end.
    #[test]
    fn an_arm_that_is_stretched_out_bends_as_a_beam() {
        let robot = bundled::find("ur5e").unwrap().load().unwrap();
        let names: Vec<String> = robot.joints.iter().map(|j| j.name.clone()).collect();
        let chain: Vec<&str> = names.iter().map(String::as_str).collect();
        let gravity = Gravity::of(robot, &names, String::new()).unwrap();
        let robot = &gravity.robot;
        let found = bends(&gravity, &chain, &[vec![0.0; 6]]);
        assert!(
            found[0][0].is_none(),
            "nothing bends before the first joint"
        );
        // stretched out and level: the upper arm carries everything from the elbow on
        let mut poses = Vec::new();
        append_poses(robot, &[0.0; 6], &mut poses);
        let end = poses[2].position;
        let length = (end - poses[1].position).norm();
        let d = (end - poses[1].position) / length;
        assert!(d.dot(&robot.gravity).abs() < 1e-3, "the upper arm is level");
        let (mut weight, mut lever) = (0.0, 0.0);
        for (pose, body) in poses.iter().zip(&robot.bodies).skip(2) {
            let com = pose.apply(&body.inertia.com().unwrap());
            let w = 9.81 * body.inertia.mass();
            weight += w;
            lever += w * d.dot(&(com - end));
        }
        let sag = weight * length.powi(3) / 3.0 + lever * length * length / 2.0;
        let slope = weight * length * length / 2.0 + lever * length;
        let b = found[0][2].unwrap();
        let axes = poses[1].rotation * robot.bodies[2].rotation;
        let shift = axes * Vector3::new(b[0], b[1], b[2]);
        let turn = axes * Vector3::new(b[3], b[4], b[5]);
        assert!((shift.z + sag).abs() < 1e-3 * sag, "{shift} {sag}");
        // the end turns downwards
        let tip = turn.cross(&d).z;
        assert!((tip + slope).abs() < 1e-3 * slope, "{turn} {slope}");
    }

    #[test]
    fn the_pose_of_an_arm_that_bends_has_the_slope_of_differences() {
        use crate::calibrate::feature::Rate;
        use crate::calibrate::kin::Kin;
        let opened = crate::calibrate::open("ur5e", None).unwrap();
        let Kin::Arm(arm) = &opened.kin else { panic!() };
        let own = opened.plant.robot().clone();
        let gravity = Gravity::of(own, &opened.joints, String::new()).unwrap();
        let q = vec![0.3, -1.1, 0.8, 0.4, 1.2, -0.5];
        let names = arm.names();
        let found = bends(&gravity, &names, std::slice::from_ref(&q));
        let all = features(&names, &found);
        assert!(all.len() >= 4, "{}", all.len());
        let place = |f: &Feature| Rate {
            turn: 0.0,
            place: found[0][f.joint],
        };
        let rates: Vec<Rate> = all.iter().map(place).collect();
        let n = arm.errors();
        let x: Vec<f64> = (0..n)
            .map(|k| 1e-3 * ((k * k) as f64).sin())
            .chain(all.iter().map(|f| f.unknown.prior))
            .collect();
        let at = arm.pose(0, &q, &x, &all, &rates);
        for (k, f) in all.iter().enumerate() {
            let h = 1e-3 * f.unknown.prior;
            let shifted = |d: f64| {
                let mut x = x.clone();
                x[n + k] += d;
                arm.pose(0, &q, &x, &all, &rates).frame.p
            };
            let slope = (shifted(h) - shifted(-h)) / (2.0 * h);
            let exact = at.jacobian.fixed_view::<3, 1>(0, n + k);
            assert!(
                (slope - exact).norm() < 1e-6 * slope.norm(),
                "{}",
                f.unknown.name
            );
        }
    }
}
