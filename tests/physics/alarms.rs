//! No false alarms: a simulation that is stable is never reported as diverged, however violent it is.
//! "Stable" is a step that is never above half the critical step at the current state. `divergence.rs` tests what is
//! reported, `stability.rs` that every unstable run is.

use supple::element::ElementMaterial;
use supple::loads::{Loads, Motion, NodalForce};
use supple::material::{AnyLaw, J_FLOOR, Law};
use supple::scene::{Axes, Support, VecScene};
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use crate::reference::Mat3;
use crate::reference::Random;
use crate::reference::tensor::{IDENTITY, from_fn};
use crate::support;
use crate::support::bodies::{far_end, held, small_bar, torsion};
use crate::support::{bound, displaced, rest_of, tissue};

/// Loads as the host sets them before a step, from the index of the step and the time.
type Host<'a> = &'a dyn Fn(u64, f64) -> (Vec<NodalForce>, Vec<Motion>);
/// Steps of a run.
const LONG: u64 = if cfg!(feature = "slow-tests") { 3_000 } else { 1_000 };
const NO_LOADS: Host<'static> = &|_, _| (vec![], vec![]);

/// What came of a run.
enum Outcome {
    /// At some time the step was above half the critical step.
    TooLong,
    FalseAlarm(String),
    /// Steps with elements beyond their law, steps called inexact for their energy, and the largest excess of
    /// kinetic energy over the energy balance, as a share of its peak.
    Done {
        limited: u64,
        inexact: u64,
        excess: f64,
    },
}

fn attempt<M: ElementMaterial>(
    scene: &VecScene<M>,
    mut state: VecState,
    step: &Step,
    count: u64,
    host: Host<'_>,
) -> Outcome {
    let (mut limited, mut inexact, mut excess) = (0, 0, f64::NEG_INFINITY);
    // Beyond the cap of the exponent there is no bound.
    let critical = |state: &mut VecState| tled::critical_step(scene, state).map_or(0.0, |critical| critical.seconds);
    for n in 0..count {
        if n % 8 == 0 && step.seconds() > 0.5 * critical(&mut state) {
            return Outcome::TooLong;
        }
        let (forces, motions) = host(n, state.time());
        let loads = Loads::new(scene, [0.0; 3], &forces, &motions).unwrap();
        match tled::step(scene, &loads, &mut state, step) {
            Status::Diverged(divergence) => {
                let strain = tled::strain_energy(scene, &mut state).expect("room");
                let critical = critical(&mut state);
                if step.seconds() > 0.5 * critical {
                    return Outcome::TooLong;
                }
                return Outcome::FalseAlarm(format!(
                    "step {n} of {:.1e} s, critical {critical:.1e} s: {divergence}; strain energy {strain:.3e} J",
                    step.seconds()
                ));
            }
            Status::Limited { least_volume_ratio, saturation, energy_excess } => {
                limited += u64::from(least_volume_ratio < J_FLOOR || saturation > 1.0);
                inexact += u64::from(energy_excess > 0.0);
            }
            _ => {}
        }
        let energy_balance = state.energy_balance();
        excess = excess
            .max((energy_balance.kinetic - energy_balance.balance()) / energy_balance.peak.max(f64::MIN_POSITIVE));
    }
    Outcome::Done { limited, inexact, excess }
}

/// False alarms of a test, told all at once.
#[derive(Default)]
struct Alarms(Vec<String>);

impl Alarms {
    /// Takes `count` steps from the state that `start` makes, with a step that is short enough all the way.
    fn watch<M: ElementMaterial>(
        &mut self,
        name: &str,
        scene: &VecScene<M>,
        start: &dyn Fn(&Step) -> VecState,
        (damping, count): (f32, u64),
        host: Host<'_>,
    ) {
        let mut dt = 0.5 * bound(scene, &rest_of(scene)).seconds;
        while dt > 1e-6 {
            let step = Step::unchecked(dt, damping).unwrap();
            match attempt(scene, start(&step), &step, count, host) {
                Outcome::TooLong => dt *= 0.8,
                Outcome::FalseAlarm(alarm) => return self.0.push(format!("{name}: false alarm at {alarm}")),
                Outcome::Done { limited, inexact, excess } => {
                    println!(
                        "{name}: {count} steps of {dt:.1e} s, {limited} limited, {inexact} inexact, largest excess \
                         {excess:+.1e}"
                    );
                    return;
                }
            }
        }
        self.0.push(format!("{name}: too violent a scene for this test"));
    }

