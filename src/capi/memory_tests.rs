//! A host in memory that is exactly as large as it must be: every kind of object, and every function that reads or
//! writes through pointers. For Miri, which checks each access, its alignment and what else may use that memory:
//!
//! ```sh
//! cargo +nightly miri test -p supple --lib --features capi,std,libm/force-soft-floats capi::
//! ```
//!
//! Square roots in software, because Miri knows no assembler.

use core::ffi::c_void;
use core::ptr::{null, null_mut};
use std::vec;
use std::vec::Vec;

use super::SUPPLE_ABI;
use super::contact::*;
use super::fibres::*;
use super::guard::*;
use super::large::*;
use super::learned::*;
use super::loads::*;
use super::prony::*;
use super::saved::*;
use super::scene::*;
use super::state::*;
use super::status::*;
use super::step::*;
use super::surface::*;
use super::vectors::*;
use crate::mesh::Bar;
use supple_status::*;

const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [2, 2, 3] };
const NODES: u32 = BAR.node_count() as u32;
const ELEMENTS: u32 = BAR.element_count() as u32;

#[derive(Clone, Copy)]
#[repr(align(64))]
struct Line([u8; 64]);

/// Memory at a multiple of 64 bytes.
struct Memory(Vec<Line>);

impl Memory {
    fn new(bytes: usize) -> Self {
        assert_eq!(bytes % 64, 0);
        Self(vec![Line([0xa5; 64]); bytes / 64])
    }

    fn of(content: &[u8]) -> Self {
        let mut memory = Self(vec![Line([0; 64]); content.len().div_ceil(64)]);
        for (line, bytes) in memory.0.iter_mut().zip(content.chunks(64)) {
            line.0[..bytes.len()].copy_from_slice(bytes);
        }
        memory
    }

    fn at(&mut self) -> *mut c_void {
        self.0.as_mut_ptr().cast()
    }

    const fn bytes(&self) -> usize {
        64 * self.0.len()
    }
}

const fn size<T>() -> u32 {
    size_of::<T>() as u32
}

/// Threads that compute the last part first, one of them twice, and leave out the rest.
unsafe extern "C" fn each(_: *mut c_void, part: supple_part, work: *const c_void, parts: u32) {
    for number in [parts - 1, parts - 1, 0] {
        // SAFETY: as the step asks for.
        unsafe { part(work, number) };
    }
}

fn scene(element: u32, prony: &[supple_prony], fibres: &[supple_fibres]) -> Memory {
    let points: Vec<_> = BAR.points().collect();
    let tets: Vec<_> = BAR.tets().collect();
    let mut supports: Vec<_> = (0..9).map(|node| supple_support { node, axes: 7, moves: 0 }).collect();
    supports.push(supple_support { node: NODES - 1, axes: 7, moves: 1 });
    let tissues = [supple_tissue { constants: [59.0, 8.023, 60_000.0, 0.0], density: 1000.0 }; 2];
    let of_element: Vec<_> = (0..ELEMENTS).map(|element| (element % 2) as u16).collect();
    let directions = [[0.0_f32, 0.0, 2.0, 1.0, 0.0, 0.0]; ELEMENTS as usize];
    let config = supple_scene_config {
        struct_size: size::<supple_scene_config>(),
        abi: SUPPLE_ABI,
        law: 1,
        winding: 0,
        nodes: NODES,
        elements: ELEMENTS,
        supports: supports.len() as u32,
        tissues: 2,
        points: points.as_ptr().cast(),
        tetrahedra: tets.as_ptr().cast(),
        support: supports.as_ptr(),
        tissue: tissues.as_ptr(),
        tissue_of_element: of_element.as_ptr(),
        element,
        reserved: 0,
        removed: core::ptr::null(),
        prony: if prony.is_empty() { null() } else { prony.as_ptr() },
        fibres: if fibres.is_empty() { null() } else { fibres.as_ptr() },
        directions: if fibres.is_empty() { null() } else { directions.as_ptr().cast() },
    };
    let patches = if element == SUPPLE_NODAL_STRAIN { supple_patches_size(NODES, ELEMENTS, 2) } else { 0 };
    let series = if prony.is_empty() { 0 } else { supple_prony_size(2) };
    let of_fibres = if fibres.is_empty() { 0 } else { supple_fibres_size(NODES, ELEMENTS, 2, element) };
    let mut memory = Memory::new(supple_scene_size(NODES, ELEMENTS, 2) + patches + series + of_fibres);
    let (mut made, mut error) = (null_mut(), supple_error::NONE);
    let (at, bytes) = (memory.at(), memory.bytes());
    // SAFETY: all memory is there, here and below.
    unsafe {
        assert_eq!(supple_scene_init(at, 64, &config, &mut made, &mut error), SUPPLE_E_SHORT);
        assert_eq!(supple_scene_init(at, bytes, &config, &mut made, null_mut()), SUPPLE_OK);
    }
    assert_eq!(made.cast(), memory.at());
    memory
}

