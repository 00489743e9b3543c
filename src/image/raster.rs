//! Drawing tetrahedra into a grid. In coordinates of the index a barycentric weight is linear, so a row of points enters
//! and leaves an element where one of four lines crosses zero, and in between the value is linear as well. In float64 up
//! to the first point of the box around an element.

use core::ops::Range;

use glam::{BVec4A, DMat4, DVec3, DVec4, Vec4};

use super::{FieldKind, ImageGrid};
use crate::mesh::{Mesh, volume};

/// A weight that is negative by less, or by less than it changes over so many points, is that of a place inside: no point
/// between two elements is left out.
const INSIDE: f64 = 1e-5;

/// Draws all elements that are not turned inside out, then what they would have up to one point beyond their surface,
/// where none is: so also between a point inside and one outside the value is that of the element. Gives how many points
/// are inside; nothing is drawn if there are none.
pub(super) fn draw(
    mesh: &Mesh<'_>,
    displacement: &impl Fn(usize) -> [f32; 3],
    kind: FieldKind,
    grid: &ImageGrid,
    out: &mut [[f32; 3]],
) -> usize {
    let to_index = grid.matrix().inverse();
    let (origin, size) = (DVec3::from(grid.origin), grid.sizes());
    let placed = |element: u32| {
        let nodes = mesh.given(element);
        let rest = mesh.corners(nodes);
        let moved = nodes.map(|node| displacement(node as usize));
        let mut now = rest;
        if kind == FieldKind::Inverse {
            for (corner, moved) in now.iter_mut().zip(moved) {
                *corner += DVec3::from(moved.map(f64::from));
            }
            if volume(now) * volume(rest) <= 0.0 {
                return None;
            }
        }
        let sign = if kind == FieldKind::Inverse { -1.0 } else { 1.0 };
        let values = moved.map(|vector| vector.map(|component| sign * component));
        Some(Placed { corners: now.map(|corner| to_index * (corner - origin)), values })
    };
    let elements = || (0..mesh.element_count() as u32).filter_map(placed);
    for element in elements() {
        if let Some(drawn) = Drawn::new(&element, 0.0, element.bounds(0.0, size)) {
            drawn.rows(size, out, |value, places| drawn.fill(value, places));
        }
    }
    let covered = out.iter().filter(|value| !value[0].is_nan()).count();
    if covered == 0 {
        return 0;
    }
    for element in elements() {
        let bounds = element.bounds(1.0, size);
        if !has_unknown(&bounds, size, out) {
            continue;
        }
        if let Some(drawn) = Drawn::new(&element, 1.0, bounds) {
            drawn.rows(size, out, |value, places| drawn.fill_unknown(value, places));
        }
    }
    covered
}

/// Whether the outside of a box has a point without a value. Where tissue ends within the box, it does so there as well,
/// but for a gap that is smaller than the box.
fn has_unknown([xs, ys, zs]: &[Range<usize>; 3], [x_size, y_size, _]: [usize; 3], out: &[[f32; 3]]) -> bool {
    let (last_y, last_z) = (ys.end.saturating_sub(1), zs.end.saturating_sub(1));
    let is_unknown = |value: &[f32; 3]| value[0].is_nan();
    zs.clone().any(|z| {
        ys.clone().any(|y| {
            let row = (z * y_size + y) * x_size;
            let places = out.get(row + xs.start..row + xs.end).unwrap_or_default();
            if z == zs.start || z == last_z || y == ys.start || y == last_y {
                places.iter().any(is_unknown)
            } else {
                places.first().is_some_and(is_unknown) || places.last().is_some_and(is_unknown)
            }
        })
    })
}

/// An element in coordinates of the index, with what its corners have, m.
struct Placed {
    corners: [DVec3; 4],
    values: [[f32; 3]; 4],
}

impl Placed {
    /// The points in the box around it, which is larger by so much.
    fn bounds(&self, beyond: f64, [x_size, y_size, z_size]: [usize; 3]) -> [Range<usize>; 3] {
        let [a, b, c, d] = self.corners;
        let (low, high) = (a.min(b).min(c.min(d)) - beyond, a.max(b).max(c.max(d)) + beyond);
        [range(low.x, high.x, x_size), range(low.y, high.y, y_size), range(low.z, high.z, z_size)]
    }
}

/// Whole numbers between two bounds, of those below `size`, which is below 2^31.
fn range(from: f64, to: f64, size: usize) -> Range<usize> {
    // A little more than the bounds, so that a corner on a point is drawn. Casts saturate, and are faster than rounding.
    let (from, to) = ((from - INSIDE).max(0.0), to + INSIDE);
    let below = from as i32;
    let first = below as usize + usize::from(f64::from(below) < from);
    let end = if to < 0.0 { 0 } else { (to as i32 as usize).saturating_add(1).min(size) };
    if first < end { first..end } else { 0..0 }
}

/// Linear in the index: at the first point of a box, and from one point to the next along x, y, z.
struct Linear {
    start: Vec4,
    slope: [Vec4; 3],
}

impl Linear {
    fn new(start: DVec4, slope: [DVec4; 3], first: DVec3) -> Self {
        let start = start + first.x * slope[0] + first.y * slope[1] + first.z * slope[2];
        Self { start: start.as_vec4(), slope: slope.map(|slope| slope.as_vec4()) }
    }
}

