//! A short way through postures: nearest first, then crossings undone (2-opt), by the largest move of a joint.

use super::Candidate;

fn far(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()))
}

/// Sum of the moves.
pub fn way(list: &[Candidate]) -> f64 {
    list.windows(2).map(|w| far(&w[0].q, &w[1].q)).sum()
}

/// Orders the postures, the first near `from`; postures of one point stay together.
pub fn shorten(list: &mut [Candidate], from: Vec<f64>) {
    list.sort_by_key(|c| c.point);
    let mut at = from;
    let mut begin = 0;
    while begin < list.len() {
        let point = list[begin].point;
        let end = begin
            + list[begin..]
                .iter()
                .take_while(|c| c.point == point)
                .count();
        let part = &mut list[begin..end];
        for k in 0..part.len() {
            let nearest = (k..part.len())
                .min_by(|&a, &b| far(&at, &part[a].q).total_cmp(&far(&at, &part[b].q)));
            if let Some(i) = nearest {
                part.swap(k, i);
            }
            at.clone_from(&part[k].q);
        }
        for _ in 0..20 {
            let mut better = false;
            for i in 1..part.len() {
                for j in i + 1..part.len() {
                    let after = part.get(j + 1).map(|c| c.q.clone());
                    let last = |q: &[f64]| after.as_ref().map_or(0.0, |a| far(q, a));
                    let old = far(&part[i - 1].q, &part[i].q) + last(&part[j].q);
                    let new = far(&part[i - 1].q, &part[j].q) + last(&part[i].q);
                    if new < old - 1e-12 {
                        part[i..=j].reverse();
                        better = true;
                    }
                }
            }
            if !better {
                break;
            }
        }
        if let Some(c) = part.last() {
            at.clone_from(&c.q);
        }
        begin = end;
    }
}
