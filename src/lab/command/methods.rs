//! `supple-lab methods`: methods over scenes, judged against the exact step.

use std::path::PathBuf;

use crate::evaluate::{self, Plan};
use crate::method::Method;
use crate::{equal_error, table};
use clap::Args;
use supple::material::Element;
use supple_cli::element_name::element_named;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, print};

use super::finish;
use crate::report::methods;

#[derive(Args)]
pub(crate) struct Asked {
    /// Folder for results.csv, report.html and the truths; results of an earlier evaluation are overwritten, but parts
    /// of the report that other commands of this kind have added stay
    #[arg(long)]
    out: PathBuf,
    /// Scene, or `ramped` or `moving` for a group of them, all 34 unless given; may be repeated
    #[arg(long = "scene", value_name = "NAME")]
    scenes: Vec<String>,
    /// Method, unless given all but paper-f32, backward-euler and implicit-midpoint, which take far longer, and those
    /// that are for hard cases; may be repeated
    #[arg(long = "method", value_name = "NAME")]
    methods: Vec<String>,
    /// Step as a multiple of the scene's, 1 10 20 50 100 unless given; may be repeated
    #[arg(long = "multiple", value_name = "N")]
    multiples: Vec<u32>,
    /// Tetrahedra of the scenes, linear or nodal-pressure; linear unless given, as in the paper
    #[arg(long, value_name = "NAME", value_parser = element_named)]
    element: Option<Element>,
    /// Weight file of a network of the learned step to judge as well, at its own step; may be repeated
    #[arg(long, value_name = "FILE")]
    weights: Vec<PathBuf>,
    /// Scene whose error the report draws over the step; reversed unless given, if that is among the scenes
    #[arg(long, value_name = "SCENE")]
    sweep: Option<String>,
}

pub(crate) fn judge(asked: &Asked) -> Result<End, Problem> {
    let Asked { out, scenes, methods, multiples, element, weights, sweep } = asked;
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
    finish(out, "results.csv", methods::NAME, &methods::part(&evaluation, plan.sweep.as_deref()))
}
