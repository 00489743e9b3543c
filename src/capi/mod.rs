//! The C API: `include/supple.h`, which `tools/header.sh` makes from these files. Every object lives in memory of the
//! host, begins with what it is and how large, and holds no pointer into itself. A function checks all that it is given
//! before it changes anything; what is wrong comes back as a status, with place and value in a `supple_error`. What is
//! computed is computed by the functions that Rust hosts call as well. SI units.
//!
//! Types and functions have the names that C sees. Their docs are the header's: written for a reader of C.
#![allow(non_camel_case_types, unreachable_pub, unsafe_code)]

/// Version of the interface: of structures, of functions' arguments, of what statuses mean. Put it into
/// the field `abi` of every configuration; a library of another version refuses it.
pub const SUPPLE_ABI: u32 = 7;

/// No node, element or axis.
pub const SUPPLE_NONE: u32 = u32::MAX;

// In the order of the header.
mod level;

mod status;

mod memory;

mod prony;

mod fibres;

mod scene;

mod loads;

mod traction;

mod state;

mod pressure;

mod step;

mod pool;
mod pulls;

mod vectors;

mod surface;

mod points;

mod image;

mod contact;

mod local_force;

mod saved;

mod learned;

mod large;

mod guard;

mod adaptive;

mod reaction;

mod simulation;

mod settle;

mod exchange;

mod remarks;

mod mesh_file;

#[cfg(test)]
mod memory_tests;
