//! Hard cases: is a run ever wrong without a word? Scenes made to break a step, and random ones, at 10 to 100 times the
//! critical step, and by exact steps at the critical one and beyond. A snapshot is wrong if the mean error of the nodes
//! exceeds a millimetre and a fifth of the motion so far; it is silently wrong if every step since the snapshot before
//! was [`supple::step::Status::Ok`]. And the reverse: how often are ordinary scenes, at 10 and 20 times the critical
//! step, doubted without reason?
//!
//! | module | what it holds |
//! |---|---|
//! | [`cases`] | scenes that are made to break a step |
//! | [`random`] | random bodies, materials, supports and loads |
//! | [`press`] | balls that push bodies which may give way |
//! | [`ordinary`] | what hosts do most of the time |
//! | [`verdict`] | what was wrong, what was told, and how far off the estimates are |
//! | [`report`] | tables for people and programs |

pub mod cases;
pub mod ordinary;
pub mod press;
pub mod random;
pub mod report;
pub mod verdict;

use std::path::Path;

use supple::guard::EVERY_LEARNED;

use super::method::Method;
use super::networks::{self, Family};
use super::run;
use super::scenes::SceneSpec;
use super::threads::in_parallel;
use super::timing::Timing;
use super::truth::{self, Truth};
use super::{DT, LabError};

use verdict::{Judged, Kind};

/// Steps over the critical step of a body at rest.
pub const TIMES_CRITICAL: [u32; 4] = [10, 20, 50, 100];

/// The same in ordinary scenes.
const TIMES_CRITICAL_ORDINARY: [u32; 2] = [10, 20];

/// The same of exact steps, which have no guard in `supple simulate` either.
const TIMES_CRITICAL_EXACT: [f64; 3] = [0.9, 1.0, 1.2];

/// Damping of the motions that the networks of the crate learned, 1/s.
const TRAINED_DAMPING: f32 = 20.0;

/// How many scenes of each kind are drawn.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// See [`random`].
    pub random: u32,
    /// See [`press`].
    pub presses: u32,
    /// See [`ordinary`].
    pub ordinary: u32,
}

/// What to judge.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Hand-made cases.
    pub cases: Vec<SceneSpec>,
    /// How many scenes are drawn.
    pub counts: Counts,
    /// Methods.
    pub methods: Vec<Method>,
    /// Steps of a run in one of its guard's second run, except for learned steps.
    pub every: u32,
}

impl Plan {
    /// A plan from names of cases and methods, and a mesh of the user's with its factor to metres; drawn scenes, and
    /// guards with `every`. All cases but [`cases::LONG`] if there are neither names nor a
    /// mesh, and all methods if there are none.
    pub fn new(
        cases: &[String],
        mesh: Option<(&Path, f64)>,
        methods: &[String],
        counts: Counts,
        every: u32,
    ) -> Result<Self, LabError> {
        let methods = match methods {
            [] => Vec::from([
                Method::Long,
                Method::Learned(Family::Compact),
                Method::Learned(Family::CompactInt8),
                Method::Learned(Family::OtherStep),
                Method::TledLargeStep,
                Method::Switching,
            ]),
            names => names.iter().map(|name| Method::named(name)).collect::<Result<_, _>>()?,
        };
        let mut cases = match cases {
            [] if mesh.is_none() => cases::names()
                .filter(|name| !cases::LONG.contains(name))
                .map(cases::named)
                .collect::<Result<Vec<_>, _>>()?,
            names => names.iter().map(|name| cases::named(name)).collect::<Result<_, _>>()?,
        };
        if let Some((path, scale)) = mesh {
            cases.push(cases::of_mesh(path, scale)?);
        }
        Ok(Self { cases, counts, methods, every })
    }

    /// How many scenes there are.
    pub(super) const fn scenes(&self) -> usize {
        let Counts { random, presses, ordinary } = self.counts;
        self.cases.len() + random as usize + presses as usize + ordinary as usize
    }

