//! What is simulated, for C: built once from the host's mesh, read only from then on.

use core::ffi::c_void;

use crate::element::{ElementLaw, ElementTile, NodeInertia, PatchRow};
use crate::material::{
    AnyLaw, Element, Law, Laws, MAX_CONSTANTS, Material, NodalPressure, NodalStrain, Regions, Tissue,
    for_each_law,
};
use crate::mesh::{Mesh, Winding};
use crate::scene::{Axes, SceneFacts, SceneView, Support, patch_rows_for, tiles_for};
use crate::tled;

use super::SUPPLE_NONE;
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, one, place_for, same_abi};
use super::status::{Answer, mismatch, short, status_of, supple_error, supple_status};
use supple_status::*;

/// Elements must have positive volumes: (x1 - x0) . ((x2 - x0) x (x3 - x0)) > 0.
pub const SUPPLE_WINDING_CHECKED: u32 = 0;
/// Elements are turned where needed.
pub const SUPPLE_WINDING_NORMALISED: u32 = 1;

/// Linear tetrahedra. They lock, that is bend too little, where tissue hardly changes its volume (Poisson's ratio above 0.45).
pub const SUPPLE_LINEAR: u32 = 0;
/// Tetrahedra with average nodal pressure, which do not lock. Take these unless you compare with others' linear ones.
pub const SUPPLE_NODAL_PRESSURE: u32 = 1;
/// Tetrahedra with stabilised nodal strain, which bend well on coarse meshes and take less time than linear ones, but more memory:
/// supple_patches_size. Under strains above a half elements at sharp edges may turn inside out, which the status tells within 16
/// steps. Only in a library with all laws.
pub const SUPPLE_NODAL_STRAIN: u32 = 2;
const _: () = assert!(SUPPLE_LINEAR == Element::Linear.code());
const _: () = assert!(SUPPLE_NODAL_PRESSURE == Element::NodalPressure.code());
const _: () = assert!(SUPPLE_NODAL_STRAIN == Element::NodalStrain.code());

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
    /// In the order that stands with the law (SUPPLE_NEO_HOOKEAN and so on), finite and positive; the rest is ignored.
    pub constants: [f32; 4],
    /// At rest, kg/m^3; finite and positive.
    pub density: f32,
}
const _: () = assert!(size_of::<supple_tissue>() == size_of::<f32>() * (MAX_CONSTANTS + 1));

/// What a scene is built from. Everything is copied; nothing needs to stay.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_scene_config {
    /// sizeof(supple_scene_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// The law of all elements: SUPPLE_NEO_HOOKEAN and so on.
    pub law: u32,
    /// SUPPLE_WINDING_CHECKED or SUPPLE_WINDING_NORMALISED.
    pub winding: u32,
    /// Nodes, at least 4.
    pub nodes: u32,
    /// Elements, at least 1.
    pub elements: u32,
    /// Entries of `support`; a node may have several.
    pub supports: u32,
    /// Entries of `tissue`, 1 to 65535.
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
    /// SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
    pub element: u32,
    /// 0.
    pub reserved: u32,
}

/// What is simulated: element tables, masses, supports. After supple_scene_init nothing changes it: any
/// number of threads may use one scene at the same time.
#[repr(C, align(64))]
pub struct supple_scene {
    head: Head,
    nodes: u32,
    elements: u32,
    tissues: u32,
    element: Element,
    /// Which of the laws; its constants are those of the tissues.
    law: AnyLaw,
    facts: SceneFacts,
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
    /// Memory that the scene takes, bytes: what a copy of it needs. With nodal strain less than it was built in.
    pub bytes: u64,
    /// Floating-point operations of one exact step without loads, the same for every step.
    pub operations: u64,
    /// Mass of the body, kg.
    pub mass: f64,
}

/// One tissue for all elements, or one of several for each.
#[derive(Clone, Copy)]
pub(super) struct Body<'a, L> {
    tissues: &'a [Tissue<L>],
    of_element: &'a [u16],
}

