//! Crushed elements with nodal strain: tissue that hangs, or is pressed together, does not turn inside out, and what
//! is computed does not depend on when the step looked which elements are crushed.

use supple::loads::{Loads, Motion, NodalForce};
use supple::material::{NeoHookean, NodalPressure, NodalStrain};
use supple::scene::{AsScene, Axes, Support, VecScene};
use supple::state::{NodeVector, Progress, StateView, VecState};
use supple::step::{Status, Step};
use supple::tled;

use crate::physics::nodal_elements::{noise, same_bits_in_parts_from};
use crate::reference::tensor::determinant;
use crate::support::{Body, bits, bound, displaced, distances, fixed, rest_of, tissue, widened};

/// From Young's modulus (Pa) and Poisson's ratio.
fn neo_hookean(young: f64, nu: f64) -> NeoHookean {
    NeoHookean { c: (young / (4.0 * (1.0 + nu))) as f32, d: (young / (6.0 * (1.0 - 2.0 * nu))) as f32 }
}

fn held_where(body: &Body, held: impl Fn([f32; 3]) -> bool) -> Vec<Support> {
    fixed(&body.nodes_where(held))
}

/// Exact steps of three quarters of the critical one until `end` (s). Gives the least volume ratio of an element that
/// was ever seen, and fails where a step is not `Ok`.
fn run_until<M: supple::element::ElementMaterial>(
    scene: &VecScene<M>,
    loads: &Loads<'_>,
    state: &mut VecState,
    damping: f32,
    end: f64,
) -> f32 {
    let mut least = 1.0f32;
    while state.time() < end {
        let step = Step::unchecked(0.75 * bound(scene, state).seconds, damping).unwrap();
        for _ in 0..50 {
            let status = tled::step(scene, loads, state, &step);
            assert_eq!(status, Status::Ok, "at {} s", state.time());
            least = least.min(state.least_volume_ratio());
        }
    }
    least
}

/// Volume ratios of all elements.
fn volume_ratios(body: &Body, state: &VecState) -> Vec<f64> {
    let u: Vec<_> = state.displacements().iter().map(|u| u.to_array()).collect();
    body.reference().deformation_gradients(&widened(&u)).iter().map(determinant).collect()
}

/// A body that hangs from a clamped part. Gives the least volume ratio ever, and the farthest that a node is, m.
fn hang(body: &Body, supports: &[Support], law: NeoHookean, gravity: [f32; 3], seconds: f64) -> (f32, f32) {
    let scene = body.scene(NodalStrain(tissue(law)), supports);
    let loads = Loads::new(&scene, gravity.map(|g| 1.06 * g), &[], &[]).unwrap();
    let mut state = rest_of(&scene);
    let least = run_until(&scene, &loads, &mut state, 20.0, seconds);
    let all = volume_ratios(body, &state).into_iter().fold(f64::INFINITY, f64::min);
    let far = state.displacements().iter().map(|u| u.to_array().iter().map(|x| x * x).sum::<f32>().sqrt());
    (least.min(all as f32), far.fold(0.0, f32::max))
}

const DOWN: [f32; 3] = [0.0, 0.0, -9.81];

/// Where elements at the edge of the clamped part were inside out before elements had an energy of their own.
#[test]
fn soft_organs_hang_without_elements_inside_out() {
    let (lobe, liver) = (Body::lobe(), Body::bar([0.12, 0.15, 0.08], [8, 10, 6]));
    let (of_lobe, of_liver) = (held_where(&lobe, |x| x[1] > 0.025), held_where(&liver, |x| x[1] < 1e-6));
    for (name, body, supports, young, gravity) in [
        ("lobe", &lobe, &of_lobe, 2_000.0, DOWN),
        ("lobe, upside down", &lobe, &of_lobe, 2_000.0, [0.0, 9.81, 0.0]),
        ("liver", &liver, &of_liver, 2_000.0, DOWN),
    ] {
        let (least, far) = hang(body, supports, neo_hookean(young, 0.45), gravity, 0.5);
        println!("{name}: least volume ratio {least:.3}, farthest {:.1} mm", 1e3 * far);
        assert!(least > 0.1 && far > 0.08);
    }
}

#[cfg(feature = "slow-tests")]
#[test]
fn seventy_two_organs_hang_without_elements_inside_out() {
    let bodies =
        [("lobe", Body::lobe()), ("liver", Body::bar([0.12, 0.15, 0.08], [8, 10, 6])), ("cylinder", Body::cylinder())];
    let mut least_of_all = f32::INFINITY;
    for (name, body) in &bodies {
        let supports = held_where(body, |[_, y, z]| match *name {
            "lobe" => y > 0.025,
            "liver" => y < 1e-6,
            _ => z < 1e-6,
        });
        for young in [2_000.0, 3_000.0, 5_000.0, 10_000.0] {
            for nu in [0.45, 0.49] {
                for gravity in [DOWN, [0.0, -9.81, 0.0], [0.0, 9.81, 0.0]] {
                    let (least, far) = hang(body, &supports, neo_hookean(young, nu), gravity, 0.6);
                    println!("{name}, E {young}, nu {nu}, {gravity:?}: least {least:.3}, farthest {:.1} mm", 1e3 * far);
                    least_of_all = least_of_all.min(least);
                    assert!(least > 0.1 && far > 0.005);
                }
            }
        }
    }
    println!("least volume ratio of all {least_of_all:.3}");
}

