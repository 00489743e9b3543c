//! The stress of fibres ([`crate::material::Fibres`]) and bounds of its stiffness. A term of the energy `phi(y)` with
//! `y = g I`, `I = m_p . m_q`, `m = F a` for the directions `p` and `q` of a family, twice the same, or of both, has
//!
//! ```text
//! P = phi' dy/dF,   dy/dF = X = g (m_p q^T + m_q p^T) + g' I C,   C = cof F
//! dF:A:dF = phi'' (X:dF)^2 + phi' [2 g dF p . dF q + 2 g' (m_p . dF q + m_q . dF p) (C:dF)
//!                                   + g'' I (C:dF)^2 + g' I dF:(dC/dF):dF]
//! ```
//! with `g = J^(-2/3)`. Directions are unit vectors, and those of the two families at right angles. Bounds take fibres
//! that are slack for ones at the point of being taut, as these stiffen at once.

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

use super::deformation::{Deformation, Matrix, Vector};
use super::extension::Distortion;
use super::matrix::outer;
use super::tile::vector_at;
use crate::material::{Directions, FIBRE_TERMS, FibreTerm, Fibres, Invariants, VolumeFactor};
use crate::simd::{Piece, Real, TILE, dot, unrolled};

/// Families of directions.
const FAMILIES: usize = 2;

/// The families of each term.
pub(super) const PAIRS: [[usize; 2]; FIBRE_TERMS] = [[0, 0], [1, 1], [0, 1]];

/// Directions of fibres in a tile of elements, or with nodal strain of patches, at rest: unit vectors, by family and
/// axis. Of a patch that of the mean of `V f f^T` over its elements that has the largest eigenvalue.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct FibreTile {
    directions: [[[f32; TILE]; 3]; FAMILIES],
}

impl FibreTile {
    /// Without any.
    pub const EMPTY: Self = Self { directions: [[[0.0; TILE]; 3]; FAMILIES] };

    /// Writes unit vectors to place `lane`.
    pub(crate) fn write(&mut self, lane: usize, directions: [DVec3; FAMILIES]) {
        for (rows, direction) in self.directions.iter_mut().zip(directions) {
            for (row, component) in rows.iter_mut().zip(direction.to_array()) {
                row[lane % TILE] = component as f32;
            }
        }
    }

    #[inline(always)]
    fn direction<R: Real>(&self, family: usize, first: usize) -> Vector<R> {
        let [x, y, z] = &self.directions[family % FAMILIES];
        [vector_at(x, first), vector_at(y, first), vector_at(z, first)]
    }

    /// In float64.
    pub(crate) fn at(&self, family: usize, lane: usize) -> DVec3 {
        DVec3::from_array(self.direction::<f32>(family, lane).map(f64::from))
    }
}

/// Unit vectors of the families, the second one without its part along the first; nothing where they are none.
pub(crate) fn unit_directions(given: &Directions, families: usize) -> Option<[DVec3; FAMILIES]> {
    let [fibre, sheet] = [given.fibre, given.sheet].map(|vector| DVec3::from_array(vector.map(f64::from)));
    let fibre = fibre.try_normalize()?;
    let across = sheet - fibre * fibre.dot(sheet);
    // Directions in float32 are off by rounding.
    let is_clear = across.length() > 1e-4 * sheet.length();
    match across.try_normalize().filter(|_| is_clear) {
        Some(sheet) => Some([fibre, sheet]),
        None if families < FAMILIES => Some([fibre, fibre.any_orthonormal_vector()]),
        None => None,
    }
}

/// The sum of `V f f^T` over the elements of a patch, for each family.
pub(crate) struct MeanDirections([DMat3; FAMILIES]);

/// Multiplications of a matrix by itself after which its columns are along its largest eigenvector.
const SQUARINGS: usize = 24;

impl MeanDirections {
    pub(crate) const NONE: Self = Self([DMat3::ZERO; FAMILIES]);

    pub(crate) fn add(&mut self, directions: [DVec3; FAMILIES], volume: f64) {
        for (sum, direction) in self.0.iter_mut().zip(directions) {
            *sum += outer(direction, direction) * volume;
        }
    }

