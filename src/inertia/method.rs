//! The lattice and the damping of a long step, and the storage that it needs.

use crate::material::{Element, Material};
use crate::scene::SceneView;
use crate::simd::NodeVector;

use super::lattice::{self, Grid, Lattice, LatticeNode};
use super::layout::Layout;
use super::rough_motion::GAIN;
use super::{InertiaError, coarse_room, matrices, node_tables};

/// How to step beyond the critical step: smooth motion keeps its true inertia through a coarse lattice, and rough
/// motion, which the lattice cannot represent, is damped.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    pub(super) cells: Cells,
    pub(super) gain: f32,
}

/// Cells of a lattice.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Cells {
    /// The largest near-cubic lattice whose cells are at least twice as wide as a cube of six elements of mean volume, and
    /// whose matrices cost little to renew: at most 0.7 times the root of the number of elements functions, or 68 if that
    /// is more. At least four nodes for each function, two where no lattice has four. A step takes a coarser one where
    /// single precision cannot invert the matrices of this one, or where its stiffness differs much from that of the
    /// elements. No lattice if the mesh is too small for one cell.
    #[default]
    Suggested,
    /// This many along x, y, z, at least one each.
    Given([u32; 3]),
}

impl Method {
    /// With this lattice.
    #[must_use]
    pub const fn new(cells: Cells) -> Self {
        Self { cells, gain: GAIN }
    }

    /// The same with another gain (1) of the damping of rough motion (`rough_motion.rs`): 0 for none.
    #[must_use]
    pub const fn with_gain(self, gain: f32) -> Self {
        Self { gain, ..self }
    }

    /// The lattice on a scene with these `points` (m).
    pub fn grid<M: Material>(&self, scene: SceneView<'_, M>, points: &[[f32; 3]]) -> Result<Grid, InertiaError> {
        self.cells.grid(scene, points)
    }
}

impl Cells {
    /// The lattice on a scene with these `points` (m).
    pub fn grid<M: Material>(self, scene: SceneView<'_, M>, points: &[[f32; 3]]) -> Result<Grid, InertiaError> {
        self.grid_on(scene, &Layout::one(points))
    }

    /// The same on nodes that may be set apart.
    pub(super) fn grid_on<M>(self, scene: SceneView<'_, M>, layout: &Layout<'_>) -> Result<Grid, InertiaError> {
        match self {
            Self::Suggested => Ok(largest_grid(scene, layout, usize::MAX)),
            Self::Given(cells) => {
                let functions = Lattice::functions_for(cells, layout, scene.inertia)?;
                Ok(Grid { cells, functions })
            }
        }
    }
}

/// Vectors of storage that a method needs on a scene with these `points` (m).
pub fn vectors_for<M: Material>(
    method: &Method,
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
) -> Result<usize, InertiaError> {
    let (nodes, elements, grid) = (scene.node_count(), scene.element_count(), method.grid(scene, points)?);
    Ok(vectors_for_lattice(scene.element(), nodes, elements, grid))
}

/// The same for this many nodes and elements and a known lattice.
#[must_use]
pub fn vectors_for_lattice(element: Element, nodes: usize, elements: usize, grid: Grid) -> usize {
    let lists = node_tables::vectors_for(nodes).saturating_add(vectors_of_places(nodes));
    coarse_room::VECTORS
        .saturating_add(lists)
        .saturating_add(matrices::vectors_for(grid, pieces(element, nodes, elements)))
}

/// Elements, and patches with nodal strain, of a scene, or more than that.
pub(super) const fn pieces(element: Element, nodes: usize, elements: usize) -> [usize; 2] {
    // Where tissues meet, a node has a patch of each; a tile of patches that there is no room for is not sampled.
    [elements, if element.is_nodal_strain() { nodes.saturating_mul(2) } else { 0 }]
}

