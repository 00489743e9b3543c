//! A law that is known only when a file or a host has named it: one of the list (`for_each_law!`).

use core::fmt;

use super::{Constant, Law, MAX_CONSTANTS, Moduli, Potential, Values};
use crate::simd::Real;

macro_rules! any_law {
    ($first:ident: $first_law:ty, $($other:ident: $other_law:ty,)*) => {
        any_law! { @ $first $first: $first_law, $($other: $other_law,)* }
    };
    (@ $first:ident $($variant:ident: $law:ty,)*) => {
        /// Any of the laws, with its constants.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum AnyLaw {
            $(
                #[doc = concat!("See [`", stringify!($variant), "`](super::", stringify!($variant), ").")]
                $variant($law),
            )*
        }

        /// Positions in the list.
        #[derive(Clone, Copy)]
        enum Position { $($variant,)* }

        /// Constants of any of the laws, scalars or vectors.
        #[doc(hidden)]
        #[derive(Clone, Copy)]
        pub struct AnyWide<R> {
            law: Position,
            constants: [R; MAX_CONSTANTS],
        }

        impl AnyLaw {
            /// Every law, its constants zero.
            pub fn all() -> impl Iterator<Item = Self> {
                [$(Self::$variant(<$law>::default()),)*].into_iter()
            }

            /// Its number in weight files: twice the position in the list of laws. The odd numbers were the laws as the
            /// paper prints them.
            #[must_use]
            pub const fn code(&self) -> u32 {
                match self {
                    $(Self::$variant(_) => 2 * Position::$variant as u32,)*
                }
            }

            /// Its moduli at rest.
            #[must_use]
            pub fn moduli(&self) -> Moduli {
                match self {
                    $(Self::$variant(law) => Moduli::of(law),)*
                }
            }
        }

        impl Default for AnyLaw {
            fn default() -> Self {
                Self::$first(Default::default())
            }
        }

        impl Law for AnyLaw {
            type Wide<R: Real> = AnyWide<R>;

            fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(law) => law.name(),)*
                }
            }

            fn constants(&self) -> &'static [Constant] {
                match self {
                    $(Self::$variant(law) => law.constants(),)*
                }
            }

            fn operations(&self) -> u32 {
                match self {
                    $(Self::$variant(law) => law.operations(),)*
                }
            }

            #[inline(always)]
            fn with(&self, values: Values) -> Self {
                match self {
                    $(Self::$variant(law) => Self::$variant(law.with(values)),)*
                }
            }

            #[inline(always)]
            fn values(&self) -> Values {
                match self {
                    $(Self::$variant(law) => law.values(),)*
                }
            }

            #[inline(always)]
            fn widen<R: Real>(&self, constants: [R; MAX_CONSTANTS]) -> AnyWide<R> {
                let law = match self {
                    $(Self::$variant(_) => Position::$variant,)*
                };
                AnyWide { law, constants }
            }

            fn energy(&self, x: f64, j: f64) -> f64 {
                match self {
                    $(Self::$variant(law) => law.energy(x, j),)*
                }
            }
        }

        impl<R: Real> Potential<R> for AnyWide<R> {
            #[inline(always)]
            fn of(constants: [R; MAX_CONSTANTS]) -> Self {
                Self { law: Position::$first, constants }
            }

            #[inline(always)]
            fn distortion_slope(&self, x: R) -> R {
                match self.law {
                    $(Position::$variant => <$law as Law>::Wide::<R>::of(self.constants).distortion_slope(x),)*
                }
            }

            #[inline(always)]
            fn distortion_curvature(&self, x: R, slope: R) -> R {
                match self.law {
                    $(Position::$variant => <$law as Law>::Wide::<R>::of(self.constants).distortion_curvature(x, slope),)*
                }
            }

            #[inline(always)]
            fn bulk_modulus(&self) -> R {
                match self.law {
                    $(Position::$variant => <$law as Law>::Wide::<R>::of(self.constants).bulk_modulus(),)*
                }
            }

            #[inline(always)]
            fn at(&self, x: R) -> [R; 3] {
                match self.law {
                    $(Position::$variant => <$law as Law>::Wide::<R>::of(self.constants).at(x),)*
                }
            }

            #[inline(always)]
            fn saturation(&self, x: R) -> R {
                match self.law {
                    $(Position::$variant => <$law as Law>::Wide::<R>::of(self.constants).saturation(x),)*
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
