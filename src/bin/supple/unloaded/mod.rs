//! `supple unloaded`: the mesh whose shape at rest under the loads of a scene is the scene's mesh, for organs that were
//! imaged under gravity.
//!
//! Wanted are places `X` of the nodes with `x(X) = x0`, where `x` is the shape at rest and `x0` the mesh. The step
//! `X - (x(X) - x0)` alone diverges where bodies sag far. The steps before it are taken into account (Anderson, Journal
//! of the ACM 12, 1965; Walker and Ni, SIAM Journal on Numerical Analysis 49, 2011): of the latest places the mixture
//! whose gaps, in least squares, cancel best. It begins with the shape under the opposite loads, in which a body is
//! nearly as far from the unloaded one as under the loads, in the other direction (Govindjee and Mihalic, Computer Methods
//! in Applied Mechanics and Engineering 136, 1996, have why it is not the answer itself).

mod carried;
mod mixture;

use std::path::PathBuf;

use supple::io::{Frame, TetMesh};

use crate::problem::{End, Problem};
use crate::rest::{Unrest, at_rest};
use crate::scene::body::volume;
use crate::scene::file::SceneFile;
use crate::scene::setup::Setup;
use crate::screen::{message, row};
use mixture::Mixture;

/// The mesh whose shape at rest under a scene's gravity and loads is the scene's mesh
#[derive(clap::Args)]
pub(crate) struct Asked {
    /// The scene with the mesh as it was imaged, a TOML file
    scene: PathBuf,
    /// File for the mesh without loads (.vtu), in the unit of the scene's mesh
    #[arg(long)]
    out: PathBuf,
    /// How far the worst node may be from the image under the loads (mm)
    #[arg(long, value_name = "MM", default_value_t = 0.1)]
    gap: f64,
}

/// At most so many simulations.
const MOST_SIMULATIONS: u32 = 40;
/// How much of the accepted gap may be left of the way to rest.
const REST: f64 = 0.02;
/// A step that turns elements inside out, or under which the body does not come to rest, is taken in part: at least
/// such a share of it.
const LEAST_SHARE: f64 = 1.0 / 16.0;
/// Of all steps together at most so many are refused: each costs more than one that is not.
const MOST_REFUSED: u32 = 6;

/// What became of the search.
struct Found {
    points: Vec<[f64; 3]>,
    /// m.
    mean_gap: f64,
    largest_gap: f64,
    simulations: u32,
}

pub(crate) fn unloaded(asked: &Asked) -> Result<End, Problem> {
    if !(asked.gap.is_finite() && asked.gap > 0.0) {
        return Err(Problem(format!("--gap is {} mm, it must be a positive number", asked.gap)));
    }
    if asked.out.extension().is_none_or(|extension| extension != "vtu") {
        return Err(Problem(format!("--out {}: the mesh is written as .vtu; name it so", asked.out.display())));
    }
    let file = SceneFile::read(&asked.scene)?;
    let mut setup = Setup::read(&file)?;
    for warning in &setup.warnings {
        message!("warning: {warning}");
    }
    if !setup.motions.is_empty() {
        return Err(Problem::in_file(
            &asked.scene,
            "supports that move have no shape without loads; remove [[move]], or make them [[fix]]",
        ));
    }
    let found = Search { file: &file, image: &mut setup, gap: 1e-3 * asked.gap, simulations: 0 }.run()?;
    let (mesh, remedies) = carried::mesh_without_loads(&file, &setup, &found.points)?;
    let image = &setup.body.mesh.points;
    write(asked, &file, &mesh, image)?;
    for remedy in remedies {
        message!("warning: {remedy}");
    }
    let sag = distances(&found.points, image);
    row("sag, mean and most", format!("{:.2} and {:.2} mm", 1e3 * mean(&sag), 1e3 * most(&sag)));
    row("gap, mean and most", format!("{:.3} and {:.3} mm", 1e3 * found.mean_gap, 1e3 * found.largest_gap));
    row("simulations", found.simulations);
    row("mesh", asked.out.display());
    Ok(End::Reached)
}

