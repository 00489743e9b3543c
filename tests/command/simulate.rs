//! `supple simulate`: the scene file's keys do what they say, and the results are where they should be.

use supple::loads::{Loads, Motion, NodalForce, traction};
use supple::material::{NeoHookean, NodalPressure, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{Axes, Support, VecScene};
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use super::{Desk, bar, names};

/// Every key of a scene with one material, in the order in which the documentation lists them.
const EVERYTHING: &str = r#"
damping = 10.0
[mesh]
shape = "bar"
size = [0.02, 0.02, 0.05]
cells = [2, 2, 5]
element = "nodal-pressure"
[material]
law = "neo-hookean"
c = 500.0
d = 25000.0
density = 1000.0
[[fix]]
plane = { axis = "z", at = 0.0 }
[[fix]]
nodes = [9]
axes = "xy"
[[force]]
nodes = [49]
newton = [0.007, -0.007, 0.0]
ramp = 0.02
[[move]]
box = { min = [0.019, 0.019, 0.049], max = [1.0, 1.0, 1.0] }
metre = [0.001, -0.0005, 0.002]
ramp = 0.02
[[traction]]
plane = { axis = "x", at = 0.02 }
pascal = [0.0, 0.0, 50.0]
ramp = 1.0
gravity = [0.0, 0.0, -9.81]
[time]
step = 1e-4
end = 0.03
frames = 3
method = "exact"
"#;

#[test]
fn a_scene_with_every_key_equals_the_kernel_called_directly() {
    let desk = Desk::new();
    let said = desk.simulate(EVERYTHING, &[]);
    assert_eq!(said.code, 0, "{}", said.err);

    let shape = Bar { size: [0.02, 0.02, 0.05], cells: [2, 2, 5] };
    let points: Vec<[f64; 3]> = shape.points().map(|p| p.map(|c| (f64::from(c) * 1e9).round() / 1e9)).collect();
    // The command moves the body to its centre.
    let local: Vec<[f32; 3]> =
        points.iter().map(|p| [(p[0] - 0.01) as f32, (p[1] - 0.01) as f32, (p[2] - 0.025) as f32]).collect();
    let tets: Vec<_> = shape.tets().collect();
    let mesh = Mesh::new(&local, &tets, Winding::Checked).unwrap();
    let tissue = NodalPressure(Tissue { law: NeoHookean { c: 500.0, d: 25_000.0 }, density: 1000.0 });
    let mut supports: Vec<_> = (0..9).map(Support::fixed).collect();
    supports.push(Support { node: 9, axes: Axes::X.union(Axes::Y), moves: false });
    supports.push(Support::moved(53));
    let scene = VecScene::build(tissue, &mesh, &supports).unwrap();
    let mut state = VecState::at_rest(points.len());
    // The side x = 20 mm: two triangles to each face of a cell.
    let mut side = vec![];
    for tet in &tets {
        let on: Vec<u32> = tet.iter().copied().filter(|&node| points[node as usize][0] > 0.0199).collect();
        if let [a, b, c] = on[..] {
            side.push([a, b, c]);
        }
    }
    assert_eq!(side.len(), 2 * 2 * 5);
    let mut forces = vec![NodalForce { node: 49, newton: [0.007, -0.007, 0.0], ramp: 0.02 }];
    forces.extend(traction(&local, &side, [0.0, 0.0, 50.0], 1.0).map(Result::unwrap));
    let motions = [Motion { node: 53, axes: Axes::XYZ, metre: [0.001, -0.0005, 0.002], ramp: 0.02 }];
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &forces, &motions).unwrap();
    let step = Step::unchecked(1e-4, 10.0).unwrap();
    for _ in 0..300 {
        assert_eq!(tled::step(&scene, &loads, &mut state, &step), Status::Ok);
    }

    let rows = desk.last();
    assert_eq!(rows.len(), points.len());
    let mut apart = 0.0f64;
    for ((node, row), (point, vector)) in rows.iter().enumerate().zip(points.iter().zip(state.displacements())) {
        assert_eq!((row[0] as usize, &row[1..4]), (node, &point[..]));
        for axis in 0..3 {
            apart = apart.max((row[4 + axis] - f64::from(vector.to_array()[axis])).abs());
        }
    }
    let largest = desk.summary()["max_displacement_mm"].as_f64().unwrap();
    println!("largest displacement {largest:.3} mm, command and kernel differ by {:.1e} mm", apart * 1e3);
    // The order in which traction adds up differs.
    assert!(largest > 1.0 && apart < 1e-8, "{apart}");
    // The moved node is where its ramp ended.
    let corner: [f32; 3] = [0, 1, 2].map(|axis| rows[53][4 + axis] as f32);
    assert_eq!(corner, [0.001, -0.0005, 0.002]);
}

