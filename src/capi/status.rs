//! What became of a call: a number that is never given another meaning, a sentence for it, and where and with which
//! value it happened.

use core::ffi::{CStr, c_char};

use crate::element::PatchRow;
use crate::inertia::InertiaError;
use crate::learned::LearnedError;
use crate::loads::LoadError;
use crate::mesh::MeshError;
use crate::mlp::WeightError;
use crate::reaction::ReactionError;
use crate::scene::BuildError;
use crate::step::StepError;

use super::SUPPLE_NONE;

/// What became of a call. Zero: done. Positive: done, with a remark, the largest if there are several. Negative: not
/// done, and nothing has changed, except that memory handed to a function that prepares an object may hold none
/// afterwards, that forces are those of the step that was refused, or zero after a critical step, that a supple_large
/// keeps the inertia that a refused step had computed for other pulls, and what supple_learned_step says of a refused
/// one. Numbers are never given another meaning.
#[repr(i32)]
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
#[must_use]
pub enum supple_status {
    /// Done.
    SUPPLE_OK = 0,
    /// Steps were taken, but are not exact: elements are beyond the range of their law, there is more kinetic energy
    /// than loads and supports explain, or a step of a supple_large held much of the motion back. The report tells the
    /// first two, also where a larger remark hides them.
    SUPPLE_LIMITED = 1,
    /// Learned steps were taken, with more than one percent of the vertices outside what training has seen.
    SUPPLE_OUTSIDE = 2,
    /// Exact steps have taken the place of learned ones that were not to be believed. The network is tried again in
    /// later steps.
    SUPPLE_FELL_BACK = 3,
    /// A guard, automatic steps or supple_sim_advance estimate that the error is more than is allowed.
    SUPPLE_INEXACT = 4,
    /// The work that supple_sim_advance may take (`most_steps`) is spent before the end of the call; the report tells
    /// how much time is missing, and its estimate whether the steps were exact enough. Of supple_settle: the body is not
    /// at rest yet, and the report tells how far it is from it.
    SUPPLE_BEHIND = 5,

    /// A pointer that must not be NULL is.
    SUPPLE_E_NULL = -1,
    /// A pointer is not aligned: memory of objects to SUPPLE_ALIGN bytes, arrays to their elements.
    SUPPLE_E_MISALIGNED = -2,
    /// Fewer bytes or floats (value) than needed (limit).
    SUPPLE_E_SHORT = -3,
    /// struct_size or abi of a configuration (value) is not this library's (limit).
    SUPPLE_E_ABI = -4,
    /// The memory holds no object: it was never prepared, or the preparation failed.
    SUPPLE_E_NOT_INITIALISED = -5,
    /// The memory holds an object of another type.
    SUPPLE_E_KIND = -6,
    /// A number that stands for a choice (value) is none of the choices.
    SUPPLE_E_CHOICE = -7,
    /// Objects for scenes with other numbers of nodes, or lists of another length (value, limit); or a saved state of tissue that
    /// remembers other bytes (value) than that of the state (limit); or tissue `index` is to have another density (value,
    /// kg/m^3) than it has (limit).
    SUPPLE_E_MISMATCH = -8,
    /// More (value) than there is room for (limit).
    SUPPLE_E_CAPACITY = -9,
    /// Entry `index` of a list (elements, supports, forces, motions) names a node that is not there (node; limit:
    /// nodes).
    SUPPLE_E_INDEX = -10,
    /// Entry or node `index` has a number (value) that is NaN or infinite, or a coordinate of the mesh beyond 1e6 m.
    SUPPLE_E_NOT_FINITE = -11,
    /// Entry `index` has a ramp (value, s) that is negative or not finite; or a span of supple_sim_advance (s), which must be
    /// above zero; or as axis tells a tolerance (0; m), a damping (1; 1/s), a lead-in or a time of targets (2; s).
    SUPPLE_E_NEGATIVE = -12,
    /// An array that is written overlaps the object that is read.
    SUPPLE_E_OVERLAP = -13,
    /// The state was prepared for a scene of other elements (value: its own, limit: the scene's).
    SUPPLE_E_ELEMENT = -14,
    /// The points are not those that element `index` of the scene was built from.
    SUPPLE_E_POINTS = -15,
    /// There is no mesh in the file, for the reason that the words tell.
    #[cfg(feature = "io")]
    SUPPLE_E_FILE = -16,

