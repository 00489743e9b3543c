//! Supports that start and stop at once: the body follows them as it follows them in exact steps.

use supple::element::ElementMaterial;
use supple::loads::{Loads, Motion};
use supple::material::{AnyLaw, NeoHookean, NodalStrain, Tissue};
use supple::scene::{Axes, Support};
use supple::step::Step;

use crate::large_steps::{limit, prepared};
use crate::support::bodies::Body;
use crate::support::{mean_distance, rest_of, run, tissue, to_f64};

/// A bar with one end that moves.
struct Pulled {
    body: Body,
    motions: Vec<Motion>,
    supports: Vec<Support>,
    law: NeoHookean,
}

impl Pulled {
    /// The end moves by `metre` (m) in `ramp` seconds; the other end is held, or free.
    fn new(law: NeoHookean, metre: [f32; 3], ramp: f32, held: bool) -> Self {
        const LENGTH: f32 = 0.1;
        let body = Body::bar([0.02, 0.02, LENGTH], [3, 3, 12]);
        let end = body.nodes_where(|[_, _, z]| z == LENGTH);
        let motions: Vec<_> = end.into_iter().map(|node| Motion { node, axes: Axes::XYZ, metre, ramp }).collect();
        let mut supports: Vec<_> = motions.iter().map(|motion| Support::moved(motion.node)).collect();
        if held {
            supports.extend(body.nodes_where(|[_, _, z]| z == 0.0).into_iter().map(Support::fixed));
        }
        Self { body, motions, supports, law }
    }

    /// Mean distance from the exact motion after each of these numbers of steps, and the mean displacement there, m.
    fn compare<M: ElementMaterial>(
        &self,
        material: impl Fn(Tissue<AnyLaw>) -> M,
        multiple: f32,
        damping: f32,
        after: &[u32],
    ) -> Vec<[f64; 2]> {
        /// Exact steps in one long step, for each multiple of the limit.
        const FINER: u32 = 4;
        let scene = self.body.scene(material(tissue(self.law)), &self.supports);
        let loads = Loads::new(&scene, [0.0; 3], &[], &self.motions).unwrap();
        let step = Step::unchecked(multiple * limit(&scene), damping).unwrap();
        let parts = FINER * multiple as u32;
        let fine = Step::unchecked(step.seconds() / parts as f32, damping).unwrap();
        let [mut state, mut exact] = [rest_of(&scene), rest_of(&scene)];
        let mut large = prepared(&self.body, &scene, &mut state, step, 0.0);
        let mut compared = Vec::new();
        for taken in 1..=after.iter().copied().max().unwrap() {
            assert!(large.step(scene.view(), &loads, state.view()).is_taken(), "step {taken}");
            run(&scene, &loads, &mut exact, &fine, u64::from(parts));
            if after.contains(&taken) {
                let [moved, truth] = [&state, &exact].map(|state| to_f64(state.displacements()));
                let rest = vec![[0.0; 3]; truth.len()];
                compared.push([mean_distance(&moved, &truth), mean_distance(&truth, &rest)]);
            }
        }
        compared
    }
}

#[test]
fn a_support_that_starts_takes_the_body_along_from_the_first_step_on() {
    is_taken_along("linear", |tissue| tissue, [50.0, 100.0]);
    // About as long as the others, as its critical step is longer.
    is_taken_along("nodal strain", NodalStrain, [35.0, 70.0]);
}

fn is_taken_along<M: ElementMaterial>(
    element: &str,
    material: impl Fn(Tissue<AnyLaw>) -> M + Copy,
    [eight, one]: [f32; 2],
) {
    // Stiff enough for a wave to run through the bar in a step of 100 times the limit: it moves nearly as one.
    let pulled = Pulled::new(NeoHookean { c: 40_000.0, d: 400_000.0 }, [0.1, 0.0, 0.3], 0.3, false);
    for (multiple, steps, most) in [(eight, 8, 0.1), (one, 1, 0.1)] {
        let [error, motion] = pulled.compare(material, multiple, 20.0, &[steps])[0].map(|metre| 1e3 * metre);
        println!("{element} at {multiple}, {steps} steps: off by {error:.2} of {motion:.1} mm");
        assert!(error < most * motion);
    }
}

#[test]
fn a_bar_follows_a_fast_pull() {
    follows("linear", |tissue| tissue);
    follows("nodal strain", NodalStrain);
}

fn follows<M: ElementMaterial>(element: &str, material: impl Fn(Tissue<AnyLaw>) -> M + Copy) {
    /// s
    const RAMP: f32 = 0.04;
    for ratio in [10.0, 50.0, 1000.0] {
        let law = NeoHookean { c: 20_000.0, d: 20_000.0 * ratio };
        let pulled = Pulled::new(law, [0.0, 0.0, 0.05], RAMP, true);
        let limit = limit(&pulled.body.scene(material(tissue(law)), &pulled.supports));
        for multiple in [10.0, 20.0] {
            let ramp = (RAMP / (multiple * limit)) as u32;
            let figures = pulled.compare(material, multiple, 20.0, &[ramp / 2, ramp, 2 * ramp]);
            let shares: Vec<_> = figures.iter().map(|[error, motion]| error / motion).collect();
            println!(
                "{element}, bulk over shear {ratio}, at {multiple}: error over motion while the support \
                moves, when it stops, and later {shares:.3?}"
            );
            assert!(shares.iter().all(|share| *share < 0.1), "{figures:?}");
        }
    }
}
