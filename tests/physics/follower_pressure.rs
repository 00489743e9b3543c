//! Pressure that follows the surface (`supple::pressure`) against closed forms: a free cube, a thick spherical shell, bodies
//! that have turned.

use std::collections::BTreeMap;

use supple::inertia::{self, Cells};
use supple::material::{Element, Moduli, NeoHookean, VecMaterial};
use supple::mesh::boundary;
use supple::pressure::SurfacePressure;
use supple::scene::{Axes, Support};
use supple::simulation::{Method, Settings, Simulation, SimulationError};
use supple::state::NodeVector;
use supple::step::{Cause, Divergence, Status};

use crate::support::Body;

const ELEMENTS: [Element; 3] = [Element::Linear, Element::NodalPressure, Element::NodalStrain];
/// Shear modulus 1 kPa, bulk modulus 50 kPa.
const SOFT: NeoHookean = NeoHookean { c: 500.0, d: 25_000.0 };

fn simulation(body: &Body, element: Element, law: NeoHookean, supports: &[Support]) -> Simulation<'static> {
    let material = VecMaterial::one(element, law, 1000.0);
    Simulation::new(body.points.clone(), body.tets.clone(), material, supports).unwrap()
}

/// A cube of 3 cm with nodes that are not regular, pressed on all sides.
fn cube(element: Element, pascal: f32, ramp: f32) -> Simulation<'static> {
    let body = Body::irregular([0.03, 0.03, 0.03], [4, 4, 4]);
    let mut simulation = simulation(&body, element, SOFT, &[]);
    let triangles = boundary(body.tets.iter().copied());
    simulation.pressures.press(&body.points, &triangles, SurfacePressure::new(pascal, ramp)).unwrap();
    simulation
}

