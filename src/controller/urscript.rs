//! Universal Robots: a program that checks where the arm is and sends one `servoj` a sample.

use super::playback::Playback;
use super::text::{exact, identifier, list, nine, plain};
use super::{Card, Format, Rates};
use crate::error::Result;

/// How far a joint may be from the start, rad.
pub(super) const NEAR: f64 = 0.01;

/// A URScript program.
pub struct UrScript;

impl Format for UrScript {
    fn card(&self) -> Card {
        Card {
            joints: Some((6, 6)),
            // 125 Hz is the cycle of a CB3, 500 Hz that of the later ones
            rates: Rates {
                offered: &[125.0, 250.0, 500.0],
                only: true,
            },
            rest: true,
            moves: true,
            ..Card::new(
                "urscript",
                "script",
                "Universal Robots: a program of servoj commands that checks the start",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        let name = format!("excite_{}", identifier(&playback.robot));
        let joints: Vec<String> = playback.joints.iter().map(|c| plain(&c.name)).collect();
        let start = list(&playback.row(0), nine);
        let step = exact(1.0 / playback.rate);
        let mut out = format!(
            "# {}: {} points, one every {step} s, {} s\n# joints: {}\ndef {name}():\n",
            plain(&playback.robot),
            playback.len(),
            playback.duration(),
            joints.join(", ")
        );
        out += &format!("  start = [{start}]\n");
        if playback.move_to_start {
            out += "  # slowly to the start; nobody has looked for obstacles on the way\n  movej(start, a=0.5, \
                    v=0.25)\n";
        }
        out += &format!(
            "  here = get_actual_joint_positions()\n  j = 0\n  while j < 6:\n    away = here[j] - start[j]\n    \
             if away > {NEAR} or away < -{NEAR}:\n      popup(\"The arm is not at the start of the motion. Move it \
             there first.\", title=\"excite\", error=True, blocking=True)\n      halt\n    end\n    j = j + 1\n  \
             end\n"
        );
        for i in 0..playback.len() {
            let q = list(&playback.row(i), nine);
            out += &format!("  servoj([{q}], 0, 0, {step}, 0.1, 300)\n");
        }
        out += &format!("  stopj(1.0)\nend\n{name}()\n");
        Ok(out.into_bytes())
    }
}
