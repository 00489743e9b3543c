//! What the stress of elements has besides that of a law that is the same in all directions and of the present alone:
//! fibres ([`super::fibres`]) and relaxation ([`super::relaxation`]). Loops over elements are compiled without it, for each
//! law, and once with it, for a law known at run time; what a scene does not have of it is then one branch for a vector of
//! elements.

use super::deformation::{Deformation, Matrix};
use super::fibres::{FibreSlopes, Fibrous};
use super::relaxation::Relaxing;
use super::tile::{vector_at, write_at};
use crate::material::{Invariants, LawState};
use crate::simd::{Real, TILE};

/// Floating-point operations of what an element or a patch has of it, with so many families of fibres and terms of
/// relaxation. One family: deformation 27, exponential and slope 35, stress 48; both with their coupling 286. Relaxation
/// 133, each of its terms 54.
pub(crate) const fn extension_operations(families: usize, terms: usize) -> u32 {
    let of_fibres = match families {
        0 => 0,
        1 => 110,
        _ => 286,
    };
    if terms == 0 { of_fibres } else { of_fibres + 133 + 54 * terms as u32 }
}

/// See the module.
pub(crate) trait Extension {
    /// Whether there is anything.
    const EXTENDS: bool;

    /// What of the law it needs to know of a vector of elements.
    type Local<R: Real>: Copy;

    /// What the first of two passes finds for the second one.
    type Prepared<R: Real>: Copy;

    /// Of elements at rest.
    fn at_rest<R: Real>() -> (Self::Local<R>, Self::Prepared<R>);

    /// Of elements in this state.
    fn of_law<R: Real>(local: &LawState<R>) -> Self::Local<R>;

    /// The modulus of the stabilising energy of nodal strain, Pa, from that of the law.
    fn stabilising<R: Real>(&self, modulus: R, element: impl Fn(usize) -> usize) -> R;

    /// Whether the first pass is to be run at all.
    fn prepares(&self) -> bool;

    /// The first of two passes over a few vectors of elements, those from place `first` of a tile on, of which `element`
    /// gives the mesh element in a lane: a pass of its own, so that a processor can overlap the long sequences of
    /// dependent operations of several vectors. Gives as well what the scalar stiffness bound gains, Pa, if it is asked for:
    /// a bound of `dF:A:dF / |dF|^2`.
    fn prepare<R: Real, T>(
        &mut self,
        place: (&T, usize),
        element: impl Fn(usize) -> usize,
        h: &Matrix<R>,
        invariants: Invariants<R>,
        with_bound: bool,
        local: &Self::Local<R>,
    ) -> (Self::Prepared<R>, R);

    /// The first Piola-Kirchhoff stress, Pa, from the law's `p1` and `s` ([`Deformation::stress`]): the second pass, once
    /// for each vector of elements.
    fn stress<R: Real, T>(
        &mut self,
        place: (&T, usize),
        element: impl Fn(usize) -> usize,
        deformation: &Deformation<R>,
        scalars: [R; 2],
        local: &Self::Local<R>,
        prepared: &Self::Prepared<R>,
    ) -> Matrix<R>;

    /// How close elements came to where its laws are continued: above 1 some are beyond.
    fn saturation(&self) -> f32;
}

/// There is nothing.
#[derive(Clone, Copy)]
pub struct NoExtension;

impl Extension for NoExtension {
    const EXTENDS: bool = false;

    type Local<R: Real> = ();
    type Prepared<R: Real> = ();

    #[inline(always)]
    fn at_rest<R: Real>() -> ((), ()) {
        ((), ())
    }

    #[inline(always)]
    fn of_law<R: Real>(_: &LawState<R>) {}

    #[inline(always)]
    fn stabilising<R: Real>(&self, modulus: R, _: impl Fn(usize) -> usize) -> R {
        modulus
    }

    #[inline(always)]
    fn prepares(&self) -> bool {
        false
    }

    #[inline(always)]
    fn prepare<R: Real, T>(
        &mut self,
        _: (&T, usize),
        _: impl Fn(usize) -> usize,
        _: &Matrix<R>,
        _: Invariants<R>,
        _: bool,
        (): &(),
    ) -> ((), R) {
        ((), R::splat(0.0))
    }

    #[inline(always)]
    fn stress<R: Real, T>(
        &mut self,
        _: (&T, usize),
        _: impl Fn(usize) -> usize,
        deformation: &Deformation<R>,
        [p1, s]: [R; 2],
        (): &(),
        (): &(),
    ) -> Matrix<R> {
        deformation.stress(p1, s)
    }

    #[inline(always)]
    fn saturation(&self) -> f32 {
        f32::NEG_INFINITY
    }
}

