//! Linear tetrahedra, several side by side: deformation from nodal displacements and nodal forces from the
//! first Piola-Kirchhoff stress, `f_a = -V P grad N_a` (Miller et al. 2007, with the stress of
//! [`crate::material`]). Nodes 1, 2, 3 carry stored gradients; node 0 takes minus their sum, so the four
//! forces of an element add up to zero and a translation gives exactly none.

use core::ops::Range;

use super::Status;
use crate::chains::{CORNERS, LONGEST};
use crate::lanes::{BLOCK, BlockNodes, EIGHT, Gather, Pair, Real, Scatter, Waiting, dot, unrolled};
use crate::ledger::Ledger;
use crate::material::{Invariants, J_FLOOR, Law, Laws, Local, response_operations};
use crate::scene::ElementBlock;

/// A vector and a matrix in lanes; rows are spatial, columns material.
pub(crate) type Vector<R> = [R; 3];
pub(crate) type Matrix<R> = [[R; 3]; 3];

/// Deformation of a chunk of elements.
#[derive(Clone, Copy)]
pub(crate) struct Deformation<R> {
    /// `H = grad u = F - I`.
    pub(crate) h: Matrix<R>,
    /// `cof H`.
    pub(crate) cof_h: Matrix<R>,
    /// `tr H`.
    pub(crate) trace: R,
    pub(crate) invariants: Invariants<R>,
}

impl<R: Real> Deformation<R> {
    /// From the displacement gradient: `J - 1 = tr H + tr cof H + det H`, `I1 - 3 = 2 tr H + H:H`.
    #[inline(always)]
    pub(crate) fn new(h: Matrix<R>) -> Self {
        let zero = Invariants { i: R::splat(0.0), j: R::splat(0.0) };
        let Self { cof_h, trace, .. } = Self::with(h, zero);
        let second = cof_h[0][0] + cof_h[1][1] + cof_h[2][2];
        let j = trace + second + dot(h[0], cof_h[0]);
        let i = trace + trace + (dot(h[0], h[0]) + dot(h[1], h[1]) + dot(h[2], h[2]));
        Self { h, cof_h, trace, invariants: Invariants { i, j } }
    }

    /// With the invariants that it has.
    #[inline(always)]
    fn with(h: Matrix<R>, invariants: Invariants<R>) -> Self {
        let minor = |i: usize, j: usize| {
            let (p, q, r, s) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
            h[p][r].fused(h[q][s], -(h[p][s] * h[q][r]))
        };
        let cof_h = [
            [minor(0, 0), minor(0, 1), minor(0, 2)],
            [minor(1, 0), minor(1, 1), minor(1, 2)],
            [minor(2, 0), minor(2, 1), minor(2, 2)],
        ];
        let trace = h[0][0] + h[1][1] + h[2][2];
        Self { h, cof_h, trace, invariants }
    }

    /// Deformation of the elements in lanes `first..` of a block, none if it names nodes that are not there.
    #[inline(always)]
    pub(crate) fn of_block(block: &ElementBlock, first: usize, displacement: Gather<'_>) -> Self {
        let nodes = block.nodes_below::<R>(displacement.count()).unwrap_or(BlockNodes::NONE);
        let at = |corner: usize| displacement.read_lanes::<R, 4>(&nodes, corner, first);
        Self::of_moved(block, first, [at(0), at(1), at(2), at(3)])
    }

    /// From the displacements of the corners.
    #[inline(always)]
    fn of_moved(block: &ElementBlock, first: usize, [origin, a, b, c]: [Vector<R>; 4]) -> Self {
        let mut h = [[R::splat(0.0); 3]; 3];
        for (corner, position) in [a, b, c].into_iter().enumerate() {
            for j in 0..3 {
                let gradient = block.gradient::<R>(corner, j, first);
                for i in 0..3 {
                    // Not fused: in ill-conditioned states the forces are then a fifth closer to the exact ones.
                    h[i][j] = h[i][j] + (position[i] - origin[i]) * gradient;
                }
            }
        }
        Self::new(h)
    }

    /// `F - cof F = H + H^T - tr H I - cof H`.
    #[inline(always)]
    pub(crate) fn distortion(&self, i: usize, j: usize) -> R {
        let (i, j) = (i % 3, j % 3);
        let sum = self.h[i][j] + self.h[j][i] - self.cof_h[i][j];
        if i == j { sum - self.trace } else { sum }
    }

