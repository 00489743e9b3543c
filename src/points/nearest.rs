//! The point of a tetrahedron that is nearest to a place, as barycentric weights: inside by ratios of volumes, outside
//! on a face that the place sees (Ericson 2005, "Real-Time Collision Detection", 5.1.5 and 5.1.6). In float64.

use glam::DVec3;

/// A weight that is negative by less is that of a place inside.
const INSIDE: f64 = 1e-6;

/// Weights of the four corners, and the squared distance, m^2.
pub(super) type Nearest = ([f64; 4], f64);

/// Weights of a place within a tetrahedron, whose volume is not zero; None outside.
pub(crate) fn within(corners: [DVec3; 4], place: DVec3) -> Option<[f64; 4]> {
    let weights = Barycentric::of(corners, place).weights();
    if !weights.into_iter().all(|weight| weight >= -INSIDE) {
        return None;
    }
    let positive = weights.map(|weight| weight.max(0.0));
    let sum: f64 = positive.into_iter().sum();
    Some(positive.map(|weight| weight / sum))
}

/// The nearest point of a tetrahedron to a place outside, if it is nearer than `least`, m^2.
pub(super) fn of_tetrahedron(corners: [DVec3; 4], place: DVec3, least: f64) -> Option<Nearest> {
    let barycentric = Barycentric::of(corners, place);
    let weights = barycentric.weights();
    // A place is at least as far away as a face's plane that is between them.
    let mut planes = weights.into_iter().zip(barycentric.plane_distances_squared());
    if planes.any(|(weight, squared)| weight < 0.0 && squared >= least) {
        return None;
    }
    let [a, b, c, d] = corners;
    // Each face with its corners' places, behind the weight of the corner that it has not.
    let faces = [([b, c, d], [1, 2, 3]), ([a, c, d], [0, 2, 3]), ([a, b, d], [0, 1, 3]), ([a, b, c], [0, 1, 2])];
    let mut best: Option<Nearest> = None;
    for ((triangle, numbers), across) in faces.into_iter().zip(weights) {
        if across >= 0.0 {
            continue;
        }
        let of_face = of_triangle(triangle, place);
        let [p, q, r] = triangle;
        let squared = (of_face[0] * p + of_face[1] * q + of_face[2] * r).distance_squared(place);
        if best.map_or(squared < least, |(_, least)| squared < least) {
            let mut all = [0.0; 4];
            for (number, weight) in numbers.into_iter().zip(of_face) {
                all.get_mut(number).into_iter().for_each(|place| *place = weight);
            }
            best = Some((all, squared));
        }
    }
    best.filter(|(weights, _)| weights.iter().all(|weight| weight.is_finite()))
}

/// What barycentric coordinates are made of.
struct Barycentric {
    /// Six times the volume, m^3.
    volume: f64,
    /// From the first corner to the place, m.
    place: DVec3,
    /// Gradients of the weights of the other three corners times that volume, m^2.
    normals: [DVec3; 3],
}

impl Barycentric {
    fn of([a, b, c, d]: [DVec3; 4], place: DVec3) -> Self {
        let (u, v, w) = (b - a, c - a, d - a);
        let normals = [v.cross(w), w.cross(u), u.cross(v)];
        Self { volume: u.dot(normals[0]), place: place - a, normals }
    }

    /// Negative across a face.
    fn weights(&self) -> [f64; 4] {
        let [second, third, fourth] = self.normals.map(|normal| self.place.dot(normal) / self.volume);
        [1.0 - second - third - fourth, second, third, fourth]
    }

    /// From the planes of the faces across from the corners, m^2.
    fn plane_distances_squared(&self) -> [f64; 4] {
        let [second, third, fourth] = self.normals;
        let first = -(second + third + fourth);
        let from = |normal: DVec3, offset: f64| {
            let along = self.place.dot(normal) + offset;
            along * along / normal.length_squared()
        };
        [from(first, self.volume), from(second, 0.0), from(third, 0.0), from(fourth, 0.0)]
    }
}

/// The nearest point of a triangle.
fn of_triangle([a, b, c]: [DVec3; 3], place: DVec3) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let [from_a, from_b, from_c] = [a, b, c].map(|corner| {
        let way = place - corner;
        [ab.dot(way), ac.dot(way)]
    });
    if from_a[0] <= 0.0 && from_a[1] <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if from_b[0] >= 0.0 && from_b[1] <= from_b[0] {
        return [0.0, 1.0, 0.0];
    }
    if from_c[1] >= 0.0 && from_c[0] <= from_c[1] {
        return [0.0, 0.0, 1.0];
    }
    let third = from_a[0] * from_b[1] - from_b[0] * from_a[1];
    if third <= 0.0 && from_a[0] >= 0.0 && from_b[0] <= 0.0 {
        let along = from_a[0] / (from_a[0] - from_b[0]);
        return [1.0 - along, along, 0.0];
    }
    let second = from_c[0] * from_a[1] - from_a[0] * from_c[1];
    if second <= 0.0 && from_a[1] >= 0.0 && from_c[1] <= 0.0 {
        let along = from_a[1] / (from_a[1] - from_c[1]);
        return [1.0 - along, 0.0, along];
    }
    let first = from_b[0] * from_c[1] - from_c[0] * from_b[1];
    let (to_b, to_c) = (from_b[1] - from_b[0], from_c[0] - from_c[1]);
    if first <= 0.0 && to_b >= 0.0 && to_c >= 0.0 {
        let along = to_b / (to_b + to_c);
        return [0.0, 1.0 - along, along];
    }
    let sum = first + second + third;
    [first / sum, second / sum, third / sum]
}
