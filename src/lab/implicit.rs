//! Backward Euler and the implicit midpoint rule, to compare explicit steps with what most packages do. With `h` the
//! step or half of it, velocities `w` at the end of `h` solve
//!
//! ```text
//! M ((1 + mu h) w - v) = h (F(t + h) + f(u + h w))
//! ```
//! by Newton's method with halved steps; each linear system by conjugate gradients in float32 with the parts of the
//! diagonal inverted (Nocedal & Wright 2006, algorithms 7.1 and 5.3). Backward Euler goes on from there, the midpoint
//! rule to twice as far. SI units.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use supple::loads::{Loads, ramp_factor};
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::simd::{Kernel, Real, dispatch};
use supple::state::VecState;
use supple::step::{Cause, Divergence, Status};
use supple::tled::{ElementTangent, element_tangents};

use super::method::Prepared;

/// Which rule.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Rule {
    /// Of first order; damps much.
    BackwardEuler,
    /// Of second order; damps nothing.
    Midpoint,
}

/// Newton's method ends when what is left of the momentum is this share of that at its start: with ten times as much it
/// adds to the error of the midpoint rule.
const NEWTON_TOLERANCE: f64 = 1e-4;
const MOST_NEWTON_STEPS: u32 = 40;
/// Conjugate gradients end at this share of the right side: Newton's method converges all the same, and sooner in time.
const LINEAR_TOLERANCE: f64 = 0.05;
const MOST_LINEAR_STEPS: u32 = 500;
/// The least share of a step of Newton's method.
const LEAST_SHARE: f64 = 1e-3;
/// Of the elements' impulses: the laws are evaluated in float32.
const ROUNDING: f64 = 1e-6;

/// Steps from `state` by `dt` (s) with `damping` (1/s).
pub(super) fn prepare<'a>(
    rule: Rule,
    scene: SceneView<'a, VecMaterial>,
    state: &VecState,
    dt: f32,
    damping: f32,
) -> Prepared<'a> {
    let tangents: Vec<ElementTangent> = element_tangents(scene, |_| [0.0; 3]).collect();
    let elements: Vec<[usize; 4]> = tangents.iter().map(|tangent| tangent.nodes).collect();
    let vector = |values: [f32; 3]| DVec3::from_array(values.map(f64::from));
    let nodes = 0..scene.node_count();
    let mut body = ImplicitMotion {
        rule,
        scene,
        dt: f64::from(dt),
        damping: f64::from(damping),
        time: state.time(),
        masses: nodes.clone().map(|node| f64::from(scene.node_mass(node))).collect(),
        free: nodes
            .clone()
            .map(|node| DVec3::from_array([0, 1, 2].map(|axis| f64::from(!scene.held(node).has(axis)))))
            .collect(),
        displacement: state.displacements().iter().map(|u| vector(u.to_array())).collect(),
        velocity: nodes.map(|node| vector(state.velocity(node))).collect(),
        tangents,
        matrix: Matrix::of(scene.node_count(), &elements),
    };
    Prepared::Own(Box::new(move |state, loads| body.step(loads, state)))
}

/// A body in motion, in float64.
struct ImplicitMotion<'a> {
    rule: Rule,
    scene: SceneView<'a, VecMaterial>,
    dt: f64,
    damping: f64,
    time: f64,
    masses: Vec<f64>,
    /// Ones along free axes.
    free: Vec<DVec3>,
    displacement: Vec<DVec3>,
    velocity: Vec<DVec3>,
    /// At the latest residual.
    tangents: Vec<ElementTangent>,
    matrix: Matrix,
}

