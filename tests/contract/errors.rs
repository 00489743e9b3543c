//! Bad input: every error of the core is reached, says in its own words what is wrong and where, leaves the scene
//! empty and the state where it was.

use supple::loads::{LoadError, Loads, Motion, NodalForce, traction};
use supple::material::{AnyLaw, Exponential, Material, NeoHookean, NodalStrain, Regions, Tissue, VecMaterial};
use supple::mesh::{Mesh, MeshError, Winding};
use supple::scene::{Axes, BuildError, FixedScene, Support, patch_rows_for};
use supple::state::FixedState;
use supple::step::{Status, Step, StepError};
use supple::tled;

use crate::support::at_run_time;

const POINTS: [[f32; 3]; 5] =
    [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01], [0.01, 0.01, 0.01]];
const TETS: [[u32; 4]; 2] = [[0, 1, 2, 3], [1, 2, 3, 4]];
const TISSUE: Tissue<AnyLaw> =
    Tissue { law: AnyLaw::NeoHookean(NeoHookean { c: 500.0, d: 25_000.0 }), density: 1000.0 };

type SmallScene = FixedScene<VecMaterial, 5, 1>;

fn good() -> Mesh<'static> {
    Mesh::new(&POINTS, &TETS, Winding::Checked).unwrap()
}

fn of<M: Material<Law: Into<AnyLaw>>>(material: &M) -> SmallScene {
    SmallScene::new(at_run_time(material))
}

fn built() -> SmallScene {
    let mut scene = of(&TISSUE);
    let supports = [Support::fixed(0), Support { node: 1, axes: Axes::X, moves: true }];
    scene.build(&good(), &supports).unwrap();
    scene
}

#[test]
fn mesh_errors_say_what_is_wrong_and_where() {
    let with = |node: usize, point: [f32; 3]| {
        let mut points = POINTS;
        points[node] = point;
        points
    };
    type Case<'a> = (&'a [[f32; 3]], &'a [[u32; 4]], MeshError, &'a str);
    let cases: [Case<'_>; 9] = [
        (&[], &TETS, MeshError::Empty, "the mesh has no elements"),
        (&POINTS, &[], MeshError::Empty, "the mesh has no elements"),
        (
            &POINTS,
            &[[0, 1, 2, 3], [1, 2, 3, 5]],
            MeshError::IndexOutOfRange { element: 1, node: 5, nodes: 5 },
            "element 1: node 5 does not exist, the mesh has 5 nodes",
        ),
        (
            &POINTS,
            &[[0, 1, 2, u32::MAX]],
            MeshError::IndexOutOfRange { element: 0, node: u32::MAX, nodes: 5 },
            "element 0: node 4294967295 does not exist, the mesh has 5 nodes",
        ),
        (&POINTS, &[[0, 1, 1, 3]], MeshError::RepeatedNode { element: 0, node: 1 }, "element 0: node 1 appears twice"),
        (
            &with(3, [0.0, f32::INFINITY, 0.0]),
            &TETS,
            MeshError::NotFinite { node: 3, axis: 1, value: f32::INFINITY },
            "node 3: coordinate y is inf",
        ),
        (
            &with(3, [0.0, 0.0, 1e-9]),
            &TETS,
            MeshError::Degenerate { element: 0, volume: 0.0, longest_edge: 0.0 },
            "element 0: degenerate, volume 1.67e-14 m^3 with a longest edge of 14.142 mm",
        ),
        (
            &with(3, [0.005, 0.0, 0.0]),
            &TETS,
            MeshError::Degenerate { element: 0, volume: 0.0, longest_edge: 0.0 },
            "element 0: degenerate, volume 0.00e0 m^3 with a longest edge of 14.142 mm",
        ),
        (
            &POINTS,
            &[[0, 1, 2, 3], [1, 3, 2, 4]],
            MeshError::Inverted { element: 1, volume: 0.0 },
            "element 1: volume -3.33e-7 m^3",
        ),
    ];
    for (points, tets, expected, text) in cases {
        let error = Mesh::new(points, tets, Winding::Checked).unwrap_err();
        assert_eq!(error.to_string(), text);
        // Volumes and edges are judged by the text.
        assert_eq!(std::mem::discriminant(&error), std::mem::discriminant(&expected), "{error:?}");
        if !matches!(error, MeshError::Degenerate { .. } | MeshError::Inverted { .. }) {
            assert_eq!(error, expected);
        }
    }
    let nan = Mesh::new(&with(0, [f32::NAN, 0.0, 0.0]), &TETS, Winding::Normalised).unwrap_err();
    assert_eq!(nan.to_string(), "node 0: coordinate x is NaN");
    let turned = Mesh::new(&POINTS, &[[0, 1, 2, 3], [1, 3, 2, 4]], Winding::Normalised).unwrap();
    assert_eq!(turned.turned(), 1);
}

