use super::*;

use supple::loads::Loads;
use supple::pulls::{MOST_STIFFNESS, Pull, PullError, PulledNode, Pulls, patch};
use supple::simulation::SimulationError;
use supple::step::{Cause, Status, Step};
use supple::tled;

#[test]
fn what_cannot_be_is_refused_in_words() {
    let nodes = [PulledNode { node: 3, weight: 1.0 }];
    let good = Pull::new([0, 1], [0.0; 3], 300.0);
    let refused = |pull: Pull| Pulls::new(10, &nodes, &[good, pull]).map(|_| ()).unwrap_err().to_string();
    for (pull, words) in [
        (Pull { nodes: [0, 0], ..good }, "pull 1: 0 nodes from entry 0 on, of a list of 1"),
        (Pull { nodes: [u32::MAX, 2], ..good }, "pull 1: 2 nodes from entry 4294967295 on"),
        (Pull { stiffness: -1.0, ..good }, "pull 1: a stiffness of -1 N/m, it must be from 0 (absent) to 1e6"),
        (Pull { stiffness: f32::NAN, ..good }, "pull 1: a stiffness of NaN N/m"),
        (Pull { stiffness: 2e6, ..good }, "pull 1: a stiffness of 2000000 N/m"),
        (Pull { most: -0.1, ..good }, "pull 1: a most force of -0.1 N"),
        (Pull { to: [0.0, f32::INFINITY, 0.0], ..good }, "pull 1: a component of its target is inf"),
        (
            Pull { from: [2e6; 3], ..good },
            "pull 1: a component of its target is 2000000, it must be a number up to 1e6",
        ),
        (Pull { along: [f32::NAN; 3], ..good }, "pull 1: a component of its direction is NaN"),
        (Pull { times: [0.0, f64::NAN], ..good }, "pull 1: a time of NaN s, it must be a finite number"),
        (Pull { turned: [0.0, f32::NAN, 0.0], ..good }, "pull 1: a component of its point is NaN"),
    ] {
        let told = refused(pull);
        assert!(told.starts_with(words), "{told}");
    }
    let told = Pulls::new(3, &nodes, &[good]).unwrap_err();
    assert_eq!(told.to_string(), "entry 0 of the pulled nodes: node 3 does not exist, the scene has 3 nodes");
    let heavy = [PulledNode { node: 3, weight: 1e30 }];
    assert!(Pulls::new(10, &heavy, &[good]).unwrap_err().to_string().ends_with("it must be a number up to 1e6"));
    let points: Vec<_> = BAR.points().collect();
    let mut room = [PulledNode::default(); 5];
    let told = patch(&points, |_| 1.0, [1.0, 0.015, 0.06], 0.01, &mut room).unwrap_err();
    assert_eq!(
        told.to_string(),
        "a pull of radius 10.000 mm: the nearest node is 970.000 mm away, a larger radius reaches it"
    );
    assert!(matches!(
        patch(&points, |_| 1.0, [0.015; 3], 0.02, &mut room),
        Err(PullError::Capacity { capacity: 5, .. })
    ));
    for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(patch(&points, |_| 1.0, [0.015; 3], radius, &mut room).is_err());
    }
}

#[test]
fn an_exact_step_without_room_for_the_forces_is_not_taken() {
    let mut body = bar(Element::Linear, true);
    let critical = body.critical_step().unwrap();
    let nodes = [PulledNode { node: 400, weight: 1.0 }];
    let pulls = [Pull { to: [0.1; 3], ..Pull::new([0, 1], [0.0; 3], 300.0) }];
    let loads = Loads::NONE.pulled_by(Pulls::new(body.scene().node_count(), &nodes, &pulls).unwrap());
    let step = Step::new(0.5 * critical.seconds, 0.0, critical).unwrap();
    let (scene, state) = body.parts_mut();
    let Status::Diverged(divergence) = tled::step(scene, &loads, state, &step) else { panic!("taken") };
    println!("{divergence}");
    assert_eq!((divergence.cause, state.steps()), (Cause::NoPulls, 0));
    state.make_room_for_pulls(1);
    assert_eq!(tled::step(scene, &loads, state, &step), Status::Ok);
    let other = Loads::NONE.pulled_by(Pulls::new(7, &[], &[]).unwrap());
    assert!(matches!(tled::step(scene, &other, state, &step), Status::Mismatch { .. }));
}

/// Whatever the host says, a state whose status is good holds numbers.
#[test]
fn no_pull_leaves_a_state_without_a_number() {
    let small = Bar { size: [0.02, 0.02, 0.04], cells: [2, 2, 4] };
    let tissue = VecMaterial::one(Element::NodalPressure, NeoHookean { c: 500.0, d: 10_000.0 }, 1000.0);
    let mut random = Random(11);
    let (mut taken, mut refused, mut not_checked) = (0, 0, 0);
    for run in 0..200 {
        let method = if run % 2 == 0 { Method::Exact } else { long() };
        let mut body = Simulation::new(small.points(), small.tets(), tissue.clone(), &[Support::fixed(0)]).unwrap();
        let step = (run % 2 == 1).then(|| 20.0 * body.critical_step().unwrap().seconds);
        body.set(settings(method, 5.0, step));
        for _ in 0..4 {
            let at = random.within(small.size);
            body.pull(at, 0.003 + 0.03 * random.next(), MOST_STIFFNESS * random.next()).ok();
        }
        for _ in 0..25 {
            for pull in &mut body.pulls {
                let wild = [1e-3, 1.0, 1e10, f32::MAX, f32::NAN, f32::INFINITY][(6.0 * random.next()) as usize % 6];
                match (8.0 * random.next()) as u32 {
                    0 => pull.to = [wild; 3],
                    1 => pull.stiffness = wild,
                    2 => pull.most = wild,
                    3 => pull.along = [0.0, wild, 1e-30],
                    _ => pull.put(random.within([0.05; 3])),
                }
            }
            match body.advance(0.002) {
                Ok(_) => {
                    taken += 1;
                    let is_number =
                        |vector: &supple::state::NodeVector| vector.to_array().iter().all(|c| c.is_finite());
                    assert!(body.displacements().iter().all(is_number), "run {run}");
                }
                Err(SimulationError::Pull(_)) => {
                    not_checked += 1;
                    for pull in &mut body.pulls {
                        *pull = Pull::new(pull.nodes, pull.at, 100.0);
                    }
                }
                Err(_) => {
                    refused += 1;
                    break;
                }
            }
        }
    }
    println!("{taken} calls taken, {refused} refused, {not_checked} with values that cannot be");
    assert!(taken > 1000 && not_checked > 100);
}
