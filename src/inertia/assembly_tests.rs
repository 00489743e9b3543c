//! The lattice's matrices, compared with direct sums.

use super::assembly::{Assembly, BATCH, ElementTangent, Tangent};
use super::cell_boxes::locate;
use super::dense::{row_length, stride};
use super::direct_assembly::NO_SLOTS;
use super::lattice::{Lattice, LatticeNode, sort_by_cell};
use super::nodal_sums::{FunctionInertia, add_inertia, add_mass, times, write_mass};
use super::projected_inertia::{CellSums, add_cell};
use crate::element::NodeInertia;
use crate::element::symmetric::Symmetric;
use crate::mesh::Bar;
use crate::simd::Baseline;

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
    let points: Vec<[f32; 3]> = BAR.points().map(|point| point.map(|along| along + 0.004 * random())).collect();
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
fn stiffness_from_boxes_is_that_from_single_elements() {
    let (lattice, places, inertia) = scene();
    let stride = stride(lattice.functions());
    let empty = vec![0.0; 3 * lattice.functions() * stride];
    let (mut by_boxes, mut direct) = (empty.clone(), empty);
    let mut elements = Vec::new();
    let mut random = random();
    let mut counts = [0; 4];
    for tet in BAR.tets() {
        let mut gradients = [[0.0; 3]; 4];
        for corner in 1..4 {
            gradients[corner] = [0; 3].map(|_| 200.0 * random());
            for axis in 0..3 {
                gradients[0][axis] -= gradients[corner][axis];
            }
        }
        let columns = [0, 1, 2].map(|j| {
            let mut column = [random(), random(), random(), 0.0];
            column[j] += 1.0;
            column
        });
        let nodes = tet.map(|node| node as usize);
        let factors = [1.0 + random(), 20.0 + random(), 5.0 + random(), if random() > 0.0 { 1.0 } else { 0.0 }];
        let tangent = Tangent { columns, factors };
        let element = ElementTangent { nodes, gradients, tangent };
        let matrix = &mut direct;
        let mut assembly = Assembly { lattice: &lattice, nodes: &places, inertia: &inertia, matrix, stride };
        assembly.add_element(&element, &mut NO_SLOTS.clone());
        let cells = locate(&lattice, &places, &inertia, &element.nodes).map(|(cells, _)| cells.cells.iter().product());
        counts[cells.map_or(3, |cells: u8| cells.ilog2().min(2) as usize)] += 1;
        elements.push(element);
    }
    for batch in elements.chunks(BATCH) {
        let matrix = &mut by_boxes;
        Assembly { lattice: &lattice, nodes: &places, inertia: &inertia, matrix, stride }.add(batch);
    }
    let worst = worst(&by_boxes, &direct, stride);
    let [one, two, more, single] = counts;
    println!("{one} elements in one cell, {two} in two, {more} in more, {single} single: relative error {worst:.1e}");
    assert!(one > 100 && two > 100 && more > 100 && single > 10);
    assert!(worst < 2e-6);
}

