//! Elements that are removed.

use super::*;

use glam::DVec3;
use supple::contact::{Instrument, Pose, Shape};
use supple::loads::Loads;
use supple::material::Prony;
use supple::mesh::{Mesh, Winding, boundary};
use supple::pressure::SurfacePressure;
use supple::scene::FixedScene;
use supple::state::{FixedState, NodeVector, VecState};
use supple::step::{Status, Step};
use supple::tled;

/// Momentum of the elements that are not removed, by quarters of their masses, kg m/s.
fn momentum_of(body: &Simulation<'_>, removed: &[u32]) -> DVec3 {
    let points: Vec<_> = BAR.points().map(|point| glam::Vec3::from(point).as_dvec3()).collect();
    let mut sum = DVec3::ZERO;
    for (_, tet) in (0..).zip(BAR.tets()).filter(|(element, _)| !removed.contains(element)) {
        let [a, b, c, d] = tet.map(|node| points[node as usize]);
        let mass = f64::from(DENSITY) * (b - a).dot((c - a).cross(d - a)).abs() / 6.0;
        let velocity = |node: u32| glam::Vec3::from(body.state().velocity(node as usize)).as_dvec3();
        sum += tet.into_iter().map(|node| 0.25 * mass * velocity(node)).sum::<DVec3>();
    }
    sum
}

/// The same by the masses of the scene's nodes.
fn momentum(body: &Simulation<'_>) -> DVec3 {
    let view = body.scene().view();
    let of = |node| f64::from(view.node_mass(node)) * glam::Vec3::from(body.state().velocity(node)).as_dvec3();
    (0..view.node_count()).map(of).sum()
}

/// A tip that hangs on nothing any more keeps its momentum, and falls with it. Long steps tie it to the stub, as their
/// lattice spans the gap, and their guard says so.
#[test]
fn what_stays_keeps_its_momentum_and_falls_freely() {
    let gap = elements_where(|[_, _, z]| (0.05..0.06).contains(&z));
    let auto = Method::Auto(inertia::Method::new(inertia::Cells::Suggested));
    for element in ELEMENTS {
        for (name, method) in [("exact", Method::Exact), ("auto", auto.clone()), ("long", long())] {
            let name = format!("{element:?}, {name}");
            let is_long = matches!(method, Method::Long(_));
            let mut body = bar(element).with(Settings { guard: true, ..settings(method, 0.0) });
            body.gravity = [4.0, 0.0, 0.0];
            body.advance(0.06).unwrap();
            let before = momentum_of(&body, &gap);
            body.remove(&gap).unwrap();
            let after = momentum(&body);
            println!("{name}: {before:.6} kg m/s, {:.1e} off", before.distance(after));
            assert!(before.length() > 1e-3 && before.distance(after) < 1e-5 * before.length(), "{name}");
            let mass = 0.108 * (1.0 - gap.len() as f64 / BAR.element_count() as f64);
            assert!((body.scene().mass() / mass - 1.0).abs() < 1e-5, "{}", body.scene().mass());
            let (x, v) = (
                tip_mean(&body, |node| body.displacements()[node].to_array()),
                tip_mean(&body, |node| body.state().velocity(node)),
            );
            let mut doubted = false;
            for _ in 0..10 {
                let report = body.advance(0.02).unwrap();
                doubted |= !report.is_ok();
                assert!(report.is_ok() || is_long, "{name}: {:?}", report.status);
            }
            // The centre of the free part follows the parabola; the velocity is that half a step before.
            let fallen = tip_mean(&body, |node| body.displacements()[node].to_array());
            let expected = x + 0.2 * v + 0.5 * 0.2 * 0.2 * DVec3::X * 4.0;
            println!("{name}: {fallen:.5} for {expected:.5}, in doubt: {doubted}");
            let off = fallen.distance(expected) / expected.length();
            assert!(if is_long { doubted && off < 0.4 } else { off < 0.02 }, "{name}");
        }
    }
}

