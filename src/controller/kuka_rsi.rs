//! KUKA Robot Sensor Interface: corrections of the axes relative to the start, degrees, one telegram a cycle of 4 ms
//! (`#IPO_FAST`) or 12 ms (`#IPO`).

use super::playback::Playback;
use super::text::{exact, nine, plain};
use super::{Card, Format, Rates};
use crate::error::Result;

/// Telegrams of the sensor, in a document with the start.
pub struct KukaRsi;

/// Names of the axes: six of the arm, then external ones.
fn axis(j: usize) -> String {
    match j < 6 {
        true => format!("A{}", j + 1),
        false => format!("E{}", j - 5),
    }
}

/// Attributes of a telegram; external axes stand in an element of their own.
fn attributes(values: &[f64], number: fn(f64) -> String) -> (String, Option<String>) {
    let text = |range: std::ops::Range<usize>| -> String {
        let one = |j: usize| format!(" {}=\"{}\"", axis(j), number(values[j]));
        range.map(one).collect()
    };
    let external = (values.len() > 6).then(|| text(6..values.len()));
    (text(0..values.len().min(6)), external)
}

impl Format for KukaRsi {
    fn card(&self) -> Card {
        Card {
            joints: Some((1, 12)),
            rates: Rates {
                offered: &[250.0 / 3.0, 250.0],
                only: true,
            },
            rest: true,
            ..Card::new(
                "kuka-rsi",
                "xml",
                "KUKA Robot Sensor Interface: corrections of the axes from the start, deg, every 4 or 12 ms",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        let start: Vec<f64> = playback.row(0).iter().map(|q| q.to_degrees()).collect();
        let (arm, external) = attributes(&start, exact);
        let mut out = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- {}: corrections from the start, degrees -->\n\
             <Motion Cycle=\"{}\" Telegrams=\"{}\">\n<Start><AIPos{arm}/>",
            plain(&playback.robot).replace("--", "__"),
            exact((1e9 / playback.rate).round() / 1e9),
            playback.len(),
        );
        if let Some(external) = external {
            out += &format!("<EIPos{external}/>");
        }
        out += "</Start>\n";
        for i in 0..playback.len() {
            let row: Vec<f64> = playback.row(i).iter().map(|q| q.to_degrees()).collect();
            let away: Vec<f64> = row.iter().zip(&start).map(|(q, s)| q - s).collect();
            let (arm, external) = attributes(&away, nine);
            out += &format!("<Sen Type=\"ImFree\"><AK{arm}/>");
            if let Some(external) = external {
                out += &format!("<EK{external}/>");
            }
            out += "<IPOC>0</IPOC></Sen>\n";
        }
        out += "</Motion>\n";
        Ok(out.into_bytes())
    }
}
