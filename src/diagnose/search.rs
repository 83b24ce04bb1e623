//! Search over effects, places and shapes.

use super::catalogue::{Context, Effect, Place, Shape};
use super::column::Column;
use super::evidence::{Evidence, Projected, Set};
use super::thresholds::THRESHOLDS as T;
use crate::report::format::significant;
use crate::robot::JointTerm;
use rayon::prelude::*;

/// An effect at a place with its best shape.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// index into the catalogue
    pub effect: usize,
    /// where
    pub place: Place,
    /// shape
    pub shape: Shape,
    /// columns
    pub projected: Projected,
    /// by how much `χ²` falls when it is added to what is already there
    pub gain: f64,
    /// coefficients then
    pub eta: Vec<f64>,
    /// why it is none, where its best fit is one that no machine can have, and by how much `χ²` would fall
    pub ruled_out: Option<(String, f64)>,
}

impl Candidate {
    /// Coefficients of columns that are not zero.
    pub fn live(&self) -> usize {
        let live = (0..self.eta.len()).filter(|&k| self.projected.raw[(k, k)] > 0.0);
        live.count()
    }

    /// Whether it is the same effect at the same place.
    pub fn same(&self, other: &Candidate) -> bool {
        self.effect == other.effect && self.place == other.place
    }
}

/// One shape of an effect, beside a set.
struct Tried {
    /// by how much `χ²` falls
    gain: f64,
    eta: Vec<f64>,
    projected: Projected,
    /// whether the coefficients make sense
    able: bool,
    /// why no machine has them
    why: Option<String>,
}

impl Tried {
    /// What it gains, nothing where it can not be.
    fn counts(&self) -> f64 {
        match self.able && self.why.is_none() {
            true => self.gain,
            false => 0.0,
        }
    }
}

/// Why no machine has these coefficients: by the rules of the effect, or because it would need more torque than
/// its drive has. The torque is that of a sine of the same power, over the fitted rows that count.
fn impossible(
    cx: &Context,
    effect: &dyn Effect,
    place: &Place,
    shape: &Shape,
    eta: &[f64],
    columns: Option<&Vec<Column>>,
) -> Option<String> {
    let why = effect.impossible(cx, place, shape, eta);
    let (Some(columns), None) = (columns, &why) else {
        return why;
    };
    place.named().into_iter().find_map(|j| {
        let most = effect.most() * cx.effort(j)?;
        let rows = cx.data.fitted;
        let (mut power, mut count) = (0.0, 0.0f64);
        for i in (0..rows).filter(|i| cx.data.weights[j][*i] > 0.0) {
            let at = |(c, e): (&Column, &f64)| c.get(j).map_or(0.0, |v| v[i] * e);
            power += columns.iter().zip(eta).map(at).sum::<f64>().powi(2);
            count += 1.0;
        }
        let torque = (2.0 * power / count.max(1.0)).sqrt();
        (torque > most).then(|| {
            format!(
                "it would make {} {} on {}, whose drive has {}",
                significant(torque, 3),
                cx.torque_unit(j),
                cx.name(j),
                significant(cx.effort(j).unwrap_or(most), 3)
            )
        })
    })
}

/// An effect with a shape and coefficients.
pub type Member<'a> = (&'a dyn Effect, &'a Shape, &'a [f64]);

/// Whether the friction of a joint brakes at all speeds, with what the effects at this place add to it and what a refit makes of the
/// rest, which `phi` gives: one that would drive the joint stands for something else.
pub fn brakes(
    cx: &Context,
    place: &Place,
    effects: &[Member],
    phi: impl FnOnce() -> Vec<f64>,
) -> bool {
    let added = |speed: f64| -> Vec<f64> {
        let each = effects.iter();
        each.filter_map(|(effect, shape, eta)| effect.friction(cx, place, shape, eta, speed))
            .collect()
    };
    let top = cx.data.speed[place.first()];
    if added(top).is_empty() {
        return true;
    }
    let phi = phi();
    let [viscous, coulomb] =
        [JointTerm::Viscous, JointTerm::Coulomb].map(|term| cx.term_of(place, term, &phi));
    let at = |share: f64| {
        let speed = share * top;
        added(speed).iter().sum::<f64>() + viscous * speed + coulomb
    };
    let least = T
        .search
        .brakes
        .map(at)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    least >= -T.search.drives * at(1.0).abs()
}

