//! Networks in eight bits, for their time.

use supple::mlp::quantise::quantise;
use supple::mlp::{Description, Network, WeightBytes, write_int8};

use super::vertices::vertices;

/// The network with all layers in eight bits but the first and the last of each part. Time does not depend on what it was
/// quantised by.
pub(crate) fn eight_bits(network: &Network<'_>) -> WeightBytes {
    let (first, second) = network.layers();
    let (split, count) = (first.len(), first.len() + second.len());
    let float = [0, split - 1, split, count - 1];
    let quantised = quantise(network, &vertices(network), &float).expect("a float32 network");
    let bytes = write_int8(&Description::of(network), &quantised.layers).expect("a sound network");
    WeightBytes::of(&bytes)
}
