"""Pages of parts for the workshop, on every paper."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from kop_exudyn.drawing.labels import text_extent
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutlist import _mm
from kop_exudyn.fabrication.cutsheets import cut_sheets
from kop_exudyn.fabrication.options import CutOptions, tenths
from kop_exudyn.fabrication.paper import PAPERS, SCALES, Book, Page, _cell, _head
from kop_exudyn.fabrication.part_pages import plate_pages, sheet_pages, stock_pages, strip_pages
from kop_exudyn.fabrication.shapes import CUT, Text
from kop_exudyn.fabrication.stock import Bar, StockPlan
from kop_exudyn.fabrication.templates import strip_template


@pytest.mark.parametrize("paper", PAPERS)
def test_parts_are_drawn_as_large_as_the_paper_allows(paper, parts):
    """Strips go across the page, or at the next handy scale would no longer; and every one is on
    a page. On A4 nothing was left for them once."""
    blanks, book = Blanks(parts, "m"), Book(paper, "kit")
    strip_pages(book, blanks)
    room = Page(paper, "").room
    longest = max(strip.cut_length for strip in blanks.strips)
    scale = book.pages[0].scale
    larger = max((s for s in SCALES if s < scale), default=1.0)
    assert longest / scale <= room[0] < longest / larger + 10.0 + 1e-9
    texts = [text.get_text() for page in book.pages for text in page.ax.texts]
    assert {strip.label for strip in blanks.strips} <= set(texts)
    for page in book.pages:
        for text in page.ax.texts:
            assert page.low[1] - 1e-6 <= text.get_position()[1] <= page.high[1] + 1e-6
    book = Book(paper, "kit")
    plate_pages(book, blanks)
    size = np.max([2 * plate.leg for plate in blanks.plates])
    assert size / book.pages[0].scale > 20.0  # mm of the paper


def texts(book):
    return [text.get_text() for page in book.pages for text in page.ax.texts]


def test_bars_that_are_alike_are_drawn_once(parts):
    blanks, book = Blanks(parts, "m", CutOptions(stock=(2400.0,))), Book("a4", "kit")
    plan = StockPlan(
        (Bar(9.0, (("L1", 4.0),), 5.0),) * 20 + (Bar(9.0, (("L2", 8.0),), 1.0),), 189.0
    )
    stock_pages(book, blanks, plan)
    told = texts(book)
    assert (
        "1–20" in told
        and "of 9, 20 alike, left 5" in told
        and "21" in told
        and len(book.pages) == 1
    )
    assert told.count("L1") == told.count("4.0") == 1


def test_bars_of_several_lengths_are_told_apart(parts):
    """Nothing on the page said once how long a bar is: which ones to buy could not be read."""
    blanks, book = Blanks(parts, "m"), Book("a3", "kit")
    bars = (Bar(50.0, (("L1", 40.0),), 10.0), *(Bar(20.0, (("L2", 15.0),), 5.0),) * 3)
    stock_pages(book, blanks, StockPlan(bars, 90.0))
    told = texts(book)
    assert any("4 bars: 1 of 50 mm, 3 of 20 mm; 0.11 m in all" in text for text in told)
    assert "of 50, left 10" in told and "of 20, 3 alike, left 5" in told


@pytest.mark.parametrize("number", [3, 12, 40])
def test_lengths_of_pieces_without_room_stand_below(parts, number):
    """Apart from each other and on the page; those with room for it keep theirs."""
    blanks, book = Blanks(parts, "m"), Book("a4", "kit")
    pieces = (("L1", 900.0), *((f"L{k + 2}", 5.0 + 0.3 * k) for k in range(number)))
    stock_pages(book, blanks, StockPlan((Bar(2400.0, pieces, 0.0),) * 2, 4800.0))
    (page,) = book.pages
    assert "L1  900.0" in texts(book)
    below = [text for text in page.ax.texts if text.get_size() == 5.5]
    # with their labels, for which there is no room either
    assert [t.get_text() for t in below] == [f"{label}  {x:.1f}" for label, x in pieces[1:]]
    figure = page.finish()
    FigureCanvasAgg(figure)
    boxes = [text.get_window_extent() for text in below]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    left, right = page.ax.transData.transform([[page.low[0], 0.0], [page.high[0], 0.0]])[:, 0]
    assert all(left - 1 <= box.x0 and box.x1 <= right + 1 for box in boxes)


def test_what_is_under_a_bar_stays_on_its_page(parts):
    blanks, book = Blanks(parts, "m"), Book("a4", "kit")
    pieces = tuple((f"L{k}", 5.0 + 0.1 * k) for k in range(60))
    bars = tuple(Bar(2400.0 - k, pieces, 0.0) for k in range(30))
    stock_pages(book, blanks, StockPlan(bars, 4800.0))
    assert len(book.pages) > 1
    for page in book.pages:
        for text in page.ax.texts:
            assert page.low[1] - 1e-6 <= text.get_position()[1] <= page.high[1] + 1e-6


def test_what_is_rounded_to_nothing_has_no_sign():
    assert [_cell("x_mm", x) for x in (-0.04, 0.0, -0.06)] == ["0.0", "0.0", "-0.1"]


def test_sheets_that_are_alike_are_on_one_page(parts):
    sheets = cut_sheets(Blanks(parts, "m"))
    first, last = (replace(sheets[0], title=f"cut sheet {n} of 3") for n in (1, 2))
    shapes = list(sheets[0].shapes)
    del shapes[next(k for k, shape in enumerate(shapes) if shape.layer == CUT)]
    other = replace(sheets[0], shapes=tuple(shapes), title="cut sheet 3 of 3")
    book = Book("a4", "kit")
    sheet_pages(book, [first, last, other])
    headings = [page.heading for page in book.pages]
    assert len(headings) == 2
    assert headings[0].startswith("Cut sheets 1 to 2 of 3, alike, ")
    assert headings[1].startswith("Cut sheet 3 of 3, ")


def test_plates_can_be_laid_out_by_a_square(parts):
    blanks, book = Blanks(parts, "m"), Book("a3", "kit")
    plate_pages(book, blanks)
    for plate in blanks.plates:
        aside = abs(plate.leg * np.sin(plate.angle))
        assert f"second axis ends {tenths(aside)} mm off the first" in texts(book)


@pytest.mark.parametrize("paper", PAPERS)
def test_what_is_said_of_plates_neither_overlaps_nor_leaves_the_page(parts, paper):
    """Short plates had their captions over each other, and beyond the page's frame."""
    book = Book(paper, "kit")
    plate_pages(book, Blanks(parts, "m"))
    for page in book.pages:
        boxes = []
        for text in page.ax.texts:
            width, height = text_extent(text.get_text(), text.get_size(), text.get_weight())
            x, y = text.get_position()
            x -= width / 2 if text.get_ha() == "center" else 0.0
            y -= height if text.get_va() == "top" else height / 2
            boxes.append((x, y, x + width, y + height))
        boxes = np.array(boxes)
        assert (boxes[:, :2] >= page.low - 1.0).all() and (boxes[:, 2:] <= page.high + 1.0).all()
        apart = (boxes[:, None, :2] >= boxes[None, :, 2:]).any(axis=2)
        assert (apart | apart.T | np.eye(len(boxes), dtype=bool)).all()


