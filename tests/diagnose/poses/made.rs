//! Robots with effects that are withheld from the diagnosis, and what a tracker or a camera sees of them. They are put
//! together here from a table of Denavit and Hartenberg and from plain vectors.

use excite::calibrate::gap::{Ask, PoseDiagnosis, diagnose};
use excite::calibrate::read;
use nalgebra::{Matrix3, Matrix4, Matrix6, Rotation3, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;

/// What is done to a robot that its file does not say.
#[derive(Debug, Clone, Copy)]
pub enum Withheld {
    Clean,
    /// zero of a joint or leg, rad or m
    Offset(usize, f64),
    /// column of the table of a joint: `a`, `α`, `d`
    Table(usize, usize, f64),
    Eccentricity(usize, f64),
    /// rad/(N m), m/N
    Compliance(usize, f64),
    /// flexibility `1/(E I)` of the link behind a joint, 1/(N m²)
    Bend(usize, f64),
    /// by the side that the joint comes from
    Play(usize, f64),
    /// by the side to which gravity pulls
    Sag(usize, f64),
    /// by gravity where it pulls harder than this friction, N m, and else by the side that the joint comes from
    Held(usize, f64, f64),
    /// the base in the last group, m
    Base(f64),
    /// base joint of a leg, m
    Leg(usize, f64),
    /// a square wave of the reading: in no catalogue
    Square(usize, f64),
}

use Withheld::*;

/// `a`, `α`, `d` of each joint: no bundled robot.
const TABLE: [[f64; 3]; 6] = [
    [0.06, -FRAC_PI_2, 0.42],
    [0.48, 0.0, 0.0],
    [0.05, -FRAC_PI_2, 0.03],
    [0.0, FRAC_PI_2, 0.46],
    [0.0, -FRAC_PI_2, 0.0],
    [0.0, 0.0, 0.10],
];
/// kg
const MASS: [f64; 6] = [12.0, 10.0, 6.0, 4.0, 2.0, 1.0];

fn turn(axis: usize, angle: f64) -> Matrix4<f64> {
    let (s, c) = angle.sin_cos();
    let (i, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut m = Matrix4::<f64>::identity();
    (m[(i, i)], m[(k, k)], m[(i, k)], m[(k, i)]) = (c, c, -s, s);
    m
}

fn shift(x: f64, y: f64, z: f64) -> Matrix4<f64> {
    Matrix4::new_translation(&Vector3::new(x, y, z))
}

/// Tool, and centres of mass half way along each link.
fn forward(q: &[f64; 6], table: &[[f64; 3]; 6]) -> (Matrix4<f64>, Vec<Vector3<f64>>) {
    let mut at = Matrix4::<f64>::identity();
    let mut centres = Vec::new();
    for (q, [a, alpha, d]) in q.iter().zip(table) {
        at *= turn(2, *q);
        let half: Matrix4<f64> = at * shift(0.5 * a, 0.0, 0.5 * d);
        centres.push(half.fixed_view::<3, 1>(0, 3).into());
        at *= shift(*a, 0.0, *d) * turn(0, *alpha);
    }
    (at, centres)
}

/// Tool of an arm one of whose links is a beam that bends under gravity: curvature summed up along it.
fn bent(q: &[f64; 6], link: usize, flexible: f64) -> Matrix4<f64> {
    const PIECES: usize = 400;
    let (_, centres) = forward(q, &TABLE);
    let point = |m: &Matrix4<f64>| -> Vector3<f64> { m.fixed_view::<3, 1>(0, 3).into() };
    let mut at = Matrix4::<f64>::identity();
    for (k, (q, [a, alpha, d])) in q.iter().zip(TABLE).enumerate() {
        let root = point(&at);
        at *= turn(2, *q) * shift(a, 0.0, d) * turn(0, alpha);
        if k != link {
            continue;
        }
        let (end, length) = (point(&at), (point(&at) - root).norm());
        let along = (end - root) / length;
        let pull = |m: f64| Vector3::new(0.0, 0.0, -9.81 * m);
        let ds = length / PIECES as f64;
        let (mut turned, mut moved) = (Vector3::zeros(), Vector3::zeros());
        for piece in 0..PIECES {
            let here = root + along * ((piece as f64 + 0.5) * ds);
            let moment: Vector3<f64> = (link + 1..6)
                .map(|b| (centres[b] - here).cross(&pull(MASS[b])))
                .sum();
            let twist = along * along.dot(&moment);
            let before = turned;
            // a round tube of steel twists 1.3 times as easily as it bends
            turned += (moment + twist * 0.3) * (flexible * ds);
            moved += (0.5 * (before + turned)).cross(&along) * ds;
        }
        let mut new = Matrix4::identity();
        let rotation = Rotation3::new(turned).into_inner() * at.fixed_view::<3, 3>(0, 0);
        new.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        new.fixed_view_mut::<3, 1>(0, 3).copy_from(&(end + moved));
        at = new;
    }
    at
}

/// Torque of gravity: the slope of the potential energy.
fn torque(q: &[f64; 6], joint: usize) -> f64 {
    let energy = |d: f64| -> f64 {
        let mut q = *q;
        q[joint] += d;
        let (_, centres) = forward(&q, &TABLE);
        centres.iter().zip(MASS).map(|(c, m)| 9.81 * m * c.z).sum()
    };
    -(energy(1e-5) - energy(-1e-5)) / 2e-5
}

fn urdf() -> String {
    let mut out = "<robot name=\"arm6\"><link name=\"base\"/>\n".to_string();
    let mut before = [0.0; 3];
    for (i, own) in TABLE.iter().enumerate() {
        let (k, m) = (i + 1, MASS[i]);
        let parent = if i == 0 {
            "base".into()
        } else {
            format!("l{i}")
        };
        let tensor = 0.01 * m;
        let _ = writeln!(
            out,
            "<link name=\"l{k}\"><inertial><origin xyz=\"{} 0 {}\"/><mass value=\"{m}\"/><inertia ixx=\"{tensor}\" \
             iyy=\"{tensor}\" izz=\"{tensor}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n<joint name=\"j{k}\" \
             type=\"revolute\"><parent link=\"{parent}\"/><child link=\"l{k}\"/><origin xyz=\"{} 0 {}\" rpy=\"{} 0 0\"/>\
             <axis xyz=\"0 0 1\"/><limit lower=\"-2.8\" upper=\"2.8\" velocity=\"3\" effort=\"300\"/></joint>",
            0.5 * own[0],
            0.5 * own[2],
            before[0],
            before[2],
            before[1]
        );
        before = *own;
    }
    let _ = writeln!(
        out,
        "<link name=\"tool\"/><joint name=\"tip\" type=\"fixed\"><parent link=\"l6\"/><child link=\"tool\"/><origin \
         xyz=\"{} 0 {}\" rpy=\"{} 0 0\"/></joint></robot>",
        before[0], before[2], before[1]
    );
    out
}

fn normal(r: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| r.random_range(-0.5..0.5)).sum()
}

/// Fitted rows of three groups, then rows held out.
const ROWS: [usize; 2] = [60, 30];

/// One group's file: joint readings, what was seen.
fn write(
    folder: &std::path::Path,
    robot: &str,
    kind: &str,
    std: [f64; 2],
    rows: &[(usize, Vec<f64>)],
) {
    let mut text = format!("robot = \"{robot}\"\n[prior]\nlength = 0.001\nangle = 0.003\n");
    for (g, name) in ["a", "b", "c", "held"].iter().enumerate() {
        let line = |r: &(usize, Vec<f64>)| {
            let cells: Vec<String> = r.1.iter().map(f64::to_string).collect();
            cells.join(",") + "\n"
        };
        let own: String = rows.iter().filter(|r| r.0 == g).map(line).collect();
        std::fs::write(folder.join(format!("{name}.csv")), own).unwrap();
        let purpose = if g < 3 { "fit" } else { "holdout" };
        let angle = match kind {
            "pose" => format!("angle_std = {}\n", std[1]),
            _ => String::new(),
        };
        let _ = write!(
            text,
            "[[measurement]]\nkind = \"{kind}\"\nfile = \"{name}.csv\"\ngroup = \"{name}\"\nuse = \"{purpose}\"\nstd = {}\n{angle}",
            std[0]
        );
    }
    std::fs::write(folder.join("calibration.toml"), text).unwrap();
}

fn group(k: usize) -> usize {
    if k < ROWS[0] { 3 * k / ROWS[0] } else { 3 }
}

fn run(folder: &std::path::Path) -> PoseDiagnosis {
    let (input, opened) = read(folder.join("calibration.toml")).unwrap();
    diagnose(
        &input,
        &opened,
        Ask {
            next: true,
            seed: 1,
        },
    )
    .unwrap()
}

/// A tracker (0.05 mm) looks at the arm.
pub fn arm(what: Withheld, seed: u64, reach: f64) -> PoseDiagnosis {
    let r = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut table = TABLE;
    if let Table(joint, column, by) = what {
        table[joint][column] += by;
    }
    let camera = shift(0.5, -0.3, 2.0) * turn(0, 2.8) * turn(1, 0.3) * turn(2, 0.2);
    let target = shift(0.03, 0.02, 0.05);
    let mut before = [0.0; 6];
    let mut rows = Vec::new();
    let middle = [0.2, -0.5, 0.6, 0.3, 0.5, 0.1];
    for k in 0..ROWS[0] + ROWS[1] {
        let q: [f64; 6] = std::array::from_fn(|j| match reach > 1.0 {
            true => r.random_range(-reach..reach),
            false => middle[j] + r.random_range(-reach..reach),
        });
        let mut at = q;
        match what {
            Offset(j, by) => at[j] += by,
            Eccentricity(j, by) => at[j] += by * (q[j] + 0.7).sin(),
            Compliance(j, by) => at[j] += by * torque(&q, j),
            Play(j, by) => at[j] -= 0.5 * by * (q[j] - before[j]).signum(),
            Sag(j, by) => at[j] += 0.5 * by * torque(&q, j).signum(),
            Held(j, by, friction) => {
                let pull = torque(&q, j);
                let side = match pull.abs() > friction {
                    true => pull.signum(),
                    false => -(q[j] - before[j]).signum(),
                };
                at[j] += 0.5 * by * side;
            }
            Square(j, by) => at[j] += by * (7.0 * q[j]).sin().signum(),
            _ => {}
        }
        before = q;
        let moved: Matrix4<f64> = match what {
            Base(by) if group(k) == 2 => shift(by, -0.5 * by, 0.3 * by) * turn(2, by),
            _ => Matrix4::identity(),
        };
        let tool = match what {
            Bend(link, by) => bent(&at, link, by),
            _ => forward(&at, &table).0,
        };
        let seen: Matrix4<f64> = camera * moved * tool * target;
        let p: Vector3<f64> = seen.fixed_view::<3, 1>(0, 3).into();
        let p = p + Vector3::from_fn(|_, _| 5e-5 * normal(r));
        rows.push((group(k), q.iter().chain(p.iter()).copied().collect()));
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.urdf"), urdf()).unwrap();
    let robot = "robot.urdf\"\nframe = \"tool";
    write(folder.path(), robot, "position", [5e-5, 0.0], &rows);
    run(folder.path())
}

/// Radius and angles of the joints of the bundled hexapod, m and rad.
const BASE: (f64, [f64; 6]) = (
    0.60,
    [
        -0.2085,
        0.2085,
        1.885_895_1,
        2.302_895_1,
        3.980_290_2,
        4.397_290_2,
    ],
);
const PLATFORM: (f64, [f64; 6]) = (
    0.35,
    [
        -0.88,
        0.88,
        1.214_395_1,
        2.974_395_1,
        3.308_790_2,
        5.068_790_2,
    ],
);

/// A camera (0.1 mm, 0.1 mrad) looks at the platform of a hexapod.
pub fn hexapod(what: Withheld, seed: u64) -> PoseDiagnosis {
    let r = &mut ChaCha8Rng::seed_from_u64(seed);
    let ring = |(radius, angles): (f64, [f64; 6])| {
        angles.map(|a| Vector3::new(radius * a.cos(), radius * a.sin(), 0.0))
    };
    let (mut base, platform) = (ring(BASE), ring(PLATFORM));
    let mut zero = [0.69; 6];
    match what {
        Leg(leg, by) => base[leg].x += by,
        Offset(leg, by) => zero[leg] += by,
        _ => {}
    }
    let view = Rotation3::from_euler_angles(2.8, 0.3, 0.2).into_inner();
    let tilt = Rotation3::from_euler_angles(0.1, 0.05, 0.4).into_inner();
    let mut before = [0.0; 6];
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    while rows.len() < ROWS[0] + ROWS[1] {
        let mut draw = |s: f64| r.random_range(-s..s);
        let p = Vector3::new(draw(0.1), draw(0.1), 0.8 + draw(0.08));
        let turned: Matrix3<f64> =
            Rotation3::from_euler_angles(draw(0.2), draw(0.2), draw(0.2)).into_inner();
        let arms = platform.map(|b| turned * b);
        let legs: [Vector3<f64>; 6] = std::array::from_fn(|i| p + arms[i] - base[i]);
        let mut q: [f64; 6] = std::array::from_fn(|i| legs[i].norm() - zero[i]);
        if let Compliance(leg, by) = what {
            // the legs hold the platform and what moves with it, 39 kg
            let unit = legs.map(|l| l.normalize());
            let wrench = Matrix6::from_fn(|i, k| match i < 3 {
                true => unit[k][i],
                false => arms[k].cross(&unit[k])[i - 3],
            });
            let pull = Vector3::new(0.0, 0.0, -39.0 * 9.81);
            let moment = (turned * Vector3::new(0.0, 0.0, 0.02)).cross(&pull);
            let load = Vector6::new(pull.x, pull.y, pull.z, moment.x, moment.y, moment.z);
            q[leg] += by * wrench.lu().solve(&(-load)).unwrap()[leg];
        }
        if let Play(leg, by) = what {
            q[leg] += 0.5 * by * (q[leg] - before[leg]).signum();
        }
        if q.iter().any(|l| !(0.0..0.4).contains(l)) {
            continue;
        }
        before = q;
        let at =
            Vector3::new(0.3, -0.2, 2.2) + view * (p + turned * Vector3::new(0.02, 0.01, 0.05));
        let at = at + Vector3::from_fn(|_, _| 1e-4 * normal(r));
        let noise = Vector3::from_fn(|_, _| 1e-4 * normal(r));
        let seen = Rotation3::new(noise).into_inner() * view * turned * tilt;
        let h = nalgebra::UnitQuaternion::from_matrix(&seen);
        let pose = [at.x, at.y, at.z, h.w, h.i, h.j, h.k];
        rows.push((group(rows.len()), q.iter().chain(&pose).copied().collect()));
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "hexapod", "pose", [1e-4, 1e-4], &rows);
    run(folder.path())
}
