//! Meshes of linear tetrahedra: shape function gradients, volumes, lumped mass, and the bar.
//!
//! `N_a` is 1 at node `a` of the element and 0 at the three others, so its gradient is constant.
//! Lengths in m.

use super::tensor::{IDENTITY, Mat3, Vec3, apply, determinant, difference, from_fn, inverse, transpose};

/// A tetrahedral mesh in its reference configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Node positions in m.
    pub points: Vec<Vec3>,
    /// Four node ids each, with `det [x1 - x0, x2 - x0, x3 - x0] > 0`.
    pub tets: Vec<[usize; 4]>,
}

/// What the forces of one element need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Node ids.
    pub nodes: [usize; 4],
    /// `grad N_a` for the four nodes, in 1/m.
    pub gradients: [Vec3; 4],
    /// Reference volume in m^3.
    pub volume: f64,
}

impl Element {
    /// `F = I + sum_a u_a (x) grad N_a`.
    pub fn deformation_gradient(&self, u: &[Vec3]) -> Mat3 {
        let h = self.displacement_gradient(u);
        from_fn(|i, j| IDENTITY[i][j] + h[i][j])
    }

    /// `H = sum_a u_a (x) grad N_a`.
    pub fn displacement_gradient(&self, u: &[Vec3]) -> Mat3 {
        from_fn(|i, j| (0..4).map(|a| u[self.nodes[a]][i] * self.gradients[a][j]).sum())
    }
}

impl Mesh {
    /// A box with one corner at the origin, `cells` hexahedra along its axes, each cut in six Kuhn tetrahedra
    /// that share the diagonal from the cell's corner (0,0,0) to (1,1,1). Node `(i, j, k)` has the id `i +
    /// (nx + 1) (j + (ny + 1) k)`.
    pub fn bar(size: Vec3, cells: [usize; 3]) -> Mesh {
        let [nx, ny, nz] = cells;
        let id = |n: [usize; 3]| n[0] + (nx + 1) * (n[1] + (ny + 1) * n[2]);
        let mut mesh = Mesh::default();
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    let n = [i, j, k];
                    mesh.points.push(std::array::from_fn(|axis| size[axis] * n[axis] as f64 / cells[axis] as f64));
                }
            }
        }
        // One tetrahedron per order of the axes: walk from (0,0,0) to (1,1,1) one axis at a time. The walks
        // in cyclic order (even permutations) have positive volume, the others get two nodes swapped.
        let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    for (index, order) in orders.iter().enumerate() {
                        let mut corner = [i, j, k];
                        let mut tet = [id(corner); 4];
                        for (step, axis) in order.iter().enumerate() {
                            corner[*axis] += 1;
                            tet[step + 1] = id(corner);
                        }
                        if index >= 3 {
                            tet.swap(1, 2);
                        }
                        mesh.tets.push(tet);
                    }
                }
            }
        }
        mesh
    }

    /// The paper's bar: 50 x 50 x 100 mm, 1458 nodes, 6528 tetrahedra.
    pub fn paper_bar() -> Mesh {
        Mesh::bar([0.05, 0.05, 0.1], [8, 8, 17])
    }

    /// Ids of the nodes whose reference position satisfies the condition.
    pub fn nodes_where(&self, condition: impl Fn(Vec3) -> bool) -> Vec<usize> {
        (0..self.points.len()).filter(|n| condition(self.points[*n])).collect()
    }

    /// Gradients and volumes of all elements.
    ///
    /// With `D = [x1 - x0, x2 - x0, x3 - x0]` (columns) the volume is `det D / 6`, `grad N_1..3` are the
    /// columns of `D^-T`, and `grad N_0` is minus their sum.
    pub fn elements(&self) -> Vec<Element> {
        self.tets.iter().map(|tet| self.element(*tet)).collect()
    }

    fn element(&self, nodes: [usize; 4]) -> Element {
        let x = nodes.map(|n| self.points[n]);
        let edges = [difference(x[1], x[0]), difference(x[2], x[0]), difference(x[3], x[0])];
        let d_inv_t = transpose(&inverse(&transpose(&edges)));
        let column = |c: usize| [d_inv_t[0][c], d_inv_t[1][c], d_inv_t[2][c]];
        let (g1, g2, g3) = (column(0), column(1), column(2));
        let g0 = std::array::from_fn(|i| -(g1[i] + g2[i] + g3[i]));
        Element { nodes, gradients: [g0, g1, g2, g3], volume: determinant(&edges) / 6.0 }
    }

    /// Element volumes in m^3.
    pub fn volumes(&self) -> Vec<f64> {
        self.elements().iter().map(|e| e.volume).collect()
    }

    /// Nodal masses in kg: a quarter of `rho V` of each element to each of its nodes.
    pub fn lumped_mass(&self, density: f64) -> Vec<f64> {
        let mut mass = vec![0.0; self.points.len()];
        for element in self.elements() {
            for node in element.nodes {
                mass[node] += density * element.volume / 4.0;
            }
        }
        mass
    }

    /// `F` of every element.
    pub fn deformation_gradients(&self, u: &[Vec3]) -> Vec<Mat3> {
        self.elements().iter().map(|e| e.deformation_gradient(u)).collect()
    }

    /// The displacement field of the homogeneous deformation `x = F X`.
    pub fn affine(&self, f: &Mat3) -> Vec<Vec3> {
        self.points.iter().map(|x| difference(apply(f, *x), *x)).collect()
    }
}
