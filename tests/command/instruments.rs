//! Instruments in a scene file: `reactions.csv`, frames, and complaints.

use super::{Desk, bar, names};

/// Rows of `reactions.csv` of one instrument.
fn reactions(desk: &Desk, instrument: f64) -> Vec<[f64; 7]> {
    let text = std::fs::read_to_string(desk.path("out/reactions.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time_s,instrument,fx,fy,fz,contacts,depth_m"));
    let row = |line: &str| -> [f64; 7] {
        let values: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
        values.try_into().unwrap()
    };
    lines.map(row).filter(|row| row[1] == instrument).collect()
}

/// A bar without supports falls onto a table, which carries its weight, whatever steps are taken; a ball that comes
/// down onto it adds its force to that of the table, and leaves.
#[test]
fn a_table_carries_what_lies_on_it_and_what_presses_it() {
    const TABLE: &str = "[[instrument]]\nshape = \"plane\"\nfriction = 0.5\npath = [[0.0, 0.0, 0.0, -0.0002]]\n\
        [[instrument]]\nshape = \"sphere\"\nradius = 0.012\npath = [[0.3, 0.01, 0.01, 0.065], [0.4, 0.01, 0.01, 0.056], [0.7, 0.01, \
        0.01, 0.056], [0.8, 0.01, 0.01, 0.08]]\ngravity = [0.0, 0.0, -9.81]\n";
    let weight = 0.02 * 0.02 * 0.05 * 1000.0 * 9.81;
    for time in
        ["", "method = \"long\"\nstep = \"10x\"\nlattice = [1, 1, 2]\n", "method = \"auto\"\nlattice = [1, 1, 2]\n"]
    {
        let desk = Desk::new();
        let scene = bar(&format!("{TABLE}[time]\nend = 1.0\nframes = 4\n{time}"));
        let said = desk.simulate(&scene.replace("[mesh]\n", "[mesh]\nelement = \"nodal-pressure\"\n"), &[]);
        println!("{}", said.out);
        assert_eq!(said.code, 0, "{}", said.err);
        let (table, ball) = (reactions(&desk, 0.0), reactions(&desk, 1.0));
        let mean = |of: &[[f64; 7]], from: f64, to: f64| {
            let rows: Vec<_> = of.iter().filter(|row| row[0] > from && row[0] <= to).collect();
            rows.iter().map(|row| row[4]).sum::<f64>() / rows.len() as f64
        };
        let alone = [mean(&table, 0.2, 0.3), mean(&table, 0.9, 1.0)];
        let [carried, pressed] = [mean(&table, 0.55, 0.7), mean(&ball, 0.55, 0.7)];
        println!("carries {alone:?} N of {weight:.4} N; {carried:.4} N when pressed with {pressed:.4} N");
        // The bar still swings at the first.
        assert!(alone.into_iter().zip([0.1, 0.02]).all(|(carried, most)| (carried + weight).abs() < most * weight));
        assert!(pressed > 0.02 * weight && (carried + weight + pressed).abs() < 0.03 * weight);
        assert_eq!(ball.last().unwrap()[2..], [0.0; 5]);
        let largest = &desk.summary()["instruments"][1]["largest_force_n"];
        assert!(largest.as_f64().unwrap() >= pressed);
        let files = names(&desk.path("out"));
        assert!(files.contains(&"instruments_0004.vtu".into()) && files.contains(&"reactions.csv".into()));
        let frames = std::fs::read_to_string(desk.path("out/frames.pvd")).unwrap();
        assert!(frames.contains("part=\"1\" file=\"instruments_0002.vtu\""), "{frames}");
    }
}

