//! Tangents that are added to the matrix directly: those of elements in no box of cells, of crushed elements, and of
//! patches of nodal strain. First the derivatives of each function that is not zero at the nodes, then the products of
//! all pairs of them.

use glam::Vec4;

use super::assembly::{Assembly, ElementTangent, Tangent, add_four};
use super::lattice::{MAX_FUNCTIONS, node_place};

/// Most functions that are not zero at the four nodes of an element.
pub(super) const TOUCHED: usize = 32;
/// The same for a patch with nodal strain, which may have any number of nodes.
const TOUCHED_BY_PATCH: usize = MAX_FUNCTIONS;
const NOT_TOUCHED: u8 = u8::MAX;
/// For each function its index among those of the element at hand; [`NOT_TOUCHED`] for other functions, and between
/// elements.
pub(super) type Slots = [u8; MAX_FUNCTIONS];
pub(super) const NO_SLOTS: Slots = [NOT_TOUCHED; MAX_FUNCTIONS];

/// The functions that an element touches: as its nodes come, and which they are.
struct Touched<const T: usize> {
    /// Derivatives of each function along the three material axes. Their components are the spatial axes, because a
    /// function may be zero along some of these.
    gradients: [[Vec4; 3]; T],
    count: usize,
    /// A bit for each function.
    functions: u128,
}

/// The same in ascending order of the functions, because only submatrices on and below the diagonal are kept; and what
/// the products of a tangent are of.
struct Factors<const T: usize> {
    functions: [usize; T],
    images: [Vec4; T],
    slopes: [[Vec4; 3]; T],
    /// The derivative of each function along each spatial axis; components as in [`Touched`].
    derivatives: [[Vec4; 3]; T],
    count: usize,
}

