//! Stress that depends on the past: a Prony series ([`Prony`]) on the isochoric part of any law, at finite strain
//! (Simo & Hughes 1998, "Computational Inelasticity", section 10.3). With `A = DEV[2 W' I]`, the stress of distortion
//! of the law in the reference frame, each term keeps
//!
//! ```text
//! Q_i' + Q_i / tau_i = g_i / tau_i A,    P = P(law) - J^(-2/3) F DEV[sum_i Q_i],   DEV[X] = X - (X:C) C^-1 / 3
//! ```
//! **In time.** The step keeps `Q` at the middle of the last step and takes `A` as that of `t_n` from there to the
//! middle of the next one: exact for constant `A`, second order in the step, and no older stress is needed,
//!
//! ```text
//! Q_n = q + (1 - e^(-h / tau)) (g A_n - q),   q <- q + (1 - e^(-(h + h') / tau)) (g A_n - q)
//! ```
//! with the halves `h` and `h'` of the last step and of this one. An infinite `h` is a body that has had time to relax.
//!
//! **Stability.** For linear motion the stress of a term at `z = e^(i w)` is `k (1 - g (1 - b) - g b (1 - b^2) / (z -
//! b^2))` with `b = e^(-h / tau)`. Its imaginary part is not negative for `0 < w < pi`: a term only takes energy, and a
//! root can leave the unit circle at `z = -1` alone, where the factor is `1 - g (1 - b)^2 / (1 + b^2) <= 1`. So the
//! critical step is no shorter than that of the law.
//!
//! **Rounding.** Steps may be a hundred thousand times shorter than `tau`, and a sum swallows what is less than half a
//! unit in its last place. So a part of about a unit is added, another in each step, by which sums are rounded up as often
//! as is right in the mean.
//!
//! **Memory.** Two copies of six numbers for each term and element, or patch with nodal strain: steps read the one and
//! write the other. So a step that is refused leaves no trace, and elements that two threads compute are written by one.

use bytemuck::must_cast_slice;

use crate::material::{MOST_TERMS, Prony};
use crate::simd::{NodeVector, Real, TILE, dot};

use super::deformation::{Deformation, Matrix};
use super::extension::{Distortion, place_of};
use super::fibres::FibreStress;
use super::tile::{vector_at, write_at};

/// Components of a symmetric matrix: xx, yy, zz, xy, yz, zx.
pub(super) const COMPONENTS: usize = 6;

/// Vectors of one copy of the memory of a term of a tile.
pub(crate) const VECTORS_OF_TERM: usize = COMPONENTS * TILE / 4;

/// Least share of the stabilising energy of nodal strain that stays, see [`Relaxing::stabilising`].
const LEAST_STABILISING: f32 = 0.5;

/// The series of all tissues, and how far a step goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series<'a> {
    /// By tissue; those that are not listed do not relax.
    pub(crate) tissues: &'a [Prony],
    /// The tissue of each mesh element; nothing where there is one.
    pub(crate) of_element: &'a [u16],
    /// Terms of the tissue that has most.
    pub(crate) terms: usize,
    /// `h` and `h'`, s.
    pub(crate) halves: [f32; 2],
    /// Number of the step, which chooses the part of a unit.
    pub(crate) step: u64,
}

/// Tissue that relaxes: [`Series`] with the memory of its elements.
pub(crate) struct Relaxing<'a> {
    series: Series<'a>,
    /// Whether all elements are of one tissue.
    alike: bool,
    /// Of the first tissues.
    listed: [OfTissue; MOST_LISTED],
    /// A part of about a unit in the last place, over the number itself.
    part: f32,
    /// Where the table of tiles begins in memory.
    table: usize,
    before: &'a [[f32; TILE]],
    after: &'a mut [[f32; TILE]],
    /// The first tile whose memory is in `after`.
    own: usize,
}

impl<'a> Relaxing<'a> {
    /// For elements in the tiles of a table: what they remember before the step, and after it for those from tile `own`
    /// on that are written here.
    pub(crate) fn new<T>(
        series: Series<'a>,
        table: &[T],
        before: &'a [NodeVector],
        after: &'a mut [NodeVector],
        own: usize,
    ) -> Self {
        /// Multiples of the golden ratio and of the root of two spread evenly, however many there are.
        const SPREAD: [u64; 2] = [0x9e37_79b9_7f4a_7c15, 0x6a09_e667_f3bc_c909];
        let evenly = |by: u64| (series.step.wrapping_mul(by) >> 40) as f32 / (1_u32 << 24) as f32 - 0.5;
        // The sum of two has no mean error where a unit is not what it is taken for, as one alone has.
        let part = f32::EPSILON * (evenly(SPREAD[0]) + evenly(SPREAD[1]));
        let mut listed = [OfTissue::NONE; MOST_LISTED];
        for (of, tissue) in listed.iter_mut().zip(series.tissues) {
            *of = OfTissue::new(tissue, series.halves);
        }
        let alike = series.of_element.is_empty();
        let (before, after): (&[f32], &mut [f32]) = (must_cast_slice(before), bytemuck::must_cast_slice_mut(after));
        let (before, after) = (before.as_chunks().0, after.as_chunks_mut().0);
        Self { series, alike, listed, part, table: table.as_ptr().addr(), before, after, own }
    }

