use super::dae;
use crate::solid::mesh::Mesh;

/// A unit square as a polylist, and a triangle of a second geometry, placed as `scene` says.
fn file(scene: &str, unit: &str) -> String {
    format!(
        r##"<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>{unit}<up_axis>Y_UP</up_axis></asset>
<library_geometries>
 <geometry id="square"><mesh>
  <source id="s"><float_array id="a" count="16">9 0 0 0  9 1 0 0  9 1 1 0  9 0 1 0</float_array>
   <technique_common><accessor source="#a" count="4" offset="1" stride="4"/></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
  <polylist count="1"><input semantic="NORMAL" source="#s" offset="0"/>
   <input semantic="VERTEX" source="#v" offset="1"/><vcount>4</vcount><p>9 0 9 1 9 2 9 3</p></polylist>
 </mesh></geometry>
 <geometry id="corner"><mesh>
  <source id="s2"><float_array id="a2" count="9">0 0 0 1 0 0 0 0 1</float_array></source>
  <vertices id="v2"><input semantic="POSITION" source="#s2"/></vertices>
  <triangles count="1"><input semantic="VERTEX" source="#v2" offset="0"/><p>0 1 2</p></triangles>
 </mesh></geometry>
</library_geometries>
<library_nodes><node id="again"><translate>0 0 5</translate><instance_geometry url="#corner"/></node></library_nodes>
<library_visual_scenes><visual_scene id="scene">{scene}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>"##
    )
}

fn corners(mesh: &Mesh) -> Vec<[f64; 3]> {
    let all = mesh.triangles.iter().flatten();
    all.map(|i| mesh.points[*i].map(|x| (x * 1e9).round() / 1e9).into())
        .collect()
}

#[test]
fn every_place_of_a_geometry_counts_with_all_transforms_above_it() {
    // turned by 90° about z, then moved along x: the point (1, 0, 0) goes to (10, 1, 0)
    let scene = r##"<node id="n"><translate>10 0 0</translate>
      <node><rotate>0 0 2 90</rotate><instance_geometry url="#square"/></node>
      <node><matrix>1 0 0 0  0 1 0 2  0 0 1 0  0 0 0 1</matrix><scale>1 3 1</scale>
        <instance_geometry url="#square"/></node>
      <instance_node url="#again"/></node>"##;
    let mesh = dae(file(scene, r#"<unit meter="0.01" name="cm"/>"#).as_bytes()).expect("a mesh");
    let expected = [
        // the square, turned
        [0.10, 0.0, 0.0],
        [0.10, 0.01, 0.0],
        [0.09, 0.01, 0.0],
        [0.10, 0.0, 0.0],
        [0.09, 0.01, 0.0],
        [0.09, 0.0, 0.0],
        // moved and stretched
        [0.10, 0.02, 0.0],
        [0.11, 0.02, 0.0],
        [0.11, 0.05, 0.0],
        [0.10, 0.02, 0.0],
        [0.11, 0.05, 0.0],
        [0.10, 0.05, 0.0],
        // the node of the library
        [0.10, 0.0, 0.05],
        [0.11, 0.0, 0.05],
        [0.10, 0.0, 0.06],
    ];
    assert_eq!(corners(&mesh), expected);
}

#[test]
fn what_would_hide_a_part_is_an_error_that_names_it() {
    let one = r##"<node id="n"><instance_geometry url="#square"/></node>"##;
    for (scene, from, to, word) in [
        (one, "vcount>4", "vcount>5", "fewer corners"),
        (one, "9 0 9 1 9 2 9 3", "9 0 9 1 9 2 9 4", "no point 4"),
        (one, "9 0 9 1 9 2 9 3", "9 0 9 1 9 2 9", "without its index"),
        (one, "9 0 9 1 9 2 9 3", "9 0 9 1 9 2 9 x", "no index"),
        (one, "9 1 0 0", "9 1 0 zero", "float_array `a`"),
        (one, "9 1 0 0", "9 1 0 nan", "not finite"),
        (one, "stride=\"4\"", "stride=\"2\"", "no points in space"),
        (one, "#square\"", "#circle\"", "`#circle`"),
        (one, "instance_geometry", "instance_controller", "bones"),
        (one, "</COLLADA>", "", "no XML"),
        (
            one,
            "<node id=\"n\">",
            "<node id=\"n\"><skew>0 0 1 0 1 0 0</skew>",
            "skew",
        ),
        (
            one,
            "<node id=\"n\">",
            "<node id=\"n\"><translate>1 2</translate>",
            "3 numbers",
        ),
        (
            one,
            "<node id=\"n\">",
            "<node id=\"n\"><instance_node url=\"#n\"/>",
            "places itself",
        ),
        (one, "<asset>", "<asset><unit meter=\"-1\"/>", "no length"),
    ] {
        let text = file(scene, "").replace(from, to);
        let error = dae(text.as_bytes()).expect_err(word);
        assert!(error.contains(word), "{error} does not say {word}");
    }
    assert!(dae(&[0xff, 0xfe]).unwrap_err().contains("UTF-8"));
    assert!(dae(b"<robot/>").unwrap_err().contains("robot"));
}
