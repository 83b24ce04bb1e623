//! A mechanism of its own in one file: sliders on vertical rails, each with two parallel rods to a
//! platform that translates (a linear Delta). With four rails it is redundantly actuated.

use excite::Result;
use excite::mechanism::Mechanism;
use excite::mechanism::parts::{ClosedForm, Group, Pattern, Segment, Source, Task};
use excite::mechanism::parts::{Coordinates, Kinematics, Setup};
use excite::mechanism::scalar::Scalar;
use excite::mechanism::tree::{Builder, Place};
use excite::robot::Joint;
use excite::robot::parts::JointTerm;
use excite::robot::parts::Motion;
use nalgebra::{Matrix3, Vector3};

#[derive(Debug, Clone)]
pub struct Tripod {
    /// foot of the rail from the platform's joint, horizontal
    rails: Vec<[f64; 2]>,
    rod: f64,
}

impl Kinematics for Tripod {
    fn coordinates(&self) -> usize {
        3 * self.rails.len() + 3
    }

    #[inline(always)]
    fn inverse<S: Scalar, C: Coordinates<S> + ?Sized>(&self, x: &[S], q: &mut C) {
        let n = self.rails.len();
        for (i, rail) in self.rails.iter().enumerate() {
            let (dx, dy) = (x[0] + (-rail[0]), x[1] + (-rail[1]));
            let down = (dx * dx + dy * dy) * -1.0 + self.rod * self.rod;
            let down = down.sqrt();
            q.put(i, x[2] + down);
            // rod direction (dx, dy, -down) = l (sin β, -sin γ cos β, cos γ cos β)
            q.put(n + 2 * i, (-dy).atan2(-down));
            q.put(n + 2 * i + 1, dx.atan2((dy * dy + down * down).sqrt()));
        }
        for k in 0..3 {
            q.put(3 * n + k, x[k]);
        }
    }

    fn unreachable(&self, x: &[f64]) -> Option<String> {
        self.rails
            .iter()
            .position(|r| (x[0] - r[0]).hypot(x[1] - r[1]) >= self.rod)
            .map(|i| {
                format!(
                    "rail {} is further away than the rod of {} m",
                    i + 1,
                    self.rod
                )
            })
    }

    fn segments(&self, _x: &[f64]) -> Vec<Segment> {
        Vec::new()
    }
}

pub fn build(rails: usize, seed: u64) -> Result<Mechanism> {
    let r = &mut super::rng(seed);
    let mut tree = Builder::default();
    for i in 0..rails {
        let mut slide = Joint::new(&format!("slide{i}"), Motion::Prismatic);
        slide.identify = [true, true, false, true];
        slide.terms = [0.7, 3.0, 0.0, -1.0];
        tree.add(slide);
    }
    for i in 0..rails {
        for (k, angle) in ["gamma", "beta"].iter().enumerate() {
            let mut rod = Joint::new(&format!("rod{i}_{angle}"), Motion::Revolute);
            // friction of a passive joint
            rod.identify = JointTerm::ALL.map(|t| t == JointTerm::Viscous && k == 0);
            rod.terms = [0.0, if k == 0 { 0.4 } else { 0.0 }, 0.0, 0.0];
            tree.add(rod);
        }
    }
    let mut groups = Vec::new();
    let mut points = Vec::new();
    for i in 0..rails {
        let angle = 0.3 + i as f64 * std::f64::consts::TAU / rails as f64;
        let rail = [0.4 * angle.cos(), 0.4 * angle.sin()];
        points.push(rail);
        let place = Place {
            parent: None,
            rotation: Matrix3::identity(),
            position: Vector3::new(rail[0], rail[1], 0.0),
        };
        let slider = tree.body(&format!("slider{i}"), place, i, Vector3::z());
        let cross = tree.body("cross", Place::on(slider), rails + 2 * i, Vector3::x());
        let rod = tree.body(
            &format!("rod{i}"),
            Place::on(cross),
            rails + 2 * i + 1,
            Vector3::y(),
        );
        tree.set(slider, super::inertia(r));
        tree.set(rod, super::inertia(r));
        groups.push(Group::one(&format!("slider{i}"), slider, Pattern::Full));
        groups.push(Group::one(&format!("rod{i}"), rod, Pattern::Full));
    }
    let platform = tree.platform(Task::Translation);
    tree.set(platform, super::inertia(r));
    groups.push(Group::one("platform", platform, Pattern::Full));
    Mechanism::new(Setup {
        source: Source::Code("tripod".into()),
        robot: tree.robot("tripod", Vector3::new(0.3, -0.2, -9.7)),
        actuated: (0..rails).collect(),
        task: Task::Translation,
        geometry: Box::new(ClosedForm::<_, 3>(Tripod {
            rails: points,
            rod: 0.7,
        })),
        groups,
        home: vec![0.0, 0.0, 0.2],
        length: 0.4,
    })
}
