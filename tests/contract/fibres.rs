//! What steps promise of tissue with fibres: energy is kept, long steps and rest agree with exact steps, threads change no
//! bit, scenes that lack directions are refused in words.

use supple::element::{FibreTile, NodeInertia, PatchRow};
use supple::inertia::{self, Cells};
use supple::loads::Loads;
use supple::material::{Directions, Element, FibreError, Fibres, NeoHookean, Prony, TissueValues, VecMaterial};
use supple::scene::{BuildError, FixedScene, SceneFacts, Support, VecScene, fibre_tiles_for};
use supple::simulation::{Method, Settings, Simulation};
use supple::state::{NodeVector, VecState};
use supple::step::{Status, Step};
use supple::tled;

use crate::contract::parts::same_bits_in_parts;
use crate::support::{Body, EXP, NEO, bits, bound, largest_distance, to_f64};

const ELEMENTS: [Element; 3] = Element::ALL;

/// Fibres, sheets and their coupling, of which the first are three times as stiff as the tissue.
fn all() -> Fibres {
    Fibres::new([Some([3_000.0, 5.0]), Some([1_000.0, 5.0]), Some([500.0, 5.0])]).unwrap()
}

/// They wind about the axis of a bar of 3 cm, along which it is z.
fn directions(body: &Body) -> Vec<Directions> {
    let middle = |tet: &[u32; 4]| tet.iter().map(|&node| body.points[node as usize][0] / 4.0).sum::<f32>();
    let of = |x: f32| {
        let angle = 0.6 * (x / 0.015 - 1.0);
        Directions { fibre: [0.0, angle.sin(), angle.cos()], sheet: [1.0, 0.0, 0.0] }
    };
    body.tets.iter().map(|tet| of(middle(tet))).collect()
}

fn material(element: Element, fibres: Option<Fibres>, body: &Body) -> VecMaterial {
    let tissue = VecMaterial::one(element, NEO, 1000.0);
    match fibres {
        Some(fibres) => VecMaterial { fibres: vec![fibres], directions: directions(body), ..tissue },
        None => tissue,
    }
}

fn body() -> Body {
    Body::irregular([0.03, 0.03, 0.06], [3, 3, 6])
}

fn held(body: &Body) -> Vec<Support> {
    body.nodes_where(|[_, _, z]| z == 0.0).into_iter().map(Support::fixed).collect()
}

/// A bar of 6 cm that leans and hangs.
fn bar(element: Element, fibres: Option<Fibres>) -> Simulation<'static> {
    let body = body();
    made_of(material(element, fibres, &body))
}

fn made_of(material: VecMaterial) -> Simulation<'static> {
    let body = body();
    let supports = held(&body);
    let mut simulation = Simulation::new(body.points, body.tets, material, &supports).unwrap();
    simulation.gravity = [2.0, 0.0, 3.0];
    simulation.with(Settings { damping: 10.0, ..Settings::default() })
}

fn apart(a: &[NodeVector], b: &[NodeVector]) -> f64 {
    largest_distance(&to_f64(a), &to_f64(b))
}

fn moved(at: &[NodeVector]) -> f64 {
    apart(at, &vec![NodeVector::ZERO; at.len()])
}

/// Without damping and loads a bar that is thrown keeps its energy, with fibres taut and slack in turn.
#[test]
fn a_bar_that_is_thrown_keeps_its_energy() {
    for element in ELEMENTS {
        let body = body();
        let scene = VecScene::build(material(element, Some(all()), &body), &body.mesh(), &held(&body)).unwrap();
        let mut state = VecState::of(scene.view());
        let critical = bound(&scene, &state);
        let step = Step::new(0.4 * critical.seconds, 0.0, critical).unwrap();
        let thrown = |node: usize| {
            let [x, _, z] = body.points[node];
            ([0.0; 3], [20.0 * z * z, 0.0, -20.0 * z * x])
        };
        assert!(tled::start(&scene, &mut state, &step, thrown));
        let start = state.energy_balance().start;
        let (mut worst, mut least) = (0.0_f64, start);
        for _ in 0..40 {
            for _ in 0..100 {
                assert_eq!(tled::step(&scene, &Loads::NONE, &mut state, &step), Status::Ok);
            }
            let kinetic = state.energy_balance().kinetic;
            let all = tled::strain_energy(&scene, &mut state).unwrap() + kinetic;
            (worst, least) = (worst.max((all - start).abs() / start), least.min(kinetic));
        }
        println!("{element:?}: energy within {worst:.1e}, kinetic down to {:.2} of it", least / start);
        assert!(worst < 0.02 && least < 0.5 * start);
    }
}

