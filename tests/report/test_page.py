"""The page is one file that shows what it was given and loads nothing."""

import base64
import re
import socket
from html.parser import HTMLParser

import pytest
from matplotlib.figure import Figure

from kop_exudyn.report.environment import environment
from kop_exudyn.report.page import Page, shown

VOID = {"meta", "img", "br"}


class Checker(HTMLParser):
    """Sees that tags are closed in order; collects attributes and text."""

    def __init__(self):
        super().__init__()
        self.open, self.attributes, self.text = [], [], ""

    def handle_starttag(self, tag, attrs):
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def parsed(page: Page) -> Checker:
    checker = Checker()
    checker.feed(page.html())
    assert checker.open == []
    return checker


@pytest.fixture
def page() -> Page:
    figure = Figure(figsize=(1, 1))
    figure.subplots().plot([0, 1])
    page = Page("Kit of 12 parts", "One <kit> & three designs.")
    page.section("Designs", "First.\n\nSecond.")
    page.table(
        ["name", "max %", "stable"], [["a<b", 1.23456, True], ["c", None, False]], "Deviations."
    )
    page.figure(figure, "A line.", alt='a "line"').figure(
        figure, "Again.", alt="pixels", suffix="png"
    )
    return page.details("Settings", {"seed": 0, "note": "</pre>"}).footer("Took 3 s.")


def test_well_formed_and_complete(page):
    text = parsed(page).text
    for piece in (
        "Kit of 12 parts",
        "One <kit> & three designs.",
        "a<b",
        "1.235",
        "–",
        "yes",
        "</pre>",
        "Took 3\xa0s.",
    ):
        assert piece in text


def test_nothing_is_loaded_from_elsewhere(page):
    sources = [value for name, value in parsed(page).attributes if name in ("src", "href")]
    assert len(sources) == 2 and all(value.startswith("data:image/") for value in sources)
    assert not re.search(r"url\(|@import|<script|<link", page.html())
    assert "default-src 'none'" in page.html()


def test_figures_are_embedded_whole(page):
    sources = [value for name, value in parsed(page).attributes if name == "src"]
    first, second = (base64.b64decode(source.partition(",")[2]) for source in sources)
    assert b"</svg>" in first and second.startswith(b"\x89PNG")


def test_saving(page, tmp_path):
    path = page.save(tmp_path / "index.html")
    assert path.read_text(encoding="utf-8") == page.html()


@pytest.mark.parametrize(
    "value, text",
    [
        (None, "–"),
        (True, "yes"),
        (12345, "12,345"),
        (0.000123456, "0.0001235"),
        ("x", "x"),
        (2.0, "2"),
        (12345.6, "12350"),
    ],
)
def test_values(value, text):
    assert shown(value) == text


def test_numbers_stay_beside_their_units():
    """No line's end parts them; words stay apart as they were."""
    text = "within 0.14 % (1.65 mm), max % of 3 samples, 5 MPa, 12 minutes, 7 parts"
    html = Page("Within 3 %", text).html()
    for joined in ("0.14 %", "1.65 mm", "max %", "5 MPa", "3 %"):
        assert joined.replace(" ", "\N{NO-BREAK SPACE}") in html and joined not in html
    for apart in ("% of", "3 samples", "12 minutes", "7 parts"):
        assert apart in html


def test_tables_can_be_folded_away():
    page = Page("x").drawings(["part"], [["A"]], folded="All 3 boards")
    assert "<details><summary>All 3 boards</summary>" in page.html()


def test_environment_says_versions_but_not_whose_machine():
    found = environment()
    assert {"kop_exudyn", "python", "exudyn", "numpy", "cores"} <= set(found)
    assert found["cores"] >= 1
    assert socket.gethostname() not in map(str, found.values())


def test_links_lead_to_files_beside_the_page():
    html = Page("Title").links({"3D & more": "viewer.html"}).html()
    assert '<a href="viewer.html">3D &amp; more</a>' in html
