//! Loops that are read from files.

use super::*;

#[test]
fn a_five_bar_is_the_textbook_one() {
    let m = five_bar(POINT).unwrap();
    println!("{:?}", m.warnings);
    assert_eq!(
        (m.freedoms(), m.actuators(), m.source.name()),
        (2, 2, "loops")
    );
    assert_eq!(m.task_names, ["motor_left", "motor_right"]);
    // tip by the intersection of two circles
    let states = m.random_states(50, 2);
    let motion = m.motion(&states).unwrap();
    for s in 0..50 {
        let [a, b] = [0, 1].map(|k| states.q[k * 50 + s]);
        let p = [0.2 * a.cos(), 0.2 * a.sin()];
        let r = [0.15 + 0.2 * b.cos(), 0.2 * b.sin()];
        let (dx, dy) = (r[0] - p[0], r[1] - p[1]);
        let half = 0.5 * dx.hypot(dy);
        let up = (0.09 - half * half).sqrt();
        // above the line from left to right
        let tip = [
            0.5 * (p[0] + r[0]) - up * dy / (2.0 * half),
            0.5 * (p[1] + r[1]) + up * dx / (2.0 * half),
        ];
        let q = |j: usize| motion.tree.q[j * 50 + s];
        let angle = q(0) + q(1);
        let own = [p[0] + 0.3 * angle.cos(), p[1] + 0.3 * angle.sin()];
        assert!((own[0] - tip[0]).abs() + (own[1] - tip[1]).abs() < 1e-12);
    }
    // a weld at a pinned frame is the same linkage, with rows that are redundant
    let pose = five_bar(POSE).unwrap();
    let states = m.random_states(20, 3);
    let (a, b) = (
        m.nominal_torque(&states).unwrap(),
        pose.nominal_torque(&states).unwrap(),
    );
    assert!(relative(&a, &b) < 1e-11, "{}", relative(&a, &b));
    // power of the actuators is the change of energy, whoever of three does the work
    let redundant = five_bar(REDUNDANT).unwrap();
    let said = |w: &excite::Warning| w.message.contains("3 actuators for 2 freedoms");
    assert!(redundant.warnings.iter().any(said));
    let motion = redundant.motion(&states).unwrap();
    let c = redundant.nominal_torque(&states).unwrap();
    for s in 0..20 {
        let power = |tau: &[f64], rows: &[usize]| -> f64 {
            let each = rows.iter().enumerate();
            each.map(|(i, &j)| tau[i * 20 + s] * motion.tree.qd[j * 20 + s])
                .sum()
        };
        let (two, three) = (power(&a, &m.actuated), power(&c, &redundant.actuated));
        assert!(
            (two - three).abs() < 1e-9 * (1.0 + two.abs()),
            "{two} {three}"
        );
    }
}

#[test]
fn a_five_bar_is_designed_in_its_actuators() {
    let limits = "[actuator]\nacceleration = 60.0\njerk = 2000.0\n";
    let m = five_bar(&POINT.replace("[[loop]]", &format!("{limits}[[loop]]"))).unwrap();
    assert_eq!(m.space(), Space::Actuators);
    assert_eq!(m.in_actuators().unwrap().task_names, m.task_names);
    let settings = Settings::default().with(|set| {
        set.starts = Some(2);
        set.harmonics = 4;
        set.period = 3.0;
        set.condition = Condition::Normalised;
    });
    let design = design(&Plant::from(&m), &settings).unwrap();
    let t = &design.trajectory;
    assert_eq!(t.space, Some(Space::Actuators));
    // as for a serial robot: exact, forces excepted
    let c = m.certify(&t.fourier, 1.0).unwrap();
    assert!(c.satisfied && c.proven());
    let exact = certify(&m.actuator_robot(), &t.fourier).unwrap();
    for (a, b) in c.actuators.joints.iter().zip(&exact.joints) {
        assert_eq!((a.velocity, a.jerk), (b.velocity, b.jerk));
    }
    check_at_100_khz(&m, &t.fourier);
    let text = t.to_json().unwrap();
    assert!(text.contains("\"coordinates\": \"actuators\""));
    let plant = Plant::from(m);
    let read = Trajectory::parse(&text, "t.json").unwrap();
    let a = assess(&plant, Some(&read)).unwrap();
    let condition = a.excitation.unwrap().condition.normalised;
    println!("five-bar: condition number {condition:.1}");
    assert!(condition < 100.0, "{condition}");
    let e = plant.in_space(Some(Space::Platform)).unwrap_err();
    assert!(e.to_string().contains("has no platform"), "{e}");
}

