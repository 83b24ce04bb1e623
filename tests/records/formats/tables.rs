//! Tables of any layout.

use super::*;

#[test]
fn tables_of_any_layout_are_read_by_their_names() {
    let dir = folder();
    let dir = dir.path();
    type Row = fn(f64, [f64; 2], [f64; 2]) -> String;
    let layouts: [(&str, &str, Row, [usize; 2]); 18] = [
        (
            "semicolons and decimal commas",
            "time;q1;q2;tau1;tau2\n",
            |t, q, w| format!("{t:.4};{};{};{};{}", q[0], q[1], w[0], w[1]).replace('.', ","),
            [0, 1],
        ),
        (
            "tabs",
            "% a comment\ntime_ms\tpos_1\tpos_2\ttorque_1\ttorque_2\n",
            |t, q, w| format!("{}\t{}\t{}\t{}\t{}", 1e3 * t, q[0], q[1], w[0], w[1]),
            [0, 1],
        ),
        (
            "tabs at the end of each line",
            "t\tq1\tq2\ttau1\ttau2\t\n",
            |t, q, w| format!("{t}\t{}\t{}\t{}\t{}\t", q[0], q[1], w[0], w[1]),
            [0, 1],
        ),
        (
            "remarks that come late",
            "t,q1,q2,tau1,tau2,message\n",
            |t, q, w| {
                let remark = if t < 1.2 { "" } else { "running" };
                format!("{t},{},{},{},{},{remark}", q[0], q[1], w[0], w[1])
            },
            [0, 1],
        ),
        (
            "units under the names",
            "time,position_1,position_2,torque_1,torque_2\nms,rad,deg,N m,mNm\n",
            |t, q, w| {
                let (second, last) = (q[1] * 180.0 / PI, 1e3 * w[1]);
                format!("{},{},{second},{},{last}", 1e3 * t, q[0], w[0])
            },
            [0, 1],
        ),
        (
            "delimiters in quoted names",
            "t,\"position, joint 1\",\"position, joint 2\",\"torque, joint 1\",\"torque, joint 2\"\n",
            |t, q, w| format!("{t},{},{},{},{}", q[0], q[1], w[0], w[1]),
            [0, 1],
        ),
        (
            "stamps west of Greenwich",
            "date,q1,q2,tau1,tau2\n",
            |t, q, w| {
                let s = 10.0 + t;
                format!(
                    "2020-01-22T12:59:{s:09.6}-05:00,{},{},{},{}",
                    q[0], q[1], w[0], w[1]
                )
            },
            [0, 1],
        ),
        (
            "afternoons",
            "time,q1,q2,tau1,tau2\n",
            |t, q, w| {
                // over noon
                let (hour, half, s) = match t < 1.0 {
                    true => ("11:59", "AM", 59.0 + t),
                    false => ("12:00", "PM", t - 1.0),
                };
                format!("{hour}:{s:09.6} {half},{},{},{},{}", q[0], q[1], w[0], w[1])
            },
            [0, 1],
        ),
        (
            "blanks under a comment",
            "# t q0 q1 tau0 tau1\n",
            |t, q, w| format!("  {t:.3}   {}  {} {} {}", q[0], q[1], w[0], w[1]),
            [0, 1],
        ),
        (
            "lists in cells",
            "type,timestamp,positions,torques\n",
            |t, q, w| {
                format!(
                    "STATE,{},\"[{}, {}]\",\"[{}, {}]\"",
                    1e6 * t + 7.5,
                    q[0],
                    q[1],
                    w[0],
                    w[1]
                )
            },
            [0, 1],
        ),
        (
            "lists of numpy",
            "stamp;q;tau\n",
            |t, q, w| format!("{t:.3};[ {} {}];[{}  {}]", q[0], q[1], w[0], w[1]),
            [0, 1],
        ),
        (
            "stamps",
            "date,q1,q2,tau1,tau2\n",
            |t, q, w| {
                format!(
                    "2020-01-22T12:59:{:09.6}Z,{},{},{},{}",
                    58.0 + t.min(1.9),
                    q[0],
                    q[1],
                    w[0],
                    w[1]
                )
            },
            [0, 1],
        ),
        (
            "nanoseconds since 1970",
            "%time,field.position0,field.position1,field.effort0,field.effort1\n",
            |t, q, w| {
                format!(
                    "{},{},{},{},{}",
                    1_600_000_000_000_000_000u64 + (t * 1e9).round() as u64,
                    q[0],
                    q[1],
                    w[0],
                    w[1]
                )
            },
            [0, 1],
        ),
        (
            "RTDE",
            "timestamp actual_q_0 actual_q_1 target_q_0 target_q_1 actual_current_as_torque_0 actual_current_as_torque_1\n",
            |t, q, w| {
                format!(
                    "{:.3} {} {} {} {} {} {}",
                    1000.0 + t,
                    q[0],
                    q[1],
                    q[0],
                    q[1],
                    w[0],
                    w[1]
                )
            },
            [0, 1],
        ),
        (
            "libfranka",
            "time,state.q[0],state.q[1],state.q_d[0],state.q_d[1],state.tau_J[0],state.tau_J[1],state.tau_J_d[0],state.tau_J_d[1]\n",
            |t, q, w| {
                format!(
                    "{},{},{},{},{},{},{},0,0",
                    1e3 * t,
                    q[0],
                    q[1],
                    q[0],
                    q[1],
                    w[0],
                    w[1]
                )
            },
            [0, 1],
        ),
        (
            "Kortex",
            "time,actuators[0].position,actuators[1].position,actuators[0].torque,actuators[1].torque\n",
            |t, q, w| {
                let deg = q.map(|x| x * 180.0 / PI);
                format!("{t},{},{},{},{}", deg[0], deg[1], w[0], w[1])
            },
            [0, 1],
        ),
        (
            "joints by name",
            "__time,/joint_states/wrist_b/position,/joint_states/wrist_a/position,/joint_states/wrist_b/effort,/joint_states/wrist_a/effort\n",
            |t, q, w| format!("{t},{},{},{},{}", q[0], q[1], w[0], w[1]),
            [1, 0],
        ),
        (
            "units in brackets",
            "time [s],angle 1 [deg],angle 2 [deg],torque 1 [mNm],torque 2 [mNm]\n",
            |t, q, w| {
                let deg = q.map(|x| x * 180.0 / PI);
                format!("{t},{},{},{},{}", deg[0], deg[1], 1e3 * w[0], 1e3 * w[1])
            },
            [0, 1],
        ),
    ];
    for (what, head, row, joints) in layouts {
        table(dir, head, row);
        let r = read(dir, "log = \"log.txt\"").unwrap_or_else(|e| panic!("{what}: {e}"));
        if what == "stamps" {
            // cut at a minute by the test's own writing
            assert!(r.len() >= 190, "{what}: {}", r.len());
            continue;
        }
        holds(&r, joints, 1e-6, what);
    }
}

