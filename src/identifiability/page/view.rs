//! What the view of a robot shows: its bodies along the motion, their volumes, what stands about, how near
//! each joint comes to its limits, and what comes nearest to what.

use crate::collision::scene::{self, Scene};
use crate::dynamics::Samples;
use crate::error::Result;
use crate::mechanism::Segment;
use crate::plant::Plant;
use crate::report::html::{self, Section};
use crate::report::plot::{Colour, Shape as Drawn};
use crate::report::view::{Body, Frame, Line, Nearest, Obstacle, Point, Solid, Use, View, Volume};
use crate::robot::Joint;
use crate::solid::hull::hull;
use crate::solid::{Pose, Shape};
use maud::html;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Samples a second that are shown.
const SHOWN: f64 = 20.0;
/// Most samples that are shown.
const MOST: usize = 400;
/// Most numbers of poses: fewer samples of robots with very many bodies.
const NUMBERS: usize = 90_000;

/// The section of the page; `None` where there is nothing to show.
pub(super) fn section(view: &View) -> Option<Section> {
    let markup = view.markup()?;
    let caption = html! {
        (html::legend(&[(Colour::GREEN, Drawn::Line, &format!("path of {}", view.path_of))]))
        @if !view.nearest.is_empty() {
            (html::legend(&[(Colour::VERMILLION, Drawn::Line, "nearest pair")]))
        }
        "A link is lit as its joint uses more of a limit of position, velocity, acceleration or torque. "
        (match (view.volumes.is_empty(), view.lines.is_empty()) {
            (false, _) => "Links are drawn by the volumes that collisions are checked with. ",
            (true, true) => "No volumes of the links are known: joints are drawn along their axes, links as \
                rods between their frames. ",
            (true, false) => "No volumes of the links are known: legs, arms and rods are drawn by their axes. ",
        })
        "Drag to turn, with Shift to move, click and use the wheel to come closer; Space plays, the arrow \
         keys step."
    };
    Some(Section::new(
        "The robot in motion",
        html! { (markup) p { small { (caption) } } },
    ))
}

/// The view of one period of so many seconds: `motion` of the coordinates and `actuators` with `torque` at
/// the same samples, evenly spaced, the end point left out.
///
/// # Errors
/// A pose of a closed chain that cannot be reached.
pub(in crate::identifiability) fn fill(
    plant: &Plant,
    period: f64,
    motion: &Samples,
    actuators: &Samples,
    torque: &[f64],
    scene: Option<&Scene>,
) -> Result<View> {
    let robot = plant.robot();
    let tree = plant.joint_motion(motion)?;
    let count = motion.count.max(1);
    let lines = |samples: &[usize]| Lines::of(plant, motion, samples);
    let first = lines(&[0]).map_or(0, |l| l.names.len());
    // of a chain that is drawn by lines only the bodies with volumes are needed
    let mut shown: Vec<bool> = vec![first == 0; robot.bodies.len()];
    for body in scene.iter().flat_map(|s| &s.volumes).filter_map(|v| v.body) {
        shown[body] = true;
    }
    let numbers = 7 * shown.iter().filter(|s| **s).count() + 6 * first;
    let samples = samples(count, period, numbers);
    let lines = lines(&samples);
    if lines.is_none() {
        shown.fill(true);
    }
    let place: Vec<i64> = (0..shown.len()).map(|b| rank(&shown, b)).collect();
    let tool = plant.tool();
    let tip = |b: usize| -> Option<Vector3<f64>> {
        let carries = robot.bodies.iter().any(|k| k.parent == Some(b));
        let far = |c: &Vector3<f64>| c.norm() > 1e-3;
        let com = robot.bodies[b].inertia.com().filter(far);
        com.filter(|_| !carries && plant.driver(b).is_some())
    };
    let joints = plant.actuators();
    let mut view = View {
        label: format!("{} along one period, drawn in space", plant.name()),
        path_of: tool.map_or(String::new(), |b| {
            let name = &robot.bodies[b].name;
            match tip(b) {
                Some(_) => format!("the centre of mass of {name}"),
                None => format!("the origin of {name}"),
            }
        }),
        times: samples
            .iter()
            .map(|s| *s as f64 * period / count as f64)
            .collect(),
        joints: joints.iter().map(|j| j.name.clone()).collect(),
        ..View::default()
    };
    view.bodies = (0..shown.len())
        .filter(|b| shown[*b])
        .map(|b| Body {
            parent: robot.bodies[b].parent.map_or(-1, |p| place[p]),
            joint: lit(plant, b),
            axis: robot.bodies[b].axis.into(),
            tip: tip(b).map(Point::from),
        })
        .collect();
    if let Some(s) = scene {
        view.volumes = s.volumes.iter().map(|v| volume(v, &place)).collect();
        view.obstacles = s.obstacles.iter().map(obstacle).collect();
        view.pairs = s
            .pairs
            .iter()
            .map(|p| s.names(p).map(String::from))
            .collect();
    }
    let mut at = Vec::new();
    let mut before: Vec<Frame> = Vec::new();
    for &s in &samples {
        let s = s % count;
        let q: Vec<f64> = (0..tree.dof).map(|k| tree.q[k * tree.count + s]).collect();
        scene::poses(robot, &q, &mut at);
        let frames: Vec<Frame> = (at.iter().zip(&shown).filter(|(_, shown)| **shown))
            .enumerate()
            .map(|(b, (pose, _))| frame(pose, before.get(b)))
            .collect();
        before.clone_from(&frames);
        view.frames.push(frames);
        if let Some(b) = tool.filter(|b| *b < at.len()) {
            view.path
                .push(at[b].apply(&tip(b).unwrap_or_default()).into());
        }
        let of = |j: usize| usage(joints[j], actuators, torque, j, s);
        view.used.push((0..joints.len()).map(of).collect());
        view.nearest
            .extend(scene.and_then(|scene| nearest(scene, &at)));
    }
    if let Some(lines) = lines {
        view.lines = lines.names.iter().map(|name| line(name, plant)).collect();
        view.ends = lines.ends;
    }
    Ok(view)
}

