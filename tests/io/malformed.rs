//! A malformed file is an error that names the place and the value: never a panic, never a long wait.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use supple::io::{ReadError, TetMesh, read_file, read_mesh, read_text};

/// Reads `content` from a file of this name; with `.ele`, `content` is the `.node` file, `---`, and the `.ele` file.
fn read(name: &str, content: &[u8]) -> Result<TetMesh, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let cut = content.windows(4).position(|window| window == b"---\n");
    match cut.filter(|_| name.ends_with(".ele")) {
        Some(cut) => {
            fs::write(path.with_extension("node"), &content[..cut]).unwrap();
            fs::write(&path, &content[cut + 4..]).unwrap();
        }
        None => fs::write(&path, content).unwrap(),
    }
    read_mesh(&path)
}

fn assert_refused(name: &str, content: &[u8], expected: &str) {
    let error = read(name, content).expect_err(expected).to_string();
    assert!(error.contains(expected), "{error:?} lacks {expected:?}");
    let stem = Path::new(name).file_stem().unwrap().to_str().unwrap();
    assert!(error.contains(stem), "{error:?} does not name {name}");
}

const VTK: &str = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n1 0 0\n\
                   0 1 0\n0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";

const VTK5: &str = "# vtk DataFile Version 5.1\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n1 0 0\n\
                    0 1 0\n0 0 1\nCELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3\n\
                    CELL_TYPES 1\n10\n";

const MSH1: &str = "$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n7 0 0 1\n$ENDNOD\n$ELM\n1\n1 4 5 6 4 1 2 3 7\n$ENDELM\n";

const MSH2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n7 0 0 1\n$EndNodes\n\
                    $Elements\n1\n40 4 2 5 6 1 2 3 7\n$EndElements\n";

const MSH4: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n9 0 0 0 1 1 1 1 5 0\n$EndEntities\n\
                    $Nodes\n1 4 1 7\n3 9 0 4\n1\n2\n3\n7\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
                    $Elements\n1 1 1 1\n3 9 4 1\n40 1 2 3 7\n$EndElements\n";

const TETGEN: &str = "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n---\n1 4 1\n1 1 2 3 4 8\n";

const VTU: &str = r#"<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Cells>
<DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10</DataArray>
</Cells></Piece></UnstructuredGrid></VTKFile>
"#;

#[test]
fn the_files_that_are_broken_below_are_sound() {
    let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (name, content, regions) in [
        ("a.vtk", VTK, vec![]),
        ("a.vtk", VTK5, vec![]),
        ("a.vtu", VTU, vec![]),
        ("a.msh", MSH1, vec![5]),
        ("a.msh", MSH2, vec![5]),
        ("a.msh", MSH4, vec![5]),
        ("a.ele", TETGEN, vec![8]),
    ] {
        let expected =
            TetMesh { points: points.clone(), tets: vec![[0, 1, 2, 3]], triangles: vec![], regions, vectors: vec![] };
        assert_eq!(read(name, content.as_bytes()).unwrap_or_else(|error| panic!("{error}")), expected, "{content}");
        let marked = format!("\u{feff}{}", content.replace("---\n", "---\n\u{feff}"));
        assert_eq!(read(name, marked.as_bytes()).unwrap_or_else(|error| panic!("{error}")), expected, "{content}");
        let windows = content.replace('\n', "\r\n").replace("---\r\n", "---\n");
        assert_eq!(read(name, windows.as_bytes()).unwrap_or_else(|error| panic!("{error}")), expected, "{content}");
    }
}

