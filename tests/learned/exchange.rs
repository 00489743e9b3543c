//! Weight files to and from safetensors: there and back nothing changes, PyTorch computes what we compute, and whatever
//! a file lacks or has too much of is refused by its name.

use proptest::prelude::*;
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde_json::{Value, json};
use supple::material::{AnyLaw, Law};
use supple::mlp::{ExchangeError, ForceInput, Network, from_safetensors, to_safetensors, write};

use crate::networks::{Memory, described, uniform};

fn exported(weights: &[u8]) -> Vec<u8> {
    let memory = Memory::of(weights);
    to_safetensors(&Network::parse(memory.bytes()).unwrap()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn there_and_back_nothing_changes(
        inputs in 1usize..20,
        outputs in 1usize..8,
        hidden in prop::collection::vec(1usize..40, 0..13),
        corrected in any::<bool>(),
        seed in any::<u32>(),
        law in 0..AnyLaw::all().count(),
        per_mass in any::<bool>(),
    ) {
        let first: Vec<_> = [inputs].into_iter().chain(hidden).chain([outputs]).collect();
        let second = [inputs + outputs, 5, outputs];
        let mut description = described(&first, if corrected { &second } else { &[] }, seed);
        // Values with as many digits as there are.
        let mut random = uniform(seed ^ 77);
        let mut odd = || (1.1 + random()) * 10f32.powf(20.0 * random());
        description.force = if per_mass { ForceInput::PerMass } else { ForceInput::Newton };
        description.law = AnyLaw::all().nth(law).unwrap().with([odd(), odd(), odd(), odd()]);
        (description.density, description.damping) = (odd(), odd());
        (description.step, description.exact_step) = (odd(), odd());
        for range in description.inputs.iter_mut().chain(&mut description.outputs) {
            (range.scale, range.least, range.most) = (odd(), -odd(), odd());
        }
        description.recipe = "seed = 1 # \"quoted\", \\ and \u{00b5}\n";
        let weights = write(&description).unwrap();
        let export = exported(&weights);
        prop_assert!(from_safetensors(&export).unwrap() == weights);
        // Bytes do not depend on the run.
        prop_assert!(exported(&weights) == export);
    }
}

/// What PyTorch would train is the float32 network.
#[test]
fn int8_layers_are_not_exported() {
    let memory = Memory::of(&std::fs::read("tests/data/golden-v3.weights").unwrap());
    let refused = to_safetensors(&Network::parse(memory.bytes()).unwrap()).unwrap_err();
    assert_eq!(refused.to_string(), "layer 1 is in int8; export the float32 file that it was made from");
}

const GOLDEN: &str = "tests/data/golden-v1.safetensors";

/// Exported when the format came to be; `pytorch.csv` was made from it.
#[test]
fn the_golden_export_is_what_is_written_today() {
    let weights = std::fs::read("tests/data/golden-v1.weights").unwrap();
    let export = exported(&weights);
    if std::env::var_os("SUPPLE_WRITE_GOLDEN").is_some() {
        std::fs::write(GOLDEN, &export).unwrap();
    }
    let golden = std::fs::read(GOLDEN).unwrap();
    assert!(golden == export, "exports have changed: make tests/data/pytorch.csv again");
    assert!(from_safetensors(&golden).unwrap() == weights);
}

#[test]
fn pytorch_computes_what_we_compute() {
    let memory = Memory::of(&from_safetensors(&std::fs::read(GOLDEN).unwrap()).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let (mut worst, mut clipped, mut rows) = (0.0f32, 0, 0);
    for line in std::fs::read_to_string("tests/data/pytorch.csv").unwrap().lines() {
        let row: Vec<f32> = line.split(',').map(|value| value.parse().unwrap()).collect();
        let (inputs, wanted) = row.split_at(7);
        let mut outputs = [0.0; 3];
        network.predict(inputs, &mut outputs);
        assert_eq!(wanted.len(), outputs.len());
        for ((output, wanted), range) in outputs.iter().zip(wanted).zip(network.outputs()) {
            worst = worst.max((output - wanted).abs() / range.scale);
            clipped += u32::from(*wanted == range.least || *wanted == range.most);
        }
        rows += 1;
    }
    println!("{rows} vertices, {clipped} outputs clipped: off by {worst:.1e} of the outputs' scale");
    assert!(rows == 64 && clipped > 0 && clipped < 64);
    assert!(worst < 1e-5);
}

#[test]
fn the_code_in_the_docs_is_the_code_that_made_the_vectors() {
    let script = std::fs::read_to_string("tests/data/pytorch.py").unwrap();
    let docs = std::fs::read_to_string("weights/FORMAT.md").unwrap();
    let class = script.split("\n\n\nif __name__").next().unwrap();
    assert!(docs.contains(&format!("```python\n{class}\n```")), "weights/FORMAT.md shows other code");
}

/// Tensors and metadata of a safetensors file, to be changed.
struct Editable {
    about: Value,
    tensors: Vec<(String, Dtype, Vec<usize>, Vec<u8>)>,
}

impl Editable {
    fn new() -> Self {
        let export = exported(&write(&described(&[7, 9, 3], &[10, 5, 3], 1)).unwrap());
        let (_, metadata) = SafeTensors::read_metadata(&export).unwrap();
        let about = serde_json::from_str(&metadata.metadata().as_ref().unwrap()["supple"]).unwrap();
        let tensors = SafeTensors::deserialize(&export).unwrap();
        let tensors = tensors.tensors().into_iter();
        Self {
            about,
            tensors: tensors
                .map(|(name, view)| (name, view.dtype(), view.shape().to_vec(), view.data().to_vec()))
                .collect(),
        }
    }

    fn tensor(&mut self, name: &str) -> &mut (String, Dtype, Vec<usize>, Vec<u8>) {
        self.tensors.iter_mut().find(|tensor| tensor.0 == name).unwrap()
    }

    /// With other values in a shape of their own.
    fn filled(&mut self, name: &str, shape: &[usize], value: f32) {
        let tensor = self.tensor(name);
        tensor.2 = shape.to_vec();
        tensor.3 = (0..shape.iter().product()).flat_map(|_| value.to_le_bytes()).collect();
    }

    fn bytes(&self, about: Option<String>) -> Vec<u8> {
        let views = self
            .tensors
            .iter()
            .map(|(name, dtype, shape, data)| (name.clone(), TensorView::new(*dtype, shape.clone(), data).unwrap()));
        serialize(views, about.map(|about| [("supple".to_string(), about)].into_iter().collect())).unwrap()
    }

    fn refused(&self) -> String {
        let error = from_safetensors(&self.bytes(Some(self.about.to_string()))).unwrap_err();
        println!("{error}");
        error.to_string()
    }
}

#[test]
fn tensors_that_do_not_fit_are_named() {
    type Change = fn(&mut Editable);
    let cases: &[(Change, &str)] = &[
        (|file| file.tensors.retain(|tensor| tensor.0 != "second.0.bias"), "tensor second.0.bias is missing"),
        (|file| file.tensor("first.1.bias").0 = "first.2.bias".into(), "tensor first.1.bias is missing"),
        (
            |file| file.tensors.push(("first.2.bias".into(), Dtype::F32, vec![1], vec![0; 4])),
            "tensor first.2.bias belongs to no layer of the metadata",
        ),
        (
            |file| {
                let tensor = file.tensor("first.0.bias");
                (tensor.1, tensor.3) = (Dtype::F16, vec![0; 18]);
            },
            "tensor first.0.bias holds F16, it must hold F32",
        ),
        (
            |file| file.filled("first.0.weight", &[9, 8], 0.0),
            "tensor first.0.weight has the shape [9, 8], it must be [1 to 256, 7]",
        ),
        (
            |file| file.filled("first.0.weight", &[257, 7], 0.0),
            "tensor first.0.weight has the shape [257, 7], it must be [1 to 256, 7]",
        ),
        (
            |file| file.filled("second.0.weight", &[50], 0.0),
            "tensor second.0.weight has the shape [50], it must be [1 to 256, 10]",
        ),
        (
            |file| file.filled("second.1.weight", &[4, 5], 0.0),
            "tensor second.1.weight has the shape [4, 5], it must be [3, 5]",
        ),
        (|file| file.filled("first.1.bias", &[3, 1], 0.0), "tensor first.1.bias has the shape [3, 1], it must be [3]"),
        (|file| file.filled("first.1.weight", &[3, 9], f32::NAN), "tensor first.1.weight: number 0 is NaN"),
    ];
    for (change, said) in cases {
        let mut file = Editable::new();
        change(&mut file);
        assert_eq!(file.refused(), *said);
    }
}

#[test]
fn keys_that_do_not_fit_are_named() {
    type Change = fn(&mut Value);
    let remove = |about: &mut Value, key: &str| {
        about.as_object_mut().unwrap().remove(key);
    };
    for key in ["version", "inputs", "outputs", "slopes", "law", "constants", "density", "damping", "step", "recipe"] {
        let mut file = Editable::new();
        remove(&mut file.about, key);
        assert_eq!(file.refused(), format!("metadata key {key}: missing"));
    }
    let cases: &[(Change, &str)] = &[
        (|about| about["version"] = json!(2), "metadata key version: it is 2, an export has 1"),
        (|about| about["version"] = json!("1"), "metadata key version: \"1\" is not usable: invalid type"),
        (|about| about["extra"] = json!(1), "metadata key extra: not known"),
        (|about| about["density"] = json!("heavy"), "metadata key density: \"heavy\" is not usable: invalid type"),
        (|about| about["density"] = json!(-3), "the density is -3"),
        (|about| about["damping"] = json!(null), "metadata key damping: null is not usable: "),
        (|about| about["law"] = json!("hooke"), "metadata key law: \"hooke\" is not known; neo-hookean, exponential"),
        (|about| about["force"] = json!("pound"), "metadata key force: \"pound\" is not usable: unknown variant"),
        (|about| about["law"] = json!("neo-hookean"), "metadata key constants.c: missing"),
        (|about| about["constants"]["c"] = json!(1.0), "metadata key constants.c: not known"),
        (|about| about["constants"]["a"] = json!(0.0), "a is 0"),
        (
            |about| about["inputs"]["least"] = json!([1.0]),
            "metadata key inputs.least: 1 numbers, but 7 in inputs.scale",
        ),
        (|about| about["inputs"]["scale"][2] = json!(0), "input 2: scale 0, range -7.5 to 10"),
        (|about| about["outputs"]["most"][0] = json!(-9.0), "output 0: scale 2, range -6 to -9"),
        (|about| about["outputs"]["mean"] = json!([]), "metadata key outputs.mean: not known"),
        (
            |about| about["slopes"]["second"][0] = json!(1.5),
            "metadata key slopes: layer 0 of second has 1.5, it must be from 0 to 1",
        ),
        (|about| about["slopes"]["third"] = json!([]), "metadata key slopes.third: not known"),
        (|about| about["slopes"]["first"] = json!([]), "tensor first.0.bias belongs to no layer of the metadata"),
        (
            |about| about["recipe_sha256"] = json!("0707"),
            "metadata key recipe_sha256: \"0707\" is not 64 hexadecimal digits",
        ),
        (|about| about["recipe_sha256"] = json!("g".repeat(64)), "is not 64 hexadecimal digits"),
    ];
    for (change, part) in cases {
        let mut file = Editable::new();
        change(&mut file.about);
        let said = file.refused();
        assert!(said.contains(part), "\"{part}\" is not in: {said}");
    }
}

#[test]
fn what_is_no_export_is_refused() {
    let file = Editable::new();
    let said = |bytes: &[u8]| {
        let error = from_safetensors(bytes).unwrap_err();
        println!("{error}");
        error.to_string()
    };
    assert_eq!(said(&file.bytes(None)), "metadata key supple: missing");
    assert!(said(&file.bytes(Some("{".into()))).starts_with("metadata key supple: "));
    let whole = file.bytes(Some(file.about.to_string()));
    for length in [0, 7, 100, whole.len() - 1] {
        let error = from_safetensors(&whole[..length]).unwrap_err();
        assert!(matches!(error, ExchangeError::File(_)), "{length}: {error}");
        assert!(error.to_string().starts_with("not a safetensors file: "), "{error}");
    }
}
