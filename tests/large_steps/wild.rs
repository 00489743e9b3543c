//! Irregular meshes and random loads: nothing diverges, but for a few runs in a hundred of a tissue that becomes a hundred
//! times as stiff in a single step.

use std::sync::atomic::{AtomicU32, Ordering};

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use supple::element::ElementMaterial;
use supple::loads::{Loads, Motion, NodalForce};
use supple::material::{AnyLaw, Law, NodalStrain, Tissue};
use supple::scene::{Axes, Support};
use supple::step::Step;

use crate::large_steps::{GAIN, limit, prepared};
use crate::reference::Random;
use crate::support::bodies::held;
use crate::support::{Body, EXP, NEO, largest, rest_of, tissue, to_f64};

/// A bar of 2 x 2 x 4 cm whose layers grow along all axes and whose nodes are shaken as far as every element stays
/// above a thousandth of what its cell would have. Drawn again if its elements' volumes hardly differ.
fn wild(random: &mut Random) -> Body {
    loop {
        let body = shaken(random);
        if spread(&volumes(&body)) > 50.0 {
            return body;
        }
    }
}

fn shaken(random: &mut Random) -> Body {
    let (size, cells) = ([0.02_f32, 0.02, 0.04], [3_u32, 3, 5]);
    let mut body = Body::bar(size, cells);
    let powers = random.vector().map(|x| 1.6 + 0.6 * x);
    for point in &mut body.points {
        for axis in 0..3 {
            let share = f64::from(point[axis] / size[axis]);
            point[axis] = (f64::from(size[axis]) * share.powf(powers[axis])) as f32;
        }
    }
    let mut around = vec![Vec::new(); body.points.len()];
    for (element, tet) in body.tets.iter().enumerate() {
        for &node in tet {
            around[node as usize].push(element);
        }
    }
    let straight = volumes(&body);
    for node in 0..body.points.len() {
        let before = body.points[node];
        let least = around[node].iter().map(|&e| straight[e]).fold(f64::INFINITY, f64::min).cbrt();
        let mut reach = 1.2 * least;
        for _ in 0..8 {
            let by = random.vector();
            for axis in 0..3 {
                let inside = before[axis] > 0.0 && before[axis] < size[axis];
                body.points[node][axis] = before[axis] + if inside { (reach * by[axis]) as f32 } else { 0.0 };
            }
            let now = volumes(&body);
            if around[node].iter().all(|&e| now[e] > 0.02 * straight[e]) {
                break;
            }
            body.points[node] = before;
            reach *= 0.7;
        }
    }
    body
}

fn volumes(body: &Body) -> Vec<f64> {
    body.reference().volumes()
}

/// The largest volume over the smallest.
fn spread(volumes: &[f64]) -> f64 {
    volumes.iter().copied().fold(0.0, f64::max) / volumes.iter().copied().fold(f64::INFINITY, f64::min)
}

struct Drawn {
    supports: Vec<Support>,
    forces: Vec<NodalForce>,
    motions: Vec<Motion>,
    gravity: [f32; 3],
    damping: f32,
}

/// Random supports and loads: sudden and slow forces, up to fifty times the weight, prescribed motions of up to a
/// centimetre.
fn drawn(random: &mut Random, body: &Body) -> Drawn {
    let nodes = body.points.len() as f64;
    let pick = |random: &mut Random| (random.next().abs() * nodes).min(nodes - 1.0) as u32;
    let mut supports = if random.next() > -0.5 { held(body) } else { Vec::new() };
    for _ in 0..6 {
        let axes = [Axes::X, Axes::Y, Axes::Z, Axes::X.union(Axes::Z), Axes::XYZ];
        let axes = axes[(random.next().abs() * 4.99) as usize];
        supports.push(Support { node: pick(random), axes, moves: false });
    }
    let mut motions = Vec::new();
    for _ in 0..3 {
        let (node, ramp) = (pick(random), (0.2 * random.next()).max(0.02) as f32);
        supports.push(Support::moved(node));
        motions.push(Motion { node, axes: Axes::XYZ, metre: random.vector().map(|x| (3e-3 * x) as f32), ramp });
    }
    let strength = 10.0_f64.powf(-2.5 + random.next());
    let forces = (0..12).map(|_| {
        let ramp = (0.2 * random.next()).max(0.0) as f32;
        NodalForce { node: pick(random), newton: random.vector().map(|x| (strength * x) as f32), ramp }
    });
    let forces = forces.collect();
    let gravity = random.vector().map(|x| (10.0 * x) as f32);
    let damping = (20.0 * random.next()).max(0.0) as f32;
    Drawn { supports, forces, motions, gravity, damping }
}

