//! Directions of fibres in the elements: constant, from the cell data of the mesh, or by a rule.

use serde::Deserialize;
use supple::material::Directions;
use supple::scene::Wall;
use toml::Spanned;

use super::body::Body;
use super::file::SceneFile;
use crate::problem::Problem;

/// `[directions]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DirectionsTable {
    fibre: Option<Spanned<Direction>>,
    sheet: Option<Spanned<Direction>>,
    axis: Option<Spanned<[f64; 3]>>,
    through: Option<Spanned<[f64; 3]>>,
    helix: Option<Spanned<[f64; 2]>>,
}

impl DirectionsTable {
    /// Whether they follow from where the surface is.
    pub(crate) const fn are_of_a_wall(&self) -> bool {
        self.axis.is_some()
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Direction {
    Everywhere([f32; 3]),
    /// The name of vectors in the mesh file.
    OfMesh(String),
}

const FORMS: &str = "give fibre (and sheet) as [x, y, z] or as the name of vectors in the mesh file, or a wall by axis, \
                     through and helix = [degrees at the inner side, at the outer side]";

/// The directions in each element.
pub(super) fn read(file: &SceneFile, at: &Spanned<DirectionsTable>, body: &Body) -> Result<Vec<Directions>, Problem> {
    let DirectionsTable { fibre, sheet, axis, through, helix } = at.get_ref();
    match (fibre, sheet, axis, through, helix) {
        (Some(fibre), sheet, None, None, None) => {
            let fibres = vectors(file, fibre, body)?;
            let sheets = match sheet {
                Some(sheet) => vectors(file, sheet, body)?,
                None => vec![[0.0; 3]; fibres.len()],
            };
            Ok(fibres.into_iter().zip(sheets).map(|(fibre, sheet)| Directions { fibre, sheet }).collect())
        }
        (None, None, Some(axis), Some(through), Some(helix)) => {
            let wall = Wall { axis: *axis.get_ref(), through: *through.get_ref(), helix: *helix.get_ref() };
            wall.directions(body.places(), &body.mesh.tets).map_err(|error| file.problem(axis, error))
        }
        _ => Err(file.problem(at, FORMS)),
    }
}

fn vectors(file: &SceneFile, at: &Spanned<Direction>, body: &Body) -> Result<Vec<[f32; 3]>, Problem> {
    let name = match at.get_ref() {
        Direction::Everywhere(vector) => return Ok(vec![*vector; body.mesh.tets.len()]),
        Direction::OfMesh(name) => name,
    };
    let all = &body.mesh.vectors;
    if let Some(found) = all.iter().find(|vectors| vectors.name == *name) {
        return Ok(found.values.iter().map(|vector| vector.map(|component| component as f32)).collect());
    }
    let names: Vec<_> = all.iter().map(|vectors| format!("\"{}\"", vectors.name)).collect();
    let known = if names.is_empty() { "it has none".into() } else { format!("it has {}", names.join(", ")) };
    Err(file.problem(at, format!("the mesh has no vectors \"{name}\" by cell (.vtu or .vtk); {known}")))
}
