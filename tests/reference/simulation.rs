//! Nodal forces and time integration.
//!
//! `M a + mu M v + f_int(u) = f_ext(t)`, `M` lumped, by central differences in increment form:
//!
//! ```text
//! k     = mu dt / 2
//! du'   = ((1 - k) du + dt^2 (f_ext(t_n) - f_int(u_n)) / m) / (1 + k)
//! u_n+1 = u_n + du'
//! ```
//!
//! Forces are taken at `t_n = n dt`, prescribed positions at `t_n+1`. The start is at rest, `u_0 = u_-1 = 0`:
//! the velocity is zero at `t = -dt/2`, so under a load that is already on at `t = 0` the solution runs
//! `dt/2` ahead of the exact one (first order); with a load that ramps up from zero it is second order.

use super::law::Law;
use super::mesh::{Element, Mesh};
use super::tensor::{Vec3, apply, dot};

/// Internal forces in N: the gradient of the strain energy, `f_a = sum_e V P grad N_a`.
pub fn internal_force(mesh: &Mesh, law: &Law, u: &[Vec3]) -> Vec<Vec3> {
    element_forces(&mesh.elements(), law, u)
}

fn element_forces(elements: &[Element], law: &Law, u: &[Vec3]) -> Vec<Vec3> {
    let mut force = vec![[0.0; 3]; u.len()];
    for element in elements {
        let p = law.first_piola(&element.deformation_gradient(u));
        for (node, gradient) in element.nodes.iter().zip(element.gradients) {
            let f = apply(&p, gradient);
            for axis in 0..3 {
                force[*node][axis] += element.volume * f[axis];
            }
        }
    }
    force
}

/// Strain energy in J, `sum_e V Psi(F)`.
pub fn strain_energy(mesh: &Mesh, law: &Law, u: &[Vec3]) -> f64 {
    mesh.elements().iter().map(|e| e.volume * law.energy(&e.deformation_gradient(u))).sum()
}

/// The factor of a load at time `t` that ramps up in `seconds`: `min(1, t / seconds)`, 1 where `seconds = 0`.
pub fn ramp(t: f64, seconds: f64) -> f64 {
    if seconds > 0.0 { (t / seconds).min(1.0) } else { 1.0 }
}

/// A force on a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodalForce {
    /// Node id.
    pub node: usize,
    /// Full force in N.
    pub newton: Vec3,
    /// Ramp in s, 0 for a step.
    pub ramp: f64,
}

/// A prescribed displacement of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Node id.
    pub node: usize,
    /// Axes that follow; the others stay free or fixed.
    pub axes: [bool; 3],
    /// Full displacement in m.
    pub metre: Vec3,
    /// Ramp in s, 0 for a step.
    pub ramp: f64,
}

/// Energies in J at the last half step `t_n-1/2`. Undamped and unforced, `kinetic + strain` is constant up to
/// `O(dt^2)`; always, `kinetic + strain + dissipated - external_work` is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// `sum m |du/dt|^2 / 2`.
    pub kinetic: f64,
    /// Strain energy halfway between `u_n-1` and `u_n`.
    pub strain: f64,
    /// Work of forces, gravity and prescribed motions since the start.
    pub external_work: f64,
    /// Work lost to damping since the start.
    pub dissipated: f64,
}

/// A body, its supports and loads, and its state.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The mesh.
    pub mesh: Mesh,
    /// The material.
    pub law: Law,
    /// Nodal masses in kg.
    pub mass: Vec<f64>,
    /// Time step in s.
    pub dt: f64,
    /// Mass-proportional damping in 1/s.
    pub mu: f64,
    /// Held degrees of freedom, per node and axis.
    pub fixed: Vec<[bool; 3]>,
    /// Nodal forces; several on one node add up.
    pub forces: Vec<NodalForce>,
    /// Prescribed motions; they go before `fixed`, and the last one of a node and axis wins.
    pub motions: Vec<Motion>,
    /// Acceleration of gravity in m/s^2.
    pub gravity: Vec3,
    /// Ramp of gravity in s, 0 for a step.
    pub gravity_ramp: f64,
    /// Displacements `u_n` in m.
    pub u: Vec<Vec3>,
    /// Last increment `u_n - u_n-1` in m.
    pub du: Vec<Vec3>,
    /// Steps made, `n`.
    pub steps: u64,
    external_work: f64,
    dissipated: f64,
    elements: Vec<Element>,
}

