//! Training: the same recipe gives the same weights, a training that was stopped goes on as if it had not been, the
//! data set is the exact motion, and a recipe that cannot be used says why.

#[path = "support/hostile.rs"]
mod hostile;
#[path = "hostile/recipes.rs"]
mod recipes;

#[global_allocator]
static ALLOCATOR: hostile::Counting = hostile::Counting;

use core::ops::ControlFlow;

use supple::material::Element;
use supple::mlp::{Network, WeightBytes};
use supple::scene::Support;
use supple::train::TrainError;
use supple::train::fit::{Fitted, fit};
use supple::train::recipe::Recipe;
use supple::train::samples::Samples;
use supple_lab::scenes::{SceneSpec, named};
use supple_lab::timing::Timing;
use supple_lab::training;

const RECIPE: &str = r#"
seed = 3
multiple = 10

[motion]
scene = "torsion"
load = 0.02
from = 0.03
to = 0.06
frames = 20

[network]
hidden = [12, 8]
correction = [6]
slope = 0.01

[training]
epochs = 4
batch = 512
rate = 0.003
decay = "cosine"
held_out = 0.2
"#;

fn samples() -> (Recipe, SceneSpec, Samples) {
    let recipe = Recipe::parse(RECIPE).unwrap();
    let scene = training::scene(&recipe.motion[0]).unwrap();
    let samples = Samples::collect(&recipe, &[&scene]).unwrap();
    (recipe, scene, samples)
}