impl ImplicitMotion<'_> {
    /// Takes a step and gives it to `state`.
    fn step(&mut self, loads: &Loads<'_>, state: &mut VecState) -> Status {
        let h = match self.rule {
            Rule::BackwardEuler => self.dt,
            Rule::Midpoint => 0.5 * self.dt,
        };
        let external = self.external_forces(loads, self.time + h);
        let mut velocity = self.velocity.clone();
        // What supports add to the velocities of the step before.
        let mut added: Vec<DVec3> =
            self.velocity.iter().zip(&self.free).map(|(v, free)| *v * (*free - DVec3::ONE)).collect();
        // Of several motions of an axis the last one holds.
        let mut prescribed = BTreeMap::new();
        for motion in loads.motions() {
            let factor = ramp_factor(self.time + self.dt, motion.ramp);
            for axis in (0..3).filter(|&axis| motion.axes.has(axis)) {
                prescribed.insert((motion.node as usize, axis), factor * motion.metre[axis]);
            }
        }
        for ((node, axis), metre) in prescribed {
            added[node][axis] += (f64::from(metre) - self.displacement[node][axis]) / self.dt;
        }
        if !self.solve(h, &external, &added, &mut velocity) {
            let node = velocity.iter().position(|v| !v.is_finite()).unwrap_or(0) as u32;
            return Status::Diverged(Divergence { time: self.time, node, cause: Cause::NotFinite });
        }
        for ((u, v), w) in self.displacement.iter_mut().zip(&mut self.velocity).zip(velocity) {
            *u += self.dt * w;
            *v = match self.rule {
                Rule::BackwardEuler => w,
                Rule::Midpoint => 2.0 * w - *v,
            };
        }
        self.time += self.dt;
        state.view().put(self.time, self.dt as f32, |node| {
            [self.displacement[node], self.dt * self.velocity[node]].map(|vector| vector.as_vec3().to_array())
        });
        Status::Ok
    }

    /// Gravity and nodal forces, N.
    fn external_forces(&self, loads: &Loads<'_>, time: f64) -> Vec<[f32; 3]> {
        let weight = |node| loads.gravity().map(|component| component * self.scene.node_mass(node));
        let mut forces: Vec<_> = (0..self.free.len()).map(weight).collect();
        for load in loads.forces() {
            let factor = ramp_factor(time, load.ramp);
            for (sum, newton) in forces[load.node as usize].iter_mut().zip(load.newton) {
                *sum += factor * newton;
            }
        }
        forces
    }

    /// Improves velocities until the momentum balance holds, with what supports add to them. Says whether it does.
    fn solve(&mut self, h: f64, external: &[[f32; 3]], added: &[DVec3], velocity: &mut Vec<DVec3>) -> bool {
        let Residual { mut left, scale } = self.residual(h, external, velocity);
        self.assemble(h);
        // Nodes near moved supports go with them, or their elements would be crushed.
        let moved = self.matrix.product(added, &self.free);
        for (left, moved) in left.iter_mut().zip(moved) {
            *left += moved;
        }
        let enough = (NEWTON_TOLERANCE * norm(&left)).max(ROUNDING * scale);
        for iteration in 0..MOST_NEWTON_STEPS {
            let before = norm(&left);
            if iteration > 0 {
                if before <= enough {
                    return true;
                }
                self.assemble(h);
            }
            let change = self.matrix.solve(&left, &self.free);
            let mut share = 1.0;
            loop {
                let trial: Vec<DVec3> = (0..change.len())
                    .map(|node| {
                        let added = if iteration == 0 { added[node] } else { DVec3::ZERO };
                        velocity[node] + added - share * change[node]
                    })
                    .collect();
                left = self.residual(h, external, &trial).left;
                // The first step goes to the supports' positions in any case.
                if norm(&left) < before || iteration == 0 {
                    *velocity = trial;
                    break;
                }
                share *= 0.5;
                if share < LEAST_SHARE {
                    return false;
                }
            }
        }
        false
    }

    /// What is left of the momentum balance, N s, along free axes. Keeps the elements' tangents.
    fn residual(&mut self, h: f64, external: &[[f32; 3]], velocity: &[DVec3]) -> Residual {
        let inert = 1.0 + self.damping * h;
        let mut left: Vec<DVec3> = (0..velocity.len())
            .map(|node| {
                let force = DVec3::from_array(external[node].map(f64::from));
                self.masses[node] * (inert * velocity[node] - self.velocity[node]) - h * force
            })
            .collect();
        let mut scale = 0.0;
        let at = |node: usize| (self.displacement[node] + h * velocity[node]).to_array();
        self.tangents.clear();
        self.tangents.extend(element_tangents(self.scene, at));
        for tangent in &self.tangents {
            for (node, force) in tangent.nodes.into_iter().zip(tangent.forces()) {
                let force = DVec3::from_array(force);
                left[node] -= h * force;
                scale += h * h * force.length_squared();
            }
        }
        for (left, free) in left.iter_mut().zip(&self.free) {
            *left *= *free;
        }
        Residual { left, scale: scale.sqrt() }
    }

    /// The derivative of the latest residual, into the matrix.
    fn assemble(&mut self, h: f64) {
        let inert = 1.0 + self.damping * h;
        self.matrix.start(|node| inert * self.masses[node]);
        for (element, tangent) in self.tangents.iter().enumerate() {
            self.matrix.add(element, &tangent.stiffness(), h * h);
        }
    }
}

