//! Memory for the patches of tetrahedra with nodal strain: of a fixed capacity, of the caller, on the heap the same
//! bits; too little is told with what is enough.

use supple::element::{ElementTile, NodeInertia, PatchRow};
use supple::loads::Loads;
use supple::material::{AnyLaw, NeoHookean, NodalStrain, Tissue, VecMaterial};
use supple::scene::{BuildError, FixedScene, SceneFacts, SceneView, VecScene, patch_rows_for, tiles_for};
use supple::state::{AsState, FixedState, VecState};
use supple::step::{CriticalStep, Status, Step};
use supple::tled;

use crate::reference::nodal_pressure::Tissues;
use crate::reference::nodal_strain::forces as exact_forces;
use crate::support::bodies::{held, small_bar};
use crate::support::{
    Body, NEO, at_run_time, forces, norm, norm_of_sum, reference_law, regions, rest_of, tissue, widened,
};

/// Three tissues mixed at random, some of whose elements around a node share no face.
fn three_tissues(body: &Body) -> ([Tissue<AnyLaw>; 3], Vec<u16>) {
    let tissues = [300.0, 500.0, 800.0].map(|c| tissue(NeoHookean { c, d: 20_000.0 }));
    (tissues, (0..body.tets.len() as u32).map(|element| (element.wrapping_mul(2_654_435_761) % 3) as u16).collect())
}

/// Energy, critical step and bits of displacements after some steps.
fn moved(scene: SceneView<'_, VecMaterial>, mut state: impl AsState) -> (f64, CriticalStep, Vec<[u32; 3]>) {
    let loads = Loads::new(&scene, [1.0, 0.0, -9.81], &[], &[]).unwrap();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::new(0.5 * critical.seconds, 5.0, critical).unwrap();
    for _ in 0..300 {
        assert_eq!(tled::step(&scene, &loads, &mut state, &step), Status::Ok);
    }
    let energy = tled::strain_energy(&scene, &mut state).expect("room");
    let state = state.as_state();
    let moved = state.displacements().iter().take(scene.node_count()).map(|u| u.to_array().map(f32::to_bits)).collect();
    (energy, critical, moved)
}

/// A scene of a fixed capacity and one in memory of the caller move as one on the heap does.
#[test]
fn any_memory_gives_the_same_bits() {
    const ROWS: usize = patch_rows_for(96, 270, 3);
    let body = small_bar();
    assert_eq!((body.points.len(), body.tets.len()), (96, 270));
    let (tissues, of_element) = three_tissues(&body);
    let values = tissues.map(|tissue| tissue.values());
    let material = at_run_time(&NodalStrain(regions(NEO, &values, &of_element)));
    let on_heap = VecScene::build(material.clone(), &body.mesh(), &held(&body)).unwrap();
    let expected = moved(on_heap.view(), rest_of(&on_heap));

    let mut fixed = FixedScene::<_, 100, 20, ROWS>::new(material.clone());
    fixed.build(&body.mesh(), &held(&body)).unwrap();
    assert_eq!(fixed.patch_row_count(), on_heap.patch_row_count());
    assert!(moved(fixed.view(), FixedState::<100, 100>::new()) == expected);

    let (mut nodes, mut tiles) = ([NodeInertia::EMPTY; 100], [ElementTile::EMPTY; 20]);
    let mut rows = [PatchRow::EMPTY; ROWS];
    let supports = held(&body).into_iter();
    let facts =
        SceneFacts::build(&material, &body.mesh(), supports, &mut nodes, &mut tiles, &mut rows, &mut []).unwrap();
    let view = SceneView::new(&material, &nodes, &tiles, &rows, &[], &facts);
    assert!(moved(view, VecState::at_rest(96)) == expected);
    // Those who have no patches have no memory for them.
    assert_eq!(size_of::<FixedScene<(), 100, 20, ROWS>>() - size_of::<FixedScene<(), 100, 20>>(), 320 * ROWS);
}

