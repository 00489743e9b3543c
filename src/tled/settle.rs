//! To rest under the loads, in two ways by turns. Where no instrument touches, conjugate gradients (`conjugate.rs`) lead
//! there, and a motion says whether they have arrived; with instruments, or where gradients lead astray (through crushed
//! tissue, or no nearer), the motion goes all the way. Nothing is to be tuned.
//!
//! The motion is dynamic relaxation with kinetic damping (Day 1965; Barnes 1999, "Form finding and analysis
//! of tension structures by dynamic relaxation"): the body moves without damping, and where its kinetic energy has
//! passed a peak it goes back to the estimated peak and all velocities are set to zero.
//! The shape at rest does not depend on the masses. So those of these steps are chosen so that the step is near the
//! critical one at every node, and not only in the smallest or stiffest element: with `K <= sum_a b_a |u_a|^2`, where
//! `b_a` (N/m) is the bound of [`super::critical_step`] with unit masses,
//!
//! ```text
//! du+ = du + f_a / s_a,    s_a = b_a / (4 * 0.9)        the first step after a stop is half of that
//! ```
//! Time stands still: ramps and paths of instruments stay where they are at the time of the state.
//!
//! **How far from rest.** In a swing of `n` steps, from one stop to the next, the node that moves farthest does so by
//! `d`. A mode whose quarter period is `N` steps goes by `1 - cos(pi n / 2 N)` times its distance from rest meanwhile.
//! With the longest swing so far as `N` the distance at the end is about
//!
//! ```text
//! d max(1, 8 / pi^2 (N / n)^2)
//! ```
//! or less: what is left of a mode after a whole swing is less than what it went. The body is at rest when two swings
//! in a row say so, or gradients and the swing after them.

use bytemuck::{must_cast_slice, must_cast_slice_mut};
use glam::Vec4;

use crate::copy::copy;
use crate::element::{ElementMaterial, Extremes, NodeInertia};
use crate::held_pulls::HeldPulls;
use crate::loads::{Loads, LoadsOverTime};
use crate::scene::{AsScene, SceneView};
use crate::simd::NodeVector;
use crate::state::{AsState, StateView};
use crate::step::{CallingThread, Cause, Divergence, EnergyBalance, Status, Step, Threads, Trial};

use super::conjugate::{Conjugate, Line};
use super::critical::each_rate;
use super::relaxation::{NodeMotion, Relaxation, go_back};
use super::stop_in;

/// Share of the largest stable stiffness that is taken.
const SHARE: f32 = 0.9;
/// What time goes on by in a step, s: enough to tell states apart, too little for a ramp or an instrument.
const SECONDS: f32 = 1e-8;
/// Steps in which supports without a ramp go evenly to where they are asked for.
const STEPS_OF_SUPPORTS: u32 = 64;
/// Most steps between two looks at the bounds.
const STEPS_BETWEEN_LOOKS: u32 = 128;
/// Relative fall of the least volume ratio, or rise of the saturation, after which they are looked at at once.
const SQUEEZE: f32 = 0.1;
/// Share of the largest displacement below which a distance from rest takes more than single precision, and the same of `|f| / b` along
/// gradients: sixteen times the rounding of a displacement.
const FINE: f32 = 2e-3;
const FINE_GRADIENT: f32 = 1e-6;
/// How often the steps are halved after one was refused.
const MOST_HALVINGS: u32 = 8;
/// No swing is shorter than this share of the longest one: where stiff modes alone were stopped, soft ones would never
/// begin to move.
const SHORTEST: u32 = 8;
/// Steps along gradients, at least, as a share of those of the first swing: each goes one element farther, and has not met all of a body
/// before. And at most for each step of the longest swing.
const LEAST_GRADIENTS: f32 = 0.35;
const MOST_GRADIENTS: u32 = 32;
/// They end so much nearer to rest than asked for, by their own estimate, and are looked at by a swing, so many times at most.
const CLOSER: f32 = 0.1;
const MOST_CHECKS: u32 = 8;
/// What one swing alone tells is multiplied by this.
const SURE: f32 = 1.5;
/// Steps that a swing is taken to last at most by the stiffness that gradients have met.
const MOST_LONGEST: u32 = 2000;
/// Least volume ratio that they may lead through.
const CRUSHED: f32 = 0.1;
/// How far a line may lead from a shape that is not stable, over the distance from rest that is asked for: below it is rounding.
const UNSTABLE: f32 = 10.0;
/// A swing of a body lasts at least so many steps for each of its nodes along an edge.
const STEPS_A_NODE: f32 = 8.0;