/// The mean of the tip's nodes by their masses.
fn tip_mean(body: &Simulation<'_>, of: impl Fn(usize) -> [f32; 3]) -> DVec3 {
    let (view, mut mass, mut sum) = (body.scene().view(), 0.0, DVec3::ZERO);
    for node in body.points().iter().enumerate().filter(|(_, point)| point[2] > 0.059).map(|(node, _)| node) {
        mass += f64::from(view.node_mass(node));
        sum += f64::from(view.node_mass(node)) * glam::Vec3::from(of(node)).as_dvec3();
    }
    sum / mass
}

/// After a while the state is that of a body that never had the elements.
#[test]
fn the_end_is_that_of_a_mesh_without_the_elements() {
    // A notch, and a cut-off corner at the tip: some nodes are left alone.
    let removed = elements_where(|[x, _, z]| (x < 0.015 && (0.04..0.06).contains(&z)) || (x > 0.015 && z > 0.1));
    let tets: Vec<_> = BAR.tets().collect();
    let left: Vec<_> =
        (0..).zip(&tets).filter(|(element, _)| !removed.contains(element)).map(|(_, &tet)| tet).collect();
    let mut numbers = vec![None; BAR.node_count()];
    let mut points = vec![];
    for (node, point) in BAR.points().enumerate() {
        if left.iter().flatten().any(|&other| other as usize == node) {
            numbers[node] = Some(points.len() as u32);
            points.push(point);
        }
    }
    let alone = numbers.iter().filter(|number| number.is_none()).count();
    let left: Vec<_> = left.iter().map(|tet| tet.map(|node| numbers[node as usize].unwrap())).collect();
    for element in ELEMENTS {
        for method in [Method::Exact, long()] {
            let name = format!("{element:?}, {}", if matches!(method, Method::Exact) { "exact" } else { "long" });
            let rest = |mut body: Simulation<'static>, seconds: f64| {
                body.gravity = [2.0, 0.0, 0.0];
                for _ in 0..(seconds / 0.02).round() as u32 {
                    body.advance(0.02).unwrap();
                }
                body
            };
            let mut body = rest(bar(element).with(settings(method.clone(), 30.0)), 0.2);
            body.remove(&removed).unwrap();
            let frozen: Vec<_> = body.displacements().to_vec();
            let body = rest(body, 2.5);
            let (tissue, supports) =
                (VecMaterial::one(element, SOFT, DENSITY), Vec::from_iter((0..25).map(Support::fixed)));
            let made = Simulation::new(points.iter().copied(), left.iter().copied(), tissue, &supports).unwrap();
            let made = rest(made.with(settings(method, 30.0)), 2.7);
            let (mut off, mut moved) = (0.0f32, 0.0f32);
            for (node, number) in numbers.iter().enumerate() {
                let here = body.displacements()[node].to_array();
                let Some(number) = number else {
                    // But for what rounding had left out of it.
                    assert!((glam::Vec3::from(here) - glam::Vec3::from(frozen[node].to_array())).length() < 1e-8);
                    continue;
                };
                let there = glam::Vec3::from(made.displacements()[*number as usize].to_array());
                off = off.max((glam::Vec3::from(here) - there).length());
                moved = moved.max(there.length());
            }
            println!("{name}: {:.4} of {:.1} mm, {alone} nodes alone", 1e3 * off, 1e3 * moved);
            assert!(alone > 10 && off < 0.004 * moved && moved > 0.003, "{name}");
        }
    }
}

