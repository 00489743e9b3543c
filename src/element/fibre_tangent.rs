//! Stress and tangent of fibres in float64 ([`super::fibres`] has the equations), for tools, tests and pictures. Pa.

use glam::{DMat3, DVec3};

use super::fibres::{Fibrous, PAIRS};
#[cfg(feature = "std")]
use super::matrix::inner;
use super::matrix::{cofactor, outer};
use crate::material::{FIBRE_TERMS, Fibres, J_FLOOR};

/// The stress of fibres at a deformation gradient, and the derivative of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FibreTangent {
    f: DMat3,
    cofactor: DMat3,
    /// `g`, `g'`, `g''`.
    factor: [f64; 3],
    directions: [DVec3; 2],
    /// `phi'` and `phi''` of each term.
    slopes: [[f64; 2]; FIBRE_TERMS],
}

impl Fibrous<'_> {
    /// At place `lane` of a tile, which belongs to mesh element `element`, at the displacement gradient `h`.
    pub(crate) fn tangent(&self, [tile, lane]: [usize; 2], element: usize, h: DMat3) -> FibreTangent {
        let directions = [0, 1].map(|family| self.tile(tile).at(family, lane));
        FibreTangent::new(&self.of(element), directions, h)
    }
}

impl FibreTangent {
    /// Of fibres along unit vectors, at the displacement gradient `h`.
    pub(crate) fn new(fibres: &Fibres, directions: [DVec3; 2], h: DMat3) -> Self {
        let f = DMat3::IDENTITY + h;
        let volume_ratio = f.determinant();
        let floor = f64::from(J_FLOOR);
        let sound = if volume_ratio > floor { volume_ratio } else { floor };
        let g = 1.0 / libm::cbrt(sound * sound);
        let slope = -2.0 / 3.0 * g / sound;
        let curvature = if volume_ratio > floor { 10.0 / 9.0 * g / (sound * sound) } else { 0.0 };
        let factor = [g + slope * (volume_ratio - sound), slope, curvature];
        let images = directions.map(|direction| f * direction);
        let mut x = PAIRS.map(|[p, q]| factor[0] * images[p % 2].dot(images[q % 2]));
        (x[0], x[1]) = (x[0] - 1.0, x[1] - 1.0);
        Self { f, cofactor: cofactor(f), factor, directions, slopes: fibres.slopes(x) }
    }

    /// `dy/dF` of a term, with `I` and `g m_p . m_q`.
    fn derivative(&self, term: usize) -> (DMat3, f64) {
        let [p, q] = PAIRS[term % FIBRE_TERMS].map(|family| self.directions[family % 2]);
        let [g, slope, _] = self.factor;
        let product = (self.f * p).dot(self.f * q);
        let of_directions = outer(self.f * p, q) + outer(self.f * q, p);
        (of_directions * g + self.cofactor * (slope * product), product)
    }

    /// The first Piola-Kirchhoff stress.
    pub(crate) fn stress(&self) -> DMat3 {
        (0..FIBRE_TERMS)
            .fold(DMat3::ZERO, |sum, term| sum + self.derivative(term).0 * self.slopes[term % FIBRE_TERMS][0])
    }

    /// `P F^T`, the Kirchhoff stress.
    pub(crate) fn kirchhoff_stress(&self) -> DMat3 {
        self.stress() * self.f.transpose()
    }

    /// The change of the stress with one of the deformation gradient.
    #[cfg(feature = "std")]
    pub(crate) fn stress_by(&self, df: DMat3) -> DMat3 {
        let [g, slope, curvature] = self.factor;
        let volume = inner(self.cofactor, df);
        let d_cofactor = (cofactor(self.f + df) - cofactor(self.f - df)) * 0.5;
        let of_term = |term: usize| {
            let [p, q] = PAIRS[term % FIBRE_TERMS].map(|family| self.directions[family % 2]);
            let (x, product) = self.derivative(term);
            let [first, second] = self.slopes[term % FIBRE_TERMS];
            let (mp, mq) = (self.f * p, self.f * q);
            let d_product = (df * p).dot(mq) + mp.dot(df * q);
            let change = (outer(mp, q) + outer(mq, p)) * (slope * volume)
                + (outer(df * p, q) + outer(df * q, p)) * g
                + self.cofactor * (curvature * volume * product + slope * d_product)
                + d_cofactor * (slope * product);
            x * (second * inner(x, df)) + change * first
        };
        (0..FIBRE_TERMS).fold(DMat3::ZERO, |sum, term| sum + of_term(term))
    }
}
