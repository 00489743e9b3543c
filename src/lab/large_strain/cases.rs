//! What is done to a cube of 40 mm, in the middle of its coordinates (m), and its grids, six tetrahedra a cell. The
//! truth is of a part of the cube only: mirror planes stand in for the rest.

use supple::loads::Motion;
use supple::material::{AnyLaw, Exponential, NeoHookean};
use supple::mesh::Bar;
use supple::scene::{Axes, Support};

/// Edge of the cube, m.
pub(super) const EDGE: f64 = 0.04;
/// Half of the patch over the edge: it is a third of the cube wide, as cells are if there is a multiple of three.
const HALF_PATCH: f64 = 1.0 / 6.0;
/// Shear modulus at rest, Pa, and Poisson's ratio of both tissues.
const SHEAR: f64 = 1000.0;
const POISSON: f64 = 0.49;
/// Of places, m.
const ROUNDING: f64 = 1e-7;

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Case {
    /// Upper and lower face, which are bonded to plates, towards each other, by a share of the height.
    Compression,
    /// The same sideways.
    Shear,
    /// A bonded square in the middle of the upper face into the cube, by a share of half its height; the lower face is
    /// fixed.
    Indentation,
}

impl Case {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Compression, Self::Shear, Self::Indentation];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Compression => "compression",
            Self::Shear => "shear",
            Self::Indentation => "indentation",
        }
    }

    /// The axis of motion and force.
    pub(super) const fn axis(self) -> usize {
        if matches!(self, Self::Shear) { 0 } else { 2 }
    }

    /// How far supports move against each other at a share of one, m.
    pub(super) const fn way(self) -> f64 {
        if matches!(self, Self::Indentation) { 0.5 * EDGE } else { EDGE }
    }

    /// Along which axes one half of the cube mirrors the other.
    const fn mirrors(self) -> [bool; 3] {
        match self {
            Self::Compression => [true; 3],
            Self::Shear => [false, true, false],
            Self::Indentation => [true, true, false],
        }
    }

    /// How a node is moved at a share of one, if it is, m.
    fn motion(self, [x, y, z]: [f64; 3]) -> Option<[f64; 3]> {
        let (half, is_at) = (0.5 * EDGE, |a: f64, b: f64| (a - b).abs() < ROUNDING);
        let under = |x: f64| x.abs() < HALF_PATCH * EDGE + ROUNDING;
        match self {
            Self::Compression if is_at(z.abs(), half) => Some([0.0, 0.0, -half * z.signum()]),
            Self::Shear if is_at(z.abs(), half) => Some([half * z.signum(), 0.0, 0.0]),
            Self::Indentation if is_at(z, half) && under(x) && under(y) => Some([0.0, 0.0, -half]),
            Self::Indentation if is_at(z, -half) => Some([0.0; 3]),
            _ => None,
        }
    }

    /// How deep a free node that has come to such a place (m) at a share is within a plate, or within the column that
    /// would push the patch, m.
    pub(super) fn depth(self, [x, y, z]: [f64; 3], share: f64) -> f64 {
        let half = 0.5 * EDGE;
        let depth = match self {
            Self::Compression => z.abs() - half * (1.0 - share),
            Self::Shear => z.abs() - half,
            Self::Indentation => (z - half * (1.0 - share)).min(HALF_PATCH * EDGE - x.abs().max(y.abs())),
        };
        depth.max(0.0)
    }
}

/// The tissues: of the same moduli at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// Does not stiffen.
    NeoHookean,
    /// Stiffens by [`Plan::stiffening`](super::Plan::stiffening).
    Exponential,
}

impl Law {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::NeoHookean, Self::Exponential];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        if matches!(self, Self::NeoHookean) { "neo-Hookean" } else { "exponential" }
    }

    pub(super) fn with_constants(self, b: f32) -> AnyLaw {
        let d = (SHEAR * (1.0 + POISSON) / (3.0 * (1.0 - 2.0 * POISSON))) as f32;
        match self {
            Self::NeoHookean => NeoHookean { c: 0.5 * SHEAR as f32, d }.into(),
            Self::Exponential => Exponential { a: SHEAR as f32, b, d }.into(),
        }
    }
}

/// The cube or the part of it between mirror planes.
pub(super) struct Body {
    pub(super) case: Case,
    pub(super) points: Vec<[f32; 3]>,
    pub(super) tets: Vec<[u32; 4]>,
    pub(super) supports: Vec<Support>,
    /// At a share of one.
    motions: Vec<Motion>,
    /// The nodes whose force is measured.
    pub(super) pushed: Vec<u32>,
    /// Of how many such parts the force is the sum.
    pub(super) parts: f64,
}

impl Body {
    /// With so many cells across the whole cube, an even number for the part.
    pub(super) fn new(case: Case, across: u32, is_part: bool) -> Self {
        let mirrors = case.mirrors().map(|mirror| mirror && is_part);
        let grid = Bar { size: [1.0; 3], cells: mirrors.map(|mirror| if mirror { across / 2 } else { across }) };
        let place = |share: f32, axis: usize| {
            let index = (share * grid.cells[axis] as f32).round();
            let from = if mirrors[axis] { 0.0 } else { -0.5 };
            EDGE * (f64::from(index) / f64::from(across) + from)
        };
        let places: Vec<[f64; 3]> = grid.points().map(|p| [0, 1, 2].map(|axis| place(p[axis], axis))).collect();
        let (mut supports, mut motions, mut pushed) = (Vec::new(), Vec::new(), Vec::new());
        for (node, at) in (0..).zip(&places) {
            for (axis, axes) in [Axes::X, Axes::Y, Axes::Z].into_iter().enumerate() {
                if mirrors[axis] && at[axis] < ROUNDING {
                    supports.push(Support { node, axes, moves: false });
                }
            }
            if let Some(metre) = case.motion(*at) {
                supports.push(Support::moved(node));
                motions.push(Motion { node, axes: Axes::XYZ, metre: metre.map(|x| x as f32), ramp: 0.0 });
                if at[2] > 0.0 {
                    pushed.push(node);
                }
            }
        }
        let parts = mirrors[..2].iter().map(|&mirror| if mirror { 2.0 } else { 1.0 }).product();
        let points = places.into_iter().map(|place| place.map(|x| x as f32)).collect();
        Self { case, points, tets: grid.tets().collect(), supports, motions, pushed, parts }
    }

    pub(super) fn motions(&self, share: f64) -> Vec<Motion> {
        let at = |motion: &Motion| Motion { metre: motion.metre.map(|x| share as f32 * x), ..*motion };
        self.motions.iter().map(at).collect()
    }

    /// Whether no motion is prescribed to a node.
    pub(super) fn is_free(&self, node: u32) -> bool {
        self.motions.iter().all(|motion| motion.node != node)
    }
}
