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

/// How many times as long as the simulation a ramp or a path may take: the beginning of one may be all that is asked for.
const MOST_SPANS: f64 = 50.0;
/// Share of the body's diagonal beyond which a length keeps no error small.
const MOST_TOLERANCE: f64 = 0.1;

/// A ramp or a path that the simulation sees little of.
pub(crate) fn late(file: &SceneFile, what: &str, until: f64) -> Option<String> {
    let end = *file.scene.time.get_ref().end.get_ref();
    (until > MOST_SPANS * end)
        .then(|| format!("{what} goes on to {until} s, and the simulation ends at {end} s (1 ms is 0.001 s)"))
}

/// Ramps that the simulation sees little of, and errors as large as the body: one of each kind.
fn of_time(file: &SceneFile, body: &Body) -> Vec<Problem> {
    let (scene, time, diagonal) = (&file.scene, file.scene.time.get_ref(), body.diagonal());
    let forces = scene.force.iter().filter_map(|at| at.get_ref().ramp.as_ref());
    let motions = scene.motion.iter().filter_map(|at| at.get_ref().ramp.as_ref());
    let tractions = scene.traction.iter().filter_map(|at| at.get_ref().ramp.as_ref());
    let pressures = scene.pressure.iter().filter_map(|at| at.get_ref().ramp.as_ref());
    let mut ramps = forces.chain(motions).chain(tractions).chain(pressures);
    let late = ramps.find_map(|at| Some(file.problem(at, late(file, "a ramp", f64::from(*at.get_ref()))?)));
    let lengths = [("tolerance", &time.tolerance), ("settle", &time.settle)].into_iter();
    let large = lengths.filter_map(|(name, at)| {
        let (at, metre) = at.as_ref().map(|at| (at, *at.get_ref()))?;
        let message = format!("{name} is {metre} m, the body is {diagonal:.3} m across (1 mm is 0.001 m)");
        (f64::from(metre) > MOST_TOLERANCE * diagonal).then(|| file.problem(at, message))
    });
    late.into_iter().chain(large).collect()
}

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
    let of_time = of_time(file, body);
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
