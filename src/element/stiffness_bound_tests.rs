//! The bound of an element's tangent is an upper bound, and a close one: 10,000 random states of random tetrahedra,
//! slivers included, from small strain to inverted. The tangent (N/m) in float64 is a central difference of the forces
//! of the tests' reference, which shares no code with the crate.

#[path = "../../tests/reference/mod.rs"]
mod reference;

use reference::dense::{self, Matrix, cholesky, eigenvalues, symmetric_part, transformed};
use reference::tensor::{apply, contraction, determinant, from_fn, product, rotation};
use reference::{EXPONENT_CAP, J_MIN, Mat3, Random, Vec3};

use super::barrier::{Barrier, ONSET};
use super::deformation::Deformation;
use super::stiffness_bound::{Bound, Coefficients, MatrixSums};
use crate::material::{Exponential, Law, LawState, NeoHookean, Tissue};
use crate::mesh::{Mesh, Winding};
use crate::scene::VecScene;
use crate::simd::{NodeVector, SCATTER_WIDTH, Scatter, ScatterBuffer};

const STATES: usize = 10_000;

/// Largest allowed median of: largest eigenvalue of the bound over that of the tangent.
const CLOSE: f64 = 4.0;

/// A tetrahedron under a deformation, and the crate's bounds.
struct Sample {
    /// Gradients of the shape functions (1/m) and volume (m^3), as in the crate's tables.
    gradients: [Vec3; 4],
    volume: f64,
    /// The matrices `D_a` of the four nodes as computed by the crate, N/m.
    matrices: [Matrix; 4],
    /// The same, computed in float64 from the crate's `iso` and `volume`.
    exact: [Matrix; 4],
    /// The scalar bound, N/m.
    scalar: f64,
}

/// `coefficients` are those of a law, or of a crushed element.
fn sample(
    coefficients: impl Fn(&Deformation<f32>) -> Coefficients<f32>,
    points: &[[f32; 3]],
    h: [[f32; 3]; 3],
) -> Sample {
    let tets = [[0, 1, 2, 3]];
    let tissue = Tissue { law: NeoHookean { c: 500.0, d: 5_000.0 }, density: 1000.0 };
    let scene = VecScene::build(tissue, &Mesh::new(points, &tets, Winding::Normalised).unwrap(), &[]).unwrap();
    let scene = scene.view();
    let tile = &scene.tiles[0];
    let deformation = Deformation::<f32>::new(h);
    let bound = Bound::of(coefficients(&deformation), tile, 0, &deformation);
    let (mut diagonal, mut off_diagonal) = ([NodeVector::ZERO; 4], [NodeVector::ZERO; 4]);
    let mut sums = MatrixSums { diagonal: Scatter::new(&mut diagonal), off_diagonal: Scatter::new(&mut off_diagonal) };
    let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| deformation.cofactor(i, j)));
    // The other places of the tile have no volume.
    let mut buffer = [ScatterBuffer::NONE; 2];
    for lane in 0..SCATTER_WIDTH {
        sums.add(&bound, tile, lane, &rows, &mut buffer);
    }
    let scalar = f64::from(bound.scalar);

    // The crate may have permuted the corners; those of the tile are used.
    let node = |corner: usize| tile.node(corner, 0);
    let matrices = [0, 1, 2, 3].map(|corner| {
        let [xx, yy, zz, _] = diagonal[node(corner)].0.map(f64::from);
        let [xy, yz, zx, _] = off_diagonal[node(corner)].0.map(f64::from);
        vec![vec![xx, xy, zx], vec![xy, yy, yz], vec![zx, yz, zz]]
    });
    let slopes = [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| f64::from(tile.gradient_of(corner, axis, 0))));
    let origin = [0, 1, 2].map(|axis| -(slopes[0][axis] + slopes[1][axis] + slopes[2][axis]));
    let gradients = [origin, slopes[0], slopes[1], slopes[2]];
    let volume = f64::from(tile.volume::<f32>(0));
    let sum = from_fn(|i, j| gradients.iter().map(|g| g[i] * g[j]).sum());
    let gradient_eigenvalue = *eigenvalues(&sum.iter().map(|row| row.to_vec()).collect()).last().unwrap();
    let cofactor = from_fn(|i, j| f64::from(deformation.cofactor(i, j)));
    let images = gradients.map(|gradient| apply(&cofactor, gradient));
    let lengths = images.map(|image| image.iter().map(|x| x * x).sum::<f64>().sqrt());
    let exact = [0, 1, 2, 3].map(|node| {
        let image = images[node];
        let weight = lengths.iter().sum::<f64>() / lengths[node];
        let entry = |i: usize, j: usize| {
            let along = weight * f64::from(bound.volume) * image[i] * image[j];
            volume * (along + if i == j { f64::from(bound.iso) * gradient_eigenvalue } else { 0.0 })
        };
        (0..3).map(|i| (0..3).map(|j| entry(i, j)).collect()).collect()
    });
    Sample { gradients, volume, matrices, exact, scalar }
}

