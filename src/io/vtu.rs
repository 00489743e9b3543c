//! VTK XML files of unstructured grids (`.vtu`), as specified in "VTK File Formats"
//! (<https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>): arrays as text, as base64 in their
//! element, or appended as base64 or raw bytes, each plain or compressed with zlib. Coordinates are in file units.

use core::cell::Cell;
use core::fmt::Display;
use std::borrow::Cow;
use std::format;
use std::string::String;
use std::vec::Vec;

use roxmltree::{Document, Node};

use super::cursor::{Cursor, Encoding};
use super::error::{Fault, quoted};
use super::values::{Scalar, Values, read_values};
use super::vtk_cells::{Cells, names_regions};
use super::vtu_data::{Base64, Layout, Source};
use super::{CellVectors, TetMesh};

pub(super) fn read(bytes: &[u8]) -> Result<TetMesh, Fault> {
    let (head, appended) = split_appended(bytes);
    let text = core::str::from_utf8(&head)
        .map_err(|error| Fault::new(format!("byte {}", error.valid_up_to()), "the text is not UTF-8"))?;
    let document = Document::parse(text).map_err(|error| Fault::new(format!("line {}", error.pos().row), error))?;
    let file = Vtu::open(&document, appended)?;
    let mut mesh = TetMesh::default();
    for piece in file.child(document.root_element(), "UnstructuredGrid")?.children() {
        if piece.has_tag_name("Piece") {
            file.read_piece(piece, &mut mesh)?;
        }
    }
    if mesh.regions.len() != mesh.tets.len() {
        // Some pieces have regions, others have not.
        mesh.regions.clear();
    }
    let tets = mesh.tets.len();
    mesh.vectors.retain(|vectors| vectors.values.len() == tets);
    Ok(mesh)
}

/// The XML with an empty `<AppendedData>`, and the bytes behind its underscore, which are not XML.
fn split_appended(bytes: &[u8]) -> (Cow<'_, [u8]>, &[u8]) {
    const TAG: &[u8] = b"<AppendedData";
    let tag = bytes.windows(TAG.len()).position(|window| window == TAG);
    let end = tag.and_then(|tag| Some(tag + bytes.get(tag..)?.iter().position(|&b| b == b'>')? + 1));
    match end.and_then(|end| bytes.split_at_checked(end)) {
        Some((head, rest)) if !head.ends_with(b"/>") => {
            let data = rest.trim_ascii_start().strip_prefix(b"_").unwrap_or_default();
            ([head, b"</AppendedData></VTKFile>"].concat().into(), data)
        }
        _ => (bytes.into(), &[]),
    }
}

struct Vtu<'d> {
    document: &'d Document<'d>,
    layout: Layout<'d>,
    appended: &'d [u8],
    appended_raw: bool,
    /// Bytes that binary arrays may still have. Without a limit a few compressed ones, or many small elements that name
    /// the same array, would take memory without end.
    left: Cell<u64>,
}

impl<'d> Vtu<'d> {
    fn open(document: &'d Document<'d>, appended: &'d [u8]) -> Result<Self, Fault> {
        let root = document.root_element();
        let fault = |reason: String| Fault::new(place(document, root), reason);
        if !root.has_tag_name("VTKFile") {
            return Err(fault(format!("the element <{}> where <VTKFile> is expected", root.tag_name().name())));
        }
        let version = root.attribute("version").unwrap_or("0.1");
        if !["0.", "1.", "2."].iter().any(|known| version.starts_with(known)) {
            return Err(fault(format!("version {version:?} is unknown; 0.1 to 2.x can be read")));
        }
        let kind = root.attribute("type").unwrap_or_default();
        if kind != "UnstructuredGrid" {
            return Err(fault(format!("the data set is {kind:?}; only \"UnstructuredGrid\" can be read")));
        }
        let order = match root.attribute("byte_order") {
            None | Some("LittleEndian") => Encoding::Little,
            Some("BigEndian") => Encoding::Big,
            Some(other) => return Err(fault(format!("the byte order {other:?} is unknown"))),
        };
        let wide = match root.attribute("header_type") {
            None | Some("UInt32") => false,
            Some("UInt64") => true,
            Some(other) => {
                return Err(fault(format!("the header type {other:?} is neither UInt32 nor UInt64")));
            }
        };
        let compressor = root.attribute("compressor").filter(|name| !name.is_empty());
        let data = root.children().find(|node| node.has_tag_name("AppendedData"));
        let appended_raw = match data.and_then(|data| data.attribute("encoding")) {
            None | Some("base64") => false,
            Some("raw") => true,
            Some(other) => return Err(fault(format!("the encoding {other:?} is neither base64 nor raw"))),
        };
        let layout = Layout { order, wide, compressor };
        let left = Cell::new(layout.most((document.input_text().len() + appended.len()) as u64));
        Ok(Self { document, layout, appended, appended_raw, left })
    }

