//! A C header: the coefficients, and a function that evaluates them at any time.

use super::playback::Playback;
use super::text::{exact, list, plain};
use super::{Card, Format, Rates};
use crate::error::Result;

/// The header.
pub struct CHeader;

impl Format for CHeader {
    fn card(&self) -> Card {
        Card {
            rates: Rates {
                offered: &[],
                only: true,
            },
            ..Card::new(
                "c",
                "h",
                "C header: the coefficients and a function that evaluates them at any time",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        let f = &playback.fourier;
        let table = |of: &dyn Fn(usize) -> Vec<f64>| -> String {
            let rows = (0..f.dof()).map(|j| format!("    {{ {} }}", list(&of(j), exact)));
            rows.collect::<Vec<_>>().join(",\n")
        };
        let constants: Vec<f64> = f.joints.iter().map(|s| s.constant).collect();
        let harmonics: Vec<f64> = f.harmonics.iter().map(|&h| f64::from(h)).collect();
        let names: Vec<String> = playback.series.iter().map(|n| plain(n)).collect();
        let mut out = format!(
            "/* {}: {}, in this order; rad or m, s.\n   The motion repeats after EXCITE_PERIOD and is designed to \
             run for EXCITE_DURATION. */\n#ifndef EXCITE_MOTION_H\n#define EXCITE_MOTION_H\n#include <math.h>\n\n",
            plain(&playback.robot),
            names.join(", ")
        );
        out += &format!(
            "#define EXCITE_JOINTS {}\n#define EXCITE_HARMONICS {}\n#define EXCITE_PERIOD {}\n#define \
             EXCITE_DURATION {}\n\n",
            f.dof(),
            f.harmonics.len(),
            exact(f.period),
            exact(playback.duration())
        );
        out += &format!(
            "static const double excite_harmonic[EXCITE_HARMONICS] = {{ {} }};\nstatic const double \
             excite_constant[EXCITE_JOINTS] = {{ {} }};\n",
            list(&harmonics, exact),
            list(&constants, exact)
        );
        for (name, of) in [
            (
                "sin",
                &(|j: usize| f.joints[j].sin.clone()) as &dyn Fn(usize) -> Vec<f64>,
            ),
            ("cos", &|j: usize| f.joints[j].cos.clone()),
        ] {
            out += &format!(
                "static const double excite_{name}[EXCITE_JOINTS][EXCITE_HARMONICS] = {{\n{}\n}};\n",
                table(of)
            );
        }
        out += EVALUATOR;
        Ok(out.into_bytes())
    }
}

/// `q(t) = c_0 + Σ_h [ s_h sin(h ω t) + c_h cos(h ω t) ]` and its first two derivatives.
const EVALUATOR: &str = r"
/* Position, velocity and acceleration at the time t. */
static void excite_at(double t, double q[], double dq[], double ddq[]) {
    const double turn = 6.283185307179586476925;
    const double periods = t / EXCITE_PERIOD - floor(t / EXCITE_PERIOD);
    for (int j = 0; j < EXCITE_JOINTS; j++) {
        q[j] = excite_constant[j];
        dq[j] = ddq[j] = 0.0;
        for (int h = 0; h < EXCITE_HARMONICS; h++) {
            const double x = excite_harmonic[h] * periods, angle = turn * (x - floor(x));
            const double w = turn * excite_harmonic[h] / EXCITE_PERIOD;
            const double s = sin(angle), c = cos(angle);
            const double wave = excite_sin[j][h] * s + excite_cos[j][h] * c;
            q[j] += wave;
            dq[j] += w * (excite_sin[j][h] * c - excite_cos[j][h] * s);
            ddq[j] -= w * w * wave;
        }
    }
}

#endif
";
