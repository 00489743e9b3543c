//! Points of a scene file that follow the tissue: tumours, vessels, targets.

use serde::Deserialize;
use supple::points::VecPoints;
use toml::Spanned;

use super::body::Body;
use super::file::SceneFile;
use crate::problem::Problem;

/// A `[[point]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointTable {
    name: Spanned<String>,
    at: Spanned<[f64; 3]>,
    pub(super) gravity: Option<Spanned<[f32; 3]>>,
}

/// The points of a scene.
#[derive(Clone, Debug, Default)]
pub struct ScenePoints {
    pub(crate) names: Vec<String>,
    /// None without points.
    pub(crate) followed: Option<VecPoints>,
}

impl ScenePoints {
    pub(crate) fn read(file: &SceneFile, body: &Body) -> Result<Self, Problem> {
        let tables = &file.scene.point;
        if tables.is_empty() {
            return Ok(Self::default());
        }
        let (mut names, mut places) = (vec![], vec![]);
        for at in tables {
            let PointTable { name, at: place, .. } = at.get_ref();
            let text = name.get_ref();
            if text.is_empty() || text.contains([',', '"', '\n', '\r']) {
                return Err(file.problem(
                    name,
                    format!("name {text:?}: it must not be empty, nor hold a comma, quote or line break"),
                ));
            }
            if names.contains(text) {
                return Err(file.problem(name, format!("two points are named {text:?}")));
            }
            if let Some(component) = place.get_ref().iter().find(|component| !component.is_finite()) {
                return Err(file.problem(place, format!("at holds {component}")));
            }
            names.push(text.clone());
            places.push(body.local_point(*place.get_ref()));
        }
        let followed = VecPoints::locate(&body.checked()?, &places).map_err(Problem::of)?;
        Ok(Self { names, followed: Some(followed) })
    }

    /// What is outside the mesh and how far, with the place of its entry.
    pub(crate) fn warnings(&self, file: &SceneFile) -> Vec<String> {
        let points = self.followed.as_ref().map_or(&[][..], VecPoints::points);
        let entries =
            file.scene.point.iter().zip(&self.names).zip(points).filter(|(_, point)| is_outside(point.distance));
        let warning = |((at, name), distance): ((&Spanned<PointTable>, &String), f32)| {
            let message =
                format!("point {name:?} is {:.2} mm outside the mesh: it follows the nearest point", 1e3 * distance);
            file.problem(at, message).to_string()
        };
        entries.map(|(entry, point)| warning((entry, point.distance))).collect()
    }
}

/// Whether a point at this distance (m) from the mesh is outside it: one on the surface may be by rounding.
pub(super) fn is_outside(distance: f32) -> bool {
    const ROUNDING: f32 = 5e-6;
    distance > ROUNDING
}
