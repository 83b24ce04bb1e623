//! Volumes that a robot file states, and statements that make no sense.

use super::*;

#[test]
fn stated_volumes_stand_instead_of_the_geometry_of_their_link() {
    let more =
        "[[volume]]\nlink = \"upper\"\nkind = \"sphere\"\ncentre = [0.1, 0.0, 0.0]\nradius = 0.2\n";
    let robot = stated(&plain(), more);
    assert!((inside(&robot, "upper", &V::new(0.1, 0.0, 0.0)) + 0.2).abs() < 1e-12);
    assert!(inside(&robot, "upper", &V::new(0.4, 0.0, 0.0)) > 0.09);
    let origins = robot.geometry.volumes().links.iter().map(|v| v.origin);
    assert_eq!(
        origins.collect::<Vec<_>>(),
        [Origin::Urdf, Origin::Stated, Origin::Urdf]
    );
}

#[test]
fn statements_that_make_no_sense_are_refused_with_their_line() {
    let sphere = "[[volume]]\nlink = \"upper\"\nkind = \"sphere\"\n";
    let cases: Vec<(String, &[&str])> = vec![
        (
            sphere.replace("upper", "uper"),
            &["line 4", "`uper`", "`upper`"],
        ),
        (
            sphere.replace("sphere", "spere"),
            &["line 5", "`spere`", "sphere"],
        ),
        (
            format!("{sphere}centre = [0, 0, 0]\nradius = -0.1\n"),
            &["line 5", "radius", "upper"],
        ),
        (
            format!("{sphere}centre = [0, 0]\nradius = 0.1\n"),
            &["line 5", "centre"],
        ),
        (
            "[[volume]]\nkind = \"sphere\"\n".into(),
            &["line 4", "link"],
        ),
        (
            "[[volume]]\nlink = \"upper\"\nkind = \"box\"\nsize = [1, 0, 1]\n".into(),
            &["line 5", "size"],
        ),
        (
            "[[volume]]\nlink = \"upper\"\nkind = \"hull\"\npoints = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]\n".into(),
            &["line 5", "points", "plane"],
        ),
        (
            "[[volume]]\nlink = \"upper\"\nkind = \"box\"\nsize = [1, 1, 1]\npoints = [[0, 0, 0]]\n".into(),
            &["`points`", "hull"],
        ),
        (
            "[collision]\nmargin = 5\n".into(),
            &["line 4", "margin", "5"],
        ),
        (
            "[collision]\nmargin = nan\n".into(),
            &["line 4", "margin", "NaN"],
        ),
        (
            "[collision]\nignore = [[\"upper\"]]\n".into(),
            &["line 4", "pairs"],
        ),
        (
            "[collision]\nignore = [[\"base\", \"lowr\"]]\n".into(),
            &["line 4", "`lowr`", "`lower`"],
        ),
        (
            "[collision]\nflor = true\n".into(),
            &["line 4", "`flor`", "floor"],
        ),
        (
            "[[keep_in]]\nframe = \"lower\"\nlow = [0, 0, 1]\nhigh = [1, 1, 0]\n".into(),
            &["line 4", "low", "high"],
        ),
        (
            "[[keep_in]]\nframe = \"lower\"\nlow = [0, 0]\n".into(),
            &["line 4", "three numbers"],
        ),
        (
            "[[keep_in]]\nframe = \"wrist\"\n".into(),
            &["line 4", "`wrist`"],
        ),
        (
            "[[obstacle]]\nname = \"wall\"\nkind = \"plane\"\noffset = 1.0\n".into(),
            &["line 5", "`wall`", "normal"],
        ),
        (
            "[[obstacle]]\nkind = \"plane\"\nnormal = [0, 0, 0]\n".into(),
            &["line 4", "normal"],
        ),
        (
            "[[obstacle]]\nlink = \"upper\"\nkind = \"plane\"\nnormal = [0, 0, 1]\n".into(),
            &["line 4", "base frame"],
        ),
    ];
    for (more, words) in cases {
        let found = Robot::from_toml_str(&toml(&more), &plain(), "robot.toml");
        let message = found.err().unwrap_or_else(|| panic!("accepted: {more}"));
        let message = message.to_string();
        for word in words {
            assert!(message.contains(word), "no `{word}` in: {message}\n{more}");
        }
        assert!(
            !message.contains('\n') && message.contains("robot.toml"),
            "{message}"
        );
    }
}
