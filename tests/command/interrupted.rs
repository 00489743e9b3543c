//! Results are old or new, whatever happens to the process that makes them: killed, without room on the disk, or not
//! alone.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use super::networks::described;
use super::{Desk, SUPPLE, Said, bar, names};

/// Two scenes whose results share no file.
fn scenes(desk: &Desk) {
    for (name, newton, frames) in [("a.toml", 0.001, 30), ("b.toml", 0.002, 20)] {
        let scene = bar(&format!(
            "[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[[force]]\nnodes = [49]\nnewton = [{newton}, 0.0, 0.0]\n\
             [time]\nstep = \"auto\"\nend = 0.01\nframes = {frames}\n"
        ));
        desk.write(name, &scene.replace("cells = [2, 2, 5]", "cells = [4, 4, 10]"));
    }
    // Runs until it is killed.
    let rest = "[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n[time]\nstep = \"auto\"\nend = 1e4\nframes = 1000000\n";
    desk.write("endless.toml", &bar(rest));
}

/// Begins a run, and does not wait for it.
fn begin(desk: &Desk, scene: &str, out: &str) -> Child {
    let arguments = ["simulate", scene, "--out", out, "--force"];
    desk.command(SUPPLE, &arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn complete(desk: &Desk, scene: &str, out: &str) {
    let said = desk.supple(&["simulate", scene, "--out", out, "--force"]);
    assert_eq!(said.code, 0, "{}", said.err);
}

/// The files of a folder of results; of summary and report, which has the time of day, what does not change from run to
/// run.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let content = |name: String| {
        let mut bytes = fs::read(folder.join(&name)).unwrap();
        if name == "summary.json" {
            let summary: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
            bytes = format!("{} {}", summary["status"], summary["max_displacement_mm"]).into_bytes();
        } else if name == "report.html" {
            let page = String::from_utf8(bytes).unwrap();
            let title = page.lines().find(|line| line.starts_with("<title>")).unwrap();
            bytes = format!("{title} {}", page.trim_end().ends_with("</html>")).into_bytes();
        }
        (name, bytes)
    };
    names(folder).into_iter().map(content).collect()
}

/// A hidden folder with the results of the run that was killed just before it removed them.
fn leave(desk: &Desk, within: &str) {
    fs::create_dir_all(desk.path(".out.run")).unwrap();
    fs::write(desk.path(".out.run/lock"), "").unwrap();
    fs::rename(desk.path("out"), desk.path(".out.run").join(within)).unwrap();
    fs::write(desk.path(".out.run").join(within).join(".frame_0003.vtu.7-4.tmp"), "half").unwrap();
}

#[test]
fn a_killed_run_leaves_the_old_results_or_the_new_ones() {
    const KILLS: u32 = 40;
    let desk = Desk::new();
    scenes(&desk);
    let mut expected = BTreeMap::new();
    let mut span = Duration::ZERO;
    for scene in ["a.toml", "b.toml"] {
        let clock = Instant::now();
        complete(&desk, scene, "reference");
        span = span.max(clock.elapsed());
        expected.insert(scene, contents(&desk.path("reference")));
    }
    fs::remove_dir_all(desk.path("reference")).unwrap();
    complete(&desk, "a.toml", "out");
    let (mut now, mut replaced, mut left) = ("a.toml", 0, 0);
    for kill in 0..KILLS {
        let next = if now == "a.toml" { "b.toml" } else { "a.toml" };
        let mut child = begin(&desk, next, "out");
        // Even over the run and a little more, in an order without meaning.
        std::thread::sleep(span * (kill * 17 % KILLS) / KILLS * 6 / 5);
        child.kill().unwrap();
        child.wait().unwrap();
        let found = contents(&desk.path("out"));
        if found == expected[next] {
            (now, replaced) = (next, replaced + 1);
        }
        assert!(found == expected[now], "kill {kill}: {:?}", found.keys());
        left += u32::from(desk.path(".out.run").exists());
    }
    println!("{KILLS} kills: {replaced} after the results were replaced, {left} left a hidden folder");
    assert!(left > 0 && replaced < KILLS);
    complete(&desk, "a.toml", "out");
    assert!(contents(&desk.path("out")) == expected["a.toml"]);
    assert_eq!(names(&desk.path("")), ["a.toml", "b.toml", "endless.toml", "out"]);
}

#[test]
fn what_a_killed_run_left_is_put_right() {
    let desk = Desk::new();
    scenes(&desk);
    complete(&desk, "a.toml", "out");
    let a = contents(&desk.path("out"));
    let rest = ["a.toml", "b.toml", "endless.toml", "out"];

    // Killed after the exchange, with a file of somebody else's still in the old folder.
    fs::write(desk.path("out/notes.txt"), "mine").unwrap();
    leave(&desk, "new");
    complete(&desk, "a.toml", "elsewhere");
    fs::rename(desk.path("elsewhere"), desk.path("out")).unwrap();
    let said = desk.supple(&["simulate", "b.toml", "--out", "out"]);
    assert!(said.code == 2 && said.err.contains("out: is there already"), "{}", said.err);
    assert_eq!(fs::read(desk.path("out/notes.txt")).unwrap(), b"mine");
    assert_eq!(names(&desk.path("")), rest);
    complete(&desk, "a.toml", "out");
    assert_eq!(fs::read(desk.path("out/notes.txt")).unwrap(), b"mine");
    fs::remove_file(desk.path("out/notes.txt")).unwrap();
    assert!(contents(&desk.path("out")) == a);
    assert_eq!(names(&desk.path("")), rest);

    // Killed between two renamings, where folders cannot be exchanged: the old one comes back.
    leave(&desk, "old");
    fs::remove_file(desk.path(".out.run/old/.frame_0003.vtu.7-4.tmp")).unwrap();
    let said = desk.supple(&["simulate", "b.toml", "--out", "out"]);
    assert!(said.code == 2 && said.err.contains("out: is there already"), "{}", said.err);
    assert!(contents(&desk.path("out")) == a);
    assert_eq!(names(&desk.path("")), rest);
}