/// What became of [`settle`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Whether the body is at rest to within the tolerance. Not where the work did not suffice, or a step was refused:
    /// the state is then where the steps have brought it.
    pub at_rest: bool,
    /// The estimate of the largest distance of a node from where it rests, m; infinite before the first swing has ended.
    pub remaining: f32,
    /// Steps that were computed.
    pub steps: u32,
    /// That of the last step, without what its energy would say.
    pub status: Status,
}

/// Why [`settle`] was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SettleError {
    /// The tolerance is not a finite positive number.
    Metre {
        /// m.
        metre: f32,
    },
    /// Less storage than [`vectors_to_settle`].
    Capacity {
        /// Vectors needed.
        needed: usize,
        /// Vectors given.
        capacity: usize,
    },
    /// The stiffness of some element is not a finite number.
    NotFinite,
}

impl core::fmt::Display for SettleError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::Metre { metre } => {
                write!(f, "settle to within {metre} m: it must be a finite positive number")
            }
            Self::Capacity { needed, capacity } => {
                write!(f, "to settle takes {needed} vectors, there is room for {capacity}")
            }
            Self::NotFinite => f.write_str("the stiffness of some element is not a finite number"),
        }
    }
}

impl core::error::Error for SettleError {}

/// Vectors of storage that [`settle`] needs for a scene of so many nodes.
#[must_use]
pub const fn vectors_to_settle(nodes: usize) -> usize {
    3 * nodes + nodes.div_ceil(4)
}

/// Brings a body to rest: every node to within about `metre` (m) of where it rests under these loads, in at most
/// `most_steps` steps, one at least, each of which takes about as long as an exact one. Loads act as at the time of the
/// state, which stands still; supports without a ramp go evenly to where they are asked for in the first 64 steps.
/// Velocities are zero afterwards, and the energy balance is that of [`super::stop`]. `storage` of
/// [`vectors_to_settle`] vectors is overwritten.
pub fn settle(
    scene: &impl AsScene,
    loads: &mut impl LoadsOverTime,
    state: &mut impl AsState,
    metre: f32,
    most_steps: u32,
    storage: &mut [NodeVector],
) -> Result<Settled, SettleError> {
    settle_in_parts(scene.as_scene(), loads, state.as_state(), metre, most_steps, storage, &CallingThread)
}

/// The same, to the bit, on several threads of the host.
// Not inlined: other crates use the one that is compiled here.
#[inline(never)]
pub fn settle_in_parts<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    loads: &mut impl LoadsOverTime,
    mut state: StateView<'_>,
    metre: f32,
    most_steps: u32,
    storage: &mut [NodeVector],
    threads: &impl Threads,
) -> Result<Settled, SettleError> {
    if !(metre.is_finite() && metre > 0.0) {
        return Err(SettleError::Metre { metre });
    }
    let nodes = scene.node_count();
    let (units, begin, base, rates) = split(scene.inertia, storage)?;
    let nothing = |status| Settled { at_rest: false, remaining: f32::INFINITY, steps: 0, status };
    let room = state.capacity_for(scene.element());
    // Seconds of a constant, which can be a step's.
    let (true, Ok(step)) = (room >= nodes && nodes > 0, Step::unchecked(SECONDS, 0.0)) else {
        return Ok(nothing(Status::Mismatch { nodes, room }));
    };
    let mut bounds = Bounds { units, rates, share: SHARE, left: 0, between: 1, extremes: Extremes::REST };
    let is_finite = stop_in(scene, state.reborrow()) && {
        let first = loads.of_step(&state, SECONDS, STEPS_OF_SUPPORTS);
        bounds.look(scene, &first, state.reborrow(), false)
    };
    if !is_finite {
        return Err(SettleError::NotFinite);
    }
    let time = state.progress.time;
    copy(begin, state.displacement);
    let (swing, settled) = (Swing::first(nodes), nothing(Status::Ok));
    let line = Line::start(scene);
    let mut run = Run {
        metre,
        step,
        bounds,
        swing,
        begin,
        base,
        line,
        way: Way::Dynamic,
        gradients: 0,
        least: (f32::INFINITY, 0),
        checks: 0,
        halvings: 0,
        is_fine: false,
        settled,
    };
    for taken in 0..most_steps.max(1) {
        let left = STEPS_OF_SUPPORTS.saturating_sub(taken).max(1);
        let of_step = loads.of_step(&state, SECONDS, left);
        if left == 1 && taken == STEPS_OF_SUPPORTS && !of_step.motions().is_empty() {
            // What swings before have told was of other supports.
            (run.swing.told, run.settled.remaining) = (f32::INFINITY, f32::INFINITY);
        }
        let is_free = of_step.contact().is_none_or(|contact| contact.instruments().is_empty());
        if run.way == Way::Dynamic && is_free && (left == 1 || of_step.motions().is_empty()) {
            run.turn_to_gradients(state.reborrow());
        }
        let goes_on = match run.way {
            Way::Gradients => run.go_along(scene, &of_step, state.reborrow(), threads),
            _ => run.take(scene, &of_step, state.reborrow(), threads),
        };
        if !goes_on || (left == 1 && run.settled.remaining < metre) {
            break;
        }
    }
    state.progress.time = time;
    let settled = run.settled;
    let status = match settled.status {
        // The energy of these steps, of other masses, is none of the body's.
        Status::Limited { .. } => Status::of_taken(&state.progress.extremes, &EnergyBalance::NEW, false),
        status => status,
    };
    // These steps hold back others.
    state.progress.pulls = HeldPulls::NONE;
    // It has been before.
    let _ = stop_in(scene, state);
    Ok(Settled { at_rest: status.is_taken() && settled.remaining < metre, status, ..settled })
}

