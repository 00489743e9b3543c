//! What is simulated, for C: built once from the host's mesh, read only from then on.

use core::ffi::c_void;
use core::slice::from_mut;

use crate::copy::copy_apart;
use crate::element::{ElementTile, FibreTile, NodeInertia, PatchRow};
use crate::loads::FARTHEST;
use crate::material::{Directions, Element, Fibres, Prony, TissueValues};
use crate::mesh::{Mesh, Winding};
use crate::scene::{Axes, SceneFacts, SceneView, Support, patch_rows_for, tiles_for};
use crate::simd::TILE;
use crate::state::{NodeVector, StateView};
use crate::tled;

use super::SUPPLE_NONE;
use super::fibres::{direction_tiles, fibres_in, fibres_of, supple_fibres, with_fibres};
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, one, place_for, same_abi};
use super::prony::{prony_of, series_of, supple_prony, supple_relaxation_size};
use super::status::{Answer, mismatch, short, status_of, supple_error, supple_status};
use supple_status::*;

/// Elements must have positive volumes: (x1 - x0) . ((x2 - x0) x (x3 - x0)) > 0.
pub const SUPPLE_WINDING_CHECKED: u32 = 0;
/// Elements are turned where needed.
pub const SUPPLE_WINDING_NORMALISED: u32 = 1;

/// Linear tetrahedra. They lock, that is bend too little, where tissue hardly changes its volume (Poisson's ratio above
/// 0.45).
pub const SUPPLE_LINEAR: u32 = 0;
/// Tetrahedra with average nodal pressure, which do not lock. Take these unless you compare with others' linear ones.
pub const SUPPLE_NODAL_PRESSURE: u32 = 1;
/// Tetrahedra with stabilised nodal strain, which bend well on coarse meshes and take less time than linear ones, but
/// more memory: supple_patches_size. Elements that are crushed to less than half of their volume resist. Under strains
/// above a half laws that stiffen much are too soft. Only in a library with all laws.
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
    /// Held axes, at least one: 1 for x, 2 for y, 4 for z, or their sum; 7 for all.
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
const _: () = assert!(size_of::<supple_tissue>() == size_of::<TissueValues>());

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
    /// For each element 1 if it is removed, as after a resection, else 0; NULL: none is. Nodes and elements keep their
    /// numbers; nodes without an element left are held where they are and weigh nothing.
    pub removed: *const u8,
    /// How each of the `tissues` relaxes; NULL: none does. Needs more memory: supple_prony_size, supple_relaxation_size.
    /// Only in a library with all laws.
    pub prony: *const supple_prony,
    /// The fibres of each of the `tissues`; NULL: none has any. Needs more memory: supple_fibres_size. Only in a library with
    /// all laws.
    pub fibres: *const supple_fibres,
    /// With fibres: six numbers for each element, a vector along its fibres and one along its sheets, at rest, of any length but
    /// zero. The part of the second one along the first is taken off; where the element's tissue has neither sheets nor coupling
    /// it is not read, and where it has no fibres neither is. Without fibres: NULL.
    pub directions: *const f32,
}

/// What is simulated: element tables, masses, supports. After supple_scene_init nothing but supple_set_tissues changes
/// it: any number of threads may use one scene at the same time.
#[repr(C, align(64))]
pub struct supple_scene {
    head: Head,
    nodes: u32,
    elements: u32,
    tissues: u32,
    /// Entries of the series: all tissues, or none where no tissue relaxes.
    series: u32,
    /// Entries of fibres: all tissues, or none where no tissue has any.
    fibres: u32,
    element: Element,
    /// Which of the laws; its constants are those of the tissues.
    law: SceneLaw,
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
    /// Elements that take part; those with four fixed nodes, and removed ones, were left out.
    pub elements: u32,
    /// Memory that the scene takes, bytes: what a copy of it needs. With nodal strain less than it was built in.
    pub bytes: u64,
    /// Floating-point operations of one exact step without loads, the same for every step.
    pub operations: u64,
    /// Mass of the body, kg.
    pub mass: f64,
}

