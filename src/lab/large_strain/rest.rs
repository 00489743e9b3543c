//! A body at rest at each of the shares that its supports have gone, one after the other: they go in small parts, and
//! the body comes near to rest between them.

use supple::material::{AnyLaw, Element, VecMaterial};
use supple::simulation::{Simulation, SimulationError};
use supple::step::{Divergence, Status};
use supple::tled;

use super::cases::Body;
use super::vector;
use crate::LabError;
use crate::scenes::volume;

/// What supports go at once, as a share.
const PART: f64 = 0.02;
/// Steps between two parts.
const STEPS_A_PART: u32 = 128;
/// How near to rest (m), and in how many steps at most.
const NEAR: f32 = 5e-6;
const MOST_STEPS: u32 = 10_000;

/// How a share ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// At rest.
    Rest,
    /// At rest, but some elements are beyond the range of their law.
    Limited,
    /// Still in motion after all steps that are allowed.
    Restless,
    /// A step was refused on the way here or before.
    Refused(Divergence),
}

/// A body at a share.
pub(super) struct Shape {
    pub(super) end: End,
    /// Force of the supports along the axis of motion, N.
    pub(super) force: f64,
    /// m.
    pub(super) displacements: Vec<[f32; 3]>,
    /// The least volume ratio of an element.
    pub(super) least: f64,
    pub(super) steps: u32,
}

/// At each of these shares, which rise.
pub(super) fn shapes(body: &Body, element: Element, law: AnyLaw, shares: &[f64]) -> Result<Vec<Shape>, LabError> {
    let material = VecMaterial::one(element, law, 1000.0);
    let mut moved = Simulation::new(body.points.iter().copied(), body.tets.iter().copied(), material, &body.supports)?;
    let (mut gone, mut end, mut shapes) = (0.0, End::Rest, Vec::new());
    for &share in shares {
        let parts = ((share - gone) / PART).ceil().max(1.0);
        let mut steps = 0;
        for part in 1..=parts as u32 {
            if matches!(end, End::Refused(_)) {
                break;
            }
            moved.motions = body.motions(gone + (share - gone) * f64::from(part) / parts);
            let is_last = f64::from(part) == parts;
            end = match moved.settle(NEAR, if is_last { MOST_STEPS } else { STEPS_A_PART }) {
                Ok(settled) => {
                    steps += settled.steps;
                    match settled.status {
                        _ if !settled.at_rest => End::Restless,
                        Status::Ok => End::Rest,
                        _ => End::Limited,
                    }
                }
                Err(SimulationError::Refused(divergence)) => End::Refused(divergence),
                Err(error) => return Err(error.into()),
            };
        }
        gone = share;
        shapes.push(shape(body, &mut moved, end, steps)?);
    }
    Ok(shapes)
}

fn shape(body: &Body, moved: &mut Simulation<'_>, end: End, steps: u32) -> Result<Shape, LabError> {
    let (scene, state) = moved.parts_mut();
    if !tled::internal_forces(scene, state) {
        return Err(LabError::Mismatch { nodes: scene.node_count(), room: state.displacements().len() });
    }
    let axis = body.case.axis();
    let sum: f64 = body.pushed.iter().map(|&node| f64::from(state.forces()[node as usize].to_array()[axis])).sum();
    let displacements: Vec<[f32; 3]> = state.displacements().iter().map(|vector| vector.to_array()).collect();
    let ratio = |tet: &[u32; 4]| {
        let rest = tet.map(|node| vector(body.points[node as usize]));
        let now = [0, 1, 2, 3].map(|corner| rest[corner] + vector(displacements[tet[corner] as usize]));
        volume(now) / volume(rest)
    };
    let least = body.tets.iter().map(ratio).fold(f64::INFINITY, f64::min);
    Ok(Shape { end, force: (body.parts * sum).abs(), displacements, least, steps })
}
