//! `supple fit`: known values come back from displacements with noise, what the data cannot tell is told, and what is
//! wrong with the input is refused with its place.

use serde_json::Value;

use super::{Desk, Said};

/// A bar of 20 x 20 x 50 mm that is fixed at z = 0, under gravity across.
fn scene(cells: [u32; 3], more: &str) -> String {
    format!(
        "gravity = [9.81, 0.0, 0.0]\ndamping = 25.0\n[mesh]\nshape = \"bar\"\nsize = [0.02, 0.02, 0.05]\ncells = {cells:?}\n\
         element = \"nodal-strain\"\n[material]\nlaw = \"neo-hookean\"\nc = 5000.0\nd = 75000.0\ndensity = 1000.0\n\
         [[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n{more}[time]\nend = 1.0\n"
    )
}

/// Young's modulus of the scene, Pa: shear modulus 10,000, bulk modulus 150,000.
const YOUNG: f64 = 9.0 * 150e3 * 10e3 / (3.0 * 150e3 + 10e3);

/// Even pseudo-random numbers in -1 to 1.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Displacements of some nodes of a simulated scene at its end, with so much noise (m) at most, as measured.
fn measured(desk: &Desk, scene: &str, most_noise: f64, time: &str) -> String {
    let said = desk.simulate(scene, &["--force"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let mut noise = noise();
    let (header, cell) = if time.is_empty() { ("", String::new()) } else { ("time_s,", format!("{time},")) };
    let mut text = format!("{header}name,x_m,y_m,z_m,ux_m,uy_m,uz_m\n");
    for [node, x, y, z, ux, uy, uz] in desk.last().into_iter().filter(|row| row[3] > 0.0).step_by(7) {
        let [ux, uy, uz] = [ux, uy, uz].map(|metre| metre + most_noise * noise());
        text += &format!("{cell}n{node},{x},{y},{z},{ux},{uy},{uz}\n");
    }
    text
}

const YOUNG_TABLE: &str = "[[parameter]]\nname = \"material.young\"\nstart = 10000.0\nmin = 2000.0\nmax = 500000.0\n";

fn fit(desk: &Desk, text: &str) -> Said {
    desk.write("fit.toml", text);
    desk.supple(&["fit", "fit.toml", "--out", "fit.json"])
}

fn result(desk: &Desk) -> Value {
    serde_json::from_str(&std::fs::read_to_string(desk.path("fit.json")).unwrap()).unwrap()
}

fn case(more: &str) -> String {
    format!("[[case]]\nscene = \"model.toml\"\nmeasured = \"points.csv\"\n{more}")
}

#[test]
fn young_comes_back_from_another_mesh_with_noise() {
    let desk = Desk::new();
    let points = measured(&desk, &scene([4, 4, 9], ""), 0.2e-3, "");
    desk.write("points.csv", &points);
    desk.write("model.toml", &scene([3, 3, 7], ""));
    let name = |line: usize| points.lines().nth(line).unwrap().split(',').next().unwrap();
    let left_out = format!("left_out = [\"{}\", \"{}\"]\n", name(8), name(20));
    let said = fit(&desk, &format!("{YOUNG_TABLE}{}", case(&left_out)));
    assert_eq!(said.code, 0, "{}", said.err);
    let result = result(&desk);
    let young = &result["parameters"][0];
    let (value, error) = (young["value"].as_f64().unwrap(), young["standard_error"].as_f64().unwrap());
    println!("{}{result:#}", said.out);
    // The coarser mesh is some per cent stiffer or softer.
    assert!((value / YOUNG - 1.0).abs() < 0.07, "{value} of {YOUNG}");
    assert!(error > 1e-4 * value && error < 0.02 * value, "{error}");
    assert!(young["told"].as_bool().unwrap() && result["converged"].as_bool().unwrap());
    assert!(result["simulations"].as_u64().unwrap() <= 6, "{}", result["simulations"]);
    // Even noise of at most 0.2 mm an axis is 0.2 mm rms of a point.
    for distances in ["residuals", "left_out", "each_point_left_out"] {
        let rms = result[distances]["rms_m"].as_f64().unwrap();
        assert!(rms > 0.1e-3 && rms < 0.35e-3, "{distances} {rms}");
    }
    assert_eq!(result["left_out"]["points"], 2);
    assert!(said.out.contains("mm rms of 2 points"), "{}", said.out);
    // The scene's constants for the value found.
    let set = &result["cases"][0]["set"];
    let c: f64 = set[0]["value"].as_str().unwrap().parse().unwrap();
    assert_eq!(set[0]["key"], "c");
    assert!((c / 5000.0 / (value / YOUNG) - 1.0).abs() < 1e-6);
}

/// Markers above a flat face: the 24 nodes nearest to one that is more than a few edges away all lie in the face.
#[test]
fn markers_outside_move_as_the_tissue_next_to_them() {
    let desk = Desk::new();
    let model = scene([6, 6, 15], "");
    assert_eq!(desk.simulate(&model, &["--force"]).code, 0);
    let (rows, edge) = (desk.last(), 0.02 / 6.0);
    let at = |place: [f64; 3]| {
        let near = |row: &[f64; 7]| (0..3).all(|axis| (row[axis + 1] - place[axis]).abs() < 1e-5);
        let [.., x, y, z] = *rows.iter().find(|row| near(row)).unwrap();
        [x, y, z]
    };
    for height in [2.0 * edge, 4.0 * edge] {
        let mut text = "name,x_m,y_m,z_m,ux_m,uy_m,uz_m\n".to_string();
        for (number, (j, k)) in [(1, 6), (3, 8), (5, 10), (2, 12), (4, 14)].into_iter().enumerate() {
            let (y, z) = (f64::from(j) * edge, f64::from(k) * edge);
            let [on, below] = [0.02, 0.02 - edge].map(|x| at([x, y, z]));
            let u = [0, 1, 2].map(|axis| on[axis] + height / edge * (on[axis] - below[axis]));
            text += &format!("p{number},{},{y},{z},{},{},{}\n", 0.02 + height, u[0], u[1], u[2]);
        }
        desk.write("points.csv", &text);
        desk.write("model.toml", &model);
        let said = fit(&desk, &format!("{YOUNG_TABLE}{}", case("")));
        assert_eq!(said.code, 0, "{}", said.err);
        assert!(said.err.contains("points are outside the mesh"), "{}", said.err);
        let young = result(&desk)["parameters"][0]["value"].as_f64().unwrap();
        println!("{:.1} mm above: {young:.0} of {YOUNG:.0} Pa", 1e3 * height);
        assert!((young / YOUNG - 1.0).abs() < 0.05, "{young}");
    }
}

#[test]
fn damping_comes_back_from_displacements_over_time() {
    let desk = Desk::new();
    let mut all = String::new();
    for end in ["0.06", "0.1", "0.15"] {
        let text = measured(&desk, &scene([2, 2, 5], "").replace("end = 1.0", &format!("end = {end}")), 0.05e-3, end);
        all += if all.is_empty() { &text } else { text.split_once('\n').unwrap().1 };
    }
    desk.write("points.csv", &all);
    desk.write("model.toml", &scene([2, 2, 5], ""));
    let said = fit(
        &desk,
        &format!("[[parameter]]\nname = \"damping\"\nstart = 0.0\nmin = 0.0\nmax = 100.0\n{YOUNG_TABLE}{}", case("")),
    );
    assert_eq!(said.code, 0, "{}", said.err);
    let result = result(&desk);
    println!("{}", said.out);
    for (index, truth) in [25.0, YOUNG].into_iter().enumerate() {
        let parameter = &result["parameters"][index];
        let (value, error) = (parameter["value"].as_f64().unwrap(), parameter["standard_error"].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * error && error < 0.05 * truth, "{value} +- {error} of {truth}");
    }
    // Of a point at three times, not their sum.
    let [known, without] = ["residuals", "each_point_left_out"].map(|what| result[what]["rms_m"].as_f64().unwrap());
    assert!(without > known && without < 1.3 * known, "{without}, with them {known}");
}

/// At the start a body hangs where `settle` has brought it, and is undeformed without.
#[test]
fn a_recording_may_begin_with_the_start_of_the_scene() {
    let desk = Desk::new();
    let model = scene([2, 2, 5], "") + "settle = 1e-6\n";
    let points = measured(&desk, &model.replace("end = 1.0", "end = 0.001"), 0.0, "0.0");
    desk.write("points.csv", &points);
    desk.write("model.toml", &model);
    let said = fit(&desk, &format!("{YOUNG_TABLE}{}", case("")));
    assert_eq!(said.code, 0, "{}", said.err);
    let (young, rms) = (&result(&desk)["parameters"][0]["value"], &result(&desk)["residuals"]["rms_m"]);
    println!("{young} of {YOUNG} Pa, residuals {rms} m");
    assert!((young.as_f64().unwrap() / YOUNG - 1.0).abs() < 0.01 && rms.as_f64().unwrap() < 2e-5);
    desk.write("points.csv", &points.replace("0.0,n", "-0.001,n"));
    let said = fit(&desk, &format!("{YOUNG_TABLE}{}", case("")));
    assert!(said.code == 2 && said.err.contains("time_s is -0.001, it must be zero or more"), "{}", said.err);
}

#[test]
fn a_fit_of_runs_that_are_not_ok_says_so() {
    let desk = Desk::new();
    let model =
        scene([2, 2, 5], "").replace("end = 1.0", "end = 0.1\nmethod = \"long\"\nlattice = [1, 1, 2]\nstep = \"40x\"");
    desk.write("points.csv", &measured(&desk, &model, 0.0, "0.1"));
    assert_eq!(desk.summary()["status"], "inexact");
    desk.write("model.toml", &model);
    let said = fit(&desk, &format!("{YOUNG_TABLE}{}", case("")));
    assert_eq!(said.code, 0, "{}", said.err);
    let words = "model.toml with the values found (inexact): in ";
    let remedy = "; write method = \"exact\" under [time], or \"auto\" with a tolerance well below the residuals";
    assert!(said.err.contains(words) && said.err.contains(remedy), "{}", said.err);
    let warnings = result(&desk)["warnings"].as_array().unwrap().clone();
    assert!(warnings.iter().any(|warning| warning.as_str().unwrap().starts_with(words)), "{warnings:?}");
}

/// Springs in place of supports, a pull and an instrument that move, a start at rest: with each, what the scene has.
#[test]
fn whatever_acts_in_a_scene_acts_in_its_fit_over_time() {
    let spring = "[[spring]]\nplane = { axis = \"z\", at = 0.0 }\nstiffness = 20.0\n";
    let pull = "[[pull]]\npoint = [0.01, 0.01, 0.05]\nstiffness = 50.0\n\
                path = [[0.0, 0.01, 0.01, 0.05], [0.1, 0.01, 0.018, 0.05]]\n";
    let ball = "[[instrument]]\nshape = \"sphere\"\nradius = 0.006\npath = [[0.0, 0.01, 0.027, 0.04], [0.1, 0.01, 0.022, 0.04]]\n";
    for (name, more, settle) in [
        ("springs", spring, ""),
        ("a pull", pull, ""),
        ("an instrument", ball, ""),
        ("a start at rest", "", "settle = 1e-5\n"),
    ] {
        let desk = Desk::new();
        let mut model = scene([2, 2, 5], more) + settle;
        if name == "springs" {
            model = model.replace("[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n", "");
        }
        let mut all = String::new();
        for end in ["0.06", "0.1", "0.15"] {
            let text = measured(&desk, &model.replace("end = 1.0", &format!("end = {end}")), 0.0, end);
            all += if all.is_empty() { &text } else { text.split_once('\n').unwrap().1 };
        }
        desk.write("points.csv", &all);
        desk.write("model.toml", &model);
        let said = fit(&desk, &format!("{YOUNG_TABLE}{}", case("")));
        assert_eq!(said.code, 0, "{name}: {}", said.err);
        let result = result(&desk);
        let (value, rms) = (&result["parameters"][0]["value"], result["residuals"]["rms_m"].as_f64().unwrap());
        println!("{name}: {value} of {YOUNG} Pa, residuals {:.4} mm", 1e3 * rms);
        assert!((value.as_f64().unwrap() / YOUNG - 1.0).abs() < 0.01 && rms < 2e-5, "{name}: {value}, {rms} m");
    }
}

/// Share and time of relaxation, and when the film starts: 12 ms late.
#[test]
fn relaxation_comes_back_from_displacements_over_time() {
    let desk = Desk::new();
    let model = |terms: &str| {
        let weight = "[[mass]]\nbox = { min = [0.0, 0.0, 0.05], max = [0.02, 0.02, 0.05] }\nkilogram = 0.0005\n";
        scene([2, 2, 5], weight).replace("density", &format!("prony = {terms}\ndensity"))
    };
    let mut all = String::new();
    for time in [0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6] {
        let scene = model("[[0.3, 0.15]]").replace("end = 1.0", &format!("end = {time}"));
        let text = measured(&desk, &scene, 0.02e-3, &format!("{}", time + 0.012));
        all += if all.is_empty() { &text } else { text.split_once('\n').unwrap().1 };
    }
    desk.write("points.csv", &all);
    desk.write("model.toml", &model("[[0.15, 0.3]]"));
    let parameter = |name: &str, start: f64, most: f64| {
        format!("[[parameter]]\nname = \"{name}\"\nstart = {start:?}\nmin = 0.001\nmax = {most:?}\n")
    };
    let clock = parameter("clock", 0.005, 0.05) + "scene = \"model.toml\"\n";
    let terms = parameter("material.prony[0][0]", 0.15, 0.9) + &parameter("material.prony[0][1]", 0.3, 2.0);
    let said = fit(&desk, &format!("{terms}{clock}{}", case("")));
    assert_eq!(said.code, 0, "{}", said.err);
    println!("{}", said.out);
    let result = result(&desk);
    for (index, truth) in [0.3, 0.15, 0.012].into_iter().enumerate() {
        let parameter = &result["parameters"][index];
        let (value, error) = (parameter["value"].as_f64().unwrap(), parameter["standard_error"].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * error && error < 0.15 * truth, "{value} +- {error} of {truth}");
    }
    let said = fit(&desk, &format!("{}{}", parameter("clock", 0.005, 0.05), case("")));
    assert!(said.code == 2 && said.err.contains("clock is that of one scene"), "{}", said.err);
}

#[test]
fn what_the_data_cannot_tell_is_told() {
    let desk = Desk::new();
    let force = "[[force]]\nplane = { axis = \"z\", at = 0.05 }\nnewton = [0.002, 0.0, 0.0]\n";
    let model = scene([2, 2, 5], force).replace("9.81", "0.0");
    let points = measured(&desk, &model, 0.05e-3, "");
    desk.write("points.csv", &points);
    desk.write("model.toml", &model);
    // Only their ratio moves the bar.
    let force = "[[parameter]]\nname = \"force[0].newton\"\nstart = 0.8\nmin = 0.1\nmax = 10.0\n";
    let said = fit(&desk, &format!("{YOUNG_TABLE}{force}{}", case("")));
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.err.contains("cannot tell material.young from force[0].newton"), "{}", said.err);
    assert!(said.out.contains("(the data cannot tell it)"), "{}", said.out);
    assert_eq!(result(&desk)["parameters"][1]["told"], false);
    // Density moves nothing where there is no gravity.
    let density = "[[parameter]]\nname = \"material.density\"\nstart = 900.0\nmin = 500.0\nmax = 2000.0\n";
    let said = fit(&desk, &format!("{YOUNG_TABLE}{density}{}", case("")));
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.err.contains("material.density moves no measured point"), "{}{}", said.out, said.err);
    let result = result(&desk);
    assert_eq!([&result["parameters"][0]["told"], &result["parameters"][1]["told"]], [true, false], "{}", said.out);
    let said = fit(&desk, &format!("{density}{}", case("")));
    assert!(said.code == 0 && said.out.contains("each point left out") && !said.out.contains("NaN"), "{}", said.out);
    // Poisson's ratio of a bending bar, with the noise of a tracker.
    let points = measured(&desk, &model, 0.5e-3, "");
    desk.write("points.csv", &points);
    let poisson = "[[parameter]]\nname = \"material.poisson\"\nstart = 0.4\nmin = 0.2\nmax = 0.49\n";
    let said = fit(&desk, &format!("{YOUNG_TABLE}{poisson}{}", case("")));
    assert_eq!(said.code, 0, "{}", said.err);
    println!("{}{}", said.out, said.err);
    assert!(said.err.contains("cannot tell material.poisson"), "{}{}", said.out, said.err);
}