#[test]
fn a_body_settles_under_gravity_and_a_pressure_before_time_begins() {
    let desk = Desk::new();
    let scene = |time: &str| {
        format!(
            "gravity = [0.5, 0.0, 0.0]\n{}",
            bar(&format!(
                "[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[[pressure]]\nplane = {{ axis = \"y\", at = 0.02 }}\npascal = 20.0\n\
                 [[point]]\nname = \"tip\"\nat = [0.02, 0.02, 0.05]\n[time]\n{time}"
            ))
        )
    };
    let said = desk.simulate(&scene("settle = 1e-5\nend = 0.05\nframes = 2\n"), &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.contains("at rest after"), "{}", said.out);
    let settled = desk.last();
    let summary = desk.summary();
    println!("{}", summary["settled"]);
    assert!(summary["settled"]["at_rest"] == true && summary["settled"]["remaining_m"].as_f64().unwrap() < 1e-5);
    let first = supple::io::read_mesh(&desk.path("out/frame_0000.vtu")).unwrap();
    assert_eq!(first.points.len(), 54);
    // Of a point all of the way counts, which settling took it.
    let way = settled[53][4..7].iter().map(|component| component * component).sum::<f64>().sqrt();
    let told = summary["points_moved_mm"]["tip"].as_f64().unwrap();
    let rows = std::fs::read_to_string(desk.path("out/points.csv")).unwrap();
    println!("{told} mm\n{rows}");
    assert!((told - 1e3 * way).abs() < 1e-4 && told > 0.1, "{told} mm, {way} m");
    // The first row is that of the first frame.
    let begins = rows.lines().nth(1).unwrap().split(',').nth(2).unwrap().parse::<f64>().unwrap();
    assert!((begins - 0.02 - settled[53][4]).abs() < 1e-6 && rows.lines().count() == 4, "{rows}");
    // With damping the same motion ends there.
    let said = desk.simulate(&scene("end = 3.0\n"), &["--force"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let mut apart = 0.0f64;
    for (a, b) in settled.iter().zip(desk.last()) {
        apart = (4..7).map(|axis| (a[axis] - b[axis]).abs()).fold(apart, f64::max);
    }
    let moved = settled.iter().map(|row| row[4].abs().max(row[5].abs())).fold(0.0, f64::max);
    println!("{apart:.1e} m apart, moved by {moved:.1e} m");
    assert!(apart < 2e-5 && moved > 1e-4);
    // A free body never rests.
    let free = scene("settle = 1e-5\nend = 0.001\n").replace("[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n", "");
    let said = desk.simulate(&free, &["--force"]);
    println!("{}{}", said.out, said.err);
    assert_eq!(desk.summary()["settled"]["at_rest"], false);
    assert!(
        said.err.contains("scene.toml: nothing holds the body: it goes where gravity and forces take it"),
        "{}",
        said.err
    );
    assert!(said.err.contains("m to go; nothing holds it"), "{}", said.err);
}

#[test]
fn the_mass_is_that_of_the_tissue_and_of_what_hangs_on_it() {
    let desk = Desk::new();
    let weight = "[[mass]]\nplane = { axis = \"z\", at = 0.05 }\nkilogram = 0.001\n";
    let said = desk
        .simulate(&bar(&format!("{weight}[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[time]\nend = 1e-4\n")), &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    let mass = desk.summary()["mass_kg"].as_f64().unwrap();
    assert!((mass - 0.020 - 0.009).abs() < 1e-7 && said.out.contains(" 29.0 g"), "{mass}: {}", said.out);
}

#[test]
fn results_are_complete_and_where_they_should_be() {
    let desk = Desk::new();
    let said = desk.simulate(EVERYTHING, &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    let frames = (0..4).map(|frame| format!("frame_{frame:04}.vtu"));
    let mut expected = vec!["final.csv".to_string()];
    expected.extend(frames);
    expected.extend(["frames.pvd", "report.html", "summary.json"].map(String::from));
    assert_eq!(names(&desk.path("out")), expected);
    let summary = desk.summary();
    assert_eq!(summary["status"], "ok");
    assert_eq!(summary["steps"], 300);
    assert_eq!(summary["step_longest_s"], 1e-4);
    assert!(summary["warnings"].as_array().unwrap().is_empty());
    assert!(summary["critical_step_least_s"].as_f64() <= summary["critical_step_at_rest_s"].as_f64());
    let frame = supple::io::read_mesh(&desk.path("out/frame_0003.vtu")).unwrap();
    assert_eq!((frame.points.len(), frame.tets.len()), (54, 120));
    for line in ["time per step", "real-time factor", "volume change", "maximum displacement"] {
        assert!(said.out.contains(line), "{}", said.out);
    }
}

#[test]
fn an_existing_folder_is_left_alone_without_force() {
    let desk = Desk::new();
    let scene = bar("[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n[time]\nstep = \"auto\"\nend = 0.001\nframes = 2\n");
    assert_eq!(desk.simulate(&scene, &[]).code, 0);
    std::fs::write(desk.path("out/notes.txt"), "mine").unwrap();
    let before = std::fs::read(desk.path("out/summary.json")).unwrap();

    let said = desk.simulate(&scene, &[]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("out: is there already; --force overwrites"), "{}", said.err);
    assert_eq!(std::fs::read(desk.path("out/summary.json")).unwrap(), before);

    let fewer = scene.replace("frames = 2", "frames = 1");
    assert_eq!(desk.simulate(&fewer, &["--force"]).code, 0);
    let expected =
        ["final.csv", "frame_0000.vtu", "frame_0001.vtu", "frames.pvd", "notes.txt", "report.html", "summary.json"];
    assert_eq!(names(&desk.path("out")), expected);
}

#[test]
fn a_refused_scene_leaves_no_folder_behind() {
    let desk = Desk::new();
    let said = desk.simulate(&bar("[time]\nstep = 0.5\nend = 1.0\n"), &[]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("is above the stable"), "{}", said.err);
    assert!(!desk.path("out").exists());
}

#[test]
fn divergence_ends_with_code_3_and_keeps_what_may_be_believed() {
    let desk = Desk::new();
    let rest = "[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n[[force]]\nnodes = [49]\nnewton = [0.01, 0.0, 0.0]\n\
                [time]\nstep = 2e-3\nend = 1.0\nframes = 4\n";
    let said = desk.simulate(&bar(rest), &["--unchecked"]);
    assert_eq!(said.code, 3, "{}{}", said.out, said.err);
    println!("{}", said.err.trim());
    assert!(said.err.contains("diverged at ") && said.err.contains("node "), "{}", said.err);
    let summary = desk.summary();
    assert_eq!(summary["status"], "diverged");
    assert!(summary["divergence"]["node"].is_u64() && summary["divergence"]["time_s"].is_f64());
    assert!(desk.last().iter().flatten().all(|number| number.is_finite()));
}

#[test]
fn an_automatic_step_follows_the_critical_one_and_agrees_with_a_short_step() {
    let scene = |step: &str| {
        let text = bar("").replace("neo-hookean", "exponential").replace("c = 500.0", "a = 59.0\nb = 8.023");
        format!(
            "{text}[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n\
             [[force]]\nplane = {{ axis = \"z\", at = 0.05 }}\nnewton = [0.0, 0.0, 0.004]\nramp = 0.2\n\
             [time]\nstep = {step}\nend = 0.3\nframes = 3\n"
        )
    };
    let desk = Desk::new();
    assert_eq!(desk.simulate(&scene("\"auto\""), &[]).code, 0);
    let summary = desk.summary();
    let (shortest, longest) =
        (summary["step_shortest_s"].as_f64().unwrap(), summary["step_longest_s"].as_f64().unwrap());
    assert!(shortest < 0.95 * longest, "the tissue stiffens, so the step must fall: {shortest} {longest}");
    assert!((summary["time_s"].as_f64().unwrap() - 0.3).abs() < 1e-6);
    let auto = desk.last();
    assert_eq!(desk.simulate(&scene("2e-5"), &["--force"]).code, 0);
    let fixed = desk.last();
    let apart = auto.iter().flatten().zip(fixed.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let moved = desk.summary()["max_displacement_mm"].as_f64().unwrap();
    println!("auto {shortest:.2e} to {longest:.2e} s; {:.4} mm from 2e-5 s, of {moved:.2} mm", apart * 1e3);
    assert!(apart * 1e3 < 0.02 * moved);
}

#[test]
fn regions_have_their_own_constants() {
    let desk = Desk::new();
    let scene = |region: &str| {
        bar(&format!(
            "{region}[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[[force]]\nplane = {{ axis = \"z\", at = 0.05 }}\n\
             newton = [0.0, 0.0, 0.002]\nramp = 0.1\n[time]\nstep = \"auto\"\nend = 0.2\n"
        ))
    };
    let reach = |region: &str| {
        let said = desk.simulate(&scene(region), &["--force"]);
        assert_eq!(said.code, 0, "{}", said.err);
        desk.last()[49][6]
    };
    let soft = reach("");
    let half =
        reach("[[region]]\nbox = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 0.025] }\nc = 5000.0\nd = 150000.0\n");
    let stiff = reach("[[region]]\nbox = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0] }\nc = 5000.0\nd = 150000.0\n");
    println!(
        "stretch of a soft, half stiff and stiff bar: {:.3}, {:.3}, {:.3} mm",
        1e3 * soft,
        1e3 * half,
        1e3 * stiff
    );
    assert!(stiff < 0.2 * soft && half > 0.3 * soft && half < 0.8 * soft);
}

#[test]
fn a_node_that_is_listed_twice_is_loaded_once() {
    let desk = Desk::new();
    let mut reached = vec![];
    for nodes in ["[49]", "[49, 49]"] {
        let scene = bar(&format!(
            "[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[[force]]\nnodes = {nodes}\n\
             newton = [0.001, 0.0, 0.0]\n[time]\nstep = 1e-4\nend = 0.01\n"
        ));
        let said = desk.simulate(&scene, &["--force"]);
        assert_eq!(said.code, 0, "{}", said.err);
        reached.push(desk.last());
    }
    assert_eq!(reached[0], reached[1]);
    assert!(reached[0][49][4] > 0.0);
}

#[test]
fn the_scene_in_the_docs_runs() {
    let home = concat!(env!("CARGO_MANIFEST_DIR"), "/../../..");
    let page = std::fs::read_to_string(format!("{home}/docs/scene-file.md")).unwrap();
    let path = format!("{home}/docs/scenes/cylinder.toml");
    let scene = std::fs::read_to_string(&path).unwrap();
    assert!(page.contains(&format!("```toml\n{scene}```")), "the page shows another scene than {path}");
    let desk = Desk::new();
    let said = desk.supple(&["simulate", &path, "--out", "out"]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    assert_eq!(desk.summary()["status"], "ok");
}

#[test]
fn an_automatic_step_survives_a_sudden_load_on_single_nodes() {
    let desk = Desk::new();
    let text = bar("").replace("neo-hookean", "exponential").replace("c = 500.0", "a = 59.0\nb = 8.023");
    let rest = "[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n[[force]]\nnodes = [45, 53]\nnewton = [0.05, 0.0, 0.0]\n\
                [time]\nstep = \"auto\"\nend = 0.05\n";
    let said = desk.simulate(&format!("{text}{rest}").replace("d = 15000.0", "d = 60000.0"), &[]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    let summary = desk.summary();
    assert!(summary["step_shortest_s"].as_f64() < summary["step_longest_s"].as_f64());
}
