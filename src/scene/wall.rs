//! Directions of fibres in a wall around an axis, as that of a ventricle or an artery, by a rule: the fibres wind about the
//! axis, with an angle that goes from that at the inner side to that at the outer one. How deep an element lies is the
//! solution of Laplace's equation between both sides (Bayer et al. 2012, "A novel rule-based algorithm for assigning
//! myocardial fiber orientation", section 2.2), on the linear tetrahedra of the mesh. For tools: it allocates.

use std::fmt;
use std::vec::Vec;

use glam::DVec3;

use crate::material::Directions;
use crate::mesh::{boundary, gradients};

/// A wall around an axis.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    /// Along the axis, of any length but zero.
    pub axis: [f64; 3],
    /// A point on it, m.
    pub through: [f64; 3],
    /// Angles of the fibres to the circumference at the inner and the outer side, degrees: at 90 they run along the axis.
    pub helix: [f64; 2],
}

/// Why a body has no wall.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum WallError {
    /// The axis has no direction, or a number is not finite.
    Rule,
    /// No part of the surface faces the axis.
    NoInnerSide,
    /// No part of it faces away.
    NoOuterSide,
}

impl fmt::Display for WallError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rule => "give an axis that is not zero, and finite numbers",
            Self::NoInnerSide => {
                "no part of the surface faces the axis: give the axis of the cavity that the wall is around"
            }
            Self::NoOuterSide => {
                "no part of the surface faces away from the axis: give the axis that the wall is around"
            }
        })
    }
}

impl core::error::Error for WallError {}

/// Parts of the surface whose normal has no larger cosine to the axis belong to a side; others are ends.
const MOST_COSINE: f64 = 0.9;

/// The wall is solved to this residual over the first one.
const RESIDUAL: f64 = 1e-10;

impl Wall {
    /// Directions in each tetrahedron (nodes, from points in m): fibres at their angle, sheets across the wall, outwards.
    pub fn directions(&self, points: &[[f64; 3]], tets: &[[u32; 4]]) -> Result<Vec<Directions>, WallError> {
        let axis = DVec3::from_array(self.axis).try_normalize().ok_or(WallError::Rule)?;
        if !self.through.iter().chain(&self.helix).all(|number| number.is_finite()) {
            return Err(WallError::Rule);
        }
        let points: Vec<_> = points.iter().map(|&point| DVec3::from_array(point)).collect();
        let at = |node: u32| points.get(node as usize).copied().unwrap_or_default();
        let elements: Vec<_> = tets.iter().map(|tet| Tetrahedron::new(*tet, tet.map(at))).collect();
        let surface = boundary(elements.iter().map(|element| element.nodes));
        let depths = depths(self.sides(axis, at, &surface, points.len())?, &elements);
        let [inner, outer] = self.helix.map(f64::to_radians);
        let of_element = |element: &Tetrahedron| {
            let across = element.gradient(&depths);
            let middle = element.nodes.map(at).into_iter().sum::<DVec3>() / 4.0 - DVec3::from_array(self.through);
            let sheet = across.try_normalize().or_else(|| middle.reject_from_normalized(axis).try_normalize());
            let sheet = sheet.unwrap_or_else(|| axis.any_orthonormal_vector());
            let around = axis.cross(sheet).try_normalize().unwrap_or_else(|| sheet.any_orthonormal_vector());
            let depth = element.nodes.map(|node| depths[node as usize]).iter().sum::<f64>() / 4.0;
            let angle = inner + (outer - inner) * depth;
            let fibre = around * angle.cos() + sheet.cross(around) * angle.sin();
            Directions { fibre: fibre.as_vec3().to_array(), sheet: sheet.as_vec3().to_array() }
        };
        Ok(elements.iter().map(of_element).collect())
    }

