//! The command `supple-lab`: what it refuses, and the files of `physics`.

use std::path::PathBuf;
use std::process::Command;

use tempfile::TempDir;

/// Runs the command in a folder; gives its exit code, what it printed and its complaints.
fn lab(folder: &TempDir, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple-lab"));
    let said = command.args(arguments).current_dir(folder.path()).output().unwrap();
    let [out, err] = [said.stdout, said.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (said.status.code(), out, err)
}

fn folder() -> (TempDir, impl Fn(&str) -> PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_path_buf();
    (folder, move |name| path.join(name))
}

#[test]
fn what_does_not_exist_is_named_with_what_does() {
    let (folder, path) = folder();
    for (flag, value, sentence) in [
        ("--scene", "tension", "scene \"tension\" is not known; there are torsion, reversed, "),
        ("--sweep", "tension", "scene \"tension\" is not known; there are torsion, reversed, "),
        ("--method", "euler", "method \"euler\" is not known; there are tled, hold, "),
        ("--multiple", "3", "multiple 3 misses the snapshots of torsion; there are 1, 2, 4, 5, 8, 10, "),
    ] {
        let (code, _, err) = lab(&folder, &["methods", "--out", "out", flag, value]);
        assert_eq!(code, Some(2));
        assert!(err.starts_with(&format!("error: {sentence}")), "{err}");
        assert!(!path("out").exists());
    }
}

#[test]
fn a_mesh_that_cannot_be_judged_is_named() {
    let (folder, path) = folder();
    for (scale, sentence) in [("0", "--scale 0: it must be a positive number"), ("1", "none.msh: ")] {
        let (code, _, err) = lab(&folder, &["hard", "--mesh", "none.msh", "--scale", scale, "--out", "out"]);
        assert_eq!(code, Some(2));
        assert!(err.starts_with(&format!("error: {sentence}")), "{err}");
        assert!(!path("out").exists());
    }
}

#[test]
fn cells_that_do_not_fit_the_patch_are_refused() {
    let (folder, path) = folder();
    for cells in [["7", "6"], ["6", "12"], ["6", "0"]] {
        let (code, _, err) = lab(&folder, &["large-strain", "--quick", "--truth", cells[0], cells[1], "--out", "out"]);
        assert_eq!(code, Some(2));
        assert!(err.starts_with("error: --truth: they must be multiples of six, the larger one first"), "{err}");
        assert!(!path("out").exists());
    }
}

#[test]
fn physics_of_a_case_is_a_table_with_orders_of_convergence() {
    let (folder, path) = folder();
    let (code, out, err) = lab(&folder, &["physics", "--scene", "torsion", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    let table = std::fs::read_to_string(path("out/physics.md")).unwrap();
    assert!(table.contains("\n| case | mesh | element |") && out.starts_with(&table), "{table}");
    let csv = std::fs::read_to_string(path("out/physics.csv")).unwrap();
    let heads = "case,mesh,element,method,nodes,tetrahedra,quantity,unit,value,reference,source,error_percent,\
                 us_per_simulated_second,computing_seconds,note";
    assert_eq!(csv.lines().next(), Some(heads));
    // Two kinds of steps on three meshes and an order, for each of three elements.
    assert_eq!(csv.lines().count(), 1 + 3 * 7);
    assert_eq!(csv.matches("order of convergence").count(), 3);
    let page = std::fs::read_to_string(path("out/report.html")).unwrap();
    assert!(page.contains("<dd>supple-lab physics --scene torsion --out out</dd>"));
    assert!(page.contains("\"name\":\"torsion: torque\""));

    let (code, _, err) = lab(&folder, &["physics", "--scene", "lobe", "--out", "none"]);
    assert_eq!(code, Some(2));
    let sentence =
        "error: case \"lobe\" is not known; there are silicone-beam, bending, cook, cylinder, torsion, punch";
    assert!(err.starts_with(sentence), "{err}");
    assert!(!path("none").exists());

    std::fs::write(path("file"), "").unwrap();
    let (code, _, err) = lab(&folder, &["physics", "--scene", "torsion", "--out", "file"]);
    assert!(code == Some(2) && err.starts_with("error: file: cannot be made: "), "{err}");
}

#[cfg(not(feature = "train"))]
#[test]
fn a_command_without_training_says_how_to_get_it() {
    let (folder, _) = folder();
    for command in ["train", "quantise"] {
        let (code, _, err) = lab(&folder, &[command, "file", "--out", "organ.weights"]);
        assert_eq!(code, Some(2));
        let words = "built without training; build it with `cargo build --release -p supple-lab --features train`";
        assert!(err.contains(words), "{err}");
    }
}
