//! Elements two by two: two that share a face have five nodes instead of eight, and most of a step goes into bringing nodes'
//! displacements to elements and forces back. Found greedily among elements whose numbers are near.

/// How many elements ahead a mate is looked for.
const WINDOW: usize = 32;

/// An element with its number in the mesh; its nodes in an order of the same winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Numbered {
    pub(crate) element: usize,
    pub(crate) nodes: [u32; 4],
}

/// One element, or two as `(p, a, b, c)` and `(q, a, c, b)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unit {
    One(Numbered),
    Two([Numbered; 2]),
}

impl Unit {
    /// Nodes of the first element.
    pub(crate) const fn nodes(&self) -> [u32; 4] {
        match self {
            Self::One(one) | Self::Two([one, _]) => one.nodes,
        }
    }

    /// Its elements.
    pub(crate) fn elements(self) -> impl Iterator<Item = Numbered> {
        let (one, other) = match self {
            Self::One(one) => (one, None),
            Self::Two([one, other]) => (one, Some(other)),
        };
        core::iter::once(one).chain(other)
    }
}

/// The next elements; those in front of the others come first.
struct Window<I> {
    rest: I,
    elements: [Option<Numbered>; WINDOW],
    first: usize,
}

/// Pairs of elements that share a face and are alike (`kind`), and elements that have no such neighbour free.
pub(crate) fn units<K: PartialEq>(
    elements: impl Iterator<Item = Numbered>,
    kind: impl Fn([u32; 4]) -> K,
) -> impl Iterator<Item = Unit> {
    let mut window = Window { rest: elements, elements: [None; WINDOW], first: 0 };
    for place in &mut window.elements {
        *place = window.rest.next();
    }
    core::iter::from_fn(move || {
        // The end: a whole window without an element.
        for _ in 0..=WINDOW {
            if let Some(element) = window.advance() {
                return Some(window.mate(element, &kind).map_or(Unit::One(element), Unit::Two));
            }
        }
        None
    })
}

impl<I: Iterator<Item = Numbered>> Window<I> {
    /// The first one, if it has no mate yet.
    fn advance(&mut self) -> Option<Numbered> {
        let first = self.elements.get_mut(self.first)?.take();
        let next = self.rest.next();
        if let Some(place) = self.elements.get_mut(self.first) {
            *place = next;
        }
        self.first = (self.first + 1) % WINDOW;
        first
    }

    /// Takes the neighbour out that has the fewest others to go to, the last of such.
    fn mate<K: PartialEq>(
        &mut self,
        element: Numbered,
        kind: &impl Fn([u32; 4]) -> K,
    ) -> Option<[Numbered; 2]> {
        let mut best: Option<(usize, usize, [Numbered; 2])> = None;
        for step in 0..WINDOW {
            let place = (self.first + step) % WINDOW;
            let Some(other) = self.elements.get(place).copied().flatten() else { continue };
            let Some(pair) = paired(element, other) else { continue };
            if kind(element.nodes) != kind(other.nodes) {
                continue;
            }
            let free =
                self.elements.iter().flatten().filter(|third| shared(other.nodes, third.nodes) == 3).count();
            if best.as_ref().is_none_or(|(least, ..)| free <= *least) {
                best = Some((free, place, pair));
            }
        }
        let (_, place, pair) = best?;
        if let Some(taken) = self.elements.get_mut(place) {
            *taken = None;
        }
        Some(pair)
    }
}

/// Nodes that two elements have in common.
fn shared(a: [u32; 4], b: [u32; 4]) -> usize {
    a.iter().filter(|node| b.contains(node)).count()
}

/// Two elements that share a face and lie on both sides of it.
fn paired(one: Numbered, other: Numbered) -> Option<[Numbered; 2]> {
    if shared(one.nodes, other.nodes) != 3 {
        return None;
    }
    let [p, a, b, c] = led_by(one.nodes, |node| !other.nodes.contains(&node));
    let [q, x, y, z] = led_by(other.nodes, |node| !one.nodes.contains(&node));
    // Turned until the faces' first nodes are the same.
    let nodes = [[q, x, y, z], [q, y, z, x], [q, z, x, y]].into_iter().find(|nodes| nodes[1] == a)?;
    let facing = nodes[2] == c && nodes[3] == b;
    facing.then_some([Numbered { nodes: [p, a, b, c], ..one }, Numbered { nodes, ..other }])
}

/// The nodes in an even permutation that begins with the one that is `first`.
fn led_by([a, b, c, d]: [u32; 4], first: impl Fn(u32) -> bool) -> [u32; 4] {
    let orders = [[a, b, c, d], [b, a, d, c], [c, a, b, d], [d, a, c, b]];
    orders.into_iter().find(|nodes| first(nodes[0])).unwrap_or([a, b, c, d])
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::mesh::Bar;

    fn of(tets: &[[u32; 4]]) -> Vec<Unit> {
        let numbered = tets.iter().enumerate().map(|(element, &nodes)| Numbered { element, nodes });
        units(numbered, |_| ()).collect()
    }

    /// The volume's sign in a bar does not depend on which even permutation names the nodes.
    fn even(a: [u32; 4], b: [u32; 4]) -> bool {
        let place = |node: u32| b.iter().position(|&other| other == node);
        let [Some(i), Some(j), Some(k), Some(l)] = a.map(place) else { return false };
        let order = [i, j, k, l];
        let turned = |&(m, n): &(usize, usize)| order[m] > order[n];
        [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].iter().filter(|pair| turned(pair)).count() % 2 == 0
    }

    #[test]
    fn every_element_of_a_bar_is_there_once_and_nearly_all_are_paired() {
        let tets: Vec<[u32; 4]> = Bar { size: [1.0; 3], cells: [5, 4, 6] }.tets().collect();
        let (mut seen, mut pairs) = (std::vec![0; tets.len()], 0);
        for unit in of(&tets) {
            let elements = match unit {
                Unit::One(one) => std::vec![one],
                Unit::Two(both) => {
                    let [[p, a, b, c], [q, a2, c2, b2]] = both.map(|one| one.nodes);
                    assert_eq!([a, b, c], [a2, b2, c2]);
                    assert_ne!(p, q);
                    pairs += 1;
                    both.to_vec()
                }
            };
            for one in elements {
                seen[one.element] += 1;
                assert!(even(one.nodes, tets[one.element]), "{one:?}");
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        println!("{} of {} elements in pairs", 2 * pairs, tets.len());
        assert!(2 * pairs > tets.len() * 9 / 10);
    }

    #[test]
    fn elements_on_the_same_side_of_a_face_are_no_pair() {
        assert!(of(&[[0, 1, 2, 3], [4, 1, 2, 3]]).iter().all(|unit| matches!(unit, Unit::One(_))));
        assert!(matches!(of(&[[0, 1, 2, 3], [4, 1, 3, 2]])[..], [Unit::Two(_)]));
    }
}
