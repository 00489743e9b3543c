//! What a sphere costs a step of the liver lobe, exact and long (20 times): far away, over the same step of the body
//! at rest; and pressing, over that of the body that is pressed by the same forces as loads, since a deformed body
//! costs a long step more. Then the same sphere with the triangles of the surface, which a thin instrument needs.
//!
//! `cargo bench --features io --bench contact` prints ratios from runs in turn.

mod common {
    pub(crate) mod pairs;
}

use std::path::Path;

use common::pairs::{median, seconds};
use supple::contact::{
    Contact, ContactPoint, Instrument, Pose, Shape, Surface, Touch, boundary, boundary_triangles, vectors_to_push,
};
use supple::element::ElementMaterial;
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::{Loads, NodalForce};
use supple::material::{Exponential, NodalPressure, NodalStrain, Tissue};
use supple::mesh::{Mesh, Winding};
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

fn sphere(top: [f32; 3], depth: f32) -> Vec<Instrument<'static>> {
    let at = |height: f32| Pose::at([top[0], top[1], top[2] + RADIUS + height]);
    let mut sphere = Instrument::resting(Shape::Sphere { radius: RADIUS }, at(0.0005));
    sphere.friction = 0.3;
    sphere.move_to(at(-depth), 0.0, f64::from(DEPTH / SPEED));
    vec![sphere]
}

/// What acts on the lobe in a run.
#[derive(Default)]
struct Acting {
    instruments: Vec<Instrument<'static>>,
    has_triangles: bool,
    forces: Vec<NodalForce>,
}

fn measure<M: ElementMaterial>(name: &str, material: M, points: &[[f32; 3]], tets: &[[u32; 4]], is_long: bool) {
    let mesh = Mesh::new(points, tets, Winding::Checked).expect("the lobe is sound");
    let back: Vec<u32> = (0u32..).zip(points).filter(|(_, point)| point[1] > 0.03).map(|(node, _)| node).collect();
    let fixed: Vec<_> = back.iter().map(|&node| Support::fixed(node)).collect();
    let scene = VecScene::build(material, &mesh, &fixed).expect("the lobe can be built");
    let surface = boundary(&mesh);
    let triangles = boundary_triangles(&mesh, &surface);
    let top = surface.iter().max_by(|a, b| a.rest[2].total_cmp(&b.rest[2])).expect("a surface").rest;
    let critical = tled::critical_step(&scene, &mut VecState::at_rest(points.len())).expect("a critical step");
    let multiple = if is_long { MULTIPLE } else { 0.5 };
    let step = Step::unchecked(multiple * critical.seconds, DAMPING).expect("a step");
    let (scene, surface, triangles) = (&scene, &*surface, &*triangles);
    let run = |acting: Acting| -> Box<dyn FnMut() -> (Vec<ContactPoint>, f64) + '_> {
        let Acting { instruments, has_triangles, forces } = acting;
        let triangles = if has_triangles { triangles } else { &[] };
        let mut state = VecState::at_rest(points.len());
        let mut pushes = vec![NodeVector::ZERO; vectors_to_push(surface.len(), triangles.len())];
        let (mut touches, mut list) = ([Touch::default()], vec![ContactPoint::default(); 64]);
        let mut large = is_long.then(|| {
            let method = Method::new(Cells::Given([3, 3, 3]));
            LargeStep::prepare_in_vec(method, scene.view(), points, state.view(), step).expect("prepared")
        });
        Box::new(move || {
            let touched = Surface::new(surface, points.len()).and_then(|all| all.with_triangles(triangles));
            let contact = Contact::new(touched.expect("a surface"), &instruments).expect("instruments");
            let mut loads = Loads::new(scene, [0.0; 3], &forces, &[]).expect("forces");
            let mut view = state.view();
            if !instruments.is_empty() {
                loads = loads.touched_by(contact);
                view = view.feeling(&mut touches).pushing(&mut pushes).listing(&mut list);
            }
            let status = match &mut large {
                Some(large) => large.step(scene.view(), &loads, view),
                None => tled::step(scene, &loads, &mut view, &step),
            };
            assert!(status.is_taken(), "{status:?}");
            (list[..touches[0].contacts as usize].to_vec(), state.time())
        })
    };
    let settled = |run: &mut dyn FnMut() -> (Vec<ContactPoint>, f64)| {
        loop {
            let (points, time) = run();
            if time > 1.5 * f64::from(DEPTH / SPEED) {
                break points;
            }
        }
    };
    let pressing = || Acting { instruments: sphere(top, DEPTH), ..Acting::default() };
    let contacts = settled(&mut run(pressing()));
    let force = |point: &ContactPoint| NodalForce { node: point.node, newton: point.force, ramp: DEPTH / SPEED };
    let mut runs = [
        run(Acting::default()),
        run(Acting { instruments: sphere([0.0, 0.0, 1.0], 0.0), ..Acting::default() }),
        run(Acting { forces: contacts.iter().map(force).collect(), ..Acting::default() }),
        run(pressing()),
        run(Acting { has_triangles: true, ..pressing() }),
    ];
    let met = runs.each_mut().map(|run| settled(run).len());
    let mut times = [const { Vec::new() }; 5];
    for _ in 0..PAIRS {
        for (run, times) in runs.iter_mut().zip(&mut times) {
            let steps = || (0..STEPS).for_each(|_| drop(run()));
            times.push(seconds(steps) / STEPS as f64);
        }
    }
    let micro = |at: usize| 1e6 * median(times[at].clone());
    let more = |at: usize, than: usize| {
        let ratios = times[at].iter().zip(&times[than]).map(|(with, without)| with / without);
        100.0 * (median(ratios.collect()) - 1.0)
    };
    println!(
        "{name}, {} nodes, {} and {} triangles on the surface: at rest {:.1} us a step, a sphere far away {:+.1} %; pressed by forces {:.1} us, \
         by a sphere on {} nodes {:+.1} %, on {} nodes and triangles {:+.1} %",
        points.len(),
        surface.len(),
        triangles.len(),
        micro(0),
        more(1, 0),
        micro(2),
        met[3],
        more(3, 2),
        met[4],
        more(4, 2),
    );
}

fn main() {
    let file = supple::io::read_mesh(Path::new("meshes/lobe.msh")).expect("the lobe's mesh");
    let points: Vec<[f32; 3]> = file.points.iter().map(|p| p.map(|c| c as f32)).collect();
    let tissue = Tissue { law: Exponential { a: 1500.0, b: 8.023, d: 40_000.0 }, density: 1060.0 };
    for is_long in [false, true] {
        let name = if is_long { "long" } else { "exact" };
        measure(&format!("{name}, linear"), tissue, &points, &file.tets, is_long);
        measure(&format!("{name}, nodal pressure"), NodalPressure(tissue), &points, &file.tets, is_long);
        measure(&format!("{name}, nodal strain"), NodalStrain(tissue), &points, &file.tets, is_long);
    }
}
