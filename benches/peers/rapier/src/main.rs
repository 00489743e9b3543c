//! One run of rapier3d's soft bodies: `rapier-peer MESH YOUNG POISSON DAMPING GRAVITY SOLVER MODEL STEP SUBSTEPS SWEEPS CG SECONDS REST
//! NODE...`. MESH has a line for each node (x y z mass) and, after an empty one, for each tetrahedron. Nodes at x = 0 are pinned. Prints the processor
//! time of a simulated second, then the time and the places of the NODEs at the end of each step until SECONDS, then those after REST seconds.

use std::time::Instant;

use rapier3d::prelude::*;

/// Units of length in a metre: in 32 bits rapier3d gives cells below 1.2e-7 cubic units no stiffness.
const SCALE: Real = 100.0;

fn numbers<T: std::str::FromStr>(line: &str) -> Vec<T> {
    line.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

/// Processor time of this program, which has one thread, s.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    numbers::<f64>(&stat).first().map_or(f64::NAN, |ns| 1e-9 * ns)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize| arguments[at].parse::<Real>().expect("a number");
    let mesh = std::fs::read_to_string(&arguments[0]).expect("a mesh");
    let (nodes, tetrahedra) = mesh.split_once("\n\n").expect("nodes and tetrahedra");
    let nodes: Vec<Vec<Real>> = nodes.lines().map(numbers).collect();
    let cells = tetrahedra.lines().map(|line| numbers(line).try_into().expect("four nodes")).collect();
    let followed: Vec<usize> = arguments[13..].iter().map(|word| word.parse().expect("a node")).collect();

    let mut world = PhysicsWorld::new();
    world.gravity = Vector::new(0.0, 0.0, -SCALE * number(4));
    world.integration_parameters.length_unit = SCALE;
    world.integration_parameters.dt = number(7);
    world.integration_parameters.num_solver_iterations = number(8) as usize;
    world.integration_parameters.soft_bodies.fem.max_linear_iterations = number(10) as usize;
    let solver = if arguments[5] == "fem" { SoftBodySolver::Fem } else { SoftBodySolver::Constraints };
    let model =
        if arguments[6] == "corotational" { SoftBodyCellModel::Corotational } else { SoftBodyCellModel::NeoHookean };
    let material = SoftBodyMaterial {
        young_modulus: number(1) / SCALE,
        poisson_ratio: number(2),
        // The scene's damping is that of the mass alone.
        elastic_damping_ratio: 0.0,
        ..Default::default()
    };
    let body = SoftBodyBuilder::new(nodes.iter().map(|node| SCALE * Vector::new(node[0], node[1], node[2])).collect())
        .cells(cells)
        .masses(nodes.iter().map(|node| node[3]).collect())
        .pinned_particles((0..).zip(&nodes).filter(|(_, node)| node[0] == 0.0).map(|(at, _)| at))
        .material(material)
        .cell_model(model)
        .solver(solver)
        .additional_pgs_iterations(number(9) as usize)
        .linear_damping(number(3))
        .no_surface_collider()
        .self_contacts(false)
        .can_sleep(false);
    let handle = world.insert_soft_body(body);

    let mut lines = Vec::new();
    let (seconds, rest, step) = (number(11) as f64, number(12) as f64, number(7) as f64);
    let (began, mut spent) = (Instant::now(), 0.0);
    for count in 1..=(rest / step).ceil() as usize {
        let time = count as f64 * step;
        let before = processor();
        world.step();
        if time <= seconds + 1e-6 {
            spent += processor() - before;
        }
        let body = &world.soft_bodies[handle];
        let places = followed.iter().map(|&node| body.particle_position(node));
        lines.push(
            places.fold(format!("{time}"), |line, at| {
                format!("{line} {} {} {}", at.x / SCALE, at.y / SCALE, at.z / SCALE)
            }),
        );
        // What diverges or takes too long is not followed to the end.
        if lines.last().is_some_and(|line| line.contains("NaN")) || began.elapsed().as_secs_f64() > 400.0 {
            println!("stopped");
            break;
        }
    }
    println!("{}", spent / seconds);
    lines.iter().for_each(|line| println!("{line}"));
}