#[test]
fn what_cannot_be_closed_is_said_with_numbers() {
    let refused = |rest: &str, urdf: &str, words: &[&str]| {
        let head = match rest.contains("lock") {
            true => HEAD.replace(", pin = 0.1", ""),
            false => HEAD.to_string(),
        };
        let toml = match rest.contains("mechanism") {
            true => rest.to_string(),
            false => format!("{head}{rest}"),
        };
        let message = match file(&toml, urdf) {
            Ok(_) => panic!("accepted, but should say {words:?}"),
            Err(e) => e.to_string(),
        };
        println!("{message}");
        for w in words {
            assert!(message.contains(w), "no `{w}` in: {message}");
        }
    };
    // too far apart to meet
    let far = URDF.replace("xyz=\"0.15 0 0\"/><axis", "xyz=\"1.5 0 0\"/><axis");
    assert_ne!(far, URDF);
    refused(
        POINT,
        &far,
        &[
            "cannot be closed",
            "left_end - right_end stays open by 1.",
            "m",
        ],
    );
    refused(
        &POINT.replace(", \"motor_right\"", ""),
        URDF,
        &["an actuator is missing: 2 freedoms (4 joints, closures of rank 2) but 1"],
    );
    refused(
        &POINT.replace("\"motor_right\"", "\"motor_left\""),
        URDF,
        &["line 6", "`motor_left` is listed twice"],
    );
    refused(
        &POINT.replace("\"motor_right\"", "\"motor_rite\""),
        URDF,
        &["no joint `motor_rite`", "did you mean `motor_right`"],
    );
    refused(
        &POINT.replace("\"right_end\"", "\"rigt_end\""),
        URDF,
        &["no link `rigt_end`", "did you mean `right_end`"],
    );
    refused(
        &POINT.replace("\"right_end\"", "\"left2\""),
        URDF,
        &["the same body"],
    );
    refused(
        &POINT.replace("\"position\"", "\"point\""),
        URDF,
        &["coincide = \"point\" must be"],
    );
    refused(
        &format!("{POINT}[[joint]]\nname = \"elbow_left\"\n[[joint]]\nname = \"elbow_left\"\n"),
        URDF,
        &["joint `elbow_left`", "two [[joint]] entries"],
    );
    refused(
        &POINT.replace("lock = { pin", "lock = { pim"),
        URDF,
        &["no joint `pim`", "did you mean `pin`"],
    );
    // with shorter links the elbows can be too far apart
    let head = HEAD.replace(", pin = 0.1", "");
    let short = URDF.replace("0.3 0 0", "0.22 0 0");
    let m = file(&format!("{head}{POINT}"), &short).unwrap();
    let x = [3.1, 0.1];
    let why = m.problem(&x).unwrap();
    println!("{why}");
    assert!(why.contains("cannot be followed further") && why.contains("singular value"));
}

