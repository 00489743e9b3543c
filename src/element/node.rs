//! The mass of a node (kg) and its held axes.

use bytemuck::{Pod, Zeroable};
use glam::{BVec4A, Vec4};

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

/// Of a node whose elements are all removed, kg: no real node has it (2^-60, a cube of water of 0.1 um). Its square and
/// the inverse of that are still numbers.
const ALONE: f32 = 8.673_617_4e-19;

impl NodeInertia {
    /// A node without mass.
    pub const EMPTY: Self = Self { inverse: [0.0; 3], mass: 0.0 };

    /// The axes along which it moves; not the fourth one.
    #[inline(always)]
    pub(crate) fn free_axes(&self) -> BVec4A {
        let [x, y, z] = self.inverse;
        Vec4::new(x, y, z, 0.0).cmpgt(Vec4::ZERO)
    }

    /// Ones along these.
    #[inline(always)]
    pub(crate) fn free(&self) -> Vec4 {
        Vec4::select(self.free_axes(), Vec4::ONE, Vec4::ZERO)
    }

    /// How many axes are held.
    pub(crate) fn held_count(&self) -> usize {
        self.inverse.iter().filter(|&&inverse| inverse <= 0.0).count()
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

    /// Marks a node of an element that can move.
    pub(crate) fn mark_neighbour(&mut self) {
        self.mass = 1.0;
    }

    /// Whether the node is marked as fixed, and not as one of an element that can move.
    pub(crate) fn is_left_out(&self) -> bool {
        self.is_marked_fixed() && self.mass == 0.0
    }

    /// Forgets the tissues of the node. While a scene is being built the mass holds
    /// the lowest two, as bits; tissues have indices below 65,535.
    pub(crate) fn clear_regions(&mut self) {
        self.mass = f32::from_bits(u32::MAX);
    }

    /// Notes a tissue of the node.
    pub(crate) fn add_region(&mut self, region: u16) {
        let [lowest, second] = self.regions();
        let regions = match region {
            region if region == lowest || region == second => return,
            region if region < lowest => [region, lowest],
            region if region < second => [lowest, region],
            _ => return,
        };
        self.mass = f32::from_bits(u32::from(regions[0]) | u32::from(regions[1]) << 16);
    }

    fn regions(&self) -> [u16; 2] {
        let bits = self.mass.to_bits();
        [bits as u16, (bits >> 16) as u16]
    }

    /// Which of the tissues of the node this is: 0 or 1, 2 for any further one.
    pub(crate) fn slot_of_region(&self, region: u16) -> u8 {
        let [lowest, second] = self.regions();
        if region == lowest {
            0
        } else if region == second {
            1
        } else {
            2
        }
    }

    /// Gives a node without mass that of one whose elements are all removed, so that nothing divides by zero.
    pub(crate) fn leave_alone(&mut self) {
        if self.mass == 0.0 {
            self.mass = ALONE;
        }
    }

    /// Whether all elements of the node are removed.
    pub(crate) fn is_alone(&self) -> bool {
        self.mass == ALONE
    }

    /// Forgets what the mass has held so far.
    pub(crate) fn clear_mass(&mut self) {
        self.mass = 0.0;
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

    /// Adds a point mass, kg, to a node that is built.
    #[cfg(feature = "std")]
    pub(crate) fn add_mass(&mut self, kilogram: f32) {
        self.mass += kilogram;
        let inverse = 1.0 / self.mass;
        self.inverse = self.inverse.map(|free| if free > 0.0 { inverse } else { free });
    }
}
