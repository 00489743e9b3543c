//! Internal forces (N) of linear tetrahedra, vectorised: `f_a = -V P grad N_a` from the first Piola-Kirchhoff stress
//! `P` (Pa) of [`crate::material`], the rest volume `V` (m^3) and the gradients of the shape functions `N_a` (1/m);
//! Miller et al. 2007. The four forces of an element add up to zero.

use core::ops::Range;

use crate::material::{AnyLaw, Invariants, Law, LawState, Laws, response_operations};
use crate::mesh::partition::Partitions;
use crate::mesh::strips::{CORNERS, LONGEST};
use crate::simd::{
    Gather, Kernel, NodeVector, Pair, Piece, Real, SCATTER_WIDTH, Scatter, ScatterBuffer, TILE, TileNodes, dot,
    unrolled,
};

use super::ElementTile;
use super::deformation::{Deformation, LeftOut, Matrix, edges};
use super::extension::{Extension, NoExtension};
use super::pressure::{OwnPressure, Pressure};
use super::stiffness_bound::scale_of;

/// The elements of a scene with their laws.
#[derive(Clone, Copy)]
pub(crate) struct Elements<'a, L> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) partitions: &'a Partitions,
}

/// Floating-point operations of [`add_forces`] for one element: displacement gradient 63, invariants 57, stress 63,
/// nodal forces 65, sums 12, and those of the law.
pub(crate) fn operations<L: Law>(law: &L) -> u32 {
    63 + 57 + 63 + 65 + 12 + response_operations(law)
}

/// Extreme states among the elements of a step: they tell how near it is to where laws are cut off to stay finite.
#[derive(Clone, Copy, Debug)]
pub struct Extremes<R> {
    /// Smallest `J - 1`.
    pub(crate) least_change: R,
    /// Largest saturation of the law.
    pub(crate) saturation: R,
}

impl<R: Real> Extremes<R> {
    /// The extremes of an empty set of elements.
    pub(crate) fn none() -> Self {
        Self { least_change: R::splat(f32::INFINITY), saturation: R::splat(f32::NEG_INFINITY) }
    }

    /// The extremes of both, over all values of the vectors in `other`.
    pub(crate) fn merged_with<O: Real>(mut self, other: &Extremes<O>) -> Self {
        for lane in 0..O::COUNT {
            self.least_change = self.least_change.min(R::splat(other.least_change.lane(lane)));
            self.saturation = self.saturation.max(R::splat(other.saturation.lane(lane)));
        }
        self
    }
}

impl Extremes<f32> {
    /// The extremes of a body at rest.
    pub(crate) const REST: Self = Self { least_change: 0.0, saturation: 0.0 };
}

/// A further computation from the deformation of an element, in the same pass as its forces.
pub(crate) trait ElementVisitor {
    /// Whether the scalar stiffness bound is added to the fourth component of the forces of the nodes: by
    /// [`ElementVisitor::visit`], and of patches with nodal strain by these.
    fn bounds(&self) -> bool;

    /// Called for each vector of elements, those from place `first` of the tile on. Its result is added to the fourth
    /// component of the forces of their nodes.
    fn visit<R: Real, L: Law>(
        &mut self,
        law: &L::Wide<R>,
        tile: &ElementTile,
        first: usize,
        deformation: &Deformation<R>,
        local: &LawState<R>,
    ) -> R;
}

/// A visitor that computes nothing.
#[derive(Clone, Copy)]
pub struct NoVisitor;

impl ElementVisitor for NoVisitor {
    #[inline(always)]
    fn bounds(&self) -> bool {
        false
    }

    #[inline(always)]
    fn visit<R: Real, L: Law>(
        &mut self,
        _: &L::Wide<R>,
        _: &ElementTile,
        _: usize,
        _: &Deformation<R>,
        _: &LawState<R>,
    ) -> R {
        R::splat(0.0)
    }
}

/// The kernel that adds internal forces to the nodes of some partitions, in the order of the elements.
pub struct InternalForces<'a, L, V, P = OwnPressure, K = NoExtension> {
    elements: Elements<'a, L>,
    pressure: P,
    /// Forces of the nodes in these partitions are computed.
    partitions: Range<usize>,
    displacement: Gather<'a>,
    /// What rounding has left out of the displacements, or nothing.
    remainder: Gather<'a>,
    force: Scatter<'a>,
    visitor: V,
    extension: K,
}

