//! The mesh of a scene: read or made, scaled to metres, checked, with its boundary.

use std::path::Path;

use supple::io::{self, TetMesh};
use supple::mesh::{Bar, Mesh, MeshError, Winding, boundary};
use toml::Spanned;

use super::file::{MeshTable, SceneFile};
use crate::problem::Problem;

/// A mesh in metres, and what the kernel sees of it.
#[derive(Clone)]
pub struct Body {
    pub(crate) mesh: TetMesh,
    /// Where boxes, planes and walls find the nodes (m), if not where they are.
    pub(crate) found_at: Option<Vec<[f64; 3]>>,
    /// Coordinates less `centre`, which float32 holds better than the corner of a room.
    pub(crate) local: Vec<[f32; 3]>,
    /// m.
    pub(crate) centre: [f64; 3],
    pub(crate) winding: Winding,
    pub(crate) name: String,
    /// Nodes of the file that belong to no element and are left out, in its numbers.
    pub(crate) unused: Vec<usize>,
}

fn relative(point: [f64; 3], centre: [f64; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| (point[axis] - centre[axis]) as f32)
}

impl Body {
    pub(crate) fn read(path: &Path, scale: f64, winding: Winding) -> Result<Self, Problem> {
        let mut mesh = io::read_mesh(path).map_err(Problem::of)?;
        for point in &mut mesh.points {
            *point = point.map(|component| component * scale);
        }
        let unused = leave_out_unused(&mut mesh);
        Ok(Self { unused, ..Self::new(mesh, winding, path.display().to_string()) })
    }

    pub(crate) fn new(mesh: TetMesh, winding: Winding, name: String) -> Self {
        let (low, high) = extent(&mesh.points);
        let centre = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
        let local = mesh.points.iter().map(|&point| relative(point, centre)).collect();
        Self { mesh, found_at: None, local, centre, winding, name, unused: vec![] }
    }

    /// The same body with its nodes elsewhere (m), about the same centre. Boxes, planes and walls find them where they were.
    pub(crate) fn moved_to(&self, points: &[[f64; 3]]) -> Self {
        let mut moved = self.clone();
        moved.local = points.iter().map(|&point| self.local_point(point)).collect();
        moved.found_at = Some(std::mem::replace(&mut moved.mesh.points, points.to_vec()));
        moved
    }

    /// Where boxes, planes and walls find the nodes, m.
    pub(crate) fn places(&self) -> &[[f64; 3]] {
        self.found_at.as_ref().unwrap_or(&self.mesh.points)
    }

    /// Coordinates less the centre, m.
    pub(crate) fn local_point(&self, point: [f64; 3]) -> [f32; 3] {
        relative(point, self.centre)
    }

    fn bar(bar: Bar) -> Self {
        // Without the noise of float32, for the people who read the files; far below it in size.
        let clean = |component: f32| (f64::from(component) * 1e9).round() / 1e9;
        let points = bar.points().map(|point| point.map(clean)).collect();
        let mesh = TetMesh { points, tets: bar.tets().collect(), triangles: vec![], regions: vec![], vectors: vec![] };
        Self::new(mesh, Winding::Checked, "bar".into())
    }

    /// The checked mesh.
    pub fn checked(&self) -> Result<Mesh<'_>, Problem> {
        Mesh::new(&self.local, &self.mesh.tets, self.winding).map_err(|error| self.mesh_problem(error))
    }

    pub(crate) fn mesh_problem(&self, error: MeshError) -> Problem {
        let advice = match error {
            MeshError::Inverted { .. } => {
                let volumes = self.mesh.tets.iter().map(|tet| volume(tet.map(|n| self.mesh.points[n as usize])));
                let negative = volumes.filter(|volume| *volume < 0.0).count();
                format!(
                    "; {negative} of {} elements have negative volume; winding = \"normalise\" under [mesh] turns them",
                    self.mesh.tets.len()
                )
            }
            _ => String::new(),
        };
        Problem(format!("{}: {error}{advice}", self.name))
    }

    /// What there is to say of nodes that are left out.
    pub(crate) fn unused_remark(&self) -> Option<String> {
        let first = self.unused.first()?;
        Some(format!(
            "{}: nodes that belong to no element are left out: {}, the first is {first}; results number the others without them",
            self.name,
            self.unused.len()
        ))
    }

    pub(crate) fn diagonal(&self) -> f64 {
        diagonal(&self.mesh.points)
    }

    /// Of each element, m^3, whichever way it is turned.
    pub(crate) fn volumes(&self) -> impl Iterator<Item = f64> {
        self.mesh.tets.iter().map(|tet| volume(tet.map(|node| self.mesh.points[node as usize])).abs())
    }

    /// Area of the boundary at each node (m^2): a third of those triangles whose nodes are all chosen.
    pub(crate) fn areas(&self, chosen: impl Fn(u32) -> bool) -> Vec<f64> {
        let mut areas = vec![0.0; self.local.len()];
        for triangle in self.boundary().into_iter().filter(|triangle| triangle.iter().all(|&node| chosen(node))) {
            let [a, b, c] = triangle.map(|node| self.mesh.points[node as usize]);
            let edge = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
            let (u, v) = (edge(b), edge(c));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let area = 0.5 * normal.iter().map(|component| component * component).sum::<f64>().sqrt();
            triangle.iter().for_each(|&node| areas[node as usize] += area / 3.0);
        }
        areas
    }

    /// Of the tissue of each node, a quarter of its elements, m^3.
    pub(crate) fn node_volumes(&self) -> Vec<f32> {
        let mut volumes = vec![0.0; self.local.len()];
        for (tet, volume) in self.mesh.tets.iter().zip(self.volumes()) {
            tet.iter().for_each(|&node| volumes[node as usize] += (0.25 * volume) as f32);
        }
        volumes
    }

    /// For each node the least one of the part of the mesh that it hangs together with.
    pub(crate) fn parts(&self) -> Vec<u32> {
        // Each node's way to the least node of its part.
        let mut towards: Vec<u32> = (0..self.local.len() as u32).collect();
        let root = |towards: &mut Vec<u32>, mut node: u32| {
            while towards[node as usize] != node {
                towards[node as usize] = towards[towards[node as usize] as usize];
                node = towards[node as usize];
            }
            node
        };
        for &[first, ref others @ ..] in &self.mesh.tets {
            for &other in others {
                let [a, b] = [first, other].map(|node| root(&mut towards, node));
                towards[a.max(b) as usize] = a.min(b);
            }
        }
        (0..towards.len() as u32).map(|node| root(&mut towards, node)).collect()
    }

    /// Triangles that belong to one element only.
    pub(crate) fn boundary(&self) -> Vec<[u32; 3]> {
        boundary(self.mesh.tets.iter().copied())
    }
}