/// One lattice over both would hold the piece back and pull the rest along.
#[test]
fn a_piece_that_is_cut_off_falls_while_the_rest_swings_back() {
    const STEP: f32 = 1e-3;
    let layer = elements_where(|[_, _, z]| z > 0.06 && z < 0.0675);
    for element in ELEMENTS {
        let [long, exact] = [(long(), Some(STEP)), (Method::Exact, None)].map(|(method, step)| {
            let mut body = bar(element).with(Settings { step, ..settings(method, 5.0) });
            body.gravity = [0.0, 0.0, 2.0];
            body.advance(0.1).unwrap();
            body.remove(&layer).unwrap();
            let before = body.displacements().to_vec();
            body.advance(0.1).unwrap();
            (before, body.displacements().to_vec())
        });
        // Mean distance over the nodes of a part, mm.
        let mean = |is: &dyn Fn(f32) -> bool, a: &[NodeVector], b: &[NodeVector]| {
            let vector = |of: &NodeVector| glam::Vec3::from(of.to_array()).as_dvec3();
            let part = BAR.points().zip(a.iter().zip(b)).filter(|(point, _)| is(point[2]));
            let far: Vec<_> = part.map(|(_, (a, b))| 1e3 * (vector(a) - vector(b)).length()).collect();
            far.iter().sum::<f64>() / far.len() as f64
        };
        let (piece, rest): (&dyn Fn(f32) -> bool, &dyn Fn(f32) -> bool) = (&|z| z > 0.067, &|z| z < 0.061);
        let [fell, swung] = [piece, rest].map(|is| mean(is, &exact.0, &exact.1));
        let [of_piece, of_rest] = [piece, rest].map(|is| mean(is, &long.1, &exact.1));
        println!(
            "{element:?}: the piece fell by {fell:.1} mm, {of_piece:.2} off; the rest by {swung:.1} mm, {of_rest:.2} off"
        );
        assert!(fell > 10.0 && of_piece < 0.03 * fell && of_rest < 0.1 * swung);
    }
}

/// An instrument presses what was inside.
#[test]
fn an_instrument_presses_the_new_surface() {
    let removed = elements_where(|[_, _, z]| z > 0.09);
    for element in ELEMENTS {
        for (method, triangles) in [(Method::Exact, false), (Method::Exact, true), (long(), false)] {
            let name = format!("{element:?}, {}", if matches!(method, Method::Exact) { "exact" } else { "long" });
            let mut body = bar(element).with(settings(method, 30.0)).meeting(triangles).unwrap();
            let radius = 0.012;
            let sphere = Instrument::resting(Shape::Sphere { radius }, Pose::at([0.015, 0.015, 0.14]));
            body.instruments = vec![sphere];
            body.advance(0.02).unwrap();
            body.remove(&removed).unwrap();
            // From above the cut to 4 mm into it.
            body.instruments[0].move_to(Pose::at([0.015, 0.015, 0.09 + radius - 0.004]), 0.02, 0.42);
            for _ in 0..25 {
                body.advance(0.02).unwrap();
            }
            let touch = body.touches()[0];
            let node = BAR.node(2, 2, 12) as usize;
            let pressed = body.displacements()[node].to_array()[2];
            println!("{name}: {:?} N, {} contacts, the middle {:.2} mm", touch.force, touch.contacts, 1e3 * pressed);
            assert!(touch.force[2] > 0.01 && touch.contacts > 0 && (pressed + 0.004).abs() < 0.0008, "{name}");
            let alone = BAR.node(2, 2, 14) as usize;
            assert!(body.scene().view().is_alone(alone) && body.displacements()[alone].to_array()[2].abs() < 1e-3);
        }
    }
}

/// Pulls act on what is left of their patches.
#[test]
fn pulls_let_go_of_what_is_removed() {
    let mut body = bar(Element::NodalStrain).with(settings(Method::Exact, 30.0));
    let gone = body.pull([0.015, 0.015, 0.12], 0.008, 100.0).unwrap();
    let half = body.pull([0.03, 0.015, 0.09], 0.012, 100.0).unwrap();
    for pull in [gone, half] {
        let [x, y, z] = body.pulls[pull].at;
        body.pulls[pull].put([x + 0.01, y, z]);
    }
    body.advance(0.1).unwrap();
    body.remove(&elements_where(|[_, _, z]| z > 0.09)).unwrap();
    for _ in 0..50 {
        assert!(body.advance(0.02).unwrap().is_ok());
    }
    let [gone, half] = [gone, half].map(|pull| body.pulled(pull).unwrap());
    println!("{gone:?} {half:?}");
    assert_eq!(gone.force, [0.0; 3]);
    assert!(half.force[0] > 0.01);
}

