//! `[learned]` in a scene file: after the lead-in of the exact step a network takes over, and what it did is told.

use supple::material::{Element, NeoHookean};
use supple::mlp::{Activation, Description, LayerDescription, Range};

use super::networks::described;
use super::{Desk, bar, names};

/// A network that brings every vertex to a stop: `a = -40 v`, and the tangent is the direction of the velocity.
fn stopping() -> Description<'static> {
    let mut weights = vec![0.0; 21];
    weights[3] = -40.0;
    let range = |most: f32| Range { scale: 1.0, least: -most, most };
    Description {
        inputs: vec![range(10.0); 7],
        outputs: vec![range(1e3); 3],
        first: vec![LayerDescription { inputs: 7, activation: Activation::Linear, weights, biases: vec![0.0; 3] }],
        second: vec![],
        law: NeoHookean { c: 500.0, d: 15_000.0 }.into(),
        element: Element::NodalPressure,
        step: 5e-3,
        exact_step: 5e-4,
        ..described(&[7, 3], &[], 1)
    }
}

/// A network that makes every vertex faster, by `push` m/s^2 along each axis of its frame.
fn accelerating(push: f32) -> Description<'static> {
    let mut network = stopping();
    network.first[0].weights.fill(0.0);
    network.first[0].biases.fill(push);
    network
}

/// A bar that leans over under gravity from the side, moved by `a.weights`.
fn leaning(time: &str, learned: &str) -> String {
    let body = bar("").replace("damping = 20.0\n", "");
    format!(
        "gravity = [1.0, 0.0, 0.0]\n{body}[[fix]]\nplane = {{ axis = \"z\", at = 0.0 }}\n[time]\n{time}\
         [learned]\nweights = \"a.weights\"\n{learned}"
    )
}

/// The same without a network.
fn without_network(time: &str) -> String {
    let scene = leaning(time, "");
    format!("damping = 20.0\n{}", scene.split("[learned]").next().unwrap())
}

/// The same of the tetrahedra that the networks learned from.
fn as_learned(time: &str) -> String {
    without_network(time).replace("[mesh]\n", "[mesh]\nelement = \"nodal-pressure\"\n")
}

fn far(desk: &Desk) -> f64 {
    desk.summary()["max_displacement_mm"].as_f64().unwrap()
}

#[test]
fn tissue_that_relaxes_is_refused() {
    let desk = Desk::new();
    desk.network("a.weights", &stopping());
    let scene = leaning("end = 0.6\n", "").replace("density", "prony = [[0.2, 0.1]]\ndensity");
    let said = desk.simulate(&scene, &[]);
    assert!(said.code == 2 && said.err.contains("learned steps do not know tissue that relaxes"), "{}", said.err);
}

#[test]
fn tissue_with_fibres_is_refused() {
    let desk = Desk::new();
    desk.network("a.weights", &stopping());
    let fibres = "fibres = [1000.0, 5.0]\ndensity";
    let directions = "[directions]\nfibre = [0.0, 0.0, 1.0]\n[time]";
    let scene = leaning("end = 0.6\n", "").replace("density", fibres).replace("[time]", directions);
    let said = desk.simulate(&scene, &[]);
    assert!(said.code == 2 && said.err.contains("learned steps do not know fibres"), "{}", said.err);
}