/// From this start the first steps take `d` to its maximum, where a small change of it moves nothing.
#[test]
fn a_value_that_has_gone_to_its_limit_comes_back() {
    let desk = Desk::new();
    let model = scene([3, 3, 9], "")
        .replace("[9.81, 0.0, 0.0]", "[0.0, 2.0, 9.81]")
        .replace("[0.02, 0.02, 0.05]", "[0.03, 0.03, 0.09]")
        .replace("c = 5000.0", "c = 1584.5")
        .replace("d = 75000.0", "d = 9375.0")
        .replace("end = 1.0", "end = 0.01\nsettle = 1e-7");
    desk.write("points.csv", &measured(&desk, &model, 0.0, ""));
    desk.write("model.toml", &model);
    let c = "[[parameter]]\nname = \"material.c\"\nstart = 600.0\nmin = 100.0\nmax = 1e6\n";
    let d = "[[parameter]]\nname = \"material.d\"\nstart = 6e4\nmin = 1e3\nmax = 1e6\n";
    let said = fit(&desk, &format!("{c}{d}{}", case("")));
    println!("{}{}", said.out, said.err);
    // They are known to 1e-4, so that a correlation of -0.98 does not matter.
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    for (index, truth) in [1584.5, 9375.0].into_iter().enumerate() {
        let value = result(&desk)["parameters"][index]["value"].as_f64().unwrap();
        assert!((value / truth - 1.0).abs() < 1e-3, "{value} of {truth}");
    }
    // One that must stay there has the others' errors with it.
    let said = fit(
        &desk,
        &format!("{c}{}{}", d.replace("max = 1e6", "max = 8e4").replace("min = 1e3", "min = 2e4"), case("")),
    );
    assert_eq!(said.code, 0, "{}", said.err);
    let words = "material.d stays at its limit, 20000: the data want it further, and the other values and their errors hold only if it is the truth";
    assert!(said.err.contains(words), "{}{}", said.out, said.err);
}

