//! Steps beyond the critical one: `method`, `step = "20x"` and `lattice` under `[time]`, and what `inspect` says of
//! them.

use super::{Desk, bar};

/// A bar of 960 elements that leans over under gravity from the side, its foot held.
fn leaning(time: &str) -> String {
    let body = bar("").replace("cells = [2, 2, 5]", "cells = [4, 4, 10]");
    format!("gravity = [1.0, 0.0, 0.0]\n{body}[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[time]\n{time}")
}

fn far(desk: &Desk) -> f64 {
    desk.summary()["max_displacement_mm"].as_f64().unwrap()
}

#[test]
fn long_steps_reach_where_short_ones_do_and_say_what_they_did() {
    let desk = Desk::new();
    let said = desk.simulate(&leaning("step = \"auto\"\nend = 0.3\n"), &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(desk.summary()["inertia"].is_null() && !said.out.contains("added mass"), "{}", said.out);
    let exact = far(&desk);

    // Former names of methods mean long steps, with a remark.
    for name in ["long", "damped", "multilevel", "mass-scaled"] {
        let time = format!("method = \"{name}\"\nstep = \"10x\"\nend = 0.3\nframes = 3\n");
        let said = desk.simulate(&leaning(&time), &["--force"]);
        let remark = format!("line 15: method \"{name}\" is now \"long\": write method = \"long\"");
        assert_eq!(said.err.contains(&remark), name != "long", "{}", said.err);
        println!("{}", said.out);
        assert_eq!(said.code, 0, "{}", said.err);
        let summary = desk.summary();
        assert_eq!(summary["method"], "long");
        // The host is told what a guard has seen, whatever it is.
        let inexact = summary["steps_inexact"].as_u64().unwrap();
        assert_eq!(summary["status"], if inexact > 0 { "inexact" } else { "ok" }, "{summary:#}");
        assert!(inexact == 0 || said.err.contains("the error may be more than is allowed: "), "{}", said.err);
        let inertia = &summary["inertia"];
        let figure = |name: &str| inertia[name].as_f64().unwrap();
        let critical = summary["critical_step_at_rest_s"].as_f64().unwrap();
        // The longest step, at most ten times the critical one, of which whole numbers reach the frames and the end.
        let steps = (0.1 / (10.0 * critical)).ceil() * 3.0;
        assert_eq!(summary["steps"].as_f64(), Some(steps));
        assert!((figure("step_s") * steps / 0.3 - 1.0).abs() < 1e-6, "{inertia:#}");
        assert!((figure("step_over_critical_at_rest") / (figure("step_s") / critical) - 1.0).abs() < 1e-4);
        assert!((summary["time_s"].as_f64().unwrap() / 0.3 - 1.0).abs() < 1e-6);
        assert!(figure("added_mass_mean") > 1.0, "{inertia:#}");
        assert!(figure("added_mass_largest") > figure("added_mass_mean"), "{inertia:#}");
        assert!(inertia["added_mass_node"].as_u64().unwrap() < 275);
        let estimate = |name: &str| summary[name].as_f64().unwrap();
        let (last, most) = (estimate("error_estimate_mm"), estimate("error_estimate_largest_mm"));
        assert!(last > 0.0 && most >= last, "{summary:#}");
        assert!(estimate("error_estimate_worst_node_mm") >= last, "{summary:#}");
        assert!((0.0..=1.0).contains(&figure("steps_held_back_share")), "{inertia:#}");
        for part in [
            "times the critical step",
            "times its own mass",
            "error estimate",
            "held back",
            "taken away in a step",
            "coarse motion",
            "lattice ",
        ] {
            assert!(said.out.contains(part), "{part}: {}", said.out);
        }
        for name in ["lattice_cells", "lattice_functions", "coarse_share_least"] {
            assert!(!inertia[name].is_null(), "{name}");
        }
        let share = figure("rough_motion_damped_largest");
        assert!(share > 0.0 && share <= 0.5, "{inertia:#}");
        println!("{:.3} mm, the exact step {exact:.3} mm", far(&desk));
        assert!((far(&desk) / exact - 1.0).abs() < 0.1, "{} {exact}", far(&desk));
    }
}

/// `method = "auto"` and an end are enough; a tolerance is kept with fewer steps the larger it is.
#[test]
fn a_step_may_be_left_to_the_tolerance() {
    let desk = Desk::new();
    let said = desk.simulate(&leaning("end = 1.5\n"), &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    let (exact, exact_steps) = (desk.last(), desk.summary()["steps"].as_u64().unwrap());
    let mut steps = vec![exact_steps];
    for (asked, millimetres) in [("tolerance = 0.0001\n", 0.1), ("", 0.287), ("tolerance = 0.002\n", 2.0)] {
        let said =
            desk.simulate(&leaning(&format!("method = \"auto\"\nend = 1.5\nframes = 60\n{asked}")), &["--force"]);
        assert_eq!(said.code, 0, "{}", said.err);
        let summary = desk.summary();
        let adaptive = &summary["adaptive"];
        let figure = |name: &str| adaptive[name].as_f64().unwrap();
        let distances = exact
            .iter()
            .zip(desk.last())
            .map(|(exact, node)| (4..7).map(|axis| (exact[axis] - node[axis]).powi(2)).sum::<f64>().sqrt());
        let error = 1e3 * distances.sum::<f64>() / exact.len() as f64;
        println!("{asked}{error:.4} mm of {:.1} off, {adaptive}", far(&desk));
        assert!(far(&desk) > 5.0 && error < figure("tolerance_mm"), "{error} {adaptive}");
        assert!((figure("tolerance_mm") - millimetres).abs() < 1e-3, "{adaptive}");
        let time = summary["time_s"].as_f64().unwrap();
        assert!(summary["method"] == "auto" && (time - 1.5).abs() < 1e-6, "{summary}");
        assert!(figure("steps_beyond_critical") > 0.0 && figure("changes") > 0.0, "{adaptive}");
        assert!(said.out.contains(" beyond the critical step, ") && said.out.contains("tolerance "), "{}", said.out);
        steps.push(summary["steps"].as_u64().unwrap());
    }
    assert!(steps.is_sorted_by(|a, b| a >= b) && steps[3] < exact_steps / 4, "{steps:?}");
}

/// 0.1 in float32 is above 0.1 in float64.
#[test]
fn a_step_may_be_as_long_as_the_whole_time() {
    let desk = Desk::new();
    for (end, time) in
        [("0.05", "method = \"auto\"\n"), ("0.1", "method = \"long\"\ntolerance = 1e-3\n"), ("0.001", "step = 0.001\n")]
    {
        let scene = bar(&format!("[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[time]\nend = {end}\n{time}"));
        let stiff = scene.replace("cells = [2, 2, 5]", "cells = [3, 3, 6]");
        let said = desk.simulate(if time.contains("method") { &stiff } else { &scene }, &["--force"]);
        assert_eq!(said.code, 0, "{end} {time}: {}", said.err);
        assert!((desk.summary()["time_s"].as_f64().unwrap() - end.parse::<f64>().unwrap()).abs() < 1e-8);
    }
}

#[test]
fn a_lattice_and_a_step_may_be_given_by_hand() {
    let desk = Desk::new();
    let time = "method = \"long\"\nstep = 0.004\nlattice = [1, 2, 3]\nend = 0.02\nframes = 100\n";
    let said = desk.simulate(&leaning(time), &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    let summary = desk.summary();
    assert_eq!(summary["steps"], 5);
    assert_eq!(summary["inertia"]["step_s"], 0.004);
    assert_eq!(summary["inertia"]["lattice_cells"], serde_json::json!([1, 2, 3]));
    // The foot is held: 2 x 3 points above it at each of three heights, and those at the foot that reach up.
    let functions = summary["inertia"]["lattice_functions"].as_u64().unwrap();
    assert!((18..=24).contains(&functions), "{functions}");
    // Five steps leave five frames after that at rest.
    assert!(desk.path("out/frame_0005.vtu").exists() && !desk.path("out/frame_0006.vtu").exists());
}

#[test]
fn the_exact_step_takes_multiples_up_to_one() {
    let desk = Desk::new();
    assert_eq!(desk.simulate(&leaning("step = \"1x\"\nend = 0.002\n"), &[]).code, 0);
    let summary = desk.summary();
    let steps = summary["steps"].as_f64().unwrap();
    assert_eq!(steps, (0.002 / summary["critical_step_at_rest_s"].as_f64().unwrap()).ceil());
    assert!((summary["step_longest_s"].as_f64().unwrap() * steps / 0.002 - 1.0).abs() < 1e-6);
    let said = desk.simulate(&leaning("step = \"1.1x\"\nend = 0.002\n"), &["--force"]);
    assert_eq!(said.code, 2);
    for part in ["scene.toml, line 15: the step of", "is above the stable", "method = \"long\""] {
        assert!(said.err.contains(part), "{part}: {}", said.err);
    }
}

#[test]
fn what_does_not_go_together_is_refused_in_words() {
    let cases = [
        (
            "method = \"fast\"\nstep = 0.001\nend = 1.0\n",
            "line 15: method \"fast\" is not known; \"exact\", \"long\" and \"auto\" are",
        ),
        ("step = \"auto\"\nmethod = \"long\"\nend = 1.0\n", "line 15: step \"auto\" stays below the "),
        (
            "end = 1.0\ntolerance = 0.0005\n",
            "line 16: tolerance is given, but exact steps have no error to be tolerated; method = \"auto\"",
        ),
        ("method = \"auto\"\nend = 1.0\ntolerance = -1.0\n", "line 17: tolerance is -1 m, it must be a positive"),
        (
            "method = \"long\"\nend = 1.0\n",
            "line 14: step is missing: method \"long\" needs seconds, or a multiple of the critical step",
        ),
        ("end = 1.0\nstep = \"x\"\n", "line 16: step \"x\" is not known; give seconds, \"auto\", or a multiple"),
        ("end = 1.0\nstep = \"-20x\"\n", "line 16: step is \"-20x\", it must be a positive multiple"),
        ("end = 1.0\nstep = \"nanx\"\n", "line 16: step is \"nanx\""),
        ("end = 0.1\nstep = \"5000x\"\nmethod = \"long\"\n", "line 16: the step of 3.2"),
        (
            "step = 0.001\nend = 1.0\nlattice = [2, 2, 4]\n",
            "line 17: lattice is [2, 2, 4], but method \"exact\" has none; \"long\" and \"auto\" have",
        ),
        (
            "step = 0.001\nmethod = \"long\"\nend = 1.0\nlattice = [2, 0, 4]\n",
            "line 18: lattice is [2, 0, 4]; give at least 1 cell along each axis",
        ),
        (
            "step = 0.001\nmethod = \"long\"\nend = 1.0\nlattice = [9, 9, 9]\n",
            "line 18: a lattice of 9 x 9 x 9 cells has more than 240 functions",
        ),
        (
            "step = 0.001\nmethod = \"long\"\nend = 1.0\nlattice = [99, 99, 99]\n",
            "line 18: a lattice of 99 x 99 x 99 cells: each must be at least 1, with at most 1024 points",
        ),
        ("step = 0.001\nmethod = \"long\"\nend = 1.0\nlattice = [2, 2]\n", "line 18: "),
    ];
    let desk = Desk::new();
    for (time, fragment) in cases {
        let said = desk.simulate(&leaning(time), &[]);
        print!("{}", said.err);
        assert_eq!(said.code, 2, "expected a complaint with \"{fragment}\" of:\n{time}\n{}", said.err);
        assert!(said.err.contains(fragment), "\"{fragment}\" is not in: {}", said.err);
        assert!(!desk.path("out").exists(), "a refused scene left a folder behind");
    }
    let tiny =
        bar("[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n[time]\nstep = \"20x\"\nmethod = \"long\"\nend = 1.0\n")
            .replace("cells = [2, 2, 5]", "cells = [1, 1, 2]");
    let said = desk.simulate(&tiny, &[]);
    print!("{}", said.err);
    assert!(
        said.err.contains("bar: with 12 elements the mesh is too small for long steps; write method = \"exact\""),
        "{}",
        said.err
    );
}

#[test]
fn inspect_tells_what_steps_beyond_the_limit_cost() {
    let desk = Desk::new();
    desk.write("scene.toml", &leaning("method = \"long\"\nstep = \"20x\"\nend = 1.0\n"));
    let said = desk.supple(&["inspect", "scene.toml", "--accuracy", "0.5"]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    for part in [
        "long steps",
        "lattice suggested",
        "memory of inertia",
        "long step ",
        "added mass at 10x",
        "added mass at 50x",
        "expected error",
        "over the first 0.200 s",
        "recommended",
    ] {
        assert!(said.out.contains(part), "{part}: {}", said.out);
    }
    // The table falls with the step, and the longest below half a millimetre is recommended.
    let row = |name: &str| {
        let line = said.out.lines().find(|line| line.starts_with(&format!("{name} "))).unwrap();
        line.split_whitespace().map(str::to_string).collect::<Vec<_>>()
    };
    let error = |name: &str| row(name)[2].parse::<f64>().unwrap();
    let names = ["50x", "40x", "30x", "20x", "10x", "5x"];
    assert!(error("50x") > error("10x") && error("10x") > error("5x"));
    let below = names.iter().rev().take_while(|name| error(name) < 0.5).last().unwrap();
    let recommended = said.out.lines().find(|line| line.starts_with("recommended")).unwrap();
    assert!(recommended.contains(&format!("step = \"{below}\"")), "{below}: {recommended}");

    let said = desk.supple(&["inspect", "scene.toml", "--accuracy", "1e-9"]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.contains("method = \"exact\": none of these long steps stays below"), "{}", said.out);
}

#[test]
fn accuracy_is_for_scenes_and_a_positive_number() {
    let desk = Desk::new();
    desk.write("scene.toml", &leaning("step = \"auto\"\nend = 1.0\n"));
    let said = desk.supple(&["inspect", "scene.toml", "--accuracy", "0"]);
    assert_eq!((said.code, said.err.trim()), (2, "error: --accuracy is 0 mm, it must be a positive number"));
    let lobe = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../meshes/lobe.msh");
    let said = desk.supple(&["inspect", lobe, "--accuracy", "0.1"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("--accuracy recommends a step for a scene (.toml), this is a mesh"), "{}", said.err);
}