#[test]
fn a_training_that_was_stopped_goes_on_as_if_it_had_not_been() {
    let (recipe, scene, samples) = samples();
    let mut losses = Vec::new();
    let whole = fit(&recipe, RECIPE, &scene, &samples, None, &mut |at| {
        if at.done == at.samples {
            losses.push(at.loss);
        }
        ControlFlow::Continue(())
    })
    .unwrap();
    println!("loss {losses:.3?}, held out {:.3?}", whole.held_out.unwrap());
    assert!(losses.last().unwrap() < &(0.9 * losses[0]));

    let folder = tempfile::tempdir().unwrap();
    for epochs in [1, 3] {
        // Killed in the middle of an epoch.
        let stopped = fit(&recipe, RECIPE, &scene, &samples, Some(folder.path()), &mut |at| {
            if at.epoch == epochs && at.done > 2_000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert!(matches!(stopped, Err(TrainError::Stopped { epoch }) if epoch == epochs), "{stopped:?}");
    }
    let mut first = None;
    let resumed = fit(&recipe, RECIPE, &scene, &samples, Some(folder.path()), &mut |at| {
        first = first.or(Some(at.epoch));
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(first, Some(3));
    assert!(whole.bytes == resumed.bytes, "other weights");

    let other = RECIPE.replace("seed = 3", "seed = 4");
    let refused = fit(&Recipe::parse(&other).unwrap(), &other, &scene, &samples, Some(folder.path()), &mut |_| {
        ControlFlow::Continue(())
    });
    let said = refused.unwrap_err().to_string();
    println!("{said}");
    assert!(said.ends_with("a checkpoint of another recipe; remove it to train anew"), "{said}");
}

#[test]
fn weights_say_where_they_come_from() {
    let (recipe, scene, samples) = samples();
    let fitted = fit(&recipe, RECIPE, &scene, &samples, None, &mut |_| ControlFlow::Continue(()));
    let Fitted { bytes, samples, .. } = fitted.unwrap();
    let mut words = vec![0u32; bytes.len().div_ceil(4)];
    bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(&bytes);
    let network = Network::parse(bytemuck::cast_slice(&words)).unwrap();
    assert_eq!(network.recipe().text, RECIPE);
    assert_eq!((network.recipe().step, network.recipe().damping), (10.0 * 3e-5, 20.0));
    assert_eq!(network.multiply_adds(), 7 * 12 + 12 * 8 + 8 * 3 + 10 * 6 + 6 * 3);
    assert!(samples > 1_000);
    for range in network.inputs().iter().chain(network.outputs()) {
        assert!(range.least < range.most && range.scale < range.most - range.least, "{range:?}");
    }
}

/// A scene of a user's own, with steps of its own: the weights are for these, and for its tissue and tetrahedra.
#[test]
fn a_network_learns_from_any_scene_at_its_own_step() {
    let text = RECIPE.replace("\"torsion\"", "\"organ.toml\"").replace("load = 0.02", "load = 0.5");
    let recipe = Recipe::parse(&text).unwrap();
    assert!(recipe.motion[0].is_file());
    let bar = named("stretch").unwrap();
    let timing = Timing { step: 5e-5, ..Timing::PAPER };
    let own = SceneSpec { element: Element::NodalPressure, damping: 7.0, density: 1_100.0, timing, ..bar };
    let scene = own.with_load(recipe.motion[0].load);
    let samples = Samples::collect(&recipe, &[&scene]).unwrap();
    assert_eq!(samples.inputs.len(), 20 * samples.vertices);
    let Fitted { bytes, .. } = fit(&recipe, &text, &scene, &samples, None, &mut |_| ControlFlow::Continue(())).unwrap();
    let memory = WeightBytes::of(&bytes);
    let network = Network::parse(memory.bytes()).unwrap();
    let facts = network.recipe();
    assert_eq!((facts.step, facts.exact_step, facts.damping, facts.density), (10.0 * 5e-5, 5e-5, 7.0, 1_100.0));
    assert_eq!(facts.element, Element::NodalPressure);

    // It has moved.
    let mean = |values: &dyn Fn(usize) -> f32| {
        (0..samples.inputs.len()).map(|row| f64::from(values(row)).abs()).sum::<f64>() / samples.inputs.len() as f64
    };
    let (speed, acceleration) = (mean(&|row| samples.inputs[row][3]), mean(&|row| samples.targets[row][0]));
    println!("mean speed {speed:.2e} m/s, mean acceleration along it {acceleration:.2e} m/s^2");
    assert!(speed > 1e-4 && acceleration > 1e-3);
}

#[test]
fn frames_are_spread_over_the_motion_at_every_step() {
    for multiple in [10, 20, 100] {
        let text = RECIPE.replace("multiple = 10", &format!("multiple = {multiple}"));
        let recipe = Recipe::parse(&text).unwrap();
        let samples = Samples::collect(&recipe, &[&training::scene(&recipe.motion[0]).unwrap()]).unwrap();
        assert_eq!(samples.inputs.len(), 20 * samples.vertices);
        assert_eq!(samples.targets.len(), samples.inputs.len());
        // The speed is that of the motion: it grows with the load, which is on a ramp.
        let speed = |frame: usize| {
            let rows = &samples.inputs[frame * samples.vertices..][..samples.vertices];
            rows.iter().map(|row| f64::from(row[3])).sum::<f64>() / samples.vertices as f64
        };
        println!("{multiple}: {:.2e} to {:.2e} m/s", speed(0), speed(19));
        assert!(speed(19) > speed(0));
        // Accelerations of the body are of the size of what drives it.
        let (_, targets) = samples.ranges();
        assert!(targets.iter().all(|range| range.scale < 5.0), "{targets:?}");
    }
}

/// Over the mass of its vertex the force says what the exact step does: `a = f / m - mu v`, whatever the vertex weighs.
#[test]
fn force_over_mass_is_the_acceleration_and_what_damping_takes() {
    let text = RECIPE.replace("slope = 0.01", "slope = 0.01\nforce = \"per-mass\"");
    let (newton, per_mass) = (collected(RECIPE), collected(&text));
    assert_eq!(newton.targets, per_mass.targets);
    let (mut off, mut of, mut masses) = (0.0, 0.0, Vec::new());
    for ((newton, per_mass), target) in newton.inputs.iter().zip(&per_mass.inputs).zip(&per_mass.targets) {
        assert_eq!(newton[..4], per_mass[..4]);
        let largest = (4..7).max_by(|&a, &b| newton[a].abs().total_cmp(&newton[b].abs())).unwrap();
        masses.push(newton[largest] / per_mass[largest]);
        for axis in 0..3 {
            let damping = if axis == 0 { 20.0 * per_mass[3] } else { 0.0 };
            let exact = per_mass[4 + axis] - damping;
            off += f64::from(target[axis] - exact).powi(2);
            of += f64::from(target[axis]).powi(2);
        }
    }
    masses.sort_by(f32::total_cmp);
    let (least, most) = (masses[0], masses[masses.len() - 1]);
    println!("masses {least:.2e} to {most:.2e} kg; {:.3} of the acceleration unexplained", (off / of).sqrt());
    assert!(most / least > 3.0);
    assert!((off / of).sqrt() < 0.1);
    assert!(Recipe::parse(&text.replace("per-mass", "pound")).unwrap_err().to_string().contains("unknown variant"));
}

#[test]
fn a_recipe_that_cannot_be_used_says_why() {
    let said = |from: &str, to: &str| {
        assert!(RECIPE.contains(from));
        let recipe = Recipe::parse(&RECIPE.replace(from, to));
        let said = recipe.and_then(|recipe| training::scene(&recipe.motion[0])).unwrap_err().to_string();
        println!("{said}");
        said
    };
    assert!(said("\"torsion\"", "\"torsoin\"").starts_with("scene = \"torsoin\": there are torsion,"));
    assert_eq!(said("multiple = 10", "multiple = 0"), "multiple = 0: it must be from 1 to 1000");
    assert_eq!(said("to = 0.06", "to = 0.02"), "from = 0.03 to 0.02: they must rise, from zero to ten seconds");
    assert_eq!(said("load = 0.02", "load = 0.0"), "load = 0: it must be a number other than zero");
    assert_eq!(said("[12, 8]", "[12, 300]"), "a width = 300: it must be from 1 to 256");
    assert_eq!(said("rate = 0.003", "rate = 3.0"), "rate = 3: it must be between 0 and 1");
    assert_eq!(said("held_out = 0.2", "held_out = 1.0"), "held_out = 1: it must be from 0 to 0.9");
    assert!(said("batch = 512", "batsch = 512").contains("unknown field `batsch`"));
}

const NOISE: &str = r#"
[noise]
copies = 2
least = 1e-6
most = 1e-6
back = 1.0
before = 0.5
ease = 1.0

[network]"#;

fn collected(text: &str) -> Samples {
    let recipe = Recipe::parse(text).unwrap();
    Samples::collect(&recipe, &[&training::scene(&recipe.motion[0]).unwrap()]).unwrap()
}

#[test]
fn rough_motion_leads_back_to_the_exact_one() {
    let text = RECIPE.replace("[network]", NOISE);
    let smooth = collected(RECIPE);
    // So little that it is the exact motion itself.
    let still = collected(&text.replace("1e-6", "1e-12"));
    assert_eq!(still.inputs, smooth.inputs);
    assert_eq!(still.rough.targets.len(), 2 * smooth.targets.len());
    assert!(still.rough.weights.iter().all(|&weight| weight > 0.999));
    let (_, scales) = smooth.ranges();
    let frames = still.rough.targets.chunks(2 * smooth.vertices).zip(smooth.targets.chunks(smooth.vertices));
    for (copies, frame) in frames {
        for (rough, exact) in copies.iter().zip(frame.iter().cycle()) {
            for axis in 0..3 {
                assert!((rough[axis] - exact[axis]).abs() < 1e-2 * scales[axis].scale, "{rough:?} {exact:?}");
            }
        }
    }
    // A micrometre: the step takes it back, 1.5 times with what it does to the velocity, and the forces are those of
    // the moved body, many times those of the smooth motion.
    let rough = collected(&text).rough;
    let square = |rows: &[[f32; 3]]| {
        rows.iter().flatten().map(|&value| f64::from(value).powi(2)).sum::<f64>() / (3 * rows.len()) as f64
    };
    let (added, long) = (square(&rough.targets) - square(&smooth.targets), 3e-4f64);
    let expected = (1.5f64.powi(2) + 0.5f64.powi(2)) * (1e-6 / (long * long)).powi(2);
    println!("{:.2} of what is expected", added / expected);
    assert!((added / expected - 1.0).abs() < 0.02);
    let force = |rows: &[[f32; 7]]| rows.iter().map(|row| f64::from(row[4]).abs()).sum::<f64>();
    assert!(force(&rough.inputs) > 10.0 * force(&smooth.inputs));
    let taken = (1.5f64.powi(2) + 0.5f64.powi(2)).sqrt() * 1e-6 / (long * long);
    assert!(rough.weights.iter().all(|&weight| (f64::from(weight) * (1.0 + taken * taken) - 1.0).abs() < 1e-4));
    assert!(rough == collected(&text).rough, "the same recipe, other noise");

    for (from, to) in [("copies = 2", "copies = 0"), ("most = 1e-6", "most = 1e-7"), ("ease = 1.0", "ease = 0.0")] {
        let said = Recipe::parse(&text.replace(from, to)).unwrap_err().to_string();
        assert!(said.starts_with("noise = "), "{said}");
    }
}

/// In place of one motion a recipe may have several, of one body and tissue: their frames in the order of the recipe.
#[test]
fn a_network_learns_from_several_motions() {
    let first = RECIPE.replace("[motion]", "[[motion]]");
    let (table, rest) = first.split_once("[network]").unwrap();
    let second = &table[table.find("[[motion]]").unwrap()..];
    let several = |scene: &str| {
        let second = second.replace("\"torsion\"", scene).replace("load = 0.02", "load = 1.0");
        let recipe = Recipe::parse(&format!("{table}{second}[network]{rest}")).unwrap();
        let scenes = recipe.motion.iter().map(|motion| training::scene(motion).unwrap()).collect::<Vec<_>>();
        Samples::collect(&recipe, &[&scenes[0], &scenes[1]])
    };
    let (one, both) = (collected(RECIPE), several("\"stretch\"").unwrap());
    assert_eq!(one, collected(&first));
    assert_eq!((both.vertices, both.inputs.len()), (one.vertices, 2 * one.inputs.len()));
    assert_eq!(both.of_frames(|frame| frame < 20), one);
    assert!(both.of_frames(|frame| frame >= 20).inputs != one.inputs);
    // Damped otherwise.
    let said = several("\"sudden-torsion\"").unwrap_err().to_string();
    println!("{said}");
    assert!(said.starts_with("scene = \"sudden-torsion\": tissue, tetrahedra, damping, step or vertices are not"));
    let said = Recipe::parse(&first.replace("to =", "too =")).unwrap_err().to_string();
    assert!(said.contains("unknown field `too`"), "{said}");
}

#[test]
fn turned_normals_change_no_length() {
    let smooth = collected(RECIPE);
    let turned = collected(&RECIPE.replace("frames = 20", "frames = 20\nturned = true"));
    assert_ne!(smooth.inputs, turned.inputs);
    let across = |[a, b]: [f32; 2]| a.hypot(b);
    for (a, b) in smooth.inputs.iter().zip(&turned.inputs) {
        assert_eq!((a[0], a[3], a[4]), (b[0], b[3], b[4]));
        for (a, b) in [(a[1], a[2]), (a[5], a[6])].map(|(x, y)| [x, y]).into_iter().zip([[b[1], b[2]], [b[5], b[6]]]) {
            assert!((across(a) - across(b)).abs() <= 1e-5 * across(a));
        }
    }
}

#[test]
fn vertices_loaded_alone_are_left_out_and_those_of_a_loaded_surface_are_not() {
    let (_, scene, samples) = samples();
    let free = scene.points.len() - scene.supports.len();
    assert_eq!(samples.vertices, free - scene.forces.len(), "four corners of the bar");
    let recipe = Recipe::parse(&RECIPE.replace("torsion", "cylinder")).unwrap();
    let scene = training::scene(&recipe.motion[0]).unwrap();
    let samples = Samples::collect(&recipe, &[&scene]).unwrap();
    assert_eq!(samples.vertices, scene.points.len() - scene.supports.len(), "all of the cylinder is loaded");
}

#[test]
fn a_motion_of_which_every_vertex_is_held_or_loaded_alone_leaves_nothing_to_learn() {
    let recipe = Recipe::parse(RECIPE).unwrap();
    let mut scene = training::scene(&recipe.motion[0]).unwrap();
    let is_loaded = |node: &u32| scene.forces.iter().any(|force| force.node == *node);
    scene.supports = (0..scene.points.len() as u32).filter(|node| !is_loaded(node)).map(Support::fixed).collect();
    let samples = Samples::collect(&recipe, &[&scene]).unwrap();
    let fitted = fit(&recipe, RECIPE, &scene, &samples, None, &mut |_| ControlFlow::Continue(()));
    let said = fitted.unwrap_err().to_string();
    assert!(said.starts_with("scene = \"torsion\": every vertex is held, or loaded alone"), "{said}");
}
