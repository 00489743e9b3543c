//! `supple inspect`: what a mesh, a scene or a network is like, before any time passes.

mod cost;
mod doubling;
mod learned_cost;
mod mesh;
mod network;
mod times;

use std::path::Path;

use supple::mesh::Winding;

use self::doubling::Pilots;
use crate::problem::Problem;
use crate::scene::body::Body;
use crate::scene::file::SceneFile;
use crate::scene::plausible::size_remark;
use crate::scene::setup::Setup;
use crate::screen::output;
use crate::weight_file::is_weights;

/// Looks at a file; `accuracy` (mm) asks for a step of a scene that keeps it.
pub(crate) fn inspect(path: &Path, accuracy: Option<f64>) -> Result<(), Problem> {
    if let Some(accuracy) = accuracy
        && !(accuracy.is_finite() && accuracy > 0.0)
    {
        return Err(Problem(format!("--accuracy is {accuracy} mm, it must be a positive number")));
    }
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        let file = SceneFile::read(path)?;
        let setup = Setup::read(&file)?;
        mesh::describe(&setup.body)?;
        for warning in &setup.warnings {
            output!("warning: {warning}");
        }
        let pilots = Pilots::new(Setup::with_body(&file, setup.body.clone())?);
        return cost::describe(&setup, pilots, accuracy);
    }
    let is_weights = is_weights(path);
    if accuracy.is_some() {
        let kind = if is_weights { "network" } else { "mesh" };
        let message = format!("--accuracy recommends a step for a scene (.toml), this is a {kind}");
        return Err(Problem::in_file(path, message));
    }
    if is_weights {
        return network::inspect(path);
    }
    let body = Body::read(path, 1.0, Winding::Checked)?;
    if let Some(remark) = body.unused_remark() {
        output!("warning: {remark}");
    }
    mesh::describe(&body)?;
    if let Some(remark) = size_remark(&body) {
        output!("warning: {}", Problem::in_file(path, remark));
    }
    Ok(())
}
