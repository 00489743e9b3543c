//! The networks that come with the crate (`weights/`), where they can be read in place, and what they are with another
//! step written into their files.

use std::sync::OnceLock;

use supple::mlp::{Description, Network, WeightBytes, write};

/// Weight files at multiples of 64 bytes, as their arrays ask.
#[repr(C, align(64))]
struct Aligned<B: ?Sized>(B);

macro_rules! file {
    ($name:literal) => {{
        static FILE: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!("../../weights/", $name)));
        &FILE.0
    }};
}

/// Networks of the learned step, one for each of its lengths.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Family {
    /// The paper's, 119 k multiply-adds a vertex.
    Paper,
    /// 6.2 k.
    Compact,
    /// The same with int8 layers.
    CompactInt8,
    /// Each compact network at the step of the next shorter one, the shortest at the longest step: what a step that was
    /// not that of the training does.
    OtherStep,
}

/// Steps over [`super::DT`], each with the paper's network, the compact one, and that with int8 layers.
static LEARNED: [(u32, [&[u8]; 3]); 4] = [
    (10, [file!("paper-10.weights"), file!("compact-10.weights"), file!("compact-10-i8.weights")]),
    (20, [file!("paper-20.weights"), file!("compact-20.weights"), file!("compact-20-i8.weights")]),
    (50, [file!("paper-50.weights"), file!("compact-50.weights"), file!("compact-50-i8.weights")]),
    (100, [file!("paper-100.weights"), file!("compact-100.weights"), file!("compact-100-i8.weights")]),
];

/// Steps over [`super::DT`] that there are networks for.
pub fn multiples() -> impl Iterator<Item = u32> {
    LEARNED.iter().map(|(multiple, ..)| *multiple)
}

/// The weight file of a network for so many times [`super::DT`].
#[must_use]
pub fn learned(family: Family, multiple: u32) -> Option<&'static [u8]> {
    let at = LEARNED.iter().position(|(of, _)| *of == multiple)?;
    let (_, [paper, compact, int8]) = LEARNED[at];
    match family {
        Family::Paper => Some(paper),
        Family::Compact => Some(compact),
        Family::CompactInt8 => Some(int8),
        Family::OtherStep => other_step(at),
    }
}

/// The compact network of the step after that at this place, with the step of this place in its file.
fn other_step(at: usize) -> Option<&'static [u8]> {
    static FILES: OnceLock<Vec<WeightBytes>> = OnceLock::new();
    let made = |at: usize| {
        let [here, next] = [at, (at + 1) % LEARNED.len()].map(|at| Network::parse(LEARNED[at].1[1]));
        let step = here.ok()?.recipe().step;
        let described = Description { step, ..Description::of(&next.ok()?) };
        Some(WeightBytes::of(&write(&described).ok()?))
    };
    let files = FILES.get_or_init(|| (0..LEARNED.len()).filter_map(made).collect());
    files.get(at).map(WeightBytes::bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DT;
    use supple::learned::{FEATURES, PREDICTED};

    #[test]
    fn every_file_is_a_network_of_its_kind_and_step() {
        let families = [
            (Family::Paper, 120_000),
            (Family::Compact, 6_300),
            (Family::CompactInt8, 6_300),
            (Family::OtherStep, 6_300),
        ];
        for (family, most) in families {
            for multiple in multiples() {
                let network = Network::parse(learned(family, multiple).unwrap()).unwrap();
                assert_eq!((network.inputs().len(), network.outputs().len()), (FEATURES, PREDICTED));
                assert_eq!(network.recipe().step, multiple as f32 * DT);
                assert!(network.multiply_adds() <= most, "{}", network.multiply_adds());
            }
            assert!(learned(family, 30).is_none());
        }
    }
}