/// What scenes of this library are made of.
#[cfg(feature = "capi")]
mod contents {
    use crate::material::Element;
    pub(in crate::capi) use crate::material::{AnyLaw as SceneLaw, AnyMaterial as SceneMaterial};
    use crate::material::{Directions, Fibres, Prony, TissueValues};

    /// The elements that there are; the number of each is its place.
    pub(super) const ELEMENTS: &[Element] = &Element::ALL;

    /// The law of a number: the position in the list of laws.
    pub(super) fn law_of(number: u32) -> Option<SceneLaw> {
        SceneLaw::all().find(|law| number.checked_mul(2) == Some(law.code()))
    }

    /// Whether tissue may relax and have fibres.
    pub(in crate::capi) const EXTENDS: bool = true;

    pub(super) const fn material_of<'a>(
        (element, law): (Element, SceneLaw),
        tissues: &'a [TissueValues],
        of_element: &'a [u16],
        prony: &'a [Prony],
        (fibres, directions): (&'a [Fibres], &'a [Directions]),
    ) -> SceneMaterial<'a> {
        SceneMaterial { element, law, tissues, of_element, prony, fibres, directions }
    }
}

/// What scenes of this library are made of: the first law of the list, without nodal strain.
#[cfg(not(feature = "capi"))]
mod contents {
    pub(in crate::capi) use crate::material::NeoHookean as SceneLaw;
    use crate::material::{AnyMaterial, Directions, Element, Fibres, Laws, Material, Prony, Tissue, TissueValues};

    pub(super) const ELEMENTS: &[Element] = &[Element::Linear, Element::NodalPressure];

    pub(super) fn law_of(number: u32) -> Option<SceneLaw> {
        (number == 0).then(SceneLaw::default)
    }

    pub(in crate::capi) const EXTENDS: bool = false;

    pub(super) const fn material_of<'a>(
        (element, law): (Element, SceneLaw),
        tissues: &'a [TissueValues],
        of_element: &'a [u16],
        _: &'a [Prony],
        _: (&'a [Fibres], &'a [Directions]),
    ) -> SceneMaterial<'a> {
        SceneMaterial { element, law, tissues, of_element }
    }

    #[derive(Clone, Copy)]
    pub(in crate::capi) struct SceneMaterial<'a> {
        pub(super) element: Element,
        pub(super) law: SceneLaw,
        pub(super) tissues: &'a [TissueValues],
        pub(super) of_element: &'a [u16],
    }

    impl<'a> SceneMaterial<'a> {
        const fn any(&self) -> AnyMaterial<'a, SceneLaw> {
            let Self { element, law, tissues, of_element } = *self;
            AnyMaterial { element, law, tissues, of_element, prony: &[], fibres: &[], directions: &[] }
        }
    }

    impl Material for SceneMaterial<'_> {
        type Law = SceneLaw;

        #[inline(always)]
        fn element(&self) -> Element {
            // Seen by the compiler, which then leaves nodal strain out.
            if self.element as u32 == Element::NodalPressure as u32 { Element::NodalPressure } else { Element::Linear }
        }

        fn tissue(&self, element: usize) -> Option<Tissue<SceneLaw>> {
            self.any().tissue(element)
        }

        fn laws(&self) -> Laws<'_, SceneLaw> {
            self.any().laws_of_all()
        }

        fn region(&self, element: usize) -> u16 {
            self.any().region(element)
        }
    }
}
use contents::{ELEMENTS, SceneLaw, law_of, material_of};
pub(super) use contents::{EXTENDS, SceneMaterial};

/// A scene in the memory of its object.
pub(super) struct OpenScene<'a> {
    material: SceneMaterial<'a>,
    nodes: &'a [NodeInertia],
    tiles: &'a [ElementTile],
    patches: &'a [PatchRow],
    directions: &'a [FibreTile],
    facts: &'a SceneFacts,
    /// What the state of any such scene remembers at most, bytes.
    room_to_remember: usize,
}

