//! Elements and steps against nature: errors over computing time, of a filmed beam, closed forms and published values.

use crate::evaluate::unique;
use crate::physics::PhysicsRow;
use supple_cli::report::made::Made;
use supple_cli::report::plots::{self, COLOURS, Curve, DashType, MarkerSymbol, short};
use supple_cli::report::{Figure, Panel, ReportPart, Section, Table};

pub(crate) const NAME: &str = "physics";

pub(crate) fn part(rows: &[PhysicsRow]) -> ReportPart {
    let names = unique(rows.iter().map(|row| (row.case, &*row.quantity)));
    let panels = names.into_iter().filter_map(|(case, quantity)| {
        let of = rows.iter().filter(|row| row.case == case && row.quantity == quantity);
        panel(case, quantity, &of.collect::<Vec<_>>())
    });
    let caption = "A point is a mesh, with its tetrahedra under the mouse; lower is nearer to nature, further left is faster. Computing time is that of a \
                   simulated second where the case moves, and of the whole way to rest where it comes to rest, on one core.";
    let section = Section {
        title: "Error against nature over computing time".into(),
        paragraphs: vec![
            "What is true here is not ours: a filmed silicone beam, closed forms of elasticity, a published benchmark. Errors are those of mesh, element and step together."
                .into(),
        ],
        tables: vec![finest(rows)],
        figures: vec![Figure::choice(caption, panels.collect())],
        ..Section::default()
    };
    ReportPart { made: Made::by_this_command("none"), sections: vec![section] }
}

/// Error, its unit, computing time.
fn error(row: &PhysicsRow) -> Option<(f64, &'static str, f64)> {
    let time = row.us_per_simulated_second.map(|time| 1e-6 * time).or(row.computing_seconds)?;
    // A distance to what was measured is an error by itself.
    let (error, unit) = match row.error_percent() {
        Some(percent) => (percent.abs(), "%"),
        None if row.quantity.contains("distance") => (row.value?, row.unit),
        None => return None,
    };
    (error > 0.0 && time > 0.0).then_some((error, unit, time))
}

/// Meshes of one element with one kind of steps.
#[derive(Default)]
struct Meshes {
    name: String,
    times: Vec<f64>,
    errors: Vec<f64>,
    words: Vec<String>,
}

fn panel(case: &str, quantity: &str, rows: &[&PhysicsRow]) -> Option<Panel> {
    let mut curves: Vec<Meshes> = vec![];
    let mut unit = "";
    for row in rows {
        let Some((error, of, time)) = error(row) else { continue };
        unit = of;
        let name = format!("{}, {}, {}", row.element.name(), row.method, row.mesh);
        let at = curves.iter().position(|known| known.name == name).unwrap_or_else(|| {
            curves.push(Meshes { name: name.clone(), ..Meshes::default() });
            curves.len() - 1
        });
        curves[at].times.push(time);
        curves[at].errors.push(error);
        curves[at].words.push(format!(
            "{name}<br>{} tetrahedra: off by {} {of}, {} s of computing",
            row.tetrahedra,
            short(error),
            short(time)
        ));
    }
    if curves.is_empty() {
        return None;
    }
    let drawn = curves.into_iter().enumerate().map(|(index, Meshes { name, times, errors, words })| {
        let curve = Curve::new(name, times, errors).coloured(COLOURS[index % COLOURS.len()]).saying(words);
        let dash = [DashType::Solid, DashType::Dash, DashType::Dot][index / COLOURS.len() % 3];
        curve.dashed(dash).marked(MarkerSymbol::Circle)
    });
    let plot = plots::logarithms("computing time, s", &format!("error, {unit}"), drawn.collect());
    Some(Panel::new(format!("{case}: {quantity}"), plot))
}

/// The finest mesh of each case, quantity and element with exact steps.
fn finest(rows: &[PhysicsRow]) -> Table {
    let mut lines: Vec<&PhysicsRow> = vec![];
    for row in rows.iter().filter(|row| row.error_percent().is_some() && row.computing_seconds.is_some()) {
        let same = |other: &&mut &PhysicsRow| {
            (other.case, &other.quantity, other.element, other.method, other.mesh)
                == (row.case, &row.quantity, row.element, row.method, row.mesh)
        };
        match lines.iter_mut().find(same) {
            Some(line) if line.tetrahedra <= row.tetrahedra => *line = row,
            Some(_) => {}
            None => lines.push(row),
        }
    }
    let heads =
        ["case", "quantity", "element", "steps", "mesh", "tetrahedra", "value", "should be", "error, %", "source"];
    let cells = |row: &&PhysicsRow| {
        let number =
            |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{} {}", short(value), row.unit));
        vec![
            row.case.into(),
            row.quantity.clone(),
            row.element.name().into(),
            row.method.into(),
            row.mesh.into(),
            row.tetrahedra.to_string(),
            number(row.value),
            number(row.reference),
            row.error_percent().map_or_else(|| "-".into(), |percent| format!("{percent:+.1}")),
            row.source.into(),
        ]
    };
    Table {
        title: "the finest meshes".into(),
        heads: heads.map(String::from).to_vec(),
        rows: lines.iter().map(cells).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple::material::Element;

    fn row(value: f64, reference: Option<f64>, tetrahedra: usize) -> PhysicsRow {
        PhysicsRow {
            case: "bending",
            mesh: "grid",
            element: Element::Linear,
            method: "exact",
            nodes: 8,
            tetrahedra,
            quantity: "sag".into(),
            unit: "mm",
            value: Some(value),
            reference,
            source: "Timoshenko",
            us_per_simulated_second: None,
            computing_seconds: Some(2.0),
            note: String::new(),
        }
    }

    #[test]
    fn errors_are_shares_of_what_should_be_and_the_finest_mesh_is_told() {
        let rows = [row(9.0, Some(10.0), 6), row(11.0, Some(10.0), 48)];
        let panel = panel("bending", "sag", &rows.iter().collect::<Vec<_>>()).unwrap();
        let x = &panel.plot.data[0];
        assert_eq!((&x["x"], &x["y"]), (&serde_json::json!([2.0, 2.0]), &serde_json::json!([10.0, 10.0])));
        let table = finest(&rows);
        assert_eq!(table.rows.len(), 1);
        assert_eq!(table.rows[0][5..9], ["48", "11.0 mm", "10.0 mm", "+10.0"].map(String::from));
        // Nothing to compare with, and no distance.
        assert!(error(&row(9.0, None, 6)).is_none());
    }
}
