//! `[time]` of a scene file: the method, its step, the end, the frames.

use toml::Spanned;

use crate::scene_file::{Problem, SceneFile, StepLength, TimeTable};

/// How the scene is moved.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(crate) enum Method {
    /// The exact step.
    Tled,
    /// Inertia raised where the step would be unstable.
    MassScaled,
    /// The same, with a lattice that gives smooth motion its inertia back.
    Multilevel,
    /// The same, with rough motion damped as a network says.
    Damped,
}

impl Method {
    const ALL: [Self; 4] = [Self::Tled, Self::MassScaled, Self::Multilevel, Self::Damped];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Tled => "tled",
            Self::MassScaled => "mass-scaled",
            Self::Multilevel => "multilevel",
            Self::Damped => "damped",
        }
    }

    pub(crate) const fn has_lattice(self) -> bool {
        matches!(self, Self::Multilevel | Self::Damped)
    }
}

/// A length of step as asked for.
#[derive(Clone, Copy)]
pub(crate) enum StepChoice {
    Seconds(f32),
    /// Times the bound of the critical step at rest.
    Multiple(f32),
    /// 0.9 of the critical step, asked again while running.
    Auto,
}

/// What `[time]` asks for.
pub(crate) struct Timing {
    pub(crate) method: Method,
    pub(crate) step: StepChoice,
    /// Where the step was asked for, for complaints.
    pub(crate) step_at: String,
    /// Cells of the lattice by hand, and where they stand.
    pub(crate) lattice: Option<([u32; 3], String)>,
    pub(crate) end: f64,
    pub(crate) frames: u32,
}

impl Timing {
    pub(crate) fn read(file: &SceneFile) -> Result<Self, Problem> {
        let time = file.scene.time.get_ref();
        let method = read_method(file, time)?;
        let step = read_step(file, &time.step, method)?;
        let lattice = match &time.lattice {
            Some(at) => Some((read_lattice(file, at, method)?, file.place(at))),
            None => None,
        };
        let end = *time.end.get_ref();
        if !(end.is_finite() && end > 0.0) {
            return Err(file.problem(&time.end, format!("end is {end} s, it must be a positive number")));
        }
        let frames = time.frames.as_ref().map_or(1, |frames| *frames.get_ref());
        if let (0, Some(at)) = (frames, &time.frames) {
            return Err(file.problem(at, "frames is 0; the last state is always written, so give 1 or more"));
        }
        let timing = Self { method, step, step_at: file.place(&time.step), lattice, end, frames };
        if let StepChoice::Seconds(seconds) = step {
            timing.check_length(seconds)?;
        }
        Ok(timing)
    }

    /// The exact step at its automatic length for one second.
    pub(crate) fn of_demo() -> Self {
        Self {
            method: Method::Tled,
            step: StepChoice::Auto,
            step_at: "demo".into(),
            lattice: None,
            end: 1.0,
            frames: 30,
        }
    }

    /// Refuses a step beyond the end.
    pub(crate) fn check_length(&self, seconds: f32) -> Result<(), Problem> {
        if f64::from(seconds) <= self.end {
            return Ok(());
        }
        Err(Problem(format!(
            "{}: the step of {seconds} s is longer than the end, {} s",
            self.step_at, self.end
        )))
    }
}

fn read_method(file: &SceneFile, time: &TimeTable) -> Result<Method, Problem> {
    let Some(at) = &time.method else {
        return Ok(Method::Tled);
    };
    let name = at.get_ref();
    Method::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| {
        file.problem(
            at,
            format!(
                "method \"{name}\" is not known; \"tled\", \"mass-scaled\", \"multilevel\" and \"damped\" are"
            ),
        )
    })
}

fn read_step(file: &SceneFile, at: &Spanned<StepLength>, method: Method) -> Result<StepChoice, Problem> {
    let positive = |value: f32| value.is_finite() && value > 0.0;
    match at.get_ref() {
        StepLength::Seconds(seconds) if positive(*seconds) => Ok(StepChoice::Seconds(*seconds)),
        StepLength::Seconds(seconds) => {
            Err(file.problem(at, format!("step is {seconds} s, it must be a positive number")))
        }
        StepLength::Named(name) if name == "auto" && method == Method::Tled => Ok(StepChoice::Auto),
        StepLength::Named(name) if name == "auto" => Err(file.problem(
            at,
            format!(
                "step \"auto\" stays below the critical step, which method \"{}\" is there to exceed; give seconds, \
                 or a multiple of the critical step, as in \"20x\"",
                method.name()
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

fn read_lattice(file: &SceneFile, at: &Spanned<[u32; 3]>, method: Method) -> Result<[u32; 3], Problem> {
    let cells = *at.get_ref();
    if !method.has_lattice() {
        return Err(file.problem(
            at,
            format!(
                "lattice is {cells:?}, but method \"{}\" has none; \"multilevel\" and \"damped\" have",
                method.name()
            ),
        ));
    }
    if cells.contains(&0) {
        return Err(file.problem(at, format!("lattice is {cells:?}; give at least 1 cell along each axis")));
    }
    Ok(cells)
}
