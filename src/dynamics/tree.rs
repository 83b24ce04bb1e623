//! The robot flattened for the kernels: constants per body, and which bodies move which.

use crate::robot::{Motion, Robot};
use nalgebra::{Matrix3, Vector3};

/// Constants of one body.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub parent: Option<usize>,
    pub motion: Motion,
    /// unit axis in body axes
    pub axis: [f64; 3],
    /// `R_PB(q) = r0 + sin(q) rs + cos(q) rc` (revolute), `r0` (prismatic)
    pub r0: [[f64; 3]; 3],
    pub rs: [[f64; 3]; 3],
    pub rc: [[f64; 3]; 3],
    /// origin in the parent's frame at zero position
    pub position: [f64; 3],
    /// `R_PB axis`, along which a prismatic joint slides, in parent axes
    pub slide: [f64; 3],
    pub coordinate: usize,
    pub ratio: f64,
    pub offset: f64,
}

/// A robot as the kernels read it: immutable, shared by all threads.
#[derive(Debug, Clone)]
pub struct Tree {
    pub(crate) nodes: Vec<Node>,
    /// for each body its chain from the base to itself
    pub(crate) chains: Vec<Vec<usize>>,
    /// where the stretch of body `j` starts in a list of all (body, ancestor) pairs
    pub(crate) twist_start: Vec<usize>,
    pub(crate) gravity: [f64; 3],
    pub(crate) dof: usize,
    /// whether some coordinate moves several bodies (mimic joints)
    pub(crate) shared: bool,
}

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

impl Tree {
    /// Flattens a robot.
    pub fn new(robot: &Robot) -> Self {
        let nodes: Vec<Node> = robot
            .bodies
            .iter()
            .map(|b| {
                let a: Vector3<f64> = b.axis;
                let aa = a * a.transpose();
                let (r0, rs, rc) = match b.motion {
                    Motion::Revolute => (
                        b.rotation * aa,
                        b.rotation * crate::robot::inertia::skew(&a),
                        b.rotation * (Matrix3::identity() - aa),
                    ),
                    Motion::Prismatic => (b.rotation, Matrix3::zeros(), Matrix3::zeros()),
                };
                Node {
                    parent: b.parent,
                    motion: b.motion,
                    axis: a.into(),
                    r0: rows(&r0),
                    rs: rows(&rs),
                    rc: rows(&rc),
                    position: b.position.into(),
                    slide: (b.rotation * a).into(),
                    coordinate: b.coordinate,
                    ratio: b.ratio,
                    offset: b.offset,
                }
            })
            .collect();
        let mut chains: Vec<Vec<usize>> = Vec::with_capacity(nodes.len());
        let mut used = vec![false; robot.joints.len()];
        let mut shared = false;
        for (i, node) in nodes.iter().enumerate() {
            let mut chain = node.parent.map(|p| chains[p].clone()).unwrap_or_default();
            chain.push(i);
            chains.push(chain);
            shared |= std::mem::replace(&mut used[node.coordinate], true);
        }
        let mut twist_start = vec![0];
        for chain in &chains {
            twist_start.push(twist_start[twist_start.len() - 1] + chain.len());
        }
        Tree {
            nodes,
            chains,
            twist_start,
            gravity: robot.gravity.into(),
            dof: robot.joints.len(),
            shared,
        }
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.nodes.len()
    }

    /// Number of coordinates.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Whether coordinate `j` moves body `b` (otherwise that block of the regressor is zero).
    pub fn moves(&self, j: usize, b: usize) -> bool {
        self.chains[b]
            .iter()
            .any(|&i| self.nodes[i].coordinate == j)
    }
}