    /// The kind of a scene by its number, and its number among those of the kind.
    fn kind(&self, index: usize) -> (Kind, u32) {
        let Counts { random, presses, .. } = self.counts;
        match index.checked_sub(self.cases.len()).map(|number| number as u32) {
            None => (Kind::Hard, index as u32),
            Some(number) if number < random => (Kind::Hard, number),
            Some(number) if number - random < presses => (Kind::Press, number - random),
            Some(number) => (Kind::Ordinary, number - random - presses),
        }
    }

    /// A scene by its number, with its truth, which is kept in `out/truth`. None for a drawn scene that cannot be
    /// found.
    pub(super) fn scene(&self, index: usize, out: &Path) -> Result<Option<(SceneSpec, Truth)>, LabError> {
        let truths = out.join("truth");
        super::create_folder(&truths)?;
        if let Some(case) = self.cases.get(index) {
            return truth::obtain_one(case.clone(), &truths).map(Some);
        }
        let (kind, number) = self.kind(index);
        match kind {
            Kind::Hard => drawn(|attempt| random::scene(number, attempt), f64::INFINITY, &truths),
            Kind::Press => drawn(|attempt| press::scene(number, attempt), press::FARTHEST, &truths),
            Kind::Ordinary => drawn(|attempt| ordinary::scene(number, attempt), ordinary::FARTHEST, &truths),
        }
    }
}

/// Time in steps of at most 0.95 of the critical one that the learned steps of the crate are multiples of, and in
/// snapshots that steps a hundred times as long as the critical one divide: timing and number of intervals of about
/// `seconds`.
fn timing_of(critical: f32, seconds: f32) -> (Timing, usize) {
    // The shortest learned step, s, and a multiple of all of them.
    let (learned, common) = (10.0 * DT, 1000.0 * DT);
    let parts = (learned / (0.95 * critical)).ceil().max(1.0);
    let step = learned / parts;
    let length = common * (100.0 * critical / common).ceil();
    let timing = Timing { step, interval: (length / step).round() as u32, refinement: 1 };
    (timing, (seconds / length).ceil().max(2.0) as usize)
}

/// The multiple of the scene's step that divides its interval and is nearest to so many times the critical step.
fn multiple_near(timing: &Timing, critical: f32, times: u32) -> u32 {
    let wanted = times as f32 * critical / timing.step;
    let off = |multiple: &u32| (*multiple as f32 / wanted).ln().abs();
    let divisors = (1..=timing.interval).filter(|&multiple| timing.hits_snapshots(multiple));
    divisors.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(1)
}

/// Carries the plan out on two threads: truths in `out/truth/`, tables in `out`. `say` is given the progress in words.
pub fn evaluate(plan: &Plan, out: &Path, say: impl Fn(&str) + Sync) -> Result<Vec<Judged>, LabError> {
    let judge = |index: usize| {
        let Some((spec, truth)) = plan.scene(index, out)? else { return Ok(Vec::new()) };
        say(&format!("{}: moves by {:.1} mm", spec.name, 1e3 * truth.most()));
        runs(&spec, &truth, plan, plan.kind(index).0, &say)
    };
    let judged = in_parallel(plan.scenes(), judge, |_, _| ())?.concat();
    report::write(&judged, out)?;
    Ok(judged)
}

