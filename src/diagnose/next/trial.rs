//! A motion judged before it is run: how far it tells effects apart.

use super::motions::PERIODS;
use crate::diagnose::catalogue::{self, Context, Effect, Place, Shape};
use crate::diagnose::data::Data;
use crate::diagnose::evidence::{Evidence, Projected};
use crate::diagnose::finding::Finding;
use crate::diagnose::search;
use crate::diagnose::thresholds::THRESHOLDS as T;
use crate::log::Payload;
use crate::signals::series::{Series, standing};
use crate::trajectory::Fourier;

/// How closely a motion is looked at: most samples of a period, and shapes of an effect.
#[derive(Clone, Copy)]
pub(super) struct Detail {
    pub samples: usize,
    pub shapes: usize,
}

/// While motions are compared, and in the last prediction.
pub(super) const COARSE: Detail = Detail {
    samples: T.next.coarse[0],
    shapes: T.next.coarse[1],
};
pub(super) const FINE: Detail = Detail {
    samples: T.next.fine[0],
    shapes: T.next.fine[1],
};

/// An effect at a place, with its shape and, where they are known, its coefficients.
pub(super) struct Placed<'a> {
    pub effect: &'a dyn Effect,
    place: &'a Place,
    shape: &'a Shape,
    eta: Option<&'a [f64]>,
}

impl<'a> Placed<'a> {
    pub fn of_finding(effects: &'a [Box<dyn Effect>], f: &'a Finding) -> Option<Self> {
        let effect = catalogue::named(effects, f.effect)?;
        Some(Placed {
            effect,
            place: &f.place,
            shape: &f.shape,
            // coefficients of directions that the records choose are of these records alone
            eta: (effect.prior() == 0.0).then_some(&f.eta[..]),
        })
    }

    pub fn of_candidate(effects: &'a [Box<dyn Effect>], c: &'a search::Candidate) -> Self {
        Placed {
            effect: effects[c.effect].as_ref(),
            place: &c.place,
            shape: &c.shape,
            eta: None,
        }
    }

    /// Title and place, for sentences.
    pub fn words(&self, joints: &[String]) -> String {
        let title = self.effect.card().title;
        let named = self.place.named().into_iter();
        let names: Vec<&str> = named.map(|j| joints[j].as_str()).collect();
        match names.is_empty() {
            true => title.to_string(),
            false => format!("{title} on {}", names.join(" and ")),
        }
    }

    fn projected(&self, evidence: &Evidence, cx: &Context) -> Option<Projected> {
        let columns = self.effect.columns(cx, self.place, self.shape, false);
        (!columns.is_empty()).then(|| evidence.project(&columns))
    }

    /// Energy per row, in noise variances, that the nominal model cannot absorb: of the fitted
    /// coefficients, or per unit of each.
    pub fn visible(&self, evidence: &Evidence, cx: &Context) -> Option<f64> {
        let projected = self.projected(evidence, cx)?;
        Some(projected.energies(self.eta).0 / evidence.data.fitted.max(1) as f64)
    }

    /// The largest figure among the fitted shape and others of its grid, in all no more than `most`.
    fn largest(
        &self,
        evidence: &Evidence,
        cx: &Context,
        most: usize,
        figure: impl Fn(&Projected) -> f64,
    ) -> Option<f64> {
        let grid = self.effect.shapes(cx, self.place);
        let stride = grid.len().div_ceil(most.max(2) - 1).max(1);
        let others = grid.into_iter().step_by(stride).filter(|s| s != self.shape);
        let mut sets = std::iter::once(self.shape.clone())
            .chain(others)
            .enumerate()
            .map(|(i, s)| self.effect.columns(cx, self.place, &s, i > 0))
            .filter(|c| !c.is_empty() && c.iter().all(|c| !c.rows.is_empty()));
        let mut largest: Option<f64> = None;
        loop {
            // a few at once: fast, and few columns are held
            let some: Vec<_> = sets.by_ref().take(TOGETHER).collect();
            if some.is_empty() {
                return largest;
            }
            let figures = evidence.project_all(&some).into_iter().map(|z| figure(&z));
            largest = largest.into_iter().chain(figures).reduce(f64::max);
        }
    }
}

/// Shapes whose columns are whitened and projected at once.
const TOGETHER: usize = 4;