#[test]
fn the_layout_of_example_parallel_robots_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let robot = folder.path().join("five_bar_3d");
    std::fs::create_dir(&robot).unwrap();
    // the pin as a ball, and a start near the closed configuration
    let near = URDF
        .replace(
            "<child link=\"left1\"/>",
            "<child link=\"left1\"/><origin rpy=\"0 0 2.2\"/>",
        )
        .replace("<origin xyz=\"0.2 0 0\"/><axis xyz=\"0 0 1\"/><limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"50\"/>\n", "<origin xyz=\"0.2 0 0\" rpy=\"0 0 -1.2\"/><axis xyz=\"0 0 1\"/><limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"50\"/>\n")
        .replace(
            "<origin xyz=\"0.15 0 0\"/><axis",
            "<origin xyz=\"0.15 0 0\" rpy=\"0 0 0.9\"/><axis",
        )
        .replace("<child link=\"right2\"/>\n <origin xyz=\"0.2 0 0\"/>", "<child link=\"right2\"/>\n <origin xyz=\"0.2 0 0\" rpy=\"0 0 1.2\"/>");
    std::fs::write(robot.join("robot.urdf"), near).unwrap();
    let write = |yaml: &str| std::fs::write(robot.join("robot.yaml"), yaml).unwrap();
    let load = |p: &Path| Mechanism::load(p.to_str().unwrap()).map(Option::unwrap);
    write(
        "closed_loop: [['tip', 'right_end']]\ntype: ['6d']\n\
         name_mot: ['motor_left', 'motor_right']\n\
         joint_name: ['pin']\njoint_type: ['SPHERICAL']\n",
    );
    let ball = load(&robot).unwrap();
    println!("{:?}\n{:?}", ball.robot.joint_names(), ball.warnings);
    assert_eq!(ball.robot.name, "five_bar_3d");
    assert_eq!((ball.freedoms(), ball.robot.dof()), (2, 7));
    assert!(ball.robot.joint_names().contains(&"pin_Y".to_string()));
    write(
        "closed_loop: [['left_end', 'right_end']]\ntype: ['3d']\n\
         name_mot: ['motor_left', 'motor_right']\njoint_name: ['pin']\njoint_type: ['FIXED']\n",
    );
    let point = load(&robot.join("robot.yaml")).unwrap();
    assert_eq!((point.freedoms(), point.robot.dof()), (2, 4));
    let x = point.random_states(10, 1);
    let (a, b) = (
        point.nominal_torque(&x).unwrap(),
        ball.nominal_torque(&x).unwrap(),
    );
    assert!(relative(&a, &b) < 1e-10, "{:e}", relative(&a, &b));
    write("closed_loop: [['left_end', 'nowhere']]\nname_mot: ['motor_left', 'motor_right']\n");
    let error = load(&robot).unwrap_err().to_string();
    assert!(error.contains("no link `nowhere`"), "{error}");
    write("closed_loop: [['left_end', 'right_end']]\ntype: ['3d']\nname_mot: ['motor_left']\n");
    let error = load(&robot).unwrap_err().to_string();
    assert!(
        error.contains("an actuator is missing: 3 freedoms"),
        "{error}"
    );
    std::fs::remove_file(robot.join("robot.urdf")).unwrap();
    assert!(
        load(&robot)
            .unwrap_err()
            .to_string()
            .contains("no URDF beside it")
    );
}

/// Other values written to a robot file and its URDF are the values that are read from them.
#[test]
fn an_identified_tree_with_loops_is_written_and_read() {
    use excite::export::mechanism;
    use excite::export::parts::Format;
    use excite::export::parts::Model;
    use excite::export::urdf::Urdf;
    use excite::plant::Plant;
    let frames = "lock = { pin = 0.0 }\nactuated = [\"motor_left\", \"motor_right\"]\n\
                  [[joint]]\nname = \"motor_left\"\nidentify = [\"armature\", \"coulomb\", \"offset\"]\n\
                  [[loop]]\nframes = [{ link = \"tip\", position = [0.01, 0, 0], rpy = [0.1, 0.2, 0.3] }, \
                  { link = \"right2\", position = [0.31, 0, 0], rpy = [0.1, 0.2, 0.3] }]\ncoincide = \"position\"\n";
    for rest in [POINT, POSE, REDUNDANT, frames] {
        let plant = Plant::from(five_bar(rest).unwrap());
        let mut phi = plant.values();
        let r = &mut rng(7);
        let bodies = 10 * plant.mechanism().unwrap().parameters.bodies.len();
        for body in phi[..bodies].chunks_exact_mut(10) {
            let f = r.random_range(0.8..1.2);
            body.iter_mut().for_each(|x| *x *= f);
        }
        phi[bodies..].iter_mut().for_each(|x| *x += 0.1);
        let m = plant.mechanism().unwrap();
        let tree = plant.with_values(&phi);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("robot.toml");
        let toml = mechanism::toml(m, &tree, "identified.urdf").unwrap();
        println!("{toml}");
        std::fs::write(&path, &toml).unwrap();
        let model = Model {
            plant: &plant,
            robot: &tree,
            remarks: &[],
        };
        let urdf = Urdf.write(&model).unwrap();
        std::fs::write(folder.path().join("identified.urdf"), urdf).unwrap();
        let again = Mechanism::load(path.to_str().unwrap()).unwrap().unwrap();
        assert_eq!(again.actuator_names(), m.actuator_names());
        assert_eq!(again.task_names, m.task_names);
        assert_eq!(again.parameters.list.len(), m.parameters.list.len());
        let off = relative(&again.home, &m.home);
        assert!(off < 1e-12, "{off}");
        for (a, b) in again.workspace.iter().zip(&m.workspace) {
            assert!((a.position[0] - b.position[0]).abs() < 1e-12, "{a:?} {b:?}");
        }
        let x = m.random_states(30, 5);
        let off = relative(
            &again.nominal_torque(&x).unwrap(),
            &plant.torque(&x, &phi).unwrap(),
        );
        assert!(off < 1e-9, "{rest}: {off:e}");
    }
}
