//! What the scaling is doing right now.

/// Added inertia, reported with every step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Mean over the nodes of the inertia added, in masses of the node.
    pub added_mean: f32,
    /// The largest, and the node that has it.
    pub added_largest: f32,
    /// See `added_largest`.
    pub added_node: u32,
    /// Nodes that the latest step held back: their stiffness has grown since their inertia was computed, or
    /// their force would have moved them by more than a small part of an element.
    pub held_back: u32,
    /// Share of the lattice's motion that was used: below one where the body stiffened since its last refresh.
    pub coarse_share: f32,
    /// Share of the rough motion that the latest damped step took away.
    pub damping: f32,
    /// Estimate of the error that the added inertia has caused so far, m: mean over the nodes of their distance
    /// from where the exact step would have them. It follows the force that the added inertia absorbs along the
    /// body's displacement, from rest or from when the inertia was prepared. Of 78 runs of the laboratory 58 were
    /// within a factor of three of the truth, 70 within five; up to nine times too high where a small error sits
    /// beside a moved support, up to eleven times too low where mass scaling hardly moves the body at all. It tells
    /// the scale, it is no bound.
    pub error: f32,
}

impl Report {
    pub(super) const NONE: Self = Self {
        added_mean: 0.0,
        added_largest: 0.0,
        added_node: 0,
        held_back: 0,
        coarse_share: 1.0,
        damping: 0.0,
        error: 0.0,
    };
}

/// Nodes that a step holds back.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeldBack {
    pub(super) nodes: u32,
    /// Sum of the shares of their inverse inertia that are not used.
    pub(super) unused: f32,
}

impl HeldBack {
    pub(super) const NONE: Self = Self { nodes: 0, unused: 0.0 };

    /// Adds nodes, and the sum of the shares that they do not use.
    #[inline(always)]
    pub(super) fn add(&mut self, nodes: f32, unused: f32) {
        self.nodes += nodes as u32;
        self.unused += unused;
    }
}

/// Sums of added inertia while it is being computed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tally {
    sum: f32,
    nodes: u32,
    largest: f32,
    node: u32,
}

impl Tally {
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

    pub(super) fn report(&self, held_back: u32, coarse_share: f32, error: f32) -> Report {
        let count = if self.nodes > 0 { self.nodes as f32 } else { 1.0 };
        Report {
            added_mean: self.sum / count,
            added_largest: self.largest,
            added_node: self.node,
            held_back,
            coarse_share,
            damping: 0.0,
            error,
        }
    }
}
