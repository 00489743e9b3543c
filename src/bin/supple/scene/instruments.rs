//! Instruments of a scene file: their shapes, and where they are over time.

use std::path::PathBuf;

use serde::Deserialize;
use supple::contact::{
    Contact, Instrument, MOST_INSTRUMENTS, Pose, Shape, Surface, SurfaceField, SurfaceNode, passes_between,
};
use supple::plausibility::of_distance;
use supple::points::{FollowedPoint, VecPoints};
use supple::scene::{Axes, Support};
use toml::Spanned;

use super::body::Body;
use super::file::SceneFile;
use super::plausible::late;
use super::select::ON_PLANE;
use crate::field::read_surface;
use crate::problem::Problem;

/// An `[[instrument]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct InstrumentTable {
    shape: Spanned<String>,
    radius: Option<Spanned<f32>>,
    length: Option<Spanned<f32>>,
    file: Option<Spanned<PathBuf>>,
    scale: Option<Spanned<f64>>,
    spacing: Option<Spanned<f32>>,
    friction: Option<Spanned<f32>>,
    path: Option<Spanned<Vec<[f64; 4]>>>,
    direction: Option<Spanned<[f32; 3]>>,
    pub(super) gravity: Option<Spanned<[f32; 3]>>,
}

/// A shape that owns its field.
pub(crate) enum OwnedShape {
    Plane,
    Sphere { radius: f32 },
    Capsule { radius: f32, length: f32 },
    Field(Box<OwnedField>),
}

/// A field with the surface that it was made from, m.
pub(crate) struct OwnedField {
    field: SurfaceField,
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// An instrument with its path.
pub(crate) struct MovedInstrument {
    pub(crate) shape: OwnedShape,
    friction: f32,
    /// s, and m from the centre of the body.
    path: Vec<(f64, [f32; 3])>,
    direction: [f32; 3],
}

/// The instruments of a scene and what they can touch.
#[derive(Default)]
pub struct SceneInstruments {
    pub(crate) all: Vec<MovedInstrument>,
    nodes: Vec<SurfaceNode>,
    /// None unless an instrument is thinner than an edge is long.
    triangles: Vec<[u32; 3]>,
}

impl SceneInstruments {
    /// A ball on a path (s, and m in the body's coordinates), for the demo.
    pub(crate) fn ball(body: &Body, radius: f32, friction: f32, path: &[(f64, [f64; 3])]) -> Self {
        let path = path.iter().map(|&(time, at)| (time, body.local_point(at))).collect();
        let instrument =
            MovedInstrument { shape: OwnedShape::Sphere { radius }, friction, path, direction: [0.0, 0.0, 1.0] };
        Self::new(vec![instrument], body)
    }

    fn new(all: Vec<MovedInstrument>, body: &Body) -> Self {
        let mut triangles = body.boundary();
        let mut nodes = triangles.as_flattened().to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        let thinnest = all.iter().map(|instrument| instrument.shape.shape().thickness()).fold(f32::INFINITY, f32::min);
        if !passes_between(&body.local, triangles.iter().copied(), thinnest) {
            triangles.clear();
        }
        for corner in triangles.as_flattened_mut() {
            *corner = nodes.partition_point(|node| node < corner) as u32;
        }
        let nodes = nodes.into_iter().map(|node| SurfaceNode { rest: body.local[node as usize], node });
        Self { all, nodes: nodes.collect(), triangles }
    }

    pub(crate) fn read(file: &SceneFile, body: &Body) -> Result<Self, Problem> {
        let tables = &file.scene.instrument;
        let Some(first) = tables.first() else { return Ok(Self::default()) };
        if let Some(at) = tables.get(MOST_INSTRUMENTS) {
            return Err(file.problem(at, format!("at most {MOST_INSTRUMENTS} instruments can touch a body")));
        }
        if file.scene.learned.is_some() {
            return Err(file.problem(first, "learned steps cannot meet instruments; method = \"long\" can"));
        }
        let all: Vec<_> = tables.iter().map(|at| MovedInstrument::read(file, at, body)).collect::<Result<_, _>>()?;
        Ok(Self::new(all, body))
    }

