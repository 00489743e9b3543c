//! `[surrogate]` of a scene file: a network moves the scene after the exact step has led.
//!
//! Time goes in intervals of the network's step `D`. In each of the first the exact step of `[time]` takes as many
//! steps as it needs; the frames of the vertices follow, and the last increment is made to span `D`. From then on each
//! interval is one learned step. With `fallback` the first one that energy does not explain is undone, and the exact step
//! takes over for good.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use supple::lab::method::BURN_IN;
use supple::loads::Loads;
use supple::material::Material;
use supple::mlp::{Network, WeightBytes};
use supple::surrogate::{self, Surrogate, SurrogateReport, Vertex};
use supple::tled::Status;
use toml::Spanned;

use crate::inspect::row;
use crate::network::{describe_step, describe_tissue};
use crate::prepare::{HostScene, HostState, Setup};
use crate::run::Outcome;
use crate::scene_file::{Problem, SceneFile, SurrogateTable};
use crate::timing::{Method, Timing};
use crate::weights;

/// Learned steps that `supple inspect` times.
const TIMED: u32 = 50;

/// What `[surrogate]` asks for.
pub(crate) struct Learned {
    pub(crate) path: PathBuf,
    /// Where the weights were asked for, for complaints.
    place: String,
    memory: WeightBytes,
    /// s.
    burn_in: f64,
    fallback: bool,
}

impl Learned {
    pub(crate) fn read(file: &SceneFile, table: &SurrogateTable, time: &Timing) -> Result<Self, Problem> {
        let path = file.beside(table.weights.get_ref());
        let place = file.place(&table.weights);
        let memory = weights::read(&path).map_err(|problem| file.problem(&table.weights, problem))?;
        let learned = Self {
            path,
            place,
            memory,
            burn_in: table.burn_in.as_ref().map_or(BURN_IN, |seconds| *seconds.get_ref()),
            fallback: table.fallback.unwrap_or(false),
        };
        let step = f64::from(learned.surrogate(0)?.seconds());
        if let (Some(at), true) = (&file.scene.time.get_ref().method, time.method != Method::Tled) {
            return Err(file.problem(
                at,
                format!(
                    "method is \"{}\", but with [surrogate] the exact step leads and the network follows; leave \
                     method out",
                    time.method.name()
                ),
            ));
        }
        let burn_in = learned.burn_in;
        let at = table.burn_in.as_ref().map_or_else(|| learned.place.clone(), |at| file.place(at));
        if !(burn_in.is_finite() && burn_in >= 0.0) {
            return Err(Problem(format!("{at}: burn_in is {burn_in} s, it must be zero or more")));
        }
        if (burn_in + step) * (1.0 - 1e-6) > time.end {
            return Err(Problem(format!(
                "{at}: the exact step leads for {burn_in} s (burn_in), so a learned step of {step:.3e} s does not fit \
                 before the end, {} s",
                time.end
            )));
        }
        Ok(learned)
    }

    pub(crate) fn network(&self) -> Result<Network<'_>, Problem> {
        weights::parse(&self.path, &self.memory)
            .map_err(|problem| Problem(format!("{}: {problem}", self.place)))
    }

    /// The learned step with room for a scene's nodes.
    fn surrogate(&self, nodes: usize) -> Result<Surrogate<'_, Vec<Vertex>>, Problem> {
        Surrogate::over(self.network()?, vec![Vertex::NEW; nodes])
            .map_err(|error| Problem(format!("{}: {}: {error}", self.place, self.path.display())))
    }

    /// The damping of the training, which a scene may repeat but not change.
    pub(crate) fn damping(&self, file: &SceneFile, given: Option<&Spanned<f32>>) -> Result<f32, Problem> {
        let trained = self.network()?.recipe().damping;
        match given {
            Some(at) if !same(*at.get_ref(), trained) => Err(file.problem(
                at,
                format!(
                    "damping is {} 1/s, but {} learned a motion damped by {trained} 1/s; leave damping out to take it \
                     from there",
                    at.get_ref(),
                    self.path.display()
                ),
            )),
            _ => Ok(trained),
        }
    }

    /// The exact step of about `seconds` of which a learned step is a whole number, s.
    pub(crate) fn exact_seconds(&self, setup: &Setup, seconds: f32) -> Result<f32, Problem> {
        let step = self.network()?.recipe().step;
        let count = (step / seconds).round();
        if count >= 1.0 && (count * seconds - step).abs() <= 1e-4 * step {
            return Ok(step / count);
        }
        Err(Problem(format!(
            "{}: the exact step is {seconds} s and that of {} {step} s, which is no whole number of them; write step = \
             {} or step = \"auto\"",
            setup.time.step_at,
            self.path.display(),
            step / (step / seconds).ceil().max(1.0)
        )))
    }

    /// What a user should know before trusting the network in this scene.
    pub(crate) fn warning(&self, setup: &Setup) -> Result<Option<String>, Problem> {
        let network = self.network()?;
        if setup.is_of(network.recipe()) {
            return Ok(None);
        }
        Ok(Some(format!(
            "{}: {} learned from {}; the scene is {}: its error there is not known",
            self.place,
            self.path.display(),
            describe_tissue(&network),
            setup.describe_material()
        )))
    }
}

/// Numbers that a person may have written in two ways.
pub(crate) fn same(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-6 * a.abs().max(b.abs())
}

/// What the learned steps did on the way.
pub(crate) struct LearnedTrace {
    /// Of a learned step.
    pub(crate) seconds: f32,
    pub(crate) described: String,
    /// When the network took over, s.
    pub(crate) from: Option<f64>,
    pub(crate) steps: u64,
    pub(crate) spent: Duration,
    /// Sums over the steps, and the most.
    clipped: f64,
    outside: f64,
    pub(crate) most: SurrogateReport,
    /// When and why the exact step took over again.
    pub(crate) fell_back: Option<(f64, String)>,
}

