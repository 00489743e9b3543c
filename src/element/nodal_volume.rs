//! Volume ratios of the nodes, the first of two passes over tetrahedra with average nodal pressure ([`super::pressure`]): each
//! element adds a quarter of its volume (m^3) and of its change to its nodes.

use core::ops::Range;

use crate::material::{Laws, NeoHookean};
use crate::simd::{Gather, Kernel, NodeVector, Real, Scatter, dispatch};

use super::ElementTile;
use super::internal_forces::{BATCH, Corners, ElementVector, SCALAR_BATCH, batches, deform, scatter};
use super::pressure::OwnPressure;
use crate::mesh::partition::Partitions;

/// The kernel that computes the rows of the nodes in some partitions: `J - 1` in the first tissue of the node and in the second,
/// then the volumes that these are means over, m^3.
pub(crate) struct NodalVolumes<'a> {
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) all: &'a Partitions,
    pub(crate) partitions: Range<usize>,
    /// Whether elements may be of different tissues.
    pub(crate) differ: bool,
    pub(crate) displacement: &'a [NodeVector],
    /// Of the nodes in these partitions.
    pub(crate) rows: &'a mut [NodeVector],
}

impl NodalVolumes<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(crate) fn compute(self) {
        dispatch(self);
    }
}

impl Kernel for NodalVolumes<'_> {
    type Output = ();

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        in_batches::<R, BATCH>(self);
    }

    #[inline(always)]
    fn run_scalar(self) {
        in_batches::<f32, SCALAR_BATCH>(self);
    }
}

#[inline(always)]
fn in_batches<R: Real, const SIZE: usize>(kernel: NodalVolumes<'_>) {
    let NodalVolumes { tiles, all, partitions, differ, displacement, rows } = kernel;
    rows.fill(NodeVector::ZERO);
    let displacement = Gather::new(displacement);
    let mut sums = Scatter::from(all.nodes(&partitions).start, rows);
    for (touching, length) in all.touching(partitions) {
        let tiles = (tiles.get(touching).unwrap_or_default(), length);
        if differ {
            add_volumes::<R, OfTwoTissues, SIZE>(tiles, displacement, &mut sums);
        } else {
            add_volumes::<R, OfOneTissue, SIZE>(tiles, displacement, &mut sums);
        }
    }
    for row in rows {
        let [change, volume, other_change, other_volume] = row.0;
        let ratio = |change: f32, volume: f32| if volume > 0.0 { change / volume } else { 0.0 };
        row.0 = [ratio(change, volume), ratio(other_change, other_volume), volume, other_volume];
    }
}

/// In passes as [`super::internal_forces::add_forces`].
#[inline(always)]
fn add_volumes<R: Real, C: Corners<R, ()>, const SIZE: usize>(
    (tiles, length): (&[ElementTile], usize),
    displacement: Gather<'_>,
    sums: &mut Scatter<'_>,
) {
    let Some(first) = tiles.first() else { return };
    let mut batch = [ElementVector::<R, ()>::zero(first, ()); SIZE];
    // No pressure is asked of the law.
    let (laws, input) = (Laws::One(NeoHookean::default()), (displacement, OwnPressure));
    for strips in batches::<R, SIZE>(tiles, length) {
        let count = length * strips.len();
        match length {
            3 => deform::<R, _, _, 3, 6>(&laws, tiles, strips, input, &mut batch),
            2 => deform::<R, _, _, 2, 5>(&laws, tiles, strips, input, &mut batch),
            _ => deform::<R, _, _, 1, 4>(&laws, tiles, strips, input, &mut batch),
        }
        let batch = batch.get(..count).unwrap_or_default();
        match length {
            3 => scatter::<R, _, C, 3, 6>(batch, sums),
            2 => scatter::<R, _, C, 2, 5>(batch, sums),
            _ => scatter::<R, _, C, 1, 4>(batch, sums),
        }
    }
}

/// A quarter of each element's volume and of its change.
#[inline(always)]
fn shares<R: Real>(elements: &ElementVector<'_, R, ()>) -> [R; 2] {
    let volume = R::splat(0.25) * elements.tile.volume::<R>(elements.first);
    [volume * elements.invariants.j, volume]
}

struct OfOneTissue;

impl<R: Real> Corners<R, ()> for OfOneTissue {
    #[inline(always)]
    fn rows(elements: &ElementVector<'_, R, ()>) -> [[R; 4]; 4] {
        let ([change, volume], zero) = (shares(elements), R::splat(0.0));
        [[change, volume, zero, zero]; 4]
    }
}

struct OfTwoTissues;

impl<R: Real> Corners<R, ()> for OfTwoTissues {
    #[inline(always)]
    fn rows(elements: &ElementVector<'_, R, ()>) -> [[R; 4]; 4] {
        let [change, volume] = shares(elements);
        let mut rows = [[change, volume, change, volume]; 4];
        for (corner, row) in rows.iter_mut().enumerate() {
            let is = |slot: u8| {
                R::from_fn(|lane| f32::from(elements.tile.slot(corner, elements.first + lane) == slot))
            };
            let (one, other) = (is(0), is(1));
            *row = [one * row[0], one * row[1], other * row[2], other * row[3]];
        }
        rows
    }
}
