//! What evaluations add to a report: one part each, in a page that `supple_cli::report` makes.
//!
//! | module | what it holds |
//! |---|---|
//! | `methods`, `peers` | speed against error, error over time, the paper's figures |
//! | `physics` | error against nature over computing time |
//! | `hard` | hard cases: errors and estimates |

pub(crate) mod hard;
pub(crate) mod methods;
pub(crate) mod peers;
pub(crate) mod physics;

/// The names of the parts, in their order.
pub(crate) const NAMES: [&str; 3] = [methods::NAME, physics::NAME, hard::NAME];
