//! Strips of one to three tetrahedra, neighbours of which share a triangle. Two such elements have five nodes instead
//! of eight, three have six instead of twelve. That saves time, because most of a step is gather (displacements to
//! elements) and scatter (forces to nodes). Strips are made greedily from elements with near numbers.

/// Most elements of a strip.
pub(crate) const LONGEST: usize = 3;

/// Nodes of each element of a strip, as places in the list `p a b c q r` of the strip's nodes. The first element is
/// `(p, a, b, c)`. The second, `(q, a, c, b)`, shares the triangle opposite `p`; the third, `(r, q, a, c)`, shares the
/// triangle of the second that is opposite `b`. Each element after the first adds one node, its first.
pub(crate) const CORNERS: [[usize; 4]; LONGEST] = [[0, 1, 2, 3], [4, 1, 3, 2], [5, 4, 1, 3]];

/// Neighbours of an element are searched among so many following elements.
const WINDOW: usize = 32;

/// An element with its index in the mesh. Its nodes may be permuted, but keep their winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Numbered {
    pub(crate) element: usize,
    pub(crate) nodes: [u32; 4],
}

/// One to three elements with their nodes in the order of [`CORNERS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Strip {
    elements: [Numbered; LONGEST],
    length: usize,
}

impl Strip {
    /// The elements.
    pub(crate) fn elements(&self) -> &[Numbered] {
        self.elements.get(..self.length).unwrap_or_default()
    }

    const fn single(element: Numbered) -> Self {
        Self { elements: [element; LONGEST], length: 1 }
    }

    /// Two elements on opposite sides of a shared triangle.
    fn pair(first: Numbered, second: Numbered) -> Option<Self> {
        if shared_nodes(first.nodes, second.nodes) != 3 {
            return None;
        }
        let [p, a, b, c] = starting_with(first.nodes, |node| !second.nodes.contains(&node));
        let second = permuted([node_not_in(first, second)?, a, c, b], second)?;
        Some(Self { elements: [Numbered { nodes: [p, a, b, c], ..first }, second, second], length: 2 })
    }

    /// A strip of two elements with a third one added at its end or its beginning.
    fn with_third(&self, third: Numbered) -> Option<Self> {
        let [first, second, _] = self.elements;
        self.with_third_at_end(third).or_else(|| Self::pair(second, first)?.with_third_at_end(third))
    }

    /// A strip of two elements with a third one added at its end.
    fn with_third_at_end(&self, third: Numbered) -> Option<Self> {
        let [first, second, _] = self.elements;
        if self.length != 2 || shared_nodes(second.nodes, third.nodes) != 3 {
            return None;
        }
        // Rotate the shared triangle until the third element does not have `b`.
        let ([p, mut a, mut b, mut c], [q, ..]) = (first.nodes, second.nodes);
        for _ in 0..2 {
            if third.nodes.contains(&b) {
                (a, b, c) = (b, c, a);
            }
        }
        let third = permuted([node_not_in(second, third)?, q, a, c], third)?;
        let (first, second) = (Numbered { nodes: [p, a, b, c], ..first }, Numbered { nodes: [q, a, c, b], ..second });
        Some(Self { elements: [first, second, third], length: 3 })
    }
}

/// The node of `second` that `first` does not have.
fn node_not_in(first: Numbered, second: Numbered) -> Option<u32> {
    second.nodes.into_iter().find(|node| !first.nodes.contains(node))
}

/// The element with its nodes in this order, if that keeps the winding.
fn permuted(nodes: [u32; 4], element: Numbered) -> Option<Numbered> {
    let [q, x, y, z] = starting_with(element.nodes, |node| node == nodes[0]);
    let same = [[q, x, y, z], [q, y, z, x], [q, z, x, y]].contains(&nodes);
    same.then_some(Numbered { nodes, ..element })
}

/// Number of nodes that two elements share.
fn shared_nodes(a: [u32; 4], b: [u32; 4]) -> usize {
    a.iter().filter(|node| b.contains(node)).count()
}

/// An even permutation of the nodes that begins with the node for which `first` is true.
fn starting_with([a, b, c, d]: [u32; 4], first: impl Fn(u32) -> bool) -> [u32; 4] {
    let orders = [[a, b, c, d], [b, a, d, c], [c, a, b, d], [d, a, c, b]];
    orders.into_iter().find(|nodes| first(nodes[0])).unwrap_or([a, b, c, d])
}

/// A ring buffer with the next elements, in their order from place `first` on.
struct Window<I> {
    rest: I,
    elements: [Option<Numbered>; WINDOW],
    first: usize,
}

