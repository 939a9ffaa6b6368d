"""A design that a kit was not made for, built of that kit: relaxed towards its parts with one
weight w_c."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from kop_exudyn.kit.parts import Assignment, Kit
from kop_exudyn.kit.projection import Projection
from kop_exudyn.search.evaluation import Evaluation
from kop_exudyn.search.result import KitResult, summary_of
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.stage_results import StageResult
from kop_exudyn.structures.base import Design


def project_design(
    design: Design, kit: Kit, factor: float, stages: StageSettings = StageSettings()
) -> dict[str, Any]:
    """The design projected onto a kit whose parts stay as they are, as plain data.

    factor : w_c over the weight of the fit; all other settings from `stages`, without rescues

    Returns for the states "direct" (every input element its nearest part), "relaxed" (elements
    free, drawn to the parts by w_c), "built" (each relaxed element its nearest part) and
    "reassigned" (parts exchanged where the objective gains) the `summary_of`, J, `changed` (places
    in q of the elements whose part or variant isn't that of the direct state), and `positions` of
    the bodies (n, 3) at the best placement; of the relaxed state also its `tightness` (root mean
    square distance of elements to their parts by kind, relative to the kind's scale).

    Raises SimulationFailure when the input design can't be simulated.
    """
    settings = JobSettings(
        stages=replace(stages, schedule=(factor * design.fit_weight,), rescues=0), jobs=1
    )
    result = optimize_kit([design], kit=kit, settings=settings)
    direct = result.stages["direct"].assignment
    relaxed = result.stages["relaxed"]
    states = {
        "direct": result.stages["direct"],
        "relaxed": relaxed,
        "built": result.at_parts,
        "reassigned": result.stages["assigned"],
    }
    found = {name: _plain(result, state, direct) for name, state in states.items() if state}
    projection = Projection.of_inputs(design.groups, design.parameters)
    found["relaxed"]["tightness"] = projection.tightness(
        relaxed.evaluations[0].q, kit, relaxed.assignment
    )
    return {"weight": factor * design.fit_weight, "elements": design.n_elements, **found}


def changed_parameters(before: Assignment, after: Assignment) -> np.ndarray:
    """(k,) places in q of the elements that have another part or another variant."""
    rows = [
        group.indices[(a != b) | (v != w)].ravel()
        for group, a, b, v, w in zip(
            before.groups, before.part, after.part, before.variant, after.variant
        )
    ]
    return np.sort(np.concatenate(rows)) if rows else np.empty(0, dtype=int)


def _plain(result: KitResult, state: StageResult, direct: Assignment) -> dict[str, Any]:
    outcome, design = state.designs[0], result.designs[0]
    found = summary_of(outcome, design, result.references[0]) | {
        "objective": state.value,
        "changes": direct.changes(state.assignment),
        "changed": changed_parameters(direct, state.assignment),
    }
    if isinstance(outcome, Evaluation):
        positions = outcome.equilibria[design.fitted_role.name].state.positions
        found["positions"] = outcome.fit.placement.apply(positions)
    return found
