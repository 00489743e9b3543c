//! What fibres add to the bounds of the stiffness: matrices of the nodes for the critical step, as
//! [`super::critical_bounds`] and [`super::patch_bounds`] have them of the law (1/s^2), and tangents for a coarse
//! stiffness ([`super::tile_tangents`]). Scenes without fibres do not come here.

use crate::simd::{Gather, Kernel, NodeVector, Piece, Real, ScatterBuffer, TILE, TileNodes, dispatch, dot};

use super::critical_bounds::{Image, NodeMatrices, mass_weighted_gradients};
use super::deformation::{Deformation, Vector};
use super::fibres::{FibreBounds, FibreTile, Fibrous};
use super::patch::{Neighbours, PatchTile, Patches};
use super::patch_bounds::{mass_root, weighted_gradient};
use super::patch_deformation::{PatchDeformations, gradient};
use super::symmetric::Symmetric;
use super::tile::vector_at;
use super::tile_tangents::{Tangent, TileTangents};
use super::{ElementTile, NodeInertia};

/// Adds the matrices of the fibres in elements to those of their nodes, whose displacements are in `sums`.
pub(crate) fn add_fibre_bounds(
    fibres: Fibrous<'_>,
    tiles: &[ElementTile],
    inertia: &[NodeInertia],
    sums: &mut NodeMatrices<'_>,
) {
    dispatch(OfElements { fibres, tiles, inertia: Gather::new(bytemuck::must_cast_slice(inertia)), sums });
}

/// Adds the matrices of the fibres in patches, with weights of the nodes that rows begin with.
pub(crate) fn add_patch_fibre_bounds(
    fibres: Fibrous<'_>,
    patches: Patches<'_>,
    inertia: &[NodeInertia],
    weights: &[NodeVector],
    sums: &mut NodeMatrices<'_>,
) {
    let (inertia, weights) = (Gather::new(bytemuck::must_cast_slice(inertia)), Gather::new(weights));
    dispatch(OfPatches { fibres, patches, inertia, weights, sums });
}

/// The directions of a shape function gradient under the parts of a bound, and their sums over the nodes of an element
/// or a patch.
#[derive(Clone, Copy)]
struct Lengths<R> {
    own: R,
    of_c: R,
    of_x: [R; FibreBounds::<f32>::TERMS],
}

impl<R: Real> Lengths<R> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = R::splat(0.0);
        Self { own: zero, of_c: zero, of_x: [zero; FibreBounds::<f32>::TERMS] }
    }

    /// Adds those of the gradient `g` of a node with a weight.
    #[inline(always)]
    fn add(&mut self, bounds: &FibreBounds<R>, deformation: &Deformation<R>, g: Vector<R>, weight: R) {
        let c = Image::of_cofactor(deformation, g);
        self.own = weight.fused(dot(g, g).sqrt(), self.own);
        self.of_c = weight.fused(c.length, self.of_c);
        for term in 0..self.of_x.len() {
            let x = bounds.image(term, g, c.vector);
            self.of_x[term] = weight.fused(dot(x, x).sqrt(), self.of_x[term]);
        }
    }
}

/// Adds the lengths of a gradient with a weight to the sums of its element or patch.
struct AddLengths<'a, R> {
    lengths: &'a mut Lengths<R>,
    bounds: &'a FibreBounds<R>,
    deformation: &'a Deformation<R>,
    g: Vector<R>,
    weight: R,
}

impl<R: Real> Piece for AddLengths<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { lengths, bounds, deformation, g, weight } = self;
        lengths.add(bounds, deformation, g, weight);
    }
}

/// What the node with this gradient and weight gets: by Cauchy-Schwarz, as in [`super::critical_bounds`].
struct OfNode<'a, R> {
    lengths: &'a Lengths<R>,
    bounds: &'a FibreBounds<R>,
    deformation: &'a Deformation<R>,
    g: Vector<R>,
    weight: R,
}

impl<R: Real> Piece for OfNode<'_, R> {
    type Output = Symmetric<R>;

    #[inline(always)]
    fn run(self) -> Symmetric<R> {
        let Self { lengths, bounds, deformation, g, weight } = self;
        let share = R::splat(1.0).divide(weight);
        let c = Image::of_cofactor(deformation, g);
        let isotropic = share * bounds.isotropic * dot(g, g).sqrt() * lengths.own;
        let mut sum = c.matrix(share * bounds.volume * lengths.of_c);
        for term in 0..lengths.of_x.len() {
            let x = Image::new(bounds.image(term, g, c.vector));
            let matrix = x.matrix(share * bounds.stiffening[term] * lengths.of_x[term]);
            sum = sum.plus(&matrix);
        }
        Symmetric { xx: sum.xx + isotropic, yy: sum.yy + isotropic, zz: sum.zz + isotropic, ..sum }
    }
}

