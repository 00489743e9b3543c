//! The kernel's tests in one crate: what they have in common is compiled once, and no core waits for the last of a few.

#[path = "support/networks.rs"]
mod networks;
mod reference;
mod support;

mod contact;
mod contract;
mod exchange;
mod large_steps;
mod physics;
mod pulls;
