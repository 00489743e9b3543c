//! Does a scene look as if a unit or a number was mistaken? What no tissue and no instrument has is simulated all the
//! same, but remarked upon before the first step: size (m), mass (kg), density (kg/m^3), Young's modulus (Pa),
//! Poisson's ratio, gravity (m/s^2), forces (N), prescribed motions (m and m/s, the latter against `sqrt(mu / rho)`,
//! the speed of shear waves at rest in the softest tissue), supports counted from one, a network that learned
//! another tissue, instruments that pass between the nodes that they can touch, start within the body or stand far away from it,
//! and pulls of held nodes and to far targets.

use core::fmt;
use core::ops::RangeInclusive;

use glam::DVec3;

use crate::contact::{Contact, passes_between};
use crate::element::{Axes, ElementMaterial, ElementTile};
use crate::loads::{Motion, NodalForce};
use crate::material::{AnyLaw, Law, Laws, Material, Moduli, Tissue};
use crate::mesh::faces;
use crate::mlp::Recipe;
use crate::points::within;
use crate::pulls::Pulls;
use crate::scene::SceneView;

/// Diagonals of bodies, m.
const DIAGONALS: RangeInclusive<f64> = 1e-3..=5.0;
/// kg.
const MASSES: RangeInclusive<f64> = 1e-9..=1e3;
/// kg/m^3.
const DENSITIES: RangeInclusive<f32> = 200.0..=10_000.0;
/// Young's moduli, Pa.
const YOUNG: RangeInclusive<f64> = 20.0..=1e9;
/// Of what does not change its volume single precision would leave no digits.
const POISSON_RATIOS: RangeInclusive<f64> = 0.0..=0.499_99;
/// m/s^2: a hundred times that of the earth.
const MOST_GRAVITY: f64 = 1e3;
/// Share of the diagonal by which a node may jump in the first step.
const MOST_JUMP: f64 = 0.05;
/// In diagonals of the body: farther away an instrument or a target is not in metres.
const FAR: f64 = 10.0;
/// Faces of elements with three held nodes that a support has at least, to be told from single nodes.
const FACES_OF_A_SUPPORT: u32 = 4;