impl<'a, L: Law, V, P> InternalForces<'a, L, V, P> {
    /// Forces of the nodes in `partitions`; `force` has one vector for each of these. `moved` are displacements and
    /// what rounding has left out of them, or nothing.
    pub(crate) fn of_partitions(
        elements: Elements<'a, L>,
        pressure: P,
        partitions: Range<usize>,
        moved: [&'a [NodeVector]; 2],
        force: &'a mut [NodeVector],
        visitor: V,
    ) -> Self {
        let force = Scatter::from(elements.partitions.nodes(&partitions).start, force);
        let [displacement, remainder] = moved.map(Gather::new);
        Self { elements, pressure, partitions, displacement, remainder, force, visitor, extension: NoExtension }
    }
}

impl<'a, L: Law + Into<AnyLaw>, V, P> InternalForces<'a, L, V, P> {
    /// The same with what the stress has besides that of the law.
    pub(crate) fn with_extension<K>(self, extension: K) -> InternalForces<'a, AnyLaw, V, P, K> {
        let Self { elements: Elements { laws, tiles, partitions: all }, pressure, partitions, .. } = self;
        let Self { displacement, remainder, force, visitor, .. } = self;
        let elements = Elements { laws: laws.any(), tiles, partitions: all };
        InternalForces { elements, pressure, partitions, displacement, remainder, force, visitor, extension }
    }
}

impl<L: Law, V: ElementVisitor, P: Pressure, K: Extension> Kernel for InternalForces<'_, L, V, P, K> {
    type Output = Extremes<f32>;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> Extremes<f32> {
        if R::COUNT > 8 {
            in_batches::<R, L, V, P, K, WIDE_BATCH>(self)
        } else {
            in_batches::<R, L, V, P, K, BATCH>(self)
        }
    }

    #[inline(always)]
    fn run_scalar(self) -> Extremes<f32> {
        in_batches::<f32, L, V, P, K, SCALAR_BATCH>(self)
    }
}

#[inline(always)]
fn in_batches<R: Real, L: Law, V: ElementVisitor, P: Pressure, K: Extension, const SIZE: usize>(
    kernel: InternalForces<'_, L, V, P, K>,
) -> Extremes<f32> {
    let InternalForces { elements, pressure, partitions, displacement, remainder, mut force, visitor, extension } =
        kernel;
    let Elements { laws, tiles, partitions: all } = elements;
    let displacement = pressure.displacement().unwrap_or(displacement);
    let (mut extremes, mut asked) = (Extremes::<Pair<R>>::none(), (visitor, extension));
    for (touching, length) in all.touching(partitions) {
        let tiles = (tiles.get(touching).unwrap_or_default(), length);
        let input = (displacement, remainder, pressure);
        add_forces::<R, L, V, P, K, SIZE>(&laws, tiles, input, &mut force, &mut asked, &mut extremes);
    }
    if K::EXTENDS {
        extremes.saturation = extremes.saturation.max(Pair::splat(asked.1.saturation()));
    }
    Extremes::none().merged_with(&extremes)
}

/// A vector of elements, those of a tile from place `first` on, with what the passes of [`add_forces`] compute for
/// them.
#[derive(Clone, Copy)]
struct ElementVector<'a, R> {
    tile: &'a ElementTile,
    first: usize,
    /// Displacement gradient.
    h: Matrix<R>,
    invariants: Invariants<R>,
    /// `J - 1` at which the pressure is taken.
    change: R,
    /// Scalars of the stress, Pa.
    p1: R,
    s: R,
    /// Fourth component of the forces.
    fourth: R,
}

impl<'a, R: Real> ElementVector<'a, R> {
    #[inline(always)]
    fn zero(tile: &'a ElementTile) -> Self {
        let zero = R::splat(0.0);
        let invariants = Invariants { i: zero, j: zero };
        let h = [[zero; 3]; 3];
        Self { tile, first: 0, h, invariants, change: zero, p1: zero, s: zero, fourth: zero }
    }
}