    /// The mesh has no nodes or no elements.
    SUPPLE_E_MESH_EMPTY = -20,
    /// Element `index` names `node` twice.
    SUPPLE_E_MESH_REPEATED_NODE = -21,
    /// Element `index` is flat (value: volume, m^3).
    SUPPLE_E_MESH_DEGENERATE = -22,
    /// Element `index` has a negative volume (value, m^3) and winding is SUPPLE_WINDING_CHECKED.
    SUPPLE_E_MESH_INVERTED = -23,
    /// `node` belongs to no element; with index: it is a corner of that triangle of a contact.
    SUPPLE_E_MESH_UNUSED_NODE = -24,
    /// A constant of the law of element `index` (value) is not a finite positive number.
    SUPPLE_E_CONSTANT = -25,
    /// The density of element `index` (value, kg/m^3) is not a finite positive number.
    SUPPLE_E_DENSITY = -26,
    /// Element `index` is of a tissue that is not there.
    SUPPLE_E_TISSUE = -27,
    /// Every element has four fixed nodes.
    SUPPLE_E_NOTHING_MOVES = -28,
    /// The law (value) is not in this library.
    SUPPLE_E_LAW = -29,

    /// Motion `index` moves `node` along an axis on which no support that moves holds it.
    SUPPLE_E_NOT_HELD = -30,
    /// No step has been set: supple_set_step comes first; of a supple_sim: supple_sim_set was refused, call it again.
    SUPPLE_E_NO_STEP = -31,
    /// The step (value, s) is not a finite positive number.
    SUPPLE_E_STEP = -32,
    /// The step (value, s) is above the critical step (limit, s), which `node` sets.
    SUPPLE_E_UNSTABLE = -33,
    /// Instrument `index` has a size, friction or time (value), or a pose, that cannot be.
    SUPPLE_E_INSTRUMENT = -34,
    /// The field of instrument `index` is none, damaged, or reaches the rim of its grid.
    SUPPLE_E_FIELD = -35,
    /// Pull `index` has a point, radius, direction, target, stiffness or most force (value) that cannot be, no nodes, or weights
    /// whose sum (value) is not one (limit).
    SUPPLE_E_PULL = -36,
    /// No node is nearer to the point of pull `index` than its radius (value, m); the nearest is at the limit (m).
    SUPPLE_E_NO_NODES = -37,
    /// Tissue `index` relaxes by a share (value; axis: which term) that is no positive number, or without an axis by more
    /// in sum than may relax (limit).
    SUPPLE_E_RELAXATION_SHARE = -38,
    /// Tissue `index` relaxes with a time (value, s; axis: which term) that is not from 1e-6 to 1e6 s (limit: which of them).
    SUPPLE_E_RELAXATION_TIME = -39,

    /// Weights do not begin at a multiple of four bytes.
    SUPPLE_E_WEIGHTS_MISALIGNED = -40,
    /// Fewer bytes (value) than the weight file has (limit).
    SUPPLE_E_WEIGHTS_SHORT = -41,
    /// Not a weight file.
    SUPPLE_E_NOT_WEIGHTS = -42,
    /// A version of the weight format (value) that this library does not read.
    SUPPLE_E_WEIGHTS_VERSION = -43,
    /// The weights are damaged.
    SUPPLE_E_WEIGHTS_CHECKSUM = -44,
    /// A number in the weights (value; index: layer) is not one it can be.
    SUPPLE_E_WEIGHTS_CONTENT = -45,
    /// A network with other inputs (value) or outputs than are needed here.
    SUPPLE_E_WEIGHTS_SHAPE = -46,

