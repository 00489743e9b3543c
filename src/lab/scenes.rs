//! The scenes of the laboratory: bodies, laws, supports and loads as data. SI units.
//!
//! The bar is the paper's ([`Bar::PAPER`]), held at z = 0 and loaded at its four corners at z = 100 mm.

use std::path::Path;

use glam::{DVec3, Vec3};
use supple::contact::Instrument;
use supple::io::{TetMesh, parse_msh};
use supple::loads::{Motion, NodalForce};
use supple::material::{AnyLaw, Element, Exponential, NeoHookean, Tissue, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{AsScene, Axes, BuildError, Support, VecScene};
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

use super::course::{Course, CurrentLoads};
use super::timing::Timing;
use super::touched::TouchedSurface;
use super::{LabError, moving};

/// The names of all scenes of the tables, in their order. One more, `bent`, is for training.
pub fn names() -> impl Iterator<Item = &'static str> {
    RAMPED.into_iter().chain(moving::names())
}

/// The scenes of a group, `ramped` or `moving` ([`moving`]); for any other name the scene of that name.
pub(super) fn of_group(name: &str) -> Vec<&str> {
    match name {
        "ramped" => RAMPED.to_vec(),
        "moving" => moving::names().collect(),
        name => vec![name],
    }
}

/// The names of scenes at multiples of the paper's step: slow ramps and small rotations, but for the last three.
pub const RAMPED: [&str; 10] = [
    "torsion",
    "reversed",
    "stretch",
    "compression",
    "compression-neo-hookean",
    "cylinder",
    "lobe",
    "sudden-torsion",
    "release",
    "push",
];

/// The exponential law of the paper's bar.
pub const PAPER_LAW: Exponential = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
/// Four times as stiff at rest as [`PAPER_LAW`] (c would be a / 2), since this law does not stiffen.
pub const NEO_HOOKEAN: NeoHookean = NeoHookean { c: 118.0, d: 60_000.0 };
/// Ten times the paper's shear modulus, for meshes that are longer than the bar and loaded everywhere.
pub const MESH_LAW: Exponential = Exponential { a: 590.0, b: 8.023, d: 60_000.0 };

/// The paper's, kg/m^3.
const DENSITY: f32 = 1_000.0;
/// The paper's, 1/s.
const DAMPING: f32 = 20.0;
/// For sudden loads: a swing falls to a third in 0.4 s, 1/s.
const LIGHT_DAMPING: f32 = 5.0;
/// The paper's, s.
const RAMP: f32 = 1.0;
/// Snapshots, one each 0.03 s: 1.02 s, the first whole number of them that holds the ramp.
const INTERVALS: usize = 34;

/// Twist of the bar, N at each corner: the exact limit falls to 3.85e-5 s during it, so the
/// paper's step is about as long as it can be.
const TORSION: f32 = 15.5;
/// The bar moves by 4 to 6 cm, and its limit of stability stays above 1e-4 s, N at each corner.
const GENTLE: f32 = 0.3;
/// The corners go in by a quarter of the length, N at each corner.
const COMPRESSION: f32 = 0.05;

/// What is simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSpec {
    /// One of [`names`].
    pub name: &'static str,
    /// Node coordinates, m.
    pub points: Vec<[f32; 3]>,
    /// The four nodes of each tetrahedron, of positive volume.
    pub tets: Vec<[u32; 4]>,
    /// The law.
    pub law: AnyLaw,
    /// Tetrahedra; the scenes of the paper are of linear ones.
    pub element: Element,
    /// Density, kg/m^3.
    pub density: f32,
    /// Damping, proportional to mass, 1/s.
    pub damping: f32,
    /// Held nodes.
    pub supports: Vec<Support>,
    /// Velocities at the start.
    pub start: RigidVelocity,
    /// Gravity, m/s^2.
    pub gravity: [f32; 3],
    /// Forces.
    pub forces: Vec<NodalForce>,
    /// Prescribed motions.
    pub motions: Vec<Motion>,
    /// How forces, motions and gravity vary over time.
    pub course: Course,
    /// An instrument that touches the body.
    pub instrument: Option<Instrument<'static>>,
    /// A second tissue of some elements, of the same kind of law.
    pub second: Option<SecondTissue>,
    /// How time is counted.
    pub timing: Timing,
    /// Duration in intervals of [`Timing::interval`].
    pub intervals: usize,
}

/// Tissue of some elements of a scene: only with [`AnyLaw::NeoHookean`].
#[derive(Clone, Debug, PartialEq)]
pub struct SecondTissue {
    /// Its law and density.
    pub tissue: Tissue<NeoHookean>,
    /// One for each element of it, zero for the others.
    pub of_element: Vec<u16>,
}

