//! A lobe on pulls: whether any stiffness makes a step go wrong, and what pulls cost in a step; below
//! [`registration`], how well tracked points lead it. The model is the one of `examples/register_points.py`: free,
//! neo-Hookean with 3 kPa and a Poisson's ratio of 0.45, each pull on the nodes within 2.2 mean edges. SI units.

pub mod registration;

use std::path::Path;
use std::time::Instant;

use glam::Vec3;
use supple::io::{TetMesh, parse_msh};
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::simulation::{Settings, Simulation, SimulationError};

use super::LabError;
use super::random_numbers::Random;
use super::scenes::LOBE;
use super::threads::in_parallel;

/// Stiffnesses of the random pulls, N/m; the last is the stiffest that there can be.
pub const STIFFNESSES: [f32; 6] = [1e1, 1e2, 1e3, 1e4, 1e5, 1e6];
/// Of the points of a tracker, N/m.
const STIFFNESS: f32 = 1000.0;
/// Seconds of a frame.
const FRAME: f64 = 1.0 / 60.0;
/// Share of the points that a frame lacks.
const MISSING: f32 = 0.3;
/// 1/s.
const DAMPING: f32 = 20.0;
const DENSITY: f32 = 1060.0;

/// The mesh of the lobe.
#[derive(Clone, Debug)]
pub struct Lobe {
    points: Vec<[f32; 3]>,
    tets: Vec<[u32; 4]>,
    /// Nodes of the surface, in order.
    surface: Vec<u32>,
    /// Of a patch, m.
    radius: f32,
}

impl Lobe {
    /// That of `meshes/lobe.msh`.
    pub fn read() -> Result<Self, LabError> {
        let TetMesh { points, tets, triangles, .. } = parse_msh(Path::new("lobe"), LOBE)?;
        let points: Vec<_> = points.into_iter().map(|point| point.map(|component| component as f32)).collect();
        let mut surface = triangles.into_flattened();
        surface.sort_unstable();
        surface.dedup();
        let lengths = tets.iter().flat_map(|tet| EDGES.map(|pair| pair.map(|corner| tet[corner])));
        let lengths = lengths.map(|[a, b]| at(&points, a).distance(at(&points, b)));
        let radius = 2.2 * lengths.sum::<f32>() / (6 * tets.len()) as f32;
        Ok(Self { points, tets, surface, radius })
    }

    /// The free model, at rest.
    fn body(&self, element: Element) -> Result<Simulation<'static>, LabError> {
        let material = VecMaterial::one(element, NeoHookean { c: 517.0, d: 5_000.0 }, DENSITY);
        let body = Simulation::new(self.points.iter().copied(), self.tets.iter().copied(), material, &[])?;
        Ok(body.with(Settings { damping: DAMPING, ..Settings::default() }))
    }

    /// A point somewhere in the tissue.
    fn inside(&self, random: &mut Random) -> Vec3 {
        let tet = random.one_of(&self.tets);
        // Evenly distributed, as gaps between three numbers on a line.
        let mut cuts = [0.0, random.between(0.0, 1.0), random.between(0.0, 1.0), random.between(0.0, 1.0), 1.0];
        cuts.sort_by(f32::total_cmp);
        (0..4).map(|corner| (cuts[corner + 1] - cuts[corner]) * at(&self.points, tet[corner])).sum()
    }
}

/// Corners of the edges of a tetrahedron.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

fn at(points: &[[f32; 3]], node: u32) -> Vec3 {
    Vec3::from_array(points[node as usize])
}

