//! What moves: the displacement of each node (m), its last increment (m), and the total force (N) that the
//! latest step saw. Position independent: it may be copied, saved and resumed.
//!
//! The increment `u_n - u_(n-1)` is kept instead of `u_(n-1)`: in float32 the rounding of
//! `2 u_n - u_(n-1)` acts as a false spring to the ground (13.8 % after 20,000 steps of the paper's bar).

pub use crate::lanes::NodeVector;
use crate::ledger::Ledger;
use crate::tled::Extremes;

/// The state of a scene over storage `S`, with room for at least its nodes.
#[derive(Clone, Debug)]
pub struct State<S> {
    pub(crate) displacement: S,
    pub(crate) increment: S,
    pub(crate) force: S,
    /// Seconds since the start.
    pub(crate) time: f64,
    pub(crate) steps: u64,
    /// Step that `increment` spans, s; zero before the first step.
    pub(crate) dt: f32,
    pub(crate) ledger: Ledger,
    /// At the start of the latest step.
    pub(crate) extremes: Extremes<f32>,
}

/// A state with room for `N` nodes, which may be a `static`.
pub type FixedState<const N: usize> = State<[NodeVector; N]>;

impl<const N: usize> FixedState<N> {
    /// At rest.
    #[must_use]
    pub const fn new() -> Self {
        Self::over([NodeVector::ZERO; N], [NodeVector::ZERO; N], [NodeVector::ZERO; N])
    }
}

impl<const N: usize> Default for FixedState<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S> State<S> {
    /// A state over the given storage, as it is: zeros mean at rest.
    pub const fn over(displacement: S, increment: S, force: S) -> Self {
        Self {
            displacement,
            increment,
            force,
            time: 0.0,
            steps: 0,
            dt: 0.0,
            ledger: Ledger::NEW,
            extremes: Extremes::REST,
        }
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

    /// The energy account.
    #[must_use]
    pub const fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Smallest volume of an element over its volume at rest, at the start of the latest step that was taken; 1 before the first.
    #[must_use]
    pub const fn least_volume_ratio(&self) -> f32 {
        1.0 + self.extremes.least_j
    }

    /// Largest exponent over its cap, at the start of the latest step that was taken: above 1 the exponential law went on along
    /// its tangent. Zero for laws without.
    #[must_use]
    pub const fn saturation(&self) -> f32 {
        self.extremes.saturation
    }
}

impl<S: AsRef<[NodeVector]>> State<S> {
    /// Displacement of each node, m.
    #[must_use]
    pub fn displacements(&self) -> &[NodeVector] {
        self.displacement.as_ref()
    }

    /// Total force on each node (external less internal) at the start of the latest step, N. At held nodes
    /// its opposite is the reaction of the support, apart from the inertia of a moved one. After a step that
    /// was refused these are the forces of that step, and after [`crate::tled::critical_step`] zero.
    #[must_use]
    pub fn forces(&self) -> &[NodeVector] {
        self.force.as_ref()
    }

    /// Velocity of a node over the latest step, m/s; zero for a node that does not exist.
    #[must_use]
    pub fn velocity(&self, node: usize) -> [f32; 3] {
        let increment = self.increment.as_ref().get(node).copied().unwrap_or_default();
        if self.dt > 0.0 { increment.to_array().map(|component| component / self.dt) } else { [0.0; 3] }
    }

    /// How many nodes the storage holds.
    #[must_use]
    pub fn capacity(&self) -> usize {
        let lengths =
            [&self.displacement, &self.increment, &self.force].map(|vectors| vectors.as_ref().len());
        lengths.into_iter().min().unwrap_or(0)
    }
}

impl<S: AsRef<[NodeVector]> + AsMut<[NodeVector]>> State<S> {
    /// Makes the last increment span `seconds`: `before` are the displacements of that long ago. A step of that length
    /// goes on from here. Nodes beyond `before` are left as they are.
    pub fn span(&mut self, before: &[NodeVector], seconds: f32) {
        let vectors = self.displacement.as_ref().iter().zip(self.increment.as_mut());
        for ((displacement, increment), before) in vectors.zip(before) {
            for axis in 0..3 {
                increment.0[axis] = displacement.0[axis] - before.0[axis];
            }
        }
        self.dt = seconds;
    }

    /// Makes the last increment span `seconds` at the velocity that it has. A step much shorter than the last goes on
    /// smoothly from here: it would count half the last step's acceleration into its own otherwise.
    pub fn respan(&mut self, seconds: f32) {
        let factor = if self.dt > 0.0 { seconds / self.dt } else { 1.0 };
        for increment in self.increment.as_mut() {
            for component in &mut increment.0 {
                *component *= factor;
            }
        }
        self.dt = seconds;
    }

    /// Back to rest at time zero.
    pub fn reset(&mut self) {
        for vectors in [&mut self.displacement, &mut self.increment, &mut self.force] {
            vectors.as_mut().fill(NodeVector::ZERO);
        }
        self.time = 0.0;
        self.steps = 0;
        self.dt = 0.0;
        self.ledger = Ledger::NEW;
        self.extremes = Extremes::REST;
    }
}