/// What is left of the momentum balance, N s, and the norm of the elements' impulses in it.
struct Residual {
    left: Vec<DVec3>,
    scale: f64,
}

fn norm(vectors: &[DVec3]) -> f64 {
    vectors.iter().map(|vector| vector.length_squared()).sum::<f64>().sqrt()
}

/// Three columns of four numbers, the fourth zero.
type NodeBlock = [[f32; 4]; 3];

/// A sparse matrix of parts of 3 x 3, by rows of nodes.
struct Matrix {
    /// Where each node's row starts, and the end of the last.
    starts: Vec<usize>,
    columns: Vec<u32>,
    parts: Vec<NodeBlock>,
    /// The place of each node's own part.
    diagonal: Vec<usize>,
    /// Places of the parts of each element, by rows and columns of its nodes.
    places: Vec<[[usize; 4]; 4]>,
}

impl Matrix {
    /// With the nodes of each element.
    fn of(node_count: usize, elements: &[[usize; 4]]) -> Self {
        let mut neighbours: Vec<Vec<u32>> = (0..node_count as u32).map(|node| vec![node]).collect();
        for nodes in elements {
            for &node in nodes {
                neighbours[node].extend(nodes.map(|other| other as u32));
            }
        }
        let (mut starts, mut columns) = (vec![0], Vec::new());
        for row in &mut neighbours {
            row.sort_unstable();
            row.dedup();
            columns.extend_from_slice(row);
            starts.push(columns.len());
        }
        let place = |row: usize, column: usize| {
            starts[row] + neighbours[row].binary_search(&(column as u32)).unwrap_or_default()
        };
        Self {
            diagonal: (0..node_count).map(|node| place(node, node)).collect(),
            places: elements.iter().map(|nodes| nodes.map(|row| nodes.map(|column| place(row, column)))).collect(),
            parts: vec![NodeBlock::default(); columns.len()],
            starts,
            columns,
        }
    }

    /// Begins with `mass` on the diagonal.
    fn start(&mut self, mass: impl Fn(usize) -> f64) {
        self.parts.fill(NodeBlock::default());
        for (node, &place) in self.diagonal.iter().enumerate() {
            for axis in 0..3 {
                self.parts[place][axis][axis] = mass(node) as f32;
            }
        }
    }

    fn add(&mut self, element: usize, stiffness: &[[[[f64; 3]; 3]; 4]; 4], factor: f64) {
        for (places, row) in self.places[element].iter().zip(stiffness) {
            for (&place, part) in places.iter().zip(row) {
                for (sum, column) in self.parts[place].iter_mut().zip(part) {
                    for (sum, value) in sum.iter_mut().zip(column) {
                        *sum += (factor * value) as f32;
                    }
                }
            }
        }
    }

    /// The product with a vector, along free axes.
    fn product(&self, vector: &[DVec3], free: &[DVec3]) -> Vec<DVec3> {
        let vector = wide(vector);
        let mut product = vec![[0.0; 4]; vector.len()];
        self.multiply(&wide(free), &vector, &mut product);
        narrow(product)
    }

    #[inline(always)]
    fn multiply(&self, free: &[[f32; 4]], vector: &[[f32; 4]], product: &mut [[f32; 4]]) {
        for node in 0..free.len() {
            let mut sum = [0.0; 4];
            let row = self.starts[node]..self.starts[node + 1];
            for (part, &column) in self.parts[row.clone()].iter().zip(&self.columns[row]) {
                times(part, &vector[column as usize], &mut sum);
            }
            for axis in 0..4 {
                product[node][axis] = sum[axis] * free[node][axis];
            }
        }
    }