/// The parts of the storage: unit masses along free axes, where a swing began, forces at the base of a line, bounds.
type Parts<'a> = (&'a [NodeVector], &'a mut [NodeVector], &'a mut [NodeVector], &'a mut [f32]);

fn split<'a>(inertia: &[NodeInertia], storage: &'a mut [NodeVector]) -> Result<Parts<'a>, SettleError> {
    let (nodes, capacity) = (inertia.len(), storage.len());
    let needed = vectors_to_settle(nodes);
    if capacity < needed {
        return Err(SettleError::Capacity { needed, capacity });
    }
    let (units, rest) = storage.split_at_mut(nodes.min(capacity));
    let (begin, rest) = rest.split_at_mut(nodes.min(rest.len()));
    let (base, rates) = rest.split_at_mut(nodes.min(rest.len()));
    for (unit, inertia) in units.iter_mut().zip(inertia) {
        let [x, y, z] = inertia.inverse.map(|inverse| if inverse > 0.0 { 1.0 } else { 0.0 });
        unit.0 = [x, y, z, 1.0];
    }
    Ok((units, begin, base, must_cast_slice_mut(rates).get_mut(..nodes).unwrap_or_default()))
}

/// Bounds of the stiffness at the nodes.
struct Bounds<'a> {
    /// Unit masses along free axes.
    units: &'a [NodeVector],
    /// N/m.
    rates: &'a mut [f32],
    /// Of the largest stable step, squared.
    share: f32,
    /// Steps to the next look, and from one to the next.
    left: u32,
    between: u32,
    /// At the last look.
    extremes: Extremes<f32>,
}

impl Bounds<'_> {
    /// Computes them for the state, with or without those of pulls. Whether they are numbers.
    fn look<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
        with_pulls: bool,
    ) -> bool {
        let StateView { displacement, increment, force, volume, progress, pushes, .. } = state;
        let (rates, mut finite) = (&mut *self.rates, true);
        let vectors = [&mut *displacement, increment, force];
        let found = each_rate(scene, must_cast_slice(self.units), vectors, volume, |node, rate| {
            finite &= rate.is_finite();
            if let Some(to) = rates.get_mut(node) {
                *to = rate.max(f32::MIN_POSITIVE);
            }
        });
        if let Some(pressure) = loads.pressure() {
            pressure.add_stiffness(progress.time, displacement, rates);
        }
        if let Some(contact) = loads.contact() {
            contact.add_stiffness(pushes, progress, displacement, rates);
        }
        if let Some(pulls) = loads.pulls().filter(|_| with_pulls) {
            for (_, pull) in pulls.acting() {
                pulls.each_stiffness(pull, |pulled, stiffness| {
                    if let Some(rate) = rates.get_mut(pulled.node as usize) {
                        *rate += stiffness;
                    }
                });
            }
        }
        self.left = self.between;
        self.between = (2 * self.between).min(STEPS_BETWEEN_LOOKS);
        self.extremes = progress.extremes;
        found.is_some() && finite
    }

    /// After a step with these extremes: they are to be looked at sooner where elements are squeezed.
    fn enter(&mut self, now: &Extremes<f32>) {
        self.left = self.left.saturating_sub(1);
        let squeezed = 1.0 + now.least_change < (1.0 - SQUEEZE) * (1.0 + self.extremes.least_change)
            || now.saturation > self.extremes.saturation + SQUEEZE;
        if squeezed {
            (self.left, self.between) = (0, 1);
        }
    }
}

