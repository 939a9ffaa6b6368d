"""What an SQP step costs, with the exact Hessian and with BFGS: seconds, equilibria, and how far it
gets."""

from __future__ import annotations

from collections.abc import Sequence
from time import process_time

import numpy as np

from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.projection import Projection
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.problems import RelaxedProblem
from kop_exudyn.search.weights import Weights
from kop_exudyn.sqp.options import SQPOptions
from kop_exudyn.sqp.solver import minimise
from kop_exudyn.structures.base import Design

from .benchmark import Row

_WEIGHT = 1e4  # of the projection: as much as of the fit
_PARTS = {"linear": 6, "angular": 3}


def sqp_steps(
    designs: Sequence[Design], steps: int, hessians: Sequence[str] = ("exact", "bfgs")
) -> list[Row]:
    """One row a Hessian: the relaxed problem of some designs from their inputs, `steps` steps at
    most, one process."""
    rows = []
    with DesignPool(designs, 1) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights())
        kit = cluster(dataset.groups, dataset.parameters, _PARTS).kit
        projection = Projection.of_inputs(dataset.groups, dataset.parameters).with_weight(_WEIGHT)
        for hessian in hessians:
            problem = RelaxedProblem(dataset, projection, kit)
            begin = process_time()
            first = problem.evaluate(dataset.parameters, None)
            result = minimise(
                problem,
                dataset.parameters,
                SQPOptions(hessian=hessian, max_steps=steps),
                start=first,
            )
            seconds = process_time() - begin
            taken, roles = max(result.steps, 1), sum(len(design.roles) for design in designs)
            spent = (
                {
                    phase: float(np.median([record.seconds[phase] for record in result.history]))
                    for phase in ("derivatives", "qp", "evaluate")
                }
                if result.history
                else {}
            )
            rows.append(
                {
                    "Hessian": hessian,
                    "parameters": problem.n,
                    "steps": result.steps,
                    "seconds a step": seconds / taken,
                    "equilibria a step": result.evaluations * roles / taken,
                    **{f"{phase}, s": value for phase, value in spent.items()},
                    "objective before": first.value,
                    "after": result.point.value,
                    "values": [first.value] + [record.value for record in result.history],
                }
            )
    return rows
