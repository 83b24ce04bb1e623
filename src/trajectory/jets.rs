//! Norm jets: a rigorous bound of the second and third time derivative of every joint torque.
//!
//! Between two samples a distance `h` apart a smooth torque obeys `|τ(t)| ≤ max(|τ_i|, |τ_{i+1}|)
//! + (h²/8) sup |τ̈|`, so a bound of `τ̈` turns samples into a proof. Automatic differentiation of
//! inverse dynamics would give `τ̈` at points; what is needed here is a bound over an interval of
//! time, given only `sup |q⁽ᵏ⁾|` of every coordinate for `k = 0 … 4`. The rate of the torque obeys the same with
//! `sup |τ⃛|`, for which `k` goes to 5.
//!
//! A *norm jet* of a vector `x(t)` is a list `x_0 … x_5` with `|x⁽ᵏ⁾(t)| ≤ x_k` throughout. Jets of
//! sums add, and Leibniz' rule with `|a × b| ≤ |a||b|` gives those of products:
//! `(xy)_k = Σ_j C(k,j) x_j y_{k−j}`.
//!
//! **Frame.** The torque of joint `i` is `τ_i = a · n`, with the axis `a` constant in body `i`.
//! Everything is therefore written in the axes of body `i`: the time derivative of the components
//! counts only motion *relative to* body `i`, and `|τ̈_i| ≤ n_2`.
//!
//! **Motion of the frame**, from the base outwards, components in the axes of the body itself.
//! `R(q)ᵀ` for a turn about a fixed axis obeys `dRᵀ/dt = −q̇ S(a) Rᵀ`, so its operator norms have
//! the jet `e_0 = 1`, `e_{k+1} = Σ_j C(k,j) |q⁽ʲ⁺¹⁾| e_{k−j}`. With `Ω` the angular velocity and `A`
//! the acceleration of the origin minus gravity (base: `0` and `|g|`), and `r` the origin of `i`
//! in its parent `p`,
//!
//! ```text
//! Ω_i = e Ω_p + q̇              A_i = e (A_p + D_p(r))        (revolute)
//! Ω_i = Ω_p                    A_i = A_p + D_p(r + a q)      (prismatic)
//! D(s) = s̈ + 2 Ω ṡ + Ω̇ s + Ω Ω s    inertial acceleration of a point s of the moving frame
//! ```
//!
//! **The bodies beyond**, in the axes of `i`: `ν_b` relative angular velocity, `δ_b` a unit vector
//! fixed in body `b` (`δ_0 = 1`, `δ_{k+1} = Σ_j C(k,j) ν_j δ_{k−j}`), `s_b` the origin of `b` seen
//! from the origin of `i`:
//!
//! ```text
//! ν_c = ν_b + δ_b q̇_c (revolute)          s_c = s_b + |r_c| δ_b  (+ δ_b q_c, prismatic)
//! ```
//!
//! **Force and moment** on the subtree, with mass `m`, first moment `h` and inertia `I` of each
//! body about its origin, `y = Σ (m s + |h| δ)`, `v = ṡ + Ω s`, `σ = Ω + ν`:
//!
//! ```text
//! f = (Σ m) A + D(y)
//! H = Σ [ m s v + |h| δ v + s σ |h| δ + I σ ]     angular momentum about the moving origin of i
//! n = Ḣ + Ω H + y A
//! ```
//!
//! where `I_0` is the largest magnitude of an eigenvalue of `I` and, since an isotropic part does
//! not change when it turns, the derivatives grow from half the spread of the eigenvalues:
//! `d_0 = ½(λ_max − λ_min)`, `d_{k+1} = 2 Σ_j C(k,j) ν_j d_{k−j}`, `I_k = d_k` for `k ≥ 1`. Finally
//! `|τ̈| ≤ n_2` (revolute) or `f_2` (prismatic), `|τ⃛| ≤ n_3` or `f_3`; joint terms add `I_a |q⁽⁴⁾| + F_v |q⁽³⁾|`, and the
//! joints of one coordinate add with their ratios.

use crate::robot::{JointTerm, Motion, Robot};
use nalgebra::SymmetricEigen;

/// Upper bounds of the norms of a vector and of its first five time derivatives.
pub type Jet = [f64; ORDERS];

/// Orders of a jet.
const ORDERS: usize = 6;

const ZERO: Jet = [0.0; ORDERS];
const BINOMIAL: [[f64; ORDERS]; ORDERS] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0, 0.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, 1.0],
];

