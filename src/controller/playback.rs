//! What is sent: the samples of a course at a rate that the controller takes, and how far it may leave the course.

use super::course::{Channel, Course};
use super::deviation::{Deviation, Interpolation};
use super::options::{Column, Options, columns, fits, scales, select, unknown};
use super::{Choice, Format};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::trajectory::samples::times;
use crate::trajectory::{Fourier, Samples};

/// Most numbers of a playback, some twenty minutes of seven joints at 1 kHz: their text fits the memory of a small
/// computer.
const MOST: usize = 30_000_000;

/// All that a format writes.
#[derive(Debug, Clone)]
pub struct Playback {
    /// name of the robot
    pub robot: String,
    /// the joints that are sent, in this order
    pub joints: Vec<Channel>,
    /// samples a second; 0 for a format without samples
    pub rate: f64,
    /// states of the joints, column by column
    pub samples: Samples,
    /// durations of approach, periodic motion and return, s
    pub parts: [f64; 3],
    /// how many periods run
    pub periods: u32,
    /// the series behind it: of the joints in their order, or of the platform
    pub fourier: Fourier,
    /// names of what the series move
    pub series: Vec<String>,
    /// columns to be written
    pub columns: Vec<Column>,
    /// factor from rad or m to what is written, for each joint
    pub scale: Vec<f64>,
    /// a program begins with a slow move to the start
    pub move_to_start: bool,
    /// how far the controller may leave the motion, by the way it interpolates
    pub deviations: Vec<(Interpolation, Vec<Deviation>)>,
    /// what the user should know before the file is run
    pub warnings: Vec<Warning>,
}

impl Playback {
    /// Samples a course for a format.
    ///
    /// # Errors
    /// [`Error::Argument`] for options that the format does not have; [`Error::Infeasible`] for a course that it cannot
    /// play: another number of joints, joints that slide, a start or an end in motion.
    pub fn new(course: &Course, format: &dyn Format, options: &Options) -> Result<Self> {
        let card = format.card();
        let (joints, order) = select(course.joints(), options.joints.as_deref())?;
        fits(format, &joints)?;
        let columns = columns(format, options)?;
        let scale = scales(format, &joints, &options.units)?;
        if options.move_to_start && !card.moves {
            return Err(unknown(format, "--move-to-start"));
        }
        let mut warnings = Vec::new();
        if joints.len() < course.joints().len() {
            let left = course.joints().iter().filter(|c| !joints.contains(c));
            let left: Vec<&str> = left.map(|c| c.name.as_str()).collect();
            warnings.push(Warning::new(
                WarningKind::JointsLeftOut,
                course.robot(),
                format!(
                    "{} move in the design and are not in the file; play them at the same time, or \
                     collisions and identification are not those of the design",
                    left.join(", ")
                ),
            ));
        }
        ends(course, format, &mut warnings)?;
        let ways = ways(card.between, card.choice, &columns);
        let (rate, samples, deviations) = match card.rates.offered.is_empty() {
            true => {
                if options.rate.is_some() {
                    return Err(unknown(format, "--rate"));
                }
                if course.parts()[0] > 0.0 || course.parts()[2] > 0.0 {
                    return Err(Error::Infeasible(format!(
                        "{} holds the series of the periodic motion and nothing else; leave out --approach \
                         and --return, or use another format",
                        card.name
                    )));
                }
                (0.0, Samples::with_capacity(joints.len(), 0), Vec::new())
            }
            false => {
                let rate = rate(course, format, options.rate, ways[0], &order, &mut warnings)?;
                let times = times(course.duration(), rate)?;
                if times.len().saturating_mul(3 * course.joints().len()) > MOST {
                    return Err(Error::Infeasible(format!(
                        "{} samples of {} joints are too many for one file; lower --rate or --periods",
                        times.len(),
                        course.joints().len()
                    )));
                }
                let mut all = course.sample(&times)?;
                let pick = |columns: &mut [Vec<f64>]| -> Vec<Vec<f64>> {
                    order
                        .iter()
                        .map(|&j| std::mem::take(&mut columns[j]))
                        .collect()
                };
                let samples = Samples {
                    q: pick(&mut all.q),
                    qd: pick(&mut all.qd),
                    qdd: pick(&mut all.qdd),
                    t: all.t,
                };
                let mut deviations = Vec::new();
                for way in ways {
                    let all = course.deviations(way, rate)?;
                    deviations.push((way, order.iter().map(|&j| all[j]).collect()));
                }
                (rate, samples, deviations)
            }
        };
        let (fourier, series) = match course.is_of_joints() {
            true => {
                let mut f = course.fourier().clone();
                f.joints = order.iter().map(|&j| f.joints[j].clone()).collect();
                (f, joints.iter().map(|c| c.name.clone()).collect())
            }
            false => (course.fourier().clone(), course.series().to_vec()),
        };
        Ok(Playback {
            robot: course.robot().to_string(),
            joints,
            rate,
            samples,
            parts: course.parts(),
            periods: course.periods(),
            fourier,
            series,
            columns,
            scale,
            move_to_start: options.move_to_start,
            deviations,
            warnings,
        })
    }

