//! Long steps on the paper's bar.

use supple::guard::Guard;
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::material::Exponential;
use supple::state::VecState;
use supple::step::Step;

use super::bar::{BarScene, DAMPING, DT, moved};

/// Steps that are timed together: many enough for several renewals of the lattice's inertia.
pub(crate) const RUN: u32 = 256;

/// A step of so many times the exact one, from a state that it has deformed for some time.
pub(crate) fn long<'a>(
    scene: &'a BarScene<Exponential>,
    loads: &'a Loads<'a>,
    points: &[[f32; 3]],
    multiple: f32,
) -> impl FnMut() + use<'a> {
    guarded(scene, loads, points, multiple, None)
}

/// The same with a guard whose second run takes one step in `every`, if any.
pub(crate) fn guarded<'a>(
    scene: &'a BarScene<Exponential>,
    loads: &'a Loads<'a>,
    points: &[[f32; 3]],
    multiple: f32,
    every: Option<u32>,
) -> impl FnMut() + use<'a> {
    let mut state = VecState::at_rest(points.len());
    let step = Step::unchecked(multiple * DT, DAMPING).expect("a positive step");
    let method = Method::new(Cells::Given([2, 2, 5]));
    let mut large =
        LargeStep::prepare_in_vec(method, scene.view(), points, state.view(), step).expect("the bar can be prepared");
    let mut guard = every.map(|every| {
        Guard::prepare_in_vec(scene.view(), points, state.view(), step, every).expect("a guard of the bar")
    });
    let mut run = move || {
        let status = large.step(scene.view(), loads, state.view());
        moved(match &mut guard {
            Some(guard) => guard.follow(status, scene.view(), loads, state.view()),
            None => status,
        });
    };
    (0..2 * RUN).for_each(|_| run());
    run
}
