//! Gmsh files (`.msh`): version 1 (text), versions 2.x and 4.1 (text and binary in either byte order), as specified
//! in the Gmsh reference manual (<https://gmsh.info/doc/texinfo/gmsh.html#Gmsh-file-formats>). Coordinates are in
//! file units. Nodes keep the order of the file; their tags may have gaps.

use std::collections::HashMap;
use std::format;
use std::vec::Vec;

use super::TetMesh;
use super::cursor::{Cursor, Encoding};
use super::error::{Fault, quoted};
use super::node_index::NodeIndex;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Version {
    One,
    Two,
    Four,
}

/// What Gmsh says of an element besides its nodes.
#[derive(Clone, Copy)]
struct Tags {
    physical: i32,
    elementary: i32,
}

/// What the sections read so far have said.
struct Gmsh {
    version: Option<Version>,
    encoding: Encoding,
    index: Option<NodeIndex>,
    /// The first physical tag of each volume (version 4.1).
    volumes: HashMap<i32, i32>,
    mesh: TetMesh,
    /// Of each tetrahedron.
    tags: Vec<Tags>,
}

pub(super) fn read(bytes: &[u8]) -> Result<TetMesh, Fault> {
    let mut file = Gmsh {
        version: None,
        encoding: Encoding::Text,
        index: None,
        volumes: HashMap::new(),
        mesh: TetMesh::default(),
        tags: Vec::new(),
    };
    file.read_sections(&mut Cursor::new(bytes, 1))?;
    let Gmsh { mut mesh, tags, .. } = file;
    if tags.iter().any(|tags| tags.physical != 0) {
        mesh.regions = tags.iter().map(|tags| tags.physical).collect();
    } else if tags.iter().any(|tags| tags.elementary != 0) {
        mesh.regions = tags.iter().map(|tags| tags.elementary).collect();
    }
    Ok(mesh)
}

impl Gmsh {
    /// Reads up to the elements; the results that may follow them are not looked at.
    fn read_sections(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        while let Some(section) = cursor.token() {
            match (section, self.version) {
                (b"$Nodes", _) if self.index.is_some() => {
                    return Err(cursor.fault("a second list of nodes"));
                }
                (b"$MeshFormat", None) => self.read_format(cursor)?,
                (b"$NOD", None) => {
                    self.version = Some(Version::One);
                    self.read_numbered_nodes(cursor)?;
                    expect(cursor, "$ENDNOD")?;
                }
                (b"$ELM", Some(Version::One)) => {
                    self.read_elements_1(cursor)?;
                    return expect(cursor, "$ENDELM");
                }
                (b"$Nodes", Some(Version::Two)) => {
                    self.read_numbered_nodes(cursor)?;
                    expect(cursor, "$EndNodes")?;
                }
                (b"$Elements", Some(Version::Two)) => {
                    match self.encoding {
                        Encoding::Text => self.read_elements_2(cursor)?,
                        _ => self.read_elements_2_binary(cursor)?,
                    }
                    return expect(cursor, "$EndElements");
                }
                (b"$Entities", Some(Version::Four)) => {
                    self.read_entities(cursor)?;
                    expect(cursor, "$EndEntities")?;
                }
                (b"$PartitionedEntities", Some(Version::Four)) => {
                    return Err(cursor.fault("the mesh is partitioned; save it in one part"));
                }
                (b"$Nodes", Some(Version::Four)) => {
                    self.read_nodes_4(cursor)?;
                    expect(cursor, "$EndNodes")?;
                }
                (b"$Elements", Some(Version::Four)) => {
                    self.read_elements_4(cursor)?;
                    return expect(cursor, "$EndElements");
                }
                (b"$Nodes" | b"$Elements", _) => {
                    return Err(cursor.fault(format_args!("{} without $MeshFormat before it", quoted(section))));
                }
                (other, _) if other.starts_with(b"$") => skip_section(cursor, other)?,
                (other, None) => {
                    let reason = format!("{} where $MeshFormat or $NOD is expected", quoted(other));
                    return Err(cursor.fault(reason));
                }
                (other, _) => {
                    let reason = format!("{} where a section such as $Nodes is expected", quoted(other));
                    return Err(cursor.fault(reason));
                }
            }
        }
        Err(cursor.fault("the file ends without elements"))
    }

