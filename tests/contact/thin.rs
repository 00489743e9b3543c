//! Instruments that are thinner than the edges of the surface are long, which pass between its nodes and touch its
//! triangles.

use supple::contact::{Instrument, Pose, Shape, Touch};
use supple::inertia::Method;
use supple::mesh::Bar;
use supple::scene::Support;
use supple::step::Status;

use super::long_steps::{BAR, Run, length, long};
use super::scene::{Body, compared};

const EDGE: f32 = 0.005;
const NEEDLE: Shape = Shape::Capsule { radius: 0.0008, length: 0.03 };
const DAMPING: f32 = 20.0;

fn held() -> Vec<Support> {
    (0..25).map(Support::fixed).collect()
}

/// The needle with its tip at `tip`, along x, with its middle outside the bar.
fn at(tip: [f32; 3]) -> Pose {
    Pose::along([tip[0] - 0.0158, tip[1], tip[2]], [1.0, 0.0, 0.0])
}

/// How deep the needle is inside the surface between its nodes, m: from many points of each triangle, in float64.
fn deepest(body: &Body, tip: [f32; 3]) -> f64 {
    let place = |place: u32| {
        let entry = &body.surface[place as usize];
        let moved = body.displacement(entry.node as usize);
        [0, 1, 2].map(|axis| f64::from(entry.rest[axis]) + f64::from(moved[axis]))
    };
    let end = [f64::from(tip[0]) - 0.0008, f64::from(tip[1]), f64::from(tip[2])];
    let mut deepest = 0.0f64;
    for triangle in &body.triangles {
        let [a, b, c] = triangle.map(place);
        for second in 0..=20 {
            for third in 0..=20 - second {
                let [u, v, w] = [20 - second - third, second, third].map(|part| f64::from(part) / 20.0);
                let point = [0, 1, 2].map(|axis| u * a[axis] + v * b[axis] + w * c[axis] - end[axis]);
                let way = length([point[0].max(0.0), point[1], point[2]]);
                deepest = deepest.max(0.0008 - way);
            }
        }
    }
    deepest
}

/// Press by 2 mm between the nodes, hold, slide by 4 mm over the edges between triangles, and retract.
fn path(speed: f64) -> [(f64, [f32; 3]); 5] {
    let [press, hold, slide] = [0.002 / speed, 0.1, 0.004 / speed];
    let ends = [0.0, press, press + hold, press + hold + slide, 2.0 * press + hold + slide];
    let [start, inside, end] = [-0.0001, 0.0019, -0.001];
    let [low, high] = [[0.0115, 0.0265], [0.0135, 0.03]];
    let at = [(start, low), (inside, low), (inside, low), (inside, high), (end, high)];
    [0, 1, 2, 3, 4].map(|part| (ends[part], [at[part].0, at[part].1[0], at[part].1[1]]))
}

/// Means of the force over the parts of the path, N, and the deepest point, m.
fn course(method: Option<Method>, seconds: f32, speed: f64) -> (Vec<[f64; 3]>, f64) {
    let is_long = method.is_some();
    let mut run = Run::new(Body::new(BAR, &held(), DAMPING).with_triangles(), method, seconds, DAMPING);
    let path = path(speed);
    let mut needle = Instrument::resting(NEEDLE, at(path[0].1));
    needle.friction = 0.3;
    let (mut means, mut inside) = (Vec::new(), 0.0f64);
    for (from, to) in path.iter().zip(&path[1..]) {
        needle.move_to(at(to.1), from.0, to.0);
        let (mut sum, mut steps) = ([0.0f64; 3], 0);
        while run.body.time() < to.0 {
            let status = run.step(needle);
            assert!(status.is_taken(), "{status:?}");
            sum.iter_mut().zip(run.touch[0].force).for_each(|(sum, force)| *sum += f64::from(force));
            steps += 1;
            if is_long || steps % 16 == 0 {
                let share = (((run.body.time() - from.0) / (to.0 - from.0)) as f32).min(1.0);
                let tip = [0, 1, 2].map(|axis| from.1[axis] + share * (to.1[axis] - from.1[axis]));
                inside = inside.max(deepest(&run.body, tip));
            }
        }
        means.push(sum.map(|sum| sum / f64::from(steps)));
    }
    assert_eq!(run.touch[0].contacts, 0, "it still touches");
    (means, inside)
}