#[test]
fn unusual_but_allowed() {
    let expected = read("a.vtk", VTK.as_bytes()).unwrap();
    // Text may go on in the line of its keyword, metadata may follow any array.
    let line = VTK.replace("double\n", "double ").replace("1 5\n", "1 5 ").replace("CELL_TYPES 1\n", "CELL_TYPES 1 ");
    assert_eq!(read("a.vtk", line.as_bytes()).unwrap(), expected);
    let metadata = VTK5.replace("CONN", "METADATA\nINFORMATION 0\n\nCONN");
    assert_eq!(read("a.vtk", metadata.as_bytes()).unwrap(), expected);
    let quads = VTK.replace("CELLS 1 5", "CELLS 3 12\n4 0 1 2 3\n1 0").replace("S 1\n10", "S 3\n9\n1\n10");
    assert_eq!(read("a.vtk", quads.as_bytes()).unwrap(), expected);
    // A piece without anything, whose arrays have not even a header.
    let array = |name| format!("<DataArray type=\"Int64\" Name=\"{name}\" format=\"binary\"/>");
    let cells = [array("connectivity"), array("offsets"), array("types")].concat();
    let points = array("Points");
    let empty = format!(
        "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><Points>{points}</Points><Cells>{cells}</Cells></Piece>"
    );
    let pieces = VTU.replace("</Piece>", &format!("</Piece>{empty}"));
    assert_eq!(read("a.vtu", pieces.as_bytes()).unwrap(), expected);
    // Extensions in capitals.
    assert_eq!(read("a.VTK", VTK.as_bytes()).unwrap(), expected);
    assert!(read("a.NODE", b"").unwrap_err().to_string().contains("a.NODE, line 1: the file ends where"));
}

#[test]
fn not_a_number_is_left_to_the_check_of_the_mesh() {
    let mesh = read("a.msh", MSH2.replace("2 1 0 0", "2 nan -inf 1e400").as_bytes()).unwrap();
    assert!(mesh.points[1][0].is_nan());
    assert_eq!(mesh.points[1][1..], [f64::NEG_INFINITY, f64::INFINITY]);
}

#[test]
fn names_in_messages_are_cut_and_cannot_control_a_terminal() {
    let name = format!("\u{1b}[2J{}", "long".repeat(10_000));
    let arrays = format!("CELL_DATA 1\nSCALARS {name} int\nLOOKUP_TABLE default\nx\n");
    let cells = VTU.replace("<Cells>", "<Cel--->").replace("--->", &format!("{}>", "-".repeat(10_000)));
    for (file, content) in [("a.vtk", [VTK, &arrays].concat()), ("a.vtu", cells)] {
        let error = read(file, content.as_bytes()).unwrap_err().to_string();
        assert!(error.len() < 600 && error.ends_with("...") && !error.contains(char::is_control), "{error:?}");
    }
}

#[test]
fn as_many_compressed_bytes_as_can_be_counted_are_missing() {
    let zlib = VTU.replace("type=\"Unstr", "compressor=\"vtkZLibDataCompressor\" type=\"Unstr");
    let points = zlib.replace("NumberOfPoints=\"4\"", &format!("NumberOfPoints=\"{}\"", u64::MAX / 3));
    // One block, of an empty text.
    let empty = points
        .replace("format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1", "format=\"binary\">AQAAAAAAAAAAAAAACAAAAA==eJwDAAAAAAE=");
    let bytes = empty.replace("Float64", "UInt8");
    assert_refused("bad.vtu", bytes.as_bytes(), "more bytes together than a file of this size can hold");
}

/// In `sound`, the first text of a change is replaced by the second; the message must contain the third.
fn assert_changes_refused(name: &str, sound: &str, changes: &[(&str, &str, &str)]) {
    for (from, to, expected) in changes {
        assert!(sound.contains(from), "{from}");
        assert_refused(name, sound.replacen(from, to, 1).as_bytes(), expected);
    }
}

