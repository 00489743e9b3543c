//! The exact critical step `2 / omega_max`: the largest eigenvalue of `M^-1/2 K(u) M^-1/2` in float64 by
//! the Lanczos iteration (a power iteration that keeps what it has seen; plain power iteration needs
//! thousands of products where the upper spectrum is dense, as in a regular mesh). For tools and tests: it
//! allocates and takes hundreds of products with the tangent.

use std::vec;
use std::vec::Vec;

use glam::DVec3;

use super::tangent::{ElementTangent, LawTangent};
use crate::element::place_in;
use crate::element::stabilising_modulus;
use crate::material::Material;
use crate::scene::SceneView;
use crate::simd::NodeVector;

/// Relative change of the largest eigenvalue over [`CHECK`] iterations at which the iteration ends.
const TOLERANCE: f64 = 1e-8;
const CHECK: usize = 20;
const MOST_ITERATIONS: usize = 2_000;

/// The exact limit of stability at the given displacements, s; infinite if nothing is stiff. Nothing if
/// there are fewer displacements than nodes or the iteration does not settle.
pub fn exact_critical_step<M: Material>(scene: SceneView<'_, M>, displacement: &[NodeVector]) -> Option<f64> {
    let displacement = displacement.get(..scene.node_count())?;
    let tangents: Vec<ElementTangent> =
        scene.places().map(|(tile, lane)| ElementTangent::of(scene, tile, lane, displacement)).collect();
    let nodal = if scene.element().is_nodal_pressure() { Some(NodalTangent::new(scene, &tangents)) } else { None };
    let tangents = match &nodal {
        Some(nodal) => nodal.with_pressures(tangents),
        None => tangents,
    };
    let strain = scene.element().is_nodal_strain().then(|| PatchTangents::new(scene, &tangents, displacement));
    let roots: Vec<DVec3> = scene
        .inertia
        .iter()
        .map(|inertia| DVec3::from_array(inertia.inverse.map(|inverse| f64::from(inverse).sqrt())))
        .collect();
    let product = |vector: &[DVec3]| {
        let mut out = vec![DVec3::ZERO; vector.len()];
        let at = |node: usize| roots[node] * vector[node];
        match &strain {
            Some(strain) => strain.add(scene, &tangents, at, &mut out),
            None => {
                for tangent in &tangents {
                    add_to_nodes(tangent, tangent.product(tangent.nodes.map(at)), &mut out);
                }
            }
        }
        if let Some(nodal) = &nodal {
            nodal.add(&tangents, at, &mut out);
        }
        for (sum, root) in out.iter_mut().zip(&roots) {
            *sum *= *root;
        }
        out
    };
    let largest = largest_eigenvalue(start_vector(&roots), product)?;
    Some(if largest > 0.0 { 2.0 / largest.sqrt() } else { f64::INFINITY })
}

/// What nodal pressure adds to the tangents of the elements: `k sum_a V_a (dJ_a)^2` ([`crate::element`]). Where an
/// element keeps its own volume it has an entry of its own.
struct NodalTangent {
    /// For each element the entries of its corners.
    entries: Vec<[usize; 4]>,
    /// For each entry: volume, m^3, `J - 1`.
    volumes: Vec<f64>,
    changes: Vec<f64>,
}

impl NodalTangent {
    fn new<M: Material>(scene: SceneView<'_, M>, tangents: &[ElementTangent]) -> Self {
        let nodes = scene.node_count();
        let places = scene.places().enumerate();
        let entries: Vec<_> = places
            .map(|(element, (tile, lane))| {
                [0, 1, 2, 3].map(|corner| match tile.slot(corner, lane) {
                    slot @ (0 | 1) => 2 * tile.node(corner, lane) + usize::from(slot),
                    _ => 2 * nodes + element,
                })
            })
            .collect();
        let mut volumes = vec![0.0; 2 * nodes + tangents.len()];
        let mut changes = volumes.clone();
        for (tangent, entries) in tangents.iter().zip(&entries) {
            for &entry in entries {
                volumes[entry] += tangent.quarter();
                changes[entry] += tangent.quarter() * tangent.at.change;
            }
        }
        for (change, volume) in changes.iter_mut().zip(&volumes) {
            *change /= volume.max(f64::MIN_POSITIVE);
        }
        Self { entries, volumes, changes }
    }

    /// The tangents with the mean pressures of their corners.
    fn with_pressures(&self, tangents: Vec<ElementTangent>) -> Vec<ElementTangent> {
        let elements = tangents.into_iter().zip(&self.entries);
        elements.map(|(tangent, entries)| tangent.with_change(mean_at(entries, &self.changes))).collect()
    }

    /// Adds the products with displacements (m) of the nodes, N.
    fn add(&self, tangents: &[ElementTangent], at: impl Fn(usize) -> DVec3, out: &mut [DVec3]) {
        let mut changes = vec![0.0; self.changes.len()];
        for (tangent, entries) in tangents.iter().zip(&self.entries) {
            let change = tangent.quarter() * tangent.change_by(tangent.nodes.map(&at));
            for &entry in entries {
                changes[entry] += change / self.volumes[entry];
            }
        }
        for (tangent, entries) in tangents.iter().zip(&self.entries) {
            add_to_nodes(tangent, tangent.forces_of_change(mean_at(entries, &changes)), out);
        }
    }
}

/// The mean of four entries.
fn mean_at(entries: &[usize; 4], values: &[f64]) -> f64 {
    0.25 * entries.iter().map(|&entry| values[entry]).sum::<f64>()
}

fn add_to_nodes(tangent: &ElementTangent, forces: [DVec3; 4], out: &mut [DVec3]) {
    for (&node, force) in tangent.nodes.iter().zip(forces) {
        out[node] += force;
    }
}

