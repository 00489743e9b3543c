//! Rigid instruments that touch the tissue, for C ([`crate::contact`]).

use core::ffi::c_void;
use core::mem::take;

use crate::contact::{
    Contact, ContactPoint, Field, Grip, Instrument, MOST_INSTRUMENTS, Pose, Shape, Surface, SurfaceNode, Touch,
    vectors_to_push,
};
use crate::copy::copy;
use crate::state::{NodeVector, StateView};

use super::memory::{self, Arrays, Head, Layout, Object, Place, array, lasting_bytes, magic, one, place_for};
use super::scene::{OpenScene, supple_scene};
use super::state::{opened, supple_state};
use super::status::{Answer, status_of, supple_error, supple_status};
use super::surface::{Given, supple_surface};
use supple_status::*;

/// Shapes of an instrument: all below the plane z = 0 of its axes; a ball around its centre; a cylinder along z with
/// round ends; the signed distances in a field's file, which `supple field` makes of a mesh.
pub const SUPPLE_PLANE: u32 = 0;
pub const SUPPLE_SPHERE: u32 = 1;
pub const SUPPLE_CAPSULE: u32 = 2;
pub const SUPPLE_FIELD: u32 = 3;

/// Most instruments of a supple_contact.
pub const SUPPLE_MOST_INSTRUMENTS: u32 = 8;
const _: () = assert!(SUPPLE_MOST_INSTRUMENTS as usize == MOST_INSTRUMENTS);

/// Most contact points that are kept of a step.
pub const SUPPLE_MOST_CONTACT_POINTS: u32 = 64;
const POINTS: usize = SUPPLE_MOST_CONTACT_POINTS as usize;

/// Where an instrument is.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_pose {
    /// Its centre, m.
    pub position: [f32; 3],
    /// Quaternion x, y, z, w that turns its axes into those of the scene, of any length; all zero: not turned.
    pub rotation: [f32; 4],
}

/// A rigid instrument.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_instrument {
    /// SUPPLE_PLANE, SUPPLE_SPHERE, SUPPLE_CAPSULE or SUPPLE_FIELD.
    pub shape: u32,
    /// Of a sphere or capsule, m. Below the length of the surface's edges the surface needs triangles: else it passes
    /// between nodes.
    pub radius: f32,
    /// Of a capsule, between the centres of its ends, m.
    pub length: f32,
    /// Coulomb's coefficient of friction, zero or more.
    pub friction: f32,
    /// Where it is.
    pub pose: supple_pose,
    /// Of a field: the bytes of its file, aligned to four, used where they are as long as the contact; else NULL.
    pub field: *const c_void,
    /// How many.
    pub field_bytes: usize,
}

/// What an instrument feels.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_touch {
    /// Force of the tissue on the instrument in the latest step, N.
    pub force: [f32; 3],
    /// Moment of the same about its position, N m.
    pub moment: [f32; 3],
    /// Mean of the force over the steps of the latest call that took steps, N; of steps that choose their length
    /// (supple_adaptive_advance, SUPPLE_STEPS_AUTO) that of the latest step.
    pub mean_force: [f32; 3],
    /// Nodes that it pushes or holds, and triangles.
    pub contacts: u32,
    /// How far the deepest one would have been inside without the instrument, m.
    pub depth: f32,
    /// Work that it did on the tissue in the latest step, J.
    pub work: f32,
    /// What friction took of the work of the instrument, J.
    pub friction_loss: f32,
}

/// Where an instrument pushes a node or a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_contact_point {
    /// m.
    pub position: [f32; 3],
    /// Outward normal of the instrument; zero where it holds the node.
    pub normal: [f32; 3],
    /// Force of the instrument on the tissue, N.
    pub force: [f32; 3],
    /// How far the point would have been inside without the instrument, m.
    pub depth: f32,
    /// From zero; of a triangle the corner with most of the force.
    pub node: u32,
    /// From zero.
    pub instrument: u32,
}

