//! The scene file: what a person writes about a simulation, in TOML. Lengths in metres (after `scale`), SI
//! units. Every complaint names the file and the line.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::{Spanned, Value};

use super::directions::DirectionsTable;
use super::instruments::InstrumentTable;
use super::points::PointTable;
use super::pulls::PullTable;
use crate::problem::Problem;

/// A scene file with its text, for line numbers.
pub struct SceneFile {
    path: PathBuf,
    text: String,
    pub(crate) scene: SceneTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneTable {
    pub(crate) mesh: Spanned<MeshTable>,
    pub(crate) material: Spanned<TissueTable>,
    #[serde(default)]
    pub(crate) region: Vec<Spanned<TissueTable>>,
    pub(crate) directions: Option<Spanned<DirectionsTable>>,
    pub(crate) damping: Option<Spanned<f32>>,
    #[serde(default)]
    pub(crate) fix: Vec<Spanned<FixTable>>,
    #[serde(default)]
    pub(crate) force: Vec<Spanned<ForceTable>>,
    #[serde(default)]
    pub(crate) mass: Vec<Spanned<MassTable>>,
    #[serde(default, rename = "move")]
    pub(crate) motion: Vec<Spanned<MoveTable>>,
    #[serde(default)]
    pub(crate) traction: Vec<Spanned<TractionTable>>,
    #[serde(default)]
    pub(crate) pressure: Vec<Spanned<PressureTable>>,
    #[serde(default)]
    pub(crate) instrument: Vec<Spanned<InstrumentTable>>,
    #[serde(default)]
    pub(crate) pull: Vec<Spanned<PullTable>>,
    #[serde(default)]
    pub(crate) point: Vec<Spanned<PointTable>>,
    #[serde(default)]
    pub(crate) spring: Vec<Spanned<SpringTable>>,
    gravity: Option<Spanned<[f32; 3]>>,
    pub(crate) time: Spanned<TimeTable>,
    // The former name stays readable.
    #[serde(alias = "surrogate")]
    pub(crate) learned: Option<Spanned<LearnedTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MeshTable {
    pub(crate) file: Option<Spanned<PathBuf>>,
    pub(crate) scale: Option<Spanned<f64>>,
    pub(crate) winding: Option<Spanned<String>>,
    pub(crate) element: Option<Spanned<String>>,
    pub(crate) shape: Option<Spanned<String>>,
    pub(crate) size: Option<Spanned<[f32; 3]>>,
    pub(crate) cells: Option<Spanned<[u32; 3]>>,
}

/// `[material]` or `[[region]]`: which constants it has depends on the law, so that its keys are checked by `tissues`.
pub(crate) type TissueTable = BTreeMap<String, Spanned<Value>>;

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum AxisName {
    X,
    Y,
    Z,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Plane {
    pub(crate) axis: AxisName,
    pub(crate) at: f64,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Bounds {
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
}

/// Which nodes an entry is about: exactly one of the three.
pub(crate) struct Selection<'a> {
    pub(crate) nodes: Option<&'a Spanned<Vec<u32>>>,
    pub(crate) plane: Option<Plane>,
    pub(crate) bounds: Option<Bounds>,
}

/// Entries that select nodes. Each also takes `gravity`: in TOML a key that follows a `[[...]]` header belongs
/// to that entry, and a scene that goes on with `gravity = [...]` means the scene's gravity.
macro_rules! entry {
    ($name:ident { $($field:ident : $type:ty),* }) => {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        pub(crate) struct $name {
            nodes: Option<Spanned<Vec<u32>>>,
            plane: Option<Plane>,
            #[serde(rename = "box")]
            bounds: Option<Bounds>,
            gravity: Option<Spanned<[f32; 3]>>,
            $(pub(crate) $field: $type,)*
        }

        impl $name {
            pub(crate) fn selection(&self) -> Selection<'_> {
                Selection { nodes: self.nodes.as_ref(), plane: self.plane, bounds: self.bounds }
            }
        }
    };
}

entry!(FixTable { axes: Option<Spanned<String>> });
entry!(ForceTable { newton: Spanned<[f32; 3]>, ramp: Option<Spanned<f32>> });
entry!(MassTable { kilogram: Spanned<f32> });
entry!(MoveTable { metre: Spanned<[f32; 3]>, ramp: Option<Spanned<f32>>, axes: Option<Spanned<String>> });
entry!(TractionTable { pascal: Spanned<[f32; 3]>, ramp: Option<Spanned<f32>> });
entry!(SpringTable { stiffness: Option<Spanned<f32>>, per_area: Option<Spanned<f32>> });
entry!(PressureTable { pascal: Spanned<f32>, ramp: Option<Spanned<f32>> });

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TimeTable {
    pub(crate) step: Option<Spanned<StepLength>>,
    pub(crate) tolerance: Option<Spanned<f32>>,
    pub(crate) end: Spanned<f64>,
    pub(crate) frames: Option<Spanned<u32>>,
    pub(crate) method: Option<Spanned<String>>,
    pub(crate) lattice: Option<Spanned<[u32; 3]>>,
    pub(crate) settle: Option<Spanned<f32>>,
}

/// A network that takes over from the exact step.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LearnedTable {
    pub(crate) weights: Spanned<PathBuf>,
    // The former name stays readable.
    #[serde(alias = "burn_in")]
    pub(crate) lead_in: Option<Spanned<f64>>,
    pub(crate) fallback: Option<bool>,
}

#[derive(Deserialize)]
#[serde(untagged)]
pub(crate) enum StepLength {
    Seconds(f32),
    Named(String),
}

impl SceneFile {
    pub fn read(path: &Path) -> Result<Self, Problem> {
        let text =
            supple::io::read_text(path).map_err(|error| Problem::in_file(path, format!("cannot be read: {error}")))?;
        Self::of_text(path, text)
    }

