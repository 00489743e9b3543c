//! `supple` moves soft tissue in real time. Software for image-guided interventions hands it a tetrahedral
//! mesh of an organ, its material, supports and loads, and calls one step function as often as it needs.
//! SI units throughout (m, kg, s, N, Pa, J).
//!
//! # A scene in motion
//!
//! A soft bar, fixed at one end, bent by a force at the other, on a host with a heap (feature `std`):
//!
#![cfg_attr(feature = "std", doc = "```")]
#![cfg_attr(not(feature = "std"), doc = "```ignore")]
//! use supple::loads::NodalForce;
//! use supple::material::{Element, NeoHookean, VecMaterial};
//! use supple::{mesh::Bar, scene::Support, simulation::Simulation};
//!
//! let bar = Bar { size: [0.02, 0.02, 0.1], cells: [2, 2, 10] };
//! let tissue = VecMaterial::one(Element::NodalStrain, NeoHookean { c: 500.0, d: 25_000.0 }, 1000.0);
//! let fixed: Vec<_> = (0..9).map(Support::fixed).collect();
//! let tip = bar.node(1, 1, 10);
//! let mut bent = Simulation::new(bar.points(), bar.tets(), tissue, &fixed)?;
//! bent.forces = vec![NodalForce { node: tip, newton: [0.01, 0.0, 0.0], ramp: 0.1 }];
//! let report = bent.advance(0.2)?;
//! println!("{:?}: the tip moved {:.2} mm", report.status, 1e3 * bent.displacements()[tip as usize].to_array()[0]);
//! # assert!(report.is_ok() && bent.displacements()[tip as usize].to_array()[0] > 0.003);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! These are exact steps ([`tled`]), no longer than the critical step. **Long steps** ([`inertia`]) are twenty times as long, and a
//! guard estimates their error:
//!
#![cfg_attr(feature = "std", doc = "```")]
#![cfg_attr(not(feature = "std"), doc = "```ignore")]
#![doc = include_str!("doc_bar.txt")]
//! use supple::inertia::{self, Cells};
//! use supple::simulation::{Method, Settings};
//!
//! let method = Method::Long(inertia::Method::new(Cells::Given([1, 1, 4])));
//! let mut bent = at_rest.with(Settings { method, damping: 20.0, ..Settings::default() });
//! let report = bent.advance(0.2)?;
//! if let Some(estimate) = report.estimate {
//!     println!("off by at most about {:.3} mm on average", 1e3 * estimate.mean);
//! }
//! # assert!(report.estimate.is_some() && bent.displacements()[94].to_array()[0] > 0.003);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! With [`Method::Auto`](simulation::Method) their length is chosen for a tolerance. **Learned steps** ([`learned`]) follow a lead-in of
//! exact ones, which take their place for a while if energy or the guard does not believe what the network does:
//!
#![cfg_attr(feature = "std", doc = "```")]
#![cfg_attr(not(feature = "std"), doc = "```ignore")]
#![doc = include_str!("doc_bar.txt")]
//! use supple::mlp::{Network, WeightBytes};
//! use supple::simulation::{Method, Settings};
//!
//! # let read = |_| include_bytes!("../weights/compact-10.weights");
//! let bytes = WeightBytes::of(read("weights/compact-10.weights"));
//! let method = Method::Learned { network: Network::parse(bytes.bytes())?, lead_in: 0.3, fallback: true };
//! let mut bent = at_rest.with(Settings { method, ..Settings::default() });
//! let report = bent.advance(0.5)?;
//! println!("{} exact and {} learned steps, fell back: {}", report.exact, report.learned, report.fell_back);
//! # assert!(report.learned > 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Below it the parts can be used by themselves, typed, and without a heap: the scene is then a [`scene::FixedScene`], the state a
//! [`state::FixedState`], what long and learned steps keep an array, all of which may be `static`, and [`simulation::Mover`] the loop. The
//! same bar:
//!
#![cfg_attr(feature = "std", doc = "```")]
#![cfg_attr(not(feature = "std"), doc = "```ignore")]
#![doc = include_str!("doc_common.txt")]
//! let step = Step::new(0.9 * critical.seconds, 20.0, critical)?;
//! while state.time() < 0.2 {
//!     assert_eq!(tled::step(&scene, &loads, &mut state, &step), Status::Ok);
//! }
//! # assert!(state.displacements()[94].to_array()[0] > 0.003);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Layers
//!
//! A module uses only those that stand before it in this table. The exceptions: [`contact`] has the moment of a state
//! (`state::Progress`) and the size of a response of [`inertia`]; documentation points anywhere.
//!
//! | module | what it holds |
//! |---|---|
//! | [`simd`] | one generic body for every instruction set |
//! | [`mesh`] | a checked tetrahedral mesh, borrowed from the caller; renumbering, strips, partitions |
//! | [`material`] | hyperelastic laws: two scalar functions of the invariants each |
//! | [`element`] | tetrahedra (linear, nodal pressure, nodal strain): deformation, internal forces, stiffness bounds |
//! | [`scene`] | what is simulated, computed once: element tables, masses, supports |
//! | [`contact`] | rigid instruments that touch the tissue, and what they feel |
//! | [`pulls`] | forces that draw points of the tissue to targets; supports that give way |
//! | [`state`] | what moves: displacements and their last increment |
//! | [`loads`] | what acts on it, set when the host likes: forces, traction, gravity, prescribed motion, instruments |
//! | [`pressure`] | pressure that follows the surface |
//! | [`mlp`] | dense layers: the forward pass, the weight file |
//! | [`plausibility`] | does a scene look as if a unit was mistaken |
//! | [`step`] | the protocol of every step: begin, compute, energy balance, accept or refuse; threads |
//! | [`tled`] | the exact step and the critical step |
//! | [`reaction`] | the force by which supports act on the tissue, also in long steps |
//! | [`inertia`] | long steps, beyond the critical one |
//! | [`guard`] | may a step be believed: a second run that estimates its error |
//! | [`adaptive`] | steps that choose their length so that their error stays below a tolerance |
//! | [`learned`] | the learned step with lead-in and fallback; the local frame of a vertex |
//! | [`points`] | points that follow the tissue: tumours, vessels, finer surfaces, targets |
//! | [`image`] | displacement fields on the grid of an image, forward and inverse |
//! | [`simulation`] | one owner of all that: scene, state, loads, method, guard, fallback, pace |
//!
//! With the feature `io` meshes are read and fields written (`io`), with `train` networks are trained (`train`), with
//! `safetensors` they go to and from PyTorch, with `capi` there are the functions of `include/supple.h`. Packages of their own are
//! the command `supple` and the laboratory `supple-lab`, where methods are judged against the exact step over scenes.
//!
//! # Promises
//!
//! The core, which is what no feature gives, is `no_std`, never allocates, and does not panic on any input
//! through its public API. Memory is the caller's; too little is an error. An exact or learned step does the same
//! work every time, one beyond the critical step at most a bounded amount: it renews its bounds the sooner, the faster tissue deforms. A step says
//! what became of it ([`step::Status`]); one that cannot be believed is not taken. The same
//! input gives the same bits from run to run and for any number of threads; with the feature `deterministic`, which fuses no
//! multiplications and additions, on every processor. What a scene does not use costs it nothing: no exponential is linked into a
//! neo-Hookean scene, elements whose four nodes are fixed are left out.
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

pub mod adaptive;
#[cfg(feature = "capi-neo-hookean")]
mod capi;
mod checksum;
pub mod contact;
mod copy;
pub mod element;
mod energy_balance;
pub mod guard;
mod heap_sort;
mod held_pulls;
pub mod image;
pub mod inertia;
pub mod learned;
pub mod loads;
pub mod material;
pub mod mesh;
pub mod mlp;
mod padding;
pub mod plausibility;
pub mod points;
pub mod pressure;
pub mod pulls;
pub mod reaction;
/// Of the tests, in float64.
#[cfg(test)]
#[path = "../tests/reference/mod.rs"]
mod reference;
mod scattered;
pub mod scene;
pub mod simd;
pub mod simulation;
pub mod state;
pub mod step;
pub mod tled;

#[cfg(feature = "io")]
pub mod io;

#[cfg(feature = "train")]
pub mod train;

/// A library for hosts without Rust's standard library has to say what a panic does. The core has none to
/// raise; this is for what the compiler cannot prove.
#[cfg(all(feature = "panic-handler", not(any(feature = "std", test))))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
