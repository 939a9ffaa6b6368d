"""Designs led to other parts in no more steps than the way asks for."""

import numpy as np
import pytest

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.io.designs import load_design
from kop_exudyn.search.objective import DesignObjective


@pytest.fixture(scope="module")
def objective(repository):
    return DesignObjective(load_design(repository / "models" / "small" / "01_sinh.json"))


def start_and_way(objective):
    start = objective.judge(objective.design.parameters, dict(objective.reference.equilibria))
    way = np.random.default_rng(0).normal(size=len(start.q)) * np.abs(start.q)
    return start, way


def test_short_ways_take_one_step_and_long_ones_all(objective):
    start, way = start_and_way(objective)
    lengths = [
        len(objective.approach(start.q + size * way, start, 5)) for size in (1e-5, 1e-2, 1e-1)
    ]
    assert lengths[0] == 1 and lengths == sorted(lengths) and lengths[-1] == 5


def test_it_ends_where_all_steps_do(objective):
    start, way = start_and_way(objective)
    q = start.q + 1e-4 * way
    few, all_ = (found(q, start, 5) for found in (objective.approach, objective.follow))
    assert len(few) < len(all_) == 5
    assert few[-1].value == pytest.approx(all_[-1].value, rel=1e-6)
    assert np.array_equal(few[-1].q, q)


def test_what_fails_in_few_steps_is_tried_in_all(objective, monkeypatch):
    start, way = start_and_way(objective)
    follow, tried = objective.follow, []

    def failing(q, previous, steps):
        tried.append(steps)
        if steps < 5:
            raise SimulationFailure("too far")
        return follow(q, previous, steps)

    monkeypatch.setattr(objective, "follow", failing)
    assert len(objective.approach(start.q + 1e-5 * way, start, 5)) == 5
    assert tried == [1, 5]
    tried.clear()
    with pytest.raises(SimulationFailure, match="too far"):
        objective.approach(start.q + 1e-5 * way, start, 1)
    assert tried == [1]
