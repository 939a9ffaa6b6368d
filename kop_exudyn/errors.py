"""The two ways in which a request can go wrong: bad input, and a simulation that finds no
equilibrium."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any


class InputError(ValueError):
    """Input that can't be used: says which file, which field and which value.

    Parameters
    ----------
    message : what is wrong, one sentence without the place
    source : file (or other origin) of the input
    field : dotted path of the offending field, as ``curves[3].points``
    value : the offending value
    """

    def __init__(
        self, message: str, *, source: Any = None, field: str | None = None, value: Any = None
    ):
        self.message, self.source, self.field, self.value = message, source, field, value
        super().__init__(str(self))

    def __str__(self) -> str:
        parts = [str(self.source)] if self.source is not None else []
        if self.field is not None:
            shown = "" if self.value is None else f" = {_short(self.value)}"
            parts.append(f"{self.field}{shown}")
        return ": ".join([*parts, self.message])

    def at(self, source: Any) -> InputError:
        """The same error, with the file that it came from filled in where it was unknown."""
        return type(self)(
            self.message, source=self.source or source, field=self.field, value=self.value
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild_input_error, (
            type(self), self.message, self.source, self.field, self.value,
        )  # fmt: skip


class OccupiedError(InputError):
    """A place to write to holds something already, which is replaced where that is allowed."""


def _rebuild_input_error(
    kind: type[InputError], message: str, source: Any, field: str | None, value: Any
) -> InputError:
    return kind(message, source=source, field=field, value=value)


class SimulationFailure(RuntimeError):
    """No acceptable equilibrium was found. Callers record it as data: which state, and why.

    Parameters
    ----------
    reason : what happened, one sentence
    where : what was solved, as ``spiral: deployed state``
    """

    def __init__(self, reason: str, *, where: str | None = None):
        self.reason, self.where = reason, where
        super().__init__(reason if where is None else f"{where}: {reason}")

    def within(self, where: str) -> SimulationFailure:
        """The same failure, named by the wider context that it happened in."""
        return SimulationFailure(
            self.reason, where=where if self.where is None else f"{where}: {self.where}"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild_failure, (self.reason, self.where)


def _rebuild_failure(reason: str, where: str | None) -> SimulationFailure:
    return SimulationFailure(reason, where=where)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """ "did you mean 'linear'? " where one of the known names is near, else nothing: goes before
    the list of what is known."""
    near = get_close_matches(name.lower(), [str(one) for one in known], 1)
    return f"did you mean {near[0]!r}? " if near else ""