fn at(simulation: &Simulation<'_>, node: usize) -> [f64; 3] {
    let (point, moved) = (simulation.points()[node], simulation.displacements()[node].to_array());
    [0, 1, 2].map(|axis| f64::from(point[axis]) + f64::from(moved[axis]))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn length(a: [f64; 3]) -> f64 {
    a.iter().map(|axis| axis * axis).sum::<f64>().sqrt()
}

/// Sum and moment of the forces of the latest step, and the sum of their lengths, N and N m.
fn sums(simulation: &Simulation<'_>) -> ([f64; 3], [f64; 3], f64) {
    let (mut sum, mut moment, mut all) = ([0.0; 3], [0.0; 3], 0.0);
    for (node, force) in simulation.state().forces().iter().enumerate() {
        let force = force.to_array().map(f64::from);
        let turning = cross(at(simulation, node), force);
        for axis in 0..3 {
            sum[axis] += force[axis];
            moment[axis] += turning[axis];
        }
        all += length(force);
    }
    (sum, moment, all)
}

/// With `d (J - 1)^2` the stress is hydrostatic where `2 d (J - 1) = -p`, so that each edge is `J^(1/3)` times as long.
#[test]
fn a_free_cube_shrinks_by_its_bulk_modulus_and_stays_where_it_is() {
    for element in ELEMENTS {
        for pascal in [500.0, -500.0, 5_000.0] {
            // More than Young's modulus, 2.9 kPa: there nodal strain, which averages over patches, folds.
            if pascal > 1_000.0 && element == Element::NodalStrain {
                continue;
            }
            let mut simulation = cube(element, pascal, 0.0);
            let volume = simulation.pressures.volume(0, simulation.displacements());
            assert!((volume / 2.7e-5 - 1.0).abs() < 1e-5, "{volume}");
            let settled = simulation.settle(1e-7, 5000).unwrap();
            assert!(settled.at_rest, "{settled:?}");
            let ratio = 1.0 - f64::from(pascal) / 50_000.0;
            let found = simulation.pressures.volume(0, simulation.displacements()) / volume;
            let stretch = ratio.cbrt();
            let ends = [0, simulation.points().len() - 1];
            let [low, high] = ends.map(|node| at(&simulation, node));
            println!("{element:?}, {pascal} Pa: volume {found:.6} of {ratio:.6} in {} steps", settled.steps);
            assert!((found - ratio).abs() < 0.003 * (1.0 - ratio).abs());
            let diagonal = length([0, 1, 2].map(|axis| high[axis] - low[axis])) / (3.0_f64.sqrt() * 0.03);
            assert!((diagonal - stretch).abs() < 0.003 * (1.0 - stretch).abs(), "{diagonal} of {stretch}");
            // Its centre is where it was, but for masses that are not even.
            let shift = length([0, 1, 2].map(|axis| 0.5 * (high[axis] + low[axis] - 0.03)));
            assert!(shift < 0.03 * (1.0 - stretch).abs(), "{shift}");
        }
    }
}

#[test]
fn forces_on_a_closed_surface_have_no_sum_and_no_moment_however_it_is_deformed_and_turned() {
    for element in ELEMENTS {
        let mut simulation = cube(element, 300.0, 0.0);
        let (sin, cos) = 1.1_f32.sin_cos();
        let turned = |&[x, y, z]: &[f32; 3]| {
            let (u, v, w) = (x * (1.0 + 8.0 * z), y + 0.2 * z, z * (1.0 + 5.0 * x * y / 0.03));
            [cos * u - sin * v - x, sin * u + cos * v - y, w - z]
        };
        let turned: Vec<_> = simulation.points().iter().map(turned).collect();
        simulation.set_displacements(&turned).unwrap();
        // The forces of a step are those at its start, and move the nodes by little.
        simulation.set(Settings { step: Some(1e-9), unchecked: true, ..Settings::default() });
        simulation.advance(1e-9).unwrap();
        let (sum, moment, all) = sums(&simulation);
        println!("{element:?}: {:.1e} N, {:.1e} N m of {all:.2} N", length(sum), length(moment));
        assert!(length(sum) < 1e-5 * all && length(moment) < 1e-5 * all * 0.03);
    }
}

/// A bar that is turned as a whole, pressed on its end: the force turns with it.
#[test]
fn a_pressure_turns_with_the_body() {
    let body = Body::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let end: Vec<_> = boundary(body.tets.iter().copied())
        .into_iter()
        .filter(|triangle| triangle.iter().all(|&node| body.points[node as usize][2] > 0.0399))
        .collect();
    for element in ELEMENTS {
        let mut simulation = simulation(&body, element, SOFT, &[]);
        simulation.pressures.press(&body.points, &end, SurfacePressure::new(100.0, 0.0)).unwrap();
        // About y by a quarter turn: the end looks along x.
        let turned: Vec<_> = body.points.iter().map(|&[x, y, z]| [z - x, y - y, -x - z]).collect();
        simulation.set_displacements(&turned).unwrap();
        simulation.set(Settings { step: Some(1e-9), unchecked: true, ..Settings::default() });
        simulation.advance(1e-9).unwrap();
        let ([x, y, z], ..) = sums(&simulation);
        println!("{element:?}: {x:.6} {y:.6} {z:.6} N");
        assert!((x + 100.0 * 0.02 * 0.02).abs() < 1e-6 && y.abs() < 1e-6 && z.abs() < 1e-6);
    }
}

/// An eighth of a sphere's shell, its three plane sides held in their planes: hexahedra of three patches, each cut into
/// six tetrahedra from its node with the least number, so that neighbours agree.
fn shell(inner: f64, outer: f64, cells: usize, layers: usize) -> (Body, Vec<Support>) {
    let mut numbers = BTreeMap::new();
    let mut points = Vec::new();
    let mut number = |direction: [f64; 3], radius: f64| {
        let along = length(direction);
        let point = direction.map(|axis| radius * axis / along);
        let key = point.map(|axis| (axis * 1e8).round() as i64);
        *numbers.entry(key).or_insert_with(|| {
            points.push(point.map(|axis| axis as f32));
            points.len() as u32 - 1
        })
    };
    let share = |step: usize, of: usize| step as f64 / of as f64;
    // Equal angles.
    let side = |step: usize| (share(step, cells) * std::f64::consts::FRAC_PI_4).tan();
    let mut hexahedra = Vec::new();
    for patch in 0..3 {
        for (i, j, k) in (0..cells * cells * layers).map(|c| (c % cells, c / cells % cells, c / cells / cells)) {
            let corner = |c: usize| {
                let (a, b) = (side(i + (c & 1)), side(j + (c >> 1 & 1)));
                let mut direction = [0.0; 3];
                (direction[patch], direction[(patch + 1) % 3], direction[(patch + 2) % 3]) = (1.0, a, b);
                (direction, inner + (outer - inner) * share(k + (c >> 2), layers))
            };
            hexahedra.push(std::array::from_fn::<_, 8, _>(corner));
        }
    }
    let mut tets = Vec::new();
    for hexahedron in hexahedra {
        let nodes = hexahedron.map(|(direction, radius)| number(direction, radius));
        let least = (0..8).min_by_key(|&corner| nodes[corner]).unwrap();
        for face in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
            if face.contains(&least) {
                continue;
            }
            let first = (0..4).min_by_key(|&at| nodes[face[at]]).unwrap();
            let turned: [usize; 4] = std::array::from_fn(|at| face[(first + at) % 4]);
            for [b, c] in [[1, 2], [2, 3]] {
                tets.push([nodes[least], nodes[turned[0]], nodes[turned[b]], nodes[turned[c]]]);
            }
        }
    }
    let mut body = Body { points, tets };
    body.tets = body.mesh().tets().collect();
    let held = |(node, point): (u32, &[f32; 3])| {
        let axes = [(Axes::X, 0), (Axes::Y, 1), (Axes::Z, 2)];
        let held = axes.into_iter().filter(|&(_, axis)| point[axis].abs() < 1e-7).map(|(axes, _)| axes);
        let axes = held.reduce(Axes::union)?;
        Some(Support { node, axes, moves: false })
    };
    let supports = (0..).zip(&body.points).filter_map(held).collect();
    (body, supports)
}