impl<L: Law> Body<'_, L> {
    /// The tissue of all elements, if there is but one.
    fn only(&self) -> Option<Tissue<L>> {
        if self.of_element.is_empty() { self.tissues.first().copied() } else { None }
    }
}

impl<L: Law> Material for Body<'_, L> {
    type Law = L;

    fn tissue(&self, element: usize) -> Option<Tissue<L>> {
        let Self { tissues, of_element } = *self;
        self.only().or_else(|| Regions { tissues, of_element }.tissue(element))
    }

    fn laws(&self) -> Laws<'_, L> {
        let Self { tissues, of_element } = *self;
        match self.only() {
            Some(tissue) => Laws::One(tissue.law),
            None => Laws::Regions { tissues, of_element, beyond: L::default() },
        }
    }

    fn region(&self, element: usize) -> u16 {
        self.of_element.get(element).copied().unwrap_or_default()
    }
}

/// A scene of one law in the memory of its object.
pub(super) struct Carved<'a, L> {
    element: Element,
    /// With the wrappers of all elements: the outermost one counts.
    body: NodalStrain<NodalPressure<Body<'a, L>>>,
    nodes: &'a [NodeInertia],
    tiles: &'a [ElementTile],
    patches: &'a [PatchRow],
    facts: &'a SceneFacts,
}

impl<'a, L: ElementLaw> Carved<'a, L> {
    const FITS: () = assert!(size_of::<Tissue<L>>() <= size_of::<supple_tissue>());

    /// # Safety
    /// `object` is a scene of this law, which nobody writes.
    unsafe fn of(object: *const supple_scene) -> Self {
        let () = Self::FITS;
        // SAFETY: the caller's promise; all arrays were written by `build`.
        unsafe {
            let &supple_scene { nodes, elements, tissues, element, ref facts, .. } = &*object;
            let mut arrays = Arrays::behind(object);
            Self {
                element,
                nodes: arrays.read(nodes as usize),
                tiles: arrays.read(tiles_for(elements as usize)),
                body: NodalStrain(NodalPressure(Body {
                    tissues: arrays.read(tissues as usize),
                    of_element: arrays.read(regions(elements, tissues)),
                })),
                patches: arrays.read(facts.patch_row_count()),
                facts,
            }
        }
    }

    pub(super) const fn element(&self) -> Element {
        self.element
    }

    /// The scene, of linear elements.
    pub(super) fn linear(&self) -> SceneView<'_, Body<'a, L>> {
        self.view(&self.body.0.0)
    }

    /// The scene, of elements with nodal pressure.
    #[cfg(feature = "capi-nodal-pressure")]
    pub(super) fn nodal_pressure(&self) -> SceneView<'_, NodalPressure<Body<'a, L>>> {
        self.view(&self.body.0)
    }

    /// The scene, of elements with nodal strain.
    #[cfg(feature = "capi")]
    pub(super) fn nodal_strain(&self) -> SceneView<'_, NodalStrain<NodalPressure<Body<'a, L>>>> {
        self.view(&self.body)
    }

    fn view<'b, M>(&'b self, body: &'b M) -> SceneView<'b, M> {
        SceneView::new(body, self.nodes, self.tiles, self.patches, self.facts)
    }
}

