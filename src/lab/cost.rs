//! What a simulated second costs a host: a cuboid of the size of a liver lobe, held at one face, that gravity bends from
//! the first moment on and that swings, on meshes of several sizes, in frames of a sixtieth of a second, with all that a
//! host pays for: guard, looks at the critical step, changes of length. SI units inside, times in seconds.

use std::path::Path;
use std::time::Instant;

use rayon::ThreadPoolBuilder;
use supple::inertia::{self, Cells};
use supple::io::write_atomically;
use supple::loads::Loads;
use supple::material::{AnyLaw, Element, NeoHookean};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{self, Settings, Simulation};
use supple::state::NodeVector;
use supple::step::{Rayon, Status};

use super::LabError;
use super::measure::Errors;
use super::method::Method;
use super::scenes::{SceneSpec, bar};
use super::truth::Truth;

/// Sides of the cuboid, m, and its cells where it has 10,800 tetrahedra.
const SIZE: [f32; 3] = [0.12, 0.15, 0.08];
const CELLS: [f64; 3] = [12.0, 15.0, 10.0];
const TETRAHEDRA: f64 = 10_800.0;
/// Frames in the second that is simulated, and those at whose ends errors are known.
const FRAMES: usize = 60;
const SNAPSHOT: usize = 3;
/// 1/s; m/s^2.
const DAMPING: f32 = 15.0;
const GRAVITY: [f32; 3] = [0.0, 0.0, -9.81];
/// Steps of the truth and of exact runs over the critical step.
const OF_TRUTH: f32 = 0.45;
const OF_EXACT: f32 = 0.9;

/// What moves the cuboid, and how long its steps are, over the critical one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// Exact steps.
    Exact,
    /// Long steps with a guard.
    Long(u32),
    /// Steps that choose their length for an error of half a millimetre.
    Auto,
    /// Backward Euler, for comparison, without a guard; of linear tetrahedra.
    BackwardEuler(u32),
}

impl Way {
    /// All but backward Euler, which takes far longer.
    pub const USUAL: [Self; 6] =
        [Self::Exact, Self::Long(10), Self::Long(20), Self::Long(50), Self::Long(100), Self::Auto];

    /// That with this name: `exact`, `long-20`, `auto`, `backward-euler-20`.
    pub fn named(name: &str) -> Result<Self, LabError> {
        let multiple = |text: &str| text.parse().ok().filter(|multiple| (2..=1000).contains(multiple));
        let of = |start: &str| name.strip_prefix(start).and_then(multiple);
        match name {
            "exact" => Some(Self::Exact),
            "auto" => Some(Self::Auto),
            _ => of("long-").map(Self::Long).or_else(|| of("backward-euler-").map(Self::BackwardEuler)),
        }
        .ok_or_else(|| LabError::Unknown {
            kind: "method",
            name: name.to_string(),
            known: "exact, auto, long-N and backward-euler-N with N times the critical step, 2 to 1000".into(),
        })
    }

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Exact => "exact".into(),
            Self::Auto => "auto".into(),
            Self::Long(multiple) => format!("long-{multiple}"),
            Self::BackwardEuler(multiple) => format!("backward-euler-{multiple}"),
        }
    }
}

/// What a simulated second came to.
#[derive(Clone, Debug)]
pub struct Second {
    /// Tetrahedra of the mesh.
    pub tetrahedra: usize,
    /// What moved it.
    pub way: Way,
    /// Time to prepare it, s.
    pub prepare: f64,
    /// Time of each frame, s.
    pub frames: Vec<f64>,
    /// Exact and long steps.
    pub steps: [u32; 2],
    /// Mean over nodes and snapshots, and the largest mean over nodes, mm.
    pub error: [f64; 2],
    /// The largest mean displacement of the nodes, mm.
    pub motion: f64,
    /// The largest estimate of the mean error of the nodes, mm.
    pub estimate: Option<f64>,
    /// Frames whose status was not `ok`.
    pub doubted: usize,
}

