//! Every encoding in `tests/data` (made by `make.py` there, by VTK, Gmsh and meshio) holds the same mesh.

use std::path::{Path, PathBuf};

use supple::io::{TetMesh, read_mesh};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn read(name: &str) -> TetMesh {
    read_mesh(&data(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// The mesh of `reference.txt`: lines `p x y z`, `t a b c d region`, `f a b c`.
fn reference() -> TetMesh {
    let mut mesh = TetMesh::default();
    for line in std::fs::read_to_string(data("reference.txt")).unwrap().lines() {
        let (kind, values) = line.split_once(' ').unwrap();
        let values: Vec<f64> = values.split(' ').map(|value| value.parse().unwrap()).collect();
        match (kind, values.as_slice()) {
            ("p", &[x, y, z]) => mesh.points.push([x, y, z]),
            ("f", &[a, b, c]) => mesh.triangles.push([a, b, c].map(|p| p as u32)),
            ("t", &[a, b, c, d, region]) => {
                mesh.tets.push([a, b, c, d].map(|p| p as u32));
                mesh.regions.push(region as i32);
            }
            _ => panic!("{line}"),
        }
    }
    mesh
}

/// Gmsh writes 16 digits in text: not always the same bits.
fn rounded(x: f64) -> i64 {
    (x * 1e12).round() as i64
}

/// Cells by the coordinates of their corners, in the order of the corners: equal in any order of the points.
type Cell<const N: usize> = ([[i64; 3]; N], Option<i32>);

fn by_coordinates<const N: usize>(mesh: &TetMesh, cells: &[[u32; N]], regions: &[i32]) -> Vec<Cell<N>> {
    let corner = |p: u32| mesh.points[p as usize].map(rounded);
    let region = |cell: usize| regions.get(cell).copied();
    let mut cells: Vec<_> = cells.iter().enumerate().map(|(i, cell)| (cell.map(corner), region(i))).collect();
    cells.sort_unstable();
    cells
}

fn points(mesh: &TetMesh) -> Vec<[i64; 3]> {
    let mut points: Vec<_> = mesh.points.iter().map(|p| p.map(rounded)).collect();
    points.sort_unstable();
    points
}

fn assert_same(name: &str, mesh: &TetMesh, expected: &TetMesh) {
    assert_eq!(points(mesh), points(expected), "points of {name}");
    assert_eq!(
        by_coordinates(mesh, &mesh.tets, &mesh.regions),
        by_coordinates(expected, &expected.tets, &expected.regions),
        "tetrahedra of {name}"
    );
    assert_eq!(
        by_coordinates(mesh, &mesh.triangles, &[]),
        by_coordinates(expected, &expected.triangles, &[]),
        "triangles of {name}"
    );
}

#[test]
fn reference_is_what_we_think() {
    let mesh = reference();
    assert_eq!((mesh.points.len(), mesh.tets.len(), mesh.triangles.len()), (18, 24, 32));
    assert_eq!(mesh.regions.iter().filter(|&&region| region == 3).count(), 12);
}

#[test]
fn every_encoding_holds_the_same_mesh() {
    let expected = reference();
    for name in [
        "vtk_4.2_ascii.vtk",
        "vtk_4.2_binary.vtk",
        "vtk_5.1_ascii_f32.vtk",
        "vtk_5.1_binary.vtk",
        "meshio_4.2_ascii.vtk",
        "meshio_5.1_ascii.vtk",
        "meshio_5.1_binary.vtk",
        "vtk_ascii.vtu",
        "vtk_inline_f32.vtu",
        "vtk_inline_zlib_u64.vtu",
        "vtk_base64_big.vtu",
        "vtk_base64_zlib.vtu",
        "vtk_raw.vtu",
        "vtk_raw_u64_big.vtu",
        "vtk_raw_zlib.vtu",
        "meshio_zlib.vtu",
        "gmsh_1.0_ascii.msh",
        "gmsh_2.2_ascii.msh",
        "gmsh_2.2_binary.msh",
        "gmsh_4.1_ascii.msh",
        "gmsh_4.1_binary.msh",
        "meshio_2.2_ascii.msh",
        "meshio_2.2_binary.msh",
        "big_2.2_binary.msh",
        "big_4.1_binary.msh",
    ] {
        assert_same(name, &read(name), &expected);
    }
}

#[test]
fn without_regions_or_triangles_in_the_file_both_are_empty() {
    let expected = TetMesh { triangles: Vec::new(), regions: Vec::new(), ..reference() };
    for name in ["meshio_4.1_ascii_bare.msh", "meshio_4.1_binary_bare.msh", "meshio_tetgen_bare.node"] {
        assert_same(name, &read(name), &expected);
    }
}

#[test]
fn nothing_is_renumbered() {
    let expected = reference();
    for name in ["vtk_5.1_ascii_f32.vtk", "vtk_raw.vtu", "meshio_2.2_ascii.msh", "big_4.1_binary.msh"] {
        let mesh = read(name);
        assert_eq!((mesh.points, mesh.triangles), (expected.points.clone(), expected.triangles.clone()), "{name}");
    }
    assert_eq!(read("vtk_raw.vtu"), expected);
}

#[test]
fn tetgen_is_found_by_either_file() {
    let expected = TetMesh { triangles: Vec::new(), ..reference() };
    assert_eq!(read("tetgen.1.node"), expected);
    assert_eq!(read("tetgen.1.ele"), expected);
    assert_eq!(read("meshio_tetgen_bare.ele"), read("meshio_tetgen_bare.node"));
}

#[test]
fn pieces_are_joined() {
    // Both pieces carry all points, the second has no triangles.
    let (mesh, expected) = (read("vtk_pieces.vtu"), reference());
    assert_eq!(mesh.points, [expected.points.as_slice(), &expected.points].concat());
    let whole = TetMesh {
        points: expected.points.clone(),
        tets: mesh.tets.iter().map(|t| t.map(|p| p % 18)).collect(),
        ..mesh
    };
    assert_eq!(whole, expected);
}

#[test]
fn geometry_with_parameters_on_curves_and_surfaces() {
    let expected = TetMesh { regions: Vec::new(), ..read("lens.vtk") };
    assert!(expected.tets.len() > 4);
    for name in ["lens_4.1.msh", "lens_parametric.msh", "lens_parametric_binary.msh"] {
        let mesh = read(name);
        // No physical groups, so the elementary tag of the only volume.
        assert_eq!(mesh.regions, vec![1; mesh.tets.len()]);
        assert_same(name, &TetMesh { regions: Vec::new(), ..mesh }, &expected);
    }
}
