"""The studies of kits, in their quick mode: one folder of reports, so that later studies find the
kits of the first."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from support.quick_studies import data_of, run

FIGURES = {
    "kit_size_tradeoff": ["tradeoff"],
    "part_reuse": ["sharing", "subsets", "sizes", "front"],
    "project_new_design": ["sweep", "changes"],
    "slit_parts": ["slits", "intervals"],
}


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reports")
    for name in FIGURES:
        run(name, folder)
    return folder


@pytest.mark.parametrize("name", FIGURES)
def test_reports_are_whole(reports, name):
    page, data = (reports / name / "index.html").read_text(), data_of(reports, name)
    assert f"<h1>{data['study']}" in page and data["quick"]
    assert page.count("data:image/png;base64") == len(FIGURES[name]) and len(page) < 5e6
    for figure in FIGURES[name]:
        assert (reports / name / f"{figure}.svg").stat().st_size > 1000
        assert (reports / name / f"{figure}.pdf").read_bytes()[:5] == b"%PDF-"
    assert data["finding"].endswith(".") and data["times"]["wall_s"] > 0


def test_smaller_kits_fit_worse(reports):
    kits = data_of(reports, "kit_size_tradeoff")["kits"]
    assert [kit["linear"] for kit in kits] == [2, 3]
    built = [kit for kit in kits if kit["J"] is not None]  # of very few parts not all can be
    assert built[0]["J"] >= built[-1]["J"]
    largest = [np.inf if kit["max %"] is None else kit["max %"] for kit in kits]
    assert largest == sorted(largest, reverse=True)
    assert kits[1]["direct max %"] > kits[1]["max %"] and kits[0]["direct max %"] is None
    assert all(0 < kit["mean %"] < kit["max %"] for kit in built)
    with open(reports / "kit_size_tradeoff" / "kits.csv", encoding="utf-8") as file:
        written = [row["J"] for row in csv.DictReader(file)]
    assert [float(value) for value in written if value not in ("", "–")] == [
        kit["J"] for kit in built
    ]


def test_other_studies_take_the_kits_from_there(reports):
    own = {path.name for path in (reports / "part_reuse" / "sweep").glob("*-*.json")}
    assert len(own) == 2 and all(name.startswith("reuse") for name in own)
    names = ("kit_size_tradeoff", "part_reuse", "project_new_design")
    first, *others = (data_of(reports, name)["times"]["kits_s"] for name in names)
    assert len(first) == 2 and others == [first, first]
    kept = {path.name for path in (reports / "project_new_design" / "sweep").glob("*-*.json")}
    assert len(kept) == 2 and all(name.startswith("w_c") for name in kept)


def test_reuse_agrees_with_the_sizes(reports):
    reuse, sizes = data_of(reports, "part_reuse"), data_of(reports, "kit_size_tradeoff")
    assert [row["kit size %"] for row in reuse["kits"]] == [
        row["kit size %"] for row in sizes["kits"]
    ]
    for details in reuse["details"].values():
        (pair,) = details["subsets"]
        assert pair["reuse"] == details["average_reuse"] == details["jaccard"][0][1]
        # of two multisets of equal size: |A u B| = 2 n - |A n B|
        assert details["kit_size_percent"] == pytest.approx(100 / (1 + pair["reuse"]))


def test_pieces_are_counted_under_both_weights(reports):
    """That a weight saves pieces is tested in tests/search/test_reuse.py: here hardly any steps are
    taken."""
    rows = data_of(reports, "part_reuse")["weights"]
    assert len(rows) == 2
    for row in rows:
        assert 0 < row["pieces"] < 400 and row["J"] > 0


def test_a_new_design_is_built_better_after_exchanges(reports):
    """Relaxation alone may lead to parts that are no better than the nearest ones, as the report
    says; exchanges from there make up for it."""
    rows = data_of(reports, "project_new_design")["weights"]
    for row in rows:
        most = 1 + 1e-9  # the same state, found twice
        assert row["reassigned J"] <= min(row["built J"], row["direct J"]) * most
    # elements that may still move come nearer to the target than parts do, at every weight
    assert all(row["relaxed max %"] < row["direct max %"] for row in rows)


def test_slits_help_and_more_parts_need_shorter_ones(reports):
    cases = {(row["parts"], row["cost"]): row for row in data_of(reports, "slit_parts")["cases"]}
    for parts in (2, 4):
        plain, slit = cases[parts, None], cases[parts, 0.01]
        assert (
            slit["projection energy"] < 0.1 * plain["projection energy"]
            and slit["max %"] < plain["max %"]
        )
        assert plain["longest slit %"] == 0
    assert cases[4, 0.01]["mean slit %"] < cases[2, 0.01]["mean slit %"]
    searched = {(r["kind"], r["parts"]): r for r in data_of(reports, "slit_parts")["optimised"]}
    slit, plain = searched["slit", 3], searched["linear", 3]
    assert slit["J"] < plain["J"] == slit["J, plain, as many parts"]
    assert 0 < slit["of it slits"] < slit["J"] and slit["outside %"] < 1e-6
    assert plain["longest slit %"] == 0 == plain["of it slits"]


def test_a_resumed_study_computes_nothing_again(reports):
    before = data_of(reports, "slit_parts")
    kept = {path: path.stat().st_mtime_ns for path in (reports / "slit_parts" / "sweep").iterdir()}
    run("slit_parts", reports, "--resume")
    assert {
        path: path.stat().st_mtime_ns for path in (reports / "slit_parts" / "sweep").iterdir()
    } == kept
    assert data_of(reports, "slit_parts")["cases"] == before["cases"]