    fn none(self) {
        assert!(self.0.is_empty(), "{:#?}", self.0);
    }
}

/// How far a law is driven: the exponential stiffens without bound.
fn reach(law: AnyLaw) -> f32 {
    if law.name().starts_with("exp") { 0.4 } else { 1.0 }
}

#[test]
fn sudden_torsion() {
    let body = small_bar();
    let mut alarms = Alarms::default();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        for newton in [1e-6, 1e-3, 1e-2] {
            for damping in [0.0, 5.0, 1e3, 1e6] {
                let name = format!("{}, {newton} N, {damping}/s", law.name());
                let host = |_, _| (torsion(&body, newton, 0.0), vec![]);
                alarms.watch(&name, &scene, &|_| rest_of(&scene), (damping, 1_000), &host);
            }
        }
    }
    alarms.none();
}

#[test]
fn release_from_a_homogeneous_strain() {
    let body = small_bar();
    let mut alarms = Alarms::default();
    let modes: [(&str, Mat3); 3] = [
        ("stretched", [[-0.2, 0.0, 0.0], [0.0, -0.2, 0.0], [0.0, 0.0, 0.5]]),
        ("squeezed", [[0.2, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, -0.35]]),
        ("sheared", [[0.0, 0.0, 0.6], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
    ];
    for law in support::laws() {
        for (how, strain) in modes {
            let scene = body.scene(tissue(law), &held(&body));
            let f = from_fn(|i, j| IDENTITY[i][j] + f64::from(reach(law)) * strain[i][j]);
            let u = body.affine(&f, [0.0; 3]);
            let name = format!("{}, {how} and released", law.name());
            alarms.watch(&name, &scene, &|_| displaced(&scene, &u), (0.0, LONG), NO_LOADS);
        }
    }
    alarms.none();
}

/// Noise on all nodes, with velocities along or against the forces that are like one step's change of velocity:
/// the stiffest modes, in any phase.
#[test]
fn any_start() {
    let body = small_bar();
    let mut alarms = Alarms::default();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        for size in [1e-6, 1e-4, 1e-3] {
            let mut random = Random(5);
            let size = size * f64::from(reach(law));
            let noise = body.points.iter().map(|point| {
                let free = if point[2] > 0.0 { size } else { 0.0 };
                random.vector().map(|x| (free * x) as f32)
            });
            let u: Vec<[f32; 3]> = noise.collect();
            let force = support::forces(&scene, &u);
            for share in [0.0, 1.0, -1.0] {
                let name = format!("{}, noise of {size:.0e} m, velocity {share} dt f/m", law.name());
                let start = |step: &Step| {
                    let mut state = rest_of(&scene);
                    let velocity = |node: usize| {
                        let impulse = share * f64::from(step.seconds() / scene.view().node_mass(node));
                        force[node].map(|f| (impulse * f) as f32)
                    };
                    assert!(tled::start(&scene, &mut state, step, |node| (u[node], velocity(node))));
                    state
                };
                alarms.watch(&name, &scene, &start, (0.0, 1_000), NO_LOADS);
            }
        }
    }
    alarms.none();
}

#[test]
fn motions_that_jump_and_reverse() {
    let body = small_bar();
    let end = far_end(&body);
    let moved = end.iter().copied().map(Support::moved);
    let supports: Vec<_> = held(&body).into_iter().chain(moved).collect();
    let mut alarms = Alarms::default();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &supports);
        let motions = |millimetre: f32, ramp: f32| {
            let size = 1e-3 * reach(law) * millimetre;
            let follow = |&node| Motion { node, axes: Axes::XYZ, metre: [0.0, 0.2 * size, size], ramp };
            end.iter().map(follow).collect::<Vec<_>>()
        };
        let there_and_back = |n: u64| if (n / 500).is_multiple_of(2) { 3.0 } else { -3.0 };
        let mut watch = |how: &str, damping: f32, motions: &dyn Fn(u64, f64) -> Vec<Motion>| {
            let name = format!("{}, {how}", law.name());
            alarms.watch(&name, &scene, &|_| rest_of(&scene), (damping, LONG), &|n, t| (vec![], motions(n, t)));
        };
        watch("reversed every 500 steps", 5.0, &|n, _| motions(there_and_back(n), 0.0));
        watch("taken away and given back", 5.0, &|n, _| {
            if n / 250 % 2 == 0 { motions(there_and_back(n), 0.0) } else { vec![] }
        });
        watch("for one step only", 0.0, &|n, _| if n == 10 { motions(3.0, 0.0) } else { vec![] });
        watch("a ramp of 2 ms, then back at once", 0.0, &|_, t| {
            if t < 4e-3 { motions(4.0, 2e-3) } else { motions(0.0, 0.0) }
        });
        watch("shaken by 1 mm at 50 Hz", 0.0, &|_, t| motions((314.0 * t).sin() as f32, 0.0));
        // "Of several motions of an axis the last one holds."
        watch("two motions of the same nodes", 5.0, &|_, _| {
            motions(-3.0, 0.0).into_iter().chain(motions(3.0, 0.0)).collect()
        });
    }
    alarms.none();
}

