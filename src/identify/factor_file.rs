//! Condensed records as the bytes of a file: a line of text, a line of JSON, and packed numbers.
//!
//! A number of a triangle is a whole multiple of a part of the largest in its column. The part is 2⁻⁴⁸ of it where the estimate
//! comes from the numbers, near to what factoring leaves in doubt, and 2⁻²⁴ where only the strength of the prior does. First
//! bytes of all numbers, then second ones and so on are compressed: most numbers are small beside the largest.

use super::cross_validation::FOLDS;
use super::factor::{Factor, Header};
use crate::error::{Error, Result};
use faer::Mat;
use miniz_oxide::deflate::compress_to_vec_zlib;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use std::path::Path;

/// First bytes of a file, before its version.
const MAGIC: &[u8] = b"excite factor ";
/// Version of the format.
const VERSION: &[u8] = b"2\n";
/// Most columns of a factor.
const MOST: usize = 20_000;
/// Binary digits of numbers beside the largest of their column: for the estimate, for the strength of the prior.
const DIGITS: [i32; 2] = [48, 24];
/// How hard the compressor tries, of ten.
const LEVEL: u8 = 6;
/// Numbers of a triangle are smaller than this.
const LARGEST: f64 = 1e280;

/// The triangles in the order of the file, with the digits that they need.
fn sizes(header: &Header) -> Vec<(usize, i32)> {
    let [fit, holdout] = &header.parts;
    let each = |folds: usize, widths: Vec<usize>, digits: i32| {
        (0..folds).flat_map(move |_| widths.clone().into_iter().map(move |k| (k, digits)))
    };
    let mut out = vec![(fit.columns.len(), DIGITS[0])];
    out.extend(each(fit.folds, fit.widths(), DIGITS[1]));
    out.extend(each(holdout.folds, holdout.widths(), DIGITS[0]));
    out
}

/// Numbers in an upper triangle.
fn numbers(columns: usize) -> usize {
    columns * (columns + 1) / 2
}

/// Two to a power, for powers that doubles have.
fn power(k: i32) -> f64 {
    2f64.powi(k)
}

/// The power of two that is larger than all numbers of a column; that of a column of zeros does not matter.
fn exponent(column: impl Iterator<Item = f64>) -> i16 {
    let most = column.fold(0.0f64, |m, x| m.max(x.abs()));
    match most > LARGEST.recip() {
        true => most.log2().floor() as i16 + 1,
        false => i16::MIN,
    }
}

impl Factor {
    /// As bytes of a file: a line, a line of JSON, then all triangles.
    ///
    /// # Errors
    /// Numbers that are not finite or beyond 1e280.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut out = [MAGIC, VERSION].concat();
        let text =
            serde_json::to_string(&self.header).map_err(|e| Error::Infeasible(e.to_string()))?;
        out.extend(text.as_bytes());
        out.push(b'\n');
        let (mut scales, mut whole) = (Vec::new(), Vec::new());
        let triangles =
            std::iter::once(&self.together).chain(self.alone.iter().flatten().flatten());
        for (m, (_, digits)) in triangles.zip(sizes(&self.header)) {
            for j in 0..m.ncols() {
                let column = || (0..=j).map(|i| m[(i, j)]);
                if !column().all(|x| x.abs() < LARGEST) {
                    return Err(Error::Infeasible(
                        "the equations hold numbers that are not finite".into(),
                    ));
                }
                let scale = exponent(column());
                scales.push(scale);
                whole.extend(column().map(|x| match scale {
                    i16::MIN => 0,
                    k => {
                        let q = (x * power(digits - i32::from(k))).round() as i64;
                        // the sign last, so that small numbers have zeros in front
                        ((q << 1) ^ (q >> 63)) as u64
                    }
                }));
            }
        }
        let mut bytes: Vec<u8> = scales.iter().flat_map(|k| k.to_le_bytes()).collect();
        for plane in 0..8 {
            bytes.extend(whole.iter().map(|q| (q >> (8 * plane)) as u8));
        }
        out.extend(compress_to_vec_zlib(&bytes, LEVEL));
        Ok(out)
    }

    /// From the bytes of a file; `path` is what errors call it.
    ///
    /// # Errors
    /// Bytes that are no such file, cut off or damaged, or of an earlier version.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Factor> {
        let wrong = |why: &str| {
            Error::file(
                path,
                "",
                format!("{why}; write it again with `excite condense`"),
            )
        };
        let rest = bytes
            .strip_prefix(MAGIC)
            .ok_or_else(|| wrong("it is no factor"))?;
        let rest = rest
            .strip_prefix(VERSION)
            .ok_or_else(|| wrong("it is cut off, or of another version of the program"))?;
        let end = rest.iter().position(|b| *b == b'\n');
        let end = end.ok_or_else(|| wrong("it is cut off"))?;
        let header: Header = serde_json::from_slice(&rest[..end])
            .map_err(|e| wrong(&format!("its header is damaged ({e})")))?;
        if !sound(&header) {
            return Err(wrong("its header is damaged"));
        }
        let sizes = sizes(&header);
        let columns: usize = sizes.iter().map(|(k, _)| k).sum();
        let count: usize = sizes.iter().map(|(k, _)| numbers(*k)).sum();
        let full = 2 * columns + 8 * count;
        let packed = decompress_to_vec_zlib_with_limit(&rest[end + 1..], full)
            .map_err(|_| wrong("its numbers are cut off or damaged"))?;
        if packed.len() != full {
            return Err(wrong("it is cut off"));
        }
        let (scales, planes) = packed.split_at(2 * columns);
        let mut scales = scales
            .chunks_exact(2)
            .map(|b| i16::from_le_bytes([b[0], b[1]]));
        let mut place = 0;
        let mut triangle = |k: usize, digits: i32| -> Option<Mat<f64>> {
            let mut m = Mat::<f64>::zeros(k, k);
            for j in 0..k {
                let scale = scales.next()?;
                let unit = match scale {
                    i16::MIN => 0.0,
                    s => power(i32::from(s) - digits),
                };
                for i in 0..=j {
                    let byte =
                        |plane: usize| u64::from(planes[plane * count + place]) << (8 * plane);
                    let q = (0..8).map(byte).sum::<u64>();
                    let x = ((q >> 1) as i64 ^ -((q & 1) as i64)) as f64 * unit;
                    m[(i, j)] = Some(x).filter(|x| x.abs() < LARGEST)?;
                    place += 1;
                }
            }
            Some(m)
        };
        let mut all = sizes.iter().map(|&(k, digits)| {
            triangle(k, digits).ok_or_else(|| wrong("a number in it is not finite"))
        });
        let together = all.next().ok_or_else(|| wrong("it is cut off"))??;
        let mut alone = [Vec::new(), Vec::new()];
        for (p, out) in header.parts.iter().zip(&mut alone) {
            for _ in 0..p.folds {
                out.push(all.by_ref().take(p.used.len()).collect::<Result<_>>()?);
            }
        }
        drop(all);
        Ok(Factor {
            header,
            together,
            alone,
        })
    }
}