    /// No lead-in and no learned step has brought the state to this moment: supple_learned_lead comes first.
    SUPPLE_E_NOT_LED = -50,
    /// The network's step (value, s) is no whole number of the exact one (limit, s), or of more than 65536.
    SUPPLE_E_STEP_RATIO = -51,
    /// The damping (value, 1/s) is not that of the training (limit, 1/s).
    SUPPLE_E_DAMPING = -52,

    /// A lattice of impossible cells: each count at least 1, SUPPLE_LATTICE_POINTS points and SUPPLE_LATTICE_FUNCTIONS
    /// functions at most. Or a mesh that is too small for a lattice of one cell: take exact steps.
    SUPPLE_E_LATTICE = -60,
    /// The state is not finite, or so stiff at `node` that no step can be bounded.
    SUPPLE_E_TOO_STIFF = -61,

    /// A constant of the fibres of tissue `index` (value; axis: its term, 0 for fibres, 1 for sheets, 2 for coupling) is not a
    /// finite positive number.
    SUPPLE_E_FIBRES = -65,
    /// The directions of the fibres in element `index` are zero, not finite, or parallel where there are two. Or without an
    /// index: there are none (value) where so many (limit) are needed.
    SUPPLE_E_DIRECTION = -66,

    /// Not a saved state.
    SUPPLE_E_NOT_SAVED = -70,
    /// A saved state of a version (value) that this library does not read.
    SUPPLE_E_SAVED_VERSION = -71,
    /// The saved state is damaged.
    SUPPLE_E_SAVED_CHECKSUM = -72,

    /// This processor does not have these instructions.
    SUPPLE_E_LEVEL = -80,

    /// The grid of an image that cannot be: along `axis` an origin or a spacing (value, m); without an axis directions that
    /// are not orthonormal (value: by how much), or no points or too many (value).
    SUPPLE_E_GRID = -85,

    /// The step was not taken: a displacement, first of `node`, would not be a finite number.
    SUPPLE_E_DIVERGED = -90,
    /// The step was not taken: the kinetic energy (value, J), most of it at `node`, is several times what loads and
    /// supports ever gave (limit, J).
    SUPPLE_E_DIVERGED_ENERGY = -91,
    /// The step was not taken: force `index` (value, N) would move `node` in it through the tissue around it (limit:
    /// its size, m).
    SUPPLE_E_DIVERGED_FORCE = -92,
    /// The step was not taken: supports moved `node` by too much in the step before (value, m) for the tissue around it
    /// (limit: its size, m).
    SUPPLE_E_DIVERGED_MOTION = -93,
    /// The step was not taken: instrument `index` would move farther in it, or is farther inside the body at a node,
    /// (value, m) than it may (limit): start outside, move slower.
    SUPPLE_E_DIVERGED_INSTRUMENT = -94,
    /// The step was not taken: learned steps cannot meet instruments.
    SUPPLE_E_NO_CONTACT = -95,
    /// The step was not taken: learned steps do not know pulls.
    SUPPLE_E_NO_PULLS = -96,
    /// The step was not taken: learned steps do not know tissue that relaxes or has fibres. Or a state remembers more or
    /// fewer bytes (value) than the tissue of the scene needs (limit): supple_state_carry_on, or another state.
    SUPPLE_E_NO_RELAXATION = -97,
    /// The step was not taken: the pressure on surface `index` (value, Pa) would move `node` in it through the tissue
    /// around it (limit: its size, m).
    SUPPLE_E_DIVERGED_PRESSURE = -98,
    /// Surface `index` is to be filled, but is open or has no triangles: it has no volume.
    SUPPLE_E_OPEN_SURFACE = -99,
}

use supple_status::*;

