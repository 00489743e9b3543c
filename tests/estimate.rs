//! The running estimate of the error that added inertia causes (`supple::inertia::Report::error`), against the exact
//! step.

mod reference;
mod support;

use supple::inertia::{self, Inertia, LatticeNode, numbers_for, suggested_lattice, vectors_for};
use supple::loads::{Loads, NodalForce};
use supple::state::NodeVector;
use supple::tled::{Status, Step};
use support::bodies::{held, torsion};
use support::{Body, EXP, HostScene, HostState, bound, rest_of, tissue, to_f64};

type Scene = HostScene<supple::material::Tissue<supple::material::Exponential>>;
type HostInertia = Inertia<Vec<NodeVector>, Vec<LatticeNode>, Vec<f32>>;

const DAMPING: f32 = 20.0;
const SNAPSHOTS: usize = 10;
/// Exact steps between two snapshots.
const INTERVAL: u32 = 400;

fn bar() -> (Body, Scene) {
    let body = Body::irregular([0.02, 0.02, 0.06], [4, 4, 10]);
    let scene = body.scene(tissue(EXP), &held(&body));
    (body, scene)
}

fn prepared(body: &Body, scene: &Scene, state: &mut HostState, seconds: f32, lattice: bool) -> HostInertia {
    let (cells, functions) = if lattice { suggested_lattice(scene, &body.points) } else { ([0; 3], 0) };
    let nodes = body.points.len();
    let mut inertia = Inertia::over(
        vec![NodeVector::ZERO; vectors_for(nodes)],
        vec![LatticeNode::EMPTY; nodes],
        vec![0.0; numbers_for(cells, functions)],
    );
    let step = Step::insist(seconds, DAMPING).unwrap();
    inertia.prepare(scene, &body.points, state, step, cells).unwrap();
    inertia
}

/// Means over nodes and snapshots, mm: the estimate, and the true error.
fn judged(gravity: [f32; 3], forces: &[NodalForce], multiple: u32, lattice: bool) -> (f64, f64) {
    let (body, scene) = bar();
    let loads = Loads::new(&scene, gravity, forces, &[]).unwrap();
    let dt = 0.5 * bound(&scene, &rest_of(&scene)).seconds;
    let exact = Step::insist(dt, DAMPING).unwrap();
    let (mut truth, mut state) = (rest_of(&scene), rest_of(&scene));
    let mut inertia = prepared(&body, &scene, &mut state, multiple as f32 * dt, lattice);
    let (mut estimate, mut error) = (0.0, 0.0);
    for _ in 0..SNAPSHOTS {
        support::run(&scene, &loads, &mut truth, &exact, u64::from(INTERVAL));
        for _ in 0..INTERVAL / multiple {
            let status = inertia::step(&scene, &loads, &mut state, &mut inertia);
            assert!(matches!(status, Status::Ok | Status::Limited { .. }), "{status:?}");
        }
        estimate += 1e3 * f64::from(inertia.report().error);
        let pairs = to_f64(truth.displacements()).into_iter().zip(to_f64(state.displacements()));
        let distances: Vec<f64> =
            pairs.map(|(a, b)| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()).collect();
        error += 1e3 * distances.iter().sum::<f64>() / distances.len() as f64;
    }
    (estimate / SNAPSHOTS as f64, error / SNAPSHOTS as f64)
}

/// Factor of the truth that the estimate stays within here.
const FACTOR: f64 = 3.0;

#[test]
fn the_estimate_tells_the_scale_of_the_error_and_grows_with_the_step() {
    let (body, _) = bar();
    let twist = torsion(&body, 5e-4, 0.1);
    let lean = [0.5, 0.0, 0.0];
    // Mass scaling at 16 times this step hardly turns the bar at all: there the estimate is a tenth of the error.
    type Case<'a> = (&'a str, [f32; 3], &'a [NodalForce], bool, &'a [u32]);
    let cases: [Case; 3] = [
        ("leaning", lean, &[][..], false, &[4, 8, 16][..]),
        ("leaning", lean, &[], true, &[10, 20, 40]),
        ("torsion", [0.0; 3], &twist, false, &[4, 8]),
    ];
    for (name, gravity, forces, lattice, multiples) in cases {
        let mut before = 0.0;
        for &multiple in multiples {
            let (estimate, error) = judged(gravity, forces, multiple, lattice);
            let ratio = estimate / error;
            println!(
                "{name}, lattice {lattice}: {estimate:.4} mm estimated, {error:.4} mm true, ratio {ratio:.2}"
            );
            assert!((FACTOR.recip()..FACTOR).contains(&ratio), "{name}, lattice {lattice} at {multiple}");
            assert!(estimate > before, "{name}, lattice {lattice} at {multiple}: {before} {estimate}");
            before = estimate;
        }
    }
}

#[test]
fn a_body_at_rest_has_no_error() {
    let (body, scene) = bar();
    for lattice in [false, true] {
        let mut state = rest_of(&scene);
        let mut inertia = prepared(&body, &scene, &mut state, 5e-3, lattice);
        for _ in 0..50 {
            assert_eq!(inertia::step(&scene, &Loads::NONE, &mut state, &mut inertia), Status::Ok);
            assert_eq!(inertia.report().error, 0.0);
        }
    }
}