impl LearnedTrace {
    fn add(&mut self, report: &SurrogateReport, spent: Duration) {
        self.steps += 1;
        self.spent += spent;
        self.clipped += f64::from(report.clipped);
        self.outside += f64::from(report.outside);
        self.most.clipped = self.most.clipped.max(report.clipped);
        self.most.outside = self.most.outside.max(report.outside);
    }

    pub(crate) fn us_per_step(&self) -> f64 {
        1e6 * self.spent.as_secs_f64() / self.steps.max(1) as f64
    }

    /// Shares of the free vertices that were clipped and outside, on average over the steps.
    pub(crate) fn means(&self) -> (f64, f64) {
        let steps = self.steps.max(1) as f64;
        (self.clipped / steps, self.outside / steps)
    }
}

/// A learned simulation on its way.
pub(crate) struct LearnedRun<'a> {
    surrogate: Surrogate<'a, Vec<Vertex>>,
    /// Intervals in all and in which the exact step leads.
    pub(crate) interval: u64,
    lead: u64,
    fallback: bool,
    pub(crate) trace: LearnedTrace,
}

impl<'a> LearnedRun<'a> {
    pub(crate) fn new(learned: &'a Learned, nodes: usize) -> Result<Self, Problem> {
        let surrogate = learned.surrogate(nodes)?;
        let seconds = surrogate.seconds();
        Ok(Self {
            surrogate,
            interval: 0,
            lead: (learned.burn_in / f64::from(seconds)).round() as u64,
            fallback: learned.fallback,
            trace: LearnedTrace {
                seconds,
                described: describe_step(&learned.network()?),
                from: None,
                steps: 0,
                spent: Duration::ZERO,
                clipped: 0.0,
                outside: 0.0,
                most: SurrogateReport::default(),
                fell_back: None,
            },
        })
    }

    /// The learned step, s.
    pub(crate) const fn seconds(&self) -> f32 {
        self.trace.seconds
    }

    /// Whether the exact step moves the scene.
    pub(crate) const fn is_exact(&self) -> bool {
        self.interval < self.lead || self.trace.fell_back.is_some()
    }

    /// Moves on by one interval. `exact` does so by steps of about `exact_seconds` (s).
    pub(crate) fn advance<M: Material>(
        &mut self,
        scene: &HostScene<M>,
        loads: &Loads<'_>,
        state: &mut HostState,
        outcome: &mut Outcome,
        exact_seconds: f32,
        exact: impl FnOnce(&mut HostState, &mut Outcome) -> Result<(), Problem>,
    ) -> Result<(), Problem> {
        if self.is_exact() {
            self.interval += 1;
            let before = state.displacements().to_vec();
            exact(state, outcome)?;
            if self.interval <= self.lead {
                let mut spanned = state.clone();
                spanned.span(&before, self.trace.seconds);
                self.surrogate.follow(&spanned);
                if self.interval == self.lead {
                    *state = spanned;
                }
            }
            return Ok(());
        }
        self.interval += 1;
        self.trace.from.get_or_insert(state.time());
        let before = self.fallback.then(|| state.clone());
        let clock = Instant::now();
        let status = surrogate::step(scene, loads, state, &mut self.surrogate);
        self.trace.add(self.surrogate.report(), clock.elapsed());
        if let (Some(before), Some(why)) = (before, unexplained(&status)) {
            self.trace.fell_back = Some((before.time(), why));
            *state = before;
            outcome.computed += 1;
            state.respan(exact_seconds);
            return exact(state, outcome);
        }
        outcome.steps.1 = outcome.steps.1.max(self.trace.seconds);
        outcome.enter(status, state);
        Ok(())
    }
}

/// Why a step cannot be believed as far as energy tells: what it did.
fn unexplained(status: &Status) -> Option<String> {
    match status {
        Status::Diverged(divergence) => Some(divergence.to_string()),
        Status::Limited { energy_excess, .. } if *energy_excess > 0.0 => {
            Some(format!("exceeded what loads and supports ever gave by {:.1} %", 100.0 * energy_excess))
        }
        _ => None,
    }
}

/// Prints what a learned step of the scene costs.
pub(crate) fn cost<M: Material>(
    learned: &Learned,
    setup: &Setup,
    scene: &HostScene<M>,
    loads: &Loads<'_>,
) -> Result<(), Problem> {
    let network = learned.network()?;
    let mut surrogate = learned.surrogate(scene.node_count())?;
    let mut state = setup.state();
    let start = Instant::now();
    for _ in 0..TIMED {
        // Only the time counts here: every step does the same work, whatever becomes of the motion.
        let _ = surrogate::step(scene, loads, &mut state, &mut surrogate);
    }
    let seconds = start.elapsed().as_secs_f64() / f64::from(TIMED);
    println!("\nlearned step");
    row(
        "network",
        format!("{}, {} multiply-adds per vertex", learned.path.display(), network.multiply_adds()),
    );
    row("step", describe_step(&network));
    row(
        "memory",
        format!(
            "{:.1} kB of weights, {:.1} kB of vertices, beside the above",
            1e-3 * learned.memory.bytes().len() as f64,
            1e-3 * (scene.node_count() * size_of::<Vertex>()) as f64
        ),
    );
    row(
        "time per step",
        format!("{:.1} us, {:.3} times real time", 1e6 * seconds, f64::from(surrogate.seconds()) / seconds),
    );
    Ok(())
}
