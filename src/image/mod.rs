//! Displacement fields on the grid of an image: the forward one tells how far the material that was at a place has
//! moved, the inverse one where the material that is at a place now has come from. An image is warped with the inverse
//! one (each new voxel is looked up in the old image), points and surfaces move with the forward one.
//!
//! The grid is that of ITK (Yoo et al. 2002): `place = origin + direction * (spacing * index)`, in metres and in the axes
//! of the mesh; x runs fastest. Each tetrahedron is drawn into it: at rest for the forward field, where it is now for the
//! inverse one, which is therefore that of the linear elements to rounding, without iteration. Rules:
//!
//! - A place within an element, or on its surface, has what the shape functions of its nodes give.
//! - An element that is turned inside out is not drawn. A place that several are drawn to (tissue that overlaps itself)
//!   has the value of the last one in the list.
//! - A place up to one point of the grid beyond the surface has the linear continuation of an element there, no further
//!   than what its corners have: between a point inside and one outside the field is that of the tissue.
//! - All other places are continued by push and pull over a pyramid of grids (Gortler et al. 1996, "The Lumigraph"; Burt
//!   1988): means of what is drawn go up, linear interpolation between them comes down. Near the surface a place has what
//!   the surface nearby has, far from it the mean of the whole; each component is between the least and the largest that
//!   was drawn (to rounding). Interpolation is continuous on every level.
//! - With a reach these fall off to zero, by `(1 - (d - c)^2 / (reach - c)^2)^2` from the distance `d = c` from the tissue
//!   on. So that d is found in bounded time, it is that between cells and linear between them; c is their longest edge, at
//!   most an eighth of the reach or the spacing of the grid, whichever is larger. So the field ends at the reach to within
//!   two cells. The slope is at most `1.54 / (reach - c)` times the displacement: where that is below one, the fall does not fold
//!   space.
//!
#![cfg_attr(feature = "std", doc = "```")]
#![cfg_attr(not(feature = "std"), doc = "```ignore")]
//! use supple::image::{FieldKind, ImageGrid, VecField};
//! use supple::mesh::{Bar, Mesh, Winding};
//! use supple::state::VecState;
//!
//! let bar = Bar { size: [0.02, 0.02, 0.1], cells: [2, 2, 10] };
//! let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
//! let mesh = Mesh::new(&points, &tets, Winding::Checked)?;
//! let mut state = VecState::at_rest(points.len());
//! // ... steps ...
//! # state.view().put(0.0, 1e-3, |_| [[0.0, 0.001, 0.0], [0.0; 3]]);
//! let grid = ImageGrid::aligned([-0.01; 3], [0.002; 3], [20, 20, 60]);
//! let mut field = VecField::new(FieldKind::Inverse, grid, 0.0)?;
//! let inside = field.compute(&mesh, state.displacements())?;
//! println!("{inside} points within the tissue, {:?} m at the first", field.values()[0]);
//! # assert!(inside > 5000 && (field.values()[0][1] + 0.001).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod fade;
mod pyramid;
mod raster;
#[cfg(test)]
mod tests;

use core::fmt;

use glam::{DMat3, DVec3};

use crate::mesh::Mesh;
use pyramid::Pyramid;

/// Most points of a grid.
pub const MOST_GRID_POINTS: u64 = 1 << 31;
/// How far directions may be from being orthonormal.
const ORTHONORMAL: f64 = 1e-3;

/// The grid of an image: where its points are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageGrid {
    /// Of the first point, m.
    pub origin: [f64; 3],
    /// Between points along each axis of the grid, m.
    pub spacing: [f64; 3],
    /// Points along each axis of the grid.
    pub size: [u32; 3],
    /// Direction cosines: column `a` is the direction of axis `a` of the grid, as in ITK; orthonormal to a thousandth.
    pub direction: [[f64; 3]; 3],
}

/// Which field.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum FieldKind {
    /// At a place of the shape at rest: where its material is now, less where it was.
    Forward,
    /// At a place now: where its material was at rest, less where it is.
    Inverse,
}