/// The mesh as `.vtu`, with the displacement to the image at its nodes, and the regions and vectors of its elements.
fn write(asked: &Asked, file: &SceneFile, mesh: &TetMesh, image: &[[f64; 3]]) -> Result<(), Problem> {
    let scale = file.scene.mesh.get_ref().scale.as_ref().map_or(1.0, |scale| *scale.get_ref());
    let points: Vec<_> = mesh.points.iter().map(|point| point.map(|metre| metre / scale)).collect();
    let to_image = mesh.points.iter().zip(image);
    let to_image: Vec<_> =
        to_image.map(|(from, to)| [0, 1, 2].map(|axis| ((to[axis] - from[axis]) / scale) as f32)).collect();
    let vectors: Vec<Vec<[f32; 3]>> = mesh.vectors.iter().map(|vectors| single(&vectors.values)).collect();
    let vectors: Vec<_> = mesh.vectors.iter().zip(&vectors).map(|(of, values)| (&of.name[..], &values[..])).collect();
    let frame = Frame {
        points: &points,
        tets: &mesh.tets,
        point_vectors: &[("to_image", &to_image)],
        cell_vectors: &vectors,
        regions: &mesh.regions,
        ..Frame::default()
    };
    supple::io::write_vtu(&asked.out, &frame)
        .map_err(|error| Problem::in_file(&asked.out, format!("cannot be written: {error}")))
}

fn single(vectors: &[[f64; 3]]) -> Vec<[f32; 3]> {
    vectors.iter().map(|vector| vector.map(|component| component as f32)).collect()
}

struct Search<'a> {
    file: &'a SceneFile,
    /// The scene of the image.
    image: &'a mut Setup,
    /// m.
    gap: f64,
    simulations: u32,
}

