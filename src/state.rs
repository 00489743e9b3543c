//! What moves: the displacement of each node (m) and what rounding has left out of it ([`crate::step`]), its last
//! increment (m), and the total force (N) that the latest step saw. A [`StateView`] borrows it, and every step works on
//! one; [`VecState`] owns it on a host with a heap (feature
//! `std`), [`FixedState`] without.
//!
//! The increment `u_n - u_(n-1)` is kept instead of `u_(n-1)`: in float32 the rounding of
//! `2 u_n - u_(n-1)` acts as a false spring to the ground (13.8 % after 20,000 steps of the paper's bar).

use core::num::NonZeroU64;
use core::ops::Deref;

use crate::contact::{ContactPoint, Touch};
#[cfg(any(feature = "std", test))]
use crate::contact::{MOST_INSTRUMENTS, Surface, vectors_to_push};
use crate::copy::copy;
use crate::element::{Extremes, forget_crushed};
use crate::energy_balance::EnergyBalance;
use crate::held_pulls::HeldPulls;
use crate::material::Element;
#[cfg(any(feature = "std", test))]
use crate::material::Material;
use crate::scattered::scattered;
#[cfg(any(feature = "std", test))]
use crate::scene::SceneView;
pub use crate::simd::NodeVector;

/// The velocity (m/s) of an increment (m) over a step of so many seconds; zero before the first step. A number, however short
/// the step.
pub(crate) fn velocity(increment: [f32; 3], seconds: f32) -> [f32; 3] {
    let of = |component: f32| if seconds > 0.0 { (component / seconds).clamp(-f32::MAX, f32::MAX) } else { 0.0 };
    increment.map(of)
}

/// Vectors of a node that a step moves: displacement, remainder, increment.
pub(crate) const MOVED_VECTORS: usize = 3;

/// How far a simulation has come, apart from its vectors.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Seconds since the start.
    pub(crate) time: f64,
    pub(crate) steps: u64,
    pub(crate) energy_balance: EnergyBalance,
    /// Step that the last increment spans, s; zero before the first step.
    pub(crate) dt: f32,
    /// Its damping, 1/s.
    pub(crate) damping: f32,
    /// At the start of the latest step.
    pub(crate) extremes: Extremes<f32>,
    /// Time of what tissue remembers before that of the state, s: half the last step.
    pub(crate) half: f32,
    /// Which of the two copies of what it remembers is that of now.
    pub(crate) second: bool,
    /// Steps keep it, and copies have it; a state that was restored, reset or put has none.
    pub(crate) seen: Option<Mark>,
    /// What the latest exact steps held back of pulls.
    pub(crate) pulls: HeldPulls,
}

/// Left by the guard that follows a state ([`crate::guard`]) at the moment at which it has seen it last: a state with
/// this mark has come from there.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub(crate) struct Mark(NonZeroU64);

impl Mark {
    pub(crate) const fn number(self) -> u64 {
        self.0.get()
    }
}

/// Tells a state from others that have taken as many steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moment {
    steps: u64,
    time: f64,
    kinetic: f64,
}

impl Moment {
    /// The same in one number.
    pub(crate) const fn mark(&self) -> Mark {
        let hash = scattered(scattered(self.steps.wrapping_add(1)) ^ self.time.to_bits());
        let hash = scattered(hash ^ self.kinetic.to_bits());
        Mark(NonZeroU64::MIN.saturating_add(hash))
    }
}

impl Progress {
    /// A guard sees the state as it is now.
    pub(crate) const fn mark(&mut self) -> Mark {
        let mark = self.moment().mark();
        self.seen = Some(mark);
        mark
    }

    pub(crate) const fn moment(&self) -> Moment {
        Moment { steps: self.steps, time: self.time, kinetic: self.energy_balance.kinetic }
    }

    /// At rest, at time zero.
    pub const START: Self = Self::resumed(0.0, 0, 0.0, EnergyBalance::NEW);

