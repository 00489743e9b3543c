//! What a scene costs: critical step, memory, time of a step, and the same for steps beyond the limit.

use std::time::Instant;

use supple::loads::Loads;
use supple::material::Material;
use supple::tled::{self, CriticalStep, Step};

use crate::doubling;
use crate::inspect::row;
use crate::large_steps::{Grid, HostInertia, describe_added};
use crate::learned;
use crate::prepare::{HostScene, HostState, Job, Setup};
use crate::run;
use crate::scene_file::Problem;
use crate::timing::Method;

/// Steps of each method that are timed beyond the limit, and at which multiple of the critical step.
const TIMED: usize = 50;
const TIMED_MULTIPLE: f32 = 20.0;

/// Critical step, memory and cost of a scene.
pub(crate) struct Cost<'a> {
    pub(crate) setup: &'a Setup,
    /// Error that a recommended step may have, mm.
    pub(crate) accuracy: Option<f64>,
}

impl Job for Cost<'_> {
    type Output = Result<(), Problem>;

    fn run<M: Material>(self, material: M) -> Self::Output {
        let setup = self.setup;
        let (scene, mut state) = setup.build(material)?;
        row("material", setup.describe_material());
        row("mass", format!("{:.3} g", 1e3 * scene.mass()));
        row("elements left out", setup.body.mesh.tets.len() - scene.element_count());
        let bound = run::critical(&scene, &mut state)?;
        row(
            "critical step",
            format!("{:.4e} s at rest, which node {} sets (a bound, safe)", bound.seconds, bound.node),
        );
        match tled::exact_critical_step(&scene, state.displacements()) {
            Some(exact) => row(
                "exact limit",
                format!("{exact:.4e} s at rest; the bound is {:.2} of it", f64::from(bound.seconds) / exact),
            ),
            None => row("exact limit", "not found: the iteration did not settle"),
        }
        let step = run::first_step(setup, bound, false);
        let loads = Loads::new(&scene, setup.gravity, &setup.forces, &setup.motions)
            .map_err(|error| Problem(error.to_string()))?;
        let bytes = scene.node_count()
            * (size_of::<supple::scene::NodeInertia>() + 3 * size_of::<supple::state::NodeVector>())
            + supple::scene::blocks_for(scene.element_count()) * size_of::<supple::scene::ElementBlock>();
        row("memory", format!("{:.1} kB", bytes as f64 * 1e-3));
        let operations = tled::operations(&scene);
        row("operations per step", format!("{operations} floating-point operations"));
        let measured =
            Step::insist(0.5 * bound.seconds, setup.damping).map_err(|error| Problem(error.to_string()))?;
        const STEPS: u32 = 300;
        let start = Instant::now();
        for _ in 0..STEPS {
            // Only the time counts here; what becomes of the motion is for `simulate`.
            let _ = tled::step(&scene, &loads, &mut state, &measured);
        }
        let seconds = start.elapsed().as_secs_f64() / f64::from(STEPS);
        row(
            "time per step",
            format!(
                "{:.1} us here and now, {:.1} GFLOP/s",
                1e6 * seconds,
                operations as f64 / seconds * 1e-9
            ),
        );
        if setup.time.method == Method::Tled {
            let wanted = step.as_ref().map_or(bound.seconds, |step| step.seconds());
            row("real-time factor", real_time(wanted, seconds));
        }
        let times = beyond(setup, &scene, &mut state, &loads, bound)?;
        doubling::foretell(setup, &scene, &loads, bound)?;
        if let Some(learned) = &setup.learned {
            learned::cost(learned, setup, &scene, &loads)?;
        }
        let step = step?;
        if setup.time.method != Method::Tled {
            row("real-time factor", real_time(step.seconds(), times.of(setup.time.method)));
        }
        match self.accuracy {
            Some(accuracy) => doubling::recommend(setup, &scene, &loads, bound, accuracy, &times),
            None => Ok(()),
        }
    }
}

fn real_time(step: f32, spent: f64) -> String {
    format!("{:.3} at {step:.3e} s a step", f64::from(step) / spent)
}

/// Median time of a step, s.
pub(crate) struct Times {
    plain: f64,
    mass_scaled: f64,
    multilevel: f64,
    damped: f64,
}

