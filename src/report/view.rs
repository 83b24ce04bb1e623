//! A view in space that is turned and played: bodies, the volumes around them, what stands about.
//!
//! The page carries the data as JSON and one script that draws them with WebGL, or on a plain canvas where
//! there is none. Nothing is fetched. Numbers are whole multiples of 10⁻⁵ (m, or parts of a quaternion) and
//! columns hold their differences from sample to sample, which keeps a minute of motion short.
//!
//! The base frame is that of the robot, in m, z up. A pose is the position of a body's origin and the unit
//! quaternion `w, x, y, z` that turns its axes into those of the base.

use maud::{Markup, PreEscaped, html};
use serde::Serialize;
use serde_json::{Value, json};

/// The script of all views: one function, so that it leaves no names behind.
const SCRIPT: &str = concat!(
    "(()=>{'use strict';\n",
    include_str!("view/math.js"),
    include_str!("view/webgl.js"),
    include_str!("view/flat.js"),
    include_str!("view/model.js"),
    include_str!("view/view.js"),
    "})();"
);

/// Steps to one unit.
const STEPS: f64 = 1e5;

/// Largest coordinate that is drawn, m.
const LARGEST: f64 = 1e4;

/// A point or direction.
pub type Point = [f64; 3];

/// A body that moves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Body {
    /// index of the body that carries it; −1: the base
    pub parent: i64,
    /// index of the joint whose use lights it; −1: none
    pub joint: i64,
    /// direction of its joint's axis, in its own frame
    pub axis: Point,
    /// where a link that carries nothing ends, in its own frame
    pub tip: Option<Point>,
}

/// A convex volume.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Solid {
    /// ball
    Sphere {
        /// centre
        from: Point,
        /// radius
        radius: f64,
    },
    /// segment swept by a ball
    Capsule {
        /// one end of the segment
        from: Point,
        /// the other end
        to: Point,
        /// radius
        radius: f64,
    },
    /// box
    Box {
        /// centre
        centre: Point,
        /// unit quaternion that turns its edges into the axes of its frame
        turn: [f64; 4],
        /// half edge lengths
        half: Point,
    },
    /// convex hull
    Hull {
        /// corners
        points: Vec<Point>,
        /// triangles: indices of corners, counter-clockwise seen from outside
        faces: Vec<[usize; 3]>,
    },
}

/// A volume of a link.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Volume {
    /// name of the link
    pub link: String,
    /// index of the body that carries it; −1: the base
    pub body: i64,
    /// in the frame of that body
    #[serde(flatten)]
    pub solid: Solid,
}

/// What stands about, in the base frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Obstacle {
    /// what lies below `normalᵀ x = offset`
    Plane {
        /// name
        name: String,
        /// `plane`
        kind: &'static str,
        /// unit normal, away from the solid
        normal: Point,
        /// m
        offset: f64,
    },
    /// a convex thing
    Solid {
        /// name
        name: String,
        /// where
        #[serde(flatten)]
        solid: Solid,
    },
}

/// A line of a closed chain, drawn as a thin rod.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// index of the joint whose use lights it; −1: none
    pub joint: i64,
    /// whether it belongs to the platform, which is filled
    pub plate: bool,
}

/// Position and orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// origin
    pub position: Point,
    /// unit quaternion `w, x, y, z`
    pub turn: [f64; 4],
}

/// The pair of things with the least room between them at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// index into [`View::pairs`]
    pub pair: usize,
    /// distance of their surfaces, m; negative where they overlap
    pub distance: f64,
    /// the points that are nearest
    pub points: [Point; 2],
}

/// How much of its limits a joint uses at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Use {
    /// largest part of a limit; 1: all of it
    pub most: f64,
    /// of which: `p`osition, `v`elocity, `a`cceleration, `t`orque
    pub kind: char,
}