/// A needle that meets no node: exact steps at a quarter of the critical one are the reference for all others.
#[test]
fn a_needle_presses_and_slides_between_the_nodes() {
    let critical = Body::new(BAR, &held(), DAMPING).step.seconds();
    for (speed, most) in [(0.005, 0.03), (0.02, 0.14)] {
        let (exact, inside) = course(None, 0.25 * critical, speed);
        let percent = |inside: f64| 100.0 * inside / f64::from(EDGE);
        println!("{:.0} mm/s, exact: {:.2} % of an edge inside: {exact:.4?}", 1e3 * speed, percent(inside));
        assert!(exact[1][0] < -1e-2 && percent(inside) < 1.0);
        let all: f64 = exact.iter().map(|force| length(*force)).sum();
        let cases = [
            ("exact", None, 0.9, 0.05),
            ("long", Some(long()), 4.0, most),
            ("long", Some(long()), 10.0, most),
            ("long", Some(long()), 20.0, most),
        ];
        for (name, method, multiple, most) in cases {
            let (means, inside) = course(method, multiple * critical, speed);
            let parts = means.iter().zip(&exact).map(|(a, b)| length([0, 1, 2].map(|axis| a[axis] - b[axis])));
            let share = parts.sum::<f64>() / all;
            println!(
                "  {name} at {multiple}: force off by {:.1} %, {:.2} % of an edge inside: {means:.4?}",
                100.0 * share,
                percent(inside)
            );
            assert!(share < most && percent(inside) < 1.0);
        }
    }
}

/// Without triangles the same needle goes through without a touch.
#[test]
fn without_triangles_it_passes_between_the_nodes() {
    let mut body = Body::new(BAR, &held(), DAMPING);
    let path = path(0.02);
    let mut needle = Instrument::resting(NEEDLE, at(path[0].1));
    needle.move_to(at(path[1].1), 0.0, path[1].0);
    let mut touch = [Touch::default()];
    while body.time() < path[1].0 {
        assert_eq!(body.step([0.0; 3], &[needle], &mut touch), Status::Ok);
        assert_eq!(touch[0].contacts, 0);
    }
}

/// A free body that a needle hits and drags: the impulse of the needle is the change of its momentum.
#[test]
fn the_impulse_of_a_needle_is_the_change_of_momentum() {
    let mut body = Body::new(BAR, &[], 0.0).with_triangles();
    let mut needle = Instrument::resting(NEEDLE, at([-0.0001, 0.0115, 0.0265]));
    needle.friction = 0.4;
    needle.move_to(at([0.006, 0.0135, 0.0275]), 0.0, 0.1);
    let mut touch = [Touch::default()];
    let (mut impulse, mut pushed, mut first) = ([0.0f64; 3], 0, true);
    while body.time() < 0.15 {
        assert!(body.step([0.0; 3], &[needle], &mut touch).is_taken());
        // In the first step a force acts for half a step.
        let span = f64::from(body.step.seconds()) * if first { 0.5 } else { 1.0 };
        first = false;
        impulse.iter_mut().zip(touch[0].force).for_each(|(sum, force)| *sum -= f64::from(force) * span);
        pushed += u32::from(touch[0].contacts > 0);
    }
    let (momentum, _) = body.momentum();
    let (size, error) = compared(momentum, impulse);
    println!("momentum {momentum:?}, impulse {impulse:?}, off by {error:.1e}; {pushed} steps");
    assert!(pushed > 20 && size > 1e-5 && error < 1e-4);
}

/// A ball of the size of an edge on a coarse surface: where triangles are touched, too, it sinks in no farther than
/// into a fine one.
#[test]
fn triangles_bring_the_force_of_a_coarse_surface_nearer_to_that_of_a_fine_one() {
    let force = |cells: [u32; 3], triangles: bool| {
        let bar = Bar { size: [0.02, 0.02, 0.02], cells };
        let fixed: Vec<_> =
            bar.points().zip(0..).filter(|(point, _)| point[2] == 0.0).map(|(_, node)| Support::fixed(node)).collect();
        let body = Body::new(bar, &fixed, 60.0);
        let mut body = if triangles { body.with_triangles() } else { body };
        let at = |depth: f32| Pose::at([0.0085, 0.0115, 0.025 - depth]);
        let mut ball = Instrument::resting(Shape::Sphere { radius: 0.005 }, at(0.0));
        ball.move_to(at(0.0015), 0.0, 0.2);
        let mut touch = [Touch::default()];
        while body.time() < 0.4 {
            assert!(body.step([0.0; 3], &[ball], &mut touch).is_taken());
        }
        f64::from(touch[0].force[2])
    };
    let fine = force([20; 3], true);
    println!("20 cells: {:.2} mN", 1e3 * fine);
    let mut errors = Vec::new();
    for cells in [4, 8, 16] {
        let [nodes, triangles] = [false, true].map(|triangles| force([cells; 3], triangles) / fine - 1.0);
        println!("{cells} cells: nodes only {:+.1} %, triangles {:+.1} %", 100.0 * nodes, 100.0 * triangles);
        errors.push(triangles);
    }
    assert!(errors.is_sorted_by(|a, b| a.abs() > b.abs()) && errors[2].abs() < 0.05, "{errors:?}");
}
