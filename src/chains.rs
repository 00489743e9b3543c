//! Elements in chains: two that share a face have five nodes instead of eight, three have six instead of twelve, and most of a
//! step goes into bringing nodes' displacements to elements and forces back. Found greedily among elements whose numbers are
//! near.

/// Most elements of a chain.
pub(crate) const LONGEST: usize = 3;

/// Nodes of each element of a chain, by the nodes' places in the chain: `(p, a, b, c)`, `(q, a, c, b)` across the first one's
/// face opposite `p`, and `(r, q, a, c)` across the second one's opposite `b`. Each brings its first one.
pub(crate) const CORNERS: [[usize; 4]; LONGEST] = [[0, 1, 2, 3], [4, 1, 3, 2], [5, 4, 1, 3]];

/// How many elements ahead others are looked for.
const WINDOW: usize = 32;

/// An element with its number in the mesh; its nodes in an order of the same winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Numbered {
    pub(crate) element: usize,
    pub(crate) nodes: [u32; 4],
}

/// One to three elements with their nodes in the order of [`CORNERS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chain {
    elements: [Numbered; LONGEST],
    length: usize,
}

impl Chain {
    /// Its elements.
    pub(crate) fn elements(&self) -> &[Numbered] {
        self.elements.get(..self.length).unwrap_or_default()
    }

    const fn one(element: Numbered) -> Self {
        Self { elements: [element; LONGEST], length: 1 }
    }

    /// Two elements that share a face and lie on both sides of it.
    fn two(one: Numbered, other: Numbered) -> Option<Self> {
        if shared(one.nodes, other.nodes) != 3 {
            return None;
        }
        let [p, a, b, c] = led_by(one.nodes, |node| !other.nodes.contains(&node));
        let across = across([q_of(one, other)?, a, c, b], other)?;
        Some(Self { elements: [Numbered { nodes: [p, a, b, c], ..one }, across, across], length: 2 })
    }

    /// This one of two elements, and a third one at its end or its beginning.
    fn and(&self, third: Numbered) -> Option<Self> {
        let [one, other, _] = self.elements;
        self.then(third).or_else(|| Self::two(other, one)?.then(third))
    }

    /// This one of two elements, and a third one at its end.
    fn then(&self, third: Numbered) -> Option<Self> {
        let [one, other, _] = self.elements;
        if self.length != 2 || shared(other.nodes, third.nodes) != 3 {
            return None;
        }
        // Turned until the third does not have `b`.
        let ([p, mut a, mut b, mut c], [q, ..]) = (one.nodes, other.nodes);
        for _ in 0..2 {
            if third.nodes.contains(&b) {
                (a, b, c) = (b, c, a);
            }
        }
        let third = across([q_of(other, third)?, q, a, c], third)?;
        let (one, other) =
            (Numbered { nodes: [p, a, b, c], ..one }, Numbered { nodes: [q, a, c, b], ..other });
        Some(Self { elements: [one, other, third], length: 3 })
    }
}

/// The node of the other element that the first does not have.
fn q_of(one: Numbered, other: Numbered) -> Option<u32> {
    other.nodes.into_iter().find(|node| !one.nodes.contains(node))
}

/// The element with its nodes in this order, if that is of the same winding.
fn across(nodes: [u32; 4], element: Numbered) -> Option<Numbered> {
    let [q, x, y, z] = led_by(element.nodes, |node| node == nodes[0]);
    let same = [[q, x, y, z], [q, y, z, x], [q, z, x, y]].contains(&nodes);
    same.then_some(Numbered { nodes, ..element })
}

/// Nodes that two elements have in common.
fn shared(a: [u32; 4], b: [u32; 4]) -> usize {
    a.iter().filter(|node| b.contains(node)).count()
}

/// The nodes in an even permutation that begins with the one that is `first`.
fn led_by([a, b, c, d]: [u32; 4], first: impl Fn(u32) -> bool) -> [u32; 4] {
    let orders = [[a, b, c, d], [b, a, d, c], [c, a, b, d], [d, a, c, b]];
    orders.into_iter().find(|nodes| first(nodes[0])).unwrap_or([a, b, c, d])
}

/// The next elements; those in front of the others come first.
struct Window<I> {
    rest: I,
    elements: [Option<Numbered>; WINDOW],
    first: usize,
}