/// All elements in strips; the elements of a strip have the same `kind`.
pub(crate) fn strips<K: PartialEq>(
    elements: impl Iterator<Item = Numbered>,
    kind: impl Fn([u32; 4]) -> K,
) -> impl Iterator<Item = Strip> {
    let mut window = Window { rest: elements, elements: [None; WINDOW], first: 0 };
    for place in &mut window.elements {
        *place = window.rest.next();
    }
    core::iter::from_fn(move || {
        // A whole window without an element is the end.
        for _ in 0..=WINDOW {
            if let Some(element) = window.advance() {
                let same_kind = |other: Numbered| kind(element.nodes) == kind(other.nodes);
                let strip = Strip::single(element);
                let Some(strip) = window.extend(&same_kind, |second| Strip::pair(element, second)) else {
                    return Some(strip);
                };
                return Some(window.extend(&same_kind, |third| strip.with_third(third)).unwrap_or(strip));
            }
        }
        None
    })
}

impl<I: Iterator<Item = Numbered>> Window<I> {
    /// Moves the window on by one element. Gives the element that leaves it, if no strip has it yet.
    fn advance(&mut self) -> Option<Numbered> {
        let first = self.elements.get_mut(self.first)?.take();
        let next = self.rest.next();
        if let Some(place) = self.elements.get_mut(self.first) {
            *place = next;
        }
        self.first = (self.first + 1) % WINDOW;
        first
    }

    /// A strip extended by one element of the window, which leaves the window. Of several candidates the one with the
    /// fewest neighbours in the window is taken, of these the last.
    fn extend(
        &mut self,
        same_kind: &impl Fn(Numbered) -> bool,
        with: impl Fn(Numbered) -> Option<Strip>,
    ) -> Option<Strip> {
        let mut best: Option<(usize, usize, Strip)> = None;
        for step in 0..WINDOW {
            let place = (self.first + step) % WINDOW;
            let Some(other) = self.elements.get(place).copied().flatten() else { continue };
            let Some(strip) = with(other).filter(|_| same_kind(other)) else { continue };
            let rest = self.elements.iter().flatten();
            let neighbours = rest.filter(|third| shared_nodes(other.nodes, third.nodes) == 3).count();
            if best.as_ref().is_none_or(|(least, ..)| neighbours <= *least) {
                best = Some((neighbours, place, strip));
            }
        }
        let (_, place, strip) = best?;
        if let Some(taken) = self.elements.get_mut(place) {
            *taken = None;
        }
        Some(strip)
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::mesh::Bar;

    fn strips_of(tets: &[[u32; 4]]) -> Vec<Strip> {
        let numbered = tets.iter().enumerate().map(|(element, &nodes)| Numbered { element, nodes });
        strips(numbered, |_| ()).collect()
    }

    /// Whether `a` is an even permutation of `b`: then both have the same winding.
    fn is_even_permutation(a: [u32; 4], b: [u32; 4]) -> bool {
        let place = |node: u32| b.iter().position(|&other| other == node);
        let [Some(i), Some(j), Some(k), Some(l)] = a.map(place) else { return false };
        let order = [i, j, k, l];
        let inverted = |&(m, n): &(usize, usize)| order[m] > order[n];
        [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].iter().filter(|pair| inverted(pair)).count() % 2 == 0
    }

    #[test]
    fn every_element_of_a_bar_is_in_one_strip_and_most_strips_have_three_elements() {
        let tets: Vec<[u32; 4]> = Bar { size: [1.0; 3], cells: [5, 4, 6] }.tets().collect();
        let (mut seen, mut of_length) = (std::vec![0; tets.len()], [0; LONGEST + 1]);
        for strip in strips_of(&tets) {
            let elements = strip.elements();
            of_length[elements.len()] += elements.len();
            let mut nodes: Vec<u32> = elements[0].nodes.to_vec();
            nodes.extend(elements[1..].iter().map(|one| one.nodes[0]));
            let mut all = nodes.clone();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), nodes.len(), "{strip:?} has a node twice");
            for (one, corners) in elements.iter().zip(CORNERS) {
                seen[one.element] += 1;
                assert_eq!(one.nodes, corners.map(|corner| nodes[corner]), "{strip:?}");
                assert!(is_even_permutation(one.nodes, tets[one.element]), "{one:?}");
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        println!("elements in strips of one, two, three: {:?} of {}", &of_length[1..], tets.len());
        assert!(of_length[3] > tets.len() * 3 / 4);
    }

    #[test]
    fn elements_on_the_same_side_of_a_triangle_are_no_pair() {
        assert!(strips_of(&[[0, 1, 2, 3], [4, 1, 2, 3]]).iter().all(|strip| strip.elements().len() == 1));
        assert_eq!(strips_of(&[[0, 1, 2, 3], [4, 1, 3, 2]])[0].elements().len(), 2);
        // The third element is a neighbour of the first, not of the second.
        assert_eq!(strips_of(&[[0, 1, 2, 3], [4, 1, 3, 2], [5, 0, 1, 3]])[0].elements().len(), 2);
        assert_eq!(strips_of(&[[0, 1, 2, 3], [4, 1, 3, 2], [5, 0, 3, 1]])[0].elements().len(), 3);
    }
}
