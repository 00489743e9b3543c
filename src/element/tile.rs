//! The tables of the elements, in tiles of [`TILE`] elements: nodes, shape function gradients (1/m), rest volumes
//! (m^3).

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

use super::symmetric::Symmetric;
use crate::mesh::gradients;
use crate::mesh::strips::Numbered;
use crate::simd::{Real, TILE, TileNodes};

/// Bits of an element's index: a mesh has fewer elements than this.
const ELEMENT_BITS: u32 = 24;
const ELEMENT: u32 = (1 << ELEMENT_BITS) - 1;

/// Most elements of a mesh.
pub(crate) const MOST_ELEMENTS: usize = ELEMENT as usize;

/// Tables of [`TILE`] elements as a structure of arrays. The elements of a tile come from different parts of the mesh.
/// Neighbours share nodes, and additions to a shared node one after the other would each wait for the last one. Places
/// without an element have volume zero and the nodes of another element, to which they add zero.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct ElementTile {
    /// Nodes.
    nodes: [[u32; TILE]; 4],
    /// Shape function gradients of nodes 1, 2, 3 along x, y, z, 1/m.
    gradients: [[[f32; TILE]; 3]; 3],
    /// Rest volumes, m^3.
    volumes: [f32; TILE],
    /// Index of each element in the mesh; in the upper eight bits, two for each corner, which of the tissues at that
    /// node it is of ([`ElementTile::slot`]).
    elements: [u32; TILE],
    /// Largest eigenvalue of `sum_a ga ga^T` over the four shape function gradients, 1/m^2.
    gradient_eigenvalues: [f32; TILE],
}

impl ElementTile {
    /// A tile without elements.
    pub const EMPTY: Self = Self {
        nodes: [[0; TILE]; 4],
        gradients: [[[0.0; TILE]; 3]; 3],
        volumes: [0.0; TILE],
        elements: [0; TILE],
        gradient_eigenvalues: [0.0; TILE],
    };

    /// Node `corner` (0 to 3) of the element at place `lane`.
    #[inline(always)]
    pub(crate) fn node(&self, corner: usize, lane: usize) -> usize {
        self.nodes[corner % 4][lane % TILE] as usize
    }

    /// The nodes, by corner and place.
    #[inline(always)]
    pub(crate) fn nodes(&self) -> [&[u32; TILE]; 4] {
        self.nodes.each_ref()
    }

