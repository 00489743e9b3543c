//! Which elements with nodal strain are crushed, so that they have an energy of their own ([`super::barrier`]). To look
//! at every element in every step would cost a sixth of an exact step. So a state keeps marks: for each tile of
//! elements a mask of those below the volume ratio [`MARKED`] when last looked at, in the vectors that nodal pressure
//! has for volumes. An exact step looks at one tile in [`LOOK_CYCLE`], a longer one at one in [`LOOK_CYCLE_OF_LONG`] and
//! at those with marks, a learned one at all; forces are those of the marked elements, whose volume ratio is computed in
//! every step.
//!
//! Marks follow from the displacements when the tile was looked at and from nothing else, so a step that is refused
//! leaves none behind that the next one would not set. They are told apart from those of another moment by the number
//! of steps, the time and the kinetic energy: a state that was restored, put somewhere, undone or looked at by
//! [`critical_step`](crate::tled::critical_step) is looked at as a whole. An element that is not marked and falls from
//! [`MARKED`] to [`super::barrier::ONSET`] within a cycle is seen late, by less than a cycle. A copy of a state has its
//! marks; one that was restored sees such an element at once.

use bytemuck::{must_cast_mut, must_cast_ref, must_cast_slice, must_cast_slice_mut};

use super::ElementTile;
use super::barrier::modulus;
use super::deformation::Deformation;
use crate::material::{Law, Laws};
use crate::simd::{Gather, Kernel, NodeVector, Real, TILE, dispatch};
use crate::state::Moment;

/// Exact steps in which every element is looked at.
pub(crate) const LOOK_CYCLE: usize = 16;

/// Steps beyond the critical one in which it is.
pub(crate) const LOOK_CYCLE_OF_LONG: usize = 4;

/// Volume ratio below which an element is marked.
pub(crate) const MARKED: f32 = 0.6;

/// Whether the marks in `vectors` are those of this moment.
pub(crate) fn is_marked_at(vectors: &[NodeVector], moment: &Moment) -> bool {
    let kept = vectors.first().map(|vector| *must_cast_ref::<NodeVector, [u64; 2]>(vector));
    kept == Some([moment.mark().number(), 0])
}

/// Says that the marks in `vectors` are of this moment.
pub(crate) fn mark_moment(vectors: &mut [NodeVector], moment: &Moment) {
    if let Some(vector) = vectors.first_mut() {
        *must_cast_mut(vector) = [moment.mark().number(), 0];
    }
}

/// Says that they are of none.
pub(crate) fn forget_crushed(vectors: &mut [NodeVector]) {
    if let Some(vector) = vectors.first_mut() {
        *vector = NodeVector::ZERO;
    }
}

/// The masks in the vectors of a state, one for each tile of elements; none where there are so few nodes for the
/// elements that they have no room, and every step looks at all.
pub(crate) fn masks(vectors: &[NodeVector], tiles: usize) -> &[u16] {
    let masks = must_cast_slice(vectors.get(1..).unwrap_or_default());
    masks.get(..tiles).unwrap_or_default()
}

/// The same, to be changed.
pub(crate) fn masks_mut(vectors: &mut [NodeVector], tiles: usize) -> &mut [u16] {
    let masks = must_cast_slice_mut(vectors.get_mut(1..).unwrap_or_default());
    masks.get_mut(..tiles).unwrap_or_default()
}

/// Calls `with` with the places of marked elements, each [`TILE`] times the index of a tile plus that in the tile;
/// `first` is the tile of the first mask.
#[inline(always)]
pub(crate) fn each_marked(masks: &[u16], first: usize, mut with: impl FnMut(u32)) {
    // Mostly none is marked: four masks at a time.
    let (fours, rest) = masks.as_chunks::<4>();
    let mut last = [0; 4];
    last.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
    let mut at = (TILE * first) as u32;
    for &[a, b, c, d] in fours.iter().chain([&last]) {
        let mut marked = u64::from(a) | u64::from(b) << TILE | u64::from(c) << (2 * TILE) | u64::from(d) << (3 * TILE);
        while marked != 0 {
            with(at + marked.trailing_zeros());
            marked &= marked - 1;
        }
        at += 4 * TILE as u32;
    }
}

/// The kernel that writes the masks of the elements below a volume ratio, of one tile in `cycle` from tile `first` on,
/// and `with_marked` of all that have marks. Gives the least `J - 1` of these tiles.
pub(crate) struct Look<'a> {
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) displacement: &'a [NodeVector],
    pub(crate) below: f32,
    pub(crate) first: usize,
    pub(crate) cycle: usize,
    pub(crate) with_marked: bool,
    pub(crate) masks: &'a mut [u16],
}

