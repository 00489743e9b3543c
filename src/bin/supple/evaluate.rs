//! `supple evaluate`: methods over scenes, judged against the exact step.

use std::path::{Path, PathBuf};

use clap::Args;
use supple::lab::evaluate::{self, Plan};
use supple::lab::method::Method;
use supple::lab::{equal_error, hard, physics, table, tolerance};
use supple::material::Element;

use crate::element_name::element_named;
use crate::problem::{End, Problem};
use crate::report;
use crate::screen::{message, output, print};

#[derive(Args)]
pub(crate) struct Asked {
    /// Folder for results.csv, report.html and the truths; results of an earlier evaluation are overwritten, but parts of the report that
    /// other commands of this kind have added stay
    #[arg(long)]
    out: PathBuf,
    /// Scene, or `ramped` or `moving` for a group of them, all 34 unless given; may be repeated
    #[arg(long = "scene", value_name = "NAME")]
    scenes: Vec<String>,
    /// Method, unless given all but paper-f32, backward-euler and implicit-midpoint, which take far longer, and those that are for hard
    /// cases; may be repeated
    #[arg(long = "method", value_name = "NAME")]
    methods: Vec<String>,
    /// Step as a multiple of the scene's, 1 10 20 50 100 unless given; may be repeated
    #[arg(long = "multiple", value_name = "N")]
    multiples: Vec<u32>,
    /// Tetrahedra of the scenes, linear or nodal-pressure; linear unless given, as in the paper
    #[arg(long, value_name = "NAME", value_parser = element_named)]
    element: Option<Element>,
    /// Weight file of a network to judge as well, a learned step's at its own step, a damper's at all; may be repeated
    #[arg(long, value_name = "FILE")]
    weights: Vec<PathBuf>,
    /// Scene whose error the report draws over the step; reversed unless given, if that is among the scenes
    #[arg(long, value_name = "SCENE")]
    sweep: Option<String>,
    /// Judge elements against nature, closed forms and published values instead: physics.csv, physics.md, pictures and a part of report.html; a scene is one of
    /// silicone-beam, bending, cook, cylinder, torsion, punch, all of them unless given
    #[arg(long, conflicts_with_all = ["methods", "multiples", "element", "weights", "sweep"])]
    physics: bool,
    /// Judge whether runs are ever wrong without a word instead: hard.csv, hard-frames.csv and a part of report.html; a scene is a hard case or one of
    /// the laboratory's, all of them unless given but paper-bar-fine and million-steps, which take minutes
    #[arg(long, conflicts_with_all = ["physics", "multiples", "element", "weights", "sweep"])]
    hard: bool,
    /// Mesh to judge as a hard case, with the scenes that are named: held at one end of its longest axis, under its own weight and a
    /// pull at the other end
    #[arg(long, value_name = "FILE", requires = "hard")]
    mesh: Option<PathBuf>,
    /// Factor to metres of that mesh; 0.001 for one in millimetres
    #[arg(long, value_name = "S", default_value_t = 1.0, requires = "mesh")]
    scale: f64,
    /// Judge adaptive steps of this tolerance (mm) over the hard cases instead, against fixed steps of the methods, damped ones unless
    /// given: tolerance.csv; may be repeated
    #[arg(long = "tolerance", value_name = "MM", conflicts_with_all = ["physics", "hard", "multiples", "element", "weights", "sweep"])]
    tolerances: Vec<f64>,
    /// Random scenes among the hard cases
    #[arg(long, value_name = "N", default_value_t = 200)]
    random: u32,
    /// Steps of a run in one of its guard's second run
    #[arg(long, value_name = "N", default_value_t = supple::guard::EVERY, requires = "hard")]
    every: u32,
}

pub(crate) fn evaluate(asked: &Asked) -> Result<End, Problem> {
    if asked.physics {
        return evaluate_physics(asked);
    }
    if !asked.tolerances.is_empty() {
        return evaluate_tolerances(asked);
    }
    if asked.hard {
        return evaluate_hard(asked);
    }
    let Asked { out, scenes, methods, multiples, element, weights, sweep, .. } = asked;
    let mut plan = Plan::new(scenes, methods, multiples, sweep.as_deref()).map_err(Problem::of)?;
    for (scene, _) in &mut plan.scenes {
        scene.element = element.unwrap_or(scene.element);
    }
    for path in weights {
        plan.methods.push(Method::with(path).map_err(Problem::of)?);
    }
    let evaluation = evaluate::evaluate(&plan, out, |words| message!("{words}")).map_err(Problem::of)?;
    print(table::text(&evaluation.rows));
    let judged = equal_error::text(&evaluation.rows);
    if !judged.is_empty() {
        print(format_args!("\n{judged}"));
    }
    finish(
        out,
        "results.csv",
        report::methods::NAME,
        &report::methods::part(&evaluation, plan.sweep.as_deref()),
    )
}

/// Adds a part to the report, and says where results are.
fn finish(out: &Path, results: &str, name: &str, part: &report::Part) -> Result<End, Problem> {
    let report = report::add(out, name, part)?;
    output!("\nresults  {}", out.join(results).display());
    output!("report   {}", report.display());
    Ok(End::Reached)
}

fn evaluate_physics(Asked { out, scenes, .. }: &Asked) -> Result<End, Problem> {
    let plan = physics::Plan::new(scenes).map_err(Problem::of)?;
    let rows = physics::evaluate(&plan, out, |words| message!("{words}")).map_err(Problem::of)?;
    print(physics::tables::tables(&rows));
    finish(out, "physics.csv", report::physics::NAME, &report::physics::part(&rows))
}

fn evaluate_hard(
    Asked { out, scenes, mesh, scale, methods, random, every, .. }: &Asked,
) -> Result<End, Problem> {
    if !(scale.is_finite() && *scale > 0.0) {
        return Err(Problem(format!("--scale {scale}: it must be a positive number")));
    }
    let mesh = mesh.as_deref().map(|path| (path, *scale));
    let plan = hard::Plan::new(scenes, mesh, methods, *random, *every).map_err(Problem::of)?;
    let judged = hard::evaluate(&plan, out, |words| message!("{words}")).map_err(Problem::of)?;
    print(hard::report::text(&judged));
    finish(out, "hard.csv", report::hard::NAME, &report::hard::part(&judged))
}

fn evaluate_tolerances(
    Asked { out, scenes, methods, tolerances, random, every, .. }: &Asked,
) -> Result<End, Problem> {
    if let Some(wrong) = tolerances.iter().find(|tolerance| !(tolerance.is_finite() && **tolerance > 0.0)) {
        return Err(Problem(format!("--tolerance {wrong}: it must be a positive number of mm")));
    }
    let methods = if methods.is_empty() { &[Method::Damped.name().to_owned()] } else { &**methods };
    let plan = hard::Plan::new(scenes, None, methods, *random, *every).map_err(Problem::of)?;
    let rows =
        tolerance::evaluate(&plan, tolerances, out, |words| message!("{words}")).map_err(Problem::of)?;
    print(tolerance::text(&rows));
    output!("\nresults  {}", out.join("tolerance.csv").display());
    Ok(End::Reached)
}