#[test]
#[rustfmt::skip] // a line each
fn vtk_with_counted_cells() {
    assert_changes_refused("bad.vtk", VTK, &[
        ("# vtk", "# vtx", "line 1: the file does not begin with"),
        ("3.0", "7.0", "line 1: version \"7.0\" is unknown"),
        ("3.0", "x", "line 1: version \"x\" is unknown"),
        ("ASCII", "ASCI", "line 3: \"ASCI\" where ASCII or BINARY"),
        ("UNSTRUCTURED_GRID", "POLYDATA", "line 4: the data set is \"POLYDATA\""),
        ("double", "string", "line 5: the type \"string\" of POINTS is unknown"),
        ("POINTS 4", "POINTS 1000000000000000", "line 10: \"CELLS\" where value 13 of 3000000000000000 of POINTS"),
        ("POINTS 4", "POINTS 18446744073709551615", "\"CELLS\" where value 13"),
        ("POINTS 4", "POINTS -4", "line 5: \"-4\" where the number of points is expected"),
        ("POINTS 4", "POINTS 3", "line 9: \"0\" where a keyword such as CELLS is expected"),
        ("1 0 0", "1 0,5 0", "line 7: \"0,5\" where value 5 of 12 of POINTS is expected"),
        ("4 0 1 2 3", "4 0 1 2 4", "line 10: cell 0 names point 4, but the points are numbered 0 to 3"),
        ("4 0 1 2 3", "4 0 1 2 -1", "cell 0 names point -1"),
        ("4 0 1 2 3", "3 0 1 2 3", "line 10: cell 1 claims 3 points, but 0 entries are left"),
        ("4 0 1 2 3", "-4 0 1 2 3", "cell 0 claims -4 points"),
        ("CELLS 1 5", "CELLS 2 5", "line 10: CELLS announces 2 cells, but lists 1"),
        ("CELLS 1 5", "CELLS 1 6", "\"CELL_TYPES\" where value 6 of 6 of CELLS"),
        ("CELL_TYPES 1\n10\n", "", "the file ends without CELL_TYPES"),
        ("CELL_TYPES 1\n10\n", "CELL_TYPES 2\n10 10\n", "2 cell types for 1 cells"),
        ("CELL_TYPES 1\n10\n", "CELL_TYPES 1\n", "line 13: the file ends where value 1 of 1 of CELL_TYPES"),
        ("\n10\n", "\n12\n", "cell 0 is a hexahedron (VTK type 12); only tetrahedra"),
        ("\n10\n", "\n24\n", "cell 0 is a quadratic tetrahedron"),
        ("\n10\n", "\n200\n", "cell 0 is a cell of another type (VTK type 200)"),
        ("\n10\n", "\n5\n", "cell 0 is a triangle with 4 points"),
        ("\n10\n", "\n9\n", "the file has no tetrahedra"),
        ("\n10\n", "\n10\nCELL_DATA 1\nSCALARS region int\nLOOKUP_TABLE default\n3000000000\n", "region 3000000000"),
        ("\n10\n", "\n10\nCELL_DATA 2\nSCALARS region int\nLOOKUP_TABLE default\n3 4\n", "2 regions for 1 cells"),
    ]);
}

#[test]
#[rustfmt::skip] // a line each
fn vtk_with_offsets() {
    assert_changes_refused("bad.vtk", VTK5, &[
        ("OFFSETS", "OFFSET", "line 11: \"OFFSET\" where OFFSETS is expected"),
        ("\n0 4\n", "\n1 4\n", "line 10: the first of the OFFSETS is 1, not 0"),
        ("\n0 4\n", "\n0 5\n", "cell 0 has the entries 0 to 5 of the connectivity, which has 4"),
        ("\n0 4\n", "\n0 -4\n", "entries 0 to -4"),
        ("\n0 4\n", "\n0 4.5\n", "line 12: \"4.5\" where value 2 of 2 of OFFSETS"),
        ("CELLS 2 4", "CELLS 2 99999999999999", "\"CELL_TYPES\" where value 5"),
        ("CONNECTIVITY vtktypeint64", "CONNECTIVITY float", "CONNECTIVITY must be whole numbers"),
    ]);
}

