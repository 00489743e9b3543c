//! The field of a closed surface of triangles: its signed distances on a grid.

use std::format;
use std::string::String;
use std::vec::Vec;

use glam::Vec3;

use super::field::{Field, FieldError};
use super::signed_distance::{SignedDistance, bounds};

/// Distances of a closed surface on a grid, as [`Field::new`] takes them.
#[derive(Clone, Debug)]
pub struct SurfaceField {
    /// m, x fastest.
    pub values: Vec<f32>,
    /// Points along each axis.
    pub size: [u32; 3],
    /// m.
    pub origin: [f32; 3],
    /// m.
    pub spacing: f32,
}

/// Most points of a grid: 256 MiB.
const MOST_POINTS: f64 = 67_108_864.0;
/// Points of the grid around the box of the surface.
const RIM: f32 = 2.0;

impl SurfaceField {
    /// Computes the distances of a closed surface, whose triangles are all counted in the same direction, on a grid of
    /// this spacing (m) around it.
    pub fn new(points: &[[f32; 3]], triangles: &[[u32; 3]], spacing: f32) -> Result<Self, String> {
        let mut corners = Vec::with_capacity(triangles.len());
        for (triangle, places) in triangles.iter().enumerate() {
            let at = places.map(|place| points.get(place as usize).copied().map(Vec3::from_array));
            let [Some(a), Some(b), Some(c)] = at else {
                return Err(format!("triangle {triangle} has the corners {places:?} of {} points", points.len()));
            };
            if let Some(corner) = [a, b, c].iter().position(|corner| !corner.is_finite()) {
                let place = places[corner];
                return Err(format!("point {place} of triangle {triangle} is {:?}", points[place as usize]));
            }
            corners.push([a, b, c]);
        }
        let [low, high] = bounds(&corners);
        let size = ((high - low) / spacing).ceil() + 1.0 + 2.0 * RIM;
        let origin = low - RIM * spacing;
        let end = origin + spacing * size;
        if !(spacing > 0.0 && (high - low).is_finite() && origin.is_finite() && end.is_finite()) {
            return Err(format!("a spacing of {spacing} m for {} triangles cannot be", triangles.len()));
        }
        let count: f64 = size.to_array().into_iter().map(f64::from).product();
        if count > MOST_POINTS {
            return Err(format!("a spacing of {spacing} m makes {count:.2e} points, {MOST_POINTS:.2e} are possible"));
        }
        // Six times the volume: below zero if the normals point inwards.
        let volume = |&corners: &[Vec3; 3]| {
            let [a, b, c] = corners.map(|corner| (corner - low).as_dvec3());
            a.dot(b.cross(c))
        };
        if corners.iter().map(volume).sum::<f64>() < 0.0 {
            corners.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        let surface = SignedDistance::new(&corners, origin.abs().max(end.abs()).max_element())?;
        let size = size.to_array().map(|points| points as u32);
        let mut values = Vec::with_capacity(count as usize);
        let mut nearest = 0;
        for k in 0..size[2] {
            for j in 0..size[1] {
                for i in 0..size[0] {
                    let at = origin + spacing * Vec3::new(i as f32, j as f32, k as f32);
                    let (distance, triangle) = surface.at(at, nearest);
                    values.push(distance);
                    nearest = triangle;
                }
            }
        }
        Ok(Self { values, size, origin: origin.to_array(), spacing })
    }

    /// The checked field.
    pub fn field(&self) -> Result<Field<'_>, FieldError> {
        Field::new(&self.values, self.size, self.origin, self.spacing)
    }
}
