//! `[time]` of a scene file: the method, its step, the end, the frames.

use supple::inertia::{Cells, Method};
use toml::Spanned;

use super::file::{SceneFile, StepLength, TimeTable};
use crate::problem::Problem;

/// A length of step as asked for.
#[derive(Clone, Copy)]
pub enum StepChoice {
    Seconds(f32),
    /// Times the bound of the critical step at rest.
    Multiple(f32),
    /// 0.9 of the critical step, asked again while running; of adaptive steps the longest that pays.
    Auto,
}

/// Of each frame some files are written.
const MOST_FRAMES: u32 = 1_000_000;

/// What `[time]` asks for.
pub struct Timing {
    /// Of steps beyond the critical one; none is the exact step.
    pub(crate) method: Option<Method>,
    /// A method by a name that it had once, and what to write.
    pub(crate) old_name: Option<String>,
    pub step: StepChoice,
    /// Whether steps choose their length, up to `step`.
    pub(crate) is_adaptive: bool,
    /// Mean error of the nodes that is accepted, m.
    pub(crate) tolerance: Option<f32>,
    /// Where the step was asked for, for complaints.
    pub(crate) step_at: String,
    /// Where the cells of the lattice were, if they were.
    pub(crate) lattice_at: Option<String>,
    /// s.
    pub(crate) end: f64,
    pub(crate) frames: u32,
    /// Within this distance of rest (m) the body is brought before it moves, if it is.
    pub(crate) settle: Option<f32>,
}

impl Timing {
    pub(crate) fn read(file: &SceneFile) -> Result<Self, Problem> {
        let time = file.scene.time.get_ref();
        let ReadMethod { method, is_auto: names_auto, old_name } = read_method(file, time)?;
        let tolerance = read_tolerance(file, time, method.as_ref())?;
        let is_auto = match &time.step {
            Some(at) => matches!(at.get_ref(), StepLength::Named(name) if name == "auto"),
            None => true,
        };
        let is_adaptive = names_auto || (method.is_some() && tolerance.is_some() && is_auto);
        let step = match &time.step {
            Some(at) => read_step(file, at, method.as_ref().filter(|_| !is_adaptive))?,
            None if is_adaptive || method.is_none() => StepChoice::Auto,
            None => {
                return Err(file.problem(
                    &file.scene.time,
                    "step is missing: method \"long\" needs seconds, or a multiple of the critical step, as in \"20x\"; \
                     method = \"auto\" chooses its own",
                ));
            }
        };
        let method = match &time.lattice {
            Some(at) => Some(with_lattice(file, at, method.as_ref())?),
            None => method,
        };
        let end = *time.end.get_ref();
        if !(end.is_finite() && end > 0.0) {
            return Err(file.problem(&time.end, format!("end is {end} s, it must be a positive number")));
        }
        let frames = time.frames.as_ref().map_or(1, |frames| *frames.get_ref());
        if let (0, Some(at)) = (frames, &time.frames) {
            return Err(file.problem(at, "frames is 0; the last state is always written, so give 1 or more"));
        }
        if let (true, Some(at)) = (frames > MOST_FRAMES, &time.frames) {
            return Err(file.problem(at, format!("frames is {frames}; at most {MOST_FRAMES} are written")));
        }
        let lattice_at = time.lattice.as_ref().map(|at| file.place(at));
        let step_at = time.step.as_ref().map_or_else(|| file.place(&file.scene.time), |at| file.place(at));
        let settle = time.settle.as_ref().map(|at| *at.get_ref());
        if let (Some(metre), Some(at)) = (settle, &time.settle)
            && !(metre.is_finite() && metre > 0.0)
        {
            return Err(file.problem(at, format!("settle is {metre} m, it must be a positive number")));
        }
        let timing = Self { method, old_name, step, is_adaptive, tolerance, step_at, lattice_at, end, frames, settle };
        if let StepChoice::Seconds(seconds) = step {
            timing.check_length(seconds)?;
        }
        Ok(timing)
    }

    /// The exact step at its automatic length, with frames at whole numbers of steps of the crate's networks.
    pub(crate) fn of_demo() -> Self {
        Self {
            method: None,
            old_name: None,
            step: StepChoice::Auto,
            is_adaptive: false,
            tolerance: None,
            step_at: "demo".into(),
            lattice_at: None,
            end: 1.02,
            frames: 34,
            settle: None,
        }
    }

