//! Layouts of tables as recorders and people write them, of a robot whose columns are known.

use super::blind::simulated;
use excite::Plant;
use excite::survey::{Means, Survey, survey, survey_in_parts};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const JOINTS: usize = 6;

/// What the arrays of a message are called.
const ARRAYS: [(Means, &str); 3] = [
    (Means::Position, "position"),
    (Means::Velocity, "velocity"),
    (Means::Torque, "effort"),
];

/// Time, positions, velocities and torques of an arm.
struct Motion {
    plant: Plant,
    t: Vec<f64>,
    q: Vec<Vec<f64>>,
    dq: Vec<Vec<f64>>,
    tau: Vec<Vec<f64>>,
}

impl Motion {
    fn new() -> Self {
        let plant = Plant::load("ur5e").unwrap();
        let all = simulated(&plant, 11);
        let of = |means: Means| -> Vec<Vec<f64>> {
            let mine = all.iter().filter(|c| c.means == means);
            mine.map(|c| c.values.clone()).collect()
        };
        let mut t = of(Means::Time);
        let [q, dq, tau] = [Means::Position, Means::Velocity, Means::Torque].map(of);
        Motion {
            t: t.remove(0),
            plant,
            q,
            dq,
            tau,
        }
    }

    /// A table of these columns, cell by cell.
    fn write(&self, path: &Path, head: &str, cells: &dyn Fn(usize) -> Vec<String>) {
        let mut text = format!("{head}\n");
        for i in 0..self.t.len() {
            let _ = writeln!(text, "{}", cells(i).join(","));
        }
        std::fs::write(path, text).unwrap();
    }

    fn joint(&self, j: usize) -> String {
        self.plant.actuators()[j].name.clone()
    }
}

/// `name0,name1,…`
fn numbered(name: &str, from: usize) -> String {
    let all = (from..from + JOINTS).map(|j| format!("{name}{j}"));
    all.collect::<Vec<_>>().join(",")
}

fn numbers(columns: &[Vec<f64>], i: usize) -> impl Iterator<Item = String> + '_ {
    columns.iter().map(move |c| c[i].to_string())
}

/// Row `i` of a table: what comes first, and then columns.
fn row(mut first: Vec<String>, i: usize, columns: &[&[Vec<f64>]]) -> Vec<String> {
    first.extend(columns.iter().flat_map(|c| numbers(c, i)));
    first
}

/// Joints in the order of their names.
const ORDER: [usize; JOINTS] = [2, 1, 0, 3, 4, 5];

fn permuted(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    ORDER.iter().map(|&j| columns[j].clone()).collect()
}

/// Where a joint stands in that order.
fn place(j: usize) -> usize {
    ORDER.iter().position(|&o| o == j).unwrap()
}

/// Names of the columns that are claimed to mean this, joint by joint.
fn claimed(found: &Survey, means: Means) -> Vec<String> {
    (0..JOINTS)
        .map(|j| {
            let name = &found.joints[j];
            let mine = |c: &&excite::survey::Claim| {
                c.means == means && c.joint.as_ref() == Some(name) && c.confidence >= 0.5
            };
            let mut all = found.claims.iter().filter(mine);
            let first = all.next().map_or("none".into(), |c| c.column.clone());
            assert!(all.next().is_none(), "two {means:?} of {name}");
            first
        })
        .collect()
}

fn expect(found: &Survey, means: Means, of: &dyn Fn(usize) -> String) {
    let expected: Vec<String> = (0..JOINTS).map(of).collect();
    assert_eq!(claimed(found, means), expected);
}

fn of(path: &Path, plant: &Plant) -> Survey {
    survey(&[path.to_path_buf()], Some(plant)).unwrap()
}

/// The experiment that is written for what was found, and what it reads.
fn read_back(found: &Survey, folder: &Path) -> (String, excite::log::Experiment) {
    let toml = folder.join("experiment.toml");
    let text = excite::survey::experiment(found, Some("ur5e"), folder);
    std::fs::write(&toml, &text).unwrap();
    let read = excite::log::Experiment::read(&toml).unwrap();
    (text, read)
}

