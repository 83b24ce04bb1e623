//! Links and joints to a tree of moving bodies.

use super::drive::{Drive, drives};
use super::{Kind, MAX_MOVING_JOINTS, Options, StatedLimits, Urdf, UrdfJoint, limits};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::geometry::{Geometry, Link, Part, folders};
use crate::robot::meant::angle;
use crate::robot::{Body, Joint, Motion, Placement, Prior, Robot};
use crate::solid;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::collections::HashMap;

impl UrdfJoint {
    /// Axis, rotation and position as written.
    fn written(&self) -> Placement {
        Placement {
            axis: self.axis,
            rotation: self.rotation,
            position: self.position,
        }
    }
}

impl Urdf {
    /// An error at a joint.
    pub(super) fn joint_error(&self, joint: &UrdfJoint, message: impl Into<String>) -> Error {
        let place = format!("line {}: joint `{}`", joint.line, joint.name);
        Error::file(&self.file, place, message)
    }
}

pub(super) fn build(urdf: &Urdf, options: &Options) -> Result<Robot> {
    let mut warnings = urdf.warnings.clone();
    let children = children(urdf)?;
    let order = order(urdf, &children)?;
    let drives = drives(urdf, options, &mut warnings)?;

    // coordinates from the base to the tips, as the bodies
    let mut coordinate = vec![usize::MAX; urdf.joints.len()];
    let mut joints = Vec::new();
    let mut moving = 0;
    for &(i, _) in &order {
        let Drive::Follows { leader, .. } = drives[i] else {
            continue;
        };
        moving += 1;
        if leader == i {
            coordinate[i] = joints.len();
            joints.push(i);
        }
    }
    if joints.is_empty() {
        return Err(Error::file(
            &urdf.file,
            "",
            "no joint moves; a robot needs at least one revolute, continuous or prismatic joint \
             that is not locked",
        ));
    }
    if moving > MAX_MOVING_JOINTS {
        return Err(Error::file(
            &urdf.file,
            "",
            format!(
                "{moving} joints move, at most {MAX_MOVING_JOINTS} can; \
                 hold those that are not used by `lock` in robot.toml"
            ),
        ));
    }
    let mut joints = joints
        .into_iter()
        .map(|i| coordinate_of(urdf, &urdf.joints[i], options, &mut warnings))
        .collect::<Result<Vec<_>>>()?;
    for (joint, drive) in urdf.joints.iter().zip(&drives) {
        let Drive::Follows {
            leader,
            ratio,
            offset,
        } = *drive
        else {
            continue;
        };
        let leader_name = urdf.joints[leader].name.as_str();
        if leader_name == joint.name {
            continue;
        }
        let followed = &mut joints[coordinate[leader]];
        // virtual work of the follower's inertia and friction
        followed.terms[0] += ratio * ratio * joint.armature;
        followed.terms[1] += ratio * ratio * joint.damping;
        followed.terms[2] += ratio.abs() * joint.friction;
        let stated = options.limits.get(leader_name).copied().unwrap_or_default();
        let map = (ratio, offset);
        limits::narrow(
            &mut followed.limits,
            leader_name,
            &stated,
            joint,
            map,
            &mut warnings,
        );
    }

    let (bodies, geometry) = bodies(urdf, &order, &drives, &coordinate, &mut warnings)?;
    Ok(Robot {
        name: urdf.name.clone(),
        bodies,
        joints,
        gravity: urdf.gravity,
        prior: Prior::default(),
        warnings,
        path: None,
        hash: String::new(),
        geometry,
        tool: None,
    })
}

/// For every link, by index, the joints that leave it in document order, and the joint that
/// carries it.
struct Children {
    /// joints below each link
    below: Vec<Vec<usize>>,
    /// child link of each joint
    child: Vec<usize>,
    /// the link without a parent
    root: usize,
}

