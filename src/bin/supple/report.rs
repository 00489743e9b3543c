//! What a simulation leaves behind: frames for ParaView, `final.csv`, `summary.json`, and a table on the
//! screen. People read millimetres and percent; files hold SI units unless their names say otherwise.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use supple::io::{Frame, write_atomically, write_pvd, write_vtu};
use supple::material::Material;
use supple::tled;

use crate::body::{Body, volume};
use crate::large_steps::{Grid, Trace, describe_added};
use crate::learned::{Learned, LearnedTrace};
use crate::prepare::{HostScene, HostState, Setup};
use crate::run::Outcome;
use crate::scene_file::Problem;

/// Share of the vertices outside a network's training, on average, from which on it is remarked upon.
const OUTSIDE: f64 = 0.01;

/// The folder of a simulation's results.
pub(crate) struct Folder {
    path: PathBuf,
    frames: Vec<(f64, String)>,
}

/// Figures of the state a simulation ended in.
pub(crate) struct Figures {
    /// Total volume now over volume at rest, less one.
    pub(crate) volume_change: f64,
    pub(crate) least_volume_ratio: f64,
    pub(crate) max_displacement: f64,
    pub(crate) max_node: usize,
    pub(crate) strain_energy: f64,
}

impl Folder {
    /// Makes the folder; one that is there is left alone unless `force`.
    pub(crate) fn create(path: &Path, force: bool) -> Result<Self, Problem> {
        if path.exists() && !force {
            return Err(Problem(format!(
                "{}: is there already; --force overwrites the results in it",
                path.display()
            )));
        }
        std::fs::create_dir_all(path).map_err(|error| cannot_write(path, &error))?;
        let folder = Self { path: path.to_path_buf(), frames: vec![] };
        folder.remove_old_frames().map_err(|error| cannot_write(path, &error))?;
        Ok(folder)
    }

    /// Frames of an earlier run would mix with ours; nothing else is touched.
    fn remove_old_frames(&self) -> io::Result<()> {
        for entry in std::fs::read_dir(&self.path)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let number = name.strip_prefix("frame_").and_then(|rest| rest.strip_suffix(".vtu"));
            if number.is_some_and(|number| number.parse::<u32>().is_ok()) {
                std::fs::remove_file(path)?;
            }
        }
        Ok(())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Adds a frame: displacement (m), velocity (m/s), von Mises stress (Pa), volume ratio J.
    pub(crate) fn add_frame<M: Material>(
        &mut self,
        body: &Body,
        scene: &HostScene<M>,
        state: &HostState,
    ) -> Result<(), Problem> {
        let displacement: Vec<_> = state.displacements().iter().map(|vector| vector.to_array()).collect();
        let velocity: Vec<_> = (0..displacement.len()).map(|node| state.velocity(node)).collect();
        // Elements that were left out have four fixed nodes: no stress, no change of volume.
        let mut von_mises = vec![0.0; body.mesh.tets.len()];
        let mut volume_ratio = vec![1.0; body.mesh.tets.len()];
        for fields in tled::element_fields(scene, state.displacements()) {
            von_mises[fields.element] = fields.von_mises as f32;
            volume_ratio[fields.element] = fields.volume_ratio as f32;
        }
        let name = format!("frame_{:04}.vtu", self.frames.len());
        let frame = Frame {
            points: &body.mesh.points,
            tets: &body.mesh.tets,
            point_vectors: &[("displacement", &displacement), ("velocity", &velocity)],
            point_scalars: &[],
            cell_scalars: &[("von_mises", &von_mises), ("volume_ratio", &volume_ratio)],
        };
        let path = self.path(&name);
        write_vtu(&path, &frame).map_err(|error| cannot_write(&path, &error))?;
        self.frames.push((state.time(), name));
        // Always complete, so that a look while the simulation runs finds the frames there are.
        let path = self.path("frames.pvd");
        write_pvd(&path, &self.frames).map_err(|error| cannot_write(&path, &error))
    }

    /// Positions at rest and displacements of all nodes, m.
    pub(crate) fn write_final(&self, body: &Body, state: &HostState) -> Result<(), Problem> {
        let mut text = String::from("node,x,y,z,ux,uy,uz\n");
        for (node, (point, vector)) in body.mesh.points.iter().zip(state.displacements()).enumerate() {
            let ([x, y, z], [ux, uy, uz]) = (point, vector.to_array());
            // Writing to a string does not fail.
            let _ = writeln!(text, "{node},{x},{y},{z},{ux},{uy},{uz}");
        }
        self.write_text("final.csv", &text)
    }

    pub(crate) fn write_summary(&self, summary: &Value) -> Result<(), Problem> {
        self.write_text("summary.json", &format!("{summary:#}\n"))
    }