    /// The tissues of a vector of elements.
    #[inline(always)]
    fn tissues<R: Real>(&self, element: impl Fn(usize) -> usize) -> [usize; TILE] {
        let mut tissues = [0; TILE];
        if !self.alike {
            for (lane, tissue) in tissues.iter_mut().enumerate().take(R::COUNT) {
                *tissue = self.series.tissue(element(lane));
            }
        }
        tissues
    }

    /// Numbers of each of these tissues.
    #[inline(always)]
    fn numbers<R: Real, const N: usize>(&self, tissues: &[usize; TILE], of: impl Fn(&OfTissue) -> [f32; N]) -> [R; N] {
        if self.alike {
            return of(&self.listed[0]).map(R::splat);
        }
        let mut rows = [[0.0; TILE]; N];
        for (lane, &tissue) in tissues.iter().enumerate().take(R::COUNT) {
            let numbers = match self.listed.get(tissue) {
                Some(listed) => of(listed),
                None => of(&self.not_listed(tissue)),
            };
            for (row, number) in rows.iter_mut().zip(numbers) {
                row[lane % TILE] = number;
            }
        }
        let mut vectors = [R::splat(0.0); N];
        for (vector, row) in vectors.iter_mut().zip(&rows) {
            *vector = vector_at(row, 0);
        }
        vectors
    }

    #[cold]
    fn not_listed(&self, tissue: usize) -> OfTissue {
        let series = self.series.tissues.get(tissue).copied().unwrap_or(Prony::NONE);
        OfTissue::new(&series, self.series.halves)
    }
}

/// Tissues whose numbers are computed once for all elements, not for each.
const MOST_LISTED: usize = 32;

/// What a step needs of a tissue.
#[derive(Clone, Copy)]
struct OfTissue {
    /// Of each term `g`, and `1 - e^(-h / tau)` of the first half and of both.
    terms: [[f32; 3]; MOST_TERMS],
    /// The share of the stabilising modulus that stays.
    stabilising: f32,
}

impl OfTissue {
    const NONE: Self = Self { terms: [[0.0; 3]; MOST_TERMS], stabilising: 1.0 };

    fn new(series: &Prony, [first, second]: [f32; 2]) -> Self {
        // Finite, so that a rate of zero makes no NaN of it.
        let spans = [first, first + second].map(|span| span.min(f32::MAX));
        let of_term = |term: usize| {
            let [at_step, over_step] = spans.map(|span| -libm::expm1f(-span * series.rate(term)));
            [series.share(term), at_step, over_step]
        };
        Self { terms: core::array::from_fn(of_term), stabilising: stabilising_share(series) }
    }
}

/// The share of the stabilising modulus of nodal strain that stays.
fn stabilising_share(series: &Prony) -> f32 {
    (1.0 - series.relaxed()).max(LEAST_STABILISING)
}

impl Series<'_> {
    /// The tissue of mesh element `element`.
    #[inline(always)]
    fn tissue(&self, element: usize) -> usize {
        self.of_element.get(element).copied().unwrap_or_default().into()
    }

    /// That of mesh element `element`.
    pub(super) fn of(&self, element: usize) -> Prony {
        self.tissues.get(self.tissue(element)).copied().unwrap_or(Prony::NONE)
    }

    /// See [`stabilising_share`].
    pub(super) fn stabilising(&self, element: usize) -> f32 {
        stabilising_share(&self.of(element))
    }
}

/// A component of `M^T M + M + M^T`.
#[inline(always)]
fn square<R: Real>(m: &Matrix<R>, i: usize, j: usize) -> R {
    m[0][i].fused(m[0][j], m[1][i].fused(m[1][j], m[2][i].fused(m[2][j], m[i][j] + m[j][i])))
}

impl<R: Real> Distortion<R> {
    /// Adds to `A` what fibres add: `B - B:C / (3 J^2) N^T N`.
    #[inline(always)]
    fn add_fibres(&self, driving: &mut [R; COMPONENTS], fibres: &FibreStress<R>, m: &Matrix<R>) {
        let one = R::splat(1.0);
        let less = fibres.inner * (self.inverse * self.inverse) * R::splat(-1.0 / 3.0);
        let own = fibres.symmetric();
        let squares = [
            square(m, 0, 0) + one,
            square(m, 1, 1) + one,
            square(m, 2, 2) + one,
            square(m, 0, 1),
            square(m, 1, 2),
            square(m, 2, 0),
        ];
        for component in 0..COMPONENTS {
            driving[component] = driving[component] + less.fused(squares[component], own[component]);
        }
    }

