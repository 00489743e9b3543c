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
}

#[test]
fn every_kind_of_fault_is_counted_and_its_first_case_named() {
    let desk = Desk::new();
    desk.write(
        "bad.msh",
        "$NOD\n6\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 0\n6 9 9 9\n$ENDNOD\n\
         $ELM\n5\n1 4 1 1 4 1 2 3 4\n2 4 1 1 4 1 3 2 4\n3 4 1 1 4 1 3 2 4\n4 4 1 1 4 1 2 3 5\n5 4 1 1 4 1 2 3 3\n$ENDELM\n",
    );
    let said = desk.supple(&["inspect", "bad.msh"]);
    print!("{}", said.err);
    assert_eq!(said.code, 2);
    for part in [
        "2 elements inverted, first element 1 (volume -1.67e-1 m^3)",
        "2 elements degenerate, first element 3",
        "1 element with a repeated node, first element 4 (node 2)",
        "1 node in no element, first node 5",
    ] {
        assert!(said.err.contains(part), "{part}: {}", said.err);
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