    /// `cof F = (1 + tr H) I - H^T + cof H`.
    #[inline(always)]
    pub(crate) fn cofactor(&self, i: usize, j: usize) -> R {
        let (i, j) = (i % 3, j % 3);
        let off = self.cof_h[i][j] - self.h[j][i];
        if i == j { off + (R::splat(1.0) + self.trace) } else { off }
    }

    /// First Piola-Kirchhoff stress, Pa.
    #[inline(always)]
    pub(crate) fn stress(&self, p1: R, s: R) -> Matrix<R> {
        // Loops: closures over vectors may stay calls.
        let mut stress = [[p1; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                stress[i][j] = p1.fused(self.distortion(i, j), s * self.cofactor(i, j));
            }
        }
        stress
    }
}

/// Floating-point operations of [`add_forces`] for one element: displacement gradient 63, invariants 57,
/// stress 63, nodal forces 65, sums 12, and the law's.
pub(crate) const fn operations<L: Law>() -> u32 {
    63 + 57 + 63 + 65 + 12 + response_operations::<L>()
}

/// How far a step went into the range where laws are continued to stay finite.
#[derive(Clone, Copy, Debug)]
pub struct Extremes<R> {
    /// Smallest `J - 1`.
    pub(crate) least_j: R,
    /// Largest saturation of the law.
    pub(crate) saturation: R,
}

impl<R: Real> Extremes<R> {
    /// Of no elements.
    pub(crate) fn none() -> Self {
        Self { least_j: R::splat(f32::INFINITY), saturation: R::splat(f32::NEG_INFINITY) }
    }

    /// Of this and the lanes of another.
    pub(crate) fn with_lanes<O: Real>(mut self, other: &Extremes<O>) -> Self {
        for lane in 0..O::COUNT {
            self.least_j = self.least_j.min(R::splat(other.least_j.lane(lane)));
            self.saturation = self.saturation.max(R::splat(other.saturation.lane(lane)));
        }
        self
    }
}

impl Extremes<f32> {
    /// Of a body at rest.
    pub(crate) const REST: Self = Self { least_j: 0.0, saturation: 0.0 };

    /// What a step that was taken says of itself; `held` if it held back much of the motion.
    pub(crate) fn status(&self, ledger: &Ledger, held: bool) -> Status {
        let least_volume_ratio = 1.0 + self.least_j;
        let (saturation, energy_excess) = (self.saturation, ledger.excess() as f32);
        if held || least_volume_ratio < J_FLOOR || saturation > 1.0 || energy_excess > 0.0 {
            return Status::Limited { least_volume_ratio, saturation, energy_excess };
        }
        Status::Ok
    }
}

/// What else is made of an element's deformation while it is at hand.
pub(crate) trait Beside {
    /// Called with each chunk of elements; what it returns is added to the fourth component of the forces of
    /// their nodes.
    fn see<R: Real, L: Law>(
        &mut self,
        law: &L::Wide<R>,
        block: &ElementBlock,
        first: usize,
        deformation: &Deformation<R>,
        local: &Local<R>,
    ) -> R;
}

/// Forces and nothing else.
pub struct Nothing;

impl Beside for Nothing {
    #[inline(always)]
    fn see<R: Real, L: Law>(
        &mut self,
        _: &L::Wide<R>,
        _: &ElementBlock,
        _: usize,
        _: &Deformation<R>,
        _: &Local<R>,
    ) -> R {
        R::splat(0.0)
    }
}

/// Elements side by side on their way through the passes of [`add_forces`]: lanes of a block, from `first` on.
#[derive(Clone, Copy)]
struct Part<'a, R> {
    block: &'a ElementBlock,
    first: usize,
    h: Matrix<R>,
    invariants: Invariants<R>,
    p1: R,
    s: R,
    /// For the fourth component of the forces.
    fourth: R,
}

impl<'a, R: Real> Part<'a, R> {
    #[inline(always)]
    fn nothing(block: &'a ElementBlock) -> Self {
        let zero = R::splat(0.0);
        let invariants = Invariants { i: zero, j: zero };
        Self { block, first: 0, h: [[zero; 3]; 3], invariants, p1: zero, s: zero, fourth: zero }
    }
}

