//! MuJoCo: targets of position actuators as NumPy arrays, and a keyframe with the start.

use super::playback::Playback;
use super::text::{exact, plain};
use super::zip::zip;
use super::{Card, Format, Interpolation, Rates};
use crate::error::Result;

/// `.npz` with `t`, `ctrl`, `rate`, `joints`, `qpos`, `qvel`.
pub struct Control;

/// An array as in a `.npy` file: version 1.0, a header that ends at a multiple of 64 bytes.
fn npy(kind: &str, shape: &[usize], bytes: Vec<u8>) -> Vec<u8> {
    let sizes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({sizes}), }}");
    while !(10 + head.len() + 1).is_multiple_of(64) {
        head.push(' ');
    }
    head.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((head.len() as u16).to_le_bytes());
    out.extend(head.into_bytes());
    out.extend(bytes);
    out
}

fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Texts as NumPy keeps them: four bytes a character, filled with zeros to the longest.
fn texts(names: &[&str]) -> Vec<u8> {
    let longest = names
        .iter()
        .map(|n| n.chars().count())
        .max()
        .unwrap_or(0)
        .max(1);
    let mut bytes = Vec::new();
    for name in names {
        let codes = name.chars().map(u32::from).chain(std::iter::repeat(0));
        bytes.extend(codes.take(longest).flat_map(u32::to_le_bytes));
    }
    npy(&format!("<U{longest}"), &[names.len()], bytes)
}

impl Format for Control {
    fn card(&self) -> Card {
        Card {
            // one point a step of the default length
            rates: Rates {
                offered: &[500.0],
                only: false,
            },
            between: Interpolation::Hold,
            ..Card::new(
                "mujoco",
                "npz",
                "MuJoCo: targets of position actuators (NumPy), and a keyframe with the start",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        let (n, rows) = (playback.joints.len(), playback.len());
        let table = |columns: &[Vec<f64>]| -> Vec<u8> {
            let at = |i: usize| columns.iter().map(move |c| c[i]);
            (0..rows).flat_map(at).flat_map(f64::to_le_bytes).collect()
        };
        let s = &playback.samples;
        let start = |columns: &[Vec<f64>]| -> Vec<f64> {
            columns.iter().filter_map(|c| c.first().copied()).collect()
        };
        let names: Vec<&str> = playback.joints.iter().map(|c| c.name.as_str()).collect();
        zip(&[
            ("t.npy", npy("<f8", &[rows], doubles(&s.t))),
            ("ctrl.npy", npy("<f8", &[rows, n], table(&s.q))),
            ("rate.npy", npy("<f8", &[], doubles(&[playback.rate]))),
            ("qpos.npy", npy("<f8", &[n], doubles(&start(&s.q)))),
            ("qvel.npy", npy("<f8", &[n], doubles(&start(&s.qd)))),
            ("joints.npy", texts(&names)),
        ])
    }

    fn beside(&self, playback: &Playback) -> Option<(&'static str, String)> {
        let first = |columns: &[Vec<f64>]| -> String {
            let values = columns.iter().filter_map(|c| c.first().copied());
            values.map(exact).collect::<Vec<_>>().join(" ")
        };
        let s = &playback.samples;
        let names: Vec<String> = playback.joints.iter().map(|c| plain(&c.name)).collect();
        let text = format!(
            "<mujoco>\n  <!-- joints and actuators in this order: {} -->\n  <keyframe>\n    <key name=\"start\" \
             qpos=\"{q}\" qvel=\"{}\" ctrl=\"{q}\"/>\n  </keyframe>\n</mujoco>\n",
            names.join(", ").replace("--", "__"),
            first(&s.qd),
            q = first(&s.q),
        );
        Some(("_start.xml", text))
    }
}
