//! `supple inspect`: what a mesh or scene is like, faults included.

use super::{Desk, bar};

#[test]
fn a_sound_mesh_is_described() {
    let desk = Desk::new();
    let lobe = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../meshes/lobe.msh");
    let said = desk.supple(&["inspect", lobe]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    for part in ["2049", "8201", "2516", "288.", "radius ratio", "sound"] {
        assert!(said.out.contains(part), "{part}: {}", said.out);
    }
    assert!(!said.out.contains("parts"), "{}", said.out);
    let nodes = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 0\n6 -1 0 0\n7 0 0 1\n8 0 1 0\n";
    desk.write(
        "two.msh",
        &format!("$NOD\n8\n{nodes}$ENDNOD\n$ELM\n2\n1 4 1 1 4 1 2 3 4\n2 4 1 1 4 5 6 7 8\n$ENDELM\n"),
    );
    let said = desk.supple(&["inspect", "two.msh"]);
    assert!(said.out.contains("2 that share no node; merge nodes"), "{}{}", said.out, said.err);
}

#[test]
fn every_kind_of_fault_is_counted_and_its_first_case_named() {
    let desk = Desk::new();
    desk.write(
        "bad.msh",
        "$NOD\n10\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 0\n6 9 9 9\n7 -1 0 0\n8 0 -1 0\n9 0 0 -1\n10 0 1 1\n$ENDNOD\n\
         $ELM\n5\n1 4 1 1 4 1 2 3 4\n2 4 1 1 4 1 7 3 4\n3 4 1 1 4 1 7 8 9\n4 4 1 1 4 1 2 3 5\n5 4 1 1 4 1 2 10 10\n$ENDELM\n",
    );
    let said = desk.supple(&["inspect", "bad.msh"]);
    print!("{}", said.err);
    assert_eq!(said.code, 2);
    for part in [
        "2 elements inverted, first element 1 (volume -1.67e-1 m^3)",
        "2 elements degenerate, first element 3",
        "1 element with a repeated node, first element 4 (node 8)",
    ] {
        assert!(said.err.contains(part), "{part}: {}", said.err);
    }
    assert!(said.out.contains("nodes that belong to no element are left out: 1, the first is 5"), "{}", said.out);
}

/// As Gmsh 2.2 writes a volume of two physical groups. They were called sound, and bent half as far.
#[test]
fn tetrahedra_that_are_listed_twice_are_refused() {
    let desk = Desk::new();
    let nodes = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 .1 0 0\n3 0 .1 0\n4 0 0 .1\n5 .1 .1 .1\n$EndNodes\n";
    let elements = "1 4 2 1 1 1 2 3 4\n2 4 2 1 1 2 3 4 5\n3 4 2 2 1 3 1 2 4\n$EndElements\n";
    desk.write("twice.msh", &format!("{nodes}$Elements\n3\n{elements}"));
    let scene = bar("[time]\nend = 0.1\n");
    let (_, rest) = scene.split_once("[material]").unwrap();
    desk.write("scene.toml", &format!("[mesh]\nfile = \"twice.msh\"\n[material]{rest}"));
    for asked in [
        &["inspect", "twice.msh"][..],
        &["simulate", "scene.toml", "--out", "out"],
        &["field", "twice.msh", "--spacing", "5", "--out", "a.field"],
    ] {
        let said = desk.supple(asked);
        let part = "twice.msh: elements 0 and 2 (counted from 0) have the same four nodes; list each once (Gmsh";
        assert!(said.code == 2 && said.err.contains(part), "{asked:?}: {}", said.err);
    }
}

#[test]
fn a_scene_tells_its_limits_memory_and_cost() {
    let desk = Desk::new();
    desk.write("scene.toml", &bar("[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n[time]\nstep = 1e-4\nend = 0.1\n"));
    let said = desk.supple(&["inspect", "scene.toml"]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    for part in ["critical step", "exact limit", "memory", "operations per step", "time per step"] {
        assert!(said.out.contains(part), "{part}: {}", said.out);
    }
}

const HELD: &str = "[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n";

/// What `inspect --accuracy 0.2` says of a bar, and how far its pilots moved, mm.
fn piloted(rest: &str) -> (String, Option<f64>) {
    let desk = Desk::new();
    desk.write("scene.toml", &bar(rest));
    let said = desk.supple(&["inspect", "scene.toml", "--accuracy", "0.2"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let (_, told) = said.out.split_once("expected error").unwrap();
    println!("{rest}{told}");
    let moved = told.split_once("that moved ").map(|(_, moved)| moved.split_once(" mm").unwrap().0.parse().unwrap());
    (told.to_owned(), moved)
}

#[test]
fn pilots_have_all_that_acts_on_the_scene() {
    let time = "[time]\nend = 0.5\n";
    let pull = "[[pull]]\npoint = [0.01, 0.01, 0.045]\nradius = 0.012\nstiffness = 50.0\n\
                path = [[0.3, 0.01, 0.01, 0.045], [0.35, 0.025, 0.01, 0.045]]\n";
    let ball = "[[instrument]]\nshape = \"sphere\"\nradius = 0.01\npath = [[0.0, -0.0105, 0.01, 0.045], [0.1, -0.004, 0.01, 0.045]]\n";
    for (acts, expected) in [(pull, 1.0..10.0), (ball, 0.5..10.0)] {
        let (told, moved) = piloted(&format!("{HELD}{acts}{time}"));
        assert!(expected.contains(&moved.unwrap()) && !told.contains("\"50x\""), "{told}");
    }
    // On springs it hangs, in place of falling.
    let springs = "[[spring]]\nplane = { axis = \"z\", at = 0.0 }\nstiffness = 1e3\ngravity = [2.0, 0.0, 0.0]\n";
    let (_, moved) = piloted(&format!("{springs}{time}"));
    assert!((1.0..60.0).contains(&moved.unwrap()), "{moved:?}");
}

#[test]
fn of_a_scene_that_does_not_move_no_step_is_recommended() {
    let gravity = "gravity = [2.0, 0.0, 0.0]\n";
    for rest in [format!("{HELD}[time]\nend = 0.5\n"), format!("{HELD}{gravity}[time]\nend = 0.5\nsettle = 1e-6\n")] {
        let (told, moved) = piloted(&rest);
        assert!(told.contains("not foretold: the scene does not move") && moved.is_none(), "{told}");
        assert!(told.contains("none: the scene does not move in its first 0.200 s"), "{told}");
    }
}
