//! One case: a machine, its effects, its records, and what the generator knows about them.

use crate::disturb::Disturbance;
use crate::effects::{self, Effect};
use crate::motion::{self, Record};
use crate::plant::Plant;
use crate::random::Random;
use crate::refit::{Prepared, energy, parameters, solve};
use crate::robots::{self, Machine};
use crate::simulate::{self, Log, MARGIN, Raw};
use nalgebra::DVector;

/// Largest size of an effect: what a robot that still works can have.
const STRONGEST: f64 = 4.0;

/// Smallest size: below it a case would be none of its effect.
const WEAKEST: f64 = 0.01;

/// What a case is to be.
#[derive(Clone, Debug)]
pub struct Plan {
    pub index: usize,
    pub kind: &'static str,
    pub effects: Vec<&'static str>,
    /// Visible share of the effect over the torque noise that its size is chosen for.
    pub target: f64,
}

/// A case as written.
pub struct Case {
    pub plan: Plan,
    pub machine: Machine,
    pub effects: Vec<Effect>,
    pub records: Vec<Record>,
    pub logs: Vec<Log>,
    pub figures: Figures,
}

/// Root mean squares per joint in units of the torque noise, noise-free, over the fit records; and mean
/// squares of the held-out ones.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    pub frozen: Vec<f64>,
    pub refit: Vec<f64>,
    /// Of each effect alone.
    pub visible: Vec<f64>,
    pub visible_frozen: Vec<f64>,
    /// Held-out energy: nominal, refitted, refitted with the true effect known, nominal with it.
    pub holdout: [f64; 4],
}

/// Machine and plant share these choices across the sizes of an effect.
struct Setting {
    machine: Machine,
    records: Vec<Record>,
    bandwidth: f64,
    jitter: f64,
    seed: u64,
    index: usize,
}

/// A joint term that the true machine has in another size than usual, or that its model lacks.
fn adjust(machine: &Machine, effects: &[Effect]) -> Machine {
    let mut m = machine.clone();
    for e in effects {
        let (d, nominal) = (&mut m.drives[e.joint], &mut m.nominal_drives[e.joint]);
        let (term, value, model) = match e.name {
            "rotor_inertia" => (0, &mut d.armature, &mut nominal.armature),
            "viscous_friction" => (1, &mut d.viscous, &mut nominal.viscous),
            "coulomb_friction" => (2, &mut d.coulomb, &mut nominal.coulomb),
            "torque_offset" => (3, &mut d.offset, &mut nominal.offset),
            _ => continue,
        };
        if term == 3 {
            *value = 0.03 * d.effort * if e.shape[5] < 0.5 { -1.0 } else { 1.0 };
        }
        *value *= e.strength;
        *model = 0.0;
        nominal.identify[term] = false;
    }
    m
}

impl Setting {
    /// Simulates the records in their order; a thermal state cools between them.
    fn simulate(
        &self,
        effects: &[Effect],
        used: impl Fn(&Record) -> bool,
    ) -> Option<(Machine, Vec<Raw>)> {
        let machine = adjust(&self.machine, effects);
        let mut plant = Plant::new(&machine, effects);
        let mut out = Vec::new();
        for (i, record) in self.records.iter().enumerate() {
            if !used(record) {
                continue;
            }
            let mut rng = Random::new(self.seed, self.index, 16 + i as u64);
            let end = record.duration() + 1.0;
            let outer = Disturbance::new(effects, &machine, simulate::lead(record), end, &mut rng);
            out.push(simulate::run(
                &machine,
                &mut plant,
                record,
                &outer,
                self.bandwidth,
            )?);
            for axis in &mut plant.axes {
                axis.friction.rest(20.0);
            }
        }
        Some((machine, out))
    }

    /// Largest joint residual of the frozen and of the refitted model over the fit records.
    fn visible(&self, effects: &[Effect], all: bool) -> Option<[Vec<f64>; 2]> {
        let used = |r: &Record| r.fit && (all || r.creep || r.name == "fit_1");
        let (machine, raw) = self.simulate(effects, used)?;
        let fit: Vec<&Record> = self.records.iter().filter(|r| used(r)).collect();
        let prepared: Vec<Prepared> = raw
            .iter()
            .zip(fit)
            .map(|(raw, r)| Prepared::new(&machine, &raw.sample(&simulate::times(r, MARGIN - 1))))
            .collect();
        let rms = |theta: &[f64]| {
            let model: Vec<Vec<DVector<f64>>> = prepared.iter().map(|p| p.model(theta)).collect();
            let pairs: Vec<_> = prepared
                .iter()
                .zip(&model)
                .map(|(p, m)| (&p.tau[..], &m[..]))
                .collect();
            energy(&pairs).1
        };
        let torque: Vec<_> = prepared.iter().map(|p| p.tau.clone()).collect();
        let theta = solve(&prepared.iter().collect::<Vec<_>>(), &torque);
        let nominal = if machine.identified {
            parameters(&machine, true)
        } else {
            parameters(&machine, false)
        };
        Some([rms(&nominal), rms(&theta)])
    }
}

/// Root of what a joint leaves with the effect beyond what it leaves without; of the worst joint.
fn excess(with: &[f64], without: &[f64]) -> f64 {
    let squares = with.iter().zip(without).map(|(a, b)| a * a - b * b);
    squares.fold(0.0, f64::max).sqrt()
}

/// Draws a case until its machine can be simulated; the draw is fixed by seed and index.
pub fn build(seed: u64, plan: &Plan) -> Result<Case, String> {
    for attempt in 0..12 {
        if let Some(case) = draw(seed, plan, attempt) {
            return Ok(case);
        }
    }
    Err(format!(
        "case {}: {:?} could not be simulated",
        plan.index, plan.effects
    ))
}

