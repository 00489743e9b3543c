//! From a scene file to what the kernel wants: nodes in float32 around the body's centre, supports, loads,
//! tissues. Everything that can be wrong with a scene is found here, before any time passes.

use supple::loads::{Motion, NodalForce, traction};
use supple::material::{Exponential, Law, Literal, Material, NeoHookean, Regions, Tissue};
use supple::scene::{Axes, BuildError, ElementBlock, NodeInertia, Scene, Support, blocks_for};
use supple::state::{NodeVector, State};
use toml::Spanned;

use crate::body::{Body, extent, read_body};
use crate::scene_file::{AxisName, MaterialTable, Problem, RegionTable, SceneFile, Selection, StepLength};

/// How far from a plane a node may be and still lie on it, as a share of the body's diagonal: more than the
/// rounding of mesh files, less than any element.
const ON_PLANE: f64 = 1e-5;

/// The kernel's scene and state on a host with a heap.
pub(crate) type HostScene<M> = Scene<M, Vec<NodeInertia>, Vec<ElementBlock>>;
pub(crate) type HostState = State<Vec<NodeVector>>;

/// A length of step as asked for.
#[derive(Clone, Copy)]
pub(crate) enum StepChoice {
    Seconds(f32),
    /// 0.9 of the critical step, asked again while running.
    Auto,
}

/// A scene ready to be built.
pub(crate) struct Setup {
    pub(crate) body: Body,
    pub(crate) supports: Vec<Support>,
    pub(crate) forces: Vec<NodalForce>,
    pub(crate) motions: Vec<Motion>,
    pub(crate) gravity: [f32; 3],
    pub(crate) damping: f32,
    pub(crate) step: StepChoice,
    pub(crate) end: f64,
    pub(crate) frames: u32,
    pub(crate) warnings: Vec<String>,
    law: String,
    /// `a, b, c, d, density` of `[material]`, then of each region.
    tissues: Vec<[f32; 5]>,
    of_element: Vec<u16>,
}

/// Work that is compiled once for each law.
pub(crate) trait Job {
    type Output;
    fn run<M: Material>(self, material: M) -> Self::Output;
}

impl Setup {
    pub(crate) fn read(file: &SceneFile) -> Result<Self, Problem> {
        let scene = &file.scene;
        if let Some(surrogate) = &scene.surrogate {
            return Err(file.problem(
                surrogate,
                "the learned step ([surrogate]) is not in this version; remove the table",
            ));
        }
        let body = read_body(file, &scene.mesh)?;
        let mut warnings = vec![];
        let diagonal = body.diagonal();
        if !(1e-3..=5.0).contains(&diagonal) {
            warnings.push(
                file.problem(
                    &scene.mesh,
                    format!(
                        "the body is {:.4} m across; is scale right? (0.001 turns millimetres into metres)",
                        diagonal
                    ),
                )
                .to_string(),
            );
        }
        let gravity = file.gravity()?;
        let damping = scene.damping.as_ref().map_or(0.0, |damping| *damping.get_ref());
        if let Some(at) = &scene.damping
            && !(damping.is_finite() && damping >= 0.0)
        {
            return Err(file.problem(at, format!("damping is {damping} 1/s, it must be zero or more")));
        }
        let (supports, forces, motions) = read_loads(file, &body)?;
        let (law, tissues, of_element) = read_tissues(file, &body)?;
        let time = scene.time.get_ref();
        if let Some(method) = &time.method
            && method.get_ref() != "tled"
        {
            return Err(file.problem(
                method,
                format!("method \"{}\" is not in this version; \"tled\" is", method.get_ref()),
            ));
        }
        let step = match time.step.get_ref() {
            StepLength::Seconds(seconds) if seconds.is_finite() && *seconds > 0.0 => {
                StepChoice::Seconds(*seconds)
            }
            StepLength::Named(name) if name == "auto" => StepChoice::Auto,
            StepLength::Seconds(seconds) => {
                return Err(
                    file.problem(&time.step, format!("step is {seconds} s, it must be a positive number"))
                );
            }
            StepLength::Named(name) => {
                return Err(file
                    .problem(&time.step, format!("step \"{name}\" is not known; give seconds or \"auto\"")));
            }
        };
        let end = *time.end.get_ref();
        if !(end.is_finite() && end > 0.0) {
            return Err(file.problem(&time.end, format!("end is {end} s, it must be a positive number")));
        }
        if let StepChoice::Seconds(seconds) = step
            && f64::from(seconds) > end
        {
            return Err(
                file.problem(&time.step, format!("the step of {seconds} s is longer than the end, {end} s"))
            );
        }
        let frames = time.frames.as_ref().map_or(1, |frames| *frames.get_ref());
        if let (0, Some(at)) = (frames, &time.frames) {
            return Err(file.problem(at, "frames is 0; the last state is always written, so give 1 or more"));
        }
        Ok(Self {
            body,
            supports,
            forces,
            motions,
            gravity,
            damping,
            step,
            end,
            frames,
            warnings,
            law,
            tissues,
            of_element,
        })
    }