impl Times {
    pub(crate) const fn of(&self, method: Method) -> f64 {
        match method {
            Method::Tled => self.plain,
            Method::MassScaled => self.mass_scaled,
            Method::Multilevel => self.multilevel,
            Method::Damped => self.damped,
        }
    }
}

/// Prints what steps beyond the limit need and do at rest.
fn beyond<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    state: &mut HostState,
    loads: &Loads<'_>,
    bound: CriticalStep,
) -> Result<Times, Problem> {
    println!("\nsteps beyond the limit");
    let suggested = Grid::suggested(setup, scene);
    let grid = if setup.time.method.has_lattice() { Grid::wanted(setup, scene)? } else { suggested };
    let words =
        |grid: Grid| if grid.functions == 0 { "none, too few elements".into() } else { grid.to_string() };
    row("lattice suggested", words(suggested));
    if grid != suggested {
        row("lattice of the scene", grid);
    }
    let bytes = |grid: Grid| 1e-3 * grid.bytes(scene.node_count()) as f64;
    row(
        "memory of inertia",
        format!(
            "{:.1} kB damped, {:.1} kB multilevel, {:.1} kB mass-scaled, beside the above",
            bytes(Grid { damped: true, ..grid }),
            bytes(Grid { damped: false, ..grid }),
            bytes(Grid::NONE)
        ),
    );
    let times = time(setup, scene, state, loads, bound, grid)?;
    for method in [Method::MassScaled, Method::Multilevel, Method::Damped] {
        let seconds = times.of(method);
        let ratio = seconds / times.plain;
        row(
            &format!("{} step", method.name()),
            format!("{:.1} us, {ratio:.2} times an exact one's {:.1} us", 1e6 * seconds, 1e6 * times.plain),
        );
    }
    let (of, grid) = match setup.time.method {
        Method::MassScaled => (Method::MassScaled, Grid::NONE),
        Method::Damped => (Method::Damped, grid),
        Method::Tled | Method::Multilevel => (Method::Multilevel, grid),
    };
    for multiple in [10.0, 20.0, 50.0] {
        let inertia = at_rest(setup, scene, state, multiple * bound.seconds, grid)?;
        row(
            &format!("added mass at {multiple}x"),
            format!("{}, {}", describe_added(inertia.report()), of.name()),
        );
    }
    Ok(times)
}

/// The inertia of a scene at rest.
fn at_rest<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    state: &mut HostState,
    seconds: f32,
    grid: Grid,
) -> Result<HostInertia, Problem> {
    let step = Step::insist(seconds, setup.damping).map_err(|error| Problem(error.to_string()))?;
    state.reset();
    grid.prepare(setup, scene, state, step).map_err(|error| Problem(format!("{}: {error}", setup.body.name)))
}

/// Times steps of each method from rest, in turn, so that what else the machine does meets all of them.
fn time<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    state: &mut HostState,
    loads: &Loads<'_>,
    bound: CriticalStep,
    grid: Grid,
) -> Result<Times, Problem> {
    let long = TIMED_MULTIPLE * bound.seconds;
    let mut prepared = |grid| at_rest(setup, scene, state, long, grid);
    let mut inertias = [
        prepared(Grid::NONE)?,
        prepared(Grid { damped: false, ..grid })?,
        prepared(Grid { damped: true, ..grid })?,
    ];
    let plain =
        Step::insist(0.5 * bound.seconds, setup.damping).map_err(|error| Problem(error.to_string()))?;
    let mut states = [(); 4].map(|()| state.clone());
    let mut spent = [(); 4].map(|()| vec![]);
    // Only the time counts here, as above.
    for _ in 0..TIMED {
        for (method, (state, spent)) in states.iter_mut().zip(&mut spent).enumerate() {
            let start = Instant::now();
            let _ = match method.checked_sub(1) {
                None => tled::step(scene, loads, state, &plain),
                Some(scaled) => inertias[scaled].step(scene, loads, state),
            };
            spent.push(start.elapsed().as_secs_f64());
        }
    }
    let [plain, mass_scaled, multilevel, damped] = spent.map(|mut seconds| {
        seconds.sort_by(f64::total_cmp);
        seconds[TIMED / 2]
    });
    Ok(Times { plain, mass_scaled, multilevel, damped })
}