    /// The nodes, if all are below `count`.
    #[inline(always)]
    pub(crate) fn nodes_below<R: Real>(&self, count: usize) -> Option<TileNodes<'_, 4>> {
        TileNodes::in_range::<R>(self.nodes(), 0, count)
    }

    /// Index in the mesh of the element at place `lane`.
    #[inline(always)]
    pub(crate) fn element(&self, lane: usize) -> usize {
        (self.elements[lane % TILE] & ELEMENT) as usize
    }

    /// Which of the tissues at node `corner` the element at place `lane` is of: 0 or 1, 2 for any further one.
    #[inline(always)]
    pub(crate) fn slot(&self, corner: usize, lane: usize) -> u8 {
        (self.elements[lane % TILE] >> (ELEMENT_BITS + 2 * (corner as u32 % 4)) & 3) as u8
    }

    /// Sets [`ElementTile::slot`] of all corners.
    pub(crate) fn set_slots(&mut self, lane: usize, slots: [u8; 4]) {
        let bits = slots.iter().rev().fold(0, |bits, &slot| bits << 2 | u32::from(slot & 3));
        let element = &mut self.elements[lane % TILE];
        *element = *element & ELEMENT | bits << ELEMENT_BITS;
    }

    /// A gradient component of shape function `corner + 1` (`corner` 0 to 2), of the elements from place `first` on,
    /// 1/m.
    #[inline(always)]
    pub(crate) fn gradient<R: Real>(&self, corner: usize, axis: usize, first: usize) -> R {
        vector_at(&self.gradients[corner][axis], first)
    }

    /// The gradient of shape function `corner + 1`, of the elements from place `first` on, 1/m.
    #[inline(always)]
    pub(crate) fn gradients<R: Real>(&self, corner: usize, first: usize) -> [R; 3] {
        [self.gradient(corner, 0, first), self.gradient(corner, 1, first), self.gradient(corner, 2, first)]
    }

    /// A gradient component of shape function `corner + 1`, of the element at place `lane`, 1/m.
    #[inline(always)]
    pub(crate) fn gradient_of(&self, corner: usize, axis: usize, lane: usize) -> f32 {
        self.gradients[corner % 3][axis % 3][lane % TILE]
    }

    /// Largest eigenvalue of `sum_a ga ga^T` of the elements from place `first` on, 1/m^2.
    #[inline(always)]
    pub(crate) fn gradient_eigenvalue<R: Real>(&self, first: usize) -> R {
        vector_at(&self.gradient_eigenvalues, first)
    }

    /// Rest volumes of the elements from place `first` on, m^3.
    #[inline(always)]
    pub(crate) fn volume<R: Real>(&self, first: usize) -> R {
        vector_at(&self.volumes, first)
    }

    /// Whether an element has the edges between these points (m): `sum_a (x_a - x_0) ga^T` is one.
    pub(crate) fn has_edges_of(&self, lane: usize, points: &[[f32; 3]]) -> bool {
        // Slivers come near it by rounding.
        const MOST: f64 = 0.05;
        let at = |corner| {
            points.get(self.node(corner, lane)).map(|point| DVec3::from_array(point.map(f64::from))).unwrap_or_default()
        };
        let origin = at(0);
        let mut sum = DMat3::IDENTITY * -1.0;
        for corner in 0..3 {
            let gradient = [0, 1, 2].map(|axis| f64::from(self.gradient_of(corner, axis, lane)));
            let edge = at(corner + 1) - origin;
            sum += DMat3::from_cols(edge * gradient[0], edge * gradient[1], edge * gradient[2]);
        }
        sum.abs_diff_eq(DMat3::ZERO, MOST)
    }

    /// Copies the element at a place of some tiles to place `lane`.
    #[inline(always)]
    pub(crate) fn copy_element(&mut self, lane: usize, tiles: &[Self], place: u32) {
        let (Some(tile), from, lane) = (tiles.get(place as usize / TILE), place as usize % TILE, lane % TILE) else {
            return;
        };
        for corner in 0..4 {
            self.nodes[corner][lane] = tile.nodes[corner][from];
        }
        for corner in 0..3 {
            for axis in 0..3 {
                self.gradients[corner][axis][lane] = tile.gradients[corner][axis][from];
            }
        }
        self.elements[lane] = tile.elements[from];
        self.gradient_eigenvalues[lane] = tile.gradient_eigenvalues[from];
        self.volumes[lane] = tile.volumes[from];
    }

    /// Makes the places from `lane` on ones without an element.
    pub(crate) fn empty_from(&mut self, lane: usize) {
        self.volumes.iter_mut().skip(lane).for_each(|volume| *volume = 0.0);
    }

    /// Writes an element with these `corners` (m) to place `lane`.
    pub(crate) fn write(&mut self, lane: usize, element: Numbered, corners: [DVec3; 4]) {
        fn set<T>(values: &mut [T; TILE], lane: usize, value: T) {
            if let Some(place) = values.get_mut(lane) {
                *place = value;
            }
        }
        let (slopes, volume) = gradients(corners);
        for (nodes, node) in self.nodes.iter_mut().zip(element.nodes) {
            // Places that get no element keep the nodes of the first one.
            if lane == 0 {
                nodes.fill(node);
            }
            set(nodes, lane, node);
        }
        for (components, slope) in self.gradients.iter_mut().zip(slopes) {
            for (component, value) in components.iter_mut().zip(slope.to_array()) {
                set(component, lane, value as f32);
            }
        }
        set(&mut self.volumes, lane, volume as f32);
        set(&mut self.elements, lane, element.element as u32);
        set(&mut self.gradient_eigenvalues, lane, gradient_eigenvalue(slopes));
    }
}

/// The vector of values from place `first` of a row of a tile on.
#[inline(always)]
pub(super) fn vector_at<R: Real>(row: &[f32; TILE], first: usize) -> R {
    let first = multiple_of_width::<R>(first);
    R::from_fn(|lane| row[(first + lane) % TILE])
}

/// Writes a vector to a row of a tile, from place `first` on.
#[inline(always)]
pub(super) fn write_at<R: Real>(row: &mut [f32; TILE], first: usize, vector: R) {
    let first = multiple_of_width::<R>(first);
    for lane in 0..R::COUNT {
        row[(first + lane) % TILE] = vector.lane(lane);
    }
}

/// `first`, which is one already: this shows the compiler that no index is out of range.
#[inline(always)]
fn multiple_of_width<R: Real>(first: usize) -> usize {
    first / R::COUNT % (TILE / R::COUNT).max(1) * R::COUNT
}

/// An upper bound, despite rounding, of the largest eigenvalue of `sum_a ga ga^T` over the four gradients, 1/m^2.
fn gradient_eigenvalue(slopes: [DVec3; 3]) -> f32 {
    let mut sum = Symmetric::<f32>::default();
    for g in [slopes[0], slopes[1], slopes[2], -(slopes[0] + slopes[1] + slopes[2])] {
        sum.xx += (g.x * g.x) as f32;
        sum.yy += (g.y * g.y) as f32;
        sum.zz += (g.z * g.z) as f32;
        sum.xy += (g.x * g.y) as f32;
        sum.yz += (g.y * g.z) as f32;
        sum.zx += (g.z * g.x) as f32;
    }
    sum.largest_eigenvalue() * (1.0 + 1e-5)
}