/// Why there is no field.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FieldError {
    /// The origin is not finite.
    Origin {
        /// 0, 1, 2.
        axis: usize,
        /// m.
        value: f64,
    },
    /// A spacing that is not a finite positive number.
    Spacing {
        /// 0, 1, 2, of the grid.
        axis: usize,
        /// m.
        value: f64,
    },
    /// Directions that are not orthonormal.
    Direction {
        /// How far two of their products are from those of orthonormal ones.
        off: f64,
    },
    /// No points, or more than [`MOST_GRID_POINTS`].
    Points {
        /// How many.
        points: u64,
    },
    /// A reach that is negative or not finite.
    Reach {
        /// m.
        value: f32,
    },
    /// A displacement that is not finite.
    Displacement {
        /// The node.
        node: usize,
        /// 0, 1, 2.
        axis: usize,
        /// m.
        value: f32,
    },
    /// Less scratch than [`scratch_for`] says, or fewer places to write to than points of the grid.
    Capacity {
        /// Needed.
        needed: usize,
        /// There.
        capacity: usize,
    },
}

impl fmt::Display for FieldError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Origin { axis, value } => write!(f, "origin of the grid: component {axis} is {value} m"),
            Self::Spacing { axis, value } => {
                write!(f, "spacing of the grid along axis {axis} is {value} m, it must be a positive number")
            }
            Self::Direction { off } => {
                write!(f, "directions of the grid are off by {off:.2e} from orthonormal: resample the image")
            }
            Self::Points { points } => {
                write!(f, "the grid has {points} points, it must have 1 to {MOST_GRID_POINTS}: take a coarser one")
            }
            Self::Reach { value } => write!(f, "reach is {value} m, it must be a number from 0 (none) on"),
            Self::Displacement { node, axis, value } => {
                write!(f, "displacement of node {node}: component {axis} is {value}")
            }
            Self::Capacity { needed, capacity } => {
                write!(f, "there is room for {capacity} numbers or points, {needed} are needed")
            }
        }
    }
}

impl core::error::Error for FieldError {}

impl ImageGrid {
    /// Along the axes of the mesh.
    #[must_use]
    pub const fn aligned(origin: [f64; 3], spacing: [f64; 3], size: [u32; 3]) -> Self {
        Self { origin, spacing, size, direction: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    /// How many points it has.
    #[must_use]
    pub fn point_count(&self) -> u64 {
        self.size.iter().fold(1, |count: u64, &points| count.saturating_mul(points.into()))
    }

    /// Where a point is, m.
    #[must_use]
    pub fn place(&self, index: [f64; 3]) -> [f64; 3] {
        (DVec3::from(self.origin) + self.matrix() * DVec3::from(index)).to_array()
    }

    /// That there can be such a grid.
    pub fn check(&self) -> Result<(), FieldError> {
        for axis in 0..3 {
            let (origin, spacing) = (self.origin[axis], self.spacing[axis]);
            if !origin.is_finite() {
                return Err(FieldError::Origin { axis, value: origin });
            }
            if !(spacing.is_finite() && spacing > 0.0) {
                return Err(FieldError::Spacing { axis, value: spacing });
            }
        }
        let products = self.columns().transpose() * self.columns() - DMat3::IDENTITY;
        let off = products.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        let is_number = products.is_finite();
        if !is_number || off > ORTHONORMAL {
            return Err(FieldError::Direction { off: if is_number { off } else { f64::NAN } });
        }
        match self.point_count() {
            points @ 1..=MOST_GRID_POINTS => {
                if usize::try_from(points).is_ok() {
                    Ok(())
                } else {
                    Err(FieldError::Points { points })
                }
            }
            points => Err(FieldError::Points { points }),
        }
    }

    /// With the directions of the grid as columns.
    fn columns(&self) -> DMat3 {
        let [x, y, z] = self.direction.map(DVec3::from);
        DMat3::from_cols(x, y, z).transpose()
    }

    /// From an index to metres.
    fn matrix(&self) -> DMat3 {
        self.columns() * DMat3::from_diagonal(DVec3::from(self.spacing))
    }

    fn sizes(&self) -> [usize; 3] {
        self.size.map(|points| points as usize)
    }
}

/// Numbers of scratch that [`displacement_field`] needs for a grid and a reach (m; 0: none): half a number for each point
/// where spacings are alike, some four at most, and two more for each where the reach is below eight spacings.
pub fn scratch_for(grid: &ImageGrid, reach: f32) -> Result<usize, FieldError> {
    grid.check()?;
    check_reach(reach)?;
    Ok(Pyramid::of(grid, reach).words())
}

fn check_reach(value: f32) -> Result<(), FieldError> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(FieldError::Reach { value }) }
}

