"""What lies in the workshop's folder, for a reader who has nothing else: every file, and what the
columns of the tables mean."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..files.read_me import read_me_text
from .assembly import stands_on_edge
from .assembly_pages import explanation
from .blanks import Blanks
from .options import unfit
from .placement import PlacedPieces
from .sources import advice

# Beginnings of file names; the first that fits counts.
_FILES = {
    r"workshop\.": "all of it to print: the lists, every part with its dimensions, what it is cut "
    "from, and of every design its steps, drawing and joints. Print at 100 %; pages that are to "
    "scale have a bar to check that by",
    r"cut_list\.": "one line a part: how many to make, and how to cut it",
    r"material\.": "what the parts take, and what to buy for them",
    r"fasteners\.": "bolts or pins, as many as the design with most of them needs",
    r"stock\.": "these pieces as a stock, from which other designs can be sought: kop optimize "
    "DESIGNS --stock stock.csv. Change the counts to what is there",
    r"bars\.": "which piece is sawn from which bar, in order",
    r"bill_": "how many pieces of each part the design of that name needs",
    r"steps_": "in which order that design is put together",
    r"assembly_": "where each piece of that design goes, which way round, and what it meets",
    r"joints_": "where the joints of that design are when it stands",
    r"cut_sheet_\d": "what a machine cuts from a sheet, at true scale in millimetres: layer CUT is "
    "cut through, ENGRAVE marked, NOTES is for people",
    r"templates_\d": "every part once, at true scale, to print and to mark by",
}
# Columns of the tables: the first that fits counts.
_COLUMNS = {
    r"part": "label of a part; pieces of one part are alike",
    r"kind": "linear: a straight piece; angular: a corner; cell: two plates and their arms; slit: "
    "a straight piece with slits for its bolts",
    r"count": "of a stock: how many pieces of the part there are",
    r"unit": "of the lengths beside it, which are not rounded; angles are in radians",
    r"force_unit": "the unit of force of the designs",
    r"l1|l2|top|bottom|angle": "of a stock: the part itself, see the columns of that name with a "
    "unit in the cut list",
    r"slit": "of a stock: by how much longer than l1 and l2 either side may be bolted",
    r"pieces": "how many to make or to buy: enough for any one of the designs",
    r"in_.*": "how many of them the design of that name needs",
    r"angle_deg": "of a corner: by how much the second strip turns against the first; of a joint: "
    "between the pieces that cross, in degrees",
    r"tolerance_(mm|deg)": "how exactly to cut",
    r"leg_mm": "how far a corner plate reaches along either strip, from the corner point",
    r"bolts_from_corner_mm": "middles of a corner plate's holes, along either strip from the "
    "corner point",
    r"(bolt|joint)_hole_mm": "diameter of the holes",
    r"cut_length_mm": "of a straight piece, from sawn end to sawn end",
    r"hole_from_end_mm": "middle of the joint's hole or slot, from the sawn end of side 1",
    r"bolts_from_end_mm": "middles of the holes for corner plates, from the sawn end of side 1",
    r"section_mm": "breadth by thickness, or the thickness of a sheet",
    r"material": "as the designs name it",
    r"slot_(width|depth)_mm": "of the slot in which a crossing piece sits",
    r"setback_mm": "by how much either sawn end stands back from the corner point",
    r"(l1|l2)_mm": "lengths of the axis from the joint to the corner points of sides 1 and 2; "
    "where the part has slits, the longest ones",
    r"slit_mm": "by how much shorter either side may be bolted",
    r"(top|bottom)_mm": "lengths of a cell's arms, from pin to pin",
    r"(arms|bars)_.*": "how many arms or bars of that length and sort",
    r"item": "what it is",
    r"(length_m|area_m2)": "of all pieces together, in m or square metres",
    r"diameter_mm": "of a bolt or pin",
    r"clamps_mm": "thickness that it holds together",
    r"length_mm": "of a bolt or pin, with nut and washers",
    r"bar": "number of the bar",
    r"bar_mm": "its length",
    r"(from|to)_mm": "where the piece begins and ends on it",
    r"left_mm": "what is left of it",
    r"step": "number of the step",
    r"action": "what to do",
    r"lamella": "number of the lamella, a row of pieces from end to end: (n) in the drawing",
    r"elements?": "numbers of the pieces in the design: grey in the drawing",
    r"parts": "labels of the lamella's pieces, from one end to the other",
    r"joints?": "numbers of the joints: small and grey in the drawing",
    r"variant": "as is, or how else the part is built in: a mirrored straight piece has its side 2 "
    "first, a mirrored cell has top and bottom changed, a flipped corner bends the other way, see "
    "the assembly drawing",
    r"place": "of the piece along its lamella, from 1",
    r"layer": "lower or upper piece at its joint",
    r"slot": "whether its slot opens up or down",
    r"crosses": "number of the lamella that it crosses",
    r"arms": "sort of the cell's arms: a, both pins on one face; b, on opposite faces",
    r"(upper|lower)_plate": "which arms are hinged to that plate of the cell",
    r"side_[12]": "which of the part's lengths lies first, and second, along the lamella; of a "
    "cell, at its upper and at its lower plate",
    r"side_[12]_mm": "how long that side is along its axis",
    r"side_[12]_towards": "what is at its end",
    r"turn_deg": "of a corner: by how much the lamella turns left there, seen from above, when "
    "walking from before to after; less than 0: right (flipped)",
    r"(before|after)": "elements that meet at the corner",
    r"[xyz]_mm": "the place, in millimetres, as in the design's file",
    r"(lower|upper)": "elements that cross at the joint",
}


_ON_EDGE = {
    r"turn_deg": "of a corner: by how much the lamella, which stands on edge, bends up at its ends "
    "there; less than 0: down (flipped)"
}


def read_me(
    title: str,
    blanks: Blanks,
    placed: Sequence[PlacedPieces],
    files: Sequence[Path],
    warnings: Sequence[str] = (),
) -> str:
    """The text of READ_ME.txt.

    placed : the pieces of every design, as they are drawn
    files : all that lie in the folder
    warnings : what stops the kit from being built, in sentences
    """
    sentences = [*unfit(warnings), "All lengths are in millimetres, angles in degrees."]
    sentences += advice(blanks)
    drawn = dict.fromkeys(explanation(one) for one in placed)
    sentences += [f"In assembly drawings: {' · '.join(text.splitlines())}." for text in drawn]
    columns = _COLUMNS | (_ON_EDGE if any(map(stands_on_edge, placed)) else {})
    return read_me_text(title, sentences, files, _FILES, columns)
