//! Tetrahedra with linear displacements (T4): stress and pressure from each element's own deformation, with the
//! pressure of the volumes around its nodes ([`crate::material::NodalPressure`]), or all from the mean strain around
//! nodes ([`crate::material::NodalStrain`], with an energy of their own for crushed elements, `barrier.rs`). Their
//! tables, deformation, internal forces, bounds of their tangent stiffness, and what they tell about themselves. Loops
//! over elements are written once, for any law and any instruction-set level ([`crate::simd`]); they are compiled for
//! each law of the list (`kernels.rs`), and linked only where a scene uses that law. What in them does not depend on
//! the law is compiled once for each level ([`crate::simd::Piece`]).

mod barrier;
mod barrier_bounds;
mod barrier_forces;
mod critical_bounds;
mod crushed;
mod deformation;
mod extension;
mod fibre_bounds;
mod fibre_tangent;
mod fibres;
mod fields;
mod internal_forces;
mod kernels;
mod matrix;
mod nodal_volume;
mod nodal_volume_bounds;
mod node;
mod patch;
mod patch_bounds;
mod patch_builder;
mod patch_deformation;
mod patch_forces;
mod patch_tangents;
mod pressure;
mod relaxation;
mod relaxation_energy;
mod stiffness_bound;
#[cfg(test)]
mod stiffness_bound_tests;
pub(crate) mod symmetric;
mod tile;
mod tile_tangents;

pub use fibres::FibreTile;
pub use fields::ElementFields;
pub use kernels::ElementLaw;
pub(crate) use kernels::{
    ForcesVisitor, extended_forces, extended_nodal_pressure_forces, extended_patch_forces, tangents,
};
pub use node::{Axes, NodeInertia};
pub use patch::{Neighbours, PatchLayout, PatchRow, PatchTile, Patches};
pub(crate) use patch_bounds::PatchBounds;
pub(crate) use patch_builder::PatchBuilder;
pub use patch_builder::patch_rows_for;
pub(crate) use patch_builder::patch_tiles_for;
pub(crate) use patch_forces::PatchForces;
pub(crate) use patch_tangents::PatchTangents;
pub use tile::ElementTile;
pub(crate) use tile::MOST_ELEMENTS;

#[cfg(feature = "std")]
pub(crate) use barrier::{factor as barrier_factor, modulus as barrier_modulus};
pub(crate) use barrier_bounds::{CrushedTangents, add_crushed_bounds, each_bounded};
pub(crate) use barrier_forces::{AddCrushed, Forces as CrushedForces};
pub(crate) use critical_bounds::{CriticalBounds, NodeMatrices};
pub(crate) use crushed::{
    CrushedElements, LOOK_CYCLE, LOOK_CYCLE_OF_LONG, Look, MARKED, Marks, Seen, Turn, each_marked, farthest,
    forget_crushed, is_marked_at, mark_moment, mask_of, masks,
};
#[cfg(feature = "std")]
pub(crate) use extension::place_in;
pub(crate) use extension::{Extended, NoExtension, extension_operations};
pub(crate) use fibre_bounds::{add_fibre_bounds, add_fibre_tangents, add_patch_fibre_bounds, add_patch_fibre_tangents};
pub(crate) use fibre_tangent::FibreTangent;
pub(crate) use fibres::{Fibrous, unit_directions};
pub(crate) use fields::{MoreEnergy, element_energy, element_fields, patch_energy, stabilising_energy};
#[cfg(feature = "std")]
pub(crate) use fields::{invariants, pressure_at, stabilising_modulus, volume_ratio};
pub(crate) use internal_forces::{Elements, Extremes, InternalForces, NoVisitor, operations};
#[cfg(feature = "std")]
pub(crate) use matrix::{cofactor, inner, outer};
pub(crate) use nodal_volume::{NODAL_PRESSURE_OPERATIONS, NodalVolumes, VolumeRows};
pub(crate) use nodal_volume_bounds::{NodalVolumeBounds, balance, weigh};
pub(crate) use pressure::{MeanPressure, OwnPressure};
pub(crate) use relaxation::{Relaxing, Series, VECTORS_OF_TERM};
pub(crate) use relaxation_energy::Remembered;
pub(crate) use stiffness_bound::{MaybeBound, ScalarBound};
pub(crate) use tile_tangents::{ElementTangents, Tangent, TileTangents};

use crate::material::Material;

/// A material whose law has kernels: any of this crate.
pub trait ElementMaterial: Material<Law: ElementLaw> {}

impl<M: Material<Law: ElementLaw>> ElementMaterial for M {}