/// Velocities of a body that moves rigidly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidVelocity {
    /// Of the mean of the nodes, m/s.
    pub linear: [f32; 3],
    /// About it, 1/s.
    pub angular: [f32; 3],
}

impl SceneSpec {
    /// The scene under `times` its forces.
    #[must_use]
    pub fn with_load(mut self, times: f32) -> Self {
        for force in &mut self.forces {
            force.newton = force.newton.map(|newton| times * newton);
        }
        self
    }

    /// Duration, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.intervals as f64 * self.timing.interval_seconds()
    }

    /// Fails unless every snapshot falls on a step of `multiple` times that of the scene.
    pub fn check_multiple(&self, multiple: u32) -> Result<(), LabError> {
        if self.timing.hits_snapshots(multiple) {
            return Ok(());
        }
        Err(LabError::Multiple { scene: self.name, multiple, interval: self.timing.interval })
    }

    /// What the scene is made of.
    #[must_use]
    pub fn material(&self) -> VecMaterial {
        let Self { element, law, density, second, .. } = self;
        let mut material = VecMaterial::one(*element, *law, *density);
        if let Some(SecondTissue { tissue, of_element }) = second {
            material.tissues.push(tissue.values());
            material.of_element.clone_from(of_element);
        }
        material
    }

    /// Builds the scene.
    pub fn build(&self) -> Result<VecScene<VecMaterial>, LabError> {
        let mesh = Mesh::new(&self.points, &self.tets, Winding::Checked).map_err(BuildError::Mesh)?;
        Ok(VecScene::build(self.material(), &mesh, &self.supports)?)
    }

    /// The loads, checked against the scene.
    pub fn loads(&self, scene: &impl AsScene) -> Result<CurrentLoads<'_>, LabError> {
        CurrentLoads::new(self, scene)
    }

    /// The surface that the instrument touches, if there is one.
    pub(super) fn touched(&self) -> Result<Option<TouchedSurface>, LabError> {
        let instruments = self.instrument.as_slice();
        if instruments.is_empty() {
            return Ok(None);
        }
        let mesh = Mesh::new(&self.points, &self.tets, Winding::Checked).map_err(BuildError::Mesh)?;
        TouchedSurface::new(&mesh, instruments).map(Some)
    }

    /// The state at the start, for steps of `dt` (s).
    pub fn state(&self, scene: &impl AsScene, dt: f32) -> Result<VecState, LabError> {
        let count = self.points.len();
        let mut state = VecState::at_rest(count);
        if let Some(touched) = self.touched()? {
            state = touched.met_by(state)?;
        }
        if self.start != RigidVelocity::default() {
            let [linear, angular] = [self.start.linear, self.start.angular].map(Vec3::from);
            let centre = self.points.iter().copied().map(Vec3::from).sum::<Vec3>() / count as f32;
            let velocity = |node: usize| {
                let point = self.points.get(node).copied().map_or(centre, Vec3::from);
                (linear + angular.cross(point - centre)).to_array()
            };
            let step = Step::unchecked(dt, self.damping)?;
            if !tled::start(scene, &mut state, &step, |node| ([0.0; 3], velocity(node))) {
                return Err(LabError::Mismatch { nodes: scene.as_scene().node_count(), room: count });
            }
        }
        Ok(state)
    }
}

/// All scenes.
pub fn all() -> Result<Vec<SceneSpec>, LabError> {
    names().map(named).collect()
}

/// The scene with this name.
pub fn named(name: &str) -> Result<SceneSpec, LabError> {
    match name {
        "torsion" => Ok(bar("torsion", twist(TORSION, RAMP))),
        "reversed" => Ok(bar("reversed", twist(-GENTLE, RAMP))),
        "stretch" => Ok(bar("stretch", pull(GENTLE, RAMP))),
        "compression" => Ok(bar("compression", pull(-COMPRESSION, RAMP))),
        "compression-neo-hookean" => Ok(SceneSpec {
            law: AnyLaw::NeoHookean(NEO_HOOKEAN),
            ..bar("compression-neo-hookean", pull(-COMPRESSION, RAMP))
        }),
        "cylinder" => leaning("cylinder", CYLINDER),
        "lobe" => leaning("lobe", LOBE),
        "sudden-torsion" => Ok(SceneSpec { damping: LIGHT_DAMPING, ..bar("sudden-torsion", twist(GENTLE, 0.0)) }),
        // Held for a hundredth of a second after the ramp, so that it is let go at a snapshot.
        "release" => {
            let course = Course::Released((INTERVALS / 2) as f64 * Timing::PAPER.interval_seconds());
            Ok(SceneSpec { course, ..bar("release", pull(GENTLE, 0.5)) })
        }
        "push" => pushed_lobe(),
        "bent" => Ok(bent()),
        _ => moving::named(name).unwrap_or_else(|| {
            let known: Vec<_> = names().chain(["ramped", "moving"]).collect();
            let known = known.join(", ");
            Err(LabError::Unknown { kind: "scene", name: name.to_string(), known })
        }),
    }
}

