//! Networks on bodies unlike those of their training: with fallback a run ends wherever exact steps end, and says what
//! it took.

use supple::loads::NodalForce;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::mlp::{Network, WeightBytes};
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};
use supple::state::NodeVector;
use supple::step::Status;

use crate::reference::Random;
use crate::support::{mean_distance, to_f64};

const FRAME: f64 = 1.0 / 60.0;
const FRAMES: u32 = 24;

/// Those of the crate, which have learned torsion of a bar.
const NETWORKS: [(&str, &[u8]); 2] = [
    ("compact-20", include_bytes!("../../weights/compact-20.weights")),
    ("compact-100", include_bytes!("../../weights/compact-100.weights")),
];

/// A bent ellipsoid that is held at one side and pulled at the other by a force that rises and falls.
struct Organ {
    points: Vec<[f32; 3]>,
    material: VecMaterial,
    supports: Vec<Support>,
    pulled: Vec<u32>,
    newton: [f32; 3],
}

const CUBE: Bar = Bar { size: [2.0; 3], cells: [8; 3] };

impl Organ {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut between = |low: f64, high: f64| low + (high - low) * 0.5 * (random.next() + 1.0);
        let half = [between(0.04, 0.07), between(0.025, 0.04), between(0.02, 0.03)];
        let bend = between(-0.15, 0.15);
        let (young, poisson) = (between(2e3, 1e4), between(0.4, 0.47));
        let force = between(0.05, 0.2);
        let direction = [between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)];
        let ball: Vec<_> = CUBE.points().map(|point| onto_ball(point.map(|part| f64::from(part) - 1.0))).collect();
        let at = |[x, y, z]: [f64; 3]| {
            let x = half[0] * x;
            [x, half[1] * y, half[2] * z + bend * x * x / half[0]].map(|part| part as f32)
        };
        let nodes = |chosen: &dyn Fn(f64) -> bool| -> Vec<u32> {
            (0..).zip(&ball).filter(|(_, point)| chosen(point[0])).map(|(node, _)| node).collect()
        };
        let pulled = nodes(&|x| x > 0.9);
        let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt() * pulled.len() as f64;
        let law = NeoHookean {
            c: (young / (4.0 * (1.0 + poisson))) as f32,
            d: (young / (6.0 * (1.0 - 2.0 * poisson))) as f32,
        };
        Self {
            points: ball.iter().map(|&point| at(point)).collect(),
            material: VecMaterial::one(Element::NodalPressure, law, 1060.0),
            supports: nodes(&|x| x < -0.75).into_iter().map(Support::fixed).collect(),
            newton: direction.map(|part| (force * part / length) as f32),
            pulled,
        }
    }

    /// Where all nodes are at the end, and the worst status.
    fn run(&self, settings: Settings<'_>) -> (Vec<NodeVector>, Status) {
        let (points, tets) = (self.points.clone(), CUBE.tets().collect::<Vec<_>>());
        let simulation = Simulation::new(points, tets, self.material.clone(), &self.supports).unwrap();
        let mut simulation = simulation.with(settings);
        let mut worst = Status::Ok;
        for frame in 1..=FRAMES {
            let share = (std::f64::consts::PI * (f64::from(frame) * FRAME / 0.5).min(1.0)).sin() as f32;
            let force = |&node: &u32| NodalForce { node, newton: self.newton.map(|part| share * part), ramp: 0.0 };
            simulation.forces = self.pulled.iter().map(force).collect();
            worst = worst.worse(simulation.advance(FRAME).unwrap().status);
        }
        (simulation.displacements().to_vec(), worst)
    }
}

/// A point of the cube from -1 to 1 on its way to the ball.
fn onto_ball([x, y, z]: [f64; 3]) -> [f64; 3] {
    let along = |a: f64, b: f64, c: f64| a * (1.0 - b * b / 2.0 - c * c / 2.0 + b * b * c * c / 3.0).sqrt();
    [along(x, y, z), along(y, z, x), along(z, x, y)]
}

/// Mean distance of the nodes, mm.
fn distance(a: &[NodeVector], b: &[NodeVector]) -> f64 {
    1e3 * mean_distance(&to_f64(a), &to_f64(b))
}

#[test]
fn with_fallback_no_network_runs_away_on_an_organ_that_it_has_not_seen() {
    let organ = Organ::new(0);
    let damping = Network::parse(WeightBytes::of(NETWORKS[0].1).bytes()).unwrap().recipe().damping;
    let (exact, status) = organ.run(Settings { damping, ..Settings::default() });
    let motion = distance(&exact, &vec![NodeVector::ZERO; exact.len()]);
    assert!(status == Status::Ok && motion > 0.5, "{status:?}, {motion}");
    for (name, bytes) in NETWORKS {
        let bytes = WeightBytes::of(bytes);
        let network = Network::parse(bytes.bytes()).unwrap();
        let method = Method::Learned { network, lead_in: 0.1, fallback: true };
        let (end, status) = organ.run(Settings { method, ..Settings::default() });
        let off = distance(&end, &exact);
        println!("{name}: {off:.2} mm off, exact steps moved by {motion:.2} mm, {status:?}");
        assert!(off < 0.25 * motion && status != Status::Ok);
    }
}
