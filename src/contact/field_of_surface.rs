//! The field of a closed surface of triangles, with parry's distances: to the nearest triangle, with the sign of its pseudo-normal
//! (Baerentzen and Aanaes 2005).

use std::string::ToString;
use std::vec::Vec;

use glam::Vec3;
use parry3d::query::PointQuery;
use parry3d::shape::{TriMesh, TriMeshFlags};

use super::field::{Field, FieldError};

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
    /// Computes the distances of a closed surface, whose triangles are all counted in the same direction, on a grid of this spacing (m)
    /// around it.
    pub fn new(
        points: &[[f32; 3]],
        triangles: &[[u32; 3]],
        spacing: f32,
    ) -> Result<Self, std::string::String> {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &corner in triangles.as_flattened() {
            let point = points.get(corner as usize).ok_or("a triangle has a corner that does not exist")?;
            (low, high) = (low.min(Vec3::from_array(*point)), high.max(Vec3::from_array(*point)));
        }
        if !(spacing > 0.0 && (high - low).is_finite()) {
            return Err(std::format!("a spacing of {spacing} m for {} triangles cannot be", triangles.len()));
        }
        let origin = low - RIM * spacing;
        let size = ((high - low) / spacing).ceil() + 1.0 + 2.0 * RIM;
        let count: f64 = size.to_array().into_iter().map(f64::from).product();
        if count > MOST_POINTS {
            return Err(std::format!(
                "a spacing of {spacing} m makes {count:.2e} points, {MOST_POINTS:.2e} are possible"
            ));
        }
        // Six times the volume: below zero if the normals point inwards.
        let corner = |corner: u32| {
            points.get(corner as usize).map_or(Vec3::ZERO, |&point| Vec3::from_array(point) - low)
        };
        let volume: f32 = triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum();
        let triangles: Vec<_> =
            triangles.iter().map(|&[a, b, c]| if volume < 0.0 { [a, c, b] } else { [a, b, c] }).collect();
        let vertices = points.iter().map(|&point| point.into()).collect();
        let mesh = TriMesh::with_flags(vertices, triangles, TriMeshFlags::ORIENTED)
            .map_err(|error| error.to_string())?;
        let size = size.to_array().map(|points| points as u32);
        let mut values = Vec::with_capacity(count as usize);
        for k in 0..size[2] {
            for j in 0..size[1] {
                for i in 0..size[0] {
                    let at = origin + spacing * Vec3::new(i as f32, j as f32, k as f32);
                    let nearest = mesh.project_local_point(at.to_array().into(), false);
                    let distance = at.distance(Vec3::from_array(nearest.point.into()));
                    values.push(if nearest.is_inside { -distance } else { distance });
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