impl<'a> OpenScene<'a> {
    /// # Safety
    /// As at [`memory::read`]; nobody writes the scene.
    pub(super) unsafe fn of(object: *const supple_scene) -> Answer<Self> {
        // SAFETY: the caller's promise; all arrays were written by `build`.
        unsafe {
            memory::is(object)?;
            let &supple_scene { nodes, elements, tissues, series, fibres, element, law, ref facts, .. } = &*object;
            let mut arrays = Arrays::behind(object);
            Ok(Self {
                nodes: arrays.read(nodes as usize),
                tiles: arrays.read(tiles_for(elements as usize)),
                material: material_of(
                    (element, law),
                    arrays.read(tissues as usize),
                    arrays.read(regions(elements, tissues)),
                    arrays.read(series as usize),
                    // Directions by element are not kept: those in tiles are what is computed with.
                    (arrays.read(fibres as usize), &[]),
                ),
                directions: arrays.read(direction_tiles([nodes, elements, tissues], fibres, element)),
                patches: arrays.read(facts.patch_row_count()),
                facts,
                room_to_remember: match EXTENDS {
                    true => supple_relaxation_size(nodes, elements, tissues, element.code(), facts.terms() as u32),
                    false => 0,
                },
            })
        }
    }

    pub(super) fn view(&self) -> SceneView<'_, SceneMaterial<'a>> {
        SceneView::new(&self.material, self.nodes, self.tiles, self.patches, self.directions, self.facts)
    }

    pub(super) const fn node_count(&self) -> usize {
        self.facts.node_count()
    }

    pub(super) const fn element(&self) -> Element {
        self.material.element
    }

    /// Vectors for what its tissue remembers: in a state's memory, and those in use.
    pub(super) fn remembers(&self) -> [usize; 2] {
        [self.room_to_remember / size_of::<NodeVector>(), self.view().memory_vectors()]
    }

    /// That something was made for the scene's number of nodes.
    pub(super) fn fits(&self, nodes: u32) -> Answer<()> {
        let needed = self.node_count();
        if nodes as usize == needed { Ok(()) } else { Err(mismatch(nodes as usize, needed)) }
    }

    /// A node that is so far away, or else so stiff, that no step can be bounded.
    pub(super) fn stiffest(&self, state: StateView<'_>) -> Option<u32> {
        let StateView { displacement, increment, force, volume, .. } = state;
        let is_there = |moved: &NodeVector| moved.to_array().iter().all(|component| component.abs() <= FARTHEST);
        let mut found = displacement.iter().position(|moved| !is_there(moved));
        if found.is_none() {
            tled::each_rate(self.view(), self.nodes, [displacement, increment, force], volume, |node, rate| {
                found = found.or((!rate.is_finite()).then_some(node));
            });
        }
        found.map(|node| node as u32)
    }

    /// That these are the points that its elements were built from.
    pub(super) fn has_points(&self, points: &[[f32; 3]]) -> Answer<()> {
        self.has_points_of_each(1, points)
    }

    /// The same for each frame, looking at some hundred elements: enough to see millimetres, another body, or points that have moved.
    pub(super) fn seems_to_have_points(&self, points: &[[f32; 3]]) -> Answer<()> {
        self.has_points_of_each((self.view().tiles.len() / 32).next_power_of_two(), points)
    }

    /// The same, looking at one in so many tiles, a power of two.
    fn has_points_of_each(&self, number: usize, points: &[[f32; 3]]) -> Answer<()> {
        let chosen = self.view().tiles.iter().enumerate().filter(|(place, _)| place & (number - 1) == 0);
        let places = chosen.flat_map(|(_, tile)| (0..TILE).map(move |lane| (tile, lane)));
        let mut places = places.filter(|(tile, lane)| tile.volume::<f32>(*lane) > 0.0);
        match places.find(|&(tile, lane)| !tile.has_edges_of(lane, points)) {
            Some((tile, lane)) => Err(supple_error::from(SUPPLE_E_POINTS).at(tile.element(lane))),
            None => Ok(()),
        }
    }
}

/// Elements that have a tissue of their own: all, or none where there is only one.
const fn regions(elements: u32, tissues: u32) -> usize {
    if tissues > 1 { elements as usize } else { 0 }
}

/// How much is in the arrays of a scene.
#[derive(Clone, Copy)]
struct Counts {
    nodes: u32,
    elements: u32,
    tissues: u32,
    /// Entries of series.
    series: u32,
    /// Entries of fibres.
    fibres: u32,
    element: Element,
}

