//! Meshes of the cases: mapped grids, that is the unit cube of [`Bar`], six tetrahedra a cell, under a map of its
//! parameters to metres; and irregular ones by Gmsh (`meshes/physics`, made by `tools/make_physics_meshes.py`). Nodes
//! are chosen by their places, so that supports, loads and markers are the same on either.

use std::collections::HashMap;
use std::path::Path;

use supple::io::parse_msh;
use supple::loads::NodalForce;
use supple::mesh::Bar;

use crate::LabError;

/// Tetrahedra and their nodes.
pub(super) struct BodyMesh {
    /// What made it, for the tables.
    pub(super) family: &'static str,
    /// m.
    pub(super) points: Vec<[f32; 3]>,
    pub(super) tets: Vec<[u32; 4]>,
}

/// The family of equal cells.
pub(super) const GRID: &str = "grid";
/// The family of irregular meshes.
pub(super) const GMSH: &str = "Gmsh";

/// Whether two lengths (m) are the same but for rounding: to a ten-thousandth of a millimetre.
pub(super) fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-7
}

impl BodyMesh {
    /// The image of the unit cube.
    pub(super) fn grid(cells: [u32; 3], map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let bar = Bar { size: [1.0; 3], cells };
        let mut points = Vec::with_capacity(bar.node_count());
        for k in 0..=cells[2] {
            for j in 0..=cells[1] {
                for i in 0..=cells[0] {
                    let at = [(i, cells[0]), (j, cells[1]), (k, cells[2])];
                    let at = at.map(|(index, count)| f64::from(index) / f64::from(count));
                    points.push(map(at).map(|x| x as f32));
                }
            }
        }
        Self { family: GRID, points, tets: bar.tets().collect() }
    }

    /// A mesh of Gmsh's, of the program's own files.
    pub(super) fn gmsh(name: &str, bytes: &[u8]) -> Result<Self, LabError> {
        let mesh = parse_msh(Path::new(name), bytes)?;
        let points = mesh.points.into_iter().map(|point| point.map(|x| x as f32)).collect();
        Ok(Self { family: GMSH, points, tets: mesh.tets })
    }

    /// Nodes by their places, m.
    pub(super) fn nodes(&self, chosen: impl Fn([f64; 3]) -> bool) -> Vec<u32> {
        (0..self.points.len() as u32).filter(|&node| chosen(self.point(node))).collect()
    }

    /// A node in float64.
    pub(super) fn point(&self, node: u32) -> [f64; 3] {
        self.points[node as usize].map(f64::from)
    }

    /// The triangles of the surface with all corners among these nodes, corners in order seen from outside.
    pub(super) fn triangles(&self, nodes: &[u32]) -> Vec<[u32; 3]> {
        let mut chosen = vec![false; self.points.len()];
        nodes.iter().for_each(|&node| chosen[node as usize] = true);
        let (mut triangles, mut shared) = (Vec::new(), HashMap::new());
        for tet in &self.tets {
            // In a tetrahedron of positive volume.
            for triangle in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|face| face.map(|i| tet[i])) {
                if triangle.iter().all(|&node| chosen[node as usize]) {
                    triangles.push(triangle);
                    *shared.entry(sorted(triangle)).or_insert(0) += 1;
                }
            }
        }
        triangles.retain(|&triangle| shared.get(&sorted(triangle)) == Some(&1));
        triangles
    }

    /// Forces of a traction (Pa) on the surface between these nodes: a third of traction times area to each corner of a
    /// triangle. The traction is given the unit normal out of the body.
    pub(super) fn traction(&self, nodes: &[u32], ramp: f32, pascal: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<NodalForce> {
        let mut sums = vec![[0.0; 3]; self.points.len()];
        for triangle in self.triangles(nodes) {
            let [p, q, r] = triangle.map(|node| glam::DVec3::from_array(self.point(node)));
            let twice = (q - p).cross(r - p);
            let traction = pascal(twice.normalize().to_array());
            for node in triangle {
                for axis in 0..3 {
                    sums[node as usize][axis] += traction[axis] * twice.length() / 6.0;
                }
            }
        }
        let force = |&node: &u32| NodalForce { node, newton: sums[node as usize].map(|x| x as f32), ramp };
        nodes.iter().map(force).collect()
    }
}

fn sorted(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort_unstable();
    triangle
}

#[cfg(test)]
mod tests {
    use super::super::cylinder;

    /// The pressure on a quarter of a cylinder's inner surface has the resultants of the surface's projected areas in
    /// any mesh, and no part along the axis: the ends are in planes.
    #[test]
    fn pressure_on_a_curved_face_acts_on_its_projected_area() {
        for mesh in [cylinder::grid(4), cylinder::irregular(0).unwrap()] {
            let inner = mesh.nodes(|[x, y, _]| super::same(x.hypot(y), cylinder::INNER));
            let forces = mesh.traction(&inner, 0.0, |normal| normal.map(|x| -5e6 * x));
            let sum = |axis: usize| forces.iter().map(|force| f64::from(force.newton[axis])).sum::<f64>();
            let thickness = mesh.points.iter().map(|point| f64::from(point[2])).fold(0.0, f64::max);
            let expected = 5e6 * cylinder::INNER * thickness;
            std::println!("{}: {} {} {} N of {expected} N", mesh.family, sum(0), sum(1), sum(2));
            for (axis, expected) in [expected, expected, 0.0].into_iter().enumerate() {
                assert!((sum(axis) - expected).abs() < 1e-4);
            }
        }
    }
}
