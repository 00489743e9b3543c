//! Meshes out of files, for C ([`crate::io`]): only in a library with the feature `io`, which needs the system's C
//! library and its heap. What is read is handed over in memory of the host's, and nothing of the library's stays.
#![cfg(feature = "io")]

use core::ffi::{CStr, c_char};
use std::path::Path;
use std::string::{String, ToString};

use crate::io::{TetMesh, read_mesh};

use super::memory::{one, place_for};
use super::status::supple_status;
use supple_status::*;

/// How large the mesh of a file is. A host defines SUPPLE_IO, and has a library with the feature io, to use this and
/// the two functions that take it.
#[cfg(feature = "io")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct supple_mesh_size {
    /// Nodes, also those of no element.
    pub nodes: u32,
    /// Tetrahedra.
    pub elements: u32,
    /// 1 if the file tells of what region each tetrahedron is; else 0.
    pub has_regions: u32,
}

/// Writes how large the mesh of a file is. The extension tells the format: .vtk, .vtu, .msh (Gmsh 1, 2.x and 4.1),
/// .node or .ele (TetGen). It reads the whole file, on the heap, and releases what it took. What is wrong with the
/// file, SUPPLE_E_FILE, stands in `words`: a sentence with the file, the place in it and the value.
///
/// @param path in UTF-8.
/// @param words receives the sentence, cut to `room` bytes, or nothing; NULL if `room` is 0.
#[cfg(feature = "io")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_measure_mesh(
    path: *const c_char,
    size: *mut supple_mesh_size,
    words: *mut c_char,
    room: usize,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    unsafe {
        told(words, room, || {
            let place = place_for(size).map_err(status)?;
            place.write(size_of_mesh(&mesh_of(path)?));
            Ok(())
        })
    }
}

/// Writes the mesh of a file of a known size. Nothing is scaled, renumbered or turned.
///
/// @param size as of supple_measure_mesh. A file that has changed since is refused.
/// @param points receives three coordinates of each node, in the unit of the file.
/// @param tetrahedra receives four nodes of each element, from zero.
/// @param regions receives the region of each element, if the file has regions; else it may be NULL.
/// @param words as of supple_measure_mesh.
#[cfg(feature = "io")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_read_mesh(
    path: *const c_char,
    size: *const supple_mesh_size,
    points: *mut f64,
    tetrahedra: *mut u32,
    regions: *mut i32,
    words: *mut c_char,
    room: usize,
) -> supple_status {
    // SAFETY: what the header asks of the caller: room for as many as the size says.
    unsafe {
        told(words, room, || {
            let size = one(size).map_err(status)?;
            let (points, tetrahedra) = (place_for(points).map_err(status)?, place_for(tetrahedra).map_err(status)?);
            let mesh = mesh_of(path)?;
            if size_of_mesh(&mesh) != *size {
                return Err(Refused::Words("the file has changed since its size was asked for".into()));
            }
            points.copy_from_nonoverlapping(mesh.points.as_ptr().cast(), 3 * mesh.points.len());
            tetrahedra.copy_from_nonoverlapping(mesh.tets.as_ptr().cast(), 4 * mesh.tets.len());
            if size.has_regions == 1 {
                let regions = place_for(regions).map_err(status)?;
                regions.copy_from_nonoverlapping(mesh.regions.as_ptr(), mesh.regions.len());
            }
            Ok(())
        })
    }
}

/// Why there is no mesh.
enum Refused {
    Status(supple_status),
    Words(String),
}

fn status(error: super::status::supple_error) -> Refused {
    Refused::Status(error.status)
}

/// # Safety
/// If not NULL, the path is a string.
unsafe fn mesh_of(path: *const c_char) -> Result<TetMesh, Refused> {
    if path.is_null() {
        return Err(Refused::Status(SUPPLE_E_NULL));
    }
    // SAFETY: the caller's promise.
    let path = unsafe { CStr::from_ptr(path) }.to_str();
    let path = path.map_err(|error| Refused::Words(std::format!("the path is not UTF-8: {error}")))?;
    let mesh = read_mesh(Path::new(path)).map_err(|error| Refused::Words(error.to_string()))?;
    let most = u32::MAX as usize;
    if mesh.points.len() > most || mesh.tets.len() > most {
        return Err(Refused::Words(std::format!("{path}: more than {most} nodes or tetrahedra")));
    }
    Ok(mesh)
}

fn size_of_mesh(mesh: &TetMesh) -> supple_mesh_size {
    let has_regions = mesh.regions.len() == mesh.tets.len();
    supple_mesh_size {
        nodes: mesh.points.len() as u32,
        elements: mesh.tets.len() as u32,
        has_regions: has_regions.into(),
    }
}

/// Does `work`, and writes the words of what went wrong.
///
/// # Safety
/// If not NULL, `words` leads to `room` bytes.
unsafe fn told(words: *mut c_char, room: usize, work: impl FnOnce() -> Result<(), Refused>) -> supple_status {
    if words.is_null() && room > 0 {
        return SUPPLE_E_NULL;
    }
    let (status, said) = match work() {
        Ok(()) => (SUPPLE_OK, String::new()),
        Err(Refused::Status(status)) => (status, String::new()),
        Err(Refused::Words(said)) => (SUPPLE_E_FILE, said),
    };
    // Not within a character.
    let kept = (0..room.min(said.len() + 1)).rev().find(|&end| said.is_char_boundary(end)).unwrap_or(0);
    if room > 0 {
        // SAFETY: the caller's promise; with the zero that ends a string it is no longer than the room.
        unsafe {
            words.copy_from_nonoverlapping(said.as_ptr().cast(), kept);
            words.add(kept).write(0);
        }
    }
    status
}
