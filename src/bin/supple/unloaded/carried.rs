//! What a scene file finds by place is something else on the mesh without loads. The search has found it on the image;
//! here the mesh is given what scenes need to name it, and what to write into them is told.

use supple::io::{CellVectors, TetMesh};
use toml::Spanned;

use crate::problem::Problem;
use crate::scene::body::Body;
use crate::scene::file::SceneFile;
use crate::scene::select::select;
use crate::scene::setup::Setup;
use crate::scene::tissues::elements_of_region;

/// Vectors for the directions of a wall.
const WALL: [&str; 2] = ["wall_fibre", "wall_sheet"];

/// The mesh with its nodes at these points (m), and what to change in the scene file for it.
pub(super) fn mesh_without_loads(
    file: &SceneFile,
    image: &Setup,
    points: &[[f64; 3]],
) -> Result<(TetMesh, Vec<String>), Problem> {
    let found = Body { found_at: None, ..image.body.moved_to(points) };
    let mut remedies = other_nodes(file, &image.body, &found)?;
    let mut mesh = found.mesh.clone();
    let mut tag = mesh.regions.iter().copied().fold(0, i32::max);
    for (index, at) in (1..).zip(&file.scene.region) {
        if elements_of_region(file, at, &found).ok() == Some(elements_of_region(file, at, &image.body)?) {
            continue;
        }
        tag += 1;
        mesh.regions.resize(mesh.tets.len(), 0);
        image.tissues.elements_of(index).for_each(|element| mesh.regions[element] = tag);
        let remedy = "on the mesh without loads its box or plane has other elements";
        remedies.push(file.problem(at, format!("{remedy}; write tags = [{tag}] in its place")).to_string());
    }
    if let Some(at) = file.scene.directions.as_ref().filter(|at| at.get_ref().are_of_a_wall()) {
        let directions = image.tissues.directions();
        let vector = |vector: &[f32; 3]| vector.map(f64::from);
        let fibres = directions.iter().map(|directions| vector(&directions.fibre)).collect();
        let sheets = directions.iter().map(|directions| vector(&directions.sheet)).collect();
        let named = WALL.into_iter().zip([fibres, sheets]);
        mesh.vectors.retain(|vectors| !WALL.contains(&&vectors.name[..]));
        mesh.vectors.extend(named.map(|(name, values)| CellVectors { name: name.into(), values }));
        let [fibre, sheet] = WALL;
        let remedy = format!(
            "by the mesh without loads its fibres would have other directions; write fibre = \"{fibre}\" and sheet = \"{sheet}\" in place \
             of axis, through and helix"
        );
        remedies.push(file.problem(at, remedy).to_string());
    }
    Ok((mesh, remedies))
}

/// Boxes and planes that select other nodes there, and the nodes that they should.
fn other_nodes(file: &SceneFile, image: &Body, found: &Body) -> Result<Vec<String>, Problem> {
    let mut remedies = vec![];
    for (span, selection) in file.selections() {
        let at = Spanned::new(span, ());
        let nodes = select(file, &at, &selection, image)?;
        if select(file, &at, &selection, found).is_ok_and(|there| there == nodes) {
            continue;
        }
        let remedy = "on the mesh without loads its box or plane has other nodes";
        remedies.push(file.problem(&at, format!("{remedy}; write nodes = {nodes:?} in its place")).to_string());
    }
    Ok(remedies)
}
