"""A structure class is one file: one is added from outside, `lib.stress.arch`, and a kit is found
for it without other changes."""

from __future__ import annotations

import numpy as np
import pytest
from support.settings import FEW_ERRORS

import lib.stress.arch  # noqa: F401  # registers the class
from kop_exudyn.errors import InputError
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.structures.base import class_names, design_from_dict


def designs():
    rng = np.random.default_rng(3)
    pieces = [0.1 + 0.04 * rng.random((6, 2)) for _ in range(3)]
    return [
        design_from_dict(
            {
                "class": "stress_arch",
                "name": f"arch {k}",
                "pieces": p.tolist(),
                "span": 0.8 * p.sum(),
            }
        )
        for k, p in enumerate(pieces)
    ]


def test_the_class_is_registered_beside_the_built_in_ones():
    names = class_names()
    assert "stress_arch" in names and "c_shell" in names


def test_two_stages_beat_the_direct_projection():
    settings = JobSettings(jobs=1, stages=StageSettings(effort="quick"))
    outcome = optimize_kit(designs(), {"linear": 3}, settings=settings)
    direct, assigned = outcome.stages["direct"], outcome.stages["assigned"]
    assert assigned.value < 0.5 * direct.value
    for evaluation in assigned.designs:
        assert evaluation.confirmations["deployed"].moved < 1e-8
        assert evaluation.equilibria["deployed"].stable
    realised = assigned.assignment.matrix(assigned.kit) @ assigned.kit.vector
    np.testing.assert_array_equal(np.concatenate([e.q for e in assigned.designs]), realised)


def test_results_do_not_depend_on_the_number_of_processes():
    settings = StageSettings(schedule=(1e3, 1e5), effort="quick", requirements=FEW_ERRORS)
    one, two = (
        optimize_kit(designs(), {"linear": 3}, settings=JobSettings(jobs=jobs, stages=settings))
        for jobs in (1, 2)
    )
    np.testing.assert_array_equal(
        one.stages["assigned"].kit.vector, two.stages["assigned"].kit.vector
    )


def test_more_parts_than_elements_are_refused():
    with pytest.raises(InputError, match="more parts than elements"):
        optimize_kit(designs(), {"linear": 30}, settings=JobSettings(jobs=1))


def test_exudyn_solves_it_as_well():
    from kop_exudyn.analysis.simulation import simulate

    arch = designs()[0]
    fast, own = (simulate(arch, engine=engine).joints for engine in ("fast", "exudyn"))
    assert abs(fast - own).max() < 1e-6 * arch.target.size
