//! Symmetric 3 x 3 matrices, for the stiffness (N/m) or inertia (kg) of a node.

use crate::simd::Real;

/// `[[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]`, of one node or of a vector of nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Symmetric<R = f32> {
    pub(crate) xx: R,
    pub(crate) yy: R,
    pub(crate) zz: R,
    pub(crate) xy: R,
    pub(crate) yz: R,
    pub(crate) zx: R,
}

impl<R: Real> Symmetric<R> {
    /// The matrix with zero rows and columns at held axes, those without a positive inverse mass.
    #[inline(always)]
    pub(crate) fn on_free(self, [x, y, z]: [R; 3]) -> Self {
        let (x, y, z) = (x.positive(), y.positive(), z.positive());
        Self {
            xx: self.xx * x,
            yy: self.yy * y,
            zz: self.zz * z,
            xy: self.xy * x * y,
            yz: self.yz * y * z,
            zx: self.zx * z * x,
        }
    }

    /// `diagonal I + factor A`.
    #[inline(always)]
    pub(crate) fn scaled_plus(self, factor: R, diagonal: R) -> Self {
        Self {
            xx: diagonal + factor * self.xx,
            yy: diagonal + factor * self.yy,
            zz: diagonal + factor * self.zz,
            xy: factor * self.xy,
            yz: factor * self.yz,
            zx: factor * self.zx,
        }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: &Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            yy: self.yy + other.yy,
            zz: self.zz + other.zz,
            xy: self.xy + other.xy,
            yz: self.yz + other.yz,
            zx: self.zx + other.zx,
        }
    }

    /// `factor A`.
    #[inline(always)]
    pub(crate) fn scaled(self, factor: R) -> Self {
        self.scaled_plus(factor, R::splat(0.0))
    }

    #[inline(always)]
    pub(crate) fn trace(&self) -> R {
        self.xx + self.yy + self.zz
    }

    /// A close upper bound of the largest eigenvalue of a positive semidefinite matrix, by Newton's iteration on the
    /// characteristic polynomial. It starts above the largest root, where the polynomial is convex, so no iterate falls
    /// below the root. Zero or NaN if the trace is zero or NaN.
    #[inline(always)]
    pub(crate) fn largest_eigenvalue(&self) -> R {
        let (one, two, three) = (R::splat(1.0), R::splat(2.0), R::splat(3.0));
        let mean = self.trace().divide(three);
        // The matrix divided by the mean of its diagonal, minus the identity.
        let scaled = |entry: R| entry.divide(mean);
        let (a, b, c) = (scaled(self.xx) - one, scaled(self.yy) - one, scaled(self.zz) - one);
        let (d, e, f) = (scaled(self.xy), scaled(self.yz), scaled(self.zx));
        let q = (a * a + b * b + c * c + two * (d * d + e * e + f * f)).divide(R::splat(6.0));
        let determinant = a * (b * c - e * e) - d * (d * c - e * f) + f * (d * e - b * f);
        // The roots of t^3 - 3 q t - determinant; none is above 2 sqrt q.
        let mut root = two * q.root();
        for _ in 0..4 {
            let slope = three * (root * root - q);
            let next = root - (root * (root * root - three * q) - determinant).divide(slope);
            root = (slope - R::splat(1e-6)).choose(next.min(root), root);
        }
        mean.choose(mean * (one + root), mean)
    }
}

#[cfg(test)]
mod tests {
    use super::Symmetric;

    #[test]
    fn eigenvalue_of_a_stiff_direction() {
        // 2 I + 1e4 n n^T: largest eigenvalue 10002
        let n = [0.48f32, 0.6, 0.64];
        let rank = Symmetric {
            xx: n[0] * n[0],
            yy: n[1] * n[1],
            zz: n[2] * n[2],
            xy: n[0] * n[1],
            yz: n[1] * n[2],
            zx: n[2] * n[0],
        };
        let matrix = rank.scaled_plus(1e4, 2.0);
        let largest = matrix.largest_eigenvalue();
        assert!((10_001.9..10_003.0).contains(&largest), "{largest}");
    }
}
