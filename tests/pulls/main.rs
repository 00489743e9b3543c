//! Pulls to targets: closed forms, momentum, energy, stability for any stiffness, long steps against exact ones.

use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};
use supple::step::Status;

const ELEMENTS: [Element; 3] = [Element::Linear, Element::NodalPressure, Element::NodalStrain];
const BAR: Bar = Bar { size: [0.03, 0.03, 0.12], cells: [4, 4, 16] };

fn tissue(element: Element) -> VecMaterial {
    VecMaterial::one(element, NeoHookean { c: 500.0, d: 10_000.0 }, 1000.0)
}

fn bar(element: Element, fixed: bool) -> Simulation<'static> {
    let supports: Vec<_> = if fixed { (0..25).map(Support::fixed).collect() } else { vec![] };
    Simulation::new(BAR.points(), BAR.tets(), tissue(element), &supports).unwrap()
}

fn long() -> Method<'static> {
    Method::Long(supple::inertia::Method::new(supple::inertia::Cells::Suggested))
}

fn spread() -> f32 {
    std::env::var("SPREAD").ok().and_then(|s| s.parse().ok()).unwrap_or(0.03)
}
fn length(vector: [f32; 3]) -> f32 {
    vector.into_iter().map(|component| component * component).sum::<f32>().sqrt()
}

/// A free body hangs on one pull: the spring carries its weight.
#[test]
fn a_free_body_hangs_on_a_pull_that_carries_its_weight() {
    for (name, method, step) in [("exact", Method::Exact, None), ("long", long(), Some(0.004))] {
        let mut body = bar(Element::NodalStrain, false).with(Settings {
            method,
            step,
            damping: 10.0,
            guard: false,
            ..Settings::default()
        });
        let weight = 1000.0 * 0.03 * 0.03 * 0.12 * 9.81;
        body.gravity = [0.0, 0.0, -9.81];
        let pull = body.pull([0.015, 0.015, 0.12], 0.02, 300.0).unwrap();
        let mut report = body.advance(0.01).unwrap();
        for _ in 0..300 {
            report = body.advance(0.01).unwrap();
        }
        let pulled = body.pulled(pull).unwrap();
        println!("{name}: {:?} N of {weight} N, gap {:?} m, {:?}", pulled.force, pulled.gap, report.status);
        assert!((pulled.force[2] - weight).abs() < 0.01 * weight);
        assert!((pulled.gap[2] - weight / 300.0).abs() < 0.01 * weight / 300.0);
    }
}

#[test]
fn no_stiffness_and_no_target_makes_a_step_diverge() {
    let mut state = 7u64;
    let mut random = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as f32) / (1u64 << 31) as f32
    };
    let (mut worst, mut limited, mut runs) = (0.0f32, 0, 0);
    for seed in 0..30 {
        for element in ELEMENTS {
            for method in [Method::Exact, long()] {
                let is_exact = matches!(method, Method::Exact);
                let mut body = bar(element, seed % 2 == 0);
                let critical = body.critical_step().unwrap().seconds;
                let step = if is_exact { None } else { Some([5.0, 20.0, 50.0][seed % 3] * critical) };
                body.set(Settings { method, step, damping: 10.0, guard: false, ..Settings::default() });
                for _ in 0..10 {
                    let at = [0.03 * random(), 0.03 * random(), 0.12 * random()];
                    let pull = body.pull(at, 0.012, 10f32.powf(1.0 + 5.0 * random())).unwrap();
                    let target = at.map(|x| x + spread() * (random() - 0.5));
                    body.pulls[pull].put(target);
                }
                runs += 1;
                for frame in 0..30 {
                    match body.advance(1.0 / 60.0) {
                        Ok(report) => limited += u32::from(report.status != Status::Ok),
                        Err(error) => {
                            println!("seed {seed} {element:?} exact {is_exact} frame {frame}: {error}");
                            worst += 1.0;
                            break;
                        }
                    }
                }
            }
        }
    }
    println!("{worst} of {runs} refused, {limited} frames not ok");
    assert_eq!(worst, 0.0);
}

#[test]
fn look() {
    let mut state = 7u64;
    let mut random = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as f32) / (1u64 << 31) as f32
    };
    for seed in 0..30 {
        for element in ELEMENTS {
            for method in [Method::Exact, long()] {
                let mut body = bar(element, seed % 2 == 0);
                let is_exact = matches!(method, Method::Exact);
                let critical = body.critical_step().unwrap().seconds;
                body.set(Settings {
                    method: Method::Exact,
                    step: None,
                    damping: 10.0,
                    guard: false,
                    ..Settings::default()
                });
                for _ in 0..10 {
                    let at = [0.03 * random(), 0.03 * random(), 0.12 * random()];
                    let pull = body.pull(at, 0.012, 10f32.powf(1.0 + 5.0 * random())).unwrap();
                    let target = at.map(|x| x + spread() * (random() - 0.5));
                    body.pulls[pull].put(target);
                }
                if seed != 26 || element != Element::NodalPressure || !is_exact {
                    continue;
                }
                for pull in &body.pulls {
                    println!("{:?} k {} to {:?} n {}", pull.at, pull.stiffness, pull.to, pull.nodes[1]);
                }
                for frame in 0..60 {
                    match body.advance(1.0 / 240.0) {
                        Ok(report) => {
                            println!(
                                "{frame} {:?} T {:.4} W {:.4} avail {:.4} shortest {:.3e} crit {critical:.3e} steps {}",
                                report.status,
                                body.state().energy_balance().kinetic,
                                body.state().energy_balance().work,
                                body.state().energy_balance().balance(),
                                report.seconds[0],
                                report.exact
                            );
                        }
                        Err(error) => {
                            println!("{error}");
                            break;
                        }
                    }
                }
            }
        }
    }
}