/// Pressures act on what is left of their surfaces: on the outer faces of a bar whose corner is cut off as on those of a bar
/// that never had it. An open cavity fills no more.
#[test]
fn pressures_let_go_of_the_surface_that_is_removed() {
    let points: Vec<_> = BAR.points().collect();
    let gone = elements_where(|[x, _, z]| x > 0.015 && z > 0.06);
    let tets: Vec<_> = BAR.tets().collect();
    let faces = |with_gone: bool| {
        let of = (0..).zip(&tets).filter(|(element, _)| with_gone || !gone.contains(element)).map(|(_, tet)| *tet);
        boundary(of)
    };
    let (all, left) = (faces(true), faces(false));
    let skin: Vec<_> = left.iter().copied().filter(|face| all.contains(face)).collect();
    assert!(skin.len() < left.len() && skin.len() < all.len());
    let pressed = |triangles: &[[u32; 3]], bulk: f32| {
        let mut body = bar(Element::NodalStrain).with(settings(Method::Exact, 30.0));
        let pressure = SurfacePressure { volume: 1e-4, bulk, ..SurfacePressure::new(20.0, 0.0) };
        body.pressures.press(&points, triangles, pressure).unwrap();
        body
    };
    let mut cut = pressed(&all, 1.0);
    cut.advance(0.05).unwrap();
    cut.remove(&gone).unwrap();
    assert_eq!(cut.pressures.surfaces[0].bulk, 0.0);
    let mut never = pressed(&skin, 0.0);
    never.remove(&gone).unwrap();
    for body in [&mut cut, &mut never] {
        assert!(body.settle(1e-6, 20_000).unwrap().at_rest);
    }
    let alone = |node: usize| cut.scene().view().is_alone(node);
    let (mut off, mut way) = (0.0f32, 0.0f32);
    for (node, (a, b)) in
        cut.displacements().iter().zip(never.displacements()).enumerate().filter(|(node, _)| !alone(*node))
    {
        let [a, b] = [a, b].map(|moved| glam::Vec3::from(moved.to_array()));
        assert!(a.is_finite(), "{node}");
        (off, way) = (off.max(a.distance(b)), way.max(b.length()));
    }
    println!("{:.4} mm off of {:.2} mm", 1e3 * off, 1e3 * way);
    assert!(off < 1e-2 * way && way > 1e-4);
}

/// Evenly between 0 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Balls and single elements, one after the other, in motion, some of them ablated first: no status that says nothing of a number that is none.
#[test]
fn a_hundred_random_changes_end_well_or_in_words() {
    let mut random = Random(49);
    let (mut refused, mut diverged, mut largest) = (0, 0, 0.0f32);
    for run in 0..20 {
        let (element, method) = (ELEMENTS[run % 3], if run % 2 == 0 { Method::Exact } else { long() });
        let mut body = bar(element).with(settings(method, 2.0)).meeting(false).unwrap();
        body.gravity = [4.0, 0.0, -2.0];
        for _ in 0..5 {
            let _ = body.advance(0.03);
            let centre = [0.03, 0.03, 0.12].map(|edge| edge * random.next());
            let radius = 0.02 * random.next();
            let mut removed = elements_where(|point| glam::Vec3::from(point).distance(centre.into()) < radius);
            removed.push((random.next() * 1535.0) as u32);
            if random.next() < 0.3 {
                let factor = 0.2 + 5.0 * random.next();
                let law = NeoHookean { c: factor * SOFT.c, d: factor * SOFT.d };
                refused += usize::from(body.ablate(&removed, law, 0.05 * f64::from(random.next())).is_err());
            } else {
                refused += usize::from(body.remove(&removed).is_err());
            }
            for _ in 0..3 {
                match body.advance(0.01) {
                    Ok(report) => {
                        let finite =
                            body.displacements().iter().all(|vector| vector.to_array().iter().all(|x| x.is_finite()));
                        assert!(finite, "{run}: {:?}", report.status);
                    }
                    Err(error) => {
                        println!("{run}: {error}");
                        diverged += 1;
                    }
                }
            }
            for vector in body.displacements() {
                vector.to_array().into_iter().for_each(|component| largest = largest.max(component.abs()));
            }
        }
    }
    println!(
        "{refused} of 100 refused, {diverged} of 300 calls ended early, nodes moved by {:.1} mm at most",
        1e3 * largest
    );
    // Free pieces fall by less than a metre; nothing explodes.
    assert!(refused <= 5 && diverged <= 5 && largest < 0.6);
}

