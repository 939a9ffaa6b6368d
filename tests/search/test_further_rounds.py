"""Reassignments in secured stages: from where steps can't go on, and never to what is lost by."""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from support.settings import FEW_ERRORS
from support.shells import stages_of_two

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.search import assigned, demands, forgiving, levelling, run
from kop_exudyn.search.assigned import further_rounds
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.evaluation import distance
from kop_exudyn.search.levelling import level, worst
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.reassign import keep_parts
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stages import Stages

SETTINGS = StageSettings(assigned_steps=3, round_steps=6, requirements=FEW_ERRORS)


@pytest.fixture(scope="module")
def found(repository):
    """Secured stages of two small shells, a kit after a few steps, and further rounds from there
    with what steps they took."""
    steps = []
    with stages_of_two(repository, SETTINGS, steps.append) as stages:
        secured = demands.secured(stages, forgiving=True)
        start = secured.assigned(secured.kept(secured.direct()))
        steps.clear()
        after = further_rounds(secured, start, count(7))
        yield stages, secured, start, after, list(steps)


@pytest.fixture(scope="module")
def levelled(found):
    """After levelling without rounds, which are for deviations that are felt more, and which rounds
    were made all the same."""
    stages, _, _, after, _ = found
    tried = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(levelling, "_FELT", 1e3)
        patch.setattr(levelling, "further_rounds", lambda *asked: tried.append(asked) or asked[1])
        return level(stages, after, count(1)), tried


def test_they_go_on_with_other_parts(found):
    _, _, start, after, steps = found
    assert after.merit < 0.98 * start.merit
    assert after.assignment.changes(start.assignment) > 0
    assert {event.round for event in steps} == set(range(7, 7 + len({e.round for e in steps})))
    assert after.steps == start.steps + len(steps)


def test_what_is_required_stays_met_on_the_way(found):
    stages, _, _, after, _ = found
    assert stages.snapping(after) == ()
    for shell, reference, built in zip(
        stages.dataset.designs, stages.dataset.references, after.designs
    ):
        assert built.way
        objective = DesignObjective(shell, stages.dataset.weights, reference, stages.required)
        assert distance(objective.design, objective.redeploy(built.q), built) < 1e-3


def test_a_design_that_is_lost_stays_as_it_was(found, monkeypatch):
    """Of a trial with the same parts the others are kept; one with other parts is given up."""
    _, secured, start, _, _ = found
    derivatives = secured.dataset.derivatives(start.evaluations, hessian=True)
    trials = [
        trial[0]
        for damping in (1.0, 0.1, 0.01)
        if (trial := assigned._trial(secured, start, derivatives, damping, (), keep_parts))
    ]
    both, whole = next(
        (trial, whole)
        for trial in sorted(trials, key=lambda trial: trial.merit)
        if (whole := assigned._kept(secured, start, trial)) is not None
        and all(
            new.value < old.value and not np.array_equal(new.q, old.q)
            for new, old in zip(whole.designs, start.designs)
        )
    )
    monkeypatch.setattr(
        Stages, "snapping", lambda self, result, members=None: (1,) if 1 in members else ()
    )
    part = assigned._kept(secured, start, both)
    assert whole.merit < part.merit < start.merit
    assert np.array_equal(part.designs[1].q, start.designs[1].q)
    assert np.array_equal(part.designs[0].q, both.designs[0].q)
    moved = replace(both, kit=replace_parts(both.kit))
    assert assigned._kept(secured, start, moved) is None


def replace_parts(kit):
    return replace(kit, parts={name: rows * 1.001 for name, rows in kit.parts.items()})


def test_steps_that_can_go_no_further_are_followed_by_rounds(found, monkeypatch):
    stages, _, start, after, _ = found
    calls = []

    def rounds(secured, result, numbers):
        calls.append(result.blocked)
        return after

    monkeypatch.setattr(forgiving, "further_rounds", rounds)
    free = forgiving.secured_steps(stages, start, count(20), forgiving=True)
    assert calls == [] and free.merit < start.merit
    completed = Dataset.completed

    def wall(self, evaluations, previous):
        """No step may bring more than a little."""
        if self.value(evaluations) < 0.999 * start.value:
            raise SimulationFailure("here is a wall")
        return completed(self, evaluations, previous)

    monkeypatch.setattr(Dataset, "completed", wall)
    won = forgiving.secured_steps(stages, start, count(30), forgiving=True)
    assert calls and all(calls) and won.merit == after.merit


def test_levelling_tries_other_parts_where_a_deviation_is_felt(found, levelled, monkeypatch):
    stages, _, _, after, _ = found
    assert levelled[1] == []
    tried = []

    def rounds(levelled, result, numbers, label, seen, optimised=True):
        tried.append(label(next(numbers)).name)  # what rounds bring is tested above
        return result

    monkeypatch.setattr(levelling, "further_rounds", rounds)
    monkeypatch.setattr(levelling, "_FELT", 1.0)
    assert worst(after.designs) > 100 * SETTINGS.levelling
    found_level = level(stages, after, count(1))
    assert tried and tried[0] in ("assigned-levelled-2", "assigned-levelled-3")
    assert worst(found_level.designs) <= worst(after.designs)