/// `rostopic echo -p` writes joints in the order of their names, and the names in columns of texts; a Python script may
/// write lists of both.
#[test]
fn names_of_joints_in_columns_of_texts_count() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let [q, dq, tau] = [&m.q, &m.dq, &m.tau].map(|c| permuted(c));
    let names: Vec<String> = ORDER.iter().map(|&j| m.joint(j)).collect();
    // cells of lists are called by numbers from 0, too
    for (head, lists) in [
        (
            format!(
                "%time,field.header.seq,field.header.stamp,field.header.frame_id,{}",
                ["name", "position", "velocity", "effort"]
                    .map(|what| numbered(&format!("field.{what}"), 0))
                    .join(",")
            ),
            false,
        ),
        ("timestamp,name,position,velocity,effort".into(), true),
    ] {
        let path = folder.path().join("echo.csv");
        m.write(&path, &head, &|i| {
            let stamp = 1_600_000_000_000_000_000_i64 + (m.t[i] * 1e9) as i64;
            if !lists {
                let mut out = vec![
                    stamp.to_string(),
                    (1000 + i).to_string(),
                    (stamp - 3000).to_string(),
                    String::new(),
                ];
                out.extend(names.clone());
                return row(out, i, &[&q, &dq, &tau]);
            }
            let list = |all: Vec<String>| format!("\"[{}]\"", all.join(" "));
            let mut out = vec![stamp.to_string(), list(names.clone())];
            out.extend([&q, &dq, &tau].map(|c| list(numbers(c, i).collect())));
            out
        });
        let found = of(&path, &m.plant);
        for (means, what) in ARRAYS {
            expect(&found, means, &|j| match lists {
                true => format!("{what}[{}]", place(j)),
                false => format!("field.{what}{}", place(j)),
            });
        }
        let said: Vec<&str> = found.warnings.iter().map(|w| &w.message[..]).collect();
        assert!(
            said.iter()
                .all(|m| !m.contains("cannot have been measured")),
            "{said:?}"
        );
    }
}

/// `ros2 topic echo --csv` writes no header, and stamps in two columns; the joints as the driver has them.
#[test]
fn a_joint_state_without_a_header_is_read() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("echo.csv");
    let [q, dq, tau] = [&m.q, &m.dq, &m.tau].map(|c| permuted(c));
    for frame in ["", "base_link"] {
        m.write(&path, "", &|i| {
            let t = 1_700_000_000.3 + m.t[i];
            let nanoseconds = ((t - t.floor()) * 1e9).round();
            let mut out = vec![t.floor().to_string(), nanoseconds.to_string(), frame.into()];
            out.extend(ORDER.iter().map(|&j| m.joint(j)));
            row(out, i, &[&q, &dq, &tau])
        });
        let found = of(&path, &m.plant);
        for (means, what) in ARRAYS {
            expect(&found, means, &|j| format!("{what}[{}]", place(j)));
        }
        assert!((found.frames[0].step - 0.004).abs() < 1e-8);
        // the experiment reads what was found
        let (text, read) = read_back(&found, folder.path());
        assert!((read.records[0].step - 0.004).abs() < 1e-8, "{text}");
        assert_eq!(read.records[0].q[0][9], m.q[0][9]);
    }
}

/// A recorder that counts angles from 0° to 360° (Kortex), with joints that pass zero: they are continuous in the survey and in
/// the record, in the turn of the limits, and the model explains the torques with them as before.
#[test]
fn angles_that_jump_by_a_turn_are_continuous() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kortex.csv");
    // the first joint about zero, the others where they are
    let mut q = m.q.clone();
    let middle = q[0].iter().sum::<f64>() / q[0].len() as f64;
    q[0].iter_mut().for_each(|x| *x -= middle);
    let columns = ["position", "velocity", "torque"].map(|what| {
        let all = (0..JOINTS).map(|j| format!("actuators[{j}].{what}"));
        all.collect::<Vec<_>>().join(",")
    });
    m.write(&path, &format!("time,{}", columns.join(",")), &|i| {
        let mut out = vec![m.t[i].to_string()];
        out.extend(
            q.iter()
                .map(|c| c[i].to_degrees().rem_euclid(360.0).to_string()),
        );
        out.extend(m.dq.iter().map(|c| c[i].to_degrees().to_string()));
        out.extend(numbers(&m.tau, i));
        out
    });
    let found = of(&path, &m.plant);
    expect(&found, Means::Position, &|j| {
        format!("actuators[{j}].position")
    });
    expect(&found, Means::Torque, &|j| format!("actuators[{j}].torque"));
    let jumps = |w: &str| w.contains("jumps by a whole turn");
    let first = found
        .warnings
        .iter()
        .find(|w| w.subject.contains("actuators[0].position"));
    assert!(
        first.is_some_and(|w| jumps(&w.message)),
        "{:?}",
        found.warnings
    );
    let (_, read) = read_back(&found, folder.path());
    let record = &read.records[0];
    assert!(record.warnings.iter().any(|w| jumps(&w.message)));
    for (j, (read, was)) in record.q.iter().zip(&q).enumerate() {
        let turns = ((read[0] - was[0]) / std::f64::consts::TAU).round();
        let by = turns * std::f64::consts::TAU;
        assert!(
            read.iter().zip(was).all(|(a, b)| (a - b - by).abs() < 1e-9),
            "{j}"
        );
        let limits = m.plant.actuators()[j].limits.position;
        assert!(
            read.iter().all(|x| (limits[0]..limits[1]).contains(x)),
            "{j}"
        );
    }
}