    fn read_format(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let version = cursor.word("the version")?;
        self.version = Some(match version {
            b"4.1" => Version::Four,
            _ if version == b"2" || version.starts_with(b"2.") => Version::Two,
            _ => {
                let version = quoted(version);
                let reason = format_args!("version {version} cannot be read; save the mesh as version 4.1 or 2.2");
                return Err(cursor.fault(reason));
            }
        });
        let kind: u32 = cursor.number("the file type")?;
        let size: u32 = cursor.number("the size of a real number")?;
        match (kind, size) {
            (0, _) => {}
            (1, 8) => {
                cursor.rest_of_line();
                self.encoding = match cursor.take(Some(4), "the mark of the byte order")? {
                    [1, 0, 0, 0] => Encoding::Little,
                    [0, 0, 0, 1] => Encoding::Big,
                    other => {
                        let reason = format_args!("{other:?} is not the number one in either byte order");
                        return Err(cursor.fault(reason));
                    }
                };
            }
            (1, _) => return Err(cursor.fault(format_args!("numbers of {size} bytes; only 8 can be read"))),
            _ => return Err(cursor.fault(format_args!("the file type is {kind}; 0 is text, 1 is binary"))),
        }
        expect(cursor, "$EndMeshFormat")
    }

    /// Versions 1 and 2: a tag and three coordinates each.
    fn read_numbered_nodes(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let encoding = self.encoding;
        let n = count(cursor, "nodes")?;
        let mut index = NodeIndex::default();
        for i in 1..=n {
            cursor.record(encoding, |cursor| {
                let tag = cursor.int(encoding, format_args!("the number of node {i} of {n}"))?;
                index.add(tag.into(), cursor)?;
                self.mesh.points.push(cursor.point(encoding, format_args!("node {tag}"))?);
                Ok(())
            })?;
        }
        self.index = Some(index);
        Ok(())
    }

    /// `number type physical elementary node-count nodes`
    fn read_elements_1(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let n = count(cursor, "elements")?;
        for i in 1..=n {
            cursor.record(Encoding::Text, |cursor| {
                let number = cursor.number(format_args!("the number of element {i} of {n}"))?;
                let kind = cursor.number(format_args!("the type of element {number}"))?;
                let physical = cursor.number(format_args!("the physical tag of element {number}"))?;
                let elementary = cursor.number(format_args!("the elementary tag of element {number}"))?;
                let nodes: usize = cursor.number(format_args!("the number of nodes of element {number}"))?;
                if node_count(kind).is_ok_and(|n| n != nodes) {
                    let reason = format_args!("element {number} has the type {kind} with {nodes} nodes");
                    return Err(cursor.fault(reason));
                }
                self.read_element(cursor, number, kind, Tags { physical, elementary })
            })?;
        }
        Ok(())
    }

    /// `number type tag-count tags nodes`
    fn read_elements_2(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let n = count(cursor, "elements")?;
        for i in 1..=n {
            cursor.record(Encoding::Text, |cursor| {
                let number = cursor.number(format_args!("the number of element {i} of {n}"))?;
                let kind = cursor.number(format_args!("the type of element {number}"))?;
                let tags = cursor.number(format_args!("the number of tags of element {number}"))?;
                let tags = read_tags(cursor, Encoding::Text, tags, number)?;
                self.read_element(cursor, number, kind, tags)
            })?;
        }
        Ok(())
    }

    /// Blocks `type element-count tag-count` of elements `number tags nodes`
    fn read_elements_2_binary(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let encoding = self.encoding;
        let n = count(cursor, "elements")?;
        let mut done = 0;
        while done < n {
            let kind = cursor.int(encoding, "the type of a block of elements")?;
            let block = cursor.int(encoding, "the number of elements in a block")?;
            let tags = cursor.int(encoding, "the number of tags in a block of elements")?;
            let block = u64::try_from(block).ok().filter(|&block| block > 0 && block <= n - done);
            let Some(block) = block else {
                let reason = format_args!("a block of elements does not fit the announced {n} elements");
                return Err(cursor.fault(reason));
            };
            for _ in 0..block {
                let number = cursor.int(encoding, "the number of an element")?.into();
                let tags = read_tags(cursor, encoding, tags, number)?;
                self.read_element(cursor, number, kind, tags)?;
            }
            done += block;
        }
        Ok(())
    }

