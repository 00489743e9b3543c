//! The rows of the physics cases as the tables of `docs/accuracy.md`, in Markdown: the beam with exact steps, the beam
//! with other steps, its damping, the other cases, and how much pressure oscillates.

use supple::material::Element;

use super::mesh::GRID;
use super::recordings::Recording;
use super::report::ORDER;
use super::steps::{BACKWARD_EULER, EXACT, LONG_20, LONG_100, Steps, TO_REST};
use super::{PhysicsRow, cook, pressure, silicone};
use crate::literal::PAPER;

/// All tables that the rows fill.
#[must_use]
pub fn tables(rows: &[PhysicsRow]) -> String {
    let rows = Rows(rows);
    let tables = [rows.beam(), rows.other_steps(), rows.damping(), rows.cases(), rows.notes(), rows.pressure()];
    let literal = format!(
        "The paper's laws as printed, functions of `I1 - 3` and not of `I1bar - 3`, have a stress at rest: with its neo-Hookean constants a \
         free body shrinks by {:.2} % of its volume. The library has no such law.\n",
        100.0 * (1.0 - PAPER.volume_at_rest())
    );
    tables.into_iter().flatten().chain([literal]).collect::<Vec<_>>().join("\n")
}

struct Rows<'a>(&'a [PhysicsRow]);

/// Mesh, element, method and tetrahedra of a run.
type Key = (&'static str, Element, &'static str, usize);

fn key(row: &PhysicsRow) -> Key {
    (row.mesh, row.element, row.method, row.tetrahedra)
}

/// A table under its name, if it has lines.
fn table(name: &str, heads: &str, lines: Vec<String>) -> Option<String> {
    let rule = "|---".repeat(heads.matches('|').count() - 1);
    (!lines.is_empty()).then(|| format!("**{name}**\n\n{heads}\n{rule}|\n{}\n", lines.join("\n")))
}

fn join(values: impl Iterator<Item = Option<String>>) -> String {
    values.map(|value| value.unwrap_or_else(|| "-".into())).collect::<Vec<_>>().join(", ")
}

/// Three digits.
fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    format!("{value:.*}", (2.0 - digits).clamp(0.0, 4.0) as usize)
}

fn percent(row: &PhysicsRow) -> Option<String> {
    let error = row.error_percent()?;
    let digits = if error.abs() < 9.95 { 1 } else { 0 };
    Some(format!("{error:+.digits$}"))
}