struct OfElements<'a, 'b> {
    fibres: Fibrous<'a>,
    tiles: &'a [ElementTile],
    inertia: Gather<'a>,
    sums: &'a mut NodeMatrices<'b>,
}

impl Kernel for OfElements<'_, '_> {
    type Output = ();

    const SELDOM: bool = true;
    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { fibres, tiles, inertia, sums } = self;
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        for (number, tile) in tiles.iter().enumerate() {
            let mut buffers = [ScatterBuffer::NONE; 3];
            let Some(nodes) = tile.nodes_below::<R>(sums.zx_in_padding.len()) else { continue };
            for first in (0..TILE).step_by(R::COUNT) {
                let deformation = &Deformation::<R>::of_tile(tile, first, Gather::new(sums.zx_in_padding));
                let element = |lane: usize| tile.element(first + lane);
                let bounds = &fibres.bounds(fibres.tile(number), first, element, deformation);
                let (gradients, _) = mass_weighted_gradients(tile, first, &nodes, inertia);
                let mut lengths = Lengths::zero();
                for g in gradients {
                    R::run_piece(AddLengths { lengths: &mut lengths, bounds, deformation, g, weight: one });
                }
                let lengths = &lengths;
                let mut matrices = [Symmetric { xx: zero, yy: zero, zz: zero, xy: zero, yz: zero, zx: zero }; 4];
                for corner in 0..4 {
                    let g = gradients[corner];
                    matrices[corner] = R::run_piece(OfNode { lengths, bounds, deformation, g, weight: one });
                }
                sums.add_corners(&nodes, first, matrices, &mut buffers);
            }
        }
    }
}

struct OfPatches<'a, 'b> {
    fibres: Fibrous<'a>,
    patches: Patches<'a>,
    inertia: Gather<'a>,
    weights: Gather<'a>,
    sums: &'a mut NodeMatrices<'b>,
}

impl Kernel for OfPatches<'_, '_> {
    type Output = ();

    const SELDOM: bool = true;
    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        match R::COUNT {
            16 => self.add_all::<R, 1>(),
            8 => self.add_all::<R, 2>(),
            4 => self.add_all::<R, 4>(),
            _ => self.add_all::<R, TILE>(),
        }
    }
}

/// What a vector of patches gives to its nodes.
#[derive(Clone, Copy)]
struct OfPatch<R> {
    deformation: Deformation<R>,
    bounds: FibreBounds<R>,
    lengths: Lengths<R>,
    /// Root of one over the volume.
    root: R,
    /// Weighted gradient of the own node.
    own: Vector<R>,
}