/// Where and with which value something went wrong. What does not apply is SUPPLE_NONE or zero.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_error {
    /// What the function returned.
    pub status: supple_status,
    /// Position in a list, or number of an element, from zero.
    pub index: u32,
    /// Number of a node, from zero.
    pub node: u32,
    /// 0, 1, 2 for x, y, z; or of a tissue that relaxes or has fibres for the terms of these; or as the status says.
    pub axis: u32,
    /// The offending value; its unit stands with the status.
    pub value: f64,
    /// What it may be at most, or should be.
    pub limit: f64,
}

pub(super) type Answer<T> = Result<T, supple_error>;

impl From<supple_status> for supple_error {
    fn from(status: supple_status) -> Self {
        Self { status, ..Self::NONE }
    }
}

impl supple_error {
    pub(super) const NONE: Self =
        Self { status: SUPPLE_OK, index: SUPPLE_NONE, node: SUPPLE_NONE, axis: SUPPLE_NONE, value: 0.0, limit: 0.0 };

    pub(super) fn value(self, value: f64, limit: f64) -> Self {
        Self { value, limit, ..self }
    }

    pub(super) fn at(self, index: usize) -> Self {
        Self { index: index as u32, ..self }
    }

    pub(super) fn node(self, node: u32) -> Self {
        Self { node, ..self }
    }

    pub(super) fn axis(self, axis: usize) -> Self {
        Self { axis: axis as u32, ..self }
    }
}

/// The status of a call that tells no more.
pub(super) fn status_of(answer: Answer<supple_status>) -> supple_status {
    answer.unwrap_or_else(|error| error.status)
}

/// Fewer than needed.
pub(super) fn short(there: usize, needed: usize) -> supple_error {
    supple_error::from(SUPPLE_E_SHORT).value(there as f64, needed as f64)
}

/// What of a call is negative or not finite, where it has several such numbers: the axis of the error.
#[derive(Clone, Copy)]
pub(super) enum Quantity {
    Tolerance,
    Damping,
    Time,
}

/// Negative, or not finite.
pub(super) fn negative(quantity: Quantity, value: f64) -> supple_error {
    supple_error::from(SUPPLE_E_NEGATIVE).axis(quantity as usize).value(value, 0.0)
}

/// Objects of other sizes.
pub(super) fn mismatch(there: usize, needed: usize) -> supple_error {
    supple_error::from(SUPPLE_E_MISMATCH).value(there as f64, needed as f64)
}

impl From<MeshError> for supple_error {
    fn from(error: MeshError) -> Self {
        let is = Self::from;
        match error {
            MeshError::Empty => is(SUPPLE_E_MESH_EMPTY),
            MeshError::IndexOutOfRange { element, node, nodes } => {
                is(SUPPLE_E_INDEX).at(element).node(node).value(node.into(), nodes as f64)
            }
            MeshError::RepeatedNode { element, node } => is(SUPPLE_E_MESH_REPEATED_NODE).at(element).node(node),
            MeshError::NotFinite { node, axis, value } => {
                is(SUPPLE_E_NOT_FINITE).at(node).node(node as u32).axis(axis).value(value.into(), 0.0)
            }
            MeshError::Degenerate { element, volume, .. } => {
                is(SUPPLE_E_MESH_DEGENERATE).at(element).value(volume, 0.0)
            }
            MeshError::Inverted { element, volume } => is(SUPPLE_E_MESH_INVERTED).at(element).value(volume, 0.0),
            MeshError::Table { places, nodes } => mismatch(places, nodes),
            MeshError::UnusedNode { node } => is(SUPPLE_E_MESH_UNUSED_NODE).node(node as u32),
            MeshError::Marks { marks, elements } => mismatch(marks, elements),
        }
    }
}