    /// Version 4.1 gives physical tags to points, curves, surfaces and volumes, not to elements.
    fn read_entities(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let encoding = self.encoding;
        if encoding != Encoding::Text {
            cursor.rest_of_line();
        }
        let counts = read_sizes::<4>(cursor, encoding, "the numbers of entities")?;
        for (dimension, n) in counts.into_iter().enumerate() {
            for _ in 0..n {
                cursor.record(encoding, |cursor| {
                    let tag = cursor.int(encoding, "the tag of an entity")?;
                    for _ in 0..if dimension == 0 { 3 } else { 6 } {
                        cursor.real(encoding, format_args!("the bounds of entity {tag}"))?;
                    }
                    let tags = cursor.size(encoding, format_args!("the number of physical tags of entity {tag}"))?;
                    let mut physical = 0;
                    for i in 0..tags {
                        let value = cursor.int(encoding, format_args!("a physical tag of entity {tag}"))?;
                        if i == 0 {
                            physical = value;
                        }
                    }
                    if dimension > 0 {
                        let sides = cursor.size(encoding, format_args!("the number of sides of entity {tag}"))?;
                        for _ in 0..sides {
                            cursor.int(encoding, format_args!("a side of entity {tag}"))?;
                        }
                    }
                    if dimension == 3 {
                        self.volumes.insert(tag, physical);
                    }
                    Ok(())
                })?;
            }
        }
        Ok(())
    }

    /// Blocks `dimension entity parametric node-count` of first tags, then coordinates
    fn read_nodes_4(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let encoding = self.encoding;
        if encoding != Encoding::Text {
            cursor.rest_of_line();
        }
        let [blocks, n, ..] = read_sizes::<4>(cursor, encoding, "the numbers of blocks and nodes")?;
        let mut index = NodeIndex::default();
        for _ in 0..blocks {
            let (dimension, parametric, block) = cursor.record(encoding, |cursor| {
                let dimension = cursor.int(encoding, "the dimension of a block of nodes")?;
                cursor.int(encoding, "the entity of a block of nodes")?;
                let parametric = cursor.int(encoding, "the mark of parametric nodes")?;
                Ok((dimension, parametric, cursor.size(encoding, "the number of nodes in a block")?))
            })?;
            let mut tags = Vec::new();
            for _ in 0..block {
                let tag = cursor
                    .record(encoding, |cursor| Ok(cursor.size(encoding, "the number of a node")?.cast_signed()))?;
                index.add(tag, cursor)?;
                tags.push(tag);
            }
            for tag in tags {
                cursor.record(encoding, |cursor| {
                    self.mesh.points.push(cursor.point(encoding, format_args!("node {tag}"))?);
                    for _ in 0..if parametric == 0 { 0 } else { dimension } {
                        cursor.real(encoding, format_args!("the parameters of node {tag}"))?;
                    }
                    Ok(())
                })?;
            }
        }
        self.index = Some(index);
        let listed = self.mesh.points.len();
        if n != listed as u64 {
            return Err(cursor.fault(format_args!("{n} nodes are announced, but the blocks list {listed}")));
        }
        Ok(())
    }

    /// Blocks `dimension entity type element-count` of elements `number nodes`
    fn read_elements_4(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let encoding = self.encoding;
        if encoding != Encoding::Text {
            cursor.rest_of_line();
        }
        let [blocks, n, ..] = read_sizes::<4>(cursor, encoding, "the numbers of blocks and elements")?;
        let mut listed = 0_u64;
        for _ in 0..blocks {
            let (entity, kind, block) = cursor.record(encoding, |cursor| {
                cursor.int(encoding, "the dimension of a block of elements")?;
                let entity = cursor.int(encoding, "the entity of a block of elements")?;
                let kind = cursor.int(encoding, "the type of a block of elements")?;
                Ok((entity, kind, cursor.size(encoding, "the number of elements in a block")?))
            })?;
            let physical = self.volumes.get(&entity).copied().unwrap_or(0);
            for _ in 0..block {
                cursor.record(encoding, |cursor| {
                    let number = cursor.size(encoding, "the number of an element")?.cast_signed();
                    self.read_element(cursor, number, kind, Tags { physical, elementary: entity })
                })?;
                listed += 1;
            }
        }
        if n != listed {
            return Err(cursor.fault(format_args!("{n} elements are announced, but the blocks list {listed}")));
        }
        Ok(())
    }

