//! Distances, gradients, fits and clearances against brute force.

mod fitted;

use excite::collision::clearance::{Fineness, Path, clearances};
use excite::collision::scene::{Balls, Obstacle, Pair, Partner, Scene, Volume, poses};
use excite::robot::parts::Motion;
use excite::robot::{Body, Inertia, Joint, Robot};
use excite::solid::{Pose, Shape, fit, formats, hull, hulls, mesh, separation};
use nalgebra::{Rotation3, Vector3};

type V = Vector3<f64>;

struct Random(u64);
impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    }
    fn vector(&mut self, size: f64) -> V {
        V::new(self.next(), self.next(), self.next()) * size
    }
    fn pose(&mut self, size: f64) -> Pose {
        let axis = self.vector(3.0);
        Pose {
            rotation: Rotation3::new(axis).into_inner(),
            position: self.vector(size),
        }
    }
    fn shape(&mut self, kind: usize) -> Shape {
        match kind {
            0 => Shape::Sphere {
                centre: self.vector(0.1),
                radius: 0.05 + 0.04 * self.next(),
            },
            1 => Shape::Capsule {
                from: self.vector(0.3),
                to: self.vector(0.3),
                radius: 0.05 + 0.04 * self.next(),
            },
            2 => Shape::Box {
                pose: self.pose(0.2),
                half: self.vector(0.1).abs() + V::repeat(0.05),
            },
            _ => {
                let centre = self.vector(0.2);
                let count = 4 + (self.next().abs() * 28.0) as usize;
                let points: Vec<V> = (0..count)
                    .map(|_| centre + self.vector(1.0).normalize() * 0.15)
                    .collect();
                let radius = 0.01 * self.next().max(0.0);
                Shape::hull(&points, radius).unwrap_or_else(|| self.shape(3))
            }
        }
    }
}

/// Distance of two cores by projected gradient over the cores' own coordinates.
fn brute(a: &Shape, at_a: &Pose, b: &Shape, at_b: &Pose) -> f64 {
    let point = |s: &Shape, at: &Pose, x: &[f64; 3]| match s {
        Shape::Sphere { centre, .. } => at.apply(centre),
        Shape::Capsule { from, to, .. } => at.apply(&(from + (to - from) * x[0])),
        Shape::Box { pose, half } => {
            let local = V::new(
                (2.0 * x[0] - 1.0) * half.x,
                (2.0 * x[1] - 1.0) * half.y,
                (2.0 * x[2] - 1.0) * half.z,
            );
            at.apply(&pose.apply(&local))
        }
        Shape::Hull(_) => unreachable!("hulls have a test of their own"),
    };
    let mut x = [0.5; 6];
    let value = |x: &[f64; 6]| {
        let p = point(a, at_a, &[x[0], x[1], x[2]]);
        let q = point(b, at_b, &[x[3], x[4], x[5]]);
        (p - q).norm()
    };
    // the problem is convex: cyclic golden steps along coordinates and pairs of them
    let mut step = 0.5;
    let mut best = value(&x);
    while step > 1e-8 {
        let mut better = false;
        for i in 0..6 {
            for k in 0..6 {
                for (s, t) in [
                    (1.0, 0.0),
                    (-1.0, 0.0),
                    (1.0, 1.0),
                    (1.0, -1.0),
                    (-1.0, 1.0),
                    (-1.0, -1.0),
                    (1.0, 0.5),
                    (-1.0, 0.5),
                    (1.0, -0.5),
                    (-1.0, -0.5),
                ] {
                    let mut y = x;
                    y[i] = (y[i] + s * step).clamp(0.0, 1.0);
                    if i != k {
                        y[k] = (y[k] + t * step).clamp(0.0, 1.0);
                    }
                    let v = value(&y);
                    if v < best - 1e-15 {
                        best = v;
                        x = y;
                        better = true;
                    }
                }
            }
        }
        if !better {
            step *= 0.5;
        }
    }
    best - a.radius() - b.radius()
}

