//! `supple-lab cost`: what a simulated second takes, by size of mesh and method.

use std::path::PathBuf;

use crate::cost::{HEAD, Way, evaluate, line};
use clap::Args;
use supple::material::Element;
use supple_cli::element_name::element_named;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::output;

#[derive(Args)]
pub(crate) struct Asked {
    /// Folder for cost.csv
    #[arg(long)]
    out: PathBuf,
    /// Tetrahedra of the mesh, about; may be repeated
    #[arg(long = "size", value_name = "N", default_values_t = [2_000, 10_000, 30_000, 100_000])]
    sizes: Vec<u32>,
    /// exact, long-N, auto or backward-euler-N, N times the critical step; all but backward Euler unless given; may be
    /// repeated
    #[arg(long = "method", value_name = "NAME")]
    methods: Vec<String>,
    /// Tetrahedra of the scene, linear, nodal-pressure or nodal-strain
    #[arg(long, value_name = "NAME", default_value = "nodal-strain", value_parser = element_named)]
    element: Element,
    /// Threads
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
}

pub(crate) fn judge(Asked { out, sizes, methods, element, threads }: &Asked) -> Result<End, Problem> {
    let ways = methods.iter().map(|name| Way::named(name)).collect::<Result<Vec<_>, _>>().map_err(Problem::of)?;
    let ways = if ways.is_empty() { Way::USUAL.to_vec() } else { ways };
    let mut exact = None;
    output!("{HEAD}");
    evaluate(sizes, *element, &ways, *threads, out, |second| {
        if second.way == Way::Exact {
            exact = Some((second.tetrahedra, second.seconds()));
        }
        output!("{}", line(second, exact.filter(|(of, _)| *of == second.tetrahedra).map(|(_, seconds)| seconds)));
    })
    .map_err(Problem::of)?;
    output!("\nresults  {}", out.join("cost.csv").display());
    Ok(End::Reached)
}
