//! `supple-lab pulls`: what a lobe does on pulls.

use crate::LabError;
use crate::pulls::registration::{FRAMES, Start, Truth, follow, start};
use crate::pulls::{Lobe, cost, draw, share};
use clap::Args;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, output};

/// Tracked points.
const POINTS: [usize; 3] = [6, 10, 20];

#[derive(Args)]
pub(crate) struct Asked {
    /// Random runs of each element and stiffness
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    seeds: u64,
    /// Runs with moving points, and cold starts, of each number of points
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    registrations: u64,
}

pub(crate) fn judge(asked: &Asked) -> Result<End, Problem> {
    tables(asked).map_err(Problem::of)
}

fn tables(Asked { seeds, registrations }: &Asked) -> Result<End, LabError> {
    let lobe = Lobe::read()?;
    message!("the truth of moving points, on a mesh of eight times as many elements");
    let truth = Truth::of(&lobe, FRAMES, true)?;
    output!("points  error mm moving   rigid  at rest   rigid  frame ms median   95 %  worst  not ok");
    for points in POINTS {
        let row = follow(&lobe, &truth, points, *registrations)?;
        let [[moving, rigid], [rest, rigid_rest]] = row.errors;
        let [median, most, worst] = [0.5, 0.95, 1.0].map(|part| share(&row.times, part));
        let (doubted, frames) = (row.doubted, row.times.len());
        output!(
            "{points:6} {moving:16.2} {rigid:7.2} {rest:8.2} {rigid_rest:7.2} {median:16.2} {most:6.2} {worst:6.2}  \
             {doubted} of {frames}"
        );
    }
    output!("\npoints  steps to rest, most  ms median  to within 0.1 mm, most  off when at rest mm  error mm   rigid");
    for points in POINTS {
        let rows = (0..*registrations).map(|seed| start(&lobe, &truth, points, seed)).collect::<Result<Vec<_>, _>>()?;
        let of = |part: f64, of: fn(&Start) -> f64| share(&rows.iter().map(of).collect::<Vec<_>>(), part);
        let steps = [0.5, 1.0].map(|part| of(part, |row| row.steps.into()));
        let within = [0.5, 1.0].map(|part| of(part, |row| row.within.into()));
        output!(
            "{points:6} {:14.0} {:5.0} {:10.1} {:17.0} {:5.0} {:20.3} {:9.2} {:7.2}",
            steps[0],
            steps[1],
            of(0.5, |row| row.time),
            within[0],
            within[1],
            of(1.0, |row| row.remaining),
            of(0.5, |row| row.errors[0]),
            of(0.5, |row| row.errors[1]),
        );
    }
    output!("\n20 pulls in an exact step  nodes  us without    with  difference  ratio");
    cost(&lobe, 200, |row| {
        let ([without, with, difference], name) = (row.times, row.element.name());
        let ratio = 1.0 + difference / without;
        output!("{name:25} {:6} {without:11.1} {with:7.1} {difference:11.2} {ratio:6.3}", row.nodes);
    })?;
    output!("\nrandom pulls              N/m   runs  refused  silently astray  told  farthest mm");
    draw(&lobe, *seeds, |row| {
        let (name, refused, astray) = (row.element.name(), row.refused.len(), row.astray.len());
        let stiffness = row.stiffness.map_or_else(|| "of corners".into(), |stiffness| stiffness.to_string());
        let (told, farthest) = (row.told, row.farthest);
        output!("{name:16} {stiffness:>12} {seeds:6} {refused:8} {astray:16} {told:5} {farthest:12.0}");
        for (seed, error) in &row.refused {
            output!("    seed {seed}: {error}");
        }
        for seed in &row.astray {
            output!("    seed {seed}: a node is not finite, or beyond sense while every status was ok");
        }
    })?;
    Ok(End::Reached)
}
