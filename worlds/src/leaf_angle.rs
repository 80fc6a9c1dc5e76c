//! How the leaves of a plant are inclined: de Wit's classes, as a sampler and as the projection that light sees.

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_2};
use std::sync::LazyLock;

/// The distribution of the leaves' inclinations: the angle between a leaf's normal and the zenith. Bearings are uniform.
///
/// Densities over the inclination `t` in [0, pi/2] after de Wit (1965), as in Goudriaan (1977).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LeafAngle {
    /// Normals uniform on the sphere: `sin t`.
    #[default]
    Spherical,
    /// Every inclination alike: `2/pi`.
    Uniform,
    /// Mostly level leaves: `2/pi (1 + cos 2t)`.
    Planophile,
    /// Mostly upright leaves: `2/pi (1 - cos 2t)`.
    Erectophile,
    /// Mostly at 45 degrees: `2/pi (1 - cos 4t)`.
    Plagiophile,
}

/// Places of the projection table, even in the cosine of the zenith angle; 0 and 1 included. Between two of them the
/// straight line is off by less than 1e-3.
const NODES: usize = 129;
/// Steps of the integral over the inclination.
const STEPS: usize = 512;
/// Halvings that bring an inclination to 1e-12 radians.
const HALVINGS: usize = 41;

/// Projections by class (in the order of [`LeafAngle::ALL`]) and by cosine of the zenith angle.
static PROJECTIONS: LazyLock<[[f64; NODES]; 5]> = LazyLock::new(|| {
    LeafAngle::ALL.map(|angle| std::array::from_fn(|node| angle.integral(node as f64 / (NODES - 1) as f64)))
});

impl LeafAngle {
    /// Every class.
    pub const ALL: [LeafAngle; 5] = [
        LeafAngle::Spherical,
        LeafAngle::Uniform,
        LeafAngle::Planophile,
        LeafAngle::Erectophile,
        LeafAngle::Plagiophile,
    ];

    /// Mean projection of a leaf of area 1 on the plane across a beam, `G`, for the cosine of the angle between beam
    /// and zenith (Ross 1981); of either sign. A cosine beyond 1 counts as 1.
    pub fn projection(&self, cos_zenith: f64) -> f64 {
        if *self == LeafAngle::Spherical {
            return 0.5;
        }
        let table = &PROJECTIONS[*self as usize];
        let place = cos_zenith.abs().min(1.0) * (NODES - 1) as f64;
        let node = (place as usize).min(NODES - 2);
        table[node] + (table[node + 1] - table[node]) * (place - node as f64)
    }

    /// The inclination below which this share of the leaves lies, radians in [0, pi/2]: feed it uniform chance.
    pub fn inclination_rad(&self, share: f64) -> f64 {
        match self {
            LeafAngle::Spherical => (1.0 - share).clamp(0.0, 1.0).acos(),
            LeafAngle::Uniform => share * FRAC_PI_2,
            _ => {
                let (mut low, mut high) = (0.0, FRAC_PI_2);
                for _ in 0..HALVINGS {
                    let middle = (low + high) / 2.0;
                    if self.share_below(middle) < share { low = middle } else { high = middle }
                }
                (low + high) / 2.0
            }
        }
    }

    /// Density at an inclination, 1/rad.
    pub fn density_per_rad(&self, inclination_rad: f64) -> f64 {
        match self {
            LeafAngle::Spherical => inclination_rad.sin(),
            LeafAngle::Uniform => FRAC_2_PI,
            LeafAngle::Planophile => FRAC_2_PI * (1.0 + (2.0 * inclination_rad).cos()),
            LeafAngle::Erectophile => FRAC_2_PI * (1.0 - (2.0 * inclination_rad).cos()),
            LeafAngle::Plagiophile => FRAC_2_PI * (1.0 - (4.0 * inclination_rad).cos()),
        }
    }

    /// Integral of the density from 0.
    fn share_below(&self, inclination_rad: f64) -> f64 {
        let t = inclination_rad;
        match self {
            LeafAngle::Spherical => 1.0 - t.cos(),
            LeafAngle::Uniform => FRAC_2_PI * t,
            LeafAngle::Planophile => FRAC_2_PI * t + FRAC_1_PI * (2.0 * t).sin(),
            LeafAngle::Erectophile => FRAC_2_PI * t - FRAC_1_PI * (2.0 * t).sin(),
            LeafAngle::Plagiophile => FRAC_2_PI * t - FRAC_1_PI / 2.0 * (4.0 * t).sin(),
        }
    }

    /// `G` by the midpoint rule over equal shares of leaves.
    fn integral(&self, cos_zenith: f64) -> f64 {
        let share = |step: usize| (step as f64 + 0.5) / STEPS as f64;
        (0..STEPS).map(|step| turned(cos_zenith, self.inclination_rad(share(step)))).sum::<f64>()
            / STEPS as f64
    }
}

/// Mean projection of leaves of one inclination and every bearing (Ross 1981, eq. for A): `cos cos` where the beam sees
/// only one face, more where it sees both.
fn turned(cos_zenith: f64, inclination_rad: f64) -> f64 {
    let (sin_leaf, cos_leaf) = inclination_rad.sin_cos();
    let sin_zenith = (1.0 - cos_zenith * cos_zenith).max(0.0).sqrt();
    let (level, across) = (cos_zenith * cos_leaf, sin_zenith * sin_leaf);
    if level >= across {
        return level;
    }
    // With a = acos(-level / across): level (2 a / pi - 1) + 2 / pi across sin a, the same without a tangent.
    let turn = (-level / across).acos();
    level * (FRAC_2_PI * turn - 1.0) + FRAC_2_PI * across * turn.sin()
}