impl From<BuildError> for supple_error {
    fn from(error: BuildError) -> Self {
        let is = Self::from;
        let room = |needed: usize, capacity: usize| is(SUPPLE_E_CAPACITY).value(needed as f64, capacity as f64);
        match error {
            BuildError::Mesh(error) => error.into(),
            BuildError::NodeCapacity { needed, capacity } | BuildError::TileCapacity { needed, capacity } => {
                room(needed, capacity)
            }
            BuildError::ElementCount { elements, most } => room(elements, most),
            BuildError::SupportNode { support, node, nodes } => {
                is(SUPPLE_E_INDEX).at(support).node(node).value(node.into(), nodes as f64)
            }
            BuildError::NoTissue { element } => is(SUPPLE_E_TISSUE).at(element),
            BuildError::Constant { element, value, .. } => is(SUPPLE_E_CONSTANT).at(element).value(value.into(), 0.0),
            BuildError::Density { element, value } => is(SUPPLE_E_DENSITY).at(element).value(value.into(), 0.0),
            BuildError::PatchCapacity { needed, capacity } => {
                let bytes = |rows: usize| rows.saturating_mul(size_of::<PatchRow>());
                short(bytes(capacity), bytes(needed))
            }
            BuildError::FibreCapacity { needed, capacity } => room(needed, capacity),
            BuildError::DirectionCount { directions, elements } => {
                is(SUPPLE_E_DIRECTION).value(directions as f64, elements as f64)
            }
            BuildError::PointMass { node, kilogram, .. } => {
                is(SUPPLE_E_NEGATIVE).node(node as u32).value(kilogram.into(), 0.0)
            }
            BuildError::Direction { element, .. } => is(SUPPLE_E_DIRECTION).at(element),
            BuildError::NothingMoves => is(SUPPLE_E_NOTHING_MOVES),
        }
    }
}

impl From<LoadError> for supple_error {
    fn from(error: LoadError) -> Self {
        let is = Self::from;
        match error {
            LoadError::Node { index, node, nodes, .. } => {
                is(SUPPLE_E_INDEX).at(index).node(node).value(node.into(), nodes as f64)
            }
            LoadError::NotFinite { index, value, .. } => is(SUPPLE_E_NOT_FINITE).at(index).value(value.into(), 0.0),
            LoadError::Ramp { index, value, .. } => is(SUPPLE_E_NEGATIVE).at(index).value(value.into(), 0.0),
            LoadError::Filling { index, volume, bulk } => {
                is(SUPPLE_E_NEGATIVE).at(index).value(if bulk < 0.0 { bulk } else { volume }.into(), 0.0)
            }
            LoadError::Open { index } => is(SUPPLE_E_OPEN_SURFACE).at(index),
            LoadError::Surface { index, surface, surfaces } => {
                is(SUPPLE_E_CAPACITY).at(index).value(surface.into(), surfaces as f64)
            }
            LoadError::NotHeld { index, node, axis } => is(SUPPLE_E_NOT_HELD).at(index).node(node).axis(axis),
        }
    }
}

impl From<ReactionError> for supple_error {
    fn from(error: ReactionError) -> Self {
        let is = Self::from;
        match error {
            ReactionError::Capacity { needed, capacity } => short(capacity, needed),
            ReactionError::Empty => is(SUPPLE_E_NOT_HELD),
            ReactionError::Node { index, node, nodes } => {
                is(SUPPLE_E_INDEX).at(index).node(node).value(node.into(), nodes as f64)
            }
            ReactionError::NotHeld { index, node } => is(SUPPLE_E_NOT_HELD).at(index).node(node),
            ReactionError::Damping { damping } => negative(Quantity::Damping, damping.into()),
        }
    }
}

impl From<StepError> for supple_error {
    fn from(error: StepError) -> Self {
        let is = Self::from;
        match error {
            StepError::Step { seconds } => is(SUPPLE_E_STEP).value(seconds.into(), 0.0),
            StepError::Damping { damping } => negative(Quantity::Damping, damping.into()),
            StepError::AboveCritical { seconds, critical } => {
                is(SUPPLE_E_UNSTABLE).node(critical.node).value(seconds.into(), critical.seconds.into())
            }
        }
    }
}

