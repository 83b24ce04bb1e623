//! KUKA Fast Robot Interface: joint positions at the send period of the session, which is 1 to 10 ms.

use super::options::Column;
use super::playback::Playback;
use super::{Card, Format, Rates, table};
use crate::error::Result;

/// Joint positions as CSV.
pub struct KukaFri;

impl Format for KukaFri {
    fn card(&self) -> Card {
        Card {
            joints: Some((7, 7)),
            rates: Rates {
                offered: &[100.0, 125.0, 200.0, 250.0, 500.0, 1000.0],
                only: true,
            },
            rest: true,
            ..Card::new(
                "kuka-fri",
                "csv",
                "KUKA LBR, Fast Robot Interface: t, q at the send period",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        table::csv(playback, &[Column::T, Column::Q])
    }
}
