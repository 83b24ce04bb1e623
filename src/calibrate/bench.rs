//! What a calibration knows before it begins: nominal poses, torques of gravity, where the set-up starts.

use super::bend::{self, Bends};
use super::doubts;
use super::effects::{self, Gravity};
use super::feature::{Feature, Shape};
use super::file::Calibration;
use super::fit::Plan;
use super::frame::Frame;
use super::gravity;
use super::kin::Kin;
use super::layout::Start;
use super::model::{Model, Settings};
use super::open::Opened;
use super::start;
use super::unknown::Part;
use crate::error::{Result, Warning};

/// A robot and its measurements, made ready.
pub struct Bench<'a> {
    input: &'a Calibration,
    opened: &'a Opened,
    settings: Settings,
    /// whose inertia tells the torques of gravity, where they are known
    pub gravity: Option<Gravity>,
    /// torques of gravity, by row and joint, N m
    torques: Option<Vec<Vec<f64>>>,
    /// how links bend under it, where that is known
    bends: Option<Bends>,
    /// poses with nominal geometry, by row; `None` where the readings cannot be
    poses: Vec<Option<Frame>>,
    start: Start,
}

impl<'a> Bench<'a> {
    /// Makes ready.
    ///
    /// # Errors
    /// A robot of gravity that cannot be read; rows that the robot cannot take; a set-up that cannot be started.
    pub fn new(
        input: &'a Calibration,
        opened: &'a Opened,
        settings: Settings,
        warnings: &mut Vec<Warning>,
    ) -> Result<Self> {
        let gravity = match &opened.kin {
            Kin::Arm(_) => gravity::gravity(input, opened, warnings)?,
            Kin::Parallel(_) => None,
        };
        let postures: Vec<Vec<f64>> = input.rows.iter().map(|r| r.q.clone()).collect();
        let poses: Vec<Option<Frame>> = postures
            .iter()
            .map(|q| opened.kin.nominal(q).ok())
            .collect();
        doubts::unreached(input, &poses, warnings)?;
        let start = start::start(input, &opened.kin, &poses)?;
        Ok(Bench {
            input,
            opened,
            settings,
            torques: gravity.as_ref().map(|g| g.torques(&postures)),
            bends: gravity.as_ref().and_then(|g| match &opened.kin {
                Kin::Arm(arm) => Some(bend::bends(g, &arm.names(), &postures)),
                Kin::Parallel(_) => None,
            }),
            gravity,
            poses,
            start,
        })
    }

    /// The model whose joints do this beside turning.
    pub fn model(&self, features: Vec<Feature>) -> Model<'_> {
        let mut model = Model::new(
            self.input,
            &self.opened.kin,
            features,
            self.torques.as_deref(),
            self.start.clone(),
            &self.poses,
            self.settings,
        );
        if let Some(bends) = &self.bends {
            for (rates, bends) in model.rates.iter_mut().zip(bends) {
                for (rate, f) in rates.iter_mut().zip(&model.features) {
                    if f.shape == Shape::Bend {
                        rate.place = bends[f.joint];
                    }
                }
            }
        }
        model
    }

    /// Torques that gravity puts on the joints, by row; `None` where no inertia is known.
    pub fn torques(&self) -> Option<&[Vec<f64>]> {
        self.torques.as_deref()
    }

    /// How links bend under gravity, by row; `None` where no inertia is known.
    pub fn bends(&self) -> Option<&Bends> {
        self.bends.as_ref()
    }

    /// The plan of a first fit: rows for the fit count, no unknown of the robot is free.
    pub fn plan(&self, nominal: &Model) -> Plan {
        Plan {
            weights: (self.input.rows.iter().zip(&self.poses))
                .map(|(r, p)| f64::from(u8::from(r.fit && p.is_some())))
                .collect(),
            free: vec![false; nominal.count()],
            robust: true,
        }
    }

    /// What an effect could add to the joints.
    pub fn columns(&self, part: Part) -> Vec<Feature> {
        let names = &self.opened.joints;
        let motions = self.opened.kin.motions(names.len());
        if part == Part::Bending {
            return match (&self.opened.kin, &self.bends) {
                (Kin::Arm(arm), Some(bends)) => bend::features(&arm.names(), bends),
                _ => Vec::new(),
            };
        }
        match (&self.opened.kin, &self.torques) {
            (Kin::Parallel(_), _) => Vec::new(),
            (Kin::Arm(_), Some(t)) => effects::features(part, names, &motions, t),
            (Kin::Arm(_), None) => {
                let none = vec![vec![0.0; names.len()]; self.input.rows.len()];
                effects::features(part, names, &motions, &none)
            }
        }
    }
}