/// Everything that a view shows. Lists of lists are samples first: `frames[s][b]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct View {
    /// what is seen, for those who cannot see it
    pub label: String,
    /// what the path is that of
    pub path_of: String,
    /// times of the samples, s, increasing
    pub times: Vec<f64>,
    /// names of the joints whose limits are looked at
    pub joints: Vec<String>,
    /// bodies
    pub bodies: Vec<Body>,
    /// their poses
    pub frames: Vec<Vec<Frame>>,
    /// volumes of links
    pub volumes: Vec<Volume>,
    /// what stands about
    pub obstacles: Vec<Obstacle>,
    /// lines of a closed chain
    pub lines: Vec<Line>,
    /// their ends
    pub ends: Vec<Vec<[Point; 2]>>,
    /// path of the tool
    pub path: Vec<Point>,
    /// use of limits by joint
    pub used: Vec<Vec<Use>>,
    /// names of pairs that come near
    pub pairs: Vec<[String; 2]>,
    /// the nearest of them; empty where nothing was looked at
    pub nearest: Vec<Nearest>,
}

impl View {
    /// As a part of a page; `None` where a number cannot be drawn.
    pub fn markup(&self) -> Option<Markup> {
        let data = self.data()?.to_string().replace('<', "\\u003c");
        Some(html! {
            div class="view" role="group" aria-label=(self.label) {
                script type="application/json" { (PreEscaped(data)) }
                noscript { p { "The view needs a browser that runs scripts." } }
            }
            script { (PreEscaped(SCRIPT)) }
        })
    }

    /// The data of the script.
    fn data(&self) -> Option<Value> {
        let pose = |f: &Frame| {
            let ([x, y, z], [w, i, j, k]) = (f.position, f.turn);
            [x, y, z, w, i, j, k]
        };
        let frames: Option<Vec<Vec<Vec<i64>>>> = (0..self.bodies.len())
            .map(|b| columns(self.frames.iter().map(|f| Some(pose(f.get(b)?)))))
            .collect();
        let ends: Option<Vec<Vec<Vec<i64>>>> = (0..self.lines.len())
            .map(|l| columns(self.ends.iter().map(|e| Some(both(e.get(l)?)))))
            .collect();
        let joint = |j: usize| self.used.iter().map(move |u| u.get(j));
        let uses: Vec<Vec<i64>> = (0..self.joints.len())
            .map(|j| joint(j).map(|u| u.map_or(0, |u| part(u.most))).collect())
            .collect();
        let which: Vec<String> = (0..self.joints.len())
            .map(|j| joint(j).map(|u| u.map_or(' ', |u| u.kind)).collect())
            .collect();
        let closest = match self.nearest.is_empty() {
            true => Value::Null,
            false => json!({
                "pairs": self.pairs,
                "pair": self.nearest.iter().map(|n| n.pair).collect::<Vec<_>>(),
                "distance": columns(self.nearest.iter().map(|n| Some([n.distance])))?.pop()?,
                "points": columns(self.nearest.iter().map(|n| Some(both(&n.points))))?,
            }),
        };
        let mut fixed = json!({
            "bodies": self.bodies,
            "volumes": self.volumes,
            "obstacles": self.obstacles,
        });
        round(&mut fixed);
        let mut data = json!({
            "times": columns(self.times.iter().map(|t| Some([*t])))?.pop()?,
            "joints": self.joints,
            "frames": frames?,
            "lines": self.lines,
            "ends": ends?,
            "path": columns(self.path.iter().map(|p| Some(*p)))?,
            "pathOf": self.path_of,
            "uses": uses,
            "which": which,
            "closest": closest,
        });
        if let (Value::Object(all), Value::Object(more)) = (&mut data, fixed) {
            all.extend(more);
        }
        Some(data)
    }
}

fn both([a, b]: &[Point; 2]) -> [f64; 6] {
    [a[0], a[1], a[2], b[0], b[1], b[2]]
}

/// Thousandths of a limit; 0 of what is not a number.
fn part(used: f64) -> i64 {
    (1000.0 * used.clamp(0.0, 99.0)).round() as i64
}

