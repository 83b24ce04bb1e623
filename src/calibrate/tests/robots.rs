//! Robots whose errors are known, and a real one.

use super::*;

#[test]
fn a_serial_arm_seen_by_a_tracker_is_known_to_a_tenth_of_a_millimetre() {
    let opened = open("ur5e", None).unwrap();
    let tolerance = [0.001, 0.5f64.to_radians()];
    let c = made(
        &opened,
        Kind::Position,
        [5e-5, 1e-3],
        tolerance,
        [80, 60],
        5,
        0,
    );
    let (sound, found) = after(&opened, &c, Settings::default());
    assert!(sound.max < 1e-4, "{sound:?}");
    assert!(
        found.trials.iter().all(|t| !t.kept),
        "no effect of the joints was there"
    );
    // a fifth of the rows is far off: named, and survived
    let c = made(
        &opened,
        Kind::Position,
        [5e-5, 1e-3],
        tolerance,
        [80, 60],
        5,
        16,
    );
    let (survived, found) = after(&opened, &c, Settings::default());
    assert!(survived.max < 1.5e-4, "{survived:?}");
    for i in 0..16 {
        assert!(
            found.outliers.iter().any(|o| o.row == i),
            "row {i} is not named"
        );
    }
}

#[test]
fn an_h4_is_known_to_a_fraction_of_the_noise_of_its_camera() {
    let opened = open("h4", None).unwrap();
    let noise = |s: f64| [3e-4 * s, 0.02f64.to_radians() * s];
    let case = |s: f64| {
        made(
            &opened,
            Kind::Pose,
            noise(s),
            [0.002, 0.005],
            [45, 100],
            6,
            0,
        )
    };
    let published = Settings {
        orientation: false,
        ..Settings::default()
    };
    let (without, found) = after(&opened, &case(1.0), published);
    let [before, _] = found.errors(false, true);
    let before = Stats::of(&before).unwrap();
    assert!(
        without.median < 6e-4 && before.median > 1.5e-3,
        "the published algorithms, camera and target tilted as in closed form: {before:?} {without:?}"
    );
    let (with, found) = after(&opened, &case(1.0), Settings::default());
    assert!(
        with.rms < 1.1 * without.rms,
        "the orientation is no loss: {with:?} {without:?}"
    );
    assert!(
        with.rms < 6e-4 && [found.identifiability.rank, found.identifiability.total] == [36, 62]
    );
    let (little, _) = after(&opened, &case(1.0 / 6.0), Settings::default());
    assert!(
        little.rms < 0.35 * with.rms,
        "errors scale with the noise: {little:?} {with:?}"
    );
    for algorithm in [Algorithm::Implicit, Algorithm::Forward] {
        let settings = Settings {
            algorithm,
            orientation: true,
        };
        let (other, _) = after(&opened, &case(1.0), settings);
        assert!(
            other.rms < 1.5 * with.rms,
            "{algorithm:?}: {other:?} {with:?}"
        );
    }
}

#[test]
fn a_hexapod_is_known_to_the_noise() {
    let opened = open("hexapod", None).unwrap();
    let c = made(
        &opened,
        Kind::Pose,
        [3e-4, 0.02f64.to_radians()],
        [0.001, 0.001],
        [60, 60],
        8,
        0,
    );
    let (sound, _) = after(&opened, &c, Settings::default());
    assert!(sound.rms < 3e-4, "{sound:?}");
}

#[test]
fn chosen_postures_know_more_than_random_ones() {
    for name in ["h4", "ur5e"] {
        let opened = open(name, None).unwrap();
        let request = poses::Request {
            count: 20,
            kind: Kind::Pose,
            points: Vec::new(),
            grip: None,
            region: None,
            sight: None,
            std: [3e-4, 3.5e-4],
            tolerances: Tolerances::default(),
            candidates: 300,
            seed: 1,
        };
        let found = poses::choose(&opened, &request).unwrap();
        assert_eq!(found.postures.len(), 20);
        assert!(
            found.predicted < 0.9 * found.random_middle(),
            "{name}: {} {}",
            found.predicted,
            found.random_middle()
        );
        assert!(found.way[0] < found.way[1]);
        let again = poses::choose(&opened, &request).unwrap();
        assert_eq!(found.csv(), again.csv());
    }
}

