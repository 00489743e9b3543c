//! One method over one scene with one step: a row of the table. Only the steps are timed, on the calling
//! thread.

use core::fmt;
use std::time::{Duration, Instant};

use supple::guard::Guard;
use supple::step::{Status, Step};

use super::LabError;
use super::measure::Errors;
use super::method::Method;
use super::scenes::SceneSpec;
use super::truth::Truth;

/// What a method did on a scene with a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The scene.
    pub scene: &'static str,
    /// The method.
    pub method: Method,
    /// Its step over that of the scene.
    pub multiple: u32,
    /// Its step, s.
    pub step: f64,
    /// Mean error over time of a body that never moves, mm.
    pub hold: f64,
    /// The same at the end.
    pub hold_at_end: f64,
    /// Step over the exact limit of stability at rest.
    pub step_over_limit_rest: f64,
    /// Step over the least exact limit along the motion.
    pub step_over_limit_trajectory: f64,
    /// What was known at each snapshot that was reached.
    pub frames: Vec<Frame>,
    /// Displacement of each node at the last of them, m; empty if none was reached.
    pub shape: Vec<[f32; 3]>,
    /// How it ended.
    pub end: End,
}

/// What a host and the truth knew at a snapshot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Mean error of the nodes, mm.
    pub mean: f64,
    /// The largest, mm.
    pub max: f64,
    /// Estimates of the mean error and of the largest, mm.
    pub estimate: Option<[f64; 2]>,
    /// The worst status of the steps since the snapshot before.
    pub said: Said,
}

/// What the status of a step says to a host, from good to bad.
#[derive(Clone, Copy, Debug, Eq, Ord, PartialEq, PartialOrd)]
pub enum Said {
    /// [`Status::Ok`].
    Ok,
    /// Something in the step itself is not as it should be: [`Status::Limited`] in most cases.
    Limited,
    /// [`Status::Inexact`], the guard's word.
    Inexact,
}

impl Said {
    /// Of a step that was taken.
    const fn of(status: Status) -> Self {
        match status {
            Status::Ok => Self::Ok,
            Status::Inexact { .. } => Self::Inexact,
            _ => Self::Limited,
        }
    }

    /// Whether nothing was to be said.
    #[must_use]
    pub const fn is_ok(self) -> bool {
        matches!(self, Self::Ok)
    }

    /// For tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Limited => "limited",
            Self::Inexact => "inexact",
        }
    }
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// All steps were taken.
    Reached(Figures),
    /// A step was refused at this time, s.
    Diverged(f64),
}

/// Figures of a run that reached its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// How far off it was.
    pub errors: Errors,
    /// Share of the steps that were [`Status::Limited`]; of a learned step, that of its predictions that were clipped.
    pub clip_share: f64,
    /// Time of a step, microseconds.
    pub us_per_step: f64,
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reached(figures) if figures.clip_share > 0.0 => f.write_str("limited"),
            Self::Reached(_) => f.write_str("ok"),
            Self::Diverged(time) => write!(f, "diverged at {time:.3} s"),
        }
    }
}

impl Row {
    /// The figures, if the run reached its end.
    #[must_use]
    pub const fn figures(&self) -> Option<&Figures> {
        match &self.end {
            End::Reached(figures) => Some(figures),
            End::Diverged(_) => None,
        }
    }
}

/// Runs `method` over a scene at `multiple` times its step.
pub fn run(spec: &SceneSpec, truth: &Truth, method: Method, multiple: u32) -> Result<Row, LabError> {
    run_guarded(spec, truth, method, multiple, None)
}

/// The same with a guard whose second run's steps are `every` times as long, if any.
pub fn run_guarded(
    spec: &SceneSpec,
    truth: &Truth,
    method: Method,
    multiple: u32,
    every: Option<u32>,
) -> Result<Row, LabError> {
    spec.check_multiple(multiple)?;
    let Ended { end, frames, shape } = run_to_end(spec, truth, method, multiple, every)?;
    let hold = Errors::of_hold(truth)?;
    let step = f64::from(multiple) * f64::from(spec.timing.step);
    Ok(Row {
        scene: spec.name,
        method,
        multiple,
        step,
        hold: hold.mean_over_time(),
        hold_at_end: hold.mean(),
        step_over_limit_rest: step / truth.limit_at_rest,
        step_over_limit_trajectory: step / truth.limit_least,
        frames,
        shape,
        end,
    })
}

