//! Does a scene look as if a unit was mistaken? Sizes, densities, stiffness, gravity and prescribed motions that no tissue and no
//! instrument has are computed all the same, with a remark that names the place and the unit that was probably meant.

use std::ops::RangeInclusive;

use supple::material::Moduli;

use super::body::Body;
use super::file::SceneFile;
use super::tissues::Tissues;

/// Diagonals of bodies, m; densities, kg/m^3; Young's moduli, Pa.
const DIAGONALS: RangeInclusive<f64> = 1e-3..=5.0;
const DENSITIES: RangeInclusive<f32> = 200.0..=10_000.0;
const YOUNG: RangeInclusive<f64> = 20.0..=1e9;
/// m/s^2: a hundred times that of the earth.
const MOST_GRAVITY: f32 = 1e3;
/// Share of the diagonal by which a node may jump in the first step.
const MOST_JUMP: f64 = 0.05;

/// What does not look right.
pub(crate) fn warnings(file: &SceneFile, body: &Body, tissues: &Tissues, gravity: [f32; 3]) -> Vec<String> {
    let scene = &file.scene;
    let mut warnings = vec![];
    let diagonal = body.diagonal();
    if !DIAGONALS.contains(&diagonal) {
        let words = format!(
            "the body is {diagonal:.4} m across; is scale right? (0.001 turns millimetres into metres)"
        );
        warnings.push(file.problem(&scene.mesh, words).to_string());
    }
    for (density, moduli) in tissues.densities().zip(tissues.moduli()) {
        if !DENSITIES.contains(&density) {
            let words =
                format!("a density of {density} kg/m^3; tissue has about 1000 (1 g/cm^3 is 1000 kg/m^3)");
            warnings.push(file.problem(&scene.material, words).to_string());
        }
        let young = moduli.young();
        if !YOUNG.contains(&young) {
            let words = format!(
                "Young's modulus of the tissue is {young:.3e} Pa; soft tissue has 1e3 to 1e5 (1 kPa is 1000 Pa)"
            );
            warnings.push(file.problem(&scene.material, words).to_string());
        }
    }
    let size = length(gravity);
    if size > MOST_GRAVITY.into() {
        warnings.push(format!(
            "{}: gravity is {size:.0} m/s^2, that of the earth is 9.81 (9810 mm/s^2 is 9.81 m/s^2)",
            file.path().display()
        ));
    }
    let waves = slowest_waves(tissues);
    for at in &scene.motion {
        let (way, ramp) = (length(*at.get_ref().metre.get_ref()), at.get_ref().ramp.as_ref());
        let ramp = ramp.map_or(0.0, |ramp| f64::from(*ramp.get_ref()));
        let words = if way > diagonal {
            format!("nodes move by {way} m, the body is {diagonal:.3} m across (1 mm is 0.001 m)")
        } else if ramp == 0.0 && way > MOST_JUMP * diagonal {
            format!("nodes move by {:.1} mm in the first step; with a ramp they take time", 1e3 * way)
        } else if ramp > 0.0 && way / ramp > waves {
            format!(
                "nodes move at {:.2} m/s, faster than shear waves in the softest tissue ({waves:.2} m/s), which cannot follow; \
                 a ramp of {:.3} s is slower",
                way / ramp,
                2.0 * way / waves
            )
        } else {
            continue;
        };
        warnings.push(file.problem(at, words).to_string());
    }
    warnings
}

fn length(vector: [f32; 3]) -> f64 {
    vector.into_iter().map(|component| f64::from(component).powi(2)).sum::<f64>().sqrt()
}

/// The least speed of shear waves at rest, m/s.
fn slowest_waves(tissues: &Tissues) -> f64 {
    let speed = |(density, Moduli { shear, .. }): (f32, Moduli)| (shear / f64::from(density)).sqrt();
    tissues.densities().zip(tissues.moduli()).map(speed).fold(f64::INFINITY, f64::min)
}