/// Lame's solution for a thick shell under inner pressure, at strains of half a per cent.
#[test]
fn a_thick_spherical_shell_grows_as_lame_says() {
    let (inner, outer) = (0.02, 0.04);
    let (body, supports) = shell(inner, outer, 6, 8);
    let (shear, bulk) = (4_000.0, 8_000.0);
    let moduli = Moduli { shear, bulk };
    let poisson = moduli.poisson_ratio();
    let young = 2.0 * shear * (1.0 + poisson);
    let pascal = 60.0;
    let lame = |r: f64| {
        let cubes = inner.powi(3) / (outer.powi(3) - inner.powi(3));
        let grown = (1.0 - 2.0 * poisson) * r + (1.0 + poisson) * outer.powi(3) / (2.0 * r * r);
        pascal * cubes / young * grown
    };
    let radius = |node: u32| length(body.points[node as usize].map(f64::from));
    let cavity: Vec<_> = boundary(body.tets.iter().copied())
        .into_iter()
        .filter(|triangle| triangle.iter().all(|&node| radius(node) < inner + 1e-6))
        .collect();
    for element in ELEMENTS {
        let law = NeoHookean { c: (shear / 2.0) as f32, d: (bulk / 2.0) as f32 };
        let mut simulation = simulation(&body, element, law, &supports);
        let pressure = SurfacePressure::new(pascal as f32, 0.0);
        simulation.pressures.press(&body.points, &cavity, pressure).unwrap();
        let settled = simulation.settle(1e-7, 5000).unwrap();
        assert!(settled.at_rest, "{settled:?}");
        for (r, most) in [(inner, 0.03), (outer, 0.03)] {
            let nodes: Vec<_> = (0..body.points.len() as u32).filter(|&node| (radius(node) - r).abs() < 1e-6).collect();
            let outward = |node: &u32| length(at(&simulation, *node as usize)) - r;
            let mean = nodes.iter().map(outward).sum::<f64>() / nodes.len() as f64;
            let error = mean / lame(r) - 1.0;
            println!(
                "{element:?}: at {r} m {:.3} um, Lame {:.3} um, {:+.2} %",
                1e6 * mean,
                1e6 * lame(r),
                100.0 * error
            );
            assert!(error.abs() < most);
        }
    }
}

/// A whole shell of eight such parts.
fn sphere(inner: f64, outer: f64, cells: usize, layers: usize) -> Body {
    let (part, _) = shell(inner, outer, cells, layers);
    let mut numbers = BTreeMap::new();
    let (mut points, mut tets) = (Vec::new(), Vec::new());
    for mirrored in 0..8 {
        let mut node = |old: u32| {
            let point = part.points[old as usize];
            let point = [0, 1, 2].map(|axis| if mirrored >> axis & 1 == 1 { -point[axis] } else { point[axis] });
            let key = point.map(|axis| (axis * 1e8).round() as i64);
            *numbers.entry(key).or_insert_with(|| {
                points.push(point);
                points.len() as u32 - 1
            })
        };
        tets.extend(part.tets.iter().map(|tet| tet.map(&mut node)));
    }
    let mut body = Body { points, tets };
    body.tets = body.mesh().tets().collect();
    body
}