/// JSON Lines of a `JointState`, as scripts write them: the names say which joint is which, the stamp is in two members.
#[test]
fn lines_of_json_are_read() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("states.jsonl");
    let [q, dq, tau] = [&m.q, &m.dq, &m.tau].map(|c| permuted(c));
    let names: Vec<String> = ORDER
        .iter()
        .map(|&j| format!("\"{}\"", m.joint(j)))
        .collect();
    let list = |c: &[Vec<f64>], i| numbers(c, i).collect::<Vec<_>>().join(", ");
    let text: String = (0..m.t.len())
        .map(|i| {
            let t = 1_700_000_000.3 + m.t[i];
            format!(
                "{{\"header\": {{\"stamp\": {{\"sec\": {}, \"nanosec\": {}}}}}, \"name\": [{}], \"position\": [{}], \
                 \"velocity\": [{}], \"effort\": [{}]}}\n",
                t.floor(),
                ((t - t.floor()) * 1e9).round(),
                names.join(", "),
                list(&q, i),
                list(&dq, i),
                list(&tau, i)
            )
        })
        .collect();
    // the recorder was stopped in the middle of a line
    std::fs::write(&path, &text[..text.len() - 40]).unwrap();
    let found = of(&path, &m.plant);
    for (means, what) in ARRAYS {
        expect(&found, means, &|j| format!("{what}[{}]", place(j)));
    }
    assert!((found.frames[0].step - 0.004).abs() < 1e-8);
    assert_eq!(found.frames[0].rows, m.t.len() - 1);
    let (text, read) = read_back(&found, folder.path());
    assert_eq!(read.records[0].q[0][9], m.q[0][9], "{text}");
}

/// Without the names, arrays in another order are not given to joints by their numbers: neither the positions that the
/// torques contradict, nor what belongs to them.
#[test]
fn arrays_in_another_order_are_not_claimed() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arrays.csv");
    let head = [
        "t".into(),
        numbered("position_", 0),
        numbered("velocity_", 0),
    ];
    let head = format!("{},{}", head.join(","), numbered("effort_", 0));
    let [q, dq, tau] = [&m.q, &m.dq, &m.tau].map(|c| permuted(c));
    m.write(&path, &head, &|i| {
        row(vec![m.t[i].to_string()], i, &[&q, &dq, &tau])
    });
    let found = of(&path, &m.plant);
    for (means, what) in ARRAYS {
        let claims = claimed(&found, means);
        for j in [0, 2] {
            let wrong = format!("{what}_{j}");
            assert_ne!(claims[j], wrong, "{claims:?}");
        }
        assert_eq!(claims[3], format!("{what}_3"));
    }
    assert!(found.warnings.iter().any(|w| w.message.contains("swapped")));
}