/// Looks for shapes beside a set.
#[derive(Clone, Copy)]
pub struct Finder<'a> {
    /// what columns are made from
    pub cx: &'a Context<'a>,
    /// the catalogue
    pub effects: &'a [Box<dyn Effect>],
    /// the set
    pub beside: &'a Set<'a>,
}

/// An effect of the catalogue, and where.
pub type Task = (usize, Place);

/// The best shape of an effect at a place among those of its grid.
struct Sketch {
    task: Task,
    grid: Vec<Shape>,
    shape: Shape,
    /// by how much `χ²` falls
    gain: f64,
    /// a shape that no machine can have and that would gain more: why, and how much
    said: Option<(String, f64)>,
}

impl Finder<'_> {
    fn effect(&self, task: Task) -> &dyn Effect {
        self.effects[task.0].as_ref()
    }

    /// Several shapes; none where one of them has nothing to show.
    fn tried(&self, task: Task, shapes: &[Shape], draft: bool) -> Option<Vec<Tried>> {
        let (cx, effect, place) = (self.cx, self.effect(task), &task.1);
        let sets = match draft {
            true => effect.drafts(cx, place, shapes),
            false => (shapes.iter())
                .map(|s| effect.columns(cx, place, s, false))
                .collect(),
        };
        let empty = |s: &Vec<Column>| s.is_empty() || s.iter().any(|c| c.rows.is_empty());
        if sets.iter().any(empty) {
            return None;
        }
        let projected = self.beside.evidence().project_all(&sets);
        let all = projected.into_iter().zip(sets.iter().zip(shapes));
        let of = |(mut projected, (columns, shape)): (Projected, (&Vec<Column>, &Shape))| {
            projected.prior = effect.prior();
            let fit = self.beside.with(&projected);
            let eta = fit.eta[fit.eta.len() - columns.len()..].to_vec();
            let gain = fit.gain - self.beside.gain();
            let phi = || self.beside.parameters(&projected, &fit);
            let able = gain.is_finite()
                && effect.plausible(cx, place, shape, &eta)
                && brakes(cx, place, &[(effect, shape, &eta)], phi);
            let columns = (!draft).then_some(columns);
            let why = (able.then(|| impossible(cx, effect, place, shape, &eta, columns))).flatten();
            Tried {
                gain,
                eta,
                projected,
                able,
                why,
            }
        };
        Some(all.map(of).collect())
    }

    /// One shape with its whole columns.
    fn whole(&self, task: Task, shape: &Shape) -> Option<Tried> {
        self.tried(task, std::slice::from_ref(shape), false)?.pop()
    }

    /// A shape refined with the whole columns, in small steps.
    fn settled(&self, task: Task, (mut last, mut shape): (Tried, Shape)) -> (Tried, Shape) {
        let effect = self.effect(task);
        for step in T.settle.steps {
            for k in 0..shape.constants.len() {
                if !effect.refinable(&shape, k) {
                    continue;
                }
                for factor in [step, 1.0 / step] {
                    let from = shape.clone();
                    for _ in 0..T.settle.most {
                        let mut next = shape.clone();
                        next.constants[k] *= factor;
                        match self.whole(task, &next) {
                            Some(t) if t.counts() > last.counts() * T.shapes.better => {
                                (last, shape) = (t, next);
                            }
                            _ => break,
                        }
                    }
                    // what rises on one side falls on the other
                    if shape != from {
                        break;
                    }
                }
            }
        }
        (last, shape)
    }

    /// The best shape of a grid.
    fn sketch(&self, task: Task) -> Option<Sketch> {
        let grid = self.effect(task).shapes(self.cx, &task.1);
        // the best that a machine can have, and the best that none can: by what they gain less what their columns cost, so that
        // a form with more of them takes the place of a plain one only where it has a use
        type Best = [Option<(f64, f64, Shape, Option<String>)>; 2];
        let best_of = |shapes: &[Shape]| -> Option<Best> {
            let mut best: Best = [None, None];
            let tried = self.tried(task, shapes, true)?;
            for (tried, shape) in tried.into_iter().zip(shapes).filter(|t| t.0.able) {
                let raw = &tried.projected.raw;
                let live = (0..raw.nrows()).filter(|k| raw[(*k, *k)] > 0.0).count();
                let worth = tried.gain - T.rivals.price * live as f64;
                let of = &mut best[usize::from(tried.why.is_some())];
                if of.as_ref().is_none_or(|b| worth > b.0) {
                    *of = Some((worth, tried.gain, shape.clone(), tried.why));
                }
            }
            Some(best)
        };
        let parts: Vec<_> = grid.par_chunks(8).with_max_len(1).map(best_of).collect();
        let [best, none] = [0, 1].map(|which| {
            let all = parts.iter().flatten().filter_map(|b| b[which].clone());
            all.reduce(|a, b| if b.0 > a.0 { b } else { a })
        });
        // what no machine can have is kept only to be said
        let gain = best.as_ref().map_or(0.0, |b| b.1);
        let said =
            none.and_then(|(_, more, shape, why)| (more > gain).then_some(((why?, more), shape)));
        let (said, instead) = said.unzip();
        Some(Sketch {
            task,
            shape: best.map(|b| b.2).or(instead)?,
            grid,
            gain,
            said,
        })
    }

    /// The shape between the points of the grid: to the best neighbour as long as one is better.
    fn between(&self, s: &mut Sketch) {
        let effect = self.effect(s.task);
        let of = |k: usize| {
            let ends = (s.grid.iter())
                .filter(|g| g.form == s.shape.form)
                .map(|g| g[k])
                .filter(|v| v.signum() == s.shape[k].signum());
            let [a, b] = ends.fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], v| {
                [a.min(v.abs()), b.max(v.abs())]
            });
            (k, a / T.shapes.below..=b * T.shapes.above)
        };
        let constants = (0..s.shape.constants.len()).filter(|k| effect.refinable(&s.shape, *k));
        let bounds: Vec<_> = constants.map(of).collect();
        for step in T.shapes.steps {
            // not back to where it came from
            let mut came: Option<(usize, f64)> = None;
            loop {
                let factors = |k: usize| [(k, step), (k, 1.0 / step)];
                let moves = bounds.iter().flat_map(|(k, _)| factors(*k));
                let moves = moves.filter(|m| came.is_none_or(|c| c.0 != m.0 || c.1 == m.1));
                let (moves, shapes): (Vec<_>, Vec<_>) = moves
                    .filter_map(|(k, factor)| {
                        let mut next = s.shape.clone();
                        next.constants[k] *= factor;
                        let bounds = &bounds.iter().find(|b| b.0 == k)?.1;
                        bounds
                            .contains(&next[k].abs())
                            .then_some(((k, factor), next))
                    })
                    .unzip();
                let tried = match shapes.is_empty() {
                    true => None,
                    false => self.tried(s.task, &shapes, true),
                };
                let all = tried.into_iter().flatten().map(|t| t.counts());
                let best =
                    (all.zip(moves).zip(shapes)).reduce(|a, b| if b.0.0 > a.0.0 { b } else { a });
                match best {
                    Some(((gain, by), next)) if gain > s.gain * T.shapes.better => {
                        (s.gain, s.shape, came) = (gain, next, Some(by));
                    }
                    _ => break,
                }
            }
        }
    }

    /// The candidate that a sketch becomes, with its whole columns; where its gain is near the `most` of others, between the points
    /// of the grid.
    fn candidate(&self, mut s: Sketch, most: f64) -> Option<Candidate> {
        let near = s.gain >= T.shapes.near * most;
        if near && s.gain > T.shapes.refined {
            self.between(&mut s);
        }
        let last = self.whole(s.task, &s.shape)?;
        // a draft leaves out what gravity and velocity do to a way
        let large = last.counts() > T.settle.whole;
        let (last, shape) = match near && self.effect(s.task).sways() && large {
            true => self.settled(s.task, (last, s.shape)),
            false => (last, s.shape),
        };
        let mut found = candidate(s.task, last, shape);
        found.ruled_out = found.ruled_out.or(s.said);
        Some(found)
    }

    /// The best shape of an effect at a place.
    pub fn best_shape(&self, task: Task) -> Option<Candidate> {
        self.candidate(self.sketch(task)?, 0.0)
    }

    /// The best shapes of effects at places. Those that gain little beside the best one stay at a point of their grid.
    pub fn best_shapes(&self, tasks: &[Task]) -> Vec<Candidate> {
        let sketches = tasks.par_iter().with_max_len(1);
        self.candidates(sketches.filter_map(|t| self.sketch(*t)).collect())
    }

    /// The same of a search of the same records with something else assumed, from the shapes that were best `before`. Those that gain
    /// much in either search are looked for in their whole grid.
    fn best_shapes_from(&self, before: &[Candidate]) -> Vec<Candidate> {
        let first = before.iter().fold(0.0f64, |m, c| m.max(c.gain));
        let large = |c: &Candidate| c.gain > T.shapes.anew * first || c.ruled_out.is_some();
        let start = |c: &Candidate| match large(c) {
            true => self.sketch((c.effect, c.place)),
            false => self.sketch_of(c),
        };
        let all = before.par_iter().with_max_len(1);
        let mut sketches: Vec<Option<Sketch>> = all.map(start).collect();
        let gains = sketches.iter().flatten().map(|s| s.gain);
        let most = gains.fold(0.0f64, f64::max);
        let own = sketches.par_iter_mut().zip(before).with_max_len(1);
        own.for_each(|(sketch, c)| {
            if !large(c)
                && sketch
                    .as_ref()
                    .is_some_and(|s| s.gain > T.shapes.anew * most)
            {
                *sketch = self.sketch((c.effect, c.place));
            }
        });
        self.candidates(sketches.into_iter().flatten().collect())
    }

    /// The shape of a candidate, as a sketch beside this set.
    fn sketch_of(&self, c: &Candidate) -> Option<Sketch> {
        let task = (c.effect, c.place);
        let tried = self
            .tried(task, std::slice::from_ref(&c.shape), true)?
            .pop()?;
        Some(Sketch {
            task,
            grid: self.effect(task).shapes(self.cx, &task.1),
            shape: c.shape.clone(),
            gain: tried.counts(),
            said: None,
        })
    }

    fn candidates(&self, sketches: Vec<Sketch>) -> Vec<Candidate> {
        let most = sketches.iter().fold(0.0f64, |m, s| m.max(s.gain));
        let all = sketches.into_par_iter().with_max_len(1);
        all.filter_map(|s| self.candidate(s, most)).collect()
    }

    /// A candidate of another context, its shape refined from where it is.
    pub fn again(&self, c: &Candidate) -> Option<Candidate> {
        let task = (c.effect, c.place);
        let first = self.whole(task, &c.shape)?;
        let (last, shape) = self.settled(task, (first, c.shape.clone()));
        Some(candidate(task, last, shape))
    }
}

/// What was tried as a candidate.
fn candidate((effect, place): Task, tried: Tried, shape: Shape) -> Candidate {
    Candidate {
        effect,
        place,
        shape,
        gain: tried.counts(),
        projected: tried.projected,
        eta: tried.eta,
        ruled_out: tried.why.map(|why| (why, tried.gain)),
    }
}

/// Every effect at every place with its best shape, from those `before` where the records were searched already; by falling
/// gain.
pub fn singles(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    before: Option<&[Candidate]>,
) -> Vec<Candidate> {
    let beside = &evidence.set(&[]);
    let finder = Finder {
        cx,
        effects,
        beside,
    };
    let mut all = match before {
        Some(before) => finder.best_shapes_from(before),
        None => {
            let tasks = (effects.iter().enumerate())
                .flat_map(|(e, effect)| effect.sites(cx).into_iter().map(move |p| (e, p)));
            finder.best_shapes(&tasks.collect::<Vec<Task>>())
        }
    };
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}
