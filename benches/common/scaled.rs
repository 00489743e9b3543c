//! Steps beyond the limit of stability on the paper's bar: mass-scaled, multilevel, damped.

use supple::inertia::{
    self, Damper, Inertia, LatticeNode, damped_numbers_for, damped_step, damped_vectors_for,
};
use supple::loads::Loads;
use supple::material::Exponential;
use supple::mlp::Network;
use supple::state::NodeVector;
use supple::tled::Step;

use super::bar::{BarScene, DAMPING, DT, moved, state};

pub(crate) const LATTICE: [u32; 3] = [2, 2, 4];
pub(crate) const DAMPED_LATTICE: [u32; 3] = [2, 2, 5];

/// A network as it would lie in flash.
#[repr(C, align(64))]
struct Flash<B: ?Sized>(B);
static DAMPER: &Flash<[u8]> = &Flash(*include_bytes!("../../weights/damper.weights"));

/// A step with the given lattice, from a state that it has deformed for eight cycles.
pub(crate) fn scaled<'a>(
    scene: &'a BarScene<Exponential>,
    loads: &'a Loads<'a>,
    points: &[[f32; 3]],
    multiple: f32,
    (cells, damped): ([u32; 3], bool),
    cycle: u32,
) -> impl FnMut() + 'a {
    let nodes = points.len();
    let functions = if cells == [0; 3] {
        0
    } else {
        inertia::lattice_functions(scene, points, cells).expect("the lattice fits")
    };
    let mut state = state(nodes);
    let mut inertia = Inertia::over(
        vec![NodeVector::ZERO; damped_vectors_for(nodes)],
        vec![LatticeNode::EMPTY; nodes],
        vec![0.0; damped_numbers_for(cells, functions)],
    );
    let step = Step::insist(multiple * DT, DAMPING).expect("a positive step");
    let damper = damped.then(|| {
        let network = Network::parse(&DAMPER.0).expect("a weight file of the crate");
        Damper::over(network).expect("a damper")
    });
    if damped {
        inertia = inertia.damped();
    }
    inertia.prepare(scene, points, &mut state, step, cells).expect("the bar can be prepared");
    assert_eq!(inertia.cycle(), cycle);
    let mut run = move || {
        moved(damped_step(scene, loads, &mut state, &mut inertia, damper.as_ref()));
    };
    // Whole cycles.
    (0..8 * cycle).for_each(|_| run());
    run
}
