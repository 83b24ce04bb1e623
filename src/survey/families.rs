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

/// Factor within which a nominal model is right about a torque.
const SAME: std::ops::Range<f64> = 0.6..1.67;
/// Share explained of a column by another of the same joint's torque in the same unit.
const TWIN: f64 = 0.9;
/// Largest torque of a joint in a record, as a share of its limit: anything within a factor of less than a thousand.
const USED: std::ops::Range<f64> = 0.004..1.5;
/// Factor within which the gains of all drives are for one of them to be taken from the others.
const ALIKE: f64 = 1.5;

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
    late: &[f64],
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
    // what the bodies tell of each column: its gain
    let gains: Vec<Option<Gain>> = (0..torques.len())
        .map(|c| {
            let m = &matches[of[c]?][c];
            (m.rigid >= RIGID || n == 1).then(|| Gain::new(m.gain))
        })
        .collect();
    let grain = |c: &usize| smooth.grain[torques[*c]];
    // the noisiest is measured: what a model makes has no noise
    let measured: Vec<Gain> = (0..n)
        .filter_map(|j| {
            let mine = (0..torques.len()).filter(|&c| of[c] == Some(j));
            gains[mine.max_by(|a, b| grain(a).total_cmp(&grain(b)))?]
        })
        .collect();
    for j in 0..n {
        let mut mine: Vec<usize> = (0..torques.len()).filter(|&c| of[c] == Some(j)).collect();
        mine.sort_by(|a, b| grain(b).total_cmp(&grain(a)));
        let mut unit = None;
        for (rank, &c) in mine.iter().enumerate() {
            let k = torques[c];
            let (m, sign) = (&matches[j][c], matches[j][c].gain.signum());
            let made = rank > 0 && smooth.grain[k] < 0.5 * smooth.grain[torques[mine[0]]];
            if rank > 0 && !made {
                claims[k].abstain(
                    "a second column of the same joint's torque that cannot be told from the first",
                );
                continue;
            }
            let largest = |m: f64, x: &f64| m.max(x.abs());
            let gain = match gains[c] {
                Some(g) => Some((g, 0.9)),
                // one that is as large as the measured one is in its unit
                None if made => smooth
                    .follows(&smooth.value[torques[mine[0]]], &smooth.value[k])
                    .filter(|f| f.share > TWIN && SAME.contains(&f.slope.abs()))
                    .and(unit),
                None => {
                    let most = smooth.value[k].iter().fold(0.0, largest);
                    Gain::of_others(&measured, most, joints[j].limits.effort)
                }
            };
            let Some((gain, confidence)) = gain else {
                claims[k].abstain(
                    "it goes with the friction of a joint; its gain and what it is the bodies do not tell",
                );
                continue;
            };
            if rank == 0 {
                unit = Some((gain, confidence));
            }
            claims[k].means = match gain.torque {
                _ if made => Means::Command,
                true => Means::Torque,
                false => Means::Current,
            };
            claims[k].commands = made.then_some("torque");
            claims[k].scale = gain.scale;
            claims[k].side = (!made && !gain.torque).then_some("motor");
            claims[k].unit = (!gain.torque).then_some("A");
            if m.weightless && gains[c].is_some() {
                claims[k].without = vec!["gravity"];
            }
            claims[k].sign = sign * usual[j].sign * best.sign[j];
            claims[k].sign_known = usual[j].told;
            claims[k].delay = late[c];
            let confidence = if made { 0.6 } else { confidence };
            claims[k].confidence = usual[j].confidence.min(confidence);
            claims[k].at = Some(j);
            claims[k].joint = Some(joints[j].name.clone());
            claims[k].gain_of_others = gains[c].is_none() && !gain.torque;
            claims[k].evidence = format!(
                "{:.0} % of it is the torque of {} with friction, {:.0} % of the rest of it that of the model's bodies{}{}",
                100.0 * m.share,
                joints[j].name,
                100.0 * m.rigid,
                match (gains[c].is_some(), gain.torque) {
                    (true, _) => "",
                    (_, true) =>
                        "; its unit is that of the other columns, by its size and the joint's limit",
                    (_, false) => OF_OTHERS,
                },
                if made {
                    "; it has less noise than another: commanded, filtered or made by a model"
                } else {
                    ""
                }
            );
        }
    }
}

/// What makes a column a torque in N m.
#[derive(Clone, Copy)]
struct Gain {
    /// whether it is one or a power of a thousand, within what a nominal model may be wrong by
    torque: bool,
    scale: f64,
}

impl Gain {
    fn new(gain: f64) -> Self {
        let size = gain.abs();
        let power = 10f64.powf((size.log10() / 3.0).round() * 3.0);
        let torque = SAME.contains(&(size / power));
        Gain {
            torque,
            scale: if torque { 1.0 / power } else { 1.0 / size },
        }
    }

    /// … of a column that the bodies do not explain: what the others are, in the unit in which it is a torque that the
    /// joint can have; with its confidence.
    fn of_others(known: &[Gain], most: f64, effort: f64) -> Option<(Self, f64)> {
        let torques = known.iter().filter(|g| g.torque).count();
        if known.len() < 2 {
            return None;
        }
        if 3 * torques >= 2 * known.len() {
            let scale = [1e-3, 1.0, 1e3]
                .into_iter()
                .find(|s| USED.contains(&(most * s / effort)))?;
            return Some((
                Gain {
                    torque: true,
                    scale,
                },
                0.8,
            ));
        }
        let middle = alike(known.iter().map(|g| g.scale)).filter(|_| torques == 0)?;
        let gain = Gain {
            torque: false,
            scale: middle,
        };
        Some((gain, 0.6))
    }
}

/// What is said of a gain that is [`alike`] others.
pub(super) const OF_OTHERS: &str =
    "; its gain is the middle of the others: the bodies do not tell it";

/// The middle of the gains of drives, where there are several and all are about the same.
pub(super) fn alike(gains: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let middle = crate::median::median(gains.clone());
    let same = gains.clone().all(|g| (g / middle).ln().abs() < ALIKE.ln());
    (same && gains.count() > 1).then_some(middle)
}

/// What a column is, without telling torques, currents and their commands apart.
fn kind(c: &Claim) -> Means {
    match (c.means, c.commands) {
        (Means::Current, _) | (Means::Command, Some("torque")) => Means::Torque,
        (other, _) => other,
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
        // a row of torques may hold some that pass for currents or commands, and nothing else
        let like = part.iter().find(|c| sure(c) && c.means == means);
        let row = like.map_or(Means::Other, kind);
        if misplaced
            || 2 * placed <= n
            || 3 * count(means) < n.max(6)
            || 2 * count(means) < placed
            || turned
            || part.iter().any(|c| c.confidence >= 0.5 && kind(c) != row)
        {
            from += 1;
            continue;
        }
        // commands of positions and of torques do not stand in one row
        let like = part.iter().find(|c| sure(c) && c.means == means).cloned();
        let alike = part.iter().filter(|c| sure(c) && c.means == means);
        let middle = crate::median::median(alike.map(|c| c.scale));
        for (j, joint) in joints.iter().enumerate() {
            let c = &mut claims[from + j];
            if sure(c) && c.means == means {
                continue;
            }
            let Some(like) = &like else { continue };
            // a torque in N m that turns out to be a current has the gain of currents
            let scale = match sure(c) && kind(c) == kind(like) && c.unit == like.unit {
                true => c.scale,
                false => middle,
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