/// Checks that every link has at most one parent and exactly one has none.
fn children(urdf: &Urdf) -> Result<Children> {
    let index: HashMap<&str, usize> = urdf
        .links
        .iter()
        .enumerate()
        .map(|(i, l)| (l.name.as_str(), i))
        .collect();
    let mut below = vec![Vec::new(); urdf.links.len()];
    let mut carrier: Vec<Option<usize>> = vec![None; urdf.links.len()];
    let mut child = Vec::with_capacity(urdf.joints.len());
    for (j, joint) in urdf.joints.iter().enumerate() {
        let find = |end: &str, name: &str| {
            index.get(name).copied().ok_or_else(|| {
                urdf.joint_error(
                    joint,
                    format!("its {end} link `{name}` does not exist; add the link or correct it"),
                )
            })
        };
        let (p, c) = (find("parent", &joint.parent)?, find("child", &joint.child)?);
        if p == c {
            return Err(urdf.joint_error(joint, "its parent and child are the same link"));
        }
        if let Some(other) = carrier[c].replace(j) {
            return Err(urdf.joint_error(
                joint,
                format!(
                    "link `{}` is already the child of joint `{}`; a URDF is a tree, \
                     so remove one of the two",
                    joint.child, urdf.joints[other].name
                ),
            ));
        }
        below[p].push(j);
        child.push(c);
    }
    let roots: Vec<usize> = (0..urdf.links.len())
        .filter(|&l| carrier[l].is_none())
        .collect();
    match roots[..] {
        [root] => Ok(Children { below, child, root }),
        [] => Err(Error::file(
            &urdf.file,
            "",
            "every link is the child of a joint: they form a cycle; one link must be the base",
        )),
        _ => {
            let names: Vec<String> = roots
                .iter()
                .take(5)
                .map(|&l| format!("`{}` (line {})", urdf.links[l].name, urdf.links[l].line))
                .collect();
            let more = if roots.len() > 5 { ", …" } else { "" };
            Err(Error::file(
                &urdf.file,
                "",
                format!(
                    "{} links have no parent: {}{more}; one must be the base, \
                     attach the others with a joint (type fixed if they do not move)",
                    roots.len(),
                    names.join(", ")
                ),
            ))
        }
    }
}

/// Joints from the root outwards, depth first in document order, each with its child link.
fn order(urdf: &Urdf, tree: &Children) -> Result<Vec<(usize, usize)>> {
    let mut order = Vec::with_capacity(urdf.joints.len());
    let mut stack: Vec<usize> = tree.below[tree.root].iter().rev().copied().collect();
    let mut reached = vec![false; urdf.links.len()];
    reached[tree.root] = true;
    while let Some(joint) = stack.pop() {
        let link = tree.child[joint];
        reached[link] = true;
        order.push((joint, link));
        stack.extend(tree.below[link].iter().rev());
    }
    // one root and one parent each: what is not reached hangs on a cycle
    match urdf
        .links
        .iter()
        .zip(&reached)
        .find(|(_, reached)| !**reached)
    {
        Some((link, _)) => Err(Error::file(
            &urdf.file,
            format!("line {}: link `{}`", link.line, link.name),
            format!(
                "it is not connected with the base `{}`: its joints form a cycle; \
                 a URDF is a tree, so remove one of them",
                urdf.links[tree.root].name
            ),
        )),
        None => Ok(order),
    }
}

fn motion(kind: Kind) -> Motion {
    match kind {
        Kind::Prismatic => Motion::Prismatic,
        _ => Motion::Revolute,
    }
}

fn coordinate_of(
    urdf: &Urdf,
    joint: &UrdfJoint,
    options: &Options,
    warnings: &mut Vec<Warning>,
) -> Result<Joint> {
    let none = StatedLimits::default();
    let stated = options.limits.get(&joint.name).unwrap_or(&none);
    Ok(Joint {
        name: joint.name.clone(),
        motion: motion(joint.kind),
        continuous: joint.kind == Kind::Continuous,
        limits: limits::of_joint(&urdf.file, joint, stated, warnings)?,
        torque_noise: None,
        position_resolution: None,
        gear_ratio: None,
        piston: None,
        stribeck: Default::default(),
        continuous_torque: None,
        continuous_power: None,
        terms: [joint.armature, joint.damping, joint.friction, 0.0],
        identify: [false; 4],
    })
}

/// Axes and origin of a link in the frame of the body it belongs to.
#[derive(Clone, Copy)]
struct Frame {
    rotation: Matrix3<f64>,
    position: Vector3<f64>,
}

impl Default for Frame {
    fn default() -> Self {
        Frame {
            rotation: Matrix3::identity(),
            position: Vector3::zeros(),
        }
    }
}

impl Frame {
    /// The frame of the link that hangs here on a joint, at zero joint position.
    fn then(&self, place: &Placement) -> Frame {
        Frame {
            rotation: self.rotation * place.rotation,
            position: self.position + self.rotation * place.position,
        }
    }

    /// Moves it along its joint to a position (rad or m) where that is held.
    fn hold(&mut self, joint: &UrdfJoint, axis: &Vector3<f64>, q: f64) {
        match motion(joint.kind) {
            Motion::Revolute if q != 0.0 => {
                let axis = Unit::new_unchecked(*axis);
                self.rotation *= Rotation3::from_axis_angle(&axis, q).matrix();
            }
            Motion::Revolute => {}
            Motion::Prismatic => self.position += self.rotation * (axis * q),
        }
    }
}