    /// A simulation that goes on from here; its displacements, remainders and increments are the caller's to restore.
    #[must_use]
    pub const fn resumed(time: f64, steps: u64, last_step: f32, energy_balance: EnergyBalance) -> Self {
        let (half, extremes) = (0.5 * last_step, Extremes::REST);
        Self {
            time,
            steps,
            energy_balance,
            dt: last_step,
            damping: 0.0,
            extremes,
            half,
            second: false,
            seen: None,
            pulls: HeldPulls::NONE,
        }
    }

    /// Length of the step that the last increment spans, s; zero before the first step.
    #[must_use]
    pub const fn last_step(&self) -> f32 {
        self.dt
    }

    /// Simulated time, s.
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.time
    }

    /// Steps taken.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        self.steps
    }

    /// Pulls that exact steps hold back, or have held back in the last 128 of them, if more than five in a row did
    /// ([`crate::pulls`]): the motion is another then. A target that jumps is followed sooner.
    #[must_use]
    pub const fn pulls_held_back(&self) -> u32 {
        self.pulls.for_long()
    }

    /// The energy balance.
    #[must_use]
    pub const fn energy_balance(&self) -> &EnergyBalance {
        &self.energy_balance
    }

    /// Smallest volume of an element over its volume at rest, at the start of the latest step that was taken; 1 before
    /// the first.
    #[must_use]
    pub const fn least_volume_ratio(&self) -> f32 {
        1.0 + self.extremes.least_change
    }

    /// Largest exponent over its cap, at the start of the latest step that was taken: above 1 the exponential law went
    /// on along its tangent. Zero for laws without.
    #[must_use]
    pub const fn saturation(&self) -> f32 {
        self.extremes.saturation
    }
}

/// A state over memory of whichever kind.
#[derive(Debug)]
pub struct StateView<'a> {
    pub(crate) displacement: &'a mut [NodeVector],
    /// What rounding has left out of the displacements, m.
    pub(crate) remainder: &'a mut [NodeVector],
    pub(crate) increment: &'a mut [NodeVector],
    pub(crate) force: &'a mut [NodeVector],
    /// Of scenes with nodal pressure; with nodal strain the marks of crushed elements ([`crate::element`]); empty for
    /// others.
    pub(crate) volume: &'a mut [NodeVector],
    pub(crate) progress: &'a mut Progress,
    /// What the instruments feel in the latest step.
    pub(crate) touches: &'a mut [Touch],
    /// Where they push.
    pub(crate) points: &'a mut [ContactPoint],
    /// Pushes of the instruments on the nodes of the surface, and room for the next.
    pub(crate) pushes: &'a mut [NodeVector],
    /// Forces of the pulls in the latest step, N.
    pub(crate) pulls: &'a mut [NodeVector],
    /// What tissue remembers, twice.
    pub(crate) memory: &'a mut [NodeVector],
}

impl Deref for StateView<'_> {
    type Target = Progress;

    fn deref(&self) -> &Progress {
        self.progress
    }
}

impl<'a> StateView<'a> {
    /// A state over the given vectors as they are: zeros mean at rest. Displacements and remainders add up to where the
    /// nodes are: what rounding leaves out of a displacement in a step is added in the next one. `volume` is as long as
    /// the others for scenes with [`NodalPressure`](crate::material::NodalPressure) or
    /// [`NodalStrain`](crate::material::NodalStrain), and may be empty for linear tetrahedra.
    pub const fn new(
        displacement: &'a mut [NodeVector],
        remainder: &'a mut [NodeVector],
        increment: &'a mut [NodeVector],
        force: &'a mut [NodeVector],
        volume: &'a mut [NodeVector],
        progress: &'a mut Progress,
    ) -> Self {
        let (touches, points, pushes): (&mut [_], &mut [_], &mut [_]) = (&mut [], &mut [], &mut []);
        let (pulls, memory): (&mut [_], &mut [_]) = (&mut [], &mut []);
        Self { displacement, remainder, increment, force, volume, progress, touches, points, pushes, pulls, memory }
    }

