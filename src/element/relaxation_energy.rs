//! Energy (J) by which tissue that relaxes ([`super::relaxation`]) differs from its law: of the energy of distortion it
//! has the share that does not relax, and `V sum_i |g_i A - Q_i|^2 / (4 g_i 2 W')`, the energy of the springs of a generalised Maxwell model whose moduli are those at small strain, with
//! the lengths `|X|^2 = tr(X C X C)` of the present shape; with fibres `A` is the stress of both, and their stiffness at
//! rest is added to `2 W'`. For the energy balance, in float64: at small strain exact, at
//! larger strain an estimate, for laws that stiffen one from above.

use glam::DMat3;

use super::fibres::Fibrous;
use super::relaxation::{COMPONENTS, Series, VECTORS_OF_TERM};
use crate::material::{Law, Potential};
use crate::simd::{NodeVector, TILE};

/// What tissue remembers, one copy, and how it relaxes.
#[derive(Clone, Copy)]
pub(crate) struct Remembered<'a> {
    pub(crate) series: Series<'a>,
    pub(crate) memory: &'a [NodeVector],
}

impl Remembered<'_> {
    /// What to add to the energy density (J/m^3) of what is at a place of a tile and belongs to a mesh element, at displacement
    /// gradient `h`.
    pub(crate) fn energy_density<L: Law>(
        &self,
        law: &L,
        place: [usize; 2],
        element: usize,
        h: DMat3,
        fibres: Option<Fibrous<'_>>,
    ) -> f64 {
        let (tissue, terms) = (self.series.of(element), self.series.terms);
        let f = DMat3::IDENTITY + h;
        let (c, j) = (f.transpose() * f, f.determinant());
        if !(j > 0.0 && tissue.terms() > 0) {
            return 0.0;
        }
        let i1 = c.x_axis.x + c.y_axis.y + c.z_axis.z;
        let x = i1 / libm::cbrt(j * j) - 3.0;
        let twice_slope = 2.0 * f64::from(law.splat::<f32>().distortion_slope(x as f32));
        let mut driving = (DMat3::IDENTITY - c.inverse() * (i1 / 3.0)) * twice_slope;
        let (mut modulus, mut instant) = (twice_slope, law.energy(x, 0.0));
        if let Some(fibres) = fibres {
            let inverse = f.inverse();
            // P = J^(-2/3) F A.
            driving += inverse * fibres.tangent(place, element, h).stress() * libm::cbrt(j * j);
            modulus += fibres.stiffness(element);
            instant += fibres.energy_density(place, element, h);
        }
        let term_energy = |term: usize| {
            let share = f64::from(tissue.share(term));
            if share <= 0.0 {
                return 0.0;
            }
            let spring = (driving * share - self.matrix(terms * place[0] + term, place[1])) * c;
            let square = spring * spring;
            (square.x_axis.x + square.y_axis.y + square.z_axis.z) / (4.0 * share * modulus)
        };
        (0..terms).map(term_energy).sum::<f64>() - f64::from(tissue.relaxed()) * instant
    }

    /// `Q` of a term of a tile, counted through all, at place `lane`.
    fn matrix(&self, term: usize, lane: usize) -> DMat3 {
        let of_term = self.memory.get(VECTORS_OF_TERM * term..).unwrap_or_default();
        let numbers: &[f32] = bytemuck::must_cast_slice(of_term);
        let at = |component: usize| f64::from(numbers.get(TILE * component + lane).copied().unwrap_or_default());
        let [xx, yy, zz, xy, yz, zx]: [f64; COMPONENTS] = core::array::from_fn(at);
        DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
    }
}
