//! Volumes that are fitted to meshes.

use super::*;

#[test]
fn a_fit_holds_every_corner_and_is_tight() {
    // a drum of 24 sides, 0.1 m radius, 0.4 m long, turned away from the axes
    let turn = Rotation3::new(V::new(0.4, -0.3, 0.8));
    let mut m = mesh::Mesh::default();
    for z in [-0.2, 0.2] {
        for k in 0..24 {
            let a = f64::from(k) * std::f64::consts::TAU / 24.0;
            m.points
                .push(turn * V::new(0.1 * a.cos(), 0.1 * a.sin(), z));
        }
    }
    for k in 0..24 {
        let n = (k + 1) % 24;
        m.triangles.extend([[k, n, 24 + k], [n, 24 + n, 24 + k]]);
    }
    for k in 1..23 {
        m.triangles.extend([[0, k + 1, k], [24, 24 + k, 25 + k]]);
    }
    assert!(m.closed());
    let h = hull::hull(&m.points).expect("a volume");
    let area = 12.0 * 0.01 * (std::f64::consts::TAU / 24.0).sin();
    assert!((h.volume - area * 0.4).abs() < 1e-9, "{}", h.volume);
    let f = fit::fit(&m, 4, 1.6);
    for p in &m.points {
        assert!(f.shapes.iter().any(|s| s.signed_distance(p) <= 0.0));
    }
    assert!(f.volume < 1.7 * f.hull, "{}", f.volume / f.hull);
}

/// Corners of fine meshes lie in a plane up to the rounding of the file.
#[test]
fn hulls_of_finely_meshed_flats_are_sound() {
    let mut r = Random(5);
    for k in 0..40 {
        let turn = r.pose(0.1);
        let round = |p: V| turn.apply(&p).map(|x| f64::from(x as f32));
        let steps = 6 + k % 12;
        let grid = |i: usize| 2.0 * i as f64 / steps as f64 - 1.0;
        let half = V::new(0.1, 0.07, 0.15);
        let mut points = Vec::new();
        for (a, b) in (0..=steps).flat_map(|a| (0..=steps).map(move |b| (a, b))) {
            for (axis, side) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
                let mut p = V::zeros();
                p[axis] = side;
                p[(axis + 1) % 3] = grid(a);
                p[(axis + 2) % 3] = grid(b);
                points.push(round(p.component_mul(&half)));
            }
        }
        let h = hull::hull(&points).expect("a volume");
        let volume = 8.0 * half.x * half.y * half.z;
        assert!((h.volume / volume - 1.0).abs() < 1e-4, "{k}: {}", h.volume);
        // the corners of the box are corners of the hull
        for sign in 0..8 {
            let side = |bit: usize| if sign >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let corner = round(V::new(side(0) * half.x, side(1) * half.y, side(2) * half.z));
            let near = |i: &usize| (points[*i] - corner).norm() < 1e-5;
            assert!(h.corners.iter().any(near), "{k} {sign}");
        }
    }
}

/// The plane across the normal parts the two by exactly the distance: no two points of them can be nearer.
#[test]
fn distances_of_hulls_are_certified_by_a_plane() {
    let mut r = Random(23);
    let (mut apart, mut met) = (0, 0);
    for k in 0..20_000 {
        let (a, b) = (r.shape(3), r.shape(k % 4));
        let (pa, pb) = (r.pose(0.25), r.pose(0.25));
        for (a, pa, b, pb) in [(&a, &pa, &b, &pb), (&b, &pb, &a, &pa)] {
            let s = separation(a, pa, b, pb);
            let gap = b.extent(pb, &s.normal)[0] - a.extent(pa, &s.normal)[1];
            let rounded = a.radius() + b.radius();
            if s.distance + rounded > 1e-6 {
                apart += 1;
                assert!((gap - s.distance).abs() < 1e-9, "{k}: {} {gap}", s.distance);
                assert!((s.on_second - s.on_first - s.normal * s.distance).norm() < 1e-9);
                for (shape, at, p) in [(a, pa, s.on_first), (b, pb, s.on_second)] {
                    let local = at.rotation.transpose() * (p - at.position);
                    assert!(shape.signed_distance(&local).abs() < 1e-8, "{k}");
                }
            } else if s.distance + rounded < -1e-6 {
                met += 1;
                // the depth stated is enough to part them
                assert!((gap - s.distance).abs() < 1e-9, "{k}: {} {gap}", s.distance);
                let away = Pose {
                    position: pb.position + s.normal * (1e-6 - s.distance),
                    ..*pb
                };
                let after = separation(a, pa, b, &away).distance;
                assert!(after >= -1e-9, "{k}: {after}");
            }
        }
    }
    assert!(apart > 5000 && met > 2000, "{apart} {met}");
}

