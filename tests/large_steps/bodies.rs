//! Bodies of one mesh that share no node have nothing to do with each other, however close they are.

use supple::element::ElementMaterial;
use supple::loads::{Loads, NodalForce};
use supple::material::{AnyLaw, NeoHookean, NodalPressure, NodalStrain, Tissue};
use supple::scene::Support;
use supple::step::Step;

use crate::large_steps::{limit, prepared};
use crate::support::bodies::Body;
use crate::support::{largest, mean_distance, rest_of, run, tissue, to_f64};

const LAW: NeoHookean = NeoHookean { c: 700.0, d: 6_700.0 };
/// Of a cube, and between two, m.
const EDGE: f32 = 0.04;
const GAP: f32 = 0.001;

/// Cubes in a row along x, with the nodes of all in turn.
fn cubes(count: u32) -> Body {
    let one = Body::bar([EDGE; 3], [6; 3]);
    let row = |[x, y, z]: [f32; 3]| (0..count).map(move |cube| [x + cube as f32 * (EDGE + GAP), y, z]);
    let points = one.points.iter().copied().flat_map(row).collect();
    let tets =
        (0..count).flat_map(|cube| one.tets.iter().map(move |tet| tet.map(|node| node * count + cube))).collect();
    Body { points, tets }
}

/// The first of several cubes that stand side by side is pulled: mean distance from its exact motion and the mean
/// displacement there, and the farthest that a node of another cube has moved, m.
fn pulled<M: ElementMaterial>(material: impl Fn(Tissue<AnyLaw>) -> M, count: u32, multiple: f32) -> [f64; 3] {
    const NEWTON: f32 = 0.3;
    const DAMPING: f32 = 20.0;
    const SECONDS: f32 = 0.25;
    let body = cubes(count);
    let held: Vec<_> = body.nodes_where(|[_, _, z]| z == 0.0).into_iter().map(Support::fixed).collect();
    let top = body.nodes_where(|[x, _, z]| z == EDGE && x < EDGE + 0.5 * GAP);
    let newton = [0.0, NEWTON / top.len() as f32, 0.0];
    let forces: Vec<_> = top.iter().map(|&node| NodalForce { node, newton, ramp: 0.1 }).collect();
    let scene = body.scene(material(tissue(LAW)), &held);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(multiple * limit(&scene), DAMPING).unwrap();
    let parts = 2 * multiple as u32;
    let fine = Step::unchecked(step.seconds() / parts as f32, DAMPING).unwrap();
    let [mut state, mut exact] = [rest_of(&scene), rest_of(&scene)];
    let mut large = prepared(&body, &scene, &mut state, step, 0.0);
    for taken in 0..(SECONDS / step.seconds()) as u32 {
        assert!(large.step(scene.view(), &loads, state.view()).is_taken(), "step {taken}");
        run(&scene, &loads, &mut exact, &fine, u64::from(parts));
    }
    let [moved, truth] = [&state, &exact].map(|state| to_f64(state.displacements()));
    let of = |first: bool, all: &[[f64; 3]]| -> Vec<_> {
        let is_wanted = |node: usize| (node as u32).is_multiple_of(count) == first;
        all.iter().enumerate().filter(|(node, _)| is_wanted(*node)).map(|(_, vector)| *vector).collect()
    };
    let (own, exact) = (of(true, &moved), of(true, &truth));
    [mean_distance(&own, &exact), mean_distance(&exact, &vec![[0.0; 3]; exact.len()]), largest(&of(false, &moved))]
}

#[test]
fn a_body_moves_as_if_it_were_alone() {
    fn check<M: ElementMaterial>(name: &str, material: impl Fn(Tissue<AnyLaw>) -> M) {
        for multiple in [10.0, 20.0] {
            let [alone, next, in_many] = [1, 2, 5].map(|count| pulled(&material, count, multiple));
            println!(
                "{name}, {multiple}x: {:.3} mm off alone, {:.3} with one next to it, {:.3} with four, of {:.2} mm; others move {:.1e} mm",
                1e3 * alone[0],
                1e3 * next[0],
                1e3 * in_many[0],
                1e3 * alone[1],
                1e3 * next[2].max(in_many[2])
            );
            assert!(alone[1] > 2e-3);
            for several in [next, in_many] {
                // All share the functions of one lattice, so each has fewer.
                assert!(several[0] < alone[0].max(0.3 * alone[1]) && several[2] == 0.0, "{several:?}");
            }
        }
    }
    check("linear", |tissue| tissue);
    check("nodal pressure", NodalPressure);
    check("nodal strain", NodalStrain);
}

/// Only eight are set apart: the last ones are tied together, but nothing else changes.
#[test]
fn more_bodies_than_are_set_apart_are_moved_as_well() {
    let [error, moved, others] = pulled(|tissue| tissue, 12, 10.0);
    println!("twelve: {:.3} mm off of {:.2}, others move {:.1e} mm", 1e3 * error, 1e3 * moved, 1e3 * others);
    assert!(error < 0.3 * moved && others == 0.0);
}
