//! The steps of [`super::settle`] where no instrument touches: nonlinear conjugate gradients (Polak & Ribiere 1969) with the bounds of
//! the nodes' stiffness as preconditioner. With the forces `F` at the base of a line, its direction `p`, and the forces
//! `f` at `a p` from there, the force is taken to be linear along the line: it is zero along it at
//!
//! ```text
//! a* = a F.p / (F.p - f.p),   f* = F + (a* / a) (f - F)
//! p' = f* / b + beta p,       beta = max(0, f*.(f* - F) / b / (F.F / b))
//! ```
//! so that each step takes one evaluation of the forces: it goes to `a*` and from there on along the next line, as far as the
//! last one went. Where `a*` is far from `a`, or farther than elements may be strained at once, it goes on along its line first.

use glam::Vec4;

use crate::element::{ElementMaterial, LOOK_CYCLE, NoVisitor, NodeInertia};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::step::{Cause, Computed, StepMethod, Threads, TotalForces, Totals, Trial, moved};

/// By how much `a*` may differ from `a` for forces to be linear between.
const NEAR: f32 = 3.0;
/// How far a step moves a node at most, as a share of the edge of a cube of six mean elements.
const MOST_WAY: f32 = 0.25;
/// Nodes whose products are summed in single precision.
const AT_ONCE: usize = 64;

/// Where a step is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// `a` over one, by the direction in the state's increments; zero at a start.
    way: f32,
    /// `F.F / b` at the base, N m.
    square: f32,
    /// Largest way of a node along the direction, m.
    farthest: f32,
    /// That a node may go in one step, m.
    most: f32,
    /// The least ratio of `p.K p` and `p.b p` of the lines so far, and that of this one.
    softest: f32,
    weight: f64,
    /// The largest `|f| / b`, m.
    gradient: f32,
    /// Whether the last line had a minimum.
    ends: bool,
    /// How far a line went on that its forces helped along, m, at the farthest node; zero if the last one was none.
    unstable: f32,
}

/// Where the forces of a step lead.
#[derive(Clone, Copy, Debug)]
enum Next {
    /// So much farther along the line.
    On(f32),
    /// By so much to the end of the line, where forces are `(1 - share) F + share f` and their product over `b` is
    /// `square`, and along the next one with this `beta`.
    Turn { rest: f32, share: f32, square: f32, beta: f32 },
}

impl Line {
    /// A start anywhere.
    pub(super) fn start<M>(scene: SceneView<'_, M>) -> Self {
        let most = MOST_WAY * scene.edge();
        Self {
            way: 0.0,
            square: 0.0,
            farthest: 0.0,
            most,
            softest: 1.0,
            weight: 0.0,
            gradient: f32::INFINITY,
            ends: false,
            unstable: 0.0,
        }
    }

    /// The same where the state has been moved by others; its increments and the forces at the base are zero.
    pub(super) const fn again(&mut self) {
        (self.way, self.gradient, self.ends) = (0.0, f32::INFINITY, false);
    }

    /// The largest `|f| / b` of a node, m.
    pub(super) const fn gradient(&self) -> f32 {
        self.gradient
    }

    /// About how far from rest the farthest node is, m: the largest `|f| / b`, over the least stiffness of a line, in parts of
    /// `b`. Infinite where the last line was none of a minimum.
    pub(super) fn remaining(&self) -> f32 {
        if self.ends || self.gradient == 0.0 { self.gradient / self.softest } else { f32::INFINITY }
    }

    /// Whether the last line, farther than this (m), led down from a shape in which the body does not stay.
    pub(super) fn is_unstable(&self, metre: f32) -> bool {
        self.unstable > metre
    }

    /// The quarter period of a motion with the least stiffness so far, in steps of `du+ = du + push f / b`.
    pub(super) fn quarter(&self, push: f32) -> u32 {
        (core::f32::consts::FRAC_PI_2 / libm::sqrtf(push * self.softest)) as u32
    }

    /// Enters the products of the forces and the largest `|f| / b`.
    fn judge(&mut self, [.., first, last]: [f64; 4], farthest: f32) {
        (self.gradient, self.ends) = (farthest, false);
        if self.way == 0.0 || farthest == 0.0 {
            return;
        }
        let stiffness = ((first - last) / (f64::from(self.way) * self.weight)) as f32;
        self.ends = stiffness > 0.0;
        if self.ends {
            self.softest = self.softest.min(stiffness);
        }
        self.unstable = if self.ends { 0.0 } else { self.way * self.farthest };
    }

    /// From the products of the forces: `F.f / b`, `f.f / b`, `F.p`, `f.p`.
    fn next(&self, [mixed, new, first, last]: [f64; 4]) -> Next {
        if self.way == 0.0 {
            return Next::Turn { rest: 0.0, share: 1.0, square: new as f32, beta: 0.0 };
        }
        if self.farthest == 0.0 {
            return Next::On(0.0);
        }
        let (way, most) = (f64::from(self.way), f64::from(self.most / self.farthest));
        let falls = first - last;
        let end = if falls > 0.0 { way * first / falls } else { f64::INFINITY };
        let (rest, share) = (end - way, end / way);
        let near = 1.0 / f64::from(NEAR)..=f64::from(NEAR);
        if rest.abs() > most || !near.contains(&share) {
            return Next::On(rest.max(-most).min(most) as f32);
        }
        let old = f64::from(self.square);
        let own = (1.0 - share) * (1.0 - share) * old + 2.0 * share * (1.0 - share) * mixed + share * share * new;
        let with_old = (1.0 - share) * old + share * mixed;
        let beta = ((own - with_old) / old).max(0.0);
        let beta = if beta.is_finite() { beta as f32 } else { 0.0 };
        Next::Turn { rest: rest as f32, share: share as f32, square: own.max(0.0) as f32, beta }
    }
}

