"""In which order a design is put together, and what holds it together: steps and fasteners."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

from ..kit.kinds import part_kind
from .assembly import stands_on_edge
from .blanks import Blanks
from .cells import CellParts, sorts_of_arms
from .lamellas import LOWER, UPPER, Lamella, Lamellas
from .pieces import DesignPieces
from .placement import PlacedPieces

_SPARE = 1.0  # diameters of a bolt's shank beyond what it holds: nut and washers
_BOLTS_A_CORNER = 4


def assembly_steps(blanks: Blanks, name: str) -> list[dict[str, Any]]:
    """One row a step, in order: what to do, with which lamella, elements and joints.

    First every lamella is bolted together on a bench, then all lower ones are laid out, then the
    upper ones put on them, joint by joint. Where the two don't separate into families, lamellas
    come in the order of their numbers, each with the joints whose other lamella is there already.
    A design of several states is assembled in the first and opened into the last. Of cells, arms
    and plates are made ready, then every cell is hinged together, then the joints are closed.
    Nothing for other parts.

    Raises InputError for a design that isn't there.
    """
    pieces = blanks.parts.named(name)
    if blanks.cells is not None:
        return [{"step": n} | step for n, step in enumerate(_cell_steps(blanks, pieces), 1)]
    lamellas = Lamellas(PlacedPieces.of(pieces))
    if not lamellas.all:
        return []
    parts = blanks.parts
    steps: list[dict[str, Any]] = []
    for lamella in lamellas.all:
        labels = " ".join(parts.label(piece) for piece in lamella.pieces)
        steps.append(_step("bolt together", lamella, parts=labels))
    there: set[int] = set()
    for lamella in _in_order(lamellas):
        joints = [
            joint
            for joint, pair in sorted(lamellas.crossings.items())
            if {lamellas.place[piece.element][0] for piece in pair} <= there | {lamella.number}
            and lamella.number in {lamellas.place[piece.element][0] for piece in pair}
        ]
        there.add(lamella.number)
        action = "put on, and join" if joints else "lay out"
        steps.append(_step(action, lamella, joints=" ".join(map(str, joints)) or None))
    roles = pieces.design.roles
    if len(roles) > 1:
        steps.append({"action": f"open it into its {roles[0].name} state: joints as listed"})
    return [{"step": number} | step for number, step in enumerate(steps, 1)]


def _cell_steps(blanks: Blanks, pieces: DesignPieces) -> Iterator[dict[str, Any]]:
    """How a design of cells is put together; of every cell, which arms are at its upper and at its
    lower plate, as "2 x C1 top a"."""
    hardware = pieces.design.hardware
    assert hardware is not None
    placed, arms = PlacedPieces.of(pieces), Counter(arm.parameter for arm in hardware.arms)
    yield {"action": "lay up arms: board 2 on board 1, labels up, edges flush"}
    yield {"action": "put an ear into a plate's slot wherever an arm comes, on the inner face"}
    for piece in pieces.pieces:
        names, sort = part_kind(piece.kind).parameter_names, sorts_of_arms(piece, hardware)
        label = blanks.parts.label(piece)
        upper, lower = (
            f"{arms[parameter]} x {label} {names[column]} {sort}"
            for parameter, column in zip(piece.parameters, piece.columns)
        )
        yield {
            "action": "hinge arms to both plates",
            "element": piece.element,
            "upper_plate": upper,
            "lower_plate": lower,
            "joints": " ".join(map(str, placed.joints_of(piece))),
        }
    yield {"action": "at every joint, pin one cell's upper arm and the other's lower one to a beam"}
    yield {"action": "put the axles through both beams of every joint"}
    yield {"action": "open it: draw the plates of every cell together"}


def fasteners(blanks: Blanks) -> list[dict[str, Any]]:
    """One row a sort of fastener: what it is for, diameter, clamped thickness, length, pieces.

    As many as the design with most of them needs, and for every design.
    """
    if blanks.cells is not None:
        return _pins(blanks.cells)
    board, options = blanks.board, blanks.options
    counts = {design.design.name: _counted(design, blanks) for design in blanks.parts.designs}
    rows = []
    clamped = 2 * board.thickness
    for item, diameter in (("joint", options.joint_hole), ("corner", options.bolt_hole)):
        numbers = {name: found[item] for name, found in counts.items()}
        if any(numbers.values()):
            row = {
                "item": f"bolt with nut, {item}s",
                "diameter_mm": diameter,
                "clamps_mm": round(clamped, 2),
                "length_mm": round(clamped + 2 * _SPARE * diameter, 1),
                "pieces": max(numbers.values()),
            }
            rows.append(row | {f"in_{name}": number for name, number in numbers.items()})
    return rows


def _pins(cells: CellParts) -> list[dict[str, Any]]:
    """Pins of cells: one a hinge at a plate, one through each crossing, two lock every beam."""
    t, width = cells.thickness, cells.width
    apart = 2 * abs(cells.scale * cells.hardware[0].arm_position)
    hinges = [len(hardware.arms) for hardware in cells.hardware]
    crossings = [hardware.crossings for hardware in cells.hardware]
    rows = (
        ("hinge pin, plates", cells.pin, width + t, hinges),
        ("axle, crossings", cells.pin, apart + width, crossings),
        ("locking pin, crossings", t / 4, width, [4 * number for number in crossings]),
    )
    names = [pieces.design.name for pieces in cells.parts.designs]
    return [
        {
            "item": item,
            "diameter_mm": diameter,
            "clamps_mm": round(clamped, 2),
            "length_mm": round(clamped + 2 * _SPARE * diameter, 1),
            "pieces": max(numbers),
            **{f"in_{name}": number for name, number in zip(names, numbers)},
        }
        for item, diameter, clamped, numbers in rows
    ]


def _counted(design: DesignPieces, blanks: Blanks) -> dict[str, int]:
    """Bolts of one design, by what they are for; lamellas in slots need none at their joints."""
    placed = PlacedPieces.of(design)
    joints = 0 if stands_on_edge(placed) else len(Lamellas(placed).crossings)
    corners = sum(corner in placed.corners for corner in placed.pieces.by_parameter)
    return {"joint": joints, "corner": _BOLTS_A_CORNER * corners if blanks.corners.bolts else 0}


def _step(action: str, lamella: Lamella, **more: Any) -> dict[str, Any]:
    elements = " ".join(str(piece.element) for piece in lamella.straight)
    return {"action": action, "lamella": lamella.number, "elements": elements} | more


def _in_order(lamellas: Lamellas) -> list[Lamella]:
    """The lower family first, then the upper one; in the order of their numbers within them."""
    if not lamellas.by_family:
        return list(lamellas.all)
    layers = {
        lamella.number: next(
            (lamellas.layer[p.element] for p in lamella.straight if p.element in lamellas.layer),
            LOWER,
        )
        for lamella in lamellas.all
    }
    return sorted(lamellas.all, key=lambda lamella: layers[lamella.number] == UPPER)