#[test]
fn instruments_that_cannot_be_are_refused_with_their_line() {
    let sphere = "shape = \"sphere\"\nradius = 0.01\npath = [[0.0, 0.0, 0.0, 0.1]]\n";
    let cases = [
        (sphere.replace("0.01", "-0.01"), "line 13: radius is -0.01, it must be positive"),
        (sphere.replace("radius = 0.01\n", ""), "line 11: a sphere needs a radius, m"),
        (sphere.replace("sphere", "cone"), "line 12: shape \"cone\" is not known"),
        (sphere.replace("[[0.0, 0.0, 0.0, 0.1]]", "[]"), "line 14: the path has no point"),
        (
            sphere.replace("0.1]]", "0.1], [0.0, 1.0, 1.0, 1.0]]"),
            "line 14: the path goes from 0 s to 0 s; times must increase",
        ),
        (sphere.replace("0.1]]", "nan]]"), "line 14: the path holds [0.0, 0.0, 0.0, NaN]"),
        (sphere.replace("path = [[0.0, 0.0, 0.0, 0.1]]\n", ""), "line 11: an instrument needs a path"),
        (format!("{sphere}friction = -1.0\n"), "line 15: friction is -1, it must be zero or more"),
        (format!("{sphere}direction = [0.0, 0.0, 0.0]\n"), "line 15: direction is [0.0, 0.0, 0.0]; it needs a length"),
        (sphere.replace("0.0, 0.0, 0.1]]", "0.01, 0.01, 0.02]]"), "line 11: the axis of this instrument starts inside"),
        (format!("{sphere}length = 0.1\n"), "line 15: a sphere has no use for that size"),
        ("shape = \"field\"\n".into(), "line 11: a field needs the file of a mesh"),
        ("shape = \"field\"\nfile = \"none.msh\"\n".into(), "line 13: none.msh"),
        (
            sphere.repeat(9).replace(
                "path = [[0.0, 0.0, 0.0, 0.1]]\nshape",
                "path = [[0.0, 0.0, 0.0, 0.1]]\n[[instrument]]\nshape",
            ),
            "at most 8 instruments",
        ),
    ];
    for (entry, sentence) in cases {
        let desk = Desk::new();
        let said = desk.simulate(&bar(&format!("[[instrument]]\n{entry}[time]\nend = 0.1\n")), &[]);
        print!("{}", said.err);
        assert_eq!(said.code, 2);
        assert!(said.err.contains(sentence), "{}: {sentence}", said.err);
    }
}

/// A ball that comes and goes within one step.
#[test]
fn steps_that_may_pass_over_a_part_of_a_path_are_warned_of() {
    let desk = Desk::new();
    let ball = "[[instrument]]\nshape = \"sphere\"\nradius = 0.005\n\
                path = [[0.01, 0.01, 0.03, 0.04], [0.012, 0.01, 0.024, 0.04], [0.014, 0.01, 0.03, 0.04]]\n";
    for (time, warns) in [
        ("method = \"long\"\nstep = 0.004\nlattice = [1, 1, 2]\n", true),
        ("method = \"auto\"\nlattice = [1, 1, 2]\n", false),
    ] {
        let said = desk.simulate(&bar(&format!("{ball}[time]\nend = 0.02\n{time}")), &["--force"]);
        println!("{}", said.err);
        assert_eq!(said.code, 0, "{}", said.err);
        let words = "are longer than the part of a path from 0.010 s on, and may pass over it";
        assert_eq!(said.err.contains(words), warns, "{}", said.err);
    }
}

/// Of a plane and of a ball nodes are inside, of a ball above the middle of a face the face is, and held nodes meet no instrument.
#[test]
fn an_instrument_that_starts_inside_is_warned_of_with_its_depth() {
    let desk = Desk::new();
    let plane = |z: f64| format!("shape = \"plane\"\ndirection = [0.0, 0.0, -1.0]\npath = [[0.0, 0.0, 0.0, {z}]]\n");
    let ball = |x: f64, z: f64| format!("shape = \"sphere\"\nradius = 0.008\npath = [[0.0, {x}, {x}, {z}]]\n");
    let capsule = "shape = \"capsule\"\nradius = 0.004\nlength = 0.04\ndirection = [1.0, 0.0, 0.0]\npath = [[0.0, 0.01, 0.005, 0.053]]\n";
    let table = "shape = \"plane\"\npath = [[0.0, 0.0, 0.0, 0.003]]\n";
    for (entry, depth) in [
        (plane(0.049), "1.000"),
        (plane(0.05), ""),
        (ball(0.01, 0.0575), "0.500"),
        (ball(0.01, 0.058), ""),
        (ball(0.005, 0.0575), "0.500"),
        (capsule.into(), "1.000"),
        (table.into(), ""),
    ] {
        for (settle, moves) in
            [("", "the tissue jumps out of it"), ("settle = 1e-3\n", "settle has to move the tissue out of it")]
        {
            let fix = "[[fix]]\nplane = { axis = \"z\", at = 0.0 }\n";
            let scene = bar(&format!("{fix}[[instrument]]\n{entry}[time]\nend = 1e-4\n{settle}"));
            let said = desk.simulate(&scene, &["--force"]);
            print!("{}", said.err);
            assert_eq!(said.code, 0, "{}", said.err);
            let words = format!("line 13: this instrument starts {depth} mm inside the body: {moves}");
            assert_eq!(said.err.contains("mm inside the body"), !depth.is_empty(), "{entry}{}", said.err);
            assert!(depth.is_empty() || said.err.contains(&words), "{words}: {}", said.err);
        }
    }
}