/// Without a heap: a second scene, and the state goes on in it.
#[test]
fn a_state_goes_on_in_a_second_scene() {
    const SMALL: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [2, 2, 4] };
    const NODES: usize = SMALL.node_count();
    const TILES: usize = supple::scene::tiles_for(SMALL.element_count());
    let (points, tets): (Vec<_>, Vec<_>) = (SMALL.points().collect(), SMALL.tets().collect());
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let supports: Vec<_> = (0..9).map(Support::fixed).collect();
    let tissue = VecMaterial::one(Element::Linear, SOFT, DENSITY);
    let mut scene = FixedScene::<_, NODES, TILES>::new(tissue.clone());
    scene.build(&mesh, &supports).unwrap();
    let mut state = FixedState::<NODES>::new();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::new(0.5 * critical.seconds, 0.0, critical).unwrap();
    let loads = Loads::new(&scene, [3.0, 0.0, 0.0], &[], &[]).unwrap();
    for _ in 0..100 {
        assert_eq!(tled::step(&scene, &loads, &mut state, &step), Status::Ok);
    }
    let mut removed = [false; SMALL.element_count()];
    removed[72..].fill(true);
    let mut second = FixedScene::<_, NODES, TILES>::new(tissue);
    second.build(&mesh.without(&removed).unwrap(), &supports).unwrap();
    assert!(tled::carry_on(&second, &mut state));
    let loads = Loads::new(&second, [3.0, 0.0, 0.0], &[], &[]).unwrap();
    let frozen = state.displacements()[NODES - 1];
    for _ in 0..100 {
        assert_eq!(tled::step(&second, &loads, &mut state, &step), Status::Ok);
    }
    assert_eq!(state.displacements()[NODES - 1], frozen);
    assert_eq!(second.element_count(), 72);
    assert!(mesh.without(&removed[1..]).is_err() && mesh.without(&[true; SMALL.element_count()]).is_err());
}

/// Point masses stay, as far as their nodes do, and a surface of the caller's loses what is gone.
#[test]
fn point_masses_and_surfaces_of_the_callers_stay() {
    let (points, tets): (Vec<_>, Vec<_>) = (BAR.points().collect(), BAR.tets().collect());
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let supports: Vec<_> = (0..25).map(Support::fixed).collect();
    let tissue = VecMaterial::one(Element::NodalPressure, SOFT, DENSITY);
    let mut scene = supple::scene::VecScene::build(tissue, &mesh, &supports).unwrap();
    let (stays, goes) = (BAR.node(2, 2, 8) as usize, BAR.node(2, 2, 16) as usize);
    scene.add_mass(stays, 0.01).unwrap();
    scene.add_mass(goes, 0.01).unwrap();
    let nodes = supple::contact::boundary(&mesh);
    let triangles = supple::contact::boundary_triangles(&mesh, &nodes);
    let before = (nodes.len(), triangles.len());
    let mut body = Simulation::of_scene(scene, points, tets).with(settings(Method::Exact, 10.0));
    body.meet(nodes, triangles).unwrap();
    let ball = Instrument::resting(Shape::Sphere { radius: 0.008 }, Pose::at([-0.0081, 0.015, 0.06]));
    body.instruments = vec![ball];
    body.gravity = [-2.0, 0.0, 0.0];
    body.advance(0.02).unwrap();
    let mass = body.scene().view().node_mass(stays);
    body.remove(&elements_where(|[_, _, z]| z > 0.09)).unwrap();
    assert!((body.scene().view().node_mass(stays) / mass - 1.0).abs() < 1e-6 && mass > 0.01);
    assert!(body.scene().view().node_mass(goes) < 1e-15);
    for _ in 0..10 {
        assert!(body.advance(0.02).unwrap().is_ok());
    }
    println!("{before:?}, {} contacts, {:?} N", body.touches()[0].contacts, body.touches()[0].force);
    assert!(body.touches()[0].contacts > 0);
}

