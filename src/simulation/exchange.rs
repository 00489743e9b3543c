//! Tissue that changes while it moves: elements are removed (resection), or their constants change over a time
//! (ablation; Pa, s). A scene of the same nodes takes the place of the former one under the same state
//! ([`tled::carry_on`]).

use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use super::owned::{Exact, Prepared};
use super::remembered::carry;
use super::{Simulation, SimulationError};
use crate::material::{AnyLaw, Fibres, Law, Prony, TissueValues, Values, VecMaterial};
use crate::mesh::{Mesh, Winding};
use crate::pulls::let_go_of_removed;
use crate::scene::BuildError;
use crate::simd::NodeVector;
use crate::tled;

/// How often an ablation changes the constants.
const STAGES: u32 = 20;

/// What has changed since the start.
#[derive(Debug, Default)]
pub(super) struct Changes {
    /// For each element whether it is removed; empty: none is.
    pub(super) removed: Vec<bool>,
    /// Whether instruments touch the boundary of what is left, and not a surface of the caller's.
    pub(super) meets_boundary: bool,
    ablations: Vec<Ablation>,
}

/// Constants of a tissue on their way, in time.
#[derive(Clone, Debug)]
struct Ablation {
    tissue: usize,
    from: Values,
    to: Values,
    /// s.
    start: f64,
    seconds: f64,
    stage: u32,
}