    /// Unit vectors at right angles.
    pub(crate) fn directions(&self) -> [DVec3; FAMILIES] {
        let [fibre, sheet] = self.0.map(|mut sum| {
            for _ in 0..SQUARINGS {
                let largest = sum.to_cols_array().into_iter().fold(0.0, |most, entry| f64::max(most, entry.abs()));
                if largest > 0.0 {
                    sum *= 1.0 / largest;
                }
                sum = sum * sum;
            }
            let columns = [sum.x_axis, sum.y_axis, sum.z_axis];
            columns
                .into_iter()
                .fold(DVec3::ZERO, |most, column| if column.length() > most.length() { column } else { most })
        });
        let fibre = fibre.normalize_or_zero();
        let sheet = (sheet - fibre * fibre.dot(sheet)).normalize_or_zero();
        let any = || if fibre == DVec3::ZERO { DVec3::ZERO } else { fibre.any_orthonormal_vector() };
        [fibre, if sheet == DVec3::ZERO { any() } else { sheet }]
    }
}

/// The fibres of a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fibrous<'a> {
    /// By tissue; those that are not listed have none.
    pub(crate) tissues: &'a [Fibres],
    /// The tissue of each mesh element; nothing where there is one.
    pub(crate) of_element: &'a [u16],
    /// By tile of elements or patches.
    pub(crate) tiles: &'a [FibreTile],
    /// How many families of directions the tissues need.
    pub(crate) families: usize,
}

/// Fibres in a vector of elements or patches.
#[derive(Clone, Copy)]
pub(super) struct Stretch<R> {
    directions: [Vector<R>; FAMILIES],
    /// `m = F a`.
    images: [Vector<R>; FAMILIES],
    /// `I` of each term.
    products: [R; FIBRE_TERMS],
    /// What the terms depend on: `g I - 1` of a family, zero where it is slack, and `g I` of both.
    x: [R; FIBRE_TERMS],
    terms: [FibreTerm<R>; FIBRE_TERMS],
}

/// Scalars of the stress of fibres.
#[derive(Clone, Copy)]
pub(crate) struct FibreSlopes<R> {
    /// `2 phi'` of the families, and `phi'` of the term of both, Pa.
    slopes: [R; FIBRE_TERMS],
    /// `B:C`, Pa, with `B = 2 dW/dC` (isochoric).
    pub(super) inner: R,
}

impl<R: Real> FibreSlopes<R> {
    #[inline(always)]
    pub(super) fn none() -> Self {
        let zero = R::splat(0.0);
        Self { slopes: [zero; FIBRE_TERMS], inner: zero }
    }
}

/// The stress of fibres: `g (m_f b_f^T + m_s b_s^T) + g' B:C / 2 C`.
#[derive(Clone, Copy)]
pub(super) struct FibreStress<R> {
    directions: [Vector<R>; FAMILIES],
    images: [Vector<R>; FAMILIES],
    /// Columns of `B = f b_f^T + s b_s^T`, Pa.
    across: [Vector<R>; FAMILIES],
    /// `B:C`, Pa.
    pub(super) inner: R,
    families: usize,
}

