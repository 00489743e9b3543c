//! An evaluation from plan to files.

use supple_lab::evaluate::{self, Plan};
use supple_lab::method::Method;
use supple_lab::{MULTIPLES, sweep};

const HEAD: &str = "scene,method,multiple,mean_mm,sd_mm,max_mm,mean_over_time_mm,hold_mm,skill,clip_share,\
                    us_per_step,us_per_simulated_second,step_over_limit_rest,step_over_limit_trajectory,status,\
                    hold_at_end_mm";

#[test]
fn a_table_says_how_far_off_methods_are_and_what_they_cost() {
    // A tenth of a second, in which the load has hardly begun.
    let mut plan = Plan::new(&["cylinder".into()], &[], &[100], Some("cylinder")).unwrap();
    plan.scenes[0].0.intervals = 4;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut said = Vec::new();
    let evaluation = evaluate::evaluate(&plan, &out, |words| said.push(words.to_string())).unwrap();
    assert!(said[0].starts_with("cylinder: truth moves by "), "{said:?}");
    assert!(said[0].contains("stable below 3.796e-4 s at rest"), "{said:?}");

    let text = std::fs::read_to_string(out.join("results.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(HEAD));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let row = |method: &str, multiple: &str| {
        rows.iter().find(|row| row[1] == method && row[2] == multiple).unwrap().as_slice()
    };
    let number = |text: &str| text.parse::<f64>().unwrap();

    let exact = row("tled", "1");
    assert_eq!((exact[3], exact[6], exact[8], exact[14]), ("0.000000", "0.000000", "1.000000", "ok"));
    assert!(number(exact[10]) > 0.0);
    assert!((number(exact[11]) * 3e-5 / number(exact[10]) - 1.0).abs() < 1e-3, "{exact:?}");
    assert!((number(exact[12]) * 3.796e-4 / 3e-5 - 1.0).abs() < 1e-3, "{exact:?}");

    let hold = row("hold", "1");
    assert_eq!((hold[6], hold[8]), (hold[7], "0.000000"));
    assert!((number(hold[3]) - 0.0716).abs() < 0.001, "{hold:?}");

    // Ten of the exact steps are within the limit, twenty are not.
    let long = row("tled-large-step", "10");
    assert!(number(long[12]) < 1.0 && number(long[8]) > 0.99, "{long:?}");
    let longer = row("tled-large-step", "100");
    assert!(longer[14].starts_with("diverged at 0."), "{longer:?}");
    assert!([3, 4, 5, 6, 8, 9, 10, 11].iter().all(|&column| longer[column].is_empty()), "{longer:?}");

    // The last shape is what the error at the end was measured on.
    let (_, truth) = &evaluation.scenes[0];
    let exact_run = evaluation.rows.iter().find(|row| row.method == Method::Tled).unwrap();
    assert_eq!(Some(&exact_run.shape), truth.snapshots.last());
    let curves = sweep::curves(&evaluation.rows, "cylinder");
    let formula = curves.iter().find(|curve| curve.name == "tled-large-step").unwrap();
    assert!(formula.slope().is_some() && !formula.diverged.is_empty(), "{formula:?}");
}

fn plan(scenes: &[&str], multiples: &[u32], sweep: Option<&str>) -> Vec<(&'static str, Vec<u32>)> {
    let scenes: Vec<String> = scenes.iter().copied().map(String::from).collect();
    let plan = Plan::new(&scenes, &[], multiples, sweep).unwrap();
    plan.scenes.into_iter().map(|(spec, multiples)| (spec.name, multiples)).collect()
}

#[test]
fn nothing_asked_means_everything() {
    let plan = plan(&[], &[], None);
    assert_eq!(plan.len(), 34);
    assert_eq!(plan[0], ("torsion", MULTIPLES.to_vec()));
    assert_eq!(plan[1], ("reversed", sweep::MULTIPLES.to_vec()));
}

#[test]
fn what_is_asked_twice_is_done_once_and_a_sweep_brings_its_scene() {
    let wanted = [("lobe", [10].to_vec()), ("push", sweep::MULTIPLES.to_vec())];
    assert_eq!(plan(&["lobe", "lobe"], &[10, 10], Some("push")), wanted);
    assert_eq!(plan(&["lobe"], &[10], None), wanted[..1]);
}