impl Assembly<'_> {
    /// Adds the tangent of an element.
    #[inline(never)]
    pub(super) fn add_element(&mut self, element: &ElementTangent, slots: &mut Slots) {
        self.add_directly::<TOUCHED>(element.corners(), &element.tangent, slots);
    }

    /// Adds the tangent of a patch with these nodes and gradients.
    #[inline(never)]
    pub(super) fn add_patch(
        &mut self,
        nodes: impl Iterator<Item = (usize, [f32; 3])>,
        tangent: &Tangent,
        slots: &mut Slots,
    ) {
        self.add_directly::<TOUCHED_BY_PATCH>(nodes, tangent, slots);
    }

    /// Adds a tangent directly to the matrix; its nodes touch at most `T` functions.
    #[inline(always)]
    pub(super) fn add_directly<const T: usize>(
        &mut self,
        corners: impl Iterator<Item = (usize, [f32; 3])>,
        tangent: &Tangent,
        slots: &mut Slots,
    ) {
        // Written in place: the compiler would copy what is given back.
        let mut touched = Touched::<T>::NONE;
        self.touch(corners, slots, &mut touched);
        let mut factors = Factors::<T>::NONE;
        touched.write_factors(tangent, slots, &mut factors);
        self.add_pairs(&factors, tangent);
    }

    /// Adds the functions that nodes touch, with what the gradients at the nodes give them; their places are in `slots`
    /// then.
    #[inline(always)]
    fn touch<const T: usize>(
        &self,
        corners: impl Iterator<Item = (usize, [f32; 3])>,
        slots: &mut Slots,
        touched: &mut Touched<T>,
    ) {
        for (node, gradient) in corners {
            let (Some(at), Some(inertia)) = (node_place(self.nodes, node), self.inertia.get(node)) else {
                continue;
            };
            let free = inertia.free();
            let along = gradient.map(|slope| slope * free);
            for (function, weight) in self.lattice.weights(at) {
                let Some(slot) = slots.get_mut(function) else {
                    continue;
                };
                if weight == 0.0 {
                    continue;
                }
                if let Some(touch) = touched.gradients.get_mut(usize::from(*slot)) {
                    for (slope, along) in touch.iter_mut().zip(along) {
                        *slope += weight * along;
                    }
                } else if let Some(touch) = touched.gradients.get_mut(touched.count) {
                    *slot = touched.count as u8;
                    *touch = along.map(|along| weight * along);
                    touched.functions |= 1 << function;
                    touched.count += 1;
                }
            }
        }
    }

    /// Adds the products of all pairs of functions.
    #[inline(always)]
    fn add_pairs<const T: usize>(&mut self, factors: &Factors<T>, tangent: &Tangent) {
        let Factors { functions, images, slopes, derivatives, count } = factors;
        let [inner, outer, exchanged, _] = tangent.factors;
        for c in 0..*count {
            let c = c % T;
            let first = 3 * functions[c] * self.stride;
            let rows = self.matrix.get_mut(first..first + 3 * self.stride);
            let Some((row_x, rows)) = rows.and_then(|rows| rows.split_at_mut_checked(self.stride)) else {
                return;
            };
            let Some((row_y, row_z)) = rows.split_at_mut_checked(self.stride) else {
                return;
            };
            let [x, y, z] = slopes[c].map(|slope| inner * slope);
            let image = outer * images[c];
            // Row `i` of the submatrix gets `d_j phi_c` for axis `i` times `d_i phi_d` for axis `j`.
            let [dx, dy, dz] = derivatives[c].map(|derivative| exchanged * derivative);
            let row_of = |axis: usize| Vec4::new(dx[axis], dy[axis], dz[axis], 0.0);
            let exchanged_rows = [row_of(0), row_of(1), row_of(2)];
            // A submatrix is added with four columns, the last of zeros in the next submatrix. That would then have to
            // wait for the cache. So every second submatrix is added first.
            for d in (0..=c).step_by(2).chain((1..=c).step_by(2)) {
                let d = d % T;
                let diagonal = x * slopes[d][0] + y * slopes[d][1] + z * slopes[d][2];
                let column = 3 * functions[d];
                let [ex, ey, ez] = exchanged_rows;
                let [px, py, pz] = derivatives[d];
                add_four(row_x, column, image.x * images[d] + ex * px + diagonal * Vec4::X);
                add_four(row_y, column, image.y * images[d] + ey * py + diagonal * Vec4::Y);
                add_four(row_z, column, image.z * images[d] + ez * pz + diagonal * Vec4::Z);
            }
        }
    }
}

impl<const T: usize> Factors<T> {
    const NONE: Self = Self {
        functions: [0; T],
        images: [Vec4::ZERO; T],
        slopes: [[Vec4::ZERO; 3]; T],
        derivatives: [[Vec4::ZERO; 3]; T],
        count: 0,
    };
}

impl<const T: usize> Touched<T> {
    const NONE: Self = Self { gradients: [[Vec4::ZERO; 3]; T], count: 0, functions: 0 };

    /// Writes what the products of a tangent are of, in ascending order of the functions; `slots` are empty again then.
    #[inline(always)]
    fn write_factors(&self, tangent: &Tangent, slots: &mut Slots, factors: &mut Factors<T>) {
        let [cx, cy, cz] = tangent.columns.map(Vec4::from);
        let mut bits = self.functions;
        factors.count = self.count;
        for place in 0..self.count {
            let function = bits.trailing_zeros() as usize;
            bits &= bits.wrapping_sub(1);
            let Some(slot) = slots.get_mut(function) else { continue };
            let [x, y, z] = self.gradients.get(usize::from(*slot)).copied().unwrap_or_default();
            *slot = NOT_TOUCHED;
            let along = |axis: usize| cx[axis] * x + cy[axis] * y + cz[axis] * z;
            let derivatives = [along(0), along(1), along(2)];
            factors.functions[place % T] = function;
            factors.images[place % T] = cx * x + cy * y + cz * z;
            factors.derivatives[place % T] = derivatives;
            factors.slopes[place % T] = if tangent.is_spatial() { derivatives } else { [x, y, z] };
        }
    }
}