/// Instruments, the nodes that they can touch, and what a state keeps of them. It belongs to one state: save and
/// restore both, or prepare it again. One thread at a time; a call that takes steps changes it.
#[repr(C, align(64))]
pub struct supple_contact {
    head: Head,
    /// Of the scene, and of those that can be touched.
    nodes: u32,
    surface: u32,
    triangles: u32,
    grip_room: u32,
    grips: u32,
    instruments: u32,
    list: [Instrument<'static>; MOST_INSTRUMENTS],
    touches: [Touch; MOST_INSTRUMENTS],
    means: [[f32; 3]; MOST_INSTRUMENTS],
    points: [ContactPoint; POINTS],
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_contact {
    const MAGIC: [u8; 8] = magic(b'T');
    const FRONT: usize = size_of::<Self>();
}

/// How much room the arrays of a contact have.
#[derive(Clone, Copy)]
struct Room {
    nodes: u32,
    triangles: u32,
    grips: u32,
}

impl Room {
    const fn vectors(self) -> usize {
        vectors_to_push(self.nodes as usize, self.triangles as usize)
    }

    fn layout(self) -> Layout {
        Layout::of::<supple_contact>()
            .and::<SurfaceNode>(self.nodes as usize)
            .and::<[u32; 3]>(self.triangles as usize)
            .and::<Grip>(self.grips as usize)
            .and::<NodeVector>(self.vectors())
    }

    /// # Safety
    /// The arrays are those of a contact with so much room, and nobody else uses them.
    unsafe fn parts<'a>(self, mut arrays: Arrays) -> ContactArrays<'a> {
        // SAFETY: the caller's promise. Any bits are each of them.
        unsafe {
            ContactArrays {
                nodes: arrays.change(self.nodes as usize),
                triangles: arrays.change(self.triangles as usize),
                grips: arrays.change(self.grips as usize),
                pushes: arrays.change(self.vectors()),
            }
        }
    }
}

/// The arrays of a contact.
struct ContactArrays<'a> {
    nodes: &'a mut [SurfaceNode],
    triangles: &'a mut [[u32; 3]],
    grips: &'a mut [Grip],
    pushes: &'a mut [NodeVector],
}

impl supple_contact {
    pub(super) const fn nodes(&self) -> u32 {
        self.nodes
    }

