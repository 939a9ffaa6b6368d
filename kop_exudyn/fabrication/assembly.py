"""Assembly plans: for every element of a design, which part goes there, which way round, and what
it meets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..files.tables import write_csv
from ..kit.kinds import part_kind
from .cutlist import millimetres
from .pieces import PartsList, Piece
from .placement import PlacedPieces


def assembly_plan(parts: PartsList, name: str, unit: str) -> list[dict[str, Any]]:
    """One row an element of the design of that name, in the elements' order.

    Of a beam: the joint that it carries (of a cell: all that its bars end at), and for each of its
    sides the part's side used there, its length and the corner or free end that it leads to. Of a
    corner: its signed turn, and the elements before and after it; positive turns are
    counter-clockwise about the hinge axis when walking from "before" to "after".

    unit : the designs' unit of length
    Raises InputError for a design that isn't there.
    """
    scale = millimetres(unit)
    parts.needed([name])  # knows the names
    placed = PlacedPieces.of(next(d for d in parts.designs if d.design.name == name))
    return [
        {
            "element": piece.element,
            "kind": piece.kind,
            "part": parts.label(piece),
            "variant": piece.variant,
            **_where(placed, parts, piece, scale),
        }
        for piece in placed.pieces.pieces
    ]


def write_assembly_plan(
    path: str | Path, parts: PartsList, name: str, unit: str, *, overwrite: bool = False
) -> Path:
    """Write `assembly_plan` as CSV."""
    return write_csv(path, assembly_plan(parts, name, unit), overwrite=overwrite)


def _where(placed: PlacedPieces, parts: PartsList, piece: Piece, scale: float) -> dict[str, Any]:
    if part_kind(piece.kind).angular:
        return _corner(placed, piece)
    row: dict[str, Any] = {"joint": " ".join(map(str, placed.joints_of(piece)))}
    names = part_kind(piece.kind).parameter_names
    for side, (parameter, column, value) in enumerate(
        zip(piece.parameters, piece.columns, piece.values), 1
    ):
        row |= {
            f"side_{side}": names[column],
            f"side_{side}_mm": round(value * scale, 4),
            f"side_{side}_towards": _leads_to(placed, parts, parameter),
        }
    return row


def _corner(placed: PlacedPieces, piece: Piece) -> dict[str, Any]:
    row: dict[str, Any] = {"turn_deg": round(float(np.degrees(piece.values[0])), 4)}
    corner = placed.corners.get(piece.parameters[0])
    if corner is not None:
        row |= {
            "before": _elements(placed, corner.before),
            "after": _elements(placed, corner.after),
        }
    return row


def _elements(placed: PlacedPieces, chains: tuple[int, ...]) -> str:
    found = [placed.chain_pieces[chain] for chain in chains]
    return " ".join(str(piece.element) for piece in found if piece is not None)


def _leads_to(placed: PlacedPieces, parts: PartsList, parameter: int) -> str:
    """What is at the outer end of the rod piece that a parameter drives; of several, as in cells,
    nothing."""
    chains = placed.chains.get(parameter, [])
    return _named(placed, parts, placed.far_end(chains[0])) if len(chains) == 1 else ""


def _named(placed: PlacedPieces, parts: PartsList, body: int) -> str:
    if body in placed.corner_pieces:
        corner = placed.corner_pieces[body]
        return f"corner {corner.element} ({parts.label(corner)})"
    if body in placed.joint_numbers:
        return f"joint {placed.joint_numbers[body]}"
    return "free end" if len(placed.touching[body]) == 1 else f"point {body}"
