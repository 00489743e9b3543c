//! Damaged mesh files of every format. Reading takes at most [`BYTES`] bytes of memory for each byte of the file, of a
//! compressed one for each byte of what it holds. What is read is in range, and the kernel takes it or says why not.

use std::fs;
use std::path::Path;

use supple::io::read_mesh;
use supple::loads::Loads;
use supple::material::NodalPressure;
use supple::mesh::{Mesh, Winding};
use supple::scene::{Support, VecScene};
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

use crate::data;
use crate::hostile::{Changes, Run, measured};
use crate::support::{NEO, tissue};

/// Bytes of memory for a byte of a file: an XML element of three characters becomes a node of 72 bytes in a vector that
/// grows; of a list of numbers two characters become eight bytes, and again eight.
const BYTES: u64 = 128;
/// Bytes of memory for any file: names, messages, buffers.
const ANY: u64 = 20_000;
/// Bytes of arrays for a byte of a file compressed with zlib, and for any.
const UNPACKED: u64 = 50;
const UNPACKED_OF_ANY: u64 = 1 << 20;

/// Tries inputs made from `sound` ones as files of this name, and prints the most memory that a byte of them took.
fn tries(target: &'static str, name: &str, sound: &[Vec<u8>], words: &[&[u8]]) {
    // Files in memory, where there are any: on a disk most of the time would go into them.
    let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap();
    let path = folder.path().join(name);
    let changes = Changes { sound, words, most: 300_000 };
    let mut most = 0.0_f64;
    Run::new(target, 2_000).each(|dice| {
        let bytes = changes.input(dice);
        write(&path, &bytes);
        let (mesh, memory) = measured(|| read_mesh(&path));
        let compressed = bytes.windows(6).any(|window| window == b"vtkZLi");
        let stored = bytes.len() as u64;
        let unpacked = if compressed { UNPACKED * stored + UNPACKED_OF_ANY } else { stored };
        most = most.max(memory.saturating_sub(ANY) as f64 / bytes.len().max(1) as f64);
        assert!(memory <= BYTES * unpacked + ANY, "{memory} bytes for {}", bytes.len());
        match mesh {
            Ok(mesh) => {
                let nodes = mesh.points.len();
                assert!(!mesh.tets.is_empty());
                assert!(
                    mesh.tets.iter().flatten().chain(mesh.triangles.iter().flatten()).all(|&n| (n as usize) < nodes)
                );
                assert!(mesh.regions.is_empty() || mesh.regions.len() == mesh.tets.len());
                simulate(&mesh.points, &mesh.tets);
                true
            }
            Err(error) => {
                let text = error.to_string();
                let stem = path.file_stem().unwrap().to_str().unwrap();
                assert!(text.contains(stem) && text.len() > stem.len() + 10, "{text:?}");
                assert!(text.chars().count() < 1_000 && !text.contains(char::is_control), "{text:?}");
                false
            }
        }
    });
    println!("{target}: {most:.1} bytes for each of a file at most");
}

fn write(path: &Path, bytes: &[u8]) {
    let cut = bytes.windows(4).position(|window| window == b"---\n");
    if path.extension().is_some_and(|extension| extension == "ele") {
        let (nodes, elements) = cut.map_or((bytes, &b""[..]), |cut| (&bytes[..cut], &bytes[cut + 4..]));
        fs::write(path.with_extension("node"), nodes).unwrap();
        fs::write(path, elements).unwrap();
    } else {
        fs::write(path, bytes).unwrap();
    }
}