    /// A scene file with this text in place of what it holds.
    pub(crate) fn of_text(path: &Path, text: String) -> Result<Self, Problem> {
        let scene = toml::from_str(&text).map_err(|error: toml::de::Error| {
            let line = error.span().map(|span| format!(", line {}", line_of(&text, span.start)));
            Problem(format!("{}{}: {}", path.display(), line.unwrap_or_default(), error.message()))
        })?;
        Ok(Self { path: path.to_path_buf(), text, scene })
    }

    /// A complaint about something in the file.
    pub(crate) fn problem<T>(&self, at: &Spanned<T>, message: impl fmt::Display) -> Problem {
        Problem(format!("{}: {message}", self.place(at)))
    }

    /// What it holds.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The file and the line of something in it.
    pub(crate) fn place<T>(&self, at: &Spanned<T>) -> String {
        format!("{}, line {}", self.path.display(), line_of(&self.text, at.span().start))
    }

    /// The path of a mesh or weight file, which is named relative to the scene file.
    pub(crate) fn resolve(&self, file: &Path) -> PathBuf {
        self.path.parent().map_or_else(|| file.to_path_buf(), |folder| folder.join(file))
    }

    /// What entries select nodes by, each with where it stands.
    pub(crate) fn selections(&self) -> impl Iterator<Item = (Range<usize>, Selection<'_>)> {
        let scene = &self.scene;
        let fixes = scene.fix.iter().map(|at| (at.span(), at.get_ref().selection()));
        let forces = scene.force.iter().map(|at| (at.span(), at.get_ref().selection()));
        let masses = scene.mass.iter().map(|at| (at.span(), at.get_ref().selection()));
        let motions = scene.motion.iter().map(|at| (at.span(), at.get_ref().selection()));
        let tractions = scene.traction.iter().map(|at| (at.span(), at.get_ref().selection()));
        let pressures = scene.pressure.iter().map(|at| (at.span(), at.get_ref().selection()));
        let springs = scene.spring.iter().map(|at| (at.span(), at.get_ref().selection()));
        fixes.chain(forces).chain(masses).chain(motions).chain(tractions).chain(pressures).chain(springs)
    }

    /// The nodes that entries name by their numbers.
    pub(crate) fn named_nodes(&self) -> impl Iterator<Item = u32> {
        self.selections().filter_map(|(_, selection)| selection.nodes).flat_map(|nodes| nodes.get_ref().iter().copied())
    }

    /// The scene's gravity, wherever TOML put it; none is zero.
    pub(crate) fn gravity(&self) -> Result<[f32; 3], Problem> {
        let scene = &self.scene;
        let fix = scene.fix.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let force = scene.force.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let mass = scene.mass.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let motion = scene.motion.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let traction = scene.traction.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let pressure = scene.pressure.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let instrument = scene.instrument.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let given = scene.gravity.iter().chain(fix).chain(force).chain(mass).chain(motion).chain(traction);
        let pull = scene.pull.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let point = scene.point.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let spring = scene.spring.iter().filter_map(|entry| entry.get_ref().gravity.as_ref());
        let mut given = given.chain(pressure).chain(instrument).chain(pull).chain(spring).chain(point);
        let first = given.next();
        if let Some(second) = given.next() {
            return Err(self.problem(second, "gravity is given twice"));
        }
        match first {
            Some(gravity) if gravity.get_ref().iter().any(|component| !component.is_finite()) => {
                Err(self.problem(gravity, format!("gravity is {:?} m/s^2", gravity.get_ref())))
            }
            Some(gravity) => Ok(*gravity.get_ref()),
            None => Ok([0.0; 3]),
        }
    }
}

pub(crate) fn line_of(text: &str, at: usize) -> usize {
    text.as_bytes().iter().take(at).filter(|byte| **byte == b'\n').count() + 1
}
