//! A swing of the silicone beam: how far its markers sink over time, and how far that is from a recording. Markers are
//! fixed to the free end: displacements of its nodes, fitted by a linear function of the place in the end's plane
//! (least squares), are taken at theirs. Lengths in mm, times in s.

use std::time::{Duration, Instant};

use glam::{DMat3, DVec3};
use supple::loads::Loads;
use supple::state::VecState;

use super::mesh::BodyMesh;
use super::recordings::{Curve, LEFT, MARKERS, Measured};
use super::specimen::{Cost, Setup};
use crate::LabError;

/// Time between samples, if steps are shorter.
const SAMPLE: f64 = 1e-3;
/// How far the clock of a recording may be off: the release is known to a frame or two of 10 ms.
const MOST_OFFSET: f64 = 0.02;
const OFFSET_STEP: f64 = 5e-4;

/// The markers on the nodes of the free end.
pub(super) struct Markers(Vec<(u32, [f64; 3])>);

impl Markers {
    /// The end's nodes with their shares in each marker's displacement.
    pub(super) fn on(mesh: &BodyMesh, end: &[u32]) -> Self {
        // Constant, across and up, mm.
        let place = |node: u32| {
            let [_, y, z] = mesh.point(node);
            DVec3::new(1.0, 1e3 * y, 1e3 * z)
        };
        let outer = |p: DVec3| DMat3::from_cols(p * p.x, p * p.y, p * p.z);
        let inverse = end.iter().map(|&node| outer(place(node))).fold(DMat3::ZERO, |sum, outer| sum + outer).inverse();
        let share = |node, [y, z]: [f64; 2]| DVec3::new(1.0, y, z).dot(inverse * place(node));
        Self(end.iter().map(|&node| (node, MARKERS.map(|(_, at)| share(node, at)))).collect())
    }

    /// How far the markers have moved along an axis, mm.
    pub(super) fn moved(&self, state: &VecState, axis: usize) -> [f64; 3] {
        let mut moved = [0.0; 3];
        for (node, shares) in &self.0 {
            let metre = f64::from(state.displacements()[*node as usize].to_array()[axis]);
            for (moved, share) in moved.iter_mut().zip(shares) {
                *moved += 1e3 * share * metre;
            }
        }
        moved
    }

    /// How far they have sunk, mm.
    pub(super) fn drops(&self, state: &VecState) -> [f64; 3] {
        self.moved(state, 2).map(|up| -up)
    }
}

/// Drops of the markers at times.
pub(super) struct Swing(Vec<(f64, [f64; 3])>);

impl Swing {
    /// Lets a body go and watches it for so many seconds with a damping (1/s).
    pub(super) fn of(
        setup: &Setup<'_>,
        loads: &Loads<'_>,
        state: &mut VecState,
        markers: &Markers,
        (seconds, damping): (f64, f32),
    ) -> Result<(Self, Cost), LabError> {
        let (mut samples, mut computing) = (vec![(0.0, [0.0; 3])], Duration::ZERO);
        let mut advance = setup.advance(state, damping)?;
        while state.time() < seconds {
            let (until, start) = (state.time() + SAMPLE, Instant::now());
            advance(state, loads, until)?;
            computing += start.elapsed();
            samples.push((state.time(), markers.drops(state)));
        }
        Ok((Self(samples), Cost { simulated: state.time(), computing }))
    }

    /// Time of the left marker's lowest point.
    pub(super) fn half_period(&self) -> f64 {
        self.lowest_between(LEFT, 0.0, f64::INFINITY).0
    }

    /// What the markers do, with their drops at rest.
    pub(super) fn measured(&self, rest: [f64; 3]) -> [Measured; 3] {
        core::array::from_fn(|marker| {
            let (time, lowest) = self.lowest_between(marker, 0.0, f64::INFINITY);
            let (next, _) = self.lowest_between(marker, 2.2 * time, 4.0 * time);
            let since_tenth = time - self.time_of_tenth(marker, lowest);
            Measured { rest: rest[marker], lowest, time, since_tenth, period: next - time }
        })
    }

