//! Rotation of the tissue: each lattice function has a frame, the columns, made orthonormal (Gram-Schmidt), of the
//! deformation gradient of a tetrahedron of four of its nodes. `S` is used in the frames in which it was computed: its
//! added inertia is ten thousand times the mass, and resists a rotation if it is behind it by a few degrees.

use bytemuck::{Pod, Zeroable};
use glam::Mat3;

use super::lattice::{Lattice, LatticeNode, nodes_of_cell};
use crate::copy::copy;
use crate::element::NodeInertia;
use crate::simd::NodeVector;

/// A 3 x 3 matrix by rows.
pub(super) type Matrix = [[f32; 3]; 3];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Four nodes that define a frame, and the inverse of the matrix of their edges at rest, 1/m.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FrameNodes {
    nodes: [u32; 4],
    inverse: Matrix,
}

/// The frames of the functions, in the caller's storage.
pub(super) struct Frames<'a> {
    pub(super) nodes: &'a mut [FrameNodes],
    pub(super) latest: &'a mut [Matrix],
    /// Rotations in the latest step.
    pub(super) in_latest_step: &'a mut [Matrix],
    /// Frames when `S` was computed, and rotations since.
    pub(super) of_stiffness: &'a mut [Matrix],
    pub(super) since_stiffness: &'a mut [Matrix],
}

impl Frames<'_> {
    /// Chooses four nodes for each function, far apart from each other.
    pub(super) fn choose(
        &mut self,
        lattice: &Lattice,
        places: &[LatticeNode],
        points: &[[f32; 3]],
        inertia: &[NodeInertia],
    ) {
        for (function, nodes) in self.nodes.iter_mut().enumerate() {
            *nodes = choose(function, lattice, places, (points, inertia));
        }
        self.latest.fill(IDENTITY);
    }

    /// Computes the present frames and rotations.
    pub(super) fn update(&mut self, displacement: &[NodeVector]) {
        let turns = self.latest.iter_mut().zip(&mut *self.in_latest_step);
        let since = self.of_stiffness.iter().zip(&mut *self.since_stiffness);
        for ((nodes, (latest, turn)), (start, since)) in self.nodes.iter().zip(turns).zip(since) {
            // A collapsed tetrahedron has no frame: the last one is kept.
            let previous = *latest;
            if let Some(basis) = nodes.basis(displacement) {
                *latest = basis;
            }
            *turn = times_transposed(latest, &previous);
            *since = times_transposed(latest, start);
        }
    }

    /// `S` is computed in the present frames.
    pub(super) fn start_stiffness(&mut self) {
        copy(self.of_stiffness, self.latest);
        self.since_stiffness.fill(IDENTITY);
    }

    /// Rotation of a function since `S` was computed.
    #[inline(always)]
    pub(super) fn since_stiffness(&self, function: usize) -> Mat3 {
        let turn = self.since_stiffness.get(function).unwrap_or(&IDENTITY);
        Mat3::from_cols_array_2d(turn).transpose()
    }

    /// Rotation in the latest step.
    #[inline(always)]
    pub(super) fn in_latest_step(&self, function: usize) -> Mat3 {
        let turn = self.in_latest_step.get(function).unwrap_or(&IDENTITY);
        Mat3::from_cols_array_2d(turn).transpose()
    }

    /// Rotation of each function since rest.
    pub(super) fn since_rest(&self) -> &[Matrix] {
        self.latest
    }
}

#[inline(always)]
fn times_transposed(a: &Matrix, b: &Matrix) -> Matrix {
    // Loops, because the compiler may leave closures as function calls.
    let mut product = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            product[i][j] = a[i][0] * b[j][0] + a[i][1] * b[j][1] + a[i][2] * b[j][2];
        }
    }
    product
}

#[inline(always)]
fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn unit(a: [f32; 3]) -> Option<[f32; 3]> {
    let length = libm::sqrtf(dot(a, a));
    let inverse = 1.0 / length;
    if length > 1e-6 && length.is_finite() { Some([a[0] * inverse, a[1] * inverse, a[2] * inverse]) } else { None }
}

