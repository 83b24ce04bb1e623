//! Friction of one joint with its inner state.

/// Width of the smooth sign of dry friction, rad/s or m/s per unit of the joint's speed range.
pub const SHARP: f64 = 0.003;

/// How dry friction follows the velocity.
#[derive(Clone, Debug)]
pub enum Dry {
    /// A narrow tanh.
    Sign,
    /// LuGre bristle (Canudas de Wit et al. 1995): rise over Coulomb, Stribeck velocity and exponent,
    /// deflection at break-away.
    Bristle {
        rise: f64,
        velocity: f64,
        exponent: f64,
        deflection: f64,
        z: f64,
    },
    /// Iwan's parallel spring-slider elements, equal stiffness shares, rising yield.
    Elements { deflection: f64, z: [f64; 6] },
}

/// Friction laws of one joint; every field is zero or one where the machine is ordinary.
#[derive(Clone, Debug)]
pub struct Friction {
    pub speed: f64,
    pub viscous: [f64; 2],
    pub coulomb: [f64; 2],
    pub offset: f64,
    pub dry: Dry,
    /// Rise over Coulomb friction at low speed without a bristle: share, velocity, exponent.
    pub stribeck: Option<[f64; 3]>,
    /// Eyring lubrication: level and velocity.
    pub eyring: Option<(f64, f64)>,
    /// Power law: level at the speed range and exponent.
    pub power: Option<(f64, f64)>,
    /// Gear loss: factor at the reference load, that load, exponent, growth with speed.
    pub gear: Option<[f64; 4]>,
    /// Once and twice per turn: amplitudes and phases, relative to the dry friction.
    pub around: Option<[f64; 4]>,
    /// Cold excess of friction, time constant s, start temperature.
    pub warming: Option<(f64, f64)>,
    pub temperature: f64,
    /// Dahl friction of a hose: level and deflection, and its state.
    pub hose: Option<(f64, f64, f64)>,
}

impl Friction {
    pub fn ordinary(viscous: f64, coulomb: f64, offset: f64, speed: f64) -> Self {
        Self {
            speed,
            viscous: [viscous; 2],
            coulomb: [coulomb; 2],
            offset,
            dry: Dry::Sign,
            stribeck: None,
            eyring: None,
            power: None,
            gear: None,
            around: None,
            warming: None,
            temperature: 0.0,
            hose: None,
        }
    }

    /// Friction torque at velocity `v` and position `q` under the transmitted torque `load`, and its
    /// derivative with respect to `v`; the inner states advance by `h`. `drag` multiplies dry friction.
    pub fn step(&mut self, v: f64, q: f64, load: f64, drag: f64, h: f64) -> (f64, f64) {
        let width = SHARP * self.speed;
        let sign = (v / width).tanh();
        let slope = (1.0 - sign * sign) / width;
        let forward = 0.5 * (1.0 + (v / (4.0 * width)).tanh());
        let viscous = self.viscous[0] * forward + self.viscous[1] * (1.0 - forward);
        let mut coulomb = self.coulomb[0] * forward + self.coulomb[1] * (1.0 - forward);
        coulomb *= drag;
        if let Some([a, pa, b, pb]) = self.around {
            coulomb *= 1.0 + a * (1.0 + (q + pa).cos()) + b * (1.0 + (2.0 * q + pb).cos());
        }
        let (mut f, mut df) = match &mut self.dry {
            Dry::Sign => {
                if let Some([rise, velocity, exponent]) = self.stribeck {
                    coulomb *= 1.0 + rise * (-(v.abs() / velocity).powf(exponent)).exp();
                }
                (coulomb * sign, coulomb * slope)
            }
            Dry::Bristle {
                rise,
                velocity,
                exponent,
                deflection,
                z,
            } => {
                let level =
                    coulomb * (1.0 + *rise * (-(v.abs() / *velocity).powf(*exponent)).exp());
                // z in units of the break-away deflection; exact over a step of constant velocity
                let stiffness = coulomb / *deflection;
                let steady = level / stiffness * v.signum();
                let decay = (-(v.abs() * h * stiffness / level)).exp();
                let before = *z;
                *z = steady + (*z - steady) * decay;
                let damping = 0.2 * (stiffness * h).max(0.0);
                let rate = (*z - before) / h;
                (stiffness * *z + damping * rate, stiffness * h + damping)
            }
            Dry::Elements { deflection, z } => {
                let count = z.len() as f64;
                let mut sum = 0.0;
                let mut slope = 0.0;
                for (i, x) in z.iter_mut().enumerate() {
                    let yielding = *deflection * 2.0 * (i as f64 + 0.5) / count;
                    *x = (*x + v * h).clamp(-yielding, yielding);
                    let k = coulomb / (count * yielding);
                    sum += k * *x;
                    if x.abs() < yielding {
                        slope += k * h;
                    }
                }
                (sum, slope)
            }
        };
        f += viscous * v;
        df += viscous;
        if let Some((level, v0)) = self.eyring {
            f += level * (v / v0).asinh();
            df += level / (v0 * v0 + v * v).sqrt();
        }
        if let Some((level, p)) = self.power {
            let x = v.abs() / self.speed;
            f += level * x.powf(p) * v.signum();
            df += level * p * x.powf(p - 1.0) / self.speed;
        }
        if let Some([level, reference, p, growth]) = self.gear {
            let loss =
                level * (load.abs() / reference).powf(p) * (1.0 + growth * v.abs() / self.speed);
            f += loss * sign;
            df += loss * slope;
        }
        if let Some((excess, time)) = self.warming {
            let scale = 1.0 + excess * (-1.5 * self.temperature).exp();
            f *= scale;
            df *= scale;
            let heat = (v / (0.4 * self.speed)).powi(2);
            self.temperature += h * (heat - self.temperature) / time;
        }
        if let Some((level, deflection, z)) = &mut self.hose {
            let steady = v.signum();
            *z = steady + (*z - steady) * (-(v.abs() * h) / *deflection).exp();
            f += *level * *z;
        }
        (f + self.offset, df)
    }

    /// Cools down for `seconds` without motion.
    pub fn rest(&mut self, seconds: f64) {
        if let Some((_, time)) = self.warming {
            self.temperature *= (-seconds / time).exp();
        }
    }
}
