//! The coarse stiffness (kg, with the factor `s_c D^2 / 4`) from the tangents of a body and the moments of its clusters
//! (`clusters.rs`): with the images `f = F^-T` of material gradients, and the factors `alpha`, `beta`, `gamma` of a
//! tangent ([`crate::element::Tangent`], `src/element/stiffness_bound.rs`),
//!
//! ```text
//! T[iI,jJ]   = V_cl / V_sampled sum_sampled (alpha (f^T f)_IJ d_ij + beta f_iI f_jJ + gamma f_jI f_iJ)
//! Kc[ci,dj]  = sum_clusters sum_IJ T[iI,jJ] Q[c,d,I,J]
//! ```
//! That is `W^T K W` for the bounds of the tangents where they are the same in a whole cluster, and zero for rotations
//! of tissue without tension. Crushed pieces have `d_IJ` in place of `f^T f`, and `C` in place of `F^-T`.

use glam::Vec4;

use super::band::Band;
use super::clusters::{Cluster, Clusters, PAIRS, PairMatrices, clusters_of, for_each_pair};
use super::lattice::Lattice;
use crate::element::Tangent;
use crate::simd::{Kernel, Real, dispatch};

/// Entries of a lower triangle of nine rows, in whole vectors of four: `Vec4` number [`FIRST`]`[row] + column / 4`.
const QUARTERS: usize = 18;
/// The first vector of each row.
const FIRST: [usize; 9] = [0, 1, 2, 3, 4, 6, 8, 10, 12];

/// `T` of a cluster, entry `9 (3 i + I) + 3 j + J`.
pub(super) type ClusterTangent = [f32; 81];

/// Sums over the pieces of a cluster.
#[derive(Clone, Copy)]
struct Sums {
    /// `beta f f^T` and `gamma f f^T`, with `f` as a vector of nine, entry `3 I + i`.
    outer: [Vec4; QUARTERS],
    exchanged: [Vec4; QUARTERS],
    /// `alpha f^T f`.
    inner: [f32; 6],
}

impl Sums {
    const NONE: Self = Self { outer: [Vec4::ZERO; QUARTERS], exchanged: [Vec4::ZERO; QUARTERS], inner: [0.0; 6] };

    #[inline(always)]
    fn add(&mut self, tangent: &Tangent) {
        let [x, y, z] = tangent.columns.map(|[x, y, z, _]| [x, y, z]);
        let f = [x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]];
        let vectors =
            [Vec4::new(x[0], x[1], x[2], y[0]), Vec4::new(y[1], y[2], z[0], z[1]), Vec4::new(z[2], 0.0, 0.0, 0.0)];
        let [inner, outer, exchanged, is_spatial] = tangent.factors;
        for (row, (first, value)) in FIRST.into_iter().zip(f).enumerate() {
            let (a, b) = (outer * value, exchanged * value);
            let outer = self.outer.get_mut(first..).unwrap_or_default();
            let exchanged = self.exchanged.get_mut(first..).unwrap_or_default();
            for ((outer, exchanged), vector) in outer.iter_mut().zip(exchanged).zip(vectors).take(row / 4 + 1) {
                *outer += a * vector;
                *exchanged += b * vector;
            }
        }
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let products = if is_spatial > 0.0 {
            [dot(x, x), dot(y, x), dot(y, y), dot(z, x), dot(z, y), dot(z, z)]
        } else {
            [1.0, 0.0, 1.0, 0.0, 0.0, 1.0]
        };
        for (sum, product) in self.inner.iter_mut().zip(products) {
            *sum += inner * product;
        }
    }

    /// `T`, with a factor.
    fn tangent(&self, factor: f32) -> ClusterTangent {
        let of = |sums: &[Vec4; QUARTERS], a: usize, b: usize| {
            let (row, column) = (a.max(b), a.min(b));
            let first = FIRST.get(row).copied().unwrap_or_default();
            sums.get(first + column / 4).map_or(0.0, |vector| vector.to_array()[column % 4])
        };
        let mut tangent = [0.0; 81];
        for (large_i, large_j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let (row, column) = (large_i.max(large_j), large_i.min(large_j));
            let inner = self.inner.get(row * (row + 1) / 2 + column).copied().unwrap_or_default();
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let outer = of(&self.outer, 3 * large_i + i, 3 * large_j + j);
                let exchanged = of(&self.exchanged, 3 * large_i + j, 3 * large_j + i);
                let whole = outer + exchanged + if i == j { inner } else { 0.0 };
                if let Some(entry) = tangent.get_mut(9 * (3 * i + large_i) + 3 * j + large_j) {
                    *entry = factor * whole;
                }
            }
        }
        tangent
    }
}

/// `T` of a cluster, from the tangents of the sampled pieces.
pub(super) fn tangent_of(cluster: &Cluster, members: &[u32], tangents: &[Tangent]) -> ClusterTangent {
    let mut sums = Sums::NONE;
    for &member in members.get(cluster.members()).unwrap_or_default() {
        if let Some(tangent) = tangents.get(member as usize) {
            sums.add(tangent);
        }
    }
    sums.tangent(cluster.factor())
}

