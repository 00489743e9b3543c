//! Long steps of one length from rest, and how long they and exact ones take.

use std::time::Instant;

use supple::inertia::{LargeStep, Method};
use supple::loads::Loads;
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::{NodeVector, VecState};
use supple::step::{CriticalStep, Status, Step};
use supple::tled;

use crate::problem::Problem;
use crate::scene::setup::Setup;

/// Steps of each kind that are timed, and the length of those beyond the critical step in multiples of it.
const TIMED: usize = 50;
const TIMED_MULTIPLE: f32 = 20.0;

/// Median time of a step, s.
pub(crate) struct Times {
    pub(crate) exact: f64,
    pub(crate) long: f64,
}

impl Times {
    /// Times exact and long steps from rest, in turn, so that what else the machine does meets both.
    pub(crate) fn measured(
        method: &Method,
        setup: &Setup,
        scene: SceneView<'_, VecMaterial>,
        loads: &Loads<'_>,
        bound: CriticalStep,
    ) -> Result<Self, Problem> {
        let mut walker = Walker::new(method, setup, scene, TIMED_MULTIPLE * bound.seconds)?;
        let step = Step::unchecked(0.5 * bound.seconds, setup.damping).map_err(Problem::of)?;
        let mut state = setup.state(scene);
        let (mut exact, mut long) = (vec![], vec![]);
        for _ in 0..TIMED {
            exact.push(timed(|| tled::step(&scene, loads, &mut state, &step)));
            long.push(timed(|| walker.step(scene, loads)));
        }
        let [exact, long] = [exact, long].map(|mut seconds| {
            seconds.sort_by(f64::total_cmp);
            seconds[TIMED / 2]
        });
        Ok(Self { exact, long })
    }
}

/// Seconds that a step takes. What becomes of the motion does not matter here.
fn timed(step: impl FnOnce() -> Status) -> f64 {
    let start = Instant::now();
    let _ = step();
    start.elapsed().as_secs_f64()
}

/// A scene on its way from rest, with one method and one length of step.
pub(crate) struct Walker {
    pub(crate) state: VecState,
    pub(crate) step: LargeStep<Vec<NodeVector>>,
}

impl Walker {
    /// At rest; steps take `seconds`.
    pub(crate) fn new(
        method: &Method,
        setup: &Setup,
        scene: SceneView<'_, VecMaterial>,
        seconds: f32,
    ) -> Result<Self, Problem> {
        let step = Step::unchecked(seconds, setup.damping).map_err(Problem::of)?;
        let mut state = setup.state(scene);
        let step = LargeStep::prepare_in_vec(*method, scene, &setup.body.local, state.view(), step)
            .map_err(|error| Problem(format!("{}: {error}", setup.body.name)))?;
        Ok(Self { state, step })
    }

    pub(crate) fn step(&mut self, scene: SceneView<'_, VecMaterial>, loads: &Loads<'_>) -> Status {
        self.step.step(scene, loads, self.state.view())
    }
}