#[test]
fn forces_that_the_host_changes_at_will() {
    let body = small_bar();
    let mut alarms = Alarms::default();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let forces = |seed: u64| {
            let mut random = Random(seed);
            let mut newton = || random.vector().map(|x| 5e-3 * reach(law) * x as f32);
            let on = |&node: &u32| NodalForce { node, newton: newton(), ramp: 0.0 };
            far_end(&body).iter().map(on).collect::<Vec<_>>()
        };
        let mut watch = |how: &str, damping: f32, forces: &dyn Fn(u64) -> Vec<NodalForce>| {
            let name = format!("{}, {how}", law.name());
            alarms.watch(&name, &scene, &|_| rest_of(&scene), (damping, LONG), &|n, _| (forces(n), vec![]));
        };
        watch("others every 500 steps", 5.0, &|n| forces(n / 500));
        watch("others every step", 0.0, &forces);
        watch("for one step only", 0.0, &|n| if n % 1000 == 0 { forces(n) } else { vec![] });
        watch("forwards and backwards", 0.0, &|n| {
            forces(7)
                .into_iter()
                .map(|f| {
                    let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
                    NodalForce { newton: f.newton.map(|x| sign * x), ..f }
                })
                .collect()
        });
    }
    alarms.none();
}

/// A force that follows the velocity of what it pulls, undamped: a resonance that the motion finds itself. On for a
/// tenth of the time.
#[test]
fn a_force_that_pumps() {
    let body = small_bar();
    let end = far_end(&body);
    let count = if cfg!(feature = "slow-tests") { 100_000 } else { 5_000 };
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let step = Step::unchecked(0.25 * bound(&scene, &rest_of(&scene)).seconds, 0.0).unwrap();
        let mut state = rest_of(&scene);
        for n in 0..count {
            let along = state.velocity(end[0] as usize)[0].signum();
            let newton = [if n % 10_000 < 1_000 { 2e-4 * along } else { 0.0 }, 0.0, 0.0];
            let forces: Vec<_> = end.iter().map(|&node| NodalForce { node, newton, ramp: 0.0 }).collect();
            let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
            let status = tled::step(&scene, &loads, &mut state, &step);
            assert!(!matches!(status, Status::Diverged(_)), "{}, step {n}: {status:?}", law.name());
            if n % 100 == 0 {
                assert!(bound(&scene, &state).seconds >= 2.0 * step.seconds(), "too violent a scene for this test");
            }
        }
        println!("{}, pumped for {count} steps: {:.2e} J", law.name(), state.energy_balance().balance());
    }
}

