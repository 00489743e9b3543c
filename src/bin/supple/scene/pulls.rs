//! Pulls and springs of a scene file: what draws points of the tissue to targets, and supports that give way.

use serde::Deserialize;
use supple::element::Axes;
use supple::material::VecMaterial;
use supple::plausibility::{of_pull, of_target};
use supple::points::VecPoints;
use supple::pulls::{MOST_STIFFNESS, Pull, PulledNode, Pulls, corners, patch, usual_most};
use supple::scene::{SceneView, Support};
use toml::Spanned;

use super::body::Body;
use super::file::SceneFile;
use super::instruments::{checked_path, positive, short_part};
use super::plausible::late;
use super::points::is_outside;
use super::select::select;
use crate::problem::Problem;

/// A `[[pull]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PullTable {
    point: Spanned<[f64; 3]>,
    radius: Option<Spanned<f32>>,
    stiffness: Spanned<f32>,
    most: Option<Spanned<f32>>,
    path: Option<Spanned<Vec<[f64; 4]>>>,
    along: Option<Spanned<[f32; 3]>>,
    pub(super) gravity: Option<Spanned<[f32; 3]>>,
}

/// A pull with its path.
struct MovedPull {
    /// Its first node, and how many.
    nodes: [u32; 2],
    /// At rest, m from the centre of the body.
    at: [f32; 3],
    stiffness: f32,
    /// None: the usual one.
    most: Option<f32>,
    along: [f32; 3],
    /// Of its target, s and m from the centre of the body.
    path: Vec<(f64, [f32; 3])>,
    /// How far its point is outside the mesh, m.
    outside: f32,
}

/// The pulls of a scene, and after them its springs, a node each.
#[derive(Default)]
pub struct ScenePulls {
    nodes: Vec<PulledNode>,
    all: Vec<MovedPull>,
    /// How many of these are no springs.
    pub(crate) pulls: usize,
}

impl ScenePulls {
    pub(crate) fn read(file: &SceneFile, body: &Body) -> Result<Self, Problem> {
        let scene = &file.scene;
        let mut pulls = Self::default();
        let volumes = if scene.pull.is_empty() { vec![] } else { body.node_volumes() };
        for at in &scene.pull {
            pulls.add(file, at, body, &volumes)?;
        }
        pulls.pulls = pulls.all.len();
        for at in &scene.spring {
            pulls.add_springs(file, at, body)?;
        }
        let first = scene.pull.first().map(Spanned::span).or(scene.spring.first().map(Spanned::span));
        if let Some(span) = first.filter(|_| scene.learned.is_some()) {
            let message = "learned steps do not know pulls and springs; method = \"long\" does";
            return Err(file.problem(&Spanned::new(span, ()), message));
        }
        Ok(pulls)
    }

    /// `volumes` are those of the tissue of the nodes, m^3.
    fn add(&mut self, file: &SceneFile, at: &Spanned<PullTable>, body: &Body, volumes: &[f32]) -> Result<(), Problem> {
        let table = at.get_ref();
        let point = body.local_point(*table.point.get_ref());
        if let Some(along) = table.along.as_ref().filter(|along| *along.get_ref() == [0.0; 3]) {
            return Err(file.problem(
                along,
                "along is [0.0, 0.0, 0.0]; it needs a length, or leave it out to pull along all axes",
            ));
        }
        let (first, mut outside) = (self.nodes.len(), 0.0);
        match positive(file, "radius", table.radius.as_ref(), f32::MIN_POSITIVE)? {
            Some(radius) => {
                self.nodes.resize(first + body.local.len(), PulledNode::default());
                let count = patch(&body.local, |node| volumes[node], point, radius, &mut self.nodes[first..]);
                self.nodes.truncate(first + *count.as_ref().unwrap_or(&0));
                count.map_err(|error| file.problem(&table.point, error))?;
            }
            None => {
                let located = VecPoints::locate(&body.checked()?, &[point]);
                let located = located.map_err(|error| file.problem(&table.point, error))?;
                outside = located.points()[0].distance;
                self.nodes.extend(located.points().iter().flat_map(corners));
            }
        }
        let path = match &table.path {
            Some(path) => checked_path(file, path, body)?,
            None => vec![(0.0, point)],
        };
        let most = match &table.most {
            Some(at) if at.get_ref().is_nan() || *at.get_ref() <= 0.0 => {
                let message = format!("most is {} N, it must be positive, inf for no limit", at.get_ref());
                return Err(file.problem(at, message));
            }
            most => most.as_ref().map(|most| *most.get_ref()),
        };
        let pull = MovedPull {
            nodes: [first as u32, (self.nodes.len() - first) as u32],
            at: point,
            stiffness: stiffness(file, &table.stiffness)?,
            most,
            along: table.along.as_ref().map_or([0.0; 3], |along| *along.get_ref()),
            path,
            outside,
        };
        // Whatever else the kernel refuses.
        Pulls::new(body.local.len(), &self.nodes, &[pull.at(0.0)]).map_err(|error| file.problem(at, error))?;
        self.all.push(pull);
        Ok(())
    }

