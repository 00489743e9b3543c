//! Random scenes: bodies, materials, supports, loads and courses that nothing was tuned on. The same number gives the
//! same scene.

use glam::Vec3;
use supple::loads::{Motion, NodalForce};
use supple::material::{AnyLaw, Element, Exponential, NeoHookean, Tissue};
use supple::mesh::Bar;
use supple::scene::{Axes, Support};

use super::super::LabError;
use super::super::course::Course;
use super::super::moving::critical_step;
use super::super::random_numbers::Random;
use super::super::scenes::{LOBE, RigidVelocity, SceneSpec, SecondTissue, bar, held_at_its_end, volume};
use super::timing_of;

impl Random {
    /// From `low` to `high`.
    pub(crate) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.next_u64() >> 40) as f32 / (1_u32 << 24) as f32)
    }

    /// The same with a uniform logarithm.
    pub(super) fn scale(&mut self, low: f32, high: f32) -> f32 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub(crate) fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.next_u64() % choices.len() as u64) as usize]
    }

    pub(crate) fn chance(&mut self, share: f32) -> bool {
        self.between(0.0, 1.0) < share
    }

    pub(crate) fn direction(&mut self) -> Vec3 {
        loop {
            let vector = Vec3::from_array([0; 3].map(|_| self.between(-1.0, 1.0)));
            if (0.01..1.0).contains(&vector.length_squared()) {
                return vector.normalize();
            }
        }
    }
}

/// The scene with this number; a scene without a believable truth is drawn anew with the next `attempt`.
pub fn scene(number: u32, attempt: u32) -> Result<SceneSpec, LabError> {
    let mut random = Random(u64::from(number) << 32 | u64::from(attempt));
    let mut spec = body(&mut random)?;
    spec.name = String::leak(format!("random-{number:03}"));
    spec.element = random.one_of(&[Element::Linear, Element::NodalPressure, Element::NodalStrain]);
    let shear = material(&mut spec, &mut random);
    spec.damping = random.one_of(&[0.0, 2.0, 20.0, 20.0]);
    let seconds = random.between(0.2, 0.6);
    let free = random.chance(0.15);
    if !free {
        hold(&mut spec, &mut random);
    }
    load(&mut spec, &mut random, (shear, seconds), free);
    (spec.timing, spec.intervals) = timing_of(critical_step(&spec)?, seconds);
    Ok(spec)
}

/// A bar that is stretched, bent, tapered and shaken, or a lobe of another size.
fn body(random: &mut Random) -> Result<SceneSpec, LabError> {
    if random.chance(0.2) {
        let (mut spec, _) = held_at_its_end("", LOBE)?;
        spec.supports.clear();
        let factors = [0; 3].map(|_| random.between(0.6, 1.6));
        for point in &mut spec.points {
            for (component, factor) in point.iter_mut().zip(factors) {
                *component *= factor;
            }
        }
        return Ok(spec);
    }
    loop {
        let edge = random.scale(3e-3, 1.2e-2);
        let cells = [random.one_of(&[1, 2, 3, 5]), random.one_of(&[2, 3, 5]), random.one_of(&[4, 8, 12, 20])];
        let size = cells.map(|count| count as f32 * edge * random.between(0.7, 1.4));
        let (bend, taper, shake) = (random.between(0.0, 1.5), random.between(0.0, 0.6), random.between(0.0, 0.2));
        let shape = Bar { size, cells };
        let mut spec = SceneSpec { supports: Vec::new(), ..bar("", Vec::new()) };
        spec.tets = shape.tets().collect();
        spec.points = shape
            .points()
            .map(|point| {
                let shaken = [0, 1, 2]
                    .map(|axis| point[axis] + shake * random.between(-1.0, 1.0) * size[axis] / cells[axis] as f32);
                bent(shaken, size, bend, taper)
            })
            .collect();
        for index in (1..spec.tets.len()).rev() {
            spec.tets.swap(index, (random.next_u64() % (index as u64 + 1)) as usize);
        }
        if spec.tets.iter().all(|tet| volume_of(&spec, tet) > 0.0) {
            return Ok(spec);
        }
    }
}

/// A point of a bar along z that becomes thinner and is bent about the y axis by an angle, rad.
fn bent([x, y, z]: [f32; 3], [width, _, length]: [f32; 3], angle: f32, taper: f32) -> [f32; 3] {
    let thinner = 1.0 - taper * z / length;
    let (x, y) = ((x - 0.5 * width) * thinner, y * thinner);
    let radius = length / angle.max(0.01);
    let (sin, cos) = (z / radius).sin_cos();
    [radius - (radius - x) * cos, y, (radius - x) * sin]
}

fn volume_of(spec: &SceneSpec, tet: &[u32; 4]) -> f32 {
    volume(tet.map(|node| Vec3::from(spec.points[node as usize]).as_dvec3())) as f32
}

