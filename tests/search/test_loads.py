"""Kits whose designs carry their loads: bounds of the search, and the verdict where none does."""

import pytest
from support.grids import coarse_grid

from kop_exudyn.analysis.load_check import check_load
from kop_exudyn.analysis.verdict import VerdictSettings, judge
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict

PARTS = {"linear": 4, "angular": 2}
REQUIRED = Requirements(samples=0)
SUPPORTS = [0, 3, 12, 15]


@pytest.fixture(scope="module")
def data(repository):
    return coarse_grid(repository)


def loaded(data, **limit):
    case = {
        "name": "snow",
        "points": [{"joint": 5, "force": [0, 0, -20]}],
        "factor": 1.5,
        "deflection": limit,
    }
    return design_from_dict({**data, "load_cases": [case], "supports": SUPPORTS})


def sought(design, required, steps):
    """The direct kit with its parts optimised, and the objective that judges it."""
    weights = Weights.suiting([design])
    with DesignPool([design]) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, weights)
        settings = StageSettings(requirements=required, assigned_steps=steps)
        stages = Stages(dataset, PARTS, settings)
        result = stages.assigned(stages.direct())
        return result, DesignObjective(design, weights, pool.references[0], required)


def test_a_kit_that_carries_what_its_design_does_not(data):
    """Without the bound the kit deflects as the input design does; with it, within its limit."""
    design = loaded(data, span_over=500)
    case = design.load_cases[0]
    found = {}
    for loads in (False, True):
        result, _ = sought(design, Requirements(samples=0, loads=loads), 60)
        kept = result.designs[0]
        check = check_load(design, kept.equilibria["deployed"], case)
        found[loads] = check.deflection / check.allowed, kept.fit.max_percent
    assert found[False][0] > 1.5
    assert found[True][0] <= 1 + 1e-3 and found[True][0] > 0.9  # and no stiffer than asked for
    assert found[True][1] > found[False][1]  # which costs fidelity
    assert result.pressure["free_form"]["snow, deflection"] > 0
    assert result.penalty < 1e-3 * result.value


def test_a_load_that_no_kit_carries(data):
    """The search comes to an end, and the verdict names load and help."""
    design = loaded(data, absolute=1e-7)
    result, objective = sought(design, REQUIRED, 4)
    (kept,) = result.designs
    assert kept.utilisation["snow, deflection"] > 10 and result.penalty > 0
    verdict = judge(objective, kept, kept, VerdictSettings(samples=0))
    (stop,) = [stop for stop in verdict.stops if stop.cause == "load"]
    assert stop.why.startswith("under snow it deflects by")
    assert "more supports, or less load" in stop.helps


def test_designs_without_loads_are_judged_as_before(data):
    design = design_from_dict(data)
    objective = DesignObjective(design, requirements=REQUIRED)
    kept = objective.judge(design.parameters, dict(objective.reference.equilibria))
    assert kept.loaded == {} and set(kept.utilisation) == {"deployed"} and kept.solves == 1


def test_a_case_that_cannot_be_looked_at_bounds_nothing(data):
    """Without a density there is no self-weight; the verdict says so."""
    material = {key: value for key, value in data["material"].items() if key != "density"}
    case = {"name": "weight", "gravity": [0, 0, -9.81]}
    design = design_from_dict({**data, "material": material, "load_cases": [case]})
    objective = DesignObjective(design, requirements=REQUIRED)
    kept = objective.judge(design.parameters, dict(objective.reference.equilibria))
    assert kept.loaded == {} and set(kept.utilisation) == {"deployed"}
    (stop,) = judge(objective, kept, kept, VerdictSettings(samples=0)).stops
    assert stop.cause == "load" and "density" in stop.why
