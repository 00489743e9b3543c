//! What steps promise of tissue that relaxes: a refused step leaves no trace, threads and methods agree, rest is that of
//! the softened law, a scene that takes another's place keeps what tissue remembers.

use supple::guard::{EVERY, Guard};
use supple::inertia::{self, Cells, LargeStep};
use supple::loads::{Loads, NodalForce};
use supple::material::{AnyLaw, Directions, Element, Fibres, NeoHookean, Prony, PronyError, TissueValues, VecMaterial};
use supple::scene::{Support, VecScene};
use supple::simulation::{Method, Settings, Simulation};
use supple::state::{NodeVector, VecState};
use supple::step::{Cause, Divergence, Status, Step};
use supple::tled;

use crate::contract::parts::same_bits_in_parts;
use crate::support::{Body, EXP, NEO, bits, bound, largest_distance, to_f64};

const ELEMENTS: [Element; 3] = Element::ALL;
const TERMS: [[f32; 2]; 2] = [[0.3, 0.02], [0.3, 0.3]];
/// m/s^2.
const GRAVITY: [f32; 3] = [0.6, 0.0, -1.0];

fn material(element: Element, law: AnyLaw, terms: &[[f32; 2]]) -> VecMaterial {
    let tissue = VecMaterial::one(element, law, 1000.0);
    if terms.is_empty() { tissue } else { VecMaterial { prony: vec![Prony::new(terms).unwrap()], ..tissue } }
}

fn held(body: &Body) -> Vec<Support> {
    body.nodes_where(|[_, _, z]| z == 0.0).into_iter().map(Support::fixed).collect()
}

/// A bar of 6 cm that hangs and leans.
fn bar(element: Element, terms: &[[f32; 2]]) -> Simulation<'static> {
    let body = Body::irregular([0.03, 0.03, 0.06], [3, 3, 6]);
    let supports = held(&body);
    let mut simulation = Simulation::new(body.points, body.tets, material(element, NEO, terms), &supports).unwrap();
    simulation.gravity = GRAVITY;
    simulation.with(Settings { damping: 20.0, ..Settings::default() })
}

fn apart(a: &[NodeVector], b: &[NodeVector]) -> f64 {
    largest_distance(&to_f64(a), &to_f64(b))
}

fn moved(simulation: &Simulation<'_>) -> f64 {
    apart(simulation.displacements(), &vec![NodeVector::ZERO; simulation.points().len()])
}

#[test]
fn a_refused_step_leaves_no_trace() {
    for element in ELEMENTS {
        let body = Body::irregular([0.03, 0.03, 0.06], [3, 3, 6]);
        let scene = VecScene::build(material(element, NEO, &TERMS), &body.mesh(), &held(&body)).unwrap();
        let mut state = VecState::of(scene.view());
        let step = Step::new(0.5 * bound(&scene, &state).seconds, 5.0, bound(&scene, &state)).unwrap();
        let loads = Loads::new(&scene, GRAVITY, &[], &[]).unwrap();
        let run = |state: &mut VecState, steps: u32| {
            for _ in 0..steps {
                assert_eq!(tled::step(&scene, &loads, state, &step), Status::Ok);
            }
        };
        run(&mut state, 200);
        let mut other = state.clone();
        let torn = [NodalForce { node: body.farthest(2), newton: [1e6, 0.0, 0.0], ramp: 0.0 }];
        let tears = Loads::new(&scene, GRAVITY, &torn, &[]).unwrap();
        let status = tled::step(&scene, &tears, &mut state, &step);
        assert!(matches!(status, Status::Diverged(Divergence { cause: Cause::Force { .. }, .. })), "{status:?}");
        run(&mut state, 200);
        run(&mut other, 200);
        assert_eq!(bits(&state), bits(&other), "{element:?}");
    }
}

#[test]
fn every_number_of_threads_gives_the_same_bits() {
    for element in ELEMENTS {
        let body = Body::bar([0.05, 0.05, 0.11], [7, 7, 15]);
        let half = body.tets.len() / 2;
        let tissues: Vec<TissueValues> = vec![material(element, EXP, &[]).tissues[0]; 2];
        let of_element = (0..body.tets.len()).map(|tet| u16::from(tet > half)).collect();
        let prony = vec![Prony::new(&TERMS).unwrap(), Prony::new(&[[0.5, 0.001]]).unwrap()];
        let several = VecMaterial { element, law: EXP, tissues, of_element, prony, fibres: vec![], directions: vec![] };
        for material in [material(element, EXP, &TERMS), several] {
            let scene = VecScene::build(material, &body.mesh(), &held(&body)).unwrap();
            same_bits_in_parts(&scene, 2e-5);
        }
    }
}