#[test]
fn bodies_left_alone_and_thrown() {
    let body = small_bar();
    let mut alarms = Alarms::default();
    for law in support::laws() {
        for (how, supports) in [("held", held(&body)), ("free", vec![])] {
            let scene = body.scene(tissue(law), &supports);
            let name = format!("{}, {how}, left alone", law.name());
            alarms.watch(&name, &scene, &|_| rest_of(&scene), (0.0, LONG), NO_LOADS);
        }
        let scene = body.scene(tissue(law), &[]);
        let start = |step: &Step| {
            let mut state = rest_of(&scene);
            // At 10 m/s, turning at 30 rad/s.
            let thrown = |node: usize| {
                let [x, y, _] = body.points[node];
                ([0.0; 3], [10.0 - 30.0 * (y - 0.01), 30.0 * (x - 0.01), 5.0])
            };
            assert!(tled::start(&scene, &mut state, step, thrown));
            state
        };
        alarms.watch(&format!("{}, thrown", law.name()), &scene, &start, (0.0, LONG), NO_LOADS);
    }
    alarms.none();
}

#[test]
fn sudden_gravity() {
    let body = small_bar();
    for law in support::laws() {
        for (how, supports) in [("held", held(&body)), ("free", vec![])] {
            for damping in [0.0, 20.0] {
                let scene = body.scene(tissue(law), &supports);
                let step = Step::unchecked(0.4 * bound(&scene, &rest_of(&scene)).seconds, damping).unwrap();
                let loads = Loads::new(&scene, [3.0, 0.0, -9.81], &[], &[]).unwrap();
                let mut state = rest_of(&scene);
                for n in 0..5_000 {
                    let status = tled::step(&scene, &loads, &mut state, &step);
                    assert!(!matches!(status, Status::Diverged(_)), "{}, {how}, step {n}: {status:?}", law.name());
                }
            }
        }
    }
}

/// The host may change the step while a scene runs: here between a half and a twentieth of the critical step.
#[test]
fn a_step_that_changes() {
    let body = small_bar();
    let forces = torsion(&body, 3e-3, 0.0);
    let mut alarms = Alarms::default();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
        let critical = 0.8 * bound(&scene, &rest_of(&scene)).seconds;
        for every in [100, 30, 7, 1] {
            let mut state = rest_of(&scene);
            for n in 0..5_000 {
                assert!(n % 10 > 0 || bound(&scene, &state).seconds >= critical);
                let share = if n / every % 2 == 0 { 0.5 } else { 0.05 };
                let step = Step::unchecked(share * critical, 5.0).unwrap();
                if let Status::Diverged(divergence) = tled::step(&scene, &loads, &mut state, &step) {
                    let strain = tled::strain_energy(&scene, &mut state).expect("room");
                    alarms.0.push(format!(
                        "{}, every {every} steps, step {n}: {divergence}; strain energy {strain:.3e} J",
                        law.name()
                    ));
                    break;
                }
            }
        }
    }
    alarms.none();
}

/// The paper's bar under a load at its limit: 0.3 N at each corner at once, damping 5/s, steps of 3e-5 s.
#[test]
#[cfg(feature = "slow-tests")]
fn sudden_torsion_of_the_papers_bar() {
    let body = support::Body::paper();
    let scene = body.scene(tissue(support::EXP), &held(&body));
    let forces = support::bodies::corner_torsion(&body, 0.3, 0.0);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(3e-5, 5.0).unwrap();
    let mut state = rest_of(&scene);
    let (mut limited, mut shortest) = (0, f32::INFINITY);
    for n in 0..10_000 {
        match tled::step(&scene, &loads, &mut state, &step) {
            Status::Diverged(divergence) => panic!("false alarm at step {n}: {divergence}"),
            Status::Limited { .. } => limited += 1,
            _ => {}
        }
        if n % 50 == 0 {
            shortest = shortest.min(bound(&scene, &state).seconds);
        }
    }
    println!("sudden torsion of the paper's bar: {limited} steps limited, least critical step {shortest:.2e} s");
}