pub(super) fn bar(name: &'static str, forces: Vec<NodalForce>) -> SceneSpec {
    let bar = Bar::PAPER;
    let [nx, ny, _] = bar.cells;
    SceneSpec {
        name,
        points: bar.points().collect(),
        tets: bar.tets().collect(),
        law: AnyLaw::Exponential(PAPER_LAW),
        element: Element::Linear,
        density: DENSITY,
        damping: DAMPING,
        supports: (0..bar.node(nx, ny, 0) + 1).map(Support::fixed).collect(),
        start: RigidVelocity::default(),
        gravity: [0.0; 3],
        forces,
        motions: Vec::new(),
        course: Course::Steady,
        instrument: None,
        second: None,
        timing: Timing::PAPER,
        intervals: INTERVALS,
    }
}

/// The four corners of the bar's free end with their offsets from the axis, in units of half the width.
fn corners() -> [(u32, [f32; 2]); 4] {
    let [nx, ny, nz] = Bar::PAPER.cells;
    [(0, 0, [-1.0, -1.0]), (nx, 0, [1.0, -1.0]), (0, ny, [-1.0, 1.0]), (nx, ny, [1.0, 1.0])]
        .map(|(i, j, offset)| (Bar::PAPER.node(i, j, nz), offset))
}

/// `newton` at each corner, at a right angle to the axis and to the radius; positive turns x to y.
fn twist(newton: f32, ramp: f32) -> Vec<NodalForce> {
    let along = newton * core::f32::consts::FRAC_1_SQRT_2;
    let force = |(node, [x, y]): (u32, [f32; 2])| NodalForce { node, newton: [-y * along, x * along, 0.0], ramp };
    corners().map(force).to_vec()
}

/// `newton` at each corner along the axis.
fn pull(newton: f32, ramp: f32) -> Vec<NodalForce> {
    corners().map(|(node, _)| NodalForce { node, newton: [0.0, 0.0, newton], ramp }).to_vec()
}

pub(super) const CYLINDER: &[u8] = include_bytes!("../../meshes/cylinder.msh");
pub(super) const LOBE: &[u8] = include_bytes!("../../meshes/lobe.msh");
/// The held end of a mesh, as a share of its length: more than a layer of elements.
pub(super) const HELD: f32 = 0.12;

/// A mesh that leans over under a body force across its length.
fn leaning(name: &'static str, file: &[u8]) -> Result<SceneSpec, LabError> {
    /// A sixteenth of the weight, m/s^2: the free end moves by more than a centimetre.
    const ACCELERATION: f32 = 0.6;
    let (mut scene, _) = held_at_its_end(name, file)?;
    let (axis, _, _) = longest(&scene.points);
    let masses = node_masses(&scene);
    let forces = (0..).zip(masses).map(|(node, mass)| {
        let mut newton = [0.0; 3];
        newton[(axis + 1) % 3] = -ACCELERATION * mass;
        NodalForce { node, newton, ramp: RAMP }
    });
    scene.forces = forces.collect();
    Ok(scene)
}

/// The bar, ten times as stiff, leaning over under a body force, held at two layers of nodes, which end between layers
/// of a lattice. For training: it is in no table.
fn bent() -> SceneSpec {
    /// m/s^2.
    const ACCELERATION: f32 = 0.6;
    let mut scene = SceneSpec { law: AnyLaw::Exponential(MESH_LAW), ..bar("bent", Vec::new()) };
    let [nx, ny, _] = Bar::PAPER.cells;
    scene.supports = (0..Bar::PAPER.node(nx, ny, 1) + 1).map(Support::fixed).collect();
    let forces = (0..).zip(node_masses(&scene));
    scene.forces =
        forces.map(|(node, mass)| NodalForce { node, newton: [ACCELERATION * mass, 0.0, 0.0], ramp: RAMP }).collect();
    scene
}

