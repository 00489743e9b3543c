//! Calls of steps with loads of any size. A step that is refused leaves no trace: all that follows is the same, to the
//! bit, as if the call had not been. What is taken is finite, and so is the estimate of a guard that calls a step good.

use supple::element::ElementMaterial;
use supple::guard::Guard;
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::{Loads, Motion, NodalForce};
use supple::material::{NodalPressure, NodalStrain};
use supple::scene::{Axes, Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::{Status, Step};
use supple::tled;

use crate::hostile::{Dice, Run};
use crate::support::bodies::{held, small_bar};
use crate::support::{Body, EXP, NEO, bits, rest_of, tissue};

/// A method with a state, twice: `seen` gets every call, `unseen` only those that are taken.
struct Pair<'a, M> {
    scene: &'a VecScene<M>,
    step: Step,
    seen: Moved,
    unseen: Moved,
}

#[derive(Clone)]
struct Moved {
    state: VecState,
    large: Option<LargeStep<Vec<NodeVector>>>,
}

impl Moved {
    fn take<M: ElementMaterial>(&mut self, scene: &VecScene<M>, loads: &Loads<'_>, step: &Step) -> Status {
        match &mut self.large {
            Some(large) => large.step(scene.view(), loads, self.state.view()),
            None => tled::step(scene, loads, &mut self.state, step),
        }
    }
}

impl<M: ElementMaterial> Pair<'_, M> {
    /// Takes a step with these loads, by both runs if the first takes it.
    fn take(&mut self, loads: &Loads<'_>) -> Status {
        let before = bits(&self.seen.state);
        let status = self.seen.take(self.scene, loads, &self.step);
        if status.is_taken() {
            let again = self.unseen.take(self.scene, loads, &self.step);
            assert_eq!(format!("{status:?}"), format!("{again:?}"));
            let (state, other) = (&self.seen.state, &self.unseen.state);
            assert!(bits(state) == bits(other), "a refused step was seen in a later one: {status:?}");
            let finite = state.displacements().iter().all(|u| u.to_array().iter().all(|x| x.is_finite()));
            assert!(finite, "{status:?}, but not finite");
        } else {
            assert!(bits(&self.seen.state) == before, "a refused step moved the state: {status:?}");
        }
        status
    }
}

/// The bar on which they are tried: one end fixed, some nodes of the other moved.
fn supports(body: &Body) -> Vec<Support> {
    let mut supports = held(body);
    supports.extend([87, 91].map(Support::moved));
    supports
}

/// Loads of any size, and seldom none.
fn drawn(dice: &mut Dice, nodes: usize) -> ([f32; 3], Vec<NodalForce>, Vec<Motion>) {
    let is_wild = dice.one_in(3);
    let mut number = |usual| if is_wild { dice.wild(usual) } else { usual * (2.0 * dice.share() as f32 - 1.0) };
    let gravity = [(); 3].map(|()| number(10.0));
    let forces: Vec<_> = (0..3)
        .map(|_| NodalForce { node: 0, newton: [(); 3].map(|()| number(0.02)), ramp: number(0.01).abs() })
        .collect();
    let motion = Motion { node: 91, axes: Axes::XYZ, metre: [(); 3].map(|()| number(0.002)), ramp: number(0.1).abs() };
    let forces = forces.into_iter().map(|force| NodalForce { node: dice.below(nodes) as u32, ..force }).collect();
    (gravity, forces, if dice.one_in(2) { vec![motion] } else { vec![] })
}

/// A sequence of calls with one method on one scene; whether a step was refused.
fn sequence<M: ElementMaterial>(dice: &mut Dice, body: &Body, material: M, is_long: bool) -> bool {
    let scene = body.scene(material, &supports(body));
    let mut state = rest_of(&scene);
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let times = if is_long { [2.0, 10.0, 40.0][dice.below(3)] } else { 0.9 };
    let step = Step::unchecked(times * critical.seconds, [0.0, 20.0][dice.below(2)]).unwrap();
    let method = is_long.then(|| Method::new(Cells::Suggested).with_gain(20.0));
    let large =
        method.map(|method| LargeStep::prepare_in_vec(method, scene.view(), &body.points, state.view(), step).unwrap());
    let mut guard = Guard::prepare_in_vec(scene.view(), &body.points, state.view(), step, 3).unwrap();
    let seen = Moved { state, large };
    let mut pair = Pair { scene: &scene, step, unseen: seen.clone(), seen };
    let mut refused = false;
    for _ in 0..6 {
        let (gravity, forces, motions) = drawn(dice, body.points.len());
        let loads = match Loads::new(&scene, gravity, &forces, &motions) {
            Ok(loads) => loads,
            Err(error) => {
                assert!(!error.to_string().is_empty());
                continue;
            }
        };
        for _ in 0..1 + dice.below(8) {
            let status = pair.take(&loads);
            refused |= !status.is_taken();
            let judged = guard.follow(status, scene.view(), &loads, pair.seen.state.view());
            assert_eq!(judged.is_taken(), status.is_taken());
            if let Some(estimate) = guard.estimate() {
                assert!(estimate.mean.is_finite() && estimate.allowed.is_finite(), "{judged:?}, {estimate:?}");
            }
        }
    }
    refused
}

#[test]
fn a_refused_step_leaves_no_trace() {
    let body = small_bar();
    Run::new("steps", 400).each(|dice| {
        let is_long = dice.below(4) > 0;
        match dice.below(5) {
            0 => sequence(dice, &body, tissue(NEO), is_long),
            1 => sequence(dice, &body, tissue(EXP), is_long),
            2 => sequence(dice, &body, NodalPressure(tissue(NEO)), is_long),
            3 => sequence(dice, &body, NodalPressure(tissue(EXP)), is_long),
            _ => sequence(dice, &body, NodalStrain(tissue(NEO)), is_long),
        }
    });
}
