//! UFACTORY xArm: a Python program for its SDK that checks where the arm is and sends the points in servo mode.

use super::playback::Playback;
use super::text::{exact, list, nine, plain, quoted};
use super::urscript::NEAR;
use super::{Card, Format, Rates};
use crate::error::Result;

/// A Python program.
pub struct XArm;

impl Format for XArm {
    fn card(&self) -> Card {
        Card {
            joints: Some((5, 7)),
            // the controller drops what comes faster than 250 Hz
            rates: Rates {
                offered: &[100.0, 125.0, 200.0, 250.0],
                only: true,
            },
            rest: true,
            moves: true,
            ..Card::new(
                "xarm",
                "py",
                "UFACTORY xArm: a Python program of set_servo_angle_j commands, rad, up to 250 Hz",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        let names: Vec<String> = playback.joints.iter().map(|c| quoted(&c.name)).collect();
        let mut out = format!(
            "\"\"\"{}: {} points in {} s. Run with the address of the arm.\"\"\"\n\nJOINTS = [{}]\nRATE = {}  # \
             Hz\nNEAR = {NEAR}  # rad\nMOVE_TO_START = {}\nPOINTS = [  # rad\n",
            plain(&playback.robot),
            playback.len(),
            playback.duration(),
            names.join(", "),
            exact(playback.rate),
            if playback.move_to_start {
                "True"
            } else {
                "False"
            },
        );
        for i in 0..playback.len() {
            out += &format!("    [{}],\n", list(&playback.row(i), nine));
        }
        out += "]\n";
        out += PLAYER;
        Ok(out.into_bytes())
    }
}

/// What plays the points; `arm` is an `XArmAPI`.
const PLAYER: &str = r#"

def play(arm, clock, sleep):
    def do(code):
        if code:
            raise SystemExit(f"the arm answers {code}; stopped")

    start = POINTS[0]
    do(arm.motion_enable(enable=True))
    if MOVE_TO_START:  # slowly; nobody has looked for obstacles on the way
        do(arm.set_mode(0))
        do(arm.set_state(0))
        do(arm.set_servo_angle(angle=start, speed=0.25, mvacc=0.5, is_radian=True, wait=True))
    code, here = arm.get_servo_angle(is_radian=True)
    do(code)
    away = max(abs(a - b) for a, b in zip(here, start))
    if away > NEAR:
        raise SystemExit(f"the arm is {away:.3f} rad from the start of the motion; move it there first")
    do(arm.set_mode(1))
    do(arm.set_state(0))
    sleep(0.1)
    begin = clock()
    for i, point in enumerate(POINTS):
        while clock() < begin + i / RATE:
            pass  # sleeping is not exact enough
        do(arm.set_servo_angle_j(point, is_radian=True))
    sleep(0.1)
    do(arm.set_mode(0))


if __name__ == "__main__":
    import sys
    import time
    from xarm.wrapper import XArmAPI

    if len(sys.argv) != 2:
        raise SystemExit(f"usage: {sys.argv[0]} ADDRESS")
    play(XArmAPI(sys.argv[1], is_radian=True), time.perf_counter, time.sleep)
"#;