/// Memory may be longer than a scene needs: a guard, which copies it, estimates the same.
#[test]
fn longer_memory_changes_no_bit() {
    for element in ELEMENTS {
        let body = Body::irregular([0.03, 0.03, 0.06], [3, 3, 6]);
        let scene = VecScene::build(material(element, NEO, &TERMS), &body.mesh(), &held(&body)).unwrap();
        let needed = scene.view().memory_vectors();
        let critical = bound(&scene, &VecState::of(scene.view()));
        let (exact, long) = (Step::new(0.5 * critical.seconds, 5.0, critical).unwrap(), 10.0 * critical.seconds);
        let long = Step::unchecked(long, 5.0).unwrap();
        let loads = Loads::new(&scene, GRAVITY, &[], &[]).unwrap();
        let of = |vectors: usize| {
            let mut state = VecState::at_rest(scene.node_count());
            let mut memory = vec![NodeVector::ZERO; vectors];
            // An odd number: the second copy is that of now.
            for _ in 0..301 {
                let mut view = state.view().remembering(&mut memory);
                assert_eq!(tled::step(&scene, &loads, &mut view, &exact), Status::Ok);
            }
            let mut view = state.view().remembering(&mut memory);
            let method = inertia::Method::new(Cells::Suggested);
            let points = &body.points;
            let mut large = LargeStep::prepare_in_vec(method, scene.view(), points, view.reborrow(), long).unwrap();
            let mut guard = Guard::prepare_in_vec(scene.view(), points, view.reborrow(), long, EVERY).unwrap();
            for _ in 0..12 {
                let status = large.step(scene.view(), &loads, view.reborrow());
                assert!(guard.follow(status, scene.view(), &loads, view.reborrow()).is_taken());
            }
            (bits(&state), guard.estimate().unwrap().mean.to_bits())
        };
        assert_eq!(of(needed), of(needed + 2 * 24), "{element:?}");
    }
}

/// What it has no room for a state cannot remember.
#[test]
fn a_state_without_room_is_refused_in_words() {
    let body = Body::bar([0.03, 0.03, 0.06], [2, 2, 4]);
    let scene = VecScene::build(material(Element::Linear, NEO, &TERMS), &body.mesh(), &held(&body)).unwrap();
    let mut state = VecState::at_rest(scene.node_count());
    let step = Step::unchecked(1e-5, 0.0).unwrap();
    let status = tled::step(&scene, &Loads::NONE, &mut state, &step);
    let Status::Diverged(divergence) = status else { panic!("{status:?}") };
    assert_eq!((divergence.cause, state.steps()), (Cause::NoRelaxation, 0));
    println!("{divergence}");
}

#[test]
fn what_is_no_series_is_told() {
    let told = |terms: &[[f32; 2]]| Prony::new(terms).unwrap_err();
    assert_eq!(told(&[[0.1, 1.0]; 4]), PronyError::Count { terms: 4 });
    assert!(matches!(told(&[[0.1, 1.0], [f32::NAN, 1.0]]), PronyError::Share { term: 1, .. }));
    assert!(matches!(told(&[[-0.1, 1.0]]), PronyError::Share { term: 0, .. }));
    assert!(matches!(told(&[[0.1, 0.0]]), PronyError::Seconds { term: 0, .. }));
    assert!(matches!(told(&[[0.1, f32::INFINITY]]), PronyError::Seconds { term: 0, .. }));
    let sum = told(&[[0.5, 1.0], [0.5, 2.0]]);
    assert_eq!(sum, PronyError::Sum { value: 1.0 });
    for error in [told(&[[0.1, 1.0]; 4]), told(&[[-0.1, 1.0]]), told(&[[0.1, 0.0]]), sum] {
        println!("{error}");
    }
}

/// At rest the share that has not relaxed holds the body: the law with so much less shear modulus. With nodal strain the
/// stabilising energy does not relax: it is at least half of the law's, where 0.4 of the stress is left.
#[test]
fn settled_tissue_rests_as_the_softened_law() {
    for (element, share) in [(Element::Linear, 1e-3), (Element::NodalPressure, 1e-3), (Element::NodalStrain, 0.08)] {
        let mut relaxed = bar(element, &TERMS);
        let settled = relaxed.settle(1e-6, 20_000).unwrap();
        assert!(settled.at_rest, "{settled:?}");
        let mut softer = bar(element, &[]);
        let AnyLaw::NeoHookean(NeoHookean { c, d }) = NEO else { unreachable!() };
        let law = NeoHookean { c: 0.4 * c, d };
        softer.exchange(VecMaterial::one(element, law, 1000.0), &[]).unwrap();
        assert!(softer.settle(1e-6, 20_000).unwrap().at_rest);
        let stiff = {
            let mut stiff = bar(element, &[]);
            assert!(stiff.settle(1e-6, 20_000).unwrap().at_rest);
            moved(&stiff)
        };
        let (way, distance) = (moved(&relaxed), apart(relaxed.displacements(), softer.displacements()));
        println!(
            "{element:?}: rests {:.3} mm away (unrelaxed {:.3}), {distance:.2e} m from the softened law",
            1e3 * way,
            1e3 * stiff
        );
        assert!(way > 1.8 * stiff && distance < share * way, "{distance:.2e}");
        // It has had the time: nothing moves any more.
        let before = relaxed.displacements().to_vec();
        relaxed.advance(0.3).unwrap();
        let since = apart(&before, relaxed.displacements());
        assert!(since < 2e-5, "{since:.2e} m in 0.3 s");
    }
}

