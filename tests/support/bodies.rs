//! Bodies to simulate, from a single tetrahedron to the meshes of a lobe and a cylinder. Metres.

use std::path::Path;

use supple::loads::NodalForce;
use supple::material::{AnyLaw, Material, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{Support, VecScene};

use crate::reference::{self, Random};

/// A mesh that owns its nodes and elements.
#[derive(Clone, Debug)]
pub struct Body {
    pub points: Vec<[f32; 3]>,
    pub tets: Vec<[u32; 4]>,
}

impl Body {
    /// One tetrahedron without symmetry, of about 1 cm.
    pub fn tetrahedron() -> Self {
        Self {
            points: vec![[0.0, 0.0, 0.0], [0.011, 0.001, 0.0], [0.002, 0.009, -0.001], [0.001, 0.003, 0.012]],
            tets: vec![[0, 1, 2, 3]],
        }
    }

    /// The regular bar.
    pub fn bar(size: [f32; 3], cells: [u32; 3]) -> Self {
        let bar = Bar { size, cells };
        Self { points: bar.points().collect(), tets: bar.tets().collect() }
    }

    /// The paper's bar.
    pub fn paper() -> Self {
        let Bar { size, cells } = Bar::PAPER;
        Self::bar(size, cells)
    }

    /// A bar whose layers grow along z (by `(k / n)^1.5`) and whose nodes are shaken by up to 18 % of a cell;
    /// nodes of the six faces stay in them. Elements come in random order.
    pub fn irregular(size: [f32; 3], cells: [u32; 3]) -> Self {
        let mut body = Self::bar(size, cells);
        let mut random = Random(17);
        for point in &mut body.points {
            for axis in 0..3 {
                let share = f64::from(point[axis] / size[axis]);
                let cell = 1.0 / f64::from(cells[axis]);
                let inside = share > 0.5 * cell && share < 1.0 - 0.5 * cell;
                let shaken = share + if inside { 0.18 * cell * random.next() } else { 0.0 };
                let graded = if axis == 2 { shaken.powf(1.5) } else { shaken };
                point[axis] = (f64::from(size[axis]) * graded) as f32;
            }
        }
        for i in (1..body.tets.len()).rev() {
            let j = (random.next().abs() * (i + 1) as f64) as usize;
            body.tets.swap(i, j.min(i));
        }
        body
    }

    /// A regular bar of 4 x 4 x 6 cells with nodes at odd places moved towards one face of the elements
    /// around them, which leaves eleven or more slivers with a thousandth of a regular element's volume.
    pub fn slivers(size: [f32; 3]) -> Self {
        let bar = Bar { size, cells: [4, 4, 6] };
        let mut body = Self::bar(size, bar.cells);
        for (i, j, k) in
            [1, 3].into_iter().flat_map(|i| [1, 3].into_iter().flat_map(move |j| [1, 3, 5].map(move |k| (i, j, k))))
        {
            let node = bar.node(i, j, k);
            let around: Vec<_> = body.tets.iter().filter(|tet| tet.contains(&node)).collect();
            let tet = around[(5 * i + 3 * j + k) as usize % around.len()];
            let face: Vec<_> = tet.iter().filter(|&&other| other != node).collect();
            for axis in 0..3 {
                let middle: f32 = face.iter().map(|&&other| body.points[other as usize][axis]).sum::<f32>() / 3.0;
                let at = &mut body.points[node as usize][axis];
                *at = middle + 1e-3 * (*at - middle);
            }
        }
        body
    }

    /// `meshes/lobe.msh`, a liver lobe of about 15 cm.
    pub fn lobe() -> Self {
        Self::gmsh("lobe.msh")
    }

    /// `meshes/cylinder.msh`.
    pub fn cylinder() -> Self {
        Self::gmsh("cylinder.msh")
    }

    /// Nodes and tetrahedra of an ASCII Gmsh 2.2 file in `meshes/`, which numbers nodes from 1 without gaps.
    fn gmsh(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(name);
        let text = std::fs::read_to_string(path).expect(name);
        let section = |name: &str| {
            let (_, rest) = text.split_once(&format!("${name}\n")).expect(name);
            rest.split_once("\n$End").expect(name).0.lines().skip(1)
        };
        let points = section("Nodes").map(|line| {
            let mut words = line.split_whitespace().skip(1);
            [(); 3].map(|()| words.next().unwrap().parse().unwrap())
        });
        let tets = section("Elements").filter_map(|line| {
            let words: Vec<u32> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
            let nodes = words.get(3 + words[2] as usize..)?;
            (words[1] == 4).then(|| [0, 1, 2, 3].map(|corner| nodes[corner] - 1))
        });
        let mut body = Self { points: points.collect(), tets: tets.collect() };
        body.tets = body.mesh().tets().collect();
        body
    }

    /// The mesh as the kernel takes it.
    pub fn mesh(&self) -> Mesh<'_> {
        Mesh::new(&self.points, &self.tets, Winding::Normalised).unwrap()
    }

    /// The same coordinates in float64.
    pub fn reference(&self) -> reference::Mesh {
        reference::Mesh {
            points: super::widened(&self.points),
            tets: self.tets.iter().map(|tet| tet.map(|node| node as usize)).collect(),
        }
    }

    /// A scene of this body. Of whatever type the material is, the steps are compiled once.
    pub fn scene<M: Material<Law: Into<AnyLaw>>>(&self, material: M, supports: &[Support]) -> VecScene<VecMaterial> {
        VecScene::build(super::at_run_time(&material), &self.mesh(), supports).unwrap()
    }

    /// Nodes whose position at rest satisfies the condition.
    pub fn nodes_where(&self, condition: impl Fn([f32; 3]) -> bool) -> Vec<u32> {
        (0..self.points.len() as u32).filter(|&node| condition(self.points[node as usize])).collect()
    }

    /// Smallest and largest coordinate along an axis.
    pub fn extent(&self, axis: usize) -> (f32, f32) {
        let along = self.points.iter().map(|point| point[axis]);
        let widen = |(low, high): (f32, f32), x: f32| (low.min(x), high.max(x));
        along.fold((f32::INFINITY, f32::NEG_INFINITY), widen)
    }

    /// The node with the greatest coordinate along an axis.
    pub fn farthest(&self, axis: usize) -> u32 {
        let (_, high) = self.extent(axis);
        self.nodes_where(|x| x[axis] == high)[0]
    }

    /// Displacements of the homogeneous deformation `x = F X + shift`, rounded to float32.
    pub fn affine(&self, f: &reference::Mat3, shift: [f64; 3]) -> Vec<[f32; 3]> {
        let u = self.reference().affine(f);
        let shifted = u.iter().map(|u| [0, 1, 2].map(|axis| u[axis] + shift[axis]));
        super::to_f32(&shifted.collect::<Vec<_>>())
    }

    /// Nodes of the surface: corners of faces that belong to one element only.
    pub fn surface_nodes(&self) -> Vec<bool> {
        let mut on_surface = vec![false; self.points.len()];
        for [a, b, c] in self.surface() {
            for node in [a, b, c] {
                on_surface[node as usize] = true;
            }
        }
        on_surface
    }

    /// Triangles of the surface, wound outwards.
    pub fn surface(&self) -> Vec<[u32; 3]> {
        let mut faces = std::collections::BTreeMap::new();
        for &[a, b, c, d] in &self.tets {
            for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
                let mut key = face;
                key.sort_unstable();
                faces.entry(key).or_insert_with(Vec::new).push(face);
            }
        }
        let single = faces.values().filter(|faces| faces.len() == 1);
        single.map(|faces| faces[0]).collect()
    }
}

