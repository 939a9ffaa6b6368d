"""Parts with slits: strips whose bolts slide, and that never meet at a corner."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.fabrication.blanks import Blanks, least_side
from kop_exudyn.fabrication.cutlist import cut_list
from kop_exudyn.fabrication.limits import part_bounds, usual_options
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.fabrication.shapes import Hole, Polyline
from kop_exudyn.fabrication.templates import templates
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.parts import Kit
from kop_exudyn.structures.serving import served_by


@pytest.fixture(scope="module")
def built(repository):
    designs = load_designs(repository / "models" / "small", 1)
    (design,) = served_by(designs, ("slit", "angular"))
    found = cluster(design.groups, design.parameters, {"slit": 3, "angular": 2})
    return design, found


def blanks_of(built, slit: float, longer: float = 0.0) -> Blanks:
    """What is cut of a kit whose slits are so long (mm), and sides by so much longer."""
    design, found = built
    sides = np.clip(found.kit["slit"], 0.04, None) + 1e-3 * longer
    sides[:, 2] = 1e-3 * slit * np.array([1.0, 0.5, 0.0])
    kit = Kit({**found.kit.parts, "slit": sides})
    q = found.assignment.realise(kit, design.parameters)
    return Blanks(parts_list(kit, found.assignment, [design], [q]), "m", usual_options([design]))


def test_strips_are_sawn_off_by_as_much_as_the_longest_slit(built):
    plain, slit = (blanks_of(built, length) for length in (0.0, 6.0))
    assert slit.corners.setback == pytest.approx(plain.corners.setback + 6.0)
    for a, b in zip(plain.strips, slit.strips):
        # built in as short as it can be, a strip ends before its corner as plain ones do
        shortest = b.hole_from_end + plain.corners.setback
        assert shortest <= b.sides[0] - b.slide + 1e-9
        assert b.sides[0] == pytest.approx(a.sides[0] + b.slide)
        # and as long as it can be, its bolts are still on it
        assert min(b.bolt_stations) >= 1.5 * b.bolt_hole - 1e-9


def test_bolts_find_their_place_wherever_a_strip_slides(built):
    blanks = blanks_of(built, 6.0)
    strips = {strip.label: strip for strip in blanks.strips}
    for template in templates(blanks):
        if template.label not in strips:
            continue
        strip = strips[template.label]
        inner = [s for s in template.shapes[1:] if isinstance(s, Polyline) and s.closed]
        round_holes = [s for s in template.shapes if isinstance(s, Hole)]
        if not strip.slide:
            assert not inner and len(round_holes) >= 5
            continue
        spans = [(s.box[0, 0], s.box[1, 0]) for s in inner]
        radius = strip.bolt_hole / 2
        # side 1 at its longest, between, and at its shortest
        for short in (0.0, 0.4 * strip.slide, strip.slide):
            for at in strip.bolts:
                place = at - strip.setback + short
                assert any(a <= place - radius + 1e-9 and place + radius <= b + 1e-9
                           for a, b in spans)  # fmt: skip
        ordered = sorted(spans)
        for (_, end), (start, _) in zip(ordered, ordered[1:]):
            assert start - end > 0.9 * strip.bolt_hole, "two slots leave something between them"


def test_a_side_has_room_for_holes_beside_the_longest_slit(built):
    design, _ = built
    plain = blanks_of(built, 0.0)
    joint = plain.options.joint_hole
    least = least_side(plain.board.breadth, float(plain._angles.max()), joint, plain.options)
    assert part_bounds([design])["slit"][0][0] > 0
    shortest = plain._sides.min()
    for slit, possible in ((shortest - least - 0.1, True), (shortest - least + 0.5, False)):
        assert (blanks_of(built, slit).problems == ()) is possible


def test_lengths_in_the_cut_list_are_those_that_holes_go_by(built):
    """l1 and l2 were the shortest that a slit part realises, and the text said the longest."""
    blanks = blanks_of(built, 6.0)
    rows = {row["part"]: row for row in cut_list(blanks)}
    for strip in blanks.strips:
        row = rows[strip.label]
        kit = 1e3 * blanks.parts.kit["slit"][int(strip.label[1:]) - 1]
        assert row["l1_mm"] == pytest.approx(kit[0] + kit[2], abs=1e-3)
        assert row["l1_mm"] - row["setback_mm"] == pytest.approx(row["hole_from_end_mm"], abs=2e-3)
        both = row["l1_mm"] + row["l2_mm"] - 2 * row["setback_mm"]
        assert row["cut_length_mm"] == pytest.approx(both, abs=3e-3)
