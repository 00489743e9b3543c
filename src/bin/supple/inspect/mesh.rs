//! What a mesh is like. One with faults is looked at in full: every kind of fault is counted and its first element or
//! node named.

use supple::io::TetMesh;
use supple::mesh::{DEGENERATE, Winding};

use crate::problem::Problem;
use crate::scene::body::{Body, extent, volume};
use crate::screen::row;

/// Prints what the mesh is like; an unusable one is a problem.
pub(crate) fn describe(body: &Body) -> Result<(), Problem> {
    let mesh = &body.mesh;
    row("mesh", &body.name);
    row("nodes", mesh.points.len());
    row("tetrahedra", mesh.tets.len());
    row("boundary triangles", body.boundary().len());
    let parts = body.parts().into_iter().zip(0..).filter(|(least, node)| least == node).count();
    if parts > 1 {
        row(
            "parts",
            format!("{parts} that share no node; merge nodes that lie on each other, if they belong together"),
        );
    }
    if !mesh.regions.is_empty() {
        row("region tags", region_tags(&mesh.regions));
    }
    let (low, high) = extent(&mesh.points);
    let size = [0, 1, 2].map(|axis| 1e3 * (high[axis] - low[axis]));
    row("size", format!("{:.3} x {:.3} x {:.3} mm, if one unit is a metre", size[0], size[1], size[2]));
    describe_elements(mesh);
    Faults::of(body).tell(body)
}

fn region_tags(regions: &[i32]) -> String {
    let mut tags = regions.to_vec();
    tags.sort_unstable();
    tags.dedup();
    let count = |tag: &i32| regions.iter().filter(|other| *other == tag).count();
    let counts = tags.iter().map(|tag| format!("{tag} ({} tetrahedra)", count(tag)));
    counts.collect::<Vec<_>>().join(", ")
}

fn describe_elements(mesh: &TetMesh) {
    let (mut total, mut ratios, mut shortest, mut longest) = (0.0, vec![], f64::INFINITY, 0.0f64);
    for tet in &mesh.tets {
        let corners = corners(mesh, tet);
        for edge in edges(corners) {
            (shortest, longest) = (shortest.min(edge), longest.max(edge));
        }
        let volume = volume(corners).abs();
        total += volume;
        ratios.push(radius_ratio(corners, volume));
    }
    ratios.sort_by(f64::total_cmp);
    row("volume", format!("{:.3} ml", total * 1e6));
    row("edges", format!("{:.3} to {:.3} mm", 1e3 * shortest, 1e3 * longest));
    row(
        "radius ratio",
        format!("least {:.3}, median {:.3} (1 is a regular tetrahedron)", ratios[0], ratios[ratios.len() / 2]),
    );
}

/// Kinds of fault: what, how many, the first.
#[derive(Default)]
struct Faults(Vec<(&'static str, &'static str, usize, String)>);

impl Faults {
    fn of(body: &Body) -> Self {
        let mesh = &body.mesh;
        let mut faults = Self::default();
        for (element, tet) in mesh.tets.iter().enumerate() {
            let corners = corners(mesh, tet);
            for (k, node) in tet.iter().enumerate() {
                if tet[..k].contains(node) {
                    faults.add("with a repeated node", "element", element, format!("node {node}"));
                }
            }
            let longest = edges(corners).into_iter().fold(0.0f64, f64::max);
            let volume = volume(corners);
            if volume.abs() < DEGENERATE * longest.powi(3) || volume == 0.0 || volume.is_nan() {
                faults.add("degenerate", "element", element, format!("volume {volume:.2e} m^3"));
            } else if volume < 0.0 && body.winding == Winding::Checked {
                faults.add("inverted", "element", element, format!("volume {volume:.2e} m^3"));
            }
        }
        for (node, point) in mesh.points.iter().enumerate() {
            if point.iter().any(|component| !component.is_finite()) {
                faults.add("not finite", "node", node, format!("{point:?}"));
            }
        }
        faults
    }

    fn add(&mut self, kind: &'static str, thing: &'static str, index: usize, value: String) {
        match self.0.iter_mut().find(|fault| fault.0 == kind) {
            Some(fault) => fault.2 += 1,
            None => self.0.push((kind, thing, 1, format!("{thing} {index} ({value})"))),
        }
    }

    fn tell(self, body: &Body) -> Result<(), Problem> {
        if self.0.is_empty() {
            row("verdict", "sound");
            return Ok(());
        }
        let said: Vec<_> = self
            .0
            .iter()
            .map(|(kind, thing, count, first)| {
                format!("{count} {thing}{} {kind}, first {first}", if *count > 1 { "s" } else { "" })
            })
            .collect();
        Err(Problem(format!("{}: not usable as it is: {}", body.name, said.join("; "))))
    }
}

fn corners(mesh: &TetMesh, tet: &[u32; 4]) -> [[f64; 3]; 4] {
    tet.map(|node| mesh.points[node as usize])
}

fn edges(corners: [[f64; 3]; 4]) -> [f64; 6] {
    [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
        .map(|(a, b)| (0..3).map(|axis| (corners[a][axis] - corners[b][axis]).powi(2)).sum::<f64>().sqrt())
}

/// Three times inscribed over circumscribed radius.
fn radius_ratio(corners: [[f64; 3]; 4], volume: f64) -> f64 {
    let area = |a: usize, b: usize, c: usize| {
        let side = |p: usize, q: usize| [0, 1, 2].map(|axis| corners[q][axis] - corners[p][axis]);
        let (u, v) = (side(a, b), side(a, c));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        0.5 * n.iter().map(|component| component * component).sum::<f64>().sqrt()
    };
    let surface = area(1, 2, 3) + area(0, 2, 3) + area(0, 1, 3) + area(0, 1, 2);
    // Circumscribed radius from products of opposite edges (Crelle).
    let [e01, e02, e03, e12, e13, e23] = edges(corners);
    let (p, q, r) = (e01 * e23, e02 * e13, e03 * e12);
    let product = (p + q + r) * (p + q - r) * (p - q + r) * (-p + q + r);
    if surface > 0.0 && product > 0.0 { 9.0 * volume / surface * 24.0 * volume / product.sqrt() } else { 0.0 }
}
