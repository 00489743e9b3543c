"""What is simulated: a mesh of one tissue or several, with its supports. Checked once, used by any number of simulations."""

from __future__ import annotations

import copy
import functools
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._laws import LAWS
from ._library import ffi, lib
from .errors import InputError
from .mesh import Mesh, boundary_of

# As supple_tissue.
_TISSUE = np.dtype([("constants", np.float32, 4), ("density", np.float32)])
# As supple_prony.
_PRONY = np.dtype([("share", np.float32, 3), ("seconds", np.float32, 3)])
# As supple_fibres.
_TERMS = ("fibres", "sheets", "coupling")
_FIBRES = np.dtype([(term, np.float32, 2) for term in _TERMS])
ELEMENTS = {"linear": lib.SUPPLE_LINEAR, "nodal-pressure": lib.SUPPLE_NODAL_PRESSURE, "nodal-strain": lib.SUPPLE_NODAL_STRAIN}


def axes_of(axes: str, what: str) -> int:
    """Bits of "xyz"."""
    if not isinstance(axes, str) or not axes or any(axis not in "xyz" for axis in axes):
        raise InputError(f"{what}: axes {axes!r}, they are letters of 'xyz'")
    return sum(1 << "xyz".index(axis) for axis in set(axes))


class Material(library.Sealed):
    """A law with its constants (Pa) and a density (kg/m^3): `Material("neo-hookean", c=1034, d=10000, density=1060)`.

    With `prony=[[0.5, 1.0], [0.2, 30.0]]` it relaxes: of the stress that changes the shape a share of 0.5 with the time 1 s, 0.2 with 30 s.
    The constants are those of a motion that is over before anything relaxes; pressure does not relax. At most three terms, 0.99 in sum.

    With `fibres=[a, b]` (a in Pa, b without unit) it has fibres along the `directions` of the scene, which resist where they are longer than
    at rest; `sheets=[a, b]` are a second family, `coupling=[a, b]` resists the shear between both.
    """

    def __init__(
        self,
        law: str,
        *,
        density: float,
        prony: ArrayLike = (),
        fibres: ArrayLike = (),
        sheets: ArrayLike = (),
        coupling: ArrayLike = (),
        **constants: float,
    ) -> None:
        if law not in LAWS:
            raise InputError(f"law {law!r}: there are {', '.join(LAWS)}")
        self.law, self.density = law, library.number(density, "density")
        self._number, names = LAWS[law]
        if set(constants) != set(names):
            raise InputError(f"constants of {law}: {', '.join(constants) or 'none'} are given, {', '.join(names)} are needed")
        self.constants = {name: library.number(constants[name], name) for name in names}
        self.prony = _terms_of(prony)
        self.fibres, self.sheets, self.coupling = (_term_of(each, name) for each, name in zip((fibres, sheets, coupling), _TERMS))
        self._is_made = True

    @classmethod
    def from_moduli(
        cls,
        young: float,
        poisson: float,
        *,
        density: float,
        prony: ArrayLike = (),
        fibres: ArrayLike = (),
        sheets: ArrayLike = (),
        coupling: ArrayLike = (),
    ) -> Material:
        """The neo-Hookean law of Young's modulus (Pa) and Poisson's ratio at rest: c is half the shear modulus, d half the bulk modulus.
        Those are of the tissue without its fibres."""
        if not 0.0 < library.number(young, "Young's modulus") < np.inf:
            raise InputError(f"Young's modulus {young}: it must be a positive number, Pa")
        if not -1.0 < library.number(poisson, "Poisson's ratio") < 0.5:
            raise InputError(f"Poisson's ratio {poisson}: it must be above -1 and below 0.5")
        c, d = young / (4.0 * (1.0 + poisson)), young / (6.0 * (1.0 - 2.0 * poisson))
        return cls("neo-hookean", c=c, d=d, density=density, prony=prony, fibres=fibres, sheets=sheets, coupling=coupling)

    def __repr__(self) -> str:
        constants = ", ".join(f"{name}={value:g}" for name, value in self.constants.items())
        relaxes = f", relaxes by {', '.join(f'{share:g} in {seconds:g} s' for share, seconds in self.prony)}" if self.prony else ""
        terms = zip(_TERMS, (self.fibres, self.sheets, self.coupling))
        fibres = "".join(f", {name} a={term[0]:g}, b={term[1]:g}" for name, term in terms if term)
        return f"<supple.Material: {self.law}, {constants}, {self.density:g} kg/m^3{relaxes}{fibres}>"


