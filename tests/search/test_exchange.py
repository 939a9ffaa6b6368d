"""Exchanges: one or two elements with other parts, judged with the parts optimised again."""

from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.parts import Assignment, Kit
from kop_exudyn.search import settings as search_settings
from kop_exudyn.search.exchange import _key
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import Effort, JobSettings, StageSettings
from kop_exudyn.search.stage_results import StageResult
from lib.small_kits import strip_of

SEED = 5  # of a strip whose other starts all end in one local minimum


def found(monkeypatch, exchanges):
    effort = Effort(0, 0, 0, 1, exchanges)
    monkeypatch.setitem(search_settings.EFFORTS, "thorough", effort)
    stages = StageSettings(requirements=Requirements.none(), effort="thorough", levelling=0)
    job = JobSettings(jobs=1, stages=stages, baselines=False)
    return optimize_kit([strip_of(SEED)], {"linear": 2}, settings=job)


def test_exchanges_leave_a_minimum_that_leaps_do_not(monkeypatch):
    without, some = (found(monkeypatch, number).stages["assigned"] for number in (0, 24))
    assert some.value < 0.9 * without.value
    assert some.assignment.changes(without.assignment) > 0
    q = some.assignment.matrix(some.kit) @ some.kit.vector
    np.testing.assert_allclose(np.concatenate([e.q for e in some.evaluations]), q, rtol=1e-12)


@pytest.mark.parametrize(
    ("part", "variant", "same"),
    [
        ([0, 1, 0], [0, 1, 1], True),
        ([1, 0, 1], [0, 1, 1], True),  # the parts' numbers
        ([0, 1, 0], [1, 1, 0], True),  # the first part the other way round, everywhere
        ([0, 1, 0], [0, 0, 1], True),
        ([0, 1, 0], [0, 1, 0], False),
        ([0, 1, 1], [0, 1, 1], False),
    ],
)
def test_assignments_that_differ_by_names_only_are_one(part, variant, same):
    group = ElementGroup("linear", np.arange(6).reshape(3, 2))
    kit = Kit({"linear": [[1.0, 2.0], [3.0, 4.0]]})
    first = Assignment((group,), (np.array([0, 1, 0]),), (np.array([0, 1, 1]),), 6)
    other = replace(first, part=(np.array(part),), variant=(np.array(variant),))
    keys = [_key(StageResult([], kit, assignment)) for assignment in (first, other)]
    assert (keys[0] == keys[1]) == same