/// Positions without a name that says so, beside velocities or torques that have one; units in brackets; a clock of whole
/// seconds; what belongs to the tool.
#[test]
fn positions_are_found_beside_what_is_named() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let degrees: Vec<Vec<f64>> =
        m.q.iter()
            .map(|c| c.iter().map(|x| x.to_degrees()).collect())
            .collect();
    // of velocities
    let path = folder.path().join("state.csv");
    let head = format!(
        "frame,timestamp,{},{}",
        numbered("observation.state", 0),
        numbered("observation.velocity", 0)
    );
    m.write(&path, &head, &|i| {
        let first = vec![i.to_string(), m.t[i].to_string()];
        row(first, i, &[&degrees, &m.dq])
    });
    let found = of(&path, &m.plant);
    expect(&found, Means::Position, &|j| {
        format!("observation.state{j}")
    });
    let scale = |c: &excite::survey::Claim| (c.scale.to_degrees() - 1.0).abs() < 1e-9;
    let positions = found.claims.iter().filter(|c| c.means == Means::Position);
    assert!(positions.clone().all(scale) && positions.count() == JOINTS);
    // of torques
    for (what, torque) in [("J", "Torque_J"), ("AXIS_ACT.A", "TORQUE_AXIS_ACT.A")] {
        let path = folder.path().join("torques.csv");
        let head = format!("Time,{},{}", numbered(what, 1), numbered(torque, 1));
        m.write(&path, &head, &|i| {
            row(vec![m.t[i].to_string()], i, &[&degrees, &m.tau])
        });
        let found = of(&path, &m.plant);
        expect(&found, Means::Position, &|j| format!("{what}{}", j + 1));
        expect(&found, Means::Torque, &|j| format!("{torque}{}", j + 1));
    }
    // by their units, on a clock of whole seconds
    let path = folder.path().join("units.csv");
    let bracket = |name: &str, unit: &str| {
        let all = (1..=JOINTS).map(|j| format!("{name}{j} [{unit}]"));
        all.collect::<Vec<_>>().join(",")
    };
    let head = format!(
        "pc_ts,speed_scaling,{},{},tcp_0",
        bracket("A", "deg"),
        bracket("A", "Nm")
    );
    m.write(&path, &head, &|i| {
        let first = vec![(1_759_936_358 + m.t[i] as i64).to_string(), "1".to_string()];
        let mut out = row(first, i, &[&degrees, &m.tau]);
        out.push(m.q[0][i].cos().to_string());
        out
    });
    let found = of(&path, &m.plant);
    expect(&found, Means::Position, &|j| format!("A{} [deg]", j + 1));
    expect(&found, Means::Torque, &|j| format!("A{} [Nm]", j + 1));
    let tool = found.claims.iter().find(|c| c.column == "tcp_0").unwrap();
    assert_eq!(tool.means, Means::Other);
    let frame = &found.frames[0];
    assert!((frame.step - 0.004).abs() < 1e-5, "{}", frame.step);
}

/// Torques without a name that says so, beside positions that have one, in an order of their own; currents by their unit.
#[test]
fn torques_are_found_beside_positions() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torques.csv");
    let tau = permuted(&m.tau);
    let beside = |name: &str| {
        let head = format!("t,{},{}", numbered("q", 1), numbered(name, 0));
        m.write(&path, &head, &|i| {
            row(vec![m.t[i].to_string()], i, &[&m.q, &tau])
        });
        of(&path, &m.plant)
    };
    // a command is no torque that was measured
    let commanded = beside("TargetMoment");
    assert_eq!(claimed(&commanded, Means::Torque), ["none"; JOINTS]);
    let found = beside("x");
    expect(&found, Means::Position, &|j| format!("q{}", j + 1));
    let torques = claimed(&found, Means::Torque);
    for (j, name) in torques.iter().enumerate() {
        let right = format!("x{}", place(j));
        assert!(*name == right || j > 3 && name == "none", "{torques:?}");
    }
    let milli = (1..=JOINTS).map(|j| format!("i{j}_mA"));
    let milli: Vec<String> = milli.collect();
    let head = format!("t,{},{}", numbered("q", 1), milli.join(","));
    m.write(&path, &head, &|i| {
        let mut out = row(vec![m.t[i].to_string()], i, &[&m.q]);
        out.extend(m.tau.iter().map(|c| (100.0 * c[i]).to_string()));
        out
    });
    let found = of(&path, &m.plant);
    expect(&found, Means::Current, &|j| milli[j].clone());
}