/// Vectors of elements that go through the passes together; of numbers one by one, those of as many chains as wait for each
/// other.
const TOGETHER: usize = 8;
const TOGETHER_ONE_BY_ONE: usize = EIGHT * LONGEST;

/// Adds the internal forces of elements to `force`, with minus sign; the blocks hold chains of that `length`
/// ([`crate::chains`]), one element of each in every block. In three passes over a few vectors of elements: the law is a
/// sequence of operations that wait for each other, and gets nothing else in between ([`Pair`]).
#[inline(always)]
pub(crate) fn add_forces<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    blocks: (&[ElementBlock], usize),
    displacement: Gather<'_>,
    force: &mut Scatter<'_>,
    beside: &mut impl Beside,
    extremes: &mut Extremes<Pair<R>>,
) {
    if R::COUNT == 1 {
        add_together::<R, L, TOGETHER_ONE_BY_ONE>(laws, blocks, displacement, force, beside, extremes);
    } else {
        add_together::<R, L, TOGETHER>(laws, blocks, displacement, force, beside, extremes);
    }
}

#[inline(always)]
fn add_together<R: Real, L: Law, const PARTS: usize>(
    laws: &Laws<'_, L>,
    (blocks, length): (&[ElementBlock], usize),
    displacement: Gather<'_>,
    force: &mut Scatter<'_>,
    beside: &mut impl Beside,
    extremes: &mut Extremes<Pair<R>>,
) {
    let Some(first) = blocks.first() else { return };
    let mut parts = [Part::<R>::nothing(first); PARTS];
    let chains = blocks.len().checked_div(length).unwrap_or(0) * (BLOCK / R::COUNT);
    let most = if R::COUNT == 1 { EIGHT } else { PARTS.checked_div(length).unwrap_or(PARTS).max(1) };
    for start in (0..chains).step_by(most) {
        let chains = start..chains.min(start + most);
        let count = length * chains.len();
        match length {
            3 => deform::<R, 3, 6>(blocks, chains, displacement, &mut parts),
            2 => deform::<R, 2, 5>(blocks, chains, displacement, &mut parts),
            _ => deform::<R, 1, 4>(blocks, chains, displacement, &mut parts),
        }
        // The last pair may be half empty: what was there before is computed once more, for nobody.
        for (pair, parts) in parts.as_chunks_mut::<2>().0.iter_mut().enumerate().take(count.div_ceil(2)) {
            let locals = respond::<R, L>(laws, parts, extremes);
            for (part, local) in parts.iter_mut().zip(&locals).take(count - 2 * pair) {
                look::<R, L>(laws, part, local, beside);
            }
        }
        let parts = parts.get(..count).unwrap_or_default();
        match length {
            3 => scatter::<R, 3, 6>(parts, force),
            2 => scatter::<R, 2, 5>(parts, force),
            _ => scatter::<R, 1, 4>(parts, force),
        }
    }
}

/// The nodes of chains of `K` elements: those of the first, and one of each that follows.
#[inline(always)]
fn nodes_of<const K: usize, const N: usize>(blocks: [&ElementBlock; K]) -> [&[u32; BLOCK]; N] {
    let mut nodes = [blocks[0].nodes()[0]; N];
    for node in 1..N {
        nodes[node] = if node < 4 { blocks[0].nodes()[node] } else { blocks[(node - 3) % K].nodes()[0] };
    }
    nodes
}

/// The first pass: deformation of the elements of some chains of `K` elements with `N` nodes, none of those of blocks that
/// name nodes that are not there.
#[inline(always)]
fn deform<'a, R: Real, const K: usize, const N: usize>(
    blocks: &'a [ElementBlock],
    chains: Range<usize>,
    displacement: Gather<'_>,
    parts: &mut [Part<'a, R>],
) {
    let (blocks, vectors) = (blocks.as_chunks::<K>().0, BLOCK / R::COUNT);
    for (chain, parts) in chains.zip(parts.as_chunks_mut::<K>().0) {
        let Some(blocks) = blocks.get(chain / vectors) else { return };
        let first = chain % vectors * R::COUNT;
        let nodes = BlockNodes::among::<R>(nodes_of(blocks.each_ref()), 0, displacement.count());
        let nodes = nodes.unwrap_or(BlockNodes::<N>::NONE);
        let mut moved = [[R::splat(0.0); 3]; N];
        unrolled!(node < N => {
            moved[node] = displacement.read_lanes::<R, N>(&nodes, node, first);
        });
        unrolled!(element < K => {
            let [a, b, c, d] = CORNERS[element % LONGEST];
            let corners = [moved[a % N], moved[b % N], moved[c % N], moved[d % N]];
            let deformation = Deformation::of_moved(&blocks[element], first, corners);
            let part = &mut parts[element];
            (part.block, part.first) = (&blocks[element], first);
            (part.h, part.invariants) = (deformation.h, deformation.invariants);
        });
    }
}

