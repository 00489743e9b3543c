//! Pulls of points of the tissue to targets, for C ([`crate::pulls`]).

use core::ffi::c_void;
use core::mem::take;

use crate::pulls::{self, Pull, PullError, Pulled, PulledNode, Pulls, let_go, patch, usual_most};
use crate::state::{NodeVector, StateView};

use super::loads::supple_loads;
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, one, place_for};
use super::scene::{OpenScene, supple_scene};
use super::state::{opened, supple_state};
use super::status::{Answer, Quantity, mismatch, negative, status_of, supple_error, supple_status};
use supple_status::*;

/// How a point is pulled.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_pull {
    /// The point at rest, m.
    pub at: [f32; 3],
    /// Nodes no farther than that are pulled, m; not used by supple_add_pull_of_nodes.
    pub radius: f32,
    /// N/m, from 0, absent, to 1e6.
    pub stiffness: f32,
    /// The most force, N, infinite for no limit; zero: a quarter of the shear modulus on the area in which its nodes hang together with other
    /// tissue, half of that for fewer than eight nodes. More tears the tissue.
    pub most: f32,
    /// The direction along which it pulls, of any length, as the normal of a surface on which the point slides; zeros: along all.
    pub along: [f32; 3],
}

/// Where a pulled point is.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_pulled {
    /// m.
    pub point: [f32; 3],
    /// From the point to the target, m; along the direction of a pull that has one; zero for one without a target.
    pub gap: [f32; 3],
    /// On the tissue in the latest step, N.
    pub force: [f32; 3],
}

/// Pulls of a scene, with their targets. They belong to one state. One thread at a time; a call that takes steps changes
/// them.
#[repr(C, align(64))]
pub struct supple_pulls {
    head: Head,
    /// Of the scene.
    scene_nodes: u32,
    pull_room: u32,
    node_room: u32,
    pulls: u32,
    nodes: u32,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_pulls {
    const MAGIC: [u8; 8] = magic(b'U');
    const FRONT: usize = 64;
}

/// Bytes before the arrays of pulls.
pub const SUPPLE_PULLS_FRONT: usize = 64;
const _: () = assert!(SUPPLE_PULLS_FRONT == <supple_pulls as Object>::FRONT);

fn layout(pulls: u32, nodes: u32) -> Layout {
    Layout::of::<supple_pulls>()
        .and::<PulledNode>(nodes as usize)
        .and::<Pull>(pulls as usize)
        .and::<NodeVector>(pulls as usize)
}

/// The arrays of pulls.
struct PullArrays<'a> {
    nodes: &'a mut [PulledNode],
    pulls: &'a mut [Pull],
    forces: &'a mut [NodeVector],
}

impl supple_pulls {
    /// # Safety
    /// The arrays are those of this object, and nobody else uses them.
    unsafe fn parts<'a>(&self, mut arrays: Arrays) -> PullArrays<'a> {
        let pulls = self.pull_room as usize;
        // SAFETY: the caller's promise. Any bits are each of them.
        unsafe {
            PullArrays {
                nodes: arrays.change(self.node_room as usize),
                pulls: arrays.change(pulls),
                forces: arrays.change(pulls),
            }
        }
    }

    /// A state with as many nodes as the scene of these pulls.
    ///
    /// # Safety
    /// As at [`opened`].
    unsafe fn state<'a>(&self, state: *mut supple_state) -> Answer<StateView<'a>> {
        // SAFETY: the caller's promise.
        let state = unsafe { opened(state)? };
        let (nodes, needed) = (state.capacity(), self.scene_nodes as usize);
        if nodes == needed { Ok(state) } else { Err(mismatch(nodes, needed)) }
    }
}

/// Bytes of memory that so many pulls need, of so many nodes in sum. SUPPLE_PULLS_SIZE is the same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_pulls_size(pulls: u32, nodes: u32) -> usize {
    layout(pulls, nodes).bytes()
}