    /// Instruments that overlap the body where they start, with the place of their entry. One whose axis does is refused: it has no side
    /// to push the tissue to. Nodes that `supports` hold meet no instrument.
    pub(crate) fn warnings(&self, file: &SceneFile, body: &Body, supports: &[Support]) -> Result<Vec<String>, Problem> {
        let mut held = vec![Axes::NONE; body.local.len()];
        for support in supports {
            held[support.node as usize] = held[support.node as usize].union(support.axes);
        }
        let is_free = |node: u32| held[node as usize] != Axes::XYZ;
        let mut warnings = vec![];
        for (at, instrument) in file.scene.instrument.iter().zip(&self.all) {
            let distances =
                instrument.path.iter().map(|(time, _)| f64::from(instrument.at(*time).distance([0.0; 3], *time)));
            let far = of_distance(distances.fold(f64::INFINITY, f64::min), body.diagonal());
            let late = instrument.path.last().and_then(|(until, _)| late(file, "the path of this instrument", *until));
            warnings
                .extend(far.map(|remark| remark.to_string()).into_iter().chain(late).map(|it| file.problem(at, it).0));
            let placed = instrument.at(0.0);
            let depths =
                self.nodes.iter().filter(|node| is_free(node.node)).map(|node| -placed.distance(node.rest, 0.0));
            let mut depth = depths.fold(f32::NEG_INFINITY, f32::max);
            let axis = instrument.axis();
            if !axis.is_empty() {
                let located = VecPoints::locate(&body.checked()?, &axis).map_err(Problem::of)?;
                if located.points().iter().any(|point| point.distance == 0.0) {
                    let message = "the axis of this instrument starts inside the body; let its path begin outside";
                    return Err(file.problem(at, message));
                }
                let is_free = |point: &&FollowedPoint| {
                    point.nodes.iter().zip(point.weights).any(|(&node, weight)| weight > 1e-3 && is_free(node))
                };
                let touched = located.points().iter().filter(|_| !self.triangles.is_empty()).filter(is_free);
                let depths = touched.map(|point| instrument.shape.shape().thickness() - point.distance);
                depth = depths.fold(depth, f32::max);
            }
            if depth > instrument.rounding(body) {
                let what_moves = match file.scene.time.get_ref().settle {
                    Some(_) => "settle has to move the tissue out of it",
                    None => "the tissue jumps out of it in the first step; let its path begin outside",
                };
                let message = format!("this instrument starts {:.3} mm inside the body: {what_moves}", 1e3 * depth);
                warnings.push(file.problem(at, message).0);
            }
        }
        Ok(warnings)
    }

    pub const fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// What can be touched, on a body of so many nodes.
    pub(crate) fn surface(&self, nodes: usize) -> Result<Surface<'_>, Problem> {
        let surface = Surface::new(&self.nodes, nodes).and_then(|surface| surface.with_triangles(&self.triangles));
        surface.map_err(Problem::of)
    }

    /// The instruments on the parts of their paths that begin at `time` or before, s.
    pub(crate) fn at(&self, time: f64) -> Vec<Instrument<'_>> {
        self.all.iter().map(|instrument| instrument.at(time)).collect()
    }

    /// The next time after `time` at which an instrument changes its way, s.
    pub(crate) fn next_turn(&self, time: f64) -> f64 {
        let turns = self.all.iter().flat_map(|instrument| &instrument.path).map(|(turn, _)| *turn);
        turns.filter(|turn| *turn > time).fold(f64::INFINITY, f64::min)
    }

    /// The first of two times (s) between which an instrument goes on a part of its path in less than so many seconds.
    pub(crate) fn short_part(&self, seconds: f64) -> Option<f64> {
        self.all.iter().find_map(|instrument| short_part(&instrument.path, seconds))
    }

    /// The surface with these instruments.
    pub(crate) fn contact<'a>(
        &'a self,
        instruments: &'a [Instrument<'a>],
        nodes: usize,
    ) -> Result<Contact<'a>, Problem> {
        Contact::new(self.surface(nodes)?, instruments).map_err(Problem::of)
    }
}

impl MovedInstrument {
    fn read(file: &SceneFile, at: &Spanned<InstrumentTable>, body: &Body) -> Result<Self, Problem> {
        let table = at.get_ref();
        let friction = positive(file, "friction", table.friction.as_ref(), 0.0)?.unwrap_or(0.0);
        let direction = table.direction.as_ref().map_or([0.0, 0.0, 1.0], |direction| *direction.get_ref());
        if let Some(at) = &table.direction
            && !(direction.iter().all(|component| component.is_finite()) && direction != [0.0; 3])
        {
            return Err(file.problem(at, format!("direction is {direction:?}; it needs a length")));
        }
        let instrument =
            Self { shape: OwnedShape::read(file, at)?, friction, path: read_path(file, at, body)?, direction };
        // Whatever else the kernel refuses.
        let instruments = [instrument.at(0.0)];
        let surface = Surface::new(&[], 0).map_err(Problem::of)?;
        Contact::new(surface, &instruments).map_err(|error| file.problem(at, error))?;
        Ok(instrument)
    }

