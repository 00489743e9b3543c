extern crate std;
use std::vec;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::mesh::{Bar, Winding};
use crate::simd::NodeVector;

const BAR: Bar = Bar { size: [0.02, 0.03, 0.04], cells: [3, 4, 5] };

/// Turned by an eighth around z and by some around x; 1.1, 1.3 and 2.5 mm.
fn oblique() -> ImageGrid {
    let turn = glam::DMat3::from_rotation_z(0.4) * glam::DMat3::from_rotation_x(-0.3);
    let rows = turn.transpose().to_cols_array_2d();
    ImageGrid {
        origin: [-0.012, -0.015, -0.013],
        spacing: [1.1e-3, 1.3e-3, 2.5e-3],
        size: [40, 45, 27],
        direction: rows,
    }
}

fn vector_of([x, y, z]: [f32; 3]) -> NodeVector {
    NodeVector([x, y, z, 0.0])
}

fn bar() -> (Vec<[f32; 3]>, Vec<[u32; 4]>) {
    (BAR.points().collect(), BAR.tets().collect())
}

/// Runs on the field and how many of its points are in the tissue.
fn field(kind: FieldKind, grid: ImageGrid, reach: f32, displacements: &[NodeVector]) -> (Vec<[f32; 3]>, usize) {
    let (points, tets) = bar();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let mut made = VecField::new(kind, grid, reach).unwrap();
    let covered = made.compute(&mesh, displacements).unwrap();
    (made.values().to_vec(), covered)
}

fn places(grid: &ImageGrid) -> impl Iterator<Item = glam::DVec3> {
    let [nx, ny, nz] = grid.size;
    let grid = *grid;
    (0..nz)
        .flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| grid.place([x, y, z].map(f64::from)).into())))
}

/// `F X + t - X` of an affine motion, and of its inverse `G (y - t) - y`.
fn affine() -> (glam::DMat3, glam::DVec3) {
    let stretch = glam::DMat3::from_cols_array_2d(&[[1.1, 0.05, -0.2], [0.1, 0.9, 0.0], [0.0, 0.15, 1.2]]);
    (stretch, glam::DVec3::new(0.004, -0.003, 0.002))
}

fn moved(motion: impl Fn(glam::DVec3) -> glam::DVec3) -> Vec<NodeVector> {
    let vector = |point: [f32; 3]| vector_of(motion(glam::DVec3::from(point.map(f64::from))).as_vec3().to_array());
    BAR.points().map(vector).collect()
}

