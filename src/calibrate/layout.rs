//! The unknowns of the set-up: which there are, and where they start.

use super::entry::KnownPlace;
use super::file::Calibration;
use super::frame::Frame;
use super::kind::Kind;
use super::unknown::{Part, Unknown};
use nalgebra::Vector3;

/// Size by which columns are scaled whose prior does not say it, m and rad.
const SCALE: f64 = 0.01;

/// Where the unknowns of the set-up begin, by measurement.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    /// six numbers of the camera or tracker
    pub camera: Vec<Option<usize>>,
    /// of the target: six numbers, three for a tracker
    pub target: Vec<Option<usize>>,
    /// three numbers of the point or plane; six of what two arms hold
    pub contact: Vec<Option<usize>>,
}

/// Start of the unknowns of the set-up, by measurement.
#[derive(Debug, Clone, Default)]
pub struct Start {
    /// base in the camera's frame
    pub camera: Vec<Frame>,
    /// target on the frame
    pub target: Vec<Frame>,
    /// point, base axes
    pub socket: Vec<Vector3<f64>>,
    /// unit normal, and distance of the plane along it
    pub plane: Vec<(Vector3<f64>, f64)>,
    /// the second arm's frame in that of the first; of a ball joint its place in the first
    pub grip: Vec<Frame>,
    /// place of a ball joint in the second frame, m
    pub ball: Vec<Vector3<f64>>,
}

impl Start {
    /// Nothing is known of so many measurements.
    pub fn none(count: usize) -> Self {
        Start {
            camera: vec![Frame::identity(); count],
            target: vec![Frame::identity(); count],
            socket: vec![Vector3::zeros(); count],
            plane: vec![(Vector3::z(), 0.0); count],
            grip: vec![Frame::identity(); count],
            ball: vec![Vector3::zeros(); count],
        }
    }
}

impl Layout {
    /// Number of unknowns of a contact of this kind.
    pub fn width(kind: Kind) -> usize {
        if kind.is_loop() { 6 } else { 3 }
    }

    /// The unknowns of the set-up of all measurements, behind those that there are.
    pub fn new(input: &Calibration, unknowns: &mut Vec<Unknown>) -> Self {
        let mut layout = Layout::default();
        let wide = [input.prior.pose_length, input.prior.pose_angle];
        let place = |name: &str, part: Part, known: Option<KnownPlace>| -> Vec<Unknown> {
            let std = known.and_then(|k| k.std);
            let all = Unknown::frame(name, part, std.unwrap_or(wide)).into_iter();
            all.map(|u| Unknown {
                scale: std.map_or(u.scale, |_| SCALE),
                held: known.is_some() && std.is_none(),
                ..u
            })
            .collect()
        };
        for (m, measured) in input.measurements.iter().enumerate() {
            let earlier = input.measurements[..m]
                .iter()
                .position(|o| o.kind.has_instrument() && o.instrument == measured.instrument);
            let (mut camera, mut target, mut contact) = (None, None, None);
            let name = |what: &str| match input.measurements.len() {
                1 => what.to_string(),
                _ => format!("{what}({})", measured.instrument),
            };
            match (measured.kind, earlier) {
                (Kind::Pose | Kind::Position, Some(o)) => {
                    (camera, target) = (layout.camera[o], layout.target[o]);
                }
                (Kind::Pose, None) => {
                    camera = Some(unknowns.len());
                    unknowns.extend(place(&name("camera"), Part::Camera, measured.base_at));
                    target = Some(unknowns.len());
                    unknowns.extend(place(&name("target"), Part::Target, measured.target_at));
                }
                (Kind::Position, None) => {
                    camera = Some(unknowns.len());
                    unknowns.extend(place(&name("tracker"), Part::Camera, measured.base_at));
                    target = Some(unknowns.len());
                    let frame = place(&name("target"), Part::Target, measured.target_at);
                    unknowns.extend(frame.into_iter().take(3));
                }
                (Kind::Point, _) => {
                    contact = Some(unknowns.len());
                    for n in ["x", "y", "z"] {
                        unknowns.push(Unknown {
                            scale: SCALE,
                            ..Unknown::new(
                                format!("{}.{n}", measured.file),
                                "m",
                                Part::Socket,
                                f64::INFINITY,
                            )
                        });
                    }
                }
                (Kind::Loop, _) => {
                    contact = Some(unknowns.len());
                    let [length, angle] = match measured.grip {
                        Some((_, std)) => std,
                        None => [f64::INFINITY; 2],
                    };
                    let frame = Unknown::frame(&measured.file, Part::Grip, [length, angle]);
                    unknowns.extend(frame.into_iter().map(|u| Unknown { scale: SCALE, ..u }));
                }
                (Kind::Ball, _) => {
                    contact = Some(unknowns.len());
                    for n in ["x", "y", "z", "other_x", "other_y", "other_z"] {
                        let name = format!("{}.{n}", measured.file);
                        unknowns.push(Unknown {
                            scale: SCALE,
                            ..Unknown::new(name, "m", Part::Grip, f64::INFINITY)
                        });
                    }
                }
                (Kind::Plane | Kind::Gauge, _) => {
                    contact = Some(unknowns.len());
                    for (n, unit) in [("tilt1", "rad"), ("tilt2", "rad"), ("d", "m")] {
                        unknowns.push(Unknown {
                            scale: SCALE,
                            ..Unknown::new(
                                format!("{}.{n}", measured.file),
                                unit,
                                Part::Plane,
                                f64::INFINITY,
                            )
                        });
                    }
                }
            }
            layout.camera.push(camera);
            layout.target.push(target);
            layout.contact.push(contact);
        }
        layout
    }
}
