//! Mass-scaled, multilevel and damped steps on the paper's bar.

use supple::guard::Guard;
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::material::Exponential;
use supple::state::VecState;
use supple::step::Step;

use super::bar::{BarScene, DAMPING, DT, moved};

pub(crate) fn multilevel() -> Method<'static> {
    Method::Multilevel(Cells::Given([2, 2, 4]))
}

pub(crate) fn damped() -> Method<'static> {
    Method::damped(Cells::Given([2, 2, 5]))
}

/// Steps of a refresh cycle with a lattice, a multiple of those without one.
pub(crate) const CYCLE: u32 = 256;

/// A step of this method, from a state that it has deformed for two refresh cycles, eight without a lattice.
pub(crate) fn scaled<'a>(
    scene: &'a BarScene<Exponential>,
    loads: &'a Loads<'a>,
    points: &[[f32; 3]],
    multiple: f32,
    method: Method<'static>,
) -> impl FnMut() + use<'a> {
    guarded(scene, loads, points, multiple, method, None)
}

/// The same with a guard whose second run takes one step in `every`, if any.
pub(crate) fn guarded<'a>(
    scene: &'a BarScene<Exponential>,
    loads: &'a Loads<'a>,
    points: &[[f32; 3]],
    multiple: f32,
    method: Method<'static>,
    every: Option<u32>,
) -> impl FnMut() + use<'a> {
    let mut state = VecState::at_rest(points.len());
    let step = Step::unchecked(multiple * DT, DAMPING).expect("a positive step");
    let mut large =
        LargeStep::prepare_in_vec(method, scene.view(), points, state.view(), step).expect("the bar can be prepared");
    assert!(CYCLE.is_multiple_of(large.model().cycle()), "the steps below are no whole cycles");
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
    (0..2 * CYCLE).for_each(|_| run());
    run
}