impl<'a> Fibrous<'a> {
    /// The tile of elements or patches with this number.
    #[inline(always)]
    pub(super) fn tile(&self, number: usize) -> &'a FibreTile {
        self.tiles.get(number).unwrap_or(const { &FibreTile::EMPTY })
    }

    /// The fibres of mesh element `element`.
    #[inline(always)]
    pub(super) fn of(&self, element: usize) -> Fibres {
        let tissue = self.of_element.get(element).copied().unwrap_or_default();
        self.tissues.get(usize::from(tissue)).copied().unwrap_or(Fibres::NONE)
    }

    /// The terms of a vector of mesh elements.
    #[inline(always)]
    fn terms<R: Real>(&self, element: impl Fn(usize) -> usize) -> [FibreTerm<R>; FIBRE_TERMS] {
        let zero = R::splat(0.0);
        let mut terms = [FibreTerm { a: zero, b: zero }; FIBRE_TERMS];
        if self.of_element.is_empty() {
            let [one, ..] = self.tissues else { return terms };
            for (term, [a, b]) in terms.iter_mut().zip(one.terms()) {
                *term = FibreTerm { a: R::splat(a), b: R::splat(b) };
            }
            return terms;
        }
        let mut rows = [[[0.0; TILE]; 2]; FIBRE_TERMS];
        for lane in 0..R::COUNT {
            for (rows, constants) in rows.iter_mut().zip(self.of(element(lane)).terms()) {
                for (row, constant) in rows.iter_mut().zip(constants) {
                    row[lane % TILE] = constant;
                }
            }
        }
        for (term, [a, b]) in terms.iter_mut().zip(&rows) {
            *term = FibreTerm { a: vector_at(a, 0), b: vector_at(b, 0) };
        }
        terms
    }

    /// The fibres in a vector of elements or patches from place `first` of a tile on, with `g` and `g - 1`.
    #[inline(always)]
    pub(super) fn stretch<R: Real>(
        &self,
        tile: &FibreTile,
        first: usize,
        element: impl Fn(usize) -> usize,
        h: &Matrix<R>,
        [g, less_one]: [R; 2],
    ) -> Stretch<R> {
        let zero = R::splat(0.0);
        let none = [zero; 3];
        let mut stretch = Stretch {
            directions: [none; FAMILIES],
            images: [none; FAMILIES],
            products: [zero; FIBRE_TERMS],
            x: [zero; FIBRE_TERMS],
            terms: self.terms(element),
        };
        let mut moved = [none; FAMILIES];
        unrolled!(family < FAMILIES => {
            if family < self.families {
                let direction = tile.direction::<R>(family, first);
                let change = [dot(h[0], direction), dot(h[1], direction), dot(h[2], direction)];
                let mut twice = none;
                for axis in 0..3 {
                    stretch.images[family][axis] = direction[axis] + change[axis];
                    twice[axis] = direction[axis] + stretch.images[family][axis];
                }
                // I - 1 without cancellation, as a unit vector has no other length.
                let square = dot(twice, change);
                stretch.products[family] = square + R::splat(1.0);
                stretch.x[family] = g.fused(square, less_one).max(zero);
                (stretch.directions[family], moved[family]) = (direction, change);
            }
        });
        if self.families == FAMILIES {
            // At right angles at rest.
            let [[f, s], [df, ds]] = [stretch.directions, moved];
            let shear = dot(f, ds) + (dot(df, s) + dot(df, ds));
            (stretch.products[2], stretch.x[2]) = (shear, g * shear);
        }
        stretch
    }

    /// The scalars of the stress, and how close the law is to where it is continued.
    #[inline(always)]
    pub(super) fn slopes<R: Real>(&self, stretch: &Stretch<R>) -> (FibreSlopes<R>, R) {
        let Stretch { products, x, terms, .. } = stretch;
        let mut all = FibreSlopes::none();
        let [slope, mut close] = terms[0].slope(x[0]);
        all.slopes[0] = slope + slope;
        all.inner = all.slopes[0] * products[0];
        if self.families == FAMILIES {
            let [slope, of_sheets] = terms[1].slope(x[1]);
            let [shear, of_both] = terms[2].slope(x[2]);
            (all.slopes[1], all.slopes[2]) = (slope + slope, shear);
            let of_coupling = (shear + shear).fused(products[2], all.inner);
            all.inner = all.slopes[1].fused(products[1], of_coupling);
            close = close.max(of_sheets.max(of_both));
        }
        (all, close)
    }

    /// A bound of `dF:A:dF / |dF|^2` (Pa) that takes little time: with `|C|^2 <= I1^2 / 3`, `|dF:dC/dF:dF| <= (I1 / 3 + 1)
    /// |dF|^2`, and with `M = |m_p| + |m_q|` `2 M |C| <= c M^2 + |C|^2 / c`, where `M^2 <= 2 |m_p|^2 + 2 |m_q|^2`.
    #[inline(always)]
    pub(super) fn scalar_bound<R: Real>(
        &self,
        stretch: &Stretch<R>,
        local: &Distortion<R>,
        invariants: Invariants<R>,
    ) -> R {
        /// `|C| / M` at rest.
        const RATIO: f32 = 0.866_025_4;
        let (one, two, third) = (R::splat(1.0), R::splat(2.0), R::splat(1.0 / 3.0));
        let (g, dg) = (local.factor, local.slope);
        let steep = dg.abs();
        let i1 = invariants.i + R::splat(3.0);
        let cofactor = i1 * i1 * third;
        let reach = i1.fused(third, one);
        let ddg = R::splat(10.0 / 9.0) * g * (local.inverse * local.inverse);
        let volume_ratio = one + invariants.j;
        let mut bound = R::splat(0.0);
        unrolled!(term < FIBRE_TERMS => {
            if term == 0 || self.families == FAMILIES {
                let [p, q] = PAIRS[term];
                let [slope, curvature] = stretch.terms[term].slope_and_curvature(stretch.x[term]);
                let product = stretch.products[term];
                let squares = stretch.products[p] + stretch.products[q];
                let along_c = dg * product;
                let same = if p == q { two } else { R::splat(0.0) };
                // |X|^2.
                let square = (g * g).fused(
                    same.fused(product, squares),
                    along_c * (two * g * same).fused(volume_ratio, along_c * cofactor),
                );
                let size = product.abs();
                let mixed = steep * R::splat(RATIO).fused(squares + squares, cofactor * R::splat(1.0 / RATIO));
                let geometric = two.fused(g, (steep * size).fused(reach, ddg * size * cofactor)) + mixed;
                bound = curvature.fused(square, slope.abs().fused(geometric, bound));
            }
        });
        bound
    }

    /// The stress from its scalars.
    #[inline(always)]
    pub(super) fn stress<R: Real>(
        &self,
        tile: &FibreTile,
        first: usize,
        scalars: &FibreSlopes<R>,
        h: &Matrix<R>,
    ) -> FibreStress<R> {
        let none = [R::splat(0.0); 3];
        let FibreSlopes { slopes, inner } = *scalars;
        let mut stress = FibreStress {
            directions: [none; FAMILIES],
            images: [none; FAMILIES],
            across: [none; FAMILIES],
            inner,
            families: self.families,
        };
        unrolled!(family < FAMILIES => {
            if family < self.families {
                let direction = tile.direction::<R>(family, first);
                for axis in 0..3 {
                    stress.images[family][axis] = direction[axis] + dot(h[axis], direction);
                    stress.across[family][axis] = slopes[family] * direction[axis];
                }
                stress.directions[family] = direction;
            }
        });
        if self.families == FAMILIES {
            for axis in 0..3 {
                let [f, s] = [stress.directions[0][axis], stress.directions[1][axis]];
                stress.across[0][axis] = slopes[2].fused(s, stress.across[0][axis]);
                stress.across[1][axis] = slopes[2].fused(f, stress.across[1][axis]);
            }
        }
        stress
    }

    /// Bounds of the stiffness of a vector of elements or patches.
    #[inline(always)]
    pub(super) fn bounds<R: Real>(
        &self,
        tile: &FibreTile,
        first: usize,
        element: impl Fn(usize) -> usize,
        deformation: &Deformation<R>,
    ) -> FibreBounds<R> {
        let mut elements = [0; TILE];
        for (lane, number) in elements.iter_mut().enumerate().take(R::COUNT) {
            *number = element(lane);
        }
        R::run_piece(BoundsOf { fibres: *self, tile, first, elements: &elements, deformation })
    }

    /// Energy density (J/m^3) at place `lane` of a tile, which belongs to mesh element `element`, at the displacement
    /// gradient `h`.
    pub(crate) fn energy_density(&self, [tile, lane]: [usize; 2], element: usize, h: DMat3) -> f64 {
        self.of(element).energy(self.invariants([tile, lane], h))
    }

    /// The stiffness of the fibres in mesh element `element` at rest, Pa: that of its terms added up.
    pub(crate) fn stiffness(&self, element: usize) -> f64 {
        self.of(element).terms().iter().map(|[a, _]| f64::from(*a)).sum()
    }

    /// `g I - 1` of each family and `g I` of both, in float64.
    fn invariants(&self, place: [usize; 2], h: DMat3) -> [f64; FIBRE_TERMS] {
        let [g, less_one] = factor_at(h);
        let ([f, s], [df, ds]) = self.moved(place, h);
        let square = |a: DVec3, da: DVec3| g * (2.0 * a + da).dot(da) + less_one;
        [square(f, df), square(s, ds), g * (f.dot(ds) + df.dot(s) + df.dot(ds))]
    }

    /// Directions and their changes by `h`.
    fn moved(&self, [tile, lane]: [usize; 2], h: DMat3) -> ([DVec3; FAMILIES], [DVec3; FAMILIES]) {
        let directions = [0, 1].map(|family| self.tile(tile).at(family, lane));
        (directions, directions.map(|direction| h * direction))
    }
}