/// A file that is too short says which rows it was left with, and why.
#[test]
fn a_short_file_says_what_was_left_out() {
    let dir = folder();
    let path = dir.path().join("log.txt");
    std::fs::write(&path, "t,q1,q2,tau1,tau2\n0,1,2,3,4\n0.01,1,oops,3,4\n").unwrap();
    let read = error(dir.path(), "log = \"log.txt\"");
    let looked = excite::survey::survey(&[path], None)
        .unwrap_err()
        .to_string();
    for said in [read, looked] {
        for part in ["log.txt", "1 row is too few", "line 3", "q2", "oops"] {
            assert!(said.contains(part), "{part}: {said}");
        }
    }
}

/// The columns of an experiment: by number, with units, signs, gears and delays; parts of a record.
#[test]
fn an_experiment_states_its_columns() {
    let dir = folder();
    let dir = dir.path();
    // no header; torques come 20 ms late; motor side with a gear of 50 and turned
    table(dir, "", |t, q, _| {
        let (_, w) = state(t - 0.02);
        format!(
            "{},{},{},{},{}",
            1e3 * t,
            -50.0 * q[0],
            q[1] * 180.0 / PI,
            w[0] / 50.0,
            -2.0 * w[1]
        )
    });
    let e = error(dir, "log = \"log.txt\"");
    assert!(e.contains("time") && e.contains("record.columns"), "{e}");
    let columns = "[record.columns]\ntime = { column = 1, unit = \"ms\" }\n\
                   q = { columns = [2, 3], gear = [50, 1], sign = [-1, 1], scale = [1, 0.017453292519943295] }\n\
                   tau = { columns = [4, 5], gear = [50, 1], scale = [1, 0.5], sign = [1, -1], delay = 0.02 }";
    let r = read(dir, &format!("log = \"log.txt\"\n{columns}")).unwrap();
    for i in 5..COUNT - 5 {
        let (q, tau) = state(i as f64 * STEP);
        for j in 0..2 {
            assert!((r.q[j][i] - q[j]).abs() < 1e-9, "q{} at {i}", j + 1);
            assert!((r.tau[j][i] - tau[j]).abs() < 1e-9, "tau{} at {i}", j + 1);
        }
    }
    // a part, counted from the start
    let r = read(
        dir,
        &format!("log = \"log.txt\"\nfrom = 0.5\nto = 1.5\n{columns}"),
    )
    .unwrap();
    assert_eq!(r.len(), 101);
    assert!((r.q[0][0] - state(0.5).0[0]).abs() < 1e-9);
    // no time at all
    let rate = columns.replace("{ column = 1, unit = \"ms\" }", "{ rate = 100 }");
    assert_eq!(
        read(dir, &format!("log = \"log.txt\"\n{rate}"))
            .unwrap()
            .len(),
        COUNT
    );
    for (from, to, word) in [
        ("gear = [50, 1], sign", "gears = 3, sign", "columns.q.gears"),
        ("time =", "clock =", "columns.clock"),
        ("unit = \"ms\"", "units = \"ms\"", "columns.time.units"),
        ("[4, 5]", "[4]", "list of 1 numbers"),
        ("[4, 5]", "[4, 9]", "no column 9"),
        ("[4, 5]", "[4, \"x\"]", "no column `x`"),
        ("[4, 5]", "[4, 2]", "named twice"),
        ("sign = [1, -1]", "sign = [1, 2]", "1 or -1"),
        ("delay = 0.02", "delay = 20.0", "in seconds"),
        ("delay = 0.02", "unit = \"furlong\"", "furlong"),
        (
            "delay = 0.02",
            "without = [\"gravity\"]",
            "gravity = [0, 0, 0]",
        ),
        (
            "scale = [1, 0.5], sign = [1, -1], delay = 0.02",
            "unit = \"A\"",
            "motor currents",
        ),
    ] {
        let e = error(
            dir,
            &format!("log = \"log.txt\"\n{}", columns.replace(from, to)),
        );
        assert!(e.contains(word), "{word}: {e}");
    }
    for (entry, word) in [
        ("from = 1.5\nto = 0.5", "not before"),
        ("from = -1.0", "seconds from"),
        ("from = 50.0", "lie between"),
        ("form = \"csv\"", "form"),
        ("format = \"xls\"", "xls"),
    ] {
        let e = error(dir, &format!("log = \"log.txt\"\n{entry}\n{columns}"));
        assert!(e.contains(word), "{word}: {e}");
    }
}

