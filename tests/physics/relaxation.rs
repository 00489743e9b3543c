//! Tissue that relaxes (Prony series) against closed forms and an independent float64 integration of Simo & Hughes'
//! equations (1998, section 10.3).

use std::f64::consts::TAU;

use supple::loads::{Loads, Motion};
use supple::material::{AnyLaw, Element, Prony, VecMaterial};
use supple::scene::{Axes, Support, VecScene};
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

use crate::reference::tensor::{
    Mat3, contraction, determinant, from_fn, inverse, max_abs, product, rotation, transpose,
};
use crate::support::{Body, DENSITY, EXP, NEO, POLYNOMIAL, reference_law};

const ELEMENTS: [Element; 3] = Element::ALL;
const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A body all of whose nodes are moved, so that its deformation is the same everywhere.
pub(crate) struct Specimen {
    body: Body,
    scene: VecScene<VecMaterial>,
    state: VecState,
    step: Step,
}

impl Specimen {
    fn new(element: Element, law: AnyLaw, prony: &[[f32; 2]], seconds: f64) -> Self {
        let tissue = VecMaterial::one(element, law, DENSITY);
        Self::of(VecMaterial { prony: vec![Prony::new(prony).unwrap()], ..tissue }, seconds)
    }

    /// Of 162 elements.
    pub(crate) fn of(material: VecMaterial, seconds: f64) -> Self {
        let body = Body::irregular([0.03, 0.03, 0.03], [3, 3, 3]);
        let supports: Vec<_> = (0..body.points.len() as u32).map(Support::moved).collect();
        let scene = VecScene::build(material, &body.mesh(), &supports).unwrap();
        let state = VecState::of(scene.view());
        Self { body, scene, state, step: Step::unchecked(seconds as f32, 0.0).unwrap() }
    }

    fn displacement(&self, node: usize, f: &Mat3) -> [f32; 3] {
        let x = self.body.points[node].map(f64::from);
        [0, 1, 2].map(|i| (0..3).map(|j| (f[i][j] - IDENTITY[i][j]) * x[j]).sum::<f64>() as f32)
    }

    /// It has this deformation gradient from now on, and had none before.
    pub(crate) fn start(&mut self, f: &Mat3) {
        let at: Vec<_> = (0..self.body.points.len()).map(|node| self.displacement(node, f)).collect();
        assert!(tled::start(&self.scene, &mut self.state, &self.step, |node| (at[node], [0.0; 3])));
    }

    /// The first Piola-Kirchhoff stress at present (Pa), from the forces: `P = sum_a f_a X_a^T / V`. The deformation
    /// gradient becomes `next` in the step.
    pub(crate) fn step(&mut self, next: &Mat3) -> Mat3 {
        let nodes = self.body.points.len();
        let motion = |node: usize| Motion {
            node: node as u32,
            axes: Axes::XYZ,
            metre: self.displacement(node, next),
            ramp: 0.0,
        };
        let motions: Vec<_> = (0..nodes).map(motion).collect();
        let loads = Loads::new(&self.scene, [0.0; 3], &[], &motions).unwrap();
        let status = tled::step(&self.scene, &loads, &mut self.state, &self.step);
        assert!(status.is_taken(), "{status:?}");
        let volume = self.body.mesh().tets().map(|tet| volume(&self.body, tet)).sum::<f64>();
        let mut stress = [[0.0; 3]; 3];
        for (point, force) in self.body.points.iter().zip(self.state.forces()) {
            for i in 0..3 {
                for j in 0..3 {
                    // Forces are external less internal.
                    stress[i][j] -= f64::from(force.to_array()[i]) * f64::from(point[j]) / volume;
                }
            }
        }
        stress
    }
}

fn volume(body: &Body, tet: [u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|node| body.points[node as usize].map(f64::from));
    determinant(&[b, c, d].map(|corner| [0, 1, 2].map(|axis| corner[axis] - a[axis]))) / 6.0
}

/// The stress of the law and its isochoric part, from the textbook's `P`.
fn elastic(law: AnyLaw, f: &Mat3) -> [Mat3; 2] {
    let law = reference_law(law);
    let (all, j) = (law.first_piola(f), determinant(f));
    let cofactor = transpose(&inverse(f));
    let distortion = from_fn(|i, k| all[i][k] - 2.0 * law.d() * (j - 1.0) * j * cofactor[i][k]);
    [all, distortion]
}

