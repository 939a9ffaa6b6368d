"""Results as objects of other libraries: tables of pandas, meshes of meshio, COMPAS data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..analysis.simulation import SimulationResult
from ..checks import check_choice, check_kind
from ..errors import InputError
from ..fabrication.pieces import parts_list_of
from ..search.evaluation import Evaluation
from ..search.result import KitResult
from .compas_json import compas_data
from .export import all_labels
from .result_tables import result_tables, rod_rows
from .states import DesignState, states_of_kit, states_of_simulation
from .vtk import vtu_mesh

Result = SimulationResult | KitResult


def to_pandas(result: Result) -> dict[str, Any]:
    """The tables of a result by name, each a `pandas.DataFrame`. Needs pandas, which comes with the
    extra "pandas".

    result : of a kit optimisation: "designs", "elements", "joints", "rods" and "steps", see
        `exchange.result_tables.result_tables`; of a simulation: "rods" (strains, stress resultants,
        stresses of every rod element) and "joints" (places and distances from the target, in the
        design's unit of length)

    Raises InputError without pandas.
    """
    check_kind("result", result, (SimulationResult, KitResult))
    try:
        import pandas
    except ImportError:
        raise InputError(
            "tables need pandas: pip install 'kop_exudyn[pandas]'", field="to_pandas"
        ) from None
    if isinstance(result, KitResult):
        tables = result_tables(result)
    else:
        rods = [row for state in states_of_simulation(result) for row in rod_rows(state)]
        design = result.design  # of whose joints some have no place on the target, as plates' have
        places = result.deployed.state.positions[design.joints] + design.origin
        joints = [
            {"joint": k, "x": x, "y": y, "z": z, "distance": distance}
            for k, ((x, y, z), distance) in enumerate(zip(places, result.fit.distances), 1)
        ]
        tables = {"rods": rods, "joints": joints}
    return {name: pandas.DataFrame(rows) for name, rows in tables.items()}


def to_meshio(result: Result, state: str | None = None, design: str | None = None) -> Any:
    """One state as a `meshio.Mesh`: every rod element a line cell with part, strains, stress
    resultants and utilisation, every point with its deviation and section axes.

    result : of a simulation or a kit optimisation
    state : "deployed", "loaded" or another role; default: the one that the design is made for
    design : name of a kit's design; default: the first one

    Raises InputError for a state or a design that isn't there.
    """
    chosen = _state(result, state, design)
    labels = all_labels(parts_list_of(result)) if isinstance(result, KitResult) else ()
    return vtu_mesh(chosen, labels)


def to_compas(
    result: Result, state: str | None = None, design: str | None = None
) -> dict[str, Any]:
    """One state as COMPAS objects by name: "graph", "mesh", "target" where there is one, "units".
    Needs compas, which comes with the extra "compas".

    result, state, design : see `to_meshio`

    Raises InputError for a state or a design that isn't there, or without compas.
    """
    return compas_data(_state(result, state, design))


def _state(result: Result, name: str | None, design: str | None) -> DesignState:
    check_kind("result", result, (SimulationResult, KitResult))
    known = {state.name: state for state in _states(result, design)}
    fitted = next(iter(known.values())).design.fitted_role.name
    chosen = fitted if name is None else name
    check_choice("state", chosen, known)
    return known[chosen]


def _states(result: Result, design: str | None) -> Iterator[DesignState]:
    if isinstance(result, SimulationResult):
        own = result.design.name
        check_choice("design", own if design is None else design, (own,))
        yield from states_of_simulation(result)
        return
    parts = parts_list_of(result)
    number = 0 if design is None else parts.row_of(design)
    outcome = result.stages["assigned"].designs[number]
    if not isinstance(outcome, Evaluation):
        raise InputError(
            f"has no state: {outcome}", field="design", value=result.designs[number].name
        )
    yield from states_of_kit(parts, number, outcome, result.references[number].target)