/// How many bodies are shown before this one; −1: it is not shown.
fn rank(shown: &[bool], body: usize) -> i64 {
    match shown[body] {
        true => shown[..body].iter().filter(|s| **s).count() as i64,
        false => -1,
    }
}

/// Samples to be shown, the first one once more at the end, where the motion has come round.
fn samples(count: usize, period: f64, numbers: usize) -> Vec<usize> {
    let most = (NUMBERS / numbers.max(1)).clamp(20, MOST);
    let stride = ((count as f64 / (period * SHOWN)) as usize).max(count.div_ceil(most));
    (0..count).step_by(stride).chain([count]).collect()
}

/// Pose as position and quaternion, the one of its two signs that is nearer to the sample before.
fn frame(pose: &Pose, before: Option<&Frame>) -> Frame {
    let mut turn = quaternion(&pose.rotation);
    if let Some(before) = before
        && turn
            .iter()
            .zip(&before.turn)
            .map(|(a, b)| a * b)
            .sum::<f64>()
            < 0.0
    {
        turn = turn.map(|x| -x);
    }
    Frame {
        position: pose.position.into(),
        turn,
    }
}

/// `w, x, y, z` of a rotation.
fn quaternion(rotation: &Matrix3<f64>) -> [f64; 4] {
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation));
    [q.w, q.i, q.j, q.k]
}

fn solid(shape: &Shape) -> Solid {
    match shape {
        Shape::Sphere { centre, radius } => Solid::Sphere {
            from: (*centre).into(),
            radius: *radius,
        },
        Shape::Capsule { from, to, radius } => Solid::Capsule {
            from: (*from).into(),
            to: (*to).into(),
            radius: *radius,
        },
        Shape::Box { pose, half } => Solid::Box {
            centre: pose.position.into(),
            turn: quaternion(&pose.rotation),
            half: (*half).into(),
        },
        Shape::Hull(h) => {
            let centre = h.centre();
            // the ball that sweeps the core is drawn as a growth of it
            let out = |p: &Vector3<f64>| match (p - centre).try_normalize(0.0) {
                Some(u) => p + u * h.radius,
                None => *p,
            };
            Solid::Hull {
                points: h.points.iter().map(|p| out(p).into()).collect(),
                faces: hull(&h.points).map_or(Vec::new(), |h| h.faces),
            }
        }
    }
}

fn volume(v: &scene::Volume, place: &[i64]) -> Volume {
    Volume {
        link: v.link.clone(),
        body: v.body.map_or(-1, |b| place[b]),
        solid: solid(&v.shape),
    }
}

fn obstacle(o: &scene::Obstacle) -> Obstacle {
    let name = o.name().to_string();
    match o {
        scene::Obstacle::Plane { normal, offset, .. } => Obstacle::Plane {
            name,
            kind: "plane",
            normal: (*normal).into(),
            offset: *offset,
        },
        scene::Obstacle::Solid { shape, .. } => Obstacle::Solid {
            name,
            solid: solid(shape),
        },
    }
}

