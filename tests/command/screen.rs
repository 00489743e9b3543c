//! What is printed has no reader, or no room: the command ends quietly, or says so, and its files are there all the
//! same.

use super::networks::described;
use super::{Desk, SUPPLE, Said, bar};

const SCENE: &str = "[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n[time]\nstep = \"auto\"\nend = 0.001\nframes = 2\n";

/// Runs the command with nobody at the other end of its standard output.
fn without_reader(desk: &Desk, arguments: &[&str]) -> Said {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    Said::of(desk.command(SUPPLE, arguments).stdout(writer).output().unwrap())
}

#[cfg(unix)]
#[test]
fn without_a_reader_a_command_ends_quietly() {
    let desk = Desk::new();
    desk.write("scene.toml", &bar(SCENE));
    desk.network("a.weights", &described(&[7, 20, 3], &[10, 12, 3], 1));
    for arguments in [
        "simulate scene.toml --out out",
        "inspect scene.toml",
        "inspect a.weights",
        "weights export a.weights --out a.safetensors",
        "weights import a.safetensors --out b.weights",
    ] {
        let said = without_reader(&desk, &arguments.split(' ').collect::<Vec<_>>());
        assert_eq!((said.code, said.err.as_str()), (141, ""), "{arguments}");
    }
    for file in ["out/summary.json", "b.weights"] {
        assert!(desk.path(file).exists(), "{file}");
    }
}

#[test]
fn without_a_reader_divergence_is_still_said() {
    let desk = Desk::new();
    let scene = SCENE.replace("\"auto\"", "2e-3").replace("end = 0.001", "end = 1.0");
    desk.write("scene.toml", &format!("gravity = [0.0, 0.0, -9.81]\n{}", bar(&scene)));
    let said = without_reader(&desk, &["simulate", "scene.toml", "--out", "out", "--unchecked"]);
    assert!(said.code == 3 && said.err.contains("diverged"), "{}", said.err);
}

#[cfg(target_os = "linux")]
#[test]
fn output_for_which_there_is_no_room_is_an_error() {
    let desk = Desk::new();
    desk.write("scene.toml", &bar(SCENE));
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let said = Said::of(desk.command(SUPPLE, &["inspect", "scene.toml"]).stdout(full).output().unwrap());
    let words = "error: standard output: cannot be written: No space left on device (os error 28)\n";
    assert_eq!((said.code, said.err.as_str()), (2, words));
}
