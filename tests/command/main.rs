//! The command as a person uses it: scene files in, folders out, exit codes and sentences.
mod demo;
mod errors;
mod fibres;
mod fit;
mod inertia;
mod inspect;
mod instruments;
mod interrupted;
mod learned;
mod pulls;
mod screen;
mod simulate;
mod unloaded;
mod weights;

#[path = "../support/networks.rs"]
mod networks;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

const SUPPLE: &str = env!("CARGO_BIN_EXE_supple");

/// A folder that goes away with the test.
struct Desk(TempDir);

/// What a run of the command said.
struct Said {
    code: i32,
    out: String,
    err: String,
}

impl Said {
    fn of(Output { status, stdout, stderr }: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Self { code: status.code().unwrap(), out: text(stdout), err: text(stderr) }
    }
}

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    fn network(&self, name: &str, description: &supple::mlp::Description<'_>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, supple::mlp::write(description).unwrap()).unwrap();
        path
    }

    fn command(&self, program: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.args(arguments).current_dir(self.0.path());
        command
    }

    fn supple(&self, arguments: &[&str]) -> Said {
        Said::of(self.command(SUPPLE, arguments).output().unwrap())
    }

    /// Simulates `scene` into the folder `out`.
    fn simulate(&self, scene: &str, more: &[&str]) -> Said {
        self.write("scene.toml", scene);
        let mut arguments = vec!["simulate", "scene.toml", "--out", "out"];
        arguments.extend(more);
        self.supple(&arguments)
    }

    fn summary(&self) -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(self.path("out/summary.json")).unwrap()).unwrap()
    }

    /// Rows of final.csv.
    fn last(&self) -> Vec<[f64; 7]> {
        let text = std::fs::read_to_string(self.path("out/final.csv")).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("node,x,y,z,ux,uy,uz"));
        let row = |line: &str| {
            let values: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
            values.try_into().unwrap()
        };
        lines.map(row).collect()
    }
}

/// A small bar, 20 x 20 x 50 mm, 54 nodes; `rest` is appended.
fn bar(rest: &str) -> String {
    format!(
        "damping = 20.0\n[mesh]\nshape = \"bar\"\nsize = [0.02, 0.02, 0.05]\ncells = [2, 2, 5]\n\
         [material]\nlaw = \"neo-hookean\"\nc = 500.0\nd = 15000.0\ndensity = 1000.0\n{rest}"
    )
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