#[test]
#[rustfmt::skip] // a line each
fn vtu() {
    assert_changes_refused("bad.vtu", VTU, &[
        ("<VTKFile", "<VTKFail", "line 8: expected 'VTKFail' tag"),
        ("UnstructuredGrid\" v", "PolyData\" v", "line 1, <VTKFile>: the data set is \"PolyData\""),
        ("0.1", "3.0", "version \"3.0\" is unknown"),
        ("LittleEndian", "Middle", "the byte order \"Middle\" is unknown"),
        ("NumberOfPoints=\"4\"", "", "line 2, <Piece>: NumberOfPoints is \"\", not a number"),
        ("NumberOfPoints=\"4\"", "NumberOfPoints=\"999999999999999\"", "line 3, <DataArray>: the file ends where value 13"),
        ("NumberOfPoints=\"4\"", "NumberOfPoints=\"9999999999999999999\"", "value 13"),
        ("NumberOfPoints=\"4\"", "NumberOfPoints=\"3\"", "line 3, <DataArray>: \"0\" after the last value"),
        ("NumberOfCells=\"1\"", "NumberOfCells=\"2\"", "array \"types\": the file ends where value 2 of 2"),
        ("Float64", "Float16", "the type \"Float16\" of the array is unknown"),
        ("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\"", "points have 2 components"),
        ("0 1 2 3", "0 1 x 3", "line 5, array \"connectivity\": \"x\" where value 3 of 4"),
        ("0 1 2 3", "0 1 2 4", "line 4, <Cells>: cell 0 names point 4"),
        ("\"offsets\"", "\"ofsets\"", "line 4, <Cells>: the array \"offsets\" is missing"),
        (">4</", ">-4</", "the last of the offsets is -4"),
        (">10</", ">14</", "cell 0 is a pyramid"),
        ("<Points>", "<Points/><P>", "line 3: expected 'P' tag"),
        ("<UnstructuredGrid>", "<UnstructuredGrid>\u{1}", "line 2: "),
    ]);
}

#[test]
#[rustfmt::skip] // a line each
fn gmsh_1() {
    assert_changes_refused("bad.msh", MSH1, &[
        ("$NOD", "(0 \"Fluent\"", "line 1: \"(0\" where $MeshFormat or $NOD is expected"),
        ("7 0 0 1", "3 0 0 1", "line 6: node 3 is listed twice"),
        ("4 1 2 3 7", "4 1 2 3 999", "line 10: element 1 names node 999, which is not one of the file's 4 nodes"),
        ("4 1 2 3 7", "10 1 2 3 7", "line 10: element 1 has the type 4 with 10 nodes"),
        ("$ENDELM", "", "the file ends where $ENDELM is expected"),
    ]);
}

#[test]
#[rustfmt::skip] // a line each
fn gmsh_2() {
    assert_changes_refused("bad.msh", MSH2, &[
        ("2.2 0 8", "3.0 0 8", "line 2: version \"3.0\" cannot be read; save the mesh as version 4.1 or 2.2"),
        ("2.2 0 8", "2.2 2 8", "line 2: the file type is 2"),
        ("2.2 0 8", "2.2 1 4", "numbers of 4 bytes"),
        ("2.2 0 8", "2.2 1 8", "byte 20: [36, 69, 110, 100] is not the number one in either byte order"),
        ("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "", "line 1: \"$Nodes\" without $MeshFormat"),
        ("\n4\n1 0", "\n1000000000000000\n1 0", "line 10: \"$EndNodes\" where the number of node 5 of 1000000000000000"),
        ("\n4\n1 0", "\n3\n1 0", "line 9: \"7\" where $EndNodes is expected"),
        ("\n4\n1 0", "\n4 1 0", "line 5: \"1\" where the line should end"),
        ("3 0 1 0", "3 0 1", "line 8: the line ends where the coordinate z of node 3 is expected"),
        ("3 0 1 0", "3 0 1 0 9", "line 8: \"9\" where the line should end"),
        ("3 0 1 0", "3 0 abc 0", "line 8: \"abc\" where the coordinate y of node 3"),
        ("1 2 3 7", "1 2 3 4", "line 13: element 40 names node 4, which is not one of"),
        ("1 2 3 7", "1 2 3 -7", "element 40 names node -7"),
        ("1 2 3 7", "1 2 3", "line 13: the line ends where a node of element 40"),
        ("40 4 2", "40 5 2", "line 13: element 40 is a hexahedron (Gmsh type 5); only tetrahedra"),
        ("40 4 2", "40 11 2", "element 40 is a tetrahedron with ten nodes (Gmsh type 11)"),
        ("40 4 2", "40 4 999999", "the line ends where a tag of element 40"),
        ("40 4 2 5 6 1 2 3 7", "40 2 2 5 6 1 2 3", "the file has no tetrahedra"),
        ("$Nodes", "$Knoten", "line 4: the section \"$Knoten\" has no end"),
        ("$EndElements", "41 4 2 5 6 1 2 3 7\n$EndElements", "line 14: \"41\" where $EndElements"),
    ]);
}

