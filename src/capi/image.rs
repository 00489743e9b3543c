//! Displacement fields on the grid of an image, for C ([`crate::image`]).

use core::ffi::c_void;

use crate::image::{FieldError, FieldKind, ImageGrid, displacement_field, scratch_for};

use super::memory::{self, one, place_for};
use super::points::{Extent, apart, extent, mesh_of, reads_of, room};
use super::status::{Answer, mismatch, short, supple_error, supple_status};
use super::vectors::supple_vectors;
use supple_status::*;

/// At a place of the shape at rest: where its material is now, less where it was.
pub const SUPPLE_FORWARD_FIELD: u32 = 0;
/// At a place now: where its material was at rest, less where it is.
pub const SUPPLE_INVERSE_FIELD: u32 = 1;

/// The grid of an image, as ITK has it but in metres and in the axes of the mesh: place = origin + direction * (spacing *
/// index).
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_image_grid {
    /// Of the first point, m.
    pub origin: [f64; 3],
    /// Between points along each axis of the grid, m.
    pub spacing: [f64; 3],
    /// Direction cosines, row by row: column `a` is the direction of axis `a` of the grid. Orthonormal to a thousandth.
    pub direction: [[f64; 3]; 3],
    /// Points along each axis of the grid, at most 2^31 together.
    pub size: [u32; 3],
}

impl supple_image_grid {
    fn grid(&self) -> ImageGrid {
        let &Self { origin, spacing, direction, size } = self;
        ImageGrid { origin, spacing, size, direction }
    }
}

/// Writes how many bytes of scratch supple_displacement_field needs: 2 for each point of the grid where spacings are alike,
/// some 12 at most, and 8 more for each where the reach is below sixteen spacings.
///
/// @param reach as there, m.
/// @param error may be NULL; SUPPLE_E_GRID: axis and value tell what is wrong with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_displacement_field_size(
    grid: *const supple_image_grid,
    reach: f32,
    bytes: *mut usize,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let size = || unsafe {
        let (grid, bytes) = (one(grid)?.grid(), place_for(bytes)?);
        bytes.write(bytes_for(&grid, reach)?);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(size(), error) }
}

fn bytes_for(grid: &ImageGrid, reach: f32) -> Answer<usize> {
    let numbers = scratch_for(grid, reach)?;
    numbers.checked_mul(size_of::<f32>()).ok_or(short(0, usize::MAX))
}

/// Writes the displacement field of a body at the points of a grid: three floats for each, m, in the axes of the mesh, x
/// fastest. Within the tissue it is that of the linear elements, to rounding. Elsewhere it goes on smoothly, near the
/// surface as there, far away as the mean of the body, never beyond what is within; with a reach it falls off to zero. An
/// element that is turned inside out is left out, and where several overlap the last one counts.
///
/// An image is warped with the inverse field: the new image at a point has what the old one has at the point plus the
/// field. Points and surfaces are moved with the forward field.
///
/// @param points of all `nodes` of the scene at rest, m, three coordinates each.
/// @param tetrahedra four nodes of each of `elements`, of either winding.
/// @param displacements of all nodes, m, as supple_displacements tells where those of a state are; or your own.
/// @param kind SUPPLE_FORWARD_FIELD or SUPPLE_INVERSE_FIELD.
/// @param reach how far from the tissue the field ends, m, to within a quarter of it or two spacings of the grid; 0: it goes on.
/// @param scratch of `bytes`, supple_displacement_field_size at least, aligned to 4; free again afterwards.
/// @param field room for `floats`, three for each point of the grid at least.
/// @param covered may be NULL; receives how many points are within the tissue. With none the field is zero: the grid is
/// elsewhere (in mm? in other axes?) or coarser than the body.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_displacement_field(
    points: *const f32,
    nodes: u32,
    tetrahedra: *const u32,
    elements: u32,
    displacements: *const supple_vectors,
    kind: u32,
    grid: *const supple_image_grid,
    reach: f32,
    scratch: *mut c_void,
    bytes: usize,
    field: *mut f32,
    floats: usize,
    covered: *mut usize,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let make = || unsafe {
        let grid = one(grid)?.grid();
        let kind = match kind {
            SUPPLE_FORWARD_FIELD => FieldKind::Forward,
            SUPPLE_INVERSE_FIELD => FieldKind::Inverse,
            _ => return Err(supple_error::from(SUPPLE_E_CHOICE).value(kind.into(), 0.0)),
        };
        let needed = bytes_for(&grid, reach)?;
        if bytes < needed {
            return Err(short(bytes, needed));
        }
        let count = grid.point_count() as usize;
        if floats / 3 < count {
            return Err(short(floats, count.saturating_mul(3)));
        }
        let mesh = mesh_of(points, nodes, tetrahedra, elements)?;
        let moved = Moved::of(displacements, nodes)?;
        let covered = memory::place_if_wanted(covered)?;
        let (scratch, field) = (place_for(scratch.cast::<f32>())?, place_for(field.cast::<[f32; 3]>())?);
        let outs = [extent(scratch, needed / size_of::<f32>()), extent(field, count)];
        let [points, tetrahedra] = reads_of(&mesh);
        apart(outs, [points, tetrahedra, moved.extent()])?;
        let (scratch, field) = (room(scratch, needed / size_of::<f32>()), room(field, count));
        let within = displacement_field(&mesh, |node| moved.at(node), (kind, &grid, reach), scratch, field)?;
        if let Some(covered) = covered {
            covered.write(within);
        }
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(make(), error) }
}

