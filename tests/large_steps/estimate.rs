//! The running estimate of the error that added inertia causes (`supple::inertia::Report::error`), against the exact
//! step.

use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::{Loads, NodalForce};
use supple::material::{Exponential, Tissue};
use supple::scene::VecScene;
use supple::state::VecState;
use supple::step::{Status, Step};

use crate::support::bodies::{held, torsion};
use crate::support::{Body, EXP, bound, mean_distance, rest_of, tissue, to_f64};
use crate::{VecLargeStep, support};

type Scene = VecScene<Tissue<Exponential>>;

const DAMPING: f32 = 20.0;
const SNAPSHOTS: usize = 10;
/// Exact steps between two snapshots.
const INTERVAL: u32 = 400;

fn bar() -> (Body, Scene) {
    let body = Body::irregular([0.02, 0.02, 0.06], [4, 4, 10]);
    let scene = body.scene(tissue(EXP), &held(&body));
    (body, scene)
}

fn prepared(body: &Body, scene: &Scene, state: &mut VecState, seconds: f32, lattice: bool) -> VecLargeStep {
    let method = if lattice { Method::Multilevel(Cells::Suggested) } else { Method::MassScaled };
    let step = Step::unchecked(seconds, DAMPING).unwrap();
    LargeStep::prepare_in_vec(method, scene.view(), &body.points, state.view(), step).unwrap()
}

/// Means over nodes and snapshots, mm: the estimate, and the true error.
fn judged(gravity: [f32; 3], forces: &[NodalForce], multiple: u32, lattice: bool) -> (f64, f64) {
    let (body, scene) = bar();
    let loads = Loads::new(&scene, gravity, forces, &[]).unwrap();
    let dt = 0.5 * bound(&scene, &rest_of(&scene)).seconds;
    let exact = Step::unchecked(dt, DAMPING).unwrap();
    let (mut truth, mut state) = (rest_of(&scene), rest_of(&scene));
    let mut large = prepared(&body, &scene, &mut state, multiple as f32 * dt, lattice);
    let (mut estimate, mut error) = (0.0, 0.0);
    for _ in 0..SNAPSHOTS {
        support::run(&scene, &loads, &mut truth, &exact, u64::from(INTERVAL));
        for _ in 0..INTERVAL / multiple {
            let status = large.step(scene.view(), &loads, state.view());
            assert!(status.is_taken(), "{status:?}");
        }
        estimate += 1e3 * f64::from(large.report().error);
        error += 1e3 * mean_distance(&to_f64(truth.displacements()), &to_f64(state.displacements()));
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
        let mut large = prepared(&body, &scene, &mut state, 5e-3, lattice);
        for _ in 0..50 {
            assert_eq!(large.step(scene.view(), &Loads::NONE, state.view()), Status::Ok);
            assert_eq!(large.report().error, 0.0);
        }
    }
}
