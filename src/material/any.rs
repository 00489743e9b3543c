//! A law that is known only when a file or a host has named it: one of the list (`for_each_law!`).

use core::fmt;

use super::{Constant, Law, Moduli, Potential, Values};
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
        enum Position { $($variant,)* }

        /// Constants of any of the laws. For one element at a time: loops over elements are compiled for each law.
        #[doc(hidden)]
        #[derive(Clone, Copy)]
        pub enum AnyWide<R: Real> {
            $($variant(<$law as Law>::Wide<R>),)*
        }

        impl AnyLaw {
            /// Every law, its constants zero.
            pub fn all() -> impl Iterator<Item = Self> {
                [$(Self::$variant(<$law>::default()),)*].into_iter()
            }

            /// Its number in weight files: twice the position in the list of laws. The odd numbers were the laws as the paper prints
            /// them.
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

            fn with(&self, values: Values) -> Self {
                match self {
                    $(Self::$variant(law) => Self::$variant(law.with(values)),)*
                }
            }

            fn values(&self) -> Values {
                match self {
                    $(Self::$variant(law) => law.values(),)*
                }
            }

            fn widen<R: Real>(at: impl Fn(usize) -> Self) -> AnyWide<R> {
                match at(0) {
                    $(Self::$variant(law) => AnyWide::$variant(<$law>::widen(|lane| law.with(at(lane).values()))),)*
                }
            }

            fn energy(&self, x: f64, j: f64) -> f64 {
                match self {
                    $(Self::$variant(law) => law.energy(x, j),)*
                }
            }
        }

        impl<R: Real> Potential<R> for AnyWide<R> {
            fn distortion_slope(&self, x: R) -> R {
                match self {
                    $(Self::$variant(law) => law.distortion_slope(x),)*
                }
            }

            fn distortion_curvature(&self, x: R, slope: R) -> R {
                match self {
                    $(Self::$variant(law) => law.distortion_curvature(x, slope),)*
                }
            }

            fn bulk_modulus(&self) -> R {
                match self {
                    $(Self::$variant(law) => law.bulk_modulus(),)*
                }
            }

            fn saturation(&self, x: R) -> R {
                match self {
                    $(Self::$variant(law) => law.saturation(x),)*
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
