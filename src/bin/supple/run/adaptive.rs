//! Steps that choose their length, so that their error stays below a tolerance.

use supple::adaptive::{Adaptive, Request, Taken};
use supple::inertia::Method;
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::{NodeVector, VecState};
use supple::step::{Status, Step};

use super::exact::Motion;
use super::large::grid;
use super::outcome::{AdaptiveTrace, Outcome};
use crate::problem::Problem;
use crate::scene::setup::Setup;

/// Mean error of the nodes that is accepted unless the scene file says so, m, and as a share of the diagonal of the body's box in smaller
/// bodies.
const TOLERANCE: f32 = 0.0005;
const SHARE_OF_SIZE: f32 = 0.005;

/// Adaptive steps on a host with a heap.
pub(crate) struct AdaptiveRun {
    adaptive: Adaptive<'static, Vec<NodeVector>>,
}

impl AdaptiveRun {
    /// Steps of at most the length of `longest`.
    pub(crate) fn new(
        method: &Method<'static>,
        setup: &Setup,
        scene: SceneView<'_, VecMaterial>,
        state: &mut VecState,
        longest: Step,
    ) -> Result<Self, Problem> {
        grid(setup, scene, method)?;
        let points = &setup.body.local;
        let tolerance = setup
            .time
            .tolerance
            .unwrap_or_else(|| TOLERANCE.min(SHARE_OF_SIZE * setup.body.diagonal() as f32));
        let request = Request { tolerance, longest };
        let adaptive = Adaptive::prepare_in_vec(method.clone(), scene, points, state.view(), request)
            .map_err(|error| Problem(format!("{}: {error}", setup.body.name)))?;
        Ok(Self { adaptive })
    }

    /// Moves on by so many seconds, or until a step diverges.
    pub(crate) fn advance(
        &mut self,
        motion: &Motion<'_>,
        state: &mut VecState,
        outcome: &mut Outcome,
        seconds: f32,
    ) {
        let Motion { scene, mut loads, .. } = *motion;
        let (status, taken) = self.adaptive.advance(seconds, scene, &mut loads, state.view());
        // What is inexact is the guard's to tell.
        let own = if matches!(status, Status::Inexact { .. }) { Status::Ok } else { status };
        outcome.enter(own, &state.view());
        outcome.computed += u64::from(taken.exact + taken.large).saturating_sub(1);
        let model = self.adaptive.model();
        let trace = outcome
            .adaptive
            .get_or_insert_with(|| AdaptiveTrace { tolerance: model.tolerance(), taken: Taken::default() });
        trace.taken = trace.taken + taken;
        let (shortest, longest) = &mut outcome.steps;
        (*shortest, *longest) = (shortest.min(model.seconds()), longest.max(model.seconds()));
        outcome.guard.get_or_insert_default().enter(status, model.estimate(), state.time());
    }
}
