//! Damaged weight files, in float32 and int8, and damaged exports of PyTorch. Reading a weight file takes no memory. A
//! network that is accepted gives finite numbers in its ranges, and steps that it moves are finite or refused.

use supple::learned::{LearnedStep, vectors_for};
use supple::loads::{Loads, NodalForce};
use supple::mlp::{Network, from_safetensors};
use supple::state::{NodeVector, VecState};
use supple::step::{Status, Step};
use supple::tled;

use crate::data;
use crate::hostile::{Changes, Dice, Run, measured};
use crate::networks::{self, Memory};
use crate::support::bodies::{held, small_bar};
use crate::support::{EXP, rest_of, tissue};

/// Bytes of memory for a byte of an export, and for any export.
const BYTES: u64 = 64;
const ANY: u64 = 20_000;

/// Small networks of every kind.
fn sound() -> Vec<Vec<u8>> {
    let mut sound = data(&["v1.weights", "v3.weights"]);
    for (seed, [first, second]) in [[&[7, 8, 3][..], &[10, 4, 3][..]], [&[7, 33, 3], &[]]].into_iter().enumerate() {
        let description = networks::described(first, second, seed as u32);
        sound.push(supple::mlp::write(&description).unwrap());
        let int8 = networks::int8(&description, |_| true, 5);
        sound.push(supple::mlp::write_int8(&description, &int8).unwrap());
    }
    sound.push(networks::constant(4, 1.0).bytes().to_vec());
    sound
}

/// Puts length and checksum right, as somebody who makes a file on purpose would.
fn mend(bytes: &mut [u8]) {
    if bytes.len() > 20 {
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[12..16].copy_from_slice(&length);
        let checksum = crc32fast::hash(&bytes[20..]).to_le_bytes();
        bytes[16..20].copy_from_slice(&checksum);
    }
}

/// Predictions of a network for inputs of any size.
fn predict(network: &Network<'_>, dice: &mut Dice) {
    let (inputs, outputs) = (network.inputs().len(), network.outputs());
    let rows = 1 + dice.below(20);
    let given: Vec<f32> = (0..rows * inputs).map(|_| dice.wild(10.0)).collect();
    let mut predicted = vec![0.0; rows * outputs.len()];
    network.predict_rows(&given, &mut predicted);
    for (value, range) in predicted.iter().zip(outputs.iter().cycle()) {
        assert!(*value >= range.least && *value <= range.most, "{value} is not in {range:?}");
    }
}

#[test]
fn weight_files() {
    let sound = sound();
    let changes = Changes { sound: &sound, words: &[], most: 20_000 };
    let body = small_bar();
    let scene = body.scene(tissue(EXP), &held(&body));
    let mut rest = rest_of(&scene);
    let critical = tled::critical_step(&scene, &mut rest).unwrap();
    let push = [NodalForce { node: 94, newton: [0.01, 0.0, 0.0], ramp: 0.0 }];
    let loads = Loads::new(&scene, [0.0; 3], &push, &[]).unwrap();
    let finite = |state: &VecState| state.displacements().iter().all(|u| u.to_array().iter().all(|x| x.is_finite()));
    let storage = vec![NodeVector::ZERO; vectors_for(body.points.len(), true)];
    Run::new("weights", 4_000).each(|dice| {
        let mut bytes = changes.input(dice);
        if !dice.one_in(10) {
            mend(&mut bytes);
        }
        let memory = Memory::of(&bytes);
        let at = if dice.one_in(50) { dice.below(9).min(bytes.len()) } else { 0 };
        let (parsed, taken) = measured(|| Network::parse(&memory.bytes()[at..]));
        assert_eq!(taken, 0);
        let network = match parsed {
            Ok(network) => network,
            Err(error) => {
                assert!(error.to_string().len() > 4, "{error:?}");
                return false;
            }
        };
        predict(&network, dice);
        assert!(network.recipe().text.len() <= bytes.len());
        let mut state = rest.clone();
        let recipe = *network.recipe();
        if let Ok(mut learned) = LearnedStep::new(network, dice.one_in(2), &mut storage.clone()[..])
            && let Ok(exact) = Step::new(recipe.step / 10.0, recipe.damping, critical)
        {
            for _ in 0..5 {
                match learned.step(scene.view(), &loads, state.view(), &exact) {
                    Ok(status) if status.is_taken() => assert!(finite(&state), "{status:?}"),
                    Ok(status) => assert!(matches!(status, Status::Diverged(_))),
                    Err(error) => assert!(!error.to_string().is_empty()),
                }
            }
        }
        true
    });
}

#[test]
fn exports() {
    let mut sound = data(&[".safetensors"]);
    sound.extend(self::sound().iter().filter_map(|bytes| {
        let memory = Memory::of(bytes);
        supple::mlp::to_safetensors(&Network::parse(memory.bytes()).ok()?).ok()
    }));
    let words: &[&[u8]] = &[
        b"\"F32\"",
        b"\"shape\":[",
        b"\"data_offsets\":[0,",
        b"__metadata__",
        b"\"first.0.weight\":",
        b"[[",
        b"{\"a\":",
    ];
    let changes = Changes { sound: &sound, words, most: 20_000 };
    Run::new("safetensors", 4_000).each(|dice| {
        let mut bytes = changes.input(dice);
        if !dice.one_in(5) && bytes.len() > 8 {
            // The header's length, wherever the changes have put its end.
            let end = bytes.windows(2).rposition(|window| window == b"}}").map_or(8, |at| at + 2).max(8);
            bytes[..8].copy_from_slice(&(end as u64 - 8).to_le_bytes());
        }
        let (made, memory) = measured(|| from_safetensors(&bytes));
        assert!(memory <= BYTES * bytes.len() as u64 + ANY, "{memory} bytes for {}", bytes.len());
        match made {
            Ok(weights) => {
                let memory = Memory::of(&weights);
                predict(&Network::parse(memory.bytes()).expect("what was made can be read"), dice);
                true
            }
            Err(error) => {
                assert!(error.to_string().len() > 4, "{error:?}");
                false
            }
        }
    });
}
