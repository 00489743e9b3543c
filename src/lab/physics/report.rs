//! Rows of the physics cases for programs and people, and orders of convergence: the slope of the logarithm of the error over that of
//! the width of a cell, of the finest three meshes. An error in the square of the width has the order 2.

use std::format;
use std::path::Path;
use std::string::String;
use std::vec;

use super::Row;
use crate::io::write_atomically;
use crate::lab::LabError;

/// Heads of the file.
pub const HEADS: &str = "case,element,method,nodes,tetrahedra,quantity,unit,value,reference,source,error_percent,us_per_simulated_second";

/// A row of a mesh without quantity, its cells along a side, and what was measured on it.
pub(super) type Measured = (Row, f64, f64);

/// The order by relative errors.
pub(super) fn order_of_errors(meshes: &[Measured], mesh: &str) -> Option<Row> {
    let [.., first, _, (row, cells, error)] = meshes else { return None };
    let order = (first.2 / error).abs().ln() / (cells / first.1).ln();
    Some(order_row(row, order, mesh))
}

/// The order by differences from mesh to mesh, each twice as fine as the last.
pub(super) fn order_of_differences(meshes: &[Measured]) -> Option<Row> {
    let [.., (_, _, coarse), (_, _, middle), (row, _, fine)] = meshes else { return None };
    let order = ((middle - coarse) / (fine - middle)).abs().log2();
    Some(order_row(row, order, ""))
}

fn order_row(row: &Row, order: f64, mesh: &str) -> Row {
    Row {
        quantity: format!("order of convergence{mesh}"),
        value: Some(order),
        reference: Some(2.0),
        source: "theory of linear elements",
        ..row.clone()
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.6e}"))
}

/// Writes the rows as comma-separated values under [`HEADS`]; what is not known is left empty.
pub fn write_csv(path: &Path, rows: &[Row]) -> Result<(), LabError> {
    write_atomically(path, |file| {
        writeln!(file, "{HEADS}")?;
        rows.iter().try_for_each(|row| {
            let Row { case, method, nodes, tetrahedra, quantity, unit, source, .. } = row;
            let element = row.element.name();
            let percent = row.error_percent().map_or_else(String::new, |error| format!("{error:.3}"));
            let time = row.us_per_simulated_second.map_or_else(String::new, |time| format!("{time:.0}"));
            let (value, reference) = (number(row.value), number(row.reference));
            writeln!(
                file,
                "{case},{element},{method},{nodes},{tetrahedra},{quantity},{unit},{value},{reference},{source},{percent},{time}"
            )
        })
    })?;
    Ok(())
}

/// The rows as aligned text; of the beam's recordings the first and its left marker only.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    let heads =
        ["case", "element", "method", "tetrahedra", "value", "reference", "error %", "s/s", "quantity"];
    let mut lines = vec![heads.map(String::from)];
    let hidden = ["-b ", " top:", " right:"];
    let shown = |row: &&Row| !hidden.iter().any(|words| row.quantity.contains(words));
    for row in rows.iter().filter(shown) {
        let short = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.4}"));
        // Small forces and displacements in their own powers of ten.
        let figure = |value: Option<f64>| match value {
            Some(value) if value != 0.0 && value.abs() < 0.01 => format!("{value:.3e}"),
            value => short(value),
        };
        let unit = if row.unit.is_empty() { String::new() } else { format!(" ({})", row.unit) };
        lines.push([
            row.case.into(),
            row.element.name().into(),
            row.method.into(),
            format!("{}", row.tetrahedra),
            figure(row.value),
            figure(row.reference),
            row.error_percent().map_or_else(|| "-".into(), |error| format!("{error:+.1}")),
            short(row.us_per_simulated_second.map(|time| 1e-6 * time)),
            format!("{}{unit}", row.quantity),
        ]);
    }
    let width = |column: usize| lines.iter().map(|line| line[column].len()).max().unwrap_or(0);
    let widths: [usize; 9] = core::array::from_fn(width);
    let mut text = String::new();
    for line in &lines {
        for (column, (cell, width)) in line.iter().zip(widths).enumerate() {
            text += &match column {
                0..=2 => format!("{cell:<width$}  "),
                8 => format!("{cell}\n"),
                _ => format!("{cell:>width$}  "),
            };
        }
    }
    text
}
