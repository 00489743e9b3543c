"""The force by which supports act on the tissue."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import _library as library
from ._library import ffi, lib

if TYPE_CHECKING:
    from .simulation import Simulation


@dataclasses.dataclass(frozen=True)
class ReactionForce:
    """The mean force (N) since the call before. `spread`: how far that of the supports alone is from it. Where it is not `resolved` the
    steps are too long for a force: do not use it."""

    newton: NDArray[np.float64]
    resolved: bool
    spread: float


class Reaction(library.Sealed):
    """What tells the force of some supports; made by `Simulation.reaction` before the steps that it is to tell of."""

    def __init__(self, simulation: Simulation, nodes: NDArray[np.uint32], damping: float) -> None:
        # The simulation, too: its memory must stay.
        self._simulation = simulation
        size = lib.supple_reaction_size(len(simulation.scene.mesh.points))
        self._memory = library.Memory(size)
        made, error = ffi.new("supple_reaction **"), library.new_error()
        supports = library.pointer("uint32_t", nodes)
        status = lib.supple_reaction_init(self._memory.pointer, size, simulation._raw_scene, supports, len(nodes), damping, made, error)
        library.checked(status, error, "reaction")
        self._raw = made[0]
        self.force()
        self._is_made = True

    def force(self) -> ReactionForce | None:
        """The mean force since the last call, to be asked for after each frame; None after a reset or a restore."""
        told = ffi.new("supple_reaction_force *")
        simulation = self._simulation
        with simulation._lock:
            status = lib.supple_reaction_follow(simulation._raw_scene, simulation._state, self._raw, told)
        library.checked(status, what="reaction")
        if not told.known:
            return None
        return ReactionForce(np.array(list(told.newton)), bool(told.resolved), float(told.spread))
