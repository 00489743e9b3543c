//! What the core promises whatever it is given: no allocation, errors that name place and value, the same bits for any
//! number of threads, and that one object takes the steps that its parts take.

#[path = "../support/networks.rs"]
mod networks;
#[path = "../reference/mod.rs"]
mod reference;
#[path = "../support/mod.rs"]
mod support;

mod errors;
mod fibres;
mod no_allocation;
mod parts;
mod patches;
mod relaxation;
mod settle;
mod simulation;