/// A run that came to its end.
struct Ended {
    end: End,
    frames: Vec<Frame>,
    shape: Vec<[f32; 3]>,
}

fn run_to_end(
    spec: &SceneSpec,
    truth: &Truth,
    method: Method,
    multiple: u32,
    every: Option<u32>,
) -> Result<Ended, LabError> {
    let scene = spec.build()?;
    let dt = multiple as f32 * spec.timing.step;
    let mut state = spec.state(&scene, dt)?;
    let mut prepared = method.prepare(spec, scene.view(), &mut state, dt)?;
    let mut guard = match every {
        Some(every) => {
            let step = Step::unchecked(dt, spec.damping)?;
            Some(Guard::prepare_in_vec(scene.view(), &spec.points, state.view(), step, every)?)
        }
        None => None,
    };

    let mut errors = Errors::default();
    let (mut frames, mut shape, mut estimate) = (Vec::new(), Vec::new(), None);
    let (mut taken, mut limited, mut spent) = (0.0, 0.0, Duration::ZERO);
    let (mut clips, mut predictions) = (0.0, 0_u32);
    let mut loads = spec.loads(&scene)?;
    for snapshot in 0..spec.intervals {
        let mut said = Said::Ok;
        let parts = method.parts(snapshot);
        let (seconds, part) = (dt / parts as f32, 1.0 / f64::from(parts));
        // A lead-in is not timed.
        let timed = state.time() + 0.5 * f64::from(spec.timing.step) >= method.lead_in();
        let start = Instant::now();
        for _ in 0..parts * spec.timing.interval / multiple {
            let loads = loads.of_step(state.time(), f64::from(seconds));
            let (mut status, clipped) = prepared.advance(seconds, scene.view(), &loads, &mut state)?;
            // The library's loop would not let it doubt the exact steps of a lead-in.
            if let Some(guard) = &mut guard {
                status = guard.follow(status, scene.view(), &loads, state.view());
                estimate = guard.estimate().map(|estimate| [estimate.mean, estimate.largest]);
            }
            if let Some(clipped) = clipped {
                clips += f64::from(clipped);
                predictions += 1;
            }
            match status {
                Status::Ok => {}
                Status::Diverged(divergence) => {
                    return Ok(Ended { end: End::Diverged(divergence.time), frames, shape });
                }
                Status::Mismatch { nodes, room } => return Err(LabError::Mismatch { nodes, room }),
                _ => limited += part,
            }
            said = said.max(Said::of(status));
            taken += if timed { part } else { 0.0 };
        }
        if timed {
            spent += start.elapsed();
        }
        errors.add_snapshot(truth, state.displacements())?;
        let estimate = estimate.map(|metres| metres.map(|metre| 1e3 * f64::from(metre)));
        frames.push(Frame { mean: errors.mean(), max: errors.max, estimate, said });
        shape.clear();
        shape.extend(state.displacements().iter().map(|vector| vector.to_array()));
    }
    // The lead-in may last to the end.
    let taken = f64::max(taken, 1.0);
    let figures = Figures {
        errors,
        clip_share: if predictions > 0 { clips / f64::from(predictions) } else { limited / taken },
        us_per_step: 1e6 * spent.as_secs_f64() / taken,
    };
    Ok(Ended { end: End::Reached(figures), frames, shape })
}

#[cfg(test)]
impl Row {
    /// A row for tests of what is made of rows.
    pub(super) const fn example(end: End) -> Self {
        Self {
            scene: "lobe",
            method: Method::Long,
            multiple: 10,
            step: 3e-4,
            hold: 3.0,
            hold_at_end: 3.5,
            step_over_limit_rest: 1.5,
            step_over_limit_trajectory: 2.0,
            frames: Vec::new(),
            shape: Vec::new(),
            end,
        }
    }
}
