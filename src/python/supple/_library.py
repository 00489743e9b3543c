"""The C library (include/supple.h) that comes with the package: calls that turn refusals into exceptions, and memory for objects."""

from __future__ import annotations

import math
import pathlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _interface, errors

ffi: Any = _interface.ffi
lib: Any = ffi.dlopen(str(pathlib.Path(__file__).with_name("libsupple.so")))

if lib.supple_abi() != lib.SUPPLE_ABI:
    raise ImportError(f"libsupple.so has interface {lib.supple_abi()}, the package is for {lib.SUPPLE_ABI}")
# Statuses of steps that were refused.
_DIVERGED = range(lib.SUPPLE_E_DIVERGED_PRESSURE, lib.SUPPLE_E_DIVERGED + 1)
# What an axis is where it is none.
_TERMS = ("term 0", "term 1", "term 2")
_AXES = {
    **dict.fromkeys((lib.SUPPLE_E_RELAXATION_SHARE, lib.SUPPLE_E_RELAXATION_TIME, lib.SUPPLE_E_FIBRES), _TERMS),
    lib.SUPPLE_E_NEGATIVE: ("tolerance", "damping", "time"),
}


def words(status: int) -> str:
    """What a status means."""
    return str(ffi.string(lib.supple_status_text(status)), "ascii")


def checked(status: int, error: Any = None, what: str = "") -> int:
    """The status of a call, if it did what it was asked; else an exception with the kernel's words, the place and the value."""
    if status < 0:
        raise _refusal(status, words(status), error, what)
    return status


def _refusal(status: int, words: str, error: Any, what: str) -> errors.Error:
    """The exception of a negative status; `error` is a supple_error, or None."""
    found: dict[str, Any] = {}
    parts: list[str] = []
    if error is not None:
        for name in ("index", "node", "axis"):
            if getattr(error, name) != lib.SUPPLE_NONE:
                found[name] = int(getattr(error, name))
        if "index" in found:
            parts.append(f"entry {found['index']}")
        if "node" in found:
            parts.append(f"node {found['node']}")
        if "axis" in found:
            parts.append(_AXES.get(status, ("axis x", "axis y", "axis z"))[found["axis"] % 3])
        if not math.isnan(error.value) and (error.value != 0.0 or error.limit != 0.0):
            found["value"] = float(error.value)
            parts.append(f"value {error.value:.6g}")
            if not math.isnan(error.limit) and error.limit != 0.0:
                found["limit"] = float(error.limit)
                parts.append(f"against {error.limit:.6g}")
    sentence = ": ".join(part for part in (what, words, ", ".join(parts)) if part)
    kind = errors.UnstableStep if status == lib.SUPPLE_E_UNSTABLE else errors.Diverged if status in _DIVERGED else errors.InputError
    return kind(sentence, status, **found)


class Sealed:
    """An object of which, once it is made, only what has a setter can be set: nothing would read anything else."""

    _is_made = False

    # Type checkers know the names by themselves.
    if not TYPE_CHECKING:

        def __setattr__(self, name: str, value: Any) -> None:
            if self._is_made and not name.startswith("_"):
                kind = type(self)
                settable = [each for each in dir(kind) if getattr(getattr(kind, each), "fset", None)]
                if name not in settable:
                    only, made = f", only {', '.join(settable)}" if settable else "", kind.__name__
                    raise AttributeError(f"{made}.{name} cannot be set{only}: make a new {made} with it, or call a method")
            super().__setattr__(name, value)


class Memory:
    """Aligned bytes for an object of the library, which stays where it is as long as this does."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._bytes = np.zeros(size + lib.SUPPLE_ALIGN, np.uint8)
        start = -self._bytes.ctypes.data % lib.SUPPLE_ALIGN
        self.view = self._bytes[start : start + size]
        self.pointer = ffi.cast("void *", self.view.ctypes.data)


def new_error() -> Any:
    return ffi.new("supple_error *")


def config(kind: str) -> Any:
    """An empty configuration of this kind of the library's version."""
    made = ffi.new(f"{kind} *")
    made.struct_size, made.abi = ffi.sizeof(kind), lib.SUPPLE_ABI
    return made