    /// Time and drop of the lowest point of a marker between two times, of a parabola through three samples.
    fn lowest_between(&self, marker: usize, from: f64, to: f64) -> (f64, f64) {
        let triples = self.0.windows(3).filter(|triple| triple[1].0 > from && triple[1].0 < to);
        let best = triples.max_by(|a, b| a[1].1[marker].total_cmp(&b[1].1[marker]));
        let Some([a, b, c]) = best.and_then(|triple| triple.first_chunk::<3>()) else {
            return (f64::NAN, f64::NAN);
        };
        let [before, here, after] = [a, b, c].map(|sample| sample.1[marker]);
        let bend = before - 2.0 * here + after;
        if bend >= 0.0 {
            return (b.0, here);
        }
        let offset = 0.5 * (before - after) / bend;
        (b.0 + offset * 0.5 * (c.0 - a.0), here - 0.25 * (before - after) * offset)
    }

    /// When a marker has sunk by a tenth of its lowest drop.
    fn time_of_tenth(&self, marker: usize, lowest: f64) -> f64 {
        let tenth = 0.1 * lowest;
        let Some(after) = self.0.iter().position(|(_, drops)| drops[marker] >= tenth) else {
            return f64::NAN;
        };
        let ((from, before), (to, here)) = (self.0[after.saturating_sub(1)], self.0[after]);
        let root = |drops: [f64; 3]| drops[marker].max(0.0).sqrt();
        let share = (tenth.sqrt() - root(before)) / (root(here) - root(before));
        from + share * (to - from)
    }

    /// Root mean square distance of the left marker's curve from a recorded one, if the swing starts at `offset` on its
    /// clock.
    pub(super) fn distance(&self, curve: &Curve, offset: f64) -> f64 {
        let times = (0..).map(|sample| f64::from(sample) * curve.interval - offset);
        let squares = curve.drops.iter().zip(times).map(|(drop, time)| (self.left_at(time) - drop).powi(2));
        (squares.sum::<f64>() / curve.drops.len() as f64).sqrt()
    }

    /// The offset with the least distance, and that distance.
    pub(super) fn best_offset(&self, curve: &Curve) -> (f64, f64) {
        let most = (MOST_OFFSET / OFFSET_STEP) as i32;
        let offsets = (-most..=most).map(|step| f64::from(step) * OFFSET_STEP);
        let pairs = offsets.map(|offset| (offset, self.distance(curve, offset)));
        pairs.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((f64::NAN, f64::NAN))
    }

    /// Drop of the left marker at a time: none before the release, interpolated between samples.
    fn left_at(&self, time: f64) -> f64 {
        let after = self.0.partition_point(|sample| sample.0 < time);
        let (Some((to, here)), Some((from, before))) = (self.0.get(after), self.0.get(after.wrapping_sub(1))) else {
            return self.0.get(after).or(self.0.last()).map_or(f64::NAN, |sample| sample.1[LEFT]);
        };
        before[LEFT] + (time - from) / (to - from) * (here[LEFT] - before[LEFT])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drop of `5 (1 - exp(-t) cos(40 t))` mm.
    fn swing() -> Swing {
        let drop = |time: f64| 5.0 * (1.0 - (-time).exp() * (40.0 * time).cos());
        let times = (0..400).map(|step| 1e-3 * f64::from(step));
        Swing(times.map(|time| (time, [drop(time); 3])).collect())
    }

    #[test]
    fn a_swing_has_its_lowest_point_period_and_start() {
        let swing = swing();
        let [found, ..] = swing.measured([5.0; 3]);
        let shift = (1.0_f64 / 40.0).atan();
        let time = (core::f64::consts::PI - shift) / 40.0;
        assert!((found.time - time).abs() < 1e-5, "{found:?}");
        assert!((found.lowest - 5.0 * (1.0 + (-time).exp() * shift.cos())).abs() < 1e-4, "{found:?}");
        assert!((found.period - core::f64::consts::PI / 20.0).abs() < 1e-5, "{found:?}");
        let tenth = swing.left_at(found.time - found.since_tenth);
        assert!((tenth - 0.1 * found.lowest).abs() < 1e-3, "{found:?}, {tenth} mm");
    }

    #[test]
    fn the_clock_shift_of_a_late_recording_is_found() {
        let swing = swing();
        let late = Curve { interval: 0.01, drops: core::array::from_fn(|i| swing.left_at(0.01 * i as f64 - 0.008)) };
        let (offset, distance) = swing.best_offset(&late);
        assert!((offset - 0.008).abs() < 1e-9 && distance < 1e-9 && swing.distance(&late, 0.0) > 0.3);
    }
}
