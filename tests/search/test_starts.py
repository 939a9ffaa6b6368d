"""Several starts of the assigned stage: none is worse than that of the relaxed stage alone."""

import numpy as np
import pytest
from support.settings import FEW_ERRORS
from support.zigzags import zigzags

from kop_exudyn.errors import InputError
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import EFFORTS, JobSettings, StageSettings

PARTS = {"linear": 2, "angular": 2}


def found(effort):
    stages = StageSettings(
        schedule=(1e3, 1e5),
        path_steps=4,
        leaps=0,
        redeployments=0,
        levelling=0,
        effort=effort,
        requirements=FEW_ERRORS,
    )
    return optimize_kit(
        zigzags(), PARTS, settings=JobSettings(jobs=1, stages=stages, baselines=False)
    )


@pytest.fixture(scope="module")
def results():
    return {effort: found(effort) for effort in ("quick", "normal")}


def test_more_effort_is_never_worse_and_says_what_was_tried(results):
    quick, normal = (results[effort] for effort in ("quick", "normal"))
    assert [start.origin for start in quick.tried] == ["relaxed"] and quick.tried[0].kept
    assert len(normal.tried) > EFFORTS["normal"].optimised
    ends = [start.optimised for start in normal.tried if start.optimised is not None]
    assert 1 <= len(ends) <= EFFORTS["normal"].optimised
    (kept,) = [start for start in normal.tried if start.kept]
    assert kept.optimised == min(ends)
    built = sorted(start.built for start in normal.tried if start.built is not None)
    optimised = sorted(start.built for start in normal.tried if start.optimised is not None)
    assert optimised == built[: len(optimised)] and optimised[-1] <= 3.0 * built[0]
    assert normal.to_dict()["tried"][0]["origin"] == "relaxed"


def test_starts_under_the_model_are_good_ones(results):
    """Before anything is optimised, the best of them is better than the relaxed designs' parts."""
    tried = results["normal"].tried
    model = [start.built for start in tried if start.origin == "model" and start.built is not None]
    assert min(model) < tried[0].built


def test_the_same_again_is_the_same(results):
    again = found("normal")
    np.testing.assert_array_equal(again.kit.vector, results["normal"].kit.vector)
    assert again.tried == results["normal"].tried


def test_unknown_efforts_are_refused():
    with pytest.raises(
        InputError, match="effort = 'much': unknown .*known: quick, normal, thorough"
    ):
        StageSettings(effort="much")
