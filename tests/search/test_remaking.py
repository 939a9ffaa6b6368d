"""Designs made of the same parts otherwise: better ones, and those of them that may snap."""

from dataclasses import replace

import numpy as np
import pytest
from support.shells import stages_of_two

from kop_exudyn.search import demands, remaking
from kop_exudyn.search.remaking import made_better, made_otherwise
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stages import Stages

SETTINGS = StageSettings(assigned_steps=2, round_steps=4)


@pytest.fixture(scope="module")
def found(repository):
    """Secured stages of two small shells, their direct projection, and the first one made
    better."""
    with stages_of_two(repository, SETTINGS, lambda event: None) as stages:
        secured = demands.secured(stages, forgiving=True)
        start = secured.kept(secured.direct())
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(remaking, "_BETTER", remaking._BETTER[:8])
            better = made_better(secured, start, [0], 1)
        yield secured, start, better


def test_a_design_gains_and_the_others_stay(found):
    stages, start, better = found
    assert better.designs[0].value < 0.98 * start.designs[0].value
    assert better.designs[1] is start.designs[1]
    np.testing.assert_array_equal(better.kit.vector, start.kit.vector)
    assert better.assignment.changes(start.assignment) > 0
    parts = better.assignment.realise(better.kit, np.concatenate([d.q for d in better.designs]))
    np.testing.assert_array_equal(
        np.split(parts, stages.dataset.offsets[1:-1])[0], better.designs[0].q
    )


def test_what_is_better_opens_and_forgives(found):
    stages, _, better = found
    assert better.designs[0].way and stages.snapping(better, [0]) == ()


def test_the_same_seed_finds_the_same(found, monkeypatch):
    stages, start, better = found
    monkeypatch.setattr(remaking, "_BETTER", remaking._BETTER[:8])
    again = made_better(stages, start, [0], 1)
    assert again.assignment.changes(better.assignment) == 0


def test_what_snaps_is_not_taken(found, monkeypatch):
    stages, start, _ = found
    monkeypatch.setattr(remaking, "_BETTER", remaking._BETTER[:2])
    monkeypatch.setattr(Stages, "snapping", lambda self, result, members=None: tuple(members))
    assert made_better(stages, start, [0], 1) is start
    monkeypatch.setattr(remaking, "_OTHERWISE", (remaking._OTHERWISE[0][:2],))
    result, still = made_otherwise(stages, start, [0])
    assert result is start and still == (0,)


def test_a_dear_way_is_only_taken_where_that_is_allowed(found, monkeypatch):
    """Above half of what a design costs, or of the mean, more."""
    stages, start, _ = found
    monkeypatch.setattr(remaking, "_OTHERWISE", (remaking._OTHERWISE[0][:3],))
    monkeypatch.setattr(Stages, "snapping", lambda self, result, members=None: ())
    share = Stages.share

    def dearer(self, result, n):
        return share(self, start, n) if result is start else 1.9 * share(self, start, n)

    monkeypatch.setattr(Stages, "share", dearer)
    assert made_otherwise(stages, start, [0]) == (start, (0,))
    alone = replace(start, value=10 * start.value)  # of many designs
    result, still = made_otherwise(stages, alone, [0], dear=True)
    assert still == () and result.designs[1] is start.designs[1]


def test_designs_that_snap_already_are_not_asked(found):
    """The others are, by their own numbers, in subsets too."""
    stages, start, _ = found
    but = demands.secured(stages, forgiving=True, but=[0])
    asked = []

    class Pool:
        def __getattr__(self, name):
            return getattr(stages.dataset.pool, name)

        def map(self, method, weights, calls, requirements):
            asked.extend(calls)
            return dict.fromkeys(calls, False)

    dataset = replace(but.dataset, pool=Pool())
    states = dict(enumerate(start.designs))
    assert dataset.snapping(states) == [1] and asked == [1]
    assert dataset.subset([0]).snapping({0: start.designs[0]}) == []
    assert dataset.subset([1]).snapping({0: start.designs[1]}) == [0]
