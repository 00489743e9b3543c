//! Legacy VTK files (`.vtk`), text and binary (always big endian), as specified in "VTK File Formats"
//! (<https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>): versions 1 to 4, whose cells are
//! prefixed with their count of points, and version 5, with offsets and connectivity. Coordinates are in file units.

use core::fmt::Display;
use std::format;
use std::string::String;
use std::vec::Vec;

use super::cursor::{Cursor, Encoding};
use super::error::{Fault, quoted};
use super::values::{Scalar, Values, read_values};
use super::vtk_cells::{Cells, names_regions};
use super::{CellVectors, TetMesh};

const MAGIC: &[u8] = b"# vtk DataFile Version ";

pub(super) fn read(bytes: &[u8]) -> Result<TetMesh, Fault> {
    let mut cursor = Cursor::new(bytes, 1);
    let major = read_version(&mut cursor)?;
    let _title = cursor.rest_of_line();
    let encoding = match cursor.word("ASCII or BINARY")?.to_ascii_uppercase().as_slice() {
        b"ASCII" => Encoding::Text,
        b"BINARY" => Encoding::Big,
        other => {
            return Err(cursor.fault(format_args!("{} where ASCII or BINARY is expected", quoted(other))));
        }
    };
    let mut file =
        Legacy { cursor, encoding, points: None, cells: None, types: None, regions: None, vectors: Vec::new() };
    file.read_sections(major)?;
    file.finish()
}

fn read_version(cursor: &mut Cursor<'_>) -> Result<u32, Fault> {
    if !cursor.rest().starts_with(MAGIC) {
        let reason = "the file does not begin with \"# vtk DataFile Version\"; it is not a legacy VTK file";
        return Err(cursor.fault(reason));
    }
    cursor.skip(MAGIC.len());
    let version = cursor.word("the version")?;
    let major = version.split(|&b| b == b'.').next().and_then(|major| core::str::from_utf8(major).ok()?.parse().ok());
    let known = major.filter(|major| (1..=5).contains(major));
    let fault = || cursor.fault(format_args!("version {} is unknown; 1 to 5 can be read", quoted(version)));
    let major = known.ok_or_else(fault)?;
    cursor.rest_of_line();
    Ok(major)
}

/// Whom the data arrays being read belong to.
enum Owner {
    Grid,
    Points(usize),
    Cells(usize),
}

struct Legacy<'a> {
    cursor: Cursor<'a>,
    encoding: Encoding,
    points: Option<Vec<[f64; 3]>>,
    /// Where each cell ends in the connectivity, the connectivity, and the place for complaints about them.
    cells: Option<(Vec<i64>, Vec<i64>, String)>,
    types: Option<Vec<i64>>,
    regions: Option<Vec<i64>>,
    vectors: Vec<CellVectors>,
}

impl<'a> Legacy<'a> {
    fn read_sections(&mut self, major: u32) -> Result<(), Fault> {
        let mut owner = Owner::Grid;
        while let Some(keyword) = self.cursor.token() {
            match keyword.to_ascii_uppercase().as_slice() {
                b"DATASET" => {
                    let kind = self.cursor.word("the kind of data set")?;
                    if !kind.eq_ignore_ascii_case(b"UNSTRUCTURED_GRID") {
                        let reason = format!("the data set is {}; only UNSTRUCTURED_GRID can be read", quoted(kind));
                        return Err(self.cursor.fault(reason));
                    }
                }
                b"POINTS" => {
                    let n: usize = self.cursor.number("the number of points")?;
                    let scalar = self.scalar("POINTS")?;
                    let points = self.values(n.checked_mul(3), scalar, "POINTS")?.into_points();
                    self.points = Some(points);
                }
                b"CELLS" if major < 5 => self.read_counted_cells()?,
                b"CELLS" => self.read_offset_cells()?,
                b"CELL_TYPES" => {
                    let n = self.cursor.number("the number of cell types")?;
                    self.end_header();
                    self.types = Some(self.whole_values(Some(n), Scalar::I32, "CELL_TYPES")?);
                }
                b"POINT_DATA" => owner = Owner::Points(self.cursor.number("the number of points")?),
                b"CELL_DATA" => owner = Owner::Cells(self.cursor.number("the number of cells")?),
                b"METADATA" => self.skip_metadata(),
                attribute => self.read_attribute(attribute, &owner)?,
            }
        }
        Ok(())
    }

