//! The summary of a simulation: one list of what there is to tell, each with a row of the table and its figures in
//! `summary.json`.

use serde_json::{Map, Value, json};
use supple::adaptive::Taken;
use supple::inertia::Grid;
use supple::tled::Settled;

use super::figures::Figures;
use crate::added_mass::describe_added;
use crate::run::followed::FollowedPoints;
use crate::run::outcome::{AdaptiveTrace, GuardTrace, LargeTrace, LearnedTrace, Outcome};
use crate::run::pulled::{PulledPoints, length};
use crate::run::reactions::Reactions;
use crate::scene::learned::LearnedChoice;
use crate::scene::setup::Setup;

#[derive(Default)]
pub(crate) struct Summary {
    rows: Vec<(&'static str, String)>,
    figures: Map<String, Value>,
}

impl Summary {
    /// Adds a row of the table, if there are words for it, and its figures, a JSON object.
    fn add(&mut self, name: &'static str, words: impl Into<Option<String>>, figures: Value) {
        self.rows.extend(words.into().map(|words| (name, words)));
        self.add_figures(figures);
    }

    /// Adds figures without a row, a JSON object.
    fn add_figures(&mut self, figures: Value) {
        if let Value::Object(figures) = figures {
            self.figures.extend(figures);
        }
    }

    /// Adds rows, and their figures as an object of its own.
    fn add_section(&mut self, name: &str, section: Option<Self>) {
        let (rows, figures) =
            section.map_or((vec![], Value::Null), |Self { rows, figures }| (rows, Value::Object(figures)));
        self.rows.extend(rows);
        self.figures.insert(name.into(), figures);
    }

    /// The table on the screen.
    pub(crate) fn table(&self) -> String {
        self.rows.iter().map(|(name, words)| format!("{name:<21} {words}\n")).collect()
    }

