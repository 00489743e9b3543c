//! Pressure (Pa) on parts of the surface that follows them as they move: breathing, inflation, a pneumoperitoneum. A
//! triangle with corners `a`, `b`, `c` where they are now, seen from outside counter-clockwise, bears
//!
//! ```text
//! f = -p / 6 (b - a) x (c - a)      at each corner, N
//! ```
//! a third of pressure times area each, against the outward normal: a positive pressure presses the tissue, from outside
//! or from within a cavity. The forces on a closed surface have no sum and no moment. They are taken at the start of a
//! step, as all forces are, and their work `f . b` enters the energy balance ([`crate::step::EnergyBalance`]).
//!
//! **Organs that fill.** With a volume `V*` (m^3) that a closed surface shall have, and a stiffness `B` (Pa), the pressure
//! within, which acts in addition, is `B (V* - V) / V*`. At rest the volume is short of `V*` by the pressure that the
//! tissue needs over `B`. It is taken at the start of a step as well, so that `B` is bounded by the step `h`, with the
//! area `g` of each node (m^2, a vector) and its mass `m`:
//!
//! ```text
//! B sum |g|^2 / m < V* (2 / h)^2 / 5
//! ```
//! of which exact steps have the margin: five times Young's modulus of the wall is within it for a shell as thick as its
//! cavity. With too much the motion grows until the energy balance refuses a step.
//!
//! The stiffness of a pressure that follows is about `p` times a length, that of tissue `E` times it, and the bound of
//! [`crate::tled::critical_step`] knows nothing of it: pressures up to a tenth of Young's modulus are within the margin
//! that exact steps have. A pressure that moves a node by more than the size of its tissue in one step is refused.

use glam::Vec3;

#[cfg(any(feature = "std", test))]
use crate::loads::Loads;
use crate::loads::{FARTHEST, LoadError, ramp_factor};
#[cfg(any(feature = "std", test))]
use crate::mesh::{faces, in_order};
use crate::scene::AsScene;
use crate::simd::NodeVector;

/// A triangle of the surface that bears a pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct PressedTriangle {
    nodes: [u32; 3],
    surface: u32,
    /// Of the first corner at rest, m.
    corner: [f32; 3],
    /// From there to the others at rest, m.
    edges: [[f32; 3]; 2],
}

/// The pressure on a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct SurfacePressure {
    /// Full pressure, Pa: positive where it presses the tissue.
    pub pascal: f32,
    /// Ramp, s ([`crate::loads::ramp_factor`]).
    pub ramp: f32,
    /// Volume that a closed surface shall have, m^3, whichever side the tissue is on.
    pub volume: f32,
    /// With which stiffness, Pa; zero: the volume is not asked for.
    pub bulk: f32,
}

impl PressedTriangle {
    /// A triangle of surface `surface`, with the nodes in the order of [`crate::mesh::boundary`] of elements with positive volumes: seen from
    /// outside counter-clockwise. `points` are those of the body at rest, m; `index` is its place in a list, for the
    /// error.
    pub fn new(points: &[[f32; 3]], index: usize, nodes: [u32; 3], surface: u32) -> Result<Self, LoadError> {
        let corner = |node: u32| {
            let count = points.len();
            let point = points.get(node as usize).copied();
            point.map(Vec3::from_array).ok_or(LoadError::Node { kind: "pressure triangle", index, node, nodes: count })
        };
        let [a, b, c] = nodes;
        let (a, b, c) = (corner(a)?, corner(b)?, corner(c)?);
        let edges = [b - a, c - a].map(|edge| edge.to_array());
        let mut values = [a, b, c].into_iter().flat_map(|point| point.to_array());
        let value = values.find(|value| value.is_nan() || value.abs() > FARTHEST);
        match value {
            Some(value) => Err(LoadError::NotFinite { kind: "pressure triangle", index, value }),
            None => Ok(Self { nodes, surface, corner: a.to_array(), edges }),
        }
    }

    /// Its surface.
    #[cfg(feature = "capi-neo-hookean")]
    pub(crate) const fn surface(&self) -> u32 {
        self.surface
    }

    /// Its nodes.
    #[must_use]
    pub const fn nodes(&self) -> [u32; 3] {
        self.nodes
    }

