//! The cells of an unstructured grid, as both VTK formats describe them: a type each
//! (<https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>, `vtkCellType.h`) and the points.

use std::format;
use std::string::String;
use std::vec::Vec;

use super::{CellVectors, TetMesh};

const TRIANGLE: i64 = 5;
const TETRAHEDRON: i64 = 10;

/// Cells without volume: they cannot be missed in a solid mesh.
const FLAT: [i64; 23] = [0, 1, 2, 3, 4, 6, 7, 8, 9, 21, 22, 23, 28, 30, 34, 35, 36, 68, 69, 70, 75, 76, 77];

/// Names under which meshers store the region of a cell, in lower case.
const REGION_NAMES: [&str; 10] = [
    "region",
    "regions",
    "region_id",
    "material",
    "materialid",
    "materialids",
    "material_id",
    "physicalids",
    "cellentityids",
    "gmsh:physical",
];

pub(super) fn names_regions(array: &str) -> bool {
    REGION_NAMES.contains(&array.to_ascii_lowercase().as_str())
}

/// Cell `c` has the type `types[c]` and the points `connectivity[ends[c - 1]..ends[c]]`.
pub(super) struct Cells {
    pub(super) types: Vec<i64>,
    pub(super) ends: Vec<i64>,
    pub(super) connectivity: Vec<i64>,
    /// The region of every cell, if the file has one.
    pub(super) regions: Option<Vec<i64>>,
    /// Vectors of every cell.
    pub(super) vectors: Vec<CellVectors>,
}

impl Cells {
    /// Adds the tetrahedra and triangles to `mesh`; their points are the `points` ones that begin at `first_point`.
    /// Volume cells of any other type are an error, because dropping them would leave holes in the organ.
    pub(super) fn add_to(&self, mesh: &mut TetMesh, first_point: usize, points: usize) -> Result<(), String> {
        if self.types.len() != self.ends.len() {
            return Err(format!("{} cell types for {} cells", self.types.len(), self.ends.len()));
        }
        if let Some(regions) = &self.regions
            && regions.len() != self.types.len()
        {
            return Err(format!("{} regions for {} cells", regions.len(), self.types.len()));
        }
        let first_tet = mesh.tets.len();
        let mut places = Vec::new();
        let mut start = 0;
        for (cell, (&kind, &end)) in self.types.iter().zip(&self.ends).enumerate() {
            let nodes = usize::try_from(start).ok().zip(usize::try_from(end).ok());
            let nodes = nodes.and_then(|(start, end)| self.connectivity.get(start..end)).ok_or_else(|| {
                format!(
                    "cell {cell} has the entries {start} to {end} of the connectivity, which has {}",
                    self.connectivity.len()
                )
            })?;
            start = end;
            match kind {
                TETRAHEDRON => {
                    mesh.tets.push(corners(cell, "tetrahedron", nodes, first_point, points)?);
                    places.push(cell);
                    if let Some(&region) = self.regions.as_ref().and_then(|regions| regions.get(cell)) {
                        let region = i32::try_from(region)
                            .map_err(|_| format!("the region {region} of cell {cell} exceeds 32 bits"))?;
                        mesh.regions.push(region);
                    }
                }
                TRIANGLE => mesh.triangles.push(corners(cell, "triangle", nodes, first_point, points)?),
                flat if FLAT.contains(&flat) => {}
                other => {
                    return Err(format!(
                        "cell {cell} is a {} (VTK type {other}); only tetrahedra with four nodes can be read",
                        name(other)
                    ));
                }
            }
        }
        for CellVectors { name, values } in &self.vectors {
            if values.len() != self.types.len() {
                return Err(format!("{} vectors {name:?} for {} cells", values.len(), self.types.len()));
            }
            let of_tets = places.iter().filter_map(|&cell| values.get(cell).copied());
            match mesh.vectors.iter_mut().find(|vectors| vectors.name == *name) {
                Some(vectors) => vectors.values.extend(of_tets),
                // One that earlier pieces do not have cannot be one of all.
                None if first_tet == 0 => {
                    mesh.vectors.push(CellVectors { name: name.clone(), values: of_tets.collect() });
                }
                None => {}
            }
        }
        Ok(())
    }
}

fn corners<const N: usize>(
    cell: usize,
    shape: &str,
    nodes: &[i64],
    first_point: usize,
    points: usize,
) -> Result<[u32; N], String> {
    let nodes: &[i64; N] =
        nodes.try_into().map_err(|_| format!("cell {cell} is a {shape} with {} points", nodes.len()))?;
    let mut corners = [0; N];
    for (corner, &node) in corners.iter_mut().zip(nodes) {
        let index = usize::try_from(node).ok().filter(|&node| node < points);
        *corner = index.and_then(|index| u32::try_from(first_point + index).ok()).ok_or_else(|| {
            format!("cell {cell} names point {node}, but the points are numbered 0 to {}", points as i64 - 1)
        })?;
    }
    Ok(corners)
}

fn name(kind: i64) -> &'static str {
    match kind {
        11 => "voxel",
        12 => "hexahedron",
        13 => "wedge",
        14 => "pyramid",
        24 => "quadratic tetrahedron",
        25 => "quadratic hexahedron",
        26 => "quadratic wedge",
        27 => "quadratic pyramid",
        42 => "polyhedron",
        71 => "Lagrange tetrahedron",
        _ => "cell of another type",
    }
}
