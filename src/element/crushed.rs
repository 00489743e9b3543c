//! Which elements with nodal strain are crushed, so that they have an energy of their own ([`super::barrier`]). To look
//! at every element in every step would take nearly as many instructions as an exact step (545,000 for 585,000 of the
//! paper's bar, AVX2). So a state keeps marks: for each tile of elements a mask of those below the volume ratio [`MARKED`] when last looked at, and the step in which it is looked at
//! again, in the vectors that nodal pressure has for volumes. Forces are those of the marked elements, whose volume ratio
//! is computed in every step.
//!
//! **When.** A tile is looked at again after the steps in which one of its other elements could fall to
//! [`super::barrier::ONSET`], at twice the rate at which its volume ratio falls now, and at most after a cycle
//! ([`LOOK_CYCLE`], [`LOOK_CYCLE_OF_LONG`]). Where one falls fast its neighbours may follow: for some steps all tiles are
//! looked at within those in which it falls from its volume at rest to there. And all are looked at where the fastest
//! node has become faster by half, as where a load begins suddenly ([`Hurry`]).
//!
//! An element that is seen late meets an energy that was not there, which tears tissue. Where a lobe is torn at, 0 to 3
//! of its elements are seen late in 400 steps; with a look at all in 16 steps, however they move, 90 to 380 are.
//!
//! Marks follow from the displacements when the tile was looked at and from nothing else, and turns are changed when the
//! step is taken, so one that is refused leaves nothing behind that the next one would not set. They are told apart from
//! those of another moment by the number of steps, the time and the kinetic energy: a state that was restored, put somewhere, undone or looked at by
//! [`critical_step`](crate::tled::critical_step) is looked at as a whole. A copy of a state has its marks.

use core::array::from_fn;

use bytemuck::{must_cast_mut, must_cast_ref, must_cast_slice, must_cast_slice_mut};

use super::ElementTile;
use super::barrier::{ONSET, modulus};
use super::deformation::{Deformation, edges};
use crate::material::{Law, Laws};
use crate::simd::{Gather, Kernel, NodeVector, Real, TILE, TileNodes, dispatch};
use crate::state::Moment;

/// Exact steps in which every element is looked at, see above.
pub(crate) const LOOK_CYCLE: u8 = 32;

/// Steps beyond the critical one in which it is.
pub(crate) const LOOK_CYCLE_OF_LONG: u8 = 4;

/// Steps for which all tiles are looked at more often.
const HURRY_STEPS: u32 = 16;
/// How much faster than when all tiles were looked at the fastest node may be, and its way in a step, over the mean edge
/// of the elements, below which nothing can be crushed soon.
const FASTER: f32 = 1.5;
const SLOW: f32 = 0.01;

/// Volume ratio below which an element is marked.
pub(crate) const MARKED: f32 = 0.6;

/// Whether the marks in `vectors` are those of this moment.
pub(crate) fn is_marked_at(vectors: &[NodeVector], moment: &Moment) -> bool {
    let kept = vectors.first().map(|vector| must_cast_ref::<NodeVector, [u64; 2]>(vector)[0]);
    kept == Some(moment.mark().number())
}

/// Says that the marks in `vectors` are of this moment, to which the step that wrote them leads.
pub(crate) fn mark_moment(vectors: &mut [NodeVector], moment: &Moment, tiles: usize) {
    let Marks { turns, next, .. } = Marks::of(vectors, tiles);
    turns.iter_mut().zip(next).for_each(|(turn, next)| *turn = *next);
    if let [first, second, ..] = vectors {
        *first = *second;
        must_cast_mut::<NodeVector, [u64; 2]>(first)[0] = moment.mark().number();
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
    let shorts: &[u16] = must_cast_slice(vectors.get(2..).unwrap_or_default());
    shorts.get(..tiles).filter(|_| has_room(shorts.len(), tiles)).unwrap_or_default()
}

/// Whether numbers of two bytes are enough for tiles, each of which has its turn and its next one besides its mask.
const fn has_room(shorts: usize, tiles: usize) -> bool {
    shorts / 2 >= tiles
}

/// What a state keeps about its crushed elements, to be changed.
pub(crate) struct Marks<'a> {
    pub(crate) hurry: Hurry,
    /// Of each tile.
    pub(crate) masks: &'a mut [u16],
    /// The steps in which tiles are looked at again, modulo 256; those after the step that is computed, if it is taken.
    pub(crate) turns: &'a mut [u8],
    pub(crate) next: &'a mut [u8],
}