/// The error of a build, whose scene was full before.
fn refused(mut scene: SmallScene, mesh: &Mesh<'_>, supports: &[Support]) -> BuildError {
    let error = scene.build(mesh, supports).unwrap_err();
    assert_eq!((scene.node_count(), scene.element_count()), (0, 0), "{error}");
    assert_eq!(scene.mass(), 0.0);
    assert_eq!((scene.view().node_mass(0), scene.view().held(4)), (0.0, Axes::NONE));
    error
}

#[test]
fn build_errors_say_what_is_wrong_and_leave_the_scene_empty() {
    let six: Vec<_> = POINTS.iter().copied().chain([[0.02, 0.0, 0.0]]).collect();
    let many = vec![TETS[0]; 17];
    let cases: [(BuildError, BuildError, &str); 6] = [
        (
            refused(built(), &Mesh::new(&six, &TETS, Winding::Checked).unwrap(), &[]),
            BuildError::NodeCapacity { needed: 6, capacity: 5 },
            "the mesh has 6 nodes, the scene has room for 5",
        ),
        (
            refused(built(), &Mesh::new(&POINTS, &many, Winding::Checked).unwrap(), &[]),
            BuildError::TileCapacity { needed: 2, capacity: 1 },
            "the mesh needs 2 tiles of 16 elements, the scene has room for 1",
        ),
        (
            refused(built(), &Mesh::new(&POINTS, &TETS[..1], Winding::Checked).unwrap(), &[]),
            BuildError::Mesh(MeshError::UnusedNode { node: 4 }),
            "node 4 belongs to no element",
        ),
        (
            refused(built(), &good(), &[Support::fixed(0), Support::moved(5)]),
            BuildError::SupportNode { support: 1, node: 5, nodes: 5 },
            "support 1: node 5 does not exist, the mesh has 5 nodes",
        ),
        (
            refused(built(), &good(), &[0, 1, 2, 3, 4].map(Support::fixed)),
            BuildError::NothingMoves,
            "all nodes of all elements are fixed, so nothing can move",
        ),
        (
            refused(
                of(&Regions { law: TISSUE.law, tissues: &[TISSUE.values(); 2], of_element: &[0, 2] }),
                &good(),
                &[],
            ),
            BuildError::NoTissue { element: 1 },
            "element 1: the material names no tissue",
        ),
    ];
    for (error, expected, text) in cases {
        assert_eq!(error, expected);
        assert_eq!(error.to_string(), text);
    }
    let strain = refused(of(&NodalStrain(TISSUE)), &good(), &[]);
    let needed = patch_rows_for(5, 2, 1);
    assert_eq!(strain, BuildError::PatchCapacity { needed, capacity: 0 });
    let text = format!("{needed} rows of patches are enough for nodal strain, the scene has room for 0");
    assert_eq!(strain.to_string(), text);
    let (tissues, of_element) = ([TISSUE.values(); 2], [0]);
    let short = Regions { law: TISSUE.law, tissues: &tissues, of_element: &of_element };
    assert_eq!(refused(of(&short), &good(), &[]), BuildError::NoTissue { element: 1 });
    let all = [0, 1, 2, 3, 4].map(Support::moved);
    assert_eq!(built().build(&good(), &all), Ok(()), "what is moved by the host may move");
}

