"""What goes wrong, as exceptions: with the kernel's own words, the place and the value."""

from __future__ import annotations

import math
from typing import Any

NONE = 0xFFFFFFFF


class Error(Exception):
    """Anything that the kernel refuses.

    Attributes
    ----------
    status : the kernel's number, as in include/supple.h; 0 if the input was refused before the kernel saw it
    index, node, axis : where, if it is somewhere; else None
    value, limit : what it found, and what it must be below; else None
    """

    def __init__(
        self,
        sentence: str,
        status: int = 0,
        index: int | None = None,
        node: int | None = None,
        axis: int | None = None,
        value: float | None = None,
        limit: float | None = None,
    ) -> None:
        super().__init__(sentence)
        self.status, self.index, self.node, self.axis = status, index, node, axis
        self.value, self.limit = value, limit


class InputError(Error, ValueError):
    """A mesh, a constant, a load, a step or an instrument that cannot be."""


class UnstableStep(InputError):
    """A step above the critical one: shorten it, or take another method."""


class Diverged(Error, ArithmeticError):
    """A step was refused, since what it would have led to cannot be. The state is as it was before that step."""


_UNSTABLE = -33
_DIVERGED = range(-95, -89)


def made(status: int, words: str, error: Any, what: str) -> Error:
    """The exception of a negative status; `error` is a supple_error, or None."""
    found: dict[str, Any] = {}
    parts: list[str] = []
    if error is not None:
        for name in ("index", "node", "axis"):
            if getattr(error, name) != NONE:
                found[name] = int(getattr(error, name))
        if "index" in found:
            parts.append(f"entry {found['index']}")
        if "node" in found:
            parts.append(f"node {found['node']}")
        if "axis" in found:
            parts.append(f"axis {'xyz'[found['axis'] % 3]}")
        if not math.isnan(error.value) and (error.value != 0.0 or error.limit != 0.0):
            found["value"] = float(error.value)
            parts.append(f"value {error.value:.6g}")
            if not math.isnan(error.limit) and error.limit != 0.0:
                found["limit"] = float(error.limit)
                parts.append(f"against {error.limit:.6g}")
    sentence = ": ".join(part for part in (what, words, ", ".join(parts)) if part)
    kind = UnstableStep if status == _UNSTABLE else Diverged if status in _DIVERGED else InputError
    return kind(sentence, status, **found)
