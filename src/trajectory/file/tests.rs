use super::*;
use proptest::prelude::*;

fn example(coefficients: &[f64]) -> Trajectory {
    let series = Series::from_coefficients;
    Trajectory {
        robot: "two \"quoted\" links".into(),
        robot_hash: "ab12".into(),
        joints: vec!["a".into(), "b".into()],
        kind: Kind::Fourier,
        space: Some(Space::Actuators),
        fourier: Fourier {
            period: 0.1 + 0.2,
            harmonics: vec![1, 3],
            joints: vec![series(&coefficients[..5]), series(&coefficients[5..10])],
        },
        periods: 3,
        ends: Ends::Free,
        grid: Grid::Odd,
        settings: serde_json::json!({ "criterion": "d", "seed": 7, "derate": 0.9 }),
        excite_version: "0.1.0".into(),
    }
}

proptest! {
    #[test]
    fn round_trip_is_exact(c in proptest::collection::vec(proptest::num::f64::NORMAL
        | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO, 10)) {
        let written = example(&c);
        let read = Trajectory::parse(&written.to_json().unwrap(), "t.json").unwrap();
        for (a, b) in written.fourier.joints.iter().zip(&read.fourier.joints) {
            let bits = |s: &Series| s.coefficients().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(a), bits(b));
        }
        prop_assert_eq!(written, read);
    }

    #[test]
    fn no_text_makes_it_panic(cut in 0usize..900, at in 0usize..900, byte in 0u8..128) {
        let text = example(&[0.25; 10]).to_json().unwrap();
        let _ = Trajectory::parse(&text[..cut.min(text.len())], "t.json");
        let mut bytes = text.into_bytes();
        let at = at.min(bytes.len() - 1);
        bytes[at] = byte;
        if let Ok(text) = String::from_utf8(bytes)
            && let Err(e) = Trajectory::parse(&text, "t.json")
        {
            prop_assert!(e.to_string().starts_with("t.json: "));
        }
    }
}

#[test]
fn through_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("trajectory.json");
    let written = example(&[0.1; 10]);
    written.write(&path, false).unwrap();
    assert_eq!(Trajectory::read(&path).unwrap(), written);
    assert!(matches!(written.write(&path, false), Err(Error::Exists(_))));
    let missing = Trajectory::read(dir.path().join("none.json")).unwrap_err();
    assert!(missing.to_string().contains("none.json"));
    assert!((written.duration() - 0.9).abs() < 1e-15);
}

#[test]
fn faults_name_file_and_place() {
    let text = example(&[0.5; 10]).to_json().unwrap();
    let fault = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let text = text.replacen(from, to, 1);
        Trajectory::parse(&text, "some/t.json")
            .unwrap_err()
            .to_string()
    };
    let cases = [
        ("excite-trajectory", "other", "format: is not a trajectory"),
        (
            "\"version\": 1",
            "\"version\": 2",
            "version: version 2 is not known",
        ),
        ("\"version\": 1,", "", "version: is missing"),
        ("0.5", "1e999", "column"),
        ("0.5", "null", "line"),
        ("0.5", "0.5, 0.5", "line"),
        (
            "\"harmonics\": [\n    1,",
            "\"harmonics\": [",
            "coefficients[0].sin: 2 values",
        ),
        (
            "\"harmonics\": [\n    1,",
            "\"harmonics\": [\n    3,",
            "harmonics[1]: 3 found",
        ),
        (
            "\"harmonics\": [\n    1,",
            "\"harmonics\": [\n    -1,",
            "line",
        ),
        (
            "\"harmonics\": [\n    1,",
            "\"harmonics\": [\n    0,",
            "harmonics[0]: 0 found",
        ),
        (
            "\"periods\": 3",
            "\"periods\": 0",
            "periods: must be at least 1",
        ),
        (
            "\"period\": 0.30000000000000004",
            "\"period\": 0.0",
            "period: must be a positive",
        ),
        (
            "\"a\",\n    \"b\"",
            "\"b\",\n    \"b\"",
            "joints[1]: \"b\" is there twice",
        ),
        (
            "\"a\",\n    \"b\"",
            "\"a\"",
            "coefficients: 2 entries, but there are 1 joints",
        ),
        (
            "\"joint\": \"b\"",
            "\"joint\": \"c\"",
            "coefficients[1].joint: \"c\" found",
        ),
        ("\"fourier\"", "\"spline\"", "unknown variant"),
        ("\"robot\"", "\"rob\"", "missing field `robot`"),
        (
            "\"robot\":",
            "\"robot\": \"x\", \"robot\":",
            "duplicate field `robot`",
        ),
    ];
    for (from, to, want) in cases {
        let message = fault(from, to);
        assert!(
            message.starts_with("some/t.json: ") && message.contains(want),
            "{message}"
        );
    }
}

#[test]
fn what_cannot_be_read_back_is_not_written() {
    let mut t = example(&[0.5; 10]);
    t.fourier.joints[1].sin[0] = f64::NAN;
    let message = t.to_json().unwrap_err().to_string();
    assert!(message.contains("coefficients[1].sin[0]"), "{message}");
    let mut t = example(&[0.5; 10]);
    t.joints.pop();
    assert!(t.to_json().unwrap_err().is_argument());
}
