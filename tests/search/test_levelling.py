"""The last tuning: the largest deviation falls, and what is required stays met."""

from copy import copy
from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from support.shells import stages_of_two

from kop_exudyn.errors import InputError
from kop_exudyn.search import demands, levelling
from kop_exudyn.search.evaluation import distance
from kop_exudyn.search.events import SQPLabel
from kop_exudyn.search.levelling import level, worst
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.weights import Weights

SETTINGS = StageSettings(assigned_steps=8, requirements=Requirements(samples=3))


@pytest.fixture(scope="module")
def found(repository):
    """The stages of two small shells, a kit that opens and forgives, the steps that levelling it
    took, and what came of it."""
    steps = []
    with stages_of_two(repository, SETTINGS, steps.append) as stages:
        before = demands.secured(stages).assigned(demands.secured(stages).kept(stages.direct()))
        assert not stages.snapping(before)
        steps.clear()
        with pytest.MonkeyPatch.context() as patch:  # the rounds after it: test_further_rounds.py
            patch.setattr(levelling, "_FELT", np.inf)
            after = level(stages, before, count(7))
        told = stages.snapping(after)
        yield stages, before, after, steps, told


def test_the_largest_deviation_falls(found):
    """By the last steps alone, which keep the assignment; J, as it was, is above its minimum."""
    _, before, after, steps, _ = found
    assert worst(after.designs) < 0.97 * worst(before.designs)
    assert after.assignment.changes(before.assignment) == 0
    assert after.value > before.value
    assert {event.label for event in steps} == {SQPLabel.of_levelling(7)}
    assert after.steps == before.steps + len(steps)


def test_the_result_is_judged_by_the_weights_asked_for(found):
    stages, _, after, _, _ = found
    for shell, reference, built in zip(
        stages.dataset.designs, stages.dataset.references, after.designs
    ):
        objective = DesignObjective(shell, stages.dataset.weights, reference)
        again = objective.placed(objective.judge(built.q, dict(built.equilibria)))
        assert again.value == pytest.approx(built.value, rel=1e-12)
        assert again.fit.max_percent == pytest.approx(built.fit.max_percent, rel=1e-9)


def test_what_is_required_stays_met(found):
    """Each opens into the state that is reported, none snaps, stress is below its limit."""
    stages, _, after, _, told = found
    assert told == () and after.snapping == ()
    assert after.penalty == 0
    for shell, reference, built in zip(
        stages.dataset.designs, stages.dataset.references, after.designs
    ):
        objective = DesignObjective(shell, stages.dataset.weights, reference, stages.required)
        assert distance(objective.design, objective.redeploy(built.q), built) < 1e-3


def test_where_nothing_may_or_can_move_the_result_stays(found):
    stages, before, _, _, _ = found
    off, fixed = copy(stages), copy(stages)
    off.settings = replace(SETTINGS, levelling=0.0)

    class Given:
        parts_move = False

    fixed.rule = Given()
    assert level(off, before, count(1)) is before and level(fixed, before, count(1)) is before
    failed = replace(before, value=None)
    assert level(stages, failed, count(1)) is failed


def test_levels_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match="levelling = -1"):
        StageSettings(levelling=-1)
    with pytest.raises(InputError, match="level = 0"):
        Weights(level=0.0)
    assert Weights.of(Weights(level=0.01).to_dict()) == Weights(level=0.01)