#[test]
#[rustfmt::skip] // a line each
fn gmsh_4() {
    assert_changes_refused("bad.msh", MSH4, &[
        ("4.1", "4.0", "version \"4.0\" cannot be read"),
        ("$EndEntities", "$EndEntities\n$PartitionedEntities", "line 8: the mesh is partitioned"),
        ("\n7\n", "\n2\n", "line 14: node 2 is listed twice"),
        ("1 4 1 7", "1 5 1 7", "5 nodes are announced, but the blocks list 4"),
        ("3 9 0 4", "3 9 0 9", "line 15: \"0\" where the line should end"),
        ("1 1 1 1\n3 9 4", "1 2 1 1\n3 9 4", "2 elements are announced, but the blocks list 1"),
        ("3 9 4 1", "3 9 6 1", "element 40 is a prism"),
        ("40 1 2 3 7", "40 1 2 3 8", "line 23: element 40 names node 8"),
        ("$Nodes", "$Elements", "elements come before the nodes"),
    ]);
}

#[test]
#[rustfmt::skip] // a line each
fn tetgen() {
    assert_changes_refused("bad.ele", TETGEN, &[
        ("4 3 0 0", "4 2 0 0", "bad.node, line 1: the dimension is 2; it must be 3"),
        ("4 3 0 0", "5 3 0 0", "bad.node, line 6: the file ends where the number of node 5 of 5"),
        ("4 3 0 0", "3 3 0 0", "bad.node, line 5: \"4\" where the file should end after the announced 3 nodes"),
        ("2 1 0 0", "2 1 0 # 0", "bad.node, line 3: the line ends where the coordinate z of node 2"),
        ("2 1 0 0", "1 1 0 0", "bad.node, line 3: node 1 is listed twice"),
        ("1 4 1", "1 10 1", "bad.ele, line 1: the tetrahedra have 10 nodes"),
        ("1 2 3 4 8", "0 2 3 4 8", "bad.ele, line 2: element 1 names node 0"),
        ("1 2 3 4 8", "1 2 3 4", "bad.ele, line 2: the line ends where an attribute of element 1"),
        ("1 2 3 4 8", "1 2 3 4 eight", "\"eight\" where an attribute of element 1"),
        ("1 4 1", "9 4 1", "the file ends where the number of element 2 of 9"),
    ]);
}

