//! Rows of the physics cases as a file, and orders of convergence: the slope of the logarithm of the error over that of
//! the width of a cell, of the finest three meshes. An error in the square of the width has the order 2.

use std::path::Path;

use supple::io::write_atomically;

use super::PhysicsRow;
use crate::LabError;

/// Heads of the file.
pub const HEADS: &str = "case,mesh,element,method,nodes,tetrahedra,quantity,unit,value,reference,source,error_percent,\
     us_per_simulated_second,computing_seconds,note";

/// A row of a mesh without quantity, its cells along a side, and what was measured on it.
pub(super) type Measured = (PhysicsRow, f64, f64);

/// How the quantity of an order begins.
pub(super) const ORDER: &str = "order of convergence";

/// The order by relative errors of a quantity.
pub(super) fn order_of_errors(quantity: &str, meshes: &[Measured]) -> Option<PhysicsRow> {
    let [.., first, _, (row, cells, error)] = meshes else { return None };
    Some(order_row(quantity, row, (first.2 / error).abs().ln() / (cells / first.1).ln()))
}

/// The order by differences from mesh to mesh, each twice as fine as the last; without a value while they grow.
pub(super) fn order_of_differences(quantity: &str, meshes: &[Measured]) -> Option<PhysicsRow> {
    let [.., (_, _, coarse), (_, _, middle), (row, _, fine)] = meshes else { return None };
    let order = ((middle - coarse) / (fine - middle)).abs().log2();
    let row = order_row(quantity, row, order);
    let grows = "differences from mesh to mesh still grow";
    Some(if order > 0.0 { row } else { PhysicsRow { value: None, note: grows.into(), ..row } })
}

fn order_row(quantity: &str, row: &PhysicsRow, order: f64) -> PhysicsRow {
    PhysicsRow {
        quantity: format!("{ORDER}; {quantity}"),
        value: Some(order),
        reference: Some(2.0),
        source: "theory of linear elements",
        us_per_simulated_second: None,
        computing_seconds: None,
        ..row.clone()
    }
}

/// Writes the rows as comma-separated values under [`HEADS`]; what is not known is left empty.
pub fn write_csv(path: &Path, rows: &[PhysicsRow]) -> Result<(), LabError> {
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.6e}"));
    write_atomically(path, |file| {
        writeln!(file, "{HEADS}")?;
        rows.iter().try_for_each(|row| {
            let PhysicsRow { case, mesh, method, nodes, tetrahedra, quantity, unit, source, .. } = row;
            let element = row.element.name();
            let percent = row.error_percent().map_or_else(String::new, |error| format!("{error:.3}"));
            let time = row.us_per_simulated_second.map_or_else(String::new, |time| format!("{time:.0}"));
            let (value, reference) = (number(row.value), number(row.reference));
            let (computing, note) = (number(row.computing_seconds), row.note.replace(',', ";"));
            writeln!(
                file,
                "{case},{mesh},{element},{method},{nodes},{tetrahedra},{quantity},{unit},{value},{reference},{source},\
                 {percent},{time},{computing},{note}"
            )
        })
    })?;
    Ok(())
}
