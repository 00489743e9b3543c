//! Plain float64 reference for the exact step: total Lagrangian explicit dynamics of linear tetrahedra.
//!
//! The judge of the fast kernel. It is written from the textbook and shares nothing with the crate: the
//! deformation gradient `F = I + H`, `F^-T` by a plain inverse, `P = dPsi/dF` from the stored energy, nodal
//! forces `f_a = V P grad N_a`, lumped masses, central differences in increment form (Belytschko, Liu, Moran,
//! Nonlinear Finite Elements, ch. 4 and 6; Miller et al. 2007, doi:10.1002/cnm.887; Bonet & Wood, Nonlinear
//! Continuum Mechanics, ch. 6).
//! Units are SI: m, kg, s, N, Pa, J.
//!
//! - [`Law`]: stored energy, first Piola-Kirchhoff stress, tangent
//! - [`Mesh`]: tetrahedra, shape function gradients, lumped mass, the bar
//! - [`internal_force`], [`strain_energy`], [`Simulation`]: forces and time integration
//! - [`critical_step`]: exact `2 / omega_max` of `M^-1 K(u)`
//! - [`closed_form`]: stresses written out by hand for simple deformations
//! - [`dense`]: Cholesky factor and eigenvalues of small dense matrices
//! - [`random`]: random values and deformation gradients for tests
//!
//! Several test crates include it and none uses all of it, hence the `allow`.
#![allow(dead_code, unreachable_pub, unused_imports)]

pub mod closed_form;
pub mod critical;
pub mod dense;
pub mod law;
pub mod mesh;
pub mod nodal_pressure;
pub mod nodal_strain;
pub mod random;
pub mod simulation;
pub mod tensor;

pub use critical::{critical_step, tangent_product};
pub use law::{EXPONENT_CAP, J_MIN, Law};
pub use mesh::{Element, Mesh};
pub use random::{Random, deformations};
pub use simulation::{Energy, Motion, NodalForce, Simulation, internal_force, ramp, strain_energy};
pub use tensor::{Mat3, Vec3};