    const fn room(&self) -> Room {
        Room { nodes: self.surface, triangles: self.triangles, grips: self.grip_room }
    }
}

/// Bytes of memory that a supple_contact needs for a surface of so many nodes and triangles, of which so many nodes can
/// be held at once.
#[unsafe(no_mangle)]
pub extern "C" fn supple_contact_size(nodes: u32, triangles: u32, grips: u32) -> usize {
    Room { nodes, triangles, grips }.layout().bytes()
}

/// Prepares a contact in `memory` of at least supple_contact_size bytes, aligned to SUPPLE_ALIGN: no instruments yet.
///
/// @param points the points that the scene was built from, three coordinates each (SUPPLE_E_POINTS).
/// @param surface what can be touched; it is copied. A triangle with a corner that belongs to no element, as those of tissue
/// that is removed, is refused (SUPPLE_E_MESH_UNUSED_NODE).
/// @param grips most nodes that instruments hold at once.
/// @param error may be NULL; index is the place in the nodes of `surface`, or that of a triangle with a corner that is
/// not among these nodes, twice the same, or of no element; of SUPPLE_E_POINTS that of an element.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_contact_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    points: *const f32,
    surface: *const supple_surface,
    grips: u32,
    contact: *mut *mut supple_contact,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let init = || unsafe {
        let (open, contact) = (OpenScene::of(scene)?, place_for(contact)?);
        let (nodes, surface) = (open.node_count(), one(surface)?);
        let points = array(points.cast(), nodes)?;
        let given = Given::new(surface, points)?;
        let room = Room { nodes: surface.node_count, triangles: surface.triangle_count, grips };
        let place = Place::new(memory, bytes, room.layout())?;
        given.check(|node| open.view().is_alone(node))?;
        open.has_points(points)?;
        let parts = room.parts(place.arrays::<supple_contact>());
        for (index, entry) in parts.nodes.iter_mut().enumerate() {
            *entry = given.node(index)?;
        }
        for (index, entry) in parts.triangles.iter_mut().enumerate() {
            *entry = given.corners(index)?;
        }
        parts.grips.fill(Grip::default());
        parts.pushes.fill(NodeVector::ZERO);
        contact.write(place.put(|head| supple_contact {
            head,
            nodes: nodes as u32,
            surface: room.nodes,
            triangles: room.triangles,
            grip_room: grips,
            grips: 0,
            instruments: 0,
            list: [Instrument::resting(Shape::Plane, Pose::at([0.0; 3])); MOST_INSTRUMENTS],
            touches: [Touch::default(); MOST_INSTRUMENTS],
            means: [[0.0; 3]; MOST_INSTRUMENTS],
            points: [ContactPoint::default(); POINTS],
        }));
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// Replaces all instruments by `count` others, which stand still where they are; none with a count of zero. What was
/// held is let go.
///
/// @param error may be NULL; index is that of an instrument.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_instruments(
    contact: *mut supple_contact,
    instruments: *const supple_instrument,
    count: u32,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let object = memory::change(contact)?;
        let given = array(instruments, count as usize)?;
        if count > SUPPLE_MOST_INSTRUMENTS {
            let error = supple_error::from(SUPPLE_E_CAPACITY);
            return Err(error.value(count.into(), SUPPLE_MOST_INSTRUMENTS.into()));
        }
        let mut list = object.list;
        for (index, (place, instrument)) in list.iter_mut().zip(given).enumerate() {
            *place = checked(instrument, index)?;
        }
        (object.list, object.instruments, object.grips) = (list, count, 0);
        object.touches = [Touch::default(); MOST_INSTRUMENTS];
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// # Safety
/// The bytes of a field stay.
pub(super) unsafe fn checked(given: &supple_instrument, index: usize) -> Answer<Instrument<'static>> {
    let &supple_instrument { shape, radius, length, friction, pose, field, field_bytes } = given;
    let shape = match shape {
        SUPPLE_PLANE => Shape::Plane,
        SUPPLE_SPHERE => Shape::Sphere { radius },
        SUPPLE_CAPSULE => Shape::Capsule { radius, length },
        SUPPLE_FIELD => {
            let damaged = supple_error::from(SUPPLE_E_FIELD).at(index);
            // SAFETY: the caller's promise.
            let bytes = unsafe { lasting_bytes(field, field_bytes) };
            Shape::Field(bytes.and_then(|bytes| Field::parse(bytes).map_err(|_| damaged)).map_err(|_| damaged)?)
        }
        other => return Err(supple_error::from(SUPPLE_E_CHOICE).at(index).value(other.into(), 0.0)),
    };
    let mut instrument = Instrument::resting(shape, pose_of(&pose));
    instrument.friction = friction;
    check(&instrument, index)?;
    Ok(instrument)
}

fn check(instrument: &Instrument<'_>, index: usize) -> Answer<()> {
    use crate::contact::ContactError;
    let refused = |value: f32| supple_error::from(SUPPLE_E_INSTRUMENT).at(index).value(value.into(), 0.0);
    Surface::new(&[], 0).and_then(|surface| Contact::new(surface, &[*instrument]).map(|_| ())).map_err(|error| {
        match error {
            ContactError::Instrument { value, .. } => refused(value),
            // Of a pose.
            _ => {
                let numbers = |pose: Pose| pose.position.into_iter().chain(pose.rotation);
                let mut all = [instrument.from, instrument.to].into_iter().flat_map(numbers);
                refused(all.find(|value| !value.is_finite()).unwrap_or(f32::NAN))
            }
        }
    })
}

fn pose_of(pose: &supple_pose) -> Pose {
    let &supple_pose { position, rotation } = pose;
    let largest = rotation.into_iter().fold(0.0_f32, |most, value| most.max(value.abs()));
    if rotation == [0.0; 4] {
        return Pose::at(position);
    }
    // Of any length: without its power of two, which rounds nothing, its square is neither zero nor infinite.
    let power = f32::from_bits(largest.to_bits() & f32::INFINITY.to_bits()).max(f32::MIN_POSITIVE);
    Pose { position, rotation: rotation.map(|value| value / power) }
}

/// Lets an instrument move on a line, and turn evenly, from where it is at the time `from` (s) to `pose` at the time
/// `to`, usually the times of the state now and at the end of the frame. Before and after it stands still; with `to` before
/// `from` it is there at once.
///
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_move_instrument(
    contact: *mut supple_contact,
    instrument: u32,
    pose: *const supple_pose,
    from: f64,
    to: f64,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let (object, pose) = (memory::change(contact)?, one(pose)?);
        let (index, count) = (instrument as usize, object.instruments);
        let Some(place) = object.list.get_mut(..count as usize).and_then(|list| list.get_mut(index)) else {
            return Err(missing(instrument, count));
        };
        let mut moved = *place;
        moved.move_to(pose_of(pose), from, to);
        check(&moved, index)?;
        *place = moved;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Lets an instrument hold the nodes of the surface that are nearer to it than `within` (m) now, where they are, as
/// forceps do; those that it or another one holds already it leaves as they are. They move with it, whatever force that
/// takes, until supple_let_go.
///
/// @param within zero or more (SUPPLE_E_NEGATIVE).
/// @param held may be NULL; receives how many nodes it holds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_grasp(
    contact: *mut supple_contact,
    state: *mut supple_state,
    instrument: u32,
    within: f32,
    held: *mut u32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let grasp = || unsafe {
        let held = memory::place_if_wanted(held)?;
        let (object, arrays) = memory::open(contact)?;
        let state = opened(state)?;
        if state.capacity() != object.nodes as usize {
            return Err(super::status::mismatch(state.capacity(), object.nodes as usize));
        }
        if !within.is_finite() {
            return Err(supple_error::from(SUPPLE_E_NOT_FINITE).value(within.into(), 0.0));
        }
        if within < 0.0 {
            return Err(supple_error::from(SUPPLE_E_NEGATIVE).value(within.into(), 0.0));
        }
        let list = object.list.get(..object.instruments as usize).unwrap_or_default();
        let tool = list.get(instrument as usize).ok_or(missing(instrument, object.instruments))?;
        let ContactArrays { nodes, grips, .. } = object.room().parts(arrays);
        let surface = Surface::new(nodes, object.nodes as usize).map_err(|_| supple_error::from(SUPPLE_E_INDEX))?;
        let near = || tool.grips(instrument, surface, state.displacements(), state.time(), within);
        let old = object.grips as usize;
        let is_held =
            |place: u32, grips: &[Grip], count: usize| grips.iter().take(count).any(|grip| grip.place == place);
        let new = near().filter(|grip| !is_held(grip.place, grips, old)).count();
        if old + new > grips.len() {
            let error = supple_error::from(SUPPLE_E_CAPACITY);
            return Err(error.value((old + new) as f64, grips.len() as f64));
        }
        for grip in near() {
            if !is_held(grip.place, grips, object.grips as usize) {
                insert(grips, &mut object.grips, grip);
            }
        }
        let all = grips.iter().take(object.grips as usize);
        if let Some(held) = held {
            held.write(all.filter(|grip| grip.instrument == instrument).count() as u32);
        }
        Ok(SUPPLE_OK)
    };
    status_of(grasp())
}

fn missing(instrument: u32, instruments: u32) -> supple_error {
    supple_error::from(SUPPLE_E_CAPACITY).value(instrument.into(), instruments.into())
}

/// Inserts a grip in the order of the places; there is room for it.
fn insert(grips: &mut [Grip], count: &mut u32, grip: Grip) {
    let mut at = *count as usize;
    while let Some(before) = at.checked_sub(1).and_then(|before| grips.get(before)).copied()
        && before.place > grip.place
    {
        if let Some(place) = grips.get_mut(at) {
            *place = before;
        }
        at -= 1;
    }
    if let Some(place) = grips.get_mut(at) {
        *place = grip;
        *count += 1;
    }
}

/// Lets a contact go on where another one is, of a scene of the same nodes: with its instruments where they are, and the
/// nodes that these hold, as far as they are in the new surface and the scene has elements around them. Nothing touches
/// yet. For a surface that has changed, as after a resection.
///
/// @param scene of the new contact.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_contact_carry_on(
    contact: *mut supple_contact,
    scene: *const supple_scene,
    from: *mut supple_contact,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let go_on = || unsafe {
        let open = OpenScene::of(scene)?;
        memory::is(from.cast_const())?;
        if contact == from {
            return Err(supple_error::from(SUPPLE_E_OVERLAP));
        }
        let ((object, arrays), (old, before)) = (memory::open(contact)?, memory::open(from)?);
        open.fits(object.nodes)?;
        open.fits(old.nodes)?;
        let (parts, former) = (object.room().parts(arrays), old.room().parts(before));
        let held = former.grips.get(..old.grips as usize).unwrap_or_default();
        let still = || {
            held.iter().filter_map(|grip| {
                let node = former.nodes.get(grip.place as usize)?.node;
                let place = parts.nodes.iter().position(|entry| entry.node == node)? as u32;
                (!open.view().is_alone(node as usize)).then_some(Grip { place, ..*grip })
            })
        };
        let count = still().count();
        if count > parts.grips.len() {
            return Err(supple_error::from(SUPPLE_E_CAPACITY).value(count as f64, parts.grips.len() as f64));
        }
        copy(&mut object.list, &old.list);
        (object.instruments, object.grips) = (old.instruments, 0);
        for grip in still() {
            insert(parts.grips, &mut object.grips, grip);
        }
        object.touches = [Touch::default(); MOST_INSTRUMENTS];
        object.means = [[0.0; 3]; MOST_INSTRUMENTS];
        parts.pushes.fill(NodeVector::ZERO);
        Ok(SUPPLE_OK)
    };
    status_of(go_on())
}

