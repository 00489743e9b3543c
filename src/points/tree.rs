//! A tree of boxes over the elements of a mesh, in memory of the caller: elements in the order of a Morton curve
//! (Morton 1966) through their centres, four in a leaf, and the leaves under a complete binary tree (Karras 2012 has the
//! like for graphics processors). It finds the element nearest to a place: inside one the distance is zero, so both
//! questions are one.

use glam::DVec3;

use super::nearest::{Nearest, of_tetrahedron, within};
use super::{FollowedPoint, PointError};
use crate::heap_sort;
use crate::mesh::{CURVE_BITS, Mesh, every_third_bit};

/// Elements of a leaf.
const LEAF: usize = 4;
/// Words of a box: least and largest x, y, z.
const BOX: usize = 6;
/// Levels of a tree of 2^32 elements, with some to spare.
const DEPTH: usize = 40;
/// Of each coordinate along the curve.
const CURVE_MOST: u32 = (1 << CURVE_BITS) - 1;

/// The leaves of so many elements, a power of two.
const fn leaves(elements: usize) -> usize {
    match elements.div_ceil(LEAF).checked_next_power_of_two() {
        Some(leaves) => leaves,
        None => usize::MAX,
    }
}

pub(super) struct Tree<'m> {
    /// Place on the curve and number of each element.
    order: &'m [[u32; 2]],
    /// Of node 1, the root; of `2 n` and `2 n + 1` below node `n`; the last half are the leaves. Bits of float32.
    boxes: &'m [[u32; BOX]],
}

/// A node that may hold the nearest element, and the squared distance of its box, m^2.
type Ahead = (usize, f64);

impl<'m> Tree<'m> {
    pub(super) const fn words(elements: usize) -> usize {
        let boxes = leaves(elements).saturating_mul(2 * BOX);
        boxes.saturating_add(elements.saturating_mul(2))
    }

    pub(super) fn build(mesh: &Mesh<'_>, memory: &'m mut [u32]) -> Result<Self, PointError> {
        let elements = mesh.element_count();
        let (needed, capacity) = (Self::words(elements), memory.len());
        let (order, rest) =
            memory.split_at_mut_checked(2 * elements).ok_or(PointError::Capacity { needed, capacity })?;
        let boxes = rest.get_mut(..needed - 2 * elements).ok_or(PointError::Capacity { needed, capacity })?;
        let (order, boxes) = (order.as_chunks_mut().0, boxes.as_chunks_mut().0);
        put_in_order(mesh, order);
        put_boxes(mesh, order, boxes);
        Ok(Self { order, boxes })
    }

    /// The element that holds a place, which is finite, or the nearest one.
    pub(super) fn nearest(&self, mesh: &Mesh<'_>, at: [f32; 3]) -> FollowedPoint {
        let place = wide(at);
        let mut best: (u32, Nearest) = (0, ([1.0, 0.0, 0.0, 0.0], f64::INFINITY));
        // Most places are inside, and that takes less to find out.
        self.search(place, 0.0, |element| {
            let found = within(mesh.corners(mesh.given(element)), place);
            best = found.map_or(best, |weights| (element, (weights, 0.0)));
            if best.1.1 > 0.0 { 0.0 } else { -1.0 }
        });
        if best.1.1 > 0.0 {
            self.search(place, f64::INFINITY, |element| {
                let found = of_tetrahedron(mesh.corners(mesh.given(element)), place, best.1.1);
                best = found.map_or(best, |found| (element, found));
                best.1.1
            });
        }
        let (element, (weights, squared)) = best;
        let distance = (libm::sqrt(squared) as f32).min(f32::MAX);
        let weights = weights.map(|weight| weight as f32);
        FollowedPoint { rest: at, element, nodes: mesh.given(element), weights, distance }
    }

    /// Calls `look` with elements, those of near boxes first, as long as boxes are at most as far away as it last said,
    /// m^2.
    fn search(&self, place: DVec3, mut most: f64, mut look: impl FnMut(u32) -> f64) {
        let mut ahead: heapless::Vec<Ahead, DEPTH> = heapless::Vec::new();
        // There is room: a node is replaced by at most two, one level below.
        let _ = ahead.push((1, 0.0));
        while let Some((node, squared)) = ahead.pop() {
            if squared > most {
                continue;
            }
            if 2 * node < self.boxes.len() {
                let below = [2 * node, 2 * node + 1].map(|node| (node, self.distance_squared(node, place)));
                let [near, far] = if below[0].1 <= below[1].1 { below } else { [below[1], below[0]] };
                for next in [far, near] {
                    if next.1 <= most {
                        let _ = ahead.push(next);
                    }
                }
                continue;
            }
            let first = (node - self.boxes.len() / 2) * LEAF;
            for &[_, element] in self.order.iter().skip(first).take(LEAF) {
                most = look(element);
            }
        }
    }

    /// From the box of a node, m^2; infinite from an empty one.
    fn distance_squared(&self, node: usize, place: DVec3) -> f64 {
        let Some(words) = self.boxes.get(node) else { return f64::INFINITY };
        let [x0, y0, z0, x1, y1, z1] = words.map(|word| f64::from(f32::from_bits(word)));
        let (low, high) = (DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
        (low - place).max(place - high).max(DVec3::ZERO).length_squared()
    }
}

fn wide([x, y, z]: [f32; 3]) -> DVec3 {
    DVec3::new(x.into(), y.into(), z.into())
}

/// Sorts the elements along the curve.
fn put_in_order(mesh: &Mesh<'_>, order: &mut [[u32; 2]]) {
    let points = mesh.points().iter().map(|&point| wide(point));
    let (low, high) =
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)));
    let size = (high - low).max_element();
    let scale = if size > 0.0 { f64::from(CURVE_MOST) / size } else { 0.0 };
    for (element, place) in order.iter_mut().enumerate() {
        let [a, b, c, d] = mesh.corners(mesh.given(element as u32));
        let centre = ((a + b + c + d) / 4.0 - low) * scale;
        let [x, y, z] = centre.to_array().map(|component| every_third_bit((component as u32).min(CURVE_MOST)));
        *place = [x | y << 1 | z << 2, element as u32];
    }
    heap_sort::sort(order, |place| place);
}

/// The boxes of the leaves, and of what is above them.
fn put_boxes(mesh: &Mesh<'_>, order: &[[u32; 2]], boxes: &mut [[u32; BOX]]) {
    let leaves = boxes.len() / 2;
    for (leaf, place) in boxes.iter_mut().skip(leaves).enumerate() {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for &[_, element] in order.iter().skip(leaf.saturating_mul(LEAF)).take(LEAF) {
            for node in mesh.given(element) {
                let point = mesh.points().get(node as usize).copied().unwrap_or_default();
                for axis in 0..3 {
                    low[axis] = low[axis].min(point[axis]);
                    high[axis] = high[axis].max(point[axis]);
                }
            }
        }
        *place = packed(low, high);
    }
    for node in (1..leaves).rev() {
        let [first, second] = [2 * node, 2 * node + 1]
            .map(|node| boxes.get(node).map_or([f32::NAN; BOX], |words| words.map(f32::from_bits)));
        let low = core::array::from_fn(|axis| first[axis].min(second[axis]));
        let high = core::array::from_fn(|axis| first[axis + 3].max(second[axis + 3]));
        boxes.get_mut(node).into_iter().for_each(|place| *place = packed(low, high));
    }
}

fn packed(low: [f32; 3], high: [f32; 3]) -> [u32; BOX] {
    let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
    [x0, y0, z0, x1, y1, z1].map(f32::to_bits)
}
