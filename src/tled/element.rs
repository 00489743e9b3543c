//! Linear tetrahedra, several side by side: deformation from nodal displacements and nodal forces from the
//! first Piola-Kirchhoff stress, `f_a = -V P grad N_a` (Miller et al. 2007, with the stress of
//! [`crate::material`]). Nodes 1, 2, 3 carry stored gradients; node 0 takes minus their sum, so the four
//! forces of an element add up to zero and a translation gives exactly none.

use super::Status;
use crate::lanes::{BLOCK, BlockNodes, Gather, Pair, Real, Scatter, dot};
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

    /// Deformation of the elements in lanes `first..` of two blocks of pairs, which have three nodes in common.
    #[inline(always)]
    fn of_pair([one, other]: [&ElementBlock; 2], first: usize, displacement: Gather<'_>) -> [Self; 2] {
        let nodes = BlockNodes::among::<R>(nodes_of_pair([one, other]), 0, displacement.count());
        let nodes = nodes.unwrap_or(BlockNodes::NONE);
        let at = |corner: usize| displacement.read_lanes::<R, 5>(&nodes, corner, first);
        let [p, a, b, c, q] = [at(0), at(1), at(2), at(3), at(4)];
        [Self::of_moved(one, first, [p, a, b, c]), Self::of_moved(other, first, [q, a, c, b])]
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
#[derive(Clone, Copy)]
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

/// Elements side by side on their way through the passes of [`add_forces`].
#[derive(Clone, Copy)]
struct Part<R> {
    h: Matrix<R>,
    invariants: Invariants<R>,
    p1: R,
    s: R,
    /// For the fourth component of the forces.
    fourth: R,
}

impl<R: Real> Part<R> {
    #[inline(always)]
    fn nothing() -> Self {
        let zero = R::splat(0.0);
        Self {
            h: [[zero; 3]; 3],
            invariants: Invariants { i: zero, j: zero },
            p1: zero,
            s: zero,
            fourth: zero,
        }
    }
}

/// Vectors of elements that go through the passes together.
const TOGETHER: usize = 8;

/// Adds the internal forces of elements to `force`, with minus sign; `paired` if the blocks hold pairs ([`crate::pairs`]), one
/// element in each of two. In three passes over a few vectors of elements: the law is a long chain of operations that wait
/// for each other, and gets nothing else in between ([`Pair`]).
#[inline(always)]
pub(crate) fn add_forces<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    (blocks, paired): (&[ElementBlock], bool),
    displacement: Gather<'_>,
    force: &mut Scatter<'_>,
    beside: &mut impl Beside,
    extremes: &mut Extremes<Pair<R>>,
) {
    let mut parts = [Part::<R>::nothing(); TOGETHER];
    let vectors = BLOCK / R::COUNT;
    for blocks in blocks.chunks((TOGETHER / vectors).max(2)) {
        let Some(first) = blocks.first() else { continue };
        // Vectors of a pair of blocks in turn.
        let place = |vector: usize| {
            let (block, part) = if paired {
                (vector / 2 / vectors * 2 + vector % 2, vector / 2 % vectors)
            } else {
                (vector / vectors, vector % vectors)
            };
            Place { block: blocks.get(block).unwrap_or(first), first: part * R::COUNT }
        };
        let count = blocks.len() * vectors;
        if paired {
            for (pair, parts) in parts.as_chunks_mut::<2>().0.iter_mut().enumerate().take(count / 2) {
                let (near, far) = (place(2 * pair), place(2 * pair + 1));
                let both = Deformation::<R>::of_pair([near.block, far.block], near.first, displacement);
                for (part, deformation) in parts.iter_mut().zip(both) {
                    (part.h, part.invariants) = (deformation.h, deformation.invariants);
                }
            }
        } else {
            for (vector, part) in parts.iter_mut().enumerate().take(count) {
                let Place { block, first } = place(vector);
                let deformation = Deformation::<R>::of_block(block, first, displacement);
                (part.h, part.invariants) = (deformation.h, deformation.invariants);
            }
        }
        // The last pair may be half empty: what was there before is computed once more, for nobody.
        for (pair, parts) in parts.as_chunks_mut::<2>().0.iter_mut().enumerate().take(count.div_ceil(2)) {
            let places = [place(2 * pair), place(2 * pair + 1)];
            let locals = respond::<R, L>(laws, places, parts, extremes);
            for ((place, part), local) in places.into_iter().zip(parts).zip(&locals).take(count - 2 * pair) {
                look::<R, L>(laws, place, part, local, beside);
            }
        }
        if paired {
            for (pair, parts) in parts.as_chunks::<2>().0.iter().enumerate().take(count / 2) {
                scatter_pair(parts, [place(2 * pair), place(2 * pair + 1)], force);
            }
        } else {
            for (vector, part) in parts.iter().enumerate().take(count) {
                let place = place(vector);
                add_rows(place.block.nodes(), place.first, nodal_forces(part, place), force);
            }
        }
    }
}

