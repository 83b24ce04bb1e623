//! The recursions themselves, written once for all pack widths.
//!
//! Everything is in **body axes** and the base accelerates by `−g`. For body `B` on parent `P`
//! with `R = R_PB(q)`, `p = p_PB_P`, axis `a` (revolute):
//!
//! ```text
//! ω_B = Rᵀω_P + a q̇            α_B = Rᵀα_P + (Rᵀω_P) × a q̇ + a q̈
//! a_B = Rᵀ(a_P + α_P × p + ω_P × (ω_P × p))
//! f_B = m a_B + α_B × h + ω_B × (ω_B × h)
//! n_B = h × a_B + I α_B + ω_B × I ω_B
//! ```
//!
//! (Newton-Euler about the body origin; Featherstone 2008, ch. 5; Atkeson, An & Hollerbach 1986.)
//!
//! **Regressor.** The generalised force of coordinate `i` due to body `j` is the power of that
//! wrench on the motion `(v_ij, w_ij)` that a unit rate of `i` gives to the frame of `j`:
//! `Y_ij φ_j = v_ij·f_j + w_ij·n_j`, linear in the ten parameters of `j`.
//!
//! **Adjoint.** For given parameters `φ` and rates `r` the scalar `F = Σ_i r_i τ_i` equals
//! `Σ_j (v_j·f_j + w_j·n_j)` with `(v_j, w_j)` the motion that the rates `r` give. One sweep up
//! and one down return `∂F/∂q, ∂F/∂q̇, ∂F/∂q̈` in `O(n)`, for the price of about four inverse
//! dynamics: the reverse mode of the recursion above.

// written with indices: iterators over arrays of wide packs are not inlined into the functions that
// are compiled for them
#![allow(clippy::needless_range_loop)]

use super::lanes::*;
use super::tree::{Node, Tree};
use crate::robot::Motion;

/// Kinematics of one body for one pack of samples.
#[derive(Clone, Copy)]
pub(crate) struct Frame<L> {
    /// `R_PB`
    r: M3<L>,
    /// `p_PB_P`
    p: V3<L>,
    omega: V3<L>,
    alpha: V3<L>,
    acc: V3<L>,
    qd: L,
}

/// Wrench, virtual motion and adjoints of one body.
#[derive(Clone, Copy)]
pub(crate) struct Flow<L> {
    /// accumulated force and moment of the subtree
    f: V3<L>,
    n: V3<L>,
    v: V3<L>,
    w: V3<L>,
    acc: V3<L>,
    alpha: V3<L>,
    omega: V3<L>,
}

/// Scratch memory of one thread; grows once and is then reused.
#[derive(Clone)]
pub(crate) struct Scratch<L> {
    frames: Vec<Frame<L>>,
    flows: Vec<Flow<L>>,
    twists: Vec<(V3<L>, V3<L>)>,
}

impl<L: Lanes> Default for Scratch<L> {
    fn default() -> Self {
        Scratch {
            frames: Vec::new(),
            flows: Vec::new(),
            twists: Vec::new(),
        }
    }
}

impl<L: Lanes> Scratch<L> {
    /// Makes room for a robot; does nothing the second time.
    pub fn fit(&mut self, tree: &Tree) {
        let z = zero();
        let frame = Frame {
            r: [z; 3],
            p: z,
            omega: z,
            alpha: z,
            acc: z,
            qd: L::splat(0.0),
        };
        let flow = Flow {
            f: z,
            n: z,
            v: z,
            w: z,
            acc: z,
            alpha: z,
            omega: z,
        };
        self.frames.resize(tree.nodes.len(), frame);
        self.flows.resize(tree.nodes.len(), flow);
        self.twists
            .resize(tree.twist_start[tree.nodes.len()], (z, z));
    }
}

/// Pointers to one pack of a motion stored joint by joint: `q + j·stride`.
#[derive(Clone, Copy)]
pub(crate) struct Pack {
    pub q: *const f64,
    pub qd: *const f64,
    pub qdd: *const f64,
    /// distance between joints
    pub stride: usize,
}

