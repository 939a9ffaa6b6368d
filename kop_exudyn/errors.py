"""The two ways in which a request can go wrong: bad input, and a simulation that finds no
equilibrium."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from difflib import get_close_matches
from typing import Any

Place = str | Iterable[float]


class InputError(ValueError):
    """Input that can't be used: says which file, which field and which value.

    Parameters
    ----------
    message : what is wrong, one sentence without the place
    source : file (or other origin) of the input
    field : dotted path of the offending field, as ``curves[3].points``
    value : the offending value
    places : points (d,), in whatever coordinates are at hand where the error is raised, or texts;
        the message has "{place}" where they are to stand. Who knows the user's coordinates moves
        them there, see `moved`
    """

    def __init__(
        self,
        message: str,
        *,
        source: Any = None,
        field: str | None = None,
        value: Any = None,
        places: Iterable[Place] = (),
    ):
        self.pattern, self.source, self.field, self.value = message, source, field, value
        self.places = tuple(places)
        super().__init__(str(self))

    @property
    def message(self) -> str:
        """What is wrong, the places included."""
        return self.pattern.replace("{place}", ", ".join(map(_shown, self.places)))

    def moved(self, to: Callable[[Any], Place]) -> InputError:
        """The same error, its places in other coordinates; those that are texts stay."""
        return type(self)(
            self.pattern,
            source=self.source,
            field=self.field,
            value=self.value,
            places=[p if isinstance(p, str) else to(p) for p in self.places],
        )

    def __str__(self) -> str:
        parts = [str(self.source)] if self.source is not None else []
        if self.field is not None:
            shown = "" if self.value is None else f" = {_short(self.value)}"
            parts.append(f"{self.field}{shown}")
        return ": ".join([*parts, self.message])

    def at(self, source: Any) -> InputError:
        """The same error, with the file that it came from filled in where it was unknown."""
        return type(self)(
            self.pattern,
            source=self.source or source,
            field=self.field,
            value=self.value,
            places=self.places,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild_input_error, (
            type(self), self.pattern, self.source, self.field, self.value, self.places,
        )  # fmt: skip


class OccupiedError(InputError):
    """A place to write to holds something already, which is replaced where that is allowed."""


def _rebuild_input_error(
    kind: type[InputError],
    message: str,
    source: Any,
    field: str | None,
    value: Any,
    places: Iterable[Place],
) -> InputError:
    return kind(message, source=source, field=field, value=value, places=places)


def _shown(place: Place) -> str:
    return place if isinstance(place, str) else shown_place(place)


def shown_place(place: Iterable[float], size: float | None = None) -> str:
    """A point as text: six digits, or more of one that lies far away for the size of what it
    belongs to."""
    numbers = [float(x) for x in place]
    farthest = max((abs(x) for x in numbers), default=0.0)
    digits = 6
    if size is not None and farthest > size > 0:
        digits = min(15, max(6, 4 + math.ceil(math.log10(farthest / size))))
    return f"({', '.join(f'{x:.{digits}g}' for x in numbers)})"


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
