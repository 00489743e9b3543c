"""What goes wrong, as exceptions: with the kernel's own words, the place and the value."""

from __future__ import annotations


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
