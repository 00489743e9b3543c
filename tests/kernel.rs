//! The kernel's tests in one crate: what they share is compiled once, and they share two cores without waiting.

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
