//! Forces of instruments against closed forms: a flat punch, Hertz, Coulomb on a slope.

use supple::contact::{Instrument, Pose, Shape, Touch};
use supple::element::Axes;
use supple::mesh::Bar;
use supple::scene::Support;

use super::scene::Body;

/// Smoothly from 0 to 1.
fn eased(share: f64) -> f32 {
    let s = share.clamp(0.0, 1.0);
    (s * s * (3.0 - 2.0 * s)) as f32
}

/// A cube on a smooth table, free to spread, under a plane: uniaxial compression of a neo-Hookean body, whose lateral
/// stretch is the root of an equation in one unknown. The reference is solved here in float64 from the law's energy
/// alone, `c (I1 J^(-2/3) - 3) + d (J - 1)^2`.
#[test]
fn a_plane_presses_with_the_force_of_uniaxial_compression() {
    const BAR: Bar = Bar { size: [0.02, 0.02, 0.02], cells: [4, 4, 4] };
    const PRESSED: f64 = 0.002;
    let table: Vec<_> = (0..25).map(|node| Support { node, axes: Axes::Z, moves: false }).collect();
    let mut body = Body::new(BAR, &table, 60.0);
    let mut plate = Instrument::resting(Shape::Plane, Pose::along([0.01, 0.01, 0.021], [0.0, 0.0, -1.0]));
    let mut touch = [Touch::default()];
    while body.time() < 1.0 {
        let (now, next) = (body.time(), body.time() + 1e-3);
        let depth = PRESSED as f32 * eased(next / 0.5);
        plate.move_to(Pose::along([0.01, 0.01, 0.02 - depth], [0.0, 0.0, -1.0]), now, next);
        while body.time() < next {
            assert!(body.step([0.0; 3], &[plate], &mut touch).is_taken());
        }
    }
    let (c, d) = (1000.0, 10_000.0);
    let axial = 1.0 - PRESSED / 0.02;
    let energy = |l: f64, a: f64| {
        let j: f64 = l * l * a;
        c * ((2.0 * l * l + a * a) * j.powf(-2.0 / 3.0) - 3.0) + d * (j - 1.0).powi(2)
    };
    let slope = |f: &dyn Fn(f64) -> f64, x: f64| (f(x + 1e-6) - f(x - 1e-6)) / 2e-6;
    let (mut low, mut high) = (0.9, 1.2);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if slope(&|l| energy(l, axial), middle) < 0.0 { low = middle } else { high = middle }
    }
    let expected = -4e-4 * slope(&|a| energy(low, a), axial);
    let force = f64::from(touch[0].force[2]);
    println!(
        "plane: {:.3} mN, closed form {:.3} mN, error {:.1e}",
        1e3 * force,
        1e3 * expected,
        force / expected - 1.0
    );
    assert!((force / expected - 1.0).abs() < 0.01);
    assert_eq!(touch[0].contacts, 25);
}

/// Coulomb on a slope: gravity is turned instead of the table. A slab whose slope is 2 % below the angle of friction
/// comes to rest; one that is above slides with `g (sin a - mu cos a)`.
#[test]
fn a_slab_on_a_slope_sticks_below_the_angle_of_friction_and_slides_above() {
    const BAR: Bar = Bar { size: [0.03, 0.03, 0.01], cells: [3, 3, 1] };
    const FRICTION: f32 = 0.5;
    const DAMPING: f32 = 200.0;
    let limit = FRICTION.atan();
    for (share, slides) in [(0.98, false), (1.02, true), (1.3, true)] {
        let mut body = Body::new(BAR, &[], DAMPING);
        let mut table = Instrument::resting(Shape::Plane, Pose::at([0.0; 3]));
        table.friction = FRICTION;
        let (sin, cos) = (limit * share).sin_cos();
        let gravity = [9.81 * sin, 0.0, -9.81 * cos];
        let mut touch = [Touch::default()];
        while body.time() < 1.0 {
            assert!(body.step(gravity, &[table], &mut touch).is_taken());
        }
        let (momentum, mass) = body.momentum();
        let speed = momentum[0] / mass;
        // What damping leaves of the acceleration is the final speed.
        let expected = f64::from(9.81 * (sin - FRICTION * cos) / DAMPING).max(0.0);
        println!("slope at {share} of the angle: {:.3} mm/s, expected {:.3} mm/s", 1e3 * speed, 1e3 * expected);
        let scale = f64::from(9.81 * sin / DAMPING);
        assert!((speed - expected).abs() < 0.02 * scale, "{speed} {expected}");
        assert_eq!(slides, speed > 1e-4);
    }
}

/// Hertz 1882: a rigid sphere of 10 mm, 0.5 mm deep, in a half-space: `F = 4/3 E / (1 - nu^2) sqrt(R) d^1.5`. A quarter
/// of a cube of 80 mm, with symmetry at two sides; cells are finer near the contact.
#[test]
fn a_sphere_presses_with_the_force_of_hertz() {
    const R: f32 = 0.01;
    const DEPTH: f32 = 0.0005;
    const WIDTH: f32 = 0.08;
    let (shear, bulk) = (2000.0f64, 20_000.0f64);
    let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
    let nu = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
    let hertz = 4.0 / 3.0 * young / (1.0 - nu * nu) * f64::from(R).sqrt() * f64::from(DEPTH).powf(1.5);
    let graded = |s: f32| WIDTH * (0.1 * s + 0.9 * s * s * s);
    let mut errors = Vec::new();
    for cells in [8, 12, 16] {
        let bar = Bar { size: [1.0; 3], cells: [cells; 3] };
        let points: Vec<_> = bar.points().map(|[x, y, z]| [graded(x), graded(y), WIDTH - graded(1.0 - z)]).collect();
        let supports: Vec<_> = points
            .iter()
            .zip(0..)
            .filter_map(|(&[x, y, z], node)| {
                let held = [(x == 0.0, Axes::X), (y == 0.0, Axes::Y), (z == 0.0, Axes::XYZ)];
                let axes = held.into_iter().filter(|held| held.0).fold(Axes::NONE, |all, held| all.union(held.1));
                (axes != Axes::NONE).then_some(Support { node, axes, moves: false })
            })
            .collect();
        let mut body = Body::of(points, &bar.tets().collect::<Vec<_>>(), &supports, 100.0);
        let mut sphere = Instrument::resting(Shape::Sphere { radius: R }, Pose::at([0.0, 0.0, WIDTH + R]));
        let mut touch = [Touch::default()];
        while body.time() < 0.25 {
            let (now, next) = (body.time(), body.time() + 1e-3);
            let depth = DEPTH * eased(next / 0.15);
            sphere.move_to(Pose::at([0.0, 0.0, WIDTH + R - depth]), now, next);
            while body.time() < next {
                assert!(body.step([0.0; 3], &[sphere], &mut touch).is_taken());
            }
        }
        let error = 4.0 * f64::from(touch[0].force[2]) / hertz - 1.0;
        let (percent, contacts) = (100.0 * error, touch[0].contacts);
        println!("{cells} cells: {percent:+.1} % of {:.3} mN, {contacts} nodes touch", 1e3 * hertz);
        errors.push(error);
    }
    assert!(errors[2].abs() < 0.1, "{errors:?}");
    assert!(errors.is_sorted_by(|a, b| a.abs() > b.abs()), "{errors:?}");
}
