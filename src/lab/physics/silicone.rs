//! The silicone beam of [`super::recordings`]: E 263,824 Pa (the source's fit), nu 0.499, 1070 kg/m^3, gravity 9.80709 m/s^2, clamped at
//! one end, let go at time zero. The weight is a point mass along the upper edge of the free end. Markers are fixed to the free
//! end: the vertical displacement of its nodes, fitted by a linear function of the place in the end's plane, is taken at theirs.
//! Each run swings until twice the first lowest point has come, and is then damped critically until it rests.

use std::format;
use std::time::{Duration, Instant};
use std::vec::Vec;

use super::body::{Body, Elastic, SceneWork};
use super::grid::Grid;
use super::recordings::{DAMPING, GRAVITY, LOAD, MARKERS, Measured, Recording};
use super::{LabError, Row};
use crate::element::ElementMaterial;
use crate::inertia::{self, Cells, Damper, LargeStep};
use crate::lab::networks;
use crate::loads::Loads;
use crate::material::Element;
use crate::mlp::Network;
use crate::scene::{Support, VecScene};
use crate::state::VecState;
use crate::step::{Status, Step};
use crate::tled;

pub(super) const NAME: &str = "silicone-beam";
/// The quantity of the picture.
pub(super) const DISTANCE: &str = "gravity: mean distance to the recordings at rest and at the lowest point";
const SIZE: [f64; 3] = [0.1, 0.03, 0.03];
/// 0.51012 N at the recordings' gravity.
const WEIGHT: f64 = 0.052_015;
const PULL: f32 = -9.80709;
const SOURCE: &str = "Soft Robotics Lab; ETH Zurich; srl-ethz/diffPD_sim2real (MIT)";
/// Cells along, across and up.
const MESHES: [[u32; 3]; 4] = [[6, 2, 2], [13, 4, 4], [20, 6, 6], [26, 8, 8]];
/// Time between samples of the swing, s, if steps are shorter.
const SAMPLE: f64 = 1e-3;

/// Steps over the critical one; none are exact ones.
const METHODS: [(&str, Option<f32>); 3] =
    [("exact", None), ("damped 20x", Some(20.0)), ("damped 100x", Some(100.0))];

pub(super) fn rows(meshes: usize) -> Result<Vec<Row>, LabError> {
    let mut rows = Vec::new();
    for cells in MESHES.into_iter().take(meshes) {
        for (load, recordings, seconds, kilogram) in
            [("gravity", &GRAVITY, 0.3, 0.0), ("52 g", &LOAD, 0.58, WEIGHT)]
        {
            let body = body(cells, kilogram);
            let end = body.grid.nodes(|[i, ..]| i == cells[0]);
            for element in Element::ALL {
                for (method, multiple) in METHODS {
                    let run = Run { body: &body, end: &end, seconds, multiple };
                    let (found, us) = body.with(element, run)?;
                    let row = Row {
                        unit: "mm",
                        source: SOURCE,
                        us_per_simulated_second: Some(us),
                        ..body.row(NAME, element, method)
                    };
                    rows.extend(compared(load, recordings, found, &row));
                }
            }
        }
    }
    Ok(rows)
}

/// Rows of one run against both recordings.
fn compared(load: &str, recordings: &[Recording; 2], found: Option<[Measured; 3]>, row: &Row) -> Vec<Row> {
    let mut rows = Vec::new();
    let (mut sum, mut count) = (0.0, 0.0);
    for Recording { name, markers } in recordings {
        for (index, (reference, (marker, _))) in markers.iter().zip(MARKERS).enumerate() {
            let found = found.map(|found| found[index]);
            let mut add = |quantity: &str, unit, value: Option<f64>, reference: f64| {
                rows.push(Row {
                    quantity: format!("{name} {marker}: {quantity}"),
                    unit,
                    // A body that does not swing has no period.
                    value: value.filter(|value| value.is_finite()),
                    reference: Some(reference),
                    ..row.clone()
                });
            };
            add("drop at rest", "mm", found.map(|found| found.rest), reference.rest);
            add("drop at the lowest point", "mm", found.map(|found| found.lowest), reference.lowest);
            add("time of the lowest point", "s", found.map(|found| found.time), reference.time);
            add("period", "s", found.map(|found| found.period), reference.period);
            if let Some(found) = found {
                sum += (found.rest - reference.rest).abs() + (found.lowest - reference.lowest).abs();
                count += 2.0;
            }
        }
    }
    let (_, what) = DISTANCE.split_once(": ").unwrap_or_default();
    let quantity = format!("{load}: {what}");
    rows.push(Row { quantity, value: (count > 0.0).then(|| sum / count), ..row.clone() });
    rows
}

fn body(cells: [u32; 3], kilogram: f64) -> Body {
    let grid = Grid::new(cells, 0.0, |at| core::array::from_fn(|axis| at[axis] * SIZE[axis]));
    let supports = grid.nodes(|[i, ..]| i == 0).into_iter().map(Support::fixed).collect();
    let share = kilogram / f64::from(cells[1]);
    let masses = (0..=cells[1])
        .map(|j| {
            let whole = if j == 0 || j == cells[1] { 0.5 } else { 1.0 };
            (grid.bar.node(cells[0], j, cells[2]), (share * whole) as f32)
        })
        .collect();
    Body { grid, elastic: Elastic { young: 263_824.0, poisson: 0.499 }, density: 1070.0, supports, masses }
}

