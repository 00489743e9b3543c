//! The report of a step beyond the critical one: added inertia and what was held back.

/// Added inertia and its consequences, reported with every step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Added inertia as a multiple of the node's mass, mean over the nodes, when all inertia was last computed.
    pub added_mean: f32,
    /// The largest added inertia of a node, as a multiple of its mass.
    pub added_largest: f32,
    /// The node with the largest added inertia.
    pub added_node: u32,
    /// Number of nodes that the latest step held back, because their force would have moved them by more than a small
    /// part of an element.
    pub held_back: u32,
    /// Share of the lattice's motion that was used: below one if the forces of the step would have strained a cell too
    /// much.
    pub coarse_share: f32,
    /// Share of the rough motion that the latest damped step removed.
    pub damping: f32,
}

impl Report {
    pub(super) const NONE: Self =
        Self { added_mean: 0.0, added_largest: 0.0, added_node: 0, held_back: 0, coarse_share: 1.0, damping: 0.0 };
}

/// Sums over the nodes that a step holds back.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeldBack {
    pub(super) nodes: u32,
    /// Sum of the unused shares of their inverse inertia.
    pub(super) unused: f32,
}

impl HeldBack {
    pub(super) const NONE: Self = Self { nodes: 0, unused: 0.0 };

    /// Adds a number of nodes and the sum of their unused shares.
    #[inline(always)]
    pub(super) fn add(&mut self, nodes: f32, unused: f32) {
        self.nodes += nodes as u32;
        self.unused += unused;
    }

    /// Adds those of other nodes.
    pub(super) fn merge(&mut self, other: &Self) {
        self.nodes += other.nodes;
        self.unused += other.unused;
    }
}

/// Added inertia as a multiple of the node's mass.
#[derive(Clone, Copy, Debug)]
pub(super) struct AddedInertia {
    pub(super) mean: f32,
    nodes: u32,
    largest: f32,
    node: u32,
}

impl AddedInertia {
    pub(super) const NONE: Self = Self { mean: 0.0, nodes: 0, largest: 0.0, node: 0 };

    /// Adds a node to the sum.
    pub(super) fn add(&mut self, node: usize, added: f32) {
        self.mean += added;
        self.nodes += 1;
        if added > self.largest {
            (self.largest, self.node) = (added, node as u32);
        }
    }

    /// Makes the sum a mean.
    pub(super) fn end(&mut self) {
        self.mean /= self.nodes.max(1) as f32;
    }

    pub(super) const fn report(&self, held_back: u32, coarse_share: f32, damping: f32) -> Report {
        let Self { mean: added_mean, largest: added_largest, node: added_node, .. } = *self;
        Report { added_mean, added_largest, added_node, held_back, coarse_share, damping }
    }
}