    /// `J^2 A / (2 W')` from `M = cof F - I` without cancellation: `J^2 I - I1 / 3 N^T N` with `N = I + M`.
    #[inline(always)]
    fn shape(&self, m: &Matrix<R>, i: R) -> [R; COMPONENTS] {
        let strain = i * R::splat(1.0 / 3.0);
        let factor = -(R::splat(1.0) + strain);
        let diagonal = self.change.fused(self.change, (self.change + self.change) - strain);
        [
            factor.fused(square(m, 0, 0), diagonal),
            factor.fused(square(m, 1, 1), diagonal),
            factor.fused(square(m, 2, 2), diagonal),
            factor * square(m, 0, 1),
            factor * square(m, 1, 2),
            factor * square(m, 2, 0),
        ]
    }
}

impl Relaxing<'_> {
    /// `sum_i Q_i` at present, from the memory of a vector of elements and `A` (Pa), and the memory after the step.
    #[inline(always)]
    fn relax<R: Real, T>(
        &mut self,
        (tile, first): (&T, usize),
        element: impl Fn(usize) -> usize,
        driving: &[R; COMPONENTS],
    ) -> [R; COMPONENTS] {
        let tile = place_of(self.table, tile);
        let (part, terms) = (R::splat(self.part), self.series.terms.min(MOST_TERMS));
        let mut sum = [R::splat(0.0); COMPONENTS];
        let tissues = self.tissues::<R>(element);
        for term in 0..terms {
            let [share, at_step, over_step] = self.numbers::<R, 3>(&tissues, |of| of.terms[term % MOST_TERMS]);
            let rows = COMPONENTS * (terms * tile + term);
            let before: Option<&[_; COMPONENTS]> = self.before.get(rows..).and_then(|rows| rows.first_chunk());
            let own = rows.wrapping_sub(COMPONENTS * terms * self.own);
            let after: Option<&mut [_; COMPONENTS]> = self.after.get_mut(own..).and_then(|rows| rows.first_chunk_mut());
            let Some(before) = before else { continue };
            let mut next = [R::splat(0.0); COMPONENTS];
            for component in 0..COMPONENTS {
                let q = vector_at::<R>(&before[component], first);
                let missing = share.fused(driving[component], -q);
                sum[component] = at_step.fused(missing, sum[component] + q);
                next[component] = q + over_step.fused(missing, part * q);
            }
            if let Some(after) = after {
                for component in 0..COMPONENTS {
                    write_at(&mut after[component], first, next[component]);
                }
            }
        }
        sum
    }
}

impl Relaxing<'_> {
    /// That energy has no memory. It is of the tissue at rest, so that bodies rest as the softened law would, but of no
    /// less than half the law's, as rough motion is hardly held by less. Bounds are those of the whole: what is taken off
    /// is never negative.
    #[inline(always)]
    pub(super) fn stabilising<R: Real>(&self, modulus: R, element: impl Fn(usize) -> usize) -> R {
        let [share] = self.numbers::<R, 1>(&self.tissues::<R>(element), |of| [of.stabilising]);
        modulus * share
    }

    /// With `q = -J^(-2/3) sum_i Q_i` the stress is `p1 (F - N) + (s - C:q / (3 J)) N + F q`. Every product below is small
    /// at small strain. `fibres` are a part of what relaxes.
    #[inline(always)]
    pub(super) fn stress<R: Real, T>(
        &mut self,
        place: (&T, usize),
        element: impl Fn(usize) -> usize,
        deformation: &Deformation<R>,
        [p1, s]: [R; 2],
        local: &Distortion<R>,
        fibres: Option<&FibreStress<R>>,
    ) -> Matrix<R> {
        let h = deformation.h;
        let mut m = h;
        for i in 0..3 {
            for j in 0..3 {
                m[i][j] = deformation.cofactor_change(i, j);
            }
        }
        let i1 = deformation.invariants.i;
        let mut driving = local.shape(&m, i1);
        for component in &mut driving {
            *component = local.scale * *component;
        }
        if let Some(fibres) = fibres {
            local.add_fibres(&mut driving, fibres, &m);
        }
        let sum = self.relax(place, element, &driving);
        let minus = -local.factor;
        let [xx, yy, zz, xy, yz, zx] = sum.map(|component| minus * component);
        let q = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
        let inner = [[xx + p1, xy, zx], [xy, yy + p1, yz], [zx, yz, zz + p1]];
        let mut stress = q;
        // F:(p1 H) is known: what is left of F:stress is C:q.
        let mut across = [-(p1 * (i1 - deformation.trace)), zx, zx];
        for i in 0..3 {
            for j in 0..3 {
                stress[i][j] =
                    h[i][0].fused(inner[0][j], h[i][1].fused(inner[1][j], h[i][2].fused(inner[2][j], q[i][j])));
            }
            let row = dot(h[i], stress[i]) + stress[i][i];
            across[i] = if i == 0 { across[i] + row } else { row };
        }
        let across = across[0] + (across[1] + across[2]);
        let s = (local.inverse * R::splat(-1.0 / 3.0)).fused(across, s);
        let along = s - p1;
        for i in 0..3 {
            for j in 0..3 {
                stress[i][j] = along.fused(m[i][j], stress[i][j]);
            }
            stress[i][i] = stress[i][i] + s;
        }
        stress
    }
}