#[test]
fn bounds_of_the_functions_inertia_are_above_the_projected_inertia() {
    let (lattice, places, _) = scene();
    let functions = lattice.functions();
    let mut sums = vec![FunctionInertia::default(); functions];
    let mut random = random();
    let inertia: Vec<_> = places
        .iter()
        .map(|place| {
            let [a, b, c] = [random(), random(), random()];
            let matrix =
                Symmetric { xx: 0.1 + a * a, yy: 0.1 + b * b, zz: 0.1 + c * c, xy: a * b, yz: b * c, zx: c * a };
            add_inertia(&mut sums, &lattice, place, &matrix);
            matrix
        })
        .collect();
    let form = |matrix: &Symmetric, v: [f32; 3]| {
        let [x, y, z] = matrix.times(v);
        x * v[0] + y * v[1] + z * v[2]
    };
    let mut largest: f32 = 0.0;
    for _ in 0..200 {
        let x: Vec<[f32; 3]> = (0..functions).map(|_| [random(), random(), random()]).collect();
        let bound: f32 = sums
            .iter()
            .zip(&x)
            .map(|(sums, &x)| {
                let [a, b, c] = times(sums, x);
                a * x[0] + b * x[1] + c * x[2]
            })
            .sum();
        let projected: f32 = places
            .iter()
            .zip(&inertia)
            .map(|(place, inertia)| {
                let mut v = [0.0; 3];
                for (function, weight) in lattice.weights(place) {
                    if let Some(x) = x.get(function) {
                        v = [0, 1, 2].map(|i| v[i] + weight * x[i]);
                    }
                }
                form(inertia, v)
            })
            .sum();
        largest = largest.max(projected / bound);
    }
    println!("projected inertia at most {largest:.3} of the bound");
    assert!(largest < 1.0 && largest > 0.1);
}

#[test]
fn the_mass_of_a_lattice_is_that_of_its_free_nodes() {
    let (lattice, places, inertia) = scene();
    let functions = lattice.functions();
    let size = functions * row_length(functions);
    let mut masses = vec![0.0; 3 * size];
    write_mass(&mut masses, &lattice, &places, &inertia);
    for (axis, mass) in masses.chunks_exact(size).enumerate() {
        let sum: f32 = mass.iter().sum();
        // Functions of held points are left out, so the nodes next to the support count in part.
        let total = |place: &LatticeNode| {
            let kept = lattice.weights(place).into_iter().filter(|(function, _)| *function < functions);
            let weight: f32 = kept.map(|(_, weight)| weight).sum();
            let node = &inertia[place.node()];
            if node.inverse[axis] > 0.0 { weight * weight * node.mass } else { 0.0 }
        };
        let expected: f32 = places.iter().map(total).sum();
        println!("axis {axis}: {sum:.6} kg of {expected:.6}");
        assert!((sum - expected).abs() < 1e-5 * expected);
    }
    let stride = stride(functions);
    let mut whole = vec![0.0; 3 * functions * stride];
    add_mass(&mut whole, stride, &masses, functions, 2.0);
    let at = |c: usize, d: usize, axis: usize| whole[(3 * c + axis) * stride + 3 * d + axis];
    assert_eq!(at(5, 4, 1), 2.0 * masses[size + 5 * row_length(functions) + 4]);
    assert_eq!(at(4, 5, 1), 0.0);
}

#[test]
fn projected_inertia_from_sums_of_the_cells_is_that_from_single_nodes() {
    let (lattice, places, _) = scene();
    let stride = stride(lattice.functions());
    let empty = vec![0.0; 3 * lattice.functions() * stride];
    let (mut inertia, mut direct) = (empty.clone(), empty);
    let mut sums = vec![CellSums::NONE; lattice.cell_count()];
    let mut random = random();
    for place in &places {
        let [xx, yy, zz, xy, yz, zx] = [3.0, 3.0, 3.0, 0.0, 0.0, 0.0].map(|mean: f32| mean + random());
        sums[place.cell()].add_node::<Baseline>(place, &Symmetric { xx, yy, zz, xy, yz, zx });
        let rows = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
        let kept = || lattice.weights(place).into_iter().filter(|(function, _)| *function < lattice.functions());
        for (c, by) in kept() {
            for (d, with) in kept() {
                for (i, entries) in rows.iter().enumerate() {
                    for (j, entry) in entries.iter().enumerate() {
                        direct[(3 * c + i) * stride + 3 * d + j] += by * with * entry;
                    }
                }
            }
        }
    }
    for (cell, sums) in sums.iter_mut().enumerate() {
        add_cell(&mut inertia, stride, lattice.functions_of(cell), sums);
    }
    let worst = worst(&inertia, &direct, stride);
    println!("relative error {worst:.1e}");
    assert!(worst < 2e-6);
}
