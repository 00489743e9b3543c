//! `supple unloaded`: the mesh that it finds comes to rest, under the loads, in the shape of the scene's mesh.

use supple::mesh::Bar;

use super::fibres::vtk;
use super::{Desk, Said};

/// A bar of 20 x 20 x 50 mm, in mm, that is fixed at z = 0; under gravity across it sags by a fifth of its length.
fn scene(mesh: &str, c: f64) -> String {
    format!(
        "gravity = [9.81, 0.0, 0.0]\ndamping = 40.0\n[mesh]\n{mesh}\nscale = 0.001\nelement = \"nodal-strain\"\n\
         [material]\nlaw = \"neo-hookean\"\nc = {c}\nd = {}\ndensity = 1000.0\n[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n\
         [time]\nend = 1.5\n",
        15.0 * c
    )
}

const BAR: &str = "shape = \"bar\"\nsize = [20.0, 20.0, 50.0]\ncells = [2, 2, 5]";
const FOUND: &str = "file = \"unloaded.vtu\"";
const IMAGE: Bar = Bar { size: [0.02, 0.02, 0.05], cells: [2, 2, 5] };

/// The nodes of the image that are on the plane x = 0.
fn nodes_of_the_side() -> String {
    let nodes = IMAGE.points().enumerate().filter(|(_, point)| point[0] == 0.0).map(|(node, _)| node.to_string());
    format!("nodes = [{}]", nodes.collect::<Vec<_>>().join(", "))
}

fn unloaded(desk: &Desk, image: &str) -> Said {
    desk.write("image.toml", image);
    let said = desk.supple(&["unloaded", "image.toml", "--out", "unloaded.vtu"]);
    println!("{}{}", said.out, said.err);
    assert_eq!(said.code, 0, "{}", said.err);
    said
}

/// How far a run of a scene ends from the image at the worst node, and how far it begins from it, m.
fn gap_and_sag(desk: &Desk, scene: &str) -> (f64, f64) {
    let run = desk.simulate(scene, &["--force"]);
    assert_eq!(run.code, 0, "{}", run.err);
    let (mut gap, mut sag) = (0.0f64, 0.0f64);
    for ([_, x, y, z, ux, uy, uz], to) in desk.last().into_iter().zip(IMAGE.points()) {
        let apart =
            |point: [f64; 3]| (0..3).map(|axis| (point[axis] - f64::from(to[axis])).powi(2)).sum::<f64>().sqrt();
        (gap, sag) = (gap.max(apart([x + ux, y + uy, z + uz])), sag.max(apart([x, y, z])));
    }
    println!("sag {sag}, gap {gap} m");
    (gap, sag)
}

/// A bar that hangs down: the first peak of its kinetic energy is that of its fast motion along itself.
#[test]
fn a_body_that_hangs_along_itself_comes_to_rest() {
    let desk = Desk::new();
    let hanging = |mesh: &str| scene(mesh, 8000.0).replace("gravity = [9.81, 0.0, 0.0]", "gravity = [0.3, 0.0, 9.81]");
    unloaded(&desk, &hanging(BAR));
    let (gap, sag) = gap_and_sag(&desk, &hanging(FOUND));
    assert!(gap < 0.1e-3 && sag > 0.3e-3, "{gap} {sag}");
}

#[test]
fn under_the_loads_the_unloaded_mesh_has_the_shape_of_the_image() {
    let desk = Desk::new();
    let said = unloaded(&desk, &scene(BAR, 3000.0));
    let count =
        said.out.lines().find_map(|line| line.strip_prefix("simulations")).unwrap().trim().parse::<u32>().unwrap();
    assert!(count <= 8, "{count}");
    let (gap, sag) = gap_and_sag(&desk, &scene(FOUND, 3000.0));
    assert!(gap < 0.12e-3, "{gap}");
    assert!(sag > 8e-3, "{sag}");
}

#[test]
fn loads_on_areas_are_those_of_the_unloaded_mesh() {
    let side = nodes_of_the_side();
    for load in [
        format!("[[pressure]]\n{side}\npascal = 60.0\n[time]"),
        format!("[[traction]]\n{side}\npascal = [0.0, 60.0, 0.0]\n[time]"),
        format!("[[spring]]\n{side}\nper_area = 1e5\n[time]"),
    ] {
        let desk = Desk::new();
        unloaded(&desk, &scene(BAR, 3000.0).replace("[time]", &load));
        let (gap, _) = gap_and_sag(&desk, &scene(FOUND, 3000.0).replace("[time]", &load));
        assert!(gap < 0.12e-3, "{load}: {gap}");
    }
}