/// What does not look right.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Remark {
    /// The diagonal of the body's box, m.
    Size(f64),
    /// The mass of the body, kg.
    Mass(f64),
    /// A density, kg/m^3.
    Density(f32),
    /// Young's modulus at rest, Pa.
    Stiffness(f64),
    /// Poisson's ratio at rest.
    PoissonRatio(f64),
    /// The size of gravity, m/s^2.
    Gravity(f64),
    /// Forces so large that the body cannot bear them.
    Forces {
        /// The sum of their sizes, N.
        newton: f64,
        /// Young's modulus times the area of a cube of the body's volume, N.
        bearable: f64,
    },
    /// A prescribed motion farther than the body is large.
    Way {
        /// How far, m.
        metre: f64,
        /// The diagonal of the body's box, m.
        diagonal: f64,
    },
    /// A prescribed motion without a ramp, far for a single step; m.
    Jump(f64),
    /// A prescribed motion faster than shear waves.
    Speed {
        /// Its speed, m/s.
        speed: f64,
        /// That of shear waves in the softest tissue, m/s.
        waves: f64,
        /// A ramp for half the speed of the waves, s.
        ramp: f64,
    },
    /// The held nodes are few neighbours, those with numbers one less are many.
    CountedFromOne,
    /// A network that learned another law, other constants or density, or other tetrahedra.
    OtherTissue,
    /// An instrument of this thickness, m, that can touch nodes only, where the surface has longer edges.
    Thin(f32),
    /// An instrument whose middle or axis starts within the body at rest: it pushes its surface from within, or not at all.
    Inside,
    /// A pull all of whose nodes are held where it would move them.
    HeldPull,
    /// An instrument that is so far from the body where its motion begins and ends.
    Far {
        /// From the middle of the body, m.
        metre: f64,
        /// The diagonal of the body's box, m.
        diagonal: f64,
    },
    /// A pull to a target that is so far from its point.
    FarTarget {
        /// How far, m.
        metre: f64,
        /// The diagonal of the body's box, m.
        diagonal: f64,
    },
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Size(diagonal) => {
                write!(f, "the body is {diagonal:.4} m across; are its points in metres? (1 mm is 0.001 m)")
            }
            Self::Mass(mass) => {
                write!(f, "the body has a mass of {mass:.3e} kg; are its points in metres? (1 mm is 0.001 m)")
            }
            Self::Density(density) => {
                write!(f, "a density of {density} kg/m^3; tissue has about 1000 (1 g/cm^3 is 1000 kg/m^3)")
            }
            Self::Stiffness(young) => write!(
                f,
                "Young's modulus of the tissue is {young:.3e} Pa; soft tissue has 1e3 to 1e5 (1 kPa is 1000 Pa)"
            ),
            Self::PoissonRatio(ratio) => write!(
                f,
                "Poisson's ratio of the tissue is {ratio:.5}; soft tissue has 0.3 to 0.4999 (are the constants in the right order?)"
            ),
            Self::Gravity(size) => write!(
                f,
                "gravity is {size:.0} m/s^2, that of the earth is 9.81 (9810 mm/s^2 is 9.81 m/s^2)"
            ),
            Self::Forces { newton, bearable } => write!(
                f,
                "forces add up to {newton:.3e} N, the body would be crushed by {bearable:.3e} N (1 mN is 0.001 N)"
            ),
            Self::Way { metre, diagonal } => {
                write!(f, "nodes move by {metre} m, the body is {diagonal:.3} m across (1 mm is 0.001 m)")
            }
            Self::Jump(metre) => {
                write!(f, "nodes move by {:.1} mm in the first step; with a ramp they take time", 1e3 * metre)
            }
            Self::Speed { speed, waves, ramp } => write!(
                f,
                "nodes move at {speed:.2} m/s, faster than shear waves in the softest tissue ({waves:.2} m/s), which cannot follow; \
                 a ramp of {ramp:.3} s is slower"
            ),
            Self::CountedFromOne => {
                f.write_str("supports are of nodes far from each other; are they counted from one? (the first node is 0)")
            }
            Self::OtherTissue => f.write_str(
                "the network learned from another law, other constants or other tetrahedra: its error here is not known",
            ),
            Self::Thin(thickness) => write!(
                f,
                "an instrument is {:.2} mm thick, and edges of the surface are longer: it needs the surface's triangles",
                1e3 * thickness
            ),
            Self::Inside => f.write_str(
                "an instrument starts within the body, where it touches nothing and pushes the surface from within; let its path begin outside",
            ),
            Self::HeldPull => f.write_str("all nodes of a pull are held: it moves nothing"),
            Self::Far { metre, diagonal } => write!(
                f,
                "an instrument is {metre:.4} m away from the body, which is {diagonal:.3} m across (1 mm is 0.001 m)"
            ),
            Self::FarTarget { metre, diagonal } => write!(
                f,
                "a pull's target is {metre:.4} m away from its point, the body is {diagonal:.3} m across (1 mm is 0.001 m)"
            ),
        }
    }
}

/// What remarks about loads need to know of the body.
#[derive(Clone, Copy, Debug)]
pub struct Proportions {
    /// The diagonal of its box, m.
    pub diagonal: f64,
    /// m^3.
    pub volume: f64,
    /// Least Young's modulus of its tissues at rest, Pa.
    pub young: f64,
    /// Least speed of shear waves in its tissues at rest, m/s.
    pub waves: f64,
}

impl Proportions {
    /// Of a scene built from these points, m.
    #[must_use]
    pub fn of<M: ElementMaterial>(scene: SceneView<'_, M>, points: &[[f32; 3]]) -> Self {
        let mut volume = 0.0;
        for (tile, lane) in scene.places() {
            volume += f64::from(tile.volume::<f32>(lane));
        }
        let tissues = tissues_of(scene.material).map(|tissue| (tissue.density, Moduli::of(&tissue.law)));
        Self::of_tissues(diagonal(points), volume, tissues)
    }

    /// Of a body of tissues with these densities, kg/m^3, and moduli at rest.
    #[must_use]
    pub fn of_tissues(diagonal: f64, volume: f64, tissues: impl Iterator<Item = (f32, Moduli)>) -> Self {
        let mut least = Self { diagonal, volume, young: f64::MAX, waves: f64::MAX };
        for (density, moduli) in tissues {
            least.young = least.young.min(moduli.young());
            least.waves = least.waves.min(libm::sqrt(moduli.shear / f64::from(density)));
        }
        least
    }

