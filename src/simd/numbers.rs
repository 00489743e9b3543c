//! Scatter of one number for each node, as [`super::vectors`] scatters vectors, and in the same order.

use core::ops::Range;

use super::vectors::SCATTER_WIDTH;
use super::{Real, TILE, TileNodes};

/// Numbers of consecutive nodes to add to.
pub(crate) struct ScatterNumbers<'a> {
    numbers: &'a mut [f32],
    /// Node of the first number.
    first: usize,
}

/// Scalar code and vectors of four collect here what goes to the `N` corners of eight elements, as in [`super::ScatterBuffer`].
pub(crate) struct NumberBuffer<const N: usize>([[f32; SCATTER_WIDTH]; N]);

impl<const N: usize> NumberBuffer<N> {
    /// An empty buffer.
    pub(crate) const NONE: Self = Self([[0.0; SCATTER_WIDTH]; N]);
}

impl<'a> ScatterNumbers<'a> {
    /// Numbers of the nodes from `first` on.
    pub(crate) const fn from(first: usize, numbers: &'a mut [f32]) -> Self {
        Self { numbers, first }
    }

    /// The nodes of a tile, if all of them have a number here, as [`super::Scatter::checked`].
    #[inline(always)]
    pub(crate) fn checked<'b, R: Real, const N: usize>(&self, rows: [&'b [u32; TILE]; N]) -> Option<TileNodes<'b, N>> {
        if R::COUNT < SCATTER_WIDTH {
            return Some(TileNodes::checked_at_access(rows));
        }
        TileNodes::in_range::<R>(rows, self.first, self.numbers.len())
    }

    /// Adds for each corner the value in lane `l` to the number of the node in place `first + l`; nothing if the nodes
    /// have not been checked by [`ScatterNumbers::checked`]. Vectors of fewer than eight have to call this for all places in
    /// order.
    #[inline(always)]
    pub(crate) fn add_corners<R: Real, const N: usize>(
        &mut self,
        nodes: &TileNodes<'_, N>,
        first: usize,
        values: [R; N],
        buffer: &mut NumberBuffer<N>,
    ) {
        if R::COUNT < SCATTER_WIDTH {
            let place = first % SCATTER_WIDTH;
            for (buffered, value) in buffer.0.iter_mut().zip(values) {
                for lane in 0..R::COUNT {
                    buffered[(place + lane) % SCATTER_WIDTH] = value.lane(lane);
                }
            }
            if place + R::COUNT == SCATTER_WIDTH {
                self.add_buffered(nodes, first - place, buffer);
            }
            return;
        }
        if nodes.first != self.first || nodes.count > self.numbers.len() {
            return;
        }
        // The place that node 0 would have, so that nodes need no subtraction.
        let numbers = self.numbers.as_mut_ptr().wrapping_sub(self.first);
        for start in (0..R::COUNT).step_by(SCATTER_WIDTH) {
            for (corner, value) in values.iter().enumerate() {
                for lane in start..R::COUNT.min(start + SCATTER_WIDTH) {
                    #[allow(unsafe_code)]
                    // SAFETY: all nodes are in the range of `nodes.count` from `self.first` on, and each of these has a
                    // number.
                    let number = unsafe { &mut *numbers.wrapping_add(nodes.at(corner, first + lane)) };
                    *number += value.lane(lane);
                }
            }
        }
    }

    /// Adds the buffered values to the nodes in places from `first` on, those that have a number here.
    fn add_buffered<const N: usize>(&mut self, nodes: &TileNodes<'_, N>, first: usize, buffer: &NumberBuffer<N>) {
        for (corner, buffered) in buffer.0.iter().enumerate() {
            for (lane, value) in (first..).zip(buffered) {
                if let Some(number) = self.numbers.get_mut(nodes.at(corner, lane).wrapping_sub(self.first)) {
                    *number += value;
                }
            }
        }
    }

    /// Adds to those nodes of a tile that have a number here, in the same order but slower.
    #[inline(always)]
    pub(crate) fn add_present<R: Real, const N: usize>(
        &mut self,
        nodes: [&[u32; TILE]; N],
        first: usize,
        values: [R; N],
    ) {
        let mut rows = [[0.0; TILE]; N];
        for (row, value) in rows.iter_mut().zip(values) {
            for lane in 0..R::COUNT {
                row[lane % TILE] = value.lane(lane);
            }
        }
        self.add_rows(&nodes, first..first + R::COUNT, &rows);
    }

    /// The numbers of each corner, one for each of these places. Compiled once, not for each kernel and width.
    #[inline(never)]
    fn add_rows(&mut self, nodes: &[&[u32; TILE]], places: Range<usize>, rows: &[[f32; TILE]]) {
        for start in places.clone().step_by(SCATTER_WIDTH) {
            for (nodes, row) in nodes.iter().zip(rows) {
                for place in start..places.end.min(start + SCATTER_WIDTH) {
                    let node = nodes[place % TILE] as usize;
                    if let Some(number) = self.numbers.get_mut(node.wrapping_sub(self.first)) {
                        *number += row[(place - places.start) % TILE];
                    }
                }
            }
        }
    }
}
