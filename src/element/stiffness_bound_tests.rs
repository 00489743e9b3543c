//! The bounds of an element's tangent are upper bounds, and close ones: 10,000 random states of random tetrahedra,
//! slivers included, from small strain to inverted. The tangent `dP/dF` (Pa) in float64 is that of the tests' reference,
//! which shares no code with the crate, and a central difference of its stress.

use crate::reference;
use crate::reference::dense::{self, Matrix, eigenvalues};
use crate::reference::tensor::{apply, contraction, determinant, from_fn, inverse, product, rotation};
use crate::reference::{EXPONENT_CAP, J_MIN, Mat3, Random, Vec3};

use super::barrier::{Barrier, ONSET};
use super::deformation::Deformation;
use super::internal_forces::ElementVisitor;
use super::patch_forces::modulus_of;
use super::stiffness_bound::{Coefficients, ScalarBound, scalar_bound, scalar_bound_of_patches, spatial_bound};
use crate::material::{Exponential, Law, LawState, NeoHookean, Tissue};
use crate::mesh::{Mesh, Winding};
use crate::scene::VecScene;

const STATES: usize = 10_000;

/// Below this volume ratio the bound that rotations do not feel is not used.
const CRUSHED: f64 = 0.2;

/// Quadratic form of `dF` as a 9 x 9 matrix, from its values.
fn quadratic(form: impl Fn(&Mat3) -> f64) -> Matrix {
    let unit = |at: usize| from_fn(|i, j| if 3 * i + j == at { 1.0 } else { 0.0 });
    let mut matrix = dense::zeros(9);
    for (row, column) in (0..9).flat_map(|row| (0..=row).map(move |column| (row, column))) {
        let (a, b) = (unit(row), unit(column));
        let sum = from_fn(|i, j| a[i][j] + b[i][j]);
        let value = 0.5 * (form(&sum) - form(&a) - form(&b));
        (matrix[row][column], matrix[column][row]) = (value, value);
    }
    matrix
}

fn plus(a: &Matrix, factor: f64, b: &Matrix) -> Matrix {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + factor * b).collect()).collect()
}

fn largest(matrix: &Matrix) -> f64 {
    *eigenvalues(matrix).last().unwrap()
}

fn norm(a: &Matrix) -> f64 {
    a.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}

fn square(a: &Mat3) -> f64 {
    contraction(a, a)
}

/// The crate's bounds of a tangent in one state.
struct Bounds {
    /// Of `dF:A:dF`, Pa: for any state, and that which rotations do not feel, where the element is not crushed.
    any: Matrix,
    spatial: Option<Matrix>,
    /// Modulus of the stabilising energy of patches, Pa; no eigenvalue of the rest exceeds the following, Pa.
    modulus: f64,
    scalar_of_patch: f64,
    /// Of the eigenvalues of the element's stiffness, N/m.
    scalar: f64,
    /// Its gradients, 1/m, and volume, m^3.
    gradients: [Vec3; 4],
    volume: f64,
}

/// The bound of `dF:A:dF` (Pa) that holds in any state.
fn bound_of_any_state(coefficients: &Coefficients<f32>, deformation: &Deformation<f32>) -> Matrix {
    let (iso, volume) = coefficients.bound(deformation);
    let cofactor = from_fn(|i, j| f64::from(deformation.cofactor(i, j)));
    quadratic(|change| f64::from(iso) * square(change) + f64::from(volume) * contraction(&cofactor, change).powi(2))
}

fn bounds<L: Law>(law: L, points: &[[f32; 3]], h: [[f32; 3]; 3]) -> Bounds {
    let tissue = Tissue { law, density: 1000.0 };
    let scene =
        VecScene::build(tissue, &Mesh::new(points, &[[0, 1, 2, 3]], Winding::Normalised).unwrap(), &[]).unwrap();
    let tile = &scene.view().tiles[0];
    let deformation = &Deformation::<f32>::new(h);
    let wide = law.splat::<f32>();
    let local = LawState::new::<L>(&wide, deformation.invariants);
    let coefficients = &Coefficients::new::<L>(&wide, &local);
    let f = from_fn(|i, j| f64::from(h[i][j]) + if i == j { 1.0 } else { 0.0 });
    let spatial = || {
        let bound = spatial_bound(coefficients, deformation);
        let [shear, volume, stress] = [bound.shear, bound.volume, bound.stress].map(f64::from);
        let inverse = inverse(&f);
        quadratic(|change| {
            let l = product(change, &inverse);
            let d = from_fn(|i, j| 0.5 * (l[i][j] + l[j][i]));
            let trace = d[0][0] + d[1][1] + d[2][2];
            shear * square(&d) + volume * trace * trace + stress * square(&l)
        })
    };
    let any = bound_of_any_state(coefficients, deformation);
    let modulus = modulus_of::<f32, L>(&wide);
    let less = &Coefficients::new::<L>(&wide, &local).less(modulus);
    let is_sound = determinant(&f) > CRUSHED;
    let slopes = [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| f64::from(tile.gradient_of(corner, axis, 0))));
    let origin = [0, 1, 2].map(|axis| -(slopes[0][axis] + slopes[1][axis] + slopes[2][axis]));
    Bounds {
        any,
        spatial: is_sound.then(spatial),
        modulus: modulus.into(),
        scalar_of_patch: scalar_bound_of_patches(less, deformation, 1.0).into(),
        scalar: ScalarBound.visit::<f32, L>(&wide, tile, 0, deformation, &local).into(),
        gradients: [origin, slopes[0], slopes[1], slopes[2]],
        volume: tile.volume::<f32>(0).into(),
    }
}