/// Forces on the four nodes, N.
fn forces(stress: &impl Fn(&Mat3) -> Mat3, sample: &Sample, f: &Mat3) -> Vec<f64> {
    let p = stress(f);
    sample.gradients.iter().flat_map(|g| apply(&p, *g).map(|x| sample.volume * x)).collect()
}

/// The 12 x 12 tangent (N/m) by central differences of fourth order, with steps that change `F` by `size`.
fn tangent(stress: &impl Fn(&Mat3) -> Mat3, sample: &Sample, f: &Mat3, size: f64) -> Matrix {
    let mut k = dense::zeros(12);
    for (node, gradient) in sample.gradients.iter().enumerate() {
        let length = gradient.iter().map(|x| x * x).sum::<f64>().sqrt();
        for axis in 0..3 {
            let at = |times: f64| {
                let moved = from_fn(|i, j| f[i][j] + if i == axis { times * size * gradient[j] / length } else { 0.0 });
                forces(stress, sample, &moved)
            };
            let (far_back, back, on, far_on) = (at(-2.0), at(-1.0), at(1.0), at(2.0));
            for row in 0..12 {
                let difference = 8.0 * (on[row] - back[row]) - (far_on[row] - far_back[row]);
                k[row][3 * node + axis] = difference * length / (12.0 * size);
            }
        }
    }
    k
}

fn norm(a: &Matrix) -> f64 {
    a.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}

/// The 12 x 12 matrix with these submatrices on its diagonal.
fn direct_sum(matrices: &[Matrix; 4]) -> Matrix {
    let mut whole = dense::zeros(12);
    for (node, matrix) in matrices.iter().enumerate() {
        for i in 0..3 {
            for j in 0..3 {
                whole[3 * node + i][3 * node + j] = matrix[i][j];
            }
        }
    }
    whole
}

fn largest(matrix: &Matrix) -> f64 {
    *eigenvalues(matrix).last().unwrap()
}

/// Largest `lambda` of `K x = lambda D x` with the matrices `D_a` of the nodes.
fn generalised(k: &Matrix, matrices: &[Matrix; 4]) -> f64 {
    let root = cholesky(&direct_sum(matrices)).expect("the bound is positive");
    largest(&transformed(&root, &symmetric_part(k)))
}

/// Comparison of the bounds with the tangent `K` in one state.
struct Comparison {
    /// Largest `lambda` of `K x = lambda D x`, with the matrices in float64 and with those of the crate.
    generalised: f64,
    summed: f64,
    /// Largest eigenvalue of `D` over that of `K`.
    ratio: f64,
    /// Largest eigenvalue of a `D_a` over the scalar bound.
    over_scalar: f64,
    /// Relative distance of the tangent from that with twice the step of differences, and from the analytic one.
    converged: f64,
    analytic: f64,
}