/// `g` and `g - 1` of a displacement gradient, in float64.
fn factor_at(h: DMat3) -> [f64; 2] {
    let (i, j, _) = super::fields::invariants(h);
    // Directions count where tissue is sound: the digits of float32 are enough for the rest.
    let floor = f64::from(crate::material::J_FLOOR) - 1.0;
    if j > floor {
        let less_one = libm::expm1(-2.0 / 3.0 * libm::log1p(j));
        return [1.0 + less_one, less_one];
    }
    let factor = VolumeFactor::new(Invariants { i: i as f32, j: j as f32 });
    [factor.g.into(), factor.less_one.into()]
}

/// See [`Fibrous::bounds`].
struct BoundsOf<'a, R> {
    fibres: Fibrous<'a>,
    tile: &'a FibreTile,
    first: usize,
    /// Of the vector.
    elements: &'a [usize; TILE],
    deformation: &'a Deformation<R>,
}

impl<R: Real> Piece for BoundsOf<'_, R> {
    type Output = FibreBounds<R>;

    #[inline(always)]
    fn run(self) -> FibreBounds<R> {
        let Self { fibres, tile, first, elements, deformation } = self;
        let factor = VolumeFactor::new(deformation.invariants);
        let element = |lane: usize| elements[lane % TILE];
        let stretch = fibres.stretch(tile, first, element, &deformation.h, [factor.g, factor.less_one]);
        FibreBounds::new(stretch, &factor, deformation)
    }
}