/// `dP/dF` (Pa) by central differences of fourth order, with steps of `size`.
fn by_differences(stress: impl Fn(&Mat3) -> Mat3, f: &Mat3, size: f64) -> Matrix {
    let mut a = dense::zeros(9);
    for column in 0..9 {
        let at = |times: f64| {
            let unit = |i, j| if 3 * i + j == column { times * size } else { 0.0 };
            stress(&from_fn(|i, j| f[i][j] + unit(i, j)))
        };
        let (far_back, back, on, far_on) = (at(-2.0), at(-1.0), at(1.0), at(2.0));
        for row in 0..9 {
            let (i, j) = (row / 3, row % 3);
            let difference = 8.0 * (on[i][j] - back[i][j]) - (far_on[i][j] - far_back[i][j]);
            a[row][column] = difference / (12.0 * size);
        }
    }
    a
}

/// The tangent, Pa, and how far it is from differences.
fn tangent(law: &reference::Law, f: &Mat3) -> (Matrix, f64) {
    let a: Matrix = law.tangent(f).iter().map(|row| row.to_vec()).collect();
    let other = by_differences(|f| law.first_piola(f), f, step_size(law, f));
    let distance = norm(&plus(&other, -1.0, &a)) / norm(&a);
    (a, distance)
}

/// The stiffness of a tetrahedron, N/m.
fn stiffness(a: &Matrix, bounds: &Bounds) -> Matrix {
    let mut k = dense::zeros(12);
    for (row, column) in (0..12).flat_map(|row| (0..12).map(move |column| (row, column))) {
        let (g, other) = (bounds.gradients[row / 3], bounds.gradients[column / 3]);
        let entries = (0..9).map(|at| a[3 * (row % 3) + at / 3][3 * (column % 3) + at % 3] * g[at / 3] * other[at % 3]);
        k[row][column] = bounds.volume * entries.sum::<f64>();
    }
    k
}

const BOUNDS: [&str; 4] = ["any state", "spatial", "scalar", "scalar, patches"];

/// The largest eigenvalue of each bound over that of the tangent.
struct Comparison {
    ratios: [Option<f64>; BOUNDS.len()],
    /// The least eigenvalue of a bound less the tangent over the norm of the bound.
    margin: f64,
    /// Relative distance of the tangent from differences.
    distance: f64,
}

