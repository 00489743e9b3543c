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

/// Steps over [`super::DT`] that there are networks for.
pub const MULTIPLES: [u32; 4] = [10, 20, 50, 100];

/// The weight file of a network for so many times [`super::DT`].
#[must_use]
pub fn learned(size: Size, multiple: u32) -> Option<&'static [u8]> {
    Some(match (size, multiple) {
        (Size::Paper, 10) => file!("paper-10.weights"),
        (Size::Paper, 20) => file!("paper-20.weights"),
        (Size::Paper, 50) => file!("paper-50.weights"),
        (Size::Paper, 100) => file!("paper-100.weights"),
        (Size::Compact, 10) => file!("compact-10.weights"),
        (Size::Compact, 20) => file!("compact-20.weights"),
        (Size::Compact, 50) => file!("compact-50.weights"),
        (Size::Compact, 100) => file!("compact-100.weights"),
        _ => return None,
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
    use crate::mlp::Network;
    use crate::surrogate::{FEATURES, PREDICTED};

    #[test]
    fn every_file_is_a_network_of_its_kind_and_step() {
        for (size, most) in [(Size::Paper, 120_000), (Size::Compact, 6_300)] {
            for multiple in MULTIPLES {
                let network = Network::parse(learned(size, multiple).unwrap()).unwrap();
                assert_eq!((network.inputs().len(), network.outputs().len()), (FEATURES, PREDICTED));
                assert_eq!(network.recipe().step, multiple as f32 * DT);
                assert!(network.multiply_adds() <= most, "{}", network.multiply_adds());
            }
            assert!(learned(size, 30).is_none());
        }
        assert!(Damper::over(Network::parse(damper()).unwrap()).is_ok());
    }
}
