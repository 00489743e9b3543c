//! Rigid bodies of any form, as signed distances on a grid.

use supple::contact::{Field, FieldError, Instrument, Pose, Shape, Touch, vectors_to_push};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::state::NodeVector;

use super::scene::Body;

const RADIUS: f32 = 0.008;
const SPACING: f32 = 0.001;

/// Distances of a box with round edges, or of a sphere if it has no size.
fn rounded(half: [f32; 3], spacing: f32) -> (Vec<f32>, [u32; 3], [f32; 3]) {
    let reach = half.map(|half| half + RADIUS + 3.0 * spacing);
    let size = reach.map(|reach| (2.0 * reach / spacing) as u32 + 1);
    let origin = reach.map(|reach| -reach);
    let mut values = Vec::new();
    for k in 0..size[2] {
        for j in 0..size[1] {
            for i in 0..size[0] {
                let at = [i, j, k].map(|index| spacing * index as f32);
                let way = [0, 1, 2].map(|axis| (origin[axis] + at[axis]).abs() - half[axis]);
                let outside: f32 = way.iter().map(|way| way.max(0.0).powi(2)).sum();
                let inside = way[0].max(way[1]).max(way[2]).min(0.0);
                values.push(outside.sqrt() + inside - RADIUS);
            }
        }
    }
    (values, size, origin)
}

/// Mean of the largest force and the deepest node, for a tool that presses a bar.
fn pressed(shape: Shape<'_>) -> [f32; 3] {
    const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [4, 4, 8] };
    let fixed: Vec<_> = (0..25).map(Support::fixed).collect();
    let mut body = Body::new(BAR, &fixed, 40.0);
    let mut tool = Instrument::resting(shape, Pose::along([-0.0081, 0.0103, 0.0312], [0.3, 1.0, 0.5]));
    tool.friction = 0.3;
    tool.move_to(Pose::along([-0.005, 0.0103, 0.0332], [0.3, 1.0, -0.5]), 0.0, 0.1);
    let mut touch = [Touch::default()];
    let (mut sum, mut steps) = ([0.0; 3], 0.0f32);
    while body.time() < 0.2 {
        assert!(body.step([0.0; 3], &[tool], &mut touch).is_taken());
        if body.time() > 0.15 {
            (0..3).for_each(|axis| sum[axis] += touch[0].force[axis]);
            steps += 1.0;
        }
    }
    sum.map(|sum| sum / steps)
}

/// A sphere as a field presses like a sphere, the better the finer the grid.
#[test]
fn a_sphere_on_a_grid_presses_like_a_sphere() {
    let length = |vector: [f32; 3]| vector.iter().map(|force| force * force).sum::<f32>().sqrt();
    let sphere = pressed(Shape::Sphere { radius: RADIUS });
    assert!(length(sphere) > 5e-3);
    for (cells, most) in [(8.0, 0.06), (16.0, 0.02), (32.0, 0.01)] {
        let (values, size, origin) = rounded([0.0; 3], RADIUS / cells);
        let field = Field::new(&values, size, origin, RADIUS / cells).unwrap();
        let force = pressed(Shape::Field(field));
        let off = length([0, 1, 2].map(|axis| sphere[axis] - force[axis])) / length(sphere);
        println!("sphere {sphere:?} N, {cells} cells a radius {force:?} N, off by {:.2} %", 100.0 * off);
        assert!(off < most);
    }
}

