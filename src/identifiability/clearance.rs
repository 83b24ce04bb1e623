//! What a trajectory comes near to.

use crate::collision::Scene;
use crate::collision::scene::{LeftOut, poses};
use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::{ClearanceCertificate, Plant};
use crate::robot::geometry::Origin;

/// Volumes of one link.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct LinkVolumes {
    /// name of the link
    pub link: String,
    /// number of its spheres, capsules and boxes
    pub shapes: usize,
    /// where they come from
    pub origin: Origin,
    /// volume of fitted ones over that of the convex hull of the link's geometry
    pub tightness: Option<f64>,
    /// furthest that a fitted one reaches outside that hull, m
    pub protrusion: Option<f64>,
}

/// How near a trajectory brings the robot to itself and to what stands around it.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Clearances {
    /// least clearances over all time
    pub certificate: ClearanceCertificate,
    /// least distance of any two at the samples of [`Excitation::motion`](super::Excitation::motion), m
    pub least: Vec<f64>,
    /// pairs that are not looked at, and why
    pub left_out: Vec<LeftOut>,
    /// volumes of the links
    pub volumes: Vec<LinkVolumes>,
}

impl Clearances {
    /// Of a motion of the coordinates, with the certificate of its trajectory.
    pub(super) fn of(
        plant: &Plant,
        scene: &Scene,
        certificate: ClearanceCertificate,
        motion: &Samples,
    ) -> Result<Self> {
        let geometry = &plant.robot().geometry;
        let volumes = scene.fitted.links.iter().map(|v| LinkVolumes {
            link: geometry.links[v.link].name.clone(),
            shapes: v.shapes.len(),
            origin: v.origin,
            tightness: v.tightness,
            protrusion: v.protrusion,
        });
        let mut at = Vec::new();
        let mut least = Vec::with_capacity(motion.count);
        for i in 0..motion.count {
            let x: Vec<f64> = (0..motion.dof)
                .map(|k| motion.q[k * motion.count + i])
                .collect();
            poses(plant.robot(), &plant.posture(&x)?, &mut at);
            // the faces of a [[keep_in]] have no margin and are no volumes
            let face = |margin: f64| margin == 0.0 && scene.margin > 0.0;
            let all = scene.pairs.iter().filter(|p| !face(p.margin));
            let all = all.map(|p| scene.separation(p, &at).distance);
            least.push(all.fold(f64::INFINITY, f64::min));
        }
        Ok(Clearances {
            certificate,
            least,
            left_out: scene.left_out.clone(),
            volumes: volumes.collect(),
        })
    }
}