/// What is drawn of an element: the points of a box in which all four weights are positive.
struct Drawn {
    bounds: [Range<usize>; 3],
    /// Weights of the four corners, and how far below zero they may be.
    inside: Linear,
    /// Minus one over the slopes of the weights along x.
    over_x: Vec4,
    /// Whether the weights fall along x.
    falls: BVec4A,
    /// m.
    value: Linear,
    least: Vec4,
    most: Vec4,
}

impl Drawn {
    /// With what is up to so many points beyond its faces. None for an element without a volume.
    fn new(element: &Placed, beyond: f64, bounds: [Range<usize>; 3]) -> Option<Self> {
        let [a, b, c, d] = element.corners;
        let (u, v, w) = (b - a, c - a, d - a);
        let over = 1.0 / u.dot(v.cross(w));
        let [second, third, fourth] = [v.cross(w) * over, w.cross(u) * over, u.cross(v) * over];
        let first = -(second + third + fourth);
        if !first.is_finite() {
            return None;
        }
        let gradients = DMat4::from_cols(first.extend(0.0), second.extend(0.0), third.extend(0.0), fourth.extend(0.0));
        let [along_x, along_y, along_z, _] = gradients.transpose().to_cols_array_2d().map(DVec4::from);
        let slack = INSIDE + (INSIDE + beyond) * (along_x.abs() + along_y.abs() + along_z.abs());
        let at_origin = DVec4::X - a.x * along_x - a.y * along_y - a.z * along_z;
        let box_start = bounds.each_ref().map(|range| range.start as f64).into();
        let inside = Linear::new(at_origin + slack, [along_x, along_y, along_z], box_start);
        let values = element.values.map(|[x, y, z]| DVec4::new(x.into(), y.into(), z.into(), 0.0));
        let [of_first, more @ ..] = [values[0], values[1] - values[0], values[2] - values[0], values[3] - values[0]];
        let slope = |[second, third, fourth]: [f64; 3]| second * more[0] + third * more[1] + fourth * more[2];
        let slopes = [0, 1, 2].map(|axis| slope([second[axis], third[axis], fourth[axis]]));
        let at_origin = of_first - a.x * slopes[0] - a.y * slopes[1] - a.z * slopes[2];
        let value = Linear::new(at_origin, slopes, box_start);
        let corners = values.map(|value| value.as_vec4());
        let least = corners.into_iter().fold(Vec4::INFINITY, Vec4::min);
        let most = corners.into_iter().fold(Vec4::NEG_INFINITY, Vec4::max);
        // A weight that does not change along x bounds all of a row, or nothing.
        let x_slope = inside.slope[0];
        let over_x = Vec4::select(x_slope.cmpeq(Vec4::ZERO), Vec4::splat(-1e30), -x_slope.recip());
        Some(Self { bounds, falls: x_slope.cmplt(Vec4::ZERO), over_x, inside, value, least, most })
    }

    /// Calls `fill` with the points of each row that are drawn, and the value at the first of them, m.
    fn rows(&self, [x_size, y_size, _]: [usize; 3], out: &mut [[f32; 3]], fill: impl Fn(Vec4, &mut [[f32; 3]])) {
        let [xs, ys, zs] = self.bounds.clone();
        let last = xs.len() as f32 - 1.0;
        for (z_at, z) in zs.enumerate() {
            let z_at = z_at as i32 as f32;
            let inside_z = self.inside.start + z_at * self.inside.slope[2];
            let value_z = self.value.start + z_at * self.value.slope[2];
            for (y_at, y) in ys.clone().enumerate() {
                let y_at = y_at as i32 as f32;
                let crossing = (inside_z + y_at * self.inside.slope[1]) * self.over_x;
                let from = Vec4::select(self.falls, Vec4::ZERO, crossing).max_element().max(0.0);
                let to = Vec4::select(self.falls, crossing, Vec4::splat(last)).min_element().min(last);
                if from > to {
                    continue;
                }
                let below = from as i32;
                let first = below + i32::from((below as f32) < from);
                let start = (z * y_size + y) * x_size + xs.start;
                let places = out.get_mut(start + first as usize..=start + to as i32 as usize).unwrap_or_default();
                fill(value_z + y_at * self.value.slope[1] + first as f32 * self.value.slope[0], places);
            }
        }
    }

    /// Points of a row from this value on. Nothing goes beyond what the corners have.
    fn fill(&self, value: Vec4, places: &mut [[f32; 3]]) {
        for (step, place) in places.iter_mut().enumerate() {
            *place = self.after(value, step);
        }
    }

    /// The same of points without a value.
    fn fill_unknown(&self, value: Vec4, places: &mut [[f32; 3]]) {
        for (step, place) in places.iter_mut().enumerate() {
            if place[0].is_nan() {
                *place = self.after(value, step);
            }
        }
    }

    fn after(&self, value: Vec4, step: usize) -> [f32; 3] {
        let value = value + step as i32 as f32 * self.value.slope[0];
        // A NaN, where numbers are too large to be computed with, becomes the least.
        let [x, y, z, _] = value.max(self.least).min(self.most).to_array();
        [x, y, z]
    }
}
