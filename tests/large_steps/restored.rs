//! A guard whose state is restored, reset, put or exchanged for a copy, whatever steps follow: it begins a second run
//! anew, and no estimate is negative or no number.

use std::hash::{DefaultHasher, Hash, Hasher};

use supple::guard::{EVERY, Estimate, Guard};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::material::VecMaterial;
use supple::scene::{AsScene, VecScene};
use supple::state::{NodeVector, Progress, StateView};
use supple::step::{Status, Step};
use supple::tled;

use crate::large_steps::{VecLargeStep, limit};
use crate::reference::Random;
use crate::support::bodies::held;
use crate::support::{Body, NEO, tissue};

type VecGuard = Guard<Vec<NodeVector>>;

const DAMPING: f32 = 5.0;
const GRAVITY: [f32; 3] = [3.0, 0.0, 0.0];

/// A state in memory of the host's: a clone is a copy by memcpy.
#[derive(Clone)]
struct Memory {
    vectors: [Vec<NodeVector>; 4],
    progress: Progress,
}

impl Memory {
    fn at_rest(nodes: usize) -> Self {
        Self { vectors: [(); 4].map(|()| vec![NodeVector::ZERO; nodes]), progress: Progress::START }
    }

    fn view(&mut self) -> StateView<'_> {
        let [displacement, remainder, increment, force] = &mut self.vectors;
        StateView::new(displacement, remainder, increment, force, &mut [], &mut self.progress)
    }

    /// The same for the same state, to the bit.
    fn hash(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        let [moved @ .., _] = &self.vectors;
        for vector in moved.iter().flatten() {
            vector.to_array().map(f32::to_bits).hash(&mut hasher);
        }
        self.progress.time().to_bits().hash(&mut hasher);
        hasher.finish()
    }

    /// What comes back from a file.
    fn read_back(&self) -> Self {
        let progress = &self.progress;
        let energy = *progress.energy_balance();
        let progress = Progress::resumed(progress.time(), progress.steps(), progress.last_step(), energy);
        Self { progress, vectors: self.vectors.clone() }
    }
}

struct Guarded {
    scene: VecScene<VecMaterial>,
    points: Vec<[f32; 3]>,
    critical: f32,
    state: Memory,
    large: VecLargeStep,
    guard: VecGuard,
}

impl Guarded {
    /// A bar that gravity bends, and steps of 20 times the critical one.
    fn new() -> Self {
        let body = Body::bar([0.02, 0.02, 0.06], [2, 2, 6]);
        let scene = body.scene(tissue(NEO), &held(&body));
        let critical = limit(&scene);
        let mut state = Memory::at_rest(scene.node_count());
        let step = Step::unchecked(20.0 * critical, DAMPING).unwrap();
        let method = Method::new(Cells::Suggested);
        let large = LargeStep::prepare_in_vec(method, scene.view(), &body.points, state.view(), step).unwrap();
        let guard = Guard::prepare_in_vec(scene.view(), &body.points, state.view(), step, EVERY).unwrap();
        Self { scene, points: body.points, critical, state, large, guard }
    }

    /// A guard that is prepared for the state as it is now.
    fn another_guard(&mut self) -> VecGuard {
        let step = Step::unchecked(20.0 * self.critical, DAMPING).unwrap();
        Guard::prepare_in_vec(self.scene.view(), &self.points, self.state.view(), step, EVERY).unwrap()
    }

    /// Whether it was taken.
    fn long_step(&mut self) -> bool {
        let loads = Loads::new(&self.scene, GRAVITY, &[], &[]).unwrap();
        self.large.step(self.scene.view(), &loads, self.state.view()).is_taken()
    }

    /// Whether all were taken.
    fn exact_steps(&mut self, count: usize) -> bool {
        let loads = Loads::new(&self.scene, GRAVITY, &[], &[]).unwrap();
        let step = Step::unchecked(0.4 * self.critical, DAMPING).unwrap();
        (0..count).all(|_| tled::step(&self.scene.as_scene(), &loads, &mut self.state.view(), &step).is_taken())
    }

    fn follow(&mut self) -> (Status, Option<Estimate>) {
        let loads = Loads::new(&self.scene, GRAVITY, &[], &[]).unwrap();
        let status = self.guard.follow(Status::Ok, self.scene.view(), &loads, self.state.view());
        let estimate = self.guard.estimate();
        if let Some(Estimate { mean, largest, allowed, .. }) = estimate {
            assert!([mean, largest, allowed].iter().all(|value| value.is_finite()), "{estimate:?}");
            assert!(0.0 <= mean && mean <= largest && allowed > 0.0, "{estimate:?}");
        }
        (status, estimate)
    }
}

