//! The folder of a simulation's results: frames and tables.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use supple::element::ElementMaterial;
use supple::io::{Frame, write_atomically, write_pvd, write_vtu};
use supple::scene::SceneView;
use supple::state::VecState;
use supple::tled;

use crate::problem::Problem;
use crate::scene::body::Body;

/// The folder of a simulation's results.
pub(crate) struct Folder {
    path: PathBuf,
    frames: Vec<(f64, String)>,
}

impl Folder {
    /// Makes the folder; one that is there is left alone unless `force`.
    pub(crate) fn create(path: &Path, force: bool) -> Result<Self, Problem> {
        if path.exists() && !force {
            return Err(Problem::in_file(path, "is there already; --force overwrites the results in it"));
        }
        std::fs::create_dir_all(path).map_err(|error| cannot_write(path, &error))?;
        let folder = Self { path: path.to_path_buf(), frames: vec![] };
        folder.remove_old_frames().map_err(|error| cannot_write(path, &error))?;
        Ok(folder)
    }

    /// Frames of an earlier run would mix with ours; nothing else is touched.
    fn remove_old_frames(&self) -> io::Result<()> {
        for entry in std::fs::read_dir(&self.path)? {
            let path = entry?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let number = name.strip_prefix("frame_").and_then(|rest| rest.strip_suffix(".vtu"));
            if number.is_some_and(|number| number.parse::<u32>().is_ok()) {
                std::fs::remove_file(path)?;
            }
        }
        Ok(())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Adds a frame: displacement (m), velocity (m/s), pressure (Pa) of the nodes; von Mises stress (Pa), volume ratio J of the
    /// elements.
    pub(crate) fn add_frame<M: ElementMaterial>(
        &mut self,
        body: &Body,
        scene: SceneView<'_, M>,
        state: &mut VecState,
    ) -> Result<(), Problem> {
        let pressure = tled::nodal_pressures(&scene, state)
            .ok_or_else(|| Problem("the state does not have the nodes of the scene".into()))?;
        let displacement: Vec<_> = state.displacements().iter().map(|vector| vector.to_array()).collect();
        let velocity: Vec<_> = (0..displacement.len()).map(|node| state.velocity(node)).collect();
        // Elements that were left out have four fixed nodes: no stress, no change of volume.
        let mut von_mises = vec![0.0; body.mesh.tets.len()];
        let mut volume_ratio = vec![1.0; body.mesh.tets.len()];
        for fields in scene.element_fields(state.displacements()) {
            von_mises[fields.element] = fields.von_mises as f32;
            volume_ratio[fields.element] = fields.volume_ratio as f32;
        }
        let name = format!("frame_{:04}.vtu", self.frames.len());
        let frame = Frame {
            points: &body.mesh.points,
            tets: &body.mesh.tets,
            point_vectors: &[("displacement", &displacement), ("velocity", &velocity)],
            point_scalars: &[("pressure", &pressure)],
            cell_scalars: &[("von_mises", &von_mises), ("volume_ratio", &volume_ratio)],
        };
        let path = self.path(&name);
        write_vtu(&path, &frame).map_err(|error| cannot_write(&path, &error))?;
        self.frames.push((state.time(), name));
        // Always complete, so that a look while the simulation runs sees the frames there are.
        let path = self.path("frames.pvd");
        write_pvd(&path, &self.frames).map_err(|error| cannot_write(&path, &error))
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
        let path = self.path(name);
        write_atomically(&path, |out| out.write_all(text.as_bytes()))
            .map_err(|error| cannot_write(&path, &error))
    }
}

fn cannot_write(path: &Path, error: &io::Error) -> Problem {
    Problem::in_file(path, format!("cannot be written: {error}"))
}
