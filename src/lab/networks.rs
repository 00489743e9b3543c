//! The networks that come with the crate (`weights/`), where they can be read in place.

/// Weight files at multiples of 64 bytes, as their arrays ask.
#[repr(C, align(64))]
struct Aligned<B: ?Sized>(B);

macro_rules! file {
    ($name:literal) => {{
        static FILE: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!("../../weights/", $name)));
        &FILE.0
    }};
}

/// Networks of the learned step.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Size {
    /// The paper's, 119 k multiply-adds a vertex.
    Paper,
    /// 6.2 k.
    Compact,
}

/// Steps over [`super::DT`], each with the paper's and the compact network.
static LEARNED: [(u32, &[u8], &[u8]); 4] = [
    (10, file!("paper-10.weights"), file!("compact-10.weights")),
    (20, file!("paper-20.weights"), file!("compact-20.weights")),
    (50, file!("paper-50.weights"), file!("compact-50.weights")),
    (100, file!("paper-100.weights"), file!("compact-100.weights")),
];

/// Steps over [`super::DT`] that there are networks for.
pub fn multiples() -> impl Iterator<Item = u32> {
    LEARNED.iter().map(|(multiple, ..)| *multiple)
}

/// The weight file of a network for so many times [`super::DT`].
#[must_use]
pub fn learned(size: Size, multiple: u32) -> Option<&'static [u8]> {
    let (_, paper, compact) = LEARNED.iter().find(|(of, ..)| *of == multiple)?;
    Some(match size {
        Size::Paper => paper,
        Size::Compact => compact,
    })
}

/// The weight file of the damper.
#[must_use]
pub fn damper() -> &'static [u8] {
    file!("damper.weights")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertia::Damper;
    use crate::lab::DT;
    use crate::learned::{FEATURES, PREDICTED};
    use crate::mlp::Network;

    #[test]
    fn every_file_is_a_network_of_its_kind_and_step() {
        for (size, most) in [(Size::Paper, 120_000), (Size::Compact, 6_300)] {
            for multiple in multiples() {
                let network = Network::parse(learned(size, multiple).unwrap()).unwrap();
                assert_eq!((network.inputs().len(), network.outputs().len()), (FEATURES, PREDICTED));
                assert_eq!(network.recipe().step, multiple as f32 * DT);
                assert!(network.multiply_adds() <= most, "{}", network.multiply_adds());
            }
            assert!(learned(size, 30).is_none());
        }
        assert!(Damper::new(Network::parse(damper()).unwrap()).is_ok());
    }
}
