//! A start from displacements that the host has (m), at a stop: from another simulation, a registration, a search for
//! an unloaded shape.

use core::fmt;

use crate::element::{Extremes, forget_crushed};
use crate::scene::AsScene;
use crate::state::AsState;

use super::stop_in;

/// Why displacements were refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum DisplacementError {
    /// There is not one for each node.
    Count {
        /// Displacements given.
        given: usize,
        /// Nodes of the scene.
        nodes: usize,
    },
    /// One is NaN or infinite.
    NotFinite {
        /// The node.
        node: u32,
        /// Its component, m.
        value: f32,
    },
    /// The state has room for fewer nodes than the scene.
    Room {
        /// Nodes of the scene.
        nodes: usize,
        /// Nodes that the state has room for.
        room: usize,
    },
}

impl fmt::Display for DisplacementError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Count { given, nodes } => {
                write!(f, "{given} displacements are given, the scene has {nodes} nodes")
            }
            Self::NotFinite { node, value } => write!(f, "the displacement of node {node} holds {value}"),
            Self::Room { nodes, room } => {
                write!(f, "the scene has {nodes} nodes, the state has room for {room}")
            }
        }
    }
}

impl core::error::Error for DisplacementError {}

/// Puts every node at its displacement (m, from rest), at a stop ([`super::stop`]): velocities are zero, time stays, and
/// the energy balance begins with the strain energy. It counts as a step, by which whatever follows the state sees that
/// it has moved. Held axes keep what is given until a motion moves them. Nothing changes if it is refused.
pub fn displace(
    scene: &impl AsScene,
    state: &mut impl AsState,
    displacements: &[[f32; 3]],
) -> Result<(), DisplacementError> {
    let (scene, state) = (scene.as_scene(), state.as_state());
    let (nodes, given) = (scene.node_count(), displacements.len());
    let room = state.capacity_for(scene.element());
    if room < nodes {
        return Err(DisplacementError::Room { nodes, room });
    }
    if given != nodes {
        return Err(DisplacementError::Count { given, nodes });
    }
    for (node, displacement) in (0..).zip(displacements) {
        if let Some(&value) = displacement.iter().find(|value| !value.is_finite()) {
            return Err(DisplacementError::NotFinite { node, value });
        }
    }
    let places = state.displacement.iter_mut().zip(state.remainder.iter_mut());
    for ((at, left), [x, y, z]) in places.zip(displacements) {
        at.0 = [*x, *y, *z, 0.0];
        left.0 = [0.0; 4];
    }
    forget_crushed(state.volume);
    state.progress.steps += 1;
    state.progress.extremes = Extremes::REST;
    // It has the room.
    let _ = stop_in(scene, state);
    Ok(())
}
