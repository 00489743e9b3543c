//! The exact step against closed forms, theory and the float64 reference, which is itself tested against its
//! definitions.

#[cfg(feature = "slow-tests")]
mod against_reference;
mod alarms;
mod crushed;
mod divergence;
mod elements;
mod fibres;
mod follower_pressure;
mod loads;
mod measured_energy;
mod nodal_elements;
mod nodal_pressure;
mod nodal_strain;
mod patch;
mod reach;
mod reference_self;
mod relaxation;
mod stability;
mod tube;
mod vibration;
