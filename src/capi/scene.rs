//! What is simulated, for C: built once from the host's mesh, read only from then on.

use core::ffi::c_void;

#[cfg(feature = "capi")]
use crate::material::Exponential;
use crate::material::{Law, Laws, Material, NeoHookean, Tissue};
use crate::mesh::{Mesh, Winding};
use crate::scene::{Axes, Built, ElementBlock, NodeInertia, Scene, Support, blocks_for};
use crate::tled;

use super::SUPPLE_NONE;
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, one, place_for, same_abi};
use super::status::{Answer, supple_error, supple_status};
use supple_status::*;

/// Neo-Hookean, with the constants c and d, Pa.
pub const SUPPLE_NEO_HOOKEAN: u32 = 0;
/// Exponential, with the constants a (Pa), b, and d (Pa).
pub const SUPPLE_EXPONENTIAL: u32 = 1;

/// Elements must have positive volumes: (x1 - x0) . ((x2 - x0) x (x3 - x0)) > 0.
pub const SUPPLE_WINDING_CHECKED: u32 = 0;
/// Elements are turned where needed.
pub const SUPPLE_WINDING_NORMALISED: u32 = 1;

/// A node that does not move freely: along held axes it stands still, or follows motions.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_support {
    /// From zero.
    pub node: u32,
    /// Held axes: 1 for x, 2 for y, 4 for z, or their sum; 7 for all.
    pub axes: u32,
    /// 0: stands still. 1: motions may be prescribed.
    pub moves: u32,
}

/// The constants of a law, and a density.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_tissue {
    /// Neo-Hookean: c, d, unused. Exponential: a, b, d. Finite and positive.
    pub constants: [f32; 3],
    /// At rest, kg/m^3; finite and positive.
    pub density: f32,
}

/// What a scene is built from. Everything is copied; nothing needs to stay.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_scene_config {
    /// sizeof(supple_scene_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// SUPPLE_NEO_HOOKEAN or SUPPLE_EXPONENTIAL, for all elements.
    pub law: u32,
    /// SUPPLE_WINDING_CHECKED or SUPPLE_WINDING_NORMALISED.
    pub winding: u32,
    /// Nodes, at least 4.
    pub nodes: u32,
    /// Elements, at least 1.
    pub elements: u32,
    /// Supports; a node may have several.
    pub supports: u32,
    /// Tissues, 1 to 65535.
    pub tissues: u32,
    /// Three coordinates of each node, m. Keep the origin near the body: they are float32.
    pub points: *const f32,
    /// Four nodes of each element, from zero.
    pub tetrahedra: *const u32,
    /// The supports; may be NULL if there are none.
    pub support: *const supple_support,
    /// The tissues.
    pub tissue: *const supple_tissue,
    /// With more than one tissue: of which each element is. With one: NULL.
    pub tissue_of_element: *const u16,
}

/// What is simulated: element tables, masses, supports. After supple_scene_init nothing changes it: any
/// number of threads may use one scene at the same time.
#[repr(C, align(64))]
pub struct supple_scene {
    head: Head,
    law: u32,
    nodes: u32,
    blocks: u32,
    tissues: u32,
    elements: u32,
    built: Built,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_scene {
    const MAGIC: [u8; 8] = magic(b'S');
    const FRONT: usize = 768;
}

/// Bytes before the arrays of a scene.
pub const SUPPLE_SCENE_FRONT: usize = 768;
const _: () = assert!(SUPPLE_SCENE_FRONT == <supple_scene as Object>::FRONT);

/// Sizes and costs of a scene.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_scene_facts {
    /// Nodes.
    pub nodes: u32,
    /// Elements that take part; those with four fixed nodes were left out.
    pub elements: u32,
    /// Memory of the scene, bytes.
    pub bytes: u64,
    /// Floating-point operations of one exact step without loads, the same for every step.
    pub operations: u64,
    /// Mass of the body, kg.
    pub mass: f64,
}

/// A law that C can ask for.
pub(super) trait FromConstants: Law {
    fn from_constants(constants: [f32; 3]) -> Self;
}

impl FromConstants for NeoHookean {
    fn from_constants([c, d, _]: [f32; 3]) -> Self {
        Self { c, d }
    }
}

#[cfg(feature = "capi")]
impl FromConstants for Exponential {
    fn from_constants([a, b, d]: [f32; 3]) -> Self {
        Self { a, b, d }
    }
}

/// One tissue for all elements, or one of several for each.
#[derive(Clone, Copy)]
pub(super) struct Body<'a, L> {
    tissues: &'a [Tissue<L>],
    of_element: &'a [u16],
    first: Tissue<L>,
}

impl<'a, L: FromConstants> Body<'a, L> {
    fn new(tissues: &'a [Tissue<L>], of_element: &'a [u16]) -> Self {
        let none = Tissue { law: L::from_constants([0.0; 3]), density: 0.0 };
        Self { tissues, of_element, first: tissues.first().copied().unwrap_or(none) }
    }
}

