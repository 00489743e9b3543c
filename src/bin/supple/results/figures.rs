//! Figures of the state that a simulation ended in, SI units.

use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::VecState;
use supple::step::EnergyBalance;
use supple::tled;

use crate::run::outcome::Outcome;
use crate::scene::body::volume;
use crate::scene::setup::Setup;

pub(crate) struct Figures {
    pub(crate) nodes: usize,
    /// Those that take part.
    pub(crate) elements: usize,
    pub(crate) mass: f64,
    pub(crate) time: f64,
    /// Taken, and computed but taken back: automatic ones that turned out too long, or the one that diverged.
    pub(crate) steps: u64,
    pub(crate) steps_undone: u64,
    /// Of a step that was computed.
    pub(crate) us_per_step: f64,
    /// Simulated seconds per second spent.
    pub(crate) real_time_factor: f64,
    /// Total volume now over volume at rest, less one.
    pub(crate) volume_change: f64,
    pub(crate) least_volume_ratio: f64,
    pub(crate) max_displacement: f64,
    pub(crate) max_node: usize,
    pub(crate) strain_energy: f64,
    pub(crate) energy: EnergyBalance,
}

impl Figures {
    pub(crate) fn new(setup: &Setup, scene: SceneView<'_, VecMaterial>, state: &VecState, outcome: &Outcome) -> Self {
        let displacements = state.displacements();
        let ratios = scene.element_fields(displacements).map(|fields| fields.volume_ratio);
        let length = |node: usize| displacements[node].to_array().iter().map(|c| f64::from(c * c)).sum::<f64>().sqrt();
        let furthest = (0..displacements.len()).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
        // Without those to rest, which are no time.
        let steps = state.steps().saturating_sub(outcome.settled.map_or(0, |settled| settled.steps.into()));
        let spent = outcome.spent.as_secs_f64().max(1e-9);
        Self {
            nodes: scene.node_count(),
            elements: scene.element_count(),
            mass: scene.mass(),
            time: state.time(),
            steps,
            steps_undone: outcome.computed.saturating_sub(steps),
            us_per_step: spent * 1e6 / outcome.computed.max(1) as f64,
            real_time_factor: state.time() / spent,
            volume_change: volume_ratio(setup, state) - 1.0,
            least_volume_ratio: ratios.fold(f64::INFINITY, f64::min),
            max_displacement: length(furthest),
            max_node: furthest,
            strain_energy: tled::strain_energy(&scene, &mut state.clone()).expect("room"),
            energy: *state.energy_balance(),
        }
    }
}

/// Volume of the body over its volume at rest.
fn volume_ratio(setup: &Setup, state: &VecState) -> f64 {
    let (mesh, displacements) = (&setup.body.mesh, state.displacements());
    let at_rest = |tet: &[u32; 4]| volume(tet.map(|node| mesh.points[node as usize]));
    let moved = |node: u32| {
        let (point, vector) = (mesh.points[node as usize], displacements[node as usize].to_array());
        [0, 1, 2].map(|axis| point[axis] + f64::from(vector[axis]))
    };
    // Magnitudes at rest: the winding may have been normalised.
    let rest: f64 = mesh.tets.iter().map(|tet| at_rest(tet).abs()).sum();
    let now: f64 = mesh.tets.iter().map(|tet| at_rest(tet).signum() * volume(tet.map(moved))).sum();
    now / rest
}