    /// The depth of the nodes of both sides, 0 and 1; nothing for the others.
    fn sides(
        &self,
        axis: DVec3,
        at: impl Fn(u32) -> DVec3,
        surface: &[[u32; 3]],
        nodes: usize,
    ) -> Result<Vec<Option<f64>>, WallError> {
        let mut sides = std::vec![None; nodes];
        let mut found = [false; 2];
        for triangle in surface {
            let [a, b, c] = triangle.map(&at);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let middle = (a + b + c) / 3.0 - DVec3::from_array(self.through);
            let outwards = normal.dot(middle.reject_from_normalized(axis));
            if normal.dot(axis).abs() > MOST_COSINE || outwards == 0.0 {
                continue;
            }
            let outer = outwards > 0.0;
            found[usize::from(outer)] = true;
            for &node in triangle {
                sides[node as usize] = Some(f64::from(u8::from(outer)));
            }
        }
        match found {
            [true, true] => Ok(sides),
            [false, _] => Err(WallError::NoInnerSide),
            _ => Err(WallError::NoOuterSide),
        }
    }
}

/// A linear tetrahedron.
struct Tetrahedron {
    /// In the order in which its volume is positive.
    nodes: [u32; 4],
    /// Gradients of the shape functions, 1/m.
    slopes: [DVec3; 4],
    /// m^3.
    volume: f64,
}

impl Tetrahedron {
    fn new(nodes: [u32; 4], corners: [DVec3; 4]) -> Self {
        let ([b, c, d], volume) = gradients(corners);
        let (a, [first, second, third, fourth]) = (-(b + c + d), nodes);
        if volume < 0.0 {
            return Self { nodes: [second, first, third, fourth], slopes: [b, a, c, d], volume: -volume };
        }
        Self { nodes, slopes: [a, b, c, d], volume }
    }

    /// The gradient of a function with these values at all nodes.
    fn gradient(&self, values: &[f64]) -> DVec3 {
        let of_nodes = self.nodes.iter().zip(self.slopes);
        of_nodes.fold(DVec3::ZERO, |sum, (node, slope)| sum + slope * values[*node as usize])
    }

    /// Adds something of each slope to the numbers of the nodes.
    fn add(&self, of_slope: impl Fn(DVec3) -> f64, numbers: &mut [f64]) {
        let of_nodes = self.nodes.iter().zip(self.slopes);
        of_nodes.for_each(|(node, slope)| numbers[*node as usize] += self.volume * of_slope(slope));
    }
}