/// A network goes on after another lead-in.
#[test]
fn learned_steps_are_led_again() {
    use supple::material::Exponential;
    use supple::mlp::{Network, WeightBytes};
    let bytes = WeightBytes::of(include_bytes!("../../weights/compact-10.weights"));
    let network = Network::parse(bytes.bytes()).unwrap();
    let tissue = VecMaterial::one(Element::Linear, Exponential { a: 59.0, b: 8.023, d: 60_000.0 }, DENSITY);
    let supports: Vec<_> = (0..25).map(Support::fixed).collect();
    let method = Method::Learned { network, lead_in: 0.05, fallback: true };
    let settings = Settings { method, guard: false, ..Settings::default() };
    let mut body = Simulation::new(BAR.points(), BAR.tets(), tissue, &supports).unwrap().with(settings);
    body.gravity = [0.5, 0.0, 0.0];
    assert!(body.advance(0.2).unwrap().learned > 0);
    body.remove(&elements_where(|[_, _, z]| z > 0.09)).unwrap();
    let report = body.advance(0.2).unwrap();
    println!("{report:?}");
    assert!(report.exact > 0 && report.status.is_taken());
    assert!(body.displacements().iter().all(|vector| vector.to_array().iter().all(|x| x.is_finite())));
}

/// A point mass counts in the mass, and one that cannot be is refused with its node.
#[test]
fn a_point_mass_is_of_the_scene_or_refused() {
    let mut scene = bar(Element::Linear).scene().clone();
    let before = scene.view().mass();
    scene.add_mass(3, 0.05).unwrap();
    assert!((scene.view().mass() - before - 0.05).abs() < 1e-7);
    for (node, kilogram) in [(3, -0.06), (3, f32::NAN), (3, f32::INFINITY), (100_000, 0.1)] {
        let error = scene.add_mass(node, kilogram).unwrap_err().to_string();
        println!("{error}");
        assert!(error.contains(&format!("node {node}")), "{error}");
    }
}

/// A state of before a removal, put back after it, remembers other elements: it begins as if it remembered nothing.
#[test]
fn a_state_of_before_a_removal_remembers_nothing_of_other_elements() {
    let series = Prony::new(&[[0.5, 0.2]]).unwrap();
    for element in ELEMENTS {
        let material = VecMaterial { prony: vec![series], ..VecMaterial::one(element, SOFT, DENSITY) };
        let supports: Vec<_> = (0..25).map(Support::fixed).collect();
        let mut body = Simulation::new(BAR.points(), BAR.tets(), material, &supports).unwrap();
        body = body.with(settings(Method::Exact, 30.0));
        body.gravity = [6.0, 0.0, 0.0];
        (0..6).for_each(|_| _ = body.advance(0.02).unwrap());
        let mut saved = body.state().clone();
        body.remove(&(0..6).collect::<Vec<_>>()).unwrap();
        let mut without = VecState::of(body.scene().view());
        let seconds = saved.view().last_step();
        without.view().put(saved.time(), seconds, |node| {
            [saved.displacements()[node].to_array(), saved.velocity(node).map(|speed| seconds * speed)]
        });
        for state in [&mut saved, &mut without] {
            assert!(tled::carry_on(body.scene(), state));
        }
        let ended = [saved, without].map(|state| {
            *body.state_mut() = state;
            (0..3).for_each(|_| _ = body.advance(0.02).unwrap());
            body.displacements().to_vec()
        });
        let moved = ended[0].iter().map(|u| glam::Vec3::from(u.to_array()).length()).fold(0.0, f32::max);
        let off =
            ended[0].iter().zip(&ended[1]).map(|(a, b)| glam::Vec3::from(a.to_array()).distance(b.to_array().into()));
        let off = off.fold(0.0, f32::max);
        println!("{element:?}: {:.4} mm off of {:.2} mm", 1e3 * off, 1e3 * moved);
        assert!(off < 0.01 * moved && moved > 1e-3);
    }
}
