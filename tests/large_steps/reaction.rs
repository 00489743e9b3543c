//! The force by which supports act on the tissue (`supple::reaction`), judged against the weight of a body, against
//! exact steps, and against the force at the supports alone, which long steps get wrong.

use supple::element::ElementMaterial;
use supple::loads::{Loads, Motion};
use supple::material::{NeoHookean, NodalStrain};
use supple::reaction::{Force, Reaction, ReactionError};
use supple::scene::{Axes, Support, VecScene};
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

use crate::large_steps::{limit, prepared};
use crate::support::bodies::Body;
use crate::support::{rest_of, run, tissue};

/// s
const FRAME: f32 = 1.0 / 60.0;
/// 1/s
const DAMPING: f32 = 6.0;

fn norm(vector: [f32; 3]) -> f32 {
    vector.iter().map(|component| component * component).sum::<f32>().sqrt()
}

/// The mean of the square of the differences, and of the second forces.
fn relative(forces: &[[f32; 3]], exact: &[[f32; 3]]) -> f32 {
    let differences = forces.iter().zip(exact).map(|(a, b)| [0, 1, 2].map(|axis| a[axis] - b[axis]));
    let squares = |vectors: Vec<[f32; 3]>| vectors.into_iter().map(norm).map(|size| size * size).sum::<f32>();
    (squares(differences.collect()) / squares(exact.to_vec())).sqrt()
}

/// Forces of frames at times that are later by `later` frames, linear between frames.
fn moved_in_time(forces: &[[f32; 3]], later: f32) -> Vec<[f32; 3]> {
    let last = forces.len() - 1;
    let at = |frame: usize| {
        let time = (frame as f32 + later).clamp(0.0, last as f32);
        let before = (time as usize).min(last - 1);
        let share = time - before as f32;
        [0, 1, 2].map(|axis| (1.0 - share) * forces[before][axis] + share * forces[before + 1][axis])
    };
    (0..=last).map(at).collect()
}

/// The lobe, held at one end, with an instrument at the other.
struct Pushed {
    body: Body,
    supports: Vec<Support>,
    instrument: Vec<u32>,
}

impl Pushed {
    fn new() -> Self {
        const WIDTH: f32 = 0.012;
        let body = Body::lobe();
        let ((low, high), tip) = (body.extent(0), body.farthest(0) as usize);
        let tip = body.points[tip];
        let surface = body.surface_nodes();
        let held = body.nodes_where(|[x, ..]| x < low + 0.15 * (high - low));
        let near = |point: [f32; 3]| norm([0, 1, 2].map(|axis| point[axis] - tip[axis])) < WIDTH;
        let instrument: Vec<_> = body.nodes_where(near).into_iter().filter(|&node| surface[node as usize]).collect();
        assert!(instrument.len() > 3);
        let mut supports: Vec<_> = held.into_iter().map(Support::fixed).collect();
        supports.extend(instrument.iter().copied().map(Support::moved));
        Self { body, supports, instrument }
    }

    fn motions(&self) -> Vec<Motion> {
        let motion = |&node: &u32| Motion { node, axes: Axes::XYZ, metre: [0.0; 3], ramp: 0.0 };
        self.instrument.iter().map(motion).collect()
    }

    /// The forces of each frame, and those at the supports alone at its end, while the instrument moves along z as
    /// `hand` says at each time (s), m. Exact steps unless `long`.
    fn follow<M: ElementMaterial>(
        &self,
        scene: &VecScene<M>,
        long: bool,
        per_frame: u32,
        hand: impl Fn(f64) -> f64,
    ) -> (Vec<Force>, Vec<[f32; 3]>) {
        const FRAMES: u32 = 36;
        let step = Step::unchecked(FRAME / per_frame as f32, DAMPING).unwrap();
        let mut state = rest_of(scene);
        let mut large = long.then(|| prepared(&self.body, scene, &mut state, step, 0.0));
        let mut reaction = Reaction::prepare_in_vec(scene.view(), &self.instrument, DAMPING).unwrap();
        assert!(reaction.follow(scene.view(), &state.view()).is_none());
        let (mut motions, mut forces, mut alone) = (self.motions(), Vec::new(), Vec::new());
        for frame in 0..FRAMES {
            for part in 1..=per_frame {
                let time = f64::from(frame * per_frame + part) * f64::from(step.seconds());
                motions.iter_mut().for_each(|motion| motion.metre[2] = hand(time) as f32);
                let loads = Loads::new(scene, [0.0; 3], &[], &motions).unwrap();
                let status = match &mut large {
                    Some(large) => large.step(scene.view(), &loads, state.view()),
                    None => tled::step(scene, &loads, &mut state, &step),
                };
                assert!(status.is_taken(), "{status:?}");
            }
            forces.push(reaction.follow(scene.view(), &state.view()).unwrap());
            let at = |axis: usize| {
                -self.instrument.iter().map(|&node| state.forces()[node as usize].to_array()[axis]).sum::<f32>()
            };
            alone.push([at(0), at(1), at(2)]);
        }
        (forces, alone)
    }
}

