//! A simulation from rest to its end: steps, frames at even intervals, what became of it.

pub(crate) mod adaptive;
pub(crate) mod exact;
pub(crate) mod large;
pub(crate) mod learned;
pub(crate) mod outcome;
pub(crate) mod reactions;
pub(crate) mod start;

use std::time::Instant;

use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::VecState;
use supple::step::Status;
use supple::tled::Pace;

use crate::problem::Problem;
use crate::scene::setup::Setup;
use exact::{Automatic, ExactSteps, Motion, ROUNDING};
use outcome::{LargeTrace, Outcome};
use reactions::Reactions;
use start::{Mover, Start, critical};

/// Runs to the end or to divergence. `frame` is called at rest and after each interval between frames, `tick` with the time (s) now
/// and then.
pub(crate) fn run(
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    state: &mut VecState,
    start: Start<'_>,
    tick: &dyn Fn(f64),
    frame: &mut dyn FnMut(&mut VecState) -> Result<(), Problem>,
) -> Result<Outcome, Problem> {
    let loads = setup.loads(&scene)?;
    let (time, tools) = (&setup.time, &setup.tools);
    let rounding = 2.0 * ROUNDING * time.end;
    let Start { at_rest, step, mut mover, mut guard } = start;
    let mut outcome = Outcome::new(at_rest, step.seconds());
    outcome.reactions = Reactions::new(tools.tools.len(), time);
    if let (Mover::Large(large), Some(method)) = (&mover, &time.method) {
        outcome.large = Some(LargeTrace::new(method, large.model()));
    }
    if let Mover::Adaptive(_) = &mover {
        // They begin as exact ones.
        outcome.steps.0 = outcome.steps.0.min(Pace::SHARE * at_rest.seconds);
        outcome.steps.1 = outcome.steps.0;
    }
    outcome.enter_frame(state);
    frame(state)?;
    // Time goes in even intervals, each one step or one of a network, unless exact steps alone set their own pace.
    let interval = if let Mover::Learned(learned) = &mover { learned.seconds() } else { step.seconds() };
    let even = !matches!(mover, Mover::Exact(ExactSteps::Automatic(_)));
    let total = (time.end / f64::from(interval)).round().max(1.0) as u64;
    let mut taken = 0;
    // No two frames of one state.
    let frames = if even { total.min(time.frames.into()) } else { time.frames.into() };
    for index in 1..=frames {
        let share = index as f64 / frames as f64;
        let clock = Instant::now();
        if let Mover::Exact(ExactSteps::Automatic(automatic)) = &mut mover {
            let motion = Motion { scene, loads, damping: setup.damping, end: time.end, tick };
            reach(automatic, setup, motion, state, &mut outcome, time.end * share)?;
        } else {
            let target = (total as f64 * share).round() as u64;
            while taken < target && outcome.divergence.is_none() {
                taken += 1;
                let instruments = tools.at(state.time() + rounding);
                let contact = tools.contact(&instruments, scene.node_count())?;
                let loads = if tools.is_empty() { loads } else { loads.touched_by(&contact) };
                let motion = Motion { scene, loads, damping: setup.damping, end: time.end, tick };
                mover.advance(&motion, state, &mut outcome, interval)?;
                if let Some(guard) = guard.as_mut().filter(|_| outcome.divergence.is_none()) {
                    let begun = Instant::now();
                    let status = guard.follow(Status::Ok, scene, &loads, &state.view());
                    outcome.guarding += begun.elapsed();
                    let status = if mover.is_leading() { Status::Ok } else { status };
                    let trace = outcome.guard.get_or_insert_default();
                    trace.enter(status, guard.estimate(), state.time());
                    if let (Mover::Learned(learned), Status::Inexact { .. }) = (&mut mover, status) {
                        learned.fall_back(state.time(), status);
                    }
                }
                if taken % u64::from(Pace::STEPS_BETWEEN_LOOKS) == 0 {
                    tick(state.time());
                }
            }
        }
        outcome.spent += clock.elapsed();
        if outcome.divergence.is_some() {
            break;
        }
        let bound = critical(scene, state)?;
        if bound.seconds < outcome.least.0.seconds {
            outcome.least = (bound, state.time());
        }
        if mover.fixed_exact_seconds().is_some_and(|seconds| seconds > bound.seconds) {
            outcome.above_from.get_or_insert(state.time());
        }
        outcome.enter_frame(state);
        frame(state)?;
    }
    if let Mover::Learned(learned) = mover {
        outcome.learned = Some(learned.trace);
    }
    Ok(outcome)
}

/// Automatic steps to a time (s), along the parts of the instruments' paths.
fn reach(
    automatic: &mut Automatic,
    setup: &Setup,
    motion: Motion<'_>,
    state: &mut VecState,
    outcome: &mut Outcome,
    target: f64,
) -> Result<(), Problem> {
    let (tools, rounding) = (&setup.tools, 2.0 * ROUNDING * motion.end);
    let mut from = state.time();
    while from < target && outcome.divergence.is_none() {
        let until = target.min(tools.next_turn(from + rounding));
        let instruments = tools.at(from + rounding);
        let contact = tools.contact(&instruments, motion.scene.node_count())?;
        let loads = if tools.is_empty() { motion.loads } else { motion.loads.touched_by(&contact) };
        automatic.reach(&Motion { loads, ..motion }, state, outcome, until);
        from = until;
    }
    Ok(())
}