impl From<WeightError> for supple_error {
    fn from(error: WeightError) -> Self {
        let is = Self::from;
        let content = |layer: u32, value: f64| is(SUPPLE_E_WEIGHTS_CONTENT).at(layer as usize).value(value, 0.0);
        match error {
            WeightError::Misaligned => is(SUPPLE_E_WEIGHTS_MISALIGNED),
            WeightError::Short { needed, bytes } => is(SUPPLE_E_WEIGHTS_SHORT).value(bytes as f64, needed as f64),
            WeightError::NotWeights => is(SUPPLE_E_NOT_WEIGHTS),
            WeightError::Version { version } => is(SUPPLE_E_WEIGHTS_VERSION).value(version.into(), 0.0),
            WeightError::Checksum { stated, found } => is(SUPPLE_E_WEIGHTS_CHECKSUM).value(found.into(), stated.into()),
            WeightError::Header { value, .. } => is(SUPPLE_E_WEIGHTS_CONTENT).value(value.into(), 0.0),
            WeightError::Range { index, range, .. } => content(index, range.scale.into()),
            WeightError::Layer { layer, value, .. } => content(layer, value.into()),
            WeightError::Slope { layer, slope } => content(layer, slope.into()),
            WeightError::Number { layer, value, .. } => content(layer, value.into()),
            WeightError::Scale { layer, value, .. } => content(layer, value.into()),
            WeightError::NotFinite { layer, .. } => content(layer, f64::NAN),
            WeightError::Padding { layer, .. } => content(layer, 0.0),
            WeightError::Recipe { length, .. } => is(SUPPLE_E_WEIGHTS_CONTENT).value(length.into(), 0.0),
        }
    }
}

impl From<LearnedError> for supple_error {
    fn from(error: LearnedError) -> Self {
        let is = Self::from;
        match error {
            LearnedError::Shape { inputs, outputs } => is(SUPPLE_E_WEIGHTS_SHAPE).value(inputs as f64, outputs as f64),
            LearnedError::Damping { exact, trained } => is(SUPPLE_E_DAMPING).value(exact.into(), trained.into()),
            LearnedError::StepRatio { exact, learned } => is(SUPPLE_E_STEP_RATIO).value(learned.into(), exact.into()),
            LearnedError::NotLed { .. } => is(SUPPLE_E_NOT_LED),
        }
    }
}

impl From<InertiaError> for supple_error {
    fn from(error: InertiaError) -> Self {
        let is = Self::from;
        match error {
            InertiaError::Capacity { needed, capacity, .. } => short(capacity, needed),
            InertiaError::Cells { .. }
            | InertiaError::Functions { .. }
            | InertiaError::Singular { .. }
            | InertiaError::TooSmall { .. } => is(SUPPLE_E_LATTICE),
            InertiaError::Points { points, nodes } => mismatch(points, nodes),
            InertiaError::OtherPoints { element } => Self::from(SUPPLE_E_POINTS).at(element),
            InertiaError::Step { seconds, most } => is(SUPPLE_E_STEP).value(seconds.into(), most.into()),
            InertiaError::NotFinite { node } => is(SUPPLE_E_TOO_STIFF).node(node),
        }
    }
}

/// The sentence for a status, in English and without its numbers; for a number that is no status, that it is none.
/// Never NULL, and there for as long as the library is.
#[unsafe(no_mangle)]
pub extern "C" fn supple_status_text(status: i32) -> *const c_char {
    text(status).unwrap_or(c"not a status of this library").as_ptr()
}

