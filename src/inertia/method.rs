//! Which of the three methods a step beyond the critical one uses, the lattice it needs, and the storage for both.

use crate::material::Material;
use crate::scene::SceneView;
use crate::simd::NodeVector;

use super::damper::Damper;
use super::lattice::{self, Grid, Lattice, LatticeNode};
use super::{InertiaError, matrices, node_tables};

/// A way to step beyond the critical step.
#[derive(Clone, Debug)]
// A network's tables stand where the method stands: there is no heap to put them on.
#[allow(clippy::large_enum_variant)]
pub enum Method<'w> {
    /// Mass scaling: inertia is raised where the step would be unstable.
    MassScaled,
    /// Multilevel inertia: the same, and smooth motion keeps its true inertia through a coarse lattice.
    Multilevel(Cells),
    /// The damped step: the same, and a small network damps rough motion, which the lattice cannot represent.
    Damped(Damper<'w>, Cells),
}

/// Cells of a lattice.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Cells {
    /// The largest near-cubic lattice whose cost is a small part of the step's: with `n` unknowns, three for each
    /// function, `n^3` is at most 400 times the number of elements; 700 times for [`Method::Damped`], as a finer
    /// lattice pays when rough motion is damped. No lattice if even one cell costs too much.
    #[default]
    Suggested,
    /// This many along x, y, z, at least one each.
    Given([u32; 3]),
}

impl<'w> Method<'w> {
    pub(super) const fn damper(&self) -> Option<&Damper<'w>> {
        match self {
            Self::Damped(damper, _) => Some(damper),
            _ => None,
        }
    }

    /// The lattice of the method on a scene with these `points` (m).
    pub fn grid<M: Material>(
        &self,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
    ) -> Result<Grid, InertiaError> {
        match self {
            Self::MassScaled => Ok(Grid::default()),
            Self::Multilevel(cells) => cells.grid(false, scene, points),
            Self::Damped(_, cells) => cells.grid(true, scene, points),
        }
    }
}

impl Cells {
    /// The lattice of [`Method::Multilevel`] or (`damped`) [`Method::Damped`] on a scene with these `points` (m).
    pub fn grid<M: Material>(
        self,
        damped: bool,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
    ) -> Result<Grid, InertiaError> {
        match self {
            Self::Suggested => Ok(largest_grid(scene, points, if damped { 700 } else { 400 })),
            Self::Given(cells) => {
                let functions = Lattice::new(cells, points, scene.inertia)?.functions();
                Ok(Grid { cells, functions })
            }
        }
    }
}

/// Vectors of storage that a method needs on a scene with these `points` (m).
pub fn vectors_for<M: Material>(
    method: &Method<'_>,
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
) -> Result<usize, InertiaError> {
    let grid = method.grid(scene, points)?;
    Ok(vectors_for_lattice(scene.node_count(), grid, method.damper().is_some()))
}

/// The same for this many nodes and a known lattice.
#[must_use]
pub const fn vectors_for_lattice(nodes: usize, grid: Grid, damped: bool) -> usize {
    let tables = node_tables::vectors_for(nodes, damped);
    if grid.functions == 0 {
        return tables;
    }
    let [x, y, z] = grid.cells;
    let cells = (x as usize).saturating_mul(y as usize).saturating_mul(z as usize);
    let floats = matrices::floats_for(cells, grid.functions, damped);
    let places = vectors_of_places(nodes);
    tables.saturating_add(places).saturating_add(floats.div_ceil(FLOATS))
}

/// Floats of a vector.
const FLOATS: usize = size_of::<NodeVector>() / size_of::<f32>();

/// Two places take the memory of three vectors.
const _: () = assert!(3 * size_of::<NodeVector>() == 2 * size_of::<LatticeNode>());

/// Vectors of storage for the places of this many nodes.
pub(super) const fn vectors_of_places(nodes: usize) -> usize {
    3 * nodes.div_ceil(2)
}

/// The largest near-cubic lattice for which the third power of the number of unknowns is at most `multiply_adds` times
/// the number of elements.
pub(super) fn largest_grid<M>(scene: SceneView<'_, M>, points: &[[f32; 3]], multiply_adds: u64) -> Grid {
    let mut best = Grid::default();
    for cells in (1..64).flat_map(|parts| lattice::near_cubic(points, parts)) {
        let Ok(lattice) = Lattice::new(cells, points, scene.inertia) else {
            break;
        };
        let functions = lattice.functions();
        let unknowns = 3 * functions as u64;
        if functions > best.functions
            && unknowns * unknowns * unknowns <= multiply_adds * scene.element_count() as u64
        {
            best = Grid { cells, functions };
        }
    }
    best
}