    /// The same state, whose steps write to `touches` what each instrument feels ([`crate::contact`]) in the latest
    /// step: nothing if it was refused. Of instruments beyond its length nothing is written.
    #[must_use]
    pub fn feeling(self, touches: &'a mut [Touch]) -> Self {
        Self { touches, ..self }
    }

    /// The same state, whose steps write to `points` where instruments push: as many as the touches have contacts in
    /// sum, or as there is room for; the rest is zero.
    #[must_use]
    pub fn listing(self, points: &'a mut [ContactPoint]) -> Self {
        Self { points, ..self }
    }

    /// The same state with [`crate::contact::vectors_to_push`] vectors that belong to it, for what instruments do:
    /// long steps need them, exact ones for triangles, and are faster with them. Zeros: nothing
    /// touches yet.
    #[must_use]
    pub fn pushing(self, pushes: &'a mut [NodeVector]) -> Self {
        Self { pushes, ..self }
    }

    /// The same state, whose steps write to `forces` with which force (N) each pull acts on the tissue ([`crate::pulls`]) in the
    /// latest step. Exact steps need one vector for each pull.
    #[must_use]
    pub fn pulling(self, forces: &'a mut [NodeVector]) -> Self {
        Self { pulls: forces, ..self }
    }

    /// The same state with [`SceneView::memory_vectors`](crate::scene::SceneView::memory_vectors) vectors that belong to
    /// it, for tissue that relaxes. Zeros: nothing has been deformed so far.
    #[must_use]
    pub fn remembering(self, memory: &'a mut [NodeVector]) -> Self {
        Self { memory, ..self }
    }

    /// The same state for a shorter time.
    pub const fn reborrow(&mut self) -> StateView<'_> {
        StateView {
            displacement: self.displacement,
            remainder: self.remainder,
            increment: self.increment,
            force: self.force,
            volume: self.volume,
            progress: self.progress,
            touches: self.touches,
            points: self.points,
            pushes: self.pushes,
            pulls: self.pulls,
            memory: self.memory,
        }
    }

    /// Displacement of each node, m.
    #[must_use]
    pub const fn displacements(&self) -> &[NodeVector] {
        self.displacement
    }

    /// What each instrument felt in the latest step, as far as the host wants to know.
    #[must_use]
    pub const fn touches(&self) -> &[Touch] {
        self.touches
    }

    /// How many nodes the vectors hold.
    #[must_use]
    pub fn capacity(&self) -> usize {
        let Self { displacement, remainder, increment, force, .. } = self;
        displacement.len().min(remainder.len()).min(increment.len()).min(force.len())
    }

    /// How many nodes of a scene of these elements the vectors hold.
    pub(crate) fn capacity_for(&self, element: Element) -> usize {
        let volumes = if element == Element::Linear { usize::MAX } else { self.volume.len() };
        self.capacity().min(volumes)
    }

    /// Makes the last increment span `seconds` at the velocity that it has. A step much shorter than the last goes on
    /// smoothly from here: it would count half the last step's acceleration into its own otherwise.
    pub fn respan(&mut self, seconds: f32) {
        let factor = if self.dt > 0.0 { seconds / self.dt } else { 1.0 };
        for increment in self.increment.iter_mut() {
            for component in &mut increment.0 {
                *component *= factor;
            }
        }
        self.progress.dt = seconds;
    }

    /// Exact steps follow: after steps beyond the critical one they would count half the acceleration of the last of these
    /// into their own, of nodes whose forces only added inertia bears.
    #[cfg(any(feature = "std", feature = "capi-neo-hookean"))]
    pub(crate) fn end_long_steps(&mut self, critical: crate::step::CriticalStep) {
        /// A step over the critical one that is not an exact one.
        const MUCH_LONGER: f32 = 2.0;
        if self.dt > MUCH_LONGER * critical.seconds {
            self.respan(critical.seconds);
        }
    }

    /// Puts the state where a method of the host's own has brought it at a time (s): `at` gives displacement and
    /// increment (m) of each node, which spans `seconds`. Number of steps and energy balance stay as they are.
    pub fn put(&mut self, time: f64, seconds: f32, at: impl Fn(usize) -> [[f32; 3]; 2]) {
        let vectors = self.displacement.iter_mut().zip(self.increment.iter_mut());
        for (node, (displacement, increment)) in vectors.enumerate() {
            [displacement.0, increment.0] = at(node).map(|[x, y, z]| [x, y, z, 0.0]);
        }
        self.remainder.fill(NodeVector::ZERO);
        self.forget();
        (self.progress.time, self.progress.dt, self.progress.seen) = (time, seconds, None);
        forget_crushed(self.volume);
    }

    /// Lets tissue that relaxes forget: nothing has been deformed so far.
    pub(crate) fn forget(&mut self) {
        self.memory.fill(NodeVector::ZERO);
    }

    /// What tissue remembers, and where the next step writes it.
    pub(crate) fn copies_of_memory(&mut self) -> [&mut [NodeVector]; 2] {
        copies_of(self.memory, self.progress)
    }

    /// What tissue remembers.
    pub(crate) const fn remembered(&self) -> &[NodeVector] {
        remembered(self.memory, self.progress)
    }

    /// Copies the vectors that a step moves to [`MOVED_VECTORS`] for each of so many nodes, and what tissue remembers.
    pub(crate) fn save(&self, nodes: usize, into: &mut [NodeVector]) {
        let (moved, past) = into.split_at_mut((MOVED_VECTORS * nodes).min(into.len()));
        let vectors = [&*self.displacement, self.remainder, self.increment];
        for (saved, vectors) in moved.chunks_exact_mut(nodes.max(1)).zip(vectors) {
            copy(saved, vectors);
        }
        copy(past, self.remembered());
    }

    /// Copies them back.
    pub(crate) fn restore(&mut self, nodes: usize, from: &[NodeVector]) {
        let (moved, remembered) = from.split_at((MOVED_VECTORS * nodes).min(from.len()));
        let Self { displacement, remainder, increment, .. } = self;
        for (vectors, saved) in [displacement, remainder, increment].into_iter().zip(moved.chunks_exact(nodes.max(1))) {
            copy(vectors, saved);
        }
        copy(self.copies_of_memory()[0], remembered);
    }

    /// Back to rest at time zero.
    pub fn reset(&mut self) {
        let Self { displacement, remainder, increment, force, memory, .. } = self;
        for vectors in [displacement, remainder, increment, force, memory] {
            vectors.fill(NodeVector::ZERO);
        }
        *self.progress = Progress::START;
    }
}