#[test]
fn an_affine_motion_is_exact_within_the_tissue() {
    let (stretch, shift) = affine();
    let displacements = moved(|point| stretch * point + shift - point);
    let is_inside = |point: glam::DVec3, most: f64| {
        let near = point.clamp(glam::DVec3::ZERO, glam::DVec3::from(BAR.size.map(f64::from)));
        near.distance(point) <= most
    };
    for (kind, grid) in [
        (FieldKind::Forward, oblique()),
        (FieldKind::Inverse, oblique()),
        (
            FieldKind::Inverse,
            ImageGrid {
                direction: [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                origin: [0.04, -0.01, -0.01],
                ..oblique()
            },
        ),
    ] {
        let (values, covered) = field(kind, grid, 0.0, &displacements);
        let (mut inside, mut near) = (0, 0);
        for (place, value) in places(&grid).zip(&values) {
            let source = if kind == FieldKind::Forward { place } else { stretch.inverse() * (place - shift) };
            let expected = match kind {
                FieldKind::Forward => stretch * place + shift - place,
                FieldKind::Inverse => source - place,
            };
            near += usize::from(is_inside(source, 1e-7));
            if is_inside(source, 0.0) {
                inside += 1;
                let off = (expected.as_vec3() - glam::Vec3::from(*value)).length();
                assert!(off < 1e-8, "{kind:?} at {place}: {value:?}, off by {off} m");
            }
        }
        assert!(inside > 1000 && (inside..=near).contains(&covered), "{inside} {covered} {near}");
    }
}

/// Beyond the surface nothing is larger than within, and neighbours are alike.
#[test]
fn the_field_goes_on_beyond_the_surface_within_bounds() {
    let bend = |point: glam::DVec3| glam::DVec3::new(8.0 * point.z * point.z, -2.0 * point.z * point.y, 0.003);
    let displacements = moved(bend);
    let grid = oblique();
    let (drawn, covered) = field(FieldKind::Inverse, grid, 0.0, &displacements);
    assert!(covered > 1000);
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for vector in &displacements {
        for axis in 0..3 {
            low[axis] = low[axis].min(-vector.to_array()[axis]);
            high[axis] = high[axis].max(-vector.to_array()[axis]);
        }
    }
    for value in &drawn {
        for axis in 0..3 {
            assert!(value[axis] >= low[axis] - 1e-9 && value[axis] <= high[axis] + 1e-9, "{value:?}");
        }
    }
    // Along x from one point to the next: the tissue's own slope is 0.64 at most, times 3 mm across a cell.
    let steps = drawn.windows(2).enumerate().filter(|(at, _)| (at + 1) % 40 != 0);
    let steps = steps.map(|(_, pair)| (glam::Vec3::from(pair[1]) - glam::Vec3::from(pair[0])).length());
    let mut steps: Vec<_> = steps.collect();
    steps.sort_by(f32::total_cmp);
    let (most, nearly_all) = (steps[steps.len() - 1], steps[steps.len() * 99 / 100]);
    std::println!("from point to point at most {:.2} mm, 99 % below {:.2} mm", 1e3 * most, 1e3 * nearly_all);
    assert!(most < 1.95e-3 && nearly_all < 0.7e-3);
}

#[test]
fn a_reach_ends_the_field() {
    let displacements = moved(|_| glam::DVec3::new(0.0, 0.002, 0.0));
    for (reach, spacing) in [(0.005, 1e-3), (0.02, 1e-3), (0.003, 2e-3)] {
        let grid = ImageGrid::aligned([-0.03; 3], [spacing; 3], [(0.08 / spacing) as u32; 3]);
        let (values, _) = field(FieldKind::Forward, grid, reach, &displacements);
        for (place, value) in places(&grid).zip(&values) {
            let near = place.clamp(glam::DVec3::ZERO, glam::DVec3::from(BAR.size.map(f64::from)));
            let distance = near.distance(place);
            // Distances are between cells of the grid or of an eighth of the reach, whose diagonals are as long.
            let fuzzy = 2.0 * 1.8 * (2.0 * f64::from(reach) / 8.0).max(spacing);
            let kept = |way: f64| (1.0 - (way.max(0.0) / f64::from(reach)).powi(2)).max(0.0).powi(2);
            let (most, least) = (0.002 * kept(distance - fuzzy), 0.002 * kept(distance + fuzzy));
            // Zero to within two cells, and the point of the grid that is drawn beyond the surface.
            let ends = f64::from(reach) + 2.0 * (f64::from(reach) / 8.0).max(spacing) + spacing;
            assert!(value[1] == 0.0 || distance < ends, "{distance} of {reach}");
            let length = f64::from(value[1]);
            assert!(
                length <= most + 1e-8 && length >= least - 1e-8,
                "{place} at {distance}: {length}, {least} to {most}"
            );
            if distance < 1e-6 {
                assert!((length - 0.002).abs() < 1e-9);
            }
        }
    }
}

/// As in computed tomography, with slices far apart.
#[test]
fn a_reach_does_not_fold_space_between_long_voxels() {
    let (moved_by, spacing, size) = (0.02, [0.5e-3, 0.5e-3, 6e-3], [300, 300, 26]);
    let displacements = moved(|_| glam::DVec3::new(moved_by, 0.0, 0.0));
    let grid = ImageGrid::aligned([-0.06, -0.06, -0.05], spacing, size);
    // The least that the module promises.
    let reach = 1.54 * moved_by + 6e-3;
    let (values, _) = field(FieldKind::Forward, grid, reach as f32, &displacements);
    let rows = values.chunks_exact(size[0] as usize);
    let slopes = rows.flat_map(|row| row.windows(2).map(|pair| f64::from(pair[1][0] - pair[0][0]) / spacing[0]));
    let steepest = slopes.fold(0.0, f64::min);
    std::println!("slope {steepest:.2}");
    assert!(steepest > -1.0 && steepest < -0.5);
}

#[test]
fn elements_turned_inside_out_are_left_out() {
    let points = [[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01], [0.0, 0.0, -0.01]];
    let tets = [[0, 1, 2, 3], [0, 2, 1, 4]];
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    // The upper one is pushed through its base, into the lower one.
    let mut displacements = vec![NodeVector::ZERO; 5];
    displacements[3] = vector_of([0.0, 0.0, -0.018]);
    let grid = ImageGrid::aligned([0.0, 0.0, -0.01], [1e-3; 3], [11, 11, 21]);
    let mut made = VecField::new(FieldKind::Inverse, grid, 0.0).unwrap();
    let covered = made.compute(&mesh, &displacements).unwrap();
    assert!(covered > 100 && made.values().iter().all(|value| *value == [0.0; 3]));
    // Overlapping but upright: the last one in the list.
    for node in [3, 0, 1, 2] {
        displacements[node] = vector_of([0.0, 0.0, -0.005]);
    }
    let tets = [[0, 2, 1, 4], [0, 1, 2, 3]];
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    made.compute(&mesh, &displacements).unwrap();
    let at = |x: usize, y: usize, z: usize| made.values()[(z * 11 + y) * 11 + x][2];
    assert!((at(1, 1, 7) - 0.005).abs() < 1e-9, "{}", at(1, 1, 7));
}

#[test]
fn a_grid_without_tissue_is_zero() {
    let displacements = moved(|_| glam::DVec3::splat(0.3));
    let far = ImageGrid::aligned([1.0; 3], [1e-3; 3], [5, 6, 7]);
    let (values, covered) = field(FieldKind::Inverse, far, 0.0, &displacements);
    assert!(covered == 0 && values.iter().all(|value| *value == [0.0; 3]));
}

proptest! {
    /// Grids of any shape, displacements of any size: finite fields within bounds, in the scratch that is stated.
    #[test]
    fn whatever_comes_is_finite(
        size in proptest::array::uniform3(1u32..20),
        spacing in proptest::array::uniform3(1e-4f64..2e-2),
        reach in prop_oneof![Just(0.0f32), 1e-30f32..0.1, Just(1e30f32)],
        scale in prop_oneof![Just(1e-3f32), Just(0.1f32), Just(1e10f32), Just(3.4e38f32)],
        bits in any::<u64>(),
    ) {
        let grid = ImageGrid::aligned([0.0, 0.0, 0.01], spacing, size);
        let words = scratch_for(&grid, reach).unwrap();
        let points = grid.point_count() as usize;
        prop_assert!(words <= 6 * points + 4 * size[0] as usize + 300, "{words} for {points}");
        let mut number = bits;
        let mut random = || {
            number = number.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((number >> 40) as f32 / (1 << 23) as f32 - 1.0) * scale
        };
        let displacements: Vec<_> = BAR.points().map(|_| vector_of([random(), random(), random()])).collect();
        for kind in [FieldKind::Forward, FieldKind::Inverse] {
            let (values, _) = field(kind, grid, reach, &displacements);
            for value in values.as_flattened() {
                prop_assert!(value.abs() <= scale * 1.000_01, "{value}");
            }
        }
    }
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let grid = oblique();
    let words = |error: FieldError| std::format!("{error}");
    let refused = |grid: ImageGrid| words(scratch_for(&grid, 0.0).unwrap_err());
    assert_eq!(refused(ImageGrid { origin: [0.0, f64::NAN, 0.0], ..grid }), "origin of the grid: component 1 is NaN m");
    assert_eq!(
        refused(ImageGrid { spacing: [1.0, 1.0, 0.0], ..grid }),
        "spacing of the grid along axis 2 is 0 m, it must be a positive number"
    );
    for direction in
        [[[0.0; 3]; 3], [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [[f64::NAN; 3]; 3], [[1e200; 3]; 3]]
    {
        assert!(refused(ImageGrid { direction, ..grid }).ends_with("from orthonormal: resample the image"));
    }
    for size in [[0, 5, 5], [u32::MAX; 3], [1 << 31, 2, 1]] {
        assert!(refused(ImageGrid { size, ..grid }).ends_with("take a coarser one"));
    }
    for reach in [-1.0, f32::NAN, f32::INFINITY] {
        assert!(matches!(scratch_for(&grid, reach), Err(FieldError::Reach { .. })));
    }
    let (points, tets) = bar();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let (mut scratch, mut out) = (vec![0.0; scratch_for(&grid, 0.0).unwrap()], vec![[7.0; 3]; 40 * 45 * 27]);
    let request = (FieldKind::Inverse, &grid, 0.0);
    let bad = |node: usize| [0.0, 0.0, if node == 3 { f32::NAN } else { 0.0 }];
    let refused = displacement_field(&mesh, bad, request, &mut scratch, &mut out).unwrap_err();
    assert_eq!(words(refused), "displacement of node 3: component 2 is NaN");
    let at_rest = |_: usize| [0.0; 3];
    let most = scratch.len() - 1;
    assert!(displacement_field(&mesh, at_rest, request, &mut scratch[..most], &mut out).is_err());
    assert!(displacement_field(&mesh, at_rest, request, &mut scratch, &mut out[1..]).is_err());
    assert!(out.iter().all(|value| *value == [7.0; 3]));
}