#[test]
fn constants_that_are_not_finite_and_positive_are_refused_by_name() {
    for value in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let soft = |c, d| Tissue { law: NeoHookean { c, d }, density: 1000.0 };
        let stiff = |a, b, d| Tissue { law: Exponential { a, b, d }, density: 1000.0 };
        let refusals = [
            ("c", refused(of(&soft(value, 1.0)), &good(), &[])),
            ("d", refused(of(&soft(1.0, value)), &good(), &[])),
            ("a", refused(of(&stiff(value, 1.0, 1.0)), &good(), &[])),
            ("b", refused(of(&stiff(1.0, value, 1.0)), &good(), &[])),
            ("d", refused(of(&stiff(1.0, 1.0, value)), &good(), &[])),
        ];
        for (name, error) in refusals {
            assert_eq!(
                error.to_string(),
                format!("element 0: constant {name} is {value}, it must be a finite positive number")
            );
        }
        let heavy = Tissue { density: value, ..TISSUE };
        let tissues = [TISSUE, heavy].map(|tissue| tissue.values());
        let regions = Regions { law: TISSUE.law, tissues: &tissues, of_element: &[0, 1] };
        assert_eq!(
            refused(of(&regions), &good(), &[]).to_string(),
            format!("element 1: density is {value} kg/m^3, it must be a finite positive number")
        );
    }
}

#[test]
fn load_errors_say_which_load_is_wrong() {
    let scene = built();
    let force = NodalForce { node: 4, newton: [1.0; 3], ramp: 0.0 };
    let motion = Motion { node: 1, axes: Axes::X, metre: [1e-3, 0.0, 0.0], ramp: 0.0 };
    let forces = |bad| Loads::new(&scene, [0.0; 3], &[force, bad], &[]).unwrap_err();
    let motions = |bad| Loads::new(&scene, [0.0; 3], &[], &[motion, bad]).unwrap_err();
    let tractions =
        |triangle, pascal, ramp| traction(&POINTS, &[[0, 1, 2], triangle], pascal, ramp).find_map(Result::err).unwrap();
    let cases: [(LoadError, &str); 12] = [
        (forces(NodalForce { node: 5, ..force }), "force 1: node 5 does not exist, the scene has 5 nodes"),
        (forces(NodalForce { newton: [0.0, f32::NAN, 0.0], ..force }), "force 1: a component is NaN"),
        (forces(NodalForce { ramp: -0.5, ..force }), "force 1: the ramp is -0.5 s, it must be zero or more"),
        (forces(NodalForce { ramp: f32::INFINITY, ..force }), "force 1: the ramp is inf s, it must be zero or more"),
        (motions(Motion { node: 9, ..motion }), "motion 1: node 9 does not exist, the scene has 5 nodes"),
        (motions(Motion { metre: [f32::NEG_INFINITY, 0.0, 0.0], ..motion }), "motion 1: a component is -inf"),
        (motions(Motion { ramp: f32::NAN, ..motion }), "motion 1: the ramp is NaN s, it must be zero or more"),
        (
            motions(Motion { axes: Axes::X.union(Axes::Z), ..motion }),
            "motion 1: node 1 has no support that moves along z",
        ),
        (Loads::new(&scene, [0.0, f32::NAN, 0.0], &[], &[]).unwrap_err(), "gravity 0: a component is NaN"),
        (tractions([0, 1, 7], [0.0; 3], 0.0), "triangle 1: node 7 does not exist, the scene has 5 nodes"),
        (tractions([0, 1, 3], [f32::INFINITY, 0.0, 0.0], 0.0), "traction 0: a component is inf"),
        (tractions([0, 1, 3], [1.0; 3], -1.0), "traction 0: the ramp is -1 s, it must be zero or more"),
    ];
    for (error, text) in cases {
        assert_eq!(error.to_string(), text);
    }
}