/// Columns of rows, each as differences of whole numbers; `None` where one is not finite or too large.
fn columns<const N: usize>(rows: impl Iterator<Item = Option<[f64; N]>>) -> Option<Vec<Vec<i64>>> {
    let mut out = vec![Vec::new(); N];
    let mut last = [0; N];
    for row in rows {
        for ((x, column), last) in row?.into_iter().zip(&mut out).zip(&mut last) {
            // not a number fails, too
            if !(x.abs() < LARGEST) {
                return None;
            }
            let now = (STEPS * x).round() as i64;
            column.push(now - *last);
            *last = now;
        }
    }
    Some(out)
}

/// All fractions in a document to the nearest step.
fn round(value: &mut Value) {
    match value {
        Value::Number(n) if n.is_f64() => {
            let x = n.as_f64().unwrap_or(0.0).clamp(-LARGEST, LARGEST);
            // adding 0 turns −0 into 0
            *value = json!((STEPS * x).round() / STEPS + 0.0);
        }
        Value::Array(all) => all.iter_mut().for_each(round),
        Value::Object(all) => all.values_mut().for_each(round),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_samples() -> View {
        let frame = |x: f64| Frame {
            position: [x, 0.0, 0.5],
            turn: [1.0, 0.0, 0.0, 0.0],
        };
        View {
            label: "a \"robot\"".into(),
            times: vec![0.0, 0.05],
            joints: vec!["</script><b>".into()],
            bodies: vec![Body {
                parent: -1,
                joint: 0,
                axis: [0.0, 0.0, 1.0],
                tip: None,
            }],
            frames: vec![vec![frame(0.1)], vec![frame(0.123456)]],
            volumes: vec![Volume {
                link: "a".into(),
                body: 0,
                solid: Solid::Sphere {
                    from: [-1e-9, 0.0, 1.0 / 3.0],
                    radius: 0.1,
                },
            }],
            used: vec![vec![Use {
                most: f64::NAN,
                kind: 'v',
            }]],
            ..View::default()
        }
    }

    #[test]
    fn data_are_differences_of_whole_numbers() {
        let data = two_samples().data().expect("finite");
        assert_eq!(data["times"], json!([0, 5000]));
        assert_eq!(data["frames"][0][0], json!([10000, 2346]));
        assert_eq!(data["frames"][0][3], json!([100_000, 0]));
        assert_eq!(data["volumes"][0]["from"], json!([0.0, 0.0, 0.33333]));
        assert_eq!(data["volumes"][0]["kind"], "sphere");
        assert_eq!(data["uses"], json!([[0]]));
        assert_eq!(data["closest"], Value::Null);
    }

    #[test]
    fn names_end_no_script_and_odd_numbers_draw_nothing() {
        let text = two_samples().markup().expect("finite").into_string();
        assert_eq!(text.matches("</script>").count(), 2);
        assert!(text.contains("\\u003c/script>\\u003cb>") && text.contains("a &quot;robot&quot;"));
        for odd in [f64::NAN, f64::INFINITY, 1e300] {
            let mut view = two_samples();
            view.frames[1][0].position[2] = odd;
            assert!(view.markup().is_none());
        }
        let mut view = two_samples();
        view.frames[1].clear();
        assert!(view.markup().is_none());
    }

    #[test]
    fn the_script_is_small_and_fetches_nothing() {
        let css = include_str!("view/view.css");
        assert!(SCRIPT.len() + css.len() < 150_000);
        for forbidden in [
            "http",
            "fetch(",
            "import(",
            "XMLHttp",
            "eval(",
            "url(",
            "src=",
            "</",
            "innerHTML",
            "<b ",
            "<u>",
        ] {
            let closes = forbidden == "</";
            assert!(closes || !SCRIPT.contains(forbidden), "{forbidden}");
            assert!(!css.contains(forbidden), "{forbidden}");
        }
        assert!(!SCRIPT.contains("</script") && SCRIPT.is_ascii() && css.is_ascii());
    }
}
