//! Meshes in, fields out. [`read_mesh`] reads tetrahedral meshes in the formats of VTK, Gmsh and TetGen;
//! [`write_vtu`] and [`write_pvd`] write results for ParaView. Points keep the unit of their file, which no format
//! records: the caller scales to metres.

mod cursor;
mod error;
mod file;
mod gmsh;
mod node_index;
mod replace;
mod tetgen;
mod values;
mod vtk;
mod vtk_cells;
mod vtu;
mod vtu_data;
mod write;

use std::ffi::OsStr;
use std::path::Path;
use std::string::String;
use std::vec::Vec;

use crate::mesh::overlap;
use error::Fault;
pub use error::ReadError;
pub use file::{read_file, read_text};
pub use replace::write_atomically;
pub use write::{Frame, write_pvd, write_triangles, write_vtu};

/// A tetrahedral mesh as its file has it; nothing is scaled, renumbered or turned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Coordinates in file units. They may be NaN or infinite, and not every point belongs to a tetrahedron.
    pub points: Vec<[f64; 3]>,
    /// The four points of each tetrahedron, from 0, in the order of the file. All are in range.
    pub tets: Vec<[u32; 4]>,
    /// The triangles of the file, usually its surface; empty if it lists none.
    pub triangles: Vec<[u32; 3]>,
    /// A region for each tetrahedron, empty if the file has none. Gmsh: the (first) physical tags, or the elementary
    /// tags where no tetrahedron has a physical one. VTK: the first array of whole numbers among the cell data that
    /// is named like `region`, `material`, `PhysicalIds`, `CellEntityIds` or `gmsh:physical`. TetGen: the last
    /// attribute, if it is a whole number everywhere.
    pub regions: Vec<i32>,
    /// Vectors by tetrahedron, such as the directions of fibres. VTK: the arrays of real numbers with three components
    /// among the cell data; other formats have none.
    pub vectors: Vec<CellVectors>,
}

/// An array of vectors, one for each tetrahedron.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellVectors {
    /// Its name.
    pub name: String,
    /// The vectors, as the file has them.
    pub values: Vec<[f64; 3]>,
}

/// Reads a mesh; the extension tells the format.
///
/// - `.vtk`: legacy VTK, versions 1 to 5, text or binary
/// - `.vtu`: VTK XML, text, base64 or raw, plain or zlib
/// - `.msh`: Gmsh 1, 2.x or 4.1, text or binary
/// - `.node` or `.ele`: TetGen; the other file must be in the same folder
///
/// Points, lines and surface cells other than triangles are left out. A volume cell that is not a tetrahedron with
/// four nodes is an error, as are a file without tetrahedra and tetrahedra that overlap: listed twice, or three at a face.
pub fn read_mesh(path: &Path) -> Result<TetMesh, ReadError> {
    let mesh = read_any(path)?;
    if mesh.tets.is_empty() {
        return Err(Fault::new("", "the file has no tetrahedra").in_file(path));
    }
    Ok(mesh)
}

/// The surface of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceMesh {
    /// Coordinates in file units.
    pub points: Vec<[f64; 3]>,
    /// The points of each triangle, from 0.
    pub triangles: Vec<[u32; 3]>,
}

/// Reads the surface of a body from the same files: the boundary of their tetrahedra, or else their triangles. A file
/// without either is an error.
pub fn read_surface(path: &Path) -> Result<SurfaceMesh, ReadError> {
    let mesh = read_any(path)?;
    let triangles = if mesh.tets.is_empty() { mesh.triangles } else { crate::mesh::boundary(mesh.tets) };
    if triangles.is_empty() {
        return Err(Fault::new("", "the file has neither tetrahedra nor triangles").in_file(path));
    }
    Ok(SurfaceMesh { points: mesh.points, triangles })
}

fn read_any(path: &Path) -> Result<TetMesh, ReadError> {
    let mesh = read_as_it_is(path)?;
    // With twice the mass and stiffness they would look sound, and no boundary would be left of them.
    match overlap(&mesh.tets) {
        Some(overlap) => Err(Fault::new("", format_args!("{overlap}; {REMEDY}")).in_file(path)),
        None => Ok(mesh),
    }
}

/// For tetrahedra that overlap.
const REMEDY: &str = "list each once (Gmsh lists those of two physical groups twice in version 2.2: save version 4.1, or give each volume one group)";

fn read_as_it_is(path: &Path) -> Result<TetMesh, ReadError> {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "vtk" => parse(path, vtk::read),
        "vtu" => parse(path, vtu::read),
        "msh" => parse(path, gmsh::read),
        "node" | "ele" => {
            let file = |kind| {
                if extension == kind { path.into() } else { path.with_extension(kind) }
            };
            let (points, index) = parse(&file("node"), tetgen::read_nodes)?;
            parse(&file("ele"), |bytes| tetgen::read_elements(bytes, points, &index))
        }
        _ => Err(Fault::new("", "the extension is none of .vtk, .vtu, .msh, .node and .ele").in_file(path)),
    }
}

/// Reads a Gmsh `.msh` mesh from memory; `name` stands for the file in errors.
pub fn parse_msh(name: &Path, bytes: &[u8]) -> Result<TetMesh, ReadError> {
    gmsh::read(bytes).map_err(|fault| fault.in_file(name))
}

fn parse<T>(path: &Path, parse: impl FnOnce(&[u8]) -> Result<T, Fault>) -> Result<T, ReadError> {
    let bytes = read_file(path).map_err(|source| ReadError::Unreadable { path: path.into(), source })?;
    // All formats begin with text.
    parse(file::without_mark(&bytes)).map_err(|fault| fault.in_file(path))
}
