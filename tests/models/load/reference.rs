//! The published equations.

use super::*;

#[test]
fn the_published_equations_hold_for_the_reference_samples() {
    let Some(folder) = checks("skipped") else {
        return;
    };
    let text = std::fs::read_to_string(folder.join("load_two_step.json")).unwrap();
    let all: Value = serde_json::from_str(&text).unwrap();
    let text = std::fs::read_to_string(folder.join("sg_model.json")).unwrap();
    let model: Value = serde_json::from_str(&text).unwrap();
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    for name in ["single", "multi"] {
        let case = &all["exact"][name];
        let s = &case["sample"];
        let f = numbers(&s["f"]);
        let force: Vector3<f64> = (0..6).map(|j| vector(&s["s"][j]) * f[j]).sum();
        let rotation = matrix(&s["R"]);
        let moment: Vector3<f64> = (0..6)
            .map(|j| {
                let arm = rotation * vector(&model["legs"][j]["b"]);
                arm.cross(&(vector(&s["s"][j]) * f[j]))
            })
            .sum();
        let sample = PlatformSample {
            rotation,
            omega: vector(&s["w_L"]),
            alpha: vector(&s["wd_L"]),
            acceleration: vector(&s["a_P"]),
            force,
            moment,
            weight: 1.0,
        };
        let (phi, y) = sample.newton(&gravity);
        let r = vector(&case["r"]);
        let theta = nalgebra::Vector4::new(1.0 / case["m"].as_f64().unwrap(), r.x, r.y, r.z);
        assert!(
            (phi * theta - y).norm() < 1e-10,
            "{name}: {}",
            phi * theta - y
        );
        let jc = numbers(&case["JC"]);
        let (phi, y) = sample.euler(&r);
        let tensor = nalgebra::Vector6::from_column_slice(&jc);
        assert!((phi * tensor - y).norm() < 1e-10, "{name}");
        // total minus platform is the load, as the file states it
        let mut v = [0.0; 10];
        v[0] = case["m"].as_f64().unwrap();
        v[1..4].copy_from_slice(r.as_slice());
        v[4..].copy_from_slice(&jc);
        let total = Inertia::from_quantities(&v);
        let back = total.quantities();
        assert!(largest(&errors(&back, &v)) < 1e-9);
        let load = case["load_r"].as_array().unwrap();
        let lj = matrix(&case["load_JC"]);
        let load = Inertia::from_com(
            case["load_m"].as_f64().unwrap(),
            Vector3::from_iterator(load.iter().map(|x| x.as_f64().unwrap())),
            lj,
        );
        assert!(largest(&errors(&load.quantities(), &LOAD)) < 1e-8);
        // and the rest is a platform of 30 kg that can exist
        let platform = excite::load::body::difference(&total, &load);
        assert!((platform.mass() - 30.0).abs() < 1e-9);
        assert!(platform.realizability().0 > 0.0);
    }
}