    /// Where the first corner is, and the others from there, m.
    #[inline(always)]
    fn placed(&self, displacement: &[NodeVector]) -> [Vec3; 3] {
        let moved = |node: u32| {
            displacement.get(node as usize).map_or(Vec3::ZERO, |&NodeVector([x, y, z, _])| Vec3::new(x, y, z))
        };
        let [a, b, c] = self.nodes.map(moved);
        let [to_b, to_c] = self.edges.map(Vec3::from_array);
        [Vec3::from_array(self.corner) + a, to_b + (b - a), to_c + (c - a)]
    }
}

impl SurfacePressure {
    /// A pressure (Pa) with a ramp (s).
    #[must_use]
    pub const fn new(pascal: f32, ramp: f32) -> Self {
        Self { pascal, ramp, volume: 0.0, bulk: 0.0 }
    }

    /// What fills a closed surface to a volume (m^3) with a stiffness (Pa) over a ramp (s).
    #[must_use]
    pub const fn filling(volume: f32, bulk: f32, ramp: f32) -> Self {
        Self { pascal: 0.0, ramp, volume, bulk }
    }

    /// Checks entry `index` of a list.
    pub fn check(&self, index: usize) -> Result<(), LoadError> {
        let Self { pascal, ramp, volume, bulk } = *self;
        if let Some(value) = [pascal, volume, bulk].into_iter().find(|value| !value.is_finite()) {
            return Err(LoadError::NotFinite { kind: "pressure", index, value });
        }
        if bulk < 0.0 || (bulk > 0.0 && volume <= 0.0) {
            return Err(LoadError::Filling { index, volume, bulk });
        }
        if !(ramp.is_finite() && ramp >= 0.0) {
            return Err(LoadError::Ramp { kind: "pressure", index, value: ramp });
        }
        Ok(())
    }

    /// The same, and that surface `index` of these triangles is closed if it is to be filled: each edge is there in both directions
    /// as often. Of an open one the edges do not cancel, but by a chance of 1 in 2^64.
    pub(crate) fn check_on(&self, index: usize, triangles: &[PressedTriangle]) -> Result<(), LoadError> {
        self.check(index)?;
        if self.bulk > 0.0 {
            let own = triangles.iter().filter(|triangle| triangle.surface as usize == index);
            let edges = own.map(|&PressedTriangle { nodes: [a, b, c], .. }| [edge(a, b), edge(b, c), edge(c, a)]);
            if edges.flatten().fold(0, u64::wrapping_add) != 0 {
                return Err(LoadError::Open { index });
            }
        }
        Ok(())
    }
}

/// The same number for an edge from `a` to `b` as the negative of that from `b` to `a` (SplitMix64, Steele et al. 2014).
fn edge(a: u32, b: u32) -> u64 {
    let mut mixed = (u64::from(a.min(b)) << 32 | u64::from(a.max(b))).wrapping_add(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^= mixed >> 31;
    if a < b { mixed } else { mixed.wrapping_neg() }
}

/// Pressures on surfaces, checked, borrowed from the caller.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pressure<'a> {
    triangles: &'a [PressedTriangle],
    surfaces: &'a [SurfacePressure],
}

impl<'a> Pressure<'a> {
    /// Checks triangles and the pressures of their surfaces against the scene they will act on. The triangles of a surface
    /// that fills should stand together: each change of the surface from one to the next costs a sum over all.
    pub fn new(
        scene: &impl AsScene,
        triangles: &'a [PressedTriangle],
        surfaces: &'a [SurfacePressure],
    ) -> Result<Self, LoadError> {
        let nodes = scene.as_scene().node_count();
        for (index, triangle) in triangles.iter().enumerate() {
            if let Some(&node) = triangle.nodes.iter().find(|node| **node as usize >= nodes) {
                return Err(LoadError::Node { kind: "pressure triangle", index, node, nodes });
            }
            let (surface, count) = (triangle.surface, surfaces.len());
            if surface as usize >= count {
                return Err(LoadError::Surface { index, surface, surfaces: count });
            }
        }
        for (index, surface) in surfaces.iter().enumerate() {
            surface.check_on(index, triangles)?;
        }
        Ok(Self { triangles, surfaces })
    }

    /// The same that the caller has checked. Of what has not been, nodes and surfaces that do not exist are ignored, and
    /// values that are not finite make a step diverge.
    #[must_use]
    pub const fn unchecked(triangles: &'a [PressedTriangle], surfaces: &'a [SurfacePressure]) -> Self {
        Self { triangles, surfaces }
    }