#[test]
fn a_network_takes_over_after_the_exact_step_and_says_what_it_did() {
    let desk = Desk::new();
    desk.network("a.weights", &stopping());
    // Where the bar has come to a stop.
    assert_eq!(desk.simulate(&leaning("step = \"auto\"\nend = 0.3\n", "lead_in = 0.1\n"), &[]).code, 0);
    let stopped = far(&desk);
    assert_eq!(desk.simulate(&without_network("step = \"auto\"\nend = 0.4\n"), &["--force"]).code, 0);
    assert!(desk.summary()["learned"].is_null());
    assert!((far(&desk) / stopped - 1.0).abs() > 0.05, "{} {stopped}", far(&desk));

    for step in ["\"auto\"", "5e-4"] {
        let time = format!("step = {step}\nend = 0.4\nframes = 4\n");
        let said = desk.simulate(&leaning(&time, "lead_in = 0.1\n"), &["--force"]);
        println!("{}{}", said.out, said.err);
        assert_eq!(said.code, 0, "{}", said.err);
        // A network that stops the bar in its swing is wrong, and that is the only remark: the tissue is that of the
        // training.
        assert_eq!(said.err.lines().count(), 1, "{}", said.err);
        assert!(said.err.contains("the error may be more than is allowed: "), "{}", said.err);
        let summary = desk.summary();
        assert_eq!((&summary["method"], &summary["status"]), (&"learned".into(), &"inexact".into()));
        assert!(summary["steps_inexact"].as_u64().unwrap() > 10, "{summary:#}");
        assert_eq!(summary["damping_per_s"], 20.0);
        let network = &summary["learned"];
        assert!(network["weights"].as_str().unwrap().ends_with("a.weights"));
        assert_eq!((&network["steps"], &network["step_s"]), (&60.into(), &5e-3.into()));
        assert!((network["from_s"].as_f64().unwrap() - 0.1).abs() < 1e-6);
        for share in ["clipped_share", "clipped_share_most", "outside_share", "outside_share_most"] {
            assert_eq!(network[share], 0.0, "{share}");
        }
        assert!(network["fell_back_at_s"].is_null());
        if step == "5e-4" {
            assert_eq!(summary["steps"], 200 + 60);
        }
        assert!((summary["time_s"].as_f64().unwrap() - 0.4).abs() < 1e-6);
        assert!((far(&desk) / stopped - 1.0).abs() < 0.01, "{} {stopped}", far(&desk));
        for part in ["a.weights, steps of 5.000e-3 s, 10.0 times", "60 from 0.100 s on", "outside training"] {
            assert!(said.out.contains(part), "{part}: {}", said.out);
        }
        let frames = names(&desk.path("out")).into_iter().filter(|name| name.ends_with(".vtu")).count();
        assert_eq!(frames, 5);
    }
}

#[test]
fn the_first_learned_step_goes_on_from_the_last_interval_of_the_lead_in() {
    let desk = Desk::new();
    // No acceleration: every vertex goes on as it went over the last interval.
    let mut network = stopping();
    network.first[0].weights.fill(0.0);
    desk.network("a.weights", &network);
    let end = |end: f64, learned: &str| {
        let time = format!("step = 5e-4\nend = {end}\n");
        let scene = if learned.is_empty() { as_learned(&time) } else { leaning(&time, learned) };
        let said = desk.simulate(&scene, &["--force"]);
        assert_eq!(said.code, 0, "{}", said.err);
        desk.last()
    };
    let (before, after) = (end(0.045, ""), end(0.05, ""));
    let learned = end(0.06, "lead_in = 0.05\n");
    for ((before, after), learned) in before.iter().zip(&after).zip(&learned) {
        for axis in 4..7 {
            let expected = after[axis] + 2.0 * (after[axis] - before[axis]);
            assert!((learned[axis] - expected).abs() < 1e-8, "{expected} {}", learned[axis]);
        }
    }
}

#[test]
fn shares_that_were_clipped_and_outside_are_told() {
    let desk = Desk::new();
    let mut network = stopping();
    for range in network.inputs.iter_mut().chain(&mut network.outputs) {
        (range.least, range.most) = (-1e-9, 1e-9);
    }
    desk.network("a.weights", &network);
    let said = desk.simulate(&leaning("step = \"auto\"\nend = 0.2\n", "lead_in = 0.1\n"), &[]);
    println!("{}{}", said.out, said.err);
    assert_eq!(said.code, 0, "{}", said.err);
    let network = &desk.summary()["learned"];
    for share in ["clipped_share", "clipped_share_most", "outside_share", "outside_share_most"] {
        assert_eq!(network[share], 1.0, "{share}");
    }
    assert!(said.out.contains("100.00 % of the vertices on average, 100.0 % at most"), "{}", said.out);
    assert!(said.err.contains("had inputs outside the network's training"), "{}", said.err);
}

