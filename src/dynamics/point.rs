//! Velocity and acceleration of a point of a robot, with their derivatives.
//!
//! With `J_k` the velocity of the point when joint `k` of the chain alone moves, and `z_k` its axis, all in
//! base axes, the derivative of `J_k` with respect to joint `j ≤ k` is `z_j × J_k` where `j` turns and zero
//! where it slides, and once more so:
//!
//! ```text
//! v = Σ J_k θ̇_k                    w_k = ∂v/∂θ_k = Σ_j H_jk θ̇_j,   H_jk = z_min(j,k) × J_max(j,k)
//! a = Σ J_k θ̈_k + Σ w_k θ̇_k        ∂a/∂θ̇_k = 2 w_k
//! ∂a/∂θ_k = Σ_j H_jk θ̈_j + Σ_jl z_i × H_jl θ̇_j θ̇_l over the three sorted towards the tip
//! ```

use crate::robot::{Motion, Robot, Tool};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

/// A point, and the chain of bodies that carries it.
#[derive(Debug, Clone)]
pub struct Point<'a> {
    robot: &'a Robot,
    chain: Vec<usize>,
    place: Vector3<f64>,
}

/// Where a point is and how it moves, base axes.
#[derive(Debug, Clone, Default)]
pub struct PointMotion {
    /// m
    pub position: Vector3<f64>,
    /// m/s
    pub velocity: Vector3<f64>,
    /// m/s²
    pub acceleration: Vector3<f64>,
    /// `J_k` along the chain, for the joint positions of the bodies
    jacobian: Vec<Vector3<f64>>,
    /// `z_k`, zero where the joint slides
    axes: Vec<Vector3<f64>>,
    /// `θ̇`, `θ̈`
    rates: Vec<[f64; 2]>,
    /// `∂v/∂θ_k`
    turned: Vec<Vector3<f64>>,
}

impl<'a> Point<'a> {
    /// The tool point of a robot.
    pub fn of(robot: &'a Robot, tool: &Tool) -> Self {
        Point {
            robot,
            chain: tool.chain(robot),
            place: tool.point,
        }
    }

    /// Its motion at a state.
    pub fn at(&self, q: &[f64], qd: &[f64], qdd: &[f64], out: &mut PointMotion) {
        let (mut rotation, mut origin) = (Matrix3::identity(), Vector3::zeros());
        let (mut origins, mut directions) = (Vec::new(), Vec::new());
        out.rates.clear();
        for &b in &self.chain {
            let body = &self.robot.bodies[b];
            let c = body.coordinate;
            let theta = body.ratio * q[c] + body.offset;
            out.rates.push([body.ratio * qd[c], body.ratio * qdd[c]]);
            origin += rotation * body.position;
            rotation *= body.rotation;
            let axis = rotation * body.axis;
            match body.motion {
                Motion::Revolute => {
                    let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(body.axis), theta);
                    rotation *= turn.matrix();
                }
                Motion::Prismatic => origin += axis * theta,
            }
            origins.push(origin);
            directions.push((axis, body.motion));
        }
        out.position = origin + rotation * self.place;
        let place = out.position;
        out.jacobian.clear();
        out.axes.clear();
        for (origin, (axis, motion)) in origins.iter().zip(&directions) {
            let (column, turning) = match motion {
                Motion::Revolute => (axis.cross(&(place - origin)), *axis),
                Motion::Prismatic => (*axis, Vector3::zeros()),
            };
            out.jacobian.push(column);
            out.axes.push(turning);
        }
        let n = self.chain.len();
        let all = 0..n;
        out.turned = all
            .clone()
            .map(|k| {
                all.clone()
                    .map(|j| out.hessian(j, k) * out.rates[j][0])
                    .sum()
            })
            .collect();
        out.velocity = all.clone().map(|k| out.jacobian[k] * out.rates[k][0]).sum();
        out.acceleration = all
            .map(|k| out.jacobian[k] * out.rates[k][1] + out.turned[k] * out.rates[k][0])
            .sum();
    }

    /// Derivatives of `wᵀ v` with respect to positions and velocities of the coordinates, added to `out`.
    pub fn velocity_gradient(&self, at: &PointMotion, w: &Vector3<f64>, [q, qd]: [&mut [f64]; 2]) {
        for (k, &b) in self.chain.iter().enumerate() {
            let body = &self.robot.bodies[b];
            q[body.coordinate] += body.ratio * w.dot(&at.turned[k]);
            qd[body.coordinate] += body.ratio * w.dot(&at.jacobian[k]);
        }
    }

    /// Derivatives of `wᵀ a` with respect to positions, velocities and accelerations, added to `out`.
    pub fn acceleration_gradient(
        &self,
        at: &PointMotion,
        w: &Vector3<f64>,
        [q, qd, qdd]: [&mut [f64]; 3],
    ) {
        let n = self.chain.len();
        for (k, &b) in self.chain.iter().enumerate() {
            let body = &self.robot.bodies[b];
            let mut by_position = Vector3::zeros();
            for j in 0..n {
                by_position += at.hessian(j, k) * at.rates[j][1];
                for l in 0..n {
                    by_position += at.third(j, k, l) * (at.rates[j][0] * at.rates[l][0]);
                }
            }
            q[body.coordinate] += body.ratio * w.dot(&by_position);
            qd[body.coordinate] += body.ratio * 2.0 * w.dot(&at.turned[k]);
            qdd[body.coordinate] += body.ratio * w.dot(&at.jacobian[k]);
        }
    }
}

