"""Assembly plans: for every element of a design, which part goes there, which way round, and what
it meets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..files.tables import write_csv
from ..kit.kinds import part_kind
from .cells import sorts_of_arms
from .lamellas import LOWER, Lamellas
from .options import millimetres
from .pieces import PartsList, Piece
from .placement import PlacedPieces


def assembly_plan(parts: PartsList, name: str, unit: str) -> list[dict[str, Any]]:
    """One row an element of the design of that name, in the elements' order.

    Of all: the lamella that it belongs to, and its place along it, from 1 (see `lamellas`).
    Of a cell, the sort of its arms ("a" or "b", see `cells`), all joints that they end at, and at
    its top plate (side 1) and its bottom plate (side 2) which of the part's two lengths they have.
    Of a beam: the joint that it carries, whether it is the
    lower or the upper one there and which lamella it crosses, and for each of its sides in the
    lamella's direction the part's side used there, its length and the corner or free end that it
    leads to. Of a corner: its signed turn, and the elements before and after it; positive turns are
    counter-clockwise about the hinge axis when walking from "before" to "after".

    unit : the designs' unit of length
    Raises InputError for a design that isn't there.
    """
    scale = millimetres(unit)
    placed = PlacedPieces.of(parts.named(name))
    lamellas, on_edge = Lamellas(placed), stands_on_edge(placed)
    return [
        {
            "element": piece.element,
            "kind": piece.kind,
            "part": parts.label(piece),
            "variant": piece.variant,
            **_along(lamellas, piece, on_edge),
            **_where(placed, parts, piece, scale),
        }
        for piece in placed.pieces.pieces
    ]


def stands_on_edge(placed: PlacedPieces) -> bool:
    """Whether the joints' axes lie in the rods' boards, so that lamellas cross in slots."""
    sections = [chain.section for chain in placed.scene.chains if chain.section is not None]
    y, z = np.ptp(sections[0].outline, axis=0) if sections else (1.0, 0.0)
    return bool(z > y)


def joint_table(parts: PartsList, name: str, unit: str, points: np.ndarray) -> list[dict[str, Any]]:
    """One row a joint: its place, the pieces that meet there, the angle between them.

    unit : the designs' unit of length
    points (n_joints, 3) : where the joints are in the built state, in that unit
    Raises InputError for a design that isn't there.
    """
    scale, number = millimetres(unit), parts.row_of(name)
    placed = PlacedPieces.of(parts.designs[number])
    lamellas = Lamellas(placed)
    role = placed.design.fitted_role.name
    state = parts.states[number][role] if parts.states else placed.scene.initial
    angles = placed.crossing_angles(state)
    rows = []
    for joint, point in enumerate(points, 1):
        row: dict[str, Any] = {"joint": joint}
        row |= {f"{axis}_mm": round(scale * float(x), 3) for axis, x in zip("xyz", point)}
        if joint in lamellas.crossings:
            lower, upper = lamellas.crossings[joint]
            row |= {"lower": lower.element, "upper": upper.element}
        if joint in angles:
            row["angle_deg"] = round(float(np.degrees(angles[joint])), 2)
        rows.append(row)
    return rows


def joint_places(parts: PartsList, name: str) -> np.ndarray:
    """(n_joints, 3) where a design's joints are in its built state: in its unit of length, in its
    user's coordinates."""
    number = parts.row_of(name)
    placed = PlacedPieces.of(parts.designs[number])
    role = placed.design.fitted_role.name
    state = parts.states[number][role] if parts.states else placed.scene.initial
    return state.positions[placed.design.joints] + placed.design.origin


def _along(lamellas: Lamellas, piece: Piece, on_edge: bool) -> dict[str, Any]:
    """Where a piece is along its lamella, and how it crosses the other one."""
    if piece.element not in lamellas.place:
        return {}
    number, place = lamellas.place[piece.element]
    row: dict[str, Any] = {"lamella": number, "place": place}
    layer = lamellas.layer.get(piece.element)
    if layer is not None:
        row["layer"] = layer
        if on_edge:
            row["slot"] = "up" if layer == LOWER else "down"
        row["crosses"] = lamellas.place[lamellas.crosses[piece.element].element][0]
    return row


def write_assembly_plan(
    path: str | Path, parts: PartsList, name: str, unit: str, *, overwrite: bool = False
) -> Path:
    """Write `assembly_plan` as CSV."""
    return write_csv(path, assembly_plan(parts, name, unit), overwrite=overwrite)


def _where(placed: PlacedPieces, parts: PartsList, piece: Piece, scale: float) -> dict[str, Any]:
    if part_kind(piece.kind).angular:
        return _corner(placed, piece)
    row: dict[str, Any] = {"joint": " ".join(map(str, placed.joints_of(piece)))}
    hardware = placed.design.hardware
    if hardware is not None:
        row = {"arms": sorts_of_arms(piece, hardware)} | row
    names = part_kind(piece.kind).parameter_names
    for side, (parameter, column, value) in enumerate(
        zip(piece.parameters, piece.columns, piece.values), 1
    ):
        row |= {
            f"side_{side}": names[column],
            f"side_{side}_mm": round(value * scale, 4),
        }
        if hardware is None:
            row[f"side_{side}_towards"] = _leads_to(placed, parts, parameter)
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
