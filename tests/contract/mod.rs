//! What the core promises whatever it is given: no allocation, errors that name place and value, the same bits for any
//! number of threads, and that one object takes the steps that its parts take.

mod errors;
mod fibres;
mod no_allocation;
mod parts;
mod patches;
mod relaxation;
mod settle;
mod simulation;
