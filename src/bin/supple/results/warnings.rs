//! What is not as it should be, in sentences.

use supple::material::J_FLOOR;

use crate::run::outcome::{LearnedTrace, Limits, Outcome};
use crate::scene::setup::Setup;

/// Share of the vertices outside a network's training, on average, from which on it is remarked upon.
const OUTSIDE: f64 = 0.01;

/// Of the scene, then of what became of it.
pub(crate) fn of(setup: &Setup, outcome: &Outcome) -> Vec<String> {
    let mut warnings = setup.warnings.clone();
    if setup.tissues.relax() {
        warnings.push("the frames have no von Mises stress: it is not known of tissue that relaxes".into());
    }
    warnings.extend(of_run(setup, outcome));
    warnings
}

/// Of what became of the scene alone.
pub(crate) fn of_run(setup: &Setup, outcome: &Outcome) -> Vec<String> {
    let mut warnings = vec![];
    if let Some(settled) = outcome.settled.filter(|settled| !settled.at_rest) {
        let remedy = if setup.is_free() {
            "nothing holds it"
        } else {
            "write a larger settle, or leave it out and let damping bring the body to rest before what you look at"
        };
        let to_go = match settled.remaining {
            metre if metre.is_finite() => format!(", {metre:.2e} m to go; {remedy}"),
            _ => String::new(),
        };
        warnings.push(format!("the body is not at rest after {} steps{to_go}", settled.steps));
    }
    // Of steps of one length; others end where a path turns.
    if !setup.time.is_adaptive && !setup.time.sets_own_pace() {
        let (_, longest) = outcome.steps;
        let seconds = f64::from(longest);
        let short = setup.instruments.short_part(seconds).or_else(|| setup.pulls.short_part(seconds));
        if let Some(time) = short {
            warnings.push(format!(
                "steps of {longest:.3e} s are longer than the part of a path from {time:.3} s on, and may pass over it; \
                 shorten them or write method = \"auto\""
            ));
        }
    }
    if let Some(time) = outcome.above_from {
        warnings.push(format!(
            "from {time:.3} s on the step was above the stable {:.3e} s, as the tissue had stiffened; shorten it or \
             write step = \"auto\"",
            outcome.least.0.seconds
        ));
    }
    if let Some(trace) = &outcome.learned {
        warnings.extend(outside_training(trace));
        if let Some((time, why)) = &trace.fell_back {
            warnings.push(format!(
                "exact steps moved the scene for {:.3} s, first at {time:.3} s, as the learned step {why}",
                trace.exact_seconds()
            ));
        }
    }
    if outcome.limits.steps > 0 {
        warnings.push(not_exact(&outcome.limits));
    }
    if let Some((inexact, first)) = outcome.guard.and_then(|guard| Some((guard.inexact, guard.first?))) {
        let (time, error, allowed) = first;
        warnings.push(format!(
            "in {inexact} steps, first at {time:.3} s, the error may be more than is allowed: {:.2} mm, allowed {:.2} mm; a \
             shorter step has less",
            1e3 * error,
            1e3 * allowed
        ));
    }
    warnings
}

fn outside_training(trace: &LearnedTrace) -> Option<String> {
    let (_, outside) = trace.means();
    (outside > OUTSIDE).then(|| {
        format!(
            "{:.1} % of the vertices had inputs outside the network's training, {:.1} % at most: its error there is \
             not known",
            100.0 * outside,
            100.0 * trace.most.outside
        )
    })
}

/// Why steps were not exact.
fn not_exact(limits: &Limits) -> String {
    let mut causes = vec![];
    if limits.least_volume_ratio < J_FLOOR {
        causes.push(match limits.least_volume_ratio {
            ratio if ratio > 0.0 => format!("an element was squeezed to {ratio:.3} of its volume"),
            ratio => format!("an element was turned inside out, to {ratio:.3} of its volume"),
        });
    }
    if limits.saturation > 1.0 {
        causes.push(format!("an exponent reached {:.2} times its cap", limits.saturation));
    }
    if limits.energy_excess > 0.0 {
        causes.push(format!("kinetic energy exceeded the energy balance by {:.0} %", 100.0 * limits.energy_excess));
    }
    if limits.held_back > 0 {
        causes
            .push(format!("in {} much of the motion was held back, which a shorter step does less", limits.held_back));
    }
    format!(
        "{} steps, the first at {:.3} s, were taken but are not exact: {}",
        limits.steps,
        limits.first_time,
        causes.join(", ")
    )
}