/// Fills `scratch.frames`.
///
/// # Safety
/// `pack` must point to `tree.dof()` joints of `L::WIDTH` samples.
#[inline(always)]
unsafe fn kinematics<L: Lanes>(tree: &Tree, pack: Pack, s: &mut Scratch<L>) {
    let g = splat3::<L>(&tree.gravity);
    for (index, node) in tree.nodes.iter().enumerate() {
        // SAFETY: by the caller's promise
        let (q, qd, qdd) = unsafe {
            let k = node.coordinate * pack.stride;
            (
                L::load(pack.q.add(k)),
                L::load(pack.qd.add(k)),
                L::load(pack.qdd.add(k)),
            )
        };
        let (q, qd, qdd) = (
            q * node.ratio + L::splat(node.offset),
            qd * node.ratio,
            qdd * node.ratio,
        );
        let a = splat3::<L>(&node.axis);
        let mut p = splat3::<L>(&node.position);
        let r: M3<L> = match node.motion {
            Motion::Revolute => {
                let (sin, cos) = sin_cos(q);
                turn(node, sin, cos)
            }
            Motion::Prismatic => {
                p = add(p, scale(splat3(&node.slide), q));
                [
                    splat3(&node.r0[0]),
                    splat3(&node.r0[1]),
                    splat3(&node.r0[2]),
                ]
            }
        };
        let (omega, alpha, acc) = match node.parent {
            Some(parent) => {
                let b = &s.frames[parent];
                let (omega, alpha) = (get(&b.omega), get(&b.alpha));
                let lever = add(cross(alpha, p), cross(omega, cross(omega, p)));
                (
                    mul_t(&r, omega),
                    mul_t(&r, alpha),
                    mul_t(&r, add(get(&b.acc), lever)),
                )
            }
            None => (zero(), zero(), mul_t(&r, [-g[0], -g[1], -g[2]])),
        };
        let (omega, alpha, acc) = match node.motion {
            Motion::Revolute => (
                add(omega, scale(a, qd)),
                add(alpha, add(scale(cross(omega, a), qd), scale(a, qdd))),
                acc,
            ),
            Motion::Prismatic => (
                omega,
                alpha,
                add(acc, add(scale(a, qdd), scale(cross(omega, a), qd + qd))),
            ),
        };
        let frame = &mut s.frames[index];
        for i in 0..3 {
            set(&mut frame.r[i], r[i]);
        }
        set(&mut frame.p, p);
        set(&mut frame.omega, omega);
        set(&mut frame.alpha, alpha);
        set(&mut frame.acc, acc);
        frame.qd = qd;
    }
}

/// `r0 + sin rs + cos rc`, written out: closures over arrays would not be inlined into the
/// functions compiled for wide packs.
#[inline(always)]
fn turn<L: Lanes>(node: &Node, sin: L, cos: L) -> M3<L> {
    let mut r = [zero(); 3];
    for i in 0..3 {
        for j in 0..3 {
            r[i][j] = sin * node.rs[i][j] + cos * node.rc[i][j] + L::splat(node.r0[i][j]);
        }
    }
    r
}

/// Where a kernel writes the regressor: column `c`, coordinate `j`, sample `i` at
/// `base + c·column + j·row + i`.
#[derive(Clone, Copy)]
pub(crate) struct Sink {
    pub base: *mut f64,
    pub column: usize,
    pub row: usize,
}

/// What the regressor of a body needs of its motion.
#[derive(Clone, Copy)]
struct State<L> {
    omega: V3<L>,
    alpha: V3<L>,
    acc: V3<L>,
    /// `skew(α) + skew(ω)²`
    d: M3<L>,
}

