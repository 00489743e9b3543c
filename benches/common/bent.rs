//! A bent body that swings: in a body at rest the front of the first wave is so weak that floats are denormal, which is
//! ten times as slow.

use supple::element::ElementLaw;
use supple::scene::Support;
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

use super::bar::{self, BarScene, DAMPING};

pub(crate) struct Bent<L> {
    pub(crate) scene: BarScene<L>,
    pub(crate) state: VecState,
    pub(crate) step: Step,
}

impl<L: ElementLaw> Bent<L> {
    /// Held where `z` is zero, with its critical step.
    pub(crate) fn new(law: L, points: &[[f32; 3]], tets: &[[u32; 4]]) -> Self {
        let held = points.iter().enumerate().filter(|(_, point)| point[2] == 0.0);
        let held: Vec<_> = held.map(|(node, _)| Support::fixed(node as u32)).collect();
        let scene = bar::scene_of(bar::tissue(law), points, tets, &held);
        let mut state = VecState::at_rest(points.len());
        let critical = tled::critical_step(&scene, &mut state).expect("the bar has a critical step");
        let step = Step::new(critical.seconds, DAMPING, critical).expect("that step");
        let bent = |node: usize| {
            let [x, y, z] = points[node];
            ([0.01 * z * y, 0.001 * (30.0 * x).sin() * z, -0.01 * z * x], [0.0; 3])
        };
        assert!(tled::start(&scene, &mut state, &step, bent));
        Self { scene, state, step }
    }
}