    /// Of all forces at their full size.
    #[must_use]
    pub fn of_forces(&self, forces: &[NodalForce]) -> Option<Remark> {
        let newton: f64 = forces.iter().map(|force| length(force.newton)).sum();
        let edge = libm::cbrt(self.volume);
        let bearable = self.young * edge * edge;
        (newton > bearable).then_some(Remark::Forces { newton, bearable })
    }

    /// Of how far a motion goes, and how fast along its ramp.
    #[must_use]
    pub fn of_motion(&self, motion: &Motion) -> Option<Remark> {
        let (metre, ramp) = (length(motion.metre), f64::from(motion.ramp));
        let Self { diagonal, waves, .. } = *self;
        if metre > diagonal {
            Some(Remark::Way { metre, diagonal })
        } else if ramp > 0.0 && metre / ramp > waves {
            Some(Remark::Speed { speed: metre / ramp, waves, ramp: 2.0 * metre / waves })
        } else {
            None
        }
    }

    /// Of a motion whose first step goes all the way, where it has no ramp.
    #[must_use]
    pub fn of_jump(&self, motion: &Motion) -> Option<Remark> {
        let metre = length(motion.metre);
        (motion.ramp == 0.0 && metre > MOST_JUMP * self.diagonal).then_some(Remark::Jump(metre))
    }
}

/// Of the diagonal of a body's box, m.
#[must_use]
pub fn of_size(diagonal: f64) -> Option<Remark> {
    (!DIAGONALS.contains(&diagonal)).then_some(Remark::Size(diagonal))
}

/// Of an instrument that comes no nearer to a body with this diagonal than so many metres.
#[must_use]
pub fn of_distance(metre: f64, diagonal: f64) -> Option<Remark> {
    (metre > FAR * diagonal).then_some(Remark::Far { metre, diagonal })
}

/// Of a pull whose target is so many metres away from its point, at a body with this diagonal.
#[must_use]
pub fn of_target(metre: f64, diagonal: f64) -> Option<Remark> {
    (metre > FAR * diagonal).then_some(Remark::FarTarget { metre, diagonal })
}

/// Of the mass of a body, kg.
#[must_use]
pub fn of_mass(mass: f64) -> Option<Remark> {
    (!MASSES.contains(&mass)).then_some(Remark::Mass(mass))
}

/// Of a tissue with this density, kg/m^3, and these moduli at rest.
pub fn of_tissue(density: f32, moduli: &Moduli) -> impl Iterator<Item = Remark> + use<> {
    let (young, ratio) = (moduli.young(), moduli.poisson_ratio());
    let remarks = [
        (!DENSITIES.contains(&density)).then_some(Remark::Density(density)),
        (!YOUNG.contains(&young)).then_some(Remark::Stiffness(young)),
        (!POISSON_RATIOS.contains(&ratio)).then_some(Remark::PoissonRatio(ratio)),
    ];
    remarks.into_iter().flatten()
}

/// Of gravity, m/s^2.
#[must_use]
pub fn of_gravity(gravity: [f32; 3]) -> Option<Remark> {
    let size = length(gravity);
    (size > MOST_GRAVITY).then_some(Remark::Gravity(size))
}

/// Of which nodes are held: whether they have fewer than half as many faces in common as those with numbers one less
/// would have.
#[must_use]
pub fn of_supports(elements: impl Iterator<Item = [usize; 4]>, is_held: impl Fn(usize) -> bool) -> Option<Remark> {
    let faces = |nodes: [bool; 4]| match nodes.into_iter().filter(|&held| held).count() {
        3 => 1,
        4 => 4,
        _ => 0,
    };
    let (mut given, mut one_less) = (0, 0);
    for nodes in elements {
        given += faces(nodes.map(&is_held));
        one_less += faces(nodes.map(|node| is_held(node + 1)));
    }
    let is_likely = !is_held(0) && one_less >= FACES_OF_A_SUPPORT && one_less > 2 * given;
    is_likely.then_some(Remark::CountedFromOne)
}

