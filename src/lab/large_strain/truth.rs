//! The truth of a case, extrapolated from two meshes: whether it is one, and how far a shape is from it.

use glam::DVec3;
use supple::mesh::{Mesh, Winding};
use supple::points::{FollowedPoint, VecPoints};
use supple::scene::BuildError;

use super::cases::{Body, Case, Law};
use super::rest::{End, Shape};
use super::vector;
use crate::LabError;

/// By which share (%) the two fine meshes of a truth may differ in force.
pub const AGREED: f64 = 5.0;
/// How far the surface of a truth may pass into what moves it, which nothing keeps out, m.
pub const FOLDED: f64 = 4e-4;

/// The truth of a case, a tissue and a share.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The case.
    pub case: Case,
    /// The tissue.
    pub law: Law,
    /// How far supports have gone.
    pub share: f64,
    /// N.
    pub force: f64,
    /// How much more it is on the finer and on the less fine mesh, %.
    pub meshes: [f64; 2],
    /// The least volume ratio of an element of the finer one.
    pub least: f64,
    /// How far the surface has passed into what moves it there, m.
    pub fold: f64,
    /// Why it is none.
    pub fails: Option<&'static str>,
}

/// A body at rest on a finer and a less fine mesh.
pub(super) type Pair<'a> = [(&'a Body, &'a Shape); 2];

pub(super) fn truth(case: Case, law: Law, share: f64, pair: Pair<'_>, beyond: f64) -> Truth {
    let [(body, shape), (_, less)] = pair;
    let force = shape.force - beyond * (less.force - shape.force);
    let depths = (0..).zip(body.points.iter().zip(&shape.displacements)).filter(|(node, _)| body.is_free(*node));
    let fold = depths.map(|(_, (point, moved))| case.depth((vector(*point) + vector(*moved)).to_array(), share));
    let fold = fold.fold(0.0, f64::max);
    let fails = match (shape.end, less.end) {
        (End::Refused(_), _) | (_, End::Refused(_)) => Some("refused"),
        (End::Restless, _) | (_, End::Restless) => Some("never at rest"),
        (End::Limited, _) | (_, End::Limited) => Some("beyond its law"),
        _ if shape.least <= 0.0 => Some("inside out"),
        _ if fold > FOLDED => Some("folds into its support"),
        _ if (less.force / shape.force - 1.0).abs() > 0.01 * AGREED => Some("the meshes differ"),
        _ => None,
    };
    let meshes = [shape, less].map(|shape| 100.0 * (shape.force / force - 1.0));
    Truth { case, law, share, force, meshes, least: shape.least, fold, fails }
}

/// Root mean square of the distance of the free nodes from the truth, in its part of the cube, m.
pub(super) fn distance(pair: Pair<'_>, beyond: f64, body: &Body, shape: &Shape) -> Result<f64, LabError> {
    let free: Vec<u32> = (0..body.points.len() as u32).filter(|&node| body.is_free(node)).collect();
    let places: Vec<[f32; 3]> = free.iter().map(|&node| body.points[node as usize]).collect();
    let mut located = Vec::new();
    for (fine, shape) in pair {
        let mesh = Mesh::new(&fine.points, &fine.tets, Winding::Checked).map_err(BuildError::Mesh)?;
        let points = VecPoints::locate(&mesh, &places).map_err(|error| LabError::File(error.to_string()))?;
        let moved = |point: &FollowedPoint| -> DVec3 {
            let corners = point.nodes.iter().zip(point.weights);
            corners.map(|(&node, weight)| f64::from(weight) * vector(shape.displacements[node as usize])).sum()
        };
        // Places on the other side of a mirror plane are outside.
        let is_inside = |point: &FollowedPoint| point.distance < 1e-6;
        located.push(points.points().iter().map(|point| is_inside(point).then(|| moved(point))).collect::<Vec<_>>());
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for (&node, (fine, less)) in free.iter().zip(located[0].iter().zip(&located[1])) {
        if let (Some(fine), Some(less)) = (fine, less) {
            let truth = *fine - beyond * (*less - *fine);
            sum += (vector(shape.displacements[node as usize]) - truth).length_squared();
            count += 1.0;
        }
    }
    Ok((sum / f64::max(count, 1.0)).sqrt())
}
