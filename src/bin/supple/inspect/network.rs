//! `supple inspect` of a weight file: what the network is, what it costs, what it was trained on and on which ranges.

use std::path::Path;

use supple::learned::{FEATURES, LearnedModel, PREDICTED};
use supple::mlp::{Activation, ForceInput, Int8, Layer, Parameters, Range, hexadecimal};

use crate::problem::Problem;
use crate::screen::{output, row};
use crate::weight_file::{self, describe_step, describe_tissue};

/// Inputs and outputs of the learned step: what they are, the unit for people, and how many of it the SI unit is.
type Quantity = (&'static str, &'static str, f32);
const INPUTS: [Quantity; FEATURES] = [
    ("displacement, tangent", "mm", 1e3),
    ("displacement, normal", "mm", 1e3),
    ("displacement, binormal", "mm", 1e3),
    ("speed", "mm/s", 1e3),
    ("force, tangent", "mN", 1e3),
    ("force, normal", "mN", 1e3),
    ("force, binormal", "mN", 1e3),
];
/// The same with force over the vertex's mass.
const INPUTS_PER_MASS: [Quantity; FEATURES] = {
    let [a, b, c, d, ..] = INPUTS;
    let rest = [
        ("force / mass, tangent", "m/s^2", 1.0),
        ("force / mass, normal", "m/s^2", 1.0),
        ("force / mass, binormal", "m/s^2", 1.0),
    ];
    [a, b, c, d, rest[0], rest[1], rest[2]]
};
const OUTPUTS: [Quantity; PREDICTED] = [
    ("acceleration, tangent", "m/s^2", 1.0),
    ("acceleration, normal", "m/s^2", 1.0),
    ("acceleration, binormal", "m/s^2", 1.0),
];

/// Prints what a weight file holds.
pub(crate) fn inspect(path: &Path) -> Result<(), Problem> {
    let memory = weight_file::read(path)?;
    let network = weight_file::parse(path, &memory)?;
    let (inputs, outputs) = (network.inputs(), network.outputs());
    let recipe = network.recipe();
    row("weights", path.display());
    row("size", format!("{} bytes", memory.bytes().len()));
    row(
        "network",
        format!(
            "{} inputs, {} outputs, {} multiply-adds per vertex",
            inputs.len(),
            outputs.len(),
            network.multiply_adds()
        ),
    );
    row("step", describe_step(&network));
    row("learned from", describe_tissue(&network));
    row("damping", format!("{} 1/s", recipe.damping));

    output!(
        "\n{:<21} {:>7} {:>8}  {:<16} {:<9} {:>14} {:>9}",
        "layer",
        "inputs",
        "outputs",
        "activation",
        "precision",
        "multiply-adds",
        "bytes"
    );
    let (first, second) = network.layers();
    for (part, layers) in [("first", first), ("second", second)] {
        for (index, layer) in layers.iter().enumerate() {
            output!("{}", layer_row(&format!("{part} {index}"), layer));
        }
    }
    let (input_names, output_names): (&[Quantity], &[Quantity]) = match (inputs.len(), outputs.len(), recipe.force) {
        (FEATURES, PREDICTED, ForceInput::PerMass) => (&INPUTS_PER_MASS, &OUTPUTS),
        (FEATURES, PREDICTED, ForceInput::Newton) => (&INPUTS, &OUTPUTS),
        _ => (&[], &[]),
    };
    ranges("input", "in training", inputs, input_names);
    ranges("output", "clipped to", outputs, output_names);

    output!("\nrecipe, SHA-256 {}", hexadecimal(&recipe.hash));
    for line in recipe.text.lines() {
        output!("{}", format!("    {line}").trim_end());
    }
    match LearnedModel::new(network, false) {
        Ok(_) => Ok(()),
        Err(error) => Err(Problem::in_file(path, error)),
    }
}

fn layer_row(name: &str, layer: &Layer<'_>) -> String {
    let Layer { inputs, outputs, activation, parameters } = layer;
    let activation = match activation {
        Activation::Linear => "none".into(),
        Activation::LeakyRelu { slope } => format!("leaky ReLU {slope}"),
    };
    let (precision, bytes) = match parameters {
        Parameters::Float { weights, biases } => ("float32", size_of_val(*weights) + size_of_val(*biases)),
        Parameters::Int8(Int8 { weights, starts, scales, biases, .. }) => {
            ("int8", size_of_val(*weights) + size_of_val(*starts) + size_of_val(*scales) + size_of_val(*biases))
        }
    };
    let multiply_adds = layer.multiply_adds();
    format!("{name:<21} {inputs:>7} {outputs:>8}  {activation:<16} {precision:<9} {multiply_adds:>14} {bytes:>9}")
}

/// Prints a table of ranges; what has no name in `quantities` has a number and no unit.
fn ranges(kind: &str, what: &str, ranges: &[Range], quantities: &[Quantity]) {
    output!("\n{kind:<24} {:<6} {:>11}  {what}", "unit", "scale");
    for (index, Range { scale, least, most }) in ranges.iter().enumerate() {
        let number = format!("{kind} {index}");
        let (name, unit, factor) = quantities.get(index).copied().unwrap_or((&number, "", 1.0));
        output!("{name:<24} {unit:<6} {:>11.4}  {:.4} to {:.4}", factor * scale, factor * least, factor * most);
    }
}