impl Counts {
    fn layout(&self, patch_rows: usize) -> Layout {
        let &Self { nodes, elements, tissues, series, fibres, element } = self;
        let layout = Layout::of::<supple_scene>()
            .and::<NodeInertia>(nodes as usize)
            .and::<ElementTile>(tiles_for(elements as usize))
            .and::<TissueValues>(tissues as usize)
            .and::<u16>(regions(elements, tissues))
            .and::<Prony>(series as usize);
        with_fibres(layout, [nodes, elements, tissues], fibres, element).and::<PatchRow>(patch_rows)
    }

    const fn direction_tiles(&self) -> usize {
        direction_tiles([self.nodes, self.elements, self.tissues], self.fibres, self.element)
    }
}

/// Bytes of memory that a scene needs; zero if there can be no such scene. SUPPLE_SCENE_SIZE is the same as a constant.
/// With SUPPLE_NODAL_STRAIN it needs supple_patches_size bytes more, with tissue that relaxes supple_prony_size, with fibres
/// supple_fibres_size.
#[unsafe(no_mangle)]
pub extern "C" fn supple_scene_size(nodes: u32, elements: u32, tissues: u32) -> usize {
    Counts { nodes, elements, tissues, series: 0, fibres: 0, element: Element::Linear }.layout(0).bytes()
}

/// Bytes of memory that a scene with SUPPLE_NODAL_STRAIN needs more than supple_scene_size: enough to build it from any
/// mesh whose elements of a tissue around a node are joined by faces, with at most 48 neighbours of a node. For others
/// supple_scene_init returns SUPPLE_E_SHORT, and the error's limit is enough. The scene takes about half of these
/// bytes: supple_scene_describe tells. SUPPLE_PATCHES_SIZE is the same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_patches_size(nodes: u32, elements: u32, tissues: u32) -> usize {
    let rows = patch_rows_for(nodes as usize, elements as usize, tissues as usize);
    rows.checked_mul(size_of::<PatchRow>()).unwrap_or(0)
}

/// Builds a scene in `memory` of at least supple_scene_size bytes, with SUPPLE_NODAL_STRAIN and supple_patches_size, with
/// tissue that relaxes and supple_prony_size, with fibres and supple_fibres_size, aligned to SUPPLE_ALIGN. On success
/// `*scene` is the scene, at the beginning of that memory. What it takes of it is told by supple_scene_describe; the rest is
/// free for other use.
///
/// @param error may be NULL; index is that of an element, a support, a node or a tissue as the status says.
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
        let (law, element, parts) = CheckedBody::checked(config)?;
        let &supple_scene_config { nodes, elements, tissues, .. } = config;
        let (series, fibres) = (parts.series.len() as u32, parts.fibres.len() as u32);
        let counts = Counts { nodes, elements, tissues, series, fibres, element };
        let without_patches = counts.layout(0).bytes();
        let room = match bytes.min(isize::MAX as usize).checked_sub(without_patches) {
            _ if element != Element::NodalStrain => 0,
            Some(rest) => rest / size_of::<PatchRow>(),
            None => patch_rows_for(nodes as usize, elements as usize, tissues as usize),
        };
        let place = Place::new(memory, bytes, counts.layout(room))?;
        let facts = parts.build(law, &counts, room, place.arrays::<supple_scene>());
        let facts = facts.map_err(|error| match error.status {
            // So far of the patches alone.
            SUPPLE_E_SHORT => short(bytes, without_patches.saturating_add(error.limit as usize)),
            _ => error,
        })?;
        let place = place.shrunk(counts.layout(facts.patch_row_count()));
        let object = |head| supple_scene { head, nodes, elements, tissues, series, fibres, element, law, facts };
        scene.write(place.put(object));
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// What a scene is built from, checked as far as it can be without building it.
struct CheckedBody<'a> {
    mesh: Mesh<'a>,
    supports: &'a [supple_support],
    tissues: &'a [supple_tissue],
    of_element: &'a [u16],
    series: &'a [supple_prony],
    fibres: &'a [supple_fibres],
    directions: &'a [Directions],
}

