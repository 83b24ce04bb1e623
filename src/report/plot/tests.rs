use super::*;

fn well_formed(svg: &str) {
    let document = roxmltree::Document::parse(svg).expect("well-formed SVG");
    for node in document.descendants().filter(|n| n.is_element()) {
        for name in [
            "x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "width", "height",
        ] {
            if let Some(value) = node.attribute(name) {
                let value: f64 = value.parse().expect("a number");
                assert!(value >= 0.0 && value.is_finite(), "{name} = {value}");
            }
        }
    }
}

fn wave(count: usize) -> Vec<[f64; 2]> {
    (0..count)
        .map(|i| i as f64 / count as f64)
        .map(|t| [t, (6.0 * t).sin()])
        .collect()
}

fn one(panel: Panel) -> String {
    time_series(
        "test",
        vec!["row".into()],
        vec!["column".into()],
        vec![panel],
    )
}

fn texts(svg: &str) -> Vec<String> {
    roxmltree::Document::parse(svg)
        .expect("well-formed SVG")
        .descendants()
        .filter(|n| n.has_tag_name("text"))
        .map(|n| n.text().unwrap_or("").trim().to_string())
        .collect()
}

#[test]
fn a_figure_shows_its_texts_limits_and_markers() {
    let svg = one(Panel {
        note: "95 %".into(),
        x: Axis::linear("time, s"),
        y: Axis::linear("rad"),
        limits: [Some(-1.05), Some(1.05)],
        series: vec![Series::line(wave(100), Colour::BLUE)],
        markers: vec![Marker {
            at: [0.26, 1.0],
            colour: Colour::INK,
            label: "peak".into(),
        }],
        ..Panel::default()
    });
    well_formed(&svg);
    let texts = texts(&svg);
    for expected in ["row", "column", "95 %", "time, s", "rad", "peak", "0.5"] {
        assert!(texts.iter().any(|t| t == expected), "{expected}: {texts:?}");
    }
    let limits = svg
        .matches(&Colour::VERMILLION.css().to_uppercase())
        .count();
    assert_eq!(limits, 4, "two lines and two shades");
}

#[test]
fn a_far_limit_does_not_flatten_the_curve() {
    let svg = one(Panel {
        limits: [Some(-100.0), Some(100.0)],
        series: vec![Series::line(wave(100), Colour::BLUE)],
        ..Panel::default()
    });
    assert!(!svg.contains(&Colour::VERMILLION.css().to_uppercase()));
}

#[test]
fn names_are_escaped() {
    let svg = time_series(
        "a < b & \"c\"",
        vec!["<j1> & \u{1}".into()],
        vec!["<b>".into()],
        vec![Panel::default()],
    );
    well_formed(&svg);
    assert!(!svg.contains("<b>") && !svg.contains("<j1>"));
    let bars = bars("<d>", 800.0, &["<i>".into()], &["&".into()], &[]);
    well_formed(&bars);
    assert!(!bars.contains("<i>") && !bars.contains("<d>"));
}

#[test]
fn numbers_that_are_not_finite_leave_gaps() {
    let bad = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1e300,
        -1e300,
        0.0,
    ];
    let mut points = wave(50);
    points[10][1] = f64::NAN;
    points[20] = [f64::INFINITY, f64::NEG_INFINITY];
    let svg = one(Panel {
        series: vec![Series::line(points, Colour::BLUE)],
        ..Panel::default()
    });
    well_formed(&svg);
    assert_eq!(svg.matches(&Colour::BLUE.css().to_uppercase()).count(), 3);
    for x in bad {
        for y in bad {
            for axis in [Axis::linear(""), Axis::log(""), Axis::whole("")] {
                well_formed(&one(Panel {
                    x: axis.clone(),
                    y: Axis {
                        range: Some([x, y]),
                        ..axis
                    },
                    limits: [Some(x), Some(y)],
                    series: vec![Series::line(vec![[x, y], [y, x]], Colour::BLUE)],
                    rules: vec![Rule {
                        at: x,
                        upright: y > 0.0,
                        colour: Colour::GREY,
                        label: String::new(),
                    }],
                    markers: vec![Marker {
                        at: [x, y],
                        colour: Colour::INK,
                        label: "m".into(),
                    }],
                    ..Panel::default()
                }));
            }
            let bar = Bar {
                value: x,
                more: y,
                alarm: false,
            };
            well_formed(&bars(
                "",
                800.0,
                &["a".into()],
                &["b".into()],
                &[vec![Some(bar)]],
            ));
        }
    }
    well_formed(&one(singular_values("", "", &bad, 3)));
    well_formed(&one(history("", &[(0, &bad), (1, &[]), (2, &[3.0])], 1)));
}

#[test]
fn much_data_makes_no_large_figure() {
    let panels = (0..240)
        .map(|_| Panel {
            series: vec![Series::line(wave(20_000), Colour::BLUE)],
            ..Panel::default()
        })
        .collect();
    let columns = vec![String::new(); 4];
    let svg = time_series("", vec!["j".into(); 60], columns, panels);
    well_formed(&svg);
    assert!(svg.len() < 1_500_000, "{}", svg.len());
}

#[test]
fn rank_and_best_start_are_marked() {
    let svg = one(singular_values("", "", &[1.0, 0.1, 1e-14, 1e-15], 2));
    assert!(texts(&svg).contains(&"rank 2".to_string()));
    let svg = one(singular_values("", "", &[1.0, 0.1], 2));
    assert!(!texts(&svg).iter().any(|t| t.contains("rank")));
    let svg = one(history("", &[(0, &[9.0, 7.0]), (3, &[8.0, 6.4321])], 3));
    assert!(texts(&svg).contains(&"6.432".to_string()));
}

#[test]
fn the_bar_beyond_its_reference_stands_out() {
    let draw = |value| {
        let bar = Bar {
            value,
            ..Bar::default()
        };
        bars(
            "",
            800.0,
            &["a".into()],
            &["b".into()],
            &[vec![Some(bar), None]],
        )
    };
    let red = Colour::VERMILLION.css().to_uppercase();
    assert!(!draw(0.999).contains(&red));
    assert!(draw(1.2).contains(&red));
    assert!(texts(&draw(1.2)).contains(&"120.0\u{a0}%".to_string()));
}