    /// The lobe of `supple demo`, which has no scene file.
    pub(crate) fn of_body(body: Body, constants: Exponential, density: f32) -> Self {
        let Exponential { a, b, d } = constants;
        Self {
            body,
            supports: vec![],
            forces: vec![],
            motions: vec![],
            gravity: [0.0; 3],
            damping: 0.0,
            step: StepChoice::Auto,
            end: 1.0,
            frames: 1,
            warnings: vec![],
            law: "exponential".into(),
            tissues: vec![[a, b, 0.0, d, density]],
            of_element: vec![],
        }
    }

    /// What the material is, for people.
    pub(crate) fn describe_material(&self) -> String {
        let [a, b, c, d, density] = self.tissues[0];
        let constants = if self.law.starts_with("neo") {
            format!("c {c} Pa, d {d} Pa")
        } else {
            format!("a {a} Pa, b {b}, d {d} Pa")
        };
        let regions = match self.tissues.len() - 1 {
            0 => String::new(),
            1 => ", 1 further region".into(),
            more => format!(", {more} further regions"),
        };
        format!("{}, {constants}, {density} kg/m^3{regions}", self.law)
    }

    /// Runs `job` with the material of this scene.
    pub(crate) fn with_material<J: Job>(&self, job: J) -> J::Output {
        match self.law.as_str() {
            "neo-hookean" => self.with_law(job, |[_, _, c, d, _]| NeoHookean { c, d }),
            "neo-hookean-literal" => self.with_law(job, |[_, _, c, d, _]| Literal(NeoHookean { c, d })),
            "exponential-literal" => self.with_law(job, |[a, b, _, d, _]| Literal(Exponential { a, b, d })),
            _ => self.with_law(job, |[a, b, _, d, _]| Exponential { a, b, d }),
        }
    }

    fn with_law<L: Law + Default, J: Job>(&self, job: J, law: impl Fn([f32; 5]) -> L) -> J::Output {
        let tissue = |constants: &[f32; 5]| Tissue { law: law(*constants), density: constants[4] };
        if let [only] = self.tissues.as_slice() {
            return job.run(tissue(only));
        }
        let tissues: Vec<_> = self.tissues.iter().map(tissue).collect();
        job.run(Regions { tissues: &tissues, of_element: &self.of_element })
    }

    /// The kernel's scene over vectors.
    pub(crate) fn build<M: Material>(&self, material: M) -> Result<(HostScene<M>, HostState), Problem> {
        let mesh = self.body.checked()?;
        let nodes = vec![NodeInertia::EMPTY; self.body.local.len()];
        let blocks = vec![ElementBlock::EMPTY; blocks_for(mesh.element_count())];
        let mut scene = Scene::over(material, nodes, blocks);
        scene.build(&mesh, &self.supports).map_err(|error| match error {
            BuildError::Mesh(error) => self.body.mesh_problem(error),
            error => Problem(format!("{}: {error}", self.body.name)),
        })?;
        let zero = || vec![NodeVector::ZERO; self.body.local.len()];
        Ok((scene, State::over(zero(), zero(), zero())))
    }
}

type Lists = (Vec<Support>, Vec<NodalForce>, Vec<Motion>);

