//! Factors and solutions of matrices of lattices, against dense ones in float64.

use std::vec::Vec;
use std::{println, vec};

use crate::reference::Random;
use crate::reference::dense::{Matrix, cholesky, zeros};

use super::band::{Band, Row, factorise, solve};
use super::lattice::Lattice;
use super::layout::Layout;
use crate::element::NodeInertia;
use crate::mesh::Bar;

/// The lattice of a bar of which a part is held.
fn lattice(cells: [u32; 3]) -> Lattice {
    let bar = Bar { size: [0.03, 0.04, 0.06], cells: cells.map(|count| 2 * count) };
    let points: Vec<_> = bar.points().collect();
    let held = |point: &[f32; 3]| if point[2] < 0.025 { [0.0; 3] } else { [1e3; 3] };
    let inertia: Vec<_> = points.iter().map(|point| NodeInertia { inverse: held(point), mass: 1e-3 }).collect();
    Lattice::new(cells, &Layout::one(&points), &inertia).unwrap()
}

/// A random positive matrix that couples what cells couple.
fn coupled(lattice: &Lattice, unknowns: usize, random: &mut Random) -> Matrix {
    let functions = lattice.functions();
    let mut matrix = zeros(unknowns * functions);
    for cell in 0..lattice.cell_count() {
        let of_cell = lattice.functions_of(cell).into_iter().filter(|function| *function < functions);
        let rows: Vec<_> = of_cell.flat_map(|function| (0..unknowns).map(move |at| unknowns * function + at)).collect();
        for _ in 0..3 * rows.len() {
            let vector: Vec<f64> = rows.iter().map(|_| random.next()).collect();
            for (a, row) in vector.iter().zip(&rows) {
                for (b, column) in vector.iter().zip(&rows) {
                    matrix[*row][*column] += a * b;
                }
            }
        }
    }
    matrix
}

/// In the memory of a band.
fn banded(band: &Band, matrix: &Matrix) -> Vec<f32> {
    let mut memory = vec![7.0; band.floats()];
    band.clear(&mut memory);
    for (row, entries) in matrix.iter().enumerate() {
        for (column, entry) in entries.iter().enumerate().take(row + 1).filter(|(_, entry)| **entry != 0.0) {
            memory[band.at(row, column)] = *entry as f32;
        }
    }
    memory
}

fn solved(matrix: &Matrix, right: &[f64]) -> Vec<f64> {
    let l = cholesky(matrix).unwrap();
    let mut x = right.to_vec();
    for row in 0..x.len() {
        let sum: f64 = (0..row).map(|k| l[row][k] * x[k]).sum();
        x[row] = (x[row] - sum) / l[row][row];
    }
    for row in (0..x.len()).rev() {
        let sum: f64 = (row + 1..x.len()).map(|k| l[k][row] * x[k]).sum();
        x[row] = (x[row] - sum) / l[row][row];
    }
    x
}

/// Lattices long and cubic, of one cell and of many.
const LATTICES: [[u32; 3]; 5] = [[1, 1, 1], [1, 1, 6], [2, 3, 4], [5, 2, 2], [4, 4, 4]];

#[test]
fn a_factor_solves_as_a_dense_one_in_float64() {
    let mut random = Random(4);
    for (cells, unknowns) in LATTICES.into_iter().flat_map(|cells| [(cells, 1), (cells, 3)]) {
        let lattice = lattice(cells);
        let band = Band::new(&lattice, unknowns);
        assert!(band.floats() <= Band::most_floats(cells, lattice.functions(), unknowns));
        assert!(band.scratch_floats() <= Band::most_scratch_floats(lattice.functions()));
        let matrix = coupled(&lattice, unknowns, &mut random);
        let (mut factor, mut scratch) = (banded(&band, &matrix), vec![f32::NAN; band.scratch_floats()]);
        assert!(factorise(&band, &mut factor, &mut scratch));
        let right = [(); 2].map(|()| matrix.iter().map(|_| random.next()).collect::<Vec<_>>());
        let mut rows: [Row; 2] = [[0.0; _]; 2];
        for (row, right) in rows.iter_mut().zip(&right) {
            row.iter_mut().zip(right).for_each(|(x, right)| *x = *right as f32);
        }
        let [first, second] = &mut rows;
        solve(&band, &factor, &mut [first, second]);
        let mut worst = 0.0_f64;
        for (row, right) in rows.iter().zip(&right) {
            let exact = solved(&matrix, right);
            let largest = exact.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let apart = exact.iter().zip(row).map(|(exact, x)| (exact - f64::from(*x)).abs());
            worst = worst.max(apart.fold(0.0, f64::max) / largest);
            assert!(row[exact.len()..].iter().all(|x| *x == 0.0));
        }
        println!("{cells:?}, {} unknowns, {} floats: {worst:.1e} apart", matrix.len(), band.floats());
        assert!(worst < 1e-4);
    }
}

#[test]
fn a_matrix_that_is_not_positive_definite_has_no_factor() {
    let mut random = Random(6);
    let lattice = lattice([2, 2, 4]);
    let band = Band::new(&lattice, 3);
    let matrix = coupled(&lattice, 3, &mut random);
    let size = matrix.len();
    let factors = |matrix: &Matrix| factorise(&band, &mut banded(&band, matrix), &mut vec![0.0; band.scratch_floats()]);
    assert!(factors(&matrix));
    for at in [0, size / 2, size - 1] {
        for wrong in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            let mut spoilt = matrix.clone();
            spoilt[at][at] = wrong;
            assert!(!factors(&spoilt), "{wrong} at {at}");
        }
        // Positive on the diagonal, and indefinite.
        let mut indefinite = matrix.clone();
        indefinite[at][at] *= 1e-3;
        assert!(cholesky(&indefinite).is_none() && !factors(&indefinite), "{at}");
    }
}
