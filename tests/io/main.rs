//! Meshes in, fields out.

mod malformed;
mod read;
mod write;