/// Writes a field of displacements (m, in the axes of the mesh) to the points of a grid, x fastest, as the module
/// describes. Gives how many of them are within the tissue; if none is, all are zero: the grid is elsewhere, or its
/// spacing larger than the tissue.
///
/// `displacement` gives that of a node, m. `reach` is how far from the tissue the field ends, m; 0: it goes on. `scratch`
/// has [`scratch_for`] numbers and is free again afterwards. The work is one pass over the elements and the boxes of
/// points around them, and some passes over the grid; nothing is iterated. On an error nothing is written.
pub fn displacement_field(
    mesh: &Mesh<'_>,
    displacement: impl Fn(usize) -> [f32; 3],
    (kind, grid, reach): (FieldKind, &ImageGrid, f32),
    scratch: &mut [f32],
    out: &mut [[f32; 3]],
) -> Result<usize, FieldError> {
    let needed = scratch_for(grid, reach)?;
    for (needed, capacity) in [(needed, scratch.len()), (grid.point_count() as usize, out.len())] {
        if capacity < needed {
            return Err(FieldError::Capacity { needed, capacity });
        }
    }
    for node in 0..mesh.points().len() {
        let moved = displacement(node);
        if let Some((axis, &value)) = moved.iter().enumerate().find(|(_, component)| !component.is_finite()) {
            return Err(FieldError::Displacement { node, axis, value });
        }
    }
    let out = out.get_mut(..grid.point_count() as usize).unwrap_or_default();
    out.fill([f32::NAN; 3]);
    let covered = raster::draw(mesh, &displacement, kind, grid, out);
    if covered == 0 {
        out.fill([0.0; 3]);
    } else {
        Pyramid::of(grid, reach).fill(out, scratch);
    }
    Ok(covered)
}

/// A field with its memory, for one grid.
#[cfg(any(feature = "std", test))]
#[derive(Clone, Debug)]
pub struct VecField {
    request: (FieldKind, ImageGrid, f32),
    scratch: std::vec::Vec<f32>,
    values: std::vec::Vec<[f32; 3]>,
}

#[cfg(any(feature = "std", test))]
impl VecField {
    /// Zero everywhere; `reach` as at [`displacement_field`], m.
    pub fn new(kind: FieldKind, grid: ImageGrid, reach: f32) -> Result<Self, FieldError> {
        let scratch = std::vec![0.0; scratch_for(&grid, reach)?];
        Ok(Self { request: (kind, grid, reach), scratch, values: std::vec![[0.0; 3]; grid.point_count() as usize] })
    }

    /// The field of the displacements (m) of the nodes, those of a state for example: see [`displacement_field`].
    pub fn compute(&mut self, mesh: &Mesh<'_>, displacements: &[crate::simd::NodeVector]) -> Result<usize, FieldError> {
        let (kind, grid, reach) = &self.request;
        let at = |node: usize| displacements.get(node).copied().unwrap_or_default().to_array();
        displacement_field(mesh, at, (*kind, grid, *reach), &mut self.scratch, &mut self.values)
    }

    /// At the points of the grid, m, x fastest.
    #[must_use]
    pub fn values(&self) -> &[[f32; 3]] {
        &self.values
    }
}