/// A free body comes to rest on a box, which carries its weight; a state that keeps clearances moves to the bit like
/// one without.
#[test]
fn a_body_rests_on_a_body_of_any_form() {
    let bar = Bar { size: [0.04, 0.02, 0.02], cells: [6, 3, 3] };
    let (values, size, origin) = rounded([0.02, 0.02, 0.001], SPACING);
    let field = Field::new(&values, size, origin, SPACING).unwrap();
    let bodies = [false, true].map(|keeps| {
        let mut body = Body::new(bar, &[], 30.0);
        if keeps {
            body.pushes = vec![NodeVector::ZERO; vectors_to_push(body.surface.len(), 0)];
        }
        let pose = Pose::along([0.018, 0.011, -0.0095], [0.02, 0.01, 1.0]);
        let mut box_below = Instrument::resting(Shape::Field(field), pose);
        box_below.friction = 0.8;
        let (mut touch, mut mean, mut steps) = ([Touch::default()], 0.0f64, 0.0);
        while body.time() < 0.6 {
            let status = body.step([0.0, 0.0, -9.81], &[box_below], &mut touch);
            assert!(status.is_taken(), "{status:?}");
            if body.time() > 0.4 {
                mean -= f64::from(touch[0].force[2]);
                steps += 1.0;
            }
        }
        (body, mean / steps)
    });
    let [(body, carried), (other, _)] = &bodies;
    let weight = 9.81 * body.momentum().1;
    println!("carries {:.3} mN of {:.3} mN", 1e3 * carried, 1e3 * weight);
    assert!((carried / weight - 1.0).abs() < 2e-3);
    assert_eq!(body.bits(), other.bits());
}

#[test]
fn a_field_that_cannot_be_used_says_why() {
    let (values, size, origin) = rounded([0.0; 3], SPACING);
    let field = Field::new(&values, size, origin, SPACING).unwrap();
    let bytes = field.to_bytes();
    // In memory that is aligned.
    let aligned = |bytes: &[u8]| -> Vec<u32> {
        bytes.chunks(4).map(|four| u32::from_ne_bytes(four.try_into().unwrap())).collect()
    };
    let words = aligned(&bytes);
    let parsed = Field::parse(bytemuck::cast_slice(&words)).unwrap();
    assert_eq!(parsed, field);
    let mut changed = bytes.clone();
    *changed.last_mut().unwrap() ^= 1;
    let changed = aligned(&changed);
    let mut other = values.clone();
    other[7] = f32::NAN;
    let outside = vec![0.01; values.len()];
    let wrong: [(Result<Field<'_>, FieldError>, &str); 7] = [
        (Field::new(&values[1..], size, origin, SPACING), "values"),
        (Field::new(&values, size, origin, f32::NAN), "spacing"),
        (Field::new(&other, size, origin, SPACING), "value 7"),
        (
            Field::new(&values, size, origin, SPACING).and_then(|_| Field::new(&outside, size, origin, SPACING)),
            "inside",
        ),
        (Field::parse(&bytes[..20]), "few"),
        (Field::parse(bytemuck::cast_slice(&changed)), "checksum"),
        (Field::parse(&[0; 100]), "not those of a field"),
    ];
    for (result, what) in wrong {
        let error = result.unwrap_err().to_string();
        println!("{error}");
        assert!(error.contains(what), "{error}");
    }
    let inside = vec![-0.001; values.len()];
    assert!(matches!(Field::new(&inside, size, origin, SPACING), Err(FieldError::Rim { index: 0 })));
}

/// The field of a surface of triangles, against the closed form of a box.
#[test]
fn the_field_of_a_mesh_is_its_distance() {
    let bar = Bar { size: [0.02, 0.03, 0.04], cells: [2, 3, 4] };
    let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
    let surface = supple::mesh::boundary(tets);
    let made = supple::contact::SurfaceField::new(&points, &surface, 0.0017).unwrap();
    let turned: Vec<_> = surface.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert_eq!(supple::contact::SurfaceField::new(&points, &turned, 0.0017).unwrap().values, made.values);
    let field = made.field().unwrap();
    let (mut worst, [x, y, _]) = (0.0f32, made.size.map(|points| points as usize));
    for (index, value) in made.values.iter().enumerate() {
        let at = [index % x, index / x % y, index / (x * y)];
        let way = [0, 1, 2].map(|axis| {
            let half = 0.5 * bar.size[axis];
            (made.origin[axis] + made.spacing * at[axis] as f32 - half).abs() - half
        });
        let outside: f32 = way.iter().map(|way| way.max(0.0).powi(2)).sum();
        let exact = outside.sqrt() + way[0].max(way[1]).max(way[2]).min(0.0);
        worst = worst.max((value - exact).abs());
    }
    println!("{} points, off by at most {worst:.1e} m, {:?}", made.values.len(), field);
    assert!(worst < 1e-6);
    let error = supple::contact::SurfaceField::new(&points, &surface, 1e-6).unwrap_err();
    println!("{error}");
}