def test_levelled_results_are_proved_with_more_errors(found, levelled, monkeypatch):
    """Of results on the way the best one that forgives these is taken, and none that doesn't."""
    stages, _, _, after, _ = found
    proving = demands.proving(stages)
    assert proving.required.samples == 4 * stages.required.samples
    assert proving.required.margin < stages.required.margin
    assert proving.required.seed != stages.required.seed
    better, _ = levelled
    assert better is not after and worst(better.designs) < worst(after.designs)
    asked, sure = [], [0]

    def snapping(self, result, members=None):
        """Design 0 of what is found, in the larger errors that prove it, and as `sure` says in as
        many of the workshop's own as have the last word."""
        asked.append((self.required.samples, self.required.margin))
        if self.required.seed == stages.required.seed or same_elements(result, after):
            return ()
        return (0,) if self.required.margin > 1 else tuple(sure)

    monkeypatch.setattr(Stages, "snapping", snapping)
    monkeypatch.setattr(levelling, "made_otherwise", lambda stages, result, lost: (result, lost))
    unproved = level(stages, after, count(1))
    assert (proving.required.samples, proving.required.margin) in asked and sure_of(stages) in asked
    placed = worst(stages.confirmed(after).designs)
    assert worst(unproved.designs) > (1 - 1e-6) * placed and unproved.snapping == ()
    assert worst(better.designs) < 0.99 * placed
    # where a design can be made of the same parts otherwise, that is taken
    mended = []

    def otherwise(stages, result, lost):
        mended.append(list(lost))
        sure.clear()
        return result, ()

    monkeypatch.setattr(levelling, "made_otherwise", otherwise)
    won = level(stages, after, count(1))
    assert mended == [[0]] and won.snapping == ()
    assert worst(won.designs) <= worst(better.designs)
    # and one set of the larger errors alone doesn't cost a design its shape
    won = level(stages, after, count(1))
    assert len(mended) == 1 and worst(won.designs) <= worst(better.designs)


def sure_of(stages):
    return 10 * stages.required.samples, 1.0


def same_elements(one, other):
    return all(np.array_equal(a.q, b.q) for a, b in zip(one.designs, other.designs))


def test_a_kit_that_snaps_in_more_sets_is_made_otherwise(found, monkeypatch):
    stages, _, _, after, _ = found
    mended = forgiving.proven(stages, after)
    assert mended.merit <= 1.5 * after.merit
    asked = []

    def otherwise(stages, result, lost, dear):
        asked.append((stages.required.seed, tuple(lost)))
        return result, tuple(lost)

    monkeypatch.setattr(forgiving, "made_otherwise", otherwise)
    monkeypatch.setattr(Stages, "snapping", lambda self, result, members=None: (1,))
    assert forgiving.proven(stages, after) is after
    assert asked == [(stages.required.seed, (1,))]
    # one that snapped already is tried again, with the others
    known = replace(after, snapping=(1,))
    assert forgiving.proven(stages, known) is known and len(asked) == 2
    monkeypatch.setattr(Stages, "snapping", lambda self, result, members=None: ())
    assert forgiving.proven(stages, after) is after and len(asked) == 2
    assert forgiving.proven(stages, known).snapping == ()


def test_a_result_is_proved_and_then_levelled(found, monkeypatch):
    """And proved once more where a design snapped."""
    stages, _, start, after, _ = found
    calls = []

    def levelled(stages, result, numbers):
        calls.append(("level", result))
        return result

    def proven(stages, result):
        calls.append(("proven", result))
        return after if result is start else replace(result, snapping=())

    monkeypatch.setattr(run, "level", levelled)
    monkeypatch.setattr(run, "proven", proven)
    assert run._levelled(stages, start, count(1)) is after
    assert calls == [("proven", start), ("level", after)]
    after.snapping = (0,)
    try:
        assert run._levelled(stages, start, count(1)).snapping == ()
    finally:
        after.snapping = ()
    assert [what for what, _ in calls[2:]] == ["proven", "level", "proven"]


def test_a_baseline_that_meets_all_and_is_nearer_is_taken(found, monkeypatch):
    stages, _, start, after, _ = found
    monkeypatch.setattr(run, "_own_level", lambda stages, result, numbers: result)
    assert worst(after.designs) < worst(start.designs)
    monkeypatch.setattr(Stages, "snapping", lambda self, result, members=None: ())
    taken = run._levelled(stages, start, count(1), [after])
    assert worst(taken.designs) == pytest.approx(worst(stages.confirmed(after).designs), rel=1e-6)
    np.testing.assert_array_equal(taken.kit.vector, after.kit.vector)
    assert taken.steps == start.steps
    assert run._levelled(stages, after, count(1), [start]) is after
    # one that snaps where the result doesn't, and can't be made otherwise, is no rival
    monkeypatch.setattr(Stages, "snapping", lambda self, result, members=None: (0,))
    monkeypatch.setattr(levelling, "made_otherwise", lambda stages, result, lost: (result, lost))
    assert run._levelled(stages, start, count(1), [after]) is start