/// What a motion is to tell apart.
pub(super) enum Target<'a> {
    /// an effect and its rival
    Pair(Placed<'a>, Placed<'a>),
    /// an effect and the nominal model, and the energy per row that is visible in the records at hand
    Hidden(Placed<'a>, f64),
}

impl Target<'_> {
    /// Share of the effect that its rival, or the nominal model, can imitate. A rival has whichever of
    /// `shapes` shapes imitates most; an effect of unknown size the one that shows best. `None` where the
    /// effect is not there, is lost in the noise, or shows less than it has to.
    pub fn overlap(&self, evidence: &Evidence, cx: &Context, shapes: usize) -> Option<f64> {
        match self {
            Target::Pair(a, b) => {
                let eta = a.eta?;
                let a = a.projected(evidence, cx)?;
                let enough = T.next.seen * evidence.data.fitted as f64;
                if a.z.len() != eta.len() || a.energy(eta).0 <= enough {
                    return None;
                }
                b.largest(evidence, cx, shapes, |b| evidence.overlap(&a, eta, b))
            }
            Target::Hidden(a, least) => {
                // a slow motion shows a large share of next to nothing
                if a.visible(evidence, cx)? < *least {
                    return None;
                }
                let seen = match a.eta {
                    Some(eta) => Some(a.projected(evidence, cx)?.visibility(Some(eta))),
                    None => a.largest(evidence, cx, shapes, |z| z.visibility(None)),
                };
                seen.map(|v| 1.0 - v)
            }
        }
    }
}

/// The state of the diagnosis that motions are judged in.
pub(super) struct Trial<'a> {
    pub data: &'a Data<'a>,
    pub phi: &'a [f64],
}

impl Trial<'_> {
    /// Overlaps of targets in a motion that is run [`PERIODS`] times. Noise, window, prior and ordinary
    /// imperfections are those of the records.
    pub fn overlaps(&self, motion: &Fourier, detail: Detail, of: &[&Target]) -> Vec<Option<f64>> {
        self.try_overlaps(motion, detail, of)
            .unwrap_or_else(|| vec![None; of.len()])
    }

    fn try_overlaps(
        &self,
        motion: &Fourier,
        detail: Detail,
        of: &[&Target],
    ) -> Option<Vec<Option<f64>>> {
        let plant = self.data.plant;
        let sampled = self.data.records.first()?.dt;
        let wanted = (motion.period / sampled).round() as usize;
        let count = wanted.clamp(T.next.least_samples, detail.samples);
        let x = motion.motion(count);
        let n = self.data.joints();
        let dt = motion.period / count as f64;
        let actuators = plant.actuator_motion(&x).ok()?;
        // what hardly moves will count as standing, and tell nothing
        let noise = &self.data.records.first()?.position_noise;
        let standing = standing(plant, &actuators, noise, PERIODS as usize, dt);
        let record = Series {
            name: "next".into(),
            fit: true,
            dt,
            count,
            cycle: Some(count),
            actuators,
            x,
            reference: None,
            tau: vec![0.0; n * count],
            deflection: None,
            measured: vec![true; count],
            standing,
            position_noise: vec![0.0; n],
            band: T.next.band,
            coarse: Vec::new(),
            filters: Vec::new(),
            payload: Payload::None,
            order: 0,
            remarks: Vec::new(),
        };
        let noise = Some(self.data.noise.clone());
        let mut data = Data::with_noise(plant, vec![record], noise).ok()?;
        data.ordinary();
        data.tighten(self.data.closeness);
        data.window = self.data.window;
        // the robot would run it empty, and an unknown load has the last parameters
        let phi = self.phi.get(..data.parameters.len())?;
        let empty = self.data.first_free_load().unwrap_or(self.phi.len());
        if data.parameters.len() != empty {
            return None;
        }
        // k times as many rows weigh the prior as k times its variance would
        let rows = f64::from(PERIODS) * wanted as f64 / count as f64;
        let evidence = Evidence::new(&data, rows.max(1.0).sqrt());
        let cx = Context::new(&data, phi.to_vec()).ok()?;
        Some(
            of.iter()
                .map(|t| t.overlap(&evidence, &cx, detail.shapes))
                .collect(),
        )
    }
}