/// All kinds of steps of a scene of these elements, whose two tissues relax or have fibres, or neither.
fn host(element: u32, network: &[u8], prony: &[supple_prony], fibres: &[supple_fibres]) {
    let points: Vec<_> = BAR.points().collect();
    let points: *const f32 = points.as_ptr().cast();
    let (mut scene_memory, mut network) = (scene(element, prony, fibres), Memory::of(network));
    let scene: *const supple_scene = scene_memory.at().cast_const().cast();
    let relaxation = supple_relaxation_size(NODES, ELEMENTS, 2, element, prony.len() as u32);
    let mut state_memory = Memory::new(supple_state_size(NODES, element) + relaxation);
    let mut loads_memory = Memory::new(supple_loads_size(2, 1));
    let (mut state, mut loads) = (null_mut(), null_mut());
    let mut report = supple_report::NOTHING;
    let threads = supple_threads { context: null_mut(), parts: 4, each: Some(each) };
    // SAFETY: as above.
    unsafe {
        let (at, bytes) = (state_memory.at(), state_memory.bytes());
        assert_eq!(supple_state_init(at, bytes, scene, &mut state), SUPPLE_OK);
        let (at, bytes) = (loads_memory.at(), loads_memory.bytes());
        assert_eq!(supple_loads_init(at, bytes, scene, 2, 1, &mut loads), SUPPLE_OK);
        assert_eq!(supple_set_gravity(loads, [0.0, 0.0, -9.81].as_ptr()), SUPPLE_OK);
        let force = supple_force { node: NODES - 2, newton: [1e-3; 3], ramp: 0.0 };
        assert_eq!(supple_set_forces(loads, [force, force].as_ptr(), 2, null_mut()), SUPPLE_OK);
        let motion = supple_motion { node: NODES - 1, axes: 7, metre: [1e-7; 3], ramp: 0.0 };
        assert_eq!(supple_set_motions(loads, scene, &motion, 1, null_mut()), SUPPLE_OK);
        let step = supple_step_config {
            struct_size: size::<supple_step_config>(),
            abi: SUPPLE_ABI,
            seconds: 3e-5,
            damping: 20.0,
        };
        assert_eq!(supple_set_step(scene, state, &step, null_mut()), SUPPLE_OK);
        assert!(supple_step(scene, loads, state, 2, &threads, &mut report) as i32 >= 0);
        assert_eq!(supple_step(state.cast_const().cast(), loads, state, 2, null(), null_mut()), SUPPLE_E_KIND);

        // Out, and back from an odd address.
        let mut vectors = supple_vectors { first: null(), stride: 0, count: 0 };
        assert_eq!(supple_displacements(state, &mut vectors), SUPPLE_OK);
        assert!(vectors.first.byte_add(vectors.stride * (NODES as usize - 1)).read().is_finite());
        let mut out = vec![0.0f32; 3 * NODES as usize];
        for copy in [supple_copy_displacements, supple_copy_velocities, supple_copy_forces] {
            assert_eq!(copy(state, out.as_mut_ptr(), out.len()), SUPPLE_OK);
            assert_eq!(copy(state, out.as_mut_ptr(), out.len() - 1), SUPPLE_E_SHORT);
        }
        assert_eq!(supple_copy_positions(state, points, out.as_mut_ptr(), out.len()), SUPPLE_OK);
        let mut saved_size = 0;
        assert_eq!(supple_state_saved_size(state, &mut saved_size), SUPPLE_OK);
        let mut saved = vec![0u8; saved_size + 1];
        let odd = saved.as_mut_ptr().add(1).cast::<c_void>();
        assert_eq!(supple_save(state, odd, saved.len() - 1), SUPPLE_OK);
        assert_eq!(supple_restore(state, odd, saved.len() - 1), SUPPLE_OK);
        assert_eq!(supple_restore(state, odd, saved.len() - 2), SUPPLE_E_SHORT);

        let config = supple_large_config {
            struct_size: size::<supple_large_config>(),
            abi: SUPPLE_ABI,
            seconds: 1e-3,
            damping: 20.0,
            cells: [1, 1, 1],
        };
        let (mut needed, mut large) = (0, null_mut());
        assert_eq!(supple_large_size(scene, points, &config, &mut needed, null_mut()), SUPPLE_OK);
        let mut memory = Memory::new(needed);
        let made = supple_large_init(memory.at(), needed, scene, state, points, &config, &mut large, null_mut());
        assert_eq!(made, SUPPLE_OK);
        assert!(supple_large_step(scene, loads, state, large, 2, &threads, &mut report) as i32 >= 0);

        let config = supple_guard_config {
            struct_size: size::<supple_guard_config>(),
            abi: SUPPLE_ABI,
            seconds: 3e-5,
            damping: 20.0,
            every: 3,
            tolerance: 0.0,
        };
        let (mut needed, mut guard) = (0, null_mut());
        assert_eq!(supple_guard_size(scene, points, &mut needed, null_mut()), SUPPLE_OK);
        let mut memory = Memory::new(needed);
        let made = supple_guard_init(memory.at(), needed, scene, state, points, &config, &mut guard, null_mut());
        assert_eq!(made, SUPPLE_OK);
        assert!(supple_step(scene, loads, state, 1, null(), null_mut()) as i32 >= 0);
        let mut estimate = supple_estimate { known: 7, node: 0, mean: 0.0, largest: 0.0, allowed: 0.0 };
        assert!(supple_guard_follow(scene, loads, state, guard, &threads, &mut estimate) as i32 >= 0);
        assert_eq!(estimate.known, 1);

        let mut memory = Memory::new(supple_contact_size(NODES, 1, 16));
        let (at, bytes, mut contact) = (memory.at(), memory.bytes(), null_mut());
        let corners = [0, 1, 2];
        let surface =
            supple_surface { nodes: null(), triangles: corners.as_ptr(), node_count: NODES, triangle_count: 1 };
        let made = supple_contact_init(at, bytes, scene, points, &surface, 16, &mut contact, null_mut());
        assert_eq!(made, SUPPLE_OK);
        let pose = supple_pose { position: [-0.0079, 0.01, 0.04 / 3.0], rotation: [0.0; 4] };
        let ball = supple_instrument {
            shape: SUPPLE_SPHERE,
            radius: 0.008,
            length: 0.0,
            friction: 0.3,
            pose,
            field: null(),
            field_bytes: 0,
        };
        assert_eq!(supple_set_instruments(contact, &ball, 1, null_mut()), SUPPLE_OK);
        assert_eq!(supple_set_contact(loads, contact), SUPPLE_OK);
        let mut held = 0;
        assert_eq!(supple_grasp(contact, state, 0, 0.002, &mut held), SUPPLE_OK);
        assert!(held > 0);
        assert!(supple_step(scene, loads, state, 2, &threads, &mut report) as i32 >= 0);
        assert_eq!(supple_let_go(contact, 0), SUPPLE_OK);
        assert!(supple_step(scene, loads, state, 1, null(), &mut report) as i32 >= 0);
        let mut touch = core::mem::MaybeUninit::uninit();
        assert_eq!(supple_read_touch(contact, 0, touch.as_mut_ptr()), SUPPLE_OK);
        let (mut point, mut count) = (core::mem::MaybeUninit::uninit(), 7);
        assert_eq!(supple_contact_points(contact, point.as_mut_ptr(), 1, &mut count), SUPPLE_OK);
        assert!(count <= 1);
        assert_eq!(supple_set_contact(loads, null_mut()), SUPPLE_OK);

        let config = supple_learned_config {
            struct_size: size::<supple_learned_config>(),
            abi: SUPPLE_ABI,
            fallback: 1,
            reserved: 0,
            weights: network.at(),
            weights_bytes: network.bytes(),
        };
        let mut memory = Memory::new(supple_learned_size(NODES, 1));
        let (at, bytes, mut learned) = (memory.at(), memory.bytes(), null_mut());
        assert_eq!(supple_learned_init(at, bytes, scene, &config, &mut learned, null_mut()), SUPPLE_OK);
        assert_eq!(supple_state_reset(state), SUPPLE_OK);
        let led = supple_learned_lead(scene, loads, state, learned, 3e-4, &threads, &mut report);
        assert!(led as i32 >= 0, "{led:?}");
        let stepped = supple_learned_step(scene, loads, state, learned, 2, &threads, &mut report);
        assert!(if prony.is_empty() { stepped as i32 >= 0 } else { stepped == SUPPLE_FELL_BACK }, "{stepped:?}");
    }
}