impl<R: Real> FibreStress<R> {
    /// Adds `F B` times `g` to a stress, Pa.
    #[inline(always)]
    pub(super) fn add_to(&self, stress: &mut Matrix<R>, g: R) {
        unrolled!(family < FAMILIES => {
            if family < self.families {
                let [x, y, z] = self.across[family];
                let across = [g * x, g * y, g * z];
                for i in 0..3 {
                    for j in 0..3 {
                        stress[i][j] = self.images[family][i].fused(across[j], stress[i][j]);
                    }
                }
            }
        });
    }

    /// `B`, by components xx, yy, zz, xy, yz, zx, Pa.
    #[inline(always)]
    pub(super) fn symmetric(&self) -> [R; 6] {
        let entry = |i: usize, j: usize| {
            self.directions[0][i].fused(self.across[0][j], self.directions[1][i] * self.across[1][j])
        };
        [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(2, 0)]
    }
}

/// Bounds of the stiffness of fibres: `isotropic |dF|^2 + volume (C:dF)^2 + sum stiffening (X:dF)^2`.
#[derive(Clone, Copy)]
pub(super) struct FibreBounds<R> {
    stretch: Stretch<R>,
    /// Pa.
    pub(super) isotropic: R,
    pub(super) volume: R,
    pub(super) stiffening: [R; FIBRE_TERMS],
    /// `g`, and `g' I` of each term.
    g: R,
    along_c: [R; FIBRE_TERMS],
    /// `|X|^2` of each term.
    squares: [R; FIBRE_TERMS],
    /// In the bound that rotations do not feel: of `|D|^2`, `(tr D)^2` and `|L|^2`, with `L = dF F^-1`.
    pub(super) spatial: [R; 3],
}

impl<R: Real> FibreBounds<R> {
    pub(super) const TERMS: usize = FIBRE_TERMS;

