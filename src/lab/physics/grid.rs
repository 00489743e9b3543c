//! Mapped grids: the unit cube of [`Bar`], six tetrahedra a cell, under a map of its parameters to metres. Irregular ones move the
//! inner grid planes' nodes, deterministically, before the map; nodes of the cube's faces stay in their faces.

use std::vec::Vec;

use crate::loads::NodalForce;
use crate::mesh::Bar;

/// A mapped grid of tetrahedra.
pub(super) struct Grid {
    pub(super) bar: Bar,
    /// m.
    pub(super) points: Vec<[f32; 3]>,
    pub(super) tets: Vec<[u32; 4]>,
}

impl Grid {
    /// The image of the unit cube; nodes moved by at most `jitter` of the width of a cell.
    pub(super) fn new(cells: [u32; 3], jitter: f64, map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let bar = Bar { size: [1.0; 3], cells };
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let mut points = Vec::with_capacity(bar.node_count());
        for k in 0..=cells[2] {
            for j in 0..=cells[1] {
                for i in 0..=cells[0] {
                    let at = [(i, cells[0]), (j, cells[1]), (k, cells[2])].map(|(index, count)| {
                        let moved = if index > 0 && index < count { jitter * random.next() } else { 0.0 };
                        (f64::from(index) + moved) / f64::from(count)
                    });
                    points.push(map(at).map(|x| x as f32));
                }
            }
        }
        Self { bar, points, tets: bar.tets().collect() }
    }

    /// Nodes by their grid planes.
    pub(super) fn nodes(&self, chosen: impl Fn([u32; 3]) -> bool) -> Vec<u32> {
        let [nx, ny, nz] = self.bar.cells;
        let mut nodes = Vec::new();
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    if chosen([i, j, k]) {
                        nodes.push(self.bar.node(i, j, k));
                    }
                }
            }
        }
        nodes
    }

    /// A node in float64.
    pub(super) fn point(&self, node: u32) -> [f64; 3] {
        self.points[node as usize].map(f64::from)
    }

    /// Forces of a traction (Pa) on the face of these nodes: a third of traction times area to each corner of a triangle. The
    /// traction is given the unit normal out of the body.
    pub(super) fn traction(
        &self,
        nodes: &[u32],
        ramp: f32,
        pascal: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Vec<NodalForce> {
        let mut on_face = std::vec![false; self.points.len()];
        nodes.iter().for_each(|&node| on_face[node as usize] = true);
        let mut sums = std::vec![[0.0; 3]; self.points.len()];
        for tet in &self.tets {
            // Each triangle with its corners in order seen from outside of a tetrahedron of positive volume.
            for [a, b, c] in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|face| face.map(|i| tet[i])) {
                if [a, b, c].iter().all(|&node| on_face[node as usize]) {
                    let [p, q, r] = [a, b, c].map(|node| glam::DVec3::from_array(self.point(node)));
                    let twice = (q - p).cross(r - p);
                    let traction = pascal(twice.normalize().to_array());
                    for node in [a, b, c] {
                        for axis in 0..3 {
                            sums[node as usize][axis] += traction[axis] * twice.length() / 6.0;
                        }
                    }
                }
            }
        }
        let force = |&node: &u32| NodalForce { node, newton: sums[node as usize].map(|x| x as f32), ramp };
        nodes.iter().map(force).collect()
    }
}

/// Xorshift numbers in -1 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        2.0 * (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pressure on a quarter of a cylinder of radius 2 and length 1 has the resultants of its projected areas, in any mesh. Along
    /// the axis that is the area between the polygons of its two ends, which are not the same in an irregular mesh.
    #[test]
    fn pressure_on_a_curved_face_acts_on_its_projected_area() {
        let map = |[s, t, z]: [f64; 3]| {
            let angle = core::f64::consts::FRAC_PI_2 * t;
            [(2.0 + s) * angle.cos(), (2.0 + s) * angle.sin(), z]
        };
        for jitter in [0.0, 0.2] {
            let grid = Grid::new([3, 6, 2], jitter, map);
            let inner = grid.nodes(|[i, ..]| i == 0);
            let forces = grid.traction(&inner, 0.0, |normal| normal.map(|x| -5.0 * x));
            let sum = |axis: usize| forces.iter().map(|force| f64::from(force.newton[axis])).sum::<f64>();
            // Of the polygon of an end, with the axis.
            let area = |plane: u32| {
                let nodes = grid.nodes(|[i, _, k]| i == 0 && k == plane);
                let [from, to] = [&nodes[..6], &nodes[1..]].map(|nodes| nodes.iter().map(|&n| grid.point(n)));
                from.zip(to).map(|(p, q)| 0.5 * (p[0] * q[1] - p[1] * q[0])).sum::<f64>()
            };
            let along = 5.0 * (area(2) - area(0)).abs();
            std::println!("jitter {jitter}: {} {} {} ({along}) N", sum(0), sum(1), sum(2));
            assert!((sum(0) - 10.0).abs() < 1e-4 && (sum(1) - 10.0).abs() < 1e-4);
            assert!((sum(2).abs() - along).abs() < 1e-4);
        }
    }
}