/// A Panda with a ball in sockets, as recorded; skipped where the recording is not at hand.
#[test]
fn a_real_panda_and_its_spoiled_placement() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let named = std::env::var_os("EXCITE_SHARED").map(std::path::PathBuf::from);
    let places = ["../shared", "../../shared"].map(|p| root.join(p));
    let found = named
        .into_iter()
        .chain(places)
        .map(|p| p.join("data/mukca"))
        .find(|p| p.is_dir());
    let Some(data) = found else {
        eprintln!("skipped: ../shared/data/mukca is not there");
        return;
    };
    let data = data.canonicalize().unwrap();
    let data = data.display();
    let mut text = format!("robot = \"{data}/panda.urdf\"\nframe = \"ball_link\"\n");
    let fit = ["front_center", "back_left", "mid_left"];
    let rest = [
        "back_right",
        "front_left",
        "front_right",
        "high",
        "mid-high",
        "mid_right",
    ];
    for place in fit.iter().chain(&rest) {
        let purpose = if fit.contains(place) {
            "fit"
        } else {
            "holdout"
        };
        for hole in 0..2 {
            text += &format!(
                "[[measurement]]\nkind = \"point\"\nfile = \"{data}/panda_2/{place}/hole_{hole}.csv\"\n\
                 group = \"{place}\"\nuse = \"{purpose}\"\nstd = 0.0002\n"
            );
        }
        if fit.contains(place) {
            text += &format!(
                "[[distance]]\nbetween = [\"{data}/panda_2/{place}/hole_0.csv\", \
                 \"{data}/panda_2/{place}/hole_1.csv\"]\nvalue = 0.05\n"
            );
        }
    }
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("calibration.toml");
    std::fs::write(&file, text).unwrap();
    let (input, opened) = read(&file).unwrap();
    let found = calibrate(&input, &opened, Settings::default()).unwrap();
    let mean = |wanted: bool| {
        let own: Vec<f64> = found
            .groups
            .iter()
            .filter(|g| g.fit == wanted && !g.spoiled)
            .map(|g| g.after.unwrap().mean)
            .collect();
        own.iter().sum::<f64>() / own.len() as f64
    };
    for t in &found.trials {
        println!("{t:?}");
    }
    println!(
        "fit {:.4} mm, held out {:.4} mm",
        1e3 * mean(true),
        1e3 * mean(false)
    );
    assert!(mean(true) <= 0.20e-3, "{}", mean(true));
    assert!(mean(false) <= 0.29e-3, "{}", mean(false));
    let spoiled: Vec<&str> = found
        .groups
        .iter()
        .filter(|g| g.spoiled)
        .map(|g| g.name.as_str())
        .collect();
    assert_eq!(spoiled, ["high"]);
    let compliance = found
        .trials
        .iter()
        .find(|t| t.effect == "joint_compliance")
        .unwrap();
    assert!(compliance.kept && compliance.with < compliance.without);
    for (file, line) in [("back_left/hole_1.csv", 31), ("front_left/hole_1.csv", 23)] {
        assert!(
            found
                .outliers
                .iter()
                .any(|o| o.file.ends_with(file) && o.line == line),
            "{file}:{line}"
        );
    }
}

/// Where a camera with radial distortion sees a point; written down apart from the one that is tested.
fn pinhole(p: &Vector3<f64>) -> [f64; 2] {
    let (a, b) = (p.x / p.z, p.y / p.z);
    let stretch = 1.0 - 0.1 * (a * a + b * b);
    [1000.0 + 1500.0 * stretch * a, 600.0 + 1500.0 * stretch * b]
}

