//! Supports, forces, motions and tractions of a scene file.

use supple::loads::{Motion, NodalForce, traction};
use supple::mesh::boundary as boundary_of;
use supple::pressure::{SurfacePressure, VecPressure};
use supple::scene::{Axes, Support};
use toml::Spanned;

use super::body::Body;
use super::file::{SceneFile, Selection};
use super::select::select;
use crate::problem::Problem;

type Lists = (Vec<Support>, Vec<NodalForce>, Vec<Motion>, VecPressure);

pub(crate) fn read_loads(file: &SceneFile, body: &Body) -> Result<Lists, Problem> {
    let scene = &file.scene;
    let (mut supports, mut forces, mut motions) = (vec![], vec![], vec![]);
    // What holds each node along each axis, to be told where two do.
    let mut holders = vec![[""; 3]; body.local.len()];
    for at in &scene.fix {
        let axes = read_axes(file, at.get_ref().axes.as_ref())?;
        for node in select(file, at, &at.get_ref().selection(), body)? {
            supports.push(Support { node, axes, moves: false });
            (0..3).filter(|&axis| axes.has(axis)).for_each(|axis| holders[node as usize][axis] = "a [[fix]] holds");
        }
    }
    for at in &scene.motion {
        let axes = read_axes(file, at.get_ref().axes.as_ref())?;
        let metre = read_vector(file, "metre", &at.get_ref().metre)?;
        let ramp = read_ramp(file, at.get_ref().ramp.as_ref())?;
        for node in select(file, at, &at.get_ref().selection(), body)? {
            for axis in (0..3).filter(|&axis| axes.has(axis)) {
                let holder = core::mem::replace(&mut holders[node as usize][axis], "another [[move]] moves");
                if !holder.is_empty() {
                    let along = ["x", "y", "z"][axis];
                    let message = format!("{holder} node {node} along {along} already: leave it out of one of the two");
                    return Err(file.problem(at, message));
                }
            }
            supports.push(Support { node, axes, moves: true });
            motions.push(Motion { node, axes, metre, ramp });
        }
    }
    for at in &scene.force {
        let newton = read_vector(file, "newton", &at.get_ref().newton)?;
        let ramp = read_ramp(file, at.get_ref().ramp.as_ref())?;
        let nodes = select(file, at, &at.get_ref().selection(), body)?;
        forces.extend(nodes.into_iter().map(|node| NodalForce { node, newton, ramp }));
    }
    let boundary = if scene.traction.is_empty() { vec![] } else { body.boundary() };
    for at in &scene.traction {
        let pascal = read_vector(file, "pascal", &at.get_ref().pascal)?;
        let ramp = read_ramp(file, at.get_ref().ramp.as_ref())?;
        let triangles = select_triangles(file, at, "traction", &at.get_ref().selection(), (body, &boundary))?;
        for force in traction(&body.local, &triangles, pascal, ramp) {
            forces.push(force.map_err(|error| file.problem(at, error))?);
        }
    }
    let mut pressures = VecPressure::default();
    // Outward also where elements have been turned.
    let boundary = if scene.pressure.is_empty() { vec![] } else { boundary_of(body.checked()?.tets()) };
    for at in &scene.pressure {
        let pascal = *at.get_ref().pascal.get_ref();
        if !pascal.is_finite() {
            return Err(file.problem(&at.get_ref().pascal, format!("pascal is {pascal}")));
        }
        let ramp = read_ramp(file, at.get_ref().ramp.as_ref())?;
        let triangles = select_triangles(file, at, "pressure", &at.get_ref().selection(), (body, &boundary))?;
        let pressure = SurfacePressure::new(pascal, ramp);
        pressures.press(&body.local, &triangles, pressure).map_err(|error| file.problem(at, error))?;
    }
    Ok((supports, forces, motions, pressures))
}

/// Point masses (kg) with their nodes.
pub(crate) fn read_masses(file: &SceneFile, body: &Body) -> Result<Vec<(u32, f32)>, Problem> {
    let mut masses = vec![];
    for at in &file.scene.mass {
        let kilogram = *at.get_ref().kilogram.get_ref();
        if !(kilogram.is_finite() && kilogram > 0.0) {
            let message =
                format!("kilogram is {kilogram}, it must be a positive number; each selected node has so much");
            return Err(file.problem(&at.get_ref().kilogram, message));
        }
        let nodes = select(file, at, &at.get_ref().selection(), body)?;
        masses.extend(nodes.into_iter().map(|node| (node, kilogram)));
    }
    Ok(masses)
}

/// The triangles of the boundary with all three nodes selected.
fn select_triangles<T>(
    file: &SceneFile,
    at: &Spanned<T>,
    what: &str,
    selection: &Selection<'_>,
    (body, boundary): (&Body, &[[u32; 3]]),
) -> Result<Vec<[u32; 3]>, Problem> {
    let mut selected = vec![false; body.local.len()];
    for node in select(file, at, selection, body)? {
        selected[node as usize] = true;
    }
    let is_selected = |triangle: &&[u32; 3]| triangle.iter().all(|&node| selected[node as usize]);
    let triangles: Vec<_> = boundary.iter().filter(is_selected).copied().collect();
    if triangles.is_empty() {
        let text = format!("this {what} selects nodes, but no boundary triangle with all three of its nodes");
        return Err(file.problem(at, text));
    }
    Ok(triangles)
}

fn read_ramp(file: &SceneFile, ramp: Option<&Spanned<f32>>) -> Result<f32, Problem> {
    let Some(at) = ramp else {
        return Ok(0.0);
    };
    let ramp = *at.get_ref();
    if !(ramp.is_finite() && ramp >= 0.0) {
        return Err(file.problem(at, format!("ramp is {ramp} s, it must be zero or more")));
    }
    Ok(ramp)
}

fn read_vector(file: &SceneFile, name: &str, at: &Spanned<[f32; 3]>) -> Result<[f32; 3], Problem> {
    let vector = *at.get_ref();
    match vector.iter().find(|component| !component.is_finite()) {
        Some(component) => Err(file.problem(at, format!("{name} holds {component}"))),
        None => Ok(vector),
    }
}

fn read_axes(file: &SceneFile, axes: Option<&Spanned<String>>) -> Result<Axes, Problem> {
    let Some(at) = axes else {
        return Ok(Axes::XYZ);
    };
    let mut held = Axes::NONE;
    for letter in at.get_ref().chars() {
        held = held.union(match letter {
            'x' => Axes::X,
            'y' => Axes::Y,
            'z' => Axes::Z,
            other => {
                return Err(file.problem(at, format!("axes holds '{other}'; x, y and z may stand there")));
            }
        });
    }
    if held == Axes::NONE {
        return Err(file.problem(at, "axes is empty; x, y and z may stand there"));
    }
    Ok(held)
}