/// Displacements in memory of the host, checked.
struct Moved {
    first: *const f32,
    stride: usize,
    count: usize,
}

impl Moved {
    /// # Safety
    /// The vectors are there, and stay unchanged as long as this is used.
    unsafe fn of(vectors: *const supple_vectors, nodes: u32) -> Answer<Self> {
        // SAFETY: the caller's promise.
        let &supple_vectors { first, stride, count } = unsafe { one(vectors) }?;
        if count != nodes {
            return Err(mismatch(count as usize, nodes as usize));
        }
        if first.is_null() {
            return Err(SUPPLE_E_NULL.into());
        }
        if stride.checked_mul(count as usize).is_none_or(|bytes| bytes > isize::MAX as usize) {
            return Err(short(usize::MAX, stride));
        }
        if stride % align_of::<f32>() != 0 || !first.is_aligned() {
            return Err(SUPPLE_E_MISALIGNED.into());
        }
        if stride < size_of::<[f32; 3]>() {
            return Err(short(stride, size_of::<[f32; 3]>()));
        }
        Ok(Self { first, stride, count: count as usize })
    }

    fn at(&self, node: usize) -> [f32; 3] {
        if node >= self.count {
            return [0.0; 3];
        }
        // SAFETY: `of` has looked at pointer, alignment and stride, and the host has so many of them.
        unsafe { self.first.byte_add(node * self.stride).cast::<[f32; 3]>().read() }
    }

    fn extent(&self) -> Extent {
        extent(self.first.cast::<u8>(), self.stride.saturating_mul(self.count))
    }
}

impl From<FieldError> for supple_error {
    fn from(error: FieldError) -> Self {
        let grid = Self::from(SUPPLE_E_GRID);
        match error {
            FieldError::Origin { axis, value } | FieldError::Spacing { axis, value } => {
                grid.axis(axis).value(value, 0.0)
            }
            FieldError::Direction { off } => grid.value(off, 0.0),
            FieldError::Points { points } => grid.value(points as f64, 0.0),
            FieldError::Reach { value } => Self::from(SUPPLE_E_NEGATIVE).value(value.into(), 0.0),
            FieldError::Displacement { node, axis, value } => {
                Self::from(SUPPLE_E_NOT_FINITE).at(node).node(node as u32).axis(axis).value(value.into(), 0.0)
            }
            FieldError::Capacity { needed, capacity } => short(capacity, needed),
        }
    }
}
