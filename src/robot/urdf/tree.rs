//! Links and joints to a tree of moving bodies.

use super::drive::{Drive, drives};
use super::{Kind, MAX_MOVING_JOINTS, Options, StatedLimits, Urdf, UrdfJoint, limits};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::{Body, Joint, Motion, Prior, Robot};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::collections::HashMap;

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

    // coordinates in document order
    let mut coordinate = vec![usize::MAX; urdf.joints.len()];
    let mut joints = Vec::new();
    let mut moving = 0;
    for i in 0..urdf.joints.len() {
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
        // virtual work of the follower's friction
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

    let bodies = bodies(urdf, &order, &drives, &coordinate, &mut warnings)?;
    Ok(Robot {
        name: urdf.name.clone(),
        bodies,
        joints,
        gravity: Vector3::new(0.0, 0.0, -9.81),
        prior: Prior::default(),
        warnings,
        path: None,
        hash: String::new(),
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
        terms: [0.0, joint.damping, joint.friction, 0.0],
        identify: [false; 4],
    })
}

/// Merges what does not move and collects the rest.
fn bodies(
    urdf: &Urdf,
    order: &[(usize, usize)],
    drives: &[Drive],
    coordinate: &[usize],
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Body>> {
    /// pose of a link in the frame of the body it belongs to (`None`: the base)
    #[derive(Clone)]
    struct Pose {
        body: Option<usize>,
        rotation: Matrix3<f64>,
        position: Vector3<f64>,
    }
    let base = Pose {
        body: None,
        rotation: Matrix3::identity(),
        position: Vector3::zeros(),
    };
    let mut poses: HashMap<&str, Pose> = HashMap::with_capacity(urdf.links.len());
    let mut bodies: Vec<Body> = Vec::new();
    let mut has_inertial = Vec::new();
    for &(j, l) in order {
        let (joint, link) = (&urdf.joints[j], &urdf.links[l]);
        let parent = poses
            .get(joint.parent.as_str())
            .cloned()
            .unwrap_or_else(|| base.clone());
        let mut rotation = parent.rotation * joint.rotation;
        let mut position = parent.position + parent.rotation * joint.position;
        let mut body = parent.body;
        match drives[j] {
            Drive::Held(q) => {
                match motion(joint.kind) {
                    Motion::Revolute if q != 0.0 => {
                        let axis = Unit::new_unchecked(joint.axis);
                        rotation *= Rotation3::from_axis_angle(&axis, q).matrix();
                    }
                    Motion::Revolute => {}
                    Motion::Prismatic => position += rotation * (joint.axis * q),
                }
                if let Some(b) = body {
                    if let Some(inertia) = &link.inertia {
                        bodies[b].inertia =
                            bodies[b].inertia + inertia.in_parent(&rotation, &position);
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
                bodies.push(Body {
                    name: link.name.clone(),
                    joint_name: joint.name.clone(),
                    parent: parent.body,
                    motion: motion(joint.kind),
                    axis: joint.axis,
                    rotation,
                    position,
                    inertia: link.inertia.unwrap_or_default(),
                    merged: Vec::new(),
                    coordinate: coordinate[leader],
                    ratio,
                    offset,
                });
                (rotation, position) = (Matrix3::identity(), Vector3::zeros());
            }
        }
        if body.is_some() {
            warnings.extend_from_slice(&link.warnings);
        }
        poses.insert(
            &link.name,
            Pose {
                body,
                rotation,
                position,
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
    Ok(bodies)
}
