//! The results of a simulation: frames and tables, in a folder that takes its place when they are complete.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use supple::io::{Frame, write_atomically, write_pvd, write_triangles, write_vtu};
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::VecState;
use supple::tled;

use super::instrument_mesh;
use super::staging::Staging;
use crate::problem::Problem;
use crate::report;
use crate::scene::body::Body;
use crate::scene::setup::Setup;

/// Results but frames, by the names of their files.
const TABLES: [&str; 7] =
    ["frames.pvd", "final.csv", "points.csv", "pulls.csv", "reactions.csv", "summary.json", report::FILE];

/// The folder of a simulation's results.
pub(crate) struct Folder {
    staging: Staging,
    frames: Vec<(f64, String)>,
    count: usize,
}

impl Folder {
    /// Begins a folder; one that is there is left alone unless `force`, and until the new one is complete.
    pub(crate) fn create(path: &Path, force: bool) -> Result<Self, Problem> {
        Ok(Self { staging: Staging::open(path, force, is_result)?, frames: vec![], count: 0 })
    }

    /// Puts the complete folder into its place.
    pub(crate) fn publish(self) -> Result<(), Problem> {
        self.staging.publish()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.staging.folder().join(name)
    }

    /// Adds a frame: displacement (m), velocity (m/s), pressure (Pa) of the nodes; von Mises stress (Pa), volume ratio
    /// J of the elements. The stress is that of the law, so not of tissue that relaxes.
    pub(crate) fn add_frame(
        &mut self,
        setup: &Setup,
        scene: SceneView<'_, VecMaterial>,
        state: &mut VecState,
    ) -> Result<(), Problem> {
        let body = &setup.body;
        let pressure = tled::nodal_pressures(&scene, state)
            .ok_or_else(|| Problem("the state does not have the nodes of the scene".into()))?;
        let displacement = report::simulation::shape(state);
        let velocity: Vec<_> = (0..displacement.len()).map(|node| state.velocity(node)).collect();
        // Elements that were left out have four fixed nodes: no stress, no change of volume.
        let mut von_mises = vec![0.0; body.mesh.tets.len()];
        let mut volume_ratio = vec![1.0; body.mesh.tets.len()];
        for fields in scene.element_fields(state.displacements()) {
            von_mises[fields.element] = fields.von_mises as f32;
            volume_ratio[fields.element] = fields.volume_ratio as f32;
        }
        let cells = [("von_mises", &von_mises[..]), ("volume_ratio", &volume_ratio[..])];
        let number = self.count;
        self.count += 1;
        let name = format!("frame_{number:04}.vtu");
        let frame = Frame {
            points: &body.mesh.points,
            tets: &body.mesh.tets,
            point_vectors: &[("displacement", &displacement), ("velocity", &velocity)],
            point_scalars: &[("pressure", &pressure)],
            cell_scalars: if setup.tissues.relax() { &cells[1..] } else { &cells },
            ..Frame::default()
        };
        write_vtu(&self.path(&name), &frame).map_err(Problem::of)?;
        self.frames.push((state.time(), name));
        if !setup.instruments.is_empty() {
            let (points, triangles) = instrument_mesh::of(&setup.instruments, body, state.time());
            let name = format!("instruments_{number:04}.vtu");
            write_triangles(&self.path(&name), &points, &triangles).map_err(Problem::of)?;
            self.frames.push((state.time(), name));
        }
        // Always complete, so that a look while the simulation runs sees the frames there are.
        write_pvd(&self.path("frames.pvd"), &self.frames).map_err(Problem::of)
    }

    /// Positions at rest and displacements of all nodes, m.
    pub(crate) fn write_final(&self, body: &Body, state: &VecState) -> Result<(), Problem> {
        let mut text = String::from("node,x,y,z,ux,uy,uz\n");
        for (node, (point, vector)) in body.mesh.points.iter().zip(state.displacements()).enumerate() {
            let ([x, y, z], [ux, uy, uz]) = (point, vector.to_array());
            // Writing to a string does not fail.
            let _ = writeln!(text, "{node},{x},{y},{z},{ux},{uy},{uz}");
        }
        self.write_text("final.csv", &text)
    }

    pub(crate) fn write_text(&self, name: &str, text: &str) -> Result<(), Problem> {
        write_atomically(&self.path(name), |out| out.write_all(text.as_bytes())).map_err(Problem::of)
    }
}

/// Whether a file of this name is a result of a simulation, or one that a killed process was writing.
fn is_result(name: &OsStr) -> bool {
    let Some(name) = name.to_str() else { return false };
    // `.NAME.PROCESS-COUNT.tmp`
    let temporary = name.strip_prefix('.').and_then(|rest| rest.strip_suffix(".tmp"));
    let name = temporary.and_then(|rest| rest.rsplit_once('.')).map_or(name, |(name, _)| name);
    let number = ["frame_", "instruments_"].into_iter().find_map(|prefix| name.strip_prefix(prefix));
    let number = number.and_then(|rest| rest.strip_suffix(".vtu"));
    TABLES.contains(&name) || number.is_some_and(|number| number.parse::<u32>().is_ok())
}