    /// The solution of the system along free axes.
    fn solve(&self, right: &[DVec3], free: &[DVec3]) -> Vec<DVec3> {
        let free = wide(free);
        let inverse = (0..free.len()).map(|node| self.inverse_of_diagonal(node, &free[node])).collect();
        narrow(dispatch(Solve { matrix: self, free, inverse, right: wide(right) }))
    }

    /// The inverse of a node's own part along free axes.
    fn inverse_of_diagonal(&self, node: usize, free: &[f32; 4]) -> NodeBlock {
        let mut part = self.parts[self.diagonal[node]];
        for (i, column) in part.iter_mut().enumerate() {
            for j in 0..3 {
                column[j] *= free[i] * free[j];
            }
            column[i] += 1.0 - free[i];
        }
        let columns = part.map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
        let inverse = DMat3::from_cols_array_2d(&columns.map(|column| column.to_array())).inverse();
        inverse.to_cols_array_2d().map(|[x, y, z]| [x as f32, y as f32, z as f32, 0.0])
    }
}

fn wide(vectors: &[DVec3]) -> Vec<[f32; 4]> {
    vectors.iter().map(|vector| vector.as_vec3().extend(0.0).to_array()).collect()
}

fn narrow(vectors: Vec<[f32; 4]>) -> Vec<DVec3> {
    vectors.into_iter().map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into())).collect()
}

/// Conjugate gradients with the inverted parts of the diagonal. Ends where the matrix is not positive along its
/// direction.
struct Solve<'a> {
    matrix: &'a Matrix,
    free: Vec<[f32; 4]>,
    inverse: Vec<NodeBlock>,
    right: Vec<[f32; 4]>,
}

#[inline(always)]
fn times(part: &NodeBlock, vector: &[f32; 4], sum: &mut [f32; 4]) {
    for (column, value) in part.iter().zip(vector) {
        for (sum, entry) in sum.iter_mut().zip(column) {
            *sum += entry * value;
        }
    }
}

#[inline(always)]
fn inner(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let mut sums = [0.0_f64; 4];
    for (a, b) in a.iter().zip(b) {
        for axis in 0..4 {
            sums[axis] += f64::from(a[axis] * b[axis]);
        }
    }
    sums.into_iter().sum()
}

#[inline(always)]
fn add_scaled(to: &mut [[f32; 4]], factor: f32, from: &[[f32; 4]]) {
    for (to, from) in to.iter_mut().zip(from) {
        for axis in 0..4 {
            to[axis] += factor * from[axis];
        }
    }
}

impl Kernel for Solve<'_> {
    type Output = Vec<[f32; 4]>;

    #[inline(always)]
    fn run<R: Real>(self) -> Self::Output {
        let Self { matrix, free, inverse, right: mut left } = self;
        let count = free.len();
        let mut solution = vec![[0.0; 4]; count];
        let (mut scaled, mut direction, mut product) = (solution.clone(), solution.clone(), solution.clone());
        let enough = LINEAR_TOLERANCE * inner(&left, &left).sqrt();
        let mut along = 0.0;
        for step in 0..MOST_LINEAR_STEPS {
            for node in 0..count {
                scaled[node] = [0.0; 4];
                times(&inverse[node], &left[node], &mut scaled[node]);
            }
            let next = inner(&left, &scaled);
            let keep = if step == 0 { 0.0 } else { (next / along) as f32 };
            along = next;
            for (direction, scaled) in direction.iter_mut().zip(&scaled) {
                for axis in 0..4 {
                    direction[axis] = scaled[axis] + keep * direction[axis];
                }
            }
            matrix.multiply(&free, &direction, &mut product);
            let curvature = inner(&direction, &product);
            if curvature <= 0.0 {
                // Downhill all the same, if it is the first.
                if step == 0 {
                    return scaled;
                }
                break;
            }
            let length = (along / curvature) as f32;
            add_scaled(&mut solution, length, &direction);
            add_scaled(&mut left, -length, &product);
            if inner(&left, &left).sqrt() <= enough {
                break;
            }
        }
        solution
    }
}

