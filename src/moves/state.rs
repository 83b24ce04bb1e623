//! Where a move starts and ends.

use crate::trajectory::Fourier;

/// Position, velocity and acceleration of all coordinates.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct State {
    /// positions, rad or m
    pub q: Vec<f64>,
    /// velocities
    pub qd: Vec<f64>,
    /// accelerations
    pub qdd: Vec<f64>,
}

impl State {
    /// At rest in a posture.
    pub fn rest(q: &[f64]) -> Self {
        State {
            q: q.to_vec(),
            qd: vec![0.0; q.len()],
            qdd: vec![0.0; q.len()],
        }
    }

    /// Where a trajectory starts, and passes at every period's end. Rates that vanish but for rounding
    /// count as zero.
    pub fn start_of(trajectory: &Fourier) -> Self {
        let mut state = State::rest(&vec![0.0; trajectory.dof()]);
        trajectory.evaluate(0.0, [&mut state.q, &mut state.qd, &mut state.qdd]);
        let omega = std::f64::consts::TAU / trajectory.period;
        for (k, series) in trajectory.joints.iter().enumerate() {
            for (rate, order) in [(&mut state.qd[k], 1), (&mut state.qdd[k], 2)] {
                let size = series.amplitude_sum(&trajectory.harmonics, omega, order);
                if rate.abs() <= 1e-9 * size {
                    *rate = 0.0;
                }
            }
        }
        state
    }

    /// Whether nothing moves.
    pub fn is_rest(&self) -> bool {
        self.qd.iter().chain(&self.qdd).all(|x| *x == 0.0)
    }
}