/// An irregular bar of 2 x 2 x 4 cm, 270 elements.
pub fn small_bar() -> Body {
    Body::irregular([0.02, 0.02, 0.04], [3, 3, 5])
}

/// The nodes of the end with the largest z.
pub fn far_end(body: &Body) -> Vec<u32> {
    let (_, high) = body.extent(2);
    body.nodes_where(|x| x[2] == high)
}

/// Supports that fix the end at z = 0.
pub fn held(body: &Body) -> Vec<Support> {
    super::fixed(&body.nodes_where(|x| x[2] == 0.0))
}

/// Forces of `newton` on each node of the far end, about the axis of the bar.
pub fn torsion(body: &Body, newton: f32, ramp: f32) -> Vec<NodalForce> {
    let middle = [0, 1].map(|axis| {
        let (low, high) = body.extent(axis);
        0.5 * (low + high)
    });
    let nodes = far_end(body).into_iter();
    nodes
        .map(|node| {
            let [x, y, _] = body.points[node as usize];
            let (x, y) = (x - middle[0], y - middle[1]);
            let length = (x * x + y * y).sqrt().max(1e-6);
            let newton = [-newton * y / length, newton * x / length, 0.0];
            NodalForce { node, newton, ramp }
        })
        .collect()
}

/// The paper's torsion: forces on the four corners of the far end, of `newton` along x and along y.
pub fn corner_torsion(body: &Body, newton: f32, ramp: f32) -> Vec<NodalForce> {
    let ends = [0, 1].map(|axis| body.extent(axis));
    let corners = far_end(body).into_iter().filter_map(|node| {
        let [x, y, _] = body.points[node as usize];
        let side = |x: f32, (low, high): (f32, f32)| {
            if x == low { Some(-1.0) } else { (x == high).then_some(1.0) }
        };
        let (x, y) = (side(x, ends[0])?, side(y, ends[1])?);
        let newton = [-newton * y, newton * x, 0.0];
        Some(NodalForce { node, newton, ramp })
    });
    corners.collect()
}