fn read_loads(file: &SceneFile, body: &Body) -> Result<Lists, Problem> {
    let scene = &file.scene;
    let (mut supports, mut forces, mut motions) = (vec![], vec![], vec![]);
    for at in &scene.fix {
        let axes = read_axes(file, at.get_ref().axes.as_ref())?;
        let nodes = select(file, at, &at.get_ref().selection(), body)?;
        supports.extend(nodes.into_iter().map(|node| Support { node, axes, moves: false }));
    }
    for at in &scene.motion {
        let axes = read_axes(file, at.get_ref().axes.as_ref())?;
        let (metre, ramp) = (at.get_ref().metre, read_ramp(file, at, at.get_ref().ramp)?);
        finite(file, at, "metre", &metre)?;
        for node in select(file, at, &at.get_ref().selection(), body)? {
            supports.push(Support { node, axes, moves: true });
            motions.push(Motion { node, axes, metre, ramp });
        }
    }
    for at in &scene.force {
        let (newton, ramp) = (at.get_ref().newton, read_ramp(file, at, at.get_ref().ramp)?);
        finite(file, at, "newton", &newton)?;
        let nodes = select(file, at, &at.get_ref().selection(), body)?;
        forces.extend(nodes.into_iter().map(|node| NodalForce { node, newton, ramp }));
    }
    let boundary = if scene.traction.is_empty() { vec![] } else { body.boundary() };
    for at in &scene.traction {
        let (pascal, ramp) = (at.get_ref().pascal, read_ramp(file, at, at.get_ref().ramp)?);
        finite(file, at, "pascal", &pascal)?;
        let mut selected = vec![false; body.local.len()];
        for node in select(file, at, &at.get_ref().selection(), body)? {
            selected[node as usize] = true;
        }
        let triangles: Vec<_> = boundary
            .iter()
            .filter(|triangle| triangle.iter().all(|&node| selected[node as usize]))
            .copied()
            .collect();
        if triangles.is_empty() {
            return Err(file.problem(
                at,
                "this traction selects nodes, but no boundary triangle with all three of its nodes",
            ));
        }
        for force in traction(&body.local, &triangles, pascal, ramp) {
            forces.push(force.map_err(|error| file.problem(at, error))?);
        }
    }
    Ok((supports, forces, motions))
}

fn read_ramp<T>(file: &SceneFile, at: &Spanned<T>, ramp: Option<f32>) -> Result<f32, Problem> {
    match ramp {
        Some(ramp) if !(ramp.is_finite() && ramp >= 0.0) => {
            Err(file.problem(at, format!("ramp is {ramp} s, it must be zero or more")))
        }
        ramp => Ok(ramp.unwrap_or(0.0)),
    }
}

fn finite<T>(file: &SceneFile, at: &Spanned<T>, name: &str, vector: &[f32; 3]) -> Result<(), Problem> {
    match vector.iter().find(|component| !component.is_finite()) {
        Some(component) => Err(file.problem(at, format!("{name} holds {component}"))),
        None => Ok(()),
    }
}

fn read_axes(file: &SceneFile, axes: Option<&Spanned<String>>) -> Result<Axes, Problem> {
    let Some(at) = axes else {
        return Ok(Axes::XYZ);
    };
    let mut found = Axes::NONE;
    for letter in at.get_ref().chars() {
        found = found.union(match letter {
            'x' => Axes::X,
            'y' => Axes::Y,
            'z' => Axes::Z,
            other => {
                return Err(file.problem(at, format!("axes holds '{other}'; x, y and z may stand there")));
            }
        });
    }
    if found == Axes::NONE {
        return Err(file.problem(at, "axes is empty; x, y and z may stand there"));
    }
    Ok(found)
}

/// The nodes an entry is about; none is an error.
fn select<T>(
    file: &SceneFile,
    at: &Spanned<T>,
    selection: &Selection<'_>,
    body: &Body,
) -> Result<Vec<u32>, Problem> {
    let points = &body.mesh.points;
    let chosen = match selection {
        Selection { nodes: Some(nodes), plane: None, bounds: None } => {
            if let Some(node) = nodes.iter().find(|node| **node as usize >= points.len()) {
                return Err(file.problem(
                    at,
                    format!("node {node} does not exist, the mesh has nodes 0 to {}", points.len() - 1),
                ));
            }
            nodes.to_vec()
        }
        Selection { nodes: None, .. } => {
            let inside = inside(file, at, selection, body)?;
            (0..points.len() as u32).filter(|&node| inside(points[node as usize])).collect()
        }
        _ => return Err(file.problem(at, "give exactly one of nodes, plane and box")),
    };
    if chosen.is_empty() {
        let (low, high) = extent(points);
        let mm = |point: [f64; 3]| point.map(|component| (component * 1e6).round() * 1e-3);
        return Err(file.problem(
            at,
            format!("this selects no node; the mesh reaches from {:?} to {:?} mm", mm(low), mm(high)),
        ));
    }
    Ok(chosen)
}

