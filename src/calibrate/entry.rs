//! `[[measurement]]` of a `calibration.toml`, as it stands there.

use super::frame::Frame;
use super::kind::{Held, Kind, Purpose};
use super::pixels::{Camera, Optics};
use crate::error::{Error, Result};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;
use std::path::Path;

/// One `[[measurement]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    kind: Held,
    pub(super) file: String,
    pub(super) group: Option<String>,
    #[serde(rename = "use")]
    pub(super) purpose: Option<Purpose>,
    pub(super) std: Option<f64>,
    pub(super) angle_std: Option<f64>,
    pub(super) instrument: Option<String>,
    camera: Option<Camera>,
    target: Option<String>,
    hold: Option<Hold>,
    grip: Option<[f64; 7]>,
    grip_std: Option<[f64; 2]>,
    base_at: Option<[f64; 7]>,
    base_at_std: Option<[f64; 2]>,
    target_at: Option<[f64; 7]>,
    target_at_std: Option<[f64; 2]>,
}

/// How two arms hold each other.
#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Hold {
    Rigid,
    Ball,
}

/// Noise of a stated grip where none is stated: m and rad.
const GRIP_STD: [f64; 2] = [1e-4, 5e-4];

/// Noise of a coordinate in a picture where none is stated, pixels.
const PIXEL_STD: f64 = 0.1;

impl Entry {
    /// Poses of a target, and nothing else said.
    pub(super) fn poses(file: String) -> Self {
        Entry {
            kind: Held::Pose,
            file,
            group: None,
            purpose: None,
            std: None,
            angle_std: None,
            instrument: None,
            camera: None,
            target: None,
            hold: None,
            grip: None,
            grip_std: None,
            base_at: None,
            base_at_std: None,
            target_at: None,
            target_at_std: None,
        }
    }

    /// What is measured by it.
    pub(super) fn kind(&self) -> Kind {
        match (self.kind.kind(), self.hold) {
            (Kind::Loop, Some(Hold::Ball)) => Kind::Ball,
            (kind, _) => kind,
        }
    }

    /// Camera and target of a measurement of kind "pixels"; `None` for the others.
    pub(super) fn optics(&self, folder: &Path) -> Result<Option<Optics>> {
        let wrong = |what: String| Err(Error::Argument(what));
        if self.kind != Held::Pixels {
            return match (&self.camera, &self.target) {
                (None, None) => Ok(None),
                _ => wrong("camera and target are for kind = \"pixels\"".into()),
            };
        }
        let (Some(camera), Some(target)) = (self.camera, &self.target) else {
            return wrong(
            "kind = \"pixels\" needs camera = { fx = …, fy = …, cx = …, cy = … } in pixels and target = \"target.csv\" with the \
             points of the target, x, y, z in m"
                .into(),
        );
        };
        let distortion = [camera.k1, camera.k2, camera.p1, camera.p2, camera.k3];
        let all = [camera.cx, camera.cy].into_iter().chain(distortion);
        let able = camera.fx > 0.0
            && camera.fy > 0.0
            && all.chain([camera.fx, camera.fy]).all(f64::is_finite);
        if !able {
            return wrong("camera: fx and fy must be positive, and all numbers finite".into());
        }
        let std = self.std.unwrap_or(PIXEL_STD);
        if !(std.is_finite() && std > 0.0) {
            return wrong(format!("std is {std}; it must be positive, in pixels"));
        }
        if self.angle_std.is_some() {
            return wrong(
                "kind = \"pixels\" has no angle_std; std is that of a coordinate, in pixels".into(),
            );
        }
        Ok(Some(Optics {
            camera,
            points: Optics::points(&folder.join(target))?,
            std,
        }))
    }

    /// The grip that a measurement states, with its standard deviations.
    pub(super) fn grip(&self) -> Result<Option<(Frame, [f64; 2])>> {
        let kind = self.kind();
        let wrong = |what: String| Err(Error::Argument(what));
        if !kind.is_loop() && (self.hold.is_some() || self.grip.is_some()) {
            return wrong("hold and grip are for kind = \"loop\"".into());
        }
        if kind == Kind::Ball && self.grip.is_some() {
            return wrong("grip is that of a rigid hold; where a ball joint sits is found".into());
        }
        let of = "the second frame in the first";
        let found = stated("grip", self.grip, self.grip_std, of)?;
        Ok(found.map(|k| (k.frame, k.std.unwrap_or(GRIP_STD))))
    }

    /// Where the base is known to stand before the instrument, and the target on the frame.
    pub(super) fn known(&self) -> Result<[Option<KnownPlace>; 2]> {
        let place = |key: &str, at: Option<[f64; 7]>, std: Option<[f64; 2]>, of: &str| {
            let found = stated(key, at, std, of)?;
            if found.is_some() && !self.kind().has_instrument() {
                return Err(Error::Argument(format!(
                    "{key} is for measurements by a camera or a tracker: kind = \"pose\", \"pixels\" or \"position\""
                )));
            }
            Ok(found)
        };
        Ok([
            place(
                "base_at",
                self.base_at,
                self.base_at_std,
                "the robot's base in the frame of the instrument",
            )?,
            place(
                "target_at",
                self.target_at,
                self.target_at_std,
                "the target in the frame that is measured",
            )?,
        ])
    }
}

/// A place of the set-up that the file states.
#[derive(Debug, Clone, Copy)]
pub struct KnownPlace {
    /// where it is
    pub frame: Frame,
    /// its standard deviations, m and rad; it is taken as exact without them
    pub std: Option<[f64; 2]>,
}

/// A place under `key`, with the standard deviations under `key_std`.
fn stated(
    key: &str,
    at: Option<[f64; 7]>,
    std: Option<[f64; 2]>,
    of: &str,
) -> Result<Option<KnownPlace>> {
    let std_key = format!("{key}_std");
    match (at, std) {
        (None, None) => Ok(None),
        (None, Some(_)) => Err(Error::Argument(format!(
            "{std_key} is that of {key}, and there is none"
        ))),
        (Some(at), std) => Ok(Some(KnownPlace {
            frame: frame(key, at, of)?,
            std: std.map(|s| deviations(&std_key, s)).transpose()?,
        })),
    }
}

/// A pose as `x, y, z, qw, qx, qy, qz`.
fn frame(key: &str, at: [f64; 7], of: &str) -> Result<Frame> {
    let [x, y, z, qw, qx, qy, qz] = at;
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    if !at.iter().all(|v| v.is_finite()) || (quaternion.norm() - 1.0).abs() > 1e-3 {
        return Err(Error::Argument(format!(
            "{key} is x, y, z (m) and qw, qx, qy, qz (of length 1) of {of}"
        )));
    }
    Ok(Frame {
        r: *UnitQuaternion::from_quaternion(quaternion)
            .to_rotation_matrix()
            .matrix(),
        p: Vector3::new(x, y, z),
    })
}

/// Standard deviations of a pose.
fn deviations(key: &str, std: [f64; 2]) -> Result<[f64; 2]> {
    if std.iter().all(|v| v.is_finite() && *v > 0.0) {
        return Ok(std);
    }
    Err(Error::Argument(format!(
        "{key} is two positive numbers, m and rad"
    )))
}