    /// Whether exact steps follow the critical step. Adaptive steps do not count.
    pub(crate) const fn sets_own_pace(&self) -> bool {
        matches!(self.step, StepChoice::Auto) && !self.is_adaptive
    }

    /// Refuses a step beyond the end, which is rounded as the step is: 0.1 in float32 is above 0.1 in float64.
    pub(crate) fn check_length(&self, seconds: f32) -> Result<(), Problem> {
        if seconds <= self.end as f32 {
            return Ok(());
        }
        Err(Problem(format!("{}: the step of {seconds} s is longer than the end, {} s", self.step_at, self.end)))
    }
}

/// The name of a method in scene files; none is the exact step.
pub(crate) const fn method_name(method: Option<&Method>) -> &'static str {
    match method {
        None => "exact",
        Some(_) => "long",
    }
}

#[derive(Default)]
struct ReadMethod {
    method: Option<Method>,
    is_auto: bool,
    old_name: Option<String>,
}

fn read_method(file: &SceneFile, time: &TimeTable) -> Result<ReadMethod, Problem> {
    let Some(at) = &time.method else { return Ok(ReadMethod::default()) };
    let name = at.get_ref().as_str();
    let (method, now) = match name {
        "exact" | "tled" => (None, "exact"),
        "auto" => (Some(Method::new(Cells::Suggested)), "auto"),
        "long" | "damped" | "multilevel" | "mass-scaled" => (Some(Method::new(Cells::Suggested)), "long"),
        _ => {
            let text = format!(
                "method \"{name}\" is not known; \"exact\", \"long\" and \"auto\" are, and [learned] for a network"
            );
            return Err(file.problem(at, text));
        }
    };
    let remark = || file.problem(at, format!("method \"{name}\" is now \"{now}\": write method = \"{now}\"")).0;
    Ok(ReadMethod { method, is_auto: now == "auto", old_name: (name != now).then(remark) })
}

fn read_tolerance(file: &SceneFile, time: &TimeTable, method: Option<&Method>) -> Result<Option<f32>, Problem> {
    let Some(at) = &time.tolerance else { return Ok(None) };
    let tolerance = *at.get_ref();
    if !(tolerance.is_finite() && tolerance > 0.0) {
        return Err(file.problem(at, format!("tolerance is {tolerance} m, it must be a positive number")));
    }
    if method.is_none() && file.scene.learned.is_none() {
        return Err(file.problem(
            at,
            "tolerance is given, but exact steps have no error to be tolerated; method = \"auto\" takes longer ones within it",
        ));
    }
    Ok(Some(tolerance))
}

fn read_step(file: &SceneFile, at: &Spanned<StepLength>, method: Option<&Method>) -> Result<StepChoice, Problem> {
    let positive = |value: f32| value.is_finite() && value > 0.0;
    match at.get_ref() {
        StepLength::Seconds(seconds) if positive(*seconds) => Ok(StepChoice::Seconds(*seconds)),
        StepLength::Seconds(seconds) => {
            Err(file.problem(at, format!("step is {seconds} s, it must be a positive number")))
        }
        StepLength::Named(name) if name == "auto" && method.is_none() => Ok(StepChoice::Auto),
        StepLength::Named(name) if name == "auto" => Err(file.problem(
            at,
            format!(
                "step \"auto\" stays below the critical step, which method \"{}\" is there to exceed; give seconds, \
                 or a multiple of the critical step, as in \"20x\"",
                method_name(method)
            ),
        )),
        StepLength::Named(name) => match name.strip_suffix('x').and_then(|number| number.parse().ok()) {
            Some(multiple) if positive(multiple) => Ok(StepChoice::Multiple(multiple)),
            Some(_) => Err(file.problem(at, format!("step is \"{name}\", it must be a positive multiple"))),
            None => Err(file.problem(
                at,
                format!(
                    "step \"{name}\" is not known; give seconds, \"auto\", or a multiple of the critical step, \
                     as in \"20x\""
                ),
            )),
        },
    }
}

/// The method with its lattice given by hand.
fn with_lattice(file: &SceneFile, at: &Spanned<[u32; 3]>, method: Option<&Method>) -> Result<Method, Problem> {
    let cells = *at.get_ref();
    if method.is_none() {
        let text = format!("lattice is {cells:?}, but method \"exact\" has none; \"long\" and \"auto\" have");
        return Err(file.problem(at, text));
    }
    if cells.contains(&0) {
        return Err(file.problem(at, format!("lattice is {cells:?}; give at least 1 cell along each axis")));
    }
    Ok(Method::new(Cells::Given(cells)))
}