fn sum(a: &Jet, b: &Jet) -> Jet {
    std::array::from_fn(|k| a[k] + b[k])
}

fn scale(f: f64, a: &Jet) -> Jet {
    a.map(|x| f * x)
}

fn product(a: &Jet, b: &Jet) -> Jet {
    std::array::from_fn(|k| (0..=k).map(|j| BINOMIAL[k][j] * a[j] * b[k - j]).sum())
}

/// Jet of the time derivative; what would need a sixth derivative is unknown, hence infinite.
/// Entry `k` of every operation uses only entries up to `k`, so it never spreads downwards.
fn rate(a: &Jet) -> Jet {
    [a[1], a[2], a[3], a[4], a[5], f64::INFINITY]
}

/// Of what does not change.
fn constant(size: f64) -> Jet {
    std::array::from_fn(|k| if k == 0 { size } else { 0.0 })
}

/// Grows `x_{k+1} = f Σ_j C(k,j) w_j x_{k−j}` from `x_0 = first`.
fn grow(first: f64, f: f64, w: &Jet) -> Jet {
    let mut x = constant(first);
    for k in 0..ORDERS - 1 {
        x[k + 1] = f
            * (0..=k)
                .map(|j| BINOMIAL[k][j] * w[j] * x[k - j])
                .sum::<f64>();
    }
    x
}

/// Jet of the inertial acceleration of a point `s` of a frame that turns with `omega`.
fn inertial(omega: &Jet, s: &Jet) -> Jet {
    let relative = sum(&rate(&rate(s)), &scale(2.0, &product(omega, &rate(s))));
    let dragged = sum(
        &product(&rate(omega), s),
        &product(omega, &product(omega, s)),
    );
    sum(&relative, &dragged)
}

/// What the bound needs to know of one body.
#[derive(Debug, Clone)]
struct Node {
    parent: Option<usize>,
    revolute: bool,
    coordinate: usize,
    ratio: f64,
    offset: f64,
    /// distance of the origin from the parent's at zero joint position
    length: f64,
    mass: f64,
    moment: f64,
    /// largest magnitude of a principal moment about the origin, half their spread
    inertia: [f64; 2],
}

/// The norms of a robot's constants, from which torque derivatives are bounded.
#[derive(Debug, Clone)]
pub struct Norms {
    nodes: Vec<Node>,
    gravity: f64,
    /// armature and viscous friction of every coordinate
    terms: Vec<[f64; 2]>,
}

impl Norms {
    /// Takes the norms.
    pub fn new(robot: &Robot) -> Self {
        let nodes = robot
            .bodies
            .iter()
            .map(|body| {
                let moments = SymmetricEigen::new(body.inertia.tensor()).eigenvalues;
                Node {
                    parent: body.parent,
                    revolute: body.motion == Motion::Revolute,
                    coordinate: body.coordinate,
                    ratio: body.ratio.abs(),
                    offset: body.offset.abs(),
                    length: body.position.norm(),
                    mass: body.inertia.mass().abs(),
                    moment: body.inertia.first_moment().norm(),
                    inertia: [moments.amax(), 0.5 * (moments.max() - moments.min())],
                }
            })
            .collect();
        let terms = robot
            .joints
            .iter()
            .map(|j| [JointTerm::Armature, JointTerm::Viscous].map(|t| j.terms[t as usize].abs()))
            .collect();
        Norms {
            nodes,
            gravity: robot.gravity.norm(),
            terms,
        }
    }