/// Prepares room for pulls in `memory` of at least supple_pulls_size bytes, aligned to SUPPLE_ALIGN: none yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_pulls_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    pulls: u32,
    nodes: u32,
    made: *mut *mut supple_pulls,
) -> supple_status {
    // SAFETY: what the header asks of the caller, here and below.
    let init = || unsafe {
        let (open, made) = (OpenScene::of(scene)?, place_for(made)?);
        let scene_nodes = open.node_count() as u32;
        let place = Place::new(memory, bytes, layout(pulls, nodes))?;
        let object = place.put(|head| supple_pulls {
            head,
            scene_nodes,
            pull_room: pulls,
            node_room: nodes,
            pulls: 0,
            nodes: 0,
        });
        let (object_of, arrays) = memory::open(object)?;
        let parts = object_of.parts(arrays);
        parts.nodes.fill(PulledNode::default());
        parts.pulls.fill(Pull::new([0; 2], [0.0; 3], 0.0));
        parts.forces.fill(NodeVector::ZERO);
        made.write(object);
        Ok(SUPPLE_OK)
    };
    status_of(init())
}

/// Lets pulls let go of nodes that belong to no element of the scene any more.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn let_go_of_removed(pulls: *mut supple_pulls, scene: &OpenScene<'_>) -> Answer<()> {
    if pulls.is_null() {
        return Ok(());
    }
    // SAFETY: the caller's promise.
    unsafe {
        let (object, arrays) = memory::open(pulls)?;
        let PullArrays { nodes, pulls, .. } = object.parts(arrays);
        pulls::let_go_of_removed(scene.view(), nodes, pulls.get_mut(..object.pulls as usize).unwrap_or_default());
        Ok(())
    }
}

/// Adds a pull on the nodes that are no farther from its point than its radius at rest: their mean displacement moves it. A patch of
/// some 24 nodes is a good one. It has no target yet: it is absent until supple_set_targets.
///
/// @param points the points that the scene was built from, three coordinates each (SUPPLE_E_POINTS).
/// @param error may be NULL; index is that of the pull, of SUPPLE_E_POINTS that of an element.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_add_pull(
    pulls: *mut supple_pulls,
    scene: *const supple_scene,
    points: *const f32,
    pull: *const supple_pull,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let add = || unsafe {
        let (object, arrays) = memory::open(pulls)?;
        let (given, open, first) = (one(pull)?, OpenScene::of(scene)?, object.nodes as usize);
        open.fits(object.scene_nodes)?;
        let points = array(points.cast::<[f32; 3]>(), object.scene_nodes as usize)?;
        open.has_points(points)?;
        let parts = object.parts(arrays);
        let room = parts.nodes.get_mut(first..).unwrap_or_default();
        let count = patch(points, |node| open.view().node_mass(node), given.at, given.radius, room).map_err(
            |error| match error {
                PullError::Capacity { needed, .. } => room_for(first + needed, object.node_room),
                other => refused(object.pulls as usize, other),
            },
        )?;
        added(object, &open, parts, given, count)
    };
    // SAFETY: as above.
    unsafe { memory::answered(add(), error) }
}

/// Adds a pull on `count` nodes with weights, which sum up to one, as supple_locate gives them for a point in an element. Other sums
/// are refused (SUPPLE_E_PULL): the point would move by more or less than its nodes.
///
/// @param error may be NULL; node is one that does not exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_add_pull_of_nodes(
    pulls: *mut supple_pulls,
    scene: *const supple_scene,
    nodes: *const u32,
    weights: *const f32,
    count: u32,
    pull: *const supple_pull,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let add = || unsafe {
        let (object, arrays) = memory::open(pulls)?;
        let (given, open, first) = (one(pull)?, OpenScene::of(scene)?, object.nodes as usize);
        let count = count as usize;
        open.fits(object.scene_nodes)?;
        let rows = array(nodes, count)?.iter().zip(array(weights, count)?);
        let parts = object.parts(arrays);
        let Some(room) = parts.nodes.get_mut(first..).and_then(|room| room.get_mut(..count)) else {
            return Err(room_for(first.saturating_add(count), object.node_room));
        };
        for (place, (&node, &weight)) in room.iter_mut().zip(rows) {
            *place = PulledNode { node, weight };
        }
        Pulls::new(object.scene_nodes as usize, room, &[]).map_err(|error| refused(object.pulls as usize, error))?;
        let sum = room.iter().fold(0.0_f32, |sum, pulled| sum + pulled.weight);
        if (sum - 1.0).abs() > ROUNDING {
            return Err(supple_error::from(SUPPLE_E_PULL).at(object.pulls as usize).value(sum.into(), 1.0));
        }
        added(object, &open, parts, given, count)
    };
    // SAFETY: as above.
    unsafe { memory::answered(add(), error) }
}