/// The first attempt whose truth moves by more than a millimetre and no farther than `farthest` (m), and neither
/// diverges nor leaves the range of its law. None if ten do.
fn drawn(
    draw: impl Fn(u32) -> Result<SceneSpec, LabError>,
    farthest: f64,
    folder: &Path,
) -> Result<Option<(SceneSpec, Truth)>, LabError> {
    for attempt in 0..10 {
        match truth::obtain_one(draw(attempt)?, folder) {
            Ok((spec, truth)) if truth.limited_steps == 0 && truth.most() > 1e-3 && truth.most() <= farthest => {
                return Ok(Some((spec, truth)));
            }
            Ok(_) | Err(LabError::Diverged { .. } | LabError::NoCriticalStep { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// All methods over a scene, judged.
fn runs(
    spec: &SceneSpec,
    truth: &Truth,
    plan: &Plan,
    kind: Kind,
    say: &impl Fn(&str),
) -> Result<Vec<Judged>, LabError> {
    let mut judged = Vec::new();
    let methods = plan.methods.iter().filter(|method| spec.instrument.is_none() || method.meets_instruments());
    for &method in methods {
        for (timing, multiple) in steps(spec, truth, method, kind) {
            let spec = SceneSpec { timing, ..spec.clone() };
            let every = match method {
                Method::Tled | Method::TledLargeStep => None,
                Method::Learned(_) | Method::LearnedWith(_) => Some(EVERY_LEARNED),
                _ => Some(plan.every),
            };
            let row = match run::run_guarded(&spec, truth, method, multiple, every) {
                // Refused before it has begun: not wrong.
                Err(LabError::Inertia(error)) => {
                    say(&format!("{}: {} refuses: {error}", spec.name, method.name()));
                    continue;
                }
                row => row?,
            };
            judged.push(Judged::new(kind, row, truth, spec.timing.interval_seconds()));
        }
    }
    Ok(judged)
}

/// The steps of a method on a scene: multiples of how its time is counted, with the same snapshots.
fn steps(spec: &SceneSpec, truth: &Truth, method: Method, kind: Kind) -> Vec<(Timing, u32)> {
    let timing = spec.timing;
    let times: &[u32] = if kind == Kind::Ordinary { &TIMES_CRITICAL_ORDINARY } else { &TIMES_CRITICAL };
    match method {
        Method::Learned(_) => networks::multiples()
            .filter(|_| spec.damping == TRAINED_DAMPING)
            .map(|multiple| multiple as f32 * DT / timing.step)
            .filter(|multiple| (multiple - multiple.round()).abs() < 1e-3)
            .map(|multiple| (timing, multiple.round() as u32))
            .collect(),
        Method::Tled => Vec::from([(timing, 1)]),
        Method::TledLargeStep => {
            TIMES_CRITICAL_EXACT.map(|times| (cut(&timing, times * truth.limit_at_rest), 1)).to_vec()
        }
        _ => {
            let multiple = |&times: &u32| (timing, multiple_near(&timing, truth.limit_at_rest as f32, times));
            times.iter().map(multiple).collect()
        }
    }
}

/// The same snapshots with steps as near to so many seconds as divide the time between two.
fn cut(timing: &Timing, seconds: f64) -> Timing {
    let interval = (timing.interval_seconds() / seconds).round().max(1.0);
    Timing { step: (timing.interval_seconds() / interval) as f32, interval: interval as u32, refinement: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_steps_keep_the_snapshots_and_are_near_the_wanted_ones() {
        for critical in [2e-6, 9e-5, 5e-3] {
            let (timing, _) = timing_of(critical as f32, 0.4);
            for times in TIMES_CRITICAL_EXACT {
                let cut = cut(&timing, times * critical);
                assert!((cut.interval_seconds() / timing.interval_seconds() - 1.0).abs() < 1e-6);
                let ratio = f64::from(cut.step) / critical / times;
                assert!((0.99..1.01).contains(&ratio), "{critical}: {ratio}");
            }
        }
    }

    #[test]
    fn steps_divide_the_snapshots_and_are_near_the_wanted_ones() {
        for critical in [2e-6_f32, 1.3e-5, 9e-5, 3e-4, 1.1e-3, 5e-3] {
            let (timing, intervals) = timing_of(critical, 0.4);
            assert!(timing.step < critical && timing.interval_seconds() * intervals as f64 > 0.399);
            for multiple in networks::multiples() {
                let learned = (multiple as f32 * DT / timing.step).round() as u32;
                assert!(timing.hits_snapshots(learned), "{critical}: {multiple}");
            }
            for times in TIMES_CRITICAL {
                let multiple = multiple_near(&timing, critical, times);
                let ratio = multiple as f32 * timing.step / critical / times as f32;
                assert!(timing.hits_snapshots(multiple) && (0.6..1.7).contains(&ratio), "{critical}: {ratio}");
            }
        }
    }
}
