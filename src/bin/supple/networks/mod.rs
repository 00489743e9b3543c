//! Networks: training, conversion of their files.

pub(crate) mod convert;
#[cfg(feature = "train")]
mod exemplar;
#[cfg(feature = "train")]
mod quantise;
#[cfg(feature = "train")]
pub(crate) mod train;