/// By so much a sum of weights may differ from one.
const ROUNDING: f32 = 1e-3;

/// A pull whose nodes are the next ones of the list.
fn added(
    object: &mut supple_pulls,
    scene: &OpenScene<'_>,
    parts: PullArrays<'_>,
    given: &supple_pull,
    count: usize,
) -> Answer<supple_status> {
    let (index, first) = (object.pulls as usize, object.nodes as usize);
    let nodes = parts.nodes.get_mut(first..first + count).unwrap_or_default();
    // Of removed tissue alone it pulls nothing that moves.
    let_go(scene.view(), nodes);
    let most = usual_most(scene.view(), nodes);
    let pull = checked(&object_pull(given, [object.nodes, count as u32], most), index, first + count)?;
    let place = parts.pulls.get_mut(index).ok_or(room_for(index + 1, object.pull_room))?;
    *place = Pull { to: [f32::NAN; 3], ..pull };
    (object.pulls, object.nodes) = (index as u32 + 1, (first + count) as u32);
    Ok(SUPPLE_OK)
}

fn object_pull(given: &supple_pull, nodes: [u32; 2], usual_most: f32) -> Pull {
    let &supple_pull { at, stiffness, most, along, .. } = given;
    let most = if most == 0.0 { usual_most } else { most };
    Pull { most, along, ..Pull::new(nodes, at, stiffness) }
}

fn checked(pull: &Pull, index: usize, nodes: usize) -> Answer<Pull> {
    pull.check(index, nodes).map_err(|error| refused(index, error))?;
    Ok(*pull)
}

fn room_for(needed: usize, room: u32) -> supple_error {
    supple_error::from(SUPPLE_E_CAPACITY).value(needed as f64, room.into())
}

fn refused(index: usize, error: PullError) -> supple_error {
    let is = supple_error::from;
    match error {
        PullError::Node { index, node, nodes } => {
            is(SUPPLE_E_INDEX).at(index).node(node).value(node.into(), nodes as f64)
        }
        PullError::Weight { index, value } => is(SUPPLE_E_NOT_FINITE).at(index).value(value.into(), 0.0),
        PullError::Range { count, .. } => is(SUPPLE_E_PULL).at(index).value(count as f64, 0.0),
        PullError::Value { value, .. } => is(SUPPLE_E_PULL).at(index).value(value.into(), 0.0),
        PullError::Nothing { radius, nearest } => is(SUPPLE_E_NO_NODES).at(index).value(radius.into(), nearest.into()),
        PullError::Capacity { needed, capacity } => is(SUPPLE_E_CAPACITY).value(needed as f64, capacity as f64),
    }
}