/// Files that are called by what they hold, with the names of the joints, and no time: the velocities tell it.
#[test]
fn files_of_a_quantity_each_are_one_record() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let head: Vec<String> = (0..JOINTS).map(|j| m.joint(j)).collect();
    let files: Vec<PathBuf> = [("q", &m.q), ("dq", &m.dq), ("current_mA", &m.tau)]
        .map(|(name, columns)| {
            let path = folder.path().join(format!("{name}.csv"));
            m.write(&path, &head.join(","), &|i| {
                let milli = if name == "current_mA" { 100.0 } else { 1.0 };
                let all = columns.iter().map(|c| (milli * c[i]).to_string());
                all.collect()
            });
            path
        })
        .into();
    let found = survey(&files, Some(&m.plant)).unwrap();
    assert_eq!(found.frames.len(), 1);
    assert_eq!(found.frames[0].rate, Some(250.0));
    expect(&found, Means::Position, &|j| format!("q.{}", m.joint(j)));
    expect(&found, Means::Current, &|j| {
        format!("current_mA.{}", m.joint(j))
    });
    // 10 N m/A, also of a wrist whose friction hides its bodies
    for c in found.claims.iter().filter(|c| c.means == Means::Current) {
        let gain = 1e3 * c.scale;
        assert!((gain / 10.0).ln().abs() < 0.5, "{}: {gain}", c.column);
    }
    // and the experiment that is written is read, with this rate
    let (text, read) = read_back(&found, folder.path());
    assert!((read.records[0].step - 0.004).abs() < 1e-9, "{text}");
    for (a, b) in read.records[0].q[0].iter().zip(&m.q[0]) {
        assert_eq!(a, b);
    }
}

/// Files of a joint each are one record of a robot with so many joints, and records of any other.
#[test]
fn files_of_a_joint_each_are_one_record() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let files: Vec<PathBuf> = (0..JOINTS)
        .map(|j| {
            let path = folder.path().join(format!("joint_{}.csv", j + 1));
            let columns = [&m.q, &m.dq, &m.tau].map(|c| &c[j..=j]);
            m.write(&path, "time,position,velocity,torque", &|i| {
                row(vec![m.t[i].to_string()], i, &columns)
            });
            path
        })
        .collect();
    let found = survey(&files, Some(&m.plant)).unwrap();
    assert_eq!(found.frames.len(), 1);
    for (means, name) in [(Means::Position, "position"), (Means::Torque, "torque")] {
        expect(&found, means, &|j| format!("joint_{}.{name}", j + 1));
    }
    let (_, read) = read_back(&found, folder.path());
    for (a, b) in read.records[0].q.iter().zip(&m.q) {
        assert_eq!(a[..100], b[..100]);
    }
    let two = Plant::load("planar2").unwrap();
    assert_eq!(survey(&files[..3], Some(&two)).unwrap().frames.len(), 3);
}

/// Also where one of them holds something else.
#[test]
fn a_file_that_is_called_by_nothing_known_stays_unknown() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let head: Vec<String> = (0..JOINTS).map(|j| m.joint(j)).collect();
    let names = [("q", &m.q), ("tau", &m.tau), ("load_percent", &m.dq)];
    let files = names.map(|(name, columns)| {
        let path = folder.path().join(format!("{name}.csv"));
        m.write(&path, &format!("t,{}", head.join(",")), &|i| {
            row(vec![m.t[i].to_string()], i, &[columns])
        });
        path
    });
    let found = survey(&files, Some(&m.plant)).unwrap();
    assert_eq!(found.frames.len(), 1);
    expect(&found, Means::Position, &|j| format!("q.{}", m.joint(j)));
    expect(&found, Means::Torque, &|j| format!("tau.{}", m.joint(j)));
}

/// Several groups of columns of one quantity, as a controller and a filter add them.
#[test]
fn of_several_groups_that_which_is_called_plainly_was_measured() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("groups.csv");
    let names = [
        "Position",
        "PositionFiltered",
        "e_q",
        "Velocity",
        "motor_velocity",
        "Torque",
        "TorqueCur",
        "tau_model",
    ];
    let head: Vec<String> = names.iter().map(|n| numbered(n, 1)).collect();
    let columns = [&m.q, &m.q, &m.dq, &m.dq, &m.dq, &m.tau, &m.dq, &m.tau].map(|c| &c[..]);
    m.write(&path, &format!("Time,{}", head.join(",")), &|i| {
        row(vec![m.t[i].to_string()], i, &columns)
    });
    for plant in [Some(&m.plant), None] {
        let found = survey(std::slice::from_ref(&path), plant).unwrap();
        expect(&found, Means::Position, &|j| format!("Position{}", j + 1));
        expect(&found, Means::Velocity, &|j| format!("Velocity{}", j + 1));
        expect(&found, Means::Torque, &|j| format!("Torque{}", j + 1));
        let said = |w: &&excite::Warning| w.message.contains("too: TorqueCur1 and 5 more.");
        assert_eq!(found.warnings.iter().filter(said).count(), 1);
    }
}

