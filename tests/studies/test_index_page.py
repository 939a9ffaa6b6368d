"""The page of all reports."""

import json

import pytest
from matplotlib.figure import Figure

from kop_exudyn.drawing.style import figure_bytes
from kop_exudyn.errors import InputError
from kop_exudyn.report.page import Page
from lib.index_page import Chapter, first_sentence, write_index


def report(folder, title, lead="A lead.", data=None, suffix="png"):
    folder.mkdir()
    figure = Figure(figsize=(4, 3))
    figure.subplots().plot([1, 2])
    Page(title, lead).figure(figure_bytes(figure, suffix), "c", alt="a", suffix=suffix).save(
        folder / "index.html"
    )
    if data is not None:
        (folder / "data.json").write_text(json.dumps(data))


def test_every_report_is_listed_with_its_finding_and_picture(tmp_path):
    report(tmp_path / "b", "Second & last", data={"finding": "Half as many <parts>."})
    report(tmp_path / "a", "First", lead="What was found.", suffix="svg")
    (tmp_path / "runs").mkdir()
    page = write_index(tmp_path, "All", "Lead.").read_text()
    assert page.index('href="a/index.html"') < page.index('href="b/index.html"')
    assert (
        "Second &amp; last" in page
        and "Half as many &lt;parts&gt;." in page
        and "What was found." in page
    )
    assert page.count("<img") == 2 and "data:image/svg+xml" in page and 'href="runs' not in page
    assert len(page) < 200_000


def test_a_folder_without_reports_is_an_error(tmp_path):
    with pytest.raises(InputError, match="no reports"):
        write_index(tmp_path, "All", "Lead.")


def test_the_story_comes_first_in_its_order(tmp_path):
    """Headlines instead of titles, one sentence each; reports that aren't there are left out; those
    of unknown commits come last, also where the story names them."""
    for name in ("a", "b", "c", "old"):
        made = {} if name == "old" else {"environment": {"commit": "abc", "date": "2026-01-02"}}
        finding = {"finding": f"First of {name}. Second."}
        report(tmp_path / name, f"Title {name}", data=finding | made)
    story = tuple(Chapter(name, f"Gain {name}") for name in ("c", "missing", "a", "old"))
    page = write_index(tmp_path, "All", "Lead.", story).read_text()
    told = ("Gain c", "First of c.", "2026-01-02, commit abc", "Gain a", "More of", "Title b")
    order = [page.index(text) for text in (*told, "earlier versions", "Title old")]
    assert order == sorted(order) and "Title c" not in page and "Gain missing" not in page
    assert "Second" not in page


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("Of 15 designs 1.4 % are off. The rest", "Of 15 designs 1.4 % are off."),
        ("One only", "One only."),
        ("", ""),
    ],
)
def test_a_sentence_ends_at_its_full_stop(text, first):
    assert first_sentence(text) == first
