//! Tissue that instruments move at the speed of a hand, in exact steps of nine tenths of the critical step at rest and
//! in long ones: nothing is refused that is right, and all follow exact steps of their own pace.

use supple::contact::{Contact, Grip, Instrument, Pose, Shape, Surface, boundary};
use supple::inertia::{self, Cells};
use supple::loads::Loads;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};
use supple::state::NodeVector;
use supple::step::Status;

const FRAME: f64 = 1.0 / 60.0;

/// 5 kPa, Poisson's ratio 0.45.
const SOFT: NeoHookean = NeoHookean { c: 862.0, d: 8_333.0 };

/// From 0 to 1, gently.
fn ramp(time: f64, end: f64) -> f32 {
    let share = (time / end).clamp(0.0, 1.0);
    (share * share * (3.0 - 2.0 * share)) as f32
}

struct Case {
    name: &'static str,
    bar: Bar,
    held: bool,
    damping: f32,
    gravity: [f32; 3],
    instrument: Instrument<'static>,
    /// Whether it holds the nodes near it.
    grips: bool,
    /// Where it is at a time, s.
    pose: fn(f64) -> Pose,
    frames: u32,
}

impl Case {
    /// A slab is grasped, dragged by 20 mm, lifted by 15 mm and turned by 1.5 rad in 0.3 s.
    fn grasp() -> Self {
        let pose = |time| {
            let share = ramp(time, 0.3);
            let (sin, cos) = (0.75 * share).sin_cos();
            let position = [0.05 + 0.02 * share, 0.05, 0.0405 + 0.015 * share];
            Pose { position, rotation: [0.0, 0.0, sin, cos] }
        };
        Self {
            name: "grasp and drag",
            bar: Bar { size: [0.1, 0.1, 0.04], cells: [10, 10, 4] },
            held: true,
            damping: 20.0,
            gravity: [0.0; 3],
            instrument: Instrument::resting(Shape::Sphere { radius: 0.01 }, pose(0.0)),
            grips: true,
            pose,
            frames: 36,
        }
    }

    /// A free cube lies on a table that tilts by 0.5 rad.
    fn table() -> Self {
        let pose = |time: f64| {
            let (sin, cos) = (0.25 * ramp(time - 0.5, 0.5)).sin_cos();
            Pose { position: [0.03, 0.03, -0.0003], rotation: [0.0, sin, 0.0, cos] }
        };
        let mut table = Instrument::resting(Shape::Plane, pose(0.0));
        table.friction = 1.0;
        Self {
            name: "tilting table",
            bar: Bar { size: [0.06; 3], cells: [6; 3] },
            held: false,
            damping: 2.0,
            gravity: [0.0, 0.0, -9.81],
            instrument: table,
            grips: false,
            pose,
            frames: 84,
        }
    }

    /// Where all nodes are at the end, and the worst status. `settings` are given the critical step at rest, s.
    fn run(&self, settings: impl Fn(f32) -> Settings<'static>) -> (Vec<NodeVector>, Status) {
        let (points, tets): (Vec<_>, Vec<_>) = (self.bar.points().collect(), self.bar.tets().collect());
        let low = (0..points.len() as u32).filter(|&node| self.held && points[node as usize][2] < 1e-6);
        let supports: Vec<_> = low.map(Support::fixed).collect();
        let surface = boundary(&Mesh::new(&points, &tets, Winding::Checked).unwrap());
        let material = VecMaterial::one(Element::NodalPressure, SOFT, 1000.0);
        let mut simulation = Simulation::new(points, tets, material, &supports).unwrap().meeting(false).unwrap();
        let critical = simulation.critical_step().unwrap().seconds;
        simulation.set(settings(critical));
        let mut instrument = self.instrument;
        let grips: Vec<Grip> = if self.grips {
            let surface = Surface::new(&surface, simulation.points().len()).unwrap();
            instrument.grips(0, surface, simulation.displacements(), 0.0, 0.008).collect()
        } else {
            vec![]
        };
        let mut worst = Status::Ok;
        for frame in 0..self.frames {
            let [from, until] = [frame, frame + 1].map(|frame| f64::from(frame) * FRAME);
            instrument.move_to((self.pose)(until), from, until);
            let instruments = [instrument];
            let surface = Surface::new(&surface, simulation.points().len()).unwrap();
            let contact = Contact::new(surface, &instruments).unwrap().gripping(&grips).unwrap();
            let mut loads = Loads::new(simulation.scene(), self.gravity, &[], &[]).unwrap().touched_by(contact);
            let report = simulation.advance_under(until, &mut loads, &mut |_| {}).unwrap();
            assert!(report.status.is_taken(), "{}: {:?}", self.name, report.status);
            worst = worst.worse(report.status);
        }
        (simulation.displacements().to_vec(), worst)
    }
}

/// Mean distance of the nodes, m.
fn distance(a: &[NodeVector], b: &[NodeVector]) -> f32 {
    let lengths = a.iter().zip(b).map(|(a, b)| {
        let [a, b] = [a, b].map(|vector| vector.to_array());
        (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f32>().sqrt()
    });
    lengths.sum::<f32>() / a.len() as f32
}

#[test]
fn what_a_hand_does_is_followed_in_exact_steps_of_a_length_and_in_long_ones() {
    for case in [Case::grasp(), Case::table()] {
        let exact = |share: Option<f32>| {
            move |critical: f32| Settings {
                step: share.map(|share| share * critical),
                damping: case.damping,
                ..Settings::default()
            }
        };
        let long = |multiple: f32| {
            move |critical: f32| Settings {
                method: Method::Long(inertia::Method::new(Cells::Suggested)),
                step: Some(multiple * critical),
                damping: case.damping,
                ..Settings::default()
            }
        };
        let (truth, status) = case.run(exact(None));
        let motion = distance(&truth, &vec![NodeVector::ZERO; truth.len()]);
        assert!(motion > 0.002 && status == Status::Ok, "{motion}, {status:?}");
        let judge = |what: &str, (end, status): (Vec<NodeVector>, Status), most: f32| {
            let share = distance(&end, &truth) / motion;
            println!("{}, {what}: {:.2} % off of {:.1} mm, {status:?}", case.name, 100.0 * share, 1e3 * motion);
            assert!(share < most || status != Status::Ok, "{}, {what}", case.name);
        };
        for share in [0.9, 0.45] {
            judge(&format!("exact steps of {share}"), case.run(exact(Some(share))), 0.01);
        }
        for multiple in [10.0, 20.0] {
            judge(&format!("long steps of {multiple}"), case.run(long(multiple)), 0.05);
        }
    }
}