impl Simulation {
    /// A free, unloaded, undamped body at rest; density in kg/m^3, step in s.
    pub fn new(mesh: Mesh, law: Law, density: f64, dt: f64) -> Simulation {
        let nodes = mesh.points.len();
        Simulation {
            law,
            mass: mesh.lumped_mass(density),
            dt,
            mu: 0.0,
            fixed: vec![[false; 3]; nodes],
            forces: Vec::new(),
            motions: Vec::new(),
            gravity: [0.0; 3],
            gravity_ramp: 0.0,
            u: vec![[0.0; 3]; nodes],
            du: vec![[0.0; 3]; nodes],
            steps: 0,
            external_work: 0.0,
            dissipated: 0.0,
            elements: mesh.elements(),
            mesh,
        }
    }

    /// Holds these nodes along all axes.
    pub fn fix(&mut self, nodes: &[usize]) {
        for node in nodes {
            self.fixed[*node] = [true; 3];
        }
    }

    /// `t_n = n dt` in s.
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.dt
    }

    /// Loads at time `t` in N: nodal forces and weight.
    pub fn external_force(&self, t: f64) -> Vec<Vec3> {
        let weight = ramp(t, self.gravity_ramp);
        let mut force: Vec<Vec3> = self.mass.iter().map(|m| self.gravity.map(|g| weight * m * g)).collect();
        for load in &self.forces {
            for (f, newton) in force[load.node].iter_mut().zip(load.newton) {
                *f += ramp(t, load.ramp) * newton;
            }
        }
        force
    }

    /// Internal forces in N at `u_n`.
    pub fn internal_force(&self) -> Vec<Vec3> {
        element_forces(&self.elements, &self.law, &self.u)
    }

    /// One step, from `t_n` to `t_n+1`.
    pub fn step(&mut self) {
        let dt = self.dt;
        let k = self.mu * dt / 2.0;
        let t = self.time();
        let t_next = (self.steps + 1) as f64 * dt;
        let internal = self.internal_force();
        let external = self.external_force(t);
        let mut prescribed = vec![[None; 3]; self.u.len()];
        for motion in &self.motions {
            for axis in (0..3).filter(|axis| motion.axes[*axis]) {
                prescribed[motion.node][axis] = Some(ramp(t_next, motion.ramp) * motion.metre[axis]);
            }
        }

        for node in 0..self.u.len() {
            let m = self.mass[node];
            for axis in 0..3 {
                let f = external[node][axis] - internal[node][axis];
                let old = self.du[node][axis];
                let free = ((1.0 - k) * old + dt * dt * f / m) / (1.0 + k);
                let new = match prescribed[node][axis] {
                    Some(position) => position - self.u[node][axis],
                    None if self.fixed[node][axis] => 0.0,
                    None => free,
                };
                // Force of the constraint, 0 for a free one, from m a + mu m v = f + reaction.
                let reaction = m / (dt * dt) * (1.0 + k) * (new - free);
                let path = (old + new) / 2.0;
                self.external_work += (external[node][axis] + reaction) * path;
                self.dissipated += self.mu * m * path * path / dt;
                self.du[node][axis] = new;
                self.u[node][axis] += new;
            }
        }
        self.steps += 1;
    }

    /// `count` steps.
    pub fn run(&mut self, count: u64) {
        for _ in 0..count {
            self.step();
        }
    }

    /// Kinetic energy in J at the last half step.
    pub fn kinetic_energy(&self) -> f64 {
        let dt2 = self.dt * self.dt;
        self.mass.iter().zip(&self.du).map(|(m, du)| 0.5 * m * dot(*du, *du) / dt2).sum()
    }

    /// The energy balance at the last half step.
    pub fn energy(&self) -> Energy {
        let halfway: Vec<Vec3> =
            (self.u.iter().zip(&self.du)).map(|(u, du)| std::array::from_fn(|axis| u[axis] - 0.5 * du[axis])).collect();
        Energy {
            kinetic: self.kinetic_energy(),
            strain: strain_energy(&self.mesh, &self.law, &halfway),
            external_work: self.external_work,
            dissipated: self.dissipated,
        }
    }
}