fn text(status: i32) -> Option<&'static CStr> {
    Some(match status {
        0 => c"done",
        1 => c"steps were taken, but are not exact",
        2 => c"learned steps were taken, with inputs outside what training has seen",
        3 => c"exact steps have taken the place of learned ones that were not to be believed",
        4 => c"the error is estimated to be more than is allowed",
        5 => c"the work that a call may take is spent before its end",
        -1 => c"a pointer is NULL",
        -2 => c"a pointer is not aligned",
        -3 => c"fewer bytes or floats than needed",
        -4 => c"a configuration of another version of the interface",
        -5 => c"the memory holds no object",
        -6 => c"the memory holds an object of another type",
        -7 => c"not one of the choices",
        -8 => c"objects of scenes with other nodes, a list of another length, or tissue of another density or that remembers other things",
        -9 => c"more than there is room for",
        -10 => c"a node that does not exist",
        -11 => c"a number is not finite, or a coordinate is beyond 1e6 m",
        -12 => c"a number is negative or not finite",
        -13 => c"an array that is written overlaps the object that is read",
        -14 => c"the state was prepared for a scene of other elements",
        -15 => c"points that the scene was not built from",
        #[cfg(feature = "io")]
        -16 => c"there is no mesh in the file",
        -20 => c"the mesh has no elements",
        -21 => c"an element names a node twice",
        -22 => c"an element is flat",
        -23 => c"an element has a negative volume",
        -24 => c"a node belongs to no element",
        -25 => c"a constant of the law is not a finite positive number",
        -26 => c"a density is not a finite positive number",
        -27 => c"an element is of a tissue that does not exist",
        -28 => c"all nodes of all elements are fixed, so nothing can move",
        -29 => c"the law is not in this library",
        -30 => c"a motion along an axis that no moving support holds",
        -31 => c"no step has been set",
        -32 => c"the step is not a finite positive number",
        -33 => c"the step is above the critical step",
        -34 => c"an instrument with a size, friction, time or pose that cannot be",
        -35 => c"the bytes of an instrument's field are none, or damaged",
        -36 => c"a pull with a point, radius, direction, target, stiffness or most force that cannot be, without nodes, or with weights that do not sum up to one",
        -37 => c"no node is nearer to the point of a pull than its radius",
        -38 => c"a tissue relaxes by a share that is not positive, or by more than may relax in sum",
        -39 => c"a tissue relaxes with a time that is not between a microsecond and a million seconds",
        -40 => c"the weights are not at a multiple of four bytes",
        -41 => c"the weights are shorter than their file says",
        -42 => c"not a weight file",
        -43 => c"a version of the weight format that this library does not read",
        -44 => c"the weights are damaged",
        -45 => c"a number in the weights is not one it can be",
        -46 => c"a network with other inputs or outputs than are needed here",
        -50 => c"the learned step needs a lead-in up to this moment",
        -51 => c"the network's step is no whole number of the exact one, or of too many",
        -52 => c"the damping is not that of the training",
        -60 => c"no lattice for steps of this length on this mesh: shorter or somewhat longer steps, or fewer cells, may serve, exact steps do",
        -61 => c"too stiff, or not finite",
        -65 => c"a constant of fibres is not a finite positive number",
        -66 => c"the directions of the fibres in an element are zero, parallel or missing",
        -70 => c"not a saved state",
        -71 => c"a saved state of another version",
        -72 => c"the saved state is damaged",
        -80 => c"this processor does not have these instructions",
        -85 => c"the grid of an image that cannot be: its origin, spacing, directions or number of points",
        -90 => c"diverged: a displacement would not be a finite number",
        -91 => c"diverged: more kinetic energy than loads and supports can have given",
        -92 => c"the step was not taken: a force would move its node through the tissue around it",
        -93 => c"the step was not taken: supports moved a node too far in one step",
        -94 => c"the step was not taken: an instrument moves too far in one step, or is too far inside the body: slower, shorter steps, or start outside",
        -98 => c"the step was not taken: a pressure would move a node through its tissue",
        -99 => c"the surface is open, so it has no volume to be filled to: add the triangles that close it",
        -95 => c"the step was not taken: this kind of step cannot meet instruments",
        -96 => c"the step was not taken: this kind of step does not know pulls",
        -97 => c"learned steps do not know tissue that relaxes or has fibres, or the state has no memory for what tissue remembers",
        _ => return None,
    })
}
