"""Straight pieces come from sheets or from bars, whichever is large enough."""

import pypdf
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutsheets import cut_sheets, template_sheets
from kop_exudyn.fabrication.folder import export_workshop
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.readiness import obstacles
from kop_exudyn.fabrication.sources import sources
from kop_exudyn.fabrication.stock import stock_plan
from kop_exudyn.search.result import KitResult

SMALL = (500.0, 400.0)  # a sheet for corner plates only


def judged(shells):
    """A result that nothing is wrong with."""
    verdict = {"verdict": "", "stops": []}
    return KitResult(shells, [], {}, buildable=[verdict] * len(shells))


def laid_out(sheets):
    return {label for sheet in sheets for label in sheet.labels}


def with_(parts, **options):
    return Blanks(parts, "m", CutOptions(**options))


def test_either_will_do(parts):
    blanks = with_(parts)
    assert sources(blanks).sheets and sources(blanks).bars and not sources(blanks).note
    assert stock_plan(blanks) is not None
    assert {strip.label for strip in blanks.strips} < laid_out(cut_sheets(blanks))


def test_strips_too_long_for_sheets_are_sawn_from_bars(shells, parts):
    blanks = with_(parts, sheet=SMALL)
    found = sources(blanks)
    assert (found.sheets, found.bars, found.problem) == (False, True, "")
    assert "are sawn from bars" in found.note and "--sheet" in found.note
    sawn = {label for bar in stock_plan(blanks).bars for label, _ in bar.pieces}
    plates = {plate.label for plate in blanks.plates}
    assert sawn == {strip.label for strip in blanks.strips}
    assert laid_out(cut_sheets(blanks)) == laid_out(template_sheets(blanks)) == plates
    assert obstacles(judged(shells), blanks) == []


def test_the_sheet_that_the_note_names_holds_all(parts):
    note = sources(with_(parts, sheet=SMALL)).note
    size = note.split("--sheet ")[1].split()[0].split(",")
    assert sources(with_(parts, sheet=tuple(map(float, size)))).note == ""


def test_strips_too_long_for_bars_are_cut_from_sheets(shells, parts):
    blanks = with_(parts, stock=(500.0,))
    assert sources(blanks).sheets and "are cut from sheets" in sources(blanks).note
    assert stock_plan(blanks) is None
    assert obstacles(judged(shells), blanks) == []


@pytest.mark.parametrize("stock", [(), (500.0,)])
def test_without_either_the_files_are_refused_once(shells, parts, tmp_path, stock):
    options = CutOptions(sheet=SMALL, stock=stock)
    blanks = Blanks(parts, "m", options)
    (sentence,) = obstacles(judged(shells), blanks)
    assert "--sheet" in sentence and ("--stock" in sentence) == bool(stock)
    with pytest.raises(InputError, match="larger than a sheet"):
        export_workshop(parts, tmp_path / "out", "m", options=options)
    # asked for all the same, there are the sheets that can be had
    export_workshop(parts, tmp_path / "out", "m", options=options, force=True)
    assert laid_out(cut_sheets(blanks, force=True)) == {plate.label for plate in blanks.plates}
    assert (tmp_path / "out" / "cut_sheet_1.dxf").exists()
    assert not (tmp_path / "out" / "bars.csv").exists()


def test_the_cut_list_in_print_says_it(parts, tmp_path):
    export_workshop(parts, tmp_path, "m", options=CutOptions(sheet=SMALL))
    first = pypdf.PdfReader(tmp_path / "workshop.pdf").pages[0].extract_text()
    assert "are sawn from bars" in " ".join(first.split())