impl Rows<'_> {
    fn of_case(&self, case: &'static str) -> impl Iterator<Item = &PhysicsRow> {
        self.0.iter().filter(move |row| row.case == case)
    }

    fn find(&self, case: &'static str, at: Key, quantity: &str) -> Option<&PhysicsRow> {
        self.of_case(case).find(|row| key(row) == at && row.quantity == quantity)
    }

    /// Errors (%) of a quantity of the left marker against both recordings.
    fn errors(&self, at: Key, recordings: &[Recording; 2], quantity: &str) -> String {
        let of = |name| self.find(silicone::NAME, at, &format!("{name} left: {quantity}")).and_then(percent);
        join(recordings.iter().map(|recording| of(recording.name)))
    }

    /// Values of a quantity of the left marker that belong to each recording.
    fn values(&self, at: Key, recordings: &[Recording; 2], quantity: &str) -> String {
        let find = |name| self.find(silicone::NAME, at, &format!("{name} left: {quantity}"));
        join(recordings.iter().map(|recording| find(recording.name)?.value.map(short)))
    }

    /// Rest, lowest point, time from a tenth to it, period: what it is and by how many per cent that is off. The
    /// shifted curves.
    fn marker(&self, at: Key, recordings: &[Recording; 2]) -> String {
        let value = |quantity: &str| {
            let name = format!("{} left: {quantity}", recordings[0].name);
            self.find(silicone::NAME, at, &name).and_then(|row| row.value).map_or_else(|| "-".into(), short)
        };
        let both = |quantity| format!("{} | {}", value(quantity), self.errors(at, recordings, quantity));
        [
            both("drop at rest"),
            both("drop at the lowest point"),
            both("from a tenth of the drop to the lowest point"),
            self.errors(at, recordings, "period"),
            self.values(at, recordings, "rms distance over time; clock shifted"),
        ]
        .join(" | ")
    }

    /// Computing time of a simulated second of the run that a recording is compared with, s.
    fn seconds(&self, at: Key, [recording, _]: &[Recording; 2]) -> Option<String> {
        let row = self.find(silicone::NAME, at, &format!("{} left: drop at rest", recording.name))?;
        row.us_per_simulated_second.map(|us| short(1e-6 * us))
    }

    fn beam(&self) -> Option<String> {
        let mut lines = Vec::new();
        for load in silicone::LOADS {
            let [a, b] = load.recordings.map(|recording| recording.markers[super::recordings::LEFT]);
            let pair = |a, b| format!("{}, {}", short(a), short(b));
            let filmed = format!(
                "| {}, filmed | | | | {} | | {} | | {} | | | | |",
                load.name,
                pair(a.rest, b.rest),
                pair(a.lowest, b.lowest),
                pair(a.since_tenth, b.since_tenth)
            );
            let rest = format!("{} left: drop at rest", load.recordings[0].name);
            let exact = |row: &&PhysicsRow| row.method == EXACT.name && row.quantity == rest;
            let line = |row: &PhysicsRow| {
                let (mesh, element, _, count) = key(row);
                let seconds = [EXACT, LONG_20, LONG_100]
                    .map(|steps| self.seconds((mesh, element, steps.name, count), load.recordings));
                let figures = self.marker(key(row), load.recordings);
                let (name, seconds) = (element.name(), join(seconds.into_iter()));
                format!("| {} | {mesh} | {name} | {count} | {figures} | {seconds} |", load.name)
            };
            let runs: Vec<String> = self.of_case(silicone::NAME).filter(exact).map(line).collect();
            lines.extend((!runs.is_empty()).then_some(filmed));
            lines.extend(runs);
        }
        let heads = "| load | mesh | element | tetrahedra | at rest, mm | error, % | lowest point, mm | error, % | \
                     from a tenth to there, s | error, % | period error, % | curve, mm | s/s exact, long 20x, 100x |";
        table("The beam's left marker, exact steps", heads, lines)
    }

    /// Under gravity on grids: long steps where the element does not lock, backward Euler where it is.
    fn other_steps(&self) -> Option<String> {
        let [gravity, _] = silicone::LOADS;
        let rest = format!("{} left: drop at rest", gravity.recordings[0].name);
        let wanted = |row: &&PhysicsRow| {
            let long = row.method == LONG_20.name || row.method == LONG_100.name;
            let shown = row.method != EXACT.name && long == (row.element != Element::Linear);
            row.mesh == GRID && row.quantity == rest && shown
        };
        let line = |row: &PhysicsRow| {
            let at = key(row);
            let figures = self.marker(at, gravity.recordings);
            let seconds = self.seconds(at, gravity.recordings).unwrap_or_else(|| row.note.clone());
            format!("| {} | {} | {} | {figures} | {seconds} |", row.element.name(), row.method, row.tetrahedra)
        };
        let mut shown: Vec<&PhysicsRow> = self.of_case(silicone::NAME).filter(wanted).collect();
        let kinds = [LONG_20, LONG_100].into_iter().chain(BACKWARD_EULER);
        let place = |row: &PhysicsRow| kinds.clone().position(|steps| steps.name == row.method);
        shown.sort_by_key(|row| (row.element.code(), place(row)));
        let heads = "| element | steps | tetrahedra | at rest, mm | error, % | lowest point, mm | error, % | \
                     from a tenth to there, s | error, % | period error, % | curve, mm | s/s |";
        table("The same under gravity on grids, other steps", heads, shown.into_iter().map(line).collect())
    }

    fn damping(&self) -> Option<String> {
        let recordings = silicone::LOADS.map(|load| load.recordings.map(|recording| recording.name)).concat();
        let of = |start: String| self.of_case(silicone::NAME).find(move |row| row.quantity == start);
        let lines = silicone::DAMPINGS.into_iter().filter_map(|damping| {
            let end = format!("; damping {damping} 1/s");
            let all = of(format!("all recordings: rms distance over drop at rest{end}"))?;
            let each = recordings.iter().map(|name| of(format!("{name} left: rms distance over time{end}")));
            let each = each.map(|row| row.and_then(|row| row.value).map_or_else(|| "-".into(), short));
            let each = each.collect::<Vec<String>>().join(" | ");
            Some(format!("| {damping} | {each} | {} |", all.value.map(short)?))
        });
        let heads = format!("| damping, 1/s | {}, mm | all over drop at rest, % |", recordings.join(", mm | "));
        table("Curves of the finest grid with nodal pressure, over the damping", &heads, lines.collect())
    }

    /// Runs of one quantity of a case on meshes from coarse to fine, for each mesh and element.
    fn groups(&self, wanted: impl Fn(&PhysicsRow) -> bool) -> Vec<Vec<&PhysicsRow>> {
        let mut groups: Vec<Vec<&PhysicsRow>> = Vec::new();
        for row in self.0.iter().filter(|row| row.case != silicone::NAME && wanted(row)) {
            let same = |group: &&mut Vec<&PhysicsRow>| {
                let first = group[0];
                (first.case, first.mesh, first.element) == (row.case, row.mesh, row.element)
                    && first.quantity == row.quantity
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.push(row),
                None => groups.push(vec![row]),
            }
        }
        groups
    }

    fn cases(&self) -> Option<String> {
        let wanted = |row: &PhysicsRow| {
            let other = row.quantity.contains("outer") || row.quantity.starts_with(ORDER);
            !other && (row.reference.is_some() || row.quantity == cook::SIDE)
        };
        let line = |group: Vec<&PhysicsRow>| {
            let first = group[0];
            let of = |steps: Steps| group.iter().filter(move |row| row.method == steps.name);
            let value = |row: &PhysicsRow| Some(format!("{} {}", short(row.value?), row.unit));
            let errors = TO_REST.map(|steps| join(of(steps).map(|row| percent(row).or(value(row))))).join(" | ");
            let seconds = |steps| of(steps).next_back().and_then(|row| row.computing_seconds).map(short);
            let order = self.of_case(first.case).find(|row| {
                (row.mesh, row.element) == (first.mesh, first.element)
                    && row.quantity.strip_prefix(ORDER) == Some(&format!("; {}", first.quantity))
            });
            let order = order.map(|row| row.value.map_or_else(|| "none yet".into(), |order| format!("{order:.2}")));
            format!(
                "| {}: {} | {} | {} | {errors} | {} | {} |",
                first.case,
                first.quantity,
                first.mesh,
                first.element.name(),
                order.unwrap_or_default(),
                join(TO_REST.map(seconds).into_iter())
            )
        };
        let heads = "| case | mesh | element | error from coarse to fine, %, exact steps | long 20x | order | \
                     s to rest on the finest mesh, exact, long |";
        let lines = self.groups(wanted).into_iter().map(line).collect();
        table("Shapes at rest against closed forms and a benchmark", heads, lines)
    }

    /// Why runs have no value: of each case, mesh, element and kind of steps the first reason.
    fn notes(&self) -> Option<String> {
        let mut firsts: Vec<&PhysicsRow> = Vec::new();
        let kind = |row: &PhysicsRow| (row.case, row.mesh, row.element, row.method);
        for row in self.0.iter().filter(|row| !row.note.is_empty() && !row.quantity.starts_with(ORDER)) {
            if !firsts.iter().any(|first| kind(first) == kind(row)) {
                firsts.push(row);
            }
        }
        let line = |row: &&PhysicsRow| {
            let PhysicsRow { case, mesh, method, tetrahedra, note, .. } = row;
            format!("| {case} | {mesh} | {} | {method} | {tetrahedra} | {note} |", row.element.name())
        };
        let heads = "| case | mesh | element | steps | tetrahedra | first reason |";
        table("Runs without a value", heads, firsts.iter().map(line).collect())
    }

    fn pressure(&self) -> Option<String> {
        let wanted = |row: &PhysicsRow| row.quantity == pressure::ELEMENTS && row.method == EXACT.name;
        let line = |group: Vec<&PhysicsRow>| {
            let first = group[0];
            let between_nodes = group.iter().map(|row| {
                let nodes = self.find(row.case, key(row), pressure::NODES);
                nodes.and_then(|row| row.value).map(short)
            });
            let (elements, nodes) = (join(group.iter().map(|row| row.value.map(short))), join(between_nodes));
            format!("| {} | {} | {} | {elements} | {nodes} |", first.case, first.mesh, first.element.name())
        };
        let heads = "| case | mesh | element | between elements, coarse to fine | between nodes |";
        let lines = self.groups(wanted).into_iter().map(line).collect();
        table("Oscillation of pressure over its mean, exact steps", heads, lines)
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    #[test]
    fn figures_have_three_digits() {
        let figures = [0.0, 0.012_34, 0.5, 1.234, 12.34, 123.4, 1234.0].map(short);
        assert_eq!(figures, ["0.00", "0.0123", "0.500", "1.23", "12.3", "123", "1234"].map(|x| x.to_string()));
    }
}
