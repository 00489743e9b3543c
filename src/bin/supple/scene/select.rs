//! Which nodes or elements an entry of a scene file is about.

use toml::Spanned;

use super::body::{Body, diagonal, extent};
use super::file::{AxisName, SceneFile, Selection};
use crate::problem::Problem;

/// How far from a plane a node may be and still lie on it, as a share of the body's diagonal: more than the
/// rounding of mesh files, less than any element.
pub(super) const ON_PLANE: f64 = 1e-5;

/// The nodes an entry is about; none is an error.
pub(crate) fn select<T>(
    file: &SceneFile,
    at: &Spanned<T>,
    selection: &Selection<'_>,
    body: &Body,
) -> Result<Vec<u32>, Problem> {
    let points = body.places();
    let chosen: Vec<_> = match selection {
        Selection { nodes: Some(nodes), plane: None, bounds: None } => {
            if let Some(node) = nodes.get_ref().iter().find(|node| **node as usize >= points.len()) {
                return Err(file.problem(
                    nodes,
                    format!("node {node} does not exist, the mesh has nodes 0 to {}", points.len() - 1),
                ));
            }
            // A node that is listed twice is one node: it gets the entry's force once.
            let mut listed = vec![false; points.len()];
            let first = |node: &u32| !std::mem::replace(&mut listed[*node as usize], true);
            nodes.get_ref().iter().copied().filter(first).collect()
        }
        Selection { nodes: None, .. } => {
            let inside = inside(file, at, selection, "nodes", body)?;
            (0..points.len() as u32).filter(|&node| inside(points[node as usize])).collect()
        }
        _ => return Err(file.problem(at, "give exactly one of nodes, plane and box")),
    };
    if chosen.is_empty() {
        let (low, high) = extent(points);
        let mm = |point: [f64; 3]| point.map(|component| (component * 1e6).round() * 1e-3);
        return Err(
            file.problem(at, format!("this selects no node; the mesh reaches from {:?} to {:?} mm", mm(low), mm(high)))
        );
    }
    Ok(chosen)
}

/// Whether a point is on the plane or in the box of a selection, which may have `other` instead of these.
pub(crate) fn inside<T>(
    file: &SceneFile,
    at: &Spanned<T>,
    selection: &Selection<'_>,
    other: &str,
    body: &Body,
) -> Result<impl Fn([f64; 3]) -> bool + use<T>, Problem> {
    let (plane, bounds) = (selection.plane, selection.bounds);
    if plane.is_some() == bounds.is_some() {
        return Err(file.problem(at, format!("give exactly one of {other}, plane and box")));
    }
    let tolerance = ON_PLANE * diagonal(body.places());
    Ok(move |point: [f64; 3]| {
        let on_plane = plane.is_none_or(|plane| {
            let axis = match plane.axis {
                AxisName::X => 0,
                AxisName::Y => 1,
                AxisName::Z => 2,
            };
            (point[axis] - plane.at).abs() <= tolerance
        });
        let in_box = bounds.is_none_or(|bounds| {
            (0..3)
                .all(|axis| point[axis] >= bounds.min[axis] - tolerance && point[axis] <= bounds.max[axis] + tolerance)
        });
        on_plane && in_box
    })
}