impl Second {
    /// Computing time of the second, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.frames.iter().sum()
    }

    /// Time of a frame that this share of all does not exceed, s.
    #[must_use]
    pub fn frame(&self, share: f64) -> f64 {
        let mut sorted = self.frames.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get((share * (sorted.len().max(1) - 1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
    }
}

/// The cuboid with about so many tetrahedra.
fn cuboid(tetrahedra: u32, element: Element) -> SceneSpec {
    let times = (f64::from(tetrahedra) / TETRAHEDRA).cbrt();
    let shape = Bar { size: SIZE, cells: CELLS.map(|count| (times * count).round().max(1.0) as u32) };
    let points: Vec<_> = shape.points().collect();
    let held = (0..).zip(&points).filter(|(_, point)| point[1] == 0.0);
    SceneSpec {
        supports: held.map(|(node, _)| Support::fixed(node)).collect(),
        tets: shape.tets().collect(),
        points,
        law: AnyLaw::NeoHookean(NeoHookean { c: 840.0, d: 41_000.0 }),
        element,
        density: 1060.0,
        damping: DAMPING,
        gravity: GRAVITY,
        ..bar("cuboid", Vec::new())
    }
}

/// Runs each way on the cuboid with about so many tetrahedra, each size after the other, on so many threads; `tick` is
/// called with each second. Writes `cost.csv`.
pub fn evaluate(
    sizes: &[u32],
    element: Element,
    ways: &[Way],
    threads: usize,
    out: &Path,
    mut tick: impl FnMut(&Second) + Send,
) -> Result<Vec<Second>, LabError> {
    if element != Element::Linear && ways.iter().any(|way| matches!(way, Way::BackwardEuler(_))) {
        return Err(LabError::File("backward Euler moves linear tetrahedra only: ask for --element linear".into()));
    }
    super::create_folder(out)?;
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| LabError::File(format!("{threads} threads: {error}")))?;
    let all = pool.install(|| {
        let mut all = Vec::new();
        for &size in sizes {
            let spec = cuboid(size, element);
            let (_, truth) = run(&spec, Way::Exact, OF_TRUTH, threads, None)?;
            for &way in ways {
                let (second, _) = run(&spec, way, OF_EXACT, threads, Some(&truth))?;
                tick(&second);
                all.push(second);
            }
        }
        Ok::<_, LabError>(all)
    })?;
    write_atomically(&out.join("cost.csv"), |file| {
        writeln!(
            file,
            "tetrahedra,method,threads,prepare_s,seconds_per_simulated_second,frame_median_s,frame_95_s,frame_worst_s,\
             exact_steps,long_steps,mean_error_mm,largest_mean_error_mm,motion_mm,largest_estimate_mm,frames_not_ok"
        )?;
        all.iter().try_for_each(|second: &Second| {
            let ([mean, largest], [exact, long]) = (second.error, second.steps);
            writeln!(
                file,
                "{},{},{threads},{},{},{},{},{},{exact},{long},{mean},{largest},{},{},{}",
                second.tetrahedra,
                second.way.name(),
                second.prepare,
                second.seconds(),
                second.frame(0.5),
                second.frame(0.95),
                second.frame(1.0),
                second.motion,
                second.estimate.map_or_else(String::new, |estimate| estimate.to_string()),
                second.doubted,
            )
        })
    })?;
    Ok(all)
}

/// One second, and its displacements at the snapshots.
fn run(
    spec: &SceneSpec,
    way: Way,
    of_exact: f32,
    threads: usize,
    truth: Option<&Truth>,
) -> Result<(Second, Truth), LabError> {
    let (mut frames, mut snapshots) = (Vec::new(), Vec::new());
    let mut ended = |frame: usize, begin: Instant, displacements: &[NodeVector]| {
        frames.push(begin.elapsed().as_secs_f64());
        if frame.is_multiple_of(SNAPSHOT) {
            snapshots.push(displacements.iter().map(|vector| vector.to_array()).collect());
        }
    };
    let (mut steps, mut estimate, mut doubted) = ([0; 2], None, 0);
    let scene = spec.build()?;
    let mut body = Simulation::of_scene(scene, spec.points.clone(), spec.tets.clone());
    let critical = body.critical_step()?.seconds;
    let method = || inertia::Method::new(Cells::Suggested);
    let (method, step) = match way {
        Way::Exact | Way::BackwardEuler(_) => (simulation::Method::Exact, Some(of_exact * critical)),
        Way::Long(multiple) => (simulation::Method::Long(method()), Some(multiple as f32 * critical)),
        Way::Auto => (simulation::Method::Auto(method()), None),
    };
    body.set(Settings { method, step, damping: DAMPING, tolerance: Some(5e-4), ..Settings::default() });
    body.gravity = GRAVITY;
    let start = Instant::now();
    let prepare = match way {
        Way::BackwardEuler(multiple) => {
            let times = (1.0 / (FRAMES as f32 * multiple as f32 * critical)).ceil().max(1.0);
            let dt = 1.0 / (FRAMES as f32 * times);
            let (scene, state) = body.parts_mut();
            let mut steps_of = Method::BackwardEuler.prepare(spec, scene.view(), state, dt)?;
            let prepare = start.elapsed().as_secs_f64();
            let loads = Loads::new(scene, GRAVITY, &[], &[])?;
            for frame in 1..=FRAMES {
                let begin = Instant::now();
                for _ in 0..times as u32 {
                    let (status, _) = steps_of.advance(dt, scene.view(), &loads, state)?;
                    LabError::if_refused(spec.name, status)?;
                    steps[1] += 1;
                }
                ended(frame, begin, state.displacements());
            }
            prepare
        }
        _ => {
            body.prepare()?;
            let prepare = start.elapsed().as_secs_f64();
            for frame in 1..=FRAMES {
                let begin = Instant::now();
                let report = body.advance_in_parts(1.0 / FRAMES as f64, &Rayon { parts: threads })?;
                ended(frame, begin, body.displacements());
                steps[0] += report.exact;
                steps[1] += report.long;
                doubted += usize::from(report.status != Status::Ok);
                if let Some(mean) = report.estimate.map(|estimate| 1e3 * f64::from(estimate.mean)) {
                    estimate = Some(estimate.map_or(mean, |most: f64| most.max(mean)));
                }
            }
            prepare
        }
    };
    let moved = Truth { snapshots, ..Truth::default() };
    let (mut error, mut motion) = ([0.0; 2], 0.0);
    if let Some(truth) = truth {
        let mut errors = Errors::default();
        for snapshot in &moved.snapshots {
            errors.add_shape(truth, snapshot)?;
        }
        error = [errors.mean_over_time(), errors.largest_mean()];
        motion = Errors::of_hold(truth)?.largest_mean();
    }
    let second = Second { tetrahedra: spec.tets.len(), way, prepare, frames, steps, error, motion, estimate, doubted };
    Ok((second, moved))
}

/// The table's head.
pub const HEAD: &str = "tetrahedra method             s/s  x exact  prepare s  frame ms median, 95 %, worst  steps exact, long  error mm mean, largest       %  estimate mm  not ok";

/// A line of it; `exact` is what exact steps took for the same, s, if that is known.
#[must_use]
pub fn line(second: &Second, exact: Option<f64>) -> String {
    let ([mean, largest], [exact_steps, long]) = (second.error, second.steps);
    format!(
        "{:10} {:18} {:6.3} {:>8} {:9.3} {:16.2} {:6.2} {:6.2} {exact_steps:11} {long:6} {mean:15.3} {largest:8.3} {:9.2} {:>12} {:4} of {}",
        second.tetrahedra,
        second.way.name(),
        second.seconds(),
        exact.map_or_else(String::new, |exact| format!("{:.1}", exact / second.seconds())),
        second.prepare,
        1e3 * second.frame(0.5),
        1e3 * second.frame(0.95),
        1e3 * second.frame(1.0),
        100.0 * mean / second.motion,
        second.estimate.map_or_else(String::new, |estimate| format!("{estimate:.3}")),
        second.doubted,
        second.frames.len(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_costs_what_its_frames_do() {
        let folder = std::env::temp_dir().join(format!("supple-cost-{}", std::process::id()));
        let ways = [Way::Exact, Way::Long(10)];
        let all = evaluate(&[300], Element::Linear, &ways, 1, &folder, |second| println!("{}", line(second, None)));
        let all = all.unwrap();
        std::fs::remove_dir_all(folder).unwrap();
        for second in &all {
            assert!(second.frames.len() == FRAMES && second.motion > 10.0, "{second:?}");
            assert!(second.frame(0.5) <= second.frame(1.0) && second.frame(1.0) < second.seconds());
        }
        let [exact, long] = &all[..] else { panic!() };
        assert!(exact.steps[1] == 0 && long.steps[0] == 0 && 5 * long.steps[1] < exact.steps[0]);
        assert!(exact.error[0] < 0.01 * exact.motion && exact.error[0] < long.error[0]);
        assert!(long.error[0] < 0.1 * long.motion, "{long:?}");
    }

    #[test]
    fn names_lead_back_to_their_ways() {
        for way in Way::USUAL.into_iter().chain([Way::BackwardEuler(20)]) {
            assert_eq!(Way::named(&way.name()).unwrap(), way);
        }
        for name in ["long-1", "long-", "long", "euler"] {
            assert!(Way::named(name).is_err(), "{name}");
        }
    }
}