impl<'a> Marks<'a> {
    /// In the vectors of a state; without those of tiles where there is no room for them.
    pub(crate) fn of(vectors: &'a mut [NodeVector], tiles: usize) -> Self {
        let (first, rest) = vectors.split_at_mut_checked(2).unwrap_or_default();
        let hurry = first.first().map_or(Hurry::NONE, |vector| {
            let [.., numbers, way] = *must_cast_ref::<NodeVector, [u32; 4]>(vector);
            Hurry::kept([numbers, way])
        });
        let shorts: &mut [u16] = must_cast_slice_mut(rest);
        let room = if has_room(shorts.len(), tiles) { tiles } else { 0 };
        let (masks, bytes) = shorts.split_at_mut_checked(room).unwrap_or_default();
        let bytes: &mut [u8] = must_cast_slice_mut(bytes);
        let (turns, rest) = bytes.split_at_mut_checked(room).unwrap_or_default();
        Self { hurry, masks, turns, next: rest.get_mut(..room).unwrap_or_default() }
    }
}

/// That all tiles are looked at within fewer steps than a cycle, and until when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hurry {
    /// Steps within which a tile is looked at.
    pub(crate) within: u8,
    /// The number of the step from which it holds no more, modulo 2^24.
    until: u32,
    /// The way of the fastest node in a step that later ones are compared with, m.
    way: f32,
}

impl Hurry {
    const NONE: Self = Self { within: u8::MAX, until: 0, way: 0.0 };

    fn kept([numbers, way]: [u32; 2]) -> Self {
        Self { within: numbers as u8, until: numbers >> 8, way: f32::from_bits(way) }
    }

    /// What holds in a step of which a tile waits at most the steps of a cycle.
    pub(crate) const fn at(self, step: u64, cycle: u8) -> Self {
        let left = self.until.wrapping_sub(step as u32) & 0xff_ffff;
        let holds = self.within > 0 && self.within < cycle && left > 0 && left <= HURRY_STEPS;
        Self { within: if holds { self.within } else { cycle }, ..self }
    }

    /// Whether all tiles have to be looked at where the fastest node goes this far in a step, m.
    pub(crate) fn is_much_faster(&mut self, way: f32, tiles: &[ElementTile]) -> bool {
        let is_faster = way > FASTER * self.way;
        if is_faster || 2.0 * way < self.way {
            self.way = way;
        }
        is_faster && way > SLOW * edge(tiles)
    }

    /// The volume ratio of an element that is not marked falls by `rate` in a step: whether that asks for more haste.
    pub(crate) fn enter(&mut self, rate: f32, step: u64) -> bool {
        // Saturates.
        let within = (((1.0 - ONSET) / rate) as u8).max(1);
        let (is_fast, is_faster) = (rate > 0.0 && within <= self.within, within < self.within);
        if is_fast {
            (self.within, self.until) = (within, (step as u32).wrapping_add(HURRY_STEPS) & 0xff_ffff);
        }
        is_fast && is_faster
    }

    /// Keeps it in the vectors of a state, for the time after the step that is computed.
    pub(crate) fn keep(self, vectors: &mut [NodeVector]) {
        if let Some(vector) = vectors.get_mut(1) {
            let [.., numbers, way] = must_cast_mut::<NodeVector, [u32; 4]>(vector);
            (*numbers, *way) = (u32::from(self.within) | self.until << 8, self.way.to_bits());
        }
    }
}

/// The edge of a cube of six elements, m, of the mean volume in some tiles.
fn edge(tiles: &[ElementTile]) -> f32 {
    let some = tiles.iter().step_by((tiles.len() / 16).max(1));
    let volumes = some.flat_map(|tile| (0..TILE).map(|lane| tile.volume::<f32>(lane))).filter(|volume| *volume > 0.0);
    let (sum, count) = volumes.fold((0.0, 0.0), |(sum, count), volume| (sum + volume, count + 1.0f32));
    libm::cbrtf(6.0 * sum / count.max(1.0))
}