/// Vectors of elements in a batch. A batch of scalar code has the elements of as many strips as the scatter buffer
/// holds.
const BATCH: usize = 12;
/// Of long vectors fewer, as they need more stack: whole strips of every length.
const WIDE_BATCH: usize = 6;
#[cfg_attr(target_arch = "x86_64", allow(dead_code))]
const SCALAR_BATCH: usize = SCATTER_WIDTH * LONGEST;

/// Adds the internal forces of elements to `force`, with minus sign. Every `length` consecutive tiles hold strips of
/// that length ([`crate::mesh::strips`]), one element of each strip in every tile.
///
/// A batch of a few vectors of elements goes through three passes: deformation, law, scatter. The law is a long
/// sequence of dependent operations; in a pass of its own two vectors can be interleaved ([`Pair`]). Tissue that
/// remembers has its stress computed in one pass more.
#[inline(always)]
pub(crate) fn add_forces<R: Real, L: Law, V: ElementVisitor, P: Pressure, K: Extension, const SIZE: usize>(
    laws: &Laws<'_, L>,
    (tiles, length): (&[ElementTile], usize),
    input: (Gather<'_>, Gather<'_>, P),
    force: &mut Scatter<'_>,
    (visitor, extension): &mut (V, K),
    extremes: &mut Extremes<Pair<R>>,
) {
    let Some(first) = tiles.first() else { return };
    let (displacement, remainder, pressure) = input;
    let mut batch = [ElementVector::<R>::zero(first); SIZE];
    let mut kept = [K::at_rest::<R>(); SIZE];
    let strip_count = tiles.len().checked_div(length).unwrap_or(0) * (TILE / R::COUNT);
    let most = if R::COUNT == 1 { SCATTER_WIDTH } else { SIZE.checked_div(length).unwrap_or(SIZE).max(1) };
    for start in (0..strip_count).step_by(most) {
        let strips = start..strip_count.min(start + most);
        let count = length * strips.len();
        R::run_piece(Deform { tiles, length, strips, displacement, remainder, pressure, batch: &mut batch });
        // If the count is odd, the second vector of the last pair is an old one; its result is not used.
        for (index, pair) in batch.as_chunks_mut::<2>().0.iter_mut().enumerate().take(count.div_ceil(2)) {
            let locals = respond::<R, L>(laws, pair, extremes);
            for (elements, local) in pair.iter_mut().zip(&locals).take(count - 2 * index) {
                visit::<R, L>(laws, elements, local, visitor);
            }
            for (kept, local) in kept.iter_mut().skip(2 * index).zip(&locals) {
                kept.0 = K::of_law(local);
            }
        }
        if K::EXTENDS {
            let batch = batch.get_mut(..count).unwrap_or_default();
            let (kept, bounds) = (&mut kept, visitor.bounds());
            R::run_piece(Extend { batch, kept, extension: &mut *extension, bounds });
        }
        let batch = batch.get(..count).unwrap_or_default();
        let force = force.reborrow();
        if K::EXTENDS {
            R::run_piece(AddForces::<_, true> { batch, length, force });
        } else {
            R::run_piece(AddForces::<_, false> { batch, length, force });
        }
    }
}

/// The nodes of strips of `K` elements: four of the first element, and the first of each other element.
#[inline(always)]
pub(super) fn nodes_of<const K: usize, const N: usize>(tiles: [&ElementTile; K]) -> [&[u32; TILE]; N] {
    let mut nodes = [tiles[0].nodes()[0]; N];
    for node in 1..N {
        nodes[node] = if node < 4 { tiles[0].nodes()[node] } else { tiles[(node - 3) % K].nodes()[0] };
    }
    nodes
}

/// The first pass: deformation of the elements of some strips.
struct Deform<'a, 'b, R: Real, P: Pressure> {
    tiles: &'a [ElementTile],
    /// Elements of a strip.
    length: usize,
    strips: Range<usize>,
    displacement: Gather<'b>,
    remainder: Gather<'b>,
    pressure: P,
    batch: &'b mut [ElementVector<'a, R>],
}

impl<R: Real, P: Pressure> Piece for Deform<'_, '_, R, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        match self.length {
            3 => deform::<R, P, 3, 6>(self),
            2 => deform::<R, P, 2, 5>(self),
            _ => deform::<R, P, 1, 4>(self),
        }
    }
}