impl PointMotion {
    /// Second derivative of the position with respect to two joints of the chain.
    fn hessian(&self, j: usize, k: usize) -> Vector3<f64> {
        self.axes[j.min(k)].cross(&self.jacobian[j.max(k)])
    }

    /// Third derivative.
    fn third(&self, j: usize, k: usize, l: usize) -> Vector3<f64> {
        let mut order = [j, k, l];
        order.sort_unstable();
        self.axes[order[0]].cross(&self.hessian(order[1], order[2]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<(Robot, Tool)> {
        let tool = |robot: &Robot| Tool {
            frame: "tip".into(),
            body: robot.bodies.len() - 1,
            point: Vector3::new(0.1, -0.2, 0.3),
            speed: 1.0,
            acceleration: 1.0,
        };
        let mut scara = Robot::load("scara").unwrap();
        scara.bodies[1].ratio = -1.7;
        scara.bodies[1].offset = 0.3;
        [Robot::load("panda").unwrap(), scara]
            .map(|r| (r.clone(), tool(&r)))
            .to_vec()
    }

    #[test]
    fn velocity_and_acceleration_are_those_of_differences() {
        for (robot, tool) in points() {
            let (point, n) = (Point::of(&robot, &tool), robot.dof());
            // q = sin(k + (1 + k/5) t)
            let state = |t: f64| {
                let of = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
                    (0..n)
                        .map(|k| f(k as f64 + (1.0 + 0.2 * k as f64) * t, 1.0 + 0.2 * k as f64))
                        .collect()
                };
                let mut m = PointMotion::default();
                let (q, v, a) = (
                    of(&|x, _| x.sin()),
                    of(&|x, w| w * x.cos()),
                    of(&|x, w| -w * w * x.sin()),
                );
                point.at(&q, &v, &a, &mut m);
                (m, [q, v, a])
            };
            let h = 1e-3;
            let all: Vec<_> = (-2..=2).map(|k| state(0.4 + h * f64::from(k)).0).collect();
            let slope = |f: &dyn Fn(&PointMotion) -> Vector3<f64>| {
                (8.0 * (f(&all[3]) - f(&all[1])) - (f(&all[4]) - f(&all[0]))) / (12.0 * h)
            };
            let (here, [q, v, a]) = state(0.4);
            assert!((here.velocity - slope(&|m| m.position)).amax() < 1e-9);
            assert!((here.acceleration - slope(&|m| m.velocity)).amax() < 1e-8);
            let w = Vector3::new(0.3, -0.8, 0.5);
            let mut velocity = [vec![0.0; n], vec![0.0; n]];
            let [gq, gv] = &mut velocity;
            point.velocity_gradient(&here, &w, [gq, gv]);
            let mut acceleration = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            let [gq, gv, ga] = &mut acceleration;
            point.acceleration_gradient(&here, &w, [gq, gv, ga]);
            for k in 0..n {
                for (order, list) in acceleration.iter().enumerate() {
                    let moved = |s: f64| {
                        let mut x = [q.clone(), v.clone(), a.clone()];
                        x[order][k] += s * 1e-5;
                        let mut m = PointMotion::default();
                        point.at(&x[0], &x[1], &x[2], &mut m);
                        [w.dot(&m.velocity), w.dot(&m.acceleration)]
                    };
                    let (up, down) = (moved(1.0), moved(-1.0));
                    let [dv, da] = [0, 1].map(|i| (up[i] - down[i]) / 2e-5);
                    assert!(
                        (list[k] - da).abs() < 1e-8 * (1.0 + da.abs()),
                        "{order} {k}"
                    );
                    if let Some(list) = velocity.get(order) {
                        assert!(
                            (list[k] - dv).abs() < 1e-8 * (1.0 + dv.abs()),
                            "{order} {k}"
                        );
                    }
                }
            }
        }
    }
}
