//! Mass-scaled, multilevel and damped steps of a scene.

use supple::inertia::{Cells, Grid, LargeStep, Method};
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::{NodeVector, VecState};
use supple::step::Step;

use crate::problem::Problem;
use crate::scene::setup::Setup;

/// A prepared step on a host with a heap.
pub(crate) type PreparedStep = LargeStep<'static, Vec<NodeVector>>;

/// The lattice of a scene's method; steps may be prepared on a coarser one than is suggested ([`LargeStep::prepare_in_vec`]). A mesh too
/// small for the lattice that its method wants is a problem.
pub(crate) fn grid(
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    method: &Method<'_>,
) -> Result<Grid, Problem> {
    let grid = method.grid(scene, &setup.body.local).map_err(|error| {
        let place = setup.time.lattice_at.as_ref().unwrap_or(&setup.body.name);
        Problem(format!("{place}: {error}"))
    })?;
    let suggested =
        matches!(method, Method::Multilevel(Cells::Suggested) | Method::Damped(_, Cells::Suggested));
    if suggested && grid.functions == 0 {
        return Err(Problem(format!(
            "{}: with {} elements the mesh is too small for a lattice to pay; give lattice = [1, 1, 1] under \
             [time], or method = \"mass-scaled\"",
            setup.body.name,
            scene.element_count()
        )));
    }
    Ok(grid)
}

/// A step of `seconds` by a method, from the state as it is.
pub(crate) fn prepare(
    method: &Method<'static>,
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    state: &mut VecState,
    step: Step,
) -> Result<PreparedStep, Problem> {
    LargeStep::prepare_in_vec(method.clone(), scene, &setup.body.local, state.view(), step)
        .map_err(|error| Problem(format!("{}: {error}", setup.body.name)))
}