impl<L: Lanes> State<L> {
    #[inline(always)]
    fn of(b: &Frame<L>) -> Self {
        let (o, al) = (get(&b.omega), get(&b.alpha));
        let (xy, xz, yz) = (o[0] * o[1], o[0] * o[2], o[1] * o[2]);
        let (xx, yy, zz) = (o[0] * o[0], o[1] * o[1], o[2] * o[2]);
        State {
            omega: o,
            alpha: al,
            acc: get(&b.acc),
            d: [
                [-(yy + zz), xy - al[2], xz + al[1]],
                [xy + al[2], -(xx + zz), yz - al[0]],
                [xz - al[1], yz + al[0], -(xx + yy)],
            ],
        }
    }

    /// `v·f + w·n` for unit values of the ten parameters.
    #[inline(always)]
    fn row(&self, v: V3<L>, w: V3<L>) -> [L; 10] {
        let (o, al, a) = (self.omega, self.alpha, self.acc);
        let vd = mul_t(&self.d, v);
        let aw = cross(a, w);
        let u = cross(w, o);
        [
            dot(v, a),
            vd[0] + aw[0],
            vd[1] + aw[1],
            vd[2] + aw[2],
            w[0] * al[0] + u[0] * o[0],
            w[0] * al[1] + w[1] * al[0] + u[0] * o[1] + u[1] * o[0],
            w[0] * al[2] + w[2] * al[0] + u[0] * o[2] + u[2] * o[0],
            w[1] * al[1] + u[1] * o[1],
            w[1] * al[2] + w[2] * al[1] + u[1] * o[2] + u[2] * o[1],
            w[2] * al[2] + u[2] * o[2],
        ]
    }
}

/// Motions `(v_ij, w_ij)` that a unit rate of each joint of its chain gives to body `j`.
#[inline(always)]
fn unit_twists<L: Lanes>(
    tree: &Tree,
    j: usize,
    frames: &[Frame<L>],
    twists: &mut [(V3<L>, V3<L>)],
) {
    let first = tree.twist_start[j];
    let last = tree.chains[j].len() - 1;
    if let Some(parent) = tree.nodes[j].parent {
        let from = tree.twist_start[parent];
        let Frame { r, p, .. } = &frames[j];
        for k in 0..last {
            let (v, w) = (get(&twists[from + k].0), get(&twists[from + k].1));
            let (v, w) = (mul_t(r, add(v, cross(w, get(p)))), mul_t(r, w));
            set(&mut twists[first + k].0, v);
            set(&mut twists[first + k].1, w);
        }
    }
    let axis = splat3::<L>(&tree.nodes[j].axis);
    let (v, w) = match tree.nodes[j].motion {
        Motion::Revolute => (zero(), axis),
        Motion::Prismatic => (axis, zero()),
    };
    set(&mut twists[first + last].0, v);
    set(&mut twists[first + last].1, w);
}

/// The regressor of a closed chain for one pack: `Y = Gᵀ Y_tree`, `G = ∂q/∂q_a` being handed in.
/// Body `bodies[b]` writes columns `10·b ..`; actuator `a` is a row. For each body the motions of
/// its chain are first combined to the motion that a unit rate of the actuator gives,
/// `Σ_i G_ia (v_ij, w_ij)`, so that the ten columns are computed once per actuator.
///
/// # Safety
/// `pack` as in [`kinematics`]; `g` must hold coordinate `i`, actuator `a` at
/// `(i·actuators + a)·pack.stride`; `sink` must cover `10·bodies` columns and `actuators` rows.
#[inline(always)]
pub(crate) unsafe fn projected_regressor<L: Lanes>(
    tree: &Tree,
    bodies: &[usize],
    pack: Pack,
    g: *const f64,
    actuators: usize,
    s: &mut Scratch<L>,
    sink: Sink,
) {
    // SAFETY: by the caller's promise
    unsafe { kinematics(tree, pack, s) };
    let Scratch { frames, twists, .. } = s;
    for j in 0..tree.nodes.len() {
        unit_twists(tree, j, frames, twists);
    }
    for (b, &j) in bodies.iter().enumerate() {
        let state = State::of(&frames[j]);
        let first = tree.twist_start[j];
        for a in 0..actuators {
            let (mut v, mut w) = (zero(), zero());
            for (k, &i) in tree.chains[j].iter().enumerate() {
                let node = &tree.nodes[i];
                // SAFETY: by the caller's promise
                let rate =
                    unsafe { L::load(g.add((node.coordinate * actuators + a) * pack.stride)) }
                        * node.ratio;
                v = add(v, scale(get(&twists[first + k].0), rate));
                w = add(w, scale(get(&twists[first + k].1), rate));
            }
            let y = state.row(v, w);
            // SAFETY: by the caller's promise
            unsafe {
                let at = sink.base.add(10 * b * sink.column + a * sink.row);
                for c in 0..10 {
                    y[c].store(at.add(c * sink.column));
                }
            }
        }
    }
}

