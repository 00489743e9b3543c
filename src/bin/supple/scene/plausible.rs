//! Remarks of [`supple::plausibility`] on a scene file, with the place of what looks as if a unit was mistaken. The
//! scene is computed all the same.

use supple::element::Axes;
use supple::loads::{Motion, NodalForce};
use supple::plausibility::{Proportions, of_gravity, of_mass, of_size, of_supports, of_tissue};
use supple::scene::Support;

use super::body::Body;
use super::file::SceneFile;
use super::tissues::Tissues;
use crate::problem::Problem;

/// What does not look right in the size of a mesh, and the remedy.
pub(crate) fn size_remark(body: &Body) -> Option<String> {
    let remark = of_size(body.diagonal())?;
    Some(format!("{remark}; scale = 0.001 under [mesh] turns millimetres into metres"))
}

/// What does not look right.
pub(crate) fn warnings(
    file: &SceneFile,
    body: &Body,
    tissues: &Tissues,
    gravity: [f32; 3],
    supports: &[Support],
    forces: &[NodalForce],
) -> Vec<String> {
    let scene = &file.scene;
    let proportions = Proportions::of_tissues(body.diagonal(), body.volumes().sum(), tissues.of_regions());
    let of_mass = of_mass(tissues.mass(body)).map(|remark| remark.to_string());
    let of_mesh = size_remark(body).into_iter().chain(of_mass).map(|remark| file.problem(&scene.mesh, remark));
    let of_tissues = tissues.of_regions().flat_map(|(density, moduli)| of_tissue(density, &moduli));
    let of_tissues = of_tissues.map(|remark| file.problem(&scene.material, remark));
    let of_motions = scene.motion.iter().filter_map(|at| {
        let entry = at.get_ref();
        let ramp = entry.ramp.as_ref().map_or(0.0, |ramp| *ramp.get_ref());
        let motion = Motion { node: 0, axes: Axes::XYZ, metre: *entry.metre.get_ref(), ramp };
        let remark = proportions.of_motion(&motion).or_else(|| proportions.of_jump(&motion))?;
        Some(file.problem(at, remark))
    });
    let mut held = vec![false; body.local.len()];
    for support in supports {
        held[support.node as usize] = true;
    }
    let elements = body.mesh.tets.iter().map(|tet| tet.map(|node| node as usize));
    let of_supports = of_supports(elements, |node| held.get(node) == Some(&true));
    let of_others = of_gravity(gravity).into_iter().chain(of_supports).chain(proportions.of_forces(forces));
    let of_others = of_others.map(|remark| Problem::in_file(file.path(), remark));
    of_mesh
        .chain(of_tissues)
        .chain(of_others)
        .chain(of_motions)
        .chain(of_time)
        .map(|problem| problem.to_string())
        .collect()
}

/// A part of the mesh that shares no node with the others and that nothing holds, next to one that is held: meshes that were
/// put together and whose nodes were not merged.
pub(crate) fn loose_part(file: &SceneFile, body: &Body, held: impl Iterator<Item = u32>) -> Option<String> {
    let part = body.parts();
    let mut holds = vec![false; part.len()];
    for node in held {
        holds[part[node as usize] as usize] = true;
    }
    let mut nodes = vec![0_usize; part.len()];
    for &least in &part {
        nodes[least as usize] += 1;
    }
    let parts: Vec<_> = nodes.into_iter().zip(holds).filter(|(nodes, _)| *nodes > 0).collect();
    let loose: Vec<_> = parts.iter().filter(|(_, holds)| !holds).map(|(nodes, _)| *nodes).collect();
    let (all, loose, largest) = (parts.len(), loose.len(), loose.iter().max()?);
    (loose < all).then(|| {
        let message = format!(
            "the mesh has {all} parts that share no node, and nothing holds {loose} of them, of up to {largest} nodes; merge \
             nodes that lie on each other, if they belong together"
        );
        file.problem(&file.scene.mesh, message).to_string()
    })
}