#[test]
fn a_pressure_acts_in_full_whatever_its_ramp() {
    let of_ramp = |ramp: &str| {
        let load = format!("[[pressure]]\n{}\npascal = 60.0\nramp = {ramp}\n[time]", nodes_of_the_side());
        let said = unloaded(&Desk::new(), &scene(BAR, 3000.0).replace("[time]", &load));
        said.out.lines().next().map(str::to_owned)
    };
    assert_eq!(of_ramp("30.0"), of_ramp("0.0"));
}

#[test]
fn the_mesh_keeps_the_tags_and_the_fibres_of_the_image() {
    let desk = Desk::new();
    // Stiff at the lower half.
    let tags = IMAGE.tets().map(|tet| {
        if tet.iter().any(|&node| IMAGE.points().nth(node as usize).unwrap()[2] > 0.026) { "1\n" } else { "7\n" }
    });
    let tags = format!("SCALARS region int 1\nLOOKUP_TABLE default\n{}", tags.collect::<String>());
    desk.write("bar.vtk", &(vtk("0.3 0 1") + &tags));
    let with_file = |mesh: &str| {
        scene(mesh, 3000.0).replace("scale = 0.001\n", "").replace(
            "[[fix]]",
            "fibres = [2000.0, 5.0]\n[directions]\nfibre = \"fibre\"\n[[region]]\ntags = [7]\nc = 6000.0\n[[fix]]",
        )
    };
    unloaded(&desk, &with_file("file = \"bar.vtk\""));
    let said = desk.supple(&["inspect", "unloaded.vtu"]);
    assert!(
        said.code == 0 && said.out.lines().any(|line| line.starts_with("region tags") && line.contains('7')),
        "{}",
        said.out
    );
    let (gap, sag) = gap_and_sag(&desk, &with_file(FOUND));
    assert!(gap < 0.12e-3 && sag > 2e-3, "{gap} {sag}");
}

#[test]
fn what_is_found_by_place_is_told_with_what_to_write() {
    let desk = Desk::new();
    let wall = "axis = [0.0, 0.0, 1.0]\nthrough = [0.01, 0.1, 0.0]\nhelix = [60.0, -60.0]";
    let region = "box = { min = [-1.0, -1.0, 0.025], max = [0.012, 1.0, 1.0] }";
    let traction = "plane = { axis = \"x\", at = 0.0 }";
    let with_places = |mesh: &str| {
        let (region, traction) = (
            format!("[[region]]\n{region}\nc = 2000.0"),
            format!("[[traction]]\n{traction}\npascal = [0.0, 60.0, 0.0]"),
        );
        let directions = format!("fibres = [4000.0, 5.0]\n[directions]\n{wall}\n{region}\n{traction}\n[[fix]]");
        scene(mesh, 3000.0).replace("[[fix]]", &directions)
    };
    let said = unloaded(&desk, &with_places(BAR));
    for words in [
        "line 15: by the mesh without loads its fibres",
        "line 19: on the mesh without loads its box",
        "line 22: on the mesh without loads its box",
    ] {
        assert!(said.err.contains(words), "{words}");
    }
    let told = with_places(FOUND)
        .replace(wall, "fibre = \"wall_fibre\"\nsheet = \"wall_sheet\"")
        .replace(region, "tags = [1]")
        .replace(traction, &nodes_of_the_side());
    assert!(said.err.contains("write tags = [1] in its place") && said.err.contains(&nodes_of_the_side()));
    let (gap, _) = gap_and_sag(&desk, &told);
    assert!(gap < 0.12e-3, "{gap}");
}

#[test]
fn bodies_that_no_unloaded_mesh_can_bear_are_refused() {
    let desk = Desk::new();
    desk.write("image.toml", &scene(BAR, 50.0));
    let said = desk.supple(&["unloaded", "image.toml", "--out", "unloaded.vtu"]);
    assert_eq!(said.code, 2, "{}", said.out);
    assert!(
        said.err.contains("too soft for these loads") || said.err.contains("simulations a node is still"),
        "{}",
        said.err
    );
    assert!(!desk.path("unloaded.vtu").exists());

    desk.write("image.toml", &scene(BAR, 3000.0));
    let said = desk.supple(&["unloaded", "image.toml", "--out", "unloaded.msh"]);
    assert!(said.code == 2 && said.err.contains("the mesh is written as .vtu"), "{}", said.err);
    let moved = "[[move]]\nplane = { axis = \"z\", at = 0.05 }\nmetre = [0.001, 0.0, 0.0]\nramp = 0.1\n[time]";
    desk.write("image.toml", &scene(BAR, 3000.0).replace("[time]", moved));
    let said = desk.supple(&["unloaded", "image.toml", "--out", "unloaded.vtu"]);
    assert!(said.code == 2 && said.err.contains("supports that move have no shape without loads"), "{}", said.err);
}
