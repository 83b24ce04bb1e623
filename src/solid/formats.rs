//! Meshes from STL (binary or text), OBJ and COLLADA files.
//!
//! Only positions are read. Lengths are those of the file (COLLADA: m); the caller scales them to m.

use super::dae::dae;
use super::mesh::{Builder, Mesh};
use nalgebra::Vector3;

type V = Vector3<f64>;

/// Reads a mesh by the ending of its name.
///
/// # Errors
/// What is wrong with the file, in words: an unknown ending, a number that is not finite, a face without
/// its corners, no triangle at all.
pub fn read(name: &str, bytes: &[u8]) -> Result<Mesh, String> {
    let ending = name.rsplit('.').next().unwrap_or("").to_ascii_lowercase();
    let mesh = match ending.as_str() {
        "stl" => stl(bytes)?,
        "obj" => obj(bytes)?,
        "dae" => dae(bytes)?,
        _ => {
            return Err(format!(
                "a mesh of kind .{ending} is not read; convert it to STL, OBJ or DAE"
            ));
        }
    };
    match mesh.triangles.is_empty() {
        true => Err("the mesh holds no triangle".into()),
        false => Ok(mesh),
    }
}

/// STL, binary or text: told by the length that a binary file must have.
///
/// # Errors
/// As [`read`].
pub fn stl(bytes: &[u8]) -> Result<Mesh, String> {
    if let Some(count) = bytes.get(80..84) {
        let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize;
        if count.checked_mul(50).is_some_and(|n| n + 84 == bytes.len()) {
            return binary_stl(&bytes[84..]);
        }
    }
    text_stl(bytes)
}

fn binary_stl(body: &[u8]) -> Result<Mesh, String> {
    let mut builder = Builder::default();
    for (row, record) in body.chunks_exact(50).enumerate() {
        let number = |k: usize| {
            let b = &record[12 + 4 * k..16 + 4 * k];
            f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        };
        let corners =
            [0, 1, 2].map(|c| V::new(number(3 * c), number(3 * c + 1), number(3 * c + 2)));
        builder.triangle(corners, || format!("triangle {}", row + 1))?;
    }
    Ok(builder.mesh)
}

fn text_stl(bytes: &[u8]) -> Result<Mesh, String> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| "neither a text STL nor a binary one of the length that its head states")?;
    let mut builder = Builder::default();
    let mut corners = Vec::with_capacity(3);
    for (row, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        let first = words.next().unwrap_or_default();
        if first.eq_ignore_ascii_case("facet") {
            corners.clear();
        }
        if !first.eq_ignore_ascii_case("vertex") {
            continue;
        }
        corners.push(point(words, || format!("line {}", row + 1))?);
        if let [a, b, c] = corners[..] {
            builder.triangle([a, b, c], || format!("line {}", row + 1))?;
            corners.clear();
        }
    }
    Ok(builder.mesh)
}

/// Wavefront OBJ: `v` and `f` lines; polygons are fans of triangles.
///
/// # Errors
/// As [`read`].
pub fn obj(bytes: &[u8]) -> Result<Mesh, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "the OBJ file is not text")?;
    let mut points: Vec<V> = Vec::new();
    let mut builder = Builder::default();
    for (row, line) in text.lines().enumerate() {
        let place = || format!("line {}", row + 1);
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => points.push(point(words, place)?),
            Some("f") => {
                let corner = |word: &str| -> Option<V> {
                    let i: i64 = word.split('/').next()?.parse().ok()?;
                    let at = if i < 0 {
                        points.len() as i64 + i
                    } else {
                        i - 1
                    };
                    points.get(usize::try_from(at).ok()?).copied()
                };
                let face: Option<Vec<V>> = words.map(corner).collect();
                let face = face.filter(|f| f.len() >= 3);
                let face =
                    face.ok_or_else(|| format!("{}: a face without its corners", place()))?;
                for k in 1..face.len() - 1 {
                    builder.triangle([face[0], face[k], face[k + 1]], place)?;
                }
            }
            _ => {}
        }
    }
    Ok(builder.mesh)
}

fn point<'a>(
    words: impl Iterator<Item = &'a str>,
    place: impl Fn() -> String,
) -> Result<V, String> {
    let numbers: Vec<f64> = words.take(3).filter_map(|w| w.parse().ok()).collect();
    match numbers[..] {
        [x, y, z] => Ok(V::new(x, y, z)),
        _ => Err(format!("{}: a corner without three numbers", place())),
    }
}
