//! `supple` moves soft tissue in real time. Software for image-guided interventions hands it a tetrahedral
//! mesh of an organ, its material, supports and loads, and calls one step function as often as it needs.
//! SI units throughout (m, kg, s, N, Pa, J).
//!
//! # Layers
//!
//! Data flows one way; nothing below knows what is above.
//!
//! | module | what it holds |
//! |---|---|
//! | [`mesh`] | a checked tetrahedral mesh, borrowed from the caller; the structured bar |
//! | [`material`] | hyperelastic laws: two scalar functions of the invariants each |
//! | [`scene`] | what is simulated, computed once: element tables, masses, supports |
//! | [`loads`] | what acts on it, set when the host likes: forces, traction, gravity, prescribed motion |
//! | [`state`] | what moves: displacements and their last increment |
//! | [`tled`] | the exact step: element forces, central differences, critical step, divergence |
//! | [`inertia`] | steps beyond the limit: mass scaling and multilevel inertia |
//! | [`frame`] | the local frame of a vertex and its parallel transport |
//! | [`mlp`] | dense layers: the forward pass, the weight file |
//! | [`surrogate`] | the learned step: features, network, clip, increment |
//! | [`lanes`] | one generic body for every instruction set |
//! | [`threads`] | who computes a step: the host's threads, rayon's (feature `parallel`), or the caller alone |
//! | [`numbering`] | numbers for nodes by where they are |
//!
//! With the feature `io` meshes are read and fields written (`io`), with `lab` methods are judged against the
//! exact step over scenes (`lab`), with `train` networks are trained (`train`), with `safetensors` they go to and from
//! PyTorch, with `cli` there is the command `supple`, with `capi` the functions of `include/supple.h`.
//!
//! # Promises
//!
//! The core (`default-features = false`) is `no_std`, never allocates, and does not panic on any input
//! through its public API. Memory is the caller's: capacity is in the type ([`scene::FixedScene`],
//! [`state::FixedState`]), in slices or in vectors; too little is an error. A step does the same work every
//! time and says what became of it ([`tled::Status`]); one that cannot be believed is not taken. The same
//! input gives the same bits from run to run and for any number of threads; with the feature `deterministic`, which fuses no multiplications and
//! additions, on every processor. What a scene does not use costs it nothing: no exponential is linked into a
//! neo-Hookean scene, elements whose four nodes are fixed are left out.
//!
//! # Example
//!
//! A soft bar, fixed at one end, bent by a force at the other.
//!
//! ```
//! use supple::loads::{Loads, NodalForce};
//! use supple::material::{NeoHookean, Tissue};
//! use supple::mesh::{Bar, Mesh, Winding};
//! use supple::scene::{FixedScene, Support, blocks_for};
//! use supple::state::FixedState;
//! use supple::tled::{self, Status, Step};
//!
//! const BAR: Bar = Bar { size: [0.02, 0.02, 0.1], cells: [2, 2, 10] };
//! const NODES: usize = BAR.node_count();
//! const ELEMENTS: usize = BAR.element_count();
//!
//! // All memory there will ever be; it may as well stand in a `static`.
//! let tissue = Tissue { law: NeoHookean { c: 500.0, d: 25_000.0 }, density: 1000.0 };
//! let mut scene: FixedScene<_, NODES, { blocks_for(ELEMENTS) }> = FixedScene::new(tissue);
//! let mut state: FixedState<NODES> = FixedState::new();
//!
//! // The mesh usually comes from elsewhere.
//! let points: heapless::Vec<[f32; 3], NODES> = BAR.points().collect();
//! let tets: heapless::Vec<[u32; 4], ELEMENTS> = BAR.tets().collect();
//! let mesh = Mesh::new(&points, &tets, Winding::Checked)?;
//! let fixed: heapless::Vec<Support, 9> = (0..9).map(Support::fixed).collect();
//! scene.build(&mesh, &fixed)?;
//!
//! let tip = NodalForce { node: BAR.node(1, 1, 10), newton: [0.01, 0.0, 0.0], ramp: 0.1 };
//! let forces = [tip];
//! let loads = Loads::new(&scene, [0.0; 3], &forces, &[])?;
//!
//! let critical = tled::critical_step(&scene, &mut state).ok_or("not a finite state")?;
//! let step = Step::new(0.9 * critical.seconds, 20.0, critical)?;
//! while state.time() < 0.2 {
//!     match tled::step(&scene, &loads, &mut state, &step) {
//!         Status::Ok => {}
//!         other => panic!("{other:?}"),
//!     }
//! }
//! let [x, _, _] = state.displacements()[tip.node as usize].to_array();
//! println!("the tip moved {:.2} mm", x * 1e3);
//! assert!(x > 0.003);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Sources
//!
//! - Meister et al. 2018, "Towards Fast Biomechanical Modeling of Soft Tissue Using Neural Networks": the
//!   laws, the bar, the loads; called "the paper" in these pages.
//! - Miller et al. 2007, "Total Lagrangian explicit dynamics finite element algorithm for computing soft
//!   tissue deformation": the exact step.
//! - Holzapfel & Ogden 2009, "Constitutive modelling of passive myocardium": the exponential law.
#![cfg_attr(not(test), no_std)]

#[cfg(any(feature = "std", test))]
extern crate std;

#[cfg(feature = "capi-neo-hookean")]
mod capi;
mod chains;
mod chunks;
pub mod frame;
pub mod inertia;
pub mod lanes;
mod ledger;
pub mod loads;
pub mod material;
pub mod mesh;
pub mod mlp;
pub mod numbering;
pub mod scene;
pub mod state;
pub mod surrogate;
mod symmetric;
pub mod threads;
pub mod tled;

#[cfg(feature = "io")]
pub mod io;
#[cfg(feature = "lab")]
pub mod lab;

#[cfg(feature = "train")]
pub mod train;

pub use ledger::Ledger;

/// A library for hosts without Rust's standard library has to say what a panic does. The core has none to
/// raise; this is for what the compiler cannot prove.
#[cfg(all(feature = "panic-handler", not(any(feature = "std", test))))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