impl Simulation<'_> {
    /// Goes on with another material and without some more elements: displacements, velocities, time, loads, pulls and
    /// instruments stay, so what stays of the tissue keeps its momentum, and the energy balance begins anew. Nodes that
    /// belong to no element any more stay in all arrays, held where they are. Pulls act on the nodes that are left of
    /// their patches, or are absent; a surface of [`Simulation::meeting`] follows, one of the caller's loses nodes;
    /// pressures act on what is left of their surfaces, not on the cut, and an open one fills no more.
    /// Steps are prepared anew, with a lead-in where a network takes them. Reactions must be. An ablation under way ends
    /// where it is.
    ///
    /// It takes as long as building the scene and preparing the steps; with other constants only, and exact steps, as
    /// some of them. Where it is refused nothing has changed.
    pub fn exchange(&mut self, material: VecMaterial, removed: &[u32]) -> Result<(), SimulationError> {
        self.go_on_with(material, removed)?;
        self.changes.ablations.clear();
        Ok(())
    }

    fn go_on_with(&mut self, material: VecMaterial, removed: &[u32]) -> Result<(), SimulationError> {
        let all = self.removed_with(removed)?;
        if removed.is_empty() {
            // Only constants may differ.
            let former = self.scene.material().clone();
            if self.scene.set_constants(material.clone())? {
                let undo = |simulation: &mut Self| {
                    let _ = simulation.scene.set_constants(former);
                };
                return self.go_on(None, undo);
            }
        }
        let mesh = Mesh::new(&self.points, &self.tets, Winding::Normalised)?.without(&all)?;
        let scene = self.scene.exchanged(material, &mesh)?;
        let needed = scene.view().memory_vectors();
        let mut remembered = vec![NodeVector::ZERO; needed];
        let (now, room) = remembered.split_at_mut(needed / 2);
        carry((self.scene.view(), self.state.view().remembered()), (scene.view(), now), room);
        let former = core::mem::replace(&mut self.scene, scene);
        let removed = core::mem::replace(&mut self.changes.removed, all);
        let touchable = self.touchable.clone();
        let (pulled, pulls, is_boundary) = (self.pulled.clone(), self.pulls.clone(), self.changes.meets_boundary);
        let pressures = self.pressures.clone();
        let undo = move |simulation: &mut Self| {
            (simulation.scene, simulation.touchable, simulation.pressures) = (former, touchable, pressures);
            (simulation.pulled, simulation.pulls) = (pulled, pulls);
            (simulation.changes.removed, simulation.changes.meets_boundary) = (removed, is_boundary);
        };
        self.go_on(Some(remembered), undo)
    }

    /// Removes elements, as a resection does: see [`Simulation::exchange`]. An ablation goes on.
    pub fn remove(&mut self, elements: &[u32]) -> Result<(), SimulationError> {
        self.go_on_with(self.scene.material().clone(), elements)
    }

    /// Lets the constants of some elements change evenly to those of `law`, the law that the tissue has, over `seconds`
    /// from now on; zero: at once. Densities stay. These elements become tissues of their own at once, for which the
    /// scene is built anew; then constants change in 20 stages, each at the begin of a call of [`Simulation::advance`],
    /// so calls should be shorter than a stage. Where the state is reset, or put back to a time before it began, it ends
    /// where it is. A stage takes as long as some thirty exact steps; with steps that choose their length, and the last
    /// one with long steps, as long as preparing the steps.
    pub fn ablate(&mut self, elements: &[u32], law: impl Into<AnyLaw>, seconds: f64) -> Result<(), SimulationError> {
        let (law, count) = (law.into(), self.tets.len());
        if !(seconds >= 0.0 && seconds.is_finite()) {
            return Err(SimulationError::Seconds(seconds));
        }
        if let (Some((name, value)), Some(&element)) = (law.unusable_constant(), elements.first()) {
            return Err(BuildError::Constant { element: element as usize, name, value }.into());
        }
        let mut material = self.scene.material().clone();
        if elements.is_empty() || core::mem::discriminant(&law) != core::mem::discriminant(&material.law) {
            return Err(SimulationError::Ablation);
        }
        if material.tissues.len() == 1 {
            material.of_element = vec![0; count];
        }
        // Of each tissue the one that its ablated part becomes.
        let mut parts = vec![None; material.tissues.len()];
        let mut ablations = Vec::new();
        let (to, start) = (law.values(), self.state.time());
        for &element in elements {
            let missing = SimulationError::Element { element, elements: count };
            let place = material.of_element.get_mut(element as usize).ok_or(missing)?;
            let Some(part) = parts.get_mut(usize::from(*place)) else { continue };
            let tissue = material.tissues.get(usize::from(*place)).copied().unwrap_or_default();
            let number = *part.get_or_insert_with(|| {
                let number = material.tissues.len();
                material.tissues.push(tissue);
                if let Some(&series) = material.prony.get(usize::from(*place)) {
                    material.prony.resize(number, Prony::NONE);
                    material.prony.push(series);
                }
                if let Some(&fibres) = material.fibres.get(usize::from(*place)) {
                    material.fibres.resize(number, Fibres::NONE);
                    material.fibres.push(fibres);
                }
                ablations.push(Ablation { tissue: number, from: tissue.constants, to, start, seconds, stage: 0 });
                number
            });
            *place = u16::try_from(number).ok().filter(|&number| number < u16::MAX).ok_or(SimulationError::Ablation)?;
        }
        self.go_on_with(material, &[])?;
        // A tissue that is on its way elsewhere stays there where it was ablated again.
        self.changes.ablations.extend(ablations);
        Ok(())
    }

    /// Before a call: the state may be another one, and a stage of an ablation due.
    pub(super) fn take_note(&mut self) -> Result<(), SimulationError> {
        let (nodes, room) = (self.scene.node_count(), self.state.view().capacity_for(self.scene.view().element()));
        if room < nodes {
            return Err(SimulationError::Room { nodes, room });
        }
        self.state.forget_other(self.scene.view().memory_vectors(), self.tables);
        let now = self.state.time();
        self.changes
            .ablations
            .retain(|ablation| ablation.start < now || (ablation.start == now && ablation.stage == 0));
        if self.changes.ablations.is_empty() {
            return Ok(());
        }
        let mut ablations = self.changes.ablations.clone();
        let mut material = self.scene.material().clone();
        let mut is_due = false;
        for ablation in &mut ablations {
            let stage = ablation.stage_at(now);
            if stage > ablation.stage {
                (ablation.stage, is_due) = (stage, true);
                ablation.write(f64::from(stage) / f64::from(STAGES), &mut material.tissues);
            }
        }
        if is_due {
            let is_last = ablations.iter().any(|ablation| ablation.stage == STAGES);
            if !self.keeps_steps(&material, is_last)? {
                self.go_on_with(material, &[])?;
            }
            ablations.retain(|ablation| ablation.stage < STAGES);
            self.changes.ablations = ablations;
        }
        Ok(())
    }

    /// Goes on with other constants in the steps that there are: exact ones look at the critical step again, long ones
    /// compute their inertia anew in the next one, as their lattice is that of the nodes and regions alone. Whether it
    /// was done; long steps are prepared anew at the last stage, for the length that fits.
    fn keeps_steps(&mut self, material: &VecMaterial, is_last: bool) -> Result<bool, SimulationError> {
        match &mut self.prepared {
            Some(Prepared::Exact(_)) => {}
            Some(Prepared::Long(..)) if !is_last => {}
            _ => return Ok(false),
        }
        if !self.scene.set_constants(material.clone())? || !tled::carry_on(&self.scene, &mut self.state) {
            return Ok(false);
        }
        match &mut self.prepared {
            Some(Prepared::Exact(Exact::Paced { pace, .. })) => pace.look_soon(),
            Some(Prepared::Long(large, _)) => large.parts().0.renew_soon(),
            _ => {}
        }
        Ok(true)
    }

    /// Whether an element is removed.
    #[must_use]
    pub fn is_removed(&self, element: usize) -> bool {
        self.changes.removed.get(element).is_some_and(|&is_removed| is_removed)
    }

    /// Those marked that are removed already, and these.
    fn removed_with(&self, removed: &[u32]) -> Result<Vec<bool>, SimulationError> {
        let (mut all, elements) = (self.changes.removed.clone(), self.tets.len());
        if all.is_empty() && !removed.is_empty() {
            all = vec![false; elements];
        }
        for &element in removed {
            let missing = SimulationError::Element { element, elements };
            *all.get_mut(element as usize).ok_or(missing)? = true;
        }
        Ok(all)
    }

    /// Goes on in the scene that there is now, with what its tissue remembers where other tables have taken the place of
    /// the former ones, or undoes what has led to it.
    fn go_on(
        &mut self,
        remembered: Option<Vec<NodeVector>>,
        undo: impl FnOnce(&mut Self),
    ) -> Result<(), SimulationError> {
        let (state, prepared, tables) = (self.state.clone(), self.prepared.take(), self.tables);
        if let Some(remembered) = remembered {
            self.tables = self.scene.view().memory_checksum();
            self.state.remember(remembered, self.tables);
        }
        let was_prepared = prepared.is_some();
        let answer = self.go_on_prepared(was_prepared);
        if answer.is_err() {
            undo(self);
            (self.state, self.prepared, self.tables) = (state, prepared, tables);
        }
        answer
    }

    fn go_on_prepared(&mut self, was_prepared: bool) -> Result<(), SimulationError> {
        if !tled::carry_on(&self.scene, &mut self.state) {
            // Not reached: it has as many nodes; there is no panic in its place.
            return Err(SimulationError::NotFinite);
        }
        self.let_go_of_removed()?;
        if was_prepared { self.prepare() } else { Ok(()) }
    }

    /// Surface and pulls lose the nodes that belong to no element any more, pressures the triangles.
    fn let_go_of_removed(&mut self) -> Result<(), SimulationError> {
        if self.changes.removed.is_empty() {
            return Ok(());
        }
        let view = self.scene.view();
        let_go_of_removed(view, &mut self.pulled, &mut self.pulls);
        let left = self.tets.iter().zip(&self.changes.removed).filter(|(_, removed)| !**removed);
        self.pressures.let_go_of_removed(left.map(|(tet, _)| tet));
        let triangles = !self.touchable.1.is_empty();
        if self.changes.meets_boundary {
            return self.meet_boundary(triangles);
        }
        if self.touchable.0.iter().all(|entry| !view.is_alone(entry.node as usize)) {
            return Ok(());
        }
        let (nodes, triangles) = core::mem::take(&mut self.touchable);
        let mut place = 0;
        let places: Box<[_]> = nodes
            .iter()
            .map(|entry| {
                let is_left = !view.is_alone(entry.node as usize);
                place += u32::from(is_left);
                is_left.then(|| place - 1)
            })
            .collect();
        let at = |corner: u32| places.get(corner as usize).copied().flatten();
        let triangles = triangles.into_iter().filter_map(|[a, b, c]| Some([at(a)?, at(b)?, at(c)?])).collect();
        let nodes = nodes.into_iter().filter(|entry| !view.is_alone(entry.node as usize)).collect();
        self.meet(nodes, triangles)
    }
}

impl Ablation {
    fn stage_at(&self, now: f64) -> u32 {
        let share = if self.seconds > 0.0 { ((now - self.start) / self.seconds).clamp(0.0, 1.0) } else { 1.0 };
        // What rounding of the time lacks does not cost a stage.
        (share * f64::from(STAGES) + 1e-6) as u32
    }

    /// A share of the way.
    fn write(&self, share: f64, tissues: &mut [TissueValues]) {
        let Some(tissue) = tissues.get_mut(self.tissue) else { return };
        for (value, (from, to)) in tissue.constants.iter_mut().zip(self.from.into_iter().zip(self.to)) {
            *value = (f64::from(from) + share * (f64::from(to) - f64::from(from))) as f32;
        }
    }
}