#[test]
fn distances_agree_with_a_search_over_both_cores() {
    let mut r = Random(7);
    let mut apart = 0;
    for k in 0..600 {
        let (a, b) = (r.shape(k % 3), r.shape(k / 3 % 3));
        let (pa, pb) = (r.pose(0.5), r.pose(0.5));
        let s = separation(&a, &pa, &b, &pb);
        let found = brute(&a, &pa, &b, &pb);
        if found + a.radius() + b.radius() > 1e-4 {
            apart += 1;
            // the search is not exact where the valley is narrow: it can only be too far
            assert!(
                s.distance <= found + 1e-9 && s.distance > found - 2e-3,
                "{k}: {} against {found}: {a:?} {b:?}",
                s.distance
            );
            assert!((s.on_second - s.on_first - s.normal * s.distance).norm() < 1e-9);
            let inside = |shape: &Shape, at: &Pose, p: &V| {
                shape.signed_distance(&(at.rotation.transpose() * (p - at.position)))
            };
            assert!(
                inside(&a, &pa, &s.on_first).abs() < 1e-8
                    && inside(&b, &pb, &s.on_second).abs() < 1e-8,
                "{k}"
            );
        }
        let back = separation(&b, &pb, &a, &pa);
        assert!(
            (back.distance - s.distance).abs() < 1e-8,
            "{k}: {} {}",
            back.distance,
            s.distance
        );
    }
    assert!(apart > 300);
}

#[test]
fn moving_along_the_normal_by_the_depth_parts_two_boxes() {
    let mut r = Random(3);
    let mut overlapping = 0;
    for k in 0..1000 {
        let (a, b) = (r.shape(2), r.shape(1 + k % 2));
        let (pa, pb) = (r.pose(0.15), r.pose(0.15));
        let s = separation(&a, &pa, &b, &pb);
        if s.distance >= -b.radius() {
            continue;
        }
        overlapping += 1;
        let mut moved = pb;
        moved.position += s.normal * (-s.distance + 1e-6);
        let t = separation(&a, &pa, &b, &moved);
        assert!(
            t.distance > -1e-6 && t.distance < 1e-5,
            "{k}: {} then {}",
            s.distance,
            t.distance
        );
    }
    assert!(overlapping > 100, "{overlapping}");
}

fn arm(r: &mut Random, n: usize) -> Robot {
    let mut robot = Robot::load("planar2").expect("bundled");
    robot.bodies = (0..n)
        .map(|k| {
            let pose = r.pose(0.25);
            Body {
                name: format!("link{k}"),
                joint_name: format!("joint{k}"),
                parent: k.checked_sub(1),
                motion: if k == 3 {
                    Motion::Prismatic
                } else {
                    Motion::Revolute
                },
                axis: r.vector(1.0).normalize(),
                rotation: pose.rotation,
                position: pose.position,
                inertia: Inertia([0.0; 10]),
                merged: vec![],
                coordinate: k,
                ratio: 1.0,
                offset: 0.0,
                meant: None,
            }
        })
        .collect();
    robot.joints = (0..n)
        .map(|k| {
            let mut joint = Joint::new(&format!("joint{k}"), robot.bodies[k].motion);
            joint.limits.position = [-0.5, 0.5];
            joint
        })
        .collect();
    robot
}

fn scene(r: &mut Random, robot: &Robot) -> Scene {
    let mut s = Scene {
        margin: 0.0,
        ..Scene::default()
    };
    for b in 0..robot.bodies.len() {
        s.volumes.push(Volume {
            link: format!("link{b}"),
            body: Some(b),
            shape: r.shape(1),
        });
    }
    s.volumes.push(Volume {
        link: "base".into(),
        body: None,
        shape: r.shape(2),
    });
    s.obstacles.push(Obstacle::Plane {
        name: "floor".into(),
        normal: V::z(),
        offset: -0.3,
    });
    s.obstacles.push(Obstacle::Solid {
        name: "ball".into(),
        shape: Shape::Sphere {
            centre: V::new(0.5, 0.2, 0.1),
            radius: 0.1,
        },
    });
    let parent = |v: usize| s.volumes[v].body.map(|b| robot.bodies[b].parent);
    let joined = |a: usize, b: usize| {
        let (x, y) = (s.volumes[a].body, s.volumes[b].body);
        parent(a) == Some(y) || parent(b) == Some(x)
    };
    let moving = robot.bodies.len();
    for volume in 0..moving {
        let others = (volume + 1..s.volumes.len()).filter(|v| !joined(volume, *v));
        let others = others.map(Partner::Volume).collect::<Vec<_>>();
        let around = (0..s.obstacles.len()).map(Partner::Obstacle);
        s.pairs
            .extend(others.into_iter().chain(around).map(|partner| Pair {
                volume,
                partner,
                margin: 0.0,
            }));
    }
    s
}

