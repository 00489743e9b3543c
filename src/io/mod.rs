//! Meshes in, fields out.