const NETWORK: &[u8] = include_bytes!("../../weights/compact-10.weights");

#[test]
fn a_host_of_nodal_pressure_stays_within_its_memory() {
    host(SUPPLE_NODAL_PRESSURE, NETWORK, &[], &[]);
}

#[test]
fn a_host_of_nodal_strain_stays_within_its_memory() {
    host(SUPPLE_NODAL_STRAIN, NETWORK, &[], &[]);
}

#[test]
fn a_host_of_linear_tetrahedra_stays_within_its_memory() {
    host(SUPPLE_LINEAR, NETWORK, &[], &[]);
}

#[test]
fn a_host_of_tissue_that_relaxes_stays_within_its_memory() {
    let prony = [
        supple_prony { share: [0.5, 0.0, 0.2], seconds: [0.01, 0.0, 1.0] },
        supple_prony { share: [0.0; 3], seconds: [0.0; 3] },
    ];
    for element in [SUPPLE_LINEAR, SUPPLE_NODAL_STRAIN] {
        host(element, NETWORK, &prony, &[]);
    }
}

#[test]
fn a_host_of_tissue_with_fibres_stays_within_its_memory() {
    let none = [0.0; 2];
    let fibres = [
        supple_fibres { fibres: [1e3, 10.0], sheets: [5e2, 8.0], coupling: none },
        supple_fibres { fibres: none, sheets: none, coupling: none },
    ];
    for element in [SUPPLE_LINEAR, SUPPLE_NODAL_STRAIN] {
        host(element, NETWORK, &[], &fibres);
    }
}
