//! What cannot be prepared or stepped is said, and nothing moves.

use super::*;

/// What [`Inertia::prepare`] says of a small bar, after which no step can be taken.
fn refused(
    inertia: &mut HostInertia,
    cells: [u32; 3],
    spoil: impl Fn(&HostScene<Tissue<NeoHookean>>, &mut Vec<[f32; 3]>, &mut HostState),
) -> InertiaError {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let step = Step::insist(10.0 * limit(&scene), 0.0).unwrap();
    // Prepared once with success, so that a step could be taken.
    let mut fresh = rest_of(&scene);
    let enough = inertia.prepare(&scene, &body.points, &mut fresh, step, [0; 3]).is_ok();
    if enough {
        assert_eq!(inertia::step(&scene, &Loads::NONE, &mut fresh, inertia), Status::Ok);
    }
    let (mut points, mut state) = (body.points.clone(), rest_of(&scene));
    spoil(&scene, &mut points, &mut state);
    let error = inertia.prepare(&scene, &points, &mut state, step, cells).unwrap_err();
    let mut state = rest_of(&scene);
    let status = inertia::step(&scene, &Loads::NONE, &mut state, inertia);
    assert!(matches!(status, Status::Mismatch { nodes: 96, .. }), "{status:?}");
    assert_eq!(state.steps(), 0);
    println!("{error}");
    error
}

#[test]
fn what_cannot_be_prepared_is_said_and_no_step_is_taken() {
    let nodes = small_bar().points.len();
    assert_eq!(nodes, 96);
    let roomy = || over(vectors_for(nodes), nodes, numbers_for([4; 3], 128));
    let nothing = |_: &HostScene<_>, _: &mut Vec<_>, _: &mut HostState| {};
    let said = |error: InertiaError, text: &str| assert_eq!(error.to_string(), text);

    let error = refused(&mut over(vectors_for(nodes) - 1, nodes, 0), [0; 3], nothing);
    assert_eq!(error, InertiaError::Capacity { kind: "vectors", needed: 480, capacity: 479 });
    said(error, "the inertia needs 480 vectors, there is room for 479");
    let error =
        refused(&mut over(vectors_for(nodes), nodes - 1, numbers_for([4; 3], 128)), [1, 1, 2], nothing);
    said(error, "the inertia needs 96 lattice nodes, there is room for 95");
    let error = refused(&mut over(vectors_for(nodes), nodes, 10), [1, 1, 2], nothing);
    assert!(matches!(error, InertiaError::Capacity { kind: "numbers", capacity: 10, .. }));
    assert!(
        error.to_string().starts_with("the inertia needs ")
            && error.to_string().ends_with(" numbers, there is room for 10")
    );
    let error = refused(&mut roomy(), [0; 3], |_, _, state| *state = support::at_rest(95));
    said(error, "the inertia needs 96 nodes in the state, there is room for 95");

    for cells in [[1, 0, 1], [2_000, 1, 1], [10, 10, 10], [u32::MAX; 3]] {
        let error = refused(&mut roomy(), cells, nothing);
        assert_eq!(error, InertiaError::Cells { cells });
        let [x, y, z] = cells;
        said(
            error,
            &format!("a lattice of {x} x {y} x {z} cells: each must be at least 1, with at most 1024 points"),
        );
    }
    let error = refused(&mut roomy(), [9, 9, 9], nothing);
    said(error, "a lattice of 9 x 9 x 9 cells has more than 128 functions");
    let error = refused(&mut roomy(), [1, 1, 2], |_, points, _| {
        points.pop();
    });
    said(error, "95 points for a scene of 96 nodes");
    for cells in [[0; 3], [1, 1, 2]] {
        let error = refused(&mut roomy(), cells, |scene, _, state| {
            let mut u = vec![[0.0; 3]; 96];
            u[50][0] = f32::NAN;
            *state = displaced(scene, &u);
        });
        assert!(matches!(error, InertiaError::NotFinite { .. }));
        assert!(error.to_string().ends_with(": its stiffness is not a finite number"), "{error}");
    }
}

