//! Hard cases and random scenes.

use supple::lab::hard::{cases, random};

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
}
