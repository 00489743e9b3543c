//! What cannot be prepared or stepped is said, and nothing moves.

use supple::inertia::{Cells, InertiaError, LargeModel, LargeStep, MAX_FUNCTIONS, Method, vectors_for};
use supple::loads::{Loads, NodalForce};
use supple::material::{Tissue, VecMaterial};
use supple::scene::{Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::{Status, Step};

use crate::large_steps::{limit, prepared};
use crate::support::bodies::{held, small_bar};
use crate::support::{Body, NEO, bits, displaced, rest_of, tissue};

fn given(cells: [u32; 3]) -> Method {
    Method::new(Cells::Given(cells))
}

/// What [`LargeStep::prepare`] says of a small bar and storage of so many vectors. It gives no step then.
fn refused(
    method: Method,
    vectors: usize,
    spoil: impl Fn(&VecScene<VecMaterial>, &mut Vec<[f32; 3]>, &mut VecState),
) -> InertiaError {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let step = Step::unchecked(10.0 * limit(&scene), 0.0).unwrap();
    let (mut points, mut state) = (body.points.clone(), rest_of(&scene));
    spoil(&scene, &mut points, &mut state);
    let before = bits(&state);
    let mut storage = vec![NodeVector::ZERO; vectors];
    let prepared = LargeStep::prepare(method, scene.view(), &points, state.view(), step, &mut storage[..]);
    let error = prepared.unwrap_err();
    assert_eq!(bits(&state), before);
    println!("{error}");
    error
}

#[test]
fn what_cannot_be_prepared_is_said_and_no_step_is_taken() {
    let body = small_bar();
    assert_eq!(body.points.len(), 96);
    let scene = body.scene(tissue(NEO), &held(&body));
    let nothing = |_: &VecScene<_>, _: &mut Vec<_>, _: &mut VecState| {};
    let said = |error: InertiaError, text: &str| assert_eq!(error.to_string(), text);

    let method = given([1, 1, 2]);
    let needed = vectors_for(&method, scene.view(), &body.points).unwrap();
    for capacity in [0, needed - 1] {
        let error = refused(method, capacity, nothing);
        assert_eq!(error, InertiaError::Capacity { kind: "vectors", needed, capacity });
        said(error, &format!("the inertia needs {needed} vectors, there is room for {capacity}"));
    }
    let step = Step::unchecked(10.0 * limit(&scene), 0.0).unwrap();
    let (mut state, storage) = (rest_of(&scene), vec![NodeVector::ZERO; needed]);
    let points = &body.points;
    let enough = LargeStep::prepare(method, scene.view(), points, state.view(), step, storage);
    assert_eq!(enough.unwrap().step(scene.view(), &Loads::NONE, state.view()), Status::Ok);
    let error = refused(given([1, 1, 2]), needed, |_, _, state| *state = VecState::at_rest(95));
    said(error, "the inertia needs 96 nodes in the state, there is room for 95");

    for cells in [[0; 3], [1, 0, 1], [2_000, 1, 1], [10, 10, 10], [u32::MAX; 3]] {
        let error = refused(given(cells), 100_000, nothing);
        assert_eq!(error, InertiaError::Cells { cells });
        let [x, y, z] = cells;
        said(error, &format!("a lattice of {x} x {y} x {z} cells: each must be at least 1, with at most 1024 points"));
    }
    let error = refused(given([9, 9, 9]), 100_000, nothing);
    said(error, &format!("a lattice of 9 x 9 x 9 cells has more than {MAX_FUNCTIONS} functions"));
    let error = refused(given([1, 1, 2]), 100_000, |_, points, _| {
        points.pop();
    });
    said(error, "95 points for a scene of 96 nodes");
    let error = refused(given([1, 1, 2]), 100_000, |scene, _, state| {
        let mut u = vec![[0.0; 3]; 96];
        u[50][0] = f32::NAN;
        *state = displaced(scene, &u);
    });
    assert!(matches!(error, InertiaError::NotFinite { .. }));
    assert!(error.to_string().ends_with(": its stiffness is not a finite number"), "{error}");
}

#[test]
fn an_inertia_serves_only_what_it_was_prepared_for() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let step = Step::unchecked(10.0 * limit(&scene), 0.0).unwrap();
    let mut state = rest_of(&scene);
    let (method, points) = (given([1, 1, 2]), &body.points);
    let mut storage = vec![NodeVector::ZERO; vectors_for(&method, scene.view(), points).unwrap()];
    let mut model = LargeModel::prepare(method, scene.view(), points, state.view(), step, &mut storage).unwrap();
    storage.pop();
    let other_storage = model.with_storage(&mut storage);
    let status = other_storage.step(scene.view(), &Loads::NONE, state.view());
    assert!(matches!(status, Status::Mismatch { nodes: 96, .. }), "{status:?}");

    let mut large = prepared(&body, &scene, &mut state, step, 0.0);
    let other = Body::irregular([0.02, 0.02, 0.04], [2, 2, 4]);
    let other_scene = other.scene(Tissue { law: NEO, density: 1000.0 }, &held(&other));
    let status = large.step(other_scene.view(), &Loads::NONE, state.view());
    assert!(matches!(status, Status::Mismatch { nodes: 45, .. }), "{status:?}");
    let forces = [NodalForce { node: 1, newton: [1.0; 3], ramp: 0.0 }];
    let foreign = Loads::new(&other_scene, [0.0; 3], &forces, &[]).unwrap();
    let status = large.step(scene.view(), &foreign, state.view());
    assert!(matches!(status, Status::Mismatch { nodes: 96, .. }), "{status:?}");
    let status = large.step(scene.view(), &Loads::NONE, VecState::at_rest(95).view());
    assert_eq!(status, Status::Mismatch { nodes: 96, room: 95 });
    assert_eq!(state.steps(), 0);
    assert_eq!(large.step(scene.view(), &Loads::NONE, state.view()), Status::Ok);
}

