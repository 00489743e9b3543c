"""Tissue that changes while it moves: another scene under the same motion, and constants on their way."""

from __future__ import annotations

import dataclasses
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._library import ffi, lib
from .errors import InputError
from .instruments import Contact
from .scene import Material, Scene

if TYPE_CHECKING:
    from .simulation import Simulation

# How often an ablation changes the constants.
_STAGES = 20


@dataclasses.dataclass
class Ablation:
    """Constants (Pa) of a tissue on their way, from a time on (s)."""

    tissue: int
    begin: NDArray[np.float32]
    end: NDArray[np.float32]
    start: float
    seconds: float
    stage: int = 0

    def stage_at(self, now: float) -> int:
        # What rounding of the time lacks does not cost a stage.
        share = min(max((now - self.start) / self.seconds, 0.0), 1.0) if self.seconds > 0.0 else 1.0
        return int(share * _STAGES + 1e-6)


def made_of(scene: Scene, settings: Any, what: str) -> tuple[library.Memory, Any]:
    """A simulation at rest, with its memory."""
    size, error, made = ffi.new("size_t *"), library.new_error(), ffi.new("supple_sim **")
    library.checked(lib.supple_sim_size(scene._config, settings, size, error), error, what)
    try:
        memory = library.Memory(size[0])
    except MemoryError:
        remedy = "; take fewer cells" if settings.cells[0] else ""
        raise InputError(f"{what}: {size[0] / 2**30:.3g} GiB of memory are needed, which are not there{remedy}") from None
    library.checked(lib.supple_sim_setup(memory.pointer, size[0], scene._config, settings, made, error), error, what)
    return memory, made[0]


def exchanged(simulation: Simulation, scene: Scene) -> None:
    """See `Simulation.exchange`."""
    if not isinstance(scene, Scene):
        raise InputError(f"exchange with {scene!r}: it must be a Scene")
    settings, contact, error = simulation._settings, simulation._contact, library.new_error()
    memory, sim = made_of(scene, settings, simulation._what)
    objects = ffi.new("supple_sim_objects *")
    library.checked(lib.supple_sim_describe(sim, objects))
    if contact is not None:
        former, contact = contact, Contact(scene.mesh.points, scene._boundary, objects.scene, contact.triangles, contact.grips)
        library.checked(lib.supple_contact_carry_on(contact.raw, objects.scene, former.raw), what="instruments")
        contact._rows = former._rows
    status = lib.supple_sim_carry_on(sim, simulation._sim, settings, error)
    if status == lib.SUPPLE_E_NOT_HELD:
        raise InputError(
            f"exchange: node {error.node} has a motion, and is none of the moved nodes of the new scene: move it there as well, "
            "or end all motions before, set_motions([], (0, 0, 0))",
            status, node=int(error.node),
        )  # fmt: skip
    library.checked(status, error, "exchange")
    if contact is not None and contact.list:
        library.checked(lib.supple_set_contact(objects.loads, contact.raw))
    simulation._scene, simulation._contact = scene, contact
    simulation._adopt(memory, sim)
    _load_what_is_left(simulation)


def _load_what_is_left(simulation: Simulation) -> None:
    """Pressures and tractions lose the triangles that are not of the boundary any more; a pressure whose surface is open then does not fill."""
    scene = simulation.scene
    if simulation._traction is not None:
        triangles, pascal, ramp = simulation._traction
        simulation.set_tractions(triangles[scene._are_of_boundary(triangles)], pascal, ramp)
    if simulation._pressures:
        for one in simulation._pressures:
            triangles = one._numbers.reshape(-1, 3)
            is_left = scene._are_of_boundary(triangles)
            if not is_left.all():
                one._numbers = triangles[is_left].ravel()
                one._filling = (0.0, 0.0)
        simulation._set_pressures(simulation._pressures)


def ablated(simulation: Simulation, elements: ArrayLike, material: Material, seconds: float) -> None:
    """See `Simulation.ablate`."""
    scene = simulation.scene
    numbers = library.node_numbers(elements, len(scene.mesh.tets), "ablate", "element")
    if not isinstance(material, Material):
        raise InputError(f"ablate to {material!r}: it must be a Material")
    if material._number != scene._law:
        raise InputError(f"ablate: the material is {material.law}, another law than that of the tissue")
    if not 0.0 <= library.number(seconds, "seconds") < np.inf:
        raise InputError(f"ablate within {seconds} s: it must be zero or more")
    if not len(numbers):
        raise InputError("ablate: there are no elements")
    _, rows, series, fibres, _ = scene._tissues_of(material)
    parts = np.unique(scene._tissue_of_element[numbers])
    differ = [
        name
        for name, given, has in (("density", rows["density"], scene._tissues["density"]), ("prony", series, scene._prony), ("fibres", fibres, scene._fibres))
        if (name == "density" or given.tobytes().strip(b"\0")) and (has[parts] != given[0]).any()
    ]
    if differ:
        warnings.warn(
            f"ablate: {' and '.join(differ)} of the material differ from those of the tissue, which stay: only constants change; "
            "for all of a material exchange a scene of it",
            RuntimeWarning, stacklevel=4,
        )  # fmt: skip
    end = np.zeros(4, np.float32)
    end[: len(material.constants)] = list(material.constants.values())
    if not (np.isfinite(end).all() and (end[: len(material.constants)] > 0.0).all()):
        raise InputError(f"ablate: {material!r}: constants must be finite and positive")
    # Of each tissue its ablated part becomes one of its own.
    of_element = scene._tissue_of_element.copy()
    first = len(scene._tissues)
    of_element[numbers] = first + np.searchsorted(parts, scene._tissue_of_element[numbers])
    divided = scene._divided(parts, of_element)
    exchanged(simulation, divided)
    now = simulation.time
    for place in range(first, len(divided._tissues)):
        simulation._ablations.append(Ablation(place, divided._tissues["constants"][place].copy(), end, now, seconds))


def next_stage(simulation: Simulation) -> None:
    """The next stage of each ablation, if it is due."""
    if not simulation._ablations:
        return
    now, tissues, error = simulation.time, simulation.scene._tissues.copy(), library.new_error()
    due = [ablation for ablation in simulation._ablations if ablation.stage_at(now) > ablation.stage]
    if not due:
        return
    for ablation in due:
        share = ablation.stage_at(now) / _STAGES
        tissues["constants"][ablation.tissue] = ablation.begin + share * (ablation.end - ablation.begin)
    rows = library.pointer("supple_tissue", tissues)
    # Long steps are prepared anew at the end.
    is_last = any(ablation.stage_at(now) == _STAGES for ablation in due)
    settings = simulation._settings if is_last or simulation.method == "auto" else ffi.NULL
    status = lib.supple_sim_set_tissues(simulation._sim, rows, len(tissues), settings, error)
    library.checked(status, error, "ablation")
    for ablation in due:
        ablation.stage = ablation.stage_at(now)
    simulation._ablations = [ablation for ablation in simulation._ablations if ablation.stage < _STAGES]
    simulation._scene = simulation.scene._of_tissues(tissues)
