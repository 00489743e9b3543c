//! Node tags of Gmsh and TetGen files: whole numbers in any order, with gaps.

use std::collections::HashMap;

use super::cursor::Cursor;
use super::error::Fault;

/// From the tag of a node to its position in the list of points.
#[derive(Default)]
pub(super) struct NodeIndex(HashMap<i64, u32>);

impl NodeIndex {
    /// Gives the tag just read by `cursor` to the next point.
    pub(super) fn add(&mut self, tag: i64, cursor: &Cursor<'_>) -> Result<(), Fault> {
        let position = u32::try_from(self.0.len()).map_err(|_| cursor.fault("more than 2^32 nodes"))?;
        match self.0.insert(tag, position) {
            None => Ok(()),
            Some(_) => Err(cursor.fault(format_args!("node {tag} is listed twice"))),
        }
    }

    /// The positions of an element's nodes, whose tags `read` takes from the file.
    pub(super) fn corners<'a, const N: usize>(
        &self,
        element: i64,
        cursor: &mut Cursor<'a>,
        mut read: impl FnMut(&mut Cursor<'a>) -> Result<i64, Fault>,
    ) -> Result<[u32; N], Fault> {
        let mut corners = [0; N];
        for corner in &mut corners {
            let tag = read(cursor)?;
            *corner = *self.0.get(&tag).ok_or_else(|| {
                let n = self.0.len();
                cursor
                    .fault(format_args!("element {element} names node {tag}, which is not one of the file's {n} nodes"))
            })?;
        }
        Ok(corners)
    }
}
