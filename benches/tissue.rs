//! What relaxation and fibres cost on bars under gravity. An exact step with one, two and three terms over the same
//! without, with one term of two tissues, and a step of 20 times the critical one with one term; bytes an element and
//! term. Steps of exponential tissue with one family of fibres, with both and their coupling, and with a term as well, over
//! those without. Medians of runs in turn.
//!
//!     cargo bench --bench tissue

mod common {
    pub(crate) mod pairs;
}

use common::pairs::{median, seconds};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::material::{AnyLaw, Directions, Element, Exponential, Fibres, NeoHookean, Prony, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::Step;
use supple::tled;

const GRAVITY: [f32; 3] = [0.0, -0.981, 0.0];
/// Runs of each, in turn.
const ROUNDS: usize = 15;

struct Body {
    scene: VecScene<VecMaterial>,
    state: VecState,
    step: Step,
    long: Option<LargeStep<Vec<NodeVector>>>,
}

impl Body {
    /// A bar of cells of 4 mm that is held at one end, of so many tissues with so many terms each, and fibres along it.
    fn new(
        cells: u32,
        material: &VecMaterial,
        [tissues, terms]: [usize; 2],
        fibres: Option<Fibres>,
        multiple: f32,
    ) -> Self {
        let bar = Bar {
            size: [0.004 * cells as f32, 0.004 * cells as f32, 0.008 * cells as f32],
            cells: [cells, cells, 2 * cells],
        };
        let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
        let mesh = Mesh::new(&points, &tets, Winding::Checked).expect("a sound bar");
        let series: Vec<_> = (0..terms).map(|term| [0.2, 0.01 * 10.0_f32.powi(term as i32)]).collect();
        let prony = if terms > 0 { vec![Prony::new(&series).expect("a series"); tissues] } else { vec![] };
        let of_element =
            if tissues > 1 { (0..tets.len()).map(|tet| u16::from(2 * tet > tets.len())).collect() } else { vec![] };
        let along = Directions { fibre: [0.6, 0.0, 0.8], sheet: [0.0, 1.0, 0.0] };
        let material = VecMaterial {
            tissues: vec![material.tissues[0]; tissues],
            of_element,
            prony,
            fibres: fibres.into_iter().collect(),
            directions: if fibres.is_some() { vec![along; tets.len()] } else { vec![] },
            ..material.clone()
        };
        let fixed: Vec<_> =
            (0..).zip(&points).filter(|(_, point)| point[2] == 0.0).map(|(node, _)| Support::fixed(node)).collect();
        let scene = VecScene::build(material, &mesh, &fixed).expect("a scene");
        let mut state = VecState::of(scene.view());
        let critical = tled::critical_step(&scene, &mut state).expect("a critical step");
        let step = Step::unchecked(multiple * critical.seconds, 5.0).expect("a step");
        let large = |state: &mut VecState| {
            LargeStep::prepare_in_vec(Method::new(Cells::Suggested), scene.view(), &points, state.view(), step)
        };
        let long = (multiple > 1.0).then(|| large(&mut state).expect("a long step"));
        Self { scene, state, step, long }
    }

    /// Seconds of a step.
    fn time(&mut self) -> f64 {
        let Self { scene, state, step, long } = self;
        let loads = Loads::new(scene, GRAVITY, &[], &[]).expect("gravity");
        let steps = (1_000_000 / scene.element_count()).max(3);
        let taken = seconds(|| {
            for _ in 0..steps {
                let status = match long {
                    Some(long) => long.step(scene.view(), &loads, state.view()),
                    None => tled::step(scene, &loads, state, step),
                };
                assert!(status.is_taken(), "{status:?}");
            }
        });
        taken / steps as f64
    }
}

/// Time of a step of the first (s), and those of the others over it.
fn ratios<const N: usize>(mut all: [Body; N]) -> (f64, [f64; N]) {
    let (mut first, mut found) = (vec![], [const { vec![] }; N]);
    for _ in 0..ROUNDS {
        let times = all.each_mut().map(Body::time);
        first.push(times[0]);
        for (ratios, time) in found.iter_mut().zip(times) {
            ratios.push(time / times[0]);
        }
    }
    (median(first), found.map(median))
}

fn main() {
    fibres();
    relaxation();
}

fn relaxation() {
    println!(
        "| element | law | tetrahedra | exact step, us | 1 term | 2 terms | 3 terms | 1 term, two tissues over two | long step, 1 term | bytes a term and element |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let laws = [
        AnyLaw::from(NeoHookean { c: 500.0, d: 25_000.0 }),
        AnyLaw::from(Exponential { a: 1_000.0, b: 3.0, d: 25_000.0 }),
    ];
    for (element, law) in Element::ALL.into_iter().flat_map(|element| laws.map(|law| (element, law))) {
        for cells in [12, 20] {
            let material = VecMaterial::one(element, law, 1000.0);
            let of = |kind, multiple| Body::new(cells, &material, kind, None, multiple);
            let (exact, [_, one, two, three]) = ratios([[1, 0], [1, 1], [1, 2], [1, 3]].map(|kind| of(kind, 0.5)));
            let (_, [_, of_two_tissues]) = ratios([[2, 0], [2, 1]].map(|kind| of(kind, 0.5)));
            let (_, [_, long]) = ratios([[1, 0], [1, 1]].map(|kind| of(kind, 20.0)));
            let scene = of([1, 1], 0.5).scene;
            let bytes = (size_of::<NodeVector>() * scene.view().memory_vectors()) as f64 / scene.element_count() as f64;
            println!(
                "| {} | {} | {} | {:.0} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {bytes:.0} |",
                element.name(),
                scene.material().law.to_string().split(',').next().unwrap_or_default(),
                scene.element_count(),
                1e6 * exact,
                one,
                two,
                three,
                of_two_tissues,
                long
            );
        }
    }
}

fn fibres() {
    println!(
        "| element | tetrahedra | exact step, us | fibres | and sheets, coupling | and 1 term | long step: fibres | and sheets, coupling |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let law = AnyLaw::from(Exponential { a: 1_000.0, b: 3.0, d: 25_000.0 });
    let [along, sheets, coupling] = [[18_472.0, 16.026], [2_481.0, 11.12], [216.0, 11.436]];
    let one = Fibres::new([Some(along), None, None]).expect("fibres");
    let all = Fibres::new([Some(along), Some(sheets), Some(coupling)]).expect("fibres");
    for element in Element::ALL {
        for cells in [12, 20] {
            let material = VecMaterial::one(element, law, 1000.0);
            let of = |terms, fibres, multiple| Body::new(cells, &material, [1, terms], fibres, multiple);
            let kinds = [(0, None), (0, Some(one)), (0, Some(all)), (1, Some(all))];
            let (exact, [_, first, both, relaxing]) = ratios(kinds.map(|(terms, fibres)| of(terms, fibres, 0.5)));
            let (_, [_, long, long_both]) = ratios([None, Some(one), Some(all)].map(|fibres| of(0, fibres, 20.0)));
            let elements = of(0, None, 0.5).scene.element_count();
            println!(
                "| {} | {elements} | {:.0} | {first:.2} | {both:.2} | {relaxing:.2} | {long:.2} | {long_both:.2} |",
                element.name(),
                1e6 * exact
            );
        }
    }
}