/// The position that is meant where a joint is held.
fn held(kind: Kind, q: f64) -> f64 {
    match motion(kind) {
        Motion::Revolute => angle("", q).value,
        Motion::Prismatic => q,
    }
}

/// Where a link is.
#[derive(Clone, Copy, Default)]
struct Pose {
    /// the body it belongs to; `None`: the base
    body: Option<usize>,
    /// in the frame of that body
    written: Frame,
    /// the same with what the file means
    meant: Frame,
}

/// Merges what does not move and collects the rest.
fn bodies(
    urdf: &Urdf,
    order: &[(usize, usize)],
    drives: &[Drive],
    coordinate: &[usize],
    warnings: &mut Vec<Warning>,
) -> Result<(Vec<Body>, Geometry)> {
    let mut poses: HashMap<&str, Pose> = HashMap::with_capacity(urdf.links.len());
    let mut bodies: Vec<Body> = Vec::new();
    let mut has_inertial = Vec::new();
    for &(j, l) in order {
        let (joint, link) = (&urdf.joints[j], &urdf.links[l]);
        let parent = poses.get(joint.parent.as_str()).copied();
        let parent = parent.unwrap_or_default();
        let mut written = parent.written.then(&joint.written());
        let mut meant = parent.meant.then(&joint.meant);
        let mut body = parent.body;
        match drives[j] {
            Drive::Held(q) => {
                written.hold(joint, &joint.axis, q);
                meant.hold(joint, &joint.meant.axis, held(joint.kind, q));
                if let Some(b) = body {
                    if let Some(inertia) = &link.inertia {
                        bodies[b].inertia = bodies[b].inertia
                            + inertia.in_parent(&written.rotation, &written.position);
                        has_inertial[b] = true;
                    }
                    bodies[b].merged.push(link.name.clone());
                }
            }
            Drive::Follows {
                leader,
                ratio,
                offset,
            } => {
                body = Some(bodies.len());
                has_inertial.push(link.inertia.is_some());
                let place = |frame: &Frame, axis: Vector3<f64>| Placement {
                    axis,
                    rotation: frame.rotation,
                    position: frame.position,
                };
                let as_meant = place(&meant, joint.meant.axis);
                bodies.push(Body {
                    name: link.name.clone(),
                    joint_name: joint.name.clone(),
                    parent: parent.body,
                    motion: motion(joint.kind),
                    axis: joint.axis,
                    rotation: written.rotation,
                    position: written.position,
                    inertia: link.inertia.unwrap_or_default(),
                    merged: Vec::new(),
                    coordinate: coordinate[leader],
                    ratio,
                    offset,
                    meant: as_meant
                        .differs(&place(&written, joint.axis))
                        .then_some(as_meant),
                });
                (written, meant) = Default::default();
            }
        }
        if body.is_some() {
            warnings.extend_from_slice(&link.warnings);
        }
        poses.insert(
            &link.name,
            Pose {
                body,
                written,
                meant,
            },
        );
    }
    for (body, has_inertial) in bodies.iter().zip(has_inertial) {
        let finite = body
            .position
            .iter()
            .chain(&body.inertia.0)
            .all(|x| x.is_finite());
        if !finite {
            return Err(Error::file(
                &urdf.file,
                format!("link `{}`", body.name),
                "its position or inertia overflows; use m and kg of a real robot",
            ));
        }
        if body.inertia.0 == [0.0; 10] {
            let found = if has_inertial {
                "its <inertial> is zero"
            } else {
                "no <inertial>"
            };
            warnings.push(Warning::new(
                WarningKind::InertiaMissing,
                format!("link `{}`", body.name),
                format!("{found}; the nominal model takes it as massless"),
            ));
        }
    }
    Ok((bodies, geometry(urdf, &poses)))
}

/// Where every link sits, and its geometry.
fn geometry(urdf: &Urdf, poses: &HashMap<&str, Pose>) -> Geometry {
    let parents: HashMap<&str, &str> = (urdf.joints.iter())
        .map(|j| (j.child.as_str(), j.parent.as_str()))
        .collect();
    let links = urdf.links.iter().map(|link| {
        let at = poses.get(link.name.as_str()).copied().unwrap_or_default();
        Link {
            name: link.name.clone(),
            body: at.body,
            pose: solid::Pose {
                rotation: at.written.rotation,
                position: at.written.position,
            },
            parent: parents.get(link.name.as_str()).map(|p| p.to_string()),
        }
    });
    let parts = urdf.links.iter().enumerate().flat_map(|(link, l)| {
        let forms = l.forms.iter().cloned();
        forms.map(move |form| Part { link, form })
    });
    Geometry {
        links: links.collect(),
        parts: parts.collect(),
        folders: folders(&urdf.file),
        ..Geometry::default()
    }
}
