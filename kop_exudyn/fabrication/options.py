"""What a workshop has and asks for: units, tolerances, and the sizes of sheets, bars, holes and
gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import check_flag, check_not_negative, check_positive, numbers
from ..errors import InputError
from ..units import LENGTHS

UNFIT = "NOT FIT TO BE BUILT"  # on all files of a kit that are written nevertheless
_NEARLY_ALL = 2.5  # standard deviations: 99 of a hundred errors are smaller
NOTE_ROOM = 24.0  # mm at a sheet's lower edge, for the notes and the scale bar under them


def unfit(warnings: Sequence[str]) -> list[str]:
    """The sentence that says why a kit isn't fit to be built; none where nothing stops it."""
    return [f"{UNFIT}: {'; '.join(warnings)}."] if warnings else []


def millimetres(unit: str) -> float:
    """Millimetres of one unit of length; InputError for a unit that isn't known."""
    if unit not in LENGTHS:
        raise InputError(
            f"unknown unit of length (known: {', '.join(LENGTHS)})", field="unit", value=unit
        )
    return 1000 * LENGTHS[unit]


def tenths(length: float) -> str:
    """A length (mm) as all files and drawings print it: rounded from thousandths, which tables
    have, so that 152.6498 is 152.7 wherever it stands."""
    return f"{round(float(length), 3):.1f}"


@dataclass(frozen=True)
class Tolerances:
    """What the workshop should keep to: length in mm, angle in degrees; why : that, in words."""

    length: float = 0.5
    angle: float = 0.5
    why: str = ""

    def __post_init__(self) -> None:
        for name in ("length", "angle"):
            check_positive(f"tolerance.{name}", getattr(self, name))

    @classmethod
    def tried(cls, buildable: Sequence[Mapping[str, Any]], unit: str) -> Tolerances | None:
        """Limits within which nearly all of the errors lie that a kit's designs were tried with:
        what a verdict holds for. None where none were tried.

        buildable : verdicts, as results have them; unit : the designs' unit of length
        """
        found = [one["tolerance"] for one in buildable if one.get("tolerance")]
        if not any(one["samples"] for one in found):
            return None
        length = _NEARLY_ALL * min(one["length"] for one in found) * millimetres(unit)
        angle = _NEARLY_ALL * float(np.degrees(min(one["angle"] for one in found)))
        return cls(float(f"{length:.2g}"), float(f"{angle:.2g}"))

    def within(self, tried: Tolerances | None) -> Tolerances:
        """These, or smaller ones where designs were tried with no larger errors, see `tried`."""
        if tried is None:
            return self
        why = (
            f"at most {_NEARLY_ALL:g} standard deviations of the errors that the designs were "
            "tried with"
        )
        return Tolerances(min(self.length, tried.length), min(self.angle, tried.angle), why)


@dataclass(frozen=True)
class CutOptions:
    """Sizes in mm.

    sheet : width and height of a sheet
    stock : lengths of the bars that straight pieces are sawn from; none: no plan for bars
    gap : between pieces on a sheet
    margin : to a sheet's edge
    kerf : width of a cut, lost between two pieces of a bar; on sheets, pieces keep at least that
        much apart. Outlines are the finished edges: the machine puts its tool beside them.
    joint_hole, bolt_hole : diameters
    clearance : by which slots are wider than what goes through them
    corners : whether strips are prepared for corner plates
    """

    sheet: tuple[float, float] = (1000.0, 600.0)
    stock: tuple[float, ...] = (2400.0, 4800.0)
    gap: float = 5.0
    margin: float = 15.0
    kerf: float = 3.0
    joint_hole: float = 4.0
    bolt_hole: float = 3.0
    clearance: float = 0.2
    corners: bool = True

    if TYPE_CHECKING:  # lists are welcome too

        def __init__(
            self,
            sheet: Sequence[float] = ...,
            stock: Sequence[float] = ...,
            gap: float = 5.0,
            margin: float = 15.0,
            kerf: float = 3.0,
            joint_hole: float = 4.0,
            bolt_hole: float = 3.0,
            clearance: float = 0.2,
            corners: bool = True,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("gap", "margin", "kerf", "joint_hole", "bolt_hole", "clearance"):
            check_not_negative(f"options.{name}", getattr(self, name))
        check_flag("options.corners", self.corners)
        for name in ("sheet", "stock"):
            object.__setattr__(self, name, numbers(f"options.{name}", getattr(self, name)))
        if len(self.sheet) != 2 or not all(0 < side < np.inf for side in self.sheet):
            raise InputError(
                "a sheet has a positive width and height", field="options.sheet", value=self.sheet
            )
        if not all(0 < length < np.inf for length in self.stock):
            raise InputError("a bar has a positive length", field="options.stock", value=self.stock)

    @property
    def room(self) -> tuple[float, float]:
        """What a sheet has for pieces: its size without margins, and without its notes."""
        width, height = (side - 2 * self.margin for side in self.sheet)
        return width, height - NOTE_ROOM

    @property
    def apart(self) -> float:
        """What pieces on a sheet keep between each other."""
        return max(self.gap, self.kerf)
