//! Robots that the records do not exclude: what to randomise.
//!
//! A member of the set or one of its rivals is there with the confidence `c` that both share. A sample has the member with
//! the chance `c/(1 + Σ w)`, a rival of weight `w_k` in its place with `c w_k/(1 + Σ w)`, and none of them otherwise. Beside the
//! effects that were drawn all parameters are fitted anew; parameters `φ` and coefficients `η` are then drawn together from what
//! records and prior leave open ([`Draws`]), for a noise as large as what the fit leaves, its correlation in time included.
//! Friction below zero is none. Of bodies that cannot exist the nearest that can are taken, as for the improved model.
//!
//! The band of the samples is checked on records that were held out: with the torque `τ_s` of sample `s` and what the fit
//! leaves on each actuator of the fitted records, `σ`, a held-out torque `τ` lies in the band for 95 % if
//!
//! ```text
//! |τ − mean τ_s| ≤ 1.96 √(var τ_s + σ²)
//! ```

use super::catalogue::{Context, Effect, Estimate, Place, Shape};
use super::column::Column;
use super::data::Data;
use super::evidence::{Draws, Evidence, Projected};
use super::finding::names;
use super::improve::{Claim, Written, written};
use super::settings::Settings;
use super::thresholds::THRESHOLDS as T;
use super::verdict::{Decision, Member, inflation};
use crate::error::Result;
use crate::export::{self, Remark, parts::Model};
use crate::plant::{Column as Unknown, Plant};
use crate::robot::{Joint, JointTerm, Robot};
use crate::simulate::record::normal;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::fmt::Write as _;

/// Robots that the command line and Python draw at most.
pub const MOST: usize = 9999;

/// Table of all samples.
pub const TABLE: &str = "samples.csv";

/// Points of a record in the report.
const POINTS: usize = 500;

/// Quantile of the normal distribution that 95 % lie within.
const BAND: f64 = 1.959_963_985;

/// Robots that the records do not exclude.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Posterior {
    /// columns of the table: names and units; parameters of the model, then of the effects
    pub columns: Vec<(String, &'static str)>,
    /// samples
    pub samples: Vec<Sample>,
    /// how their band does on records that were held out, by actuator; empty without such records
    pub band: Vec<Band>,
    /// samples that were asked for and are no machine
    pub missing: usize,
}

/// One of them.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Sample {
    /// bodies and joints; not serialised, the writers of [`export`](crate::export) write it
    #[serde(skip)]
    pub robot: Robot,
    /// its effects
    pub remarks: Vec<Remark>,
    /// values of the columns; NaN of effects that it has not
    pub values: Vec<f64>,
}

/// The band for 95 % of the torque of one actuator on records that were held out.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Band {
    /// name of the actuator
    pub joint: String,
    /// share of the torques that lie in it
    pub covered: f64,
    /// what the fit leaves on fitted records, N m or N
    pub left: f64,
    /// standard deviation of the samples, root mean square, N m or N
    pub spread: f64,
    /// the same where every parameter is off by up to ±20 %, N m or N
    pub twenty: f64,
    /// a part of the first record that was held out: time, s, measured torque less the mean of the samples, half of the band,
    /// N m or N
    pub part: Vec<[f64; 3]>,
}

impl Posterior {
    /// Name of the folder of sample `k`.
    pub fn folder(k: usize) -> String {
        format!("sample_{:04}", k + 1)
    }

    /// The robot files of sample `k`, by name.
    pub fn files(&self, plant: &Plant, k: usize) -> Vec<(&'static str, Result<String>)> {
        export::write(&Model {
            plant,
            robot: &self.samples[k].robot,
            remarks: &self.samples[k].remarks,
        })
    }

    /// The table: a row for each sample; empty where a sample has not the effect.
    pub fn csv(&self) -> String {
        let quoted = |name: &str| match name.contains([',', '"', '\n', '\r']) {
            true => format!("\"{}\"", name.replace('"', "\"\"")),
            false => name.to_string(),
        };
        let names: Vec<String> = self.columns.iter().map(|c| quoted(&c.0)).collect();
        let mut out = format!("sample,{}\n", names.join(","));
        for (k, sample) in self.samples.iter().enumerate() {
            let _ = write!(out, "{}", k + 1);
            for v in &sample.values {
                let _ = match v.is_nan() {
                    true => write!(out, ","),
                    false => write!(out, ",{v}"),
                };
            }
            out.push('\n');
        }
        out
    }

