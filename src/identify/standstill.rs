//! Equations of joints that stand still ([`crate::signals::standstill`]).
//!
//! The torque of a joint at rest differs from that of the rigid bodies by any friction up to the break-away
//! value, while the column of Coulomb friction takes the sign of what little velocity the noise of the
//! position makes. Neither is information. Where a joint with Coulomb friction is slow for more than half of
//! what the filter sees, its equation is left out; those of the other joints stay. A reversal passes in less and
//! is kept.

use super::stack::Stack;
use crate::error::{Result, Warning, WarningKind};
use crate::plant::Plant;
use crate::robot::JointTerm;
use crate::signals::{Prepared, standstill};
use std::borrow::Cow;

/// Share of what the filter sees in which a joint is slow, beyond which it stands.
const SHARE: f64 = 0.5;

/// Leaves the equations of joints that stand still out of the fit records, and says which; `None` where there is nothing to
/// leave out.
///
/// # Errors
/// A pose of a parallel robot that cannot be reached.
pub fn leave_out(
    plant: &Plant,
    fit: &mut [Cow<'_, Stack>],
    prepared: &[&Prepared],
) -> Result<Option<Warning>> {
    let joints = plant.actuators();
    let coulomb = JointTerm::Coulomb as usize;
    let dry: Vec<usize> = (0..joints.len())
        .filter(|&a| joints[a].identify[coulomb] || joints[a].terms[coulomb] != 0.0)
        .collect();
    if dry.is_empty() {
        return Ok(None);
    }
    for (stack, p) in fit.iter_mut().zip(prepared) {
        let motion = plant.drive_motion(&p.motion)?;
        for &a in &dry {
            let row = a * p.count()..(a + 1) * p.count();
            let joint = standstill::Joint {
                position_noise: 0.0,
                velocity_noise: p.velocity_noise[a],
                motion: joints[a].motion,
            };
            let slow = standstill::slow(joint, &motion.q[row.clone()], &motion.qd[row]);
            if !p.filter.may_exceed(&slow, SHARE) {
                continue;
            }
            let still: Vec<f64> = slow.into_iter().map(f64::from).collect();
            for (k, share) in p.filter.apply(&still).into_iter().enumerate() {
                if share > SHARE {
                    stack.to_mut().leave_out(a, k);
                }
            }
        }
    }
    let named: Vec<String> = dry
        .iter()
        .filter_map(|&a| {
            let all: usize = fit.iter().map(|s| s.count).sum();
            let used: usize = fit.iter().map(|s| s.used(a)).sum();
            let percent = 100.0 * (all - used) as f64 / all as f64;
            (used < all).then(|| format!("{} {percent:.1} %", joints[a].name))
        })
        .collect();
    if named.is_empty() {
        return Ok(None);
    }
    Ok(Some(Warning::new(
        WarningKind::StandstillLeftOut,
        "standstill",
        format!(
            "equations of joints that stand still were left out of the fit, because friction at rest can have any \
             value up to Coulomb's: {}",
            named.join(", ")
        ),
    )))
}
