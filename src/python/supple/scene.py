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
ELEMENTS = {"linear": lib.SUPPLE_LINEAR, "nodal-pressure": lib.SUPPLE_NODAL_PRESSURE, "nodal-strain": lib.SUPPLE_NODAL_STRAIN}


def axes_of(axes: str, what: str) -> int:
    """Bits of "xyz"."""
    if not axes or any(axis not in "xyz" for axis in axes):
        raise InputError(f"{what}: axes {axes!r}, they are of x, y and z")
    return sum(1 << "xyz".index(axis) for axis in set(axes))


class Material:
    """A law with its constants (Pa) and a density (kg/m^3): `Material("neo-hookean", c=1034, d=10000, density=1060)`.

    With `prony=[[0.5, 1.0], [0.2, 30.0]]` it relaxes: of the stress that changes the shape a share of 0.5 with the time 1 s, 0.2 with 30 s.
    The constants are those of a motion that is over before anything relaxes; pressure does not relax. At most three terms, 0.99 in sum.
    """

    def __init__(self, law: str, *, density: float, prony: ArrayLike = (), **constants: float) -> None:
        if law not in LAWS:
            raise InputError(f"law {law!r}: there are {', '.join(LAWS)}")
        self.law, self.density = law, float(density)
        self._number, names = LAWS[law]
        if set(constants) != set(names):
            raise InputError(f"constants of {law}: {', '.join(constants) or 'none'} are given, {', '.join(names)} are needed")
        self.constants = {name: float(constants[name]) for name in names}
        self.prony = _terms_of(prony)

    @classmethod
    def from_moduli(cls, young: float, poisson: float, *, density: float, prony: ArrayLike = ()) -> Material:
        """The neo-Hookean law of Young's modulus (Pa) and Poisson's ratio at rest: c is half the shear modulus, d half the bulk modulus."""
        if not -1.0 < poisson < 0.5:
            raise InputError(f"Poisson's ratio {poisson}: it must be below 0.5")
        c, d = young / (4.0 * (1.0 + poisson)), young / (6.0 * (1.0 - 2.0 * poisson))
        return cls("neo-hookean", c=c, d=d, density=density, prony=prony)

    def __repr__(self) -> str:
        constants = ", ".join(f"{name}={value:g}" for name, value in self.constants.items())
        relaxes = f", relaxes by {', '.join(f'{share:g} in {seconds:g} s' for share, seconds in self.prony)}" if self.prony else ""
        return f"<supple.Material: {self.law}, {constants}, {self.density:g} kg/m^3{relaxes}>"


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


class Scene:
    """A mesh of one tissue, or of several of the same law.

    Parameters
    ----------
    mesh
    material : of all of it; or of each region of the mesh by its number: `{1: liver, 7: vessel}`
    fixed : nodes that are held, as numbers or as a mask over all nodes
    moved : nodes that will be held where `Simulation.set_motions` says
    element : "nodal-strain" (nearest to nature on coarse meshes), "nodal-pressure" (stays whole in deep dents of tissue that stiffens), or "linear" (locks in nearly incompressible tissue)
    axes : along which the fixed nodes are held
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
    ) -> None:
        if element not in ELEMENTS:
            raise InputError(f"element {element!r}: there are {', '.join(ELEMENTS)}")
        self.mesh, self.material, self.element = mesh, material, element
        self._supports = self._supports_of(fixed, moved, axes)
        self._law, self._tissues, self._prony, self._tissue_of_element = self._tissues_of(material)
        self._removed = np.zeros(len(mesh.tets), np.uint8)
        self._removed[library.node_numbers(removed, len(mesh.tets), "removed", "element")] = 1
        self._build()

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
        if self._removed.any():
            made.removed = library.pointer("uint8_t", self._removed)
        self._config = made
        # Each simulation builds its own; this one says what is wrong with it, and what it takes.
        size = lib.supple_scene_size(nodes, elements, tissues)
        if self.element == "nodal-strain":
            size += lib.supple_patches_size(nodes, elements, tissues)
        if relaxes:
            size += lib.supple_prony_size(tissues)
        memory = library.Memory(size)
        scene, error = ffi.new("supple_scene **"), library.new_error()
        library.checked(lib.supple_scene_init(memory.pointer, size, made, scene, error), error, "the scene")
        facts = ffi.new("supple_scene_facts *")
        library.checked(lib.supple_scene_describe(scene[0], facts))
        self._facts = {name: getattr(facts, name) for name in ("nodes", "elements", "bytes", "operations", "mass")}

    def _changed(
        self, removed: NDArray[np.uint8], tissues: NDArray[np.void], prony: NDArray[np.void], of_element: NDArray[np.uint16]
    ) -> Scene:
        """Another scene of the same mesh and supports."""
        made = copy.copy(self)
        made.__dict__.pop("_boundary", None)
        made._removed, made._tissues, made._prony, made._tissue_of_element = removed, tissues, prony, of_element
        made._build()
        return made

    def _tissues_of(
        self, material: Material | Mapping[int, Material]
    ) -> tuple[int, NDArray[np.void], NDArray[np.void], NDArray[np.uint16]]:
        """The law, the tissues, how each relaxes, and of which each element is."""
        regions, of_element = self.mesh.regions, np.zeros(len(self.mesh.tets), np.uint16)
        if isinstance(material, Material):
            materials = [material]
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
        rows, series = np.zeros(len(materials), _TISSUE), np.zeros(len(materials), _PRONY)
        for row, relaxing, each in zip(rows, series, materials):
            row["constants"][: len(each.constants)], row["density"] = list(each.constants.values()), each.density
            for place, (share, seconds) in enumerate(each.prony):
                relaxing["share"][place], relaxing["seconds"][place] = share, seconds
        return materials[0]._number, rows, series, of_element

    @functools.cached_property
    def _boundary(self) -> NDArray[np.uint32]:
        return boundary_of(np.ascontiguousarray(self.mesh.tets[self._removed == 0]))

    @functools.cached_property
    def _edge(self) -> float:
        """Mean length of the elements' edges, m."""
        corners = self.mesh.points[self.mesh.tets].astype(np.float64)
        pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
        return float(np.mean([np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in pairs]))

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