/// Names that are not used are said to be so, and stamps of no known kind.
#[test]
fn names_that_are_not_used_are_named() {
    let dir = folder();
    let dir = dir.path();
    let row = |t: f64, q: [f64; 2], w: [f64; 2]| format!("{t},{},{},{},{}", q[0], q[1], w[0], w[1]);
    let columns = "log = \"log.txt\"\n[record.columns]\ntime = 1\nq = [2, 3]\ntau = [4, 5]";
    table(dir, "t,q1,q2,tau1\n", row);
    let r = read(dir, columns).unwrap();
    holds(&r, [0, 1], 1e-9, "a short header");
    let said = |r: &Record, word: &str| r.warnings.iter().any(|w| w.message.contains(word));
    assert!(said(&r, "4 names for 5 columns"), "{:?}", r.warnings);
    // a first row that is cut off hides no names
    table(dir, "t,q1,q2,tau1,tau2\n0.5,0.1\n", row);
    let r = read(dir, "log = \"log.txt\"").unwrap();
    holds(&r, [0, 1], 1e-9, "a short first row");
    table(dir, "t,q1,q2,tau1,tau2\n", |t, q, w| {
        format!("tick {t},{},{},{},{}", q[0], q[1], w[0], w[1])
    });
    let named = "log = \"log.txt\"\n[record.columns]\ntime = { rate = 100 }\nq = [\"q1\", \"q2\"]\ntau = [\"tau1\", \"tau2\"]";
    let r = read(dir, named).unwrap();
    assert!(said(&r, "called a time"), "{:?}", r.warnings);
    // text that has two letters of a binary format in the place of its mark
    let names = format!(
        "t,q1,q2,tau1,tau2,{}IM\n",
        "x".repeat(126 - "t,q1,q2,tau1,tau2,".len())
    );
    table(dir, &names, |t, q, w| format!("{},1", row(t, q, w)));
    let r = read(dir, "log = \"log.txt\"").unwrap();
    holds(&r, [0, 1], 1e-9, "IM at byte 126");
}