#[test]
fn an_inertia_serves_only_what_it_was_prepared_for() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let step = Step::insist(10.0 * limit(&scene), 0.0).unwrap();
    let mut state = rest_of(&scene);
    let mut unprepared = over(vectors_for(96), 96, 0);
    let refused = Status::Mismatch { nodes: 96, room: 0 };
    assert_eq!(inertia::step(&scene, &Loads::NONE, &mut state, &mut unprepared), refused);

    let mut inertia = Method::Scaled.prepared(&body, &scene, &mut state, step);
    let other = Body::irregular([0.02, 0.02, 0.04], [2, 2, 4]);
    let other_scene = other.scene(Tissue { law: NEO, density: 1000.0 }, &held(&other));
    let refused = Status::Mismatch { nodes: 45, room: 96 };
    let status = inertia::step(&other_scene, &Loads::NONE, &mut state, &mut inertia);
    assert!(matches!(status, Status::Mismatch { nodes: 45, .. }), "{status:?}, not {refused:?}");
    let forces = [NodalForce { node: 1, newton: [1.0; 3], ramp: 0.0 }];
    let foreign = Loads::new(&other_scene, [0.0; 3], &forces, &[]).unwrap();
    let status = inertia::step(&scene, &foreign, &mut state, &mut inertia);
    assert!(matches!(status, Status::Mismatch { nodes: 96, .. }), "{status:?}");
    let status = inertia::step(&scene, &Loads::NONE, &mut support::at_rest(95), &mut inertia);
    assert_eq!(status, Status::Mismatch { nodes: 96, room: 95 });
    assert_eq!(state.steps(), 0);
    assert_eq!(inertia::step(&scene, &Loads::NONE, &mut state, &mut inertia), Status::Ok);
}

/// A host hands over a force that is none, once. What it moved is held back, or the step is refused; afterwards the node follows
/// its forces again.
#[test]
fn a_node_that_a_wild_force_held_back_is_let_go() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let step = Step::insist(10.0 * limit(&scene), 20.0).unwrap();
    let node = 94;
    let moved = |wild: &[f32]| {
        let mut state = rest_of(&scene);
        let mut inertia = Method::Scaled.prepared(&body, &scene, &mut state, step);
        let mut push = |newton: f32, copies: usize, steps: usize| {
            let force = NodalForce { node, newton: [newton, 0.0, 0.0], ramp: 0.0 };
            let forces = vec![force; copies];
            let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
            for _ in 0..steps {
                let status = inertia::step(&scene, &loads, &mut state, &mut inertia);
                if newton > 1.0 {
                    println!("{newton} N: {status:?}");
                }
            }
        };
        for &newton in wild {
            // Two of them come to infinity.
            push(newton, 1, 1);
            push(newton, 2, 1);
        }
        push(0.01, 1, 10_000);
        state.displacements()[node as usize].to_array()[0]
    };
    let (calm, wild) = (moved(&[]), moved(&[3e38]));
    println!("0.01 N move it by {:.3} mm, after a wild force by {:.3} mm", 1e3 * calm, 1e3 * wild);
    assert!((wild / calm - 1.0).abs() < 0.05);
}

/// Where every node is held no function of a lattice is left, and no memory is needed for one.
#[test]
fn a_lattice_that_has_nothing_to_move_needs_no_room_and_steps() {
    let body = small_bar();
    let nodes = body.points.len();
    let moved: Vec<_> = (0..nodes as u32).map(Support::moved).collect();
    let scene = body.scene(tissue(NEO), &moved);
    let cells = [1, 1, 2];
    assert_eq!(inertia::lattice_functions(&scene, &body.points, cells), Ok(0));
    assert_eq!(numbers_for(cells, 0), 0);
    let mut inertia = over(vectors_for(nodes), 0, 0);
    let mut state = rest_of(&scene);
    let step = Step::insist(1e-3, 0.0).unwrap();
    inertia.prepare(&scene, &body.points, &mut state, step, cells).unwrap();
    let motions = [Motion { node: 95, axes: Axes::Z, metre: [0.0, 0.0, 1e-3], ramp: 0.01 }];
    let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
    for _ in 0..10 {
        assert_eq!(inertia::step(&scene, &loads, &mut state, &mut inertia), Status::Ok);
    }
    assert!((state.displacements()[95].to_array()[2] - 1e-3).abs() < 1e-9);
}
