//! Files and motions that are refused.

use super::*;

/// The error of a file's text, which must hold all the words.
fn refused(toml: &str, words: &[&str]) {
    let message = match Mechanism::from_toml_str(toml, "robot.toml") {
        Ok(_) => panic!("accepted, but should say {words:?}"),
        Err(e) => e.to_string(),
    };
    println!("{message}");
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

#[test]
fn mistakes_are_named_with_their_line() {
    let hexapod = bundled::find("hexapod").unwrap().toml;
    let h4 = bundled::find("h4").unwrap().toml;
    let delta = bundled::find("delta").unwrap().toml;
    refused(
        &hexapod.replace("gough-stewart", "gough-steward"),
        &["no kind of mechanism", "did you mean `gough-stewart`"],
    );
    refused(
        &hexapod.replace("identical = true", "identcal = true"),
        &["line ", "identcal", "identical"],
    );
    refused(
        &hexapod.replace(
            "home = [0.0, 0.0, 0.80, 0.0, 0.0, 0.0]",
            "home = [0.0, 0.0, 0.8]",
        ),
        &["line 11", "home must be 6 finite numbers, here are 3"],
    );
    refused(
        &hexapod.replace("3.9802902047863906, 4.39729020478639]", "3.98]"),
        &["[legs] platform", "6 angles for 5 legs"],
    );
    refused(
        &hexapod.replace("mass = 30.0", "mass = -30.0"),
        &["line ", "[platform]", "mass = -30 kg"],
    );
    refused(
        &hexapod.replace(
            "axisymmetric = true",
            "axisymmetric = false\nspherical = true",
        ),
        &["6-SPS", "axisymmetric = true"],
    );
    refused(
        &h4.replacen("bar = 1", "bar = 3", 1),
        &["chain 1", "bar = 3 must be 1 or 2"],
    );
    // unreachable home, with the number that shows it
    refused(
        &delta.replace("home = [0.0, 0.0, -0.65]", "home = [0.0, 0.0, -1.2]"),
        &["home", "chain 1 does not reach", "1.20", "m"],
    );
    // a leg less: an actuator is missing
    let mut fewer = String::new();
    for (i, part) in h4.split("[[chain]]").enumerate() {
        match i {
            0 => fewer += part,
            4 => {}
            _ => fewer += &format!("[[chain]]{part}"),
        }
    }
    refused(&fewer, &["an H4 has 4 chains, this one has 3"]);
    let twice = "\n[[joint]]\nname = \"leg2_beta\"\nviscous = 0.1\n";
    refused(
        &format!("{hexapod}{twice}{twice}"),
        &["joint `leg2_beta`", "two [[joint]] entries"],
    );
    refused(
        &format!("{hexapod}\n[[joint]]\nname = \"leg7\"\n"),
        &["no joint `leg7`", "leg1"],
    );
    refused(
        &hexapod.replace("yaw = [-0.25, 0.25]", "theta = [-0.25, 0.25]"),
        &["[workspace]", "no coordinate theta", "yaw"],
    );
    // friction of a passive joint is a column of its own
    let with = format!("{hexapod}{twice}identify = [\"viscous\"]\n");
    let m = Mechanism::from_toml_str(&with, "robot.toml").unwrap();
    let known = |p: &excite::robot::parts::Parameter| p.name == "leg2_beta.viscous";
    assert!(m.parameters.list.iter().any(|p| known(p) && p.value == 0.1));
}

#[test]
fn singular_layouts_are_said() {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let h4 = bundled::find("h4").unwrap().toml;
    let layout = |azimuths: [f64; 4], bars: [u8; 4]| {
        let head = h4.split("[[chain]]").next().unwrap().to_string();
        let mut text = head;
        for (a, b) in azimuths.iter().zip(bars) {
            let at = |r: f64| format!("[{:?}, {:?}, 0.0]", r * a.cos(), r * a.sin());
            text += &format!(
                "[[chain]]\nbar = {b}\nazimuth = {a:?}\nmotor = {}\nattachment = {}\n",
                at(0.2),
                at(0.05)
            );
        }
        Mechanism::from_toml_str(&text, "h4.toml").unwrap().warnings
    };
    let first = layout([0.0, PI, FRAC_PI_2, 3.0 * FRAC_PI_2], [1, 1, 2, 2]);
    println!("{first:?}");
    assert!(
        first
            .iter()
            .any(|w| w.message.contains("singular at home: the actuators"))
    );
    let second = [1.0, 3.0, 5.0, 7.0].map(|k| k * FRAC_PI_4);
    let second = layout(second, [1, 1, 2, 2]);
    println!("{second:?}");
    assert!(
        second
            .iter()
            .any(|w| w.message.contains("singular at home: the passive joints"))
    );
}

#[test]
fn a_tree_is_asked_for_where_only_a_tree_will_do() {
    for (command, words) in [
        ("new scara", "neither a .urdf nor a .xacro file"),
        ("torque hexapot none.csv", "did you mean `hexapod`"),
    ] {
        let out = Command::cargo_bin("excite")
            .unwrap()
            .args(command.split(' '))
            .output()
            .unwrap();
        let text = String::from_utf8(out.stderr).unwrap();
        println!("{text}");
        assert!(!out.status.success());
        assert!(text.contains(words), "{text}");
    }
    let error = excite::Robot::load("hexapod").unwrap_err().to_string();
    assert!(error.contains("parallel robot"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.toml");
    std::fs::write(&path, bundled::find("delta").unwrap().toml).unwrap();
    let error = excite::Robot::load(path.to_str().unwrap()).unwrap_err();
    assert!(error.to_string().contains("parallel robot"), "{error}");
}

#[test]
fn motions_that_the_platform_cannot_do_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("motion.csv");
    let m = bundled::find("h4").unwrap().load().unwrap();
    let refused = |text: String, words: &[&str]| {
        std::fs::write(&file, text).unwrap();
        let error = m.read_motion(&file).unwrap_err().to_string();
        println!("{error}");
        words
            .iter()
            .for_each(|w| assert!(error.contains(w), "no `{w}` in: {error}"));
    };
    let mut tilted = vec![0.0; 19];
    (tilted[2], tilted[3], tilted[4]) = (-0.45, 0.1f64.cos(), 0.1f64.sin());
    refused(
        csv(POSE, std::iter::once(tilted.clone())),
        &["line 2", "x, y, z, theta only"],
    );
    tilted[3] = 3.0;
    refused(
        csv(POSE, std::iter::once(tilted)),
        &["line 2", "unit quaternion"],
    );
    refused("t,x,y,z\n0,0,0,0\n".into(), &["column theta", "missing"]);
    refused(
        "t,q1,dq1,ddq1\n0,0,0,0\n".into(),
        &["motion of a platform is needed"],
    );
    // out of reach: which sample and by how much
    let names = "x y z theta dx dy dz dtheta ddx ddy ddz ddtheta";
    let mut far = vec![0.0; 12];
    far[2] = -0.9;
    std::fs::write(&file, csv(names, std::iter::once(far))).unwrap();
    let (_, motion) = m.read_motion(&file).unwrap();
    let error = m.nominal_torque(&motion).unwrap_err().to_string();
    assert!(
        error.contains("sample 0") && error.contains("does not reach"),
        "{error}"
    );
}