impl<L: Law> Material for Body<'_, L> {
    type Law = L;

    fn tissue(&self, element: usize) -> Option<Tissue<L>> {
        if self.of_element.is_empty() {
            return Some(self.first);
        }
        let index = usize::from(*self.of_element.get(element)?);
        self.tissues.get(index).copied()
    }

    fn laws(&self) -> Laws<'_, L> {
        if self.of_element.is_empty() {
            return Laws::One(self.first.law);
        }
        Laws::Regions { tissues: self.tissues, of_element: self.of_element, beyond: self.first.law }
    }
}

/// A scene over the memory of its object.
pub(super) type Carved<'a, L> = Scene<Body<'a, L>, &'a [NodeInertia], &'a [ElementBlock]>;

/// The same, of whichever law.
pub(super) enum AnyScene<'a> {
    NeoHookean(Carved<'a, NeoHookean>),
    #[cfg(feature = "capi")]
    Exponential(Carved<'a, Exponential>),
}

/// Does the same with the scene of whichever law.
macro_rules! with_scene {
    ($any:expr, $scene:ident => $work:expr) => {
        match $any {
            $crate::capi::scene::AnyScene::NeoHookean($scene) => $work,
            #[cfg(feature = "capi")]
            $crate::capi::scene::AnyScene::Exponential($scene) => $work,
        }
    };
}
pub(super) use with_scene;

/// Elements that have a tissue of their own: all, or none where there is only one.
const fn regions(elements: u32, tissues: u32) -> usize {
    if tissues > 1 { elements as usize } else { 0 }
}

fn layout(nodes: u32, elements: u32, tissues: u32) -> Layout {
    Layout::of::<supple_scene>()
        .and::<NodeInertia>(nodes as usize)
        .and::<ElementBlock>(blocks_for(elements as usize))
        // Of either law.
        .and::<supple_tissue>(tissues as usize)
        .and::<u16>(regions(elements, tissues))
}

/// Bytes of memory that a scene needs; zero if there can be no such scene. SUPPLE_SCENE_SIZE is the same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_scene_size(nodes: u32, elements: u32, tissues: u32) -> usize {
    layout(nodes, elements, tissues).bytes()
}

/// Builds a scene in `memory` of at least supple_scene_size bytes, aligned to SUPPLE_ALIGN. On success `*scene` is the scene,
/// at the beginning of that memory.
///
/// @param error may be NULL; index is that of an element, a support or a node as the status says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_scene_init(
    memory: *mut c_void,
    bytes: usize,
    config: *const supple_scene_config,
    scene: *mut *mut supple_scene,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    unsafe { memory::answered(init(memory, bytes, config, scene), error) }
}

/// # Safety
/// As [`supple_scene_init`].
unsafe fn init(
    memory: *mut c_void,
    bytes: usize,
    config: *const supple_scene_config,
    scene: *mut *mut supple_scene,
) -> Answer<supple_status> {
    // SAFETY: the caller's promise.
    unsafe {
        let (config, scene) = (one(config)?, place_for(scene)?);
        same_abi::<supple_scene_config>(config.struct_size, config.abi)?;
        let &supple_scene_config { law, nodes, elements, tissues, .. } = config;
        let known = law == SUPPLE_NEO_HOOKEAN || law == SUPPLE_EXPONENTIAL && cfg!(feature = "capi");
        if !known {
            return Err(supple_error::from(SUPPLE_E_LAW).value(law.into(), 0.0));
        }
        check_choice(SUPPLE_NONE as usize, config.winding, SUPPLE_WINDING_NORMALISED)?;
        let winding =
            if config.winding == SUPPLE_WINDING_CHECKED { Winding::Checked } else { Winding::Normalised };
        if nodes == 0 || elements == 0 {
            return Err(SUPPLE_E_MESH_EMPTY.into());
        }
        if tissues == 0 || tissues > u32::from(u16::MAX) {
            return Err(supple_error::from(SUPPLE_E_TISSUE).value(tissues.into(), u16::MAX.into()));
        }
        let points = array(config.points.cast::<[f32; 3]>(), nodes as usize)?;
        let tets = array(config.tetrahedra.cast::<[u32; 4]>(), elements as usize)?;
        let supports = array(config.support, config.supports as usize)?;
        let given = array(config.tissue, tissues as usize)?;
        let of_element = array(config.tissue_of_element, regions(elements, tissues))?;
        for (index, support) in supports.iter().enumerate() {
            check_choice(index, support.axes, 7)?;
            check_choice(index, support.moves, 1)?;
        }
        let mesh = Mesh::new(points, tets, winding)?;
        let place = Place::new(memory, bytes, layout(nodes, elements, tissues))?;
        let blocks = blocks_for(elements as usize) as u32;
        let object = place.put(|head| supple_scene {
            head,
            law,
            nodes,
            blocks,
            tissues,
            elements,
            built: Built::NOTHING,
        });
        let supports = supports.iter().map(|support| Support {
            node: support.node,
            axes: axes_of(support.axes),
            moves: support.moves == 1,
        });
        let built = match law {
            #[cfg(feature = "capi")]
            SUPPLE_EXPONENTIAL => build::<Exponential>(object, &mesh, supports, given, of_element)?,
            _ => build::<NeoHookean>(object, &mesh, supports, given, of_element)?,
        };
        (*object).built = built;
        place.done::<supple_scene>();
        scene.write(object);
        Ok(SUPPLE_OK)
    }
}

