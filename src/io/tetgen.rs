//! TetGen files: the points (`.node`) and tetrahedra (`.ele`) of one mesh, as specified in the TetGen manual
//! (<https://wias-berlin.de/software/tetgen/fformats.html>). Coordinates are in file units; the first node has the
//! tag 0 or 1.

use std::vec::Vec;

use super::TetMesh;
use super::cursor::{Cursor, Encoding};
use super::error::{Fault, quoted};
use super::node_index::NodeIndex;

/// Comments run from `#` to the end of the line; blanks in their place keep the line numbers right.
fn without_comments(bytes: &[u8]) -> Vec<u8> {
    let mut comment = false;
    let blank = |&b: &u8| {
        comment = b != b'\n' && (comment || b == b'#');
        if comment { b' ' } else { b }
    };
    bytes.iter().map(blank).collect()
}

/// The rest of a node's line: attributes and the boundary marker.
fn skip_values(cursor: &mut Cursor<'_>) {
    while cursor.token().is_some() {}
}

fn expect_end(cursor: &mut Cursor<'_>, n: u64, what: &str) -> Result<(), Fault> {
    match cursor.token() {
        None => Ok(()),
        Some(extra) => {
            let extra = quoted(extra);
            Err(cursor.fault(format_args!("{extra} where the file should end after the announced {n} {what}")))
        }
    }
}

/// The points of a `.node` file and their tags.
pub(super) fn read_nodes(bytes: &[u8]) -> Result<(Vec<[f64; 3]>, NodeIndex), Fault> {
    let bytes = without_comments(bytes);
    let mut cursor = Cursor::new(&bytes, 1);
    let (n, dimension) = cursor.record(Encoding::Text, |cursor| {
        let n: u64 = cursor.number("the number of nodes")?;
        let dimension: u64 = cursor.number("the dimension")?;
        skip_values(cursor);
        Ok((n, dimension))
    })?;
    if dimension != 3 {
        return Err(cursor.fault(format_args!("the dimension is {dimension}; it must be 3")));
    }
    let (mut points, mut index) = (Vec::new(), NodeIndex::default());
    for i in 0..n {
        cursor.record(Encoding::Text, |cursor| {
            let tag = cursor.number(format_args!("the number of node {} of {n}", i + 1))?;
            index.add(tag, cursor)?;
            points.push(cursor.point(Encoding::Text, format_args!("node {tag}"))?);
            skip_values(cursor);
            Ok(())
        })?;
    }
    expect_end(&mut cursor, n, "nodes")?;
    Ok((points, index))
}

/// The mesh of an `.ele` file on the points of its `.node` file. Regions are the last attribute of the tetrahedra,
/// if each is a whole number.
pub(super) fn read_elements(bytes: &[u8], points: Vec<[f64; 3]>, index: &NodeIndex) -> Result<TetMesh, Fault> {
    let bytes = without_comments(bytes);
    let mut cursor = Cursor::new(&bytes, 1);
    let (n, corners, attributes) = cursor.record(Encoding::Text, |cursor| {
        let n: u64 = cursor.number("the number of tetrahedra")?;
        let corners: u64 = cursor.number("the number of nodes per tetrahedron")?;
        Ok((n, corners, cursor.number::<u64>("the number of attributes")?))
    })?;
    if corners != 4 {
        let reason = format_args!("the tetrahedra have {corners} nodes; only those with four nodes can be read");
        return Err(cursor.fault(reason));
    }
    let mut mesh = TetMesh { points, ..TetMesh::default() };
    for i in 0..n {
        cursor.record(Encoding::Text, |cursor| {
            let element = cursor.number(format_args!("the number of element {} of {n}", i + 1))?;
            let node = |cursor: &mut Cursor<'_>| cursor.number(format_args!("a node of element {element}"));
            mesh.tets.push(index.corners(element, cursor, node)?);
            let mut region = None;
            for _ in 0..attributes {
                region = Some(cursor.number::<f64>(format_args!("an attribute of element {element}"))?);
            }
            mesh.regions.extend(region.filter(|r| f64::from(*r as i32) == *r).map(|r| r as i32));
            Ok(())
        })?;
    }
    expect_end(&mut cursor, n, "tetrahedra")?;
    if mesh.regions.len() != mesh.tets.len() {
        mesh.regions.clear();
    }
    Ok(mesh)
}
