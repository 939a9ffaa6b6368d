"""Cut lists: what to make for a kit, how often, and how exactly; bills of pieces for its
designs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..files.tables import write_csv
from ..kit.kinds import PartKind, part_kind
from .blanks import Blanks, Strip
from .cells import CellParts
from .cutsheets import Sheet
from .options import Tolerances
from .pieces import PartsList
from .sources import sources
from .stock import StockPlan

_DIGITS = 3  # of millimetres: sums over a whole lamella stay exact to 0.1 mm
_DIGITS_DEG = 4


def cut_list(blanks: Blanks, tolerances: Tolerances = Tolerances()) -> list[dict[str, Any]]:
    """One row a part: label, kind, pieces to make, pieces in every design, what to cut, tolerance.

    Pieces to make serve one design after the other: as many of each part as the neediest design
    uses. Lengths of linear parts: `l1_mm` and `l2_mm` are those of the axes, from the joint to the
    corner points, as designs and assembly plans have them; what is sawn is `cut_length_mm`, with
    the joint's middle at `hole_from_end_mm` and bolt holes at `bolts_from_end_mm`, all from the
    sawn end of side 1. `setback_mm` is by how much either end is shorter than its axis. Cells have
    the number of their arms of each length and sort (see `cells`).
    """
    rows = []
    parts, needed = blanks.parts, blanks.parts.needed()
    strips = {strip.label: strip for strip in blanks.strips}
    plates = {plate.label: plate for plate in blanks.plates}
    for name, values in parts.kit.parts.items():
        kind = part_kind(name)
        for number, value in enumerate(values):
            label = parts.labels[name][number]
            row: dict[str, Any] = {
                "part": label,
                "kind": name,
                "pieces": int(needed[name][number]),
            }
            row |= {
                f"in_{d.design.name}": int(parts.counts[name][k, number])
                for k, d in enumerate(parts.designs)
            }
            if label in strips:
                row |= _sawn(strips[label])
            row |= _dimensions(kind, value, blanks.scale, tolerances)
            if label in strips:  # with slits, the longest: what is sawn goes by these
                row |= {f"l{k}_mm": _mm(side) for k, side in enumerate(strips[label].sides, 1)}
            row |= {
                f"bars_{bar.label.removeprefix(label).strip()}": bar.count
                for bar in blanks.bars
                if bar.label.startswith(f"{label} ")
            }
            row |= {
                f"arms_{arm.label.removeprefix(label).strip().replace(' ', '_')}": arm.count
                for arm in (() if blanks.cells is None else blanks.cells.arms)
                if arm.label.startswith(f"{label} ")
            }
            if label in plates:
                row |= {
                    "leg_mm": _mm(plates[label].leg),
                    "bolts_from_corner_mm": _several(plates[label].bolts),
                    "bolt_hole_mm": plates[label].bolt_hole,
                }
            rows.append(row)
    return rows


def totals(blanks: Blanks) -> list[dict[str, Any]]:
    """One row a sort of material: section, material, pieces, their length in m, their area in
    m2."""
    if blanks.cells is not None:
        return _totals_of_cells(blanks.cells)
    board, strips = blanks.board, blanks.strips
    rows: list[dict[str, Any]] = []
    if strips:
        length = sum(strip.count * strip.cut_length for strip in strips) / 1000
        rows.append(
            {
                "item": "strips",
                "section_mm": board.section,
                "material": board.material or None,
                "pieces": sum(strip.count for strip in strips),
                "length_m": round(length, 3),
                "area_m2": round(length * board.breadth / 1000, 4),
            }
        )
    if blanks.plates:
        area = sum(plate.count * 2 * plate.leg * board.breadth for plate in blanks.plates)
        rows.append(
            {
                "item": "corner plates",
                "section_mm": f"{board.thickness:g} thick",
                "material": board.material or None,
                "pieces": sum(plate.count for plate in blanks.plates),
                "area_m2": round(area / 1e6, 4),
            }
        )
    if blanks.bars:
        length = sum(bar.count * bar.length for bar in blanks.bars) / 1000
        rows.append(
            {
                "item": "bars",
                "section_mm": board.section,
                "material": board.material or None,
                "pieces": sum(bar.count for bar in blanks.bars),
                "length_m": round(length, 3),
            }
        )
    return rows


def material(
    blanks: Blanks, sheets: Sequence[Sheet], plan: StockPlan | None
) -> list[dict[str, Any]]:
    """What the parts take, and what is to be bought for them: see `totals` and `purchases`."""
    return [*totals(blanks), *purchases(blanks, sheets, plan)]


def purchases(
    blanks: Blanks, sheets: Sequence[Sheet], plan: StockPlan | None
) -> list[dict[str, Any]]:
    """One row a size of bars and sheets to buy: how many, their length in m or area in m2.

    Where straight pieces may come from either (see `sources`), some sheets hold them alone, and
    bars are bought instead of these.
    """
    either = sources(blanks).either
    straight = {label for label, _, _ in blanks.straight}
    rows: list[dict[str, Any]] = []
    for length, number in (plan.counts if plan is not None else {}).items():
        rows.append(
            {
                "item": f"to buy: bars of {length:g} mm{', or sheets' if either else ''}",
                "section_mm": blanks.board.section,
                "material": blanks.board.material or None,
                "pieces": number,
                "length_m": round(number * length / 1000, 3),
            }
        )
    others = [sheet for sheet in sheets if not straight & set(sheet.labels)]
    wanted = [("for all parts", sheets), ("with bars: for the other parts", others)]
    for purpose, chosen in wanted if either else [("as drawn", sheets)]:
        sizes = Counter((*sheet.size, sheet.thickness) for sheet in chosen)
        for (width, height, thickness), number in sizes.items():
            rows.append(
                {
                    "item": f"to buy: sheets of {width:g} x {height:g} mm, {purpose}",
                    "section_mm": f"{thickness:g} thick",
                    "pieces": number,
                    "area_m2": round(number * width * height / 1e6, 4),
                }
            )
    return rows


def _totals_of_cells(cells: CellParts) -> list[dict[str, Any]]:
    """Plates, ears and arms' boards: pieces, and the area of their outlines."""
    rows = []
    for item, labels in (("plates", "P"), ("ears", "E"), ("arms' boards", None)):
        chosen = [
            t
            for t in cells.templates()
            if (t.label == labels if labels else t.label not in ("P", "E"))
        ]
        area = sum(t.count * t.area for t in chosen)
        rows.append(
            {
                "item": item,
                "section_mm": f"{chosen[0].thickness:g} thick",
                "pieces": sum(t.count for t in chosen),
                "area_m2": round(area / 1e6, 4),
            }
        )
    return rows