/// The value that this share of all does not exceed.
#[must_use]
pub fn share(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((share * (sorted.len().max(1) - 1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

/// What became of runs with random points and targets.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Tetrahedra.
    pub element: Element,
    /// Of pulls on patches, N/m; none: of those on the corners of one element each, with all of [`STIFFNESSES`].
    pub stiffness: Option<f32>,
    /// Seeds whose run was refused, with the reason.
    pub refused: Vec<(u64, SimulationError)>,
    /// Seeds whose nodes were not finite, or went beyond [`SENSE`] while every status was `ok`.
    pub astray: Vec<u64>,
    /// Runs in which a frame was not `ok`.
    pub told: usize,
    /// The farthest that a node went from where it is at rest, mm.
    pub farthest: f64,
}

/// Targets are up to so far from where their points are at rest, m.
pub const DRAWN: f32 = 0.04;
/// No node has a reason to go so far, m: three times as far as the targets, more than half the length of the lobe.
pub const SENSE: f32 = 3.0 * DRAWN;

/// Runs with each of so many seeds, of each element and stiffness: 6 to 20 random points of the surface, with the usual
/// limit of their force, are drawn to random targets. Those change in every fifth of 20 frames, and 30 % are absent in
/// each; then the body settles. `tick` is called with what is done.
pub fn draw(lobe: &Lobe, seeds: u64, mut tick: impl FnMut(&Drawn)) -> Result<Vec<Drawn>, LabError> {
    let mut all = Vec::new();
    for element in Element::ALL {
        for stiffness in STIFFNESSES.map(Some).into_iter().chain([None]) {
            let run = |seed: usize| drawn(lobe, element, stiffness, seed as u64);
            let mut row = Drawn { element, stiffness, refused: vec![], astray: vec![], told: 0, farthest: 0.0 };
            for (seed, (refused, told, farthest)) in (0..).zip(in_parallel(seeds as usize, run, |_, _| ())?) {
                row.told += usize::from(told);
                row.refused.extend(refused.map(|error| (seed, error)));
                if !farthest.is_finite() || (farthest > SENSE && !told) {
                    row.astray.push(seed);
                }
                row.farthest = row.farthest.max(1e3 * f64::from(farthest));
            }
            tick(&row);
            all.push(row);
        }
    }
    Ok(all)
}

/// Why it was refused, whether a frame was not `ok`, and how far a node went, m.
fn drawn(
    lobe: &Lobe,
    element: Element,
    stiffness: Option<f32>,
    seed: u64,
) -> Result<(Option<SimulationError>, bool, f32), LabError> {
    let (mut random, mut body) = (Random(seed), lobe.body(element)?);
    let of_corners = (0.0, STIFFNESSES[seed as usize % STIFFNESSES.len()]);
    let (radius, stiffness) = stiffness.map_or(of_corners, |stiffness| (lobe.radius, stiffness));
    for _ in 0..random.one_of(&[6, 10, 20]) {
        body.pull(at(&lobe.points, random.one_of(&lobe.surface)).to_array(), radius, stiffness)?;
    }
    let (mut told, mut farthest) = (false, 0.0_f32);
    let mut targets = vec![Vec3::ZERO; body.pulls.len()];
    for frame in 0..=20 {
        let now = body.state().time();
        for (pull, target) in body.pulls.iter_mut().zip(&mut targets) {
            if frame % 5 == 0 {
                *target = Vec3::from_array(pull.at) + random.between(0.0, DRAWN) * random.direction();
            }
            let seen = if random.chance(MISSING) { Vec3::NAN } else { *target };
            pull.move_to(seen.to_array(), now, now + FRAME);
        }
        body.turn_pulls();
        let moved = match frame {
            20 => body.settle(1e-4, 500).map(|_| true),
            _ => body.advance(FRAME).map(|report| report.is_ok()),
        };
        match moved {
            Ok(is_ok) => told |= !is_ok,
            Err(error) => return Ok((Some(error), told, farthest)),
        }
        let lengths = body.displacements().iter().map(|moved| Vec3::from_array(moved.to_array()).length());
        // Not a number is farther than any.
        farthest = lengths.fold(farthest, |most, length| if length > most || length.is_nan() { length } else { most });
    }
    Ok((None, told, farthest))
}

/// Medians of the time of an exact step.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Tetrahedra.
    pub element: Element,
    /// Nodes of all pulls.
    pub nodes: usize,
    /// Without and with pulls, and the difference of two in turn, us.
    pub times: [f64; 3],
}

/// What 20 pulls cost in an exact step, each on its 16 nearest nodes or on those within the usual radius, by so many
/// pairs of 50 steps without and with them, in turn, from the same state of a lobe that its pulls move.
pub fn cost(lobe: &Lobe, pairs: usize, mut tick: impl FnMut(&Cost)) -> Result<(), LabError> {
    const STEPS: u32 = 50;
    for (element, is_usual) in Element::ALL.into_iter().flat_map(|element| [(element, false), (element, true)]) {
        let mut random = Random(20);
        let (mut without, mut with, mut nodes) = (lobe.body(element)?, lobe.body(element)?, 0);
        for node in registration::spread(lobe, random.one_of(&lobe.surface), 20) {
            let point = at(&lobe.points, node);
            let mut away: Vec<_> = lobe.points.iter().map(|node| point.distance(Vec3::from(*node))).collect();
            away.sort_by(f32::total_cmp);
            let pull = with.pull(point.to_array(), if is_usual { lobe.radius } else { away[15] }, STIFFNESS)?;
            with.pulls[pull].put((point + random.between(0.0, 0.01) * random.direction()).to_array());
            nodes += with.pulls[pull].nodes[1] as usize;
        }
        let step = 0.9 * with.critical_step()?.seconds;
        for body in [&mut without, &mut with] {
            body.set(Settings { step: Some(step), unchecked: true, damping: DAMPING, ..Settings::default() });
        }
        let mut times = [vec![], vec![], vec![]];
        for pair in 0..pairs {
            without.state_mut().clone_from(with.state());
            let mut pair_times = [0.0; 2];
            for which in [pair % 2, 1 - pair % 2] {
                let (body, begin) = (if which == 0 { &mut without } else { &mut with }, Instant::now());
                let report = body.advance(f64::from(STEPS) * f64::from(step))?;
                pair_times[which] = 1e6 * begin.elapsed().as_secs_f64() / f64::from(report.steps());
            }
            let [without, with] = pair_times;
            times.iter_mut().zip([without, with, with - without]).for_each(|(times, time)| times.push(time));
        }
        tick(&Cost { element, nodes, times: times.map(|times| share(&times, 0.5)) });
    }
    Ok(())
}