    /// Pulls that move nothing or are outside the mesh, and of those that go too far, take too long or are too wide for the body one of
    /// each, with the place of their entry.
    pub(crate) fn warnings(&self, file: &SceneFile, body: &Body, supports: &[Support]) -> Vec<String> {
        let held = |node: u32| {
            let own = supports.iter().filter(|support| support.node == node);
            own.fold(Axes::NONE, |axes, support| axes.union(support.axes))
        };
        let remark = |(at, pull): (&Spanned<PullTable>, &MovedPull)| {
            let [first, count] = pull.nodes.map(|number| number as usize);
            let nodes = self.nodes[first..first + count].iter().filter(|pulled| pulled.weight != 0.0);
            let remark = of_pull(nodes.map(|pulled| held(pulled.node)), pull.along)?;
            Some(file.problem(at, remark).to_string())
        };
        let mut remarks: Vec<_> = file.scene.pull.iter().zip(&self.all).filter_map(remark).collect();
        for (at, pull) in file.scene.pull.iter().zip(&self.all).filter(|(_, pull)| is_outside(pull.outside)) {
            let message = format!(
                "point is {:.2} mm outside the mesh: the nearest element is pulled; places are in metres",
                1e3 * pull.outside
            );
            remarks.push(file.problem(&at.get_ref().point, message).to_string());
        }
        let diagonal = body.diagonal();
        let mut paths =
            file.scene.pull.iter().zip(&self.all).filter_map(|(at, pull)| Some((at.get_ref().path.as_ref()?, pull)));
        let far = paths.clone().find_map(|(at, pull)| {
            let way =
                |to: &[f32; 3]| (0..3).map(|axis| f64::from(to[axis] - pull.at[axis]).powi(2)).sum::<f64>().sqrt();
            let farthest = pull.path.iter().map(|(_, to)| way(to)).fold(0.0, f64::max);
            Some(file.problem(at, of_target(farthest, diagonal)?).to_string())
        });
        let late = paths.find_map(|(at, pull)| {
            Some(file.problem(at, late(file, "the path of a target", pull.path.last()?.0)?).to_string())
        });
        let mut radii = file.scene.pull.iter().filter_map(|at| at.get_ref().radius.as_ref());
        let wide = radii.find(|at| f64::from(*at.get_ref()) > diagonal).map(|at| {
            let message = format!(
                "radius is {} m, the body is {diagonal:.3} m across: all of it is pulled (1 mm is 0.001 m)",
                at.get_ref()
            );
            file.problem(at, message).to_string()
        });
        remarks.extend(far.into_iter().chain(late).chain(wide));
        remarks
    }

