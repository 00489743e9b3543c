extern crate std;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::mesh::{Bar, Winding};
use crate::state::VecState;

const BAR: Bar = Bar { size: [0.02, 0.03, 0.05], cells: [3, 4, 6] };

fn with_bar<R>(look: impl FnOnce(&Mesh<'_>) -> R) -> R {
    let (points, tets): (Vec<_>, Vec<_>) = (BAR.points().collect(), BAR.tets().collect());
    look(&Mesh::new(&points, &tets, Winding::Checked).unwrap())
}

/// A state displaced by an affine map whose last increment is another.
fn affine(points: &[[f32; 3]], seconds: f32) -> VecState {
    let mut state = VecState::at_rest(points.len());
    let at = |node: usize| {
        let [x, y, z] = points[node];
        [[0.1 * y + 0.003, 0.2 * x - 0.1 * z, 0.05 * z - 0.001], [seconds * y, seconds * 0.5, seconds * (x - z)]]
    };
    state.view().put(1.0, seconds, at);
    state
}

proptest! {
    /// Inside, linear functions carry an affine motion exactly; outside, the point of the box that is nearest is known.
    #[test]
    fn points_follow_an_affine_motion(places in proptest::collection::vec(proptest::array::uniform3(-0.03f32..0.08), 1..50)) {
        with_bar(|mesh| {
            let mut located = VecPoints::locate(mesh, &places).unwrap();
            let mut state = affine(mesh.points(), 1e-3);
            located.follow(&mut state).unwrap();
            for (index, place) in places.iter().enumerate() {
                let point = located.points()[index];
                let near: [f32; 3] = std::array::from_fn(|axis| place[axis].clamp(0.0, BAR.size[axis]));
                let off: [f32; 3] = std::array::from_fn(|axis| place[axis] - near[axis]);
                let distance = off.map(|way| way * way).iter().sum::<f32>().sqrt();
                prop_assert!((point.distance - distance).abs() < 1e-7, "{point:?}, {distance} m");
                prop_assert!(point.weights.iter().all(|weight| (0.0..=1.0).contains(weight)));
                let [x, y, z] = near;
                let expected = [
                    place[0] + 0.1 * y + 0.003, place[1] + 0.2 * x - 0.1 * z, place[2] + 0.05 * z - 0.001,
                ];
                for axis in 0..3 {
                    prop_assert!((located.positions()[index][axis] - expected[axis]).abs() < 1e-7);
                    prop_assert!((located.velocities()[index][axis] - [y, 0.5, x - z][axis]).abs() < 1e-5);
                }
            }
            Ok(())
        })?;
    }

    /// The tree finds what a look at every element finds.
    #[test]
    fn no_element_is_nearer(place in proptest::array::uniform3(-0.1f32..0.15)) {
        with_bar(|mesh| {
            let found = VecPoints::locate(mesh, &[place]).unwrap().points()[0];
            let wide = glam::DVec3::from(place.map(f64::from));
            let all = (0..mesh.element_count() as u32)
                .filter_map(|element| {
                    let corners = mesh.corners(mesh.given(element));
                    let inside = nearest::within(corners, wide).map(|weights| (weights, 0.0));
                    inside.or_else(|| nearest::of_tetrahedron(corners, wide, f64::INFINITY))
                });
            let least = all.fold(f64::INFINITY, |least, (_, squared)| least.min(squared)).sqrt();
            prop_assert!((f64::from(found.distance) - least).abs() < 1e-8, "{found:?}, {least}");
            Ok(())
        })?;
    }
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    with_bar(|mesh| {
        let words = |error: PointError| std::format!("{error}");
        let refused = VecPoints::locate(mesh, &[[0.0; 3], [0.0, f32::NAN, 0.0]]).unwrap_err();
        assert_eq!(
            words(refused),
            "point 1: number 1 is NaN, it must be finite, a weight from 0 to 1: leave the point out"
        );
        let mut points = [FollowedPoint::default(); 1];
        let needed = words_for(mesh.element_count());
        let short = locate(mesh, &[[0.0; 3]], &mut std::vec![0; needed - 1], &mut points);
        assert_eq!(short, Err(PointError::Capacity { needed, capacity: needed - 1 }));
        assert!(locate(mesh, &[[0.0; 3]; 2], &mut std::vec![0; needed], &mut points).is_err());
        assert_eq!(points, [FollowedPoint::default()]);

        let mut state = VecState::at_rest(mesh.points().len());
        let (mut positions, mut velocities) = ([[7.0; 3]], [[7.0; 3]]);
        for wrong in [
            FollowedPoint { nodes: [0, 1, 2, u32::MAX], ..FollowedPoint::default() },
            FollowedPoint { weights: [f32::INFINITY; 4], ..FollowedPoint::default() },
            FollowedPoint { rest: [0.0, 0.0, f32::NAN], ..FollowedPoint::default() },
        ] {
            assert!(follow(&[wrong], &mut state, &mut positions, &mut velocities).is_err());
        }
        assert_eq!(positions, [[7.0; 3]]);
        assert!(follow(&points, &mut state, &mut positions, &mut []).is_err());
    });
}

/// Places as far away as float32 goes, and meshes of one element.
#[test]
fn far_places_have_finite_answers() {
    let points = [[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]];
    for tets in [[[0, 1, 2, 3]], [[0, 2, 1, 3]]] {
        let mesh = Mesh::new(&points, &tets, Winding::Normalised).unwrap();
        let places = [[f32::MAX; 3], [f32::MIN; 3], [-1e30, 0.0, 1e-30], [0.002; 3], [0.01, 0.01, 0.0]];
        let located = VecPoints::locate(&mesh, &places).unwrap();
        for point in located.points() {
            assert!(point.distance.is_finite() && point.weights.iter().all(|weight| weight.is_finite()), "{point:?}");
        }
        assert_eq!(located.points()[3].distance, 0.0);
        assert!((located.points()[4].distance - 0.5f32.sqrt() * 0.01).abs() < 1e-8);
    }
}
