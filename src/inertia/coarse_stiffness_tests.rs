//! The coarse stiffness and its factor against sums in float64 over single elements and patches, made from the mesh
//! alone, with the tangents of the tests' reference; and what they must be zero for.

use std::vec::Vec;
use std::{println, vec};

use crate::reference;
use crate::reference::dense::{Matrix, zeros};
use crate::reference::tensor::{Mat3, Mat9, cross, from_fn, product, rotation};

use super::band::{Row, solve};
use super::clusters::ClusterInput;
use super::lattice::{Grid, Lattice, LatticeNode, MAX_FUNCTIONS, sort_by_cell};
use super::layout::Layout;
use super::matrices::{Bands, Matrices, vectors_for};
use super::node::Scaling;
use super::node_tables::{self, NodeTables};
use super::renewal::{Renewal, RenewalInput};
use super::supports::MovingSupports;
use crate::element::{Axes, ElementMaterial};
use crate::loads::{Loads, Motion};
use crate::material::{NeoHookean, NodalStrain, Tissue};
use crate::mesh::{Bar, Mesh, Winding};
use crate::scene::{SceneView, Support, VecScene};
use crate::simd::NodeVector;
use crate::step::{CallingThread, Step};

const BAR: Bar = Bar { size: [0.03, 0.03, 0.06], cells: [4, 4, 8] };
const CELLS: [u32; 3] = [2, 2, 3];
const LAW: NeoHookean = NeoHookean { c: 2000.0, d: 50_000.0 };
/// `s_c D^2 / 4`, s^2.
const WEIGHT: f32 = 1e-6;

fn linear() -> Tissue<NeoHookean> {
    Tissue { law: LAW, density: 1000.0 }
}

/// The points of the bar, moved a little.
fn points() -> Vec<[f32; 3]> {
    let mut random = reference::Random(3);
    BAR.points().map(|point| point.map(|along| along + (1e-3 * random.next()) as f32)).collect()
}

/// Nodes of the layers of the bar, the first at its foot.
fn layers(layers: core::ops::Range<u32>) -> impl Iterator<Item = u32> {
    layers.flat_map(|k| (0..5).flat_map(move |j| (0..5).map(move |i| BAR.node(i, j, k))))
}

/// Nothing held; the foot; the foot along z, an edge along x and y, and one node. All may be moved.
fn supports() -> [Vec<Support>; 3] {
    let foot = |axes| layers(0..1).map(move |node| Support { node, axes, moves: true });
    let edge = (1..9).map(|k| Support { node: BAR.node(4, 0, k), axes: Axes::X.union(Axes::Y), moves: true });
    let one = Support { node: BAR.node(1, 4, 5), axes: Axes::XYZ, moves: true };
    [vec![], foot(Axes::XYZ).collect(), foot(Axes::Z).chain(edge).chain([one]).collect()]
}

/// Inertia prepared for a state.
struct Prepared<'a, 'm, M> {
    scene: SceneView<'a, M>,
    points: &'a [[f32; 3]],
    lattice: &'a Lattice,
    /// Of each node, in cells along each axis.
    positions: &'a [[f64; 3]],
    places: &'a [LatticeNode],
    displacement: &'a [NodeVector],
    matrices: &'a Matrices<'m>,
    renewal: &'a Renewal,
}