/// A motion from one stop to the next.
#[derive(Clone, Copy)]
struct Swing {
    steps: u32,
    /// Steps of the longest one so far.
    longest: u32,
    /// Kinetic energy at the latest step, J.
    kinetic: f64,
    /// Whether it was more than before.
    rises: bool,
    /// What the swing before has told of the distance from rest, m.
    told: f32,
}

impl Swing {
    /// The first one of a body of so many nodes.
    fn first(nodes: usize) -> Self {
        let longest = (STEPS_A_NODE * libm::cbrtf(nodes as f32)) as u32;
        Self { steps: 0, longest, kinetic: 0.0, rises: false, told: f32::INFINITY }
    }

    /// Enters a step with this kinetic energy, J. Whether the swing has ended.
    fn enter(&mut self, kinetic: f64) -> bool {
        self.steps += 1;
        let (rises, rose) = (kinetic > self.kinetic, self.rises);
        (self.kinetic, self.rises) = (kinetic, rises);
        // Where nothing moves there is no peak.
        ((rose && !rises) || kinetic == 0.0) && self.steps >= self.longest / SHORTEST
    }

    /// Begins the next one. Gives the distance from rest where the largest motion of a node was this, m: what this swing
    /// tells, or the one before if that is more.
    fn end(&mut self, farthest: f32) -> f32 {
        const FACTOR: f32 = 8.0 / (core::f32::consts::PI * core::f32::consts::PI);
        self.longest = self.longest.max(self.steps);
        let share = self.longest as f32 / self.steps.max(1) as f32;
        let tells = farthest * (FACTOR * share * share).max(1.0);
        let remaining = self.told.max(tells);
        (self.steps, self.kinetic, self.told) = (0, 0.0, tells);
        remaining
    }
}

/// A body on its way to rest.
struct Run<'a> {
    /// How near to rest it is to come, m.
    metre: f32,
    step: Step,
    bounds: Bounds<'a>,
    swing: Swing,
    /// Where the nodes were when it began, m.
    begin: &'a mut [NodeVector],
    /// Forces at the base of a line, N.
    base: &'a mut [NodeVector],
    line: Line,
    way: Way,
    /// Steps along gradients.
    gradients: u32,
    /// The least `|f| / b` of them, m, and after how many.
    least: (f32, u32),
    checks: u32,
    halvings: u32,
    is_fine: bool,
    settled: Settled,
}

/// How a body goes to rest.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
enum Way {
    /// By kinetic damping, until it may go on along gradients.
    Dynamic,
    Gradients,
    /// By kinetic damping: a step along gradients was refused.
    DynamicToTheEnd,
    /// By a swing that is to say that the body is at rest.
    Check,
}

