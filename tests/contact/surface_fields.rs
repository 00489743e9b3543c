//! Fields of surfaces of triangles, against the plain way: all triangles in float64, and the winding number for the
//! sign (van Oosterom and Strackee 1983).

use glam::{DVec3, Quat, Vec3};
use supple::contact::SurfaceField;
use supple::mesh::{Bar, boundary};

type Surface = (Vec<Vec3>, Vec<[u32; 3]>);

/// A body from rings of points around the z axis and two poles, by its radius in a direction, m.
fn round(rings: u32, radius: impl Fn(f32, f32) -> f32) -> Surface {
    let around = rings + 3;
    let at = |ring: u32, step: u32| {
        let down = core::f32::consts::PI * ring as f32 / (rings + 1) as f32;
        let turn = core::f32::consts::TAU * step as f32 / around as f32;
        let direction = Vec3::new(down.sin() * turn.cos(), down.sin() * turn.sin(), down.cos());
        radius(down, turn) * direction
    };
    let mut points: Vec<_> = (1..=rings).flat_map(|ring| (0..around).map(move |step| at(ring, step))).collect();
    points.extend([at(0, 0), at(rings + 1, 0)]);
    let node = |ring: u32, step: u32| ring * around + step % around;
    let [top, bottom] = [rings * around, rings * around + 1];
    let mut triangles = Vec::new();
    for step in 0..around {
        triangles.push([top, node(0, step), node(0, step + 1)]);
        triangles.push([bottom, node(rings - 1, step + 1), node(rings - 1, step)]);
        for ring in 0..rings - 1 {
            let [a, b] = [node(ring, step), node(ring, step + 1)];
            let [c, d] = [node(ring + 1, step), node(ring + 1, step + 1)];
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    (points, triangles)
}

fn brick(size: [f32; 3], cells: [u32; 3]) -> Surface {
    let bar = Bar { size, cells };
    (bar.points().map(Vec3::from).collect(), boundary(bar.tets()))
}

/// Along no axis.
fn turned((points, triangles): Surface) -> Surface {
    let turn = Quat::from_xyzw(0.3, -0.5, 0.2, 0.7).normalize();
    (points.into_iter().map(|point| turn * point).collect(), triangles)
}

/// Each triangle with corners of its own.
fn split((points, triangles): Surface) -> Surface {
    let corners = triangles.as_flattened().iter().map(|&corner| points[corner as usize]);
    (corners.collect(), (0..triangles.len() as u32).map(|first| [0, 1, 2].map(|k| 3 * first + k)).collect())
}

fn scaled((points, triangles): Surface, factor: f32) -> Surface {
    (points.into_iter().map(|point| factor * point).collect(), triangles)
}

fn made((points, triangles): &Surface, spacing: f32) -> Result<SurfaceField, String> {
    let points: Vec<_> = points.iter().map(Vec3::to_array).collect();
    SurfaceField::new(&points, triangles, spacing)
}

fn to_triangle(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let edges = [[a, b], [b, c], [c, a]];
    let normal = (b - a).cross(c - a);
    let is_over = |[from, to]: [DVec3; 2]| normal.dot((to - from).cross(point - from)) >= 0.0;
    if normal != DVec3::ZERO && edges.into_iter().all(is_over) {
        return normal.normalize().dot(point - a).abs();
    }
    let to_edge = |[from, to]: [DVec3; 2]| {
        let (way, square) = (to - from, to.distance_squared(from));
        let share = if square > 0.0 { ((point - from).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
        point.distance(from + share * way)
    };
    edges.into_iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

/// Signed.
fn plain(point: DVec3, (points, triangles): &Surface) -> f64 {
    let (mut least, mut angle) = (f64::INFINITY, 0.0);
    for triangle in triangles {
        let corners = triangle.map(|corner| points[corner as usize].as_dvec3());
        least = least.min(to_triangle(point, corners));
        let [a, b, c] = corners.map(|corner| corner - point);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        angle += 2.0 * a.dot(b.cross(c)).atan2(below);
    }
    if angle > core::f64::consts::TAU { -least } else { least }
}

/// Round, sharp, thin and crooked ones, of doubled points, with triangles without area, of any size: as far off as
/// float32 rounds.
#[test]
fn fields_are_the_distance_to_the_nearest_of_all_triangles() {
    let blob = || {
        turned(round(11, |down, turn| {
            0.02 * (1.0 + 0.3 * (3.0 * turn).sin() * down.sin().powi(3) + 0.2 * (5.0 * down).cos())
        }))
    };
    // Rings in pairs at the same place, and in pairs that are hardly apart.
    let rings = |apart: f32| {
        let (mut points, triangles) = round(12, |_, _| 0.02);
        for ring in (0..12).step_by(2) {
            for step in 0..15 {
                let upper = points[ring * 15 + step];
                points[ring * 15 + 15 + step] = upper - apart * Vec3::Z;
            }
        }
        turned((points, triangles))
    };
    let jagged = || {
        let (points, triangles) = round(8, |_, _| 0.02);
        let jagged = points.into_iter().enumerate().map(|(k, point)| point * [0.4, 1.7, 1.0][k * k % 7 % 3]);
        turned((jagged.collect(), triangles))
    };
    let blade = || {
        (vec![Vec3::ZERO, 0.03 * Vec3::X, 0.03 * Vec3::Y, Vec3::new(0.01, 0.01, 3e-4)], {
            vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        })
    };
    let cases = [
        ("sphere", round(12, |_, _| 0.02), 0.0019),
        ("box", brick([0.02, 0.03, 0.04], [2, 3, 4]), 0.0017),
        ("box, spacing that meets its sides", brick([0.02, 0.03, 0.04], [2, 3, 4]), 0.001),
        ("box that is turned", turned(brick([0.02, 0.03, 0.04], [2, 3, 4])), 0.0017),
        ("box of triangles with their own corners", split(brick([0.02, 0.03, 0.04], [2, 3, 4])), 0.0017),
        ("wall of 0.2 mm", turned(brick([0.02, 0.02, 2e-4], [5, 5, 1])), 0.0009),
        ("blade", turned(blade()), 0.001),
        ("jagged", jagged(), 0.0019),
        ("blob", blob(), 0.0019),
        ("blob of 1e-20", scaled(blob(), 1e-20), 3e-23),
        ("blob of 1e20", scaled(blob(), 1e20), 3e17),
        ("triangles without area", rings(0.0), 0.0019),
        ("thin triangles", rings(1e-8), 0.0019),
    ];
    for (name, surface, spacing) in cases {
        let field = made(&surface, spacing).unwrap();
        let [x, y, z] = field.size.map(|points| points as usize);
        let diagonal = f64::from(spacing) * f64::hypot(f64::hypot(x as f64, y as f64), z as f64);
        let mut worst = 0.0f64;
        for (index, &value) in field.values.iter().enumerate() {
            let at = Vec3::new((index % x) as f32, (index / x % y) as f32, (index / (x * y)) as f32);
            let point = (Vec3::from(field.origin) + spacing * at).as_dvec3();
            worst = worst.max((f64::from(value) - plain(point, &surface)).abs() / diagonal);
        }
        println!(
            "{name}: {} triangles, {} points, off by at most {worst:.1e} of the diagonal",
            surface.1.len(),
            field.values.len()
        );
        assert!(worst < 3e-7, "{name}");
    }
}

#[test]
fn surfaces_that_cannot_be_used_say_why() {
    let size = [0.02, 0.03, 0.04];
    let whole = || brick(size, [2, 3, 4]);
    let changed = |change: &dyn Fn(&mut Surface)| {
        let mut surface = whole();
        change(&mut surface);
        surface
    };
    let cases = [
        (changed(&|(_, triangles)| triangles[7][1] = 60), 1e-3, "triangle 7 has the corners"),
        (changed(&|(points, _)| points[5].y = f32::NAN), 1e-3, "point 5 of triangle"),
        (changed(&|(points, _)| *points = points.iter().map(|point| 0.0 * *point).collect()), 1e-3, "area"),
        (changed(&|(_, triangles)| triangles.clear()), 1e-3, "0 triangles"),
        (scaled(whole(), 1e38), 1e-3, "cannot be"),
        (whole(), 0.0, "spacing of 0 m"),
        (whole(), f32::NAN, "spacing of NaN m"),
        (whole(), f32::INFINITY, "spacing of inf m"),
        (whole(), 3e38, "cannot be"),
        (whole(), 1e-9, "points"),
    ];
    for (surface, spacing, why) in cases {
        let error = made(&surface, spacing).unwrap_err();
        println!("{error}");
        assert!(error.contains(why), "{error}");
    }
    // Without one side it has no inside, which the field says when it is checked; no step of it panics.
    let side = |(_, triangles): &mut Surface| triangles.truncate(triangles.len() / 2);
    let odd = |(_, triangles): &mut Surface| triangles.iter_mut().step_by(2).for_each(|triangle| triangle.swap(0, 1));
    for surface in [changed(&side), changed(&odd)] {
        println!("{:?}", made(&surface, 0.002).unwrap().field().map(|field| field.deepest()));
    }
}