/// That entry `index` of a list, or what is in none, is one of the choices up to `most`.
pub(super) fn check_choice(index: usize, value: u32, most: u32) -> Answer<()> {
    if value <= most {
        return Ok(());
    }
    Err(supple_error::from(SUPPLE_E_CHOICE).at(index).value(value.into(), most.into()))
}

/// The axes of a number below eight.
pub(super) fn axes_of(number: u32) -> Axes {
    let axes = [Axes::X, Axes::Y, Axes::Z].into_iter().enumerate();
    axes.filter(|(axis, _)| number >> axis & 1 == 1).fold(Axes::NONE, |sum, (_, axis)| sum.union(axis))
}

/// # Safety
/// `object` has been put, with room for its arrays, and nobody else uses it.
unsafe fn build<L: FromConstants>(
    object: *mut supple_scene,
    mesh: &Mesh<'_>,
    supports: impl Iterator<Item = Support>,
    given: &[supple_tissue],
    of_element: &[u16],
) -> Answer<Built> {
    const { assert!(size_of::<Tissue<L>>() <= size_of::<supple_tissue>()) };
    // SAFETY: the caller's promise; what is not any bits is written before it is read.
    let (nodes, blocks, tissues, regions) = unsafe {
        let supple_scene { nodes, blocks, tissues, elements, .. } = &*object;
        let mut arrays = Arrays::behind(object);
        (
            arrays.next::<NodeInertia>(*nodes as usize),
            arrays.next::<ElementBlock>(*blocks as usize),
            arrays.next_of::<Tissue<L>, supple_tissue>(*tissues as usize),
            arrays.next::<u16>(self::regions(*elements, *tissues)),
        )
    };
    for (tissue, given) in tissues.iter_mut().zip(given) {
        *tissue = Tissue { law: L::from_constants(given.constants), density: given.density };
    }
    for (region, &given) in regions.iter_mut().zip(of_element) {
        *region = given;
    }
    let mut scene = Scene::over(Body::new(&*tissues, &*regions), nodes, blocks);
    scene.build_from(mesh, supports)?;
    Ok(*scene.built())
}

/// The scene in an object.
///
/// # Safety
/// As at [`memory::read`].
pub(super) unsafe fn carved<'a>(object: *const supple_scene) -> Answer<AnyScene<'a>> {
    // SAFETY: the caller's promise.
    unsafe {
        Ok(match memory::read(object)?.law {
            #[cfg(feature = "capi")]
            SUPPLE_EXPONENTIAL => AnyScene::Exponential(of_law(object)),
            _ => AnyScene::NeoHookean(of_law(object)),
        })
    }
}

/// # Safety
/// `object` is a scene of this law, which nobody writes.
unsafe fn of_law<'a, L: FromConstants>(object: *const supple_scene) -> Carved<'a, L> {
    // SAFETY: the caller's promise; all arrays were written by `build`.
    unsafe {
        let scene = &*object;
        let mut arrays = Arrays::behind(object);
        let nodes = arrays.look::<NodeInertia>(scene.nodes as usize);
        let blocks = arrays.look::<ElementBlock>(scene.blocks as usize);
        let tissues = arrays.look_of::<Tissue<L>, supple_tissue>(scene.tissues as usize);
        let of_element = arrays.look::<u16>(regions(scene.elements, scene.tissues));
        Scene::again(Body::new(tissues, of_element), nodes, blocks, scene.built)
    }
}

/// Writes sizes and costs of a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_scene_describe(
    scene: *const supple_scene,
    facts: *mut supple_scene_facts,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let answer = unsafe { describe(scene, facts) };
    answer.unwrap_or_else(|error| error.status)
}

/// # Safety
/// As [`supple_scene_describe`].
unsafe fn describe(scene: *const supple_scene, facts: *mut supple_scene_facts) -> Answer<supple_status> {
    // SAFETY: the caller's promise.
    let (any, bytes, facts) = unsafe { (carved(scene)?, memory::bytes_of(scene), place_for(facts)?) };
    let found = with_scene!(any, scene => supple_scene_facts {
        nodes: scene.node_count() as u32,
        elements: scene.element_count() as u32,
        bytes: bytes as u64,
        operations: tled::operations(&scene),
        mass: scene.mass(),
    });
    // SAFETY: aligned, and there.
    unsafe { facts.write(found) };
    Ok(SUPPLE_OK)
}