macro_rules! any_scene {
    ($first:ident: $first_law:ty, $($other:ident: $law:ty,)*) => {
        /// A scene of whichever law this library has: the first of the list, or all with the feature `capi`.
        pub(super) enum AnyScene<'a> {
            $first(Carved<'a, $first_law>),
            $(#[cfg(feature = "capi")] $other(Carved<'a, $law>),)*
        }

        impl AnyScene<'_> {
            /// # Safety
            /// `object` is a scene, which nobody writes.
            unsafe fn of(object: *const supple_scene) -> Answer<Self> {
                // SAFETY: the caller's promise; the arrays are of the law that the object names.
                unsafe {
                    match (*object).law {
                        AnyLaw::$first(_) => Ok(Self::$first(Carved::of(object))),
                        $(#[cfg(feature = "capi")] AnyLaw::$other(_) => Ok(Self::$other(Carved::of(object))),)*
                        _ => Err(SUPPLE_E_LAW.into()),
                    }
                }
            }
        }

        impl Parts<'_> {
            /// Builds a scene of this law.
            ///
            /// # Safety
            /// As at [`Parts::build_of`].
            unsafe fn build(
                &self,
                law: AnyLaw,
                element: Element,
                patch_rows: usize,
                arrays: Arrays,
            ) -> Answer<SceneFacts> {
                // SAFETY: the caller's promise.
                unsafe {
                    match law {
                        AnyLaw::$first(_) => self.build_of::<$first_law>(element, patch_rows, arrays),
                        $(
                            #[cfg(feature = "capi")]
                            AnyLaw::$other(_) => self.build_of::<$law>(element, patch_rows, arrays),
                        )*
                        _ => Err(SUPPLE_E_LAW.into()),
                    }
                }
            }
        }
    };
}
for_each_law!(any_scene);

/// Does the same with the view of a scene of whichever law.
macro_rules! with_scene {
    (@ of $carved:ident, $scene:ident => $work:expr) => {
        match $carved.element() {
            #[cfg(feature = "capi-nodal-pressure")]
            $crate::material::Element::NodalPressure => {
                let $scene = $carved.nodal_pressure();
                $work
            }
            #[cfg(feature = "capi")]
            $crate::material::Element::NodalStrain => {
                let $scene = $carved.nodal_strain();
                $work
            }
            _ => {
                let $scene = $carved.linear();
                $work
            }
        }
    };
    (@ $any:expr, $scene:ident => $work:expr; $first:ident: $first_law:ty, $($other:ident: $law:ty,)*) => {
        match &$any {
            $crate::capi::scene::AnyScene::$first(carved) => with_scene!(@ of carved, $scene => $work),
            $(
                #[cfg(feature = "capi")]
                $crate::capi::scene::AnyScene::$other(carved) => with_scene!(@ of carved, $scene => $work),
            )*
        }
    };
    ($any:expr, $scene:ident => $work:expr) => {
        $crate::material::for_each_law!(with_scene @ $any, $scene => $work;)
    };
}
pub(super) use with_scene;

impl AnyScene<'_> {
    pub(super) fn node_count(&self) -> usize {
        with_scene!(self, scene => scene.node_count())
    }

    pub(super) fn element(&self) -> Element {
        with_scene!(self, scene => scene.element())
    }

    /// That something was made for the scene's number of nodes.
    pub(super) fn fits(&self, nodes: u32) -> Answer<()> {
        let needed = self.node_count();
        if nodes as usize == needed { Ok(()) } else { Err(mismatch(nodes as usize, needed)) }
    }
}

/// Elements that have a tissue of their own: all, or none where there is only one.
const fn regions(elements: u32, tissues: u32) -> usize {
    if tissues > 1 { elements as usize } else { 0 }
}

/// With so many rows of patches.
fn layout(nodes: u32, elements: u32, tissues: u32, patch_rows: usize) -> Layout {
    Layout::of::<supple_scene>()
        .and::<NodeInertia>(nodes as usize)
        .and::<ElementTile>(tiles_for(elements as usize))
        // Enough for the tissues of any law.
        .and::<supple_tissue>(tissues as usize)
        .and::<u16>(regions(elements, tissues))
        .and::<PatchRow>(patch_rows)
}

/// Bytes of memory that a scene needs; zero if there can be no such scene. SUPPLE_SCENE_SIZE is the same as a constant. With
/// SUPPLE_NODAL_STRAIN it needs supple_patches_size bytes more.
#[unsafe(no_mangle)]
pub extern "C" fn supple_scene_size(nodes: u32, elements: u32, tissues: u32) -> usize {
    layout(nodes, elements, tissues, 0).bytes()
}