/// What tissue remembers at the moment of a state, and where the next step writes it.
pub(crate) fn copies_of<'a>(memory: &'a mut [NodeVector], progress: &Progress) -> [&'a mut [NodeVector]; 2] {
    let (first, second) = memory.split_at_mut(memory.len() / 2);
    if progress.second { [second, first] } else { [first, second] }
}

/// The first of [`copies_of`].
pub(crate) const fn remembered<'a>(memory: &'a [NodeVector], progress: &Progress) -> &'a [NodeVector] {
    let (first, second) = memory.split_at(memory.len() / 2);
    if progress.second { second } else { first }
}

/// What can be seen as a state.
pub trait AsState {
    /// The state.
    fn as_state(&mut self) -> StateView<'_>;
}

impl AsState for StateView<'_> {
    fn as_state(&mut self) -> StateView<'_> {
        self.reborrow()
    }
}

/// Memory for the vectors of a state.
pub trait StateVectors {
    /// Displacements, their remainders, increments, forces; volumes of the nodes, or nothing.
    fn vectors(&self) -> [&[NodeVector]; 5];
    /// The same, to be changed, and what is kept for instruments, if anything.
    fn vectors_mut(&mut self) -> ([&mut [NodeVector]; 5], InstrumentMemory<'_>);
}

/// What a state keeps for instruments and pulls.
#[derive(Debug, Default)]
pub struct InstrumentMemory<'a> {
    /// See [`StateView::pushing`].
    pub pushes: &'a mut [NodeVector],
    /// See [`StateView::feeling`].
    pub touches: &'a mut [Touch],
    /// See [`StateView::pulling`].
    pub pulls: &'a mut [NodeVector],
    /// See [`StateView::remembering`].
    pub memory: &'a mut [NodeVector],
}