/// Prepares the inertia of the bar in the state `x + H x`.
fn prepare<M: ElementMaterial>(material: M, supports: &[Support], h: &Mat3, judge: impl FnOnce(&Prepared<'_, '_, M>)) {
    let (points, tets): (_, Vec<_>) = (points(), BAR.tets().collect());
    let mesh = Mesh::new(&points, &tets, Winding::Normalised).unwrap();
    let scene = VecScene::build(material, &mesh, supports).unwrap();
    let scene = scene.view();
    let layout = Layout::one(&points);
    let lattice = &Lattice::new(CELLS, &layout, scene.inertia).unwrap();
    let mut places = vec![LatticeNode::default(); points.len()];
    lattice.write_places(&layout, &mut places);
    let positions: Vec<_> = places.iter().map(|place| lattice.position(place).map(f64::from)).collect();
    sort_by_cell(&mut places);
    let (places, grid) = (&*places, Grid { cells: CELLS, functions: lattice.functions() });
    let pieces = [tets.len(), if scene.element().is_nodal_strain() { points.len() } else { 0 }];
    let mut renewal = Renewal::NEW;
    renewal.bands = Bands::new(lattice);
    let mut storage = vec![NodeVector::ZERO; vectors_for(grid, pieces)];
    let mut matrices = Matrices::split(&mut storage, lattice, &renewal.bands, pieces).unwrap();
    assert!(matrices.write_constants(scene, lattice, places, &mut renewal));
    matrices.frames.choose(lattice, places, &points, scene.inertia);
    let mut storage = vec![NodeVector([0.0, 0.0, 0.0, 1.0]); node_tables::vectors_for(points.len())];
    let mut tables = NodeTables::split(&mut storage, points.len()).unwrap();
    let moved = points.iter().map(|&x| {
        let [x, y, z] = reference::tensor::apply(h, x.map(f64::from)).map(|u| u as f32);
        NodeVector([x, y, z, 0.0])
    });
    let displacement: Vec<_> = moved.collect();
    let scaling = &Scaling { weight: WEIGHT, k: 0.0, reserve: 0.0, coarse_weight: WEIGHT };
    let input = RenewalInput { scene, displacement: &displacement, volume: &[], lattice, places, scaling };
    renewal.renew_all(input, &mut tables, &mut matrices, &CallingThread);
    assert!(renewal.lattice_in_use);
    judge(&Prepared {
        scene,
        points: &points,
        lattice,
        positions: &positions,
        places,
        displacement: &displacement,
        matrices: &matrices,
        renewal: &renewal,
    });
}

/// An element or a patch: volume, cell, nodes with the gradients of their functions.
type Reference = (f64, [usize; 3], Vec<(usize, [f64; 3])>);

impl<M: ElementMaterial> Prepared<'_, '_, M> {
    fn unknowns(&self) -> usize {
        3 * self.lattice.functions()
    }

    fn position(&self, node: usize) -> [f64; 3] {
        self.positions[node]
    }

    fn elements(&self) -> Vec<Reference> {
        let points = self.points.iter().map(|point| point.map(f64::from)).collect();
        let tets = BAR.tets().map(|tet| tet.map(|node| node as usize)).collect();
        let elements = reference::Mesh { points, tets }.elements();
        let with_cell = elements.into_iter().map(|element| {
            let centre = [0, 1, 2].map(|axis| element.nodes.iter().map(|&node| self.position(node)[axis]).sum::<f64>());
            let cell = [0, 1, 2].map(|axis| ((0.25 * centre[axis]) as usize).min(CELLS[axis] as usize - 1));
            (element.volume, cell, element.nodes.into_iter().zip(element.gradients).collect())
        });
        with_cell.collect()
    }