    /// Bounds of `|τ̈|` and `|τ⃛|` of every coordinate (N m/s² and N m/s³, or N), rigid bodies, armature and
    /// viscous friction together, where `coordinates[j][k] ≥ |q_j⁽ᵏ⁾|`, `k = 0 … 5`, on the interval of
    /// time in question. See the [module](self) for the derivation.
    ///
    /// # Panics
    /// If there are fewer coordinates than the robot has.
    pub fn torque_derivatives(&self, coordinates: &[Jet]) -> Vec<[f64; 2]> {
        let joints: Vec<Jet> = self
            .nodes
            .iter()
            .map(|n| {
                let mut q = scale(n.ratio, &coordinates[n.coordinate]);
                q[0] += n.offset;
                q
            })
            .collect();
        let mut out: Vec<[f64; 2]> = self
            .terms
            .iter()
            .zip(coordinates)
            .map(|([armature, viscous], q)| {
                [2, 3].map(|k| armature * q[k + 2] + viscous * q[k + 1])
            })
            .collect();

        let mut frames: Vec<(Jet, Jet)> = Vec::with_capacity(self.nodes.len());
        for (node, q) in self.nodes.iter().zip(&joints) {
            let base = (ZERO, constant(self.gravity));
            let (omega, acceleration) = node.parent.map_or(base, |p| frames[p]);
            let fixed = constant(node.length);
            let frame = if node.revolute {
                let turn = grow(1.0, 1.0, &rate(q));
                let moved = sum(&acceleration, &inertial(&omega, &fixed));
                (
                    sum(&product(&turn, &omega), &rate(q)),
                    product(&turn, &moved),
                )
            } else {
                (
                    omega,
                    sum(&acceleration, &inertial(&omega, &sum(&fixed, q))),
                )
            };
            frames.push(frame);
        }
        for (i, node) in self.nodes.iter().enumerate() {
            let own = self.subtree(i, &frames[i], &joints);
            let all = &mut out[node.coordinate];
            all.iter_mut()
                .zip(own)
                .for_each(|(a, b)| *a += node.ratio * b);
        }
        out.iter_mut().flatten().for_each(|v| *v *= 1.0 + 1e-9);
        out
    }

    /// Bounds of the second and third derivative of the force or moment of joint `i` along its axis.
    fn subtree(&self, i: usize, (omega, acceleration): &(Jet, Jet), joints: &[Jet]) -> [f64; 2] {
        // relative angular velocity, a unit vector of the body, origin
        let mut seen: Vec<Option<(Jet, Jet, Jet)>> = vec![None; self.nodes.len()];
        let (mut mass, mut first, mut momentum) = (0.0, ZERO, ZERO);
        for b in i..self.nodes.len() {
            let node = &self.nodes[b];
            let state = if b == i {
                (ZERO, constant(1.0), ZERO)
            } else {
                let Some((nu, unit, s)) = node.parent.and_then(|p| seen[p]) else {
                    continue;
                };
                let s = sum(&s, &scale(node.length, &unit));
                if node.revolute {
                    let nu = sum(&nu, &product(&unit, &rate(&joints[b])));
                    (nu, grow(1.0, 1.0, &nu), s)
                } else {
                    (nu, unit, sum(&s, &product(&unit, &joints[b])))
                }
            };
            seen[b] = Some(state);
            let (nu, unit, s) = state;
            let velocity = sum(&rate(&s), &product(omega, &s));
            let sigma = sum(omega, &nu);
            let h = scale(node.moment, &unit);
            let mut inertia = grow(node.inertia[1], 2.0, &nu);
            inertia[0] = node.inertia[0];

            mass += node.mass;
            first = sum(&first, &sum(&scale(node.mass, &s), &h));
            let of_mass = product(&sum(&scale(node.mass, &s), &h), &velocity);
            let of_turn = sum(
                &product(&s, &product(&sigma, &h)),
                &product(&inertia, &sigma),
            );
            momentum = sum(&momentum, &sum(&of_mass, &of_turn));
        }
        if self.nodes[i].revolute {
            let pulled = product(&first, acceleration);
            let moment = sum(&sum(&rate(&momentum), &product(omega, &momentum)), &pulled);
            [moment[2], moment[3]]
        } else {
            let force = sum(&scale(mass, acceleration), &inertial(omega, &first));
            [force[2], force[3]]
        }
    }
}

