//! How a command ends: as asked, with a simulation that diverged, or with a problem in its input.

use std::fmt;
use std::path::Path;

use supple::step::Divergence;

/// What is wrong with the input, in a sentence for the person who wrote it.
#[derive(Debug)]
pub struct Problem(pub String);

impl Problem {
    /// What the library refused.
    pub fn of(error: impl fmt::Display) -> Self {
        Self(error.to_string())
    }

    /// The same, about a file.
    pub fn in_file(path: &Path, error: impl fmt::Display) -> Self {
        Self(format!("{}: {error}", path.display()))
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// How a command ended that had no problem, for the exit code.
pub enum End {
    Reached,
    Diverged(Divergence),
}

impl From<Option<Divergence>> for End {
    fn from(divergence: Option<Divergence>) -> Self {
        divergence.map_or(Self::Reached, Self::Diverged)
    }
}