    /// Points of its axis where it starts, m from the centre of the body; a plane and a field have none.
    fn axis(&self) -> Vec<[f32; 3]> {
        let half = match self.shape {
            OwnedShape::Sphere { .. } => 0.0,
            OwnedShape::Capsule { length, .. } => 0.5 * length,
            OwnedShape::Plane | OwnedShape::Field(_) => return vec![],
        };
        let (start, along) = (self.placed(0.0).0, self.direction);
        let length = along.iter().map(|component| component * component).sum::<f32>().sqrt();
        // Not farther apart than half its radius.
        let parts = (4.0 * half / self.shape.shape().thickness()).ceil().min(1e3) as u32;
        let share = |part: u32| if parts > 0 { 2.0 * part as f32 / parts as f32 - 1.0 } else { 0.0 };
        let at = |part: u32| [0, 1, 2].map(|axis| start[axis] + half * share(part) / length * along[axis]);
        (0..=parts).map(at).collect()
    }

    /// How deep in it a node may be by the rounding of meshes, or of the grid of a field, m.
    fn rounding(&self, body: &Body) -> f32 {
        match &self.shape {
            OwnedShape::Field(owned) => owned.field.spacing,
            _ => (ON_PLANE * body.diagonal()) as f32,
        }
    }

    fn pose(&self, position: [f32; 3]) -> Pose {
        Pose::along(position, self.direction)
    }

    /// On the part of its path that begins at `time` or before, s.
    fn at(&self, time: f64) -> Instrument<'_> {
        let next = self.path.partition_point(|(turn, _)| *turn <= time).clamp(1, self.path.len().max(2) - 1);
        let (from, to) = (self.path[next - 1], *self.path.get(next).unwrap_or(&self.path[next - 1]));
        let mut instrument = Instrument::resting(self.shape.shape(), self.pose(from.1));
        instrument.friction = self.friction;
        (instrument.to, instrument.times) = (self.pose(to.1), [from.0, to.0]);
        instrument
    }

    /// Its position at `time`, s, m from the centre of the body, and its rotation.
    pub(crate) fn placed(&self, time: f64) -> ([f32; 3], [f32; 4]) {
        let Instrument { from, to, times: [start, end], .. } = self.at(time);
        let share = if time >= end { 1.0 } else { ((time - start) / (end - start)).max(0.0) } as f32;
        let at = |axis: usize| from.position[axis] + share * (to.position[axis] - from.position[axis]);
        ([0, 1, 2].map(at), from.rotation)
    }
}

impl std::fmt::Display for SceneInstruments {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, instrument) in self.all.iter().enumerate() {
            let comma = if index > 0 { ", " } else { "" };
            match &instrument.shape {
                OwnedShape::Plane => write!(f, "{comma}{index}: plane")?,
                OwnedShape::Sphere { radius } => write!(f, "{comma}{index}: sphere of {:.2} mm", 1e3 * radius)?,
                OwnedShape::Capsule { radius, length } => {
                    write!(f, "{comma}{index}: capsule of {:.2} mm, {:.2} mm long", 1e3 * radius, 1e3 * length)?;
                }
                OwnedShape::Field(owned) => {
                    let [x, y, z] = owned.field.size;
                    write!(f, "{comma}{index}: field of {x} x {y} x {z} points")?;
                }
            }
        }
        write!(f, "; {} nodes", self.nodes.len())?;
        if !self.triangles.is_empty() {
            write!(f, " and {} triangles", self.triangles.len())?;
        }
        f.write_str(" can be touched")
    }
}

impl OwnedShape {
    fn read(file: &SceneFile, at: &Spanned<InstrumentTable>) -> Result<Self, Problem> {
        let table = at.get_ref();
        let name = table.shape.get_ref().as_str();
        let needed = |what: &str, value: Option<&Spanned<f32>>| {
            positive(file, what, value, f32::MIN_POSITIVE)?
                .ok_or_else(|| file.problem(at, format!("a {name} needs a {what}, m")))
        };
        let [radius, length] = [table.radius.as_ref(), table.length.as_ref()];
        let surplus = match name {
            "plane" => radius.or(length).map(|at| (at.span(), "a size")),
            "sphere" | "field" => length.or(radius.filter(|_| name == "field")).map(|at| (at.span(), "that size")),
            _ => None,
        };
        if let Some((span, what)) = surplus {
            return Err(file.problem(&Spanned::new(span, ()), format!("a {name} has no use for {what}")));
        }
        match name {
            "plane" => Ok(Self::Plane),
            "sphere" => Ok(Self::Sphere { radius: needed("radius", radius)? }),
            "capsule" => Ok(Self::Capsule { radius: needed("radius", radius)?, length: needed("length", length)? }),
            "field" => Ok(Self::Field(Box::new(OwnedField::read(file, at)?))),
            other => Err(file.problem(
                &table.shape,
                format!("shape \"{other}\" is not known; \"sphere\", \"capsule\", \"plane\" and \"field\" are"),
            )),
        }
    }