/// A word and a number, counted from zero, beside a robot that counts its joints from one.
#[test]
fn a_word_and_a_number_are_no_name_of_a_joint() {
    let plant = Plant::load("panda").unwrap();
    let all = simulated(&plant, 11);
    let of = |means: Means| all.iter().filter(move |c| c.means == means);
    let names = [(Means::Position, "arm_q"), (Means::Torque, "arm_tau")];
    let mut columns = vec![("t".to_string(), of(Means::Time).next().unwrap())];
    for (means, name) in names {
        let mine = of(means).enumerate();
        columns.extend(mine.map(|(j, c)| (format!("{name}_{j}"), c)));
    }
    let head: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = head.join(",") + "\n";
    for i in 0..columns[0].1.values.len() {
        let cells: Vec<String> = columns
            .iter()
            .map(|(_, c)| c.values[i].to_string())
            .collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("counted.csv");
    std::fs::write(&path, text).unwrap();
    let found = self::of(&path, &plant);
    for (j, joint) in plant.actuators().iter().enumerate() {
        for name in ["arm_q", "arm_tau"] {
            let column = format!("{name}_{j}");
            let claim = found.claims.iter().find(|c| c.column == column).unwrap();
            assert_eq!(claim.joint.as_ref(), Some(&joint.name), "{column}");
        }
    }
    let said = |w: &&excite::Warning| w.message.contains("no column is called like it");
    assert_eq!(found.warnings.iter().find(said), None);
}

/// A column that counts rows is no time.
#[test]
fn a_counter_is_no_time() {
    let m = Motion::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("steps.csv");
    let head = format!(
        "step,{},{}",
        numbered("dof_pos_", 0),
        numbered("dof_tau_", 0)
    );
    m.write(&path, &head, &|i| {
        row(vec![i.to_string()], i, &[&m.q, &m.tau])
    });
    let found = of(&path, &m.plant);
    assert_eq!(found.frames[0].time, None);
    let mut said = found.warnings.iter().map(|w| &w.message);
    assert!(said.any(|m| m.contains("no column is a time")));
    // but one in a unit of time is, and of two clocks the one that goes on from row to row
    let time = |head: &str, first: &dyn Fn(usize) -> Vec<String>| {
        let head = format!("{head},{}", numbered("q", 1));
        m.write(&path, &head, &|i| row(first(i), i, &[&m.q]));
        let frame = of(&path, &m.plant).frames.remove(0);
        let name = frame.time.map(|k| frame.names[k].clone());
        (name.unwrap(), frame.time_unit)
    };
    let zeit = time("Zeit [ms]", &|i| vec![i.to_string()]);
    assert_eq!(zeit, ("Zeit [ms]".into(), "ms"));
    let of_two = time("pc_ts,timestamp", &|i| {
        vec![(m.t[i] as i64).to_string(), m.t[i].to_string()]
    });
    assert_eq!(of_two, ("timestamp".into(), "s"));
}

/// A log that is read in parts: it begins with a robot that stands, has a gap, a value that nothing can have measured, and a
/// channel that was not recorded. What its parts say together is what it says as a whole.
#[test]
fn a_log_in_parts_says_what_it_says_as_a_whole() {
    let dir = tempfile::tempdir().unwrap();
    let m = Motion::new();
    let n = m.t.len();
    let step = m.t[1] - m.t[0];
    let head = n / 4;
    let noise =
        |i: usize, j: usize| 1e-6 * (((i * 7919 + j * 104_729) % 1000) as f64 - 500.0) / 500.0;
    let (gap, wrong) = (n / 2, head + 2 * n / 3);
    for timed in [true, false] {
        let cells = |i: usize| {
            let at = i.saturating_sub(head);
            let stands = i < head;
            let t = i as f64 * step + if i >= gap { 3.0 } else { 0.0 };
            let mut cells = vec![t.to_string()];
            for (columns, scale) in [(&m.q, 1.0), (&m.dq, 0.0), (&m.tau, 1.0)] {
                for (j, column) in columns.iter().enumerate() {
                    let x = match stands {
                        true => scale * column[0] + noise(i, j),
                        false => column[at],
                    };
                    cells.push(x.to_string());
                }
            }
            if i == wrong {
                cells[2] = "4.5e7".into();
            }
            cells.push("nan".into());
            if !timed {
                cells.remove(0);
            }
            cells
        };
        let names = ["q", "dq", "tau"].map(|name| numbered(name, 1)).join(",");
        let mut text = format!("{}{names},spare\n", if timed { "t," } else { "" });
        for i in 0..head + n {
            let _ = writeln!(text, "{}", cells(i).join(","));
        }
        let path = dir.path().join("long.csv");
        std::fs::write(&path, text).unwrap();
        let files = [path];
        let read = |rows| survey_in_parts(&files, Some(&m.plant), Some(rows)).unwrap();
        let whole = read(0);
        for rows in [n / 6, n / 3] {
            let parts = read(rows);
            let [a, b] = [&whole, &parts].map(|s| &s.frames[0]);
            assert_eq!((a.rows, a.time_unit), (b.rows, b.time_unit));
            assert!((a.duration() - b.duration()).abs() < 2.0 * step, "{timed}");
            assert_eq!(a.gaps.len(), usize::from(timed));
            assert_eq!(a.gaps.len(), b.gaps.len());
            let pairs = a.gaps.iter().flatten().zip(b.gaps.iter().flatten());
            assert!(pairs.into_iter().all(|(x, y)| (x - y).abs() < 2.0 * step));
            for (c, d) in whole.claims.iter().zip(&parts.claims) {
                assert_eq!(
                    (&c.column, c.means, &c.joint),
                    (&d.column, d.means, &d.joint)
                );
                assert!((c.factor() / d.factor() - 1.0).abs() < 1e-6, "{}", c.column);
            }
            for (c, d) in whole.courses[0].iter().zip(&parts.courses[0]) {
                assert_eq!(c.saturated, d.saturated);
                let ends = c.range.iter().flatten().zip(d.range.iter().flatten());
                assert!(ends.into_iter().all(|(x, y)| (x - y).abs() < 1e-9));
                assert_eq!(c.moves.len(), d.moves.len(), "{:?} {:?}", c.moves, d.moves);
                let pairs = c.moves.iter().flatten().zip(d.moves.iter().flatten());
                assert!(pairs.into_iter().all(|(x, y)| (x - y).abs() < 0.2));
                // it stands at first
                assert!(d.moves[0][0] > (head as f64 - 1.0) * step - 0.2);
                let relative = d.fastest.unwrap() / c.fastest.unwrap();
                assert!((relative - 1.0).abs() < 1e-3, "{relative}");
            }
            let said = |s: &Survey, what: &str| -> Vec<String> {
                let all = s.warnings.iter().map(ToString::to_string);
                all.filter(|w| w.contains(what)).collect()
            };
            for what in ["no number at all", "cannot have been measured"] {
                assert_eq!(said(&parts, what).len(), 1, "{:?}", parts.warnings);
                assert_eq!(said(&parts, what), said(&whole, what));
            }
            let row = format!("row {} ", wrong + 1);
            assert!(said(&parts, "cannot have been")[0].contains(&row), "{row}");
            assert_eq!(said(&parts, "read in parts").len(), 1);
        }
    }
    let few = survey_in_parts(&[dir.path().join("long.csv")], None, Some(5)).unwrap_err();
    assert!(few.to_string().contains("64"), "{few}");
}

/// A clock that stands still for a part of a log costs the rows of that part, and not the log.
#[test]
fn a_part_of_a_log_without_a_clock_is_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let m = Motion::new();
    let path = dir.path().join("long.csv");
    let stopped = 400..800;
    m.write(&path, &format!("t,{}", numbered("q", 1)), &|i| {
        let last = if stopped.contains(&i) {
            stopped.start - 1
        } else {
            i
        };
        row(vec![m.t[last].to_string()], i, &[&m.q])
    });
    let found = survey_in_parts(&[path], None, Some(200)).unwrap();
    let frame = &found.frames[0];
    assert_eq!(frame.rows, m.t.len() - stopped.len());
    assert!((frame.duration() - m.t[m.t.len() - 1]).abs() < 0.1);
    assert_eq!(frame.gaps.len(), 1, "{:?}", frame.gaps);
    let said: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
    for rows in ["rows 401 to 600", "rows 601 to 800"] {
        assert!(said.iter().any(|w| w.contains(rows)), "{said:?}");
    }
    let all = dir.path().join("stopped.csv");
    m.write(&all, "t,q1", &|i| vec!["7".into(), m.q[0][i].to_string()]);
    assert!(survey_in_parts(&[all], None, Some(200)).is_err());
}