/// Elements side by side: lanes of a block, from `first` on.
#[derive(Clone, Copy)]
struct Place<'a> {
    block: &'a ElementBlock,
    first: usize,
}

/// The second pass: the law.
#[inline(always)]
fn respond<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    places: [Place<'_>; 2],
    [near, far]: &mut [Part<R>; 2],
    extremes: &mut Extremes<Pair<R>>,
) -> [Local<R>; 2] {
    let law = laws.widen::<Pair<R>>(|lane| {
        let Place { block, first } = places[lane / R::COUNT % 2];
        block.element(first + lane % R::COUNT)
    });
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
    Place { block, first }: Place<'_>,
    part: &mut Part<R>,
    local: &Local<R>,
    beside: &mut impl Beside,
) {
    let law = laws.widen(|lane| block.element(first + lane));
    let deformation = Deformation::with(part.h, part.invariants);
    part.fourth = beside.see::<R, L>(&law, block, first, &deformation, local);
}

/// Nodal forces from the stress, with what else goes to the elements' nodes.
#[inline(always)]
fn nodal_forces<R: Real>(part: &Part<R>, Place { block, first }: Place<'_>) -> [[R; 4]; 4] {
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

/// The third pass: forces to the nodes of pairs of elements.
#[inline(always)]
fn scatter_pair<R: Real>([one, other]: &[Part<R>; 2], [near, far]: [Place<'_>; 2], force: &mut Scatter<'_>) {
    let [p, mut a, mut b, mut c] = nodal_forces(one, near);
    let [q, a2, c2, b2] = nodal_forces(other, far);
    for axis in 0..4 {
        a[axis] = a[axis] + a2[axis];
        b[axis] = b[axis] + b2[axis];
        c[axis] = c[axis] + c2[axis];
    }
    add_rows(nodes_of_pair([near.block, far.block]), near.first, [p, a, b, c, q], force);
}

/// The nodes of blocks of pairs: `p`, `a`, `b`, `c`, `q` of `(p, a, b, c)` and `(q, a, c, b)`.
#[inline(always)]
fn nodes_of_pair([one, other]: [&ElementBlock; 2]) -> [&[u32; BLOCK]; 5] {
    let ([p, a, b, c], [q, ..]) = (one.nodes(), other.nodes());
    [p, a, b, c, q]
}

/// Adds to the nodes that are there.
#[inline(always)]
fn add_rows<R: Real, const N: usize>(
    nodes: [&[u32; BLOCK]; N],
    first: usize,
    rows: [[R; 4]; N],
    force: &mut Scatter<'_>,
) {
    match force.all_of::<R, N>(nodes) {
        Some(nodes) => force.add_corners(&nodes, first, rows),
        // Elements between the nodes of two threads.
        None => force.add_some(nodes, first, rows),
    }
}