    /// See [`crate::loads::Loads::mark`].
    pub(crate) fn mark(&self) -> f64 {
        let of_surface = |(index, surface): (usize, &SurfacePressure)| {
            let [pascal, volume, bulk] = [surface.pascal, surface.volume, surface.bulk].map(f64::from);
            (index as f64 + core::f64::consts::E) * (pascal + volume * bulk + core::f64::consts::SQRT_2 * bulk)
        };
        self.surfaces.iter().enumerate().map(of_surface).sum()
    }

    /// The volume (m^3) within a closed surface at these displacements (m), of a body or of a cavity.
    #[must_use]
    pub fn volume(&self, surface: usize, displacement: &[NodeVector]) -> f64 {
        libm::fabs(self.signed_volume(surface, displacement))
    }

    /// The same: negative for a cavity, whose triangles face inward.
    fn signed_volume(&self, surface: usize, displacement: &[NodeVector]) -> f64 {
        let (mut origin, mut sum) = (None, 0.0);
        for triangle in self.triangles {
            if triangle.surface as usize == surface {
                let [a, to_b, to_c] = triangle.placed(displacement);
                // From a point near all of them, so that nothing cancels.
                let from = *origin.get_or_insert(a);
                sum += f64::from((a - from).dot(to_b.cross(to_c)));
            }
        }
        sum / 6.0
    }

    /// The pressure on a surface at `time` (s) and these displacements (m), Pa: with what it takes to fill it.
    #[must_use]
    pub fn pascal(&self, surface: usize, time: f64, displacement: &[NodeVector]) -> f32 {
        let Some(&SurfacePressure { pascal, ramp, volume, bulk }) = self.surfaces.get(surface) else { return 0.0 };
        let mut all = pascal;
        if bulk > 0.0 {
            let (now, wanted) = (self.signed_volume(surface, displacement), f64::from(volume));
            let filling = bulk * ((wanted - libm::fabs(now)) / wanted) as f32;
            // From within: against the tissue around a cavity, outward on a body.
            all += if now < 0.0 { filling } else { -filling };
        }
        // No infinity, which times a ramp that begins would be no number.
        ramp_factor(time, ramp) * all.clamp(-f32::MAX, f32::MAX)
    }

    /// Calls `with` with the nodes of each triangle, the force on each of them at `time` (s), N, and its surface.
    #[inline(always)]
    pub(crate) fn each(
        &self,
        time: f64,
        displacement: &[NodeVector],
        is_wanted: impl Fn(&[u32; 3]) -> bool,
        mut with: impl FnMut([u32; 3], Vec3, usize),
    ) {
        let (mut of, mut sixth) = (u32::MAX, 0.0);
        for triangle in self.triangles {
            if triangle.surface != of {
                of = triangle.surface;
                sixth = -self.pascal(of as usize, time, displacement) / 6.0;
            }
            if is_wanted(&triangle.nodes) {
                let [_, to_b, to_c] = triangle.placed(displacement);
                with(triangle.nodes, sixth * to_b.cross(to_c), of as usize);
            }
        }
    }

    /// The work of the forces at `time` (s) along these ways of the nodes (m), J.
    pub(crate) fn work(&self, time: f64, displacement: &[NodeVector], way: impl Fn(usize) -> Option<[f32; 3]>) -> f64 {
        let mut work = 0.0;
        self.each(
            time,
            displacement,
            |_| true,
            |nodes, newton, _| {
                for node in nodes {
                    work += f64::from(newton.dot(Vec3::from(way(node as usize).unwrap_or_default())));
                }
            },
        );
        work
    }