/// The same for strips of `K` elements with `N` nodes. Elements of tiles with nodes out of range do not deform.
#[inline(always)]
fn deform<R: Real, P: Pressure, const K: usize, const N: usize>(pass: Deform<'_, '_, R, P>) {
    let Deform { tiles, strips, displacement, remainder, pressure, batch, .. } = pass;
    let (tiles, vectors) = (tiles.as_chunks::<K>().0, TILE / R::COUNT);
    for (strip, elements) in strips.zip(batch.as_chunks_mut::<K>().0) {
        let Some(tiles) = tiles.get(strip / vectors) else { return };
        let first = strip % vectors * R::COUNT;
        let nodes = TileNodes::in_range::<R>(nodes_of(tiles.each_ref()), 0, displacement.count());
        let nodes = nodes.unwrap_or(TileNodes::<N>::ALL_ZERO);
        let mut displacements = [[R::splat(0.0); 3]; N];
        let mut volumes = [P::no_volumes::<R>(); N];
        unrolled!(node < N => {
            let [x, y, z, fourth] = displacement.read_rows::<R, N>(&nodes, node, first);
            displacements[node] = [x, y, z];
            volumes[node] = pressure.read_with::<R, N>(fourth, &nodes, node, first);
        });
        unrolled!(element < K => {
            let [a, b, c, d] = CORNERS[element % LONGEST];
            let corners =
                [displacements[a % N], displacements[b % N], displacements[c % N], displacements[d % N]];
            let mut edges = edges(corners);
            if remainder.count() > 0 {
                edges = R::run_piece(LeftOut { tile: &tiles[element], first, remainder, edges });
            }
            let deformation = Deformation::of_edges(&tiles[element], first, edges);
            let vector = &mut elements[element];
            (vector.tile, vector.first) = (&tiles[element], first);
            (vector.h, vector.invariants) = (deformation.h, deformation.invariants);
            let volumes = [volumes[a % N], volumes[b % N], volumes[c % N], volumes[d % N]];
            vector.change = pressure.change(&tiles[element], first, volumes, deformation.invariants.j);
        });
    }
}

/// The second pass: the stress of the law.
#[inline(always)]
fn respond<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    pair: &mut [ElementVector<'_, R>; 2],
    extremes: &mut Extremes<Pair<R>>,
) -> [LawState<R>; 2] {
    let law = laws.widen::<Pair<R>>(|lane| {
        let elements = &pair[lane / R::COUNT % 2];
        elements.tile.element(elements.first + lane % R::COUNT)
    });
    let [first, second] = pair;
    let invariants = Invariants {
        i: Pair(first.invariants.i, second.invariants.i),
        j: Pair(first.invariants.j, second.invariants.j),
    };
    let change = Pair(first.change, second.change);
    let local = LawState::with_volume_change::<L>(&law, invariants, change);
    let response = local.response();
    (first.p1, first.s) = (response.p1.0, response.s.0);
    (second.p1, second.s) = (response.p1.1, response.s.1);
    extremes.least_change = invariants.j.min(extremes.least_change);
    extremes.saturation = response.saturation.max(extremes.saturation);
    local.split()
}

/// Calls the visitor.
#[inline(always)]
fn visit<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    elements: &mut ElementVector<'_, R>,
    local: &LawState<R>,
    visitor: &mut impl ElementVisitor,
) {
    let law = laws.widen(|lane| elements.tile.element(elements.first + lane));
    let deformation = Deformation::with(elements.h, elements.invariants);
    elements.fourth = visitor.visit::<R, L>(&law, elements.tile, elements.first, &deformation, local);
}

/// What an extension keeps of a vector of elements between the passes.
type Kept<K, R> = (<K as Extension>::Local<R>, <K as Extension>::Prepared<R>);

/// Between the second and the third pass, for tissue with an extension: its stress takes the place of `h`.
struct Extend<'a, 'b, R: Real, K: Extension> {
    batch: &'a mut [ElementVector<'b, R>],
    kept: &'a mut [Kept<K, R>],
    extension: &'a mut K,
    /// Whether the scalar stiffness bound is asked for.
    bounds: bool,
}

