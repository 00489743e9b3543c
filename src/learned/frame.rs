//! The local frame of a vertex: tangent along its velocity, normal carried along without twist (parallel transport,
//! Hanson & Ma 1995; Meister et al. 2018, section 2), binormal their cross product.
//!
//! The rotation that takes tangent `t` to `t'` without twist is Rodrigues' formula about `t x t'`. Of a vector
//! `n` across `t` it makes, with `s = t + t'`, the mirror image
//!
//! ```text
//! n' = n - 2 (n.s) / (s.s) s
//! ```
//! which needs neither angle nor trigonometry. At exact reversal `s` is zero: the frame turns by pi about its normal,
//! which stays. At zero speed there is no tangent: the frame stays. Frames start as the world's axes.

use bytemuck::{Pod, Zeroable};

use crate::simd::{Real, TILE, dot};

/// Squared length of an increment (m^2) or of `s` below which it has no direction.
const NO_LENGTH: f32 = 1e-30;
const REVERSED: f32 = 1e-12;

/// Tangents and normals of a vector of frames.
#[derive(Clone, Copy)]
pub(crate) struct Axes<R> {
    tangent: [R; 3],
    normal: [R; 3],
}

#[inline(always)]
fn cross<R: Real>([ax, ay, az]: [R; 3], [bx, by, bz]: [R; 3]) -> [R; 3] {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

/// `a - factor b`.
#[inline(always)]
fn less<R: Real>([ax, ay, az]: [R; 3], factor: R, [bx, by, bz]: [R; 3]) -> [R; 3] {
    [ax - factor * bx, ay - factor * by, az - factor * bz]
}

#[inline(always)]
fn divided<R: Real>([x, y, z]: [R; 3], length: R) -> [R; 3] {
    [x.divide(length), y.divide(length), z.divide(length)]
}

#[inline(always)]
fn choose<R: Real>(condition: R, [ax, ay, az]: [R; 3], [bx, by, bz]: [R; 3]) -> [R; 3] {
    [condition.choose(ax, bx), condition.choose(ay, by), condition.choose(az, bz)]
}

impl<R: Real> Axes<R> {
    /// Of each lane's frame.
    #[inline(always)]
    pub(crate) fn of(frame: impl Fn(usize) -> Frame) -> Self {
        let [tx, ty, tz, _] = R::from_rows(|lane| frame(lane).tangent);
        let [nx, ny, nz, _] = R::from_rows(|lane| frame(lane).normal);
        Self { tangent: [tx, ty, tz], normal: [nx, ny, nz] }
    }

    /// Hands each lane's frame to `frame`.
    #[inline(always)]
    pub(crate) fn hand_to(&self, mut frame: impl FnMut(usize, Frame)) {
        let (zero, [tx, ty, tz], [nx, ny, nz]) = (R::splat(0.0), self.tangent, self.normal);
        let mut normals = [[0.0; 4]; TILE];
        R::to_rows([nx, ny, nz, zero], |lane, row| normals[lane % TILE] = row);
        R::to_rows([tx, ty, tz, zero], |lane, tangent| {
            frame(lane, Frame { tangent, normal: normals[lane % TILE] });
        });
    }

    /// Tangent, normal and binormal.
    #[inline(always)]
    pub(crate) fn all(&self) -> [[R; 3]; 3] {
        [self.tangent, self.normal, cross(self.tangent, self.normal)]
    }

    /// Turns the tangents into the directions of increments of displacement, m.
    #[inline(always)]
    pub(crate) fn follow(&mut self, increment: [R; 3]) {
        let square = dot(increment, increment);
        // Neither without direction nor infinite; not what is no number either.
        let moves = (square - R::splat(NO_LENGTH)).min(R::splat(f32::MAX) - square);
        let length = square.root();
        let next = divided(increment, length);
        let [sx, sy, sz] = self.tangent;
        let [nx, ny, nz] = next;
        let sum = [sx + nx, sy + ny, sz + nz];
        let across = dot(sum, sum);
        let twice = R::splat(2.0) * dot(self.normal, sum).divide(across);
        let carried = choose(across - R::splat(REVERSED), less(self.normal, twice, sum), self.normal);
        // Rounding must not add up.
        let carried = less(carried, dot(carried, next), next);
        let length = dot(carried, carried).root();
        let carried = divided(carried, length);
        self.tangent = choose(moves, next, self.tangent);
        self.normal = choose(moves, carried, self.normal);
    }

    /// Components of vectors along tangent, normal and binormal.
    #[inline(always)]
    pub(crate) fn local(&self, v: [R; 3]) -> [R; 3] {
        let [tangent, normal, binormal] = self.all();
        [dot(tangent, v), dot(normal, v), dot(binormal, v)]
    }

    /// The vectors with these components along tangent, normal and binormal.
    #[inline(always)]
    pub(crate) fn world(&self, [t, n, b]: [R; 3]) -> [R; 3] {
        let [[tx, ty, tz], [nx, ny, nz], [bx, by, bz]] = self.all();
        [t * tx + n * nx + b * bx, t * ty + n * ny + b * by, t * tz + n * nz + b * bz]
    }
}

/// An orthonormal frame; the fourth components are zero.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Frame {
    tangent: [f32; 4],
    normal: [f32; 4],
}

impl Default for Frame {
    fn default() -> Self {
        Self::WORLD
    }
}

impl Frame {
    /// The world's axes: tangent x, normal y, binormal z.
    pub const WORLD: Self = Self { tangent: [1.0, 0.0, 0.0, 0.0], normal: [0.0, 1.0, 0.0, 0.0] };