/// Writes the ten columns of every body for one pack; blocks that are zero by structure are not
/// touched.
///
/// # Safety
/// `pack` as in [`kinematics`]; `sink` must cover `10·bodies` columns and `dof` rows of
/// `L::WIDTH` samples, and hold zeros where mimic joints accumulate.
#[inline(always)]
pub(crate) unsafe fn regressor<L: Lanes>(tree: &Tree, pack: Pack, s: &mut Scratch<L>, sink: Sink) {
    // SAFETY: by the caller's promise
    unsafe { kinematics(tree, pack, s) };
    let Scratch { frames, twists, .. } = s;
    for (j, chain) in tree.chains.iter().enumerate() {
        let state = State::of(&frames[j]);
        let first = tree.twist_start[j];
        unit_twists(tree, j, frames, twists);
        for (k, &i) in chain.iter().enumerate() {
            let (v, w) = (get(&twists[first + k].0), get(&twists[first + k].1));
            let y = state.row(v, w);
            let node = &tree.nodes[i];
            // SAFETY: by the caller's promise
            unsafe {
                let at = sink
                    .base
                    .add(10 * j * sink.column + node.coordinate * sink.row);
                if tree.shared {
                    for c in 0..10 {
                        accumulate(at.add(c * sink.column), y[c] * node.ratio);
                    }
                } else {
                    for c in 0..10 {
                        y[c].store(at.add(c * sink.column));
                    }
                }
            }
        }
    }
}

/// Adds a pack to memory.
///
/// # Safety
/// `at .. at + L::WIDTH` must be readable and writable.
#[inline(always)]
unsafe fn accumulate<L: Lanes>(at: *mut f64, x: L) {
    // SAFETY: by the caller's promise
    unsafe { (L::load(at) + x).store(at) }
}

/// Inertial parameters as the wrench needs them.
#[derive(Clone, Copy)]
struct Params {
    m: f64,
    h: [f64; 3],
    i: [f64; 6],
}

#[inline(always)]
fn params(phi: &[f64], body: usize) -> Params {
    let p = &phi[10 * body..10 * body + 10];
    Params {
        m: p[0],
        h: [p[1], p[2], p[3]],
        i: [p[4], p[5], p[6], p[7], p[8], p[9]],
    }
}

/// Wrench of every body and, accumulated, of its subtree.
#[inline(always)]
fn wrenches<L: Lanes>(tree: &Tree, phi: &[f64], s: &mut Scratch<L>) {
    let Scratch { frames, flows, .. } = s;
    for (j, (b, flow)) in frames.iter().zip(flows.iter_mut()).enumerate() {
        let p = params(phi, j);
        let h = splat3::<L>(&p.h);
        let (o, al, a) = (get(&b.omega), get(&b.alpha), get(&b.acc));
        let f = add(
            scale(a, L::splat(p.m)),
            add(cross(al, h), cross(o, cross(o, h))),
        );
        let n = add(
            cross(h, a),
            add(sym_mul(&p.i, al), cross(o, sym_mul(&p.i, o))),
        );
        set(&mut flow.f, f);
        set(&mut flow.n, n);
    }
    for j in (0..frames.len()).rev() {
        if let Some(parent) = tree.nodes[j].parent {
            let (f, n) = (get(&flows[j].f), get(&flows[j].n));
            let Frame { r, p, .. } = &frames[j];
            let force = mul(r, f);
            let moment = add(mul(r, n), cross(get(p), force));
            increase(&mut flows[parent].f, force);
            increase(&mut flows[parent].n, moment);
        }
    }
}