/// Bytes of memory that a scene with SUPPLE_NODAL_STRAIN needs more than supple_scene_size: enough to build it from any mesh whose
/// elements of a tissue around a node are joined by faces, with at most 48 neighbours of a node. For others supple_scene_init
/// returns SUPPLE_E_SHORT, and the error's limit is enough. The scene takes about half of these bytes: supple_scene_describe tells.
/// SUPPLE_PATCHES_SIZE is the same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_patches_size(nodes: u32, elements: u32, tissues: u32) -> usize {
    let rows = patch_rows_for(nodes as usize, elements as usize, tissues as usize);
    rows.checked_mul(size_of::<PatchRow>()).unwrap_or(0)
}

/// Builds a scene in `memory` of at least supple_scene_size bytes, with SUPPLE_NODAL_STRAIN and supple_patches_size, aligned to
/// SUPPLE_ALIGN. On success `*scene` is the scene, at the beginning of that memory. What it takes of it is told by
/// supple_scene_describe; the rest is free for other use.
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
    let init = || unsafe {
        let (config, scene) = (one(config)?, place_for(scene)?);
        let (law, element, parts) = Parts::checked(config)?;
        let &supple_scene_config { nodes, elements, tissues, .. } = config;
        let without_patches = layout(nodes, elements, tissues, 0).bytes();
        let room = match bytes.min(isize::MAX as usize).checked_sub(without_patches) {
            _ if element != Element::NodalStrain => 0,
            Some(rest) => rest / size_of::<PatchRow>(),
            None => patch_rows_for(nodes as usize, elements as usize, tissues as usize),
        };
        let place = Place::new(memory, bytes, layout(nodes, elements, tissues, room))?;
        let facts = parts.build(law, element, room, place.arrays::<supple_scene>());
        let facts = facts.map_err(|error| match error.status {
            // So far of the patches alone.
            SUPPLE_E_SHORT => short(bytes, without_patches.saturating_add(error.limit as usize)),
            _ => error,
        })?;
        let place = place.shrunk(layout(nodes, elements, tissues, facts.patch_row_count()));
        scene.write(place.put(|head| supple_scene { head, nodes, elements, tissues, element, law, facts }));
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// The elements that this library has; the number of each is its place.
const ELEMENTS: &[Element] = match () {
    () if cfg!(feature = "capi") => &Element::ALL,
    () if cfg!(feature = "capi-nodal-pressure") => &[Element::Linear, Element::NodalPressure],
    () => &[Element::Linear],
};

/// What a scene is built from, checked as far as it can be without building it.
struct Parts<'a> {
    mesh: Mesh<'a>,
    supports: &'a [supple_support],
    tissues: &'a [supple_tissue],
    of_element: &'a [u16],
}

impl<'a> Parts<'a> {
    /// # Safety
    /// The arrays of the configuration are as the header says.
    unsafe fn checked(config: &'a supple_scene_config) -> Answer<(AnyLaw, Element, Self)> {
        same_abi::<supple_scene_config>(config.struct_size, config.abi)?;
        let &supple_scene_config { law: number, nodes, elements, tissues, .. } = config;
        let law = law_of(number).ok_or(supple_error::from(SUPPLE_E_LAW).value(number.into(), 0.0))?;
        check_choice(SUPPLE_NONE as usize, config.winding, SUPPLE_WINDING_NORMALISED)?;
        check_choice(SUPPLE_NONE as usize, config.reserved, 0)?;
        let element = ELEMENTS.get(config.element as usize).copied();
        let most = ELEMENTS.len().saturating_sub(1) as u32;
        check_choice(SUPPLE_NONE as usize, config.element, most)?;
        let element = element.unwrap_or_default();
        let winding =
            if config.winding == SUPPLE_WINDING_CHECKED { Winding::Checked } else { Winding::Normalised };
        if nodes == 0 || elements == 0 {
            return Err(SUPPLE_E_MESH_EMPTY.into());
        }
        if tissues == 0 || tissues > u32::from(u16::MAX) {
            return Err(supple_error::from(SUPPLE_E_TISSUE).value(tissues.into(), u16::MAX.into()));
        }
        // SAFETY: the caller's promise.
        let (points, tets, supports, tissues, of_element) = unsafe {
            (
                array(config.points.cast::<[f32; 3]>(), nodes as usize)?,
                array(config.tetrahedra.cast::<[u32; 4]>(), elements as usize)?,
                array(config.support, config.supports as usize)?,
                array(config.tissue, tissues as usize)?,
                array(config.tissue_of_element, regions(elements, tissues))?,
            )
        };
        for (index, support) in supports.iter().enumerate() {
            check_choice(index, support.axes, 7)?;
            check_choice(index, support.moves, 1)?;
        }
        Ok((law, element, Self { mesh: Mesh::new(points, tets, winding)?, supports, tissues, of_element }))
    }