/// A state that owns its vectors.
#[derive(Clone, Debug)]
pub struct State<S> {
    vectors: S,
    progress: Progress,
}

impl<S> Deref for State<S> {
    type Target = Progress;

    fn deref(&self) -> &Progress {
        &self.progress
    }
}

impl<S: StateVectors> State<S> {
    /// The state.
    pub fn view(&mut self) -> StateView<'_> {
        let ([displacement, remainder, increment, force, volume], InstrumentMemory { pushes, touches, pulls, memory }) =
            self.vectors.vectors_mut();
        let state = StateView::new(displacement, remainder, increment, force, volume, &mut self.progress);
        state.pushing(pushes).feeling(touches).pulling(pulls).remembering(memory)
    }

    /// Displacement of each node, m.
    #[must_use]
    pub fn displacements(&self) -> &[NodeVector] {
        self.vectors.vectors()[0]
    }

    /// Total force on each node (external less internal) at the start of the latest step, N. At held nodes
    /// its opposite is the reaction of the support, apart from the inertia of a moved one. After a step that
    /// was refused these are the forces of that step, and after [`crate::tled::critical_step`] zero.
    #[must_use]
    pub fn forces(&self) -> &[NodeVector] {
        self.vectors.vectors()[3]
    }

    /// Velocity of a node over the latest step, m/s; zero for a node that does not exist.
    #[must_use]
    pub fn velocity(&self, node: usize) -> [f32; 3] {
        let increment = self.vectors.vectors()[2].get(node).copied().unwrap_or_default();
        let dt = self.progress.dt;
        if dt > 0.0 { increment.to_array().map(|component| component / dt) } else { [0.0; 3] }
    }

    /// How many nodes there is room for.
    #[must_use]
    pub fn capacity(&self) -> usize {
        let [displacement, remainder, increment, force, _] = self.vectors.vectors();
        displacement.len().min(remainder.len()).min(increment.len()).min(force.len())
    }

    /// Back to rest at time zero.
    pub fn reset(&mut self) {
        self.view().reset();
    }
}

impl<S: StateVectors> AsState for State<S> {
    fn as_state(&mut self) -> StateView<'_> {
        self.view()
    }
}

/// Vectors of `N` nodes, volumes of `P`.
#[derive(Clone, Debug)]
pub struct FixedVectors<const N: usize, const P: usize> {
    vectors: [[NodeVector; N]; 4],
    volumes: [NodeVector; P],
}

impl<const N: usize, const P: usize> StateVectors for FixedVectors<N, P> {
    fn vectors(&self) -> [&[NodeVector]; 5] {
        let [displacement, remainder, increment, force] = &self.vectors;
        [displacement, remainder, increment, force, &self.volumes]
    }

    fn vectors_mut(&mut self) -> ([&mut [NodeVector]; 5], InstrumentMemory<'_>) {
        let [displacement, remainder, increment, force] = &mut self.vectors;
        ([displacement, remainder, increment, force, &mut self.volumes], InstrumentMemory::default())
    }
}

/// A state with room for `N` nodes, which may be a `static`; of scenes with
/// [`NodalPressure`](crate::material::NodalPressure) or [`NodalStrain`](crate::material::NodalStrain) if `P` is `N`, with
/// linear tetrahedra if it is zero.
pub type FixedState<const N: usize, const P: usize = 0> = State<FixedVectors<N, P>>;

impl<const N: usize, const P: usize> FixedState<N, P> {
    /// At rest.
    #[must_use]
    pub const fn new() -> Self {
        let (vectors, volumes) = ([[NodeVector::ZERO; N]; 4], [NodeVector::ZERO; P]);
        Self { vectors: FixedVectors { vectors, volumes }, progress: Progress::START }
    }
}

impl<const N: usize, const P: usize> Default for FixedState<N, P> {
    fn default() -> Self {
        Self::new()
    }
}

