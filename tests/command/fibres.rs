//! Tissue with fibres in scene files: directions that are constant, of the mesh file, or of a wall.

use std::fmt::Write;

use supple::mesh::Bar;

use super::{Desk, Said};

const BAR: Bar = Bar { size: [0.02, 0.02, 0.05], cells: [2, 2, 5] };

/// A bar that hangs along x.
fn scene(mesh: &str, material: &str, directions: &str) -> String {
    format!(
        "gravity = [4.0, 0.0, 0.0]\ndamping = 20.0\n[mesh]\n{mesh}\n[material]\nlaw = \"exponential\"\na = 500.0\nb = 3.0\n\
         d = 25000.0\ndensity = 1000.0\n{material}\n{directions}\n[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n\
         [time]\nstep = \"auto\"\nend = 0.5\n"
    )
}

const SHAPE: &str = "shape = \"bar\"\nsize = [0.02, 0.02, 0.05]\ncells = [2, 2, 5]";
const FIBRES: &str = "fibres = [2000.0, 5.0]";

/// The bar as a legacy VTK file, with vectors by cell.
pub(super) fn vtk(vectors: &str) -> String {
    let (points, tets): (Vec<_>, Vec<_>) = (BAR.points().collect(), BAR.tets().collect());
    let mut text =
        format!("# vtk DataFile Version 3.0\nbar\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n", points.len());
    points.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
    writeln!(text, "CELLS {} {}", tets.len(), 5 * tets.len()).unwrap();
    tets.iter().for_each(|[a, b, c, d]| writeln!(text, "4 {a} {b} {c} {d}").unwrap());
    writeln!(text, "CELL_TYPES {}\n{}", tets.len(), "10 ".repeat(tets.len())).unwrap();
    writeln!(text, "CELL_DATA {}\nVECTORS fibre float\n{}", tets.len(), format!("{vectors}\n").repeat(tets.len()))
        .unwrap();
    text
}

fn lowest(desk: &Desk, said: &Said) -> f64 {
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    desk.summary()["max_displacement_mm"].as_f64().unwrap()
}

#[test]
fn fibres_hold_a_bar_along_them() {
    let desk = Desk::new();
    let run = |mesh: &str, material: &str, directions: &str| {
        let said = desk.simulate(&scene(mesh, material, directions), &["--force"]);
        (lowest(&desk, &said), said.out)
    };
    let (without, _) = run(SHAPE, "", "");
    let (along, out) = run(SHAPE, FIBRES, "[directions]\nfibre = [0.0, 0.0, 2.0]");
    let (across, _) = run(SHAPE, FIBRES, "[directions]\nfibre = [0.0, 1.0, 0.0]");
    desk.write("bar.vtk", &vtk("0 0 1"));
    let (of_mesh, _) = run("file = \"bar.vtk\"", FIBRES, "[directions]\nfibre = \"fibre\"");
    println!("{without:.3} mm without, {along:.3} along, {across:.3} across, {of_mesh:.3} of the mesh file\n{out}");
    assert!(along < 0.8 * without && across > 0.9 * without);
    assert!((of_mesh / along - 1.0).abs() < 1e-4);
    // All three terms, and a region without any.
    let all = "fibres = [2000.0, 5.0]\nsheets = [500.0, 5.0]\ncoupling = [200.0, 5.0]";
    let directions = "[directions]\nfibre = [0.0, 0.0, 1.0]\nsheet = [1.0, 0.0, 0.0]";
    let (three, _) = run(SHAPE, all, directions);
    let none = "[[region]]\nplane = { axis = \"z\", at = 0.0 }\n";
    let box_of_half = "box = { min = [0.0, 0.0, 0.0], max = [0.02, 0.02, 0.025] }\n";
    let region =
        none.replace("plane = { axis = \"z\", at = 0.0 }\n", box_of_half) + "fibres = []\nsheets = []\ncoupling = []\n";
    let (half, _) = run(SHAPE, all, &format!("{region}{directions}"));
    println!("{three:.3} mm with all terms, {half:.3} with none in the lower half");
    assert!(three <= along && half > 1.02 * three && half < without);
}

#[test]
fn directions_that_cannot_be_are_refused_in_words() {
    let desk = Desk::new();
    desk.write("bar.vtk", &vtk("0 0 1"));
    let file = "file = \"bar.vtk\"";
    for (mesh, material, directions, expected) in [
        (SHAPE, FIBRES, "", "tissue with fibres needs [directions]"),
        (SHAPE, "", "[directions]\nfibre = [1.0, 0.0, 0.0]", "no tissue has fibres: give fibres = [a, b]"),
        (SHAPE, "fibres = [2000.0]", "", "line 13: fibres = [a, b]: a in Pa, b without unit"),
        (SHAPE, "fibres = [-1.0, 5.0]", "", "line 13: the stiffness a (Pa) of fibres is -1"),
        (SHAPE, "sheets = [1.0, 0.0]", "", "line 13: the exponent b of sheets is 0"),
        (SHAPE, FIBRES, "[directions]\nfibre = [0.0, 0.0, 0.0]", "element 0: fibres along (0, 0, 0)"),
        (SHAPE, FIBRES, "[directions]\nsheet = [1.0, 0.0, 0.0]", "give fibre (and sheet) as [x, y, z]"),
        (SHAPE, FIBRES, "[directions]\nfibre = \"fibre\"", "no vectors \"fibre\" by cell (.vtu or .vtk); it has none"),
        (
            file,
            FIBRES,
            "[directions]\nfibre = \"fiber\"",
            "no vectors \"fiber\" by cell (.vtu or .vtk); it has \"fibre\"",
        ),
        (
            SHAPE,
            FIBRES,
            "[directions]\naxis = [0.0, 0.0, 1.0]\nthrough = [0.01, 0.01, 0.0]\nhelix = [60.0, -60.0]",
            "no part of the surface faces the axis",
        ),
    ] {
        let said = desk.simulate(&scene(mesh, material, directions), &["--force"]);
        println!("{}", said.err.trim_end());
        assert!(said.code == 2 && said.err.contains(expected), "{expected}: {}", said.err);
    }
}
