//! The truth: the exact step at a scene's step or a part of it, with displacements after every interval and the exact
//! limit of stability, at rest and the least along the motion. SI units.
//!
//! Truths are kept on disk, one file a scene, little endian: `suppleT1`, key of the scene, counts, limits,
//! displacements, and an FNV-1a checksum of all that. A file that does not match, because scene or kernel have changed
//! or the disk is damaged, is computed again.

use core::fmt;
use std::fs;
use std::path::Path;

use supple::io::write_atomically;
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use super::LabError;
use super::scenes::SceneSpec;
use super::threads::in_parallel;

/// First bytes of a file, with the version of its format.
const MAGIC: &[u8; 8] = b"suppleT1";
/// Magic, key, nodes, snapshots, three limits, limited steps.
const HEADER: usize = 64;

/// The exact limit is computed at rest and at every snapshot; in between wherever the bound of [`tled::critical_step`],
/// computed every `LOOK_STEPS` steps, has fallen by the share `FALL` below its least so far.
const LOOK_STEPS: u32 = 10;
const FALL: f32 = 0.02;

/// The exact motion of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Displacement of each node (m) after each interval.
    pub snapshots: Vec<Vec<[f32; 3]>>,
    /// The exact limit of stability at rest, s.
    pub limit_at_rest: f64,
    /// The least along the motion, s.
    pub limit_least: f64,
    /// When that was, s.
    pub limit_least_time: f64,
    /// Steps with elements beyond the range of their law.
    pub limited_steps: u64,
}

impl Truth {
    /// The largest displacement of a node at any snapshot, m.
    #[must_use]
    pub fn most(&self) -> f64 {
        let nodes = self.snapshots.iter().flatten();
        let square = |node: &[f32; 3]| node.iter().map(|u| f64::from(*u).powi(2)).sum::<f64>();
        nodes.map(square).fold(0.0, f64::max).sqrt()
    }
}

/// The truths of `scenes`, in their order, from files in `folder` or computed on two threads and put there, and the
/// scenes, in parts of a step where their critical step falls along the motion. `tick` is called with each that is ready.
pub fn obtain(
    scenes: &[SceneSpec],
    folder: &Path,
    mut tick: impl FnMut(&SceneSpec, &Truth),
) -> Result<Vec<(SceneSpec, Truth)>, LabError> {
    super::create_folder(folder)?;
    in_parallel(scenes.len(), |index| obtain_one(scenes[index].clone(), folder), |_, (spec, truth)| tick(spec, truth))
}

pub(super) fn obtain_one(mut scene: SceneSpec, folder: &Path) -> Result<(SceneSpec, Truth), LabError> {
    loop {
        match of_file_or_computed(&scene, folder) {
            Err(LabError::Diverged { .. }) if scene.timing.refinement < 20 => scene.timing.refinement *= 3,
            other => return other.map(|truth| (scene, truth)),
        }
    }
}

fn of_file_or_computed(scene: &SceneSpec, folder: &Path) -> Result<Truth, LabError> {
    let key = key(scene)?;
    let path = folder.join(format!("{}.bin", scene.name));
    let shape = (scene.points.len(), scene.intervals);
    if let Some(truth) = fs::read(&path).ok().and_then(|bytes| decode(&bytes, key, shape)) {
        return Ok(truth);
    }
    let truth = compute(scene)?;
    write_atomically(&path, |file| file.write_all(&encode(&truth, key)))?;
    Ok(truth)
}

/// Computes the truth of a scene.
pub fn compute(scene: &SceneSpec) -> Result<Truth, LabError> {
    of_steps(scene, scene.timing.interval * scene.timing.refinement)
}

/// With so many steps in an interval.
fn of_steps(spec: &SceneSpec, steps: u32) -> Result<Truth, LabError> {
    let scene = spec.build()?;
    let dt = spec.timing.step / spec.timing.refinement as f32;
    let mut state = spec.state(&scene, dt)?;
    let limit = |state: &VecState| {
        tled::exact_critical_step(scene.view(), state.displacements())
            .ok_or(LabError::NoCriticalStep { scene: spec.name })
    };
    let limit_at_rest = limit(&state)?;
    let step = Step::unchecked(dt, spec.damping)?;
    let mut truth = Truth {
        snapshots: Vec::new(),
        limit_at_rest,
        limit_least: limit_at_rest,
        limit_least_time: 0.0,
        limited_steps: 0,
    };
    let mut least_bound = f32::INFINITY;
    let mut loads = spec.loads(&scene)?;
    for _ in 0..spec.intervals {
        for count in 1..=steps {
            let loads = loads.of_step(state.time(), f64::from(dt));
            let status = tled::step(&scene, &loads, &mut state, &step);
            LabError::if_refused(spec.name, status)?;
            truth.limited_steps += u64::from(status != Status::Ok);
            let mut measure = count == steps;
            if count % LOOK_STEPS == 0 {
                let bound = tled::critical_step(&scene, &mut state).map_or(0.0, |bound| bound.seconds);
                measure |= bound < (1.0 - FALL) * least_bound;
                if measure {
                    least_bound = least_bound.min(bound);
                }
            }
            if measure {
                let limit = limit(&state)?;
                if limit < truth.limit_least {
                    (truth.limit_least, truth.limit_least_time) = (limit, state.time());
                }
            }
        }
        let shape = state.displacements().iter().map(|vector| vector.to_array());
        truth.snapshots.push(shape.collect());
    }
    Ok(truth)
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo): against accidents, not against forgery.
struct Fnv(u64);

