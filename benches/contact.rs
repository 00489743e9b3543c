//! What a sphere costs a step of the liver lobe: exact and damped (20 times), with the sphere far away, and pressing.
//!
//! `cargo bench --features io --bench contact` prints ratios to the same steps without a sphere, from runs in turn.

mod common {
    pub(crate) mod pairs;
}

use std::path::Path;

use common::pairs::{median, seconds};
use supple::contact::{Contact, Instrument, Pose, Shape, Surface, Touch, boundary, vectors_to_push};
use supple::element::ElementMaterial;
use supple::inertia::{Cells, Damper, LargeStep, Method};
use supple::loads::Loads;
use supple::material::{Exponential, NodalPressure, NodalStrain, Tissue};
use supple::mesh::{Mesh, Winding};
use supple::mlp::{Network, WeightBytes};
use supple::scene::{Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::Step;
use supple::tled;

const DAMPING: f32 = 20.0;
const MULTIPLE: f32 = 20.0;
const RADIUS: f32 = 0.01;
/// How deep the sphere presses, m, and how fast it goes there, m/s.
const DEPTH: f32 = 0.004;
const SPEED: f32 = 0.02;
const STEPS: usize = 64;
const PAIRS: usize = 41;

fn sphere(top: [f32; 3], depth: f32) -> Instrument<'static> {
    let at = |height: f32| Pose::at([top[0], top[1], top[2] + RADIUS + height]);
    let mut sphere = Instrument::resting(Shape::Sphere { radius: RADIUS }, at(0.0005));
    sphere.friction = 0.3;
    sphere.move_to(at(-depth), 0.0, f64::from(DEPTH / SPEED));
    sphere
}

fn measure<M: ElementMaterial>(
    name: &str,
    material: M,
    points: &[[f32; 3]],
    tets: &[[u32; 4]],
    damped: bool,
) {
    let mesh = Mesh::new(points, tets, Winding::Checked).expect("the lobe is sound");
    let back: Vec<u32> =
        (0u32..).zip(points).filter(|(_, point)| point[1] > 0.03).map(|(node, _)| node).collect();
    let fixed: Vec<_> = back.iter().map(|&node| Support::fixed(node)).collect();
    let scene = VecScene::build(material, &mesh, &fixed).expect("the lobe can be built");
    let surface = boundary(&mesh);
    let top = surface.iter().max_by(|a, b| a.rest[2].total_cmp(&b.rest[2])).expect("a surface").rest;
    let critical =
        tled::critical_step(&scene, &mut VecState::at_rest(points.len())).expect("a critical step");
    let multiple = if damped { MULTIPLE } else { 0.5 };
    let step = Step::unchecked(multiple * critical.seconds, DAMPING).expect("a step");
    let bytes = WeightBytes::of(include_bytes!("../weights/damper.weights"));
    let (scene, surface) = (&scene, &*surface);
    let run = |instruments: &[Instrument<'static>], with: bool| -> Box<dyn FnMut() -> (u32, f64) + '_> {
        let instruments: Vec<_> = instruments.to_vec();
        let mut state = VecState::at_rest(points.len());
        let mut pushes = vec![NodeVector::ZERO; vectors_to_push(surface.len(), 0)];
        let mut touches = [Touch::default()];
        let bytes = bytes.clone();
        let mut large = damped.then(|| {
            let network = Network::parse(Box::leak(Box::new(bytes)).bytes()).expect("weights");
            let method = Method::Damped(Damper::new(network).expect("a damper"), Cells::Given([3, 3, 3]));
            LargeStep::prepare_in_vec(method, scene.view(), points, state.view(), step).expect("prepared")
        });
        Box::new(move || {
            let contact = Contact::new(Surface::new(surface, points.len()).expect("nodes"), &instruments)
                .expect("instruments");
            let loads = if with { Loads::NONE.touched_by(&contact) } else { Loads::NONE };
            let mut view = state.view();
            if with {
                view = view.feeling(&mut touches).pushing(&mut pushes);
            }
            let status = match &mut large {
                Some(large) => large.step(scene.view(), &loads, view),
                None => tled::step(scene, &loads, &mut view, &step),
            };
            assert!(status.is_taken(), "{status:?}");
            (touches[0].contacts, state.time())
        })
    };
    let mut runs =
        [run(&[], false), run(&[sphere([0.0, 0.0, 1.0], 0.0)], true), run(&[sphere(top, DEPTH)], true)];
    let mut contacts = 0;
    for run in &mut runs {
        loop {
            let (touching, time) = run();
            contacts = touching;
            if time > 1.2 * f64::from(DEPTH / SPEED) {
                break;
            }
        }
    }
    let mut times = [const { Vec::new() }; 3];
    for _ in 0..PAIRS {
        for (run, times) in runs.iter_mut().zip(&mut times) {
            times.push(
                seconds(|| {
                    (0..STEPS).for_each(|_| {
                        run();
                    })
                }) / STEPS as f64,
            );
        }
    }
    let ratio = |at: usize| {
        100.0
            * (median(times[at].iter().zip(&times[0]).map(|(with, without)| with / without).collect()) - 1.0)
    };
    println!(
        "{name}, {} nodes, {} on the surface: {:.1} us a step, a sphere far away {:+.1} %, pressing {contacts} nodes {:+.1} %",
        points.len(),
        surface.len(),
        1e6 * median(times[0].clone()),
        ratio(1),
        ratio(2)
    );
}

fn main() {
    let file = supple::io::read_mesh(Path::new("meshes/lobe.msh")).expect("the lobe's mesh");
    let points: Vec<[f32; 3]> = file.points.iter().map(|p| p.map(|c| c as f32)).collect();
    let tissue = Tissue { law: Exponential { a: 1500.0, b: 8.023, d: 40_000.0 }, density: 1060.0 };
    for damped in [false, true] {
        let name = if damped { "damped" } else { "exact" };
        measure(&format!("{name}, linear"), tissue, &points, &file.tets, damped);
        measure(&format!("{name}, nodal pressure"), NodalPressure(tissue), &points, &file.tets, damped);
        measure(&format!("{name}, nodal strain"), NodalStrain(tissue), &points, &file.tets, damped);
    }
}
