//! `supple unloaded`: the mesh that it finds comes to rest, under the loads, in the shape of the scene's mesh.

use super::Desk;

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

#[test]
fn under_the_loads_the_unloaded_mesh_has_the_shape_of_the_image() {
    let desk = Desk::new();
    desk.write("image.toml", &scene(BAR, 3000.0));
    let said = desk.supple(&["unloaded", "image.toml", "--out", "unloaded.vtu"]);
    assert_eq!(said.code, 0, "{}", said.err);
    println!("{}", said.out);
    let count =
        said.out.lines().find_map(|line| line.strip_prefix("simulations")).unwrap().trim().parse::<u32>().unwrap();
    assert!(count <= 8, "{count}");

    let run = desk.simulate(&scene("file = \"unloaded.vtu\"", 3000.0), &[]);
    assert_eq!(run.code, 0, "{}", run.err);
    let image = supple::mesh::Bar { size: [0.02, 0.02, 0.05], cells: [2, 2, 5] };
    let (mut gap, mut sag) = (0.0f64, 0.0f64);
    for ([_, x, y, z, ux, uy, uz], to) in desk.last().into_iter().zip(image.points()) {
        let apart =
            |point: [f64; 3]| (0..3).map(|axis| (point[axis] - f64::from(to[axis])).powi(2)).sum::<f64>().sqrt();
        (gap, sag) = (gap.max(apart([x + ux, y + uy, z + uz])), sag.max(apart([x, y, z])));
    }
    println!("sag {sag}, gap {gap} m");
    assert!(gap < 0.12e-3, "{gap}");
    assert!(sag > 8e-3, "{sag}");
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