/// Lets go what an instrument holds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_let_go(contact: *mut supple_contact, instrument: u32) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let let_go = || unsafe {
        let (object, arrays) = memory::open(contact)?;
        let ContactArrays { grips, .. } = object.room().parts(arrays);
        if instrument >= object.instruments {
            return Err(missing(instrument, object.instruments));
        }
        let mut end = 0;
        for at in 0..object.grips as usize {
            if let Some(grip) = grips.get(at).copied().filter(|grip| grip.instrument != instrument)
                && let Some(place) = grips.get_mut(end)
            {
                *place = grip;
                end += 1;
            }
        }
        object.grips = end as u32;
        Ok(SUPPLE_OK)
    };
    status_of(let_go())
}

/// What an instrument felt in the latest steps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_read_touch(
    contact: *const supple_contact,
    instrument: u32,
    touch: *mut supple_touch,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let read = || unsafe {
        let (object, place) = (memory::read(contact)?, place_for(touch)?);
        let index = instrument as usize;
        let touches = object.touches.get(..object.instruments as usize).unwrap_or_default();
        let (Some(&touch), Some(&mean_force)) = (touches.get(index), object.means.get(index)) else {
            return Err(missing(instrument, object.instruments));
        };
        let Touch { force, moment, contacts, depth, work, friction_loss } = touch;
        place.write(supple_touch { force, moment, mean_force, contacts, depth, work, friction_loss });
        Ok(SUPPLE_OK)
    };
    status_of(read())
}

