//! A rehearsal: what a camera or tracker would see, or where a loop would close, of a robot whose geometry is off by its tolerances.

use super::candidates::Search;
use super::reach::{Wanted, reach};
use super::{Poses, Request};
use crate::calibrate::frame::{Frame, exp};
use crate::calibrate::kin::Kin;
use crate::calibrate::kind::Kind;
use crate::calibrate::open::Opened;
use crate::error::{Error, Result};
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rows held out, seen without noise: they show the error of the model and nothing else.
const HELD_OUT: usize = 200;

/// A file of readings for the chosen postures and for random ones that are held out. The seed decides errors, noise and
/// the postures held out.
///
/// # Errors
/// A kind that is no camera or tracker; too few postures to hold out.
pub fn rehearse(opened: &Opened, request: &Request, chosen: &Poses, seed: u64) -> Result<String> {
    if !request.kind.has_instrument() && request.kind != Kind::Loop {
        return Err(Error::Argument(format!(
            "a rehearsal is of poses, positions or loops, not of kind \"{}\"",
            request.kind.name()
        )));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let search = Search::new(opened, request)?;
    let (held_out, _) = search.draw(&mut rng, HELD_OUT);
    // sum of twelve even draws: close to normal, no draw beyond six standard deviations
    let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
    let tolerance = [request.tolerances.length, request.tolerances.angle];
    let unknowns = opened.kin.unknowns(tolerance);
    let x: Vec<f64> = unknowns.iter().map(|u| u.prior * normal()).collect();
    let camera = Frame {
        r: exp(&Vector3::new(2.9, 0.3, -0.2)),
        p: Vector3::new(0.1, -0.05, 1.5),
    };
    let target = Frame {
        r: exp(&Vector3::new(0.1, 0.05, 0.7)),
        p: Vector3::new(0.01, 0.02, 0.05),
    };
    let names = (1..=opened.joints.len()).map(|k| format!("q{k}"));
    let columns = request.kind.columns().iter().map(|c| c.to_string());
    let mut out = names
        .chain(columns)
        .chain(["use".to_string()])
        .collect::<Vec<_>>()
        .join(",")
        + "\n";
    let rows = chosen.postures.iter().map(|c| (c, true));
    for (c, fit) in rows.chain(held_out.iter().map(|c| (c, false))) {
        if request.kind == Kind::Loop {
            // the arms give way until the loop closes, all but the noise
            let mut q = c.q.clone();
            let mut held = request.grip.unwrap_or(Frame::identity());
            if fit {
                held.p += Vector3::from_fn(|_, _| request.std[0] * normal());
                held.r *= exp(&Vector3::from_fn(|_, _| request.std[1] * normal()));
            }
            let Kin::Arm(arm) = &opened.kin else { continue };
            if reach(arm, &mut q, &x, &Wanted::Grip(held)).is_some() {
                out += &q.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
                out += if fit { ",fit\n" } else { ",holdout\n" };
            }
            continue;
        }
        let Ok(posed) = opened.kin.pose(&c.q, &x, &[], &[], Some(&c.frame)) else {
            continue;
        };
        let mut seen = camera.then(&posed.frame).then(&target);
        if fit {
            seen.p += Vector3::from_fn(|_, _| request.std[0] * normal());
            seen.r = exp(&Vector3::from_fn(|_, _| request.std[1] * normal())) * seen.r;
        }
        let q = nalgebra::UnitQuaternion::from_matrix(&seen.r);
        let pose = [seen.p.x, seen.p.y, seen.p.z, q.w, q.i, q.j, q.k];
        let measured = match request.kind {
            Kind::Pose => &pose[..],
            _ => &pose[..3],
        };
        let cells = c.q.iter().chain(measured).map(f64::to_string);
        out += &cells.collect::<Vec<_>>().join(",");
        out += if fit { ",fit\n" } else { ",holdout\n" };
    }
    Ok(out)
}

/// The `calibration.toml` for such a file.
pub fn toml(
    robot: &str,
    [frame, other]: [Option<&str>; 2],
    request: &Request,
    file: &str,
) -> String {
    let name = |s: &str| toml::Value::from(s).to_string();
    let mut out = format!("robot = {}\n", name(robot));
    if let Some(f) = frame {
        out += &format!("frame = {}\n", name(f));
    }
    if let Some(o) = other {
        out += &format!("other = {}\n", name(o));
    }
    let [std, angle] = request.std;
    out += &format!(
        "\n[[measurement]]\nkind = \"{}\"\nfile = {}\nstd = {std}\n",
        request.kind.name(),
        name(file)
    );
    if matches!(request.kind, Kind::Pose | Kind::Loop) {
        out += &format!("angle_std = {angle}\n");
    }
    out + &format!(
        "\n[prior]\nlength = {}\nangle = {}\n",
        request.tolerances.length, request.tolerances.angle
    )
}