/// Calls `say` with all remarks about the body of a scene that was built from these points, m: with the number of the
/// tissue that one is about, zero for others.
pub fn of_body<M: ElementMaterial>(scene: SceneView<'_, M>, points: &[[f32; 3]], mut say: impl FnMut(usize, Remark)) {
    let of_all = of_size(diagonal(points)).into_iter().chain(of_mass(scene.mass()));
    of_all.for_each(|remark| say(0, remark));
    for (index, Tissue { law, density }) in tissues_of(scene.material).enumerate() {
        of_tissue(density, &Moduli::of(&law)).for_each(|remark| say(index, remark));
    }
    let elements = scene.places().map(|(tile, lane)| [0, 1, 2, 3].map(|corner| tile.node(corner, lane)));
    let is_held = |node| scene.held(node) != Axes::NONE;
    of_supports(elements, is_held).into_iter().for_each(|remark| say(0, remark));
}

/// Of a network that a scene's learned steps use.
#[must_use]
pub fn of_network<M: ElementMaterial>(scene: SceneView<'_, M>, recipe: &Recipe<'_>) -> Option<Remark> {
    let law: AnyLaw = scene.material.laws().law().into();
    let is_same_law = scene.element() == recipe.element && law.code() == recipe.law.code();
    let is_same = |Tissue { law, density }: Tissue<M::Law>| {
        let mut constants = law.values().into_iter().zip(recipe.law.values());
        same(density, recipe.density) && constants.all(|(here, there)| same(here, there))
    };
    (!(is_same_law && tissues_of(scene.material).all(is_same))).then_some(Remark::OtherTissue)
}

/// Calls `say` with a remark and the number of each instrument that passes between the nodes that it can touch, starts within
/// the body or is far away from it, of a scene that was built from these points, m.
pub fn of_contact<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
    contact: &Contact<'_>,
    mut say: impl FnMut(usize, Remark),
) {
    let nodes = |(tile, lane): (&ElementTile, usize)| [0, 1, 2, 3].map(|corner| tile.node(corner, lane) as u32);
    let (low, high) = extent(points);
    let middle = (0.5 * (low + high)).as_vec3().to_array();
    for (index, instrument) in contact.instruments().iter().enumerate() {
        let nearest = instrument.times.map(|time| f64::from(instrument.distance(middle, time)));
        of_distance(nearest[0].min(nearest[1]), diagonal(points)).into_iter().for_each(|remark| say(index, remark));
        // Of a shape whose middle is outside itself, as of a plane, nothing is known.
        let within =
            instrument.axis().into_iter().filter(|&point| instrument.distance(point, instrument.times[0]) < 0.0);
        let is_within =
            |point| scene.places().any(|place| is_in(point, nodes(place).map(|node| points.get(node as usize))));
        if instrument.shape.thickness().is_finite() && within.into_iter().any(is_within) {
            say(index, Remark::Inside);
        }
    }
    if !contact.surface().triangles().is_empty() {
        return;
    }
    // Behind a face that is held elements may have been left out.
    let is_held = |face: &[u32; 3]| face.iter().all(|&node| scene.held(node as usize) == Axes::XYZ);
    for (index, instrument) in contact.instruments().iter().enumerate() {
        let thickness = instrument.shape.thickness();
        let faces = scene.places().flat_map(|place| faces(nodes(place))).filter(|face| !is_held(face));
        if thickness.is_finite() && passes_between(points, faces, thickness) {
            say(index, Remark::Thin(thickness));
        }
    }
}

/// Whether a point is in a tetrahedron, or on it.
fn is_in(point: [f32; 3], corners: [Option<&[f32; 3]>; 4]) -> bool {
    let [Some(a), Some(b), Some(c), Some(d)] = corners else { return false };
    let place = |point: [f32; 3]| DVec3::from(point.map(f64::from));
    within([a, b, c, d].map(|corner| place(*corner)), place(point)).is_some()
}