    /// Adds `V G_c^T A G_d` of pieces, with the functions of their own cells.
    fn add(&self, pieces: &[Reference], a: &Mat9, sum: &mut Matrix) {
        let functions = self.lattice.functions();
        for (volume, cell, nodes) in pieces {
            let corners = (0..8).map(|at| [at & 1, at >> 1 & 1, at >> 2]);
            let whole = cell[0] + CELLS[0] as usize * (cell[1] + CELLS[1] as usize * cell[2]);
            let of_cell = self.lattice.functions_of(whole);
            // For each function and axis of motion.
            let gradients: Vec<[[f64; 3]; 3]> = corners
                .map(|corner| {
                    let mut gradients = [[0.0; 3]; 3];
                    for &(node, gradient) in nodes {
                        let at = self.position(node);
                        let along = |axis: usize| {
                            let within = at[axis] - cell[axis] as f64;
                            if corner[axis] == 1 { within } else { 1.0 - within }
                        };
                        let weight = along(0) * along(1) * along(2);
                        for i in (0..3).filter(|&i| !self.scene.held(node).has(i)) {
                            (0..3).for_each(|j| gradients[i][j] += weight * gradient[j]);
                        }
                    }
                    gradients
                })
                .collect();
            for (c, d) in (0..8).flat_map(|c| (0..8).map(move |d| (c, d))) {
                if of_cell[c] >= functions || of_cell[d] >= functions {
                    continue;
                }
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    let entry: f64 = (0..9)
                        .map(|at| a[3 * i + at / 3][3 * j + at % 3] * gradients[c][i][at / 3] * gradients[d][j][at % 3])
                        .sum();
                    sum[3 * of_cell[c] + i][3 * of_cell[d] + j] += f64::from(WEIGHT) * volume * entry;
                }
            }
        }
    }

    /// That of the matrices of the cells.
    fn of_cells(&self) -> Matrix {
        let (mut sum, functions) = (zeros(self.unknowns()), self.lattice.functions());
        for (cell, matrices) in self.matrices.stiffness.iter().enumerate() {
            let of_cell = self.lattice.functions_of(cell);
            super::clusters::for_each_pair(|pair, c, d| {
                if of_cell[c] >= functions || of_cell[d] >= functions {
                    return;
                }
                let entries = matrices.of_pair(pair);
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    let (row, column) = (3 * of_cell[c] + i, 3 * of_cell[d] + j);
                    let value = f64::from(entries[3 * i + j]);
                    sum[row][column] += value;
                    if c != d {
                        sum[column][row] += value;
                    }
                }
            });
        }
        sum
    }

    /// The vectors of the functions for a motion of the points of the lattice, m.
    fn motion(&self, motion: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
        let bound = |pick: fn(f32, f32) -> f32, from: f32| {
            [0, 1, 2].map(|axis| f64::from(self.points.iter().fold(from, |bound, point| pick(bound, point[axis]))))
        };
        let (low, high) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
        let mut vectors = vec![0.0; self.unknowns()];
        for cell in 0..self.lattice.cell_count() {
            let [across, along] = [CELLS[0] as usize, CELLS[1] as usize];
            let indices = [cell % across, cell / across % along, cell / across / along];
            for (corner, function) in self.lattice.functions_of(cell).into_iter().enumerate() {
                let point = [0, 1, 2].map(|axis| {
                    let index = indices[axis] + (corner >> axis & 1);
                    low[axis] + (high[axis] - low[axis]) * index as f64 / f64::from(CELLS[axis])
                });
                if let Some(place) = vectors.get_mut(3 * function..3 * function + 3) {
                    place.copy_from_slice(&motion(point));
                }
            }
        }
        vectors
    }
}

fn worst(a: &Matrix, b: &Matrix) -> f64 {
    let largest = b.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    let apart = a.iter().flatten().zip(b.iter().flatten()).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    apart / largest
}