#[test]
fn binary_arrays_of_xml_files() {
    let points = r#"format="ascii">0 0 0 1 0 0 0 1 0 0 0 1<"#;
    let binary = |text: &str| VTU.replace(points, &format!("format=\"binary\">{text}<"));
    assert_refused("a.vtu", binary("AA!A").as_bytes(), "line 3, <DataArray>: \"AA!A\" is not base64");
    assert_refused("a.vtu", binary("").as_bytes(), "4 bytes are expected, but the base64 text ends after 0");
    assert_refused("a.vtu", binary("YAAAAAAA").as_bytes(), "96 bytes are expected, but the base64 text ends after");
    assert_refused("a.vtu", binary("/////w==").as_bytes(), "the array has 4294967295 bytes instead of 96");
    assert_refused("a.vtu", VTU.replace(points, "format=\"hex\"><").as_bytes(), "the format \"hex\"");
    let appended = VTU.replace(points, "format=\"appended\" offset=\"7\"><");
    assert_refused("a.vtu", appended.as_bytes(), "the offset 7 is beyond the 0 appended bytes");
    let huge = binary("YAAAAAAA").replace("NumberOfPoints=\"4\"", "NumberOfPoints=\"1000000000000000\"");
    assert_refused("a.vtu", huge.as_bytes(), "the array has 96 bytes instead of 24000000000000000");

    let zlib = |text: &str| binary(text).replace("<VTKFile", "<VTKFile compressor=\"vtkZLibDataCompressor\"");
    // The count of blocks, the bytes of a full and of the last block, and the compressed bytes.
    let header = |counts: [u32; 4], data: &[u8]| {
        use base64::{Engine, engine::general_purpose::STANDARD};
        let counts: Vec<u8> = counts.iter().flat_map(|count| count.to_le_bytes()).collect();
        zlib(&(STANDARD.encode(counts) + &STANDARD.encode(data)))
    };
    assert_refused("a.vtu", header([1, 96, 0, 5], b"12345").as_bytes(), "block 0 is not zlib data");
    assert_refused("a.vtu", header([1, 96, 0, 4_000_000_000], b"").as_bytes(), "4000000000 bytes are expected");
    assert_refused("a.vtu", header([u32::MAX, 96, 0, 0], b"").as_bytes(), "4 bytes are expected");
    assert_refused("a.vtu", header([0, 96, 0, 0], b"").as_bytes(), "the array has 0 bytes instead of 96");
    // A megabyte of zeros in a thousand bytes: unpacked no further than the array is long.
    let bomb = {
        use std::io::Write;
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(&vec![0; 1 << 20]).unwrap();
        encoder.finish().unwrap()
    };
    let size = bomb.len() as u32;
    assert_refused("a.vtu", header([1, 1 << 20, 0, size], &bomb).as_bytes(), "97 bytes or more instead of 1048576");
}

#[test]
fn files_of_other_kinds() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    for (name, expected) in [
        ("refused_lz4.vtu", "compressed with \"vtkLZ4DataCompressor\", which cannot be read"),
        ("refused_lzma.vtu", "compressed with \"vtkLZMADataCompressor\""),
        ("refused_4.0.msh", "version \"4\" cannot be read; save the mesh as version 4.1 or 2.2"),
        ("refused_order2.msh", "is a tetrahedron with ten nodes (Gmsh type 11)"),
        ("refused_order2.vtk", "is a quadratic tetrahedron (VTK type 24)"),
    ] {
        let error = read_mesh(&data.join(name)).expect_err(name).to_string();
        assert!(error.contains(expected), "{error}");
    }
    for extension in ["vtk", "vtu", "msh", "node"] {
        for content in [b"".as_slice(), b"\n\n", b"\xff\xfe\x00", b"<a/>", b"0", &[0; 1000]] {
            assert!(read(&format!("a.{extension}"), content).is_err());
        }
    }
    assert_refused("a.vtu", b"<VTKFile>\xff</VTKFile>", "byte 9: the text is not UTF-8");
    assert_refused("a.msh", b"$Nod\xe9\n", "line 1: the section \"$Nod\u{fffd}\" has no end");
    assert_refused("a.stl", b"solid", "the extension is none of .vtk");
    assert_refused("a.node", b"1 3 0 0\n1 0 0 0\n", "a.ele: cannot be read: ");
    assert!(matches!(read_mesh(&data.join("missing.vtk")), Err(ReadError::Unreadable { .. })));
    assert!(read_mesh(&data).is_err());
}

#[test]
fn deep_or_wide_xml() {
    // Deeper than a recursive reader could go.
    assert!(read("a.vtu", "<a>".repeat(100_000).as_bytes()).is_err());
    let entity = "<!DOCTYPE a [<!ENTITY b \"bb\"><!ENTITY c \"&b;&b;\">]><a>&c;</a>";
    assert!(read("a.vtu", entity.as_bytes()).is_err());
}