/// Of a pull along a direction (zeros: along all) on nodes with these held axes.
#[must_use]
pub fn of_pull(held: impl Iterator<Item = Axes>, along: [f32; 3]) -> Option<Remark> {
    let pulls = |axis: usize| along == [0.0; 3] || along.get(axis).is_some_and(|component| *component != 0.0);
    let is_held = |axes: Axes| (0..3).all(|axis| axes.has(axis) || !pulls(axis));
    let (mut nodes, mut all) = (0, true);
    held.for_each(|axes| (nodes, all) = (nodes + 1, all && is_held(axes)));
    (all && nodes > 0).then_some(Remark::HeldPull)
}

/// Calls `say` with a remark and the number of each pull that moves nothing, or to a far target, in a scene that was built from these
/// points, m.
pub fn of_pulls<M>(
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
    pulls: &Pulls<'_>,
    mut say: impl FnMut(usize, Remark),
) {
    let diagonal = diagonal(points);
    for (index, pull) in pulls.pulls().iter().enumerate().filter(|(_, pull)| pull.stiffness > 0.0) {
        let held = pulls.nodes_of(pull).iter().filter(|pulled| pulled.weight != 0.0);
        let held = held.map(|pulled| scene.held(pulled.node as usize));
        let metre = length([0, 1, 2].map(|axis| pull.to[axis] - pull.at[axis]));
        of_pull(held, pull.along)
            .or_else(|| of_target(metre, diagonal))
            .into_iter()
            .for_each(|remark| say(index, remark));
    }
}

/// Whether two values differ by no more than by how a person may write them.
#[must_use]
pub fn same(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-6 * a.abs().max(b.abs())
}

fn tissues_of<M: Material>(material: &M) -> impl Iterator<Item = Tissue<M::Law>> {
    let (one, law, several) = match material.laws() {
        Laws::One(law) => (material.tissue(0), law, &[][..]),
        Laws::Regions { law, tissues, .. } => (None, law, tissues),
    };
    let several = several.iter().map(move |tissue| Tissue { law: law.with(tissue.constants), density: tissue.density });
    one.into_iter().chain(several)
}

/// Least and largest coordinates, m.
fn extent(points: &[[f32; 3]]) -> (DVec3, DVec3) {
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    for point in points {
        let point = DVec3::from_array(point.map(f64::from));
        (low, high) = (low.min(point), high.max(point));
    }
    (low, high)
}

/// The diagonal of the box around the points, m.
fn diagonal(points: &[[f32; 3]]) -> f64 {
    let (low, high) = extent(points);
    if points.is_empty() { 0.0 } else { libm::sqrt((high - low).length_squared()) }
}