    /// The rows of the table.
    pub(crate) fn rows(&self) -> &[(&'static str, String)] {
        &self.rows
    }

    /// `summary.json`.
    pub(crate) fn json(&self) -> String {
        format!("{:#}\n", Value::Object(self.figures.clone()))
    }
}

/// All there is to tell.
pub(crate) fn of(setup: &Setup, outcome: &Outcome, figures: &Figures, warnings: &[String]) -> Summary {
    let mut summary = Summary::default();
    add_ending(&mut summary, outcome);
    summary.add_figures(json!({ "method": setup.method_name(), "warnings": warnings }));
    add_scene(&mut summary, setup, figures);
    let learned = setup.learned.as_ref().zip(outcome.learned.as_ref());
    summary.add_section("learned", learned.map(|(choice, trace)| learned_section(choice, trace)));
    let large = outcome.large.as_ref();
    summary.add_section("inertia", large.map(|trace| large_section(setup.method_name(), trace, outcome)));
    add_settled(&mut summary, outcome);
    add_steps(&mut summary, setup, outcome, figures);
    summary.add_section("adaptive", outcome.adaptive.as_ref().map(adaptive_section));
    add_estimate(&mut summary, outcome.guard.as_ref());
    add_motion(&mut summary, outcome, figures);
    add_reactions(&mut summary, &outcome.reactions);
    add_pulls(&mut summary, &outcome.pulls);
    add_points(&mut summary, &outcome.points);
    summary
}

fn add_ending(summary: &mut Summary, outcome: &Outcome) {
    summary.add(
        "status",
        outcome.status().to_owned(),
        json!({
            "status": outcome.status(),
            "divergence": outcome.divergence.map(|divergence| json!({
                "time_s": divergence.time, "node": divergence.node, "sentence": divergence.to_string(),
            })),
            "steps_limited": outcome.limits.steps,
        }),
    );
}

fn add_scene(summary: &mut Summary, setup: &Setup, figures: &Figures) {
    let elements = setup.body.mesh.tets.len();
    summary.add(
        "mesh",
        format!("{}: {} nodes, {elements} tetrahedra, {:.1} g", setup.body.name, figures.nodes, 1e3 * figures.mass),
        json!({
            "mesh": setup.body.name,
            "nodes": figures.nodes,
            "elements": elements,
            "elements_left_out": elements - figures.elements,
            "mass_kg": figures.mass,
        }),
    );
    let material = setup.tissues.to_string();
    summary.add("material", material.clone(), json!({ "material": material }));
    summary.add_figures(json!({ "damping_per_s": decimal(setup.damping) }));
}

fn add_settled(summary: &mut Summary, outcome: &Outcome) {
    let Some(settled) = outcome.settled else { return summary.add_figures(json!({ "settled": null })) };
    let Settled { at_rest, remaining, steps, .. } = settled;
    let word = if at_rest { "at rest" } else { "not at rest" };
    summary.add(
        "settled",
        format!("{word} after {steps} steps, {:.2e} m to go", remaining),
        json!({ "settled": { "at_rest": at_rest, "remaining_m": decimal(remaining), "steps": steps } }),
    );
}

fn add_steps(summary: &mut Summary, setup: &Setup, outcome: &Outcome, figures: &Figures) {
    let (shortest, longest) = outcome.steps;
    let range = if shortest == longest { String::new() } else { format!("{shortest:.3e} to ") };
    let (least, least_at) = outcome.least;
    summary.add(
        "step",
        format!(
            "{range}{longest:.3e} s; stable at rest {:.3e} s, least at a frame {:.3e} s",
            outcome.at_rest.seconds, least.seconds
        ),
        json!({
            "step_shortest_s": decimal(shortest),
            "step_longest_s": decimal(longest),
            "critical_step_at_rest_s": decimal(outcome.at_rest.seconds),
            "critical_step_least_s": decimal(least.seconds),
            "critical_step_least_at_s": least_at,
        }),
    );
    let undone = match (figures.steps_undone, outcome.divergence) {
        (undone @ 1.., None) => format!(", {undone} more undone"),
        _ => String::new(),
    };
    summary.add(
        "simulated",
        format!("{:.3} s in {} steps{undone}", figures.time, figures.steps),
        json!({
            "time_s": figures.time,
            "end_s": setup.time.end,
            "steps": figures.steps,
            "steps_undone": figures.steps_undone,
        }),
    );
    let (us, factor) = (figures.us_per_step, figures.real_time_factor);
    summary.add("time per step", format!("{us:.1} us"), json!({ "us_per_step": us }));
    let words = format!("{factor:.3} (1 and more is real time)");
    summary.add("real-time factor", words, json!({ "real_time_factor": factor }));
}

/// The error that the guard estimates; nothing with exact steps, which have none.
fn add_estimate(summary: &mut Summary, guard: Option<&GuardTrace>) {
    let latest = guard.and_then(|guard| guard.latest);
    summary.add(
        "error estimate",
        guard.zip(latest).map(|(guard, latest)| {
            format!(
                "{:.3} mm on average over the nodes, {:.3} mm at node {}; at most {:.3} mm on average",
                1e3 * latest.mean,
                1e3 * latest.largest,
                latest.node,
                1e3 * guard.most
            )
        }),
        json!({
            "error_estimate_mm": latest.map(|latest| 1e3 * f64::from(latest.mean)),
            "error_estimate_worst_node_mm": latest.map(|latest| 1e3 * f64::from(latest.largest)),
            "error_estimate_largest_mm": guard.map(|guard| 1e3 * f64::from(guard.most)),
            "steps_inexact": guard.map(|guard| guard.inexact),
        }),
    );
}

fn add_motion(summary: &mut Summary, outcome: &Outcome, figures: &Figures) {
    let (percent, least) = (100.0 * figures.volume_change, figures.least_volume_ratio);
    summary.add(
        "volume change",
        format!("{percent:+.3} % (smallest element {least:.3} of its volume)"),
        json!({ "volume_change_percent": percent, "least_volume_ratio": least }),
    );
    let (mm, node) = (1e3 * figures.max_displacement, figures.max_node);
    let largest = outcome.frames.iter().map(|frame| frame.largest).fold(figures.max_displacement, f64::max);
    summary.add(
        "maximum displacement",
        format!("{mm:.3} mm at node {node} at the end, {:.3} mm at a frame", 1e3 * largest),
        json!({ "max_displacement_mm": mm, "max_displacement_node": node, "max_displacement_on_the_way_mm": 1e3 * largest }),
    );
    let energy = &figures.energy;
    summary.add_figures(json!({ "energy_j": {
        "work": energy.work, "dissipated": energy.dissipated,
        "kinetic": energy.kinetic, "strain": figures.strain_energy,
    } }));
}

/// What the instruments felt.
fn add_reactions(summary: &mut Summary, reactions: &Reactions) {
    if reactions.is_empty() {
        return;
    }
    let largest = reactions.largest();
    let words = largest.iter().enumerate().map(|(instrument, (newton, time, contacts, _))| {
        format!("{instrument}: {newton:.3e} N on {contacts} nodes at {time:.3} s")
    });
    let figures = largest.iter().map(|(newton, time, contacts, depth)| {
        json!({ "largest_force_n": newton, "at_s": time, "contacts": contacts, "depth_m": decimal(*depth) })
    });
    summary.add(
        "instruments",
        words.collect::<Vec<_>>().join(", "),
        json!({ "instruments": figures.collect::<Vec<_>>() }),
    );
}

/// How far pulled points are from their targets.
fn add_pulls(summary: &mut Summary, pulls: &PulledPoints) {
    let gaps = pulls.at_end().iter().map(|pulled| length(pulled.gap));
    let Some((farthest, gap)) = gaps.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let mean = pulls.at_end().iter().map(|pulled| length(pulled.gap)).sum::<f64>() / pulls.at_end().len() as f64;
    let figures = pulls
        .at_end()
        .iter()
        .map(|pulled| json!({ "gap_mm": 1e3 * length(pulled.gap), "force_n": length(pulled.force) }));
    summary.add(
        "pulls",
        format!(
            "{} points are {:.3} mm from their targets on average at the end, number {farthest} {:.3} mm, with {:.3e} N",
            pulls.at_end().len(),
            1e3 * mean,
            1e3 * gap,
            length(pulls.at_end()[farthest].force)
        ),
        json!({ "pulls": figures.collect::<Vec<_>>() }),
    );
}

/// How far followed points have moved.
fn add_points(summary: &mut Summary, points: &FollowedPoints) {
    let at_end = points.moved().into_iter().filter_map(|(name, rows)| Some((name, rows.last()?.1)));
    let moved: Vec<_> = at_end.collect();
    let Some((name, most)) = moved.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let mean = moved.iter().map(|(_, way)| way).sum::<f64>() / moved.len() as f64;
    let figures: Map<_, _> = moved.iter().map(|(name, way)| ((*name).to_owned(), json!(1e3 * way))).collect();
    summary.add(
        "followed points",
        format!("{} moved by {:.3} mm on average, {name} by {:.3} mm", moved.len(), 1e3 * mean, 1e3 * most),
        json!({ "points_moved_mm": figures }),
    );
}

/// Steps beyond the critical one.
fn large_section(method: &str, trace: &LargeTrace, outcome: &Outcome) -> Summary {
    let mut section = Summary::default();
    let multiple = outcome.steps.1 / outcome.at_rest.seconds;
    section.add(
        "method",
        format!("{method}, steps of {multiple:.1} times the critical step at rest"),
        json!({ "step_s": decimal(outcome.steps.1), "step_over_critical_at_rest": decimal(multiple) }),
    );
    let Grid { cells, functions } = trace.grid;
    section.add("lattice", trace.grid.to_string(), json!({ "lattice_cells": cells, "lattice_functions": functions }));
    section.add(
        "added mass",
        describe_added(&trace.report),
        json!({
            "added_mass_mean": decimal(trace.report.added_mean),
            "added_mass_largest": decimal(trace.report.added_largest),
            "added_mass_node": trace.report.added_node,
        }),
    );
    let share = trace.steps_held_back as f64 / outcome.computed.max(1) as f64;
    let words = match trace.most_held_back {
        0 => "no node in any step".into(),
        most => format!("nodes in {:.1} % of the steps, at most {most} at once", 100.0 * share),
    };
    section.add(
        "held back",
        words,
        json!({ "steps_held_back_share": share, "most_nodes_held_back": trace.most_held_back }),
    );
    section.add(
        "coarse motion",
        format!("used to {:.1} % or more", 100.0 * trace.least_coarse_share),
        json!({ "coarse_share_least": decimal(trace.least_coarse_share) }),
    );
    section.add(
        "rough motion",
        format!("at most {:.1} % taken away in a step", 100.0 * trace.most_damping),
        json!({ "rough_motion_damped_largest": decimal(trace.most_damping) }),
    );
    section
}

/// Steps that choose their length.
fn adaptive_section(AdaptiveTrace { tolerance, taken }: &AdaptiveTrace) -> Summary {
    let mut section = Summary::default();
    let millimetres = 1e3 * f64::from(*tolerance);
    section.add(
        "tolerance",
        format!("{millimetres:.3} mm on average over the nodes"),
        json!({ "tolerance_mm": millimetres }),
    );
    let Taken { exact, large, changes, .. } = taken;
    section.add(
        "steps chosen",
        format!("{exact} exact, {large} beyond the critical step, {changes} changes of length"),
        json!({ "steps_exact": exact, "steps_beyond_critical": large, "changes": changes }),
    );
    section
}

/// Learned steps.
fn learned_section(choice: &LearnedChoice, trace: &LearnedTrace) -> Summary {
    let mut section = Summary::default();
    let path = choice.path.display().to_string();
    section.add(
        "network",
        format!("{path}, steps of {}", trace.described),
        json!({ "weights": path, "step_s": decimal(trace.seconds) }),
    );
    let us = trace.us_per_step();
    let real_time = 1e6 * f64::from(trace.seconds) / us;
    section.add(
        "learned steps",
        format!(
            "{} from {:.3} s on, {us:.1} us each, {real_time:.3} times real time without the guard",
            trace.steps,
            trace.from.unwrap_or_default()
        ),
        json!({ "from_s": trace.from, "steps": trace.steps, "us_per_step": us }),
    );
    let share = |mean: f64, most: f32| {
        format!("{:.2} % of the vertices on average, {:.1} % at most", 100.0 * mean, 100.0 * most)
    };
    let ((clipped, outside), most) = (trace.means(), &trace.most);
    section.add(
        "clipped",
        share(clipped, most.clipped),
        json!({ "clipped_share": clipped, "clipped_share_most": decimal(most.clipped) }),
    );
    section.add(
        "outside training",
        share(outside, most.outside),
        json!({ "outside_share": outside, "outside_share_most": decimal(most.outside) }),
    );
    let fell_back = trace.fell_back.as_ref();
    section.add(
        "fell back",
        fell_back.map(|(time, why)| {
            format!(
                "to exact steps {} times, for {:.3} s; first at {time:.3} s: the learned step {why}",
                trace.fallbacks,
                trace.exact_seconds()
            )
        }),
        json!({
            "fell_back_at_s": fell_back.map(|(time, _)| time),
            "fell_back_because": fell_back.map(|(_, why)| why),
            "fallbacks": trace.fallbacks,
            "fell_back_for_s": trace.exact_seconds(),
        }),
    );
    section
}

/// A float32 as a person wrote it: 3e-5, not 2.9999999242136255e-5.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}
