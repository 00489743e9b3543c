//! The surface of a body where an instrument touches it.

use supple::contact::{Contact, Instrument, Surface, SurfaceNode, boundary, boundary_triangles};
use supple::mesh::Mesh;
use supple::state::VecState;

use super::LabError;

/// Nodes and triangles of a boundary.
#[derive(Clone, Debug)]
pub struct TouchedSurface {
    nodes: Vec<SurfaceNode>,
    triangles: Vec<[u32; 3]>,
    scene_nodes: usize,
}

impl TouchedSurface {
    /// All of the boundary of a mesh, checked with the instruments that will touch it.
    pub(super) fn new(mesh: &Mesh<'_>, instruments: &[Instrument<'_>]) -> Result<Self, LabError> {
        let nodes = boundary(mesh);
        let triangles = boundary_triangles(mesh, &nodes);
        let touched = Self { nodes, triangles, scene_nodes: mesh.points().len() };
        touched.by(instruments)?;
        Ok(touched)
    }

    fn surface(&self) -> Result<Surface<'_>, LabError> {
        Ok(Surface::new(&self.nodes, self.scene_nodes)?.with_triangles(&self.triangles)?)
    }

    /// Touched by instruments.
    pub(super) fn by<'a>(&'a self, instruments: &'a [Instrument<'a>]) -> Result<Contact<'a>, LabError> {
        Ok(Contact::new(self.surface()?, instruments)?)
    }

    /// The state with room for what instruments do.
    pub(super) fn met_by(&self, state: VecState) -> Result<VecState, LabError> {
        Ok(state.meeting(&self.surface()?))
    }
}
