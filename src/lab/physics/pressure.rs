//! How much pressure oscillates from node to node: the root mean square of a pressure's distance from the mean of its
//! neighbours', over the mean magnitude of pressure. `p = U'(J) = 2 d (J - 1)`, Pa. Neighbours are elements that share
//! a face, and with nodal pressure also nodes that share an edge: the pressure of a node is that of the mean volume
//! ratio around it, the pressure of an element, which its stress has, the mean of its four nodes'. Zero for a pressure
//! that is the same everywhere.

use std::collections::HashMap;

use glam::DVec3;
use supple::material::Element;
use supple::simd::NodeVector;

use super::PhysicsRow;
use super::specimen::Specimen;
use crate::scenes::volume;

pub(super) const ELEMENTS: &str = "pressure oscillation between elements over mean pressure";
pub(super) const NODES: &str = "pressure oscillation between nodes over mean pressure";

/// From element to element, and with nodal pressure from node to node.
pub(super) type Oscillation = (f64, Option<f64>);

pub(super) fn oscillation(body: &Specimen, element: Element, displacements: &[NodeVector]) -> Oscillation {
    let tets = &body.mesh.tets;
    let volumes: Vec<(f64, f64)> = tets
        .iter()
        .map(|tet| {
            let rest = tet.map(|node| DVec3::from_array(body.mesh.point(node)));
            let moved = [0, 1, 2, 3].map(|corner| {
                let u = displacements[tet[corner] as usize].to_array().map(f64::from);
                rest[corner] + DVec3::from_array(u)
            });
            (volume(rest), volume(moved))
        })
        .collect();
    let bulk = body.elastic.bulk();
    let pressure = |(rest, moved): (f64, f64)| bulk * (moved / rest - 1.0);
    let faces = across_faces(tets);
    if element == Element::Linear {
        let pressures: Vec<f64> = volumes.into_iter().map(pressure).collect();
        return (roughness(&pressures, &faces), None);
    }
    let mut sums = vec![(0.0, 0.0); body.mesh.points.len()];
    for (tet, (rest, moved)) in tets.iter().zip(volumes) {
        for &node in tet {
            let sum = &mut sums[node as usize];
            *sum = (sum.0 + rest, sum.1 + moved);
        }
    }
    let of_nodes: Vec<f64> = sums.into_iter().map(pressure).collect();
    let of_elements: Vec<f64> =
        tets.iter().map(|tet| tet.map(|node| of_nodes[node as usize]).iter().sum::<f64>() / 4.0).collect();
    (roughness(&of_elements, &faces), Some(roughness(&of_nodes, &along_edges(tets))))
}

/// Its rows; none without a result.
pub(super) fn rows(oscillation: Option<Oscillation>, row: &PhysicsRow) -> Vec<PhysicsRow> {
    let of = |quantity: &str, value| PhysicsRow { quantity: quantity.into(), value: Some(value), ..row.clone() };
    let Some((elements, nodes)) = oscillation else { return Vec::new() };
    let nodes = nodes.map(|value| of(NODES, value));
    [of(ELEMENTS, elements)].into_iter().chain(nodes).collect()
}

fn along_edges(tets: &[[u32; 4]]) -> Vec<(usize, usize)> {
    let mut edges = Vec::new();
    for tet in tets {
        for i in 0..4 {
            for j in 0..i {
                let (a, b) = (tet[i] as usize, tet[j] as usize);
                edges.push((a.min(b), a.max(b)));
            }
        }
    }
    edges.sort_unstable();
    edges.dedup();
    edges
}

fn across_faces(tets: &[[u32; 4]]) -> Vec<(usize, usize)> {
    let (mut open, mut pairs) = (HashMap::new(), Vec::new());
    for (element, tet) in tets.iter().enumerate() {
        for left_out in 0..4 {
            let mut face = [tet[(left_out + 1) % 4], tet[(left_out + 2) % 4], tet[(left_out + 3) % 4]];
            face.sort_unstable();
            match open.remove(&face) {
                Some(other) => pairs.push((other, element)),
                None => drop(open.insert(face, element)),
            }
        }
    }
    pairs
}

fn roughness(values: &[f64], pairs: &[(usize, usize)]) -> f64 {
    let mut sums = vec![(0.0, 0.0); values.len()];
    for &(a, b) in pairs {
        for (to, from) in [(a, b), (b, a)] {
            sums[to].0 += values[from];
            sums[to].1 += 1.0;
        }
    }
    let distances = values.iter().zip(sums).filter(|(_, (_, count))| *count > 0.0);
    let square: f64 = distances.map(|(value, (sum, count))| (value - sum / count).powi(2)).sum();
    let count = values.len() as f64;
    (square / count).sqrt() / (values.iter().map(|value| value.abs()).sum::<f64>() / count)
}