/// Inverse dynamics of the rigid bodies for one pack: `τ = Y φ`, coordinate `j` at `tau + j·row`.
///
/// # Safety
/// `pack` as in [`kinematics`]; `tau` must cover `dof` rows of `L::WIDTH` samples; `phi` must
/// hold at least ten numbers a body.
#[inline(always)]
pub(crate) unsafe fn inverse_dynamics<L: Lanes>(
    tree: &Tree,
    phi: &[f64],
    pack: Pack,
    s: &mut Scratch<L>,
    tau: *mut f64,
    row: usize,
) {
    // SAFETY: by the caller's promise
    unsafe {
        kinematics(tree, pack, s);
        wrenches(tree, phi, s);
        for j in 0..tree.dof {
            L::splat(0.0).store(tau.add(j * row));
        }
        for (node, flow) in tree.nodes.iter().zip(&s.flows) {
            let a = splat3::<L>(&node.axis);
            let t = match node.motion {
                Motion::Revolute => dot(a, get(&flow.n)),
                Motion::Prismatic => dot(a, get(&flow.f)),
            };
            accumulate(tau.add(node.coordinate * row), t * node.ratio);
        }
    }
}

/// Outputs of [`adjoint`] for one parameter vector and one pack.
#[derive(Clone, Copy)]
pub(crate) struct Gradients {
    pub q: *mut f64,
    pub qd: *mut f64,
    pub qdd: *mut f64,
    pub row: usize,
}

