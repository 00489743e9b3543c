//! Hard cases and random scenes.

use std::path::Path;

use supple_lab::hard::verdict::{Judged, Kind, Verdict};
use supple_lab::hard::{Counts, Plan, cases, evaluate, ordinary, press, random, report};
use supple_lab::method::Method;

#[test]
fn every_case_has_its_name_and_can_be_built() {
    for name in cases::names() {
        let spec = cases::named(name).unwrap();
        assert_eq!(spec.name, name);
        assert!(spec.intervals > 1 && spec.tets.len() > 30, "{name}");
    }
    let said = cases::named("nothing").unwrap_err().to_string();
    assert!(said.starts_with("case \"nothing\" is not known; there are sudden-load,"), "{said}");
}

#[test]
fn a_number_gives_one_scene_and_scenes_can_be_built() {
    for number in 0..20 {
        let spec = random::scene(number, 0).unwrap();
        assert_eq!(spec, random::scene(number, 0).unwrap());
        assert!(spec.points.len() > 20 && spec.timing.interval >= 100, "{number}");
    }
    assert_ne!(random::scene(0, 0).unwrap().points, random::scene(0, 1).unwrap().points);
    let mut free = 0;
    for number in 0..20 {
        let spec = press::scene(number, 0).unwrap();
        assert_eq!(spec, press::scene(number, 0).unwrap());
        assert!(spec.instrument.is_some(), "{number}");
        free += u32::from(spec.supports.is_empty());
    }
    assert!((5..=15).contains(&free), "{free} of 20 bodies are free");
}

#[test]
fn ordinary_scenes_are_held_by_a_face_and_one_of_each_kind_follows_the_other() {
    let mut kinds = vec![];
    for number in 0..6 {
        let spec = ordinary::scene(number, 0).unwrap();
        assert_eq!(spec, ordinary::scene(number, 0).unwrap());
        kinds.push(spec.name.split('-').next().unwrap());
        let (nodes, held) = (spec.points.len(), spec.supports.len());
        assert!(held > 10 && held < nodes / 3 && (2_000..9_000).contains(&spec.tets.len()), "{}", spec.name);
        let loads = [spec.gravity != [0.0; 3], !spec.forces.is_empty(), !spec.motions.is_empty()];
        assert!(loads.contains(&true) || spec.instrument.is_some(), "{}", spec.name);
        assert!((0.7..1.6).contains(&spec.duration()), "{}", spec.name);
    }
    assert_eq!(kinds, ["hang", "push", "pull", "breathe", "table", "instrument"]);
}

/// Two of them; `supple-lab hard` judges all.
#[test]
fn long_steps_are_right_in_ordinary_scenes_and_seldom_doubted() {
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan {
        cases: vec![],
        counts: Counts { ordinary: 2, ..Counts::default() },
        methods: vec![Method::Long],
        every: 3,
    };
    let judged = evaluate(&plan, folder.path(), |_| ()).unwrap();
    print!("{}", report::text(&judged));
    assert_eq!(judged.len(), 4);
    for run in &judged {
        let doubted = run.doubted();
        assert_eq!(
            (run.kind, run.verdict(), doubted.limited),
            (Kind::Ordinary, Verdict::Right, 0),
            "{}",
            run.row.scene
        );
        // A millimetre is above what is never wrong: a frozen body would not be right.
        assert!(run.motion() > 1.0 && run.worst().unwrap().mean < 0.3 * run.motion(), "{}", run.motion());
        assert!(doubted.good > 5 && 2 * doubted.inexact < doubted.good, "{doubted:?}");
    }
    let table = std::fs::read_to_string(folder.path().join("hard.csv")).unwrap();
    assert_eq!(table.matches(",ordinary,long,").count(), 4);
}

/// A step that knows of no instrument is left out where one presses.
#[cfg(feature = "slow-tests")]
#[test]
fn an_instrument_presses_in_long_steps_and_others_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let methods = vec![Method::BackwardEuler, Method::Long];
    let press = ordinary::scene(5, 0).unwrap();
    assert_eq!(press.name, "instrument-00");
    let plan = Plan { cases: vec![press], counts: Counts::default(), methods, every: 3 };
    let judged = evaluate(&plan, folder.path(), |_| ()).unwrap();
    assert!(!judged.is_empty() && judged.iter().all(|run| run.row.method == Method::Long));
    assert!(judged.iter().all(|run| run.motion() > 0.3 && run.verdict() == Verdict::Right));
}

#[test]
fn a_mesh_of_the_users_is_scaled_and_pulled_by_a_tenth_of_its_weight() {
    let lobe = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../meshes/lobe.msh"));
    let pull = |scale| {
        let spec = cases::of_mesh(lobe, scale).unwrap();
        let held = spec.supports.len();
        assert!(held > 10 && held < spec.points.len() / 4, "{held} nodes are held");
        spec.forces.iter().map(|force| force.newton.iter().sum::<f32>()).sum::<f32>()
    };
    // The lobe has 288.6 ml.
    assert!((pull(1.0) / (0.1 * 9.81 * 0.2886) - 1.0).abs() < 1e-3);
    assert!((pull(0.5) / pull(1.0) - 0.125).abs() < 1e-5);
}

#[test]
fn long_cases_are_judged_only_if_they_are_named() {
    let names = |named: &[&str], mesh| {
        let named: Vec<String> = named.iter().map(ToString::to_string).collect();
        let plan = Plan::new(&named, mesh, &[], Counts::default(), 3).unwrap();
        plan.cases.iter().map(|case| case.name).collect::<Vec<_>>()
    };
    let lobe = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../meshes/lobe.msh"));
    let all = names(&[], None);
    assert!(all.contains(&"fades-to-nothing") && cases::LONG.iter().all(|long| !all.contains(long)));
    assert_eq!(names(&["million-steps"], None), ["million-steps"]);
    assert_eq!(names(&[], Some((lobe, 1.0))), ["mesh"]);
    assert_eq!(names(&["coarse"], Some((lobe, 1.0))), ["coarse", "mesh"]);
}

#[test]
fn exact_steps_beyond_the_critical_one_tell_and_switching_steps_follow() {
    let folder = tempfile::tempdir().unwrap();
    let methods = [Method::TledLargeStep, Method::Long, Method::Switching];
    let plan = Plan {
        cases: vec![cases::named("coarse").unwrap()],
        counts: Counts::default(),
        methods: methods.to_vec(),
        every: 3,
    };
    let judged = evaluate(&plan, folder.path(), |_| ()).unwrap();
    let of = |method| judged.iter().filter(move |run: &&Judged| run.row.method == method).collect::<Vec<_>>();

    let [below, _, beyond] = of(Method::TledLargeStep)[..] else { panic!() };
    assert_eq!((below.verdict(), below.told_from()), (Verdict::Right, None));
    assert_eq!(beyond.verdict(), Verdict::Told);
    assert!(beyond.row.step_over_limit_rest > 1.1 && beyond.told_from().is_some(), "{:?}", beyond.row);

    // At the shortest of the steps.
    let error = |method| of(method)[0].worst().unwrap().mean;
    let [fixed, switching] = [Method::Long, Method::Switching].map(error);
    let motion = of(Method::Long)[0].motion();
    assert!(switching != fixed && switching < 0.15 * motion, "{switching}, {fixed} of {motion} mm");
}
