//! What the elements with nodal pressure and with nodal strain are both held to: their definition in float64, patch
//! test, rigid motion, the exact critical step as the limit of stability, drift of the energy, and the same bits from
//! any number of parts.

use supple::element::ElementMaterial;
use supple::loads::Loads;
use supple::material::NeoHookean;
use supple::scene::{Support, VecScene};
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use crate::reference::nodal_pressure::Tissues;
use crate::reference::tensor::{product, rotation};
use crate::reference::{Law, Mat3, Random};
use crate::support::bodies::{held, small_bar};
use crate::support::{Backwards, Body, bits, displaced, fixed, forces, norm, reference_law, rest_of, widened};
use crate::{reference, support};

/// Of nodes in float64: displacements (m) or forces (N).
type Vectors = Vec<[f64; 3]>;

/// An element as it is defined, in float64: strain energy (J) and forces on the nodes (N) at displacements (m).
pub(crate) struct Definition {
    pub(crate) energy: fn(&Tissues<'_>, &[[f64; 3]]) -> f64,
    pub(crate) forces: fn(&Tissues<'_>, &[[f64; 3]]) -> Vectors,
}

/// Random displacements of at most `size` m.
pub(crate) fn noise(body: &Body, size: f64, seed: u64) -> Vec<[f32; 3]> {
    let mut random = Random(seed);
    body.points.iter().map(|_| random.vector().map(|x| (size * x) as f32)).collect()
}

/// Elements that turn inside out in a state.
fn inverted(body: &Body, u: &[[f32; 3]]) -> usize {
    let gradients = body.reference().deformation_gradients(&widened(u));
    gradients.iter().filter(|f| reference::tensor::determinant(f) <= 0.0).count()
}

/// The norm over some nodes.
pub(crate) fn norm_where(forces: &[[f64; 3]], wanted: impl Fn(usize) -> bool) -> f64 {
    let of_these: Vec<_> = forces.iter().enumerate().filter(|(node, _)| wanted(*node)).map(|(_, f)| *f).collect();
    norm(&of_these)
}

impl Definition {
    /// The forces of the definition are minus the gradient of its energy, for two tissues displaced at random by at
    /// most `size` m.
    pub(crate) fn check_gradient(&self, size: f64) {
        let body = Body::bar([0.02, 0.03, 0.04], [1, 2, 2]);
        let mesh = body.reference();
        let laws = [reference_law(support::EXP), reference_law(support::NEO)];
        let of_element: Vec<usize> = (0..mesh.tets.len()).map(|element| element / 5 % 2).collect();
        let tissues = Tissues { mesh: &mesh, laws: &laws, of_element: &of_element };
        let u = widened(&noise(&body, size, 5));
        let exact = (self.forces)(&tissues, &u);
        let mut worst = 0.0_f64;
        for node in 0..u.len() {
            for axis in 0..3 {
                let at = |h: f64| {
                    let mut u = u.clone();
                    u[node][axis] += h;
                    (self.energy)(&tissues, &u)
                };
                let numeric = (at(-1e-7) - at(1e-7)) / 2e-7;
                worst = worst.max((numeric - exact[node][axis]).abs());
            }
        }
        println!("difference to the gradient {:.1e}", worst / norm(&exact));
        assert!(worst < 1e-6 * norm(&exact));
    }

    /// Relative error of the kernel's forces on the nodes that are wanted.
    fn error<M: ElementMaterial>(
        &self,
        tissues: &Tissues<'_>,
        scene: &VecScene<M>,
        u: &[[f32; 3]],
        wanted: impl Fn(usize) -> bool,
    ) -> f64 {
        let exact = (self.forces)(tissues, &widened(u));
        let off: Vec<_> = (forces(scene, u).iter().zip(&exact))
            // The kernel has external less internal forces on the nodes, the definition those of the elements on the
            // nodes.
            .map(|(of_kernel, exact)| [0, 1, 2].map(|axis| of_kernel[axis] - exact[axis]))
            .collect();
        norm_where(&off, &wanted) / norm_where(&exact, &wanted)
    }

    /// Forces and energy of the kernel are those of the definition from rounding to inverted elements, and not those of
    /// the linear element. `small_bar`, one tissue.
    pub(crate) fn check_forces<M: ElementMaterial, L: ElementMaterial>(
        &self,
        (name, law): (&str, Law),
        scene: &VecScene<M>,
        linear: &VecScene<L>,
    ) {
        let body = small_bar();
        let mesh = body.reference();
        let tissues = Tissues { mesh: &mesh, laws: &[law], of_element: &vec![0; mesh.tets.len()] };
        for size in [1e-6, 4e-4, 6e-3] {
            let u = noise(&body, size, 7);
            let error = self.error(&tissues, scene, &u, |_| true);
            let of_kernel = tled::strain_energy(scene, &mut displaced(scene, &u)).expect("room");
            let of_energy = of_kernel / (self.energy)(&tissues, &widened(&u)) - 1.0;
            let inverted = inverted(&body, &u);
            println!("{name}, {size} m, {inverted} inverted: forces {error:.1e}, energy {of_energy:.1e}");
            assert!(error < 1e-5 && of_energy.abs() < 2e-6);
            assert!(size < 5e-3 || inverted > 10);
            let of_linear = self.error(&tissues, linear, &u, |_| true);
            println!("{name}, {size} m: forces of the linear element {of_linear:.1e}");
            // In inverted elements the exponential of the distortion leaves no digit for the pressure.
            assert!(inverted > 0 || of_linear > 0.01);
        }
    }

    /// Forces of several tissues in `small_bar`, of which each has means of its own at every node.
    pub(crate) fn check_tissues<M: ElementMaterial>(&self, laws: &[Law], of_element: &[u16], scene: &VecScene<M>) {
        let body = small_bar();
        let mesh = body.reference();
        let wide: Vec<usize> = of_element.iter().map(|&tissue| tissue.into()).collect();
        let tissues = Tissues { mesh: &mesh, laws, of_element: &wide };
        let error = self.error(&tissues, scene, &noise(&body, 4e-4, 3), |_| true);
        println!("{} tissues: forces {error:.1e}", laws.len());
        assert!(error < 1e-5);
    }

    /// Elements between the fixed nodes of [`mostly_held`] are left out only where they count in no mean that can
    /// change.
    pub(crate) fn check_left_out<M: ElementMaterial>(&self, law: Law, scene: &VecScene<M>) {
        let (body, supports) = mostly_held();
        let mesh = body.reference();
        let mut free = vec![true; body.points.len()];
        supports.iter().for_each(|support| free[support.node as usize] = false);
        let mut u = noise(&body, 4e-4, 9);
        u.iter_mut().zip(&free).filter(|(_, free)| !**free).for_each(|(u, _)| *u = [0.0; 3]);
        let tissues = Tissues { mesh: &mesh, laws: &[law], of_element: &vec![0; mesh.tets.len()] };
        let error = self.error(&tissues, scene, &u, |node| free[node]);
        println!("{} of {} elements: forces {error:.1e}", scene.element_count(), mesh.tets.len());
        assert!(scene.element_count() < mesh.tets.len() && error < 1e-5);
    }
}

/// A bar of which most is held.
pub(crate) fn mostly_held() -> (Body, Vec<Support>) {
    let body = small_bar();
    let (low, high) = body.extent(2);
    let supports = fixed(&body.nodes_where(|[_, _, z]| z < low + 0.6 * (high - low)));
    (body, supports)
}

/// The body of the patch test.
pub(crate) fn irregular() -> Body {
    Body::irregular([0.05, 0.05, 0.1], [4, 4, 8])
}

/// Displacements of [`irregular`] in a general homogeneous deformation, and in the same one turned, m.
pub(crate) fn homogeneous() -> [Vec<[f32; 3]>; 2] {
    let general: Mat3 = [[1.1, 0.15, -0.1], [-0.05, 0.9, 0.2], [0.1, -0.15, 1.1]];
    let turned = product(&rotation([1.0, 2.0, -1.0], 1.0), &general);
    [general, turned].map(|f| irregular().affine(&f, [0.0; 3]))
}

/// A homogeneous deformation of [`irregular`] gives inner nodes no force. Gives the forces, N.
pub(crate) fn check_patch<M: ElementMaterial>(name: &str, scene: &VecScene<M>, u: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let on_surface = irregular().surface_nodes();
    let forces = forces(scene, u);
    let ratio = norm_where(&forces, |node| !on_surface[node]) / norm_where(&forces, |node| on_surface[node]);
    println!("{name}: inner over surface force {ratio:.1e}");
    assert!(ratio < 1e-5);
    forces
}

/// A rigid motion of [`irregular`] gives no forces compared with those of a deformation, for a law without stress at
/// rest.
pub(crate) fn check_rigid<M: ElementMaterial>(name: &str, scene: &VecScene<M>, of_deformation: &[[f64; 3]]) {
    let moved = irregular().affine(&rotation([0.3, -1.0, 0.8], 1.5), [0.02, -0.01, 0.03]);
    let ratio = norm(&forces(scene, &moved)) / norm(of_deformation);
    println!("{name}: rigid motion {ratio:.1e}");
    assert!(ratio < 1e-5);
}

/// The law of the silicone beam (E 263,824 Pa, nu 0.499), and a softer one of nu 0.25.
pub(crate) fn of_critical_steps() -> [NeoHookean; 2] {
    let (young, nu) = (263_824.0, 0.499);
    let (c, d) = (young / (4.0 * (1.0 + nu)), young / (6.0 * (1.0 - 2.0 * nu)));
    [NeoHookean { c: c as f32, d: d as f32 }, NeoHookean { c: 500.0, d: 1_000.0 }]
}

/// Bodies whose critical steps are bounded.
pub(crate) fn of_bounds() -> [(&'static str, Body); 5] {
    [
        ("beam", Body::bar([0.03, 0.03, 0.1], [4, 4, 13])),
        ("irregular bar", irregular()),
        ("slivers", Body::slivers([0.04, 0.04, 0.04])),
        ("lobe", Body::lobe()),
        ("cylinder", Body::cylinder()),
    ]
}

/// The bound of the critical step is never above the exact one, in a body at rest and in random states, and not below
/// its `least` share (a function of the noise).
pub(crate) fn check_bounds<M: ElementMaterial>(
    (name, body): (&str, &Body),
    scene: &VecScene<M>,
    least: impl Fn(f64) -> f64,
) {
    let size = f64::from(body.extent(0).1 - body.extent(0).0);
    for share in [0.0, 0.005, 0.05] {
        let state = displaced(scene, &noise(body, share * size, 4));
        let bound = f64::from(support::bound(scene, &state).seconds);
        let exact = tled::exact_critical_step(scene.view(), state.displacements()).expect("it settles");
        println!("{name}, noise {share}: bound {:.3} of exact {exact:.3e} s", bound / exact);
        assert!(bound <= exact && bound > least(share) * exact);
    }
}

/// Without damping a body stays bounded at 0.98 of the exact critical step and does not at 1.02.
pub(crate) fn check_limit_of_stability<M: ElementMaterial>(scene: &VecScene<M>) {
    let exact = tled::exact_critical_step(scene.view(), rest_of(scene).displacements()).expect("it settles");
    let stable_at = |share: f64| {
        let step = Step::unchecked((share * exact) as f32, 0.0).unwrap();
        let mut state = rest_of(scene);
        let kick = |node: usize| ([0.0; 3], if node.is_multiple_of(3) { [1e-5, -1e-5, 2e-5] } else { [0.0; 3] });
        assert!(tled::start(scene, &mut state, &step, kick));
        (0..20_000).all(|_| tled::step(scene, &Loads::NONE, &mut state, &step) == Status::Ok)
    };
    println!("exact critical step {exact:.3e} s");
    assert!(stable_at(0.98) && !stable_at(1.02));
}

/// 100,000 steps without damping keep the energy of a body that swings.
pub(crate) fn check_drift<M: ElementMaterial>(body: &Body, scene: &VecScene<M>) {
    let mut state = rest_of(scene);
    let step = Step::unchecked(0.5 * support::bound(scene, &state).seconds, 0.0).unwrap();
    let (low, _) = body.extent(2);
    let swing = |node: usize| ([0.0; 3], [0.3 * (body.points[node][2] - low), 0.0, 0.0]);
    assert!(tled::start(scene, &mut state, &step, swing));
    let start = state.energy_balance().start;
    support::run(scene, &Loads::NONE, &mut state, &step, 100_000);
    let end = state.energy_balance().kinetic + tled::strain_energy(scene, &mut state).expect("room");
    println!("energy {start:.6e} J at the start, {end:.6e} J after {} steps", state.steps());
    assert!((end / start - 1.0).abs() < 1e-3);
}

/// The bar whose steps are taken in parts, its supports, and a second tissue for every fifth element.
pub(crate) fn in_parts() -> (Body, Vec<Support>, Vec<u16>) {
    let body = Body::bar([0.05, 0.05, 0.2], [8, 8, 20]);
    let of_element = (0..body.tets.len()).map(|element| u16::from(element.is_multiple_of(5))).collect();
    let supports = held(&body);
    (body, supports, of_element)
}

/// Any number of parts on threads gives the same bits: bits after fifty steps under gravity.
pub(crate) fn same_bits_in_parts<M: ElementMaterial>(scene: &VecScene<M>) -> Vec<u64> {
    let state = rest_of(scene);
    let step = Step::unchecked(0.5 * support::bound(scene, &state).seconds, 5.0).unwrap();
    same_bits_in_parts_from(scene, &state, &step)
}

/// The same from a state.
pub(crate) fn same_bits_in_parts_from<M: ElementMaterial>(
    scene: &VecScene<M>,
    state: &VecState,
    step: &Step,
) -> Vec<u64> {
    let one = after_fifty_steps(scene, state, step, 1);
    for parts in [2, 3, 5] {
        assert!(after_fifty_steps(scene, state, step, parts) == one, "{parts} parts");
    }
    one
}

fn after_fifty_steps<M: ElementMaterial>(scene: &VecScene<M>, state: &VecState, step: &Step, parts: usize) -> Vec<u64> {
    let mut state = state.clone();
    let loads = Loads::new(scene, [3.0, 0.0, -9.81], &[], &[]).unwrap();
    for _ in 0..50 {
        let status = tled::step_in_parts(scene.view(), &loads, state.view(), step, &Backwards::new(parts));
        assert!(status.is_taken(), "{status:?}");
    }
    bits(&state)
}