impl Run<'_> {
    /// Takes a step. Whether others may follow.
    fn take<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        mut state: StateView<'_>,
        threads: &impl Threads,
    ) -> bool {
        let Self { step, bounds, swing, settled, begin, is_fine, way, checks, metre, .. } = self;
        // Not after the last step, whose forces stay.
        if bounds.left == 0 && !bounds.look(scene, loads, state.reborrow(), false) {
            let time = state.progress.time;
            settled.status = Status::Diverged(Divergence { time, node: 0, cause: Cause::NotFinite });
            return false;
        }
        let first = if state.dt > 0.0 { 1.0 } else { 0.5 };
        let node = NodeMotion { push: 4.0 * first * bounds.share };
        let mut relax = Relaxation { step, node, rates: bounds.rates, threads, is_fine: *is_fine };
        let status = match Trial::begin(scene, loads, state.reborrow(), usize::MAX) {
            Ok(trial) => trial.take(step, &mut relax),
            Err(refused) => refused,
        };
        settled.steps += 1;
        settled.status = status;
        if !status.is_taken() {
            return self.retry(scene, loads, state, status);
        }
        let (kinetic, extremes) = (state.energy_balance.kinetic, state.progress.extremes);
        if swing.enter(kinetic) {
            go_back(scene, state.reborrow(), node, bounds.rates);
            state.progress.energy_balance.dissipated += kinetic;
            settled.remaining = swing.end(farthest(begin, state.displacement));
            if *way == Way::Check {
                settled.remaining = settled.remaining.max(SURE * swing.told);
                if settled.remaining >= *metre {
                    *way = if *checks < MOST_CHECKS { Way::Dynamic } else { Way::DynamicToTheEnd };
                }
            }
            copy(begin, state.displacement);
            *is_fine = settled.remaining < FINE * farthest(&[], state.displacement);
        }
        bounds.enter(&extremes);
        true
    }

    fn turn_to_gradients(&mut self, state: StateView<'_>) {
        self.way = Way::Gradients;
        (self.bounds.left, self.gradients, self.least) = (0, 0, (f32::INFINITY, 0));
        self.line.again();
        state.increment.fill(NodeVector::ZERO);
        self.base.fill(NodeVector::ZERO);
        copy(self.begin, state.displacement);
    }

    /// Takes a step along a gradient. Whether others may follow.
    fn go_along<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        mut state: StateView<'_>,
        threads: &impl Threads,
    ) -> bool {
        let Self { step, bounds, settled, begin, base, line, gradients, least, checks, is_fine, metre, .. } = self;
        let is_finite = bounds.left > 0 || bounds.look(scene, loads, state.reborrow(), true);
        let status = if is_finite {
            let mut steps = Conjugate::new(line, bounds.rates, base, threads, *is_fine);
            match Trial::begin(scene, loads, state.reborrow(), usize::MAX) {
                Ok(trial) => trial.take(step, &mut steps),
                Err(refused) => refused,
            }
        } else {
            Status::Diverged(Divergence { time: state.progress.time, node: 0, cause: Cause::NotFinite })
        };
        settled.steps += 1;
        settled.status = status;
        let is_astray = !status.is_taken()
            || 1.0 + state.progress.extremes.least_change < CRUSHED
            || line.is_unstable(UNSTABLE * *metre);
        if is_astray {
            // Back to where they began.
            copy(state.displacement, begin);
            state.remainder.fill(NodeVector::ZERO);
            return self.go_on_by_motion(scene, state, f32::INFINITY);
        }
        *gradients += 1;
        let usual = Swing::first(scene.node_count()).longest;
        let met_all = *gradients as f32 >= LEAST_GRADIENTS * usual as f32;
        let remaining = if met_all { line.remaining() } else { f32::INFINITY };
        *is_fine = line.gradient() < FINE_GRADIENT * farthest(&[], state.displacement);
        let extremes = state.progress.extremes;
        bounds.enter(&extremes);
        if line.gradient() < 0.5 * least.0 {
            *least = (line.gradient(), *gradients);
        }
        let swing = usual.max(line.quarter(4.0 * bounds.share).min(MOST_LONGEST));
        let is_stuck = *gradients > least.1 + (*gradients / 2).max(16 * swing) || *gradients >= MOST_GRADIENTS * swing;
        if is_stuck {
            // Rounding may keep them there: a motion goes on if it does not say that the body is at rest.
            *checks = MOST_CHECKS;
            let told = if remaining < *metre { remaining } else { f32::INFINITY };
            return self.go_on_by_motion(scene, state, told);
        }
        if remaining < CLOSER * *metre {
            return self.go_on_by_motion(scene, state, remaining);
        }
        true
    }

    /// From where gradients have led, which say that so much is left to go, m.
    fn go_on_by_motion<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        state: StateView<'_>,
        told: f32,
    ) -> bool {
        let next = if told.is_finite() { Way::Check } else { Way::DynamicToTheEnd };
        (self.way, self.bounds.left, self.checks) = (next, 0, self.checks + 1);
        self.swing.told = told;
        // Near rest stiff motions alone may be left to tell how long a swing is.
        self.swing.longest = self.swing.longest.max(self.line.quarter(4.0 * self.bounds.share).min(MOST_LONGEST));
        copy(self.begin, state.displacement);
        stop_in(scene, state)
    }

    /// After a step that was refused: from a stop, with half the step. Whether that may help.
    fn retry<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        mut state: StateView<'_>,
        status: Status,
    ) -> bool {
        let too_long =
            matches!(status, Status::Diverged(Divergence { cause: Cause::NotFinite | Cause::Energy { .. }, .. }));
        self.halvings += 1;
        if !too_long || self.halvings > MOST_HALVINGS || !stop_in(scene, state.reborrow()) {
            return false;
        }
        // Half the step is a quarter of its square.
        self.bounds.share *= 0.25;
        self.bounds.between = 1;
        self.swing = Swing { steps: 0, kinetic: 0.0, told: f32::INFINITY, ..self.swing };
        copy(self.begin, state.displacement);
        self.bounds.look(scene, loads, state, false)
    }
}

/// The largest distance of a node between two states, of which the first one may be that at rest, m.
fn farthest(before: &[NodeVector], now: &[NodeVector]) -> f32 {
    let square = |(before, now): (&NodeVector, &NodeVector)| {
        let way = Vec4::from(now.0) - Vec4::from(before.0);
        way.truncate().length_squared()
    };
    let before = before.iter().chain(core::iter::repeat(&NodeVector::ZERO));
    libm::sqrtf(before.zip(now).map(square).fold(0.0, f32::max))
}