def test_a_length_has_the_same_digits_wherever_it_is_printed():
    """152.6498 was 152.7 in the list, which rounds from thousandths, and 152.6 on the drawing."""
    for length in (152.6498, 152.6500001, 152.65, 0.0501, 99.95):
        assert tenths(length) == _cell("cut_length_mm", _mm(length))
    assert _cell("diameter_mm", 0.75) == "0.75"  # a drill of 0.8 would be another one
    assert _cell("joint_hole_mm", 6.0) == "6"
    assert _head("area_m2") == "area\n[m²]"


def test_names_on_strips_keep_off_their_joint_holes(parts):
    for hole in (4.0, 9.0):
        for strip in Blanks(parts, "m", CutOptions(joint_hole=hole, corners=False)).strips:
            half = strip.board.breadth / 2
            (label,) = (
                shape
                for shape in strip_template(strip).shapes
                if isinstance(shape, Text) and shape.text == strip.label
            )
            top, bottom = label.at[1] + label.height / 2, label.at[1] - label.height / 2
            assert -half < bottom and top < -strip.hole / 2


def test_notes_are_as_wide_as_their_page():
    """One of a kit of cells ran through the frame of an A4 page, and off the paper."""
    for paper in ("a4", "a3"):
        page = Page(paper, "")
        height = page.note("word " * 150 + "\nanother paragraph")
        (text,) = page.ax.texts
        lines = text.get_text().split("\n")
        assert len(lines) > 2 and lines[-1] == "another paragraph"
        assert max(text_extent(line, 7.5)[0] for line in lines) <= page.room[0]
        assert height >= text_extent("\n".join(lines), 7.5)[1]