fn compare<L: Law>(law: L, reference_law: &reference::Law, points: &[[f32; 3]], h: [[f32; 3]; 3]) -> Comparison {
    let wide = law.splat::<f32>();
    let of_law = |deformation: &Deformation<f32>| {
        Coefficients::new::<L>(&wide, &LawState::new::<L>(&wide, deformation.invariants))
    };
    let (sample, stress) = (sample(of_law, points, h), |f: &Mat3| reference_law.first_piola(f));
    let f = from_fn(|i, j| f64::from(h[i][j]) + if i == j { 1.0 } else { 0.0 });
    let size = step_size(reference_law, &f);
    let k = tangent(&stress, &sample, &f, size);
    let coarser = tangent(&stress, &sample, &f, 2.0 * size);
    let a = reference_law.tangent(&f);
    let mut by_formula = dense::zeros(12);
    for (row, column) in (0..12).flat_map(|row| (0..12).map(move |column| (row, column))) {
        let (g, other) = (sample.gradients[row / 3], sample.gradients[column / 3]);
        by_formula[row][column] = sample.volume
            * (0..9)
                .map(|at| a[3 * (row % 3) + at / 3][3 * (column % 3) + at % 3] * g[at / 3] * other[at % 3])
                .sum::<f64>();
    }
    let distance = |other: &Matrix| {
        let square: f64 = k.iter().flatten().zip(other.iter().flatten()).map(|(x, y)| (x - y).powi(2)).sum();
        square.sqrt() / norm(&k)
    };
    let against = |matrices: &[Matrix; 4]| generalised(&k, matrices);
    let of_bound = sample.exact.iter().map(largest).fold(0.0, f64::max);
    let summed = sample.matrices.iter().map(largest).fold(0.0, f64::max);
    Comparison {
        generalised: against(&sample.exact),
        summed: against(&sample.matrices),
        ratio: of_bound / largest(&k),
        over_scalar: of_bound.max(summed) / sample.scalar,
        converged: distance(&coarser),
        analytic: distance(&by_formula),
    }
}

/// Change of `F` in a difference: small compared with `F`, and with the change that raises the exponent of the law by
/// one.
fn step_size(law: &reference::Law, f: &Mat3) -> f64 {
    let length = contraction(f, f).sqrt();
    let [g, slope, _] = law.volume_factor(determinant(f));
    let exponent = match *law {
        reference::Law::Exponential { b, .. } => b,
        _ => 0.0,
    };
    let rate = 2.0 * g * length + slope.abs() * length.powi(4);
    3e-4 / (1.0 / length + exponent * rate)
}

/// Whether the differences would include a kink of the law, at `J_MIN` or at the cap of the exponent.
fn at_a_kink(law: &reference::Law, f: &Mat3) -> bool {
    let j = determinant(f);
    let size = 4.0 * step_size(law, f);
    let of_j = size * (1.0 + contraction(f, f));
    let near_floor = (j - J_MIN).abs() < of_j;
    let near_cap = match *law {
        reference::Law::Exponential { b, .. } => (b * law.strain_measure(f) - EXPONENT_CAP).abs() < 0.01,
        _ => false,
    };
    near_floor || near_cap
}

/// A random tetrahedron of 0.1 mm to 10 cm; one in four is a sliver.
fn tetrahedron(random: &mut Random) -> Vec<[f32; 3]> {
    let size = 10.0_f64.powf(-2.5 + 1.5 * random.next());
    let flat = if random.next() > 0.5 { 10.0_f64.powf(-1.25 + 0.75 * random.next()) } else { 1.0 };
    let rotated = rotation(random.vector(), 3.0 * random.next());
    loop {
        let corners: [Vec3; 4] = [(); 4].map(|()| random.vector());
        let edges = [1, 2, 3].map(|i| [0, 1, 2].map(|axis| corners[i][axis] - corners[0][axis]));
        if determinant(&edges).abs() < 0.3 {
            continue;
        }
        return corners
            .iter()
            .map(|[x, y, z]| apply(&rotated, [*x, *y, flat * z]).map(|x| (size * x) as f32))
            .collect();
    }
}

const CLASSES: [&str; 6] = ["small strain", "ordinary", "large", "crushed", "inverted", "any matrix"];

const FORMS: [&str; 2] = ["neo-Hookean", "exponential"];

/// A random `F` of a class.
fn deformation(random: &mut Random, class: usize) -> Mat3 {
    loop {
        let mut stretched = |low: f64, high: f64| {
            let stretch = random.vector().map(|x| 0.5 * (low + high) + 0.5 * (high - low) * x);
            let (q, r) =
                (rotation(random.vector(), 3.0 * random.next()), rotation(random.vector(), 3.0 * random.next()));
            let diagonal = from_fn(|i, j| if i == j { stretch[i] } else { 0.0 });
            product(&q, &product(&diagonal, &r))
        };
        let f = match class {
            0 => stretched(0.99, 1.01),
            1 => stretched(0.5, 1.5),
            2 => stretched(0.2, 3.0),
            3 => stretched(0.05, 0.8),
            4 => stretched(-1.5, 1.5),
            _ => {
                let size = random.next().abs() * 3.0;
                let entries = random.matrix();
                from_fn(|i, j| size * entries[i][j])
            }
        };
        let j = determinant(&f);
        let fits = match class {
            0 | 2 => true,
            1 => (0.7..1.4).contains(&j),
            3 => j > 0.0 && j < 0.2,
            4 => j < -0.01,
            _ => j.abs() > 1e-4,
        };
        if fits {
            return f;
        }
    }
}

