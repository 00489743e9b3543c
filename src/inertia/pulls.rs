//! Pulls in long steps ([`crate::pulls`]). Their force is one of the forces of the step, at the point half a step ahead,
//! which damps it; and their stiffness one of the stiffnesses by which inertia is raised ([`super`]), counted twice: with
//! `K_p = sum k w w^T` a step removes `K_p D / 2` of the velocities, so that
//!
//! ```text
//! K + K_p <= 4 / D^2 B^-1 - K_p        must hold, the tissue's bound with K + 2 K_p
//! ```
//! A node's part in `K_p` is bounded by `k |w| sum |w|`, a function's by the same of its weights. Inertia that grew with the force
//! of a pull at its limit, as the gap closes, would feed motion. So no pull is stiffer in long steps than its most force over
//! [`LEAST_GAP`], or less in a small body.

use glam::Vec3;

use super::band::Band;
use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS, node_place, rank_of};
use super::node_tables::NodeTables;
use crate::element::ElementMaterial;
use crate::pulls::{Pull, Pulls};
use crate::simd::NodeVector;
use crate::step::{Step, Totals, Trial};

/// Stiffness with which pulls are counted, over their own.
const COUNTED: f32 = 2.0;
/// At the most force of a pull, m, and of the longest side of the body at most.
const LEAST_GAP: f32 = 5e-4;
const SHARE_OF_SIDE: f32 = 0.005;
/// Growth at which `S` is computed anew, and for how many steps one that is this much too large is used.
const GROWTH: f32 = 1.05;
const MOST_STEPS: u32 = 12;

/// What pulls add to the functions of the lattice, N/m.
pub(super) type FunctionStiffness = [f32; MAX_FUNCTIONS];

/// Adds the forces of pulls, and their bounds to those of the nodes.
pub(super) fn add_pulls<M: ElementMaterial>(
    trial: &mut Trial<'_, M>,
    step: &Step,
    tables: &NodeTables<'_>,
    (lattice, places): (&Lattice, &[LatticeNode]),
) {
    let Some(pulls) = trial.loads.pulls() else { return };
    trial.pulls.fill(NodeVector::ZERO);
    for (index, pull) in pulls.acting() {
        let pull = &softened(pull, lattice);
        let force = force_of(trial, step, pulls, pull);
        if let Some(place) = trial.pulls.get_mut(index) {
            place.0 = force.extend(0.0).to_array();
        }
        pulls.each_stiffness(pull, |pulled, stiffness| {
            let node = pulled.node as usize;
            let closeness = tables.next_increment.get(rank_of(places, node)).map_or(1.0, |next| next.0[3]);
            let bound = COUNTED * stiffness / closeness.max(f32::MIN_POSITIVE);
            if let Some(NodeVector([x, y, z, sum])) = trial.force.get_mut(node) {
                let added = pulled.weight * force;
                (*x, *y, *z, *sum) = (*x + added.x, *y + added.y, *z + added.z, *sum + bound);
            }
        });
    }
}

/// As stiff as long steps have it.
fn softened(pull: &Pull, lattice: &Lattice) -> Pull {
    let side = lattice.longest_side();
    let gap = if side > 0.0 { LEAST_GAP.min(SHARE_OF_SIDE * side) } else { LEAST_GAP };
    Pull { stiffness: pull.stiffness.min(pull.most / gap), ..*pull }
}

/// The force of a pull in the step, N.
fn force_of<M: ElementMaterial>(trial: &Trial<'_, M>, step: &Step, pulls: &Pulls<'_>, pull: &Pull) -> Vec3 {
    let middle = trial.progress.time + 0.5 * f64::from(step.seconds());
    let half = 0.5 * step.carry();
    let ahead =
        pulls.mean(pull, |node| half * Vec3::from(trial.increment.get(node).copied().unwrap_or_default().to_array()));
    let gap = (pull.target(middle) - pull.unmoved()) - (trial.moved_mean(pulls, pull) + ahead);
    pull.force(gap, Vec3::ZERO, Vec3::ZERO)
}

/// Enters the work of the pulls; `next` gives the next increments of the nodes.
pub(super) fn add_work<M: ElementMaterial>(
    trial: &Trial<'_, M>,
    step: &Step,
    lattice: &Lattice,
    totals: &mut Totals,
    next: impl Fn(usize) -> [f32; 4],
) {
    let Some(pulls) = trial.loads.pulls() else { return };
    for (_, pull) in pulls.acting() {
        let way = pulls.mean(pull, |node| {
            let last = trial.increment.get(node).copied().unwrap_or_default().to_array();
            let [x, y, z, _] = next(node);
            0.5 * (Vec3::new(x, y, z) + Vec3::from(last))
        });
        totals.add_work(force_of(trial, step, pulls, &softened(pull, lattice)).dot(way));
    }
}