    /// `n p0 .. pn-1` for each cell, `size` entries in all.
    fn read_counted_cells(&mut self) -> Result<(), Fault> {
        let place = self.cursor.place();
        let n: usize = self.cursor.number("the number of cells")?;
        let size: usize = self.cursor.number("the size of the cell list")?;
        self.end_header();
        let entries = self.whole_values(Some(size), Scalar::I32, "CELLS")?;
        let (mut ends, mut connectivity) = (Vec::new(), Vec::new());
        let mut rest = entries.as_slice();
        while let Some((&count, tail)) = rest.split_first() {
            let cell = ends.len();
            let Some((nodes, tail)) = usize::try_from(count).ok().and_then(|count| tail.split_at_checked(count)) else {
                let left = tail.len();
                let reason = format!("cell {cell} claims {count} points, but {left} entries are left in CELLS");
                return Err(Fault::new(place, reason));
            };
            connectivity.extend_from_slice(nodes);
            ends.push(connectivity.len() as i64);
            rest = tail;
        }
        if ends.len() != n {
            return Err(Fault::new(place, format_args!("CELLS announces {n} cells, but lists {}", ends.len())));
        }
        self.cells = Some((ends, connectivity, place));
        Ok(())
    }

    /// One offset more than there are cells, then the points of all cells.
    fn read_offset_cells(&mut self) -> Result<(), Fault> {
        let place = self.cursor.place();
        let n = self.cursor.number("the number of offsets")?;
        let size = self.cursor.number("the size of the connectivity")?;
        let offsets = self.read_cell_array("OFFSETS", n)?;
        let connectivity = self.read_cell_array("CONNECTIVITY", size)?;
        let ends = match offsets.split_first() {
            None => Vec::new(),
            Some((0, ends)) => ends.to_vec(),
            Some((first, _)) => {
                return Err(Fault::new(place, format_args!("the first of the OFFSETS is {first}, not 0")));
            }
        };
        self.cells = Some((ends, connectivity, place));
        Ok(())
    }

    fn read_cell_array(&mut self, name: &str, n: usize) -> Result<Vec<i64>, Fault> {
        let word = self.word(name)?;
        if !word.eq_ignore_ascii_case(name.as_bytes()) {
            return Err(self.cursor.fault(format_args!("{} where {name} is expected", quoted(word))));
        }
        let scalar = self.scalar(name)?;
        self.whole_values(Some(n), scalar, name)
    }

    /// An array of point or cell data, or of the whole grid. Regions and vectors of cells are kept; the rest is stepped
    /// over.
    fn read_attribute(&mut self, keyword: &[u8], owner: &Owner) -> Result<(), Fault> {
        let tuples = match *owner {
            Owner::Points(n) | Owner::Cells(n) => n,
            Owner::Grid => 0,
        };
        let components = match keyword {
            b"FIELD" => return self.read_field(owner),
            b"LOOKUP_TABLE" => {
                self.cursor.word("the name of the lookup table")?;
                let colours: usize = self.cursor.number("the size of the lookup table")?;
                self.end_header();
                return self.skip_colours(colours.checked_mul(4), "LOOKUP_TABLE");
            }
            b"SCALARS" | b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => 1,
            b"VECTORS" | b"NORMALS" => 3,
            b"TENSORS" => 9,
            b"TENSORS6" => 6,
            b"TEXTURE_COORDINATES" | b"COLOR_SCALARS" => 0,
            _ => {
                return Err(self
                    .cursor
                    .fault(format_args!("{} where a keyword such as CELLS is expected", quoted(keyword))));
            }
        };
        let name = String::from_utf8_lossy(self.cursor.word("the name of the array")?);
        let components = match keyword {
            b"COLOR_SCALARS" | b"TEXTURE_COORDINATES" => self.cursor.number("the number of components")?,
            _ => components,
        };
        if keyword == b"COLOR_SCALARS" {
            self.end_header();
            return self.skip_colours(tuples.checked_mul(components), &name);
        }
        if keyword != b"SCALARS" {
            let scalar = self.scalar(&name)?;
            return self.read_array(&name, tuples, components, scalar, owner);
        }
        let scalar = self.scalar_word(&name)?;
        let line = self.cursor.rest_of_line().trim_ascii();
        let components = match core::str::from_utf8(line).ok().map(str::parse) {
            _ if line.is_empty() => 1,
            Some(Ok(components)) => components,
            _ => {
                return Err(self.cursor.fault(format_args!("{} is not a number of components", quoted(line))));
            }
        };
        let table = self.cursor.rest().get(..12).unwrap_or_default();
        if table.eq_ignore_ascii_case(b"LOOKUP_TABLE") {
            self.cursor.rest_of_line();
        }
        self.read_array(&name, tuples, components, scalar, owner)
    }

