//! One block of elements in a refresh: their bounds, turned into the frames of the cycle, go to the sums of the nodes
//! (N/m) and of the lattice's cells (N m, times `s_c D^2 / 4`).

use super::assembly::{Assembly, Element, NO_SLOTS};
use super::bound::{Bound, MatrixSums};
use super::frames::{Frames, Rotation};
use super::lattice::MAX_FUNCTIONS;
use super::vectors::frame_of;
use crate::lanes::{BLOCK, Gather, Kernel, NodeVector, Real, Waiting, write_rows};
use crate::material::{Law, Laws, Local};
use crate::scene::ElementBlock;
use crate::tled::Deformation;

pub struct OneBlock<'a, L> {
    pub(super) laws: Laws<'a, L>,
    pub(super) block: &'a ElementBlock,
    pub(super) displacement: Gather<'a>,
    pub(super) sums: MatrixSums<'a>,
    /// Tells the frames of the nodes.
    pub(super) next: &'a [NodeVector],
    /// None without a lattice.
    pub(super) assembly: Option<Assembly<'a>>,
    pub(super) frames: &'a Frames,
    pub(super) weight: f32,
}

/// What the lattice needs to know of a block's elements: a column of `C` each, and as fourth numbers `V iso`, `V volume`
/// and nothing.
type Tangents = [[[f32; 4]; BLOCK]; 3];

impl<L: Law> Kernel for OneBlock<'_, L> {
    type Output = ();

    const ONE_BY_ONE: bool = true;

    #[inline(always)]
    fn run<R: Real>(mut self) {
        let block = self.block;
        let mut tangents = [[[0.0; 4]; BLOCK]; 3];
        let mut waiting = [Waiting::NONE; 2];
        for first in (0..BLOCK).step_by(R::COUNT) {
            self.bound::<R>(first, &mut tangents, &mut waiting);
        }
        let Some(assembly) = &mut self.assembly else {
            return;
        };
        let mut slots = NO_SLOTS;
        for lane in 0..BLOCK {
            let mut gradients = [[0.0; 3]; 4];
            for corner in 0..3 {
                for axis in 0..3 {
                    gradients[corner + 1][axis] = block.gradient_of(corner, axis, lane);
                    gradients[0][axis] -= gradients[corner + 1][axis];
                }
            }
            let nodes = [0, 1, 2, 3].map(|corner| block.node(corner, lane));
            let columns = tangents.map(|column| column[lane % BLOCK]);
            let [[_, _, _, iso], [_, _, _, volume], _] = columns;
            let cofactor = columns.map(|[x, y, z, _]| [x, y, z, 0.0]);
            let element = Element { nodes, gradients, iso, volume, cofactor };
            if !assembly.add_in_cells::<R::Eight>(&element) {
                assembly.add_element(&element, &mut slots);
            }
        }
    }
}

impl<L: Law> OneBlock<'_, L> {
    /// The bounds of the elements in lanes `first..`, into the sums of their nodes and into `tangents`.
    #[inline(always)]
    fn bound<R: Real>(&mut self, first: usize, tangents: &mut Tangents, waiting: &mut [Waiting<4>; 2]) {
        let block = self.block;
        let law = self.laws.widen(|lane| block.element(first + lane));
        let deformation = Deformation::<R>::of_block(block, first, self.displacement);
        let local = Local::new::<L>(&law, deformation.invariants);
        let bound = Bound::<R>::new::<L>(&law, block, first, &deformation, &local);
        // C in the frame of the element's first node.
        let mut turns = [Rotation::NONE; BLOCK];
        for (lane, turn) in turns.iter_mut().enumerate().take(R::COUNT) {
            let node = self.next.get(block.node(0, first + lane));
            *turn = self.frames.since_start(node.map_or(MAX_FUNCTIONS, frame_of));
        }
        let mut cofactor = [[R::splat(0.0); 3]; 3];
        for i in 0..3 {
            for k in 0..3 {
                let along = R::from_fn(|lane| turns[lane % BLOCK].0[k][i]);
                for j in 0..3 {
                    cofactor[i][j] = cofactor[i][j] + along * deformation.cofactor(k, j);
                }
            }
        }
        self.sums.add(&bound, block, first, &cofactor, waiting);
        if self.assembly.is_none() {
            return;
        }
        let weight = block.volume::<R>(first) * R::splat(self.weight);
        let beside = [weight * bound.iso, weight * bound.volume, R::splat(0.0)];
        for (j, (column, beside)) in tangents.iter_mut().zip(beside).enumerate() {
            write_rows(column, first, [cofactor[0][j], cofactor[1][j], cofactor[2][j], beside]);
        }
    }
}
