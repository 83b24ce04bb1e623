//! Derivatives against formulas and differences.

use super::*;

/// A function that uses every operation.
fn f<S: Scalar>(x: [S; 2]) -> S {
    let (s, c) = (x[0] * x[1] + 0.3).sin_cos();
    let r = (x[0] * x[0] + s * s + 1.0).sqrt();
    (s / r - c * 0.7).atan2(x[1] + x[0] / (c + 2.0)) - r
}
fn at(x: [f64; 2]) -> f64 {
    f([Pack(x[0]), Pack(x[1])]).0
}

#[test]
fn derivatives_are_those_of_difference_quotients() {
    let (x, v, a) = ([0.4, -0.7], [1.3, 0.8], [-2.0, 0.5]);
    let h = 1e-4;
    let path = |s: f64| [0, 1].map(|i| x[i] + v[i] * s + 0.5 * a[i] * s * s);
    let t = f([0, 1].map(|i| Taylor {
        a: Pack(x[i]),
        b: Pack(v[i]),
        c: Pack(0.5 * a[i]),
    }));
    let (m, z, p) = (at(path(-h)), at(x), at(path(h)));
    assert!((t.a.0 - z).abs() < 1e-15);
    assert!((t.b.0 - (p - m) / (2.0 * h)).abs() < 1e-7);
    assert!((2.0 * t.c.0 - (p - 2.0 * z + m) / (h * h)).abs() < 1e-5);

    let d = f([
        Dual::<_, 2>::variable(Pack(x[0]), 0),
        Dual::variable(Pack(x[1]), 1),
    ]);
    for i in 0..2 {
        let mut plus = x;
        plus[i] += h;
        let mut minus = x;
        minus[i] -= h;
        let quotient = (at(plus) - at(minus)) / (2.0 * h);
        assert!((d.d[i].0 - quotient).abs() < 1e-7);
    }
    // the two agree along the path, and nested they commute
    let rate = d.d[0].0 * v[0] + d.d[1].0 * v[1];
    assert!((t.b.0 - rate).abs() < 1e-13);
    let outer = f([0, 1].map(|i| {
        let t = Taylor {
            a: Pack(x[i]),
            b: Pack(v[i]),
            c: Pack(0.5 * a[i]),
        };
        Dual::<_, 2>::variable(t, i)
    }));
    let inner = f([0, 1].map(|i| Taylor {
        a: Dual::<_, 2>::variable(Pack(x[i]), i),
        b: Dual::constant(v[i]),
        c: Dual::constant(0.5 * a[i]),
    }));
    for i in 0..2 {
        assert!((outer.d[i].a.0 - inner.a.d[i].0).abs() < 1e-13);
        assert!((outer.d[i].b.0 - inner.b.d[i].0).abs() < 1e-13);
        assert!((outer.d[i].c.0 - inner.c.d[i].0).abs() < 1e-12);
    }
}