/// Steps at a multiple of the limit; the largest displacement and the largest share of kinetic energy in its energy
/// balance.
fn survive<M: ElementMaterial>(
    body: &Body,
    drawn: &Drawn,
    (law, material): (AnyLaw, impl Fn(Tissue<AnyLaw>) -> M),
    multiple: f32,
) -> Result<(f64, f64), String> {
    let scene = body.scene(material(tissue(law)), &drawn.supports);
    // A node that stands still may not be moved as well; the support that moves wins.
    let loads = Loads::new(&scene, drawn.gravity, &drawn.forces, &drawn.motions).unwrap();
    let step = Step::unchecked(multiple * limit(&scene), drawn.damping).unwrap();
    let mut state = rest_of(&scene);
    let mut large = prepared(body, &scene, &mut state, step, GAIN);
    let (mut moved, mut share) = (0.0_f64, 0.0_f64);
    let count = (0.5 / step.seconds()).clamp(100.0, 600.0) as u32;
    for taken in 0..count {
        let status = large.step(scene.view(), &loads, state.view());
        if !status.is_taken() {
            return Err(format!("{} at {multiple}, step {taken}: {status:?}", law.name()));
        }
        let largest = largest(&to_f64(state.displacements()));
        if !largest.is_finite() || state.displacements().iter().any(|u| u.to_array().iter().any(|x| x.is_nan())) {
            return Err(format!("{} at {multiple}, step {taken}: not finite", law.name()));
        }
        moved = moved.max(largest);
        let energy_balance = state.energy_balance();
        if energy_balance.peak + energy_balance.uncertainty > 0.0 {
            share = share.max(energy_balance.kinetic / (energy_balance.peak + energy_balance.uncertainty));
        }
    }
    Ok((moved, share))
}

/// Runs of the exponential law that diverged, and how many may.
static REFUSED: AtomicU32 = AtomicU32::new(0);
const MOST_REFUSED: u32 = 2;

proptest! {
    #![proptest_config(ProptestConfig {
        cases: if cfg!(feature = "slow-tests") { 40 } else { 5 },
        failure_persistence: None,
        // The same bodies in every run: others are drawn by hand.
        rng_seed: RngSeed::Fixed(1),
        max_shrink_iters: 0,
        ..ProptestConfig::default()
    })]

    #[test]
    fn no_mesh_and_no_load_makes_it_diverge(seed in any::<u64>(), multiple in 10.0_f32..100.0) {
        let mut random = Random(seed);
        let body = wild(&mut random);
        let volumes = volumes(&body);
        let spread = spread(&volumes);
        let drawn = drawn(&mut random, &body);
        let mut line = format!("volumes differ by {spread:.0}, damping {:.1}/s, {multiple:.0} times the limit:", drawn.damping);
        for (law, outcome) in [
            (NEO, survive(&body, &drawn, (NEO, |tissue| tissue), multiple)),
            (EXP, survive(&body, &drawn, (EXP, |tissue| tissue), multiple)),
            (NEO, survive(&body, &drawn, (NEO, NodalStrain), multiple)),
            (EXP, survive(&body, &drawn, (EXP, NodalStrain), multiple)),
        ] {
            if outcome.is_err() && law == EXP {
                let refused = REFUSED.fetch_add(1, Ordering::Relaxed) + 1;
                println!("seed {seed}: {outcome:?}, {refused} of at most {MOST_REFUSED}");
                prop_assert!(refused <= MOST_REFUSED);
                continue;
            }
            prop_assert!(outcome.is_ok(), "seed {seed}, volumes differ by {spread:.0}, damping {}: {outcome:?}", drawn.damping);
            let (moved, share) = outcome.unwrap();
            line += &format!(" {:.1} mm, kinetic energy {share:.2} of the energy balance;", 1e3 * moved);
            prop_assert!(share <= 4.0, "{line}");
        }
        println!("{line}");
        prop_assert!(spread > 50.0 && volumes.iter().all(|volume| *volume > 0.0));
    }
}

/// A case of the test above: an element was crushed while the lattice's inertia was a cycle old, and damping took away
/// thousands of metres of smooth motion that did not exist.
#[test]
fn smooth_motion_is_none_where_the_lattice_cannot_tell() {
    let mut random = Random(2_280_812_162_470_855_614);
    let body = wild(&mut random);
    let drawn = drawn(&mut random, &body);
    for multiple in [66.0, 67.0, 68.0, 68.009_92, 69.0] {
        let (moved, _) = survive(&body, &drawn, (EXP, |tissue| tissue), multiple).unwrap();
        assert!(moved < 0.1, "moved by {moved} m at {multiple} times the limit");
    }
}