#[test]
fn a_second_run_into_the_same_folder_is_refused() {
    let desk = Desk::new();
    scenes(&desk);
    complete(&desk, "a.toml", "out");
    let a = contents(&desk.path("out"));
    let mut first = begin(&desk, "endless.toml", "out");
    // Its frames can be looked at.
    let series = desk.path(".out.run/new/frames.pvd");
    let clock = Instant::now();
    while !fs::read_to_string(&series).is_ok_and(|text| text.contains("frame_0001.vtu")) {
        assert!(clock.elapsed() < Duration::from_secs(60), "no frame");
        std::thread::sleep(Duration::from_millis(5));
    }
    let said = desk.supple(&["simulate", "a.toml", "--out", "out", "--force"]);
    print!("{}", said.err);
    assert_eq!(said.code, 2);
    assert!(said.err.starts_with("error: out: another run writes there and holds .out.run/lock"), "{}", said.err);
    assert!(contents(&desk.path("out")) == a);
    complete(&desk, "a.toml", "other");
    // A process that was killed holds nothing.
    first.kill().unwrap();
    first.wait().unwrap();
    complete(&desk, "b.toml", "out");
    assert!(!desk.path(".out.run").exists());
    // Begun at the same time: one at least ends well, and the folder is one of theirs.
    let mut both = ["a.toml", "b.toml"].map(|scene| (scene, begin(&desk, scene, "out")));
    let well: Vec<_> =
        both.iter_mut().filter_map(|(scene, child)| child.wait().unwrap().success().then_some(*scene)).collect();
    let found = contents(&desk.path("out"));
    assert!(!well.is_empty());
    assert!(well.iter().any(|scene| (found == a) == (*scene == "a.toml")), "{well:?}");
    assert!(!desk.path(".out.run").exists());
}

#[test]
fn a_folder_that_cannot_be_replaced_is_refused_in_words() {
    let desk = Desk::new();
    scenes(&desk);
    desk.write("file", "");
    for (out, words) in [
        (".", "is not the name of a folder"),
        ("file", "file: is a file; results need a folder"),
        ("file/out", "file: cannot be made"),
    ] {
        let said = desk.supple(&["simulate", "a.toml", "--out", out, "--force"]);
        print!("{}", said.err);
        assert_eq!(said.code, 2);
        assert!(said.err.contains(words), "{}", said.err);
    }
    assert_eq!(names(&desk.path("")), ["a.toml", "b.toml", "endless.toml", "file"]);
}

#[cfg(unix)]
#[test]
fn a_link_stays_and_its_folder_is_replaced() {
    let desk = Desk::new();
    scenes(&desk);
    complete(&desk, "a.toml", "there");
    std::os::unix::fs::symlink("there", desk.path("link")).unwrap();
    complete(&desk, "b.toml", "link/");
    assert!(desk.path("link").is_symlink());
    assert_eq!(names(&desk.path("there")).len(), 25);
}

/// Runs the command with files of at most 512 or 1,024 bytes (the shells differ) times `size`; one that grows beyond
/// cannot be written, as if the disk were full.
#[cfg(target_os = "linux")]
fn with_little_room(desk: &Desk, size: u32, arguments: &str) -> Said {
    let line = format!("trap '' XFSZ; ulimit -f {size}; exec {SUPPLE} {arguments}");
    Said::of(desk.command("sh", &["-c", &line]).output().unwrap())
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_old_results_and_is_named() {
    let desk = Desk::new();
    scenes(&desk);
    let said = with_little_room(&desk, 8, "simulate a.toml --out out");
    print!("{}", said.err);
    let words = "error: .out.run/new/frame_0000.vtu: cannot be written: File too large (os error 27)\n";
    assert_eq!((said.code, said.err.as_str()), (2, words));
    assert_eq!(names(&desk.path("")), ["a.toml", "b.toml", "endless.toml"]);
    complete(&desk, "a.toml", "out");
    let a = contents(&desk.path("out"));
    let said = with_little_room(&desk, 8, "simulate b.toml --out out --force");
    assert_eq!((said.code, said.err.as_str()), (2, words));
    assert!(contents(&desk.path("out")) == a);

    desk.network("a.weights", &described(&[7, 20, 3], &[10, 12, 3], 1));
    desk.write("a.safetensors", "old");
    let said = with_little_room(&desk, 1, "weights export a.weights --out a.safetensors");
    print!("{}", said.err);
    let words = "error: a.safetensors: cannot be written: File too large (os error 27)\n";
    assert_eq!((said.code, said.err.as_str()), (2, words));
    assert_eq!(fs::read(desk.path("a.safetensors")).unwrap(), b"old");
    assert_eq!(names(&desk.path("")), ["a.safetensors", "a.toml", "a.weights", "b.toml", "endless.toml", "out"]);
}