/// Adds `Σ_j r_j ∂τ_j/∂(q, q̇, q̈)` to `out`, for rates `r` at `rates + j·rates_row`.
///
/// # Safety
/// As [`gradients`]; the scratch must hold the kinematics, and the wrenches of `phi`.
#[inline(always)]
unsafe fn adjoint<L: Lanes>(
    tree: &Tree,
    phi: &[f64],
    s: &mut Scratch<L>,
    rates: *const f64,
    rates_row: usize,
    out: Gradients,
) {
    let Scratch { frames, flows, .. } = s;
    // upwards: the motion that the rates give, and what each body's own power depends on
    for j in 0..frames.len() {
        let node = &tree.nodes[j];
        let Frame { r, p, omega: o, .. } = &frames[j];
        let o = get(o);
        let (mut v, mut w) = match node.parent {
            Some(parent) => {
                let (v, w) = (get(&flows[parent].v), get(&flows[parent].w));
                (mul_t(r, add(v, cross(w, get(p)))), mul_t(r, w))
            }
            None => (zero(), zero()),
        };
        // SAFETY: by the caller's promise
        let rate = unsafe { L::load(rates.add(node.coordinate * rates_row)) } * node.ratio;
        let a = scale(splat3::<L>(&node.axis), rate);
        match node.motion {
            Motion::Revolute => w = add(w, a),
            Motion::Prismatic => v = add(v, a),
        }
        let pr = params(phi, j);
        let h = splat3::<L>(&pr.h);
        let flow = &mut flows[j];
        set(&mut flow.v, v);
        set(&mut flow.w, w);
        set(&mut flow.acc, add(scale(v, L::splat(pr.m)), cross(w, h)));
        set(&mut flow.alpha, add(cross(h, v), sym_mul(&pr.i, w)));
        let linear = add(cross(cross(o, h), v), cross(h, cross(v, o)));
        let angular = add(cross(sym_mul(&pr.i, o), w), sym_mul(&pr.i, cross(w, o)));
        set(&mut flow.omega, add(linear, angular));
    }
    // downwards: adjoints of acceleration and velocity; those of (v, w) are the wrenches
    for j in (0..frames.len()).rev() {
        let node = &tree.nodes[j];
        let b = &frames[j];
        let (below, here) = flows.split_at_mut(j);
        let fl = &here[0];
        let a = splat3::<L>(&node.axis);
        let (f, n, v, w) = (get(&fl.f), get(&fl.n), get(&fl.v), get(&fl.w));
        let (acc_bar, alpha_bar, omega_bar) = (get(&fl.acc), get(&fl.alpha), get(&fl.omega));
        let (o, al) = (get(&b.omega), get(&b.alpha));
        let oa = cross(o, a);
        let (dq, dqd, dqdd, omega);
        match node.motion {
            Motion::Revolute => {
                omega = add(omega_bar, scale(cross(a, alpha_bar), b.qd));
                let twist = add(
                    add(cross(omega, o), cross(alpha_bar, sub(al, scale(oa, b.qd)))),
                    add(cross(acc_bar, get(&b.acc)), add(cross(n, w), cross(f, v))),
                );
                dq = dot(a, twist);
                dqd = dot(a, omega_bar) + dot(alpha_bar, oa);
                dqdd = dot(a, alpha_bar);
            }
            Motion::Prismatic => {
                omega = add(omega_bar, scale(cross(a, acc_bar), b.qd + b.qd));
                dq = dot(acc_bar, add(cross(al, a), cross(o, oa))) + dot(f, cross(w, a));
                dqd = dot(acc_bar, oa) * 2.0;
                dqdd = dot(a, acc_bar);
            }
        }
        // SAFETY: by the caller's promise
        unsafe {
            let k = node.coordinate * out.row;
            accumulate(out.q.add(k), dq * node.ratio);
            accumulate(out.qd.add(k), dqd * node.ratio);
            accumulate(out.qdd.add(k), dqdd * node.ratio);
        }
        if let Some(parent) = node.parent {
            let (r, p, o) = (&b.r, get(&b.p), get(&frames[parent].omega));
            let g = mul(r, acc_bar);
            let up = &mut below[parent];
            increase(&mut up.acc, g);
            increase(&mut up.alpha, add(mul(r, alpha_bar), cross(p, g)));
            let lever = add(cross(cross(o, p), g), cross(p, cross(g, o)));
            increase(&mut up.omega, add(mul(r, omega), lever));
        }
    }
}

/// Kinematics once, then for each of several parameter vectors `φ_k` with rates `r_k` the
/// gradient of `Σ_j r_kj τ_j(q, q̇, q̈; φ_k)`, added to `out`.
///
/// `parameters` holds the vectors one after another, `each` numbers apart; `rates` and `out` of
/// vector `k` are `k·step` further, coordinate `j` at `j·out.row`.
///
/// # Safety
/// `pack` as in [`kinematics`]; `rates` and the three arrays of `out` must cover
/// `parameters.len()/each` blocks of `dof` rows of `L::WIDTH` samples.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(crate) unsafe fn gradients<L: Lanes>(
    tree: &Tree,
    parameters: &[f64],
    each: usize,
    pack: Pack,
    s: &mut Scratch<L>,
    rates: *const f64,
    out: Gradients,
    step: usize,
) {
    // SAFETY: by the caller's promise
    unsafe {
        kinematics(tree, pack, s);
        for (k, phi) in parameters.chunks_exact(each).enumerate() {
            wrenches(tree, phi, s);
            let out = Gradients {
                q: out.q.add(k * step),
                qd: out.qd.add(k * step),
                qdd: out.qdd.add(k * step),
                row: out.row,
            };
            adjoint(tree, phi, s, rates.add(k * step), out.row, out);
        }
    }
}