/// They rest at the same place by exact and long steps and by settling, elsewhere than without fibres.
#[test]
fn every_way_to_rest_leads_to_the_same_place() {
    for element in ELEMENTS {
        let rest = |method: Method<'static>, multiple: Option<f32>, fibres: Option<Fibres>| {
            let mut simulation = bar(element, fibres);
            let critical = simulation.critical_step().unwrap().seconds;
            let step = multiple.map(|multiple| multiple * critical);
            simulation.set(Settings { method, step, damping: 20.0, ..Settings::default() });
            for _ in 0..150 {
                let report = simulation.advance(1.0 / 30.0).unwrap();
                assert!(report.status.is_taken(), "{element:?}: {:?}", report.status);
            }
            simulation.displacements().to_vec()
        };
        let exact = rest(Method::Exact, None, Some(all()));
        let without = rest(Method::Exact, None, None);
        let mut settled = bar(element, Some(all()));
        assert!(settled.settle(1e-6, 20_000).unwrap().at_rest);
        let (way, others) = (moved(&exact), apart(&exact, &without));
        let off = apart(&exact, settled.displacements()) / way;
        println!("{element:?}: {:.2} mm (without fibres {:.2} apart), settled {off:.1e} off", 1e3 * way, 1e3 * others);
        assert!(others > 0.1 * way && off < 1e-3);
        for multiple in [10.0, 20.0, 50.0] {
            let method = inertia::Method::new(Cells::Suggested);
            let long = rest(Method::Long(method), Some(multiple), Some(all()));
            let off = apart(&exact, &long) / way;
            println!("{element:?}: {off:.1e} off after {multiple} times the critical step");
            assert!(off < 5e-4);
        }
    }
}

/// On the way there long steps are as right as in tissue without fibres that is as stiff.
#[test]
fn long_steps_swing_as_exact_ones() {
    for element in ELEMENTS {
        let swing = |method: Method<'static>, step: Option<f32>, material: &VecMaterial| {
            let mut simulation = made_of(material.clone());
            simulation.set(Settings { method, step, damping: 5.0, ..Settings::default() });
            let mut shapes = vec![];
            for _ in 0..30 {
                let report = simulation.advance(1.0 / 60.0).unwrap();
                assert!(report.status.is_taken(), "{element:?}: {:?}", report.status);
                shapes.push(simulation.displacements().to_vec());
            }
            shapes
        };
        let stiff = VecMaterial::one(element, NeoHookean { c: 1_500.0, d: 25_000.0 }, 1000.0);
        for multiple in [10.0, 20.0] {
            let tissues = [material(element, Some(all()), &body()), stiff.clone()];
            let [fibrous, plain] = tissues.map(|material| {
                let exact = swing(Method::Exact, None, &material);
                let step = multiple * made_of(material.clone()).critical_step().unwrap().seconds;
                let long = swing(Method::Long(inertia::Method::new(Cells::Suggested)), Some(step), &material);
                let most = exact.iter().map(|shape| moved(shape)).fold(0.0, f64::max);
                let off = exact.iter().zip(&long).map(|(a, b)| apart(a, b)).sum::<f64>() / exact.len() as f64;
                (100.0 * off / most, 1e3 * most, 1e6 * step)
            });
            println!(
                "{element:?} {multiple}x: (% off in the mean, of mm, step in us) {fibrous:.2?}, without fibres {plain:.2?}"
            );
            assert!(fibrous.0 < 1.5 * plain.0 + 0.2);
        }
    }
}

/// Also with several tissues of which one has no fibres, and one relaxes.
#[test]
fn every_number_of_threads_gives_the_same_bits() {
    for element in ELEMENTS {
        let body = Body::bar([0.05, 0.05, 0.11], [7, 7, 15]);
        let third = body.tets.len() / 3;
        let tissues: Vec<TissueValues> = vec![VecMaterial::one(element, EXP, 1000.0).tissues[0]; 3];
        let of_element = (0..body.tets.len()).map(|tet| (tet / (third + 1)) as u16).collect();
        let one = Fibres::new([Some([18_472.0, 16.0]), None, None]).unwrap();
        let prony = vec![Prony::new(&[[0.5, 0.01]]).unwrap()];
        let several = VecMaterial {
            tissues,
            of_element,
            prony,
            fibres: vec![all(), Fibres::NONE, one],
            directions: directions(&body),
            ..VecMaterial::one(element, EXP, 1000.0)
        };
        for material in [material(element, Some(all()), &body), several] {
            let scene = VecScene::build(material, &body.mesh(), &held(&body)).unwrap();
            same_bits_in_parts(&scene, 1e-5);
        }
    }
}

