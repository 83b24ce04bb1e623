//! What is stated, against what the torques say.

use super::claim::{Claim, Means};
use super::families::{OF_OTHERS, alike};
use super::search::{Hypothesis, Problem};
use super::verdict::{MATERIAL, SHARE, Verdict, contradicts, explained};
use crate::dynamics::Workspace;
use crate::error::{Warning, WarningKind};
use crate::log::names;
use crate::plant::Plant;

/// States, and their seed, that a joint is weighed by.
const STATES: (usize, u64) = (100, 0x11_67);
/// How far a claim is believed that the torques contradict.
const DOUBTED: f64 = 0.3;
/// Torque of a joint, as a share of the largest of the robot, below which a sign alone is not judged by it: friction
/// and armature that the model lacks are as large.
const LIGHT: f64 = 0.05;

/// Joints whose torques by the model are small beside those of the others.
fn light(plant: &Plant) -> Vec<bool> {
    let states = plant.random_states(STATES.0, STATES.1);
    let Ok(torque) = plant.nominal_torque(&states) else {
        return vec![true; plant.actuators().len()];
    };
    let power: Vec<f64> = torque
        .chunks(states.count.max(1))
        .map(|of| of.iter().map(|x| x * x).sum())
        .collect();
    let largest = power.iter().copied().fold(0.0, f64::max);
    power.iter().map(|p| *p < LIGHT * LIGHT * largest).collect()
}

/// The best hypothesis with the stated sign of each joint whose turned sign alone is not as clear as a contradiction
/// must be: of a light joint, friction that is not that of the model decides it.
fn settled(problem: &Problem, stated: &Hypothesis, best: &Hypothesis, plant: &Plant) -> Hypothesis {
    let mut out = best.clone();
    if stated == best {
        return out;
    }
    for (j, light) in light(plant).into_iter().enumerate() {
        if out.column[j] != stated.column[j] || out.sign[j] == stated.sign[j] {
            continue;
        }
        let mut back = out.clone();
        back.sign[j] = stated.sign[j];
        if light || !contradicts(problem, &out, &back) {
            out = back;
        }
    }
    out
}

/// Compares what is stated with what the torques say; contradictions are warnings with the evidence. Returns whether there
/// is none.
#[allow(clippy::too_many_arguments)]
pub(super) fn contradict(
    problem: &Problem,
    stated: &Hypothesis,
    best: &Hypothesis,
    verdict: &Verdict,
    claims: &mut [Claim],
    positions: &[usize],
    torques: &[usize],
    plant: &Plant,
    warnings: &mut Vec<Warning>,
) -> bool {
    let joints = plant.actuators();
    let n = joints.len();
    let best = &settled(problem, stated, best, plant);
    let differs = stated != best && contradicts(problem, best, stated);
    // signs and gains of torques are those beside the positions as they will be read
    let held = if differs { best } else { stated };
    let matches = &problem.matches(held, &mut Workspace::default());
    for j in 0..n {
        let (stated_k, best_k) = (positions[stated.column[j]], positions[best.column[j]]);
        let same = stated_k == best_k && best.sign[j] == stated.sign[j];
        if same || !verdict.sure(j) || !differs {
            if same && verdict.sure(j) && explained(matches, j, torques) {
                claims[stated_k].confidence = claims[stated_k].confidence.max(0.98);
                claims[stated_k]
                    .evidence
                    .push_str("; the model's torques confirm joint and sign");
            }
            continue;
        }
        let what = match stated_k == best_k {
            true => "with the sign turned".to_string(),
            false => format!(
                "as column {}{}",
                claims[best_k].column,
                if best.sign[j] < 0.0 {
                    " with the sign turned"
                } else {
                    ""
                }
            ),
        };
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            &joints[j].name,
            format!(
                "its position is stated to be column {}, but the model explains the torques clearly better {what}: is \
                 it swapped or turned?",
                claims[stated_k].column
            ),
        ));
        for (k, c) in claims.iter_mut().enumerate() {
            if k == stated_k || c.of == Some(stated_k) {
                c.confidence = c.confidence.min(DOUBTED);
            }
        }
    }
    // signs and gains of stated torques
    let mut told = Vec::new();
    for (c, &k) in torques.iter().enumerate() {
        let Some(j) = claims[k]
            .at
            .filter(|_| matches!(claims[k].means, Means::Torque | Means::Current))
        else {
            continue;
        };
        let Some(m) = matches.get(j).map(|r| r[c]) else {
            continue;
        };
        // with the positions as the torques want them, another joint may explain this column
        let most = matches.iter().map(|r| r[c].share).fold(0.0, f64::max);
        if differs && verdict.torque[c] && 1.0 - most < MATERIAL * (1.0 - m.share) {
            claims[k].confidence = claims[k].confidence.min(DOUBTED);
            claims[k].evidence +=
                "; with other positions the torque of another joint is clearly nearer to it";
        }
        if differs || m.rigid < 0.5 || m.share < SHARE {
            continue;
        }
        let gain = m.gain * claims[k].factor();
        if claims[k].means == Means::Current {
            claims[k].sign = m.gain.signum();
            claims[k].scale = 1.0 / m.gain.abs();
            told.push(k);
            claims[k]
                .evidence
                .push_str("; gain from the nominal model, good to a few parts in ten");
            claims[k].confidence = claims[k].confidence.max(0.9);
        } else if gain < 0.0 {
            warnings.push(Warning::new(
                WarningKind::UnitSuspect,
                &claims[k].column,
                format!(
                    "it counts against the torque of {}: its sign is turned",
                    joints[j].name
                ),
            ));
            claims[k].sign = -claims[k].sign;
        } else {
            claims[k].confidence = claims[k].confidence.max(0.97);
        }
        if m.weightless && m.rigid > 0.8 {
            claims[k].without = vec!["gravity"];
        }
    }
    others(claims, torques, &told);
    !differs
}

/// Currents whose gain the bodies do not tell, beside those `told`: it is the middle of the others where they are alike.
fn others(claims: &mut [Claim], torques: &[usize], told: &[usize]) {
    let Some(gain) = alike(told.iter().map(|&k| claims[k].scale)) else {
        return;
    };
    for &k in torques {
        let c = &mut claims[k];
        let unit = c.unit.and_then(names::unit).map_or(1.0, |(_, f)| f);
        if c.means != Means::Current || c.scale != unit || c.at.is_none() || told.contains(&k) {
            continue;
        }
        c.scale = gain;
        c.confidence = c.confidence.min(0.6);
        c.gain_of_others = true;
        c.evidence += OF_OTHERS;
    }
}
