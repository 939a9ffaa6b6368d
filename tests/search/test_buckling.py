"""Designs that come back when their elements do, and one that has buckled."""

from __future__ import annotations

from pathlib import Path

import pytest

from kop_exudyn.errors import SimulationFailure
from kop_exudyn.io.designs import load_design
from kop_exudyn.search.buckling import buckled, missed_on_return, snapped
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights

MODELS = Path(__file__).resolve().parents[2] / "models"


def directly_built(file: str):
    """A design, its reference, and what it is like when one linear and one angular part serve all
    its elements."""
    design = load_design(MODELS / file)
    with DesignPool([design]) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights(fit=design.fit_weight))
        (built,) = Stages(dataset, {"linear": 1, "angular": 1}).direct().designs
    return design, built, dataset.references[0]


def test_a_design_that_is_only_deformed_comes_back():
    design, built, reference = directly_built("small/03_exp.json")
    objective = DesignObjective(design, reference=reference)
    origin = objective.judge(design.parameters, dict(reference.equilibria))
    assert built.fit.max_percent > 5  # far off, but elastically
    assert missed_on_return(objective, built, origin, 4) < 1e-9 and not snapped(
        objective, built, origin
    )
    assert not buckled(design, built, reference)


def test_a_design_in_another_state_does_not():
    design, built, reference = directly_built("conformals/05_sine.json")
    assert buckled(design, built, reference)


def test_what_could_not_be_built_has_not_buckled():
    design = load_design(MODELS / "small/03_exp.json")
    assert not buckled(design, SimulationFailure("no equilibrium"), None)


def test_no_way_back_counts_as_a_snap():
    class Stuck:
        design = None

        def follow(self, q, previous, steps, fitted_only):
            raise SimulationFailure("stuck")

    design, built, _ = directly_built("small/03_exp.json")
    assert snapped(Stuck(), built, built)
    with pytest.raises(SimulationFailure, match="stuck"):
        missed_on_return(Stuck(), built, built)
