//! Where nodes are for the lattice: at their points at rest, but bodies of a mesh that share no node in a row along an
//! axis, with room between them. A function moves all nodes near its point, so over two bodies that lie side by side it
//! would tie them.

use core::array::from_fn;

use super::lattice::bounding_box;
use crate::scene::SceneView;

/// Most bodies that are set apart; further ones stay where they are, with the last of these.
const MOST: usize = 8;
/// Cells between two bodies: the functions of neither have nodes of the other, nor take light points of it along
/// ([`super::lattice::Lattice`]).
const GAP: u32 = 2;
/// A body begins and ends this share of a cell from a lattice point, so that rounding puts no node beyond it.
const MARGIN: f32 = 0.01;
/// The number of a node in no element, as where all nodes of its elements are held.
const NONE: u32 = u32::MAX;

/// See the module.
pub(super) struct Layout<'a> {
    points: &'a [[f32; 3]],
    /// The body of each node; nothing where there is one.
    body_of_node: &'a [u32],
    /// Lowest corner and size of the box of each body, m.
    boxes: [([f32; 3], [f32; 3]); MOST],
    bodies: usize,
    /// Along which they are in a row.
    axis: usize,
}

/// The box of a lattice: its size, m, and what of each body comes to lie in its lowest corner.
struct Arrangement {
    size: [f32; 3],
    origins: [[f32; 3]; MOST],
}

impl<'a> Layout<'a> {
    /// All as one body.
    pub(super) fn one(points: &'a [[f32; 3]]) -> Self {
        let all = bounding_box(points.iter());
        Self { points, body_of_node: &[], boxes: [all; MOST], bodies: 1, axis: 0 }
    }

    /// The bodies of a scene that share no node, in the order of their first nodes, with their axis for the shortest row.
    /// `labels` has room for one for each node.
    pub(super) fn of_bodies<M>(scene: SceneView<'_, M>, points: &'a [[f32; 3]], labels: &'a mut [u32]) -> Self {
        let Some(labels) = labels.get_mut(..points.len()) else { return Self::one(points) };
        let found = number_bodies(scene, labels);
        if found < 2 {
            return Self::one(points);
        }
        let bodies = found.min(MOST);
        let boxes_of = |labels: &[u32]| {
            from_fn(|body| {
                let own = points.iter().zip(labels).enumerate();
                let own = own.filter(|(node, (_, label))| **label as usize == body && !scene.is_alone(*node));
                bounding_box(own.map(|(_, (point, _))| point))
            })
        };
        // What is held on all sides belongs to the body next to it.
        let boxes: [_; MOST] = boxes_of(labels);
        for (label, point) in labels.iter_mut().zip(points).filter(|(label, _)| **label == NONE) {
            *label = nearest(boxes.iter().take(bodies), point) as u32;
        }
        let (boxes, body_of_node) = (boxes_of(labels), &*labels);
        let mut layout = Self { points, body_of_node, boxes, bodies, axis: 0 };
        let lengths = [0, 1, 2].map(|axis| layout.lengths(axis).sum::<f32>());
        layout.axis = (1..3).fold(0, |least, axis| if lengths[axis % 3] < lengths[least % 3] { axis } else { least });
        layout
    }

    /// How many bodies are set apart; one where all are one.
    pub(super) const fn bodies(&self) -> usize {
        self.bodies
    }

    fn lengths(&self, axis: usize) -> impl Iterator<Item = f32> {
        self.boxes.iter().take(self.bodies).map(move |(_, size)| size[axis % 3])
    }

    /// Of the box around them, in a row without what is between, m.
    pub(super) fn size(&self) -> [f32; 3] {
        from_fn(|axis| match axis == self.axis {
            true => self.lengths(axis).sum(),
            false => self.lengths(axis).fold(0.0, f32::max),
        })
    }

    /// Three grids of near-cubic cells, with `parts` cells along the longest side of the box. Along the other sides the
    /// number of cells is rounded down, to the nearest integer and up. Bodies in a row have whole cells each.
    pub(super) fn near_cubic(&self, parts: u32) -> [[u32; 3]; 3] {
        let size = self.size();
        let longest = size.iter().copied().fold(0.0, f32::max);
        // 0.01, because rounding may make an integer slightly smaller or larger.
        [0.01, 0.5, 0.99].map(|up| {
            let mut cells = size.map(|size| (libm::floorf(size / longest * parts as f32 + up) as u32).max(1));
            if self.bodies > 1 {
                // A little wider, so that a length that this divides needs no cell more for its margins.
                cells[self.axis % 3] = self.cells_of_row((1.0 + 3.0 * MARGIN) * longest / parts as f32);
            }
            cells
        })
    }