/// Removes the points that belong to no tetrahedron, and the triangles, which a body has no use for. Gives their numbers.
fn leave_out_unused(mesh: &mut TetMesh) -> Vec<usize> {
    let mut numbers = vec![None; mesh.points.len()];
    mesh.tets.as_flattened().iter().for_each(|&node| numbers[node as usize] = Some(0));
    let unused: Vec<usize> = (0..numbers.len()).filter(|&node| numbers[node].is_none()).collect();
    if !unused.is_empty() {
        numbers.iter_mut().flatten().zip(0..).for_each(|(number, new)| *number = new);
        let mut is_used = numbers.iter().map(Option::is_some);
        mesh.points.retain(|_| is_used.next() == Some(true));
        mesh.tets.as_flattened_mut().iter_mut().for_each(|node| *node = numbers[*node as usize].unwrap_or_default());
        mesh.triangles.clear();
    }
    unused
}

/// Signed volume of a tetrahedron, m^3.
pub(crate) fn volume([a, b, c, d]: [[f64; 3]; 4]) -> f64 {
    let edge = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let (u, v, w) = (edge(b), edge(c), edge(d));
    (u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6.0
}

/// Least and largest coordinates.
pub(crate) fn extent(points: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let mut range = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in points {
        for axis in 0..3 {
            range.0[axis] = range.0[axis].min(point[axis]);
            range.1[axis] = range.1[axis].max(point[axis]);
        }
    }
    range
}

/// Of the box around points.
pub(super) fn diagonal(points: &[[f64; 3]]) -> f64 {
    let (low, high) = extent(points);
    (0..3).map(|axis| (high[axis] - low[axis]).powi(2)).sum::<f64>().sqrt()
}

pub(crate) fn read_body(file: &SceneFile, at: &Spanned<MeshTable>) -> Result<Body, Problem> {
    let table = at.get_ref();
    let winding = match table.winding.as_ref().map(|winding| (winding, winding.get_ref().as_str())) {
        None | Some((_, "checked")) => Winding::Checked,
        Some((_, "normalise")) => Winding::Normalised,
        Some((at, other)) => {
            return Err(
                file.problem(at, format!("winding \"{other}\" is not known; \"checked\" and \"normalise\" are"))
            );
        }
    };
    let scale = table.scale.as_ref().map_or(1.0, |scale| *scale.get_ref());
    if let Some(at) = &table.scale
        && !(scale.is_finite() && scale > 0.0)
    {
        return Err(file.problem(at, format!("scale is {scale}, it must be a positive number")));
    }
    match (&table.file, &table.shape) {
        (Some(path), None) => {
            let body = Body::read(&file.resolve(path.get_ref()), scale, winding)
                .map_err(|problem| file.problem(path, problem))?;
            let last_named = file.named_nodes().max();
            if let Some(node) =
                body.unused.first().filter(|first| last_named.is_some_and(|last| last as usize >= **first))
            {
                let message = format!(
                    "{}: node {node} belongs to no element; remove it from the mesh: without it the numbers in nodes = [...] are those of \
                     others",
                    body.name
                );
                return Err(file.problem(path, message));
            }
            body.checked().map_err(|problem| file.problem(path, problem))?;
            Ok(body)
        }
        (None, Some(shape)) if shape.get_ref() == "bar" => {
            let (Some(size), Some(cells)) = (&table.size, &table.cells) else {
                return Err(file.problem(shape, "a bar needs size = [x, y, z] in m and cells = [x, y, z]"));
            };
            let bar =
                Bar { size: size.get_ref().map(|edge| (f64::from(edge) * scale) as f32), cells: *cells.get_ref() };
            if let Some(edge) = bar.size.iter().find(|edge| !(edge.is_finite() && **edge > 0.0)) {
                return Err(file.problem(size, format!("size holds {edge} m, edges must be positive")));
            }
            if bar.cells.contains(&0) || bar.element_count() > 100_000_000 {
                return Err(file.problem(
                    cells,
                    format!("cells are {:?}: at least 1 along each axis, and at most 1e8 tetrahedra", bar.cells),
                ));
            }
            Ok(Body::bar(bar))
        }
        (None, Some(shape)) => {
            Err(file.problem(shape, format!("shape \"{}\" is not known; \"bar\" is", shape.get_ref())))
        }
        (Some(_), Some(shape)) => Err(file.problem(shape, "[mesh] has both a file and a shape; give one")),
        (None, None) => Err(file.problem(at, "[mesh] needs a file or a shape")),
    }
}