/// Tissue without fibres in a scene with them is what it is without.
#[test]
fn fibres_of_another_tissue_do_not_count() {
    for element in ELEMENTS {
        let body = body();
        let run = |fibres: Vec<Fibres>| {
            let tissue = material(element, None, &body);
            let has = !fibres.is_empty();
            let directions = if has { directions(&body) } else { vec![] };
            let tissues = vec![tissue.tissues[0]; 2];
            let of_element = vec![0; body.tets.len()];
            let material = VecMaterial { tissues, of_element, fibres, directions, ..tissue };
            let scene = VecScene::build(material, &body.mesh(), &held(&body)).unwrap();
            let loads = Loads::new(&scene, [2.0, 0.0, 3.0], &[], &[]).unwrap();
            let mut state = VecState::of(scene.view());
            let step = Step::unchecked(1e-4, 20.0).unwrap();
            for _ in 0..500 {
                assert!(tled::step(&scene, &loads, &mut state, &step).is_taken());
            }
            to_f64(state.displacements())
        };
        let (with, without) = (run(vec![Fibres::NONE, all()]), run(vec![]));
        let off = largest_distance(&with, &without);
        println!("{element:?}: {off:.1e} m");
        assert!(off < 1e-6 && largest_distance(&with, &vec![[0.0; 3]; with.len()]) > 1e-3);
    }
}

/// In memory that the caller lends, of a fixed size, fibres need tiles of directions.
#[test]
fn scenes_without_a_heap_have_room_for_directions_or_say_so() {
    for element in ELEMENTS {
        let body = body();
        let material = material(element, Some(all()), &body);
        let tiles = fibre_tiles_for(element, body.points.len(), body.tets.len(), 1);
        let mut scene = FixedScene::<_, 200, 80, 800, 80>::new(material.clone());
        scene.build(&body.mesh(), &held(&body)).unwrap();
        let owned = VecScene::build(material.clone(), &body.mesh(), &held(&body)).unwrap();
        let step = Step::unchecked(1e-4, 20.0).unwrap();
        let mut states = [VecState::of(scene.view()), VecState::of(owned.view())];
        for state in &mut states {
            let loads = Loads::new(&owned, [2.0, 0.0, 3.0], &[], &[]).unwrap();
            assert!((0..20).all(|_| tled::step(&owned, &loads, state, &step).is_taken()));
        }
        assert_eq!(bits(&states[0]), bits(&states[1]));
        let mut small = FixedScene::<_, 200, 80, 800, 2>::new(material.clone());
        let error = small.build(&body.mesh(), &held(&body)).unwrap_err();
        println!("{element:?}: {error}; {tiles} are enough for any");
        let BuildError::FibreCapacity { needed, capacity: 2 } = error else { panic!("{error}") };
        assert!(needed <= tiles && needed > 2);
        let mut nodes = vec![NodeInertia::EMPTY; body.points.len()];
        let mut rows = vec![PatchRow::EMPTY; 800];
        let mut lent = vec![FibreTile::EMPTY; needed];
        let mut elements = vec![supple::element::ElementTile::EMPTY; 80];
        let supports = held(&body).into_iter();
        SceneFacts::build(&material, &body.mesh(), supports, &mut nodes, &mut elements, &mut rows, &mut lent).unwrap();
    }
}

#[test]
fn fibres_that_cannot_be_are_told() {
    let body = body();
    let built = |directions: Vec<Directions>| {
        let material = VecMaterial { directions, ..material(Element::Linear, Some(all()), &body) };
        VecScene::build(material, &body.mesh(), &[]).map(|_| ()).unwrap_err()
    };
    let good = directions(&body);
    let with = |fibre: [f32; 3], sheet: [f32; 3]| {
        let mut all = good.clone();
        all[5] = Directions { fibre, sheet };
        built(all)
    };
    for error in [
        built(vec![]),
        with([0.0; 3], [1.0, 0.0, 0.0]),
        with([0.0, f32::NAN, 1.0], [1.0, 0.0, 0.0]),
        with([0.0, 1.0, 0.0], [0.0, -2.0, 0.0]),
        with([0.0, 1.0, 0.0], [0.0; 3]),
    ] {
        println!("{error}");
        assert!(matches!(
            error,
            BuildError::DirectionCount { directions: 0, .. } | BuildError::Direction { element: 5, .. }
        ));
    }
    for (terms, expected) in [
        ([Some([-1.0, 1.0]), None, None], (0, 0)),
        ([None, Some([1.0, f32::INFINITY]), None], (1, 1)),
        ([None, None, Some([f32::NAN, 1.0])], (2, 0)),
    ] {
        let error: FibreError = Fibres::new(terms).unwrap_err();
        println!("{error}");
        assert_eq!((error.term, error.constant), expected);
    }
}