/// The comparison for a law of a form with random constants; none at a kink of the law.
fn compare_random_law(random: &mut Random, points: &[[f32; 3]], f: &Mat3, form: usize) -> Option<Comparison> {
    // Rounded to float32 first, so that crate and reference get the same state.
    let h = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (f[i][j] - if i == j { 1.0 } else { 0.0 }) as f32));
    let f = from_fn(|i, j| f64::from(h[i][j]) + if i == j { 1.0 } else { 0.0 });
    let modulus = 10.0_f64.powf(2.5 + 1.5 * random.next());
    let a = modulus as f32;
    let d = (modulus * 10.0_f64.powf(1.5 + 1.5 * random.next())) as f32;
    let b = 10.0_f64.powf(0.7 + 0.7 * random.next()) as f32;
    let (wide_a, wide_b, wide_d) = (f64::from(a), f64::from(b), f64::from(d));
    let (neo, exp) = (NeoHookean { c: a, d }, Exponential { a, b, d });
    let reference_law = match form {
        0 => reference::Law::NeoHookean { c: wide_a, d: wide_d },
        _ => reference::Law::Exponential { a: wide_a, b: wide_b, d: wide_d },
    };
    if at_a_kink(&reference_law, &f) {
        return None;
    }
    Some(match form {
        0 => compare(neo, &reference_law, points, h),
        _ => compare(exp, &reference_law, points, h),
    })
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

#[test]
fn the_bound_of_an_element_is_an_upper_bound_and_close() {
    let mut random = Random(41);
    let mut ratios: [[Vec<f64>; 4]; CLASSES.len()] = Default::default();
    let (mut generalised, mut summed, mut over_scalar) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut converged, mut analytic) = (0.0_f64, 0.0_f64);
    let (mut taken, mut kinks) = (0, 0);
    let mut wrong = Vec::new();
    while taken < STATES {
        let (class, form) = (taken % CLASSES.len(), taken / CLASSES.len() % 4);
        let points = tetrahedron(&mut random);
        let f = deformation(&mut random, class);
        let Some(state) = compare_random_law(&mut random, &points, &f, form) else {
            kinks += 1;
            continue;
        };
        taken += 1;
        (generalised, summed) = (generalised.max(state.generalised), summed.max(state.summed));
        over_scalar = over_scalar.max(state.over_scalar);
        (converged, analytic) = (converged.max(state.converged), analytic.max(state.analytic));
        if state.generalised.is_nan()
            || state.generalised > 1.0 + 1e-3
            || state.ratio.is_nan()
            || state.ratio < 1.0 - 1e-3
        {
            wrong.push((CLASSES[class], form, determinant(&f), state.generalised, state.ratio));
        }
        ratios[class][form].push(state.ratio);
    }
    println!(
        "tangent by differences: within {converged:.1e} of that with twice the step, {analytic:.1e} of the formula; {kinks} states at a kink left out"
    );
    println!(
        "largest eigenvalue of the tangent against the bound: {generalised:.5}, against the sums in float32 {summed:.5}"
    );
    println!("largest eigenvalue of a node's matrix over the scalar bound: {over_scalar:.6}");
    let line = |name: &str, values: &[f64]| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let [least, median, high, most] = [0.0, 0.5, 0.95, 1.0].map(|share| quantile(&sorted, share));
        println!("{name:35} | {least:6.3} | {median:6.3} | {high:9.3} | {most:9.1}");
        median
    };
    println!("{:35} |  least | median |      95 % | most", "largest of bound / largest of tangent");
    let medians = CLASSES.iter().zip(&ratios).map(|(class, forms)| {
        for (form, values) in FORMS.iter().zip(forms) {
            line(&format!("{class}, {form}"), values);
        }
        line(class, &forms.concat())
    });
    let medians: Vec<f64> = medians.collect();
    let median = line("all", &ratios.as_flattened().concat());
    assert!(converged < 1e-5 && analytic < 1e-5, "the differences have not converged");
    assert!(
        wrong.is_empty(),
        "{} not bounded (class, form, J, eigenvalue, ratio): {:?}",
        wrong.len(),
        &wrong[..wrong.len().min(20)]
    );
    assert!(summed <= 1.0 + 1e-2);
    assert!(over_scalar <= 1.0 + 1e-5, "an eigenvalue exceeds the scalar bound");
    println!("median over all states: {median:.3}, wanted at most {CLOSE}");
    assert!(median <= CLOSE);
    // Most states of tissue belong to the first class; added inertia is small where the bound is close.
    assert!(medians[0] <= 2.0);
}