/// The pair with the least room.
fn nearest(scene: &Scene, poses: &[Pose]) -> Option<Nearest> {
    let all = scene.pairs.iter().enumerate().map(|(pair, p)| {
        let s = scene.separation(p, poses);
        Nearest {
            pair,
            distance: s.distance,
            points: [s.on_first.into(), s.on_second.into()],
        }
    });
    all.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Largest part of a limit that a joint uses at a sample; 0 where it has none. Positions count from the
/// middle of their range.
fn usage(joint: &Joint, motion: &Samples, torque: &[f64], j: usize, s: usize) -> Use {
    let at = |values: &[f64]| values.get(j * motion.count + s).copied().unwrap_or(0.0);
    let l = &joint.limits;
    let [low, high] = l.position;
    let all = [
        ('p', at(&motion.q) - 0.5 * (low + high), 0.5 * (high - low)),
        ('v', at(&motion.qd), l.velocity),
        ('a', at(&motion.qdd), l.acceleration),
        ('t', at(torque), l.effort),
    ];
    let none = Use {
        most: 0.0,
        kind: 'p',
    };
    all.into_iter().fold(none, |best, (kind, value, limit)| {
        let most = value.abs() / limit;
        match limit.is_finite() && most > best.most {
            true => Use { most, kind },
            false => best,
        }
    })
}

/// Lines of a closed chain, the same ones at all samples.
struct Lines {
    names: Vec<String>,
    ends: Vec<Vec<[Point; 2]>>,
}

impl Lines {
    /// `None` where there are none, or not the same ones everywhere.
    fn of(plant: &Plant, motion: &Samples, samples: &[usize]) -> Option<Self> {
        let count = motion.count;
        let mut names: Option<Vec<String>> = None;
        let mut ends = Vec::with_capacity(samples.len());
        for s in samples.iter().map(|s| s % count.max(1)) {
            let x: Vec<f64> = (0..motion.dof).map(|k| motion.q[k * count + s]).collect();
            let segments = with_bars(plant.segments(&x));
            let now = || segments.iter().map(|s| s.name.clone()).collect::<Vec<_>>();
            if segments.is_empty() || *names.get_or_insert_with(now) != now() {
                return None;
            }
            ends.push(segments.iter().map(|s| s.ends.map(Point::from)).collect());
        }
        Some(Lines {
            names: names?,
            ends,
        })
    }
}

/// With the bars that join the two rods of a parallelogram (`rod1a`, `rod1b`) at both ends.
fn with_bars(mut segments: Vec<Segment>) -> Vec<Segment> {
    let stem = |s: &Segment, end: char| s.name.strip_suffix(end).map(String::from);
    let bars = segments.windows(2).flat_map(|pair| {
        let of = stem(&pair[0], 'a').filter(|of| stem(&pair[1], 'b').as_ref() == Some(of));
        let bar = |k: usize| [pair[0].ends[k], pair[1].ends[k]];
        let both = of.map(|name| {
            [0, 1].map(|k| Segment {
                name: name.clone(),
                ends: bar(k),
            })
        });
        both.into_iter().flatten()
    });
    let bars: Vec<Segment> = bars.collect();
    segments.extend(bars);
    segments
}

/// A line by its name: `platform`, that of a body, or one with the number of its actuator (`leg3`, `rod3a`).
fn line(name: &str, plant: &Plant) -> Line {
    let plate = name == "platform";
    let body = plant.robot().bodies.iter().position(|b| b.name == name);
    let mut numbers = name
        .split(|c: char| !c.is_ascii_digit())
        .filter_map(|d| d.parse().ok());
    let joint = match (plate, body, numbers.next()) {
        (true, ..) => -1,
        (_, Some(b), _) => lit(plant, b),
        (_, None, Some(k)) if (1..=plant.actuated().len() as i64).contains(&k) => k - 1,
        _ => -1,
    };
    Line { joint, plate }
}

/// The actuator that lights a body: its own, or the next one towards the base; where there is none, the only
/// one further out.
fn lit(plant: &Plant, body: usize) -> i64 {
    let bodies = &plant.robot().bodies;
    let own = |b: usize| {
        let actuator = |a: &usize| *a == bodies[b].coordinate;
        plant.actuated().iter().position(actuator).map(|j| j as i64)
    };
    let inwards = |b: usize| std::iter::successors(Some(b), |b| bodies[*b].parent);
    if let Some(j) = inwards(body).find_map(own) {
        return j;
    }
    let mut further = (0..bodies.len())
        .filter(|b| inwards(*b).any(|a| a == body))
        .filter_map(own);
    match (further.next(), further.next()) {
        (Some(j), None) => j,
        _ => -1,
    }
}

#[cfg(test)]
mod tests;
