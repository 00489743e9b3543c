//! Points that follow the tissue, those a little outside too: a point's displacement as weights on the displacements
//! of nodes. Inside an element these are its linear functions; outside, as of markers on the surface, those of the
//! linear function that fits the nearest nodes best, which one element alone would give with all of its error.

use nalgebra::{Matrix4, Vector4};

use crate::scene::body::Body;

/// Nodes whose linear function carries a point outside.
const NEAREST: usize = 24;
/// How far below zero a linear function may be in a point that counts as inside: the rounding of files.
const ROUNDING: f64 = 1e-6;

/// A point as nodes and their weights, which add up to one.
pub(crate) struct Followed {
    nodes: Vec<(u32, f64)>,
    /// How far the nearest node is if the point is outside the mesh, m.
    pub(crate) outside: Option<f64>,
}

impl Followed {
    pub(crate) fn new(body: &Body, point: [f64; 3]) -> Self {
        let points = &body.mesh.points;
        for tet in &body.mesh.tets {
            let weights = linear(tet.map(|node| points[node as usize]), point);
            if let Some(weights) = weights.filter(|weights| weights.iter().all(|weight| *weight >= -ROUNDING)) {
                return Self { nodes: tet.iter().copied().zip(weights).collect(), outside: None };
            }
        }
        let square = |node: u32| (0..3).map(|axis| (points[node as usize][axis] - point[axis]).powi(2)).sum::<f64>();
        let mut nearest: Vec<u32> = (0..points.len() as u32).collect();
        nearest.sort_by(|&a, &b| square(a).total_cmp(&square(b)));
        nearest.truncate(NEAREST);
        let distance = nearest.first().map(|&node| square(node).sqrt());
        // Without units, so that the sums are of one size.
        let size = body.diagonal();
        let place = |node: u32| {
            let at = points[node as usize];
            Vector4::new(1.0, (at[0] - point[0]) / size, (at[1] - point[1]) / size, (at[2] - point[2]) / size)
        };
        let sum = nearest.iter().map(|&node| place(node) * place(node).transpose()).sum::<Matrix4<f64>>();
        let nodes = match sum.try_inverse() {
            Some(inverse) => nearest.iter().map(|&node| (node, (inverse * place(node))[0])).collect(),
            // Nodes in one plane.
            None => nearest.iter().take(1).map(|&node| (node, 1.0)).collect(),
        };
        Self { nodes, outside: distance }
    }

    /// Its displacement, m.
    pub(crate) fn displacement(&self, of_nodes: &[[f32; 3]]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(node, weight) in &self.nodes {
            for axis in 0..3 {
                sum[axis] += weight * f64::from(of_nodes[node as usize][axis]);
            }
        }
        sum
    }
}

/// The four linear functions of a tetrahedron in a point; none of one without volume.
fn linear(corners: [[f64; 3]; 4], point: [f64; 3]) -> Option<[f64; 4]> {
    let column = |[x, y, z]: [f64; 3]| Vector4::new(1.0, x, y, z);
    let weights = Matrix4::from_columns(&corners.map(column)).try_inverse()? * column(point);
    Some(weights.into())
}