    /// The nodes of an element, which close its record.
    fn read_element(&mut self, cursor: &mut Cursor<'_>, number: i64, kind: i32, tags: Tags) -> Result<(), Fault> {
        let Some(index) = &self.index else {
            return Err(cursor.fault("elements come before the nodes"));
        };
        let (encoding, wide) = (self.encoding, self.version == Some(Version::Four));
        let node = |cursor: &mut Cursor<'_>| {
            let what = format_args!("a node of element {number}");
            if wide {
                cursor.size(encoding, what).map(u64::cast_signed)
            } else {
                cursor.int(encoding, what).map(i64::from)
            }
        };
        let nodes = node_count(kind).map_err(|name| {
            let reason =
                format!("element {number} is a {name} (Gmsh type {kind}); only tetrahedra with four nodes can be read");
            cursor.fault(reason)
        })?;
        match kind {
            TRIANGLE => self.mesh.triangles.push(index.corners(number, cursor, node)?),
            TETRAHEDRON => {
                self.mesh.tets.push(index.corners(number, cursor, node)?);
                self.tags.push(tags);
            }
            _ => {
                for _ in 0..nodes {
                    node(cursor)?;
                }
            }
        }
        Ok(())
    }
}

const TRIANGLE: i32 = 2;
const TETRAHEDRON: i32 = 4;

/// How many nodes an element of this type has, or the name of a type that cannot be left out without leaving a hole
/// in the volume. Points, curves and surfaces can.
fn node_count(kind: i32) -> Result<usize, &'static str> {
    Ok(match kind {
        15 => 1,
        1 => 2,
        TRIANGLE | 8 => 3,
        TETRAHEDRON | 3 | 26 => 4,
        27 => 5,
        9 | 28 => 6,
        16 => 8,
        10 | 20 => 9,
        21 => 10,
        22 => 12,
        23 | 24 => 15,
        25 => 21,
        5 => return Err("hexahedron"),
        6 => return Err("prism"),
        7 => return Err("pyramid"),
        11 => return Err("tetrahedron with ten nodes"),
        12 | 17 => return Err("quadratic hexahedron"),
        13 | 18 => return Err("quadratic prism"),
        14 | 19 => return Err("quadratic pyramid"),
        29..=31 => return Err("tetrahedron of higher order"),
        _ => return Err("cell of another type"),
    })
}

fn expect(cursor: &mut Cursor<'_>, expected: &str) -> Result<(), Fault> {
    let word = cursor.word(expected)?;
    if word == expected.as_bytes() {
        return Ok(());
    }
    Err(cursor.fault(format_args!("{} where {expected} is expected", quoted(word))))
}

fn skip_section(cursor: &mut Cursor<'_>, section: &[u8]) -> Result<(), Fault> {
    let end = [b"$End", section.get(1..).unwrap_or_default()].concat();
    match cursor.rest().windows(end.len()).position(|window| window == end) {
        Some(length) => {
            cursor.skip(length + end.len());
            Ok(())
        }
        None => Err(cursor.fault(format_args!("the section {} has no end", quoted(section)))),
    }
}

/// A count on a line of its own; binary data may start on the next.
fn count(cursor: &mut Cursor<'_>, what: &str) -> Result<u64, Fault> {
    let n = cursor.record(Encoding::Text, |cursor| cursor.number(format_args!("the number of {what}")))?;
    cursor.rest_of_line();
    Ok(n)
}

fn read_sizes<const N: usize>(cursor: &mut Cursor<'_>, encoding: Encoding, what: &str) -> Result<[u64; N], Fault> {
    cursor.record(encoding, |cursor| {
        let mut sizes = [0; N];
        for size in &mut sizes {
            *size = cursor.size(encoding, what)?;
        }
        Ok(sizes)
    })
}

/// The first two of an element's tags; further ones are partitions.
fn read_tags(cursor: &mut Cursor<'_>, encoding: Encoding, n: i32, element: i64) -> Result<Tags, Fault> {
    let mut tags = Tags { physical: 0, elementary: 0 };
    for i in 0..n {
        let tag = cursor.int(encoding, format_args!("a tag of element {element}"))?;
        match i {
            0 => tags.physical = tag,
            1 => tags.elementary = tag,
            _ => {}
        }
    }
    Ok(tags)
}
