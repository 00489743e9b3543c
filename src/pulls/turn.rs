//! The turn of pulled points. The nodes of a pull move its point by their mean, and near a surface they are all on one
//! side of it: where the body turns by `R`, its tissue at the point moves by `(R - I)(x0 - c)` more than their mean place
//! `c`, 2 mm at 40 degrees and 4 mm. A host adds that between frames.
//!
//! It is not done in the steps, nor with the rotation at each pull: the force does not act on the arm `x0 - c`, so that a
//! rotation which answers it feeds motion. A free lobe on 20 pulls trembled with 0.2 to 0.9 m/s at a damping of 20 1/s, and
//! weights by which the force turns its nodes tear them: targets 1.15, 2.1 and 2.7 mm off with 20, 10 and 6 points in place
//! of 1.03, 1.8 and 2.5.

use glam::{Mat3, Quat, Vec3};

use super::{Pull, PulledNode};
use crate::simd::NodeVector;

/// Times that a rotation is improved, at most: from a half turn away.
const SWEEPS: usize = 64;
/// Radians below which it is not.
const SMALL: f32 = 1e-5;

/// Turns the points of pulls with the body, by the rotation that is nearest to its motion at these displacements (m).
/// `points` are those of all nodes at rest, m. Gives the largest change, m.
pub fn turn(points: &[[f32; 3]], displacements: &[NodeVector], nodes: &[PulledNode], pulls: &mut [Pull]) -> f32 {
    let count = points.len().max(1) as f32;
    let moved = |vector: &NodeVector| Vec3::from(vector.to_array());
    let middle = points.iter().map(|at| Vec3::from_array(*at)).sum::<Vec3>() / count;
    let shift = displacements.iter().map(moved).sum::<Vec3>() / count;
    let mut spread = Mat3::ZERO;
    for (at, displacement) in points.iter().zip(displacements) {
        let arm = Vec3::from_array(*at) - middle;
        let now = arm + (moved(displacement) - shift);
        spread += Mat3::from_cols(now * arm.x, now * arm.y, now * arm.z);
    }
    let (rotation, mut most) = (rotation_of(spread), 0.0_f32);
    for pull in pulls {
        let [first, count] = pull.nodes.map(|number| number as usize);
        let own = nodes.get(first..).and_then(|nodes| nodes.get(..count)).unwrap_or_default();
        let place =
            |pulled: &PulledNode| points.get(pulled.node as usize).map(|at| pulled.weight * Vec3::from_array(*at));
        let arm = Vec3::from_array(pull.at) - own.iter().filter_map(place).sum::<Vec3>();
        let turned = rotation * arm - arm;
        let change = turned.distance(Vec3::from_array(pull.turned));
        if change.is_finite() {
            (most, pull.turned) = (most.max(change), turned.to_array());
        }
    }
    most
}

/// The rotation nearest to a matrix, of whatever rank (Müller et al. 2016, "A robust method to extract the rotational part
/// of deformations").
fn rotation_of(matrix: Mat3) -> Quat {
    let mut found = Quat::IDENTITY;
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    for _ in 0..SWEEPS {
        let now = Mat3::from_quat(found);
        let axes = [now.x_axis, now.y_axis, now.z_axis];
        let (mut torque, mut along) = (Vec3::ZERO, f32::MIN_POSITIVE);
        for (axis, column) in axes.into_iter().zip(columns) {
            (torque, along) = (torque + axis.cross(column), along + axis.dot(column));
        }
        let way = torque / along.abs();
        let angle = way.length();
        if !(angle > SMALL && angle.is_finite()) {
            break;
        }
        found = (Quat::from_scaled_axis(way) * found).normalize();
    }
    found
}

#[cfg(test)]
mod tests {
    use std::{println, vec::Vec};

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
            let changed = turn(&points, &displacements, &nodes, &mut pulls);
            println!("{degrees} degrees: {:.3} mm off before, {:.6} after", 1e3 * before, 1e3 * off(&pulls));
            assert!(off(&pulls) < 1e-6 && (changed - before).abs() < 1e-6);
            assert!(before > 1.5e-3 * (degrees / 40.0).min(1.0) && (degrees > 0.0 || before < 1e-7));
            assert!(turn(&points, &displacements, &nodes, &mut pulls) < 1e-6);
        }
    }

    /// Nodes that cannot tell a turn leave the point where it is.
    #[test]
    fn one_node_and_no_numbers_turn_nothing() {
        let (points, one) = ([[0.0; 3]], [PulledNode { node: 0, weight: 1.0 }]);
        let mut pulls = [Pull::new([0, 1], [0.001, 0.0, 0.0], 100.0)];
        assert_eq!(turn(&points, &[NodeVector([0.1, 0.2, 0.3, 0.0])], &one, &mut pulls), 0.0);
        for value in [f32::NAN, f32::INFINITY, 3e38] {
            turn(&points, &[NodeVector([value, 0.0, -value, 0.0])], &one, &mut pulls);
            assert_eq!(pulls[0].turned, [0.0; 3]);
        }
    }
}