#[cfg(test)]
mod tests {

    use super::*;
    use supple::material::{Element, NeoHookean};
    use supple::mesh::{Bar, Mesh, Winding};
    use supple::scene::VecScene;
    use supple::step::Step;
    use supple::tled;

    fn scene_of(law: NeoHookean, bar: Bar) -> VecScene<VecMaterial> {
        let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
        let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
        VecScene::build(VecMaterial::one(Element::Linear, law, 1000.0), &mesh, &[]).unwrap()
    }

    /// A free bar under gravity: backward Euler falls by half a step's velocity more, the midpoint rule exactly.
    #[test]
    fn free_fall_is_what_the_rules_say_it_is() {
        let bar = Bar { size: [0.02, 0.02, 0.04], cells: [2, 2, 4] };
        let scene = scene_of(NeoHookean { c: 2_000.0, d: 100_000.0 }, bar);
        let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &[], &[]).unwrap();
        for (rule, beyond) in [(Rule::BackwardEuler, 1.0), (Rule::Midpoint, 0.0)] {
            let (dt, steps) = (2e-3_f32, 50);
            let mut state = VecState::at_rest(scene.node_count());
            let mut prepared = prepare(rule, scene.view(), &state, dt, 0.0);
            for _ in 0..steps {
                assert_eq!(prepared.advance(dt, scene.view(), &loads, &mut state).unwrap().0, Status::Ok);
            }
            let time = f64::from(steps) * f64::from(dt);
            let expected = -0.5 * 9.81 * time * (time + beyond * f64::from(dt));
            for u in state.displacements() {
                let [_, _, z] = u.to_array();
                assert!((f64::from(z) / expected - 1.0).abs() < 1e-3, "{rule:?}: {z} {expected}");
            }
        }
    }

    /// A held bar under a sudden weight: both come to the exact motion as steps get shorter, by their orders.
    #[test]
    fn errors_fall_with_the_order_of_the_rule() {
        let scene =
            scene_of(NeoHookean { c: 1_000.0, d: 10_000.0 }, Bar { size: [0.02, 0.02, 0.06], cells: [2, 2, 5] });
        let loads = Loads::new(&scene, [0.0; 3], &[], &[]).unwrap();
        // Stretched along z and let go.
        let stretched = |dt: f32| {
            let mut state = VecState::at_rest(scene.node_count());
            let points: Vec<_> = Bar { size: [0.02, 0.02, 0.06], cells: [2, 2, 5] }.points().collect();
            let step = Step::unchecked(dt, 0.0).unwrap();
            assert!(tled::start(&scene, &mut state, &step, |node| {
                ([0.0, 0.0, 0.002 * (points[node][2] / 0.06 * core::f32::consts::PI).cos()], [0.0; 3])
            }));
            state
        };
        let seconds = 0.02;
        let shape = |state: &VecState| state.displacements().iter().map(|u| u.to_array()[2]).collect::<Vec<f32>>();
        let fine = seconds / 4_000.0;
        let mut exact = stretched(fine);
        for _ in 0..4_000 {
            assert_eq!(tled::step(&scene, &loads, &mut exact, &Step::unchecked(fine, 0.0).unwrap()), Status::Ok);
        }
        for (rule, order, counts) in [(Rule::BackwardEuler, 1.0, [800, 1_600]), (Rule::Midpoint, 2.0, [100, 200])] {
            let errors = counts.map(|count| {
                let dt = seconds / count as f32;
                let mut state = stretched(dt);
                let mut prepared = prepare(rule, scene.view(), &state, dt, 0.0);
                for _ in 0..count {
                    assert_eq!(prepared.advance(dt, scene.view(), &loads, &mut state).unwrap().0, Status::Ok);
                }
                let pairs = shape(&state).into_iter().zip(shape(&exact));
                pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt()
            });
            let found = (errors[0] / errors[1]).log2();
            println!("{rule:?}: errors {errors:?} m, order {found:.2}");
            assert!((found - order).abs() < 0.35, "{rule:?}: order {found}");
        }
    }
}
