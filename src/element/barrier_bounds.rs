//! Bounds of the tangent of crushed elements with nodal strain ([`super::barrier`]), as those of a law: for the
//! critical step ([`super::critical_bounds`]), and for steps beyond it ([`super::tile_tangents`]).

use super::NodeInertia;
use super::barrier::{BOUNDED, Barrier};
use super::critical_bounds::{AddBounds, NodeMatrices, Terms};
use super::crushed::{CrushedElements, CrushedTile, MARKED, each_marked, mask_of, masks};
use super::deformation::Deformation;
use super::stiffness_bound::Coefficients;
use super::tile::vector_at;
use super::tile_tangents::{Tangent, TileTangents, WriteTangents};
use super::{ElementTile, Elements};
use crate::material::{Law, Laws};
use crate::simd::{Gather, Kernel, NodeVector, Real, ScatterBuffer, TILE, dispatch};

/// Calls `with` with the elements that count in bounds, from the marks of this moment if there is room for marks.
pub(crate) fn each_bounded<L: Law>(
    laws: &Laws<'_, L>,
    tiles: &[ElementTile],
    marks: &[NodeVector],
    displacement: &[NodeVector],
    mut with: impl FnMut(&CrushedTile),
) {
    const { assert!(MARKED >= BOUNDED) };
    let (mut elements, masks) = (CrushedElements::of(*laws, tiles), masks(marks, tiles.len()));
    each_marked(masks, 0, |place| elements.enter(place, &mut with));
    for (index, tile) in tiles.iter().enumerate().skip(masks.len()) {
        each_marked(&[mask_of(tile, displacement, BOUNDED)], index, |place| elements.enter(place, &mut with));
    }
    elements.end(with);
}

/// Adds the bounds of all crushed elements to the matrices of their nodes, 1/s^2. Gives whether there are any.
pub(crate) fn add_crushed_bounds<L: Law>(
    elements: Elements<'_, L>,
    inertia: &[NodeInertia],
    sums: &mut NodeMatrices<'_>,
) -> bool {
    let Elements { laws, tiles, .. } = elements;
    let (mut elements, mut any) = (CrushedElements::of(laws, tiles), false);
    for (index, tile) in tiles.iter().enumerate() {
        let mask = mask_of(tile, sums.zx_in_padding, BOUNDED);
        any |= mask != 0;
        each_marked(&[mask], index, |place| {
            elements.enter(place, |crushed| add_critical(CriticalBounds { crushed, inertia, sums: &mut *sums }));
        });
    }
    elements.end(|crushed| add_critical(CriticalBounds { crushed, inertia, sums }));
    any
}

#[inline(never)]
fn add_critical(kernel: CriticalBounds<'_, '_>) {
    dispatch(kernel);
}

struct CriticalBounds<'a, 'b> {
    crushed: &'a CrushedTile,
    inertia: &'a [NodeInertia],
    sums: &'a mut NodeMatrices<'b>,
}

impl Kernel for CriticalBounds<'_, '_> {
    type Output = ();

    const SELDOM: bool = true;
    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { crushed: CrushedTile { tile, moduli }, inertia, sums } = self;
        // The first three components of a node's inertia are its inverse masses.
        let inertia = Gather::new(bytemuck::must_cast_slice(inertia));
        let mut buffers = [ScatterBuffer::NONE; 3];
        for first in (0..TILE).step_by(R::COUNT) {
            let deformation = &Deformation::<R>::of_tile(tile, first, Gather::new(sums.zx_in_padding));
            let barrier = Barrier::ahead(vector_at::<R>(moduli, first), deformation.invariants);
            let terms = &Terms::of_barrier(&barrier, deformation);
            let (sums, buffers) = (&mut *sums, &mut buffers);
            R::run_piece(AddBounds { tile, first, deformation, terms, inertia, sums, buffers });
        }
    }
}

/// The tangents of crushed elements for the motion of a lattice, see [`super::tile_tangents`].
pub(crate) struct CrushedTangents<'a> {
    pub(crate) crushed: &'a CrushedTile,
    pub(crate) displacement: Gather<'a>,
    /// Factor of the tangents, s^2.
    pub(crate) weight: f32,
}

impl CrushedTangents<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(crate) fn tangents(self) -> TileTangents {
        dispatch(self)
    }
}

impl Kernel for CrushedTangents<'_> {
    type Output = TileTangents;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> TileTangents {
        let Self { crushed: CrushedTile { tile, moduli }, displacement, weight } = self;
        let mut tangents = [Tangent::default(); TILE];
        for first in (0..TILE).step_by(R::COUNT) {
            let deformation = &Deformation::<R>::of_tile(tile, first, displacement);
            let barrier = Barrier::ahead(vector_at::<R>(moduli, first), deformation.invariants);
            let coefficients = &Coefficients::of_barrier(&barrier, deformation.invariants);
            let weight = tile.volume::<R>(first) * R::splat(weight);
            let tangents = tangents.get_mut(first..first + R::COUNT).unwrap_or_default();
            R::run_piece(WriteTangents { weight, deformation, coefficients, tangents });
        }
        tangents
    }
}