    /// Adds bounds of their stiffness at these displacements to those of the nodes, N/m: of the turning and growing of
    /// triangles with the longest edge `l` a third of `p l` at each corner, and of filling `B g g^T / V*`, with the sum
    /// of all areas for one of the two.
    pub(crate) fn add_stiffness(&self, time: f64, displacement: &[NodeVector], rates: &mut [f32]) {
        let areas = |triangle: &PressedTriangle| {
            let [_, to_b, to_c] = triangle.placed(displacement);
            (0.5 * to_b.cross(to_c).length(), to_b.length().max(to_c.length()).max(to_b.distance(to_c)))
        };
        let (mut of, mut pascal, mut filling) = (u32::MAX, 0.0, 0.0);
        for triangle in self.triangles {
            if triangle.surface != of {
                of = triangle.surface;
                let SurfacePressure { volume, bulk, .. } = self.surfaces.get(of as usize).copied().unwrap_or_default();
                pascal = self.pascal(of as usize, time, displacement).abs();
                let own = self.triangles.iter().filter(|triangle| triangle.surface == of);
                let all: f32 = if bulk > 0.0 { own.map(|triangle| areas(triangle).0).sum() } else { 0.0 };
                filling = if bulk > 0.0 { bulk * all / volume } else { 0.0 };
            }
            let (area, longest) = areas(triangle);
            for node in triangle.nodes {
                if let Some(rate) = rates.get_mut(node as usize) {
                    *rate += (pascal * longest + filling * area) / 3.0;
                }
            }
        }
    }

    /// Adds the forces to those of the nodes from `first` on, N.
    pub(crate) fn add_forces(&self, time: f64, displacement: &[NodeVector], first: usize, force: &mut [NodeVector]) {
        let count = force.len();
        let own = |node: u32| (node as usize).wrapping_sub(first);
        let is_wanted = |nodes: &[u32; 3]| nodes.iter().any(|&node| own(node) < count);
        self.each(time, displacement, is_wanted, |nodes, newton, _| {
            for node in nodes {
                if let Some(NodeVector([x, y, z, _])) = force.get_mut(own(node)) {
                    (*x, *y, *z) = (*x + newton.x, *y + newton.y, *z + newton.z);
                }
            }
        });
    }
}

/// Pressures that own their triangles, on a host with a heap.
#[cfg(any(feature = "std", test))]
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VecPressure {
    triangles: std::vec::Vec<PressedTriangle>,
    /// Of each surface; to be changed between steps.
    pub surfaces: std::vec::Vec<SurfacePressure>,
}

#[cfg(any(feature = "std", test))]
impl VecPressure {
    /// Adds a surface: triangles of the boundary, as of [`crate::mesh::boundary`], of a body with these
    /// points at rest (m). Gives its place among the surfaces. If it is refused nothing has changed.
    pub fn press(
        &mut self,
        points: &[[f32; 3]],
        triangles: &[[u32; 3]],
        pressure: SurfacePressure,
    ) -> Result<usize, LoadError> {
        let surface = self.surfaces.len();
        let made = triangles.iter().enumerate();
        let made = made.map(|(index, &nodes)| PressedTriangle::new(points, index, nodes, surface as u32));
        let made: std::vec::Vec<_> = made.collect::<Result<_, _>>()?;
        pressure.check_on(surface, &made)?;
        self.triangles.extend(made);
        self.surfaces.push(pressure);
        Ok(surface)
    }

    /// Takes triangles away whose nodes are no face of one of these elements any more. A surface that is open then does not
    /// fill.
    pub(crate) fn let_go_of_removed<'a>(&mut self, tets: impl Iterator<Item = &'a [u32; 4]>) {
        let mut left: std::collections::HashMap<_, _> =
            self.triangles.iter().map(|triangle| (in_order(triangle.nodes), false)).collect();
        for face in tets.copied().flat_map(faces) {
            if let Some(is_left) = left.get_mut(&in_order(face)) {
                *is_left = true;
            }
        }
        let Self { triangles, surfaces } = self;
        triangles.retain(|triangle| {
            let is_left = left.get(&in_order(triangle.nodes)) == Some(&true);
            if let Some(surface) = surfaces.get_mut(triangle.surface as usize).filter(|_| !is_left) {
                surface.bulk = 0.0;
            }
            is_left
        });
    }

    /// Takes all away.
    pub fn clear(&mut self) {
        self.triangles.clear();
        self.surfaces.clear();
    }

    /// The loads with these pressures, checked against the scene they act on; without any as they are.
    pub fn on<'a>(&'a self, scene: &impl AsScene, loads: Loads<'a>) -> Result<Loads<'a>, LoadError> {
        if self.triangles.is_empty() {
            return Ok(loads);
        }
        Ok(loads.pressed_by(Pressure::new(scene, &self.triangles, &self.surfaces)?))
    }

    /// See [`Pressure::volume`].
    #[must_use]
    pub fn volume(&self, surface: usize, displacement: &[NodeVector]) -> f64 {
        Pressure::unchecked(&self.triangles, &self.surfaces).volume(surface, displacement)
    }
}
