//! The lattice's matrices from the sums of its cells, compared with direct sums.

use super::assembly::{Assembly, CellMatrices, CoarseInertia, ElementTangent, NO_SLOTS};
use super::dense::stride;
use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS, sort_by_cell};
use crate::element::NodeInertia;
use crate::element::symmetric::Symmetric;
use crate::mesh::Bar;
use crate::simd::{Baseline, NodeVector};

const BAR: Bar = Bar { size: [0.06, 0.05, 0.09], cells: [5, 4, 7] };

/// Random values from -0.5 to 0.5.
fn random() -> impl FnMut() -> f32 {
    let mut state = 1u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0 - 0.5
    }
}

/// An irregular bar, one end held, one node held along one axis.
fn scene() -> (Lattice, Vec<LatticeNode>, Vec<NodeInertia>) {
    let mut random = random();
    let points: Vec<[f32; 3]> =
        BAR.points().map(|point| point.map(|along| along + 0.004 * random())).collect();
    let mut inertia: Vec<_> = points.iter().map(|_| NodeInertia { inverse: [1e3; 3], mass: 1e-3 }).collect();
    inertia[..30].fill(NodeInertia { inverse: [0.0; 3], mass: 1e-3 });
    inertia[100].inverse[1] = 0.0;
    let lattice = Lattice::new([2, 2, 3], &points, &inertia).unwrap();
    let mut places: Vec<_> = points.iter().map(|&point| lattice.place(point)).collect();
    sort_by_cell(&mut places);
    (lattice, places, inertia)
}

fn worst(a: &[f32], b: &[f32], stride: usize) -> f32 {
    let (mut worst, mut largest) = (0.0f32, 0.0f32);
    for (at, (a, b)) in a.iter().zip(b).enumerate() {
        // Only submatrices on and below the diagonal are written.
        if at % stride / 3 <= at / stride / 3 {
            worst = worst.max((a - b).abs());
            largest = largest.max(b.abs());
        }
    }
    worst / largest
}

#[test]
fn stiffness_from_sums_of_the_cells_is_that_from_single_elements() {
    let (lattice, places, inertia) = scene();
    let stride = stride(lattice.functions());
    let empty = vec![0.0; 3 * lattice.functions() * stride];
    let (mut by_cells, mut direct) = (empty.clone(), empty);
    let mut sums = vec![CellMatrices::NONE; lattice.cell_count()];
    let mut no_sums = Vec::new();
    let mut random = random();
    let (mut in_one, mut in_two, mut in_more) = (0, 0, 0);
    for tet in BAR.tets() {
        let mut gradients = [[0.0; 3]; 4];
        for corner in 1..4 {
            gradients[corner] = [0; 3].map(|_| 200.0 * random());
            for axis in 0..3 {
                gradients[0][axis] -= gradients[corner][axis];
            }
        }
        let cofactor = [0, 1, 2].map(|j| {
            let mut column = [random(), random(), random(), 0.0];
            column[j] += 1.0;
            column
        });
        let (nodes, iso, volume) = (tet.map(|node| node as usize), 1.0 + random(), 20.0 + random());
        let element = ElementTangent { nodes, gradients, iso, volume, cofactor };
        let matrix = &mut direct;
        let (lattice, nodes, inertia) = (&lattice, &places, &inertia);
        Assembly { lattice, nodes, inertia, matrix, stride, sums: &mut no_sums }
            .add_element(&element, &mut NO_SLOTS.clone());
        let matrix = &mut by_cells;
        let mut assembly = Assembly { lattice, nodes, inertia, matrix, stride, sums: &mut sums };
        let across = assembly.cells_of(&element.nodes).map(|cells| cells.across.is_some());
        if !assembly.add_in_cells::<Baseline>(&element) {
            assembly.add_element(&element, &mut NO_SLOTS.clone());
        }
        match across {
            Some(false) => in_one += 1,
            Some(true) => in_two += 1,
            None => in_more += 1,
        }
    }
    let (nodes, matrix) = (&places, &mut by_cells);
    let mut assembly =
        Assembly { lattice: &lattice, nodes, inertia: &inertia, matrix, stride, sums: &mut sums };
    (0..lattice.cell_count()).for_each(|cell| assembly.add_cell(cell));
    let worst = worst(&by_cells, &direct, stride);
    println!("{in_one} elements in one cell, {in_two} in two, {in_more} in more: relative error {worst:.1e}");
    assert!(in_one > 100 && in_two > 100 && in_more > 100);
    assert!(worst < 2e-6);
}

#[test]
fn inertia_from_sums_of_the_cells_is_that_from_single_nodes() {
    let (lattice, places, _) = scene();
    let stride = stride(lattice.functions());
    let empty = vec![0.0; 3 * lattice.functions() * stride];
    let (mut inertia, mut mass) = (empty.clone(), empty.clone());
    let (mut direct_inertia, mut direct_mass) = (empty.clone(), empty);
    let mut sums = vec![CellMatrices::NONE; lattice.cell_count()];
    let mut random = random();
    for place in &places {
        let [xx, yy, zz, xy, yz, zx] = [3.0, 3.0, 3.0, 0.0, 0.0, 0.0].map(|mean: f32| mean + random());
        let masses = [1.0, 1.0, 0.0];
        sums[place.cell()].add_node::<Baseline>(
            place,
            &Symmetric { xx, yy, zz, xy, yz, zx },
            masses,
            [1.0, 2.0, 3.0],
        );
        let rows = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
        let weights = lattice.weights(place).map(|(function, weight)| (function, f64::from(weight)));
        let kept_weights = || weights.iter().filter(|(function, _)| *function < lattice.functions());
        for &(c, by) in kept_weights() {
            for &(d, with) in kept_weights() {
                for i in 0..3 {
                    let row = (3 * c + i) * stride + 3 * d;
                    direct_mass[row + i] += (by * with) as f32 * masses[i];
                    for j in 0..3 {
                        direct_inertia[row + j] += (by * with) as f32 * rows[i][j];
                    }
                }
            }
        }
    }
    let mut momenta = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    let mut into = CoarseInertia {
        lattice: &lattice,
        inertia: &mut inertia,
        mass: &mut mass,
        mass_only: &mut [],
        momenta: &mut momenta,
        stride,
    };
    sums.iter_mut().enumerate().for_each(|(cell, sums)| into.add_cell(cell, sums));
    for (function, momentum) in momenta.iter().enumerate().take(lattice.functions()) {
        let weights = places.iter().flat_map(|place| lattice.weights(place));
        let sum: f64 = weights.filter(|(of, _)| *of == function).map(|(_, weight)| f64::from(weight)).sum();
        for (axis, component) in momentum.to_array().into_iter().enumerate() {
            assert!((f64::from(component) / (sum * (axis + 1) as f64) - 1.0).abs() < 2e-6);
        }
    }
    let errors = [worst(&inertia, &direct_inertia, stride), worst(&mass, &direct_mass, stride)];
    println!("relative error of the inertia {:.1e}, of the mass {:.1e}", errors[0], errors[1]);
    assert!(errors.iter().all(|error| *error < 2e-6));
}