impl OfPatches<'_, '_> {
    #[inline(always)]
    fn add_all<R: Real, const PARTS: usize>(self) {
        let Self { fibres, patches, inertia, weights, sums } = self;
        let below = inertia.count().min(weights.count());
        let zero = R::splat(0.0);
        let at_rest = Deformation::new([[zero; 3]; 3]);
        let none = fibres.bounds(&FibreTile::EMPTY, 0, |_| usize::MAX, &at_rest);
        let none = OfPatch { deformation: at_rest, bounds: none, lengths: Lengths::zero(), root: zero, own: [zero; 3] };
        for (number, tile) in patches.tiles().iter().enumerate() {
            let neighbours = patches.neighbours_of(tile);
            let mut deformations = [at_rest; PARTS];
            let displacement = Gather::new(sums.zx_in_padding);
            R::run_piece(PatchDeformations { tile, neighbours, displacement, deformations: &mut deformations });
            let mut parts = [none; PARTS];
            let Some(own_nodes) = tile.nodes_below::<R>(below) else { continue };
            // Loops, because the compiler may leave closures over vectors as function calls.
            for (part, (of_patch, deformation)) in parts.iter_mut().zip(&deformations).enumerate() {
                let first = part * R::COUNT;
                let element = |lane: usize| tile.element(first + lane);
                of_patch.deformation = *deformation;
                of_patch.bounds = fibres.bounds(fibres.tile(number), first, element, deformation);
                of_patch.root = vector_at::<R>(&tile.inverse_volumes, first).sqrt();
                let mut own = [zero; 3];
                for neighbour in neighbours {
                    let nodes = neighbour.nodes_below::<R>(below).unwrap_or(TileNodes::ALL_ZERO);
                    let [weight, ..] = weights.read_nodes::<R, 1>(&nodes, 0, first);
                    let g = weighted_gradient(neighbour, first, &nodes, of_patch.root, inertia);
                    let (lengths, bounds) = (&mut of_patch.lengths, &of_patch.bounds);
                    R::run_piece(AddLengths { lengths, bounds, deformation, g, weight });
                    for axis in 0..3 {
                        own[axis] = own[axis] - vector_at::<R>(&neighbour.gradients[axis], first);
                    }
                }
                let factor = of_patch.root * mass_root::<R>(&own_nodes, first, inertia);
                of_patch.own = [own[0] * factor, own[1] * factor, own[2] * factor];
                let [weight, ..] = weights.read_nodes::<R, 1>(&own_nodes, 0, first);
                let (lengths, bounds, g) = (&mut of_patch.lengths, &of_patch.bounds, of_patch.own);
                R::run_piece(AddLengths { lengths, bounds, deformation, g, weight });
            }
            for neighbour in neighbours {
                let mut buffers = [ScatterBuffer::NONE; 3];
                let Some(nodes) = neighbour.nodes_below::<R>(below) else { continue };
                for (part, OfPatch { deformation, bounds, lengths, root, .. }) in parts.iter().enumerate() {
                    let first = part * R::COUNT;
                    let [weight, ..] = weights.read_nodes::<R, 1>(&nodes, 0, first);
                    let g = weighted_gradient(neighbour, first, &nodes, *root, inertia);
                    let matrix = R::run_piece(OfNode { lengths, bounds, deformation, g, weight });
                    sums.add_corners(&nodes, first, [matrix], &mut buffers);
                }
            }
            let mut buffers = [ScatterBuffer::NONE; 3];
            for (part, OfPatch { deformation, bounds, lengths, own, .. }) in parts.iter().enumerate() {
                let [weight, ..] = weights.read_nodes::<R, 1>(&own_nodes, 0, part * R::COUNT);
                let matrix = R::run_piece(OfNode { lengths, bounds, deformation, g: *own, weight });
                sums.add_corners(&own_nodes, part * R::COUNT, [matrix], &mut buffers);
            }
        }
    }
}

/// Adds the tangents of fibres to those of a tile of elements. `weight` as in [`super::ElementTangents`].
pub(crate) fn add_fibre_tangents(
    fibres: Fibrous<'_>,
    (number, tile): (usize, &ElementTile),
    displacement: Gather<'_>,
    weight: f32,
    tangents: &mut TileTangents,
) {
    for (lane, tangent) in tangents.iter_mut().enumerate() {
        let deformation = Deformation::<f32>::of_tile(tile, lane, displacement);
        let bounds = fibres.bounds(fibres.tile(number), lane, |_| tile.element(lane), &deformation);
        add_tangent(&bounds, weight * tile.volume::<f32>(lane), tangent);
    }
}

/// The same for a tile of patches.
pub(crate) fn add_patch_fibre_tangents(
    fibres: Fibrous<'_>,
    (number, tile, neighbours): (usize, &PatchTile, &[Neighbours]),
    displacement: Gather<'_>,
    weight: f32,
    tangents: &mut TileTangents,
) {
    for (lane, tangent) in tangents.iter_mut().enumerate() {
        let (h, _) = gradient::<f32>(tile, neighbours, lane, [displacement, Gather::new(&[])]);
        let deformation = Deformation::new(h);
        let bounds = fibres.bounds(fibres.tile(number), lane, |_| tile.element(lane), &deformation);
        add_tangent(&bounds, weight * vector_at::<f32>(&tile.volumes, lane), tangent);
    }
}

/// Adds a bound, in the form that the tangent has.
fn add_tangent(bounds: &FibreBounds<f32>, weight: f32, tangent: &mut Tangent) {
    let [first, outer, exchanged, is_spatial] = &mut tangent.factors;
    if *is_spatial > 0.0 {
        let [shear, volume, stress] = bounds.spatial;
        *first += weight * (0.5 * shear + stress);
        *outer += weight * volume;
        *exchanged += weight * (0.5 * shear);
    } else {
        *first += weight * bounds.of_shape();
        *outer += weight * bounds.volume;
    }
}