#[test]
fn a_network_that_cannot_be_believed_ends_the_run_or_gives_way_to_the_exact_step() {
    let desk = Desk::new();
    desk.network("a.weights", &accelerating(900.0));
    let time = "step = \"auto\"\nend = 0.4\nframes = 4\n";
    let said = desk.simulate(&leaning(time, "lead_in = 0.1\n"), &[]);
    print!("{}", said.err);
    assert_eq!(said.code, 3);
    assert!(said.err.contains("loads and supports never gave more"), "{}", said.err);
    assert_eq!(desk.summary()["status"], "diverged");

    assert_eq!(desk.simulate(&as_learned(time), &["--force"]).code, 0);
    let exact = far(&desk);
    for (push, latest, why) in [(900.0, 0.101, "diverged at 0.1"), (3.0, 0.2, "exceeded what loads")] {
        desk.network("a.weights", &accelerating(push));
        let said = desk.simulate(&leaning(time, "lead_in = 0.1\nfallback = true\n"), &["--force"]);
        print!("{}{}", said.out, said.err);
        assert_eq!(said.code, 0, "{}", said.err);
        let summary = desk.summary();
        assert_eq!(summary["status"], "fell back");
        let network = &summary["learned"];
        let at = network["fell_back_at_s"].as_f64().unwrap();
        assert!((0.099..latest).contains(&at), "{at}");
        assert!(network["fell_back_because"].as_str().unwrap().starts_with(why), "{network}");
        // Steps that were undone are not among those taken.
        assert_eq!(summary["steps_undone"], network["fallbacks"]);
        assert!((1..10).contains(&network["fallbacks"].as_u64().unwrap()), "{network}");
        assert!(said.out.contains("fell back             to exact steps "), "{}", said.out);
        assert!(said.err.contains(" s, as the learned step "), "{}", said.err);
        println!("{:.3} mm, the exact step {exact:.3} mm", far(&desk));
        assert!((far(&desk) / exact - 1.0).abs() < 0.05);
    }
}

#[test]
fn a_tissue_that_the_network_does_not_know_is_remarked_upon() {
    let desk = Desk::new();
    desk.network("a.weights", &stopping());
    let scene = leaning("step = \"auto\"\nend = 0.2\n", "lead_in = 0.1\n");
    for (known, other) in [("c = 500.0", "c = 600.0"), ("density = 1000.0", "density = 1100.0")] {
        let said = desk.simulate(&scene.replace(known, other), &["--force"]);
        print!("{}", said.err);
        assert_eq!(said.code, 0, "{}", said.err);
        for part in [
            "line 17: ",
            "a.weights learned from neo-hookean, c 500 Pa, d 15000 Pa, 1000 kg/m^3, nodal-pressure tetrahedra; the scene is \
             neo-hookean, c ",
        ] {
            assert!(said.err.contains(part), "{part}: {}", said.err);
        }
        // That it stops the bar is another.
        assert_eq!(desk.summary()["warnings"].as_array().unwrap().len(), 2);
    }
}

#[test]
fn tetrahedra_that_bend_too_little_are_remarked_upon() {
    let desk = Desk::new();
    desk.network("a.weights", &Description { element: Element::Linear, ..stopping() });
    let time = "step = \"auto\"\nend = 0.2\n";
    let locking = leaning(time, "lead_in = 0.1\n");
    let named = without_network(time).replace("[mesh]\n", "[mesh]\nelement = \"linear\"\n");
    for (scene, fragment) in [
        (&locking, "line 17: a.weights learned from linear tetrahedra, which bend too little in tissue"),
        (
            &named,
            "line 3: element = \"linear\" bends too little in tissue that hardly changes its volume (nu is 0.4835",
        ),
        // Tissue that does change its volume.
        (&named.replace("d = 15000.0", "d = 1000.0"), ""),
        (&without_network(time), ""),
    ] {
        let said = desk.simulate(scene, &["--force"]);
        print!("{}", said.err);
        assert_eq!(said.code, 0, "{}", said.err);
        let heard = said.err.replace("./", "");
        assert!(heard.contains(fragment), "\"{fragment}\" is not in: {}", said.err);
        assert!(!fragment.is_empty() || heard.is_empty(), "{heard}");
    }
}