/// A body creeps: after the first swing it sinks on for longer than a second, by long steps as by exact ones.
#[test]
fn long_and_adaptive_steps_creep_as_exact_ones() {
    let of = |element: Element, terms: &[[f32; 2]], method: Method<'static>, step: Option<f32>| {
        let mut simulation = bar(element, terms);
        let settings = Settings { method, step, damping: 20.0, tolerance: Some(1e-4), ..Settings::default() };
        simulation.set(settings);
        let mut shapes = vec![];
        for _ in 0..60 {
            let report = simulation.advance(1.0 / 60.0).unwrap();
            assert!(report.status.is_taken(), "{:?}", report.status);
            shapes.push(simulation.displacements().to_vec());
        }
        shapes
    };
    let mean = |a: &[Vec<NodeVector>], b: &[Vec<NodeVector>]| {
        a.iter().zip(b).map(|(a, b)| apart(a, b)).sum::<f64>() / a.len() as f64
    };
    for element in ELEMENTS {
        let critical = bar(element, &TERMS).critical_step().unwrap().seconds;
        for multiple in [10.0, 20.0, 50.0] {
            let [relaxing, elastic] = [&TERMS[..], &[]].map(|terms| {
                let exact = of(element, terms, Method::Exact, None);
                let long = Method::Long(inertia::Method::new(Cells::Suggested));
                let long = of(element, terms, long, Some(multiple * critical));
                (mean(&exact, &long), exact)
            });
            let way = |of: &(f64, Vec<Vec<NodeVector>>)| {
                let last = of.1.last().unwrap();
                apart(last, &vec![NodeVector::ZERO; last.len()])
            };
            let sunk = apart(&relaxing.1[20], relaxing.1.last().unwrap());
            let [share, of_elastic] = [&relaxing, &elastic].map(|of| 100.0 * of.0 / way(of));
            println!(
                "{element:?} {multiple}x: {share:.2} % of {:.2} mm off, without relaxation {of_elastic:.2} % of {:.2} mm; sinks \
                 by {:.2} mm after 0.35 s",
                1e3 * way(&relaxing),
                1e3 * way(&elastic),
                1e3 * sunk
            );
            assert!(sunk > 0.05 * way(&relaxing) && share < 1.2 * of_elastic);
        }
        let exact = of(element, &TERMS, Method::Exact, None);
        let auto = of(element, &TERMS, Method::Auto(inertia::Method::new(Cells::Suggested)), None);
        println!("{element:?} auto: {:.4} mm off", 1e3 * mean(&exact, &auto));
        assert!(mean(&exact, &auto) < 1e-4);
    }
}

/// Tissue that is cut from, or gets a name of its own, remembers as before.
#[test]
fn a_scene_that_takes_another_ones_place_keeps_what_tissue_remembers() {
    for element in ELEMENTS {
        let start = || {
            let mut simulation = bar(element, &TERMS);
            simulation.advance(0.1).unwrap();
            simulation
        };
        let end = |mut simulation: Simulation<'static>| {
            simulation.advance(0.1).unwrap();
            simulation.displacements().to_vec()
        };
        let plain = end(start());
        // The elements become a tissue of their own, with the law that they have.
        let named = end({
            let mut simulation = start();
            simulation.ablate(&(0..20).collect::<Vec<_>>(), NEO, 0.0).unwrap();
            simulation
        });
        let forgotten = end({
            let mut simulation = start();
            let (now, time) = (simulation.displacements().to_vec(), simulation.state().time());
            let span = simulation.state().last_step();
            simulation.state_mut().view().put(time, span, |node| [now[node].to_array(), [0.0; 3]]);
            simulation
        });
        let (with, without) = (apart(&plain, &named), apart(&plain, &forgotten));
        println!("{element:?}: {with:.1e} m apart, {without:.1e} m if all is forgotten");
        // Two tissues have a nodal pressure, or a nodal strain, each.
        let most = if element == Element::Linear { 1e-6 } else { 0.2 * without };
        assert!(with < most && without > 1e-4, "{with:.1e} {without:.1e}");
        let mut cut = start();
        cut.remove(&[0, 1, 2]).unwrap();
        assert!(cut.advance(0.1).unwrap().status.is_taken());
    }
}