impl Search<'_> {
    fn run(mut self) -> Result<Found, Problem> {
        let opposite = self.under_opposite_loads()?;
        let image = self.image.body.mesh.points.clone();
        let mut points: Vec<_> = image
            .iter()
            .zip(&opposite)
            .map(|(at, moved)| [0, 1, 2].map(|axis| at[axis] + f64::from(moved[axis])))
            .collect();
        let mut tried: Option<Vec<[f64; 3]>> = None;
        let (mut mixture, mut share, mut best, mut refused) = (Mixture::new(), 1.0, f64::INFINITY, 0);
        while self.simulations < MOST_SIMULATIONS {
            let gaps = match self.gaps(&points)? {
                Some(gaps) => gaps,
                None => {
                    // Back towards the last place that could be simulated.
                    (share, refused) = (0.5 * share, refused + 1);
                    let from = tried.as_ref().unwrap_or(&image);
                    if share < LEAST_SHARE || refused > MOST_REFUSED {
                        return Err(self.refused(best));
                    }
                    points = between(from, &points, 0.5);
                    continue;
                }
            };
            share = 1.0;
            let lengths = lengths(&gaps);
            let largest_gap = most(&lengths);
            best = best.min(largest_gap);
            if largest_gap <= self.gap {
                return Ok(Found { points, mean_gap: mean(&lengths), largest_gap, simulations: self.simulations });
            }
            let next = mixture.next(&points, &gaps);
            tried = Some(std::mem::replace(&mut points, next));
        }
        Err(Problem(format!(
            "{}: after {MOST_SIMULATIONS} simulations a node is still {:.2} mm from the image; stiffen the tissue, or accept it with --gap",
            self.image.body.name,
            1e3 * best
        )))
    }

    fn refused(&self, best: f64) -> Problem {
        let so_far = if best.is_finite() { format!(" (nearest so far: {:.2} mm)", 1e3 * best) } else { String::new() };
        Problem(format!(
            "{}: every mesh without loads that was tried has elements inside out, or does not come to rest under the loads{so_far}; the tissue is \
             too soft for these loads, or the image is not one of this body under them",
            self.image.body.name
        ))
    }

    /// How far each node is from the image under the loads, m; none if the mesh cannot be simulated.
    fn gaps(&mut self, points: &[[f64; 3]]) -> Result<Option<Vec<[f64; 3]>>, Problem> {
        if self.is_inside_out(points) {
            return Ok(None);
        }
        // Areas, springs and pulls are those of the mesh that is tried, as in a run of it.
        let setup = Setup::with_body(self.file, self.image.body.moved_to(points))?;
        self.simulations += 1;
        // The image is where it should come to rest.
        let image = &self.image.body.mesh.points;
        let way = |(to, from): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|axis| (to[axis] - from[axis]) as f32);
        let from: Vec<_> = image.iter().zip(points).map(way).collect();
        let gap = |((from, moved), to): ((&[f64; 3], &[f32; 3]), &[f64; 3])| {
            [0, 1, 2].map(|axis| from[axis] + f64::from(moved[axis]) - to[axis])
        };
        let gaps = |shape: &[[f32; 3]]| -> Vec<_> { points.iter().zip(shape).zip(image).map(gap).collect() };
        let tolerance = REST * self.gap;
        let from_image = match at_rest(&setup, Some(&from), tolerance) {
            Ok(shape) => gaps(&shape),
            Err(Unrest::Diverged(_)) => vec![],
            Err(Unrest::Crushed | Unrest::Moves(_)) => return Ok(None),
            Err(Unrest::Problem(problem)) => return Err(problem),
        };
        // What counts is where a run ends, and from far away it is known better when a body is at rest.
        if most(&lengths(&from_image)) > self.gap {
            return Ok(Some(from_image));
        }
        match at_rest(&setup, None, tolerance) {
            Ok(shape) => Ok(Some(gaps(&shape))),
            Err(Unrest::Problem(problem)) => Err(problem),
            Err(_) => Ok((!from_image.is_empty()).then_some(from_image)),
        }
    }

    /// Displacements at rest of the image under the opposite of gravity, forces and pressures.
    fn under_opposite_loads(&mut self) -> Result<Vec<[f32; 3]>, Problem> {
        self.simulations += 1;
        let turn = |setup: &mut Setup| {
            setup.gravity = setup.gravity.map(|component| -component);
            for force in &mut setup.forces {
                force.newton = force.newton.map(|component| -component);
            }
            for pressure in &mut setup.pressures.surfaces {
                pressure.pascal = -pressure.pascal;
            }
        };
        turn(self.image);
        let shape = at_rest(self.image, None, REST * self.gap);
        turn(self.image);
        match shape {
            Ok(shape) => Ok(shape),
            // Then from the image on.
            Err(Unrest::Diverged(_) | Unrest::Crushed) => Ok(vec![[0.0; 3]; self.image.body.local.len()]),
            Err(unrest) => Err(unrest.of(&self.image.body.name)),
        }
    }

    /// Whether elements are turned the other way than in the image.
    fn is_inside_out(&self, points: &[[f64; 3]]) -> bool {
        let of = |tet: &[u32; 4], points: &[[f64; 3]]| volume(tet.map(|node| points[node as usize]));
        let image = &self.image.body.mesh;
        image.tets.iter().any(|tet| of(tet, points) * of(tet, &image.points) <= 0.0)
    }
}

/// Places between two sets, at a share of the way.
fn between(from: &[[f64; 3]], to: &[[f64; 3]], share: f64) -> Vec<[f64; 3]> {
    let place = |(from, to): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
    from.iter().zip(to).map(place).collect()
}

fn distances(a: &[[f64; 3]], b: &[[f64; 3]]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| length([0, 1, 2].map(|axis| a[axis] - b[axis]))).collect()
}

fn lengths(vectors: &[[f64; 3]]) -> Vec<f64> {
    vectors.iter().map(|vector| length(*vector)).collect()
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|component| component * component).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