    /// `FIELD name n`, then n times `name components tuples type` with its values.
    fn read_field(&mut self, owner: &Owner) -> Result<(), Fault> {
        self.cursor.word("the name of the field")?;
        let arrays: usize = self.cursor.number("the number of arrays")?;
        for _ in 0..arrays {
            let name = self.word("the name of an array")?;
            let name = String::from_utf8_lossy(name);
            let components = self.cursor.number("the number of components")?;
            let tuples = self.cursor.number("the number of tuples")?;
            let scalar = self.scalar(&name)?;
            self.read_array(&name, tuples, components, scalar, owner)?;
        }
        Ok(())
    }

    fn read_array(
        &mut self,
        name: &str,
        tuples: usize,
        components: usize,
        scalar: Scalar,
        owner: &Owner,
    ) -> Result<(), Fault> {
        let values = self.values(tuples.checked_mul(components), scalar, name)?;
        match values {
            _ if !matches!(owner, Owner::Cells(_)) => {}
            Values::Whole(values) if components == 1 && names_regions(name) && self.regions.is_none() => {
                self.regions = Some(values);
            }
            values @ Values::Real(_) if components == 3 => {
                self.vectors.push(CellVectors { name: name.into(), values: values.into_points() });
            }
            _ => {}
        }
        Ok(())
    }

    /// Colours are bytes in binary files, but real numbers from 0 to 1 in text.
    fn skip_colours(&mut self, n: Option<usize>, name: &str) -> Result<(), Fault> {
        let scalar = if self.encoding == Encoding::Text { Scalar::F32 } else { Scalar::U8 };
        self.values(n, scalar, name).map(drop)
    }

    /// The next word, metadata of the array before it left out.
    fn word(&mut self, what: &str) -> Result<&'a [u8], Fault> {
        loop {
            match self.cursor.word(what)? {
                b"METADATA" => self.skip_metadata(),
                word => return Ok(word),
            }
        }
    }

    /// From behind the word `METADATA` to the next empty line.
    fn skip_metadata(&mut self) {
        self.cursor.rest_of_line();
        while !self.cursor.rest_of_line().trim_ascii().is_empty() {}
    }

    /// Binary values begin on the line after their header, text may follow on the same.
    fn end_header(&mut self) {
        if self.encoding != Encoding::Text {
            self.cursor.rest_of_line();
        }
    }

    /// The type at the end of a header.
    fn scalar(&mut self, array: &str) -> Result<Scalar, Fault> {
        let scalar = self.scalar_word(array)?;
        self.end_header();
        Ok(scalar)
    }

    fn scalar_word(&mut self, array: &str) -> Result<Scalar, Fault> {
        let word = self.cursor.word(format_args!("the type of {array}"))?;
        Ok(match word.to_ascii_lowercase().as_slice() {
            b"char" | b"signed_char" | b"vtktypeint8" => Scalar::I8,
            b"unsigned_char" | b"vtktypeuint8" => Scalar::U8,
            b"short" | b"vtktypeint16" => Scalar::I16,
            b"unsigned_short" | b"vtktypeuint16" => Scalar::U16,
            b"int" | b"vtktypeint32" | b"vtkidtype" => Scalar::I32,
            b"unsigned_int" | b"vtktypeuint32" => Scalar::U32,
            // As 64-bit Unix writes it; other writers say vtktypeint64.
            b"long" | b"vtktypeint64" => Scalar::I64,
            b"unsigned_long" | b"vtktypeuint64" => Scalar::U64,
            b"float" => Scalar::F32,
            b"double" => Scalar::F64,
            _ => {
                let reason = format_args!("the type {} of {array} is unknown", quoted(word));
                return Err(self.cursor.fault(reason));
            }
        })
    }

    fn values(&mut self, n: Option<usize>, scalar: Scalar, what: impl Display) -> Result<Values, Fault> {
        read_values(&mut self.cursor, n, scalar, self.encoding, what)
    }

    fn whole_values(&mut self, n: Option<usize>, scalar: Scalar, what: &str) -> Result<Vec<i64>, Fault> {
        self.values(n, scalar, what)?.into_whole(what).map_err(|reason| self.cursor.fault(reason))
    }

    fn finish(self) -> Result<TetMesh, Fault> {
        let missing = |what| self.cursor.fault(format_args!("the file ends without {what}"));
        let points = self.points.ok_or_else(|| missing("POINTS"))?;
        let (ends, connectivity, place) = self.cells.ok_or_else(|| missing("CELLS"))?;
        let types = self.types.ok_or_else(|| missing("CELL_TYPES"))?;
        let cells = Cells { types, ends, connectivity, regions: self.regions, vectors: self.vectors };
        let mut mesh = TetMesh::default();
        cells.add_to(&mut mesh, 0, points.len()).map_err(|reason| Fault::new(place, reason))?;
        mesh.points = points;
        Ok(mesh)
    }
}