/// Writes where instruments push in the latest step: at most `room` points, and SUPPLE_MOST_CONTACT_POINTS.
///
/// @param count receives how many were written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_contact_points(
    contact: *const supple_contact,
    points: *mut supple_contact_point,
    room: u32,
    count: *mut u32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let read = || unsafe {
        let (object, count) = (memory::read(contact)?, place_for(count)?);
        let all: u32 = object.touches.iter().map(|touch| touch.contacts).sum();
        let written = (all.min(room) as usize).min(POINTS);
        if written > 0 {
            place_for(points)?;
        }
        for (index, point) in object.points.iter().take(written).enumerate() {
            let &ContactPoint { position, normal, force, depth, node, instrument } = point;
            points.add(index).write(supple_contact_point { position, normal, force, depth, node, instrument });
        }
        count.write(written as u32);
        Ok(SUPPLE_OK)
    };
    status_of(read())
}

/// The contact of one call that takes steps.
pub(super) struct CallContact<'a> {
    #[cfg_attr(not(feature = "contact"), expect(dead_code))]
    pub(super) contact: Contact<'a>,
    /// What its state keeps, until it is attached.
    pushes: &'a mut [NodeVector],
    touches: &'a mut [Touch],
    points: &'a mut [ContactPoint],
    means: &'a mut [[f32; 3]; MOST_INSTRUMENTS],
    steps: f32,
}