#[test]
fn an_h4_is_calibrated_from_the_pixels_of_its_pictures() {
    let opened = open("h4", None).unwrap();
    let exact = made(
        &opened,
        Kind::Pose,
        [0.0; 2],
        [0.002, 0.005],
        [45, 60],
        6,
        0,
    );
    let r = &mut ChaCha8Rng::seed_from_u64(3);
    // 9 × 7 corners of 20 mm
    let board: Vec<Vector3<f64>> = (0..63)
        .map(|k| Vector3::new(0.02 * f64::from(k % 9), 0.02 * f64::from(k / 9), 0.0))
        .collect();
    let n = opened.joints.len();
    let line = |cells: Vec<f64>| {
        let cells: Vec<String> = cells.iter().map(f64::to_string).collect();
        cells.join(",") + "\n"
    };
    let corners = (1..=board.len()).map(|k| format!("u{k},v{k}"));
    let joints: Vec<String> = (1..=n).map(|k| format!("q{k}")).collect();
    let mut pictures = format!(
        "{},{}\n",
        joints.join(","),
        corners.collect::<Vec<_>>().join(",")
    );
    let mut poses = format!("{},x,y,z,qw,qx,qy,qz\n", joints.join(","));
    for row in &exact.rows {
        let Value::Pose(seen) = row.value else {
            panic!()
        };
        let mut cells = row.q.clone();
        if row.fit {
            for x in &board {
                let u = pinhole(&(seen.r * x + seen.p));
                cells.extend(u.map(|v| v + 0.1 * normal(r)));
            }
            pictures += &line(cells);
        } else {
            let q = nalgebra::UnitQuaternion::from_matrix(&seen.r);
            cells.extend([seen.p.x, seen.p.y, seen.p.z, q.w, q.i, q.j, q.k]);
            poses += &line(cells);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let target: String = board.iter().map(|x| line(vec![x.x, x.y, x.z])).collect();
    write("target.csv", &format!("x,y,z\n{target}"));
    write("pictures.csv", &pictures);
    write("poses.csv", &poses);
    let text = "robot = \"h4\"\n[prior]\nlength = 0.002\nangle = 0.005\n[[measurement]]\nkind = \"pixels\"\nfile = \"pictures.csv\"\n\
                target = \"target.csv\"\ncamera = { fx = 1500, fy = 1500, cx = 1000, cy = 600, k1 = -0.1 }\nstd = 0.1\n\
                [[measurement]]\nkind = \"pose\"\nfile = \"poses.csv\"\nuse = \"holdout\"\nstd = 1e-5\nangle_std = 1e-5\n";
    let path = folder.path().join("calibration.toml");
    write("calibration.toml", text);
    let (c, opened) = read(&path).unwrap();
    assert!(c.warnings.is_empty(), "{:?}", c.warnings);
    let (stats, found) = after(&opened, &c, Settings::default());
    let [before, _] = found.errors(false, true);
    let before = Stats::of(&before).unwrap();
    // a tenth of a pixel is some hundredths of a millimetre at this distance
    assert!(
        stats.rms < 3e-4 && before.rms > 1e-3,
        "{before:?} {stats:?}"
    );
    println!("H4 from pixels: {before:?} {stats:?}");
    // what is wrong with the file is said
    for (from, to, what) in [
        ("target = \"target.csv\"\n", "", "needs camera"),
        ("fx = 1500", "fx = -1", "positive"),
        ("kind = \"pixels\"", "kind = \"pose\"", "are for kind"),
        ("std = 0.1", "std = 0.1\nangle_std = 0.1", "no angle_std"),
    ] {
        write("calibration.toml", &text.replacen(from, to, 1));
        let said = read(&path).map(|_| ()).unwrap_err().to_string();
        assert!(said.contains(what), "{said}");
    }
    // another camera does not fit any picture
    write("calibration.toml", &text.replace("fx = 1500", "fx = 300"));
    let said = match read(&path) {
        Err(e) => e.to_string(),
        Ok((c, _)) => format!("{:?}", c.warnings),
    };
    assert!(said.contains("pictures"), "{said}");
}