def _terms_of(prony: ArrayLike) -> list[tuple[float, float]]:
    """Share and time (s) of each term; what they may be the kernel says."""
    try:
        terms = np.asarray(prony, np.float64).reshape(-1, 2) if np.size(prony) == 0 else np.asarray(prony, np.float64)
    except (TypeError, ValueError) as problem:
        raise InputError(f"prony: not rows of a share and a time (s): {problem}") from None
    if terms.ndim != 2 or terms.shape[1] != 2 or len(terms) > 3:
        raise InputError(f"prony: its shape is {terms.shape}, it must be up to three rows of a share and a time (s)")
    bad = np.flatnonzero(terms[:, 0] == 0.0)
    if len(bad):
        raise InputError(f"prony: term {bad[0]} has the share 0, it must be a positive number: leave the term out")
    return [(float(share), float(seconds)) for share, seconds in terms]


def _term_of(term: ArrayLike, name: str) -> tuple[float, float] | None:
    """The constants a (Pa) and b of a term of fibres, or nothing."""
    try:
        values = np.asarray(term, np.float64)
    except (TypeError, ValueError) as problem:
        raise InputError(f"{name}: not two numbers, a (Pa) and b: {problem}") from None
    if values.size == 0:
        return None
    if values.shape != (2,):
        raise InputError(f"{name}: its shape is {values.shape}, it must be two numbers, a (Pa) and b")
    for constant, value in zip("ab", values):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name}: {constant} is {value:g}, it must be a finite positive number; without such a term leave it out")
    return float(values[0]), float(values[1])


