//! Forces along the legs of a hexapod by partial velocities: the power of every body for each of six unit twists of the
//! platform, turned into forces by the rates of the legs. All vectors are in base axes.

use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};

type V = Vector3<f64>;

/// A rigid body: mass, centre and tensor about it in its own axes.
#[derive(Clone, Debug)]
pub struct Body {
    pub mass: f64,
    pub centre: V,
    pub tensor: Matrix3<f64>,
}

/// A leg: universal joint with the axes `frame` (first axis fixed in the base, third along the leg at home), cylinder
/// about the joint at the base, rod about the joint at the platform.
#[derive(Clone, Debug)]
pub struct Leg {
    pub base: V,
    pub platform: V,
    pub frame: Matrix3<f64>,
    pub cylinder: Body,
    pub rod: Body,
}

/// Motion of the platform: position, orientation, velocities and accelerations.
#[derive(Clone, Debug)]
pub struct Motion {
    pub p: V,
    pub r: Matrix3<f64>,
    pub v: V,
    pub w: V,
    pub a: V,
    pub dw: V,
}

/// What the legs do: forces along them, lengths, rates.
#[derive(Clone, Debug, Default)]
pub struct Legs {
    pub force: [f64; 6],
    pub length: [f64; 6],
    pub rate: [f64; 6],
}

/// Gravity.
const G: V = V::new(0.0, 0.0, -9.81);

impl Motion {
    /// From `x y z roll pitch yaw` (`R = R_z R_y R_x`) and their derivatives.
    pub fn new(x: &[f64; 6], d: &[f64; 6], dd: &[f64; 6]) -> Self {
        let turn = Rotation3::from_euler_angles(x[3], x[4], x[5]);
        let (sp, cp) = x[4].sin_cos();
        let (sy, cy) = x[5].sin_cos();
        let ez = V::z();
        let ey = V::new(-sy, cy, 0.0);
        let ex = V::new(cy * cp, sy * cp, -sp);
        let outer = ez * d[5];
        let middle = outer + ey * d[4];
        let turning = outer.cross(&ey) * d[4] + middle.cross(&ex) * d[3];
        Motion {
            p: V::new(x[0], x[1], x[2]),
            r: *turn.matrix(),
            v: V::new(d[0], d[1], d[2]),
            w: middle + ex * d[3],
            a: V::new(dd[0], dd[1], dd[2]),
            dw: ez * dd[5] + ey * dd[4] + ex * dd[3] + turning,
        }
    }
}

/// Power of inertia and weight of a body for a velocity of its origin and a turn.
fn power(
    b: &Body,
    r: &Matrix3<f64>,
    w: &V,
    dw: &V,
    a: &V,
    twists: &[(V, V); 6],
    to: &mut Vector6<f64>,
) {
    let c = r * b.centre;
    let inertia = r * b.tensor * r.transpose();
    let force = (a + dw.cross(&c) + w.cross(&w.cross(&c)) - G) * b.mass;
    let moment = inertia * dw + w.cross(&(inertia * w));
    for (to, (v, o)) in to.iter_mut().zip(twists) {
        *to += force.dot(&(v + o.cross(&c))) + moment.dot(o);
    }
}

/// Torque of a passive joint at a rate: dry and viscous.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rubbing {
    pub dry: f64,
    pub viscous: f64,
}

impl Rubbing {
    fn torque(&self, rate: f64) -> f64 {
        self.dry * (rate / 2e-3).tanh() + self.viscous * rate
    }
}

/// Forces along the legs with the bodies `carried` on the platform, pushed by `push` at its origin.
pub fn forces(legs: &[Leg; 6], m: &Motion, carried: &[Body], rubs: Rubbing, push: V) -> Legs {
    let unit: [(V, V); 6] = std::array::from_fn(|k| {
        let mut e = [V::zeros(), V::zeros()];
        e[k / 3][k % 3] = 1.0;
        (e[0], e[1])
    });
    let mut q = Vector6::zeros();
    for b in carried {
        power(b, &m.r, &m.w, &m.dw, &m.a, &unit, &mut q);
    }
    for (q, (v, _)) in q.iter_mut().zip(&unit) {
        *q -= push.dot(v);
    }
    let mut out = Legs::default();
    let mut rates = Matrix6::zeros();
    for (i, leg) in legs.iter().enumerate() {
        let b = m.r * leg.platform;
        let along = m.p + b - leg.base;
        let length = along.norm();
        let s = along / length;
        // angles of the universal joint: about its first axis, then about the second
        let s0 = leg.frame.transpose() * s;
        let (beta, alpha) = (s0.x.asin(), (-s0.y).atan2(s0.z));
        let middle = leg.frame * Rotation3::from_axis_angle(&V::x_axis(), alpha).matrix();
        let frame = middle * Rotation3::from_axis_angle(&V::y_axis(), beta).matrix();
        let (x0, y1) = (V::from(leg.frame.column(0)), V::from(middle.column(1)));
        let (x2, y2) = (V::from(frame.column(0)), V::from(frame.column(1)));
        let turn = |end: &V| {
            let (ad, bd) = (-end.dot(&y2) / (length * beta.cos()), end.dot(&x2) / length);
            (ad, bd, x0 * ad + y1 * bd)
        };
        let end = m.v + m.w.cross(&b);
        let pull = m.a + m.dw.cross(&b) + m.w.cross(&m.w.cross(&b));
        let (ad, bd, w) = turn(&end);
        let rate = end.dot(&s);
        let twist = x0.cross(&y1) * (ad * bd);
        let rest =
            pull - w.cross(&s) * (2.0 * rate) - (twist.cross(&s) + w.cross(&w.cross(&s))) * length;
        let (_, _, turned) = turn(&rest);
        let dw = turned + twist;
        let ends: [V; 6] = unit.map(|(v, o)| v + o.cross(&b));
        let turns = ends.map(|e| turn(&e));
        power(
            &leg.cylinder,
            &frame,
            &w,
            &dw,
            &V::zeros(),
            &turns.map(|t| (V::zeros(), t.2)),
            &mut q,
        );
        let twists: [(V, V); 6] = std::array::from_fn(|k| (ends[k], turns[k].2));
        power(&leg.rod, &frame, &w, &dw, &pull, &twists, &mut q);
        for k in 0..6 {
            q[k] += rubs.torque(ad) * turns[k].0 + rubs.torque(bd) * turns[k].1;
            rates[(k, i)] = ends[k].dot(&s);
        }
        out.length[i] = length;
        out.rate[i] = rate;
    }
    let f = rates.lu().solve(&q).unwrap_or_else(Vector6::zeros);
    out.force.copy_from_slice(f.as_slice());
    out
}
