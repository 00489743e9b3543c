//! `supple field`: the signed distances of a closed surface as a file, for instruments of hosts (`SUPPLE_FIELD`,
//! `Field::parse`).

use std::path::{Path, PathBuf};

use clap::Args;
use supple::contact::SurfaceField;
use supple::io::{self, SurfaceMesh, write_atomically};

use crate::problem::{End, Problem};
use crate::screen::output;

#[derive(Args)]
pub(crate) struct Asked {
    /// A mesh: the surface of its tetrahedra, or else its triangles, which must be closed
    mesh: PathBuf,
    /// Distance of neighbouring points of the grid, mm
    #[arg(long, value_name = "MM")]
    spacing: f32,
    /// Factor from the mesh's unit to metres
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// The file to write; one that is there is replaced
    #[arg(long)]
    out: PathBuf,
}

/// Points, m, and triangles.
type Surface = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// The surface of a mesh file.
pub(crate) fn read_surface(path: &Path, scale: f64) -> Result<Surface, Problem> {
    let SurfaceMesh { points, triangles } = io::read_surface(path).map_err(Problem::of)?;
    let points = points.iter().map(|point| point.map(|component| (component * scale) as f32));
    Ok((points.collect(), triangles))
}

pub(crate) fn make(asked: &Asked) -> Result<End, Problem> {
    let Asked { mesh, spacing, scale, out } = asked;
    if !(scale.is_finite() && *scale > 0.0) {
        return Err(Problem(format!("--scale is {scale}, it must be a positive number")));
    }
    let wrong = |error: &dyn std::fmt::Display| Problem::in_file(mesh, error);
    let (points, triangles) = read_surface(mesh, *scale)?;
    let made = SurfaceField::new(&points, &triangles, 1e-3 * spacing).map_err(|error| wrong(&error))?;
    let field = made.field().map_err(|error| wrong(&format!("{error}; is the surface closed?")))?;
    let bytes = field.to_bytes();
    write_atomically(out, |file| file.write_all(&bytes)).map_err(Problem::of)?;
    let [x, y, z] = field.size();
    output!("{} ({} bytes): {x} x {y} x {z} points, {:.2} mm deep", out.display(), bytes.len(), 1e3 * field.deepest());
    Ok(End::Reached)
}
