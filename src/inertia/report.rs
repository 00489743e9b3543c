//! The report of a step beyond the critical one: added inertia and what was held back.

/// Added inertia and its consequences, reported with every step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Added inertia as a multiple of the node's mass, mean over the nodes.
    pub added_mean: f32,
    /// The largest added inertia of a node, as a multiple of its mass.
    pub added_largest: f32,
    /// The node with the largest added inertia.
    pub added_node: u32,
    /// Number of nodes that the latest step held back, because their stiffness has grown since their inertia was
    /// computed, or because their force would have moved them by more than a small part of an element.
    pub held_back: u32,
    /// Share of the lattice's motion that was used: below one if the body has stiffened since the last refresh.
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
    /// The least share.
    pub(super) least: f32,
}

impl HeldBack {
    pub(super) const NONE: Self = Self { nodes: 0, unused: 0.0, least: 1.0 };

    /// Adds a number of nodes, the sum of their unused shares and the least share.
    #[inline(always)]
    pub(super) fn add(&mut self, nodes: f32, unused: f32, least: f32) {
        self.nodes += nodes as u32;
        self.unused += unused;
        self.least = self.least.min(least);
    }

    /// Adds those of other nodes.
    pub(super) fn merge(&mut self, other: &Self) {
        self.nodes += other.nodes;
        self.unused += other.unused;
        self.least = self.least.min(other.least);
    }
}

/// Sums of added inertia over the nodes of a cycle.
#[derive(Clone, Copy, Debug)]
pub(super) struct AddedInertiaSums {
    sum: f32,
    nodes: u32,
    largest: f32,
    node: u32,
}

impl AddedInertiaSums {
    pub(super) const NEW: Self = Self { sum: 0.0, nodes: 0, largest: 0.0, node: 0 };

    #[inline(always)]
    pub(super) fn add(&mut self, node: usize, added: f32) {
        self.sum += added;
        self.nodes += 1;
        if added > self.largest {
            self.largest = added;
            self.node = node as u32;
        }
    }

    /// As a multiple of the mass.
    pub(super) fn mean(&self) -> f32 {
        self.sum / self.nodes.max(1) as f32
    }

    pub(super) fn report(&self, held_back: u32, coarse_share: f32) -> Report {
        Report {
            added_mean: self.mean(),
            added_largest: self.largest,
            added_node: self.node,
            held_back,
            coarse_share,
            damping: 0.0,
        }
    }
}