/// The pressure that Lame's solution takes for the volume that it leads to, and the volume itself.
#[test]
fn a_cavity_fills_to_its_volume() {
    let (inner, outer) = (0.02_f64, 0.04_f64);
    let body = sphere(inner, outer, 3, 4);
    let (shear, bulk) = (4_000.0, 8_000.0);
    let poisson = Moduli { shear, bulk }.poisson_ratio();
    let young = 2.0 * shear * (1.0 + poisson);
    // Displacement of the inner surface for each pascal.
    let cubes = inner.powi(3) / (outer.powi(3) - inner.powi(3));
    let per_pascal =
        cubes / young * ((1.0 - 2.0 * poisson) * inner + (1.0 + poisson) * outer.powi(3) / (2.0 * inner * inner));
    let radius = |node: u32| length(body.points[node as usize].map(f64::from));
    let cavity: Vec<_> = boundary(body.tets.iter().copied())
        .into_iter()
        .filter(|triangle| triangle.iter().all(|&node| radius(node) < inner + 1e-6))
        .collect();
    for element in ELEMENTS {
        let law = NeoHookean { c: (shear / 2.0) as f32, d: (bulk / 2.0) as f32 };
        let mut simulation = simulation(&body, element, law, &[]);
        simulation.pressures.press(&body.points, &cavity, SurfacePressure::new(0.0, 0.0)).unwrap();
        let before = simulation.pressures.volume(0, simulation.displacements());
        let wanted = 1.01 * before;
        let stiffness = 5.0 * young;
        simulation.pressures.surfaces[0] = SurfacePressure::filling(wanted as f32, stiffness as f32, 0.0);
        let settled = simulation.settle(1e-7, 10_000).unwrap();
        assert!(settled.at_rest, "{settled:?}");
        let after = simulation.pressures.volume(0, simulation.displacements());
        let pascal = stiffness * (1.0 - after / wanted);
        let area = 3.0 * before / inner;
        let lame = stiffness * (wanted - before) / (wanted + stiffness * area * per_pascal);
        println!("{element:?}: volume {:.5} of 1.01, {pascal:.2} Pa, Lame {lame:.2} Pa", after / before);
        assert!((pascal / lame - 1.0).abs() < 0.1 && after > 1.007 * before && after < wanted);
        // It stays there in exact steps.
        simulation.set(Settings { damping: 5.0, ..Settings::default() });
        for _ in 0..20 {
            assert!(simulation.advance(0.02).unwrap().is_ok());
        }
        let later = simulation.pressures.volume(0, simulation.displacements());
        assert!((later / after - 1.0).abs() < 1e-3, "{later} {after}");
    }
    let bad = SurfacePressure::filling(-1.0, 10.0, 0.0).check(3).unwrap_err().to_string();
    assert_eq!(
        bad,
        "pressure 3: filling to -1 m^3 with 10 Pa; the volume must be positive, the stiffness zero or more"
    );
}

/// `W = -p (V - V0)` for a pressure that does not change, whatever the motion.
#[test]
fn its_work_is_the_pressure_times_the_change_of_volume() {
    for element in ELEMENTS {
        let mut simulation = cube(element, 2_000.0, 0.0);
        let before = simulation.pressures.volume(0, simulation.displacements());
        for _ in 0..40 {
            let report = simulation.advance(1e-3).unwrap();
            assert!(report.is_ok(), "{:?}", report.status);
        }
        let state = simulation.state();
        let after = simulation.pressures.volume(0, state.displacements());
        let (work, balance) = (2_000.0 * (before - after), *state.energy_balance());
        println!("{element:?}: {:.3e} J, {work:.3e} J by the volume", balance.work);
        // The balance counts up to the middle of the last step, in which the volume changes by a little.
        assert!((balance.work / work - 1.0).abs() < 0.05 && work > 0.0);
        let ratio = (balance.kinetic + strain(&mut simulation)) / balance.work;
        assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    }
}

fn strain(simulation: &mut Simulation<'_>) -> f64 {
    let (scene, state) = simulation.parts_mut();
    supple::tled::strain_energy(scene, state).unwrap()
}

