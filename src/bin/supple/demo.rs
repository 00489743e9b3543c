//! `supple demo`: a liver lobe hangs from its back, sags under its own weight and is pushed in from above.
//! The mesh is in the program, so the command needs no files.

use std::path::Path;

use supple::io::parse_msh;
use supple::loads::Motion;
use supple::material::{Exponential, Material};
use supple::mesh::Winding;
use supple::scene::{Axes, Support};

use crate::body::Body;
use crate::picture::{self, Panel};
use crate::prepare::{Job, Setup};
use crate::report::{self, Folder};
use crate::run::{self, Start};
use crate::scene_file::Problem;
use crate::simulate::End;

const LOBE: &[u8] = include_bytes!("../../../meshes/lobe.msh");
/// Liver-like: shear modulus 1.5 kPa at rest, stiffening like the paper's law, nearly incompressible.
const TISSUE: Exponential = Exponential { a: 1_500.0, b: 8.023, d: 40_000.0 };
const DENSITY: f32 = 1_060.0;
/// 1/s: the lobe rings, but not through the whole second.
const DAMPING: f32 = 20.0;
/// Nodes behind this plane hang on the diaphragm, m.
const BACK: f64 = 0.030;
/// The push: nodes within this distance (m) of the top of the dome go down by 10 mm in half a second.
const PATCH: f64 = 0.012;
const PUSH: ([f32; 3], f32) = ([0.0, 0.002, -0.010], 0.5);

pub(crate) fn demo(out: &Path) -> Result<End, Problem> {
    let mesh = parse_msh(Path::new("lobe.msh"), LOBE).map_err(|error| Problem(error.to_string()))?;
    let body = Body::new(mesh, Winding::Checked, "liver lobe".into());
    let mut setup = Setup::of_body(body, TISSUE, DENSITY);
    let points = &setup.body.mesh.points;
    let top =
        points.iter().copied().fold([0.0, 0.0, f64::NEG_INFINITY], |a, b| if b[2] > a[2] { b } else { a });
    for (node, point) in (0u32..).zip(points) {
        let away = (0..3).map(|axis| (point[axis] - top[axis]).powi(2)).sum::<f64>().sqrt();
        if point[1] > BACK {
            setup.supports.push(Support::fixed(node));
        } else if away < PATCH && point[2] > top[2] - 0.004 {
            setup.supports.push(Support::moved(node));
            setup.motions.push(Motion { node, axes: Axes::XYZ, metre: PUSH.0, ramp: PUSH.1 });
        }
    }
    setup.gravity = [0.0, 0.0, -9.81];
    setup.damping = DAMPING;
    setup.with_material(Demo { setup: &setup, out })
}

struct Demo<'a> {
    setup: &'a Setup,
    out: &'a Path,
}

impl Job for Demo<'_> {
    type Output = Result<End, Problem>;

    fn run<M: Material>(self, material: M) -> Self::Output {
        let setup = self.setup;
        let (scene, mut state) = setup.build(material)?;
        println!(
            "A liver lobe, held at its back, sags under its own weight; its dome is pushed in by 10 mm.\n"
        );
        let mut folder = Folder::create(self.out, true)?;
        let start = Start::new(setup, &scene, &mut state, false)?;
        let outcome = run::run(
            setup,
            &scene,
            &mut state,
            start,
            |_| {},
            |scene, state| folder.add_frame(&setup.body, scene, state),
        )?;
        let figures = report::conclude(&folder, setup, &scene, &state, &outcome)?;

        let rest = &setup.body.mesh.points;
        let moved: Vec<_> = rest
            .iter()
            .zip(state.displacements())
            .map(|(point, vector)| [0, 1, 2].map(|axis| point[axis] + f64::from(vector.to_array()[axis])))
            .collect();
        let lengths = state.displacements().iter().map(|vector| {
            vector.to_array().iter().map(|component| f64::from(component * component)).sum::<f64>().sqrt()
        });
        let lengths: Vec<_> = lengths.collect();
        let none = vec![0.0; rest.len()];
        let after = format!("after {:.1} s", state.time());
        let panels = [
            Panel { title: "at rest", positions: rest, displacements: &none },
            Panel { title: &after, positions: &moved, displacements: &lengths },
        ];
        let svg = picture::draw(&panels, &setup.body.boundary(), figures.max_displacement);
        folder.write_text("lobe.svg", &svg)?;
        println!("\npicture  {}", folder.path("lobe.svg").display());
        println!("frames   {} (opens in ParaView)", folder.path("frames.pvd").display());
        Ok(outcome.divergence.map_or(End::Reached, |divergence| End::Diverged(divergence.to_string())))
    }
}