/// Whether a point is on the plane or in the box of a selection.
fn inside<T>(
    file: &SceneFile,
    at: &Spanned<T>,
    selection: &Selection<'_>,
    body: &Body,
) -> Result<impl Fn([f64; 3]) -> bool + use<T>, Problem> {
    let (plane, bounds) = (selection.plane, selection.bounds);
    if plane.is_some() == bounds.is_some() {
        return Err(file.problem(at, "give exactly one of nodes, plane and box"));
    }
    let tolerance = ON_PLANE * body.diagonal();
    Ok(move |point: [f64; 3]| {
        let on_plane = plane.is_none_or(|plane| {
            let axis = match plane.axis {
                AxisName::X => 0,
                AxisName::Y => 1,
                AxisName::Z => 2,
            };
            (point[axis] - plane.at).abs() <= tolerance
        });
        let in_box = bounds.is_none_or(|bounds| {
            (0..3).all(|axis| {
                point[axis] >= bounds.min[axis] - tolerance && point[axis] <= bounds.max[axis] + tolerance
            })
        });
        on_plane && in_box
    })
}

type Tissues = (String, Vec<[f32; 5]>, Vec<u16>);

fn read_tissues(file: &SceneFile, body: &Body) -> Result<Tissues, Problem> {
    let at = &file.scene.material;
    let MaterialTable { law, a, b, c, d, density } = at.get_ref();
    let wanted = match law.get_ref().as_str() {
        "neo-hookean" | "neo-hookean-literal" => [("a", false), ("b", false), ("c", true), ("d", true)],
        "exponential" | "exponential-literal" => [("a", true), ("b", true), ("c", false), ("d", true)],
        other => {
            let known =
                "\"neo-hookean\", \"exponential\", \"neo-hookean-literal\" and \"exponential-literal\" are";
            return Err(file.problem(law, format!("law \"{other}\" is not known; {known}")));
        }
    };
    let mut base = [0.0; 5];
    for ((name, needed), (slot, given)) in wanted.iter().zip(base.iter_mut().zip([a, b, c, d])) {
        match (needed, given) {
            (true, Some(value)) => *slot = *value,
            (true, None) => return Err(file.problem(at, format!("the law {} needs {name}", law.get_ref()))),
            (false, Some(_)) => {
                return Err(file.problem(at, format!("the law {} has no constant {name}", law.get_ref())));
            }
            (false, None) => {}
        }
    }
    base[4] = *density;
    check_constants(file, at, &wanted, &base)?;
    let mut tissues = vec![base];
    let mut of_element = vec![0; body.mesh.tets.len()];
    for at in &file.scene.region {
        let RegionTable { tags, plane, bounds, a, b, c, d, density } = at.get_ref();
        let mut tissue = base;
        for ((name, needed), (slot, given)) in wanted.iter().zip(tissue.iter_mut().zip([a, b, c, d])) {
            if let Some(value) = given {
                if !needed {
                    return Err(file.problem(at, format!("the law {} has no constant {name}", law.get_ref())));
                }
                *slot = *value;
            }
        }
        tissue[4] = density.unwrap_or(base[4]);
        check_constants(file, at, &wanted, &tissue)?;
        let index = u16::try_from(tissues.len()).map_err(|_| file.problem(at, "more than 65,535 regions"))?;
        let mut any = false;
        let mut assign = |element: usize| {
            of_element[element] = index;
            any = true;
        };
        if let Some(tags) = tags {
            if plane.is_some() || bounds.is_some() {
                return Err(file.problem(at, "give exactly one of tags, plane and box"));
            }
            let tagged = body.mesh.regions.iter().enumerate().filter(|(_, tag)| tags.contains(tag));
            tagged.for_each(|(element, _)| assign(element));
        } else {
            let selection = Selection { nodes: None, plane: *plane, bounds: *bounds };
            let inside = inside(file, at, &selection, body)?;
            for (element, tet) in body.mesh.tets.iter().enumerate() {
                let corners = tet.map(|node| body.mesh.points[node as usize]);
                if inside([0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0))
                {
                    assign(element);
                }
            }
        }
        if !any {
            return Err(
                file.problem(at, "this region selects no element (by tag, or by the middle of the element)")
            );
        }
        tissues.push(tissue);
    }
    Ok((law.get_ref().clone(), tissues, of_element))
}

fn check_constants<T>(
    file: &SceneFile,
    at: &Spanned<T>,
    wanted: &[(&str, bool); 4],
    values: &[f32; 5],
) -> Result<(), Problem> {
    let named = wanted.iter().copied().chain([("density", true)]).zip(values);
    for ((name, needed), value) in named {
        if needed && !(value.is_finite() && *value > 0.0) {
            return Err(file.problem(at, format!("{name} is {value}, it must be a positive number")));
        }
    }
    Ok(())
}
