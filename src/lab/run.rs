//! One method over one scene with one step: a row of the table. Only the steps are timed, on the calling
//! thread.

use core::fmt;
use std::time::{Duration, Instant};
use std::vec::Vec;

use super::LabError;
use super::measure::Errors;
use super::method::Method;
use super::scenes::SceneSpec;
use super::truth::Truth;
use crate::element::{ElementMaterial, MaterialWork};
use crate::step::Status;

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
    /// Error estimated by a run with twice the step, where there is one, mm.
    pub doubling: Option<f64>,
    /// How it ended.
    pub end: End,
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
    /// The method's own estimate of its error, mean over the snapshots, mm.
    pub running: Option<f64>,
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

/// Displacement of each node (m) at each snapshot that was reached.
pub type Shapes = Vec<Vec<[f32; 3]>>;

/// Runs `method` over a scene at `multiple` times its step.
pub fn run(spec: &SceneSpec, truth: &Truth, method: Method, multiple: u32) -> Result<Row, LabError> {
    Ok(run_with_shapes(spec, truth, method, multiple)?.0)
}

/// The same, and the displacements at each snapshot.
pub fn run_with_shapes(
    spec: &SceneSpec,
    truth: &Truth,
    method: Method,
    multiple: u32,
) -> Result<(Row, Shapes), LabError> {
    spec.check_multiple(multiple)?;
    let (end, shapes) = spec.with_material(Run { spec, truth, method, multiple })?;
    let hold = Errors::of_hold(truth)?;
    let step = f64::from(multiple) * f64::from(spec.timing.step);
    let row = Row {
        scene: spec.name,
        method,
        multiple,
        step,
        hold: hold.mean_over_time(),
        hold_at_end: hold.mean(),
        step_over_limit_rest: step / truth.limit_at_rest,
        step_over_limit_trajectory: step / truth.limit_least,
        doubling: None,
        end,
    };
    Ok((row, shapes))
}

struct Run<'a> {
    spec: &'a SceneSpec,
    truth: &'a Truth,
    method: Method,
    multiple: u32,
}

impl MaterialWork for Run<'_> {
    type Output = Result<(End, Shapes), LabError>;

    fn run<M: ElementMaterial>(self, material: M) -> Self::Output {
        let Self { spec, truth, method, multiple } = self;
        let scene = spec.build(material)?;
        let dt = multiple as f32 * spec.timing.step;
        let mut state = spec.state(&scene, dt)?;
        let mut advance = method.prepare(spec, scene.view(), &mut state, dt)?;

        let (mut errors, mut shapes) = (Errors::default(), Shapes::new());
        let (mut estimates, mut estimate) = (Vec::new(), None);
        let (mut taken, mut limited, mut spent) = (0_u32, 0_u32, Duration::ZERO);
        let (mut clips, mut predictions) = (0.0, 0_u32);
        for interval in 0..spec.intervals {
            let loads = spec.loads(&scene, interval)?;
            // A lead-in is not timed.
            let timed = state.time() + 0.5 * f64::from(spec.timing.step) >= method.lead_in();
            let start = Instant::now();
            for _ in 0..spec.timing.interval / multiple {
                let (status, report) = advance(&mut state, &loads)?;
                estimate = report.estimate;
                if let Some(clipped) = report.clipped {
                    clips += f64::from(clipped);
                    predictions += 1;
                }
                match status {
                    Status::Ok => {}
                    Status::Limited { .. } => limited += 1,
                    Status::Diverged(divergence) => return Ok((End::Diverged(divergence.time), shapes)),
                    Status::Mismatch { nodes, room } => return Err(LabError::Mismatch { nodes, room }),
                }
                taken += u32::from(timed);
            }
            if timed {
                spent += start.elapsed();
            }
            errors.add_snapshot(truth, state.displacements())?;
            shapes.push(state.displacements().iter().map(|vector| vector.to_array()).collect());
            estimates.extend(estimate.map(|metre| 1e3 * f64::from(metre)));
        }
        let running = (!estimates.is_empty()).then(|| estimates.iter().sum::<f64>() / estimates.len() as f64);
        // The lead-in may last to the end.
        let taken = f64::from(taken.max(1));
        let figures = Figures {
            errors,
            running,
            clip_share: if predictions > 0 {
                clips / f64::from(predictions)
            } else {
                f64::from(limited) / taken
            },
            us_per_step: 1e6 * spent.as_secs_f64() / taken,
        };
        Ok((End::Reached(figures), shapes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::{scenes, truth};

    /// A tenth of a second of a light scene.
    fn short(name: &str) -> (SceneSpec, Truth) {
        let mut scene = scenes::named(name).unwrap();
        scene.intervals = 3;
        let truth = truth::compute(&scene).unwrap();
        (scene, truth)
    }

    #[test]
    fn the_exact_step_is_the_truth_and_long_steps_diverge_and_say_so() {
        let (scene, truth) = short("cylinder");
        let exact = run(&scene, &truth, Method::Tled, 1).unwrap();
        let figures = exact.figures().unwrap();
        assert_eq!(figures.errors.skill(exact.hold), 1.0);
        assert_eq!(exact.end.to_string(), "ok");
        let hold = run(&scene, &truth, Method::Hold, 1).unwrap();
        assert_eq!(hold.figures().unwrap().errors.skill(hold.hold), 0.0);
        let long = run(&scene, &truth, Method::TledLargeStep, 100).unwrap();
        assert!(long.step_over_limit_rest > 1.0);
        assert!(matches!(long.end, End::Diverged(time) if time < 0.1), "{:?}", long.end);
    }

    #[test]
    fn multiples_that_miss_the_snapshots_are_refused() {
        let (scene, truth) = short("cylinder");
        for multiple in [0, 3] {
            assert!(matches!(run(&scene, &truth, Method::Hold, multiple), Err(LabError::Multiple { .. })));
        }
    }

    #[test]
    fn a_release_lets_go_after_its_interval() {
        let mut scene = scenes::named("release").unwrap();
        scene.released_after = Some(2);
        let whole = |scene: &SceneSpec| {
            let Ok(truth) = truth::compute(scene) else { panic!("no truth") };
            truth
        };
        scene.intervals = 4;
        let let_go = whole(&scene);
        scene.released_after = None;
        let kept = whole(&scene);
        assert_eq!(let_go.snapshots[..2], kept.snapshots[..2]);
        assert_ne!(let_go.snapshots[2], kept.snapshots[2]);
    }
}