    /// Of the products of two numbers `2 x y <= r x^2 + y^2 / r` is taken with `r = |C| / (|m_p| + |m_q|)`; `|dF:dC/dF:dF|
    /// <= 2 (1 + |H|) |dF|^2`. For the other bound `X:dF = 2 g m_p . dev D m_q`, and of what `phi'` multiplies the
    /// terms with `tr D` are split so that for one family nothing of `(tr D)^2` is left.
    #[inline(always)]
    fn new(stretch: Stretch<R>, factor: &VolumeFactor<R>, deformation: &Deformation<R>) -> Self {
        let (zero, one, two) = (R::splat(0.0), R::splat(1.0), R::splat(2.0));
        let (g, dg, ddg) = (factor.g, factor.slope, factor.curvature());
        let h = &deformation.h;
        let reach = one + (dot(h[0], h[0]) + dot(h[1], h[1]) + dot(h[2], h[2])).sqrt();
        let mut cofactor = zero;
        for i in 0..3 {
            for j in 0..3 {
                let c = deformation.cofactor(i, j);
                cofactor = cofactor + c * c;
            }
        }
        let length_c = cofactor.max(R::splat(1e-12)).sqrt();
        let volume_ratio = one + deformation.invariants.j;
        let [f, s] = stretch.images;
        let lengths = [dot(f, f).sqrt(), dot(s, s).sqrt()];
        let mut bounds = Self {
            stretch,
            isotropic: zero,
            volume: zero,
            stiffening: [zero; FIBRE_TERMS],
            g,
            along_c: [zero; FIBRE_TERMS],
            squares: [zero; FIBRE_TERMS],
            spatial: [zero; 3],
        };
        unrolled!(term < FIBRE_TERMS => {
            let [p, q] = PAIRS[term];
            let [slope, curvature] = stretch.terms[term].slope_and_curvature(stretch.x[term]);
            let (slope, product) = (slope.abs(), stretch.products[term].abs());
            let along_c = dg * stretch.products[term];
            let (sum, both) = (lengths[p] + lengths[q], lengths[p] * lengths[q]);
            let mixed = slope * dg.abs() * sum;
            bounds.isotropic =
                bounds.isotropic + slope * (two * g + two * dg.abs() * product * reach) + mixed * length_c;
            bounds.volume = bounds.volume + slope * ddg * product + mixed.divide(length_c);
            let squares = lengths[p] * lengths[p] + lengths[q] * lengths[q];
            // p . q is one in a family and zero between both.
            let same = if p == q { two } else { zero };
            let own = g * g * (squares + same * stretch.products[term]);
            bounds.squares[term] =
                (own + two * g * along_c * same * volume_ratio + along_c * along_c * cofactor).max(zero);
            (bounds.stiffening[term], bounds.along_c[term]) = (curvature, along_c);
            let shape = both * both * R::splat(0.5) + product * product * R::splat(1.0 / 6.0);
            let four = R::splat(4.0);
            let scale = g * slope;
            bounds.spatial[0] = bounds.spatial[0]
                + curvature * (four * g * g * shape)
                + scale * (four * shape.divide(both.max(R::splat(1e-12))) + R::splat(2.0 / 3.0) * product);
            bounds.spatial[1] = bounds.spatial[1] + R::splat(4.0 / 9.0) * scale * (both - product).max(zero);
            bounds.spatial[2] = bounds.spatial[2] + two * scale * both;
        });
        bounds
    }

    /// The image `X a` of a shape function gradient `a`, with `C a`.
    #[inline(always)]
    pub(super) fn image(&self, term: usize, gradient: Vector<R>, of_cofactor: Vector<R>) -> Vector<R> {
        let term = term % FIBRE_TERMS;
        let (p, q) = (PAIRS[term][0] % FAMILIES, PAIRS[term][1] % FAMILIES);
        let Stretch { directions, images, .. } = &self.stretch;
        let [by_q, by_p] = [self.g * dot(directions[q], gradient), self.g * dot(directions[p], gradient)];
        let mut image = of_cofactor;
        for axis in 0..3 {
            let of_directions = images[p][axis].fused(by_q, images[q][axis] * by_p);
            image[axis] = self.along_c[term].fused(of_cofactor[axis], of_directions);
        }
        image
    }

    /// `isotropic` with the stiffening: all but the volume's part.
    #[inline(always)]
    pub(super) fn of_shape(&self) -> R {
        let mut sum = self.isotropic;
        for term in 0..FIBRE_TERMS {
            sum = self.stiffening[term].fused(self.squares[term], sum);
        }
        sum
    }
}
