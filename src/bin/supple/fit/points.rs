//! Points that follow the tissue, those a little outside too: a point's displacement as weights on the displacements
//! of nodes. Inside an element these are its linear functions; outside, as of markers on the surface, those of the
//! linear function that fits the nodes next to the nearest one best, which one element alone would give with all of its
//! error. Not the nodes nearest to the point: of one far from the surface they lie in it, and tell nothing of what is above.

use nalgebra::{Matrix4, Vector4};

use crate::scene::body::Body;

/// Nodes whose linear function carries a point outside.
const NEAREST: usize = 24;
/// Of the extent of these nodes, squared: where they lie in one plane the function does not change across it.
const FLAT: f64 = 1e-6;
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
        let square = |node: u32, from: [f64; 3]| {
            (0..3).map(|axis| (points[node as usize][axis] - from[axis]).powi(2)).sum::<f64>()
        };
        let mut nearest: Vec<u32> = (0..points.len() as u32).collect();
        let Some(foot) = nearest.iter().copied().min_by(|&a, &b| square(a, point).total_cmp(&square(b, point))) else {
            return Self { nodes: Vec::new(), outside: None };
        };
        let (at_foot, distance) = (points[foot as usize], square(foot, point).sqrt());
        nearest.sort_by(|&a, &b| square(a, at_foot).total_cmp(&square(b, at_foot)));
        nearest.truncate(NEAREST);
        // Without units, so that the sums are of one size, and about their middle.
        let size = nearest.last().map_or(1.0, |&node| square(node, at_foot).sqrt().max(f64::MIN_POSITIVE));
        let mean = [0, 1, 2]
            .map(|axis| nearest.iter().map(|&node| points[node as usize][axis]).sum::<f64>() / nearest.len() as f64);
        let place = |at: [f64; 3]| {
            let [x, y, z] = [0, 1, 2].map(|axis| (at[axis] - mean[axis]) / size);
            Vector4::new(1.0, x, y, z)
        };
        let of_node = |node: u32| place(points[node as usize]);
        let least = nearest.len() as f64 * FLAT;
        let sum = nearest.iter().map(|&node| of_node(node) * of_node(node).transpose()).sum::<Matrix4<f64>>()
            + Matrix4::from_diagonal(&Vector4::new(0.0, least, least, least));
        let weights = sum.try_inverse().map(|inverse| inverse * place(point));
        let weight = |node: u32| weights.map_or(0.0, |weights| weights.dot(&of_node(node)));
        Self { nodes: nearest.into_iter().map(|node| (node, weight(node))).collect(), outside: Some(distance) }
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
