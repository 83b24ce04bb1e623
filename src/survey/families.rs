//! Columns of torques, currents and commands once the joints are known, and columns that stand in rows.

use super::claim::{Claim, Means};
use super::kinematics::Smooth;
use super::search::{Hypothesis, Match};
use super::verdict::{Orientation, SHARE, Verdict};
use crate::plant::Plant;

/// Margin of a joint over all others for a column of torques, in shares left unexplained.
const AHEAD: f64 = 0.6;

/// Least share of what friction leaves that the bodies explain, for a gain to be told.
const RIGID: f64 = 0.4;

/// Columns of torques and currents: joint, gain, what is missing in them.
#[allow(clippy::too_many_arguments)]
pub(super) fn families(
    smooth: &Smooth,
    claims: &mut [Claim],
    matches: &[Vec<Match>],
    torques: &[usize],
    plant: &Plant,
    best: &Hypothesis,
    usual: &[Orientation],
    verdict: &Verdict,
) {
    let n = best.column.len();
    let joints = plant.actuators();
    // each column's joint, where it is far ahead of all others
    let mut of: Vec<Option<usize>> = Vec::new();
    #[allow(clippy::needless_range_loop)]
    for c in 0..torques.len() {
        let j = (0..n).max_by(|a, b| matches[*a][c].share.total_cmp(&matches[*b][c].share));
        let second = (0..n)
            .filter(|i| Some(*i) != j)
            .map(|i| matches[i][c].share)
            .fold(0.0, f64::max);
        of.push(j.filter(|&j| {
            let share = matches[j][c].share;
            usual[j].known
                && verdict.torque[c]
                && share > SHARE
                && (1.0 - share) < AHEAD * (1.0 - second)
        }));
    }
    let gain = |c: usize, j: usize| matches[j][c].gain;
    for j in 0..n {
        let mut mine: Vec<usize> = (0..torques.len()).filter(|&c| of[c] == Some(j)).collect();
        // the noisiest is measured: what a model makes has no noise
        mine.sort_by(|a, b| smooth.grain[torques[*b]].total_cmp(&smooth.grain[torques[*a]]));
        for (rank, &c) in mine.iter().enumerate() {
            let k = torques[c];
            let (m, g) = (matches[j][c], gain(c, j));
            let made = rank > 0 && smooth.grain[k] < 0.5 * smooth.grain[torques[mine[0]]];
            if m.rigid < RIGID && best.column.len() > 1 {
                claims[k].abstain(
                    "it goes with the friction of a joint; its gain and what it is the bodies do not tell",
                );
                continue;
            }
            if rank > 0 && !made {
                claims[k].abstain(
                    "a second column of the same joint's torque that cannot be told from the first",
                );
                continue;
            }
            if made {
                claims[k].means = Means::Command;
                claims[k].commands = Some("torque");
                claims[k].confidence = 0.6;
            } else {
                // one or a power of ten within what a nominal model may be wrong by
                let size = g.abs();
                let power = 10f64.powf((size.log10() / 3.0).round() * 3.0);
                let near = (0.6..1.67).contains(&(size / power));
                claims[k].means = if near { Means::Torque } else { Means::Current };
                claims[k].scale = if near { 1.0 / power } else { 1.0 / size };
                claims[k].side = if near { None } else { Some("motor") };
                claims[k].unit = if near { None } else { Some("A") };
                claims[k].confidence = 0.9;
                if m.weightless {
                    claims[k].without = vec!["gravity"];
                }
            }
            claims[k].sign = g.signum() * usual[j].sign * best.sign[j];
            claims[k].confidence = claims[k].confidence.min(usual[j].confidence);
            claims[k].at = Some(j);
            claims[k].joint = Some(joints[j].name.clone());
            claims[k].evidence = format!(
                "{:.0} % of it is the torque of {} with friction, {:.0} % of the rest of it that of the model's bodies{}",
                100.0 * m.share,
                joints[j].name,
                100.0 * m.rigid,
                if made {
                    "; it has less noise than another: commanded, filtered or made by a model"
                } else {
                    ""
                }
            );
        }
    }
}

/// Runs of as many columns as there are joints, most of which mean the same of the joints in their order: the others of
/// the run mean it, too. A shuffled table has no such runs.
pub(super) fn blocks(claims: &mut [Claim], plant: &Plant) {
    let joints = plant.actuators();
    let n = joints.len();
    if n < 4 {
        return;
    }
    let mut from = 0;
    while from + n <= claims.len() {
        let part = &claims[from..from + n];
        let sure = |c: &Claim| c.confidence >= 0.5 && c.at.is_some();
        let placed = part
            .iter()
            .enumerate()
            .filter(|(j, c)| sure(c) && c.at == Some(*j))
            .count();
        let misplaced = part
            .iter()
            .enumerate()
            .any(|(j, c)| sure(c) && c.at != Some(j));
        let count = |m: Means| part.iter().filter(|c| sure(c) && c.means == m).count();
        let kinds = [
            Means::Position,
            Means::Velocity,
            Means::Acceleration,
            Means::Torque,
            Means::Current,
            Means::Command,
        ];
        let means = kinds
            .into_iter()
            .max_by_key(|m| count(*m))
            .unwrap_or(Means::Other);
        let turned = part
            .iter()
            .any(|c| sure(c) && c.means == means && c.sign < 0.0);
        if misplaced
            || 2 * placed <= n
            || 3 * count(means) < n.max(6)
            || 2 * count(means) < placed
            || turned
        {
            from += 1;
            continue;
        }
        // commands of positions and of torques do not stand in one row
        let like = part.iter().find(|c| sure(c) && c.means == means).cloned();
        for (j, joint) in joints.iter().enumerate() {
            let c = &mut claims[from + j];
            if sure(c) && c.means == means {
                continue;
            }
            let Some(like) = &like else { continue };
            let torque = matches!(means, Means::Torque | Means::Current | Means::Command);
            let scale = if torque && sure(c) {
                c.scale
            } else {
                like.scale
            };
            *c = Claim {
                column: c.column.clone(),
                at: Some(j),
                joint: Some(joint.name.clone()),
                scale,
                of: None,
                delay: 0.0,
                confidence: 0.7,
                evidence: format!(
                    "it stands in the row of the {placed} columns beside it, in the order of the joints"
                ),
                ..like.clone()
            };
        }
        from += n;
    }
}