    pub(crate) fn write_text(&self, name: &str, text: &str) -> Result<(), Problem> {
        let path = self.path(name);
        write_atomically(&path, |out| out.write_all(text.as_bytes()))
            .map_err(|error| cannot_write(&path, &error))
    }
}

/// Leaves `final.csv` and `summary.json` in the folder, the table and the warnings on the screen.
pub(crate) fn conclude<M: Material>(
    folder: &Folder,
    setup: &Setup,
    scene: &HostScene<M>,
    state: &HostState,
    outcome: &Outcome,
) -> Result<Figures, Problem> {
    let figures = Figures::new(&setup.body, scene, state);
    folder.write_final(&setup.body, state)?;
    folder.write_summary(&summary(setup, scene, state, outcome, &figures))?;
    print!("{}", table(setup, scene, state, outcome, &figures));
    for warning in warnings(setup, outcome) {
        eprintln!("warning: {warning}");
    }
    Ok(figures)
}

fn cannot_write(path: &Path, error: &io::Error) -> Problem {
    Problem(format!("{}: cannot be written: {error}", path.display()))
}

impl Figures {
    pub(crate) fn new<M: Material>(body: &Body, scene: &HostScene<M>, state: &HostState) -> Self {
        let displacements = state.displacements();
        let moved = |node: u32| {
            let (point, vector) = (body.mesh.points[node as usize], displacements[node as usize].to_array());
            [0, 1, 2].map(|axis| point[axis] + f64::from(vector[axis]))
        };
        let tets = &body.mesh.tets;
        // Magnitudes at rest: the winding may have been normalised.
        let rest: f64 =
            tets.iter().map(|tet| volume(tet.map(|node| body.mesh.points[node as usize])).abs()).sum();
        let now: f64 = tets
            .iter()
            .map(|tet| {
                let sign = volume(tet.map(|node| body.mesh.points[node as usize])).signum();
                sign * volume(tet.map(moved))
            })
            .sum();
        let ratios = tled::element_fields(scene, displacements).map(|fields| fields.volume_ratio);
        let length =
            |node: usize| displacements[node].to_array().iter().map(|c| f64::from(c * c)).sum::<f64>().sqrt();
        let furthest = (0..displacements.len()).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
        Self {
            volume_change: now / rest - 1.0,
            least_volume_ratio: ratios.fold(f64::INFINITY, f64::min),
            max_displacement: length(furthest),
            max_node: furthest,
            strain_energy: tled::strain_energy(scene, state),
        }
    }
}

/// Microseconds a step that was computed, and simulated seconds per second spent.
pub(crate) fn speed(state: &HostState, outcome: &Outcome) -> (f64, f64) {
    let spent = outcome.spent.as_secs_f64().max(1e-9);
    (spent * 1e6 / outcome.computed.max(1) as f64, state.time() / spent)
}

/// Steps that were computed and taken back: automatic ones that turned out too long, or the one that diverged.
fn undone(state: &HostState, outcome: &Outcome) -> u64 {
    outcome.computed.saturating_sub(state.steps())
}

/// The step over the bound of the critical step at rest.
fn multiple(outcome: &Outcome) -> f32 {
    outcome.steps.1 / outcome.at_rest.seconds
}

/// Share of the steps in which nodes were held back.
fn held_back_share(trace: &Trace, outcome: &Outcome) -> f64 {
    trace.steps_held_back as f64 / outcome.computed.max(1) as f64
}

/// The inertia in `summary.json`.
fn inertia(trace: &Trace, outcome: &Outcome) -> Value {
    let lattice = (trace.grid != Grid::NONE).then_some(trace.grid);
    json!({
        "step_s": decimal(outcome.steps.1),
        "step_over_critical_at_rest": decimal(multiple(outcome)),
        "lattice_cells": lattice.map(|grid| grid.cells),
        "lattice_functions": lattice.map(|grid| grid.functions),
        "added_mass_mean": decimal(trace.report.added_mean),
        "added_mass_largest": decimal(trace.report.added_largest),
        "added_mass_node": trace.report.added_node,
        "error_estimate_mm": 1e3 * f64::from(trace.report.error),
        "error_estimate_largest_mm": 1e3 * f64::from(trace.most_error),
        "steps_held_back_share": held_back_share(trace, outcome),
        "most_nodes_held_back": trace.most_held_back,
        "coarse_share_least": lattice.map(|_| decimal(trace.least_coarse_share)),
        "rough_motion_damped_largest": trace.grid.damped.then_some(decimal(trace.most_damping)),
    })
}

