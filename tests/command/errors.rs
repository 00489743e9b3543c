//! Everything a person can get wrong has a sentence of its own that names the file, the line and the value,
//! and exit code 2.

use super::{Desk, bar};

const FIX: &str = "[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n";
const TIME: &str = "[time]\nstep = \"auto\"\nend = 0.001\n";

#[test]
fn bad_scenes_are_refused_in_words() {
    let whole = bar(&format!("{FIX}{TIME}"));
    let with = |more: &str| bar(&format!("{FIX}{more}{TIME}"));
    let instead = |old: &str, new: &str| {
        assert!(whole.contains(old), "{old}");
        whole.replace(old, new)
    };
    let cases: &[(String, &str)] = &[
        ("damping = ".into(), "scene.toml, line 1:"),
        (instead("damping", "dampening"), "line 1: unknown field `dampening`"),
        (instead("density = 1000.0", "density = 1000.0\ndensty = 1.0"), "line 11: unknown field `densty`"),
        (instead("damping = 20.0", "damping = -1.0"), "line 1: damping is -1 1/s"),
        (instead("shape = \"bar\"", "shape = \"cone\""), "line 3: shape \"cone\" is not known"),
        (instead("shape = \"bar\"", "shape = \"bar\"\nfile = \"a.vtk\""), "both a file and a shape"),
        (instead("shape = \"bar\"", ""), "[mesh] needs a file or a shape"),
        (instead("cells = [2, 2, 5]", ""), "a bar needs size"),
        (instead("cells = [2, 2, 5]", "cells = [2, 0, 5]"), "line 5: cells are [2, 0, 5]"),
        (instead("size = [0.02, 0.02, 0.05]", "size = [0.02, -0.02, 0.05]"), "line 4: size holds -0.02 m"),
        (instead("shape = \"bar\"\nsize", "shape = \"bar\"\nscale = 0.0\nsize"), "line 4: scale is 0"),
        (instead("shape = \"bar\"\nsize = [0.02, 0.02, 0.05]\ncells = [2, 2, 5]", "file = \"no.vtk\""), "no.vtk"),
        (instead("shape = \"bar\"\nsize = [0.02, 0.02, 0.05]\ncells = [2, 2, 5]", "file = \"mesh.obj\""), "mesh.obj"),
        (instead("shape = \"bar\"", "winding = \"left\"\nshape = \"bar\""), "winding \"left\" is not known"),
        (instead("neo-hookean", "hooke"), "law \"hooke\" is not known"),
        (instead("c = 500.0\n", ""), "line 6: the law neo-hookean needs c"),
        (instead("c = 500.0", "c = 500.0\na = 1.0"), "line 9: the law neo-hookean has no constant a"),
        (instead("c = 500.0", "c = -500.0"), "line 8: c is -500, it must be a positive number"),
        (instead("density = 1000.0", "density = nan"), "line 10: density is NaN"),
        (instead("density = 1000.0", "density = [1]"), "line 10: invalid type: sequence, expected f32"),
        (instead("density = 1000.0", ""), "line 6: missing field `density`"),
        (
            instead("density = 1000.0", "density = 1000.0\nprony = [[0.2, 0.1], [0.9, 1.0]]"),
            "line 11: the shares of the relaxation add up to 1.1",
        ),
        (
            instead("density = 1000.0", "density = 1000.0\nprony = [[0.2, 0.0]]"),
            "line 11: term 0 of the relaxation has the time 0 s",
        ),
        (instead("density = 1000.0", "density = 1000.0\nprony = [0.2, 0.1]"), "line 11: invalid type"),
        (with("[[mass]]\nnodes = [50]\nkilogram = 0.0\n"), "line 15: kilogram is 0, it must be a positive number"),
        (with("[[fix]]\nplane = { axis = \"w\", at = 0.0 }\n"), "unknown variant `w`"),
        (
            with("[[fix]]\nplane = { axis = \"x\", at = 0.5 }\n"),
            "line 13: this selects no node; the mesh reaches from [0.0, 0.0, 0.0] to [20.0, 20.0, 50.0] mm",
        ),
        (with("[[fix]]\nnodes = [54]\n"), "line 14: node 54 does not exist, the mesh has nodes 0 to 53"),
        (with("[[fix]]\nnodes = []\n"), "this selects no node"),
        (with("[[fix]]\naxes = \"z\"\n"), "give exactly one of nodes, plane and box"),
        (with("[[fix]]\nnodes = [1]\naxes = \"xq\"\n"), "axes holds 'q'"),
        (with("[[fix]]\nnodes = [1]\naxes = \"\"\n"), "axes is empty"),
        (with("[[force]]\nnodes = [50]\nnewton = [0.0, inf, 0.0]\n"), "line 15: newton holds inf"),
        (with("[[force]]\nnodes = [50]\nnewton = [0.0, 1.0]\n"), "line 15:"),
        (with("[[force]]\nnodes = [50]\nnewton = [0.0, 1.0, 0.0]\nramp = -1.0\n"), "line 16: ramp is -1 s"),
        (with("[[move]]\nnodes = [50]\nmetre = [0.0, nan, 0.0]\n"), "line 15: metre holds NaN"),
        (
            with("[[move]]\nnodes = [2]\naxes = \"y\"\nmetre = [0.0, 0.0, 0.0]\n"),
            "line 13: a [[fix]] holds node 2 along y already: leave it out of one of the two",
        ),
        (
            with(&"[[move]]\nnodes = [50]\nmetre = [0.0, 0.0, 0.0]\n".repeat(2)),
            "line 16: another [[move]] moves node 50 along x already: leave it out of one of the two",
        ),
        (with("[[traction]]\nnodes = [50, 51]\npascal = [0.0, 0.0, 1.0]\n"), "no boundary triangle"),
        (
            with("[[pressure]]\nnodes = [50, 51]\npascal = 1.0\n"),
            "this pressure selects nodes, but no boundary triangle",
        ),
        (with("[[pressure]]\nplane = { axis = \"z\", at = 0.05 }\npascal = nan\n"), "line 15: pascal is NaN"),
        (
            with("[[pressure]]\nplane = { axis = \"z\", at = 0.05 }\npascal = [0.0, 0.0, 1.0]\n"),
            "line 15: invalid type",
        ),
        (instead("end = 0.001", "end = 0.001\nsettle = 0.0"), "settle is 0 m, it must be a positive number"),
        (instead("end = 0.001", "end = 0.001\nsettle = inf"), "settle is inf m"),
        (with("[[region]]\ntags = [3]\nc = 1.0\n"), "this region selects no element"),
        (with("[[region]]\nc = 1.0\n"), "line 13: give exactly one of tags, plane and box"),
        (
            with("[[region]]\nplane = { axis = \"z\", at = 0.0 }\nb = 1.0\n"),
            "line 15: the law neo-hookean has no constant b",
        ),
        (
            with("[[region]]\ntags = [3]\nlaw = \"exponential\"\n"),
            "line 15: unknown field `law`, expected one of `tags`",
        ),
        (
            with(
                "[[force]]\nnodes = [50]\nnewton = [0.0, 0.0, 0.0]\ngravity = [0.0, 0.0, 1.0]\n[[fix]]\nnodes = [1]\ngravity = [1.0, 0.0, 0.0]\n",
            ),
            "gravity is given twice",
        ),
        (instead("step = \"auto\"", "step = \"often\""), "step \"often\" is not known"),
        (instead("step = \"auto\"", "step = 0.0"), "step is 0 s"),
        (instead("step = \"auto\"", "step = 1.0"), "is longer than the end"),
        (instead("end = 0.001", "end = -1.0"), "end is -1 s"),
        (instead("end = 0.001", "end = 0.001\nframes = 0"), "frames is 0"),
        (
            instead("end = 0.001", "end = 0.001\nframes = 4000000000"),
            "frames is 4000000000; at most 1000000 are written",
        ),
        (
            bar(&format!("[[fix]]\nbox = {{ min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }}\n{TIME}")),
            "nothing can move",
        ),
    ];
    let desk = Desk::new();
    desk.write("mesh.obj", "v 0 0 0\n");
    for (scene, fragment) in cases {
        let said = desk.simulate(scene, &[]);
        print!("{}", said.err);
        assert_eq!(said.code, 2, "expected a complaint with \"{fragment}\" of:\n{scene}\n{}", said.err);
        assert!(said.err.contains(fragment), "\"{fragment}\" is not in: {}", said.err);
        assert!(said.err.starts_with("error: "), "{}", said.err);
        assert!(!desk.path("out").exists(), "a refused scene left a folder behind");
    }
    println!("{} bad scenes, each with its own sentence", cases.len());
}

