//! First Piola-Kirchhoff stress in Pa, written out by hand, for deformations of which every entry is known.
//! They hold for `J >= J_MIN` and below the cap of the exponent; the forces of an element are `V P grad N_a`.
//!
//! With `W'` the derivative at the deformation's `x`:
//!
//! | | |
//! |---|---|
//! | stretch `F = diag(s, 1, 1)` | `x = (s^2 + 2) s^(-2/3) - 3` |
//! | `P11 - 2 d (s - 1)` | `4/3 W' s^(-2/3) (s - 1/s)` |
//! | `P22 - 2 d (s - 1) s` | `2/3 W' s^(-2/3) (1 - s^2)` |
//! | shear `F = I + q e1 (x) e2` | `x = q^2` |
//! | `P12`, `P21` | `2 W' q`, `2 W' q (1 + q^2/3)` |
//! | `P11 = P22 = P33` | `-2/3 W' q^2` |
//! | dilation `F = s I` | `x = 0` |
//! | `P11 - 2 d (s^3 - 1) s^2` | `0` |

use super::law::Law;
use super::tensor::Mat3;

/// `W'(x)`.
fn slope(law: &Law, x: f64) -> f64 {
    match *law {
        Law::NeoHookean { c, .. } => c,
        Law::Exponential { a, b, .. } => a / 2.0 * (b * x).exp(),
        Law::Polynomial { c, e, .. } => c + 2.0 * e * x,
    }
}

/// `F = diag(s, 1, 1)`, sides held.
pub fn uniaxial_stretch(s: f64) -> Mat3 {
    [[s, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
}

/// `P` of [`uniaxial_stretch`].
pub fn uniaxial_stretch_stress(law: &Law, s: f64) -> Mat3 {
    let g = 1.0 / (s * s).cbrt();
    let w = slope(law, (s * s + 2.0) * g - 3.0);
    let (along, across) = (4.0 / 3.0 * w * g * (s - 1.0 / s), 2.0 / 3.0 * w * g * (1.0 - s * s));
    let volume = 2.0 * law.d() * (s - 1.0);
    let (p11, p22) = (along + volume, across + volume * s);
    [[p11, 0.0, 0.0], [0.0, p22, 0.0], [0.0, 0.0, p22]]
}

/// `F = I + q e1 (x) e2`.
pub fn simple_shear(q: f64) -> Mat3 {
    [[1.0, q, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
}

/// `P` of [`simple_shear`].
pub fn simple_shear_stress(law: &Law, q: f64) -> Mat3 {
    let w = slope(law, q * q);
    let (normal, p21) = (-2.0 / 3.0 * w * q * q, 2.0 * w * q * (1.0 + q * q / 3.0));
    [[normal, 2.0 * w * q, 0.0], [p21, normal, 0.0], [0.0, 0.0, normal]]
}

/// `F = s I`.
pub fn dilation(s: f64) -> Mat3 {
    [[s, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, s]]
}

/// `P` of [`dilation`].
pub fn dilation_stress(law: &Law, s: f64) -> Mat3 {
    dilation(2.0 * law.d() * (s.powi(3) - 1.0) * s * s)
}