/// All elements, in chains of such as are alike (`kind`).
pub(crate) fn chains<K: PartialEq>(
    elements: impl Iterator<Item = Numbered>,
    kind: impl Fn([u32; 4]) -> K,
) -> impl Iterator<Item = Chain> {
    let mut window = Window { rest: elements, elements: [None; WINDOW], first: 0 };
    for place in &mut window.elements {
        *place = window.rest.next();
    }
    core::iter::from_fn(move || {
        // The end: a whole window without an element.
        for _ in 0..=WINDOW {
            if let Some(element) = window.advance() {
                let alike = |other: Numbered| kind(element.nodes) == kind(other.nodes);
                let chain = Chain::one(element);
                let Some(chain) = window.longer(&alike, |other| Chain::two(element, other)) else {
                    return Some(chain);
                };
                return Some(window.longer(&alike, |third| chain.and(third)).unwrap_or(chain));
            }
        }
        None
    })
}

impl<I: Iterator<Item = Numbered>> Window<I> {
    /// The first one, if no chain has it yet.
    fn advance(&mut self) -> Option<Numbered> {
        let first = self.elements.get_mut(self.first)?.take();
        let next = self.rest.next();
        if let Some(place) = self.elements.get_mut(self.first) {
            *place = next;
        }
        self.first = (self.first + 1) % WINDOW;
        first
    }

    /// A chain with one element more: that of those that can be added which has the fewest others to go to, the last of such.
    fn longer(
        &mut self,
        alike: &impl Fn(Numbered) -> bool,
        with: impl Fn(Numbered) -> Option<Chain>,
    ) -> Option<Chain> {
        let mut best: Option<(usize, usize, Chain)> = None;
        for step in 0..WINDOW {
            let place = (self.first + step) % WINDOW;
            let Some(other) = self.elements.get(place).copied().flatten() else { continue };
            let Some(chain) = with(other).filter(|_| alike(other)) else { continue };
            let free =
                self.elements.iter().flatten().filter(|third| shared(other.nodes, third.nodes) == 3).count();
            if best.as_ref().is_none_or(|(least, ..)| free <= *least) {
                best = Some((free, place, chain));
            }
        }
        let (_, place, chain) = best?;
        if let Some(taken) = self.elements.get_mut(place) {
            *taken = None;
        }
        Some(chain)
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::mesh::Bar;

    fn of(tets: &[[u32; 4]]) -> Vec<Chain> {
        let numbered = tets.iter().enumerate().map(|(element, &nodes)| Numbered { element, nodes });
        chains(numbered, |_| ()).collect()
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
    fn every_element_of_a_bar_is_there_once_and_nearly_all_are_in_chains_of_three() {
        let tets: Vec<[u32; 4]> = Bar { size: [1.0; 3], cells: [5, 4, 6] }.tets().collect();
        let (mut seen, mut of_length) = (std::vec![0; tets.len()], [0; LONGEST + 1]);
        for chain in of(&tets) {
            let elements = chain.elements();
            of_length[elements.len()] += elements.len();
            let mut nodes: Vec<u32> = elements[0].nodes.to_vec();
            nodes.extend(elements[1..].iter().map(|one| one.nodes[0]));
            let mut all = nodes.clone();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), nodes.len(), "{chain:?} has a node twice");
            for (one, corners) in elements.iter().zip(CORNERS) {
                seen[one.element] += 1;
                assert_eq!(one.nodes, corners.map(|corner| nodes[corner]), "{chain:?}");
                assert!(even(one.nodes, tets[one.element]), "{one:?}");
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        println!("elements alone, in pairs, in chains of three: {:?} of {}", &of_length[1..], tets.len());
        assert!(of_length[3] > tets.len() * 3 / 4);
    }

    #[test]
    fn elements_on_the_same_side_of_a_face_are_no_pair() {
        assert!(of(&[[0, 1, 2, 3], [4, 1, 2, 3]]).iter().all(|chain| chain.elements().len() == 1));
        assert_eq!(of(&[[0, 1, 2, 3], [4, 1, 3, 2]])[0].elements().len(), 2);
        // The third is across a face of the first.
        assert_eq!(of(&[[0, 1, 2, 3], [4, 1, 3, 2], [5, 0, 1, 3]])[0].elements().len(), 2);
        assert_eq!(of(&[[0, 1, 2, 3], [4, 1, 3, 2], [5, 0, 3, 1]])[0].elements().len(), 3);
    }
}
