//! The plain scalar code that a person writes first: tetrahedron by tetrahedron, float32, `F = I + grad u`, `F^-T` by
//! its cofactors over `J`, `powf` and `exp` of the standard library. The measure of every faster path.

use supple::mesh::Mesh;

/// A law of the plain code, constants in Pa.
#[derive(Clone, Copy)]
pub(crate) enum Law {
    /// Isochoric neo-Hookean: c, d.
    NeoHookean(f32, f32),
    /// Isochoric exponential: a, b, d.
    Exponential(f32, f32, f32),
}

struct Element {
    nodes: [usize; 4],
    gradients: [[f32; 3]; 4],
    volume: f32,
}

/// A simulation in plain code.
pub(crate) struct Plain {
    elements: Vec<Element>,
    law: Law,
    mass: Vec<f32>,
    fixed: Vec<bool>,
    load: Vec<[f32; 3]>,
    /// Displacement, m.
    pub(crate) u: Vec<[f32; 3]>,
    du: Vec<[f32; 3]>,
    f: Vec<[f32; 3]>,
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Plain {
    /// Density in kg/m^3, nodal loads in N.
    pub(crate) fn new(mesh: &Mesh<'_>, law: Law, density: f32, fixed: &[u32], loads: &[(u32, [f32; 3])]) -> Self {
        let points = mesh.points();
        let mut mass = vec![0.0; points.len()];
        let elements = mesh
            .tets()
            .map(|tet| {
                let [x0, x1, x2, x3] = tet.map(|node| points[node as usize]);
                let edge = |a: [f32; 3]| [a[0] - x0[0], a[1] - x0[1], a[2] - x0[2]];
                let (a, b, c) = (edge(x1), edge(x2), edge(x3));
                let six = dot(a, cross(b, c));
                let mut gradients = [[0.0; 3]; 4];
                for (k, g) in [cross(b, c), cross(c, a), cross(a, b)].into_iter().enumerate() {
                    for axis in 0..3 {
                        gradients[k + 1][axis] = g[axis] / six;
                        gradients[0][axis] -= g[axis] / six;
                    }
                }
                for node in tet {
                    mass[node as usize] += density * six / 24.0;
                }
                Element { nodes: tet.map(|node| node as usize), gradients, volume: six / 6.0 }
            })
            .collect();
        let zero = vec![[0.0; 3]; points.len()];
        let mut load = zero.clone();
        for &(node, newton) in loads {
            load[node as usize] = newton;
        }
        let mut is_fixed = vec![false; points.len()];
        for &node in fixed {
            is_fixed[node as usize] = true;
        }
        Self { elements, law, mass, fixed: is_fixed, load, u: zero.clone(), du: zero.clone(), f: zero }
    }

    /// One step of `dt` s with damping `mu` 1/s, the loads times `factor`.
    pub(crate) fn step(&mut self, dt: f32, mu: f32, factor: f32) {
        for (f, load) in self.f.iter_mut().zip(&self.load) {
            *f = load.map(|component| factor * component);
        }
        for element in &self.elements {
            let mut def = [[1.0f32, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            for (node, gradient) in element.nodes.iter().zip(&element.gradients) {
                for i in 0..3 {
                    for j in 0..3 {
                        def[i][j] += self.u[*node][i] * gradient[j];
                    }
                }
            }
            let cof = [cross(def[1], def[2]), cross(def[2], def[0]), cross(def[0], def[1])];
            let det = dot(def[0], cof[0]);
            let i1 = dot(def[0], def[0]) + dot(def[1], def[1]) + dot(def[2], def[2]);
            let g = det.powf(-2.0 / 3.0);
            let (slope, d) = match self.law {
                Law::NeoHookean(c, d) => (c, d),
                Law::Exponential(a, b, d) => (0.5 * a * (b * (g * i1 - 3.0)).exp(), d),
            };
            let p1 = 2.0 * slope * g;
            let p2 = 2.0 * d * (det - 1.0) - p1 * i1 / (3.0 * det);
            for (node, gradient) in element.nodes.iter().zip(&element.gradients) {
                for i in 0..3 {
                    let mut sum = 0.0;
                    for j in 0..3 {
                        sum += (p1 * def[i][j] + p2 * cof[i][j]) * gradient[j];
                    }
                    self.f[*node][i] -= element.volume * sum;
                }
            }
        }
        let k = 0.5 * mu * dt;
        for node in 0..self.u.len() {
            if !self.fixed[node] {
                for i in 0..3 {
                    let push = dt * dt * self.f[node][i] / self.mass[node];
                    self.du[node][i] = ((1.0 - k) * self.du[node][i] + push) / (1.0 + k);
                    self.u[node][i] += self.du[node][i];
                }
            }
        }
    }
}