    /// Seconds that will run.
    pub fn duration(&self) -> f64 {
        self.parts.iter().sum()
    }

    /// Positions of sample `i`, as they are written.
    pub fn row(&self, i: usize) -> Vec<f64> {
        let q = self.samples.q.iter().zip(&self.scale);
        q.map(|(column, scale)| scale * column[i]).collect()
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether the format has no samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}

/// A controller that is sent its positions one by one starts and ends at rest.
fn ends(course: &Course, format: &dyn Format, warnings: &mut Vec<Warning>) -> Result<()> {
    let Some((joint, place, v, a)) = course.moving_ends()?.into_iter().next() else {
        return Ok(());
    };
    let option = match place {
        "starts" => "--approach",
        _ => "--return",
    };
    let message = format!(
        "the motion {place} with velocity {v:.3} and acceleration {a:.3}; a controller cannot play that from \
         rest: give the move with {option}, or design with --ends rest"
    );
    if format.card().rest {
        return Err(Error::Infeasible(format!("{joint}: {message}")));
    }
    warnings.push(Warning::new(WarningKind::MovingEnds, joint, message));
    Ok(())
}

/// How a controller may interpolate, the way that the rate is chosen by first.
fn ways(between: Interpolation, choice: Choice, columns: &[Column]) -> Vec<Interpolation> {
    let mut able = vec![Interpolation::Linear];
    if columns.contains(&Column::Dq) {
        able.push(Interpolation::Cubic);
        if columns.contains(&Column::Ddq) {
            able.push(Interpolation::Quintic);
        }
    }
    match choice {
        Choice::None => vec![between],
        Choice::Columns => able,
        Choice::Derivatives => able.split_off(able.len() - 1),
    }
}

/// The rate that is asked for, if the controller takes it; otherwise the lowest one that it takes whose deviation is as
/// small as aimed at, or its highest.
fn rate(
    course: &Course,
    format: &dyn Format,
    asked: Option<f64>,
    way: Interpolation,
    order: &[usize],
    warnings: &mut Vec<Warning>,
) -> Result<f64> {
    let card = format.card();
    let rates = card.rates;
    if let Some(rate) = asked {
        if !(rate.is_finite() && rate > 0.0) {
            return Err(Error::Argument(format!(
                "--rate is a positive number of hertz, not {rate}"
            )));
        }
        if !rates.only {
            return Ok(rate);
        }
        let near = |r: &&f64| (rate / **r - 1.0).abs() < 1e-3;
        return rates.offered.iter().find(near).copied().ok_or_else(|| {
            let list: Vec<String> = rates
                .offered
                .iter()
                .map(|r| super::text::short(*r))
                .collect();
            Error::Argument(format!(
                "--rate: {} takes {} Hz, not {rate}",
                card.name,
                list.join(", ")
            ))
        });
    }
    let mut coarse = None;
    for &rate in rates.offered {
        let all = course.deviations(way, rate)?;
        let far = |j: &usize| all[*j].value / all[*j].aim;
        let worst = order.iter().max_by(|a, b| far(a).total_cmp(&far(b)));
        let Some(&j) = worst.filter(|j| far(j) > 1.0) else {
            return Ok(rate);
        };
        coarse = Some((rate, j, all[j]));
    }
    let Some((rate, j, found)) = coarse else {
        return Err(unknown(format, "--rate"));
    };
    // what is held lags by a step in any case
    if way != Interpolation::Hold {
        warnings.push(Warning::new(
            WarningKind::RateCoarse,
            course.joints()[j].name.as_str(),
            format!(
                "between two points the controller may leave the motion by {:.2e}, {:.0e} was aimed at; {} \
                 Hz is the most that is offered",
                found.value,
                found.aim,
                super::text::short(rate)
            ),
        ));
    }
    Ok(rate)
}