/// Without damping and loads a bar that is thrown swings and loses energy, in steps of 0.9 of the critical one: it never
/// gains any.
#[test]
fn tissue_that_relaxes_only_loses_energy_up_to_the_critical_step() {
    for (element, law, fibrous) in
        ELEMENTS.into_iter().flat_map(|element| [(element, NEO, false), (element, EXP, false), (element, NEO, true)])
    {
        for terms in [&[[0.9, 1e-5]][..], &[[0.5, 0.003]], &[[0.3, 0.1], [0.3, 0.01], [0.3, 0.001]]] {
            let body = Body::irregular([0.03, 0.03, 0.06], [3, 3, 6]);
            let mut material = material(element, law, terms);
            if fibrous {
                material.fibres = vec![Fibres::new([Some([3_000.0, 5.0]), Some([1_000.0, 5.0]), None]).unwrap()];
                let along = Directions { fibre: [0.0, 0.6, 0.8], sheet: [1.0, 0.0, 0.0] };
                material.directions = vec![along; body.tets.len()];
            }
            let scene = VecScene::build(material, &body.mesh(), &held(&body)).unwrap();
            let mut state = VecState::of(scene.view());
            let thrown = |node: usize| {
                let [x, _, z] = body.points[node];
                ([0.0; 3], [10.0 * z * z, 0.0, -20.0 * z * x])
            };
            let critical = bound(&scene, &state);
            let step = Step::new(0.9 * critical.seconds, 0.0, critical).unwrap();
            assert!(tled::start(&scene, &mut state, &step, thrown));
            let start = state.energy_balance().start;
            let (mut before, mut gain, mut last) = (start, 0.0_f64, start);
            for round in 0..40 {
                for _ in 0..200 {
                    assert_eq!(tled::step(&scene, &Loads::NONE, &mut state, &step), Status::Ok, "{round}");
                }
                last = tled::strain_energy(&scene, &mut state).unwrap() + state.energy_balance().kinetic;
                gain = gain.max((last - before) / start);
                before = last;
            }
            println!(
                "{element:?}, {law}, fibres {fibrous}, {terms:?}: {:.1} % of the energy left, largest gain {gain:.1e}",
                100.0 * last / start
            );
            // What relaxes within a step takes nothing; kinetic and strain energy are of moments half a step apart.
            let most = if terms[0][1] < step.seconds() { 1.01 } else { 0.9 };
            assert!(last < most * start && gain < 3e-2, "{gain:.1e}");
        }
    }
}

/// Drawn, held, brought back and held there, tissue has energy in what it remembers alone. When it is let go it moves by
/// that, which nobody may call an error.
#[test]
fn energy_of_the_past_is_no_error() {
    for element in ELEMENTS {
        let mut drawn = bar(element, &[[0.8, 0.4]]);
        drawn.gravity = [0.0; 3];
        let body = Body::irregular([0.03, 0.03, 0.06], [3, 3, 6]);
        let top = body.nodes_where(|[_, _, z]| z == 0.06);
        let mut go = |newton: f32, frames: u32| {
            let force = |&node: &u32| NodalForce { node, newton: [newton / top.len() as f32, 0.0, 0.0], ramp: 0.0 };
            drawn.forces = top.iter().map(force).collect();
            let mut places = vec![];
            for _ in 0..frames {
                let report = drawn.advance(1.0 / 60.0).unwrap();
                assert_eq!(report.status, Status::Ok, "{element:?}");
                places.push(1e3 * drawn.displacements()[top[0] as usize].to_array()[0]);
            }
            places
        };
        let held = go(0.02, 90);
        // As far as it takes.
        let mut back = go(-0.01, 1);
        while back[back.len() - 1] > 0.25 * held[held.len() - 1] {
            back.extend(go(-0.015, 1));
        }
        let free = go(0.0, 90);
        let [held, back, end] = [&held, &back, &free].map(|places| *places.last().unwrap());
        let most = free.iter().fold(0.0_f32, |most, place| most.max(*place));
        println!("{element:?}: drawn to {held:.2} mm, back at {back:.2}, free up to {most:.2}, at last {end:.2}");
        assert!(back < 0.25 * held && most > 1.3 * back && end < 0.8 * most);
    }
}
