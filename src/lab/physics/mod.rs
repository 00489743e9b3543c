//! Physics: cases with a truth that is not ours. A filmed beam, closed forms of elasticity and a published benchmark
//! say how far each element is from nature, on meshes from coarse to fine, and what it costs. SI units inside, mm in
//! the tables for people.
//!
//! | module | what it holds |
//! |---|---|
//! | `silicone`, `swing` | a silicone beam under gravity and with a weight, against motion capture ([`recordings`]) |
//! | `bending` | a slender cantilever, against Timoshenko's beam |
//! | `cook` | Cook's membrane, nearly incompressible, against published values |
//! | `cylinder` | a thick-walled cylinder under internal pressure, against Lamé's solution |
//! | `torsion` | a square bar, against Saint-Venant's torsion constant |
//! | `punch` | a flat circular punch on a half-space, against the closed form |
//! | `body`, `mesh` | a body with its element; mapped grids and irregular meshes of tetrahedra |
//! | `steps`, `rest` | exact steps, long ones and backward Euler; the shape at rest |
//! | `pressure` | how much pressure oscillates from node to node |
//! | [`report`], [`tables`] | rows as a file, and as the tables of the documentation |
//! | `figure`, `locking`, `svg` | pictures of error over computing time, and of the beam at rest |

mod bending;
mod cook;
mod cylinder;
mod figure;
mod locking;
mod mesh;
mod pressure;
mod punch;
pub mod recordings;
pub mod report;
mod rest;
mod silicone;
mod specimen;
mod steps;
mod svg;
mod swing;
pub mod tables;
mod torsion;

use std::path::Path;

use supple::io::write_atomically;
use supple::material::Element;

use super::LabError;

/// One quantity of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicsRow {
    /// The case.
    pub case: &'static str,
    /// What made the mesh: a grid, a graded grid or Gmsh.
    pub mesh: &'static str,
    /// The element.
    pub element: Element,
    /// The steps: exact ones, long ones and how far above the critical step, or backward Euler.
    pub method: &'static str,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Tetrahedra of the mesh.
    pub tetrahedra: usize,
    /// What was measured.
    pub quantity: String,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// What the run gives; none if it diverged or found no rest: see the note.
    pub value: Option<f64>,
    /// What it should be, if that is known.
    pub reference: Option<f64>,
    /// Where the reference is from.
    pub source: &'static str,
    /// Computing time for a simulated second, microseconds.
    pub us_per_simulated_second: Option<f64>,
    /// Computing time of the run, of a swing or of the way to rest, s.
    pub computing_seconds: Option<f64>,
    /// Why there is no value.
    pub note: String,
}

impl PhysicsRow {
    /// Value over reference, less one, in per cent.
    #[must_use]
    pub fn error_percent(&self) -> Option<f64> {
        Some(100.0 * (self.value? / self.reference.filter(|reference| *reference != 0.0)? - 1.0))
    }
}

/// A case: its name and what runs it on so many of its meshes, the coarsest first.
type Case = (&'static str, fn(usize) -> Result<Vec<PhysicsRow>, LabError>);

const CASES: [Case; 6] = [
    (silicone::NAME, silicone::rows),
    (bending::NAME, bending::rows),
    (cook::NAME, cook::rows),
    (cylinder::NAME, cylinder::rows),
    (torsion::NAME, torsion::rows),
    (punch::NAME, punch::rows),
];

/// The names of the cases.
pub fn names() -> impl Iterator<Item = &'static str> {
    CASES.into_iter().map(|(name, _)| name)
}

/// Which cases, and how many meshes of each.
#[derive(Clone, Debug)]
pub struct Plan {
    cases: Vec<Case>,
    /// Most meshes of a case, the coarsest first.
    pub meshes: usize,
}

impl Plan {
    /// All meshes of these cases; no name stands for all cases.
    pub fn new(cases: &[String]) -> Result<Self, LabError> {
        let find = |name: &String| {
            CASES.into_iter().find(|(known, _)| known == name).ok_or_else(|| LabError::Unknown {
                kind: "case",
                name: name.to_string(),
                known: names().collect::<Vec<_>>().join(", "),
            })
        };
        let cases = if cases.is_empty() { CASES.to_vec() } else { cases.iter().map(find).collect::<Result<_, _>>()? };
        Ok(Self { cases, meshes: usize::MAX })
    }
}

/// Carries the plan out: rows in `out/physics.csv`, tables of them in `out/physics.md`, and of the beam the errors over
/// computing time in `out/physics.svg` and the shapes at rest in `out/locking.svg`; files of an earlier evaluation are
/// replaced. `say` is given the progress in words.
pub fn evaluate(plan: &Plan, out: &Path, mut say: impl FnMut(&str)) -> Result<Vec<PhysicsRow>, LabError> {
    super::create_folder(out)?;
    let mut rows = Vec::new();
    for (name, run) in &plan.cases {
        say(name);
        rows.extend(run(plan.meshes)?);
    }
    report::write_csv(&out.join("physics.csv"), &rows)?;
    let write = |name: &str, text: &str| write_atomically(&out.join(name), |file| file.write_all(text.as_bytes()));
    write("physics.md", &tables::tables(&rows))?;
    if let Some(svg) = figure::draw(&rows) {
        write("physics.svg", &svg)?;
        write("locking.svg", &locking::draw(plan.meshes)?)?;
    }
    Ok(rows)
}
