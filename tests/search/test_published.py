"""The published method as a baseline in one run with ours."""

from dataclasses import replace

import numpy as np
import pytest
from support.settings import QUICK
from support.zigzags import zigzags

from kop_exudyn.io.results import load_result
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.report.kit_run import optimize_and_report
from kop_exudyn.search.settings import JobSettings

STAGES = replace(
    QUICK,
    schedule=(1e3, 1e5),
    path_steps=4,
    leaps=0,
    redeployments=0,
)
SETTINGS = JobSettings(jobs=1, stages=STAGES, baselines=False, published=True)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("run")
    parts = {"linear": 2, "angular": 2}
    return optimize_and_report(zigzags(), parts, out=out, settings=SETTINGS), out


def test_it_ends_with_nearest_parts_and_no_better(finished):
    result, _ = finished
    published = result.stages["published"]
    assert published.kit.sizes == {"angular": 2, "linear": 2}
    for evaluation in published.evaluations:
        assert evaluation.confirmations
    realised = published.assignment.matrix(published.kit) @ published.kit.vector
    np.testing.assert_array_equal(np.concatenate([e.q for e in published.evaluations]), realised)
    assert result.stages["assigned"].value <= published.value * (1 + 1e-3)
    # quasi-Newton steps are more than Newton's
    assert published.steps > result.stages["relaxed"].steps
    assert result.seconds["published"] > 0 and result.seconds["search"] > 0
    names = {event.sqp for event in result.events}
    assert not any("published" in name for name in names)  # the history is that of our search


def test_results_and_page_tell_of_it(finished):
    result, out = finished
    data = load_result(out / "result.json")
    for n, design in enumerate(data["designs"]):
        assert design["published"]["fit"]["max_percent"] == pytest.approx(
            result.stages["published"].designs[n].fit.max_percent
        )
        assert "published_opened" in design
    assert data["steps"]["published"] == result.stages["published"].steps
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "The published method (BFGS, nearest parts, no reassignment)" in page
    assert "published" in load_run(out, zigzags()).stages