/// The largest component, m, by which a node moves.
pub(crate) fn farthest(increment: &[NodeVector]) -> f32 {
    let mut most = [0.0f32; 4];
    for NodeVector(vector) in increment {
        for (most, component) in most.iter_mut().zip(vector) {
            let way = component.abs();
            *most = if way > *most { way } else { *most };
        }
    }
    let [x, y, z, _] = most;
    x.max(y).max(z)
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

/// Which tiles a step looks at.
#[derive(Clone, Copy)]
pub(crate) struct Turn {
    /// The number of the step, modulo 256: tiles whose turn it is are looked at.
    pub(crate) now: u8,
    /// Whether all are.
    pub(crate) whole: bool,
    /// Steps within which each is looked at again, of all the steps of a cycle.
    pub(crate) within: u8,
    pub(crate) cycle: u8,
    /// This step over the last one, whose increments tell the rates.
    pub(crate) pace: f32,
    /// The number of the first of the tiles.
    pub(crate) first: usize,
}

impl Turn {
    /// At all of them, whatever becomes of marks.
    pub(crate) const ALL: Self = Self { now: 0, whole: true, within: 1, cycle: 1, pace: 0.0, first: 0 };

    /// Of the turns of eight tiles, or fewer.
    fn due(&self, turns: &[u8]) -> u64 {
        let never = self.now.wrapping_add(1);
        let eight = match turns.first_chunk() {
            Some(eight) => *eight,
            None => from_fn(|place| turns.get(place).copied().unwrap_or(never)),
        };
        let ones = 0x0101_0101_0101_0101;
        let same = u64::from_le_bytes(eight) ^ (u64::from(self.now) * ones);
        same.wrapping_sub(ones) & !same & (ones << 7)
    }

    /// The next turn of a tile, one of whose elements could be crushed after some steps.
    fn next(&self, index: usize, steps: u8) -> u8 {
        // Turns that all begin in the same step are spread over a cycle.
        let place = (self.first + index) % usize::from(self.cycle.max(1));
        let most = if self.whole { 1 + place as u8 } else { u8::MAX };
        self.now.wrapping_add(steps.min(self.within).min(most).max(1))
    }
}

/// The kernel that looks at tiles of elements: writes the masks of those below a volume ratio, and when each tile is
/// looked at again.
pub(crate) struct Look<'a> {
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) displacement: &'a [NodeVector],
    /// The latest, m; none: nothing is known about rates.
    pub(crate) increment: &'a [NodeVector],
    pub(crate) below: f32,
    pub(crate) turn: Turn,
    /// Of these tiles, or none to be written.
    pub(crate) masks: &'a mut [u16],
    pub(crate) turns: &'a [u8],
    pub(crate) next: &'a mut [u8],
}

impl<'a> Look<'a> {
    /// At all of these tiles.
    pub(crate) fn at_all(
        tiles: &'a [ElementTile],
        displacement: &'a [NodeVector],
        below: f32,
        masks: &'a mut [u16],
    ) -> Self {
        Self { tiles, displacement, increment: &[], below, turn: Turn::ALL, masks, turns: &[], next: &mut [] }
    }

    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(crate) fn see(self) -> Seen<f32> {
        dispatch(self)
    }
}

/// What a look sees in the tiles that it looks at.
#[derive(Clone, Copy)]
pub(crate) struct Seen<R> {
    /// The least `J - 1`.
    pub(crate) least_change: R,
    /// By how much the volume ratio of an element that is not below falls in a step.
    pub(crate) rate: R,
}

impl<R: Real> Seen<R> {
    #[inline(always)]
    pub(crate) fn nothing() -> Self {
        Self { least_change: R::splat(f32::INFINITY), rate: R::splat(0.0) }
    }

    #[inline(always)]
    pub(crate) fn merged_with(self, other: Self) -> Self {
        Self { least_change: other.least_change.min(self.least_change), rate: other.rate.max(self.rate) }
    }
}

/// The elements of a tile below a volume ratio, as a mask.
pub(crate) fn mask_of(tile: &ElementTile, displacement: &[NodeVector], below: f32) -> u16 {
    let mut mask = [0];
    Look::at_all(core::slice::from_ref(tile), displacement, below, &mut mask).see();
    mask[0]
}