    /// # Safety
    /// The arrays are those of a scene of these parts, and nobody else uses them.
    unsafe fn build_of<L: ElementLaw>(
        &self,
        element: Element,
        patch_rows: usize,
        mut arrays: Arrays,
    ) -> Answer<SceneFacts> {
        let Self { mesh, supports, tissues: given, of_element } = self;
        // SAFETY: the caller's promise; what is not any bits is written before it is read.
        let (nodes, tiles, tissues, regions, patches) = unsafe {
            (
                arrays.change::<NodeInertia>(mesh.points().len()),
                arrays.change::<ElementTile>(tiles_for(mesh.element_count())),
                arrays.change::<Tissue<L>>(given.len()),
                arrays.change::<u16>(of_element.len()),
                arrays.change::<PatchRow>(patch_rows),
            )
        };
        for (tissue, given) in tissues.iter_mut().zip(*given) {
            *tissue = Tissue { law: L::from_constants(given.constants), density: given.density };
        }
        for (region, &given) in regions.iter_mut().zip(*of_element) {
            *region = given;
        }
        let supports = supports.iter().map(|support| Support {
            node: support.node,
            axes: axes_of(support.axes),
            moves: support.moves == 1,
        });
        let body = Body { tissues, of_element: regions };
        Ok(match element {
            #[cfg(feature = "capi-nodal-pressure")]
            Element::NodalPressure => {
                SceneFacts::build(&NodalPressure(body), mesh, supports, nodes, tiles, patches)?
            }
            #[cfg(feature = "capi")]
            Element::NodalStrain => {
                SceneFacts::build(&NodalStrain(body), mesh, supports, nodes, tiles, patches)?
            }
            _ => SceneFacts::build(&body, mesh, supports, nodes, tiles, patches)?,
        })
    }
}

/// The law of a number, if this library has it: the position in the list of laws.
fn law_of(number: u32) -> Option<AnyLaw> {
    let has_it = number == 0 || cfg!(feature = "capi");
    AnyLaw::all().find(|law| has_it && number.checked_mul(2) == Some(law.code()))
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

/// The scene in an object.
///
/// # Safety
/// As at [`memory::read`].
pub(super) unsafe fn carved<'a>(object: *const supple_scene) -> Answer<AnyScene<'a>> {
    // SAFETY: the caller's promise.
    unsafe {
        memory::is(object)?;
        AnyScene::of(object)
    }
}

/// Writes sizes and costs of a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_scene_describe(
    scene: *const supple_scene,
    facts: *mut supple_scene_facts,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let describe = || unsafe {
        let (any, bytes, facts) = (carved(scene)?, memory::bytes_of(scene), place_for(facts)?);
        facts.write(with_scene!(any, scene => supple_scene_facts {
            nodes: scene.node_count() as u32,
            elements: scene.element_count() as u32,
            bytes: bytes as u64,
            operations: tled::operations(scene),
            mass: scene.mass(),
        }));
        Ok(SUPPLE_OK)
    };
    status_of(describe())
}
