//! The turn of pulled points. The nodes of a pull move its point by their mean, and near a surface they are all on one
//! side of it: where the body turns by `R`, its tissue at the point moves by `(R - I)(x0 - c)` more than their mean place
//! `c`, 2.7 mm at 40 degrees and 4 mm. A host adds that between frames.
//!
//! It is not done in the steps, nor with the rotation at each pull: the force does not act on the arm `x0 - c`, so that a
//! rotation which answers it feeds motion. A free lobe on 20 pulls trembled with 0.2 to 0.9 m/s at a damping of 20 1/s.
//! Weights by which the force turns its nodes tear them: targets of 20, 10 and 6 points 1.15, 2.06 and 2.65 mm off where
//! the turn of the body makes 1.06, 1.82 and 2.50.
//!
//! **How fast.** The point goes on by the arm `a`, so that its patch stays behind by as much and turns the body back: what is
//! added answers itself `-g` times, with `g` at most the arms over the distances `d` of the patches from each other,
//!
//! ```text
//! g^2 = trace(J(d)^-1 J(a)),   J(v) = sum |v|^2 - v v^T,   d, a less their means
//! ```
//! of patches as large as the body more than once. Between stops, where the host settles, a turn is entered by its part
//! `1 / (1 + g)`, which converges. While the body moves it is entered with a time constant `T`: a vibration of `w` with a damping of `c` is fed
//! `g w / c` times by what is not filtered, `g / (c T)` times by what is, half with `T = 2 g / c`. A free bar of 8 x 3 x 3 cells on three pulls
//! was fed up to 24 mm at 60 frames a second without. A point that was never turned is in full.

use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};

use super::{Pull, PulledNode};
use crate::simd::NodeVector;
use crate::state::Progress;

/// Times that a matrix is squared to find its largest eigenvector: enough for one larger by a millionth than the others.
const SQUARINGS: usize = 24;

/// Time constant of a turn over the feedback and the time in which damping takes velocities.
const SLOW: f64 = 2.0;
/// Of the distances of patches from each other a part of the size of the body is the least.
const NEAREST: f64 = 0.25;
/// Seconds after which the time of a turn begins anew, so that few bits tell it.
const CYCLE: f64 = 64.0;

/// Turns the points of pulls with the body, by the rotation that is nearest to its motion at these displacements (m), at the time of
/// `progress`; in full those that were never turned ([`Pull::turned_at`]). `points` are those of all nodes at rest, m, and `mass` is that of each, in
/// any unit. Gives the largest change that was entered, m.
pub fn turn(
    points: &[[f32; 3]],
    mass: impl Fn(usize) -> f32,
    progress: &Progress,
    displacements: &[NodeVector],
    nodes: &[PulledNode],
    pulls: &mut [Pull],
) -> f32 {
    let all = || {
        let nodes = points.iter().zip(displacements).enumerate();
        nodes.map(|(node, (at, moved))| {
            let [at, moved] = [*at, moved.to_array()].map(|vector| Vec3::from_array(vector).as_dvec3());
            (f64::from(mass(node)), at, at + moved)
        })
    };
    let (mut sum, mut middle, mut now) = (f64::MIN_POSITIVE, DVec3::ZERO, DVec3::ZERO);
    for (mass, at, moved) in all() {
        (sum, middle, now) = (sum + mass, middle + mass * at, now + mass * moved);
    }
    let (middle, now) = (middle / sum, now / sum);
    let (mut spread, mut size) = (DMat3::ZERO, 0.0);
    for (mass, at, moved) in all() {
        let (arm, moved) = (at - middle, mass * (moved - now));
        spread += DMat3::from_cols(moved * arm.x, moved * arm.y, moved * arm.z);
        size += mass / sum * arm.length_squared();
    }
    let (rotation, mut most) = (rotation_of(spread).as_quat(), 0.0_f32);
    let feedback = feedback(points, NEAREST * NEAREST * size, nodes, pulls);
    let time = libm::fmod(progress.time(), CYCLE);
    for pull in pulls {
        let arm = pull.arm(points, nodes);
        let change = rotation * arm - arm - Vec3::from_array(pull.turned);
        let gone = time - f64::from(pull.turned_at);
        let share = if gone.is_nan() {
            1.0
        } else if progress.last_step() > 0.0 {
            let gone = if gone < 0.0 { gone + CYCLE } else { gone };
            1.0 - libm::exp(-gone * f64::from(progress.damping) / (SLOW * feedback.max(f64::MIN_POSITIVE)))
        } else {
            1.0 / (1.0 + feedback)
        };
        let change = share as f32 * change;
        if change.is_finite() {
            pull.turned = (Vec3::from_array(pull.turned) + change).to_array();
            pull.turned_at = time as f32;
            most = most.max(change.length());
        }
    }
    most
}