impl Look<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(crate) fn least_change(self) -> f32 {
        dispatch(self)
    }
}

/// The elements of a tile below a volume ratio, as a mask.
pub(crate) fn mask_of(tile: &ElementTile, displacement: &[NodeVector], below: f32) -> u16 {
    let mut mask = [0];
    let tiles = core::slice::from_ref(tile);
    Look { tiles, displacement, below, first: 0, cycle: 1, with_marked: false, masks: &mut mask }.least_change();
    mask[0]
}

impl Kernel for Look<'_> {
    type Output = f32;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> f32 {
        let Self { tiles, displacement, below, first, cycle, with_marked, masks } = self;
        let displacement = Gather::new(displacement);
        let mut least = R::splat(f32::INFINITY);
        let mut due = first;
        if with_marked {
            for (index, tile) in tiles.iter().enumerate() {
                let is_due = index == due;
                due += if is_due { cycle } else { 0 };
                if is_due || masks.get(index).is_some_and(|&mask| mask != 0) {
                    look_at::<R>(tile, displacement, below, masks.get_mut(index), &mut least);
                }
            }
        } else {
            for index in (first..tiles.len()).step_by(cycle.max(1)) {
                let Some(tile) = tiles.get(index) else { break };
                look_at::<R>(tile, displacement, below, masks.get_mut(index), &mut least);
            }
        }
        // A loop, because the compiler may leave closures over vectors as function calls.
        let mut least_of_all = f32::INFINITY;
        for lane in 0..R::COUNT {
            least_of_all = least.lane(lane).min(least_of_all);
        }
        least_of_all
    }
}

#[inline(always)]
fn look_at<R: Real>(tile: &ElementTile, displacement: Gather<'_>, below: f32, place: Option<&mut u16>, least: &mut R) {
    let mut mask = 0;
    for first in (0..TILE).step_by(R::COUNT) {
        let change = Deformation::<R>::of_tile(tile, first, displacement).invariants.j;
        *least = change.min(*least);
        for lane in 0..R::COUNT {
            mask |= u16::from(change.lane(lane) < below - 1.0) << ((first + lane) % TILE);
        }
    }
    if mask != 0 {
        // Places without an element have the nodes of another.
        for lane in 0..TILE {
            mask &= !(u16::from(tile.volume::<f32>(lane) <= 0.0) << lane);
        }
    }
    if let Some(place) = place {
        *place = mask;
    }
}

/// Some crushed elements, at most a tile.
pub(crate) struct CrushedTile {
    pub(crate) tile: ElementTile,
    /// See [`modulus`]; zero where there is no element.
    pub(crate) moduli: [f32; TILE],
}

/// Collects crushed elements, until there is a tile of them.
pub(crate) struct CrushedElements<'a, L> {
    laws: Laws<'a, L>,
    /// Of a scene of one tissue.
    modulus: f32,
    tiles: &'a [ElementTile],
    crushed: CrushedTile,
    count: usize,
}

impl<'a, L: Law> CrushedElements<'a, L> {
    pub(crate) fn of(laws: Laws<'a, L>, tiles: &'a [ElementTile]) -> Self {
        let crushed = CrushedTile { tile: ElementTile::EMPTY, moduli: [0.0; TILE] };
        Self { laws, modulus: modulus(&laws.law()), tiles, crushed, count: 0 }
    }

    /// Enters the element at a place. Calls `with` whenever there is a tile of them.
    #[inline(always)]
    pub(crate) fn enter(&mut self, place: u32, mut with: impl FnMut(&CrushedTile)) {
        let (CrushedTile { tile, moduli }, lane) = (&mut self.crushed, self.count % TILE);
        tile.copy_element(lane, self.tiles, place);
        let several = self.laws.has_several_tissues();
        moduli[lane] = if several { modulus(&self.laws.of(tile.element(lane))) } else { self.modulus };
        self.count += 1;
        if self.count == TILE {
            self.count = 0;
            with(&self.crushed);
        }
    }

    /// Calls `with` with the elements that are left, if any.
    pub(crate) fn end(mut self, mut with: impl FnMut(&CrushedTile)) {
        if self.count > 0 {
            self.crushed.tile.empty_from(self.count);
            self.crushed.moduli.iter_mut().skip(self.count).for_each(|modulus| *modulus = 0.0);
            with(&self.crushed);
        }
    }
}
