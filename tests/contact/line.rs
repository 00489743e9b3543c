//! Instruments that lie along the surface: contact over a length of triangles, which rests and holds by friction.

use supple::contact::{Instrument, Pose, Shape, Touch};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::step::Step;

use super::scene::Body;

const SLAB: Bar = Bar { size: [0.1, 0.1, 0.05], cells: [6, 6, 3] };
const RADIUS: f32 = 0.015;

/// On a slab that stands on its bottom.
fn slab(bar: Bar, damping: f32) -> Body {
    let bottom = (0..=bar.cells[1]).flat_map(|j| (0..=bar.cells[0]).map(move |i| bar.node(i, j, 0)));
    Body::new(bar, &bottom.map(Support::fixed).collect::<Vec<_>>(), damping).with_triangles()
}

/// Lies along x, so far above the slab (m) and moved by so much sideways.
fn pose(above: f32, sideways: f32) -> Pose {
    Pose::along([0.053 + sideways, 0.051, 0.05 + RADIUS + above], [1.0, 0.0, 0.0])
}

/// Presses a body by `deep` (m), moves the instrument sideways, and lets it stand. Gives the body and the mean forces, N,
/// in tenths of a second after it has come to a stand.
fn pressed(mut body: Body, shape: Shape<'_>, [deep, sideways]: [f32; 2], tenths: usize) -> (Body, Vec<[f32; 3]>) {
    let mut instrument = Instrument::resting(shape, pose(0.001, 0.0));
    instrument.friction = 0.3;
    let (mut touch, mut forces) = ([Touch::default()], Vec::new());
    let path = [(0.0, 0.1, pose(-deep, 0.0)), (0.1, 0.15, pose(-deep, sideways))];
    let stands =
        (0..tenths).map(|tenth| 0.1 * (tenth as f64) + 0.25).map(|end| (end - 0.1, end, pose(-deep, sideways)));
    for (from, to, pose) in path.into_iter().chain(stands) {
        instrument.move_to(pose, from, to);
        let (mut sum, mut steps) = ([0.0f32; 3], 0.0);
        while body.time() < to {
            let status = body.step([0.0; 3], &[instrument], &mut touch);
            assert!(status.is_taken(), "{status:?}");
            sum.iter_mut().zip(touch[0].force).for_each(|(sum, force)| *sum += force);
            steps += 1.0;
        }
        forces.push(sum.map(|sum| sum / steps));
    }
    (body, forces.split_off(2))
}

/// The sideways force is a seventh of that across, the friction 0.3: nothing slides, and the force stays.
#[test]
fn a_capsule_along_the_surface_holds_it_by_friction_and_rests() {
    let mut body = slab(SLAB, 40.0);
    body.step = Step::new(0.5 * body.step.seconds(), 40.0, body.critical).unwrap();
    let (body, forces) = pressed(body, Shape::Capsule { radius: RADIUS, length: 0.06 }, [0.005, 0.003], 10);
    let (first, last, kinetic) = (forces[3], forces[9], body.kinetic());
    println!("after 0.4 s {first:?} N, after 1 s {last:?} N, kinetic energy {kinetic:.1e} J");
    assert!(first[0] < -0.1 * first[2] && first[2] > 1.0, "{first:?}");
    assert!((last[0] / first[0] - 1.0).abs() < 0.005, "{first:?} {last:?}");
    assert!(kinetic < 3e-7, "{kinetic} J");
}

/// What rolls under a large ball is stiffer than the soft elements there.
#[test]
fn a_ball_and_a_capsule_on_triangles_are_settled_under() {
    let fine = Bar { size: [0.1, 0.1, 0.05], cells: [12, 12, 6] };
    let capsule = Shape::Capsule { radius: RADIUS, length: 0.06 };
    for (name, bar, shape) in [("ball", fine, Shape::Sphere { radius: RADIUS }), ("capsule", SLAB, capsule)] {
        let (mut body, _) = pressed(slab(bar, 40.0), shape, [0.005, 0.0], 1);
        let instrument = Instrument::resting(shape, pose(-0.005, 0.0));
        let settled = body.settle(&[instrument], 1e-5, 3000);
        println!("{name}: {settled:?}");
        assert!(settled.at_rest);
    }
}
