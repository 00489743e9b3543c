//! What `supple::io` writes, it reads; VTK 9.7.2 (the reader in ParaView) and meshio 5.3.5 were seen to read it too.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;

use supple::io::{
    CellVectors, Frame, TetMesh, read_mesh, read_surface, write_atomically, write_pvd, write_triangles, write_vtu,
};

fn mesh() -> TetMesh {
    read_mesh(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/vtk_raw.vtu")).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The values of a Float32 array in a file of ours: the header of an array with one zlib block is four counts.
fn field(bytes: &[u8], name: &str) -> Vec<f32> {
    let find = |text: &str| bytes.windows(text.len()).position(|window| window == text.as_bytes());
    let start = find(&format!("Name=\"{name}\"")).unwrap();
    let element = std::str::from_utf8(&bytes[start..start + 120]).unwrap();
    let offset: usize = element.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    let block = &bytes[find("\n_").unwrap() + 2 + offset..];
    let count = |i: usize| u64::from_le_bytes(block[8 * i..8 * i + 8].try_into().unwrap()) as usize;
    assert_eq!(count(0), 1, "one block");
    let mut values = Vec::new();
    io::copy(&mut flate2::read::ZlibDecoder::new(&block[32..32 + count(3)]), &mut values).unwrap();
    assert_eq!(values.len(), count(2));
    values.chunks(4).map(|chunk| f32::from_le_bytes(chunk.try_into().unwrap())).collect()
}

#[test]
fn a_frame_comes_back_with_its_fields() {
    let mesh = mesh();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.vtu");
    let displacement: Vec<[f32; 3]> = mesh.points.iter().map(|p| p.map(|x| 0.1 * x as f32)).collect();
    let distance: Vec<f32> = (0..mesh.points.len()).map(|i| i as f32 / 3.0).collect();
    let stress: Vec<f32> = (0..mesh.tets.len()).map(|i| 1000.0 + i as f32).collect();
    let fibre: Vec<[f32; 3]> = (0..mesh.tets.len()).map(|i| [1.0, 0.25 * i as f32, -0.5]).collect();
    let regions: Vec<i32> = (0..mesh.tets.len() as i32).map(|i| i - 3).collect();
    let frame = Frame {
        points: &mesh.points,
        tets: &mesh.tets,
        point_vectors: &[("displacement", &displacement)],
        point_scalars: &[("a < \"b\" & c", &distance)],
        cell_scalars: &[("von Mises stress", &stress)],
        cell_vectors: &[("fibre", &fibre)],
        regions: &regions,
    };
    write_vtu(&path, &frame).unwrap();
    let back = read_mesh(&path).unwrap();
    assert_eq!((back.points, back.tets, back.regions), (mesh.points, mesh.tets, regions));
    let values = fibre.iter().map(|vector| vector.map(f64::from)).collect();
    assert_eq!(back.vectors, [CellVectors { name: "fibre".into(), values }]);
    let bytes = fs::read(&path).unwrap();
    assert_eq!(field(&bytes, "displacement"), displacement.as_flattened());
    assert_eq!(field(&bytes, "a &lt; &quot;b&quot; &amp; c"), distance);
    assert_eq!(field(&bytes, "von Mises stress"), stress);
    assert_eq!(names(folder.path()), ["frame.vtu"]);
}

#[test]
fn arrays_of_several_blocks() {
    // 1.2 MB of coordinates and 3.2 MB of connectivity, in blocks of 1 MiB.
    let points: Vec<[f64; 3]> = (0..50_000).map(|i| [f64::from(i), 0.5, -1.0 / f64::from(i + 1)]).collect();
    // No two have a face in common.
    let corners = [[0, 1, 4, 9], [0, 13, 30, 52]];
    let tets: Vec<[u32; 4]> =
        (0..100_000).map(|i| corners[i % 2].map(|corner| (i as u32 / 2 + corner) % 50_000)).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.vtu");
    let frame = Frame { points: &points, tets: &tets, ..Frame::default() };
    write_vtu(&path, &frame).unwrap();
    let back = read_mesh(&path).unwrap();
    assert_eq!((back.points, back.tets), (points, tets));
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_written() {
    let mesh = mesh();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.vtu");
    let frame =
        Frame { points: &mesh.points, tets: &mesh.tets, cell_scalars: &[("stress", &[1.0, 2.0])], ..Frame::default() };
    let error = write_vtu(&path, &frame).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::InvalidInput);
    assert_eq!(error.to_string(), "the field \"stress\" has 2 values for 24 tetrahedra");
    let frame = Frame { points: &mesh.points[..17], cell_scalars: &[], ..frame };
    let error = write_vtu(&path, &frame).unwrap_err();
    assert!(error.to_string().contains("of 17"), "{error}");
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_series_lists_times_and_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("series.pvd");
    write_pvd(&path, &[(0.0, "a.vtu".into()), (0.02, "b & c.vtu".into())]).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    assert_eq!(document.root_element().attribute("type"), Some("Collection"));
    let sets: Vec<_> = document.descendants().filter(|node| node.has_tag_name("DataSet")).collect();
    let values: Vec<_> = sets.iter().map(|set| (set.attribute("timestep"), set.attribute("file"))).collect();
    assert_eq!(values, [(Some("0"), Some("a.vtu")), (Some("0.02"), Some("b & c.vtu"))]);
}

#[test]
fn triangles_come_back_and_files_of_one_time_are_parts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tool.vtu");
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
    write_triangles(&path, &points, &[[0, 1, 2], [0, 3, 1]]).unwrap();
    assert!(read_mesh(&path).unwrap_err().to_string().contains("no tetrahedra"));
    let read = read_surface(&path).unwrap();
    assert_eq!((read.points, read.triangles), (points.to_vec(), vec![[0, 1, 2], [0, 3, 1]]));
    let tets = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/vtk_raw.vtu");
    assert!(!read_surface(&tets).unwrap().triangles.is_empty());
    let error = write_triangles(&folder.path().join("bad.vtu"), &points, &[[0, 1, 4]]).unwrap_err();
    println!("{error}");
    assert_eq!(error.kind(), ErrorKind::InvalidInput);
    let series = folder.path().join("series.pvd");
    let file = |name: &str| name.to_string();
    write_pvd(&series, &[(0.0, file("a")), (0.0, file("b")), (0.1, file("c"))]).unwrap();
    let text = fs::read_to_string(&series).unwrap();
    let parts: Vec<_> = text.split("part=\"").skip(1).map(|rest| &rest[..1]).collect();
    assert_eq!(parts, ["0", "1", "0"]);
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.csv");
    write_atomically(&path, |w| w.write_all(b"old")).unwrap();
    let error = write_atomically(&path, |w| {
        w.write_all(b"new")?;
        Err(io::Error::other("the disk is on fire"))
    });
    assert!(error.unwrap_err().to_string().ends_with("result.csv: cannot be written: the disk is on fire"));
    assert_eq!(fs::read(&path).unwrap(), b"old");
    write_atomically(&path, |w| write!(w, "new {}", 7)).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new 7");
    assert_eq!(names(folder.path()), ["result.csv"]);
}

#[test]
fn a_write_removes_what_killed_writes_of_the_file_left() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| fs::File::create(folder.path().join(name)).unwrap();
    file(".result.csv.7-0.tmp");
    // The first numbers of this process, as in a container, where every process may have the same.
    for count in 0..20 {
        file(&format!(".result.csv.{}-{count}.tmp", std::process::id()));
    }
    // One that is being written, and others' files.
    let kept = [".other.csv.7-0.tmp", ".result.csv.8-0.tmp", ".result.csv.tmp", ".result.csv.x-1.tmp"];
    let files = kept.map(file);
    files[1].lock().unwrap();
    let path = folder.path().join("result.csv");
    write_atomically(&path, |w| w.write_all(b"new")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    let mut expected = kept.to_vec();
    expected.push("result.csv");
    assert_eq!(names(folder.path()), expected);
}

#[test]
fn writes_of_one_file_at_once_leave_one_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.csv");
    std::thread::scope(|scope| {
        for writer in 0..4u8 {
            let path = &path;
            scope.spawn(move || {
                for _ in 0..50 {
                    write_atomically(path, |w| w.write_all(&[b'0' + writer; 100_000])).unwrap();
                }
            });
        }
    });
    let bytes = fs::read(&path).unwrap();
    assert!(bytes.len() == 100_000 && bytes.iter().all(|byte| *byte == bytes[0]));
    assert_eq!(names(folder.path()), ["result.csv"]);
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("result.csv");
    let error = write_atomically(&path, |_| Ok(())).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotFound);
    assert!(error.to_string().contains("result.csv"), "{error}");
    assert_eq!(write_atomically(Path::new("/"), |_| Ok(())).unwrap_err().kind(), ErrorKind::InvalidInput);
}