/// What instruments felt so far in a call: means of the forces (N) over so many steps.
#[derive(Clone, Copy, Default)]
pub(super) struct Felt {
    means: [[f32; 3]; MOST_INSTRUMENTS],
    steps: f32,
}

impl<'a> CallContact<'a> {
    /// Of an object, or none.
    ///
    /// # Safety
    /// As at [`memory::change`].
    pub(super) unsafe fn of(contact: *mut supple_contact, nodes: usize) -> Answer<Option<Self>> {
        if contact.is_null() || !cfg!(feature = "contact") {
            return Ok(None);
        }
        // SAFETY: the caller's promise.
        let (object, arrays) = unsafe { memory::open(contact)? };
        // SAFETY: as above.
        let parts = unsafe { object.room().parts(arrays) };
        let supple_contact { grips, instruments, list, touches, means, points, .. } = object;
        let wrong = |_| supple_error::from(SUPPLE_E_MISMATCH);
        let surface = Surface::new(parts.nodes, nodes)
            .and_then(|surface| surface.with_triangles(parts.triangles))
            .map_err(wrong)?;
        let list = list.get(..*instruments as usize).unwrap_or_default();
        let grips = parts.grips.get(..*grips as usize).unwrap_or_default();
        let contact = Contact::new(surface, list).and_then(|contact| contact.gripping(grips)).map_err(wrong)?;
        Ok(Some(Self { contact, pushes: parts.pushes, touches, points, means, steps: 0.0 }))
    }

    #[cfg(feature = "contact")]
    pub(super) fn has_instruments(&self) -> bool {
        !self.contact.instruments().is_empty()
    }

    /// The state with what it keeps.
    pub(super) fn attached(&mut self, state: StateView<'a>) -> StateView<'a> {
        let (pushes, touches, points) = (take(&mut self.pushes), take(&mut self.touches), take(&mut self.points));
        state.pushing(pushes).feeling(touches).listing(points)
    }

    pub(super) fn felt(&self) -> Felt {
        Felt { means: *self.means, steps: self.steps }
    }

    /// Steps are taken back.
    pub(super) fn take_back(&mut self, felt: &Felt) {
        (*self.means, self.steps) = (felt.means, felt.steps);
    }

    /// Enters the forces of a step in the means.
    pub(super) fn enter(&mut self, touches: &[Touch]) {
        if self.steps == 0.0 {
            // Not before: a guard's call takes none.
            self.means.fill([0.0; 3]);
        }
        self.steps += 1.0;
        for (mean, touch) in self.means.iter_mut().zip(touches) {
            for (mean, force) in mean.iter_mut().zip(touch.force) {
                *mean += (force - *mean) / self.steps;
            }
        }
    }
}