class Scene(library.Sealed):
    """A mesh of one tissue, or of several of the same law.

    Parameters
    ----------
    mesh
    material : of all of it; or of each region of the mesh by its number: `{1: liver, 7: vessel}`
    fixed : nodes that are held, as numbers or as a mask over all nodes
    moved : nodes that will be held where `Simulation.set_motions` says
    element : "nodal-strain" (nearest to nature on coarse meshes), "nodal-pressure" (stays whole in deep dents of tissue that stiffens), or "linear" (locks in nearly incompressible tissue)
    axes : along which the fixed nodes are held
    directions : of the fibres of each element, at rest, of any length but zero: of shape (elements, 3); with sheets or coupling of shape
        (elements, 2, 3), along fibres and sheets, of which the part along the fibres is taken off. Not read where a tissue has none
    removed : elements that are not there, as numbers or as a mask over all, as after a resection: nodes and elements keep their numbers, and
        nodes without an element are held
    """

    def __init__(
        self,
        mesh: Mesh,
        material: Material | Mapping[int, Material],
        *,
        fixed: ArrayLike = (),
        moved: ArrayLike = (),
        element: str = "nodal-strain",
        axes: str = "xyz",
        removed: ArrayLike = (),
        directions: ArrayLike | None = None,
    ) -> None:
        if not isinstance(mesh, Mesh):
            raise InputError(f"mesh {mesh!r}: it must be a Mesh")
        if mesh._overlap:
            raise InputError(mesh._overlap)
        is_used = np.zeros(len(mesh.points), bool)
        is_used[mesh.tets] = True
        if not is_used.all():
            first = int(is_used.argmin())
            raise InputError(
                f"the scene: node {first} belongs to no element, one of {(~is_used).sum()} such nodes: leave them out, "
                "used, tets = numpy.unique(mesh.tets, return_inverse=True), supple.Mesh(mesh.points[used], tets.reshape(-1, 4))",
                lib.SUPPLE_E_MESH_UNUSED_NODE, node=first,
            )  # fmt: skip
        if element not in ELEMENTS:
            raise InputError(f"element {element!r}: there are {', '.join(ELEMENTS)}")
        self.mesh, self.material, self.element = mesh, material, element
        self._supports = self._supports_of(fixed, moved, axes)
        self._law, self._tissues, self._prony, self._fibres, self._tissue_of_element = self._tissues_of(material)
        self._directions = _directions_of(directions, self._fibres, self._tissue_of_element)
        self._removed = np.zeros(len(mesh.tets), np.uint8)
        self._removed[library.node_numbers(removed, len(mesh.tets), "removed", "element")] = 1
        self._build()
        self._is_made = True

    def _build(self) -> None:
        mesh, nodes, elements, tissues = self.mesh, len(self.mesh.points), len(self.mesh.tets), len(self._tissues)
        made = library.config("supple_scene_config")
        made.law, made.element, made.winding = self._law, ELEMENTS[self.element], lib.SUPPLE_WINDING_CHECKED
        made.nodes, made.elements, made.supports, made.tissues = nodes, elements, len(self._supports), tissues
        made.points = library.pointer("float", mesh.points)
        made.tetrahedra = library.pointer("uint32_t", mesh.tets)
        made.support = ffi.cast("supple_support *", library.pointer("uint32_t", self._supports))
        made.tissue = library.pointer("supple_tissue", self._tissues)
        if tissues > 1:
            made.tissue_of_element = library.pointer("uint16_t", self._tissue_of_element)
        relaxes = bool(self._prony["share"].any())
        if relaxes:
            made.prony = library.pointer("supple_prony", self._prony)
        if len(self._directions):
            made.fibres = library.pointer("supple_fibres", self._fibres)
            made.directions = library.pointer("float", self._directions)
        if self._removed.any():
            made.removed = library.pointer("uint8_t", self._removed)
        self._config = made
        # Each simulation builds its own; this one says what is wrong with it, and what it takes.
        size = lib.supple_scene_size(nodes, elements, tissues)
        if self.element == "nodal-strain":
            size += lib.supple_patches_size(nodes, elements, tissues)
        if relaxes:
            size += lib.supple_prony_size(tissues)
        if len(self._directions):
            size += lib.supple_fibres_size(nodes, elements, tissues, made.element)
        memory, scene, error = library.Memory(size), ffi.new("supple_scene **"), library.new_error()
        status = lib.supple_scene_init(memory.pointer, memory.size, made, scene, error)
        # Where tissues meet finely a node has more neighbours than the sizes take for usual.
        if status == lib.SUPPLE_E_SHORT:
            memory = library.Memory(int(error.limit))
            status = lib.supple_scene_init(memory.pointer, memory.size, made, scene, error)
        library.checked(status, error, "the scene")
        facts = ffi.new("supple_scene_facts *")
        library.checked(lib.supple_scene_describe(scene[0], facts))
        self._facts = {name: getattr(facts, name) for name in ("nodes", "elements", "bytes", "operations", "mass")}

    def _mesh_of_tissue(self) -> Mesh:
        """The mesh without what was removed; nodes keep their numbers."""
        mesh, is_left = self.mesh, self._removed == 0
        if is_left.all():
            return mesh
        return Mesh(mesh.points, mesh.tets[is_left], regions=None if mesh.regions is None else mesh.regions[is_left])

    def _without(self, removed: NDArray[np.uint8]) -> Scene:
        """Another scene of the same mesh and supports."""
        made = copy.copy(self)
        for of_elements in ("_boundary", "_triangles", "_parts"):
            made.__dict__.pop(of_elements, None)
        made._removed = removed
        made._build()
        return made

    def _of_tissues(self, tissues: NDArray[np.void]) -> Scene:
        """Another one of as many tissues of these constants, which are known to be good."""
        made = copy.copy(self)
        made._tissues, made._config = tissues, ffi.new("supple_scene_config *", self._config[0])
        made._config.tissue = library.pointer("supple_tissue", tissues)
        return made

    def _divided(self, parts: NDArray[np.uint16], of_element: NDArray[np.uint16]) -> Scene:
        """Another one, in which each tissue of `parts` is there once more, behind the others."""
        made = copy.copy(self)
        made._tissues, made._prony, made._fibres = (
            np.concatenate([rows, rows[parts]]) for rows in (self._tissues, self._prony, self._fibres)
        )
        made._tissue_of_element = of_element
        made._build()
        return made

    def _tissues_of(
        self, material: Material | Mapping[int, Material]
    ) -> tuple[int, NDArray[np.void], NDArray[np.void], NDArray[np.void], NDArray[np.uint16]]:
        """The law, the tissues, how each relaxes, its fibres, and of which each element is."""
        regions, of_element = self.mesh.regions, np.zeros(len(self.mesh.tets), np.uint16)
        if isinstance(material, Material):
            materials = [material]
        elif not (isinstance(material, Mapping) and all(isinstance(each, Material) for each in material.values())):
            raise InputError(f"material {material!r}: it must be a Material, or one for each region: {{1: liver, 7: vessel}}")
        else:
            if regions is None or not material:
                raise InputError(f"materials of regions: {'the mesh has no regions' if regions is None else 'there are none'}")
            known = np.array(sorted(material), np.int64)
            bad = np.flatnonzero(~np.isin(regions, known))
            if len(bad):
                raise InputError(f"materials of regions: element {bad[0]} is of region {regions[bad[0]]}, there are {known.tolist()}")
            materials = [material[number] for number in known.tolist()]
            of_element = np.searchsorted(known, regions).astype(np.uint16)
            if len({each.law for each in materials}) != 1:
                raise InputError(f"materials of regions: all must be of one law, not {', '.join(each.law for each in materials)}")
        rows, series, fibres = (np.zeros(len(materials), kind) for kind in (_TISSUE, _PRONY, _FIBRES))
        for row, relaxing, fibrous, each in zip(rows, series, fibres, materials):
            row["constants"][: len(each.constants)], row["density"] = list(each.constants.values()), each.density
            for place, (share, seconds) in enumerate(each.prony):
                relaxing["share"][place], relaxing["seconds"][place] = share, seconds
            for name, term in zip(_TERMS, (each.fibres, each.sheets, each.coupling)):
                fibrous[name] = term or (0.0, 0.0)
        return materials[0]._number, rows, series, fibres, of_element

    @functools.cached_property
    def _boundary(self) -> NDArray[np.uint32]:
        return boundary_of(np.ascontiguousarray(self.mesh.tets[self._removed == 0]))

    @functools.cached_property
    def _triangles(self) -> set[tuple[int, ...]]:
        """Those of the boundary, each from its first node on."""
        return set(_from_first(self._boundary))

    def _are_of_boundary(self, triangles: NDArray[np.uint32]) -> NDArray[np.bool_]:
        """Whether each is of the boundary, seen from either side."""
        return np.array([not {(a, b, c), (a, c, b)}.isdisjoint(self._triangles) for a, b, c in _from_first(triangles)], bool)

    def _triangles_of(self, given: ArrayLike, *, outward: bool) -> NDArray[np.uint32]:
        """Triangles of the boundary, (k, 3), each once; if it matters, seen from outside."""
        array = np.asarray(given)
        if array.size and (array.ndim != 2 or array.shape[1] != 3):
            raise InputError(f"triangles: their shape is {array.shape}, it must be (k, 3)")
        triangles = library.node_numbers(array.ravel(), len(self.mesh.points), "triangles").reshape(-1, 3)
        seen = dict[tuple[int, ...], int]()
        for row, (a, b, c) in enumerate(_from_first(triangles)):
            is_outward = (a, b, c) in self._triangles
            first = seen.setdefault((a, b, c) if is_outward else (a, c, b), row)
            if first == row and (is_outward or (not outward and (a, c, b) in self._triangles)):
                continue
            if first != row:
                wrong = f"is the same as row {first}: each is given once"
            elif (a, c, b) in self._triangles:
                wrong = "is seen from inside: take it as Mesh.boundary tells it; triangles[:, ::-1] turns all"
            else:
                wrong = f"is none of the boundary of the tissue{' that is left' if self._removed.any() else ''}"
            raise InputError(f"triangles: row {row}, {triangles[row].tolist()}, {wrong}", index=row)
        return triangles

    @functools.cached_property
    def _edge(self) -> float:
        """Mean length of the elements' edges, m."""
        corners = self.mesh.points[self.mesh.tets].astype(np.float64)
        pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
        return float(np.mean([np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in pairs]))

    @functools.cached_property
    def _across(self) -> float:
        """The diagonal of the body's box, m."""
        return float(np.linalg.norm(np.ptp(self.mesh.points, axis=0)))

    @functools.cached_property
    def _parts(self) -> NDArray[np.intp]:
        """For each node the least one of the part of the tissue that it hangs together with."""
        tets, least = self.mesh.tets[self._removed == 0], np.arange(len(self.mesh.points))
        while True:
            of_tets = least[tets]
            lower = least.copy()
            np.minimum.at(lower, of_tets, of_tets.min(axis=1, keepdims=True))
            while (lower[lower] != lower).any():
                lower = lower[lower]
            if (lower == least).all():
                return least
            least = lower

    def _supports_of(self, fixed: ArrayLike, moved: ArrayLike, axes: str) -> NDArray[np.uint32]:
        nodes = len(self.mesh.points)
        held = np.unique(library.node_numbers(fixed, nodes, "fixed"))
        free = np.unique(library.node_numbers(moved, nodes, "moved"))
        both = np.intersect1d(held, free)
        if len(both):
            raise InputError(f"node {both[0]} is both fixed and moved")
        rows = [(node, axes_of(axes, "fixed"), 0) for node in held] + [(node, axes_of("xyz", "moved"), 1) for node in free]
        return np.array(rows, np.uint32).reshape(-1, 3)

    @property
    def facts(self) -> dict[str, float]:
        """Nodes, elements that move, bytes, floating-point operations of an exact step, mass (kg)."""
        return dict(self._facts)

    def __repr__(self) -> str:
        return f"<supple.Scene: {self.mesh!r}, {self.material!r}, {self.element}>"