    /// Keeps two numbers in the padding ([`crate::padding`]).
    pub(super) const fn keep(&mut self, [one, other]: [f32; 2]) {
        (self.tangent[3], self.normal[3]) = (one, other);
    }

    /// These numbers, which it then no longer keeps.
    pub(super) const fn take_kept(&mut self) -> [f32; 2] {
        let kept = [self.tangent[3], self.normal[3]];
        self.keep([0.0; 2]);
        kept
    }

    pub(crate) fn axes(self) -> Axes<f32> {
        Axes::of(|_| self)
    }

    /// Turns the tangent into the direction of an increment of displacement, m.
    pub(crate) fn follow(&mut self, increment: [f32; 3]) {
        let mut axes = self.axes();
        axes.follow(increment);
        axes.hand_to(|_, frame| *self = frame);
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3A};
    use proptest::prelude::*;
    use std::println;

    use super::Frame;

    fn axes(frame: &Frame) -> [Vec3A; 3] {
        frame.axes().all().map(Vec3A::from_array)
    }

    /// Largest difference from an orthonormal, right-handed frame.
    fn off(frame: &Frame) -> f32 {
        let [t, n, b] = axes(frame);
        [t.length() - 1.0, n.length() - 1.0, b.length() - 1.0, t.dot(n), n.dot(b), b.dot(t), t.cross(n).dot(b) - 1.0]
            .into_iter()
            .fold(0.0, |worst, value| worst.max(value.abs()))
    }

    fn random(state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f32 / 8_388_608.0 - 1.0
    }

    #[test]
    fn a_million_random_turns_stay_orthonormal() {
        let (mut state, mut frame, mut worst) = (7, Frame::WORLD, 0.0f32);
        for _ in 0..1_000_000 {
            let [x, y, z] = [0; 3].map(|_| random(&mut state));
            frame.follow([x, y, z]);
            worst = worst.max(off(&frame));
        }
        println!("a million turns: off by {worst:.1e}");
        assert!(worst < 1e-6);
    }

    #[test]
    fn zero_speed_keeps_the_frame_and_reversal_turns_about_the_normal() {
        let mut frame = Frame::WORLD;
        frame.follow([1e-6, 2e-6, -1e-6]);
        let before = frame;
        for still in [0.0, 1e-20, f32::NAN, f32::INFINITY] {
            frame.follow([still; 3]);
            assert_eq!(frame, before);
        }
        let [t, n, b] = axes(&before);
        frame.follow((-t).to_array());
        let [reversed, kept, turned] = axes(&frame);
        assert!((reversed + t).length() < 1e-6 && (kept - n).length() < 1e-6 && (turned + b).length() < 1e-6);
        assert!(off(&frame) < 1e-6);
    }

    /// Rodrigues' formula in float64: `x + w x x + w x (w x x) / (1 + c)` with `w = t x t'`, `c = t.t'`.
    fn turned(x: DVec3, t: DVec3, next: DVec3) -> DVec3 {
        let (w, c) = (t.cross(next), t.dot(next));
        let across = w.cross(x);
        x + across + w.cross(across) / (1.0 + c)
    }

    fn direction() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0f64..1.0)
            .prop_map(DVec3::from_array)
            .prop_filter("a direction", |v| v.length() > 1e-2)
    }

    proptest! {
        #[test]
        fn transport_is_rodrigues_rotation(
            first in direction(),
            second in direction(),
            scale in -8f32..-2.0,
            v in direction(),
        ) {
            let scale = libm::powf(10.0, scale);
            let mut frame = Frame::WORLD;
            frame.follow((first.as_vec3a() * scale).to_array());
            let [t, n, b] = axes(&frame).map(|axis| axis.as_dvec3().normalize());
            let next = (second.as_vec3a() * scale).as_dvec3().normalize();
            prop_assume!(t.dot(next) > -0.999);
            frame.follow((second.as_vec3a() * scale).to_array());
            let [tangent, normal, binormal] = axes(&frame).map(|axis| axis.as_dvec3());
            prop_assert!((tangent - next).length() < 1e-6);
            // Close to reversal the plane of the turn is all but lost: an error of the tangents grows by 2 / |s|.
            let near = 3e-6 / (t + next).length();
            prop_assert!((normal - turned(n, t, next)).length() < near);
            prop_assert!((binormal - turned(b, t, next)).length() < near);
            // There and back.
            let there = frame.axes().local(v.as_vec3a().to_array());
            let back = Vec3A::from_array(frame.axes().world(there));
            prop_assert!((back - v.as_vec3a()).length() < 1e-6);
        }

        /// Carried around a closed loop on the sphere a normal turns by the loop's solid angle: what no twist means.
        #[test]
        fn around_a_triangle_it_turns_by_the_solid_angle(a in direction(), b in direction(), c in direction()) {
            let corners = [a, b, c].map(|corner| corner.normalize());
            let [a, b, c] = corners;
            let volume = a.dot(b.cross(c));
            prop_assume!(a.dot(b).min(b.dot(c)).min(c.dot(a)) > -0.9 && volume.abs() > 1e-3);
            let solid = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
            let mut frame = Frame::WORLD;
            frame.follow(a.as_vec3a().to_array());
            let [t, before, side] = axes(&frame);
            for corner in [b, c, a] {
                frame.follow(corner.as_vec3a().to_array());
            }
            let [back, after, _] = axes(&frame);
            prop_assert!((back - t).length() < 1e-6);
            let angle = f64::from(after.dot(side).atan2(after.dot(before)));
            let difference = (angle - solid).rem_euclid(std::f64::consts::TAU);
            let difference = difference.min(std::f64::consts::TAU - difference);
            prop_assert!(difference < 1e-5, "{angle} {solid}");
        }
    }
}