fn length(vector: [f32; 3]) -> f64 {
    libm::sqrt(vector.into_iter().map(|component| f64::from(component) * f64::from(component)).sum())
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::material::{NeoHookean, NodalPressure};
    use crate::mesh::{Bar, Mesh, Winding};
    use crate::scene::{Support, VecScene};

    const BAR: Bar = Bar { size: [0.02, 0.02, 0.05], cells: [2, 2, 5] };
    const LIVER: Tissue<NeoHookean> = Tissue { law: NeoHookean { c: 500.0, d: 15_000.0 }, density: 1000.0 };

    fn remarks(points: &[[f32; 3]], tissue: Tissue<NeoHookean>) -> Vec<Remark> {
        let tets: Vec<_> = BAR.tets().collect();
        let mesh = Mesh::new(points, &tets, Winding::Checked).unwrap();
        let scene = VecScene::build(NodalPressure(tissue), &mesh, &[Support::fixed(0)]).unwrap();
        let mut all = Vec::new();
        of_body(scene.view(), points, |_, remark| all.push(remark));
        all
    }

    #[test]
    fn a_pull_of_held_nodes_is_named() {
        let (free, all) = ([0.0; 3], [Axes::XYZ, Axes::XYZ]);
        assert_eq!(of_pull(all.into_iter(), free), Some(Remark::HeldPull));
        assert_eq!(of_pull([Axes::XYZ, Axes::X].into_iter(), free), None);
        assert_eq!(of_pull([Axes::XYZ, Axes::X].into_iter(), [2.0, 0.0, 0.0]), Some(Remark::HeldPull));
        assert_eq!(of_pull([Axes::XYZ, Axes::X].into_iter(), [2.0, 1.0, 0.0]), None);
        assert_eq!(of_pull([].into_iter(), free), None);
    }

    #[test]
    fn lengths_in_millimetres_are_named() {
        assert_eq!((of_distance(0.3, 0.06), of_target(0.3, 0.06)), (None, None));
        assert!(matches!(of_distance(65.0, 0.06), Some(Remark::Far { .. })));
        assert!(matches!(of_target(10.0, 0.06), Some(Remark::FarTarget { .. })));
        assert_eq!(of_target(f64::NAN, 0.06), None, "an absent target");
    }

    #[test]
    fn what_no_tissue_has_is_named_and_nothing_else() {
        let points: Vec<_> = BAR.points().collect();
        assert_eq!(remarks(&points, LIVER), []);
        let millimetres: Vec<_> = points.iter().map(|point| point.map(|metre| 1e3 * metre)).collect();
        let said = remarks(&millimetres, LIVER);
        assert!(matches!(said[..], [Remark::Size(size), Remark::Mass(mass)] if size > 50.0 && mass > 1e7));
        let said = remarks(&points, Tissue { density: 1.06, ..LIVER });
        assert_eq!(said, [Remark::Density(1.06)]);
        let swapped = Tissue { law: NeoHookean { c: 15_000.0, d: 500.0 }, ..LIVER };
        assert!(matches!(remarks(&points, swapped)[..], [Remark::PoissonRatio(ratio)] if ratio < -0.8));
        let kilopascal = Tissue { law: NeoHookean { c: 0.5, d: 15.0 }, ..LIVER };
        assert!(matches!(remarks(&points, kilopascal)[..], [Remark::Stiffness(young)] if young < 3.0));
    }

    /// A bar whose nodes have random numbers, as those of a mesher: its end is held, or the nodes after those of the
    /// end.
    #[test]
    fn supports_counted_from_one_are_noticed() {
        let points: Vec<_> = BAR.points().collect();
        let mut numbers: Vec<usize> = (0..points.len()).collect();
        let mut random = 1_u64;
        for last in (1..numbers.len()).rev() {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            numbers.swap(last, (random >> 33) as usize % (last + 1));
        }
        let elements: Vec<_> = BAR.tets().map(|tet| tet.map(|node| numbers[node as usize])).collect();
        let is_at_end = |number: usize| points.iter().zip(&numbers).any(|(point, &of)| of == number && point[2] == 0.0);
        let said = |is_held: &dyn Fn(usize) -> bool| of_supports(elements.iter().copied(), is_held);
        assert_eq!(said(&is_at_end), None);
        assert_eq!(said(&|number| number > 0 && is_at_end(number - 1)), Some(Remark::CountedFromOne));
        assert_eq!(said(&|number| number == 7), None, "a single node");
    }

    #[test]
    fn loads_are_measured_against_the_body() {
        let body = Proportions::of_tissues(0.1, 1e-4, [(1000.0, Moduli { shear: 1e3, bulk: 3e4 })].into_iter());
        let motion = |metre, ramp| Motion { node: 0, axes: Axes::XYZ, metre: [0.0, metre, 0.0], ramp };
        assert_eq!(body.of_motion(&motion(0.02, 0.1)), None);
        assert!(matches!(body.of_motion(&motion(0.2, 1.0)), Some(Remark::Way { .. })));
        let fast = body.of_motion(&motion(0.02, 0.01));
        assert!(matches!(fast, Some(Remark::Speed { waves, .. }) if (waves - 1.0).abs() < 1e-6), "{fast:?}");
        assert_eq!((body.of_jump(&motion(0.02, 0.1)), body.of_jump(&motion(0.002, 0.0))), (None, None));
        assert!(matches!(body.of_jump(&motion(0.02, 0.0)), Some(Remark::Jump(_))));
        let force = |newton| NodalForce { node: 0, newton: [newton, 0.0, 0.0], ramp: 0.0 };
        assert_eq!(body.of_forces(&[force(1.0), force(-1.0)]), None);
        assert!(matches!(body.of_forces(&[force(10.0), force(-10.0)]), Some(Remark::Forces { newton: 20.0, .. })));
        assert_eq!(
            (of_gravity([0.0, 0.0, -9.81]), of_gravity([0.0, 0.0, -9810.0])),
            (None, Some(Remark::Gravity(9810.0)))
        );
    }
}