def _from_first(triangles: NDArray[np.uint32]) -> list[tuple[int, ...]]:
    """Each from its node of the lowest number on, the way it goes round."""
    first = triangles.argmin(axis=1)[:, None] if len(triangles) else np.zeros((0, 1), np.int64)
    return [tuple(nodes) for nodes in np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1).tolist()]


def _directions_of(directions: ArrayLike | None, fibres: NDArray[np.void], of_element: NDArray[np.uint16]) -> NDArray[np.float32]:
    """Along fibres and sheets of each element, of shape (elements, 2, 3); of shape (0, 2, 3) where no tissue has fibres."""
    elements = len(of_element)
    needs_two = (fibres["sheets"][:, 0] > 0.0) | (fibres["coupling"][:, 0] > 0.0)
    needs_one = needs_two | (fibres["fibres"][:, 0] > 0.0)
    shape = f"({elements}, 2, 3), along fibres and sheets" if needs_two.any() else f"({elements}, 3) or ({elements}, 2, 3)"
    if directions is None:
        if needs_one.any():
            raise InputError(f"directions: there are none, and a material has fibres: give an array of shape {shape}")
        return np.zeros((0, 2, 3), np.float32)
    if not needs_one.any():
        raise InputError("directions: no material has fibres: give it some (fibres=[a, b]), or leave the directions out")
    try:
        given = np.asarray(directions, np.float32)
    except (TypeError, ValueError) as problem:
        raise InputError(f"directions: not an array of numbers: {problem}") from None
    if given.shape != (elements, 2, 3) and (needs_two.any() or given.shape != (elements, 3)):
        raise InputError(f"directions: their shape is {given.shape}, it must be {shape}")
    made = np.zeros((elements, 2, 3), np.float32)
    if given.ndim == 3:
        made[:] = given
    else:
        made[:, 0] = given
    # As the kernel has it, which names no values.
    with np.errstate(all="ignore"):
        length = np.linalg.norm(made.astype(np.float64), axis=2)
        fibre, sheet = np.moveaxis(made / length[:, :, None], 1, 0)
        is_one, is_two = np.isfinite(fibre).all(axis=1), np.linalg.norm(np.cross(fibre, sheet), axis=1) > 1e-4
    bad = np.flatnonzero((needs_one[of_element] & ~is_one) | (needs_two[of_element] & ~is_two))
    if len(bad):
        raise InputError(
            f"directions: of element {bad[0]} {given[bad[0]].tolist()}: they must be finite and not zero, and those of fibres and sheets not parallel"
        )
    return made