    /// Cells of this width in a row of all bodies.
    fn cells_of_row(&self, width: f32) -> u32 {
        let gaps = GAP * (self.bodies as u32 - 1);
        self.lengths(self.axis).fold(gaps, |sum, length| sum.saturating_add(cells_of(length, width)))
    }

    /// For a lattice of these cells; none if it has too few for a row of all bodies.
    fn arranged(&self, cells: [u32; 3]) -> Option<Arrangement> {
        let mut arrangement = Arrangement { size: self.size(), origins: self.boxes.map(|(low, _)| low) };
        if self.bodies == 1 {
            return Some(arrangement);
        }
        let (axis, most) = (self.axis % 3, cells[self.axis % 3]);
        // Wide enough for a cell a body; then the least width for which there are cells enough, by halving.
        let (mut wide, mut narrow) = (2.0 * self.lengths(axis).fold(0.0, f32::max), 0.0);
        if self.cells_of_row(wide) > most {
            return None;
        }
        for _ in 0..24 {
            let middle = 0.5 * (wide + narrow);
            *(if self.cells_of_row(middle) > most { &mut narrow } else { &mut wide }) = middle;
        }
        let mut start = 0;
        for (origin, (_, size)) in arrangement.origins.iter_mut().zip(&self.boxes).take(self.bodies) {
            origin[axis] -= (start as f32 + MARGIN) * wide;
            start += cells_of(size[axis], wide) + GAP;
        }
        arrangement.size[axis] = most as f32 * wide;
        Some(arrangement)
    }

    /// Size of the box of a lattice of these cells, m.
    pub(super) fn box_of(&self, cells: [u32; 3]) -> Option<[f32; 3]> {
        self.arranged(cells).map(|arrangement| arrangement.size)
    }

    /// Calls `visit` with each node and its place from the lowest corner of the box of a lattice of these cells, m.
    pub(super) fn each_node(&self, cells: [u32; 3], mut visit: impl FnMut(usize, [f32; 3])) {
        let Some(Arrangement { origins, .. }) = self.arranged(cells) else { return };
        for (node, point) in self.points.iter().enumerate() {
            let body = self.body_of_node.get(node).map_or(0, |&body| body as usize % MOST);
            visit(node, [0, 1, 2].map(|axis| point[axis] - origins[body][axis]));
        }
    }
}

/// Whole cells of a width for a length and its margins.
fn cells_of(length: f32, width: f32) -> u32 {
    libm::ceilf(length / width + 2.0 * MARGIN) as u32
}

/// The box to which a point is nearest.
fn nearest<'a>(boxes: impl Iterator<Item = &'a ([f32; 3], [f32; 3])>, point: &[f32; 3]) -> usize {
    let distance = |(low, size): &([f32; 3], [f32; 3])| {
        [0, 1, 2].map(|axis| (low[axis] - point[axis]).max(point[axis] - low[axis] - size[axis]).max(0.0))
    };
    let squares = boxes.map(|each| distance(each).into_iter().fold(0.0, |sum, along| sum + along * along));
    squares.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(0, |(body, _)| body)
}

/// Gives nodes that elements connect the same number, counted from zero by their first nodes and at most [`MOST`] - 1, and
/// others [`NONE`]. How many bodies there are.
fn number_bodies<M>(scene: SceneView<'_, M>, labels: &mut [u32]) -> usize {
    // A forest: each node names one that is no later, and a root itself.
    labels.fill(NONE);
    for (tile, lane) in scene.places() {
        for corner in 0..4 {
            let node = tile.node(corner, lane);
            if let Some(label) = labels.get_mut(node).filter(|label| **label == NONE) {
                *label = node as u32;
            }
            unite(labels, tile.node(0, lane), node);
        }
    }
    let mut bodies = 0;
    for node in 0..labels.len() {
        let named = labels.get(node).copied().unwrap_or(NONE) as usize;
        if named == NONE as usize {
            continue;
        }
        // Earlier nodes have their numbers.
        let number = match labels.get(named) {
            Some(&number) if named != node => number,
            _ => {
                bodies += 1;
                (bodies - 1).min(MOST - 1) as u32
            }
        };
        if let Some(label) = labels.get_mut(node) {
            *label = number;
        }
    }
    bodies
}

/// The root of a node, which nodes on the way are brought nearer to.
fn root(labels: &mut [u32], mut node: usize) -> usize {
    let of = |labels: &[u32], node: usize| labels.get(node).map_or(node, |&label| label as usize);
    loop {
        let named = of(labels, node);
        if named >= node {
            return node;
        }
        let next = of(labels, named);
        if let Some(label) = labels.get_mut(node) {
            *label = next as u32;
        }
        node = next;
    }
}

fn unite(labels: &mut [u32], one: usize, other: usize) {
    let (one, other) = (root(labels, one), root(labels, other));
    if let Some(label) = labels.get_mut(one.max(other)) {
        *label = one.min(other) as u32;
    }
}