    fn fault(&self, node: Node<'_, '_>, reason: impl Display) -> Fault {
        Fault::new(place(self.document, node), reason)
    }

    fn child<'i>(&self, node: Node<'d, 'i>, name: &str) -> Result<Node<'d, 'i>, Fault> {
        let child = node.children().find(|child| child.has_tag_name(name));
        child.ok_or_else(|| self.fault(node, format_args!("<{name}> is missing")))
    }

    fn count(&self, node: Node<'_, '_>, name: &str) -> Result<usize, Fault> {
        let text = node.attribute(name).unwrap_or_default().trim();
        text.parse().map_err(|_| self.fault(node, format_args!("{name} is {text:?}, not a number")))
    }

    fn read_piece(&self, piece: Node<'d, '_>, mesh: &mut TetMesh) -> Result<(), Fault> {
        let n_points = self.count(piece, "NumberOfPoints")?;
        let n_cells = self.count(piece, "NumberOfCells")?;
        let points = self.child(self.child(piece, "Points")?, "DataArray")?;
        let components = points.attribute("NumberOfComponents").unwrap_or("3");
        if components != "3" {
            return Err(self.fault(points, format_args!("points have {components} components instead of 3")));
        }
        let points = self.array(points, n_points.checked_mul(3))?.into_points();

        let node = self.child(piece, "Cells")?;
        let types = self.cell_array(node, "types", n_cells)?;
        let ends = self.cell_array(node, "offsets", n_cells)?;
        let entries = match ends.last() {
            None => 0,
            Some(&end) => {
                usize::try_from(end).map_err(|_| self.fault(node, format_args!("the last of the offsets is {end}")))?
            }
        };
        let connectivity = self.cell_array(node, "connectivity", entries)?;
        let regions = self.read_regions(piece, n_cells)?;
        let vectors = self.read_vectors(piece, n_cells)?;
        let cells = Cells { types, ends, connectivity, regions, vectors };
        let first_point = mesh.points.len();
        cells.add_to(mesh, first_point, points.len()).map_err(|reason| self.fault(node, reason))?;
        mesh.points.extend(points);
        Ok(())
    }

    fn cell_array(&self, cells: Node<'d, '_>, name: &str, n: usize) -> Result<Vec<i64>, Fault> {
        let node = cells.children().find(|node| node.attribute("Name") == Some(name));
        let node = node.ok_or_else(|| self.fault(cells, format_args!("the array {name:?} is missing")))?;
        self.array(node, Some(n))?.into_whole(name).map_err(|reason| self.fault(node, reason))
    }

    fn read_regions(&self, piece: Node<'d, '_>, n_cells: usize) -> Result<Option<Vec<i64>>, Fault> {
        let Some(data) = piece.children().find(|node| node.has_tag_name("CellData")) else {
            return Ok(None);
        };
        for node in data.children().filter(|node| node.attribute("Name").is_some_and(names_regions)) {
            if node.attribute("NumberOfComponents").unwrap_or("1") == "1"
                && let Values::Whole(regions) = self.array(node, Some(n_cells))?
            {
                return Ok(Some(regions));
            }
        }
        Ok(None)
    }

    fn read_vectors(&self, piece: Node<'d, '_>, n_cells: usize) -> Result<Vec<CellVectors>, Fault> {
        let mut vectors = Vec::new();
        let data = piece.children().find(|node| node.has_tag_name("CellData"));
        for node in data.iter().flat_map(Node::children) {
            if let Some(name) = node.attribute("Name")
                && node.attribute("NumberOfComponents") == Some("3")
                && node.attribute("type").is_some_and(|kind| kind.starts_with("Float"))
            {
                let values = self.array(node, n_cells.checked_mul(3))?.into_points();
                vectors.push(CellVectors { name: name.into(), values });
            }
        }
        Ok(vectors)
    }

    /// The `n` values of a `<DataArray>`; `n` is `None` where the count itself overflows.
    fn array(&self, node: Node<'d, '_>, n: Option<usize>) -> Result<Values, Fault> {
        let kind = node.attribute("type").unwrap_or_default();
        let scalar = match kind {
            "Int8" => Scalar::I8,
            "UInt8" => Scalar::U8,
            "Int16" => Scalar::I16,
            "UInt16" => Scalar::U16,
            "Int32" => Scalar::I32,
            "UInt32" => Scalar::U32,
            "Int64" => Scalar::I64,
            "UInt64" => Scalar::U64,
            "Float32" => Scalar::F32,
            "Float64" => Scalar::F64,
            _ => return Err(self.fault(node, format_args!("the type {kind:?} of the array is unknown"))),
        };
        let text = node.children().find(Node::is_text);
        let bytes = text.and_then(|text| text.text()).unwrap_or_default().as_bytes();
        let size = n.and_then(|n| n.checked_mul(scalar.size()));
        let source = match node.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                let mut cursor = Cursor::new(bytes, 1);
                let values = read_values(&mut cursor, n, scalar, Encoding::Text, "the array");
                let extra = cursor.token();
                return match extra {
                    Some(extra) if values.is_ok() => {
                        Err(self.fault(node, format_args!("{} after the last value", quoted(extra))))
                    }
                    _ => values.map_err(|fault| self.fault(node, fault.reason)),
                };
            }
            "binary" => {
                // Plain ones are no longer than their text.
                if self.layout.compressor.is_some() {
                    self.share(size).map_err(|reason| self.fault(node, reason))?;
                }
                Source::Base64(Base64::new(bytes))
            }
            "appended" => {
                let offset = self.count(node, "offset")?;
                let data = self.appended.get(offset..).ok_or_else(|| {
                    let length = self.appended.len();
                    self.fault(node, format_args!("the offset {offset} is beyond the {length} appended bytes"))
                })?;
                self.share(size).map_err(|reason| self.fault(node, reason))?;
                if self.appended_raw { Source::Raw(data) } else { Source::Base64(Base64::new(data)) }
            }
            other => {
                return Err(self.fault(node, format_args!("the format {other:?} of the array is unknown")));
            }
        };
        let size = size.ok_or_else(|| self.fault(node, "more values are announced than a file can have"))?;
        let bytes = self.layout.read(source, size).map_err(|reason| self.fault(node, reason))?;
        read_values(&mut Cursor::new(&bytes, 1), n, scalar, self.layout.order, "the array")
    }

    /// Takes the bytes of an array from those that all may have together.
    fn share(&self, size: Option<usize>) -> Result<(), &'static str> {
        let left = size.and_then(|size| self.left.get().checked_sub(size as u64));
        self.left.set(left.ok_or("the arrays so far have more bytes together than a file of this size can hold")?);
        Ok(())
    }
}

/// The line of an element and, if it has one, its name.
fn place(document: &Document<'_>, node: Node<'_, '_>) -> String {
    let line = document.text_pos_at(node.range().start).row;
    match node.attribute("Name") {
        Some(name) => format!("line {line}, array {name:?}"),
        None => format!("line {line}, <{}>", node.tag_name().name()),
    }
}