/// What the pulls that act now add to the functions.
fn stiffness_of(pulls: &Pulls<'_>, lattice: &Lattice, places: &[LatticeNode], sums: &mut FunctionStiffness) {
    for (_, pull) in pulls.acting() {
        // Twice: the sum of all weights, then each one times it.
        let mut all = 0.0;
        each_weight(pulls, pull, lattice, places, |_, weight| all += weight);
        let counted = COUNTED * softened(pull, lattice).stiffness * all;
        each_weight(pulls, pull, lattice, places, |function, weight| {
            if let Some(sum) = sums.get_mut(function) {
                *sum += counted * weight;
            }
        });
    }
}

/// Calls `visit` with the functions that move the nodes of a pull, and the size of their part.
fn each_weight(
    pulls: &Pulls<'_>,
    pull: &Pull,
    lattice: &Lattice,
    places: &[LatticeNode],
    mut visit: impl FnMut(usize, f32),
) {
    for pulled in pulls.nodes_of(pull) {
        let Some(place) = node_place(places, pulled.node as usize) else { continue };
        for (number, weight) in lattice.weights(place) {
            if lattice.moves(number) {
                let part = pulled.weight * weight;
                lattice.each_function(number, |function, share| visit(function, (part * share).abs()));
            }
        }
    }
}

/// The stiffness of pulls that `S` contains.
#[derive(Clone, Debug)]
pub(super) struct PullsInUse {
    of_functions: FunctionStiffness,
    /// Whether there is any.
    pub(super) any: bool,
    /// Steps since which it is too large, and the same once this step is taken.
    steps: [u32; 2],
}

impl PullsInUse {
    pub(super) const NONE: Self = Self { of_functions: [0.0; _], any: false, steps: [0; 2] };

    /// Whether `S` has to be computed anew for the pulls that act now. In the function's own stack, which is free elsewhere.
    #[inline(never)]
    pub(super) fn follow(&mut self, pulls: Option<&Pulls<'_>>, lattice: &Lattice, places: &[LatticeNode]) -> bool {
        if pulls.is_none() && !self.any {
            self.steps[1] = 0;
            return false;
        }
        let mut now = [0.0; _];
        if let Some(pulls) = pulls {
            stiffness_of(pulls, lattice, places, &mut now);
        }
        self.note(&now)
    }

    /// Takes the stiffness of the pulls that act now, if `S` has to be computed anew for them: there is more than it
    /// contains, or for long much less. A pull that is absent for a few frames changes nothing.
    fn note(&mut self, now: &FunctionStiffness) -> bool {
        let mut pairs = self.of_functions.iter().zip(now);
        let is_small = pairs.clone().any(|(used, now)| *now > GROWTH * used);
        let is_large = !is_small && pairs.any(|(used, now)| *used > GROWTH * now);
        self.steps[1] = if is_large { self.steps[0] + 1 } else { 0 };
        let is_outdated = is_small || self.steps[1] > MOST_STEPS;
        if is_outdated {
            self.any = now.iter().any(|stiffness| *stiffness > 0.0);
            (self.of_functions, self.steps) = (*now, [0; 2]);
        }
        is_outdated
    }

    /// The step is taken.
    pub(super) const fn enter(&mut self) {
        self.steps[0] = self.steps[1];
    }

    /// Adds to `S`, with the weight `s_c D^2 / 4` (s^2) of stiffness.
    pub(super) fn add_to(&self, band: &Band, factor: &mut [f32], weight: f32) {
        for (function, stiffness) in self.of_functions.iter().enumerate().filter(|(_, stiffness)| **stiffness > 0.0) {
            for axis in 0..3 {
                let row = 3 * function + axis;
                if let Some(entry) = factor.get_mut(band.at(row, row)) {
                    *entry += weight * stiffness;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_are_not_taken_do_not_count() {
        let (mut pulls, none, mut some) = (PullsInUse::NONE, [0.0; _], [0.0; _]);
        some[3] = 100.0;
        assert!(pulls.note(&some) && pulls.any);
        for _ in 0..3 * MOST_STEPS {
            assert!(!pulls.note(&none));
        }
        for _ in 0..MOST_STEPS {
            assert!(!pulls.note(&none));
            pulls.enter();
        }
        assert!(pulls.note(&none) && !pulls.any);
    }
}