/// A share of what is truly zero says nothing; of the range it does.
#[test]
fn a_value_that_is_zero_can_be_told() {
    let desk = Desk::new();
    let model = scene([2, 2, 5], "");
    desk.write("points.csv", &measured(&desk, &model, 0.1e-3, ""));
    desk.write("model.toml", &model);
    let gravity = "[[parameter]]\nname = \"gravity[1]\"\nstart = 0.5\nmin = -8.0\nmax = 8.0\n";
    let said = fit(&desk, &format!("{YOUNG_TABLE}{gravity}{}", case("")));
    println!("{}{}", said.out, said.err);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    let across = result(&desk)["parameters"][1].clone();
    let (value, error) = (across["value"].as_f64().unwrap(), across["standard_error"].as_f64().unwrap());
    assert!(value.abs() < 4.0 * error && error > 0.5 * value.abs() && error < 0.08, "{value} +- {error}");
    assert_eq!(across["told"], true);
}

/// Places for displacements, and millimetres for metres.
#[test]
fn what_was_measured_otherwise_is_remarked_upon() {
    let desk = Desk::new();
    let model = scene([2, 2, 5], "");
    let points = measured(&desk, &model, 0.0, "");
    desk.write("model.toml", &model);
    let changed = |change: &dyn Fn(f64, f64) -> f64| {
        let mut lines: Vec<String> = points.lines().map(String::from).collect();
        for line in &mut lines[1..] {
            let cells: Vec<f64> = line.split(',').skip(1).map(|cell| cell.parse().unwrap()).collect();
            let moved: Vec<_> = (0..3).map(|axis| change(cells[axis], cells[3 + axis]).to_string()).collect();
            let places: Vec<_> = line.split(',').take(4).collect();
            *line = format!("{},{}", places.join(","), moved.join(","));
        }
        desk.write("points.csv", &(lines.join("\n") + "\n"));
        let said = fit(&desk, &format!("{YOUNG_TABLE}{}", case("")));
        println!("{}{}", said.out, said.err);
        said
    };
    let said = changed(&|place, metre| place + metre);
    assert!(
        said.err.contains("model.toml: the points are ") && said.err.contains("displacements and not places"),
        "{}",
        said.err
    );
    let said = changed(&|_, metre| 1e3 * metre);
    assert!(
        said.err.contains("mm, the body is 57 mm across; displacements are in metres (1 mm is 0.001)"),
        "{}",
        said.err
    );
    assert!(!said.err.contains("moves no measured point"), "{}", said.err);
}

