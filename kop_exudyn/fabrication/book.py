"""The workshop's book: everything that is printed for a kit, page by page."""

from __future__ import annotations

from collections.abc import Sequence

from ..kit.kinds import part_kind
from .assembly import joint_places, joint_table
from .assembly_drawing import AssemblyDrawing
from .assembly_order import assembly_steps, fasteners
from .assembly_pages import assembly_pages
from .blanks import Blanks
from .cutlist import cut_list, material
from .cutsheets import Sheet
from .options import UNFIT, Tolerances, tenths, unfit
from .paper import Book
from .part_pages import cell_pages, plate_pages, sheet_pages, stock_pages, strip_pages
from .sources import advice
from .stock import StockPlan

# of cut lists, what stands in the note above or on the parts' own pages
_ELSEWHERE = (
    "tolerance_mm",
    "tolerance_deg",
    "section_mm",
    "material",
    "bolts_from_end_mm",
    "bolts_from_corner_mm",
    "setback_mm",
    "leg_mm",
    "bolt_hole_mm",
)
_ENDS = (
    "Of a lamella's first and last piece one side is used. The other one stands out beyond the "
    "last joint and carries nothing: it may be sawn off behind the joint where it is in the way "
    "and no other design needs the whole piece."
)

_JOINTS = (
    "Where the joints are in the built state, to set it out and to check it by. Angle: between the "
    "pieces that cross"
)


def workshop_book(
    blanks: Blanks,
    sheets: list[Sheet],
    plan: StockPlan | None,
    drawings: list[AssemblyDrawing],
    *,
    paper: str = "a3",
    title: str = "Kit of parts",
    tolerances: Tolerances = Tolerances(),
    warnings: Sequence[str] = (),
) -> Book:
    """Cut list, parts, bars, sheets, then of every design its steps, joints and drawing.

    paper : "a4" or "a3"
    warnings : what stops the kit from being built, in sentences
    Raises InputError for another paper.
    """
    book = Book(paper, title, f"{UNFIT}, see page 1" if warnings else "")
    rows = cut_list(blanks, tolerances)
    kept = [{name: value for name, value in row.items() if name not in _ELSEWHERE} for row in rows]
    book.table("Cut list", kept, "\n".join([*unfit(warnings), _note(blanks, tolerances)]))
    bought = [*material(blanks, sheets, plan), *fasteners(blanks)]
    book.table("Material and fasteners", bought)
    strip_pages(book, blanks)
    plate_pages(book, blanks)
    cell_pages(book, blanks)
    stock_pages(book, blanks, plan)
    sheet_pages(book, sheets)
    for drawing in drawings:
        if steps := assembly_steps(blanks, drawing.name):
            note = _ENDS if blanks.strips else ""
            book.table(f"Assembly of {drawing.name}: steps", steps, note)
        assembly_pages(book, drawing)
        points = joint_places(blanks.parts, drawing.name)
        joints = joint_table(blanks.parts, drawing.name, blanks.unit, points)
        pair = ", the elements lower and upper." if "lower" in joints[0] else "."
        book.table(f"Joints of {drawing.name}, as it stands", joints, _JOINTS + pair)
    return book


def _note(blanks: Blanks, tolerances: Tolerances) -> str:
    kinds = [part_kind(name) for name in blanks.parts.kit.parts]
    lengths = f"lengths to {tolerances.length:g} mm"
    angles = f", angles to {tolerances.angle:g} degrees" if any(k.angular for k in kinds) else ""
    lines = [
        "Pieces serve the designs one after the other: as many as the neediest uses. "
        f"Keep {lengths}{angles}{f' ({tolerances.why})' if tolerances.why else ''}."
    ]
    if blanks.strips:
        board = blanks.board
        lines.append(
            f"Strips: {board.section} mm {board.material}".rstrip()
            + ". Saw to the cut length; holes are measured from the sawn end of side 1. l1 and l2 "
            "are lengths of the axes from the joint to the corner points, "
            f"{tenths(blanks.corners.setback)} mm beyond either sawn end."
        )
    return "\n".join([*lines, *advice(blanks)])
