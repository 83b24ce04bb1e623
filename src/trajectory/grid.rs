//! Which harmonics a motion uses.

use crate::error::{Error, Result};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Choice of the harmonics.
///
/// With odd grids a nonlinear, even-order distortion falls on the even lines; with a random-odd
/// grid the odd lines left out tell odd-order distortion too (Pintelon & Schoukens, *System
/// Identification: A Frequency Domain Approach*, 2nd ed. 2012, ch. 4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grid {
    /// `1, 2, … n`
    #[default]
    Full,
    /// `1, 3, … 2n − 1`
    Odd,
    /// odd lines, of every four consecutive ones a random one left out
    RandomOdd,
}

impl Grid {
    /// All grids.
    pub const ALL: [Grid; 3] = [Grid::Full, Grid::Odd, Grid::RandomOdd];

    /// Name as in files and on the command line: `full`, `odd`, `random-odd`.
    pub fn name(self) -> &'static str {
        match self {
            Grid::Full => "full",
            Grid::Odd => "odd",
            Grid::RandomOdd => "random-odd",
        }
    }

    /// The first `n` harmonics of the grid, strictly increasing. `seed` chooses the lines left out
    /// of a random-odd grid and does nothing otherwise; more harmonics with the same seed go on
    /// where fewer stopped.
    pub fn harmonics(self, n: usize, seed: u64) -> Vec<u32> {
        let odd = |i: usize| 2 * i as u32 + 1;
        match self {
            Grid::Full => (0..n).map(|i| i as u32 + 1).collect(),
            Grid::Odd => (0..n).map(odd).collect(),
            Grid::RandomOdd => {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let mut lines = Vec::with_capacity(n + 3);
                let mut group = 0;
                while lines.len() < n {
                    let dropped = rng.random_range(0..4u32) as usize;
                    lines.extend((0..4).filter(|&k| k != dropped).map(|k| odd(4 * group + k)));
                    group += 1;
                }
                lines.truncate(n);
                lines
            }
        }
    }
}

impl std::str::FromStr for Grid {
    type Err = Error;
    fn from_str(text: &str) -> Result<Self> {
        Grid::ALL
            .into_iter()
            .find(|g| g.name() == text)
            .ok_or_else(|| {
                Error::Argument(format!(
                    "grid {text:?} is not known; use full, odd or random-odd"
                ))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_grids() {
        assert_eq!(Grid::Full.harmonics(4, 9), [1, 2, 3, 4]);
        assert_eq!(Grid::Odd.harmonics(4, 9), [1, 3, 5, 7]);
        assert!(Grid::Full.harmonics(0, 0).is_empty());
    }

    #[test]
    fn random_odd_drops_one_line_in_every_group_of_four() {
        let mut different = std::collections::BTreeSet::new();
        for seed in 0..50 {
            let lines = Grid::RandomOdd.harmonics(30, seed);
            assert_eq!(lines, Grid::RandomOdd.harmonics(30, seed));
            assert_eq!(lines[..7], Grid::RandomOdd.harmonics(7, seed));
            assert_eq!(lines.len(), 30);
            assert!(lines.windows(2).all(|w| w[0] < w[1]) && lines.iter().all(|h| h % 2 == 1));
            for group in 0..10u32 {
                let kept = lines.iter().filter(|&&h| (h - 1) / 8 == group).count();
                assert_eq!(kept, 3, "seed {seed}, group {group}");
            }
            different.insert(lines);
        }
        assert!(different.len() > 45);
    }

    #[test]
    fn names_round_trip() {
        for grid in Grid::ALL {
            assert_eq!(grid.name().parse::<Grid>().unwrap(), grid);
            assert_eq!(
                serde_json::to_string(&grid).unwrap(),
                format!("\"{}\"", grid.name())
            );
        }
        assert!("even".parse::<Grid>().unwrap_err().is_argument());
    }
}