    /// A node each that is drawn to where it is at rest.
    fn add_springs(
        &mut self,
        file: &SceneFile,
        at: &Spanned<super::file::SpringTable>,
        body: &Body,
    ) -> Result<(), Problem> {
        let table = at.get_ref();
        let nodes = select(file, at, &table.selection(), body)?;
        let mut selected = vec![false; body.local.len()];
        nodes.iter().for_each(|&node| selected[node as usize] = true);
        let shares = match (&table.stiffness, &table.per_area) {
            (Some(each), None) => vec![stiffness(file, each)?; nodes.len()],
            (None, Some(per_area)) => {
                let pascal_per_metre = positive(file, "per_area", Some(per_area), f32::MIN_POSITIVE)?.unwrap_or(0.0);
                let areas = body.areas(|node| selected[node as usize]);
                nodes.iter().map(|&node| (f64::from(pascal_per_metre) * areas[node as usize]) as f32).collect()
            }
            _ => return Err(file.problem(at, "give exactly one of stiffness (N/m, each node) and per_area (Pa/m)")),
        };
        if shares.iter().all(|stiffness| *stiffness == 0.0) {
            return Err(
                file.problem(at, "these springs have no stiffness: no boundary triangle has all its nodes selected")
            );
        }
        for (node, stiffness) in nodes.into_iter().zip(shares).filter(|(_, stiffness)| *stiffness > 0.0) {
            let (first, at) = (self.nodes.len() as u32, body.local[node as usize]);
            self.nodes.push(PulledNode { node, weight: 1.0 });
            let (nodes, most, along) = ([first, 1], Some(f32::INFINITY), [0.0; 3]);
            let stiffness = stiffness.min(MOST_STIFFNESS);
            self.all.push(MovedPull { nodes, at, stiffness, most, along, path: vec![(0.0, at)], outside: 0.0 });
        }
        Ok(())
    }

    /// The nodes of all pulls and springs.
    pub(crate) fn pulled_nodes(&self) -> impl Iterator<Item = u32> {
        self.nodes.iter().map(|pulled| pulled.node)
    }

    pub(crate) const fn len(&self) -> usize {
        self.all.len()
    }

    /// Sets the usual limits where none is given.
    pub(crate) fn limit(&self, scene: SceneView<'_, VecMaterial>) -> Vec<f32> {
        let of = |pull: &MovedPull| {
            let [first, count] = pull.nodes.map(|number| number as usize);
            pull.most.unwrap_or_else(|| usual_most(scene, &self.nodes[first..first + count]))
        };
        self.all.iter().map(of).collect()
    }

    /// The pulls on the parts of their paths that begin at `time` or before, s, with these limits, N.
    pub(crate) fn at(&self, time: f64, limits: &[f32]) -> Vec<Pull> {
        self.all.iter().zip(limits).map(|(pull, &most)| Pull { most, ..pull.at(time) }).collect()
    }

    /// The next time after `time` at which a target changes its way, s.
    pub(crate) fn next_turn(&self, time: f64) -> f64 {
        let turns = self.all.iter().flat_map(|pull| &pull.path).map(|(turn, _)| *turn);
        turns.filter(|turn| *turn > time).fold(f64::INFINITY, f64::min)
    }

    /// The first of two times (s) between which a target goes on a part of its path in less than so many seconds.
    pub(crate) fn short_part(&self, seconds: f64) -> Option<f64> {
        self.all.iter().find_map(|pull| short_part(&pull.path, seconds))
    }

    /// These pulls with their nodes, on a body of so many nodes.
    pub(crate) fn pulling<'a>(&'a self, pulls: &'a [Pull], nodes: usize) -> Result<Pulls<'a>, Problem> {
        Pulls::new(nodes, &self.nodes, pulls).map_err(Problem::of)
    }
}

impl MovedPull {
    /// On the part of its path that begins at `time` or before, s.
    fn at(&self, time: f64) -> Pull {
        let next = self.path.partition_point(|(turn, _)| *turn <= time).clamp(1, self.path.len().max(2) - 1);
        let (from, to) = (self.path[next - 1], *self.path.get(next).unwrap_or(&self.path[next - 1]));
        let pull = Pull::new(self.nodes, self.at, self.stiffness);
        Pull { along: self.along, from: from.1, to: to.1, times: [from.0, to.0], ..pull }
    }
}

fn stiffness(file: &SceneFile, at: &Spanned<f32>) -> Result<f32, Problem> {
    let value = *at.get_ref();
    if value > 0.0 && value <= MOST_STIFFNESS {
        return Ok(value);
    }
    Err(file.problem(at, format!("stiffness is {value} N/m, it must be above zero and at most {MOST_STIFFNESS:e}")))
}