/// The lobe with its tip bent down by an instrument.
fn pushed_lobe() -> Result<SceneSpec, LabError> {
    /// Nodes of the surface within this distance of the tip follow the instrument: its width, m.
    const PATCH: f32 = 0.012;
    /// Down (z), m: an eleventh of the free length, which bends the tip but leaves the limit of stability where it is.
    const DEPTH: f32 = 0.012;
    let (mut scene, triangles) = held_at_its_end("push", LOBE)?;
    let (axis, _, high) = longest(&scene.points);
    let tip = scene.points.iter().copied().find(|point| point[axis] == high).unwrap_or_default();
    let mut surface = vec![false; scene.points.len()];
    for node in triangles.into_iter().flatten() {
        if let Some(is) = surface.get_mut(node as usize) {
            *is = true;
        }
    }
    let nodes = (0..).zip(&scene.points).zip(surface);
    let patch = nodes.filter(|((_, point), surface)| {
        let square: f32 = point.iter().zip(tip).map(|(a, b)| (a - b) * (a - b)).sum();
        *surface && square < PATCH * PATCH
    });
    let motion = |((node, _), _)| Motion { node, axes: Axes::XYZ, metre: [0.0, 0.0, -DEPTH], ramp: RAMP };
    scene.motions = patch.map(motion).collect();
    scene.supports.extend(scene.motions.iter().map(|motion| Support::moved(motion.node)));
    Ok(scene)
}

/// A mesh held at the low end of its longest axis, and the triangles of its surface.
pub(super) fn held_at_its_end(name: &'static str, file: &[u8]) -> Result<(SceneSpec, Vec<[u32; 3]>), LabError> {
    let TetMesh { points, tets, triangles, .. } = parse_msh(Path::new(name), file)?;
    let points = points.into_iter().map(|point| point.map(|component| component as f32)).collect();
    Ok((SceneSpec { law: AnyLaw::Exponential(MESH_LAW), ..held(name, points, tets) }, triangles))
}

/// A body held at the low end of its longest axis.
pub(super) fn held(name: &'static str, points: Vec<[f32; 3]>, tets: Vec<[u32; 4]>) -> SceneSpec {
    let (axis, low, high) = longest(&points);
    let held = (0..).zip(&points).filter(|(_, point)| point[axis] < low + HELD * (high - low));
    let supports = held.map(|(node, _)| Support::fixed(node)).collect();
    SceneSpec { points, tets, supports, ..bar(name, Vec::new()) }
}

/// The axis along which the points reach farthest, with their least and largest coordinates on it.
pub(super) fn longest(points: &[[f32; 3]]) -> (usize, f32, f32) {
    let reach = |axis: usize| {
        let values = points.iter().map(|point| point[axis]);
        values.fold((axis, f32::INFINITY, f32::NEG_INFINITY), |(_, low, high), value| {
            (axis, low.min(value), high.max(value))
        })
    };
    let farther = |a: (usize, f32, f32), b: (usize, f32, f32)| if b.2 - b.1 > a.2 - a.1 { b } else { a };
    farther(farther(reach(0), reach(1)), reach(2))
}

/// Signed volume of a tetrahedron, m^3.
pub(crate) fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).dot((c - a).cross(d - a)) / 6.0
}

/// Lumped masses, kg: a quarter of each element's to each of its nodes.
pub(super) fn node_masses(scene: &SceneSpec) -> Vec<f32> {
    let mut masses = vec![0.0; scene.points.len()];
    for tet in &scene.tets {
        let corners = tet.map(|node| {
            let [x, y, z] = scene.points.get(node as usize).copied().unwrap_or_default();
            DVec3::new(f64::from(x), f64::from(y), f64::from(z))
        });
        let share = 0.25 * volume(corners) * f64::from(scene.density);
        for node in tet {
            if let Some(mass) = masses.get_mut(*node as usize) {
                *mass += share;
            }
        }
    }
    masses.into_iter().map(|mass| mass as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_of_a_twist_turn_but_do_not_push() {
        let forces = twist(2.0, 1.0);
        for axis in 0..3 {
            assert_eq!(forces.iter().map(|force| force.newton[axis]).sum::<f32>(), 0.0);
        }
        for force in forces {
            let [x, y, z] = Bar::PAPER.points().nth(force.node as usize).unwrap();
            assert_eq!(z, 0.1);
            let moment = (x - 0.025) * force.newton[1] - (y - 0.025) * force.newton[0];
            let arm = 0.025 * core::f32::consts::SQRT_2;
            assert!((moment - 2.0 * arm).abs() < 1e-6);
        }
    }
}