/// A prism of 48 sides about a cylinder of radius 0.1 m along z, 0.3 m long.
fn drum() -> mesh::Mesh {
    let mut m = mesh::Mesh::default();
    for z in [-0.15, 0.15] {
        for k in 0..48 {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / 48.0).sin_cos();
            m.points.push(V::new(0.1 * c, 0.1 * s, z));
        }
    }
    for k in 0..48 {
        let n = (k + 1) % 48;
        m.triangles
            .extend([[k, n, 48 + k], [n, 48 + n, 48 + k], [0, n, k]]);
        m.triangles.push([48, 48 + k, 48 + n]);
    }
    m
}

#[test]
fn hulls_hold_a_mesh_and_lie_close_to_it() {
    let drum = drum();
    let one = hulls::hulls(&drum, 1);
    assert_eq!(one.shapes.len(), 1);
    // a capsule about it reaches far beyond the flat ends
    assert!(one.volume < 1.1 * one.hull, "{}", one.volume / one.hull);
    assert!(one.protrusion < 3e-3, "{}", one.protrusion);
    assert!(fit::fit(&drum, 1, 1.0).protrusion > 5.0 * one.protrusion);
    // a cross of two drums is hollow between its arms
    let mut cross = drum.clone();
    let turned = drum.points.iter().map(|p| V::new(p.z * 3.0, p.y, p.x));
    cross.points.extend(turned);
    let moved = drum.triangles.iter().map(|t| t.map(|i| i + 96));
    cross.triangles.extend(moved);
    let (one, more) = (hulls::hulls(&cross, 1), hulls::hulls(&cross, 6));
    assert!(more.shapes.len() > 1 && more.volume < 0.85 * one.volume);
    for (mesh, found) in [
        (&drum, &hulls::hulls(&drum, 1)),
        (&cross, &one),
        (&cross, &more),
    ] {
        for t in &mesh.triangles {
            let middle = t.iter().map(|i| mesh.points[*i]).sum::<V>() / 3.0;
            for p in t.iter().map(|i| mesh.points[*i]).chain([middle]) {
                let nearest = found.shapes.iter().map(|s| s.signed_distance(&p));
                assert!(nearest.fold(f64::INFINITY, f64::min) <= 1e-12);
            }
        }
    }
}

#[test]
fn meshes_are_read_and_refused() {
    let obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1/1 2/2 4/3\nf 2 3 4\nf 3 1 -1\n";
    let m = formats::read("a.OBJ", obj).expect("a tetrahedron");
    assert_eq!(
        (m.points.len(), m.triangles.len(), m.closed()),
        (4, 4, true)
    );
    let text = b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid";
    assert_eq!(
        formats::read("a.stl", text)
            .expect("one triangle")
            .triangles
            .len(),
        1
    );
    assert!(formats::read("a.stl", b"").is_err());
    assert!(
        formats::read("a.ply", b"")
            .unwrap_err()
            .contains("STL, OBJ or DAE")
    );
    assert!(
        formats::read("a.obj", b"v 0 0 0\nf 1 2 3\n")
            .unwrap_err()
            .contains("line 2")
    );
    let mut binary = vec![0; 84];
    binary[80] = 1;
    binary.extend([0; 50]);
    binary[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(
        formats::read("a.stl", &binary)
            .unwrap_err()
            .contains("triangle 1")
    );
}