/// The recipe of `docs/embedding.md`: back to what was saved, and from there by exact steps.
#[test]
fn shorter_steps_after_a_restore_begin_a_second_run_as_well() {
    for memcpy in [false, true] {
        let mut run = Guarded::new();
        let saved = run.state.clone();
        for _ in 0..3 {
            assert!(run.long_step());
            assert!(run.follow().1.is_some());
        }
        run.state = if memcpy { saved } else { saved.read_back() };
        assert!(run.exact_steps(6));
        assert_eq!(run.follow(), (Status::Ok, None), "a copy: {memcpy}");
        let mut last = None;
        for _ in 0..200 {
            assert!(run.exact_steps(6));
            last = run.follow().1.or(last);
        }
        // Exact steps have hardly an error: what is estimated is that of the second run.
        let Estimate { mean, .. } = last.unwrap();
        let motion = run.state.vectors[0].iter().map(|u| u.to_array().map(f32::abs).into_iter().fold(0.0, f32::max));
        let most = motion.fold(0.0, f32::max);
        println!("{:.3} mm estimated of {:.2} mm", 1e3 * mean, 1e3 * most);
        assert!(mean > 0.0 && mean < most && most > 1e-3);
    }
}

/// A guard that is shown the restored state before a step is as good as a new one, to the bit; one that is shown it
/// after a step has not seen that step.
#[test]
fn a_restored_run_is_estimated_as_by_a_new_guard() {
    let mut run = Guarded::new();
    for _ in 0..20 {
        assert!(run.long_step());
        let _ = run.follow();
    }
    let saved = run.state.clone();
    for _ in 0..30 {
        assert!(run.long_step());
        let _ = run.follow();
    }
    let estimates = |run: &mut Guarded| -> Vec<_> {
        let estimates = (0..40).map(|_| {
            assert!(run.long_step());
            run.follow()
        });
        estimates.collect()
    };
    run.state = saved.read_back();
    assert_eq!(run.follow(), (Status::Ok, None));
    let restored = estimates(&mut run);
    run.state = saved.read_back();
    run.guard = run.another_guard();
    let new = estimates(&mut run);
    assert!(restored.iter().all(|(_, estimate)| estimate.is_some()));
    assert_eq!(restored, new);
}

/// Kept with each copy of a state: the state that a guard saw last of those that it comes from.
type Seen = Option<u64>;

#[test]
fn random_sessions_never_compare_with_the_second_run_of_another_state() {
    const SESSIONS: u64 = 60;
    let (mut known, mut begun, mut overtaken, mut refused) = (0, 0, 0, 0);
    for session in 0..SESSIONS {
        let mut random = Random(session);
        let mut below = |count: usize| ((0.5 + 0.5 * random.next()) * count as f64) as usize;
        let mut run = Guarded::new();
        let (mut last, mut last_steps) = (run.state.hash(), 0);
        let mut seen: Seen = Some(last);
        let mut saved: Vec<(Memory, Seen)> = vec![(run.state.clone(), seen)];
        for _ in 0..60 {
            let mut taken = true;
            match below(12) {
                0 | 1 => saved.push((run.state.clone(), seen)),
                2 => (run.state, seen) = saved[below(saved.len())].clone(),
                3 => (run.state, seen) = (saved[below(saved.len())].0.read_back(), None),
                4 if below(3) == 0 => {
                    run.state.view().reset();
                    seen = None;
                }
                4 if below(2) == 0 => {
                    let (time, seconds) = (0.9 * run.state.progress.time(), run.critical);
                    run.state.view().put(time, seconds, |_| [[0.0; 3]; 2]);
                    seen = None;
                }
                5 => run.large.set_seconds(run.critical * [20.0, 13.0, 7.0][below(3)]).unwrap(),
                6 | 7 => taken = run.exact_steps(1 + below(40)),
                _ => taken = (0..=below(3)).all(|_| run.long_step()),
            }
            if !taken {
                refused += 1;
                (run.state, seen) = (saved[0].0.read_back(), None);
            }
            if below(3) > 0 {
                let comes_from_last = seen == Some(last);
                let (status, estimate) = run.follow();
                if !comes_from_last {
                    assert_eq!((status, estimate), (Status::Ok, None), "session {session}");
                    begun += 1;
                    overtaken += usize::from(run.state.progress.steps() > last_steps);
                }
                known += usize::from(estimate.is_some());
                (last, last_steps) = (run.state.hash(), run.state.progress.steps());
                seen = Some(last);
            }
        }
    }
    println!(
        "{known} estimates; begun anew {begun} times, {overtaken} of them with more steps than the state before; \
         {refused} times refused"
    );
    assert!(known > 500 && begun > 300 && overtaken > 50);
}
