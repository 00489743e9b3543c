//! Calls far shorter than the long steps that are taken unless a length is given, 20 times the critical one: a slab
//! that is fixed below and pushed sideways at its top goes as exact steps take it. With the inertia of the longer steps
//! it hardly moved.

use supple::inertia::{Cells, Method as Lattice};
use supple::loads::NodalForce;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};
use supple::step::Status;

use crate::support::{mean_distance, to_f64};

/// What is called right, m: half of the tolerance that holds unless one is given.
const RIGHT: f64 = 2.5e-4;

/// A slab with a square base of so many metres.
struct Slab {
    edge: f32,
    young: f32,
}

impl Slab {
    fn pushed(&self, method: Method<'static>) -> Simulation<'static> {
        let bar = Bar { size: [self.edge, self.edge, 0.5 * self.edge], cells: [8, 8, 4] };
        let (shear, bulk) = (self.young / 2.9, self.young / 0.3);
        let law = NeoHookean { c: 0.5 * shear, d: 0.5 * bulk };
        let fixed: Vec<_> = (0..81).map(Support::fixed).collect();
        let tissue = VecMaterial::one(Element::NodalStrain, law, 1000.0);
        let settings = Settings { method, damping: 5.0, ..Settings::default() };
        let mut body = Simulation::new(bar.points(), bar.tets(), tissue, &fixed).unwrap().with(settings);
        let newton = [0.05 * self.young * self.edge * self.edge / 81.0, 0.0, 0.0];
        body.forces = (0..81).map(|node| NodalForce { node: 4 * 81 + node, newton, ramp: 0.2 }).collect();
        body
    }
}

#[test]
fn a_slab_moves_in_short_calls_as_exact_steps_take_it() {
    for (edge, young, call) in [(0.4, 3000.0, 1.0 / 60.0), (0.25, 1000.0, 1.0 / 60.0), (0.1, 3000.0, 0.005)] {
        let slab = Slab { edge, young };
        let (mut exact, mut long) =
            (slab.pushed(Method::Exact), slab.pushed(Method::Long(Lattice::new(Cells::Suggested))));
        let (mut worst, mut motion, mut needless) = (0.0_f64, 0.0_f64, 0);
        let calls = (0.6 / call) as u32;
        for _ in 0..calls {
            exact.advance(call).unwrap();
            let is_ok = long.advance(call).unwrap().status == Status::Ok;
            let right = to_f64(exact.state().displacements());
            let off = mean_distance(&to_f64(long.state().displacements()), &right);
            worst = worst.max(off);
            motion = motion.max(mean_distance(&right, &vec![[0.0; 3]; right.len()]));
            needless += u32::from(!is_ok && off < RIGHT);
        }
        println!(
            "{edge} m, calls of {:.1} ms: {:.2} of {:.2} mm off at most, {needless} of {calls} calls doubted that are right",
            1e3 * call,
            1e3 * worst,
            1e3 * motion
        );
        assert!(worst < 0.05 * motion && motion > 0.01 * f64::from(edge) && needless == 0);
    }
}