/// Every file of `tests/data`, cut short at many lengths and with bytes changed at random.
#[test]
fn damaged_files() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let folder = tempfile::tempdir().unwrap();
    let mut seed = 1_u64;
    let mut random = move |below: usize| {
        // Knuth's generator; its high bits are the good ones.
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    let (mut files, mut read_well, mut refused) = (0, 0, 0);
    for entry in fs::read_dir(data).unwrap() {
        let path = entry.unwrap().path();
        let extension = path.extension().unwrap().to_str().unwrap();
        if !["vtk", "vtu", "msh", "node", "ele"].contains(&extension) {
            continue;
        }
        files += 1;
        let sound = fs::read(&path).unwrap();
        let damaged = folder.path().join("damaged").with_extension(extension);
        for sibling in ["node", "ele"] {
            let _ = fs::copy(path.with_extension(sibling), damaged.with_extension(sibling));
        }
        for round in 0..200 {
            let mut bytes = sound.clone();
            if round < 75 {
                bytes.truncate(sound.len() * round / 75);
            } else {
                for _ in 0..1 + round % 4 {
                    // Digits and blanks survive the first checks more often than other bytes.
                    let new = [random(256) as u8, b"0123456789 -.\n"[random(14)]][round % 2];
                    bytes[random(sound.len())] = new;
                }
            }
            // A file that is overwritten waits for the disk.
            let _ = fs::remove_file(&damaged);
            fs::write(&damaged, &bytes).unwrap();
            let start = Instant::now();
            match read_mesh(&damaged) {
                Ok(mesh) => {
                    let n = mesh.points.len() as u32;
                    assert!(mesh.tets.as_flattened().iter().all(|&p| p < n));
                    assert!(mesh.triangles.as_flattened().iter().all(|&p| p < n));
                    assert!(mesh.regions.is_empty() || mesh.regions.len() == mesh.tets.len());
                    read_well += 1;
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(text.contains("damaged") && text.len() < 500 && !text.contains('\n'), "{text}");
                    refused += 1;
                }
            }
            assert!(start.elapsed() < Duration::from_secs(1), "{}, round {round}", path.display());
        }
    }
    println!("{files} files: {read_well} damaged ones read, {refused} refused");
    assert!(files >= 40 && refused > read_well / 4);
}

/// A third of a gigabyte of zeros in some 450 kB: refused before it is unpacked.
#[test]
fn a_small_file_does_not_unpack_without_end() {
    use base64::{Engine, engine::general_purpose::STANDARD};
    use std::io::Write;
    const BLOCK: usize = 1 << 20;
    let blocks = 320_u32;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(&vec![0; BLOCK]).unwrap();
    let block = encoder.finish().unwrap();
    let sizes = [blocks, BLOCK as u32, 0].into_iter().chain((0..blocks).map(|_| block.len() as u32));
    let header: Vec<u8> = sizes.flat_map(u32::to_le_bytes).collect();
    let data = STANDARD.encode(header) + &STANDARD.encode(block.repeat(blocks as usize));
    let points = blocks as usize * BLOCK / 12;
    let content = format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"1\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" \
         format=\"binary\">{data}</DataArray></Points></Piece></UnstructuredGrid></VTKFile>"
    );
    println!("{} bytes", content.len());
    let start = Instant::now();
    assert_refused("a.vtu", content.as_bytes(), "more bytes together than a file of this size can hold");
    assert!(start.elapsed() < Duration::from_secs(1));
}

#[test]
#[cfg(unix)]
fn devices_and_folders_are_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("endless.msh");
    std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
    let text = folder.path().join("scene.toml");
    fs::write(&text, "\u{feff}damping = 20.0\n").unwrap();
    assert_eq!(read_text(&text).unwrap(), "damping = 20.0\n");
    // What may be binary stays as it is.
    assert_eq!(read_file(&text).unwrap(), fs::read(&text).unwrap());
    assert!(read_text(&path).is_err() && read_text(folder.path()).is_err());
    let error = read_mesh(&path).unwrap_err().to_string();
    assert!(error.contains("endless.msh: cannot be read: it is a folder, a device or a pipe, not a file"), "{error}");
}