fn built(material: &VecMaterial, body: &Body, rows: usize) -> Result<SceneFacts, BuildError> {
    let mut nodes = vec![NodeInertia::EMPTY; body.points.len()];
    let mut tiles = vec![ElementTile::EMPTY; tiles_for(body.tets.len())];
    let mut rows = vec![PatchRow::EMPTY; rows];
    SceneFacts::build(material, &body.mesh(), [].into_iter(), &mut nodes, &mut tiles, &mut rows, &mut [])
}

/// Rows that are needed, and rows that are then in use. With fewer the error tells of enough, from some capacity on
/// exactly; `most` rows are enough where not even nodes can be counted.
fn rows_needed(material: &VecMaterial, body: &Body, most: usize) -> (usize, usize) {
    let mut last = 0;
    for capacity in 0.. {
        match built(material, body, capacity) {
            Ok(facts) => {
                assert_eq!(last, capacity, "what was told last was not exact");
                return (capacity, facts.patch_row_count());
            }
            Err(BuildError::PatchCapacity { needed, capacity: there }) => {
                assert!(there == capacity && needed > capacity);
                assert!(needed == last || needed == most || built(material, body, needed).is_ok());
                last = needed;
            }
            Err(error) => panic!("{error}"),
        }
    }
    unreachable!()
}

#[test]
fn too_little_room_tells_how_much_is_enough() {
    let body = small_bar();
    let (tissues, of_element) = three_tissues(&body);
    let bound = |body: &Body, tissues| patch_rows_for(body.points.len(), body.tets.len(), tissues);
    let print = |what: &str, (needed, taken): (usize, usize), bound: usize| {
        println!("{what}: {taken} rows in use, {needed} to build it, {bound} by the formula");
        assert!(needed <= bound && taken <= needed);
    };
    let most = bound(&body, 1);
    print("one tissue", rows_needed(&at_run_time(&NodalStrain(tissues[0])), &body, most), most);
    let values = tissues.map(|tissue| tissue.values());
    let regions = regions(NEO, &values, &of_element);
    let most = bound(&body, 3);
    print("three tissues", rows_needed(&at_run_time(&NodalStrain(regions)), &body, most), most);
    for body in [Body::slivers([0.04, 0.04, 0.04]), Body::lobe(), Body::cylinder()] {
        let facts = built(&at_run_time(&NodalStrain(tissues[0])), &body, bound(&body, 1)).expect("enough");
        println!("{} elements: {} rows in use", body.tets.len(), facts.patch_row_count());
    }
}

/// 200 elements that share a node and nothing else: more neighbours than the formula counts on.
#[test]
fn a_node_with_many_neighbours_is_no_obstacle() {
    let mut body = Body { points: vec![[0.0; 3]], tets: Vec::new() };
    for number in 0..200_u32 {
        let at = |angle: f32, z: f32| [angle.sin(), angle.cos(), z];
        let angle = 0.03 * number as f32;
        body.points.extend([at(angle, 0.0), at(angle + 0.01, 0.0), at(angle, 0.01)]);
        body.tets.push([0, 3 * number + 2, 3 * number + 1, 3 * number + 3]);
    }
    let usual = patch_rows_for(601, 200, 1);
    let (needed, taken) = rows_needed(&at_run_time(&NodalStrain(tissue(NEO))), &body, usual);
    assert!(taken > 600 && needed > usual);
    let scene = body.scene(NodalStrain(tissue(NEO)), &[]);
    assert_eq!(scene.patch_row_count(), taken);
    let u: Vec<_> = body.points.iter().map(|[x, y, z]| [1e-2 * x * y, 5e-3 * z - 1e-2 * y * y, 1e-3 * x]).collect();
    let tissues = Tissues { mesh: &body.reference(), laws: &[reference_law(NEO)], of_element: &[0; 200] };
    let exact = exact_forces(&tissues, &widened(&u));
    let opposite: Vec<_> = exact.iter().map(|force| force.map(|component| -component)).collect();
    let error = norm_of_sum(&forces(&scene, &u), &opposite) / norm(&exact);
    println!("forces {error:.1e}");
    assert!(error < 1e-5);
}