#[test]
fn a_motion_needs_a_support_that_moves() {
    // Node 0 is fixed: an element with four such nodes is left out of the scene, so none of them may be moved.
    let scene = built();
    let motion = Motion { node: 0, axes: Axes::X, metre: [1e-3, 0.0, 0.0], ramp: 0.0 };
    let motions = [motion];
    let refused = Loads::new(&scene, [0.0; 3], &[], &motions);
    assert!(matches!(refused, Err(LoadError::NotHeld { index: 0, node: 0, axis: 0 })), "{refused:?}");
}

#[test]
fn step_errors_give_the_values() {
    let scene = built();
    let mut state = FixedState::<5>::new();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let refusals = [0.0, -1e-4, f32::NAN, f32::INFINITY, 1e-30].map(|seconds| {
        (
            Step::unchecked(seconds, 0.0).unwrap_err(),
            StepError::Step { seconds },
            format!("the step is {seconds} s, it must be a finite positive number"),
        )
    });
    for (error, expected, text) in refusals {
        assert_eq!(error.to_string(), text);
        assert_eq!(std::mem::discriminant(&error), std::mem::discriminant(&expected));
    }
    for damping in [-1.0, f32::NAN, f32::INFINITY] {
        let error = Step::new(1e-6, damping, critical).unwrap_err();
        assert!(matches!(error, StepError::Damping { .. }));
        assert_eq!(error.to_string(), format!("the damping is {damping} 1/s, it must be zero or more"));
    }
    let above = 2.0 * critical.seconds;
    let error = Step::new(above, 0.0, critical).unwrap_err();
    assert_eq!(error, StepError::AboveCritical { seconds: above, critical });
    assert_eq!(
        error.to_string(),
        format!(
            "the step of {above:.3e} s is above the stable {:.3e} s, which node {} sets",
            critical.seconds, critical.node
        )
    );
}

#[test]
fn a_state_or_loads_of_another_scene_move_nothing() {
    let scene = built();
    let step = Step::unchecked(1e-5, 0.0).unwrap();
    let mut small = FixedState::<4>::new();
    assert_eq!(tled::step(&scene, &Loads::NONE, &mut small, &step), Status::Mismatch { nodes: 5, room: 4 });
    let (points, tets) = (&POINTS[..4], &TETS[..1]);
    let mut other = of(&TISSUE);
    other.build(&Mesh::new(points, tets, Winding::Checked).unwrap(), &[]).unwrap();
    let foreign = Loads::new(&other, [0.0, 0.0, -9.81], &[], &[]).unwrap();
    let mut state = FixedState::<5>::new();
    assert!(matches!(tled::step(&scene, &foreign, &mut state, &step), Status::Mismatch { nodes: 5, .. }));
    assert_eq!((state.steps(), state.time()), (0, 0.0));
    assert!(state.displacements().iter().all(|u| u.to_array() == [0.0; 3]));
}

#[test]
fn an_empty_scene_steps_without_harm() {
    let scene = of(&TISSUE);
    let mut state = FixedState::<5>::new();
    let step = Step::unchecked(1e-5, 0.0).unwrap();
    // Nothing is there to move; no panic is what matters.
    let _ = tled::step(&scene, &Loads::NONE, &mut state, &step);
    let critical = tled::critical_step(&scene, &mut state);
    println!("critical step of an empty scene: {critical:?}");
    assert!(scene.view().element_fields(state.displacements()).next().is_none());
    assert_eq!(tled::strain_energy(&scene, &mut state).expect("room"), 0.0);
}
