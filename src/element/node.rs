//! The mass of a node (kg) and its held axes.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use crate::padding;

/// Coordinate axes, as a set.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub struct Axes(u8);

impl Axes {
    /// Along x.
    pub const X: Self = Self(1);
    /// Along y.
    pub const Y: Self = Self(2);
    /// Along z.
    pub const Z: Self = Self(4);
    /// All three.
    pub const XYZ: Self = Self(7);
    /// None.
    pub const NONE: Self = Self(0);

    /// Axes in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// From bits: 1 for x, 2 for y, 4 for z.
    pub(crate) const fn from_bits(bits: u8) -> Self {
        Self(bits & 7)
    }

    /// Whether axis 0, 1 or 2 (x, y, z) is in the set.
    #[must_use]
    pub const fn has(self, axis: usize) -> bool {
        axis < 3 && self.0 >> axis & 1 == 1
    }
}

/// Mass of a node (kg) and its inverse along each axis (1/kg), zero along held ones.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct NodeInertia {
    pub(crate) inverse: [f32; 3],
    pub(crate) mass: f32,
}

/// While a scene is being built `inverse` holds one of these marks for each axis.
const FREE: f32 = 0.0;
const FIXED: f32 = 1.0;
const MOVED: f32 = 2.0;

impl NodeInertia {
    /// A node without mass.
    pub const EMPTY: Self = Self { inverse: [0.0; 3], mass: 0.0 };

    /// Ones along free axes; the fourth number is zero.
    #[inline(always)]
    pub(crate) fn free(&self) -> Vec4 {
        let [x, y, z] = self.inverse;
        Vec4::select(Vec4::new(x, y, z, 0.0).cmpgt(Vec4::ZERO), Vec4::ONE, Vec4::ZERO)
    }

    /// Held axes.
    pub(crate) fn held(&self) -> Axes {
        self.axes_where(|inverse| inverse == 0.0)
    }

    /// Held axes that motions may move.
    pub(crate) fn movable(&self) -> Axes {
        self.axes_where(padding::is_movable)
    }

    fn axes_where(&self, is: impl Fn(f32) -> bool) -> Axes {
        let axes = self.inverse.iter().enumerate().filter(|(_, value)| is(**value));
        Axes::from_bits(axes.fold(0, |bits, (axis, _)| bits | 1 << axis))
    }

    /// Marks axes as held, by a support that moves or stands still: of several, one that moves wins.
    pub(crate) fn mark(&mut self, axes: Axes, moves: bool) {
        let new = if moves { MOVED } else { FIXED };
        for (axis, mark) in self.inverse.iter_mut().enumerate() {
            if axes.has(axis) && *mark < new {
                *mark = new;
            }
        }
    }

    /// Whether all axes are marked as held by supports that stand still.
    pub(crate) fn is_marked_fixed(&self) -> bool {
        self.inverse == [FIXED; 3]
    }

    /// Turns the marks into the inverse of the mass.
    pub(crate) fn invert(&mut self) {
        let inverse = 1.0 / self.mass;
        self.inverse = self.inverse.map(|mark| match mark {
            FREE => inverse,
            MOVED => padding::MOVABLE,
            _ => 0.0,
        });
    }
}