/// Replaces stiffness, most force (zero: as it is) and direction of a pull; its point and nodes stay.
///
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_pull(
    pulls: *mut supple_pulls,
    index: u32,
    pull: *const supple_pull,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let (object, arrays) = memory::open(pulls)?;
        let (given, at, all) = (one(pull)?, index as usize, object.nodes as usize);
        let parts = object.parts(arrays);
        let acting = parts.pulls.get_mut(..object.pulls as usize).unwrap_or_default();
        let missing = supple_error::from(SUPPLE_E_CAPACITY).value(index.into(), object.pulls.into());
        let place = acting.get_mut(at).ok_or(missing)?;
        let Pull { stiffness, most, along, .. } = checked(&object_pull(given, place.nodes, place.most), at, all)?;
        (place.stiffness, place.most, place.along) = (stiffness, most, along);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Sets the targets of all pulls, m, three coordinates each; of a pull whose first coordinate is NaN there is none: it is absent
/// until it has one again. A target moves evenly from where it is at the time `from` (s) to there at the time `to`, usually
/// the times of the state now and at the end of the frame; one that was absent is there at once, and with `to` before `from` all are.
///
/// @param error may be NULL; index is that of a pull; of a time that is not finite (SUPPLE_E_NEGATIVE) there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_targets(
    pulls: *mut supple_pulls,
    targets: *const f32,
    count: u32,
    from: f64,
    to: f64,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let all = memory::open(pulls)?.0.pulls;
        if count != all {
            return Err(mismatch(count as usize, all as usize));
        }
        set_targets(pulls, 0, targets, count, [from, to])
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// The same of `count` pulls from the one at `first` on; the targets of the others go on as they do.
///
/// @param error may be NULL; index is that of a pull.
#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)]
pub unsafe extern "C" fn supple_set_targets_from(
    pulls: *mut supple_pulls,
    first: u32,
    targets: *const f32,
    count: u32,
    from: f64,
    to: f64,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe { set_targets(pulls, first, targets, count, [from, to]) };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Sets some targets, if all can be.
///
/// # Safety
/// As at [`supple_set_targets_from`].
unsafe fn set_targets(
    pulls: *mut supple_pulls,
    first: u32,
    targets: *const f32,
    count: u32,
    [from, to]: [f64; 2],
) -> Answer<supple_status> {
    // SAFETY: the caller's promise.
    unsafe {
        let (object, arrays) = memory::open(pulls)?;
        let (targets, all) = (array(targets.cast::<[f32; 3]>(), count as usize)?, object.nodes as usize);
        let (first, there) = (first as usize, object.pulls as usize);
        let own = object.parts(arrays).pulls.get_mut(first..).and_then(|own| own.get_mut(..targets.len()));
        let own = own.ok_or_else(|| mismatch(first.saturating_add(targets.len()), there))?;
        if let Some(&time) = [from, to].iter().find(|time| !time.is_finite()) {
            return Err(negative(Quantity::Time, time));
        }
        for (index, (&pull, target)) in own.iter().zip(targets).enumerate() {
            let mut moved = pull;
            moved.move_to(*target, from, to);
            checked(&moved, first + index, all)?;
        }
        own.iter_mut().zip(targets).for_each(|(pull, target)| pull.move_to(*target, from, to));
        Ok(SUPPLE_OK)
    }
}

/// Turns the points of pulls with the body, as it is in a state: a host calls it between frames, and before it settles. The
/// nodes of a pull move its point by their mean. Near a surface, where they are all on one side of the point, its tissue
/// moves by more than that where the body turns: by 2 mm at 40 degrees with patches of 24 nodes 5 mm apart. A
/// pull that is turned for the first time is turned in full. Later a turn is entered bit by bit, as points that turn draw
/// the body on: while it moves in the longer a time, the less it is damped and the nearer the patches of all pulls are to each other (0.01 s for an
/// organ with pulls all around, at 20 1/s; without damping never), at rest by the part that converges where a host settles and
/// turns in turn, until `most` is small.
///
/// @param points the points that the scene was built from, three coordinates each. They are looked at in some elements only
/// (SUPPLE_E_POINTS).
/// @param most the largest change of a point that was entered, m; may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_turn_pulls(
    pulls: *mut supple_pulls,
    scene: *const supple_scene,
    points: *const f32,
    state: *mut supple_state,
    most: *mut f32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let turn = || unsafe {
        let (object, arrays) = memory::open(pulls)?;
        let (open, state) = (OpenScene::of(scene)?, object.state(state)?);
        open.fits(object.scene_nodes)?;
        let points = array(points.cast::<[f32; 3]>(), object.scene_nodes as usize)?;
        open.seems_to_have_points(points)?;
        let PullArrays { nodes, pulls, .. } = object.parts(arrays);
        let list = pulls.get_mut(..object.pulls as usize).unwrap_or_default();
        let mass = |node: usize| open.view().node_mass(node);
        let change = pulls::turn(points, mass, state.progress, state.displacements(), nodes, list);
        if !most.is_null() {
            most.write(change);
        }
        Ok(SUPPLE_OK)
    };
    status_of(turn())
}

/// Writes where the points of all pulls are in a state, how far from their targets, and the forces of the latest step.
/// SUPPLE_E_NOT_FINITE where nodes are so far away that one of these is no number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_read_pulls(
    pulls: *mut supple_pulls,
    state: *mut supple_state,
    pulled: *mut supple_pulled,
    count: u32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let read = || unsafe {
        let (object, arrays) = memory::open(pulls)?;
        let state = object.state(state)?;
        if count != object.pulls {
            return Err(mismatch(count as usize, object.pulls as usize));
        }
        if count > 0 {
            place_for(pulled)?;
        }
        let parts = object.parts(arrays);
        let list = parts.pulls.get(..count as usize).unwrap_or_default();
        let all = Pulls::unchecked(object.scene_nodes as usize, parts.nodes, list);
        let read =
            || (0..list.len()).filter_map(|index| all.read(index, state.displacements(), parts.forces, state.time()));
        let is_finite = |vectors: [[f32; 3]; 3]| vectors.as_flattened().iter().all(|value| value.is_finite());
        if let Some(index) = read().position(|Pulled { point, gap, force }| !is_finite([point, gap, force])) {
            return Err(supple_error::from(SUPPLE_E_NOT_FINITE).at(index));
        }
        for (index, Pulled { point, gap, force }) in read().enumerate() {
            pulled.add(index).write(supple_pulled { point, gap, force });
        }
        Ok(SUPPLE_OK)
    };
    status_of(read())
}

