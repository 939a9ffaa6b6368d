"""Everything in a result as flat tables: designs, elements, joints, rod elements, steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..fabrication.pieces import PartsList, parts_list_of
from ..kit.kinds import part_kind
from ..search.evaluation import Evaluation
from ..search.result import INPUT, REDEPLOYED, STAGES, KitResult
from ..structures.base import Design
from ..structures.deviation import fit_summary
from ..structures.strength import design_strength
from .states import DesignState, states_of_kit
from .vtk import state_fields

_BY_SUPPORT = ("supports", "total_force", "reactions")  # of load cases: no single numbers
Rows = list[dict[str, Any]]


def result_tables(result: KitResult) -> dict[str, Rows]:
    """Name of a table -> its rows, ready for `tables.write_csv`; lengths in the designs' unit,
    angles in radians.

    designs : one row a design and stage, the input and where the assigned design opens into
        included: its units, fit in % of the size, energy, utilisation; or the failure
    elements : one row an element: its part and variant, and its parameters as in the input and in
        every stage
    joints : one row a design, stage and joint: place and distance from the target
    rods : one row a design, state of the last stage and rod element: strains, stress resultants,
        stresses
    steps : one row an accepted step of the optimisation
    loads : one row a design and load case: what the verdict on it says; only where there are any
    """
    tables = {
        "designs": list(_designs(result)),
        "elements": list(_elements(result)),
        "joints": list(_joints(result)),
        "rods": list(_rods(result)),
        "steps": list(_steps(result)),
    }
    return {**tables, "loads": loads} if (loads := list(_loads(result))) else tables


def _evaluations(result: KitResult) -> Iterator[tuple[str, int, Design, Any]]:
    """Every design after every stage, and where it opens into by itself: stage "redeployed"."""
    outcomes = {stage: result.stages[stage].designs for stage in STAGES if stage in result.stages}
    for stage, found in (outcomes | {REDEPLOYED: result.redeployed}).items():
        for n, (design, outcome) in enumerate(zip(result.designs, found)):
            yield stage, n, design, outcome


def _designs(result: KitResult) -> Iterator[dict[str, Any]]:
    for n, design in enumerate(result.designs):
        yield {
            "design": design.name,
            "class": design.class_name,
            "stage": INPUT,
            **_units(result),
            "elements": design.n_elements,
            **result.input_summary(n)["fit"],
            **_states(result, n, result.references[n].equilibria),
        }
    for stage, n, design, outcome in _evaluations(result):
        row = {
            "design": design.name,
            "class": design.class_name,
            "stage": stage,
            **_units(result),
            "elements": design.n_elements,
        }
        if not isinstance(outcome, Evaluation):
            yield row | {"failed": str(outcome)}
            continue
        state = outcome.equilibria[design.fitted_role.name].state
        row |= fit_summary(design, result.references[n].target, outcome.fit, state)
        yield row | _states(result, n, outcome.equilibria)


def _units(result: KitResult) -> dict[str, str | None]:
    """Units of lengths and forces in all tables; empty where no design names any."""
    units = result.units
    return {
        "length_unit": None if units is None else units.length,
        "force_unit": None if units is None else units.force,
    }


def _states(
    result: KitResult, number: int, equilibria: Mapping[str, Equilibrium]
) -> dict[str, Any]:
    """Energies, stability, actuation and stresses of one design's states."""
    row: dict[str, Any] = {}
    for role, strength in design_strength(result.designs[number], equilibria).items():
        equilibrium = equilibria[role]
        row |= {
            f"{role}_energy": equilibrium.elastic_energy,
            f"{role}_energy_ratio": equilibrium.elastic_energy / result.references[number].energy,
            f"{role}_stable": equilibrium.stable,
            f"{role}_opening": equilibrium.opening,
            f"{role}_torque": equilibrium.torque,
        }
        row |= {
            f"{role}_{name}": value
            for name, value in strength.to_dict().items()
            if name != "element"
        }
    return row


def _loads(result: KitResult) -> Iterator[dict[str, Any]]:
    for design, verdict in zip(result.designs, result.buildable):
        for case, check in verdict.get("loads", {}).items():
            total = check.get("total_force") or (None, None, None)
            yield {
                "design": design.name,
                "load_case": case,
                **{k: v for k, v in check.items() if k not in _BY_SUPPORT},
                **dict(zip(("force_x", "force_y", "force_z"), total)),
            }


def _elements(result: KitResult) -> Iterator[dict[str, Any]]:
    parts = parts_list_of(result)
    stages = [stage for stage in STAGES if stage in result.stages]
    for n, placed in enumerate(parts.designs):
        values = {"input": placed.design.parameters}
        values |= {
            stage: outcome.q
            for stage in stages
            if isinstance(outcome := result.stages[stage].designs[n], Evaluation)
        }
        for piece in placed.pieces:
            row = {
                "design": placed.design.name,
                "element": piece.element,
                "kind": piece.kind,
                "part": parts.label(piece),
                "variant": piece.variant,
            }
            yield row | {
                f"{stage}_{k}": q[parameter]
                for stage, q in values.items()
                for k, parameter in enumerate(piece.parameters, 1)
            }


def _joints(result: KitResult) -> Iterator[dict[str, Any]]:
    for stage, _, design, outcome in _evaluations(result):
        if isinstance(outcome, Evaluation):
            state = outcome.equilibria[design.fitted_role.name].state
            placed = outcome.fit.placement.apply(state.positions[design.joints]) + design.origin
            for number, (x, distance) in enumerate(zip(placed, outcome.fit.distances), 1):
                yield {
                    "design": design.name,
                    "stage": stage,
                    "joint": number,
                    "x": x[0],
                    "y": x[1],
                    "z": x[2],
                    "distance": distance,
                    "distance_percent": 100 * distance / outcome.fit.size,
                }


def _rods(result: KitResult) -> Iterator[dict[str, Any]]:
    parts = parts_list_of(result)
    for number, outcome in enumerate(result.stages["assigned"].designs):
        if isinstance(outcome, Evaluation):
            target = result.references[number].target
            for state in states_of_kit(parts, number, outcome, target):
                yield from rod_rows(state)


def rod_rows(state: DesignState) -> Iterator[dict[str, Any]]:
    """One row a rod element of a state: design, state, part, then `vtk.state_fields`."""
    fields = state_fields(state)
    for number, values in enumerate(zip(*fields.values())):
        plain = {
            name: v.item() if isinstance(v, np.generic) else v for name, v in zip(fields, values)
        }
        part = state.parts[plain["rod"]] if plain["rod"] >= 0 else ""
        row = {"design": state.design.name, "state": state.name, "rod_element": number}
        yield row | {"part": part or None} | plain


def part_rows(parts: PartsList) -> Rows:
    """One row a part: its number in VTU files, label, kind and parameters, in the designs'
    units."""
    rows: Rows = []
    for kind, values in parts.kit.parts.items():
        names = part_kind(kind).parameter_names
        for label, value in zip(parts.labels[kind], values):
            row = {"number": len(rows) + 1, "part": label, "kind": kind}
            rows.append(row | dict(zip(names, map(float, value))))
    return rows


def _steps(result: KitResult) -> Iterator[dict[str, Any]]:
    for event in result.events:
        figures = asdict(event.record)
        seconds = {f"seconds_{phase}": value for phase, value in figures.pop("seconds").items()}
        terms = {f"term_{name}": value for name, value in event.terms.items()}
        yield (
            {"stage": event.stage, "sqp": event.sqp, "weight": event.weight}
            | figures
            | terms
            | seconds
        )