/// The force of nodal pressure, whose elements see their own volume.
#[test]
fn a_cube_is_pressed_to_half_its_height() {
    const SIDE: f32 = 0.03;
    let body = Body::bar([SIDE; 3], [6; 3]);
    let law = neo_hookean(2_500.0, 0.45);
    let top = body.nodes_where(|x| x[2] > SIDE - 1e-6);
    let moved = top.iter().map(|&node| Support::moved(node));
    let supports: Vec<_> = held_where(&body, |x| x[2] < 1e-6).into_iter().chain(moved).collect();
    let metre = [0.0, 0.0, -0.5 * SIDE];
    let motions: Vec<_> = top.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp: 0.5 }).collect();
    let pressed = |scene: &VecScene<_>| {
        let loads = Loads::new(scene, [0.0; 3], &[], &motions).unwrap();
        let mut state = rest_of(scene);
        let least = run_until(scene, &loads, &mut state, 40.0, 0.6);
        let newton: f32 = top.iter().map(|&node| state.forces()[node as usize].to_array()[2]).sum();
        let all = volume_ratios(&body, &state).into_iter().fold(f64::INFINITY, f64::min);
        (least.min(all as f32), newton)
    };
    let (least, newton) = pressed(&body.scene(NodalStrain(tissue(law)), &supports));
    let (least_of_pressure, of_pressure) = pressed(&body.scene(NodalPressure(tissue(law)), &supports));
    println!("least volume ratio {least:.3}, {newton:.2} N; nodal pressure {least_of_pressure:.3}, {of_pressure:.2} N");
    assert!(least > 0.3 && (0.75..1.0).contains(&(newton / of_pressure)));
}

/// A bar in a random state with crushed and inverted elements.
fn shaken(supports: impl Fn(&Body) -> Vec<Support>) -> (Body, VecScene<supple::material::VecMaterial>, VecState, Step) {
    let body = Body::bar([0.05, 0.05, 0.2], [8, 8, 20]);
    let scene = body.scene(NodalStrain(tissue(neo_hookean(3_000.0, 0.45))), &supports(&body));
    let state = displaced(&scene, &noise(&body, 2e-3, 11));
    let crushed = volume_ratios(&body, &state).into_iter().filter(|j| *j < 0.5).count();
    println!("{crushed} of {} elements are crushed", scene.element_count());
    assert!(crushed > 50 && 4 * crushed < scene.element_count());
    let step = Step::unchecked(0.5 * bound(&scene, &state).seconds, 5.0).unwrap();
    (body, scene, state, step)
}

#[test]
fn any_number_of_parts_gives_crushed_elements_the_same_bits() {
    let (_, scene, state, step) = shaken(crate::support::bodies::held);
    same_bits_in_parts_from(&scene, &state, &step);
}

/// A step that is refused while elements are crushed leaves no trace in those that follow.
#[test]
fn a_refused_step_leaves_no_trace_in_marks_of_crushed_elements() {
    let (body, scene, mut state, step) = shaken(crate::support::bodies::held);
    let take = |state: &mut VecState, count: usize| {
        for _ in 0..count {
            assert!(tled::step(&scene, &Loads::NONE, state, &step).is_taken());
        }
        bits(state)
    };
    take(&mut state, 37);
    let straight = take(&mut state.clone(), 20);
    let force = [NodalForce { node: body.farthest(2), newton: [f32::MAX; 3], ramp: 0.0 }];
    let wild = Loads::new(&scene, [0.0; 3], &force, &[]).unwrap();
    assert!(matches!(tled::step(&scene, &wild, &mut state, &step), Status::Diverged(_)));
    assert!(take(&mut state, 20) == straight);
}

/// A state in memory of the host's.
#[derive(Clone)]
struct Memory {
    moved: [Vec<NodeVector>; 4],
    marks: Vec<NodeVector>,
    progress: Progress,
}

impl Memory {
    /// At rest but for the displacements of a state.
    fn of(state: &VecState) -> Self {
        let zeros = || vec![NodeVector::ZERO; state.capacity()];
        let moved = [state.displacements().to_vec(), zeros(), zeros(), zeros()];
        Self { moved, marks: zeros(), progress: **state }
    }

    fn take(&mut self, scene: &VecScene<supple::material::VecMaterial>, step: &Step, count: usize) {
        let [displacement, remainder, increment, force] = &mut self.moved;
        let mut state = StateView::new(displacement, remainder, increment, force, &mut self.marks, &mut self.progress);
        for _ in 0..count {
            assert!(tled::step(scene, &Loads::NONE, &mut state, step).is_taken());
        }
    }