impl<'a> CheckedBody<'a> {
    /// # Safety
    /// The arrays of the configuration are as the header says.
    unsafe fn checked(config: &'a supple_scene_config) -> Answer<(SceneLaw, Element, Self)> {
        same_abi::<supple_scene_config>(config.struct_size, config.abi)?;
        let &supple_scene_config { law: number, nodes, elements, tissues, .. } = config;
        let law = law_of(number).ok_or(supple_error::from(SUPPLE_E_LAW).value(number.into(), 0.0))?;
        check_choice(SUPPLE_NONE as usize, config.winding, SUPPLE_WINDING_NORMALISED)?;
        check_choice(SUPPLE_NONE as usize, config.reserved, 0)?;
        let element = ELEMENTS.get(config.element as usize).copied();
        let most = ELEMENTS.len().saturating_sub(1) as u32;
        check_choice(SUPPLE_NONE as usize, config.element, most)?;
        let element = element.unwrap_or_default();
        let winding = if config.winding == SUPPLE_WINDING_CHECKED { Winding::Checked } else { Winding::Normalised };
        if nodes == 0 || elements == 0 {
            return Err(SUPPLE_E_MESH_EMPTY.into());
        }
        tissues_of(config)?;
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
            check_axes(index, support.axes)?;
            check_choice(index, support.moves, 1)?;
        }
        check_coordinates(points)?;
        // SAFETY: the caller's promise.
        let (removed, (series, _), (fibres, directions)) =
            unsafe { (removed_of(config)?, series_of(config)?, fibres_of(config)?) };
        let mesh = Mesh::new(points, tets, winding)?.without(removed)?;
        Ok((law, element, Self { mesh, supports, tissues, of_element, series, fibres, directions }))
    }

    /// # Safety
    /// The arrays are those of a scene of these parts, and nobody else uses them.
    unsafe fn build(
        &self,
        law: SceneLaw,
        counts: &Counts,
        patch_rows: usize,
        mut arrays: Arrays,
    ) -> Answer<SceneFacts> {
        let Self { mesh, supports, tissues: given, of_element, series, fibres: given_fibres, directions } = self;
        // SAFETY: the caller's promise; what is not any bits is written before it is read.
        let (nodes, tiles, tissues, regions, prony, fibres, tiles_of_directions, patches) = unsafe {
            (
                arrays.change::<NodeInertia>(mesh.points().len()),
                arrays.change::<ElementTile>(tiles_for(mesh.element_count())),
                arrays.change::<TissueValues>(given.len()),
                arrays.change::<u16>(of_element.len()),
                arrays.change::<Prony>(series.len()),
                arrays.change::<Fibres>(given_fibres.len()),
                arrays.change::<FibreTile>(counts.direction_tiles()),
                arrays.change::<PatchRow>(patch_rows),
            )
        };
        for (tissue, given) in tissues.iter_mut().zip(*given) {
            *tissue = TissueValues { constants: given.constants, density: given.density };
        }
        for (region, &given) in regions.iter_mut().zip(*of_element) {
            *region = given;
        }
        for (tissue, (prony, given)) in prony.iter_mut().zip(*series).enumerate() {
            *prony = prony_of(tissue, given)?;
        }
        for (tissue, (fibres, given)) in fibres.iter_mut().zip(*given_fibres).enumerate() {
            *fibres = fibres_in(tissue, given)?;
        }
        let supports = supports.iter().map(|support| Support {
            node: support.node,
            axes: axes_of(support.axes),
            moves: support.moves == 1,
        });
        let material = material_of((counts.element, law), tissues, regions, prony, (fibres, directions));
        Ok(SceneFacts::build(&material, mesh, supports, nodes, tiles, patches, tiles_of_directions)?)
    }
}

/// How many tissues there are.
pub(super) fn tissues_of(config: &supple_scene_config) -> Answer<u32> {
    match config.tissues {
        0 | 0x1_0000.. => Err(supple_error::from(SUPPLE_E_TISSUE).value(config.tissues.into(), u16::MAX.into())),
        tissues => Ok(tissues),
    }
}

