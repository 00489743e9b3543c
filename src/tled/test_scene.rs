//! A scene for unit tests of loops over elements.

use std::{vec, vec::Vec};

use crate::material::{Law, Tissue};
use crate::mesh::{Bar, Mesh, Winding};
use crate::scene::{ElementBlock, NodeInertia, Scene, blocks_for};

type BarScene<L> = Scene<Tissue<L>, Vec<NodeInertia>, Vec<ElementBlock>>;

/// A bar's points (m) and its scene, of water's density and without supports.
pub(super) fn scene_of<L: Law>(law: L, bar: Bar) -> (Vec<[f32; 3]>, BarScene<L>) {
    let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
    let nodes = vec![NodeInertia::EMPTY; points.len()];
    let blocks = vec![ElementBlock::EMPTY; blocks_for(tets.len())];
    let mut scene = Scene::over(Tissue { law, density: 1000.0 }, nodes, blocks);
    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &[]).unwrap();
    (points, scene)
}