    fn bits(&self) -> Vec<[u32; 3]> {
        self.moved[0].iter().map(|vector| vector.to_array().map(f32::to_bits)).collect()
    }
}

/// A host restores a state into the memory of another one that has taken as many steps: marks of that one are not
/// taken for its own.
#[test]
fn marks_of_another_state_at_the_same_time_are_not_used() {
    let (_, scene, state, step) = shaken(crate::support::bodies::held);
    let (mut crushed, mut quiet) = (Memory::of(&state), Memory::of(&rest_of(&scene)));
    crushed.take(&scene, &step, 5);
    quiet.take(&scene, &step, 5);
    assert_eq!(crushed.progress.time().to_bits(), quiet.progress.time().to_bits());
    assert!(crushed.marks[1..] != quiet.marks[1..]);
    let mut restored = Memory { marks: quiet.marks, ..crushed.clone() };
    let mut new = Memory { marks: vec![NodeVector::ZERO; scene.node_count()], ..crushed };
    restored.take(&scene, &step, 1);
    new.take(&scene, &step, 1);
    assert!(restored.bits() == new.bits());
}

/// Steps look at all elements in a cycle only. In a lobe that falls and hangs none is seen late: a state whose marks
/// are gone, so that the next step looks at all, goes on to the same bits.
#[test]
fn no_crushed_element_of_a_falling_lobe_is_seen_late() {
    let body = Body::lobe();
    let supports = held_where(&body, |x| x[1] > 0.025);
    let scene = body.scene(NodalStrain(tissue(neo_hookean(2_000.0, 0.45))), &supports);
    let loads = Loads::new(&scene, DOWN, &[], &[]).unwrap();
    let step = Step::unchecked(0.6 * bound(&scene, &rest_of(&scene)).seconds, 20.0).unwrap();
    let (mut state, mut looked, mut crushed) = (rest_of(&scene), rest_of(&scene), 0);
    for at in 0..600 {
        assert_eq!(tled::step(&scene, &loads, &mut state, &step), Status::Ok);
        assert_eq!(tled::step(&scene, &loads, &mut looked, &step), Status::Ok);
        if at % 20 == 19 {
            // Computed with the memory of the marks.
            assert!(tled::critical_step(&scene, &mut looked).is_some());
            crushed = volume_ratios(&body, &state).into_iter().filter(|j| *j < 0.5).count();
            assert!(bits(&state)[..3 * scene.node_count()] == bits(&looked)[..3 * scene.node_count()], "step {at}");
        }
    }
    println!("{crushed} of {} elements are crushed at {:.2} s", scene.element_count(), state.time());
    assert!(crushed > 20);
}

/// A rim is torn at so suddenly that elements fall from their volume at rest to a third within tens of steps. One that is
/// seen late meets an energy that was not there: with a look at every element in 16 steps this diverges. It ends where
/// steps end that look at all.
#[test]
fn elements_of_a_rim_that_is_torn_at_are_seen_in_time() {
    let body = Body::lobe();
    let material = NodalStrain(tissue(NeoHookean { c: 517.0, d: 5_000.0 }));
    let scene = body.scene(material, &[]);
    let rim = body.points[1250];
    let nodes = body.nodes_where(|x| (0..3).map(|axis| (x[axis] - rim[axis]).powi(2)).sum::<f32>() < 0.0148f32.powi(2));
    let force = [-0.1187, -0.0318, 0.3029].map(|newton| newton / nodes.len() as f32);
    let forces: Vec<_> = nodes.iter().map(|&node| NodalForce { node, newton: force, ramp: 0.0 }).collect();
    // What keeps the body where it is on the whole.
    let mass = scene.as_scene().mass() as f32;
    let loads = Loads::new(&scene, force.map(|newton| -newton * nodes.len() as f32 / mass), &forces, &[]).unwrap();
    let step = Step::unchecked(0.5 * bound(&scene, &rest_of(&scene)).seconds, 20.0).unwrap();
    let (mut state, mut looked, mut least) = (rest_of(&scene), rest_of(&scene), 1.0f64);
    for at in 0..300 {
        for state in [&mut state, &mut looked] {
            let status = tled::step(&scene, &loads, state, &step);
            assert!(status.is_taken(), "at {} s: {status:?}", state.time());
        }
        assert!(tled::critical_step(&scene, &mut looked).is_some());
        if at % 10 == 0 {
            least = volume_ratios(&body, &state).into_iter().fold(least, f64::min);
        }
    }
    let ends =
        [&state, &looked].map(|state| widened(&state.displacements().iter().map(|u| u.to_array()).collect::<Vec<_>>()));
    let apart = distances(&ends[0], &ends[1]).fold(0.0, f64::max);
    println!("least volume ratio {least:.2}; {:.4} mm from steps that look at all", 1e3 * apart);
    assert!(least < 0.4 && apart < 5e-4);
}
