"""Pages of parts for the workshop, on every paper."""

import numpy as np
import pytest

from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.paper import PAPERS, SCALES, Book, Page
from kop_exudyn.fabrication.part_pages import plate_pages, strip_pages


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