impl FrameNodes {
    /// The orthonormal columns of the deformation gradient, by rows.
    #[inline(always)]
    fn basis(&self, displacement: &[NodeVector]) -> Option<Matrix> {
        let at = |node: u32| displacement.get(node as usize).map(|vector| vector.to_array());
        let [a, b, c, d] = self.nodes;
        let origin = at(a)?;
        let edges = [minus(at(b)?, origin), minus(at(c)?, origin), minus(at(d)?, origin)];
        // Columns of F = I + sum_k edge_k (x) row_k of the inverse.
        let (mut first, mut second) = (IDENTITY[0], IDENTITY[1]);
        for axis in 0..3 {
            for (edge, row) in edges.iter().zip(&self.inverse) {
                first[axis] += edge[axis] * row[0];
                second[axis] += edge[axis] * row[1];
            }
        }
        let first = unit(first)?;
        let along = dot(first, second);
        let across = [first[0] * along, first[1] * along, first[2] * along];
        let second = unit(minus(second, across))?;
        let third = cross(first, second);
        let row = |axis: usize| [first[axis], second[axis], third[axis]];
        Some([row(0), row(1), row(2)])
    }
}

/// Chooses among the nodes of a function: the node nearest to their centre, the one farthest from that, the one with
/// the largest triangle, and the one with the largest tetrahedron.
fn choose(
    function: usize,
    lattice: &Lattice,
    places: &[LatticeNode],
    (points, inertia): (&[[f32; 3]], &[NodeInertia]),
) -> FrameNodes {
    // Those without an element left do not turn with the tissue.
    let is_alone = |place: &&LatticeNode| inertia.get(place.node()).is_some_and(NodeInertia::is_alone);
    let nodes_of_function = || {
        let places = lattice.cells_of(function).into_iter().flatten().flat_map(|cell| nodes_of_cell(places, cell));
        places.filter(|place| !is_alone(place)).filter_map(|place| {
            let (_, weight) = lattice.weights(place).into_iter().find(|&(f, weight)| f == function && weight > 0.0)?;
            Some((place.node() as u32, *points.get(place.node())?, weight))
        })
    };
    let (mut sum, mut total) = ([0.0f32; 3], 0.0);
    for (_, point, weight) in nodes_of_function() {
        sum = [0, 1, 2].map(|axis| sum[axis] + weight * point[axis]);
        total += weight;
    }
    let centre = sum.map(|sum| sum / total);
    let node_with_largest = |score: &dyn Fn([f32; 3]) -> f32| {
        let mut best = (f32::NEG_INFINITY, 0, centre);
        for (node, point, _) in nodes_of_function() {
            let score = score(point);
            if score > best.0 {
                best = (score, node, point);
            }
        }
        (best.1, best.2)
    };
    let (a, origin) = node_with_largest(&|point| -dot(minus(point, centre), minus(point, centre)));
    let (b, first) = node_with_largest(&|point| dot(minus(point, origin), minus(point, origin)));
    let e = minus(first, origin);
    let (c, second) = node_with_largest(&|point| {
        let normal = cross(e, minus(point, origin));
        dot(normal, normal)
    });
    let normal = cross(e, minus(second, origin));
    let (d, third) = node_with_largest(&|point| {
        let height = dot(normal, minus(point, origin));
        height * height
    });
    let (f, g) = (minus(second, origin), minus(third, origin));
    // Rows of the inverse of the matrix with columns e, f, g; the determinant is six times the volume.
    let determinant = dot(e, cross(f, g));
    let extent = dot(e, e);
    let inverse = if determinant * determinant > 1e-12 * extent * extent * extent {
        [cross(f, g), cross(g, e), cross(e, f)].map(|row| row.map(|entry| entry / determinant))
    } else {
        // All nodes are in one plane: the frame never rotates.
        [[0.0; 3]; 3]
    };
    FrameNodes { nodes: [a, b, c, d], inverse }
}