/// Whether lengths and places agree.
fn sound(header: &Header) -> bool {
    let b = header.names.len();
    let n = header.parts.iter().map(|p| p.used.len()).max().unwrap_or(0);
    header.parts.iter().all(|p| {
        let listed = [&p.largest, &p.energy];
        p.columns.len() <= MOST
            && p.folds <= FOLDS
            && p.columns.iter().all(|[a, c]| *a < p.used.len() && *c <= b)
            && p.columns.is_sorted()
            && listed.iter().all(|v| v.len() == p.used.len())
            && (p.used.is_empty() || p.used.len() == n)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::factor::Part;

    /// Two actuators, the first with a column of its own beside the torque of both.
    fn factor(numbers: [f64; 6]) -> Factor {
        let part = |records: &[&str], folds: usize| Part {
            records: records.iter().map(ToString::to_string).collect(),
            columns: vec![[0, 0], [0, 1], [1, 1]],
            folds,
            used: vec![3.0; 2],
            largest: vec![1.0; 2],
            energy: vec![1.0; 2],
            inflated: 3.0,
        };
        let header = Header {
            robot: "robot".into(),
            hash: "hash".into(),
            identify: None,
            names: vec!["one".into()],
            cutoff: 10.0,
            average: true,
            derive: false,
            warnings: Vec::new(),
            parts: [part(&["run"], 2), part(&[], 1)],
        };
        let of = |k: usize| {
            let mut next = numbers.iter();
            let mut m = Mat::<f64>::zeros(k, k);
            for j in 0..k {
                for i in 0..=j {
                    m[(i, j)] = *next.next().unwrap_or(&0.0);
                }
            }
            m
        };
        let fold = || vec![of(2), of(1)];
        Factor {
            header,
            together: of(3),
            alone: [vec![fold(), fold()], vec![fold()]],
        }
    }

    fn again(f: &Factor) -> Factor {
        Factor::from_bytes(&f.to_bytes().unwrap(), Path::new("x")).unwrap()
    }

    #[test]
    fn numbers_are_as_exact_as_their_column_needs() {
        let numbers = [1e-9, -3.7e200, 1.1, -0.3, 1e-14, 6.25e-3];
        let written = factor(numbers);
        let read = again(&written);
        assert_eq!(read.header, written.header);
        let off = |a: &Mat<f64>, b: &Mat<f64>| {
            let column = |j: usize| {
                let most = (0..a.nrows()).fold(0.0f64, |m, i| m.max(b[(i, j)].abs()));
                (0..a.nrows()).fold(0.0f64, |m, i| m.max((a[(i, j)] - b[(i, j)]).abs() / most))
            };
            (0..a.ncols()).map(column).fold(0.0, f64::max)
        };
        assert!(off(&read.together, &written.together) <= power(-48));
        let folds = off(&read.alone[0][1][0], &written.alone[0][1][0]);
        assert!(folds <= power(-24), "{folds}");
        assert!(off(&read.alone[1][0][0], &written.alone[1][0][0]) <= power(-48));
        // what was read is written and read as it is
        assert_eq!(again(&read).together, read.together);
        assert_eq!(again(&factor([0.0; 6])).together, Mat::<f64>::zeros(3, 3));
    }

    #[test]
    fn numbers_without_bound_are_refused() {
        for x in [f64::NAN, f64::INFINITY, -1e290] {
            let error = factor([1.0, x, 1.0, 1.0, 1.0, 1.0]).to_bytes().unwrap_err();
            assert!(error.to_string().contains("not finite"));
        }
    }
}