    fn shape(&self) -> Shape<'_> {
        match self {
            Self::Plane => Shape::Plane,
            &Self::Sphere { radius } => Shape::Sphere { radius },
            &Self::Capsule { radius, length } => Shape::Capsule { radius, length },
            Self::Field(owned) => Shape::Field(owned.field.field().expect("checked when it was read")),
        }
    }
}

impl OwnedField {
    /// Points of the grid along the diagonal of the surface's box.
    const POINTS: f32 = 80.0;

    fn read(file: &SceneFile, at: &Spanned<InstrumentTable>) -> Result<Self, Problem> {
        let table = at.get_ref();
        let Some(path) = &table.file else {
            return Err(file.problem(at, "a field needs the file of a mesh"));
        };
        let scale = table.scale.as_ref().map_or(1.0, |scale| *scale.get_ref());
        let (points, triangles) =
            read_surface(&file.resolve(path.get_ref()), scale).map_err(|error| file.problem(path, error))?;
        let spacing = positive(file, "spacing", table.spacing.as_ref(), f32::MIN_POSITIVE)?;
        let spacing = spacing.unwrap_or_else(|| {
            let of = |axis: usize| {
                triangles.as_flattened().iter().map(move |&node| node as usize).map({
                    let points = &points;
                    move |node| points[node][axis]
                })
            };
            let edge = |axis: usize| of(axis).fold(f32::MIN, f32::max) - of(axis).fold(f32::MAX, f32::min);
            (0..3).map(|axis| edge(axis).powi(2)).sum::<f32>().sqrt() / Self::POINTS
        });
        let field = SurfaceField::new(&points, &triangles, spacing).map_err(|error| file.problem(path, error))?;
        field.field().map_err(|error| file.problem(path, format!("{error}; is the surface closed?")))?;
        Ok(Self { field, points, triangles })
    }
}

fn read_path(file: &SceneFile, at: &Spanned<InstrumentTable>, body: &Body) -> Result<Vec<(f64, [f32; 3])>, Problem> {
    let table = at.get_ref();
    let Some(path) = &table.path else {
        return if table.shape.get_ref() == "field" {
            // Where its file has it.
            Ok(vec![(0.0, body.centre.map(|component| -component as f32))])
        } else {
            Err(file.problem(at, "an instrument needs a path = [[t, x, y, z], ...], s and m"))
        };
    };
    checked_path(file, path, body)
}

/// When the first part of a path begins that takes less than so many seconds, s.
pub(super) fn short_part(path: &[(f64, [f32; 3])], seconds: f64) -> Option<f64> {
    path.windows(2).find(|part| part[1].0 - part[0].0 < seconds).map(|part| part[0].0)
}

/// Times (s) that increase, and points (m from the centre of the body).
pub(super) fn checked_path(
    file: &SceneFile,
    path: &Spanned<Vec<[f64; 4]>>,
    body: &Body,
) -> Result<Vec<(f64, [f32; 3])>, Problem> {
    let points = path.get_ref();
    if points.is_empty() {
        return Err(file.problem(path, "the path has no point"));
    }
    if let Some(point) = points.iter().find(|point| point.iter().any(|component| !component.is_finite())) {
        return Err(file.problem(path, format!("the path holds {point:?}")));
    }
    if let Some((a, b)) = points.iter().zip(&points[1..]).find(|(a, b)| a[0] >= b[0]) {
        return Err(file.problem(path, format!("the path goes from {} s to {} s; times must increase", a[0], b[0])));
    }
    Ok(points.iter().map(|&[time, x, y, z]| (time, body.local_point([x, y, z]))).collect())
}

/// A number that is finite and not below `least`.
pub(super) fn positive(
    file: &SceneFile,
    what: &str,
    value: Option<&Spanned<f32>>,
    least: f32,
) -> Result<Option<f32>, Problem> {
    let Some(at) = value else { return Ok(None) };
    let value = *at.get_ref();
    if value.is_finite() && value >= least {
        return Ok(Some(value));
    }
    let rule = if least > 0.0 { "positive" } else { "zero or more" };
    Err(file.problem(at, format!("{what} is {value}, it must be {rule}")))
}