    /// Share of the held-out torques of all actuators that lie in the band; `None` without such records.
    pub fn covered(&self) -> Option<f64> {
        let sum: f64 = self.band.iter().map(|b| b.covered).sum();
        (!self.band.is_empty()).then(|| sum / self.band.len() as f64)
    }
}

/// What may stand in the place of a member.
struct Choice<'d> {
    effect: usize,
    place: Place,
    shape: &'d Shape,
    weight: f64,
}

/// A member and its rivals, the member first; the same effect elsewhere is one of them, once.
fn choices(member: &Member) -> Vec<Choice<'_>> {
    let c = &member.candidate;
    let mut all = vec![Choice {
        effect: c.effect,
        place: c.place,
        shape: &c.shape,
        weight: 1.0,
    }];
    let likely = member.rivals.iter();
    for r in likely.filter(|r| r.weight >= T.rivals.listed) {
        if !all[1..].iter().any(|c| c.effect == r.effect) {
            all.push(Choice {
                effect: r.effect,
                place: r.place,
                shape: &r.shape,
                weight: r.weight,
            });
        }
    }
    all
}

/// Which of the choices of a member is there, if any.
fn choose(rng: &mut ChaCha8Rng, member: &Member, choices: &[Choice]) -> Option<usize> {
    let total: f64 = choices.iter().map(|c| c.weight).sum();
    let mut at = rng.random::<f64>() * total / member.together.max(1e-300);
    choices.iter().position(|c| {
        at -= c.weight;
        at < 0.0
    })
}

/// A set of effects that was fitted.
struct Fitted<'e> {
    effects: Vec<(&'e dyn Effect, Place, &'e Shape)>,
    columns: Vec<Vec<Column>>,
    draws: Option<Draws>,
}

impl<'e> Fitted<'e> {
    fn new(
        evidence: &Evidence,
        cx: &Context,
        catalogue: &'e [Box<dyn Effect>],
        chosen: &[&'e Choice<'e>],
    ) -> Self {
        let mut effects: Vec<(&dyn Effect, Place, &Shape)> = Vec::new();
        let mut seen: Vec<(usize, Place)> = Vec::new();
        for c in chosen {
            // one member may be the rival of another
            if !seen.contains(&(c.effect, c.place)) {
                seen.push((c.effect, c.place));
                effects.push((catalogue[c.effect].as_ref(), c.place, c.shape));
            }
        }
        let columns: Vec<Vec<Column>> = effects
            .iter()
            .map(|(effect, place, shape)| effect.columns(cx, place, shape, false))
            .collect();
        let mut projected = evidence.project_all(&columns);
        for (p, (effect, ..)) in projected.iter_mut().zip(&effects) {
            p.prior = effect.prior();
        }
        let set: Vec<&Projected> = projected.iter().collect();
        let fit = evidence.fit(&set);
        let noise = inflation(&evidence.residual(&set, &fit), evidence.data.fitted);
        Fitted {
            draws: evidence.draws(&set, &fit, noise),
            effects,
            columns,
        }
    }

    /// A draw, if it is a machine: its model, with the torque of its effects.
    fn draw(&self, evidence: &Evidence, cx: &Context, rng: &mut ChaCha8Rng) -> Option<Drawn<'e>> {
        let (plant, draws) = (cx.data.plant, self.draws.as_ref()?);
        for _ in 0..T.improved.tries {
            let numbers: Vec<f64> = (0..draws.count()).map(|_| normal(rng)).collect();
            let (mut phi, eta) = draws.at(&numbers);
            friction(plant, &mut phi);
            let mut at = 0;
            let mut effects: Vec<Claim> = Vec::new();
            for ((effect, place, shape), columns) in self.effects.iter().zip(&self.columns) {
                let own = eta[at..at + columns.len()].to_vec();
                at += own.len();
                effects.push((
                    *effect,
                    Estimate {
                        place: *place,
                        shape: (*shape).clone(),
                        std: vec![0.0; own.len()],
                        eta: own,
                    },
                ));
            }
            let machine = effects.iter().all(|(effect, e)| {
                effect.plausible(cx, &e.place, &e.shape, &e.eta)
                    && effect.impossible(cx, &e.place, &e.shape, &e.eta).is_none()
            });
            if !machine {
                continue;
            }
            let count = plant.parameters().len();
            let model = written(evidence, cx, &phi[..count], &effects);
            if !model.able {
                continue;
            }
            phi[..count].copy_from_slice(&model.values);
            let mut torque = cx.data.model_torque(&cx.data.without_allowance(&phi));
            for (column, eta) in self.columns.iter().flatten().zip(eta) {
                column.add_to(eta, &mut torque);
            }
            return Some(Drawn {
                model,
                effects,
                torque,
            });
        }
        None
    }
}