impl<R: Real, K: Extension> Piece for Extend<'_, '_, R, K> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { batch, kept, extension, bounds } = self;
        let first_pass = if extension.prepares() { batch.len() } else { 0 };
        for (elements, (local, prepared)) in batch.iter_mut().zip(&mut *kept).take(first_pass) {
            let ElementVector { tile, first, h, invariants, .. } = *elements;
            let element = |lane: usize| tile.element(first + lane);
            let bound;
            (*prepared, bound) = extension.prepare((tile, first), element, &h, invariants, bounds, local);
            if bounds {
                elements.fourth = scale_of::<R>(tile, first).fused(bound, elements.fourth);
            }
        }
        for (elements, (local, prepared)) in batch.iter_mut().zip(&*kept) {
            let ElementVector { tile, first, p1, s, .. } = *elements;
            let deformation = Deformation::with(elements.h, elements.invariants);
            let element = |lane: usize| tile.element(first + lane);
            elements.h = extension.stress((tile, first), element, &deformation, [p1, s], local, prepared);
        }
    }
}

/// Nodal forces from the stress, which is known in place of `h` or that of the law, with the fourth component of the
/// visitor.
#[inline(always)]
fn nodal_forces<R: Real, const KNOWN: bool>(elements: &ElementVector<'_, R>) -> [[R; 4]; 4] {
    let ElementVector { tile, first, .. } = *elements;
    let of_law = || Deformation::with(elements.h, elements.invariants).stress(elements.p1, elements.s);
    let stress = if KNOWN { elements.h } else { of_law() };
    let minus_volume = -tile.volume::<R>(first);
    let mut forces = [[R::splat(0.0); 3]; 4];
    for axis in 0..3 {
        let [x, y, z] = stress[axis];
        let row = [x * minus_volume, y * minus_volume, z * minus_volume];
        for corner in 0..3 {
            forces[corner + 1][axis] = dot(row, tile.gradients::<R>(corner, first));
        }
        forces[0][axis] = -(forces[1][axis] + forces[2][axis] + forces[3][axis]);
    }
    let ([a, b, c, d], fourth) = (forces, elements.fourth);
    [[a[0], a[1], a[2], fourth], [b[0], b[1], b[2], fourth], [c[0], c[1], c[2], fourth], [d[0], d[1], d[2], fourth]]
}

/// The third pass: adds the forces of some strips to their nodes.
struct AddForces<'a, 'b, R, const KNOWN: bool> {
    batch: &'a [ElementVector<'b, R>],
    /// Elements of a strip.
    length: usize,
    force: Scatter<'a>,
}

impl<R: Real, const KNOWN: bool> Piece for AddForces<'_, '_, R, KNOWN> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { batch, length, force } = self;
        match length {
            3 => scatter::<R, KNOWN, 3, 6>(batch, force),
            2 => scatter::<R, KNOWN, 2, 5>(batch, force),
            _ => scatter::<R, KNOWN, 1, 4>(batch, force),
        }
    }
}

/// The same for strips of `K` elements with `N` nodes.
#[inline(always)]
fn scatter<R: Real, const KNOWN: bool, const K: usize, const N: usize>(
    batch: &[ElementVector<'_, R>],
    mut force: Scatter<'_>,
) {
    let mut buffer = ScatterBuffer::NONE;
    for strip in batch.as_chunks::<K>().0 {
        let mut rows = [[R::splat(0.0); 4]; N];
        let mut tiles = [strip[0].tile; K];
        unrolled!(element < K => {
            tiles[element] = strip[element].tile;
            let forces = nodal_forces::<R, KNOWN>(&strip[element]);
            for corner in 0..4 {
                let row = &mut rows[CORNERS[element % LONGEST][corner] % N];
                for axis in 0..4 {
                    let first = element == 0 || corner == 0;
                    row[axis] = if first { forces[corner][axis] } else { row[axis] + forces[corner][axis] };
                }
            }
        });
        let (nodes, first) = (nodes_of(tiles), strip[0].first);
        match force.checked::<R, N>(nodes) {
            Some(nodes) => force.add_corners(&nodes, first, rows, &mut buffer),
            // Elements with nodes of another thread's partitions.
            None => force.add_present(nodes, first, rows),
        }
    }
}