/// Tangents of the patches of nodal strain and of its stabilising energy ([`crate::element`]).
struct PatchTangents {
    patches: Vec<LawTangent>,
    /// `s mu`, Pa, of each element.
    moduli: Vec<f64>,
    /// Of crushed elements their own energy, with the index of the element.
    crushed: Vec<(usize, LawTangent)>,
}

impl PatchTangents {
    fn new<M: Material>(scene: SceneView<'_, M>, tangents: &[ElementTangent], displacement: &[NodeVector]) -> Self {
        let laws = scene.material.laws();
        let at = |node: usize| DVec3::from_array(displacement[node].to_array().map(f64::from));
        let patches = scene.patches.places().map(|(tile, lane)| {
            let h = tile.gradient(scene.patches.neighbours_of(tile), lane, at);
            let place = [place_in(scene.patches.tiles(), tile), lane];
            let fibres = scene.fibrous().map(|of| of.tangent(place, tile.element(lane), h));
            LawTangent::new(&laws.of(tile.element(lane)), h, fibres)
        });
        let moduli = scene.places().map(|(tile, lane)| stabilising_modulus(&laws.of(tile.element(lane))));
        let crushed =
            tangents.iter().zip(scene.places()).enumerate().filter_map(|(element, (tangent, (tile, lane)))| {
                Some((element, tangent.at.of_barrier(&laws.of(tile.element(lane)))?))
            });
        Self { patches: patches.collect(), moduli: moduli.collect(), crushed: crushed.collect() }
    }

    /// Adds the products with displacements (m) of the nodes, N.
    fn add<M: Material>(
        &self,
        scene: SceneView<'_, M>,
        tangents: &[ElementTangent],
        at: impl Fn(usize) -> DVec3 + Copy,
        out: &mut [DVec3],
    ) {
        let laws = scene.material.laws();
        for ((tile, lane), tangent) in scene.patches.places().zip(&self.patches) {
            let neighbours = scene.patches.neighbours_of(tile);
            let change = tile.gradient(neighbours, lane, at);
            let modulus = stabilising_modulus(&laws.of(tile.element(lane)));
            let stress = tangent.stress_by(change) - change * modulus;
            tile.each_gradient(neighbours, lane, |node, gradient| out[node] += stress * gradient);
        }
        for (tangent, modulus) in tangents.iter().zip(&self.moduli) {
            let stress = tangent.gradient_by(tangent.nodes.map(at)) * *modulus;
            add_to_nodes(tangent, tangent.forces_of_stress(stress), out);
        }
        for (element, barrier) in &self.crushed {
            let tangent = &tangents[*element];
            let stress = barrier.stress_by(tangent.gradient_by(tangent.nodes.map(at)));
            add_to_nodes(tangent, tangent.forces_of_stress(stress), out);
        }
    }
}

/// A fixed vector with a share of every mode.
fn start_vector(roots: &[DVec3]) -> Vec<DVec3> {
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed as f64 / u64::MAX as f64 - 0.5
    };
    roots
        .iter()
        .map(|root| {
            let random = DVec3::new(next(), next(), next());
            DVec3::select(root.cmpgt(DVec3::ZERO), random, DVec3::ZERO)
        })
        .collect()
}

fn inner(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn largest_eigenvalue(start: Vec<DVec3>, product: impl Fn(&[DVec3]) -> Vec<DVec3>) -> Option<f64> {
    let (mut diagonal, mut off_diagonal) = (Vec::new(), Vec::new());
    let norm = inner(&start, &start).sqrt();
    let mut current: Vec<DVec3> = start.iter().map(|v| *v / norm).collect();
    let mut previous = vec![DVec3::ZERO; start.len()];
    let mut coupling = 0.0;
    let mut settled = f64::NAN;
    for iteration in 1..=MOST_ITERATIONS {
        let mut next = product(&current);
        let along = inner(&next, &current);
        for ((next, current), previous) in next.iter_mut().zip(&current).zip(&previous) {
            *next -= *current * along + *previous * coupling;
        }
        diagonal.push(along);
        coupling = inner(&next, &next).sqrt();
        let exhausted = coupling <= 1e-12 * along.abs();
        if iteration % CHECK == 0 || exhausted {
            let value = largest_of_tridiagonal(&diagonal, &off_diagonal);
            if exhausted || (value - settled).abs() <= TOLERANCE * value.abs() {
                return Some(value);
            }
            settled = value;
        }
        if !coupling.is_finite() {
            return None;
        }
        off_diagonal.push(coupling);
        previous = current;
        current = next.into_iter().map(|v| v / coupling).collect();
    }
    None
}

/// Bisection on the number of eigenvalues above a value (Sturm sequence).
fn largest_of_tridiagonal(diagonal: &[f64], off_diagonal: &[f64]) -> f64 {
    let reach = |i: usize| {
        let left = if i > 0 { off_diagonal[i - 1].abs() } else { 0.0 };
        let right = if i + 1 < diagonal.len() { off_diagonal[i].abs() } else { 0.0 };
        left + right
    };
    let mut high = (0..diagonal.len()).map(|i| diagonal[i] + reach(i)).fold(f64::NEG_INFINITY, f64::max);
    let mut low = diagonal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        let mut pivot = 1.0;
        let above = (0..diagonal.len()).any(|i| {
            let square = if i > 0 { off_diagonal[i - 1] * off_diagonal[i - 1] } else { 0.0 };
            pivot = diagonal[i] - middle - square / pivot;
            if pivot == 0.0 {
                pivot = f64::MIN_POSITIVE;
            }
            pivot > 0.0
        });
        if above {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