/// The inertia on the screen.
fn inertia_rows(method: &str, trace: &Trace, outcome: &Outcome) -> Vec<(&'static str, String)> {
    let lattice = trace.grid != Grid::NONE;
    let mut rows = vec![
        ("method", format!("{method}, steps of {:.1} times the critical step at rest", multiple(outcome))),
        ("added mass", describe_added(&trace.report)),
        (
            "error estimate",
            format!(
                "{:.3} mm at the end, {:.3} mm at most, on average over the nodes",
                1e3 * trace.report.error,
                1e3 * trace.most_error
            ),
        ),
        (
            "held back",
            match trace.most_held_back {
                0 => "no node in any step".into(),
                most => format!(
                    "nodes in {:.1} % of the steps, at most {most} at once",
                    100.0 * held_back_share(trace, outcome)
                ),
            },
        ),
    ];
    if lattice {
        rows.insert(1, ("lattice", trace.grid.to_string()));
        rows.push(("coarse motion", format!("used to {:.1} % or more", 100.0 * trace.least_coarse_share)));
    }
    if trace.grid.damped {
        rows.push((
            "rough motion",
            format!("at most {:.1} % taken away in a step", 100.0 * trace.most_damping),
        ));
    }
    rows
}

/// The network in `summary.json`.
fn learned(setup: &Learned, trace: &LearnedTrace) -> Value {
    let (clipped, outside) = trace.means();
    json!({
        "weights": setup.path.display().to_string(),
        "step_s": decimal(trace.seconds),
        "from_s": trace.from,
        "steps": trace.steps,
        "us_per_step": trace.us_per_step(),
        "clipped_share": clipped,
        "clipped_share_most": decimal(trace.most.clipped),
        "outside_share": outside,
        "outside_share_most": decimal(trace.most.outside),
        "fell_back_at_s": trace.fell_back.as_ref().map(|(time, _)| time),
        "fell_back_because": trace.fell_back.as_ref().map(|(_, why)| why),
    })
}

/// The network on the screen.
fn learned_rows(setup: &Learned, trace: &LearnedTrace) -> Vec<(&'static str, String)> {
    let (clipped, outside) = trace.means();
    let share = |mean: f64, most: f32| {
        format!("{:.2} % of the vertices on average, {:.1} % at most", 100.0 * mean, 100.0 * most)
    };
    let us = trace.us_per_step();
    let real_time = 1e6 * f64::from(trace.seconds) / us;
    let mut rows = vec![
        ("network", format!("{}, steps of {}", setup.path.display(), trace.described)),
        (
            "learned steps",
            format!(
                "{} from {:.3} s on, {us:.1} us each, {real_time:.3} times real time",
                trace.steps,
                trace.from.unwrap_or_default()
            ),
        ),
        ("clipped", share(clipped, trace.most.clipped)),
        ("outside training", share(outside, trace.most.outside)),
    ];
    if let Some((time, why)) = &trace.fell_back {
        rows.push(("fell back", format!("to the exact step at {time:.3} s; the learned one {why}")));
    }
    rows
}

/// What is not as it should be, in sentences.
fn warnings(setup: &Setup, outcome: &Outcome) -> Vec<String> {
    let mut warnings = setup.warnings.clone();
    if let Some(time) = outcome.above_from {
        warnings.push(format!(
            "from {time:.3} s on the step was above the stable {:.3e} s, as the tissue had stiffened; shorten it or write step = \"auto\"",
            outcome.least.0.seconds
        ));
    }
    if let Some(trace) = &outcome.learned {
        let (_, outside) = trace.means();
        if outside > OUTSIDE {
            warnings.push(format!(
                "{:.1} % of the vertices had inputs outside the network's training, {:.1} % at most: its error there is \
                 not known",
                100.0 * outside,
                100.0 * trace.most.outside
            ));
        }
        if let Some((time, why)) = &trace.fell_back {
            warnings
                .push(format!("from {time:.3} s on the exact step moved the scene: the learned one {why}"));
        }
    }
    let limits = outcome.limits;
    if limits.steps > 0 {
        let mut causes = vec![];
        if limits.least_volume_ratio < supple::material::J_FLOOR {
            causes.push(format!("an element was squeezed to {:.3} of its volume", limits.least_volume_ratio));
        }
        if limits.saturation > 1.0 {
            causes.push(format!("an exponent reached {:.2} times its cap", limits.saturation));
        }
        if limits.energy_excess > 0.0 {
            causes.push(format!(
                "kinetic energy exceeded the account by {:.0} %",
                100.0 * limits.energy_excess
            ));
        }
        if limits.held_back > 0 {
            causes.push(format!(
                "in {} much of the motion was held back, which a shorter step does less",
                limits.held_back
            ));
        }
        warnings.push(format!(
            "{} steps, the first at {:.3} s, were taken but are not exact: {}",
            limits.steps,
            limits.first_time,
            causes.join(", ")
        ));
    }
    warnings
}

