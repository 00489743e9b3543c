//! What the tests of the physics share: bodies to simulate, the laws with their float64 twins, and short
//! ways to build a scene, put it into a state and read its forces.
//!
//! Several test crates include it and none uses all of it, hence the `allow`.
#![allow(dead_code, unreachable_pub, unused_imports, unused_macros)]

pub mod bodies;
mod threads;

pub use bodies::Body;
pub use threads::Backwards;

use supple::element::ElementMaterial;
use supple::loads::Loads;
use supple::material::{
    AnyLaw, Exponential, Laws, Material, NeoHookean, Polynomial, Regions, Tissue, TissueValues, VecMaterial,
};
use supple::scene::{Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::{CriticalStep, Status, Step};
use supple::tled;

use crate::reference;

/// kg/m^3.
pub const DENSITY: f32 = 1000.0;
/// Neo-Hookean tissue of shear modulus 1 kPa and bulk modulus 50 kPa.
pub const NEO: AnyLaw = AnyLaw::NeoHookean(NeoHookean { c: 500.0, d: 25_000.0 });
/// The paper's exponential law, its constants read as kPa.
pub const EXP: AnyLaw = AnyLaw::Exponential(Exponential { a: 59.0, b: 8.023, d: 60_000.0 });

/// The neo-Hookean tissue, four times as stiff where `I1bar - 3` is one.
pub const POLYNOMIAL: AnyLaw = AnyLaw::Polynomial(Polynomial { c: 500.0, e: 750.0, d: 25_000.0 });

/// Each law once.
pub fn laws() -> [AnyLaw; 3] {
    [NEO, EXP, POLYNOMIAL]
}

/// Several tissues of one law in linear tetrahedra.
pub fn regions<'a>(law: impl Into<AnyLaw>, tissues: &'a [TissueValues], of_element: &'a [u16]) -> Regions<'a, AnyLaw> {
    Regions { law: law.into(), tissues, of_element }
}

/// The same law in float64.
pub fn reference_law(law: impl Into<AnyLaw>) -> reference::Law {
    match law.into() {
        AnyLaw::NeoHookean(NeoHookean { c, d }) => reference::Law::NeoHookean { c: c.into(), d: d.into() },
        AnyLaw::Exponential(Exponential { a, b, d }) => {
            reference::Law::Exponential { a: a.into(), b: b.into(), d: d.into() }
        }
        AnyLaw::Polynomial(Polynomial { c, e, d }) => {
            reference::Law::Polynomial { c: c.into(), e: e.into(), d: d.into() }
        }
        law => panic!("the reference does not know {law}"),
    }
}

/// A state at rest for this scene.
pub fn rest_of<M>(scene: &VecScene<M>) -> VecState {
    VecState::at_rest(scene.node_count())
}

/// One tissue of [`DENSITY`].
pub fn tissue(law: impl Into<AnyLaw>) -> Tissue<AnyLaw> {
    Tissue { law: law.into(), density: DENSITY }
}

/// The same material, with law and element chosen at run time.
pub fn at_run_time<M: Material<Law: Into<AnyLaw>>>(material: &M) -> VecMaterial {
    let element = material.element();
    match material.laws() {
        Laws::One(law) => VecMaterial::one(element, law, material.tissue(0).expect("a tissue").density),
        Laws::Regions { law, tissues, of_element } => VecMaterial {
            element,
            law: law.into(),
            tissues: tissues.to_vec(),
            of_element: of_element.to_vec(),
            prony: material.prony().to_vec(),
            fibres: material.fibres().to_vec(),
            directions: material.directions().to_vec(),
        },
    }
}

/// Supports that fix these nodes.
pub fn fixed(nodes: &[u32]) -> Vec<Support> {
    nodes.iter().copied().map(Support::fixed).collect()
}

/// The bound on the stable step at this state.
pub fn bound<M: ElementMaterial>(scene: &VecScene<M>, state: &VecState) -> CriticalStep {
    tled::critical_step(scene, &mut state.clone()).expect("a finite state")
}

/// The scene standing still at displacements `u`, m.
pub fn displaced<M: ElementMaterial>(scene: &VecScene<M>, u: &[[f32; 3]]) -> VecState {
    let mut state = rest_of(scene);
    let step = Step::unchecked(1e-15, 0.0).unwrap();
    assert!(tled::start(scene, &mut state, &step, |node| (u[node], [0.0; 3])));
    state
}

/// Total force on each node at displacements `u` without loads, N: minus the internal force. Read from a step
/// too short to move anything.
pub fn forces<M: ElementMaterial>(scene: &VecScene<M>, u: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let mut state = displaced(scene, u);
    assert!(tled::internal_forces(scene, &mut state));
    let forces = to_f64(state.forces());
    let step = Step::unchecked(1e-15, 0.0).unwrap();
    let status = tled::step(scene, &Loads::NONE, &mut state, &step);
    assert!(status.is_taken(), "{status:?}");
    assert_eq!(to_f64(state.forces()), forces, "not those of the step");
    forces
}

/// Takes steps; one that is not `Ok` fails the test.
pub fn run<M: ElementMaterial>(scene: &VecScene<M>, loads: &Loads<'_>, state: &mut VecState, step: &Step, count: u64) {
    for _ in 0..count {
        assert_eq!(tled::step(scene, loads, state, step), Status::Ok);
    }
}

/// Vectors of nodes in float64.
pub fn to_f64(vectors: &[NodeVector]) -> Vec<[f64; 3]> {
    vectors.iter().map(|vector| vector.to_array().map(f64::from)).collect()
}

/// Vectors rounded to float32.
pub fn to_f32(vectors: &[[f64; 3]]) -> Vec<[f32; 3]> {
    vectors.iter().map(|vector| vector.map(|component| component as f32)).collect()
}

/// Vectors of float32 in float64.
pub fn widened(vectors: &[[f32; 3]]) -> Vec<[f64; 3]> {
    vectors.iter().map(|vector| vector.map(f64::from)).collect()
}

/// The Euclidean norm over all nodes and axes.
pub fn norm(vectors: &[[f64; 3]]) -> f64 {
    vectors.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}

/// The norm of the sum: `forces` of the kernel are external less internal, those of the reference internal.
pub fn norm_of_sum(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let sums: Vec<_> = a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|axis| a[axis] + b[axis])).collect();
    norm(&sums)
}

/// The distance between the nodes of each pair.
pub fn distances<'a>(a: &'a [[f64; 3]], b: &'a [[f64; 3]]) -> impl Iterator<Item = f64> + 'a {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt())
}

/// The largest distance between the nodes of a pair.
pub fn largest_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    distances(a, b).fold(0.0, f64::max)
}

/// The mean of these distances.
pub fn mean_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    distances(a, b).sum::<f64>() / a.len() as f64
}

/// The largest length.
pub fn largest(vectors: &[[f64; 3]]) -> f64 {
    largest_distance(vectors, &vec![[0.0; 3]; vectors.len()])
}

/// Everything that a step may change apart from the forces it saw, bit for bit.
pub fn bits(state: &VecState) -> Vec<u64> {
    let nodes = state.displacements().iter().enumerate();
    let moving = nodes.flat_map(|(node, u)| [u.to_array(), state.velocity(node)].into_iter().flatten());
    moving
        .map(|component| u64::from(component.to_bits()))
        .chain([state.time().to_bits(), state.steps()])
        // The shortest text that reads back as the same values.
        .chain(format!("{:?}", state.energy_balance()).bytes().map(u64::from))
        .collect()
}
