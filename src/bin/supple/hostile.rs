//! Damaged scene files: each is refused with its file, a line where there is one, and a reason, or is ready to be
//! built. Memory grows with the file and the bar that it asks for, whose tetrahedra are counted as bytes of input.

#[path = "../../../tests/support/hostile.rs"]
mod runs;

use runs::{Changes, Run, measured};

use crate::scene::file::SceneFile;
use crate::scene::setup::Setup;

#[global_allocator]
static ALLOCATOR: runs::Counting = runs::Counting;

/// Bytes of memory for a byte of a file, for a tetrahedron, and for any file.
const BYTES: u64 = 200;
const TETRAHEDRON: u64 = 300;
const ANY: u64 = 100_000;

const BAR: &str = r#"damping = 10.0
[mesh]
shape = "bar"
size = [0.02, 0.02, 0.1]
cells = [2, 2, 6]
[material]
law = "exponential"
a = 59.0
b = 8.0
d = 60000.0
density = 1000.0
[[fix]]
plane = { axis = "z", at = 0.0 }
[[force]]
nodes = [62]
newton = [0.01, 0.0, 0.0]
ramp = 0.1
[[move]]
box = { min = [0.0, 0.0, 0.09], max = [0.005, 0.005, 0.2] }
metre = [0.001, 0.0, 0.0]
axes = "xy"
[[traction]]
plane = { axis = "z", at = 0.1 }
pascal = [0.0, 0.0, 5.0]
gravity = [0.0, 0.0, -9.81]
[time]
step = "auto"
end = 0.1
frames = 3
method = "multilevel"
lattice = [1, 1, 2]
"#;

const WORDS: &[&[u8]] = &[
    b"[[fix]]\n",
    b"[[region]]\n",
    b"[learned]\n",
    b"[mesh]\n",
    b"element = \"nodal-strain\"\n",
    b"winding = \"normalise\"\n",
    b"scale = 1e-3\n",
    b"file = \"../mesh.msh\"\n",
    b"weights = \"x\"\n",
    b"nodes = [0, 1]\n",
    b"\"linear\"",
    b"\"mass-scaled\"",
    b"nan",
    b"-inf",
    b"1e400",
    b"[[",
    b"{a=",
    b"\"\"\"",
    b"a.",
    b"1979-05-27T07:32:00Z",
    b"step = 1e-4\n",
    b"law = \"neo-hookean\"\n",
];

/// Builds the scene, and asks for what acts on it.
fn build(setup: &Setup) -> bool {
    match setup.build() {
        Ok((scene, _)) => setup.loads(&scene).is_ok(),
        Err(problem) => {
            assert!(problem.to_string().len() > 10, "{problem}");
            false
        }
    }
}

#[test]
fn scene_files() {
    let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap();
    let path = folder.path().join("scene.toml");
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/scenes");
    let other = |name: &str| std::fs::read(root.join(name)).unwrap();
    let sound = [BAR.into(), BAR.into(), other("hinged-bar.toml"), other("bar-learned.toml")];
    let changes = Changes { sound: &sound, words: WORDS, most: 100_000 };
    Run::new("scene files", 3_000).each(|dice| {
        let bytes = changes.input(dice);
        std::fs::write(&path, &bytes).unwrap();
        let (read, memory) = measured(|| SceneFile::read(&path));
        assert!(memory <= BYTES * bytes.len() as u64 + ANY, "{memory} bytes for {}", bytes.len());
        let told = |problem: &crate::problem::Problem| {
            let text = problem.to_string();
            assert!(text.contains("scene.toml") && text.len() > folder.path().to_str().unwrap().len() + 20, "{text:?}");
        };
        let file = match read {
            Ok(file) => file,
            Err(problem) => {
                told(&problem);
                return false;
            }
        };
        let cells = file.scene.mesh.get_ref().cells.as_ref().map_or([0; 3], |cells| *cells.get_ref());
        let tetrahedra = cells.iter().fold(6u64, |product, &count| product.saturating_mul(count.into()));
        // A bar that takes seconds to make is as right as a small one.
        if (200_000..=100_000_000).contains(&tetrahedra) {
            return false;
        }
        let (setup, memory) = measured(|| Setup::read(&file));
        let input = if tetrahedra < 200_000 { tetrahedra } else { 0 };
        let most = BYTES * bytes.len() as u64 + TETRAHEDRON * input + ANY;
        match setup {
            Ok(setup) => {
                assert!(memory <= most || setup.learned.is_some(), "{memory} bytes for {}", bytes.len());
                build(&setup)
            }
            Err(problem) => {
                told(&problem);
                false
            }
        }
    });
}