/// Solves Laplace's equation for the nodes that have no value, by conjugate gradients with the diagonal.
fn depths(given: Vec<Option<f64>>, elements: &[Tetrahedron]) -> Vec<f64> {
    let product = |vector: &[f64]| {
        let mut result = std::vec![0.0; vector.len()];
        for element in elements {
            let gradient = element.gradient(vector);
            element.add(|slope| slope.dot(gradient), &mut result);
        }
        let known = result.iter_mut().zip(&given).filter(|(_, given)| given.is_some());
        known.for_each(|(entry, _)| *entry = 0.0);
        result
    };
    let mut diagonal = std::vec![0.0; given.len()];
    elements.iter().for_each(|element| element.add(DVec3::length_squared, &mut diagonal));
    let scaled = |residual: &[f64]| -> Vec<f64> {
        residual.iter().zip(&diagonal).map(|(entry, own)| if *own > 0.0 { entry / own } else { 0.0 }).collect()
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut depths: Vec<f64> = given.iter().map(|given| given.unwrap_or(0.5)).collect();
    let mut residual: Vec<f64> = product(&depths).into_iter().map(|entry| -entry).collect();
    let mut preconditioned = scaled(&residual);
    let mut direction = preconditioned.clone();
    let mut energy = dot(&residual, &preconditioned);
    let end = RESIDUAL * RESIDUAL * energy;
    for _ in 0..given.len() {
        if energy <= end || energy == 0.0 {
            break;
        }
        let along = product(&direction);
        let length = energy / dot(&direction, &along);
        for (((depth, residual), step), along) in depths.iter_mut().zip(&mut residual).zip(&direction).zip(along) {
            *depth += length * step;
            *residual -= length * along;
        }
        preconditioned = scaled(&residual);
        let next = dot(&residual, &preconditioned);
        for (step, entry) in direction.iter_mut().zip(&preconditioned) {
            *step = entry + next / energy * *step;
        }
        energy = next;
    }
    depths
}

#[cfg(test)]
mod tests {
    use std::println;

    use super::*;

    /// A tube whose axis is not through the origin: the depth is the logarithm of the radius, and the angle follows it.
    #[test]
    fn fibres_wind_about_a_tube() {
        let (around, along, through) = (48, 6, 4);
        let node = |i: u32, j: u32, k: u32| ((k * (through + 1) + j) * around) + i % around;
        let mut points = std::vec![];
        for k in 0..=along {
            for j in 0..=through {
                for i in 0..around {
                    let (angle, radius) = (
                        f64::from(i) / f64::from(around) * core::f64::consts::TAU,
                        10.0 + 5.0 * f64::from(j) / f64::from(through),
                    );
                    points.push([
                        0.002 + 1e-3 * radius * angle.cos(),
                        1e-3 * radius * angle.sin(),
                        2e-3 * f64::from(k),
                    ]);
                }
            }
        }
        let mut tets = std::vec![];
        for k in 0..along {
            for j in 0..through {
                for i in 0..around {
                    let corner = |bits: u32| node(i + (bits & 1), j + (bits >> 1 & 1), k + (bits >> 2));
                    for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                        tets.push([0, a, b, 7].map(corner));
                    }
                }
            }
        }
        let wall = Wall { axis: [0.0, 0.0, 2.0], through: [0.002, 0.0, 0.5], helix: [60.0, -60.0] };
        let directions = wall.directions(&points, &tets).unwrap();
        // Either way round.
        let turned: Vec<_> = tets.iter().map(|&[a, b, c, d]| [b, a, c, d]).collect();
        let of_turned = wall.directions(&points, &turned).unwrap();
        let far = |(a, b): (&Directions, &Directions)| (0..3).any(|axis| (a.fibre[axis] - b.fibre[axis]).abs() > 1e-5);
        assert!(!directions.iter().zip(&of_turned).any(far));
        let (mut worst, mut tilt) = (0.0_f64, 0.0_f64);
        for (tet, directions) in tets.iter().zip(&directions) {
            let middle = tet.iter().map(|&node| DVec3::from_array(points[node as usize])).sum::<DVec3>() / 4.0;
            let radial = DVec3::new(middle.x - 0.002, middle.y, 0.0);
            let outwards = radial.normalize();
            let fibre = DVec3::from_array(directions.fibre.map(f64::from));
            let sheet = DVec3::from_array(directions.sheet.map(f64::from));
            let angle = fibre.z.atan2(fibre.dot(DVec3::Z.cross(outwards))).to_degrees();
            let depth = (radial.length() / 0.010).ln() / 1.5_f64.ln();
            worst = worst.max((angle - 60.0 * (1.0 - 2.0 * depth)).abs());
            tilt = tilt.max(sheet.angle_between(outwards).to_degrees());
        }
        println!("angle within {worst:.2} degrees, sheets within {tilt:.2} of the radius");
        assert!(worst < 3.0 && tilt < 5.0);
        assert_eq!(Wall { axis: [0.0; 3], ..wall }.directions(&points, &tets), Err(WallError::Rule));
        let bar = crate::mesh::Bar { size: [0.01; 3], cells: [2; 3] };
        let bar_points: Vec<_> = bar.points().map(|point| point.map(f64::from)).collect();
        let middle = Wall { through: [0.005; 3], ..wall };
        let solid = middle.directions(&bar_points, &bar.tets().collect::<Vec<_>>());
        assert_eq!(solid, Err(WallError::NoInnerSide));
    }
}
