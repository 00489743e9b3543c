//! Added mass in words, for the report of a simulation and for `supple inspect`.

use supple::inertia::Report;

/// Added mass in words.
pub(crate) fn describe_added(report: &Report) -> String {
    // Three figures for what may be a hundredth or thousands.
    let figure = |value: f32| {
        let decimals = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
        format!("{value:.decimals$}")
    };
    format!(
        "on average {}, at most {} times its own mass (node {})",
        figure(report.added_mean),
        figure(report.added_largest),
        report.added_node
    )
}
