//! Franka Control Interface: joint positions at 1 kHz, for a callback of libfranka.

use super::options::Column;
use super::playback::Playback;
use super::{Card, Format, Rates, table};
use crate::error::Result;

/// Joint positions and velocities as CSV.
pub struct Franka;

impl Format for Franka {
    fn card(&self) -> Card {
        Card {
            joints: Some((7, 7)),
            rates: Rates {
                offered: &[1000.0],
                only: true,
            },
            rest: true,
            ..Card::new(
                "franka",
                "csv",
                "Franka Control Interface: t, q, dq at 1 kHz for a callback of libfranka",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        table::csv(playback, &[Column::T, Column::Q, Column::Dq])
    }
}
