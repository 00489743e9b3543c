//! Elements at strains beyond a half: a cube between plates, sheared and dented by 20 to 80 %, of tissue that does not
//! stiffen and of one that does, on coarse meshes. The truth is nodal pressure on two fine meshes, extrapolated to cells
//! of no size: strain is infinite at the edges of bonded faces, so that errors fall as cells do (order 1), which nodal
//! strain on the same meshes confirms. SI units inside, millimetres in tables.

mod cases;
pub mod report;
mod rest;
mod truth;

use glam::DVec3;
use supple::material::Element;

use super::LabError;
use super::threads::in_parallel;
use cases::Body;
pub use cases::{Case, Law};
pub use rest::End;
use rest::{Shape, shapes};
pub use truth::{AGREED, FOLDED, Truth};
use truth::{distance, truth};

/// What to run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// How far supports go, rising, as shares.
    pub shares: Vec<f64>,
    /// Cells across the cube, multiples of three.
    pub across: Vec<u32>,
    /// The same of the two meshes of the truth, the finer one first, multiples of six.
    pub truth: [u32; 2],
    /// Of the truth.
    pub truth_element: Element,
    /// `b` of the exponential law.
    pub stiffening: f32,
}

impl Plan {
    /// All of it.
    #[must_use]
    pub fn full() -> Self {
        let shares = vec![0.2, 0.4, 0.6, 0.8];
        let truth_element = Element::NodalPressure;
        Self { shares, across: vec![6, 9], truth: [36, 24], truth_element, stiffening: 5.0 }
    }

    /// A few seconds of it: small strains on coarse meshes, whose figures mean nothing.
    #[must_use]
    pub fn quick() -> Self {
        Self { shares: vec![0.2, 0.4], across: vec![3], truth: [12, 6], ..Self::full() }
    }
}

/// An element against the truth.
#[derive(Clone, Debug)]
pub struct Row {
    /// Position of the truth in its list.
    pub truth: usize,
    /// The element.
    pub element: Element,
    /// Cells across the cube.
    pub across: u32,
    /// How it ended.
    pub end: End,
    /// N.
    pub force: f64,
    /// Over that of the truth, less one, %.
    pub force_error: f64,
    /// Root mean square of the distance of the free nodes from the truth, mm.
    pub distance: f64,
    /// The same as a share of the way of the supports, %.
    pub distance_share: f64,
    /// The least volume ratio of an element.
    pub least: f64,
}

impl Row {
    /// Whether it may be believed: at rest, no element inside out.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        matches!(self.end, End::Rest | End::Limited) && self.least > 0.0
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Of each case, tissue and share.
    pub truths: Vec<Truth>,
    /// Of each truth, element and mesh.
    pub rows: Vec<Row>,
}

/// A body with an element, brought to each share.
struct Job {
    case: Case,
    law: Law,
    element: Element,
    across: u32,
    is_truth: bool,
}

/// Runs the plan on two threads; `tick` is told what is done.
pub fn evaluate(plan: &Plan, mut tick: impl FnMut(&str)) -> Result<Found, LabError> {
    let pairs: Vec<_> = Case::ALL.into_iter().flat_map(|case| Law::ALL.map(|law| (case, law))).collect();
    let mut jobs = Vec::new();
    for &across in &plan.truth {
        let element = plan.truth_element;
        jobs.extend(pairs.iter().map(|&(case, law)| Job { case, law, element, across, is_truth: true }));
    }
    for &across in &plan.across {
        for element in Element::ALL {
            jobs.extend(pairs.iter().map(|&(case, law)| Job { case, law, element, across, is_truth: false }));
        }
    }
    let run = |job: &Job| {
        let body = Body::new(job.case, job.across, job.is_truth);
        let shapes = shapes(&body, job.element, job.law.with_constants(plan.stiffening), &plan.shares)?;
        Ok((body, shapes))
    };
    let runs = in_parallel(
        jobs.len(),
        |job| run(&jobs[job]),
        |job, (body, shapes)| {
            let Job { case, law, element, across, .. } = &jobs[job];
            let steps: Vec<u32> = shapes.iter().map(|shape| shape.steps).collect();
            let tets = body.tets.len();
            tick(&format!(
                "{} {} {} {across} across: {tets} tetrahedra, steps {steps:?}",
                case.name(),
                law.name(),
                element.name()
            ));
        },
    )?;
    // The error of the finer mesh over the difference between the two, at order 1.
    let [fine, less] = plan.truth.map(f64::from);
    let beyond = less / (fine - less);
    let (mut truths, mut rows) = (Vec::new(), Vec::new());
    for (pair, &(case, law)) in pairs.iter().enumerate() {
        let fine = [&runs[pair], &runs[pairs.len() + pair]];
        for (at, &share) in plan.shares.iter().enumerate() {
            let pair = fine.map(|(body, shapes)| (body, &shapes[at]));
            let truth = truth(case, law, share, pair, beyond);
            for (job, (body, shapes)) in jobs.iter().zip(&runs) {
                if (job.case, job.law, job.is_truth) == (case, law, false) {
                    let Shape { end, force, least, .. } = shapes[at];
                    let distance = 1e3 * distance(pair, beyond, body, &shapes[at])?;
                    rows.push(Row {
                        truth: truths.len(),
                        element: job.element,
                        across: job.across,
                        end,
                        force,
                        force_error: 100.0 * (force / truth.force - 1.0),
                        distance,
                        distance_share: 0.1 * distance / (share * case.way()),
                        least,
                    });
                }
            }
            truths.push(truth);
        }
    }
    Ok(Found { truths, rows })
}

fn vector(of: [f32; 3]) -> DVec3 {
    DVec3::from_array(of.map(f64::from))
}