/// The marks of removed elements, none where the host gives none.
///
/// # Safety
/// As at [`CheckedBody::checked`].
unsafe fn removed_of(config: &supple_scene_config) -> Answer<&[bool]> {
    if config.removed.is_null() {
        return Ok(&[]);
    }
    // SAFETY: the caller's promise.
    let marks = unsafe { array(config.removed, config.elements as usize)? };
    for (index, &mark) in marks.iter().enumerate() {
        check_choice(index, mark.into(), 1)?;
    }
    Ok(bytemuck::checked::try_cast_slice(marks).unwrap_or_default())
}

/// Gives the tissues of a scene other constants. Nothing is changed where they cannot be, or are of other densities, for
/// which a scene must be built anew.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn set_tissues(scene: *mut supple_scene, tissues: &[TissueValues]) -> Answer<()> {
    // SAFETY: the caller's promise; the tissues stand where they were built.
    unsafe {
        let open = OpenScene::of(scene.cast_const())?;
        let OpenScene { material, tiles, facts, .. } = &open;
        if tissues.len() != material.tissues.len() {
            return Err(mismatch(tissues.len(), material.tissues.len()));
        }
        let new = SceneMaterial { tissues, ..*material };
        let mut changed = [**facts];
        let [facts] = &mut changed;
        if !facts.change_constants(tiles, material, &new)? {
            let mut both =
                tissues.iter().zip(material.tissues).map(|(new, old)| [new.density, old.density]).enumerate();
            let (index, [new, old]) = both.find(|(_, [new, old])| new != old).unwrap_or_default();
            return Err(supple_error::from(SUPPLE_E_MISMATCH).at(index).value(new.into(), old.into()));
        }
        let (nodes, elements) = ((*scene).nodes as usize, (*scene).elements as usize);
        copy_apart(from_mut(&mut (*scene).facts), &changed);
        let mut arrays = Arrays::behind(scene.cast_const());
        arrays.read::<NodeInertia>(nodes);
        arrays.read::<ElementTile>(tiles_for(elements));
        copy_apart(arrays.change(tissues.len()), tissues);
        Ok(())
    }
}

/// That entry `index` of a list, or what is in none, is one of the choices up to `most`.
pub(super) fn check_choice(index: usize, value: u32, most: u32) -> Answer<()> {
    if value <= most {
        return Ok(());
    }
    Err(supple_error::from(SUPPLE_E_CHOICE).at(index).value(value.into(), most.into()))
}

/// That the axes of entry `index` of a list are at least one of the three.
pub(super) fn check_axes(index: usize, axes: u32) -> Answer<()> {
    match axes {
        0 => Err(supple_error::from(SUPPLE_E_CHOICE).at(index).value(0.0, 7.0)),
        axes => check_choice(index, axes, 7),
    }
}

/// That no coordinate is so large that an element with it would be called flat. One that is no number is told of the mesh.
fn check_coordinates(points: &[[f32; 3]]) -> Answer<()> {
    for (node, at) in points.iter().enumerate() {
        for (axis, &value) in at.iter().enumerate() {
            if value.abs() > FARTHEST {
                let error = supple_error::from(SUPPLE_E_NOT_FINITE).at(node).node(node as u32);
                return Err(error.axis(axis).value(value.into(), FARTHEST.into()));
            }
        }
    }
    Ok(())
}

/// The axes of a number below eight.
pub(super) fn axes_of(number: u32) -> Axes {
    let axes = [Axes::X, Axes::Y, Axes::Z].into_iter().enumerate();
    axes.filter(|(axis, _)| number >> axis & 1 == 1).fold(Axes::NONE, |sum, (_, axis)| sum.union(axis))
}

/// Writes sizes and costs of a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_scene_describe(
    scene: *const supple_scene,
    facts: *mut supple_scene_facts,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let describe = || unsafe {
        let (opened, bytes, facts) = (OpenScene::of(scene)?, memory::bytes_of(scene), place_for(facts)?);
        let scene = opened.view();
        facts.write(supple_scene_facts {
            nodes: scene.node_count() as u32,
            elements: scene.element_count() as u32,
            bytes: bytes as u64,
            operations: tled::operations(scene),
            mass: scene.mass(),
        });
        Ok(SUPPLE_OK)
    };
    status_of(describe())
}