/// Down and up again at one speed (m/s), reversed at once after each tenth of a second.
fn reversing(speed: f64) -> impl Fn(f64) -> f64 {
    move |time| -speed * (0.1 - (time % 0.2 - 0.1).abs())
}

/// Down and up again, 2.5 times a second, with at most this speed (m/s).
fn smooth(speed: f64) -> impl Fn(f64) -> f64 {
    const TURNS: f64 = 5.0 * core::f64::consts::PI;
    move |time| speed / TURNS * ((TURNS * time).cos() - 1.0)
}

/// Exact steps in a frame.
fn exact_steps<M: ElementMaterial>(scene: &VecScene<M>) -> u32 {
    (FRAME / (0.8 * limit(scene))).ceil() as u32
}

/// Forces of long steps off the exact ones, over these, at the speeds of hands: with all weights, and
/// at the supports alone.
fn errors(hand: impl Fn(f64) -> Box<dyn Fn(f64) -> f64>, mut judge: impl FnMut(u32, f32, f32)) {
    let pushed = Pushed::new();
    let law = NeoHookean { c: 1_500.0, d: 15_000.0 };
    let scene = pushed.body.scene(NodalStrain(tissue(law)), &pushed.supports);
    let newtons = |forces: &[Force]| forces.iter().map(|force| force.newton).collect::<Vec<_>>();
    for speed in [0.005, 0.02, 0.08] {
        let (exact, _) = pushed.follow(&scene, false, exact_steps(&scene), hand(speed));
        let size = exact.iter().map(|force| norm(force.newton)).fold(0.0, f32::max);
        let spread = exact.iter().map(|force| force.spread).fold(0.0, f32::max);
        println!("{} mm/s: at most {:.1} mN, spread {:.2} mN", 1e3 * speed, 1e3 * size, 1e3 * spread);
        assert!(size > 5e-3 && spread < 0.15 * size);
        let exact = newtons(&exact);
        for per_frame in [8, 4, 2, 1] {
            let (forces, alone) = pushed.follow(&scene, true, per_frame, hand(speed));
            // Forces are known for the start of a step: half of one before the middle of the frame.
            let half = 0.5 / per_frame as f32;
            let error = relative(&newtons(&forces), &moved_in_time(&exact, -half));
            let without = relative(&alone, &moved_in_time(&exact, 0.5 - 2.0 * half));
            let told = forces.iter().filter(|force| !force.is_resolved()).count();
            println!(
                "  at {:.1}: off by {:.0} %, at the supports alone by {:.0} %; {told} of {} not resolved",
                FRAME / per_frame as f32 / limit(&scene),
                100.0 * error,
                100.0 * without,
                forces.len()
            );
            judge(per_frame, error, without);
        }
    }
}

#[test]
fn an_instrument_that_reverses_at_once_feels_the_tissue() {
    errors(
        |speed| Box::new(reversing(speed)),
        |per_frame, error, alone| {
            let most = if per_frame > 2 { 0.2 } else { 0.5 };
            // Of the longest steps most frames are not resolved, and say so.
            assert!(error < most && (error < alone || per_frame == 1));
        },
    );
}

#[test]
fn an_instrument_that_moves_smoothly_feels_the_tissue() {
    errors(|speed| Box::new(smooth(speed)), |_, error, _| assert!(error < 0.25));
}

#[test]
fn forces_that_steps_do_not_resolve_are_told() {
    let pushed = Pushed::new();
    // Some 40 and 80 times the critical step: raised inertia, not the tissue, makes the force.
    let law = NeoHookean { c: 1_500.0, d: 1_500_000.0 };
    let scene = pushed.body.scene(NodalStrain(tissue(law)), &pushed.supports);
    let (exact, _) = pushed.follow(&scene, false, exact_steps(&scene), reversing(0.02));
    let (mut all_wrong, mut all_silent) = (0, 0);
    for per_frame in [2, 4] {
        let (forces, _) = pushed.follow(&scene, true, per_frame, reversing(0.02));
        let size = exact.iter().map(|force| norm(force.newton)).fold(0.0, f32::max);
        let (mut wrong, mut silent) = (0, 0);
        for (force, exact) in forces.iter().zip(&exact) {
            let error = norm([0, 1, 2].map(|axis| force.newton[axis] - exact.newton[axis]));
            wrong += u32::from(error > 0.5 * size);
            silent += u32::from(error > 0.5 * size && force.is_resolved());
        }
        println!("{per_frame} steps a frame: {wrong} of {} frames wrong, {silent} untold", forces.len());
        all_wrong += wrong;
        all_silent += silent;
    }
    assert!(all_wrong >= 10 && all_silent <= all_wrong / 10);
}