/// A sample before it is put into the table.
struct Drawn<'e> {
    model: Written,
    effects: Vec<Claim<'e>>,
    torque: Vec<Vec<f64>>,
}

/// Armature and friction below zero are none.
fn friction(plant: &Plant, phi: &mut [f64]) {
    for (p, x) in plant.parameters().iter().zip(phi) {
        if let Unknown::Term { term, .. } = p.kind
            && term != JointTerm::Offset
        {
            *x = x.max(0.0);
        }
    }
}

/// Draws robots that the records do not exclude; `left` is what the fit of all members leaves of the torque.
pub fn sample(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    decision: &Decision,
    left: &[Vec<f64>],
    settings: &Settings,
) -> Posterior {
    let of_members: Vec<Vec<Choice>> = decision.members.iter().map(choices).collect();
    let mut sets: Vec<Vec<Option<usize>>> = Vec::new();
    let mut drawn: Vec<(usize, ChaCha8Rng)> = Vec::new();
    for k in 0..settings.samples {
        // every sample has numbers of its own, whatever the others and the threads do
        let mut rng = ChaCha8Rng::seed_from_u64(settings.seed ^ 0x0705_7e21);
        rng.set_stream(k as u64);
        let members = decision.members.iter().zip(&of_members);
        let chosen: Vec<Option<usize>> = members.map(|(m, c)| choose(&mut rng, m, c)).collect();
        let known = sets.iter().position(|s| *s == chosen);
        drawn.push((known.unwrap_or(sets.len()), rng));
        if known.is_none() {
            sets.push(chosen);
        }
    }
    let fitted: Vec<Fitted> = sets
        .par_iter()
        .map(|set| {
            let of = set.iter().zip(&of_members);
            let chosen: Vec<&Choice> = of.filter_map(|(i, c)| c.get((*i)?)).collect();
            Fitted::new(evidence, cx, effects, &chosen)
        })
        .collect();
    let mut table = Table::new(cx.data);
    let mut band = Gaps::new(cx.data);
    let mut missing = 0;
    // as many at once as there are threads: each holds the torque of all records
    for part in drawn.chunks_mut(rayon::current_num_threads().max(1)) {
        let some: Vec<Option<Drawn>> = part
            .par_iter_mut()
            .map(|(set, rng)| fitted[*set].draw(evidence, cx, rng))
            .collect();
        for one in some {
            match one {
                Some(one) => {
                    band.add(&one.torque);
                    table.add(cx, one);
                }
                None => missing += 1,
            }
        }
    }
    let (columns, samples) = table.filled();
    Posterior {
        columns,
        samples,
        band: band.on_holdout(left, &evidence.phi),
        missing,
    }
}

/// Samples and the columns that they need.
struct Table {
    columns: Vec<(String, &'static str)>,
    samples: Vec<Sample>,
}

impl Table {
    fn new(data: &Data) -> Self {
        let parameters = data.plant.parameters().iter();
        Table {
            columns: parameters.map(|p| (p.name.clone(), p.unit)).collect(),
            samples: Vec::new(),
        }
    }

    fn add(&mut self, cx: &Context, drawn: Drawn) {
        let robot = drawn.model.robot;
        let mut values = cx.data.plant.values_in(&robot);
        values.resize(self.columns.len(), f64::NAN);
        for (effect, e) in &drawn.effects {
            let joints = names(cx, &e.place).join("+");
            let mut at = effect.card().name.to_string();
            if !joints.is_empty() {
                let _ = write!(at, "/{joints}");
            }
            for v in effect.values(cx, e) {
                let name = format!("{at}/{}", v.name);
                match self.columns.iter().position(|c| c.0 == name) {
                    Some(i) => values[i] = v.value,
                    None => {
                        self.columns.push((name, v.unit));
                        values.push(v.value);
                    }
                }
            }
        }
        self.samples.push(Sample {
            robot,
            remarks: drawn.model.remarks,
            values,
        });
    }

