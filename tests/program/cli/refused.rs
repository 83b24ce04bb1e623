//! Files and arguments that are refused, with their place and status.

use super::*;

#[test]
fn unusable_arguments_have_status_2() {
    let t = Test::new();
    for (line, words) in [
        ("design", &["ROBOT"][..]),
        ("design panda --period 0", &["period"]),
        ("design panda --period nan", &["period"]),
        ("design panda --harmonics 1", &["harmonics"]),
        ("design panda --harmonics -3", &["harmonics"]),
        ("design panda --derate 2", &["derate"]),
        ("design panda --rate 0", &["rate"]),
        ("design panda --rate 1e300", &["rate"]),
        ("design panda --starts 0", &["starts"]),
        ("design panda --time-limit -1", &["time limit"]),
        ("design panda --time-limit 1e999", &["time limit"]),
        ("design panda --grid even", &["grid"]),
        ("design panda --criterion f", &["criterion"]),
        ("design panda --start 1,2", &["posture", "7"]),
        ("design panda --start 9,0,0,-1,0,1,0", &["panda_joint1"]),
        ("design panda --identify friction", &["identify", "coulomb"]),
        ("design pandaa", &["pandaa", "panda"]),
        ("rehearse panda", &["rehearse"]),
    ] {
        t.fails(line, 2, words);
    }
    assert_eq!(
        std::fs::read_dir(t.path()).unwrap().count(),
        0,
        "nothing was written"
    );
}

#[test]
fn unusable_files_have_status_1_and_name_the_place() {
    let latin = [b"<robot name=\"", &[0xff, 0xfe, 0xe9][..], b"\"/>"].concat();
    let cut = &planar()[..planar().len() / 2];
    let chain: String = (0..300)
        .map(|i| {
            format!(
                "<link name=\"l{}\"/><joint name=\"j{i}\" type=\"revolute\"><parent link=\"l{i}\"/>\
                 <child link=\"l{}\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>",
                i + 1,
                i + 1
            )
        })
        .collect();
    let cycle = "<robot name=\"c\"><link name=\"a\"/><link name=\"b\"/>\
        <joint name=\"x\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
        <joint name=\"y\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>";
    let t = Test::new()
        .file("latin.urdf", latin)
        .file("cut.urdf", cut)
        .file(
            "long.urdf",
            format!("<robot name=\"l\"><link name=\"l0\"/>{chain}</robot>"),
        )
        .file("cycle.urdf", cycle)
        .file("empty.urdf", "")
        .file("arm.urdf", planar())
        .file("key.toml", "urdf = \"arm.urdf\"\nspeed = 3\n")
        .file(
            "joint.toml",
            "urdf = \"arm.urdf\"\n[[joint]]\nname = \"elbow\"\n",
        )
        .file(
            "negative.toml",
            "urdf = \"arm.urdf\"\n[[joint]]\nname = \"joint1\"\nvelocity = -1.0\n",
        )
        .file(
            "nan.toml",
            "urdf = \"arm.urdf\"\n[[joint]]\nname = \"joint1\"\nvelocity = nan\n",
        )
        .file("none.toml", "urdf = \"nowhere.urdf\"\n")
        .file("bad.json", "{\"format\": \"excite-trajectory\"")
        .file(
            "ragged.csv",
            "t,q1,q2,dq1,dq2,ddq1,ddq2\n0,0,0,0,0,0,0\n0.1,0,0\n",
        )
        .file("nan.csv", "t,q1,q2,dq1,dq2,ddq1,ddq2\n0,0,NaN,0,0,0,0\n")
        .file("missing.csv", "t,q1,dq1,dq2,ddq1,ddq2\n0,0,0,0,0,0\n");
    for (line, words) in [
        ("design latin.urdf", &["latin.urdf", "UTF-8"][..]),
        ("design cut.urdf", &["cut.urdf"]),
        ("design long.urdf", &["long.urdf", "128"]),
        ("design cycle.urdf", &["cycle.urdf"]),
        ("design empty.urdf", &["empty.urdf"]),
        ("design nowhere.urdf", &["nowhere.urdf"]),
        ("design key.toml", &["key.toml", "speed"]),
        ("design joint.toml", &["joint.toml", "elbow", "joint1"]),
        ("design negative.toml", &["negative.toml", "velocity"]),
        ("design nan.toml", &["nan.toml", "velocity"]),
        ("design none.toml", &["nowhere.urdf"]),
        ("identifiability arm.urdf bad.json", &["bad.json"]),
        ("identifiability arm.urdf nowhere.json", &["nowhere.json"]),
        ("torque arm.urdf ragged.csv", &["ragged.csv", "3"]),
        ("torque arm.urdf nan.csv", &["nan.csv", "q2"]),
        ("torque arm.urdf missing.csv", &["missing.csv", "q2"]),
        ("torque arm.urdf nowhere.csv", &["nowhere.csv"]),
    ] {
        t.fails(line, 1, words);
    }
    assert!(!t.path().join("out").exists(), "nothing was written");
}

/// A trajectory of another robot is refused.
#[test]
fn trajectory_of_another_robot() {
    let t = Test::new();
    assert_eq!(t.run("design planar2 --starts 1 --output p").status, 0);
    t.fails(
        "identifiability panda p/trajectory.json --output q",
        1,
        &["p/trajectory.json"],
    );
}

/// Damaged copies of a good trajectory end in a message, never in a panic.
#[test]
fn damaged_trajectories_are_refused() {
    let t = Test::new();
    assert_eq!(t.run("design planar2 --starts 1 --output p").status, 0);
    let good = std::fs::read_to_string(t.path().join("p/trajectory.json")).unwrap();
    for cut in (0..good.len()).step_by(good.len() / 12 + 1) {
        std::fs::write(t.path().join("cut.json"), &good[..cut]).unwrap();
        t.fails("identifiability planar2 cut.json", 1, &["cut.json"]);
    }
    for (from, to) in [
        ("\"period\": 10.0", "\"period\": -1.0"),
        ("\"version\": 1", "\"version\": 99"),
        ("\"harmonics\": [", "\"harmonics\": [0, "),
        ("joint1", "joint9"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from} stands in the file");
        std::fs::write(t.path().join("bad.json"), bad).unwrap();
        t.fails("identifiability planar2 bad.json", 1, &["bad.json"]);
    }
}

#[test]
fn questions_that_mean_nothing_have_status_2() {
    let t = Test::new();
    t.fails(
        "design planar2 --for platform",
        2,
        &["--for platform", "no parallel robot"],
    );
    t.fails(
        "design planar2 --for legs",
        2,
        &["--for legs", "no parallel robot"],
    );
    t.fails(
        "design planar2 --for friction --payload 1,0,0,0",
        2,
        &["--for load"],
    );
    t.fails("design planar2 --payload 1,0,0,0", 2, &["--for load"]);
    t.fails(
        "design planar2 --for load --payload -1,0,0,0",
        2,
        &["--payload"],
    );
    t.fails(
        "design planar2 --for load --criterion d",
        2,
        &["--criterion"],
    );
    t.fails("design planar2 --for wings", 2, &["load"]);
}