/// No fewer than are needed with these cells on any scene of so many nodes and elements.
#[must_use]
pub fn vectors_at_most(element: Element, nodes: usize, elements: usize, cells: Cells) -> usize {
    let grid = match cells {
        Cells::Given(cells) => {
            let points =
                cells.map(|count| (count as usize).saturating_add(1)).into_iter().fold(1, usize::saturating_mul);
            Grid { cells, functions: points.min(lattice::MAX_FUNCTIONS) }
        }
        Cells::Suggested => {
            let [_, few] = NODES_PER_FUNCTION;
            let functions = lattice::MAX_FUNCTIONS.min(nodes / few + 1).min(most_functions(elements));
            // As many cells as there may be, and layers as large.
            let across = libm::cbrt(most_cells(functions) as f64) as u32 + 1;
            Grid { cells: [across; 3], functions }
        }
    };
    vectors_for_lattice(element, nodes, elements, grid)
}

/// Most cells of a suggested lattice: a body that fills less of its box has a coarser one.
const fn most_cells(functions: usize) -> usize {
    3 * functions + 8
}

/// Most functions of a suggested lattice for so many elements.
fn most_functions(elements: usize) -> usize {
    FEW_FUNCTIONS.max((FUNCTIONS_OF_ROOT * libm::sqrt(elements as f64)) as usize)
}

/// Two places take the memory of three vectors.
const _: () = assert!(3 * size_of::<NodeVector>() == 2 * size_of::<LatticeNode>());

/// Vectors of storage for the places of this many nodes.
pub(super) const fn vectors_of_places(nodes: usize) -> usize {
    3 * nodes.div_ceil(2)
}

/// Least spacing of the points of a suggested lattice, as a multiple of the edge of a cube of six elements: the coarse
/// stiffness counts an element in one cell, and is too small for functions of which it is a large part.
const LEAST_SPACING: f32 = 2.0;

/// Least number of nodes for each function of a suggested lattice, and on meshes that are too small for that.
const NODES_PER_FUNCTION: [usize; 2] = [4, 2];

/// Most functions of a suggested lattice, over the root of the number of elements, so that a step which renews the
/// matrices costs at most five exact ones. Measured, a cuboid of 10,800 elements with nodal strain that swings: 60
/// functions .34 / .83 / 2.0 % of error at 10/20/50 times the critical step and 2.7 to 3.4 exact steps, 90 functions .33 /
/// .76 / 1.8 % and 3.2 to 4.3.
const FUNCTIONS_OF_ROOT: f64 = 0.7;
/// The same for bodies with few elements.
const FEW_FUNCTIONS: usize = 68;

/// See [`Cells::Suggested`]; of the lattices with fewer than `below` functions.
pub(super) fn largest_grid<M>(scene: SceneView<'_, M>, layout: &Layout<'_>, below: usize) -> Grid {
    let grids = NODES_PER_FUNCTION.map(|nodes| below.min(scene.node_count() / nodes + 1));
    let [many, few] = grids.map(|below| grid_below(scene, layout, below));
    if many.functions > 0 { many } else { few }
}

/// The largest suitable lattice with fewer than `below` functions.
fn grid_below<M>(scene: SceneView<'_, M>, layout: &Layout<'_>, below: usize) -> Grid {
    let edge = scene.edge();
    let (mut best, most) = (Grid::default(), most_functions(scene.element_count()));
    for cells in (1..64).flat_map(|parts| layout.near_cubic(parts)) {
        let Some(size) = layout.box_of(cells) else { continue };
        let least = size.map(|size| LEAST_SPACING * edge / size);
        if cells.iter().zip(least).any(|(&cells, least)| cells > 1 && cells as f32 * least > 1.0) {
            continue;
        }
        let Ok(functions) = Lattice::functions_for(cells, layout, scene.inertia) else {
            break;
        };
        if functions > best.functions
            && functions < below
            && cells.iter().map(|&count| count as usize).product::<usize>() <= most_cells(functions)
            && functions <= most
        {
            best = Grid { cells, functions };
        }
    }
    best
}