/// By how many times a turn of the body at most answers that of the points of its pulls, see above. `nearest` is the least square of a distance, m^2.
fn feedback(points: &[[f32; 3]], nearest: f64, nodes: &[PulledNode], pulls: &[Pull]) -> f64 {
    let arms = || {
        let acting = pulls.iter().filter(|pull| pull.acts());
        acting.map(|pull| {
            let arm = pull.arm(points, nodes);
            [arm.as_dvec3(), (Vec3::from_array(pull.at) - arm).as_dvec3()]
        })
    };
    let count = arms().count() as f64;
    let [arm, centre] =
        arms().fold([DVec3::ZERO; 2], |[sum, other], [arm, centre]| [sum + arm / count, other + centre / count]);
    // One alone turns the body about something else.
    let mean = if count > 1.0 { arm } else { DVec3::ZERO };
    let resisting = |vector: DVec3| {
        let [x, y, z] = [vector.x, vector.y, vector.z].map(|component| component * vector);
        DMat3::from_diagonal(DVec3::splat(vector.length_squared())) - DMat3::from_cols(x, y, z)
    };
    let mut distances = DMat3::from_diagonal(DVec3::splat(f64::MIN_POSITIVE + count * nearest));
    let mut answers = DMat3::ZERO;
    for [arm, at] in arms() {
        distances += resisting(at - centre);
        answers += resisting(arm - mean);
    }
    let ratio = distances.inverse() * answers;
    let trace = ratio.x_axis.x + ratio.y_axis.y + ratio.z_axis.z;
    if trace > 0.0 && trace.is_finite() { libm::sqrt(trace) } else { 0.0 }
}