/// One step.
pub(super) struct Conjugate<'a, T> {
    pub(super) line: &'a mut Line,
    /// `b` of each node, N/m.
    pub(super) rates: &'a [f32],
    /// `F`, N.
    pub(super) base: &'a mut [NodeVector],
    pub(super) threads: &'a T,
    /// Whether motions are so small that rounding of the displacements matters.
    pub(super) is_fine: bool,
    next: Next,
}

impl<'a, T> Conjugate<'a, T> {
    pub(super) const fn new(
        line: &'a mut Line,
        rates: &'a [f32],
        base: &'a mut [NodeVector],
        threads: &'a T,
        is_fine: bool,
    ) -> Self {
        Self { line, rates, base, threads, is_fine, next: Next::On(0.0) }
    }

    /// The products of the forces, and the largest `|f| / b`.
    fn products<M: ElementMaterial>(&self, trial: &Trial<'_, M>) -> ([f64; 4], f32) {
        let (mut sums, mut farthest) = ([0.0; 4], 0.0f32);
        let Trial { scene, force, increment, .. } = trial;
        let nodes = scene.inertia.chunks(AT_ONCE).zip(self.rates.chunks(AT_ONCE));
        let vectors = force.chunks(AT_ONCE).zip(self.base.chunks(AT_ONCE)).zip(increment.chunks(AT_ONCE));
        for ((inertia, rates), ((forces, bases), directions)) in nodes.zip(vectors) {
            let mut of_these = [Vec4::ZERO; 4];
            let nodes = inertia.iter().zip(rates).zip(forces.iter().zip(bases).zip(directions));
            for ((inertia, rate), ((force, base), direction)) in nodes {
                let axes = inertia.free_axes();
                let free = |vector: &NodeVector| Vec4::select(axes, Vec4::from(vector.0), Vec4::ZERO);
                let (force, base, direction) = (free(force), free(base), free(direction));
                let over = 1.0 / rate;
                let (old, new) = (over * base, over * force);
                farthest = farthest.max(new.length_squared());
                let products = [old * force, new * force, base * direction, force * direction];
                of_these.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
            }
            for (sum, of_these) in sums.iter_mut().zip(of_these) {
                *sum += f64::from(of_these.element_sum());
            }
        }
        (sums, libm::sqrtf(farthest))
    }
}

impl<M: ElementMaterial, T: Threads> StepMethod<M> for Conjugate<'_, T> {
    const ENERGY_CYCLE: usize = 2048;
    const IS_RELAXED: bool = true;

    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed {
        let TotalForces { forcing, volume, force, after, .. } = trial.forcing(NoVisitor, LOOK_CYCLE);
        let (_, extremes) = forcing.in_parts(volume, force, &mut [], after, self.threads, |_, _, _: &mut [()]| ());
        trial.pull_at_rest();
        let (products, farthest) = self.products(trial);
        if !products.iter().all(|product| product.is_finite()) {
            trial.refused.get_or_insert((0, Cause::NotFinite));
        }
        self.next = self.line.next(products);
        self.line.judge(products, farthest);
        Computed { totals: Totals::NONE, extremes }
    }

    fn next_increment(&self, _: usize, _: &NodeInertia, _: &NodeVector, _: &NodeVector) -> [f32; 4] {
        [0.0; 4]
    }

    fn needs_remainders(&self) -> Option<bool> {
        Some(self.is_fine)
    }

    fn follows_pulls(&self, trial: &Trial<'_, M>) -> bool {
        trial.has_room_for_pulls()
    }

    fn advance(&mut self, trial: &mut Trial<'_, M>) {
        let Trial { scene, displacement, remainder, increment, force, .. } = trial;
        let (rest, turn) = match self.next {
            Next::On(rest) => (rest, None),
            Next::Turn { rest, share, square, beta } => (rest, Some((share, square, beta))),
        };
        let (mut farthest, mut weight) = (0.0f32, 0.0f64);
        let rows = displacement.iter_mut().zip(&mut **remainder).zip(&mut **increment);
        let of_nodes = scene.inertia.iter().zip(self.rates).zip(&mut *self.base).zip(&**force);
        for (((at, left), direction), (((inertia, rate), base), force)) in rows.zip(of_nodes) {
            let free = inertia.free_axes();
            let along = Vec4::select(free, Vec4::from(direction.0), Vec4::ZERO);
            if rest != 0.0 {
                [at.0, left.0] = moved(Vec4::from(at.0), left.0.into(), rest * along).map(|vector| vector.to_array());
            }
            let Some((share, _, beta)) = turn else { continue };
            let force = Vec4::select(free, Vec4::from(force.0), Vec4::ZERO);
            let new = (1.0 - share) * Vec4::from(base.0) + share * force;
            let along = beta * along + new / *rate;
            (base.0, direction.0) = (new.to_array(), along.to_array());
            farthest = farthest.max(along.truncate().length_squared());
            weight += f64::from(rate * along.truncate().length_squared());
        }
        let Some((_, square, _)) = turn else {
            self.line.way += rest;
            return;
        };
        farthest = libm::sqrtf(farthest);
        // As far as the last line went; from a start as far as no stiffness forbids.
        let guess = if self.line.way == 0.0 { 1.0 } else { self.line.way + rest };
        let way = guess.min(self.line.most / farthest.max(f32::MIN_POSITIVE));
        for ((at, left), direction) in displacement.iter_mut().zip(&mut **remainder).zip(&**increment) {
            let step = way * Vec4::from(direction.0);
            [at.0, left.0] = moved(Vec4::from(at.0), left.0.into(), step).map(|vector| vector.to_array());
        }
        *self.line = Line { way, square, farthest, weight, ..*self.line };
    }
}