impl Kernel for Look<'_> {
    type Output = Seen<f32>;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> Seen<f32> {
        let Self { tiles, displacement, increment, below, turn, masks, turns, next } = self;
        let moved = [displacement, increment].map(Gather::new);
        let mut seen = Seen::<R>::nothing();
        for first in (0..tiles.len()).step_by(8) {
            // A byte with its highest bit for each tile whose turn it is, and maybe for those of one that follow one.
            let mut due =
                if turn.whole { 0x8080_8080_8080_8080 } else { turn.due(turns.get(first..).unwrap_or_default()) };
            while due != 0 {
                let index = first + due.trailing_zeros() as usize / 8;
                due &= due - 1;
                let Some(tile) = tiles.get(index) else { break };
                let (mask, steps) = look_at::<R>(tile, moved, below, &turn, &mut seen);
                if let Some(place) = masks.get_mut(index) {
                    *place = mask;
                }
                if let Some(place) = next.get_mut(index) {
                    *place = turn.next(index, steps);
                }
            }
        }
        // A loop, because the compiler may leave closures over vectors as function calls.
        let mut of_all = Seen::<f32>::nothing();
        for lane in 0..R::COUNT {
            let Seen { least_change, rate } = &seen;
            of_all = of_all.merged_with(Seen { least_change: least_change.lane(lane), rate: rate.lane(lane) });
        }
        of_all
    }
}

#[inline(always)]
fn corners<R: Real>(tile: &ElementTile, first: usize, vectors: Gather<'_>) -> [[R; 3]; 4] {
    let nodes = tile.nodes_below::<R>(vectors.count()).unwrap_or(TileNodes::ALL_ZERO);
    let mut at = [[R::splat(0.0); 3]; 4];
    for (corner, at) in at.iter_mut().enumerate() {
        *at = vectors.read_nodes::<R, 4>(&nodes, corner, first);
    }
    at
}

/// The mask of a tile, and the steps after which one of its other elements could be crushed.
#[inline(always)]
fn look_at<R: Real>(
    tile: &ElementTile,
    [displacement, increment]: [Gather<'_>; 2],
    below: f32,
    turn: &Turn,
    seen: &mut Seen<R>,
) -> (u16, u8) {
    let (one, twice, limit, pace) = (R::splat(1.0), R::splat(2.0), R::splat(below - 1.0), R::splat(turn.pace));
    // An element at rest has the steps of a cycle.
    let slowest = R::splat(0.9 * (1.0 - ONSET) / f32::from(turn.cycle));
    let (mut any, mut steps) = (R::splat(0.0), R::splat(f32::from(u8::MAX)));
    for first in (0..TILE).step_by(R::COUNT) {
        let (now, last) = (corners::<R>(tile, first, displacement), corners::<R>(tile, first, increment));
        let (now, last) = (edges(now), edges(last));
        let (mut h, mut h_before) = ([[R::splat(0.0); 3]; 3], [[R::splat(0.0); 3]; 3]);
        for corner in 0..3 {
            for j in 0..3 {
                let gradient = tile.gradient::<R>(corner, j, first);
                for i in 0..3 {
                    let before = now[corner][i] - pace * last[corner][i];
                    h[i][j] = now[corner][i].fused(gradient, h[i][j]);
                    h_before[i][j] = before.fused(gradient, h_before[i][j]);
                }
            }
        }
        let change = Deformation::new(h).invariants.j;
        let rate = Deformation::new(h_before).invariants.j - change;
        let crushed = (limit - change).positive();
        let rate = (one - crushed) * rate;
        let left = (change + R::splat(1.0 - ONSET)).divide((twice * rate).max(slowest));
        // Of those that are crushed the forces know in every step.
        steps = (left + crushed * R::splat(f32::from(u8::MAX))).min(steps);
        any = crushed.max(any);
        *seen = seen.merged_with(Seen { least_change: change, rate });
    }
    let (mut least, mut is_any) = (f32::from(u8::MAX), false);
    for lane in 0..R::COUNT {
        least = steps.lane(lane).min(least);
        is_any |= any.lane(lane) > 0.0;
    }
    let mut mask = 0;
    if is_any {
        for first in (0..TILE).step_by(R::COUNT) {
            let change = Deformation::<R>::of_tile(tile, first, displacement).invariants.j;
            for lane in 0..R::COUNT {
                mask |= u16::from(change.lane(lane) < below - 1.0) << ((first + lane) % TILE);
            }
        }
        // Places without an element have the nodes of another.
        for lane in 0..TILE {
            mask &= !(u16::from(tile.volume::<f32>(lane) <= 0.0) << lane);
        }
    }
    // Saturates.
    (mask, least as u8)
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