/// The second pass: the law.
#[inline(always)]
fn respond<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    parts: &mut [Part<'_, R>; 2],
    extremes: &mut Extremes<Pair<R>>,
) -> [Local<R>; 2] {
    let law = laws.widen::<Pair<R>>(|lane| {
        let part = &parts[lane / R::COUNT % 2];
        part.block.element(part.first + lane % R::COUNT)
    });
    let [near, far] = parts;
    let invariants = Invariants {
        i: Pair(near.invariants.i, far.invariants.i),
        j: Pair(near.invariants.j, far.invariants.j),
    };
    let local = Local::new::<L>(&law, invariants);
    let response = local.response::<L>(&law);
    (near.p1, near.s) = (response.p1.0, response.s.0);
    (far.p1, far.s) = (response.p1.1, response.s.1);
    extremes.least_j = invariants.j.min(extremes.least_j);
    extremes.saturation = response.saturation.max(extremes.saturation);
    local.split()
}

/// What else is made of it.
#[inline(always)]
fn look<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    part: &mut Part<'_, R>,
    local: &Local<R>,
    beside: &mut impl Beside,
) {
    let law = laws.widen(|lane| part.block.element(part.first + lane));
    let deformation = Deformation::with(part.h, part.invariants);
    part.fourth = beside.see::<R, L>(&law, part.block, part.first, &deformation, local);
}

/// Nodal forces from the stress, with what else goes to the elements' nodes.
#[inline(always)]
fn nodal_forces<R: Real>(part: &Part<'_, R>) -> [[R; 4]; 4] {
    let Part { block, first, .. } = *part;
    let deformation = Deformation::with(part.h, part.invariants);
    let stress = deformation.stress(part.p1, part.s);
    let minus_volume = -block.volume::<R>(first);
    let mut forces = [[R::splat(0.0); 3]; 4];
    for axis in 0..3 {
        let [x, y, z] = stress[axis];
        let row = [x * minus_volume, y * minus_volume, z * minus_volume];
        for corner in 0..3 {
            forces[corner + 1][axis] = dot(row, block.gradients::<R>(corner, first));
        }
        forces[0][axis] = -(forces[1][axis] + forces[2][axis] + forces[3][axis]);
    }
    let ([a, b, c, d], fourth) = (forces, part.fourth);
    [
        [a[0], a[1], a[2], fourth],
        [b[0], b[1], b[2], fourth],
        [c[0], c[1], c[2], fourth],
        [d[0], d[1], d[2], fourth],
    ]
}

/// The third pass: forces to the nodes of chains of `K` elements with `N` nodes.
#[inline(always)]
fn scatter<R: Real, const K: usize, const N: usize>(parts: &[Part<'_, R>], force: &mut Scatter<'_>) {
    let mut waiting = Waiting::NONE;
    for parts in parts.as_chunks::<K>().0 {
        let mut rows = [[R::splat(0.0); 4]; N];
        let mut blocks = [parts[0].block; K];
        unrolled!(element < K => {
            blocks[element] = parts[element].block;
            let forces = nodal_forces(&parts[element]);
            for corner in 0..4 {
                let row = &mut rows[CORNERS[element % LONGEST][corner] % N];
                for axis in 0..4 {
                    let first = element == 0 || corner == 0;
                    row[axis] = if first { forces[corner][axis] } else { row[axis] + forces[corner][axis] };
                }
            }
        });
        let (nodes, first) = (nodes_of(blocks), parts[0].first);
        match force.all_of::<R, N>(nodes) {
            Some(nodes) => force.add_corners(&nodes, first, rows, &mut waiting),
            // Elements between the nodes of two threads.
            None => force.add_some(nodes, first, rows),
        }
    }
}