#[test]
fn a_value_stays_at_its_limit_and_says_so() {
    let desk = Desk::new();
    let points = measured(&desk, &scene([2, 2, 5], ""), 0.0, "");
    desk.write("points.csv", &points);
    desk.write("model.toml", &scene([2, 2, 5], ""));
    let said = fit(&desk, &format!("{}{}", YOUNG_TABLE.replace("500000.0", "20000.0"), case("")));
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.err.contains("material.young stays at its limit, 20000"), "{}", said.err);
    let young = result(&desk)["parameters"][0].clone();
    assert_eq!((young["value"].as_f64(), young["at_limit"].as_bool()), (Some(20000.0), Some(true)));
}

#[test]
fn what_cannot_be_fitted_is_refused_with_its_place() {
    let desk = Desk::new();
    desk.write("model.toml", &scene([2, 2, 5], ""));
    let header = "x_m,y_m,z_m,ux_m,uy_m,uz_m\n";
    desk.write("points.csv", &format!("{header}0.01,0.01,0.05,0.001,,\n"));
    let refused = |text: &str, words: &str| {
        let said = fit(&desk, text);
        assert_eq!(said.code, 2, "{text}: {}", said.out);
        assert!(said.err.contains(words), "{text}: {} lacks {words}", said.err);
        assert!(!desk.path("fit.json").exists());
    };
    let both = format!("{YOUNG_TABLE}{}", case(""));
    refused(
        &both.replace("start = 10000.0", "start = 1000.0"),
        "fit.toml, line 3: start is 1000, it must be from min, 2000, to max, 500000",
    );
    refused(
        &both.replace("min = 2000.0", "min = 6e5"),
        "fit.toml, line 4: min is 600000 and max is 500000; min must be below max",
    );
    refused(
        &both.replace("material.young", "material.stiffness"),
        "fit.toml, line 2: the scene has no value material.stiffness",
    );
    refused(
        &both.replace("material.young", "material..c"),
        "fit.toml, line 2: \"material..c\" is not the place of a value",
    );
    refused(&both.replace("material.young", "spring[0].stiffness"), "spring[0].stiffness: spring is not there");
    refused(&both.replace("max =", "most ="), "fit.toml, line 5: unknown field `most`");
    refused(&both.replace("model.toml", "other.toml"), "fit.toml, line 7: other.toml: cannot be read");
    refused(&both.replace("points.csv", "other.csv"), "fit.toml, line 8: other.csv: cannot be read");
    refused(&format!("{YOUNG_TABLE}{both}"), "the parameter material.young is there twice");
    refused(&case(""), "there is no [[parameter]]");
    refused(YOUNG_TABLE, "there is no [[case]]");
    refused(&format!("{both}left_out = true\n"), "all points are left out");
    refused(&format!("{both}left_out = [\"tip\"]\n"), "no measured point has the name \"tip\"");
    let two = YOUNG_TABLE
        .replace("material.young", "material.poisson")
        .replace("10000.0", "0.4")
        .replace("2000.0", "0.3")
        .replace("500000.0", "0.45");
    refused(&format!("{two}{both}"), "2 parameters, but only 1 measured numbers");
    for (points, words) in [
        ("0.01,0.01,0.05,wide,,\n", "points.csv: line 2: ux_m is \"wide\", it must be a number"),
        ("0.01,0.01,0.05,0.1,0.1\n", "points.csv: line 2: 5 values, the first line has 6 columns"),
        ("0.01,0.01,0.05,,,\n", "the file holds no measured displacement"),
        ("10,10,50,1,,\n", "mm from the mesh"),
    ] {
        desk.write("points.csv", &format!("{header}{points}"));
        refused(&both, words);
    }
    desk.write("points.csv", "x,y_m,z_m,ux_m,uy_m,uz_m\n");
    refused(&both, "line 1: the column \"x\" is not known; there are x_m");
}
