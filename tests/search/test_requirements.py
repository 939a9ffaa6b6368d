"""Designs that open by themselves and keep below their limit, in a small search."""

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_design
from kop_exudyn.search import demands
from kop_exudyn.search.dataset import (
    Dataset,
    evaluations_from_arrays,
    evaluations_to_arrays,
)
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.opening import SAME_STATE

PARTS = {"linear": 4, "angular": 2}


@pytest.fixture(scope="module")
def shell(repository):
    return load_design(repository / "models" / "small" / "06_moebius.json")


class Steps:
    """A store that keeps every step's states."""

    def __init__(self):
        self.saved = []

    def load(self, name):
        return None

    def save(self, name, arrays):
        self.saved.append(arrays)


@pytest.fixture(scope="module")
def run(shell):
    """The direct kit, opened, with its parts optimised in steps that keep the design opening; and
    below a limit that it exceeds at first."""
    weights = Weights.suiting([shell])
    with DesignPool([shell]) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, weights)
        plain = Stages(dataset, PARTS, StageSettings(requirements=Requirements()))
        start = demands.secured(plain).kept(plain.direct())
        stressed = max(start.evaluations[0].utilisation.values())
        required = Requirements(safety=1.15 / stressed)
        store = Steps()
        stages = Stages(dataset, PARTS, StageSettings(requirements=required), store)
        start = demands.secured(stages).kept(stages.direct())
        result = demands.secured(stages).assigned(start)
        led = Stages(dataset, PARTS, StageSettings(requirements=required)).assigned(start)
        places = [
            evaluations_from_arrays(
                dataset.requiring(required),
                {k[7:]: v for k, v in arrays.items() if k.startswith("states/")},
            )[0]
            for arrays in store.saved
        ]
    return start, result, places, required, weights, pool.references[0], led


def test_accepted_steps_stay_on_the_branch_that_opens(shell, run):
    """Each accepted step's state is the one that its parts open into from their assembly."""
    start, result, places, required, weights, reference, _ = run
    objective = DesignObjective(shell, weights, reference, required)
    assert len(places) == result.steps >= 3
    for place in places:
        assert len(place.way) == len(shell.way.stations)
        found = objective.redeploy(place.q)
        role = shell.fitted_role.name
        assert shell.way.apart(found.equilibria[role], place.equilibria[role]) <= SAME_STATE


def test_stress_comes_back_below_its_limit_in_every_state(run):
    """As far as the branch goes on which it opens; and all the way where it may be led off it."""
    start, result, places, _, _, _, led = run
    before, secured, free = (
        max(r.evaluations[0].utilisation.values()) for r in (start, result, led)
    )
    assert before == pytest.approx(1.15, rel=1e-3)
    assert secured < 0.95 * before and result.merit < start.merit
    assert free <= 1 + 2e-3 and led.penalty < 0.01 * start.penalty
    assert set(places[-1].utilisation) == {"deployed", "rest"} | {
        state for state in places[-1].utilisation if state.startswith("opened by")
    }


def test_a_bound_that_pushes_has_a_multiplier(run):
    *_, led = run
    assert all(value > 0 for states in led.pressure.values() for value in states.values())
    highest = max(led.evaluations[0].utilisation.values())
    assert highest < 1 - 1e-2 or led.pressure


def test_states_on_the_way_are_restored_exactly(shell, run):
    _, _, places, required, weights, reference, _ = run
    arrays = evaluations_to_arrays(places[-1:])
    with DesignPool([shell]) as pool:
        pool.references = [reference]
        dataset = Dataset.of_pool(pool, weights).requiring(required)
        again = evaluations_from_arrays(dataset, arrays)[0]
    assert again.value == places[-1].value and again.utilisation == places[-1].utilisation
    for a, b in zip(again.way, places[-1].way):
        assert np.array_equal(a.state.positions, b.state.positions)
        assert np.array_equal(a.stress, b.stress)


def test_nothing_is_required_of_baselines(shell, run):
    _, _, places, _, weights, reference, _ = run
    free = DesignObjective(shell, weights, reference, Requirements.none())
    found = free.judge(places[-1].q, dict(places[-1].equilibria))
    assert not found.utilisation and not found.excess and found.value == places[-1].value


@pytest.mark.parametrize(
    "values", [{"safety": 0.0}, {"safety": float("nan")}, {"opening": 1}, {"penalty": -1.0}]
)
def test_wrong_requirements_are_named(values):
    with pytest.raises(InputError) as caught:
        Requirements(**values)
    assert caught.value.field == next(iter(values))
