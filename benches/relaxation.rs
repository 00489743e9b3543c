//! What tissue that relaxes costs on bars under gravity: an exact step with one, two and three terms over the same
//! without, with one term of two tissues, and a step of 20 times the critical one with one term; bytes an element and
//! term. Medians of runs in turn.
//!
//!     cargo bench --bench relaxation

mod common {
    pub(crate) mod pairs;
}

use common::pairs::{median, seconds};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::material::{AnyLaw, Element, Exponential, NeoHookean, Prony, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::Step;
use supple::tled;

const GRAVITY: [f32; 3] = [0.0, -0.981, 0.0];
/// Runs of each, in turn.
const ROUNDS: usize = 15;

struct Relaxing {
    scene: VecScene<VecMaterial>,
    state: VecState,
    step: Step,
    long: Option<LargeStep<'static, Vec<NodeVector>>>,
}

impl Relaxing {
    /// A bar of cells of 4 mm that is held at one end, of so many tissues with so many terms each.
    fn new(cells: u32, material: &VecMaterial, [tissues, terms]: [usize; 2], multiple: f32) -> Self {
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
        let material =
            VecMaterial { tissues: vec![material.tissues[0]; tissues], of_element, prony, ..material.clone() };
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
fn ratios<const N: usize>(mut all: [Relaxing; N]) -> (f64, [f64; N]) {
    let (mut first, mut found) = (vec![], [const { vec![] }; N]);
    for _ in 0..ROUNDS {
        let times = all.each_mut().map(Relaxing::time);
        first.push(times[0]);
        for (ratios, time) in found.iter_mut().zip(times) {
            ratios.push(time / times[0]);
        }
    }
    (median(first), found.map(median))
}

fn main() {
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
            let of = |kind, multiple| Relaxing::new(cells, &material, kind, multiple);
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