/// Vectors of as many nodes as there are.
#[cfg(any(feature = "std", test))]
#[derive(Clone, Debug)]
pub struct VecVectors {
    vectors: [std::vec::Vec<NodeVector>; 5],
    pushes: std::vec::Vec<NodeVector>,
    touches: std::vec::Vec<Touch>,
    pulls: std::vec::Vec<NodeVector>,
    memory: std::vec::Vec<NodeVector>,
    /// Checksum of the tables that the memory belongs to.
    tables: u32,
}

#[cfg(any(feature = "std", test))]
impl StateVectors for VecVectors {
    fn vectors(&self) -> [&[NodeVector]; 5] {
        self.vectors.each_ref().map(std::vec::Vec::as_slice)
    }

    fn vectors_mut(&mut self) -> ([&mut [NodeVector]; 5], InstrumentMemory<'_>) {
        let Self { vectors, pushes, touches, pulls, memory, .. } = self;
        (vectors.each_mut().map(std::vec::Vec::as_mut_slice), InstrumentMemory { pushes, touches, pulls, memory })
    }
}

/// A state on a host with a heap.
#[cfg(any(feature = "std", test))]
pub type VecState = State<VecVectors>;

#[cfg(any(feature = "std", test))]
impl VecState {
    /// At rest, with room for `nodes` nodes of any scene.
    #[must_use]
    pub fn at_rest(nodes: usize) -> Self {
        let zero = || std::vec![NodeVector::ZERO; nodes];
        let vectors = [zero(), zero(), zero(), zero(), zero()];
        let (pushes, touches, pulls, memory) = (std::vec![], std::vec![], std::vec![], std::vec![]);
        Self { vectors: VecVectors { vectors, pushes, touches, pulls, memory, tables: 0 }, progress: Progress::START }
    }

    /// The same with room for what a scene's tissue remembers ([`StateView::remembering`]).
    #[must_use]
    pub fn of<M: Material>(scene: SceneView<'_, M>) -> Self {
        let mut state = Self::at_rest(scene.node_count());
        state.remember(std::vec![NodeVector::ZERO; scene.memory_vectors()], scene.memory_checksum());
        state
    }

    /// Takes over what tissue remembers, in two copies of which the first is that of now, and the checksum of the scene's tables
    /// ([`SceneView::memory_checksum`]).
    pub(crate) fn remember(&mut self, memory: std::vec::Vec<NodeVector>, tables: u32) {
        (self.vectors.memory, self.vectors.tables, self.progress.second) = (memory, tables, false);
    }

    /// Remembers nothing where it was moved in another scene, with other tables, whose tissue it remembers.
    #[cfg(feature = "std")]
    pub(crate) fn forget_other(&mut self, vectors: usize, tables: u32) {
        if vectors > 0 && (self.vectors.tables != tables || self.vectors.memory.len() != vectors) {
            self.remember(std::vec![NodeVector::ZERO; vectors], tables);
        }
    }

    /// The same with room for what instruments do on a surface.
    #[must_use]
    pub fn meeting(mut self, surface: &Surface<'_>) -> Self {
        self.make_room(surface);
        self
    }

    /// See [`VecState::meeting`]: nothing touches yet.
    pub fn make_room(&mut self, surface: &Surface<'_>) {
        let vectors = vectors_to_push(surface.nodes().len(), surface.triangles().len());
        self.vectors.pushes = std::vec![NodeVector::ZERO; vectors];
        self.vectors.touches = std::vec![Touch::default(); MOST_INSTRUMENTS];
    }

    /// Makes room for the forces of so many pulls ([`StateView::pulling`]).
    pub fn make_room_for_pulls(&mut self, pulls: usize) {
        self.vectors.pulls.resize(pulls, NodeVector::ZERO);
    }

    /// The force of each pull in the latest step, N; nothing without room for it.
    #[must_use]
    pub fn pull_forces(&self) -> &[NodeVector] {
        &self.vectors.pulls
    }

    /// What each instrument felt in the latest step ([`StateView::feeling`]); nothing without room for it.
    #[must_use]
    pub fn touches(&self) -> &[Touch] {
        &self.vectors.touches
    }
}
