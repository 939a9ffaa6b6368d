"""Cut lists: what to make for a kit, how often, and how exactly; bills of pieces for any of its
designs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files.tables import write_csv
from ..kit.kinds import PartKind, part_kind
from .pieces import PartsList
from .placement import bars_needed

# Millimetres of one unit of length.
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}

_DIGITS = 4  # of millimetres and degrees: far finer than any tool


@dataclass(frozen=True)
class Tolerances:
    """What the workshop should keep to: length in mm, angle in degrees."""

    length: float = 0.5
    angle: float = 0.5


def millimetres(unit: str) -> float:
    """Millimetres of one unit of length; InputError for a unit that isn't known."""
    if unit not in UNITS:
        raise InputError(
            f"unknown unit of length (known: {', '.join(UNITS)})", field="unit", value=unit
        )
    return UNITS[unit]


def has_joint(kind: PartKind) -> bool:
    """Whether a kind's parts are beams with a joint between two sides; other parts of lengths are
    sets of bars."""
    return kind.parameter_names[:2] == ("l1", "l2")


def cut_list(
    parts: PartsList, unit: str, tolerances: Tolerances = Tolerances()
) -> list[dict[str, Any]]:
    """One row a part: label, kind, pieces to make, pieces in every design, dimensions in mm or
    degrees, tolerance.

    unit : the designs' unit of length Pieces to make serve one design after the other: as many of
    each part as the neediest design uses. Linear parts also have their whole length and the place
    of their joint, from the end of side 1; cells the number of their bars.
    """
    scale, needed = millimetres(unit), parts.needed()
    rows = []
    for name, values in parts.kit.parts.items():
        kind = part_kind(name)
        for number, value in enumerate(values):
            row: dict[str, Any] = {
                "part": parts.labels[name][number],
                "kind": name,
                "pieces": int(needed[name][number]),
            }
            row |= {
                f"in_{d.design.name}": int(parts.counts[name][k, number])
                for k, d in enumerate(parts.designs)
            }
            if not kind.angular and not has_joint(kind):
                bars = bars_needed(parts, name)[number]
                row |= {
                    f"bars_{which}": int(count) for which, count in zip(kind.parameter_names, bars)
                }
            rows.append(row | _dimensions(kind, value, scale, tolerances))
    return rows


def bill_of_pieces(
    parts: PartsList, names: Iterable[str] | None = None, *, together: bool = False
) -> list[dict[str, Any]]:
    """One row a part that some designs need (default: all): label, kind, pieces. See
    `PartsList.needed`."""
    return [
        {"part": parts.labels[kind][number], "kind": kind, "pieces": int(count)}
        for kind, counts in parts.needed(names, together=together).items()
        for number, count in enumerate(counts)
        if count
    ]


def write_cut_list(
    path: str | Path,
    parts: PartsList,
    unit: str,
    tolerances: Tolerances = Tolerances(),
    *,
    overwrite: bool = False,
) -> Path:
    """Write `cut_list` as CSV."""
    return write_csv(path, cut_list(parts, unit, tolerances), overwrite=overwrite)


def write_bill(
    path: str | Path,
    parts: PartsList,
    names: Iterable[str] | None = None,
    *,
    together: bool = False,
    overwrite: bool = False,
) -> Path:
    """Write `bill_of_pieces` as CSV."""
    return write_csv(path, bill_of_pieces(parts, names, together=together), overwrite=overwrite)


def _dimensions(
    kind: PartKind, values: np.ndarray, scale: float, tolerances: Tolerances
) -> dict[str, Any]:
    """A part's parameters in mm or degrees, and what follows from them."""
    if kind.angular:
        angles = {
            f"{name}_deg": round(float(np.degrees(v)), _DIGITS)
            for name, v in zip(kind.parameter_names, values)
        }
        return angles | {"tolerance_deg": tolerances.angle}
    lengths = {
        f"{name}_mm": round(float(v) * scale, _DIGITS)
        for name, v in zip(kind.parameter_names, values)
    }
    if has_joint(kind):
        l1, l2, slit = (*values, 0.0)[:3]
        lengths["length_mm"] = round(float(l1 + l2 + 2 * slit) * scale, _DIGITS)
        lengths["joint_at_mm"] = round(float(l1 + slit) * scale, _DIGITS)
    return lengths | {"tolerance_mm": tolerances.length}
