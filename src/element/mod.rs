//! Tetrahedra with linear displacements (T4), their pressure from their own volume or from the volumes around their nodes
//! ([`crate::material::NodalPressure`]): their tables, deformation, internal forces, bounds of their tangent stiffness, and what they tell
//! about themselves. Loops over elements are written once, for any law and any instruction-set level ([`crate::simd`]); they are
//! compiled for each law of the list (`kernels.rs`), and linked only where a scene uses that law.

mod critical_bounds;
mod deformation;
mod fields;
mod internal_forces;
mod kernels;
mod nodal_volume;
mod nodal_volume_bounds;
mod node;
mod pressure;
mod stiffness_bound;
#[cfg(test)]
mod stiffness_bound_tests;
pub(crate) mod symmetric;
mod tile;
mod tile_bounds;

pub use fields::ElementFields;
pub use kernels::ElementLaw;
pub(crate) use kernels::{ForcesVisitor, tile_bounds};
#[cfg(any(feature = "std", test))]
pub use kernels::{LawWork, MaterialWork, with_element, with_law};
pub use node::{Axes, NodeInertia};
pub use tile::ElementTile;
pub(crate) use tile::MOST_ELEMENTS;

pub(crate) use critical_bounds::{CriticalBounds, NodeMatrices};
#[cfg(feature = "std")]
pub(crate) use fields::pressure_at;
pub(crate) use fields::{element_fields, volume_energy_difference};
pub(crate) use internal_forces::{Elements, Extremes, InternalForces, NoVisitor, operations};
pub(crate) use nodal_volume::{NODAL_PRESSURE_OPERATIONS, NodalVolumes, VolumeRows};
pub(crate) use nodal_volume_bounds::NodalVolumeBounds;
pub(crate) use pressure::{MeanPressure, OwnPressure};
pub(crate) use stiffness_bound::{MatrixSums, ScalarBound};
pub(crate) use tile_bounds::{TileBounds, TileTangents};

use crate::material::Material;

/// A material whose law has kernels: any of this crate.
pub trait ElementMaterial: Material<Law: ElementLaw> {}

impl<M: Material<Law: ElementLaw>> ElementMaterial for M {}