struct Run<'a> {
    body: &'a Body,
    end: &'a [u32],
    seconds: f64,
    multiple: Option<f32>,
}

impl SceneWork for Run<'_> {
    /// What the markers do, unless the run diverged, and microseconds for a simulated second of the swing.
    type Output = (Option<[Measured; 3]>, f64);

    fn run<M: ElementMaterial>(self, scene: &VecScene<M>) -> Result<Self::Output, LabError> {
        let mut state = VecState::at_rest(scene.node_count());
        let loads = Loads::new(scene, [0.0, 0.0, PULL], &[], &[])?;
        let (mut curve, mut spent) = (std::vec![(0.0, [0.0; 3])], Duration::ZERO);
        let mut advance = self.advance(scene, &mut state, DAMPING)?;
        while state.time() < self.seconds {
            let (until, start) = (state.time() + SAMPLE, Instant::now());
            let taken = advance(&mut state, &loads, until);
            spent += start.elapsed();
            if !taken {
                return Ok((None, 1e6 * spent.as_secs_f64() / state.time()));
            }
            curve.push((state.time(), self.drops(&state)));
        }
        let us = 1e6 * spent.as_secs_f64() / state.time();
        let first = lowest_between(&curve, 1, 0.0, self.seconds).0;

        // Critical damping of the swing, whose frequency is pi over the time of its lowest point.
        let mut advance = self.advance(scene, &mut state, (2.0 * core::f64::consts::PI / first) as f32)?;
        let mut before = [f64::NAN; 3];
        for _ in 0..60 {
            let until = state.time() + first;
            if !advance(&mut state, &loads, until) {
                return Ok((None, us));
            }
            let now = self.drops(&state);
            let settled = now.iter().zip(before).all(|(now, before)| (now - before).abs() < 1e-4 * now);
            before = now;
            if settled {
                let measured = core::array::from_fn(|marker| {
                    let (time, lowest) = lowest_between(&curve, marker, 0.0, self.seconds);
                    let (next, _) = lowest_between(&curve, marker, 2.2 * time, 4.0 * time);
                    Measured { rest: now[marker], lowest, time, period: next - time }
                });
                return Ok((Some(measured), us));
            }
        }
        Err(LabError::NotAtRest { case: NAME })
    }
}

/// Takes steps until a time, s. Says whether they were taken.
type Advance<'a> = std::boxed::Box<dyn FnMut(&mut VecState, &Loads<'_>, f64) -> bool + 'a>;

impl Run<'_> {
    fn advance<'a, M: ElementMaterial>(
        &self,
        scene: &'a VecScene<M>,
        state: &mut VecState,
        damping: f32,
    ) -> Result<Advance<'a>, LabError> {
        // At rest, as a host would choose it.
        let mut at_rest = VecState::at_rest(scene.node_count());
        let critical =
            tled::critical_step(scene, &mut at_rest).ok_or(LabError::NoCriticalStep { scene: NAME })?;
        let Some(multiple) = self.multiple else {
            let step = Step::unchecked(0.9 * critical.seconds, damping)?;
            return Ok(std::boxed::Box::new(move |state, loads, until| {
                while state.time() < until {
                    if let Status::Diverged(_) = tled::step(scene, loads, state, &step) {
                        return false;
                    }
                }
                true
            }));
        };
        let step = Step::unchecked(multiple * critical.seconds, damping)?;
        let damper = Damper::new(Network::parse(networks::damper())?)?;
        let method = inertia::Method::Damped(damper, Cells::Suggested);
        let points = &self.body.grid.points;
        let mut large = LargeStep::prepare_in_vec(method, scene.view(), points, state.view(), step)?;
        Ok(std::boxed::Box::new(move |state, loads, until| {
            while state.time() < until {
                if !large.step(scene.view(), loads, state.view()).is_taken() {
                    return false;
                }
            }
            true
        }))
    }

    /// How far the markers have sunk, mm.
    fn drops(&self, state: &VecState) -> [f64; 3] {
        let count = self.end.len() as f64;
        let (mut mean, mut slopes, mut squares) = (0.0, [0.0; 2], [0.0; 2]);
        for &node in self.end {
            let [_, y, z] = self.body.grid.point(node);
            let drop = -f64::from(state.displacements()[node as usize].to_array()[2]);
            mean += drop / count;
            for (axis, from_middle) in [y - 0.5 * SIZE[1], z - 0.5 * SIZE[2]].into_iter().enumerate() {
                slopes[axis] += drop * from_middle;
                squares[axis] += from_middle * from_middle;
            }
        }
        MARKERS.map(|(_, [y, z])| {
            let [across, up] = [y - 500.0 * SIZE[1], z - 500.0 * SIZE[2]];
            1e3 * mean + across * slopes[0] / squares[0] + up * slopes[1] / squares[1]
        })
    }
}

/// Time (s) and drop (mm) of the lowest point of a marker between two times, of a parabola through three samples.
fn lowest_between(curve: &[(f64, [f64; 3])], marker: usize, from: f64, to: f64) -> (f64, f64) {
    let triples = curve.windows(3).filter(|triple| triple[1].0 > from && triple[1].0 < to);
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
