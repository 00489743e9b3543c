//! Hyperelastic laws: stored energy per reference volume, first Piola-Kirchhoff stress and tangent.
//!
//! `Psi(F) = W(x) + d (J - 1)^2` in Pa, with `J = det F`, `I1 = F : F` and `x = J^(-2/3) I1 - 3`:
//! neo-Hookean `W = c x`; exponential `W = a / (2 b) (exp(b x) - 1)`; reduced polynomial `W = c x + e x^2`.
//!
//! Two conventions of the fast kernel are reproduced, both C1 (stress continuous, tangent with a jump):
//! [`J_MIN`] and [`EXPONENT_CAP`].

use super::tensor::{IDENTITY, Mat3, Mat9, contraction, determinant, from_fn, inverse, transpose};

/// Below this `J` the factor `g(J) = J^(-2/3)` goes on along its tangent, so that crushed and inverted
/// elements keep a finite energy: `g(J) = g(J_MIN) + g'(J_MIN) (J - J_MIN)`.
pub const J_MIN: f64 = 0.1;

/// Above this value of the exponent `b x` the exponential `W` goes on along its tangent.
pub const EXPONENT_CAP: f64 = 40.0;

/// A hyperelastic law; `a`, `c`, `d`, `e` in Pa, `b` a pure number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// `c (I1bar - 3) + d (J - 1)^2`.
    NeoHookean { c: f64, d: f64 },
    /// `a / (2 b) (exp(b (I1bar - 3)) - 1) + d (J - 1)^2`.
    Exponential { a: f64, b: f64, d: f64 },
    /// `c (I1bar - 3) + e (I1bar - 3)^2 + d (J - 1)^2`.
    Polynomial { c: f64, e: f64, d: f64 },
}

impl Law {
    /// The paper's exponential law, its constants read as kPa.
    pub const PAPER: Law = Law::Exponential { a: 59.0, b: 8.023, d: 60_000.0 };

    /// Volume modulus `d` of `d (J - 1)^2`.
    pub fn d(&self) -> f64 {
        match *self {
            Law::NeoHookean { d, .. } | Law::Exponential { d, .. } | Law::Polynomial { d, .. } => d,
        }
    }

    /// `W`, `W'` and `W''` at `x`.
    pub fn shape_response(&self, x: f64) -> [f64; 3] {
        match *self {
            Law::NeoHookean { c, .. } => [c * x, c, 0.0],
            Law::Polynomial { c, e, .. } => [(c + e * x) * x, c + 2.0 * e * x, 2.0 * e],
            Law::Exponential { a, b, .. } => {
                if b * x <= EXPONENT_CAP {
                    let e = (b * x).exp();
                    [a / (2.0 * b) * (e - 1.0), a / 2.0 * e, a * b / 2.0 * e]
                } else {
                    let e = EXPONENT_CAP.exp();
                    let x_cap = EXPONENT_CAP / b;
                    [a / (2.0 * b) * (e - 1.0) + a / 2.0 * e * (x - x_cap), a / 2.0 * e, 0.0]
                }
            }
        }
    }

    /// `g`, `g'` and `g''` at `J`: the factor of `I1` in `x`.
    pub fn volume_factor(&self, j: f64) -> [f64; 3] {
        let at = j.max(J_MIN);
        let g = at.powf(-2.0 / 3.0);
        let dg = -2.0 / 3.0 * g / at;
        if j >= J_MIN { [g, dg, 10.0 / 9.0 * g / (at * at)] } else { [g + dg * (j - J_MIN), dg, 0.0] }
    }

    /// `x = g(J) I1 - 3`, the argument of `W`.
    pub fn strain_measure(&self, f: &Mat3) -> f64 {
        let [g, ..] = self.volume_factor(determinant(f));
        g * contraction(f, f) - 3.0
    }

    /// Stored energy `Psi(F)` in J/m^3.
    pub fn energy(&self, f: &Mat3) -> f64 {
        let j = determinant(f);
        let [w, ..] = self.shape_response(self.strain_measure(f));
        w + self.d() * (j - 1.0).powi(2)
    }

    /// First Piola-Kirchhoff stress `P = dPsi/dF` in Pa; not finite where `J = 0` exactly.
    ///
    /// With `dI1/dF = 2 F` and `dJ/dF = J F^-T`: `P = W' (2 g F + g' I1 J F^-T) + 2 d (J - 1) J F^-T`.
    pub fn first_piola(&self, f: &Mat3) -> Mat3 {
        let j = determinant(f);
        let i1 = contraction(f, f);
        let f_inv_t = transpose(&inverse(f));
        let [g, dg, _] = self.volume_factor(j);
        let [_, dw, _] = self.shape_response(g * i1 - 3.0);
        let of_j = dw * dg * i1 + 2.0 * self.d() * (j - 1.0);
        from_fn(|i, k| 2.0 * dw * g * f[i][k] + of_j * j * f_inv_t[i][k])
    }

    /// Tangent `A_iJkL = dP_iJ / dF_kL` in Pa, analytic: the second derivative of `Psi(I1(F), J(F))` by the
    /// product rule, with `d(J F^-T)_iJ / dF_kL = J (F^-T_iJ F^-T_kL - F^-T_iL F^-T_kJ)`.
    pub fn tangent(&self, f: &Mat3) -> Mat9 {
        let jac = determinant(f);
        let i1 = contraction(f, f);
        let f_inv_t = transpose(&inverse(f));
        let [_, dw, ddw] = self.shape_response(self.strain_measure(f));
        let [g, dg, ddg] = self.volume_factor(jac);
        let di1 = from_fn(|i, j| 2.0 * f[i][j]);
        let dj = from_fn(|i, j| jac * f_inv_t[i][j]);
        let dx = from_fn(|i, j| g * di1[i][j] + dg * i1 * dj[i][j]);
        let d = self.d();

        let entry = |i: usize, j: usize, k: usize, l: usize| {
            let ddi1 = 2.0 * IDENTITY[i][k] * IDENTITY[j][l];
            let ddj = jac * (f_inv_t[i][j] * f_inv_t[k][l] - f_inv_t[i][l] * f_inv_t[k][j]);
            let ddx = g * ddi1
                + dg * (di1[i][j] * dj[k][l] + dj[i][j] * di1[k][l])
                + i1 * (ddg * dj[i][j] * dj[k][l] + dg * ddj);
            let volume = 2.0 * d * (dj[i][j] * dj[k][l] + (jac - 1.0) * ddj);
            ddw * dx[i][j] * dx[k][l] + dw * ddx + volume
        };
        std::array::from_fn(|row| std::array::from_fn(|col| entry(row / 3, row % 3, col / 3, col % 3)))
    }
}