def bill_of_pieces(
    parts: PartsList, names: Iterable[str] | None = None, *, together: bool = False
) -> list[dict[str, Any]]:
    """One row a part that some designs need (default: all): label, kind, pieces.

    See `PartsList.needed`.
    """
    return [
        {"part": parts.labels[kind][number], "kind": kind, "pieces": int(count)}
        for kind, counts in parts.needed(names, together=together).items()
        for number, count in enumerate(counts)
        if count
    ]


def write_cut_list(
    path: str | Path,
    blanks: Blanks,
    tolerances: Tolerances = Tolerances(),
    *,
    overwrite: bool = False,
) -> Path:
    """Write `cut_list` as CSV."""
    return write_csv(path, cut_list(blanks, tolerances), overwrite=overwrite)


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
    """A part's parameters in mm or degrees, and how exactly to keep them."""
    if kind.angular:
        angles = {
            f"{name}_deg": round(float(np.degrees(v)), _DIGITS_DEG)
            for name, v in zip(kind.parameter_names, values)
        }
        return angles | {"tolerance_deg": tolerances.angle}
    lengths = {f"{name}_mm": _mm(v * scale) for name, v in zip(kind.parameter_names, values)}
    return lengths | {"tolerance_mm": tolerances.length}


def _sawn(strip: Strip) -> dict[str, Any]:
    """What is cut of a straight piece."""
    row: dict[str, Any] = {
        "cut_length_mm": _mm(strip.cut_length),
        "hole_from_end_mm": _mm(strip.hole_from_end),
        "bolts_from_end_mm": _several(strip.bolt_stations),
        "bolt_hole_mm": strip.bolt_hole if strip.bolts else None,
        "section_mm": strip.board.section,
        "material": strip.board.material or None,
    }
    if strip.slot is None:
        joint = {"joint_hole_mm": strip.hole}
    else:
        joint = {"slot_width_mm": _mm(strip.slot), "slot_depth_mm": _mm(strip.slot_depth)}
    return row | joint | {"setback_mm": _mm(strip.setback)}


def _mm(value: float) -> float:
    return round(float(value), _DIGITS)


def _several(values: Iterable[float]) -> str:
    return " ".join(f"{value:.{_DIGITS}f}" for value in values)