fn draw(seed: u64, plan: &Plan, attempt: u64) -> Option<Case> {
    let mut rng = Random::new(seed, plan.index, attempt);
    let absorbed = plan
        .effects
        .iter()
        .any(|e| effects::entry(e).is_some_and(|e| e.1));
    let slow = plan
        .effects
        .iter()
        .any(|e| effects::entry(e).is_some_and(|e| e.2));
    let family = rng.index(7);
    let mut machine = robots::machine(family, absorbed || rng.chance(0.3), &mut rng);
    if !plan.effects.iter().all(|e| effects::possible(e, &machine)) {
        return None;
    }
    let records = motion::records(&machine, slow || rng.chance(0.2), &mut rng);
    let mut list: Vec<Effect> = plan
        .effects
        .iter()
        .map(|e| effects::place(e, &machine, &mut rng))
        .collect();
    if list.len() == 2 && list[0].joint == list[1].joint {
        return None;
    }
    // a term that the model lacks and the machine too: a name not to be given
    if rng.chance(0.2) {
        let j = rng.index(machine.dof());
        if list.iter().all(|e| e.joint != j) {
            machine.drives[j].viscous = 0.0;
            machine.nominal_drives[j].viscous = 0.0;
            machine.nominal_drives[j].identify[1] = false;
        }
    }
    let setting = Setting {
        machine,
        records,
        bandwidth: rng.range(9.0, 14.0),
        jitter: if rng.chance(0.7) {
            rng.range(1e-5, 6e-5)
        } else {
            0.0
        },
        seed,
        index: plan.index,
    };
    let mut figures = Figures::default();
    // what is left without any effect is not the effect's
    let floor = if list.is_empty() {
        Default::default()
    } else {
        [setting.visible(&[], false)?, setting.visible(&[], true)?]
    };
    for e in &mut list {
        let judged = usize::from(!effects::entry(e.name).is_some_and(|e| e.1));
        // two records are enough to choose the size
        for _ in 0..4 {
            let Some(m) = setting.visible(std::slice::from_ref(e), false) else {
                e.strength *= 0.4;
                continue;
            };
            let ratio = plan.target / excess(&m[judged], &floor[0][judged]).max(1e-6);
            if (0.8..1.25).contains(&ratio)
                || (ratio > 1.0 && e.strength >= STRONGEST)
                || (ratio < 1.0 && e.strength <= WEAKEST)
            {
                break;
            }
            let next = e.strength * ratio.powf(0.9).clamp(0.02, 8.0);
            e.strength = next.clamp(WEAKEST, STRONGEST);
        }
        let m = setting.visible(std::slice::from_ref(e), true)?;
        let (refit, frozen) = (excess(&m[1], &floor[1][1]), excess(&m[0], &floor[1][0]));
        figures.visible.push(refit);
        figures.visible_frozen.push(frozen);
    }
    finish(setting, plan.clone(), list, figures)
}

/// Simulates all records with all effects, writes what the logger sees and judges the held-out gap.
fn finish(s: Setting, plan: Plan, list: Vec<Effect>, mut figures: Figures) -> Option<Case> {
    let (machine, raw) = s.simulate(&list, |_| true)?;
    let mut rng = Random::new(s.seed, s.index, 15);
    let mut logs = Vec::new();
    let (mut seen, mut exact) = (Vec::new(), Vec::new());
    for (raw, record) in raw.iter().zip(&s.records) {
        let (log, noise_free) = simulate::measure(raw, &machine, record, s.jitter, &mut rng);
        exact.push(Prepared::new(&machine, &noise_free));
        seen.push(Prepared::new(&machine, &log));
        logs.push(log);
    }
    let (truth, nominal) = (parameters(&machine, false), parameters(&machine, true));
    let fit: Vec<usize> = (0..raw.len()).filter(|i| s.records[*i].fit).collect();
    // what the true machine adds to its nominal structure, on the true motion
    let effect: Vec<Vec<DVector<f64>>> = exact
        .iter()
        .map(|p| {
            p.tau
                .iter()
                .zip(p.model(&truth))
                .map(|(t, m)| t - m)
                .collect()
        })
        .collect();
    let chosen: Vec<&Prepared> = fit.iter().map(|i| &seen[*i]).collect();
    let plain: Vec<_> = fit.iter().map(|i| seen[*i].tau.clone()).collect();
    let known: Vec<Vec<DVector<f64>>> = fit
        .iter()
        .map(|i| {
            seen[*i]
                .tau
                .iter()
                .zip(&effect[*i])
                .map(|(t, e)| t - e)
                .collect()
        })
        .collect();
    let refit = solve(&chosen, &plain);
    let oracle = solve(&chosen, &known);
    let judge = |theta: &[f64], with: bool, fits: bool| {
        let pairs: Vec<(Vec<DVector<f64>>, usize)> = (0..raw.len())
            .filter(|i| s.records[*i].fit == fits)
            .map(|i| {
                let mut m = seen[i].model(theta);
                if with {
                    m.iter_mut().zip(&effect[i]).for_each(|(m, e)| *m += e);
                }
                (m, i)
            })
            .collect();
        let pairs: Vec<_> = pairs
            .iter()
            .map(|(m, i)| (&m[..], &exact[*i].tau[..]))
            .collect();
        energy(&pairs)
    };
    figures.frozen = judge(&nominal, false, true).1;
    figures.refit = judge(&refit, false, true).1;
    figures.holdout = [
        judge(&nominal, false, false).0,
        judge(&refit, false, false).0,
        judge(&oracle, true, false).0,
        judge(&nominal, true, false).0,
    ];
    Some(Case {
        plan,
        machine,
        effects: list,
        records: s.records,
        logs,
        figures,
    })
}
