//! Relaxation of tissue: a Prony series. Of the stress of distortion, term `i` relaxes the share `g_i` with the time
//! `tau_i` (s); the law's constants are those of a motion that is over before anything relaxes, and at rest
//! `1 - sum g_i` of the stress of distortion stays. Volume does not relax. See [`crate::element`].

use core::fmt;

/// Most terms of a series.
pub const MOST_TERMS: usize = 3;

/// The most that may relax of the stress of distortion: something has to hold the tissue.
pub(crate) const MOST_SHARE: f32 = 0.99;
/// The shortest time of relaxation, s.
pub(crate) const SHORTEST: f32 = 1e-6;
/// The longest, s.
pub(crate) const LONGEST: f32 = 1e6;

/// How a tissue relaxes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Prony {
    /// `g_i`, zero for no term; terms come before places without one.
    shares: [f32; MOST_TERMS],
    /// `1 / tau_i`, 1/s.
    rates: [f32; MOST_TERMS],
}

/// What is wrong with a series.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PronyError {
    /// More terms than there is room for.
    Count {
        /// Terms given.
        terms: usize,
    },
    /// A share that is not a positive number.
    Share {
        /// Its term.
        term: usize,
        /// The share.
        value: f32,
    },
    /// A time that is not between a microsecond and a million seconds.
    Seconds {
        /// Its term.
        term: usize,
        /// The time, s.
        value: f32,
    },
    /// All shares together leave nothing.
    Sum {
        /// Their sum.
        value: f32,
    },
}

impl fmt::Display for PronyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count { terms } => write!(f, "{terms} terms of relaxation: at most {MOST_TERMS} are possible"),
            Self::Share { term, value } => {
                write!(f, "term {term} of the relaxation has the share {value}: it must be a positive number")
            }
            Self::Seconds { term, value } => {
                write!(
                    f,
                    "term {term} of the relaxation has the time {value} s: it must be from {SHORTEST} to {LONGEST} s"
                )
            }
            Self::Sum { value } => {
                write!(
                    f,
                    "the shares of the relaxation add up to {value}: at most {MOST_SHARE} of the stress may relax"
                )
            }
        }
    }
}

impl core::error::Error for PronyError {}

/// Shares and times, for people.
impl fmt::Display for Prony {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let terms = self.shares.iter().zip(&self.rates).take(self.terms());
        for (term, (share, rate)) in terms.enumerate() {
            let comma = if term > 0 { ", " } else { "" };
            write!(f, "{comma}{:.1} % in {:.3e} s", 100.0 * share, 1.0 / rate)?;
        }
        Ok(())
    }
}

impl Prony {
    /// Nothing relaxes.
    pub const NONE: Self = Self { shares: [0.0; MOST_TERMS], rates: [0.0; MOST_TERMS] };

    /// A series of terms, each a share and a time (s).
    pub fn new(terms: &[[f32; 2]]) -> Result<Self, PronyError> {
        let mut series = Self::NONE;
        if terms.len() > MOST_TERMS {
            return Err(PronyError::Count { terms: terms.len() });
        }
        let places = series.shares.iter_mut().zip(&mut series.rates);
        for ((term, &[share, seconds]), (to_share, to_rate)) in terms.iter().enumerate().zip(places) {
            if !(share > 0.0 && share.is_finite()) {
                return Err(PronyError::Share { term, value: share });
            }
            if !(SHORTEST..=LONGEST).contains(&seconds) {
                return Err(PronyError::Seconds { term, value: seconds });
            }
            (*to_share, *to_rate) = (share, 1.0 / seconds);
        }
        let value = series.relaxed();
        if value > MOST_SHARE { Err(PronyError::Sum { value }) } else { Ok(series) }
    }

    /// Number of terms.
    #[must_use]
    pub fn terms(&self) -> usize {
        self.shares.iter().filter(|&&share| share > 0.0).count()
    }

    /// Share of the stress of distortion that is relaxed in the end.
    #[must_use]
    pub fn relaxed(&self) -> f32 {
        self.shares.iter().sum()
    }

    /// `g_i`.
    #[inline(always)]
    pub(crate) fn share(&self, term: usize) -> f32 {
        self.shares[term % MOST_TERMS]
    }

    /// `1 / tau_i`, 1/s.
    #[inline(always)]
    pub(crate) fn rate(&self, term: usize) -> f32 {
        self.rates[term % MOST_TERMS]
    }
}