/// Simo & Hughes' series in float64, by the exact solution for a driving stress that is linear in time in each of many
/// short steps.
struct Series<'a> {
    law: AnyLaw,
    terms: &'a [[f32; 2]],
    q: Vec<Mat3>,
}

impl Series<'_> {
    /// `DEV[2 dW/dC]`, Pa.
    fn driving(&self, f: &Mat3) -> Mat3 {
        let [_, distortion] = elastic(self.law, f);
        let inner = product(&inverse(f), &distortion);
        let scale = determinant(f).powf(2.0 / 3.0);
        from_fn(|i, j| scale * inner[i][j])
    }

    fn advance(&mut self, f: impl Fn(f64) -> Mat3, from: f64, seconds: f64) {
        const PARTS: u32 = 20;
        let part = seconds / f64::from(PARTS);
        for index in 0..PARTS {
            let begin = from + f64::from(index) * part;
            let (a, b) = (self.driving(&f(begin)), self.driving(&f(begin + part)));
            for (q, [share, tau]) in self.q.iter_mut().zip(self.terms) {
                let (g, x) = (f64::from(*share), part / f64::from(*tau));
                let decay = (-x).exp();
                let late = 1.0 - (1.0 - decay) / x;
                let early = 1.0 - decay - late;
                *q = from_fn(|i, j| decay * q[i][j] + g * (early * a[i][j] + late * b[i][j]));
            }
        }
    }

    fn stress(&self, f: &Mat3) -> Mat3 {
        let [all, _] = elastic(self.law, f);
        let sum = from_fn(|i, j| self.q.iter().map(|q| q[i][j]).sum());
        let (c, scale) = (product(&transpose(f), f), determinant(f).powf(-2.0 / 3.0));
        let (inside, mean) = (inverse(&c), contraction(&sum, &c) / 3.0);
        let pushed = product(f, &from_fn(|i, j| sum[i][j] - mean * inside[i][j]));
        from_fn(|i, j| all[i][j] - scale * pushed[i][j])
    }
}

fn apart(a: &Mat3, b: &Mat3) -> f64 {
    max_abs(&from_fn(|i, j| a[i][j] - b[i][j]))
}

/// Held at a strain, the stress of distortion falls by `g (1 - e^(-t / tau))`, whatever the strain and the law.
#[test]
fn a_held_strain_relaxes_as_in_the_closed_form() {
    const SHARE: f64 = 0.6;
    const TAU: f64 = 0.1;
    let f = [[1.25, 0.4, 0.0], [0.0, 0.9, 0.1], [0.05, 0.0, 0.95]];
    for element in ELEMENTS {
        for law in [NEO, EXP, POLYNOMIAL] {
            for steps in [10_u32, 100, 1_000, 10_000] {
                if steps > 100 && law != NEO {
                    continue;
                }
                let seconds = TAU / f64::from(steps);
                let mut specimen = Specimen::new(element, law, &[[SHARE as f32, TAU as f32]], seconds);
                specimen.start(&f);
                let [all, distortion] = elastic(law, &f);
                let mut worst = 0.0_f64;
                for step in 0..3 * steps {
                    let stress = specimen.step(&f);
                    let relaxed = SHARE * (1.0 - (-f64::from(step) * seconds / TAU).exp());
                    let exact = from_fn(|i, j| all[i][j] - relaxed * distortion[i][j]);
                    worst = worst.max(apart(&stress, &exact) / max_abs(&distortion));
                }
                println!("{element:?}, {law}: {steps} steps a time constant, worst error {worst:.1e} of the stress");
                assert!(worst < 1e-4, "{worst}");
            }
        }
    }
}