/// Adds the tangent of one more piece of a cluster.
pub(super) fn add_tangent(sum: &mut ClusterTangent, tangent: &Tangent) {
    let mut sums = Sums::NONE;
    sums.add(tangent);
    sum.iter_mut().zip(sums.tangent(1.0)).for_each(|(sum, value)| *sum += value);
}

/// Writes the matrices of a cell, from the tangents and moments of the clusters.
pub(super) fn write_cell(
    clusters: &Clusters<'_>,
    tangents: &[ClusterTangent],
    cell: usize,
    matrices: &mut PairMatrices,
) {
    *matrices = PairMatrices::ZERO;
    let head = clusters.heads.get(cell).copied().unwrap_or_default();
    for (index, cluster) in clusters_of(clusters.all, head) {
        let moments = clusters.moments.get(cluster.sets()).unwrap_or_default();
        if let Some(tangent) = tangents.get(index) {
            dispatch(Contract { tangent, cluster, moments, matrices });
        }
    }
}

/// Adds `sum_IJ T[iI,jJ] Q[c,d,I,J]` for all pairs.
struct Contract<'a> {
    tangent: &'a ClusterTangent,
    cluster: &'a Cluster,
    /// One set, or one for each pair of gradients.
    moments: &'a [PairMatrices],
    matrices: &'a mut PairMatrices,
}

impl Kernel for Contract<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { tangent, cluster, moments, matrices } = self;
        match moments {
            [] => {}
            [one] => contract::<R::Width8>(tangent, one, matrices, 0..9),
            each => {
                let (numbers, count) = (cluster.gradients(), cluster.gradient_count());
                for entry in 0..9 {
                    if let Some(moments) = each.get(numbers[entry / 3] * count + numbers[entry % 3]) {
                        contract::<R::Width8>(tangent, moments, matrices, entry..entry + 1);
                    }
                }
            }
        }
    }
}

/// Vectors of eight pairs.
const VECTORS: usize = PAIRS.div_ceil(8);

#[inline(always)]
fn contract<R: Real>(
    tangent: &ClusterTangent,
    PairMatrices(moments): &PairMatrices,
    PairMatrices(matrices): &mut PairMatrices,
    entries: core::ops::Range<usize>,
) {
    for entry in entries {
        let (i, j) = (entry / 3 % 3, entry % 3);
        let mut sums = [R::splat(0.0); VECTORS];
        for (sum, matrices) in sums.iter_mut().zip(&*matrices) {
            *sum = R::from_fn(|lane| matrices[entry % 9][lane % 8]);
        }
        for large in 0..9 {
            let factor = R::splat(tangent[9 * (3 * i + large / 3) + 3 * j + large % 3]);
            for (sum, moments) in sums.iter_mut().zip(moments) {
                *sum = factor.fused(R::from_fn(|lane| moments[large][lane % 8]), *sum);
            }
        }
        for (sum, matrices) in sums.iter().zip(&mut *matrices) {
            for (lane, value) in matrices[entry % 9].iter_mut().enumerate() {
                *value = sum.lane(lane);
            }
        }
    }
}

/// A symmetric matrix of the eight functions of a cell for each axis, the fourth component unused.
pub(super) type AxisMatrices = [[f32; 4]; PAIRS];

/// Adds a cell's matrices to the lower triangle of the matrix of all unknowns, three for each function. `more` are
/// matrices for each axis.
pub(super) fn add_cell(
    band: &Band,
    sum: &mut [f32],
    matrices: &PairMatrices,
    more: &AxisMatrices,
    lattice: &Lattice,
    cell: usize,
) {
    let numbers = lattice.functions_of(cell);
    for_each_pair(|pair, c, d| {
        let (first, second) = (numbers[c], numbers[d]);
        if !lattice.moves(first) || !lattice.moves(second) {
            return;
        }
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = matrices.of_pair(pair);
        let [x, y, z, _] = more[pair % PAIRS];
        let rows = [[xx + x, xy, xz], [yx, yy + y, yz], [zx, zy, zz + z]];
        if lattice.is_light(first) || lattice.is_light(second) {
            lattice.each_function(first, |a, weight| {
                lattice.each_function(second, |b, other| {
                    if c == d && b > a {
                        return;
                    }
                    add_pair(band, sum, [a, b], rows.map(|row| row.map(|value| weight * other * value)));
                    // What the two in turn add, which is the transpose, where both meet on the diagonal.
                    if a == b && c != d {
                        let columns = [0, 1, 2].map(|i| [0, 1, 2].map(|j| weight * other * rows[j][i]));
                        add_pair(band, sum, [a, b], columns);
                    }
                });
            });
        } else {
            add_pair(band, sum, [first, second], rows);
        }
    });
}

/// Adds the matrix of two functions, or its transpose below the diagonal.
#[inline(always)]
fn add_pair(band: &Band, sum: &mut [f32], [first, second]: [usize; 2], rows: [[f32; 3]; 3]) {
    let (high, low) = (first.max(second), first.min(second));
    for axis in 0..3 {
        let row = if first >= second { rows[axis] } else { [rows[0][axis], rows[1][axis], rows[2][axis]] };
        let at = band.at(3 * high + axis, 3 * low);
        let entries = if high == low { axis + 1 } else { 3 };
        let places = sum.get_mut(at..at + entries).unwrap_or_default();
        places.iter_mut().zip(row).for_each(|(place, value)| *place += value);
    }
}