/// Chooses laws and densities. Gives the shear modulus, Pa.
fn material(spec: &mut SceneSpec, random: &mut Random) -> f32 {
    let shear = random.scale(500.0, 30_000.0);
    let ratio = random.one_of(&[2.2, 5.0, 10.0, 50.0, 500.0]);
    let neo_hookean = |shear: f32| NeoHookean { c: 0.5 * shear, d: 0.5 * ratio * shear };
    spec.law = if random.chance(0.3) {
        AnyLaw::Exponential(Exponential { a: shear, b: random.between(1.0, 8.0), d: 0.5 * ratio * shear })
    } else {
        AnyLaw::NeoHookean(neo_hookean(shear))
    };
    if matches!(spec.law, AnyLaw::NeoHookean(_)) && random.chance(0.25) {
        // Stiffer, softer, heavier or lighter on one side of a plane.
        let (normal, heavier) = (random.direction(), random.scale(0.1, 10.0));
        let law = neo_hookean(shear * random.scale(0.03, 30.0));
        let centre = spec.points.iter().map(|point| Vec3::from(*point)).sum::<Vec3>() / spec.points.len() as f32;
        let side = |tet: &[u32; 4]| {
            let middle = tet.iter().map(|&node| Vec3::from(spec.points[node as usize])).sum::<Vec3>() / 4.0;
            u16::from((middle - centre).dot(normal) > 0.0)
        };
        let of_element = spec.tets.iter().map(side).collect();
        spec.second = Some(SecondTissue { tissue: Tissue { law, density: 1_000.0 * heavier }, of_element });
    }
    shear
}

/// The nodes nearest to a plane or a point: at least three, at most a sixth of all.
fn patch(spec: &SceneSpec, random: &mut Random, share: f32) -> Vec<u32> {
    let point = Vec3::from(random.one_of(&spec.points));
    let normal = random.direction();
    let by_plane = random.chance(0.5);
    let value = |at: &[f32; 3]| {
        let at = Vec3::from(*at);
        if by_plane { at.dot(normal) } else { at.distance(point) }
    };
    lowest(spec.points.iter().map(value), share)
}

/// The nodes with the lowest values, at least three; `values` are those of all.
pub(super) fn lowest(values: impl Iterator<Item = f32>, share: f32) -> Vec<u32> {
    let mut nodes: Vec<(f32, u32)> = values.zip(0..).collect();
    nodes.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let count = ((share * nodes.len() as f32) as usize).max(3);
    nodes.into_iter().take(count).map(|(_, node)| node).collect()
}

fn hold(spec: &mut SceneSpec, random: &mut Random) {
    let share = random.between(0.01, 0.15);
    spec.supports = patch(spec, random, share).into_iter().map(Support::fixed).collect();
}

/// Gravity, a force or a motion of a patch, or a velocity at the start.
fn load(spec: &mut SceneSpec, random: &mut Random, (shear, seconds): (f32, f32), free: bool) {
    let volume: f32 = spec.tets.iter().map(|tet| volume_of(spec, tet)).sum();
    let size = volume.cbrt();
    let ramp = if random.chance(0.4) { 0.0 } else { random.between(0.1, 0.8) * seconds };
    let seconds = f64::from(seconds);
    let course = |random: &mut Random| match random.next_u64() % 5 {
        0 => Course::Released(seconds * f64::from(random.between(0.3, 0.7))),
        1 => Course::Reversed(seconds * f64::from(random.between(0.3, 0.7))),
        2 => Course::Alternating(f64::from(random.scale(0.01, 0.5))),
        _ => Course::Steady,
    };
    let kind = if free { random.next_u64() % 2 } else { random.next_u64() % 4 };
    if free && kind == 0 {
        spec.start = RigidVelocity {
            linear: (random.direction() * random.between(0.0, 0.5)).to_array(),
            angular: (random.direction() * random.between(2.0, 30.0)).to_array(),
        };
        return;
    }
    match kind {
        // A force of up to three tenths of the shear modulus on the mean cross-section.
        0 | 1 => {
            let nodes = patch(spec, random, 0.08);
            let whole = random.direction() * random.scale(0.01, 0.3) * shear * size * size;
            let newton = (whole / nodes.len() as f32).to_array();
            spec.forces = nodes.into_iter().map(|node| NodalForce { node, newton, ramp }).collect();
            spec.course = course(random);
        }
        2 => spec.gravity = (random.direction() * 9.81).to_array(),
        _ => {
            let held: Vec<u32> = spec.supports.iter().map(|support| support.node).collect();
            let metre = (random.direction() * random.between(0.05, 0.4) * size).to_array();
            let nodes: Vec<u32> = patch(spec, random, 0.05).into_iter().filter(|node| !held.contains(node)).collect();
            spec.motions =
                nodes.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp: ramp.max(0.05) }).collect();
            spec.supports.extend(nodes.iter().map(|&node| Support::moved(node)));
            if random.chance(0.3) {
                spec.course = Course::Alternating(f64::from(random.scale(0.1, 0.5)));
            }
        }
    }
}