/// The rotation nearest to `sum x X^T` for the places `x` to which it leads places `X`: the eigenvector of the largest
/// eigenvalue of Horn's matrix (1987, "Closed-form solution of absolute orientation using unit quaternions").
fn rotation_of(spread: DMat3) -> DQuat {
    // From X, by rows, to x.
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = spread.transpose().to_cols_array_2d();
    let rows = [
        [xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, xx - yy - zz, xy + yx, zx + xz],
        [xz - zx, xy + yx, yy - xx - zz, yz + zy],
        [yx - xy, zx + xz, yz + zy, zz - xx - yy],
    ];
    let largest = rows.as_flattened().iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    if !(largest > 0.0 && largest.is_finite()) {
        return DQuat::IDENTITY;
    }
    // No eigenvalue is below zero then.
    let mut power = DMat4::from_cols_array_2d(&rows) * (1.0 / largest) + DMat4::IDENTITY * 4.0;
    for _ in 0..SQUARINGS {
        let sizes = power.to_cols_array();
        power *= 1.0 / sizes.iter().fold(f64::MIN_POSITIVE, |most, value| most.max(value.abs()));
        power = power * power;
    }
    let columns = [power.x_axis, power.y_axis, power.z_axis, power.w_axis];
    let found = columns.into_iter().reduce(|a, b| if b.length_squared() > a.length_squared() { b } else { a });
    let [w, x, y, z] = found.unwrap_or_default().normalize_or_zero().to_array();
    let found = DQuat::from_xyzw(x, y, z, w);
    if found.is_normalized() { found } else { DQuat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use std::{println, vec::Vec};

    use glam::Quat;

    use super::*;
    use crate::pulls::{Pulls, patch};

    /// A half space of points that is turned and shifted takes the point of its surface along.
    #[test]
    fn the_point_of_a_surface_turns_with_its_nodes() {
        let places = |n: i32| (-n..=n).flat_map(move |x| (-n..=n).flat_map(move |y| (-n..=0).map(move |z| [x, y, z])));
        let points: Vec<_> = places(3).map(|at| at.map(|x| 0.004 * x as f32)).collect();
        let mut nodes = [PulledNode::default(); 64];
        let count = patch(&points, |_| 1.0, [0.0; 3], 0.01, &mut nodes).unwrap();
        for degrees in [0.0_f32, 10.0, 40.0, 120.0, 179.0] {
            let turned = Quat::from_axis_angle(Vec3::new(0.6, 0.8, 0.0), degrees.to_radians());
            let shift = Vec3::new(0.01, -0.02, 0.03);
            let displacement = |at: &[f32; 3]| turned * Vec3::from_array(*at) + shift - Vec3::from_array(*at);
            let displacements: Vec<_> = points
                .iter()
                .map(|at| {
                    let [x, y, z] = displacement(at).to_array();
                    NodeVector([x, y, z, 0.0])
                })
                .collect();
            let mut pulls = [Pull::new([0, count as u32], [0.0; 3], 100.0)];
            let off = |pulls: &[Pull]| {
                let all = Pulls::new(points.len(), &nodes, pulls).unwrap();
                let point = all.read(0, &displacements, &[], 0.0).unwrap().point;
                Vec3::from_array(point).distance(shift)
            };
            let before = off(&pulls);
            let changed = turn(&points, |_| 1.0, &Progress::START, &displacements, &nodes, &mut pulls);
            println!("{degrees} degrees: {:.3} mm off before, {:.6} after", 1e3 * before, 1e3 * off(&pulls));
            assert!(off(&pulls) < 1e-6 && (changed - before).abs() < 1e-6);
            assert!(before > 1.5e-3 * (degrees / 40.0).min(1.0) && (degrees > 0.0 || before < 1e-7));
            assert!(turn(&points, |_| 1.0, &Progress::START, &displacements, &nodes, &mut pulls) < 1e-6);
        }
    }

    /// Nodes that cannot tell a turn leave the point where it is.
    #[test]
    fn one_node_and_no_numbers_turn_nothing() {
        let (points, one) = ([[0.0; 3]], [PulledNode { node: 0, weight: 1.0 }]);
        let mut pulls = [Pull::new([0, 1], [0.001, 0.0, 0.0], 100.0)];
        assert_eq!(
            turn(&points, |_| 1.0, &Progress::START, &[NodeVector([0.1, 0.2, 0.3, 0.0])], &one, &mut pulls),
            0.0
        );
        for value in [f32::NAN, f32::INFINITY, 3e38] {
            turn(&points, |_| 1.0, &Progress::START, &[NodeVector([value, 0.0, -value, 0.0])], &one, &mut pulls);
            assert_eq!(pulls[0].turned, [0.0; 3]);
        }
    }

    /// Long bodies about their length, and half turns.
    #[test]
    fn every_rotation_is_found() {
        for spread in [[1.0, 1.0, 1.0], [1.0, 1.0, 100.0], [1.0, 2.0, 0.0], [1.0, 1.0, 0.0]] {
            for axis in [DVec3::Z, DVec3::X, DVec3::new(0.36, 0.48, -0.8)] {
                for degrees in [0.0_f64, 1e-3, 40.0, 90.0, 120.0, 170.0, 180.0] {
                    let wanted = DQuat::from_axis_angle(axis, degrees.to_radians());
                    let found = rotation_of(DMat3::from_quat(wanted) * DMat3::from_diagonal(DVec3::from_array(spread)));
                    let off = found.angle_between(wanted).to_degrees();
                    assert!(off < 1e-4, "{spread:?}, {degrees} degrees about {axis}: {off} off");
                }
            }
        }
        assert_eq!(rotation_of(DMat3::ZERO), DQuat::IDENTITY);
    }
}