/// A bar held at one end, blown up from below: all methods come to the same rest.
#[test]
fn steps_of_every_kind_come_to_the_same_rest() {
    let body = Body::irregular([0.03, 0.03, 0.06], [3, 3, 6]);
    let fixed: Vec<_> = body.nodes_where(|[_, _, z]| z == 0.0).into_iter().map(Support::fixed).collect();
    let side: Vec<_> = boundary(body.tets.iter().copied())
        .into_iter()
        .filter(|triangle| triangle.iter().all(|&node| body.points[node as usize][0] == 0.0))
        .collect();
    for element in ELEMENTS {
        let pressed = |method: Method<'static>| {
            let mut simulation = simulation(&body, element, SOFT, &fixed).with(Settings {
                method,
                damping: 20.0,
                ..Settings::default()
            });
            simulation.pressures.press(&body.points, &side, SurfacePressure::new(60.0, 0.2)).unwrap();
            simulation
        };
        let cells = || inertia::Method::new(Cells::Given([1, 1, 2]));
        let mut rest = pressed(Method::Exact);
        rest.pressures.surfaces[0].ramp = 0.0;
        assert!(rest.settle(1e-6, 10_000).unwrap().at_rest);
        for method in [Method::Exact, Method::Long(cells()), Method::Auto(cells())] {
            let mut simulation = pressed(method);
            let mut last = None;
            for _ in 0..60 {
                last = Some(simulation.advance(0.05).unwrap());
            }
            let last = last.unwrap();
            assert!(last.is_ok(), "{:?}", last.status);
            let apart = |(a, b): (&NodeVector, &NodeVector)| {
                let (a, b) = (a.to_array(), b.to_array());
                length([0, 1, 2].map(|axis| f64::from(a[axis] - b[axis])))
            };
            let most = simulation.displacements().iter().zip(rest.displacements()).map(apart).fold(0.0, f64::max);
            let moved = rest.displacements().iter().map(|u| length(u.to_array().map(f64::from))).fold(0.0, f64::max);
            println!(
                "{element:?}: {} exact, {} long: {most:.2e} m apart, moved by {moved:.2e} m",
                last.exact, last.long
            );
            assert!(most < 2e-5 && moved > 2e-3);
        }
    }
}

#[test]
fn hostile_pressures_are_refused_in_words() {
    let body = Body::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let mut simulation = simulation(&body, Element::Linear, SOFT, &[]);
    let press = |simulation: &mut Simulation<'_>, triangles: &[[u32; 3]], pascal, ramp| {
        simulation.pressures.press(&body.points, triangles, SurfacePressure::new(pascal, ramp))
    };
    let words = |result: Result<usize, supple::loads::LoadError>| result.unwrap_err().to_string();
    let triangles = boundary(body.tets.iter().copied());
    for pascal in [f32::NAN, f32::INFINITY] {
        assert_eq!(
            words(press(&mut simulation, &triangles, pascal, 0.0)),
            format!("pressure 0: a component is {pascal}")
        );
    }
    assert_eq!(
        words(press(&mut simulation, &triangles, 1.0, -1.0)),
        "pressure 0: the ramp is -1 s, it must be zero or more"
    );
    assert_eq!(
        words(press(&mut simulation, &[[0, 1, 77]], 1.0, 0.0)),
        "pressure triangle 0: node 77 does not exist, the scene has 45 nodes"
    );
    press(&mut simulation, &triangles, 100.0, 0.0).unwrap();
    simulation.pressures.surfaces.clear();
    let error = simulation.advance(0.01).unwrap_err();
    assert_eq!(error.to_string(), "pressure triangle 0: surface 0 does not exist, there are 0");
    let before = simulation.state().displacements().to_vec();
    for pascal in [1e13, -1e13, 1e30, f32::MAX] {
        simulation.pressures.surfaces = vec![SurfacePressure::new(pascal, 0.0)];
        let error = simulation.advance(0.01).unwrap_err();
        println!("{error}");
        assert!(matches!(
            error,
            SimulationError::Refused(Divergence { cause: Cause::Pressure { surface: 0, .. } | Cause::NotFinite, .. })
        ));
        assert!(simulation.state().displacements() == before);
        assert!(simulation.settle(1e-5, 100).is_err());
        simulation.state_mut().reset();
    }
    // Where tissue gives way a pressure blows it up: never in silence.
    let mut blown = cube(Element::NodalPressure, -20_000.0, 0.0);
    let mut worst = Status::Ok;
    for _ in 0..200 {
        match blown.advance(1e-3) {
            Ok(report) => worst = worst.worse(report.status),
            Err(error) => {
                println!("{error}");
                return;
            }
        }
    }
    println!("{worst:?}");
}
