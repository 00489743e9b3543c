//! A lobe on pulls, with a short and coarse truth and few seeds.

use supple::material::Element;
use supple_lab::pulls::registration::{Truth, follow, start};
use supple_lab::pulls::{Lobe, STIFFNESSES, draw, share};

#[test]
fn tracked_points_lead_nearer_than_a_rigid_fit() {
    let lobe = Lobe::read().unwrap();
    let truth = Truth::of(&lobe, [40, 72], false).unwrap();
    let followed = follow(&lobe, &truth, 20, 1).unwrap();
    println!("{:?} mm, {:.2} ms a frame", followed.errors, share(&followed.times, 0.5));
    assert!(followed.times.len() == 71 && followed.doubted == 0);
    for [model, rigid] in followed.errors {
        assert!(model < 2.0 && model < 0.6 * rigid);
    }
    let begun = start(&lobe, &truth, 20, 0).unwrap();
    println!("{begun:?}");
    assert!(begun.within < begun.steps && begun.steps < 600 && begun.remaining < 0.1);
    assert!(begun.errors[0] < 0.5 * begun.errors[1]);
}

#[test]
fn no_random_pulls_on_patches_are_refused_or_go_astray() {
    let rows = draw(&Lobe::read().unwrap(), 1, |_| ()).unwrap();
    assert_eq!(rows.len(), Element::ALL.len() * (STIFFNESSES.len() + 1));
    for row in rows.iter().filter(|row| row.stiffness.is_some()) {
        assert!(row.refused.is_empty() && row.astray.is_empty(), "{row:?}");
        // Not a body that stands still.
        assert!(row.farthest > 10.0, "{row:?}");
    }
}