/// The weight of the body, whatever the steps.
#[test]
fn supports_carry_the_weight_of_a_body_at_rest() {
    const G: f32 = 9.81;
    let body = Body::bar([0.03, 0.03, 0.04], [3, 3, 4]);
    let held = body.nodes_where(|[_, _, z]| z == 0.0);
    let supports: Vec<_> = held.iter().copied().map(Support::fixed).collect();
    let scene = body.scene(NodalStrain(tissue(NeoHookean { c: 4_000.0, d: 40_000.0 })), &supports);
    let loads = Loads::new(&scene, [0.0, 0.0, -G], &[], &[]).unwrap();
    let weight = G * scene.mass() as f32;
    for multiple in [0.8, 20.0] {
        let step = Step::unchecked(multiple * limit(&scene), 40.0).unwrap();
        let mut state = rest_of(&scene);
        let mut large = prepared(&body, &scene, &mut state, step, 0.0);
        let mut reaction = Reaction::prepare_in_vec(scene.view(), &held, 40.0).unwrap();
        let mut force = None;
        while state.time() < 2.0 {
            if multiple < 1.0 {
                run(&scene, &loads, &mut state, &step, 100);
            } else {
                assert!(large.step(scene.view(), &loads, state.view()).is_taken());
            }
            force = reaction.follow(scene.view(), &state.view());
        }
        let Force { newton: [x, y, z], spread } = force.unwrap();
        println!("at {multiple}: ({x:.1e}, {y:.1e}, {z:.5}) N of {weight:.5} N, spread {spread:.1e} N");
        assert!((z - weight).abs() < 2e-3 * weight && x.abs().max(y.abs()) < 2e-3 * weight);
        assert!(spread < 0.02 * weight);
    }
}

#[test]
fn weights_are_one_at_the_instrument_and_zero_at_other_supports() {
    let pushed = Pushed::new();
    let scene = pushed.body.scene(tissue(NeoHookean { c: 1_500.0, d: 15_000.0 }), &pushed.supports);
    let reaction = Reaction::prepare_in_vec(scene.view(), &pushed.instrument, DAMPING).unwrap();
    let weights: Vec<_> = reaction.weights().collect();
    assert_eq!(weights.len(), scene.node_count());
    for support in &pushed.supports {
        let asked = pushed.instrument.contains(&support.node);
        assert_eq!(weights[support.node as usize], if asked { 1.0 } else { 0.0 });
    }
    assert!(weights.iter().all(|weight| (0.0..=1.0).contains(weight)));
    let between = weights.iter().filter(|&&weight| weight > 0.0 && weight < 1.0).count();
    assert!(between > scene.node_count() / 2, "{between}");
}

#[test]
fn a_reaction_begins_anew_after_a_reset_and_is_the_same_when_asked_again() {
    let pushed = Pushed::new();
    let scene = pushed.body.scene(tissue(NeoHookean { c: 1_500.0, d: 15_000.0 }), &pushed.supports);
    let step = Step::unchecked(0.8 * limit(&scene), DAMPING).unwrap();
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &[], &[]).unwrap();
    let mut reaction = Reaction::prepare_in_vec(scene.view(), &pushed.instrument, DAMPING).unwrap();
    let mut state = rest_of(&scene);
    let mut follow = |state: &mut VecState| reaction.follow(scene.view(), &state.view());
    assert_eq!(follow(&mut state), None);
    run(&scene, &loads, &mut state, &step, 20);
    let force = follow(&mut state).unwrap();
    assert!(norm(force.newton) > 0.0);
    assert_eq!(follow(&mut state), Some(force));
    state.reset();
    assert_eq!(follow(&mut state), None);
    run(&scene, &loads, &mut state, &step, 20);
    assert_eq!(follow(&mut state), Some(force));
}

#[test]
fn lists_that_name_no_supports_are_refused() {
    let pushed = Pushed::new();
    let scene = pushed.body.scene(tissue(NeoHookean { c: 1_500.0, d: 15_000.0 }), &pushed.supports);
    let prepare = |nodes: &[u32], damping| {
        let reaction = Reaction::prepare_in_vec(scene.view(), nodes, damping);
        reaction.map(|_| ()).unwrap_err()
    };
    let nodes = scene.node_count();
    let free = (0..nodes as u32).find(|&node| scene.view().held(node as usize) == Axes::NONE).unwrap();
    let fixed = pushed.supports[0].node;
    assert_eq!(prepare(&[], 1.0), ReactionError::Empty);
    assert_eq!(prepare(&[fixed, free], 1.0), ReactionError::NotHeld { index: 1, node: free });
    let beyond = ReactionError::Node { index: 0, node: u32::MAX, nodes };
    assert_eq!(prepare(&[u32::MAX], 1.0), beyond);
    println!("{beyond}");
    assert_eq!(prepare(&[fixed], -1.0), ReactionError::Damping { damping: -1.0 });
    let short = Reaction::prepare(scene.view(), &[fixed], 1.0, vec![Default::default(); nodes - 1]);
    assert_eq!(short.unwrap_err(), ReactionError::Capacity { needed: nodes, capacity: nodes - 1 });
}