fn times(a: &Matrix, x: &[f64]) -> Vec<f64> {
    a.iter().map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

fn size(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

const REST: Mat3 = [[0.0; 3]; 3];

fn law_at_rest() -> Mat9 {
    let law = reference::Law::NeoHookean { c: LAW.c.into(), d: LAW.d.into() };
    law.tangent(&from_fn(|i, j| if i == j { 1.0 } else { 0.0 }))
}

fn is_the_sum<M: ElementMaterial>(name: &str, prepared: &Prepared<'_, '_, M>) {
    let mut sum = zeros(prepared.unknowns());
    prepared.add(&prepared.elements(), &law_at_rest(), &mut sum);
    let apart = worst(&prepared.of_cells(), &sum);
    println!(
        "{name}: {} functions, {} clusters: {apart:.1e} apart",
        prepared.lattice.functions(),
        prepared.renewal.clusters
    );
    assert!(apart < 1e-4);

    // With the inertia, and solved.
    for (cell, inertia) in prepared.matrices.inertia.iter().enumerate() {
        let of_cell = prepared.lattice.functions_of(cell);
        super::clusters::for_each_pair(|pair, c, d| {
            for axis in 0..3 {
                let (row, column) = (3 * of_cell[c] + axis, 3 * of_cell[d] + axis);
                if row.max(column) < sum.len() {
                    sum[row][column] += f64::from(inertia[pair][axis]);
                    if c != d {
                        sum[column][row] += f64::from(inertia[pair][axis]);
                    }
                }
            }
        });
    }
    let mut random = reference::Random(8);
    let right: Vec<f64> =
        sum.iter().map(|row| row.iter().fold(0.0_f64, |most, x| most.max(x.abs())) * random.next()).collect();
    let mut x: Row = [0.0; _];
    x.iter_mut().zip(&right).for_each(|(x, right)| *x = *right as f32);
    solve(&prepared.renewal.bands.vectors, prepared.matrices.factor, &mut [&mut x]);
    let solved: Vec<f64> = x.iter().take(right.len()).copied().map(f64::from).collect();
    let rest: Vec<f64> = times(&sum, &solved).iter().zip(&right).map(|(a, b)| a - b).collect();
    println!("{name}: solved with a rest of {:.1e}", size(&rest) / size(&right));
    assert!(size(&rest) < 1e-3 * size(&right));
}

/// At rest, where tangents are those of linear elasticity, for all supports.
#[test]
fn the_coarse_stiffness_at_rest_is_the_sum_over_elements_and_patches() {
    for (name, supports) in ["free", "held foot", "some axes"].into_iter().zip(supports()) {
        prepare(linear(), &supports, &REST, |prepared| is_the_sum(&format!("linear, {name}"), prepared));
        prepare(NodalStrain(linear()), &supports, &REST, |prepared| {
            is_the_sum(&format!("nodal strain, {name}"), prepared);
        });
    }
}

/// Strained evenly, where all pieces have one tangent: that of any of them.
#[test]
fn the_coarse_stiffness_under_even_strain_is_the_sum_over_elements_and_patches() {
    let h = [[0.2, 0.3, 0.0], [-0.1, -0.15, 0.2], [0.1, 0.0, 0.1]];
    fn of<M: ElementMaterial>(name: &str, prepared: &Prepared<'_, '_, M>) {
        let Prepared { scene, matrices, .. } = *prepared;
        // Of each piece: the columns are f, the factors alpha, beta, gamma.
        let tile = matrices.clusters.tiles[0] as usize;
        let volume = |lane: usize| {
            if scene.element().is_nodal_strain() {
                scene.patches.tiles()[tile].volume(lane) as f32
            } else {
                scene.tiles[tile].volume(lane)
            }
        };
        let tangents = (0..crate::simd::TILE).filter(|&lane| volume(lane) > 0.0).map(|lane| -> Mat9 {
            let tangent = &matrices.tangents[lane];
            let f = |i: usize, large: usize| f64::from(tangent.columns[large][i]);
            let [inner, outer, exchanged, is_spatial] =
                tangent.factors.map(|factor| f64::from(factor) / f64::from(WEIGHT * volume(lane)));
            assert!(is_spatial > 0.0);
            core::array::from_fn(|row| {
                core::array::from_fn(|column| {
                    let ((i, large_i), (j, large_j)) = ((row / 3, row % 3), (column / 3, column % 3));
                    let dot: f64 = (0..3).map(|k| f(k, large_i) * f(k, large_j)).sum();
                    let own = if i == j { inner * dot } else { 0.0 };
                    own + outer * f(i, large_i) * f(j, large_j) + exchanged * f(j, large_i) * f(i, large_j)
                })
            })
        });
        let tangents: Vec<_> = tangents.collect();
        let dense = |a: &Mat9| a.iter().map(|row| row.to_vec()).collect::<Matrix>();
        assert!(tangents.iter().all(|each| worst(&dense(each), &dense(&tangents[0])) < 1e-4));
        let mut sum = zeros(prepared.unknowns());
        prepared.add(&prepared.elements(), &tangents[0], &mut sum);
        let apart = worst(&prepared.of_cells(), &sum);
        println!("{name}: {apart:.1e} apart");
        assert!(apart < 1e-4);
    }
    for (name, supports) in ["free", "held foot", "some axes"].into_iter().zip(supports()) {
        prepare(linear(), &supports, &h, |prepared| of(&format!("linear, {name}"), prepared));
        prepare(NodalStrain(linear()), &supports, &h, |prepared| of(&format!("nodal strain, {name}"), prepared));
    }
}

/// A free body that has been turned and is not strained resists translations and rotations by nothing.
#[test]
fn a_turned_body_resists_no_rigid_motion() {
    let turn = rotation([1.0, 2.0, 3.0], 1.0);
    let h = from_fn(|i, j| turn[i][j] - if i == j { 1.0 } else { 0.0 });
    let judge = |name: &str, stiffness: &Matrix, motions: [Vec<f64>; 3]| {
        let [moved, turned, sheared] = motions.map(|motion| size(&times(stiffness, &motion)) / size(&motion));
        println!("{name}: {moved:.1e} of a translation, {turned:.1e} of a rotation, {sheared:.1e} kg of shear");
        assert!(moved.max(turned) < 1e-4 * sheared);
    };
    fn motions<M: ElementMaterial>(prepared: &Prepared<'_, '_, M>, turn: &Mat3) -> [Vec<f64>; 3] {
        let at = |x| reference::tensor::apply(turn, x);
        [
            prepared.motion(|_| [0.3, -0.2, 0.5]),
            prepared.motion(|x| cross([0.4, -0.7, 0.2], at(x))),
            prepared.motion(|x| [at(x)[1], 0.0, 0.0]),
        ]
    }
    prepare(linear(), &[], &h, |prepared| judge("linear", &prepared.of_cells(), motions(prepared, &turn)));
    prepare(NodalStrain(linear()), &[], &h, |prepared| {
        judge("nodal strain", &prepared.of_cells(), motions(prepared, &turn));
    });
}

/// Where body and supports move alike, nothing is strained: `Kc 1 + A_s 1 = 0`, whatever the state. Supports that stand
/// still resist, but only the functions around them.
#[test]
fn a_translation_of_body_and_supports_together_meets_no_resistance() {
    const SHIFT: [f32; 3] = [1e-3, -2e-3, 3e-3];
    let h = product(&rotation([0.0, 1.0, 1.0], 0.5), &[[1.1, 0.2, 0.0], [0.0, 0.95, 0.1], [0.0, 0.0, 1.05]]);
    let h = from_fn(|i, j| h[i][j] - if i == j { 1.0 } else { 0.0 });
    fn of<M: ElementMaterial>(name: &str, prepared: &Prepared<'_, '_, M>, supports: &[Support], axes: Axes) {
        let Prepared { scene, lattice, places, displacement, matrices, renewal, .. } = *prepared;
        let shift = [0, 1, 2].map(|axis| if axes.has(axis) { SHIFT[axis] } else { 0.0 });
        let moving = supports.iter().filter(|support| support.moves);
        // From where they are.
        let motions: Vec<_> = moving
            .map(|support| {
                let at = displacement[support.node as usize].to_array();
                let metre = [0, 1, 2].map(|axis| at[axis] + shift[axis]);
                Motion { node: support.node, axes: support.axes, metre, ramp: 0.0 }
            })
            .collect();
        let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
        let moving = MovingSupports {
            input: ClusterInput { scene, lattice, places, is_merged: renewal.is_merged },
            clusters: &matrices.clusters,
            tangents: matrices.of_clusters,
            displacement,
        };
        let step = Step::unchecked(1e-3, 0.0).unwrap();
        let (mut increment, mut changes) =
            (vec![NodeVector::ZERO; places.len()], vec![NodeVector([7.0; 4]); places.len()]);
        let mut room = [[NodeVector::ZERO; MAX_FUNCTIONS + 1]; 2];
        let pull = moving.pull(&loads, 0.0, &step, &mut increment, &mut changes, room.each_mut()).unwrap();
        let all = prepared.motion(|_| shift.map(f64::from));
        let resistance = times(&prepared.of_cells(), &all);
        let fixed: Vec<usize> = supports.iter().filter(|support| !support.moves).map(|s| s.node as usize).collect();
        let mut near = vec![false; lattice.functions()];
        for (_, [i, j, k], nodes) in prepared.elements() {
            let touches = nodes.iter().any(|(node, _)| fixed.contains(node));
            let cell = i + CELLS[0] as usize * (j + CELLS[1] as usize * k);
            for function in lattice.functions_of(cell).into_iter().filter(|_| touches) {
                near.get_mut(function).into_iter().for_each(|near| *near = true);
            }
        }
        let mut pulled: Row = [0.0; _];
        pulled.as_chunks_mut::<3>().0.iter_mut().zip(&*pull.residual).for_each(|(to, sum)| *to = sum.to_array());
        let (mut worst, mut largest, mut at_fixed) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (at, (&pulled, &resistance)) in pulled.iter().zip(&resistance).enumerate() {
            let apart = (f64::from(pulled) - resistance).abs();
            let place = if near[at / 3] { &mut at_fixed } else { &mut worst };
            *place = place.max(apart);
            largest = largest.max(f64::from(pulled).abs());
        }
        let work: f64 = all.iter().zip(pulled).map(|(all, pulled)| all * f64::from(pulled)).sum();
        let energy = f64::from(pull.energy) / work - 1.0;
        println!(
            "{name}: {worst:.1e} of at most {largest:.1e} kg m, {at_fixed:.1e} at fixed ones; energy off by {energy:.1e}"
        );
        assert!(largest > 0.0 && worst < 1e-5 * largest);
        assert!(fixed.is_empty() && energy.abs() < 1e-4 || at_fixed > 0.1 * largest);
        if displacement.iter().all(|moved| moved.to_array() == [0.0; 3]) {
            // The supports now keep their speed: nothing pulls, and work is done where the lattice does not follow.
            for support in supports.iter().filter(|support| support.moves) {
                let along = [0, 1, 2].map(|axis| if support.axes.has(axis) { shift[axis] } else { 0.0 });
                increment[support.node as usize] = NodeVector([along[0], along[1], along[2], 0.0]);
            }
            let mut room = [[NodeVector::ZERO; MAX_FUNCTIONS + 1]; 2];
            let kept = moving.pull(&loads, 0.0, &step, &mut increment, &mut changes, room.each_mut()).unwrap();
            assert!(kept.residual.iter().all(|sum| sum.to_array() == [0.0; 3]) && kept.energy == 0.0);
            let same = kept.of_last.iter().zip(&*pull.residual).all(|(a, b)| a.to_array() == b.to_array());
            assert!(same && kept.work(pull.residual) != 0.0);
        }
    }
    let [_, foot, some] = supports();
    let head = layers(8..9).map(Support::fixed);
    let both: Vec<_> = foot.iter().copied().chain(head).collect();
    let rail: Vec<_> = layers(0..1).map(|node| Support { node, axes: Axes::Z, moves: true }).collect();
    for (name, supports, axes) in [
        ("moved foot", foot, Axes::XYZ),
        ("moved foot and fixed head", both, Axes::XYZ),
        ("foot moved along z", rail.clone(), Axes::Z),
        ("some axes", some, Axes::XYZ),
    ] {
        for (state, h) in [("at rest", REST), ("strained", h)] {
            let name = |element| format!("{element}, {name}, {state}");
            prepare(linear(), &supports, &h, |prepared| of(&name("linear"), prepared, &supports, axes));
            prepare(NodalStrain(linear()), &supports, &h, |prepared| {
                of(&name("nodal strain"), prepared, &supports, axes);
            });
        }
    }
}
