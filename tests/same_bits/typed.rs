//! A program that knows its law and its tetrahedra when it is compiled moves its scene as one that chooses them at run
//! time does.

use supple::element::ElementMaterial;
use supple::loads::Loads;
use supple::material::{Element, NodalPressure, NodalStrain, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{Support, VecScene};
use supple::state::VecState;
use supple::step::{CriticalStep, Status, Step};
use supple::tled;

use crate::body::TISSUE;
use crate::level_guard;
use crate::sums::Level;

const BAR: Bar = Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 4] };

/// Energy, critical step and bits of displacements after some steps under gravity.
fn moved<M: ElementMaterial>(material: M) -> (f64, CriticalStep, Vec<[u32; 3]>) {
    let (points, tets): (Vec<_>, Vec<_>) = (BAR.points().collect(), BAR.tets().collect());
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let scene =
        VecScene::build(material, &mesh, &std::array::from_fn::<_, 12, _>(|node| Support::fixed(node as u32))).unwrap();
    let mut state = VecState::at_rest(points.len());
    let loads = Loads::new(&scene, [1.0, 0.0, -9.81], &[], &[]).unwrap();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::new(0.5 * critical.seconds, 5.0, critical).unwrap();
    for _ in 0..300 {
        assert_eq!(tled::step(&scene, &loads, &mut state, &step), Status::Ok);
    }
    let energy = tled::strain_energy(&scene, &mut state).expect("room");
    (energy, critical, state.displacements().iter().map(|u| u.to_array().map(f32::to_bits)).collect())
}

#[test]
fn a_material_chosen_at_run_time_gives_the_same_bits() {
    let _guard = level_guard();
    let chosen = |element| moved(VecMaterial::one(element, TISSUE.law, TISSUE.density));
    for level in Level::available() {
        assert!(Level::force(level));
        println!("{level:?}: {:.3e} J", moved(TISSUE).0);
        assert!(moved(TISSUE) == chosen(Element::Linear) && moved(TISSUE).0 > 0.0);
        assert!(moved(NodalPressure(TISSUE)) == chosen(Element::NodalPressure));
        assert!(moved(NodalStrain(TISSUE)) == chosen(Element::NodalStrain));
    }
}