/// Lets pulls act together with these loads, as long as both are there; NULL: none. Learned steps refuse loads with pulls,
/// and a library without the feature `contact` refuses them here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_pulls(loads: *mut supple_loads, pulls: *mut supple_pulls) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let loads = memory::change(loads)?;
        if !pulls.is_null() {
            if !cfg!(feature = "contact") {
                return Err(SUPPLE_E_NO_PULLS.into());
            }
            let nodes = memory::read(pulls.cast_const())?.scene_nodes;
            if nodes != loads.nodes() {
                return Err(mismatch(nodes as usize, loads.nodes() as usize));
            }
        }
        loads.set_pulls(pulls);
        Ok(SUPPLE_OK)
    };
    status_of(set())
}

/// The pulls of one call that takes steps.
pub(super) struct CallPulls<'a> {
    #[cfg_attr(not(feature = "contact"), expect(dead_code))]
    pub(super) pulls: Pulls<'a>,
    /// Their forces, until they are attached to the state.
    forces: &'a mut [NodeVector],
}

impl<'a> CallPulls<'a> {
    /// Of an object, or none.
    ///
    /// # Safety
    /// As at [`memory::change`].
    pub(super) unsafe fn of(pulls: *mut supple_pulls, scene: &OpenScene<'_>) -> Answer<Option<Self>> {
        if pulls.is_null() || !cfg!(feature = "contact") {
            return Ok(None);
        }
        // SAFETY: the caller's promise.
        let (object, arrays) = unsafe { memory::open(pulls)? };
        scene.fits(object.scene_nodes)?;
        // SAFETY: as above.
        let PullArrays { nodes, pulls, forces, .. } = unsafe { object.parts(arrays) };
        let pulls = pulls.get(..object.pulls as usize).unwrap_or_default();
        Ok(Some(Self { pulls: Pulls::unchecked(object.scene_nodes as usize, nodes, pulls), forces }))
    }

    /// The state with room for their forces.
    pub(super) fn attached(&mut self, state: StateView<'a>) -> StateView<'a> {
        state.pulling(take(&mut self.forces))
    }
}