    fn filled(mut self) -> (Vec<(String, &'static str)>, Vec<Sample>) {
        let width = self.columns.len();
        let all = self.samples.iter_mut();
        all.for_each(|s| s.values.resize(width, f64::NAN));
        (self.columns, self.samples)
    }
}

/// Gaps of the samples row by row: sums of them and of their squares about the first.
struct Gaps<'d, 'p> {
    data: &'d Data<'p>,
    first: Vec<Vec<f64>>,
    sum: Vec<Vec<f64>>,
    square: Vec<Vec<f64>>,
    count: usize,
}

impl<'d, 'p> Gaps<'d, 'p> {
    fn new(data: &'d Data<'p>) -> Self {
        let zero = vec![vec![0.0; data.rows()]; data.joints()];
        Gaps {
            data,
            first: Vec::new(),
            sum: zero.clone(),
            square: zero,
            count: 0,
        }
    }

    fn add(&mut self, torque: &[Vec<f64>]) {
        let gap = self.data.gap_that_counts(torque);
        if self.count == 0 {
            self.first = gap.clone();
        }
        self.count += 1;
        let sums = self.sum.iter_mut().zip(&mut self.square);
        for ((sum, square), (gap, first)) in sums.zip(gap.iter().zip(&self.first)) {
            let change = gap.iter().zip(first).map(|(g, f)| g - f);
            for ((s, q), d) in sum.iter_mut().zip(square).zip(change) {
                *s += d;
                *q += d * d;
            }
        }
    }

    /// The band on the rows of records held out; `left` is what the fit leaves, `phi` the nominal parameters.
    fn on_holdout(&self, left: &[Vec<f64>], phi: &[f64]) -> Vec<Band> {
        let data = self.data;
        if self.count < 2 || !data.predicts() {
            return Vec::new();
        }
        let n = self.count as f64;
        let actuators = data.plant.actuators();
        let one = |(j, actuator): (usize, &&Joint)| {
            let counts = |i: &usize| data.weights[j][*i] > 0.0;
            let mean = |rows: std::ops::Range<usize>, of: &dyn Fn(usize) -> f64| {
                let all: Vec<f64> = rows.filter(counts).map(of).collect();
                (all.iter().sum::<f64>() / all.len().max(1) as f64, all.len())
            };
            let left = mean(0..data.fitted, &|i| left[j][i].powi(2)).0;
            let variance = |i: usize| {
                let middle = self.sum[j][i] / n;
                ((self.square[j][i] / n - middle * middle) * n / (n - 1.0)).max(0.0)
            };
            let gap = |i: usize| self.first[j][i] + self.sum[j][i] / n;
            let half = |i: usize| BAND * (variance(i) + left).sqrt();
            let within = |i: usize| f64::from(gap(i).abs() <= half(i));
            let held = data.fitted..data.rows();
            let shown = data.records.iter().position(|r| !r.fit && r.moves());
            let part = shown.map_or(Vec::new(), |k| {
                let (span, dt) = (data.span(k), data.records[k].dt);
                let most = span.len().min((T.improved.shown / dt) as usize);
                let rows = (0..most).step_by((most / POINTS).max(1));
                let rows = rows.filter(|i| counts(&(span.start + i)));
                rows.map(|i| [i as f64 * dt, gap(span.start + i), half(span.start + i)])
                    .collect()
            });
            let (covered, rows) = mean(held.clone(), &within);
            // each parameter uniform within ±20 %
            let twenty = |i: usize| -> f64 {
                let own = phi.iter().enumerate().take(data.plant.parameters().len());
                let terms = own.filter_map(|(c, x)| Some((0.2 * x * data.w[j].get(c)?[i]).powi(2)));
                terms.sum::<f64>() / 3.0
            };
            (rows > 0).then(|| Band {
                joint: actuator.name.clone(),
                covered,
                left: left.sqrt(),
                spread: mean(held.clone(), &variance).0.sqrt(),
                twenty: mean(held, &twenty).0.sqrt(),
                part,
            })
        };
        actuators.iter().enumerate().filter_map(one).collect()
    }
}
