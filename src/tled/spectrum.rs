//! The exact critical step `2 / omega_max`: the largest eigenvalue of `M^-1/2 K(u) M^-1/2` in float64 by
//! the Lanczos iteration (a power iteration that keeps what it has seen; plain power iteration needs
//! thousands of products where the upper spectrum is dense, as in a regular mesh). For tools and tests: it
//! allocates and takes hundreds of products with the tangent, `dP = p1 dF + dp1 F + dpJ C + pJ dC`.

use std::vec;
use std::vec::Vec;

use glam::{DMat3, DVec3};

use crate::element::ElementTile;
use crate::material::{Invariants, Law, Material, Potential, VolumeFactor};
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
    let tangents: Vec<Tangent> = scene
        .places()
        .map(|(tile, lane)| {
            Tangent::new(&scene.material.laws().of(tile.element(lane)), tile, lane, displacement)
        })
        .collect();
    let roots: Vec<DVec3> = scene
        .inertia
        .iter()
        .map(|inertia| DVec3::from_array(inertia.inverse.map(|inverse| f64::from(inverse).sqrt())))
        .collect();
    let product = |vector: &[DVec3]| {
        let mut out = vec![DVec3::ZERO; vector.len()];
        for tangent in &tangents {
            tangent.add_product(&roots, vector, &mut out);
        }
        for (sum, root) in out.iter_mut().zip(&roots) {
            *sum *= *root;
        }
        out
    };
    let largest = largest_eigenvalue(start_vector(&roots), product)?;
    Some(if largest > 0.0 { 2.0 / largest.sqrt() } else { f64::INFINITY })
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

/// Tangent of one element.
struct Tangent {
    nodes: [usize; 4],
    gradients: [DVec3; 4],
    volume: f64,
    f: DMat3,
    cofactor: DMat3,
    /// `p1`, `pJ`, `W''`, `2 W' g'`, `U'' + W' g'' I1`.
    p1: f64,
    p_j: f64,
    stiffening: f64,
    coupling: f64,
    bulk: f64,
    /// `dx/dF = x_f F + x_c C`.
    x_f: f64,
    x_c: f64,
}

impl Tangent {
    fn new<L: Law>(law: &L, tile: &ElementTile, lane: usize, displacement: &[NodeVector]) -> Self {
        let nodes = [0, 1, 2, 3].map(|corner| tile.node(corner, lane));
        let slopes = [0, 1, 2].map(|corner| {
            DVec3::from_array([0, 1, 2].map(|axis| f64::from(tile.gradient::<f32>(corner, axis, lane))))
        });
        let gradients = [-(slopes[0] + slopes[1] + slopes[2]), slopes[0], slopes[1], slopes[2]];
        let mut h = DMat3::ZERO;
        for (&node, gradient) in nodes.iter().zip(gradients) {
            let [x, y, z] = displacement[node].to_array().map(f64::from);
            h += outer(DVec3::new(x, y, z), gradient);
        }
        let f = DMat3::IDENTITY + h;
        let cofactor = cofactor(f);
        let square = inner3(f, f);
        let volume_ratio = f.determinant();
        let at = Invariants { i: (square - 3.0) as f32, j: (volume_ratio - 1.0) as f32 };
        let wide = law_at(law);
        let slope = |x: f32| f64::from(wide.distortion_slope(x));
        let curvature = |x: f32| f64::from(wide.distortion_curvature(x, wide.distortion_slope(x)));
        let volume_slope = f64::from(wide.volume_slope(at.j));
        let volume_curvature = f64::from(wide.volume_curvature(at.j));
        let volume = f64::from(tile.volume::<f32>(lane));
        let base = Self {
            nodes,
            gradients,
            volume,
            f,
            cofactor,
            p1: 2.0 * slope(at.i),
            p_j: volume_slope,
            stiffening: curvature(at.i),
            coupling: 0.0,
            bulk: volume_curvature,
            x_f: 2.0,
            x_c: 0.0,
        };
        if !L::ISOCHORIC {
            return base;
        }
        let factor = VolumeFactor::new(at);
        let (g, slope_g, curvature_g) =
            (f64::from(factor.g), f64::from(factor.slope), f64::from(factor.curvature()));
        Self {
            p1: 2.0 * slope(factor.x) * g,
            p_j: volume_slope + slope(factor.x) * slope_g * square,
            stiffening: curvature(factor.x),
            coupling: 2.0 * slope(factor.x) * slope_g,
            bulk: volume_curvature + slope(factor.x) * curvature_g * square,
            x_f: 2.0 * g,
            x_c: slope_g * square,
            ..base
        }
    }

    /// Adds `K (root v)` to `out`.
    fn add_product(&self, roots: &[DVec3], vector: &[DVec3], out: &mut [DVec3]) {
        let mut df = DMat3::ZERO;
        for (&node, gradient) in self.nodes.iter().zip(self.gradients) {
            df += outer(roots[node] * vector[node], gradient);
        }
        let (f, c) = (self.f, self.cofactor);
        let (df_f, df_c) = (inner3(f, df), inner3(c, df));
        let dx = self.x_f * df_f + self.x_c * df_c;
        let d_cofactor = cofactor(f + df) - cofactor(f - df);
        let stress = df * self.p1
            + (f * self.x_f + c * self.x_c) * (self.stiffening * dx)
            + f * (self.coupling * df_c)
            + c * (self.coupling * df_f + self.bulk * df_c)
            + d_cofactor * (0.5 * self.p_j);
        for (&node, gradient) in self.nodes.iter().zip(self.gradients) {
            out[node] += stress * gradient * self.volume;
        }
    }
}

fn law_at<L: Law>(law: &L) -> L::Wide<f32> {
    L::widen(|_| *law)
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

fn inner3(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// The cofactor matrix, quadratic in `f`: a central difference of it is its exact derivative.
fn cofactor(f: DMat3) -> DMat3 {
    DMat3::from_cols(f.y_axis.cross(f.z_axis), f.z_axis.cross(f.x_axis), f.x_axis.cross(f.y_axis))
}