/// Small shear `gamma sin(w t)`: the storage modulus is `mu (1 - g / (1 + w^2 tau^2))`, the loss modulus
/// `mu g w tau / (1 + w^2 tau^2)`.
#[test]
fn shear_that_oscillates_has_the_moduli_of_the_series_over_three_decades() {
    const TERMS: [[f32; 2]; 2] = [[0.3, 0.02], [0.4, 0.2]];
    const STRAIN: f64 = 1e-3;
    for element in ELEMENTS {
        for omega in [0.5, 5.0, 50.0, 500.0] {
            let period = TAU / omega;
            // Of the period and of the shorter time constant.
            let per_period = (20.0 * period / 0.02).clamp(200.0, 2_000.0).round();
            let seconds = period / per_period;
            let shear = |time: f64| {
                let mut f = IDENTITY;
                f[0][1] = STRAIN * (omega * time).sin();
                f
            };
            let mut specimen = Specimen::new(element, NEO, &TERMS, seconds);
            specimen.start(&IDENTITY);
            // Until the longer term has forgotten the start, then one period.
            let rest = (5.0 * 0.2_f64 / period).ceil() * per_period;
            let (mut sine, mut cosine) = (0.0, 0.0);
            for step in 0..(rest + per_period) as u32 {
                let time = f64::from(step) * seconds;
                let stress = specimen.step(&shear(time + seconds))[0][1];
                if f64::from(step) >= rest {
                    sine += 2.0 / per_period * stress * (omega * time).sin() / STRAIN;
                    cosine += 2.0 / per_period * stress * (omega * time).cos() / STRAIN;
                }
            }
            let mu = 1_000.0;
            let of = |with: fn(f64) -> f64| -> f64 {
                let term = |[g, tau]: [f32; 2]| {
                    let x = omega * f64::from(tau);
                    f64::from(g) * with(x) / (1.0 + x * x)
                };
                mu * TERMS.into_iter().map(term).sum::<f64>()
            };
            let (storage, loss) = (mu - of(|_| 1.0), of(|x| x));
            println!(
                "{element:?}, {omega:5} 1/s: storage {sine:.2} Pa ({storage:.2}), loss {cosine:.2} Pa ({loss:.2})"
            );
            assert!((sine / storage - 1.0).abs() < 1e-3 && (cosine / loss - 1.0).abs() < 3e-3, "{sine} {cosine}");
        }
    }
}

/// A large motion that stretches, shears and turns, two terms, steps that change their length.
#[test]
fn a_large_motion_follows_the_float64_integration() {
    const TERMS: [[f32; 2]; 2] = [[0.3, 0.02], [0.4, 0.3]];
    let motion = |time: f64| {
        let (s, c) = ((8.0 * time).sin(), 1.0 - (5.0 * time).cos());
        let stretch = [[1.0 + 0.3 * s, 0.25 * c, 0.0], [0.0, 1.0 - 0.15 * s, 0.1 * s], [0.05 * c, 0.0, 1.0 - 0.08 * c]];
        product(&rotation([0.6, 0.0, 0.8], 2.0 * time), &stretch)
    };
    for element in ELEMENTS {
        for law in [NEO, EXP, POLYNOMIAL] {
            let mut errors = vec![];
            for seconds in [4e-3, 2e-3, 1e-3] {
                let mut specimen = Specimen::new(element, law, &TERMS, seconds);
                let mut series = Series { law, terms: &TERMS, q: vec![[[0.0; 3]; 3]; 2] };
                specimen.start(&motion(0.0));
                let (mut time, mut worst, mut largest) = (0.0, 0.0_f64, 0.0_f64);
                for step in 0..(0.8 / seconds) as u32 {
                    // Every third one is half as long.
                    let next = if step % 3 == 0 { 0.5 * seconds } else { seconds };
                    specimen.step = Step::unchecked(next as f32, 0.0).unwrap();
                    let stress = specimen.step(&motion(time + next));
                    let exact = series.stress(&motion(time));
                    worst = worst.max(apart(&stress, &exact));
                    largest = largest.max(max_abs(&elastic(law, &motion(time))[1]));
                    series.advance(motion, time, next);
                    time += next;
                }
                errors.push(worst / largest);
            }
            let order = (errors[0] / errors[2]).log2() / 2.0;
            let errors: Vec<f64> = errors.iter().map(|error| 1e3 * error).collect();
            println!("{element:?}, {law}: errors {errors:.2?} 1e-3 of the stress, order {order:.2}");
            assert!(errors[2] < 1.0 && order > 1.6, "{errors:?}");
        }
    }
}