impl Fnv {
    const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    fn add(mut self, bytes: &[u8]) -> Self {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
        self
    }
}

impl fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        *self = Self(self.0).add(text.as_bytes());
        Ok(())
    }
}

/// A hash of all that the truth depends on: the scene as text, which has all digits of a float32, and the kernel's
/// first steps.
pub fn key(scene: &SceneSpec) -> Result<u64, LabError> {
    /// Enough for all forces and laws to have an effect.
    const STEPS: u32 = 10;
    let brief = SceneSpec { intervals: 1, ..scene.clone() };
    let start = of_steps(&brief, STEPS)?;
    let mut hash = Fnv::EMPTY.add(&encode(&start, 0));
    // Hashing does not fail.
    let _ = fmt::write(&mut hash, format_args!("{LOOK_STEPS} {FALL} {scene:?}"));
    Ok(hash.0)
}

fn encode(truth: &Truth, key: u64) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    let counts = [key, truth.snapshots.first().map_or(0, Vec::len) as u64, truth.snapshots.len() as u64];
    let limits = [truth.limit_at_rest, truth.limit_least, truth.limit_least_time];
    bytes.extend(counts.iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend(limits.iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend(truth.limited_steps.to_le_bytes());
    for shape in &truth.snapshots {
        bytes.extend(shape.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    }
    let sum = Fnv::EMPTY.add(&bytes).0;
    bytes.extend(sum.to_le_bytes());
    bytes
}

/// The truth in `bytes`, if they hold one of a scene with this key, number of nodes and of snapshots.
fn decode(bytes: &[u8], expected: u64, (nodes, snapshots): (usize, usize)) -> Option<Truth> {
    let size = nodes.checked_mul(snapshots)?.checked_mul(12)?.checked_add(HEADER)?;
    let (content, sum) = bytes.split_last_chunk::<8>().map(|(content, sum)| (content, u64::from_le_bytes(*sum)))?;
    if content.len() != size || Fnv::EMPTY.add(content).0 != sum {
        return None;
    }
    let (header, data) = content.split_at_checked(HEADER)?;
    let words: Vec<[u8; 8]> = header.as_chunks().0.to_vec();
    let [magic, key, n, count, rest, least, time, limited] = words.try_into().ok()?;
    let [key, n, count, limited_steps] = [key, n, count, limited].map(u64::from_le_bytes);
    if magic != *MAGIC || key != expected || n != nodes as u64 || count != snapshots as u64 {
        return None;
    }
    let [limit_at_rest, limit_least, limit_least_time] = [rest, least, time].map(f64::from_le_bytes);
    let floats: Vec<f32> = data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let snapshots = floats.as_chunks().0.chunks_exact(nodes).map(<[_]>::to_vec).collect();
    Some(Truth { snapshots, limit_at_rest, limit_least, limit_least_time, limited_steps })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Truth {
        Truth {
            snapshots: vec![vec![[0.0; 3]; 2], vec![[1.0, 2.0, 3.0], [0.5, -0.25, 1e-9]]],
            limit_at_rest: 2e-4,
            limit_least: 1e-4,
            limit_least_time: 0.5,
            limited_steps: 7,
        }
    }

    #[test]
    fn a_file_gives_back_what_went_in() {
        let truth = example();
        assert_eq!(decode(&encode(&truth, 42), 42, (2, 2)), Some(truth));
    }

    #[test]
    fn a_damaged_file_is_refused() {
        let sound = encode(&example(), 42);
        for place in 0..sound.len() {
            let mut bytes = sound.clone();
            bytes[place] ^= 1;
            assert_eq!(decode(&bytes, 42, (2, 2)), None, "byte {place}");
        }
        for length in 0..sound.len() {
            assert_eq!(decode(&sound[..length], 42, (2, 2)), None, "cut to {length} bytes");
        }
        assert_eq!(decode(&[sound.as_slice(), &[0]].concat(), 42, (2, 2)), None);
        assert_eq!(decode(&sound, 43, (2, 2)), None);
        assert_eq!(decode(&sound, 42, (2, 3)), None);
    }
}