#[test]
fn what_does_not_go_together_is_refused_in_words() {
    let desk = Desk::new();
    desk.network("a.weights", &stopping());
    desk.network("wide.weights", &described(&[8, 4, 3], &[], 1));
    desk.write("damaged.weights", &"SUPPLE-W".repeat(40));
    let auto = "step = \"auto\"\nend = 0.4\n";
    let cases = [
        (
            format!("damping = 10.0\n{}", leaning(auto, "")),
            "line 1: damping is 10 1/s, but ./a.weights learned a motion damped by 20 1/s; leave damping out",
        ),
        (
            leaning("step = 4e-4\nend = 0.4\n", ""),
            "line 14: the exact step is 0.0004 s and that of ./a.weights 0.005 s, which is no whole number of them; write \
             step = 0.00038461538 or step = \"auto\"",
        ),
        (leaning("step = 0.1\nend = 0.4\n", ""), "0.1 s and that of ./a.weights 0.005 s, which is no whole"),
        (
            leaning("step = \"20x\"\nmethod = \"long\"\nend = 0.4\n", ""),
            "line 15: method is \"long\", but with [learned] the exact step leads",
        ),
        (leaning(auto, "lead_in = -0.1\n"), "line 18: lead_in is -0.1 s, it must be zero or more"),
        (leaning(auto, "lead_in = 0.4\n"), "line 18: the exact step leads for 0.4 s (lead_in), so a learned step of"),
        (leaning("step = \"auto\"\nend = 0.2\n", ""), "line 17: the exact step leads for 0.3 s (lead_in), so"),
        (leaning(auto, "fallback = 1\n"), "line 18: invalid type"),
        (leaning(auto, "burn = 1\n"), "line 18: unknown field `burn`"),
        (leaning(auto, "").replace("weights = \"a.weights\"", ""), "line 16: missing field `weights`"),
        (leaning(auto, "").replace("a.weights", "no.weights"), "line 17: ./no.weights: cannot be read"),
        (
            leaning(auto, "").replace("a.weights", "wide.weights"),
            "line 17: ./wide.weights: a network of 8 inputs and 3 outputs; the learned step needs 7 and 3",
        ),
        (leaning(auto, "").replace("a.weights", "damaged.weights"), "line 17: ./damaged.weights: version "),
    ];
    for (scene, fragment) in cases {
        let said = desk.simulate(&scene, &[]);
        print!("{}", said.err);
        assert_eq!(said.code, 2, "expected a complaint with \"{fragment}\" of:\n{scene}\n{}", said.err);
        let heard = said.err.replace("./", "");
        assert!(heard.contains(&fragment.replace("./", "")), "\"{fragment}\" is not in: {}", said.err);
        assert!(!desk.path("out").exists(), "a refused scene left a folder behind");
    }
}

#[test]
fn table_and_key_may_have_their_former_names() {
    let desk = Desk::new();
    desk.network("a.weights", &stopping());
    let scene = leaning("step = 5e-4\nend = 0.02\n", "lead_in = 0.01\n");
    let former = scene.replace("[learned]", "[surrogate]").replace("lead_in", "burn_in");
    let (now, said) = (desk.simulate(&scene, &[]), desk.simulate(&former, &["--force"]));
    println!("{}", said.err);
    assert_eq!((said.code, said.err), (0, now.err));
    assert_eq!(desk.summary()["learned"]["steps"], 2);

    let said = desk.simulate(&format!("{former}[learned]\nweights = \"a.weights\"\n"), &["--force"]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("duplicate field `learned`"), "{}", said.err);
}

#[test]
fn inspect_tells_what_a_learned_step_costs() {
    let desk = Desk::new();
    desk.network("a.weights", &stopping());
    desk.write("scene.toml", &leaning("step = \"auto\"\nend = 0.4\n", ""));
    let said = desk.supple(&["inspect", "scene.toml"]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    for part in
        ["learned step", "a.weights", "5.000e-3 s, 10.0 times", "21 multiply-adds per vertex", "times real time"]
    {
        assert!(said.out.contains(part), "{part}: {}", said.out);
    }
}