/// Crushed elements with nodal strain: between the onset of their own energy and its continuation along the tangent,
/// and beyond that.
#[test]
fn the_bound_of_a_crushed_element_is_an_upper_bound() {
    /// Shear modulus, Pa.
    const SHEAR: f32 = 900.0;
    let mut random = Random(7);
    let (mut most, mut over_scalar, mut ratios, mut inverted) = (0.0_f64, 0.0_f64, Vec::new(), 0);
    while ratios.len() < 4_000 {
        let class = 2 + ratios.len() % 4;
        let (points, f) = (tetrahedron(&mut random), deformation(&mut random, class));
        let size = 3e-4 * contraction(&f, &f).sqrt();
        let near = 4.0 * size * (1.0 + contraction(&f, &f));
        let j = determinant(&f);
        if j > f64::from(ONSET) - near || (j - 0.15).abs() < near {
            continue;
        }
        let h = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (f[i][j] - if i == j { 1.0 } else { 0.0 }) as f32));
        let of_barrier = |deformation: &Deformation<f32>| {
            let at = deformation.invariants;
            Coefficients::of_barrier(&Barrier::new(SHEAR / 6.0, at), at)
        };
        let sample = sample(of_barrier, &points, h);
        let f = from_fn(|i, j| f64::from(h[i][j]) + if i == j { 1.0 } else { 0.0 });
        let stress = |f: &Mat3| reference::nodal_strain::barrier_stress(SHEAR.into(), f);
        let k = tangent(&stress, &sample, &f, size);
        most = most.max(generalised(&k, &sample.exact)).max(generalised(&k, &sample.matrices) - 9e-3);
        let of_bound = sample.exact.iter().map(largest).fold(0.0, f64::max);
        over_scalar = over_scalar.max(of_bound / sample.scalar);
        ratios.push(of_bound / largest(&symmetric_part(&k)));
        inverted += usize::from(j < 0.0);
    }
    // At rest, in front of the onset, and in a place without an element.
    for (side, modulus) in [(1.0, SHEAR), (0.82, SHEAR), (0.7, 0.0)] {
        let h = [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { side - 1.0 } else { 0.0 }));
        let ahead = |deformation: &Deformation<f32>| {
            let at = deformation.invariants;
            Coefficients::of_barrier(&Barrier::ahead(modulus / 6.0, at), at)
        };
        let sample = sample(ahead, &tetrahedron(&mut random), h);
        let of_bound = sample.matrices.iter().map(largest).fold(0.0, f64::max);
        println!("side {side}, modulus {modulus}: {of_bound:.2e} N/m");
        assert!(sample.matrices.iter().flatten().flatten().all(|entry| entry.is_finite()) && sample.scalar.is_finite());
        // No more than what keeps a divisor from zero.
        assert_eq!(of_bound > 1e-30, side == 0.82);
    }
    ratios.sort_by(f64::total_cmp);
    let median = quantile(&ratios, 0.5);
    println!(
        "largest eigenvalue of the tangent against the bound {most:.5}, of the bound over that of the tangent {median:.2} \
         (median), {:.1} (95 %), over the scalar bound {over_scalar:.5}; {inverted} inverted",
        quantile(&ratios, 0.95)
    );
    assert!(most <= 1.0 + 1e-3 && over_scalar <= 1.0 + 1e-5 && inverted > 500);
    assert!((1.0 - 1e-3..4.0).contains(&median) && ratios[0] >= 1.0 - 1e-3);
}
