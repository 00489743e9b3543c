//! Inputs of networks for as many vertices as the paper's bar has.

use supple::mlp::Network;

pub(crate) const ROWS: usize = 1458;

/// Over the ranges of training.
pub(crate) fn vertices(network: &Network<'_>) -> Vec<f32> {
    let inputs = network.inputs();
    (0..ROWS * inputs.len())
        .map(|at| {
            let range = inputs[at % inputs.len()];
            range.least + (range.most - range.least) * ((at * 7919 % 1009) as f32 / 1009.0)
        })
        .collect()
}