/// What an extension needs to know of the law.
#[derive(Clone, Copy)]
pub(crate) struct Distortion<R> {
    /// `2 W' / J^2`, Pa.
    pub(super) scale: R,
    /// `g = J^(-2/3)`, `g'` and `g - 1`.
    pub(super) factor: R,
    pub(super) slope: R,
    pub(super) less_one: R,
    /// `J - 1` and `1 / J`, `J` no less than [`crate::material::J_FLOOR`].
    pub(super) change: R,
    pub(super) inverse: R,
}

/// The fibres and the relaxation of a scene.
pub(crate) struct Extended<'a> {
    fibres: Option<Fibrous<'a>>,
    relaxing: Option<Relaxing<'a>>,
    /// Where the table of tiles begins in memory.
    table: usize,
    /// See [`Extension::saturation`], by lane.
    saturation: [f32; TILE],
}

impl<'a> Extended<'a> {
    /// For elements in the tiles of a table.
    pub(crate) fn new<T>(table: &[T], fibres: Option<Fibrous<'a>>, relaxing: Option<Relaxing<'a>>) -> Self {
        let table = table.as_ptr().addr();
        Self { fibres, relaxing, table, saturation: [f32::NEG_INFINITY; TILE] }
    }
}

/// The place of an item in the table that begins at address `table`.
#[inline(always)]
pub(super) fn place_of<T>(table: usize, item: &T) -> usize {
    core::ptr::from_ref(item).addr().wrapping_sub(table) / size_of::<T>().max(1)
}

/// The place of an item in its table.
#[cfg(feature = "std")]
pub(crate) fn place_in<T>(table: &[T], item: &T) -> usize {
    place_of(table.as_ptr().addr(), item)
}

impl Extension for Extended<'_> {
    const EXTENDS: bool = true;

    type Local<R: Real> = Distortion<R>;
    type Prepared<R: Real> = FibreSlopes<R>;

    #[inline(always)]
    fn at_rest<R: Real>() -> (Distortion<R>, FibreSlopes<R>) {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let slope = R::splat(-2.0 / 3.0);
        let local = Distortion { scale: zero, factor: one, slope, less_one: zero, change: zero, inverse: one };
        (local, FibreSlopes::none())
    }

    #[inline(always)]
    fn of_law<R: Real>(local: &LawState<R>) -> Distortion<R> {
        let ([factor, slope, _], [change, inverse]) = (local.volume_factor(), local.clamped_volume());
        let scale = (local.slope + local.slope) * (inverse * inverse);
        Distortion { scale, factor, slope, less_one: local.less_one(), change, inverse }
    }

    #[inline(always)]
    fn stabilising<R: Real>(&self, modulus: R, element: impl Fn(usize) -> usize) -> R {
        match &self.relaxing {
            Some(relaxing) => relaxing.stabilising(modulus, element),
            None => modulus,
        }
    }

    #[inline(always)]
    fn prepares(&self) -> bool {
        self.fibres.is_some()
    }

    #[inline(always)]
    fn prepare<R: Real, T>(
        &mut self,
        (tile, first): (&T, usize),
        element: impl Fn(usize) -> usize,
        h: &Matrix<R>,
        invariants: Invariants<R>,
        with_bound: bool,
        local: &Distortion<R>,
    ) -> (FibreSlopes<R>, R) {
        let mut bound = R::splat(0.0);
        let Some(fibres) = &self.fibres else { return (FibreSlopes::none(), bound) };
        let place = fibres.tile(place_of(self.table, tile));
        let stretch = fibres.stretch(place, first, element, h, [local.factor, local.less_one]);
        if with_bound {
            bound = fibres.scalar_bound(&stretch, local, invariants);
        }
        let (slopes, close) = fibres.slopes(&stretch);
        let saturation = &mut self.saturation;
        write_at(saturation, first, close.max(vector_at(saturation, first)));
        (slopes, bound)
    }

    #[inline(always)]
    fn stress<R: Real, T>(
        &mut self,
        (tile, first): (&T, usize),
        element: impl Fn(usize) -> usize,
        deformation: &Deformation<R>,
        [p1, mut s]: [R; 2],
        local: &Distortion<R>,
        prepared: &FibreSlopes<R>,
    ) -> Matrix<R> {
        let mut of_fibres = None;
        if let Some(fibres) = &self.fibres {
            let place = fibres.tile(place_of(self.table, tile));
            s = (local.slope * R::splat(0.5)).fused(prepared.inner, s);
            of_fibres = Some(fibres.stress(place, first, prepared, &deformation.h));
        }
        let mut stress = match &mut self.relaxing {
            Some(of) => of.stress((tile, first), element, deformation, [p1, s], local, of_fibres.as_ref()),
            None => deformation.stress(p1, s),
        };
        if let Some(fibres) = of_fibres {
            fibres.add_to(&mut stress, local.factor);
        }
        stress
    }

    #[inline(always)]
    fn saturation(&self) -> f32 {
        self.saturation.iter().fold(f32::NEG_INFINITY, |most, &lane| most.max(lane))
    }
}