/// Jet of a point in base axes: it lies `reach` from the origin of the last of the bodies of `chain`, which leads
/// there from the base. Entries are bounds of the position's derivatives, where `coordinates` are those of the
/// interval of time in question.
pub(crate) fn point_jet(robot: &Robot, chain: &[usize], reach: f64, coordinates: &[Jet]) -> Jet {
    let (mut nu, mut unit, mut s) = (ZERO, constant(1.0), ZERO);
    for &b in chain {
        let body = &robot.bodies[b];
        let mut q = scale(body.ratio.abs(), &coordinates[body.coordinate]);
        q[0] += body.offset.abs();
        s = sum(&s, &scale(body.position.norm(), &unit));
        match body.motion {
            Motion::Revolute => {
                nu = sum(&nu, &product(&unit, &rate(&q)));
                unit = grow(1.0, 1.0, &nu);
            }
            Motion::Prismatic => s = sum(&s, &product(&unit, &q)),
        }
    }
    sum(&s, &scale(reach, &unit)).map(|x| x * (1.0 + 1e-9))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leibniz() {
        // e^t has all derivatives 1 at 0; its square has 2^k
        assert_eq!(
            product(&[1.0; 6], &[1.0; 6]),
            [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]
        );
        // a unit vector that turns at a constant 3 rad/s
        let turning = grow(1.0, 1.0, &constant(3.0));
        assert_eq!(turning, [1.0, 3.0, 9.0, 27.0, 81.0, 243.0]);
        // a point at 2 m on a wheel at 3 rad/s: centripetal acceleration
        assert_eq!(inertial(&constant(3.0), &constant(2.0))[0], 18.0);
    }

    /// A turntable (joint 0), a joint on it, a rotor on that, turning at constant rates, made of
    /// nothing until `change` says so. Bound for the joint in the middle.
    fn turntable(rates: [f64; 3], change: impl Fn(&mut [Node])) -> [f64; 2] {
        let node = |i: usize| Node {
            parent: i.checked_sub(1),
            revolute: true,
            coordinate: i,
            ratio: 1.0,
            offset: 0.0,
            length: 0.0,
            mass: 0.0,
            moment: 0.0,
            inertia: [0.0; 2],
        };
        let mut nodes: Vec<Node> = (0..3).map(node).collect();
        change(&mut nodes);
        let norms = Norms {
            nodes,
            gravity: 0.0,
            terms: vec![[0.0; 2]; 3],
        };
        norms.torque_derivatives(&rates.map(|rate| [0.0, rate, 0.0, 0.0, 0.0, 0.0]))[1]
    }

    #[test]
    fn centrifugal_and_coriolis_force_of_an_unbalanced_rotor() {
        // force along a slide: m r (Ω + ω)² cos ωt; the bound is the amplitude of its second
        // derivative exactly, so no term is missing and none is too large
        for (turn, spin) in [(2.0, 3.0), (5.0, 0.5), (0.0, 4.0)] {
            let exact = 0.7 * (turn + spin) * (turn + spin) * spin * spin;
            let [bound, third] = turntable([turn, 0.0, spin], |nodes| {
                nodes[1].revolute = false;
                nodes[2].moment = 0.7;
            });
            assert!((bound / exact - 1.0).abs() < 1e-8, "{bound} {exact}");
            assert!(
                (third / (spin * exact) - 1.0).abs() < 1e-8,
                "{third} {exact}"
            );
        }
    }

    #[test]
    fn gyroscopic_moment_of_a_skew_rotor() {
        // moment about a horizontal hinge: I_xz (Ω + ω)² cos ωt, I_xz at most half the spread of
        // the principal moments; on a fast turntable Ω × H is nearly all of it
        let (turn, spin): (f64, f64) = (100.0, 0.1);
        let exact = 0.3 * (turn + spin).powi(2) * spin.powi(2);
        let [bound, third] = turntable([turn, 0.0, spin], |nodes| nodes[2].inertia = [2.0, 0.3]);
        assert!(bound >= exact && bound < 4.1 * exact, "{bound} {exact}");
        assert!(third >= spin * exact && third < 9.0 * spin * exact);
    }

    #[test]
    fn moment_of_a_body_that_tumbles_on_a_turntable() {
        // about the hinge: (I_zz − I_yy) Ω² sin ωt cos ωt
        let (turn, spin): (f64, f64) = (3.0, 1.0);
        let exact = 2.0 * 0.6 * (turn * spin).powi(2);
        let [bound, third] = turntable([turn, spin, 0.0], |nodes| nodes[1].inertia = [2.0, 0.3]);
        assert!(bound >= exact && bound < 20.0 * exact, "{bound} {exact}");
        // its derivative: twice the frequency
        assert!(third >= 2.0 * spin * exact);
    }

    #[test]
    fn moment_of_an_unbalanced_rotor_at_a_distance() {
        // about a hinge held still, at a distance l: l m r ω² cos ωt, bounded exactly
        let exact = 0.5 * 0.7 * 3f64.powi(4);
        let [bound, third] = turntable([0.0, 0.0, 3.0], |nodes| {
            nodes[2].length = 0.5;
            nodes[2].moment = 0.7;
        });
        assert!((bound / exact - 1.0).abs() < 1e-8, "{bound} {exact}");
        assert!((third / (3.0 * exact) - 1.0).abs() < 1e-8);
    }
}
