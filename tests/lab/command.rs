//! The command `supple-lab`: what it refuses, and the files of `physics`.

use std::fs;
use std::path::{Path, PathBuf};

use supple_cli::problem::End;
use supple_lab::command;
use tempfile::TempDir;

/// Does what the command is asked for; gives its complaint.
fn lab(arguments: &[&str]) -> Result<(), String> {
    match command::run(["supple-lab"].iter().chain(arguments)) {
        Ok(End::Reached) => Ok(()),
        Ok(End::Diverged(divergence)) => Err(divergence.to_string()),
        Err(problem) => Err(problem.to_string()),
    }
}

/// What it complains of.
fn refused(arguments: &[&str]) -> String {
    lab(arguments).expect_err("it is refused")
}

/// A new folder and a path in it.
fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    (folder, out)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn what_does_not_exist_is_named_with_what_does() {
    let (_folder, out) = folder();
    for (flag, value, sentence) in [
        ("--scene", "tension", "scene \"tension\" is not known; there are torsion, reversed, "),
        ("--sweep", "tension", "scene \"tension\" is not known; there are torsion, reversed, "),
        ("--method", "euler", "method \"euler\" is not known; there are tled, hold, "),
        ("--multiple", "3", "multiple 3 misses the snapshots of torsion; there are 1, 2, 4, 5, 8, 10, "),
    ] {
        let problem = refused(&["methods", "--out", text(&out), flag, value]);
        assert!(problem.starts_with(sentence), "{problem}");
        assert!(!out.exists());
    }
}

#[test]
fn a_mesh_that_cannot_be_judged_is_named() {
    let (_folder, out) = folder();
    for (scale, sentence) in [("0", "--scale 0: it must be a positive number"), ("1", "none.msh: ")] {
        let problem = refused(&["hard", "--mesh", "none.msh", "--scale", scale, "--out", text(&out)]);
        assert!(problem.starts_with(sentence), "{problem}");
        assert!(!out.exists());
    }
}

#[test]
fn cells_that_do_not_fit_the_patch_are_refused() {
    let (_folder, out) = folder();
    for cells in [["7", "6"], ["6", "12"], ["6", "0"]] {
        let problem = refused(&["large-strain", "--quick", "--truth", cells[0], cells[1], "--out", text(&out)]);
        assert!(problem.starts_with("--truth: they must be multiples of six, the larger one first"), "{problem}");
        assert!(!out.exists());
    }
}

#[test]
fn physics_of_a_case_is_a_table_with_orders_of_convergence() {
    let (folder, out) = folder();
    lab(&["physics", "--scene", "torsion", "--out", text(&out)]).unwrap();
    let table = fs::read_to_string(out.join("physics.md")).unwrap();
    assert!(table.contains("\n| case | mesh | element |"), "{table}");
    let csv = fs::read_to_string(out.join("physics.csv")).unwrap();
    let heads = "case,mesh,element,method,nodes,tetrahedra,quantity,unit,value,reference,source,error_percent,\
                 us_per_simulated_second,computing_seconds,note";
    assert_eq!(csv.lines().next(), Some(heads));
    // Two kinds of steps on three meshes and an order, for each of three elements.
    assert_eq!(csv.lines().count(), 1 + 3 * 7);
    assert_eq!(csv.matches("order of convergence").count(), 3);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("\"name\":\"torsion: torque\""));

    let none = folder.path().join("none");
    let problem = refused(&["physics", "--scene", "lobe", "--out", text(&none)]);
    let sentence = "case \"lobe\" is not known; there are silicone-beam, bending, cook, cylinder, torsion, punch";
    assert!(problem.starts_with(sentence), "{problem}");
    assert!(!none.exists());

    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let problem = refused(&["physics", "--scene", "torsion", "--out", text(&file)]);
    assert!(problem.starts_with(&format!("{}: cannot be made: ", file.display())), "{problem}");
}

#[cfg(not(feature = "train"))]
#[test]
fn a_command_without_training_says_how_to_get_it() {
    for command in ["train", "quantise"] {
        let problem = refused(&[command, "file", "--out", "organ.weights"]);
        let words = "built without training; build it with `cargo build --release -p supple-lab --features train`";
        assert!(problem.contains(words), "{problem}");
    }
}