/// One file a quantity, on clocks of their own.
#[test]
fn files_with_a_quantity_each_are_one_record() {
    let dir = folder();
    let dir = dir.path();
    table(dir, "time,torque_1,torque_2\n", |t, _, w| {
        format!("{t},{},{}", w[0], w[1])
    });
    std::fs::rename(dir.join("log.txt"), dir.join("torques.csv")).unwrap();
    table(dir, "time,position_1,position_2\n", |t, q, _| {
        format!("{t},{},{}", q[0], q[1])
    });
    let r = read(dir, "log = [\"log.txt\", \"torques.csv\"]").unwrap();
    holds(&r, [0, 1], 1e-9, "two files");
    let e = error(dir, "log = \"log.txt\"");
    assert!(e.contains("no torques"), "{e}");
    // a column of one of them that is empty takes nothing away
    table(dir, "time,torque_1,torque_2,remark\n", |t, _, w| {
        format!("{},{},{},", t + 1e-4, w[0], w[1])
    });
    std::fs::rename(dir.join("log.txt"), dir.join("torques.csv")).unwrap();
    table(dir, "time,position_1,position_2\n", |t, q, _| {
        format!("{t},{},{}", q[0], q[1])
    });
    let r = read(dir, "log = [\"log.txt\", \"torques.csv\"]").unwrap();
    assert!(r.len() >= COUNT - 1, "{}", r.len());
}

/// A row for each joint is refused with what to do, and a text that changes from row to row is none.
#[test]
fn rows_of_one_joint_each_are_refused() {
    let dir = folder();
    let path = dir.path().join("long.csv");
    let table = |late: usize| {
        let mut text = String::from("time,joint,position\n");
        for i in 0..600 {
            let name = ["shoulder", "elbow", "wrist"][i % 3];
            let t = (i / 3 * 3 + i % 3 * late) as f64 * 1e-3;
            let _ = writeln!(text, "{t},{name},{}", (t * 3.0).sin());
        }
        text
    };
    let read = |text: String| {
        std::fs::write(&path, text).unwrap();
        excite::survey::survey(std::slice::from_ref(&path), None).map(|_| ())
    };
    let said = read(table(0)).unwrap_err().to_string();
    assert!(said.contains("shoulder,elbow,wrist in turn"), "{said}");
    assert!(said.contains("pivot"), "{said}");
    read(table(1)).unwrap();
}