#[test]
fn gradients_agree_with_differences() {
    let mut r = Random(11);
    let mut checked = 0;
    for _ in 0..20 {
        let robot = arm(&mut r, 6);
        let scene = scene(&mut r, &robot);
        let q: Vec<f64> = (0..6).map(|_| r.next()).collect();
        let mut at = Vec::new();
        poses(&robot, &q, &mut at);
        for pair in &scene.pairs {
            let s = scene.separation(pair, &at);
            if s.distance.abs() < 1e-3 {
                continue;
            }
            let mut g = vec![0.0; 6];
            scene.gradient(&robot, pair, &s, &at, &mut g);
            for j in 0..6 {
                let value = |h: f64| {
                    let mut x = q.clone();
                    x[j] += h;
                    let mut at = Vec::new();
                    poses(&robot, &x, &mut at);
                    scene.separation(pair, &at).distance
                };
                let h = 1e-5;
                let (plus, minus) = (value(h), value(-h));
                // where the nearest point jumps there is no derivative
                if (plus + minus - 2.0 * s.distance).abs() > 1e-7 {
                    continue;
                }
                let d = (plus - minus) / (2.0 * h);
                assert!(
                    (d - g[j]).abs() < 2e-5,
                    "{:?} joint {j}: {d} against {}",
                    scene.names(pair),
                    g[j]
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 1500, "{checked}");
}

struct Waves {
    a: Vec<[f64; 3]>,
}
impl Path for Waves {
    fn position(&self, t: f64, q: &mut [f64]) {
        for (q, a) in q.iter_mut().zip(&self.a) {
            *q = a[0] * (a[1] * t + a[2]).sin() * 0.5;
        }
    }
    fn speed(&self, _: f64, _: f64, v: &mut [f64]) {
        for (v, a) in v.iter_mut().zip(&self.a) {
            *v = (0.5 * a[0] * a[1]).abs();
        }
    }
    fn largest(&self, joint: usize) -> f64 {
        0.5 * self.a[joint][0].abs()
    }
    fn duration(&self) -> f64 {
        4.0
    }
}

#[test]
fn no_instant_is_nearer_than_the_bound() {
    let mut r = Random(5);
    for _ in 0..5 {
        let robot = arm(&mut r, 6);
        let scene = scene(&mut r, &robot);
        let path = Waves {
            a: (0..6)
                .map(|_| [1.0, 2.0 + r.next(), 3.0 * r.next()])
                .collect(),
        };
        let fine = Fineness {
            stretches: 200,
            tolerance: 0.002,
            shortest: 1e-4,
        };
        let found = clearances(&robot, &scene, &path, fine);
        let mut q = vec![0.0; 6];
        let mut at = Vec::new();
        let mut least = vec![f64::INFINITY; scene.pairs.len()];
        for k in 0..20_000 {
            path.position(4.0 * f64::from(k) / 20_000.0, &mut q);
            poses(&robot, &q, &mut at);
            for (l, p) in least.iter_mut().zip(&scene.pairs) {
                *l = l.min(scene.separation(p, &at).distance);
            }
        }
        assert_eq!(found.len(), least.len());
        let balls = Balls::new(&scene);
        for c in &found {
            let l = least[c.pair];
            assert!(c.bound <= l + 1e-12, "{c:?} {l}");
            assert!(c.met >= l - 1e-3);
            // a quick bound is one
            let pair = &scene.pairs[c.pair];
            let exact = scene.separation(pair, &at);
            assert!(balls.lower_bound(pair, &at) <= exact.distance + 1e-12);
            assert!(scene.gap_along(pair, &at, &exact.normal) <= exact.distance + 1e-9);
        }
        // the nearest pair is known closely
        assert!(
            found[0].bound >= least[found[0].pair] - 0.004,
            "{:?}",
            found[0]
        );
    }
}