fn compare<L: Law>(law: L, reference_law: &reference::Law, points: &[[f32; 3]], h: [[f32; 3]; 3]) -> Comparison {
    let bounds = bounds(law, points, h);
    let f = from_fn(|i, j| f64::from(h[i][j]) + if i == j { 1.0 } else { 0.0 });
    let (a, distance) = tangent(reference_law, &f);
    let most = largest(&a);
    let whole = [Some(&bounds.any), bounds.spatial.as_ref()];
    let margins = whole.iter().flatten().map(|bound| eigenvalues(&plus(bound, -1.0, &a))[0] / norm(bound));
    let margin = margins.fold(f64::INFINITY, f64::min);
    let [any, spatial] = whole.map(|bound| bound.map(|bound| largest(bound) / most));
    let scalar = bounds.scalar / largest(&stiffness(&a, &bounds));
    let scalar_of_patch = (bounds.scalar_of_patch + bounds.modulus) / most;
    let ratios = [any, spatial, Some(scalar), Some(scalar_of_patch)];
    Comparison { ratios, margin, distance }
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

#[test]
fn the_bounds_of_a_tangent_are_upper_bounds_and_close() {
    let mut random = Random(41);
    let mut ratios: [[Vec<f64>; BOUNDS.len()]; CLASSES.len()] = Default::default();
    let (mut margin, mut distance) = (f64::INFINITY, 0.0_f64);
    let (mut taken, mut kinks) = (0, 0);
    let mut wrong = Vec::new();
    while taken < STATES {
        let (class, form) = (taken % CLASSES.len(), taken / CLASSES.len() % FORMS.len());
        let points = tetrahedron(&mut random);
        let f = deformation(&mut random, class);
        let Some(state) = compare_random_law(&mut random, &points, &f, form) else {
            kinks += 1;
            continue;
        };
        taken += 1;
        (margin, distance) = (margin.min(state.margin), distance.max(state.distance));
        let is_bounded = state.margin > -1e-5 && state.ratios.iter().flatten().all(|ratio| *ratio > 1.0 - 1e-5);
        if !is_bounded {
            wrong.push((CLASSES[class], FORMS[form], determinant(&f), state.margin, state.ratios));
        }
        for (ratios, ratio) in ratios[class].iter_mut().zip(state.ratios) {
            ratios.extend(ratio);
        }
    }
    println!("tangent: within {distance:.1e} of differences; {kinks} states at a kink left out");
    println!("least eigenvalue of a bound less the tangent, over the bound: {margin:.1e}");
    println!("{:35} | least | median | 95 % | most", "largest of bound / largest of tangent");
    let mut medians = [[0.0; BOUNDS.len()]; CLASSES.len()];
    for (class, (of_class, medians)) in CLASSES.iter().zip(ratios.iter_mut().zip(&mut medians)) {
        for (bound, (values, median)) in BOUNDS.iter().zip(of_class.iter_mut().zip(medians)) {
            values.sort_by(f64::total_cmp);
            let at = |share: f64| values.get((values.len().saturating_sub(1) as f64 * share) as usize);
            let [least, middle, high, most] = [0.0, 0.5, 0.95, 1.0].map(|share| at(share).copied().unwrap_or(1.0));
            println!("{:35} | {least:.3} | {middle:.3} | {high:.3} | {most:.1}", format!("{class}, {bound}"));
            *median = middle;
        }
    }
    assert!(distance < 1e-5, "the differences have not converged");
    assert!(wrong.is_empty(), "{} not bounded: {:?}", wrong.len(), &wrong[..wrong.len().min(20)]);
    // Most states of tissue belong to the first two classes. The scalar bound takes neither roots nor divisions.
    for medians in &medians[..2] {
        let [any, spatial, scalar, scalar_of_patch] = *medians;
        assert!([any, spatial, scalar_of_patch].iter().all(|median| *median < 1.5) && scalar < 5.0);
    }
}

/// Crushed elements with nodal strain: between the onset of their own energy and its continuation along the tangent,
/// and beyond that.
#[test]
fn the_bounds_of_a_crushed_element_are_upper_bounds() {
    /// Shear modulus, Pa.
    const SHEAR: f32 = 900.0;
    let mut random = Random(7);
    let (mut margin, mut scalar, mut ratios, mut inverted) = (f64::INFINITY, f64::INFINITY, Vec::new(), 0);
    while ratios.len() < 4_000 {
        let class = 2 + ratios.len() % 4;
        let f = deformation(&mut random, class);
        let size = 3e-4 * square(&f).sqrt();
        let near = 4.0 * size * (1.0 + square(&f));
        let j = determinant(&f);
        if j > f64::from(ONSET) - near || (j - 0.15).abs() < near {
            continue;
        }
        let h = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (f[i][j] - if i == j { 1.0 } else { 0.0 }) as f32));
        let f = from_fn(|i, j| f64::from(h[i][j]) + if i == j { 1.0 } else { 0.0 });
        let deformation = &Deformation::<f32>::new(h);
        let at = deformation.invariants;
        let coefficients = &Coefficients::of_barrier(&Barrier::new(SHEAR / 6.0, at), at);
        let a = by_differences(|f| reference::nodal_strain::barrier_stress(SHEAR.into(), f), &f, size);
        let (bound, most) = (bound_of_any_state(coefficients, deformation), largest(&a));
        margin = margin.min(eigenvalues(&plus(&bound, -1.0, &a))[0] / norm(&bound));
        scalar = scalar.min(f64::from(scalar_bound(coefficients, at, 1.0_f32)) / most);
        ratios.push(largest(&bound) / most);
        inverted += usize::from(j < 0.0);
    }
    // At rest, in front of the onset, and in a place without an element.
    for (side, modulus) in [(1.0, SHEAR), (0.82, SHEAR), (0.7, 0.0)] {
        let h = [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { side - 1.0 } else { 0.0 }));
        let deformation = &Deformation::<f32>::new(h);
        let at = deformation.invariants;
        let coefficients = &Coefficients::of_barrier(&Barrier::ahead(modulus / 6.0, at), at);
        let (bound, scalar) = (bound_of_any_state(coefficients, deformation), scalar_bound(coefficients, at, 1.0_f32));
        println!("side {side}, modulus {modulus}: {:.2e} Pa", largest(&bound));
        assert!(bound.iter().flatten().all(|entry| entry.is_finite()) && scalar.is_finite());
        // No more than what keeps a divisor from zero.
        assert_eq!(largest(&bound) > 1e-30, side == 0.82);
    }
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share) as usize];
    println!(
        "least eigenvalue of the bound less the tangent, over the bound: {margin:.1e}; largest of bound / largest of \
         tangent: least {:.5}, median {:.2}, 95 % {:.1}; of the scalar bound: least {scalar:.5}; {inverted} inverted",
        at(0.0),
        at(0.5),
        at(0.95)
    );
    assert!(margin > -1e-3 && scalar > 1.0 - 1e-3 && inverted > 500);
    assert!((1.0 - 1e-3..4.0).contains(&at(0.5)));
}