/// A host hands over an absurd force, once. What it moves is held back, or the step is refused; afterwards the node
/// follows its forces again, and the energy balance is that of the body.
#[test]
fn a_node_that_a_wild_force_held_back_is_let_go() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let step = Step::unchecked(10.0 * limit(&scene), 20.0).unwrap();
    let node = 94;
    let moved = |wild: &[f32]| {
        let mut state = rest_of(&scene);
        let mut large = prepared(&body, &scene, &mut state, step, 0.0);
        let mut push = |newton: f32, copies: usize, steps: usize| {
            let force = NodalForce { node, newton: [newton, 0.0, 0.0], ramp: 0.0 };
            let forces = vec![force; copies];
            let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
            for _ in 0..steps {
                let status = large.step(scene.view(), &loads, state.view());
                if newton > 1.0 {
                    println!("{newton} N: {status:?}");
                }
            }
        };
        for &newton in wild {
            // Two of them add up to infinity.
            push(newton, 1, 1);
            push(newton, 2, 1);
        }
        push(0.01, 1, 10_000);
        (state.displacements()[node as usize].to_array()[0], state.energy_balance().most())
    };
    let ((undisturbed, most), (wild, most_after)) = (moved(&[]), moved(&[3e38]));
    println!("a step diverges at {most:.1e} J, after a wild force at {most_after:.1e} J");
    assert!(most_after < 10.0 * most);
    println!("0.01 N move it by {:.3} mm, after a wild force by {:.3} mm", 1e3 * undisturbed, 1e3 * wild);
    assert!((wild / undisturbed - 1.0).abs() < 0.05);
}

/// No lattice has one function, or every node is held.
#[test]
fn a_mesh_that_is_too_small_for_a_lattice_is_referred_to_exact_steps() {
    let tiny = Body::bar([0.004; 3], [1, 1, 1]);
    let body = small_bar();
    let moved: Vec<_> = (0..body.points.len() as u32).map(Support::moved).collect();
    for (body, supports, cells) in [(tiny, vec![], Cells::Suggested), (body, moved, Cells::Given([1, 1, 2]))] {
        let scene = body.scene(tissue(NEO), &supports);
        let mut state = rest_of(&scene);
        let step = Step::unchecked(1e-3, 0.0).unwrap();
        let method = Method::new(cells);
        assert_eq!(method.grid(scene.view(), &body.points).unwrap().functions, 0);
        let made = LargeStep::prepare_in_vec(method, scene.view(), &body.points, state.view(), step);
        let (error, nodes) = (made.unwrap_err(), body.points.len());
        assert_eq!(error, InertiaError::TooSmall { nodes });
        let said = format!("a mesh of {nodes} nodes is too small for long steps: take exact ones");
        assert_eq!(error.to_string(), said);
    }
}