#[test]
fn bad_meshes_are_refused_in_words() {
    let gmsh = |nodes: &str, tets: &str| {
        let count = |text: &str| text.lines().count();
        format!("$NOD\n{}\n{nodes}$ENDNOD\n$ELM\n{}\n{tets}$ENDELM\n", count(nodes), count(tets))
    };
    let corners = "1 0 0 0\n2 0.01 0 0\n3 0 0.01 0\n4 0 0 0.01\n";
    let cases = [
        (
            gmsh(corners, "1 4 1 1 4 1 3 2 4\n"),
            "element 0: volume -1.67e-7 m^3; 1 of 1 elements have negative volume; winding = \"normalise\"",
        ),
        (gmsh(corners, "1 4 1 1 4 1 2 3 3\n"), "element 0: node 2 appears twice"),
        (gmsh(corners, "1 4 1 1 4 1 2 3 9\n"), "9"),
        (gmsh(&corners.replace("4 0 0 0.01", "4 0.01 0.01 0"), "1 4 1 1 4 1 2 3 4\n"), "element 0: degenerate"),
        (gmsh(&corners.replace("4 0 0 0.01", "4 nan 0 0.01"), "1 4 1 1 4 1 2 3 4\n"), "node 3: coordinate x is NaN"),
        (gmsh(corners, ""), "no tetrahedra"),
        ("nonsense\n".into(), "mesh.msh"),
    ];
    let scene = "[mesh]\nfile = \"mesh.msh\"\n[material]\nlaw = \"neo-hookean\"\nc = 500.0\nd = 15000.0\ndensity = 1000.0\n\
                 [time]\nstep = \"auto\"\nend = 0.001\n";
    let desk = Desk::new();
    for (mesh, fragment) in &cases {
        desk.write("mesh.msh", mesh);
        let said = desk.simulate(scene, &[]);
        print!("{}", said.err);
        assert_eq!(said.code, 2, "{mesh}{}", said.err);
        assert!(said.err.contains(fragment), "\"{fragment}\" is not in: {}", said.err);
        assert!(!desk.path("out").exists());
    }
    // Asked to, the command turns elements round.
    desk.write("mesh.msh", &cases[0].0);
    let said = desk.simulate(&scene.replace("[material]", "winding = \"normalise\"\n[material]"), &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert_eq!(desk.summary()["volume_change_percent"].as_f64().map(f64::abs), Some(0.0));
}

/// The second node belongs to no element: the third is the second then.
#[test]
fn a_node_without_an_element_is_left_out_unless_nodes_are_named_by_number() {
    let desk = Desk::new();
    desk.write(
        "mesh.msh",
        "$NOD\n5\n1 0 0 0\n2 1 1 1\n3 0.01 0 0\n4 0 0.01 0\n5 0 0 0.01\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 3 4 5\n$ENDELM\n",
    );
    let scene = |entry: &str| {
        format!(
            "[mesh]\nfile = \"mesh.msh\"\n[material]\nlaw = \"neo-hookean\"\nc = 500.0\nd = 15000.0\ndensity = 1000.0\n{entry}\n\
             [time]\nend = 0.001\n"
        )
    };
    for entry in ["[[fix]]\nplane = { axis = \"z\", at = 0.0 }", "[[fix]]\nnodes = [0]"] {
        let said = desk.simulate(&scene(entry), &["--force"]);
        assert_eq!(said.code, 0, "{}", said.err);
        assert!(
            said.err.contains("mesh.msh: nodes that belong to no element are left out: 1, the first is 1"),
            "{}",
            said.err
        );
        assert_eq!(desk.summary()["nodes"], 4);
        assert_eq!(desk.last()[1][1..4], [0.01, 0.0, 0.0]);
    }
    let said = desk.simulate(&scene("[[fix]]\nnodes = [0, 2, 3]"), &["--force"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("node 1 belongs to no element; remove it from the mesh"), "{}", said.err);
}

#[test]
fn a_wrong_unit_is_remarked_upon_with_the_place_and_the_right_one() {
    let desk = Desk::new();
    let whole = bar(&format!("{FIX}{TIME}"));
    let with = |more: &str| bar(&format!("{FIX}{more}{TIME}"));
    let end = "[[move]]\nplane = { axis = \"z\", at = 0.05 }\n";
    let pull = "[[pull]]\npoint = [0.01, 0.01, 0.05]\nstiffness = 10.0\n";
    let cases = [
        (
            whole.replace("[0.02, 0.02, 0.05]", "[20.0, 20.0, 50.0]"),
            "line 2: the body is 57.4456 m across; are its points in metres? (1 mm is 0.001 m); scale = 0.001 under [mesh] turns \
             millimetres into metres",
        ),
        (
            whole.replace("[0.02, 0.02, 0.05]", "[20.0, 20.0, 50.0]"),
            "line 2: the body has a mass of 2.000e7 kg; are its points in metres? (1 mm is 0.001 m)",
        ),
        (
            whole.replace("density = 1000.0", "density = 1.06"),
            "line 6: a density of 1.06 kg/m^3; tissue has about 1000 (1 g/cm^3 is 1000 kg/m^3)",
        ),
        (
            whole.replace("c = 500.0", "c = 0.5").replace("d = 15000.0", "d = 15.0"),
            "line 6: Young's modulus of the tissue is 2.967e0 Pa; soft tissue has 1e3 to 1e5 (1 kPa is 1000 Pa)",
        ),
        (
            whole.replace("c = 500.0", "c = 15000.0").replace("d = 15000.0", "d = 500.0"),
            "line 6: Poisson's ratio of the tissue is -0.86",
        ),
        (
            with(&format!("{}newton = [0.0, 20.0, 0.0]\nramp = 100.0\n", end.replace("move", "force"))),
            "forces add up to 1.800e2 N, the body would be crushed by",
        ),
        (
            format!("gravity = [0.0, 0.0, -9810.0]\n{whole}"),
            "gravity is 9810 m/s^2, that of the earth is 9.81 (9810 mm/s^2 is 9.81 m/s^2)",
        ),
        (
            with(&format!("{end}metre = [2.0, 0.0, 0.0]\nramp = 100.0\n")),
            "line 13: nodes move by 2 m, the body is 0.057 m across (1 mm is 0.001 m)",
        ),
        (
            with(&format!("{end}metre = [0.005, 0.0, 0.0]\n")),
            "line 13: nodes move by 5.0 mm in the first step; with a ramp they take time",
        ),
        (
            with(&format!("{end}metre = [0.005, 0.0, 0.0]\nramp = 0.002\n")),
            "line 13: nodes move at 2.50 m/s, faster than shear waves in the softest tissue (1.00 m/s), which cannot follow; a \
             ramp of 0.010 s is slower",
        ),
        (
            with("[[pull]]\npoint = [0.01, 0.01, 0.0]\nradius = 0.002\nstiffness = 10.0\n"),
            "line 13: all nodes of a pull are held: it moves nothing",
        ),
        (
            with(&format!("{pull}path = [[0.0, 10.0, 10.0, 50.0]]\n")),
            "line 16: a pull's target is 51.9096 m away from its point, the body is 0.057 m across (1 mm is 0.001 m)",
        ),
        (
            with(&format!("{pull}path = [[0.0, 0.01, 0.01, 0.05], [200.0, 0.01, 0.01, 0.051]]\n")),
            "line 16: the path of a target goes on to 200 s, and the simulation ends at",
        ),
        (
            with(&format!("{pull}radius = 12.0\n")),
            "line 16: radius is 12 m, the body is 0.057 m across: all of it is pulled (1 mm is 0.001 m)",
        ),
        (
            with(
                "[[instrument]]\nshape = \"sphere\"\nradius = 5.0\npath = [[0.0, 10.0, 10.0, 70.0], [30.0, 10.0, 10.0, 50.0]]\n",
            ),
            "line 13: an instrument is 46.9",
        ),
        (
            with(
                "[[instrument]]\nshape = \"sphere\"\nradius = 5.0\npath = [[0.0, 10.0, 10.0, 70.0], [30.0, 10.0, 10.0, 50.0]]\n",
            ),
            "line 13: the path of this instrument goes on to 30 s, and the simulation ends at",
        ),
        (
            with(&format!("{}newton = [0.0, 0.01, 0.0]\nramp = 100.0\n", end.replace("move", "force"))),
            "line 16: a ramp goes on to 100 s, and the simulation ends at",
        ),
        (format!("{whole}settle = 0.1\n"), "settle is 0.1 m, the body is 0.057 m across (1 mm is 0.001 m)"),
        (
            format!("{whole}method = \"auto\"\ntolerance = 0.5\n"),
            "tolerance is 0.5 m, the body is 0.057 m across (1 mm is 0.001 m)",
        ),
    ];
    for (scene, words) in cases {
        let said = desk.simulate(&scene, &["--force"]);
        print!("{}", said.err);
        assert!(said.err.contains(words), "\"{words}\" is not in: {}", said.err);
        let warnings = desk.summary()["warnings"].as_array().unwrap().clone();
        assert!(warnings.iter().any(|warning| warning.as_str().unwrap().contains(words)), "{warnings:?}");
    }
    let said = desk.simulate(&whole, &["--force"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
}

#[test]
fn wrong_usage_has_code_2() {
    let desk = Desk::new();
    assert_eq!(desk.supple(&["simulate"]).code, 2);
    assert_eq!(desk.supple(&["fly"]).code, 2);
    let said = desk.supple(&["simulate", "none.toml", "--out", "out"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("none.toml: cannot be read"), "{}", said.err);
}

#[test]
fn warping_says_that_it_is_pythons() {
    let said = Desk::new().supple(&["warp", "out/run", "--image", "CT.nii.gz", "--out", "warped.nii.gz"]);
    let rest = "pip install SimpleITK; python -m supple warp out/run --image CT.nii.gz --out warped.nii.gz\n";
    assert!(said.code == 2 && said.err.ends_with(rest), "{}", said.err);
}

#[test]
fn a_command_that_is_the_laboratorys_now_says_what_to_type() {
    let desk = Desk::new();
    let package = "of the laboratory: cargo run --release -p supple-lab";
    for (arguments, rest) in [
        ("evaluate --physics --out out", " -- methods|physics|hard|tolerance --out DIR"),
        ("train recipe.toml --out organ.weights", " --features train -- train RECIPE --out FILE"),
        ("weights quantise a.weights --float 1", " --features train -- quantise FILE --out FILE"),
    ] {
        let said = desk.supple(&arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(said.code, 2, "{}", said.err);
        assert!(said.err.ends_with(&format!("{package}{rest}\n")), "{}", said.err);
    }
}

/// Two tetrahedra that meet in a face, each with nodes of its own; one is held.
#[test]
fn a_part_of_the_mesh_that_nothing_holds_is_remarked_upon() {
    let points = "0 0 0 0.01 0 0 0 0.01 0 0 0 0.01 0.01 0 0 0 0.01 0 0 0 0.01 0.01 0.01 0.01";
    let mesh = format!(
        "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n{points}\n\
         CELLS 2 10\n4 0 1 2 3\n4 4 5 6 7\nCELL_TYPES 2\n10\n10\n"
    );
    for (held, warns) in [("[0, 1, 2]", true), ("[0, 1, 2, 4, 5, 6]", false)] {
        let desk = Desk::new();
        desk.write("two.vtk", &mesh);
        let said = desk.simulate(
            &format!(
                "[mesh]\nfile = \"two.vtk\"\nwinding = \"normalise\"\n[material]\nlaw = \"neo-hookean\"\nc = 1000.0\n\
                 d = 10000.0\ndensity = 1000.0\n[[fix]]\nnodes = {held}\n[time]\nend = 0.001\n"
            ),
            &[],
        );
        println!("{}", said.err);
        assert_eq!(said.code, 0, "{}", said.err);
        let words = "the mesh has 2 parts that share no node, and nothing holds 1 of them, of up to 4 nodes";
        assert_eq!(said.err.contains(words), warns, "{}", said.err);
    }
}
