//! Results for ParaView: one `.vtu` file a frame and a `.pvd` file that gives each its time, as specified in "VTK File
//! Formats" (<https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>). Arrays are appended as raw
//! bytes, little endian, compressed with zlib: the smallest of the encodings, and ParaView and meshio read it.

use std::format;
use std::io::{self, Write};
use std::path::Path;
use std::string::String;
use std::vec::Vec;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::replace::replace;

/// The mesh and its fields at one time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame<'a> {
    /// Coordinates, in the unit in which ParaView shall show them.
    pub points: &'a [[f64; 3]],
    /// The four points of each tetrahedron, from 0.
    pub tets: &'a [[u32; 4]],
    /// Named vectors, one for each point, such as displacements.
    pub point_vectors: &'a [(&'a str, &'a [[f32; 3]])],
    /// Named scalars, one for each point.
    pub point_scalars: &'a [(&'a str, &'a [f32])],
    /// Named scalars, one for each tetrahedron.
    pub cell_scalars: &'a [(&'a str, &'a [f32])],
    /// Named vectors, one for each tetrahedron, such as [`TetMesh::vectors`](super::TetMesh::vectors).
    pub cell_vectors: &'a [(&'a str, &'a [[f32; 3]])],
    /// [`TetMesh::regions`](super::TetMesh::regions); none if empty.
    pub regions: &'a [i32],
}

/// Writes one frame as a `.vtu` file, atomically as [`write_atomically`](super::write_atomically) does, but for power
/// cuts: who has written a series may synchronise its files. A field whose length does not fit the mesh is an error of
/// the kind [`InvalidInput`](io::ErrorKind::InvalidInput), as is a tetrahedron that names a point beyond the last.
pub fn write_vtu(path: &Path, frame: &Frame<'_>) -> io::Result<()> {
    let (n_points, n_tets) = (frame.points.len(), frame.tets.len());
    let mut arrays = Arrays { xml: String::new(), data: Vec::new() };
    arrays.open("PointData");
    for (name, values) in frame.point_vectors {
        check(name, values.len(), n_points, "points")?;
        arrays.add(name, "Float32", 3, values.as_flattened().iter().map(|x| x.to_le_bytes()))?;
    }
    for (name, values) in frame.point_scalars {
        check(name, values.len(), n_points, "points")?;
        arrays.add(name, "Float32", 1, values.iter().map(|x| x.to_le_bytes()))?;
    }
    arrays.close("PointData");
    arrays.open("CellData");
    for (name, values) in frame.cell_scalars {
        check(name, values.len(), n_tets, "tetrahedra")?;
        arrays.add(name, "Float32", 1, values.iter().map(|x| x.to_le_bytes()))?;
    }
    for (name, values) in frame.cell_vectors {
        check(name, values.len(), n_tets, "tetrahedra")?;
        arrays.add(name, "Float32", 3, values.as_flattened().iter().map(|x| x.to_le_bytes()))?;
    }
    if !frame.regions.is_empty() {
        check("region", frame.regions.len(), n_tets, "tetrahedra")?;
        arrays.add("region", "Int32", 1, frame.regions.iter().map(|x| x.to_le_bytes()))?;
    }
    arrays.close("CellData");
    write_cells(path, frame.points, ("tetrahedron", frame.tets, 10), arrays)
}

/// Writes triangles, as those of an instrument, as a `.vtu` file, as [`write_vtu`] does.
pub fn write_triangles(path: &Path, points: &[[f64; 3]], triangles: &[[u32; 3]]) -> io::Result<()> {
    write_cells(path, points, ("triangle", triangles, 5), Arrays { xml: String::new(), data: Vec::new() })
}

/// Writes cells of one VTK type with their fields.
fn write_cells<const N: usize>(
    path: &Path,
    points: &[[f64; 3]],
    (name, cells, kind): (&str, &[[u32; N]], u8),
    mut arrays: Arrays,
) -> io::Result<()> {
    let (n_points, n_cells) = (points.len(), cells.len());
    if let Some((index, corners)) =
        cells.iter().enumerate().find(|(_, cell)| cell.iter().any(|&p| p as usize >= n_points))
    {
        return Err(invalid(format!("{name} {index} names the points {corners:?} of {n_points}")));
    }
    arrays.open("Points");
    arrays.add("Points", "Float64", 3, points.as_flattened().iter().map(|x| x.to_le_bytes()))?;
    arrays.close("Points");
    arrays.open("Cells");
    let corners = cells.as_flattened().iter().map(|&p| i64::from(p).to_le_bytes());
    arrays.add("connectivity", "Int64", 1, corners)?;
    arrays.add("offsets", "Int64", 1, (1..=n_cells).map(|cell| ((N * cell) as i64).to_le_bytes()))?;
    arrays.add("types", "UInt8", 1, cells.iter().map(|_| [kind]))?;
    arrays.close("Cells");

    replace(path, false, |w| {
        w.write_all(
            b"<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
              byte_order=\"LittleEndian\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n",
        )?;
        writeln!(
            w,
            "<UnstructuredGrid><Piece NumberOfPoints=\"{n_points}\" NumberOfCells=\"{n_cells}\">\n{}</Piece>",
            arrays.xml
        )?;
        w.write_all(b"</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_")?;
        w.write_all(&arrays.data)?;
        w.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    })
}

/// Writes a `.pvd` file, as [`write_vtu`] does: the frames of a simulation as pairs of a time in s and the name of a
/// `.vtu` file relative to the folder of the `.pvd` file. Files of one time that follow each other are shown together.
pub fn write_pvd(path: &Path, frames: &[(f64, String)]) -> io::Result<()> {
    replace(path, false, |w| {
        w.write_all(b"<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n")?;
        let (mut part, mut before) = (0, f64::NAN);
        for (time, file) in frames {
            part = if *time == before { part + 1 } else { 0 };
            before = *time;
            writeln!(w, "<DataSet timestep=\"{time}\" part=\"{part}\" file=\"{}\"/>", escaped(file))?;
        }
        w.write_all(b"</Collection>\n</VTKFile>\n")
    })
}

/// The `<DataArray>` elements and the appended data to which they point.
struct Arrays {
    xml: String,
    data: Vec<u8>,
}

impl Arrays {
    fn open(&mut self, element: &str) {
        self.xml += &format!("<{element}>\n");
    }

    fn close(&mut self, element: &str) {
        self.xml += &format!("</{element}>\n");
    }

    fn add<const N: usize>(
        &mut self,
        name: &str,
        kind: &str,
        components: usize,
        values: impl Iterator<Item = [u8; N]>,
    ) -> io::Result<()> {
        /// Bytes in a block, a multiple of every size of value.
        const BLOCK: usize = 1 << 20;
        self.xml += &format!(
            "<DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{components}\" format=\"appended\" \
             offset=\"{}\"/>\n",
            escaped(name),
            self.data.len()
        );
        let bytes: Vec<u8> = values.flatten().collect();
        let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(compressed).collect::<io::Result<_>>()?;
        for count in [blocks.len(), BLOCK, bytes.len() % BLOCK].into_iter().chain(blocks.iter().map(Vec::len)) {
            self.data.extend((count as u64).to_le_bytes());
        }
        self.data.extend(blocks.into_iter().flatten());
        Ok(())
    }
}

fn compressed(block: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(block)?;
    encoder.finish()
}

fn check(name: &str, values: usize, expected: usize, what: &str) -> io::Result<()> {
    if values == expected {
        return Ok(());
    }
    Err(invalid(format!("the field {name:?} has {values} values for {expected} {what}")))
}

pub(super) fn invalid(reason: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, reason)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