/// Builds a scene of a mesh, whatever it is, and takes some steps.
fn simulate(points: &[[f64; 3]], tets: &[[u32; 4]]) {
    let points: Vec<_> = points.iter().map(|point| point.map(|x| x as f32)).collect();
    if let Err(error) = Mesh::new(&points, tets, Winding::Checked) {
        assert!(!error.to_string().is_empty());
    }
    let mesh = match Mesh::new(&points, tets, Winding::Normalised) {
        Ok(mesh) if points.len() < 2_000 => mesh,
        _ => return,
    };
    let Ok(scene) = VecScene::build(NodalPressure(tissue(NEO)), &mesh, &[Support::fixed(0)]) else {
        return;
    };
    let mut state = VecState::at_rest(points.len());
    let Some(critical) = tled::critical_step(&scene, &mut state) else {
        return;
    };
    let (Ok(step), Ok(loads)) =
        (Step::new(0.9 * critical.seconds, 1.0, critical), Loads::new(&scene, [0.0, 0.0, -9.81], &[], &[]))
    else {
        return;
    };
    for _ in 0..3 {
        if tled::step(&scene, &loads, &mut state, &step).is_taken() {
            assert!(state.displacements().iter().all(|u| u.to_array().iter().all(|x| x.is_finite())));
        }
    }
}

#[test]
fn vtk() {
    let words: &[&[u8]] = &[
        b"POINTS ",
        b"CELLS ",
        b"CELL_TYPES ",
        b"METADATA\n",
        b"FIELD a 1\n",
        b"SCALARS region int\n",
        b"BINARY",
        b"ASCII",
    ];
    tries("vtk", "a.vtk", &data(&[".vtk"]), words);
}

#[test]
fn vtu() {
    let words: &[&[u8]] = &[
        b"<Piece>",
        b"<DataArray>",
        b"<!DOCTYPE a [<!ENTITY b \"bbbbbbbb\">]>",
        b"&b;",
        b"<![CDATA[",
        b"<!--",
        b"offset=\"0\" ",
        b"format=\"appended\" ",
        b"compressor=\"vtkZLibDataCompressor\" ",
        b"_",
    ];
    tries("vtu", "a.vtu", &data(&[".vtu"]), words);
}

#[test]
fn msh() {
    let words: &[&[u8]] =
        &[b"$Nodes\n", b"$EndNodes\n", b"$Elements\n", b"$Entities\n", b"$MeshFormat\n", b"$Periodic\n"];
    tries("msh", "a.msh", &data(&[".msh"]), words);
}

#[test]
fn tetgen() {
    let pair =
        |name: &str| [data(&[&format!("{name}.node")]), data(&[&format!("{name}.ele")])].concat().join(&b"---\n"[..]);
    let sound = [pair("tetgen.1"), pair("meshio_tetgen_bare")];
    tries("tetgen", "a.ele", &sound, &[b"#", b"---\n"]);
}

/// Many pieces that all name one array would take its memory many times.
#[test]
fn pieces_that_share_an_array_are_refused() {
    let points = 20_000;
    let piece = format!(
        "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"0\"><Points><DataArray type=\"Float32\" format=\"appended\" offset=\"0\"/></Points>\
         <Cells><DataArray type=\"Int32\" Name=\"types\"/><DataArray type=\"Int32\" Name=\"offsets\"/>\
         <DataArray type=\"Int32\" Name=\"connectivity\"/></Cells></Piece>"
    );
    let file = |pieces| {
        let head = "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">";
        let grid = format!("<UnstructuredGrid>{}</UnstructuredGrid>", piece.repeat(pieces));
        let length = 12 * points as u32;
        let data = [length.to_le_bytes().to_vec(), vec![0; length as usize]].concat();
        [format!("{head}{grid}<AppendedData encoding=\"raw\">_").into_bytes(), data].concat()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shared.vtu");
    for (pieces, expected) in
        [(1, "the file has no tetrahedra"), (300, "more bytes together than a file of this size can hold")]
    {
        let file = file(pieces);
        fs::write(&path, &file).unwrap();
        let (mesh, memory) = measured(|| read_mesh(&path));
        let error = mesh.unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
        assert!(memory <= BYTES * file.len() as u64 + ANY, "{memory} bytes for {}", file.len());
    }
}