def pointer(kind: str, array: NDArray[Any]) -> Any:
    """The address of the first entry of an array, which must be kept by the caller."""
    return ffi.cast(f"{kind} *", array.ctypes.data) if array.size else ffi.NULL


def number(value: Any, what: str) -> float:
    """A number, whatever its size; anything else is refused with its name."""
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.zeros(0)
    if array.shape != () or array.dtype.kind not in "biuf":
        raise errors.InputError(f"{what} {value!r}: it must be a number")
    return float(array)


def not_negative(value: Any, what: str, unit: str) -> float:
    """A finite number, zero or more."""
    if not 0.0 <= number(value, what) < np.inf:
        raise errors.InputError(f"{what} {value}: it must be zero or a positive number, {unit}")
    return float(value)


def whole(value: Any, what: str, most: int) -> int:
    """A whole number from 1 on."""
    if not (1.0 <= number(value, what) <= most and int(value) == value):
        raise errors.InputError(f"{what} {value}: it must be a whole number, at least 1")
    return int(value)


def vectors(values: Any, what: str, count: int | None = None) -> NDArray[np.float32]:
    """Finite float32 vectors of shape (n, 3) from anything like them; one vector stands for `count` of them."""
    try:
        array = np.asarray(values, np.float64)
    except (TypeError, ValueError) as problem:
        raise errors.InputError(f"{what}: not an array of numbers: {problem}") from None
    if array.shape == (3,) and count is not None:
        array = np.broadcast_to(array, (count, 3))
    if array.ndim != 2 or array.shape[1] != 3 or (count is not None and len(array) != count):
        wanted = "(n, 3)" if count is None else f"({count}, 3)"
        raise errors.InputError(f"{what}: its shape is {array.shape}, it must be {wanted}")
    finite = np.isfinite(array)
    if not finite.all():
        bad = np.argmin(finite.all(axis=1))
        raise errors.InputError(f"{what}: row {bad} is {array[bad].tolist()}, not finite")
    return np.ascontiguousarray(array, np.float32)


def node_numbers(selection: Any, nodes: int, what: str, kind: str = "node") -> NDArray[np.uint32]:
    """Numbers of nodes, or of elements, from numbers or from a mask over all of them. Repeated ones stay repeated."""
    array = np.asarray(selection)
    if array.dtype == bool:
        if array.shape != (nodes,):
            raise errors.InputError(f"{what}: a mask of shape {array.shape}, there are {nodes} {kind}s")
        array = np.flatnonzero(array)
    array = np.atleast_1d(array)
    if array.size == 0:
        return np.zeros(0, np.uint32)
    if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
        raise errors.InputError(f"{what}: numbers of {kind}s or a mask are needed, not {array.dtype} of shape {array.shape}")
    # As numbers they would be those of the first two, many times.
    if array.size == nodes and ((array == 0) | (array == 1)).all() and len(np.unique(array)) < nodes:
        raise errors.InputError(
            f"{what}: as many {array.dtype} zeros and ones as there are {kind}s are taken neither as numbers nor as a mask: "
            "for a mask give mask.astype(bool) or numpy.flatnonzero(mask)"
        )
    if array.min() < 0 or array.max() >= nodes:
        bad = np.argmax((array < 0) | (array >= nodes))
        raise errors.InputError(f"{what}: entry {bad} is {kind} {array[bad]}, there are {nodes} {kind}s")
    return array.astype(np.uint32)


def cells_of(given: Any) -> tuple[int, int, int]:
    """How many cells there are along x, y and z."""
    try:
        array = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != (3,) or not ((array >= 1.0) & (array < 1 << 31) & (array == np.floor(array))).all():
        raise errors.InputError(f"cells {given!r}: they must be three whole numbers, at least 1")
    return int(array[0]), int(array[1]), int(array[2])
