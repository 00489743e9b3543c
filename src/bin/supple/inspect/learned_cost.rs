//! What a learned step of a scene costs.

use std::time::{Duration, Instant};

use supple::learned::vectors_for;
use supple::loads::Loads;
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::NodeVector;
use supple::step::CallingThread;

use crate::problem::Problem;
use crate::scene::learned::LearnedChoice;
use crate::scene::setup::Setup;
use crate::screen::{output, row};
use crate::weight_file::describe_step;

/// Steps that are timed.
const TIMED: u32 = 50;

/// Prints memory and time of a learned step.
pub(crate) fn describe(
    choice: &LearnedChoice,
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    loads: &Loads<'_>,
) -> Result<(), Problem> {
    let nodes = scene.node_count();
    let mut learned = choice.step(nodes, false)?;
    let mut state = setup.state(scene);
    let mut spent = Duration::ZERO;
    for _ in 0..TIMED {
        let start = Instant::now();
        let tried = learned.view().try_step(scene, loads, &mut state.view(), 0.0, &CallingThread);
        spent += start.elapsed();
        // Only the time counts here: every step does the same work, whatever becomes of the motion.
        if !matches!(tried, Ok(Ok(status)) if status.is_taken()) {
            state.reset();
            learned.view().reset();
        }
    }
    let seconds = spent.as_secs_f64() / f64::from(TIMED);
    let network = learned.model().network();
    output!("\nlearned step");
    row("network", format!("{}, {} multiply-adds per vertex", choice.path.display(), network.multiply_adds()));
    row("step", describe_step(network));
    row(
        "memory",
        format!(
            "{:.1} kB of weights, {:.1} kB of vertices, besides the above",
            1e-3 * choice.memory.bytes().len() as f64,
            1e-3 * (vectors_for(nodes, false) * size_of::<NodeVector>()) as f64
        ),
    );
    let real_time = f64::from(learned.model().seconds()) / seconds;
    row("time per step", format!("{:.1} us, {real_time:.3} times real time", 1e6 * seconds));
    Ok(())
}
