//! A law that is known only when a file or a host has named it: the laws of the list (`for_each_law!`) and the paper's literal
//! forms.

use core::fmt;

use super::{Constant, Exponential, Law, Literal, MAX_CONSTANTS, Moduli, NeoHookean};

macro_rules! any_law {
    ($($variant:ident: $law:ty,)*) => {
        /// Any of the laws, with its constants.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum AnyLaw {
            $(
                #[doc = concat!("See [`", stringify!($variant), "`](super::", stringify!($variant), ").")]
                $variant($law),
            )*
            /// The neo-Hookean law as the paper prints it.
            LiteralNeoHookean(Literal<NeoHookean>),
            /// The exponential law as the paper prints it.
            LiteralExponential(Literal<Exponential>),
        }

        /// Positions in the list.
        enum Position { $($variant,)* }

        impl AnyLaw {
            /// Every law, its constants zero.
            pub fn all() -> impl Iterator<Item = Self> {
                [
                    $(Self::$variant(<$law>::default()),)*
                    Self::LiteralNeoHookean(Literal::default()),
                    Self::LiteralExponential(Literal::default()),
                ]
                .into_iter()
            }

            /// Its number in weight files: twice the position in the list of laws, one more for the literal form.
            #[must_use]
            pub const fn code(&self) -> u32 {
                match self {
                    $(Self::$variant(_) => 2 * Position::$variant as u32,)*
                    Self::LiteralNeoHookean(_) => 2 * Position::NeoHookean as u32 + 1,
                    Self::LiteralExponential(_) => 2 * Position::Exponential as u32 + 1,
                }
            }

            /// Its name in scene files and weight files.
            #[must_use]
            pub const fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => <$law>::NAME,)*
                    Self::LiteralNeoHookean(_) => Literal::<NeoHookean>::NAME,
                    Self::LiteralExponential(_) => Literal::<Exponential>::NAME,
                }
            }

            /// Names and units of its constants.
            #[must_use]
            pub const fn constants(&self) -> &'static [Constant] {
                match self {
                    $(Self::$variant(_) => <$law>::CONSTANTS,)*
                    Self::LiteralNeoHookean(_) => NeoHookean::CONSTANTS,
                    Self::LiteralExponential(_) => Exponential::CONSTANTS,
                }
            }

            /// Their values, zeros beyond [`AnyLaw::constants`].
            #[must_use]
            pub fn values(&self) -> [f32; MAX_CONSTANTS] {
                match self {
                    $(Self::$variant(law) => law.constants(),)*
                    Self::LiteralNeoHookean(law) => law.constants(),
                    Self::LiteralExponential(law) => law.constants(),
                }
            }

            /// Its moduli at rest.
            #[must_use]
            pub fn moduli(&self) -> Moduli {
                match self {
                    $(Self::$variant(law) => Moduli::of(law),)*
                    Self::LiteralNeoHookean(law) => Moduli::of(law),
                    Self::LiteralExponential(law) => Moduli::of(law),
                }
            }

            /// The same law with other constants.
            #[must_use]
            pub fn with(&self, values: [f32; MAX_CONSTANTS]) -> Self {
                match self {
                    $(Self::$variant(_) => Self::$variant(<$law>::from_constants(values)),)*
                    Self::LiteralNeoHookean(_) => Self::LiteralNeoHookean(Literal::from_constants(values)),
                    Self::LiteralExponential(_) => Self::LiteralExponential(Literal::from_constants(values)),
                }
            }
        }

        $(
            impl From<$law> for AnyLaw {
                fn from(law: $law) -> Self {
                    Self::$variant(law)
                }
            }
        )*
    };
}
for_each_law!(any_law);

/// Name and constants, for people.
impl fmt::Display for AnyLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        for (Constant { name, unit }, value) in self.constants().iter().zip(self.values()) {
            write!(f, ", {name} {value}")?;
            if !unit.is_empty() {
                write!(f, " {unit}")?;
            }
        }
        Ok(())
    }
}
