//! The surfaces of a scene's instruments at a time, as triangles for ParaView.

use crate::scene::body::Body;
use crate::scene::instruments::{MovedInstrument, OwnedShape, SceneInstruments};

/// Parts of a ring and of half a meridian.
const AROUND: u32 = 32;
const ALONG: u32 = 16;

type Triangles = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// All instruments at `time`, s, m in the scene's coordinates.
pub(crate) fn of(instruments: &SceneInstruments, body: &Body, time: f64) -> Triangles {
    let (mut points, mut triangles) = (vec![], vec![]);
    for instrument in &instruments.all {
        let (own, corners) = surface(instrument, body.diagonal() as f32);
        let (position, rotation) = instrument.placed(time);
        let first = points.len() as u32;
        points.extend(own.into_iter().map(|point| {
            let turned = turned(rotation, point);
            [0, 1, 2].map(|axis| f64::from(position[axis] + turned[axis]) + body.centre[axis])
        }));
        triangles.extend(corners.into_iter().map(|corners| corners.map(|corner| first + corner)));
    }
    (points, triangles)
}

/// The surface in the axes of the instrument; of a plane a square of twice `size`.
fn surface(instrument: &MovedInstrument, size: f32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    match &instrument.shape {
        OwnedShape::Plane => {
            let corners = [[-size, -size, 0.0], [size, -size, 0.0], [size, size, 0.0], [-size, size, 0.0]];
            (corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
        }
        &OwnedShape::Sphere { radius } => round(radius, 0.0),
        &OwnedShape::Capsule { radius, length } => round(radius, length),
        OwnedShape::Field(owned) => (owned.points.clone(), owned.triangles.clone()),
    }
}

/// A sphere, pulled apart by `length` along z.
fn round(radius: f32, length: f32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    use std::f32::consts::{PI, TAU};
    let (mut points, mut triangles) = (vec![], vec![]);
    // The ring at the middle is there twice, one for each half.
    for ring in 0..=ALONG + 1 {
        let is_upper = ring > ALONG / 2;
        let polar = PI * (1.0 - (ring - u32::from(is_upper)) as f32 / ALONG as f32);
        let shift = if is_upper { 0.5 } else { -0.5 } * length;
        for part in 0..AROUND {
            let (sin, cos) = (TAU * part as f32 / AROUND as f32).sin_cos();
            points.push([radius * polar.sin() * cos, radius * polar.sin() * sin, radius * polar.cos() + shift]);
            if ring <= ALONG {
                let next = (part + 1) % AROUND;
                let [a, b] = [part, next].map(|part| AROUND * ring + part);
                triangles.push([a, b, b + AROUND]);
                triangles.push([a, b + AROUND, a + AROUND]);
            }
        }
    }
    (points, triangles)
}

/// A vector turned by a unit quaternion `x, y, z, w`.
fn turned([x, y, z, w]: [f32; 4], v: [f32; 3]) -> [f32; 3] {
    let axis = [x, y, z];
    let cross =
        |a: [f32; 3], b: [f32; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let once = cross(axis, v);
    let twice = cross(axis, once);
    [0, 1, 2].map(|axis| v[axis] + 2.0 * (w * once[axis] + twice[axis]))
}