/// A float32 as a person wrote it: 3e-5, not 2.9999999242136255e-5.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// `summary.json`.
fn summary<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    state: &HostState,
    outcome: &Outcome,
    figures: &Figures,
) -> Value {
    let (us_per_step, real_time_factor) = speed(state, outcome);
    let fell_back = outcome.learned.as_ref().is_some_and(|trace| trace.fell_back.is_some());
    let (status, sentence) = match (&outcome.divergence, outcome.limits.steps) {
        (Some(divergence), _) => ("diverged", Some(divergence.to_string())),
        (None, _) if fell_back => ("fell back", None),
        (None, 0) => ("ok", None),
        (None, _) => ("limited", None),
    };
    let network = setup.learned.as_ref().zip(outcome.learned.as_ref());
    let ledger = state.ledger();
    json!({
        "status": status,
        "divergence": outcome.divergence.map(|divergence| json!({
            "time_s": divergence.time, "node": divergence.node, "sentence": sentence,
        })),
        "method": setup.method(),
        "mesh": setup.body.name,
        "material": setup.describe_material(),
        "nodes": scene.node_count(),
        "elements": setup.body.mesh.tets.len(),
        "elements_left_out": setup.body.mesh.tets.len() - scene.element_count(),
        "mass_kg": scene.mass(),
        "damping_per_s": decimal(setup.damping),
        "steps": state.steps(),
        "steps_undone": undone(state, outcome),
        "step_shortest_s": decimal(outcome.steps.0),
        "step_longest_s": decimal(outcome.steps.1),
        "critical_step_at_rest_s": decimal(outcome.at_rest.seconds),
        "critical_step_least_s": decimal(outcome.least.0.seconds),
        "critical_step_least_at_s": outcome.least.1,
        "end_s": setup.time.end,
        "time_s": state.time(),
        "us_per_step": us_per_step,
        "real_time_factor": real_time_factor,
        "volume_change_percent": 100.0 * figures.volume_change,
        "least_volume_ratio": figures.least_volume_ratio,
        "max_displacement_mm": 1e3 * figures.max_displacement,
        "max_displacement_node": figures.max_node,
        "energy_j": {
            "work": ledger.work, "dissipated": ledger.dissipated,
            "kinetic": ledger.kinetic, "strain": figures.strain_energy,
        },
        "steps_limited": outcome.limits.steps,
        "inertia": outcome.trace.as_ref().map(|trace| inertia(trace, outcome)),
        "surrogate": network.map(|(setup, trace)| learned(setup, trace)),
        "warnings": warnings(setup, outcome),
    })
}

/// The table on the screen.
fn table<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    state: &HostState,
    outcome: &Outcome,
    figures: &Figures,
) -> String {
    let (us, factor) = speed(state, outcome);
    let (shortest, longest) = outcome.steps;
    let steps = if shortest == longest {
        format!("{longest:.3e} s")
    } else {
        format!("{shortest:.3e} to {longest:.3e} s")
    };
    let undone = match (undone(state, outcome), outcome.divergence) {
        (1.., None) => format!(", {} more undone", undone(state, outcome)),
        _ => String::new(),
    };
    let mut rows = vec![
        (
            "mesh",
            format!(
                "{}: {} nodes, {} tetrahedra, {:.1} g",
                setup.body.name,
                scene.node_count(),
                setup.body.mesh.tets.len(),
                1e3 * scene.mass()
            ),
        ),
        ("material", setup.describe_material()),
        (
            "step",
            format!(
                "{steps}; stable at rest {:.3e} s, least on the way {:.3e} s",
                outcome.at_rest.seconds, outcome.least.0.seconds
            ),
        ),
        ("simulated", format!("{:.3} s in {} steps{undone}", state.time(), state.steps())),
        ("time per step", format!("{us:.1} us")),
        ("real-time factor", format!("{factor:.3} (1 and more is real time)")),
        (
            "volume change",
            format!(
                "{:+.3} % (smallest element {:.3} of its volume)",
                100.0 * figures.volume_change,
                figures.least_volume_ratio
            ),
        ),
        (
            "maximum displacement",
            format!("{:.3} mm at node {}", 1e3 * figures.max_displacement, figures.max_node),
        ),
    ];
    if let Some(trace) = &outcome.trace {
        rows.splice(2..2, inertia_rows(setup.time.method.name(), trace, outcome));
    }
    if let (Some(setup), Some(trace)) = (&setup.learned, &outcome.learned) {
        rows.splice(2..2, learned_rows(setup, trace));
    }
    rows.iter().fold(String::new(), |text, (name, value)| text + &format!("{name:<21} {value}\n"))
}
