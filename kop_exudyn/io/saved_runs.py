"""Results of finished runs, read back from their folder: what `kop export` and `kop view` work
on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..equilibrium.equilibria import Equilibrium, Start
from ..equilibrium.newton import solve
from ..errors import InputError, SimulationFailure
from ..files.arrays import numbers_of
from ..files.files import as_path
from ..kit.groups import ElementGroup
from ..kit.optimality import ClusteringGap
from ..kit.parts import Assignment, Kit
from ..scene.state import State
from ..search.evaluation import Evaluation
from ..search.events import StageEvent, events_from_list
from ..search.objective import DesignObjective, Reference, reference_of
from ..search.result import INPUT, REDEPLOYED, STAGES, KitResult
from ..search.stage_results import Jump, StageResult
from ..search.weights import Weights
from ..structures.base import Design, Role
from ..structures.serving import served_by
from ..structures.stacking import parameter_offsets, stacked_groups, stacked_parameters
from .results import load_result, load_states

_LAST = "assigned"
Outcome = Evaluation | SimulationFailure

_JUDGED = ("equivalent_stress", "utilisation")  # of every state
_SAME_FIGURE = 1e-3  # of a figure: what is the same when it is found again
_SAME_PLACE = 1e-6  # of the size: how near a saved state is to the equilibrium found from it


def load_run(folder: str | Path, designs: Sequence[Design]) -> KitResult:
    """A run's result, from result.json and states.npz in its folder and the designs that it was
    made for.

    designs : those of the run, in any order; there may be others among them Saved states are
    checked by a solve that starts from them, and confirmed by Exudyn. Folders of earlier versions
    have neither the input designs' states, which are then simulated again, nor the parameters of
    stages before the last one, which are then left out; nor the states that the assigned designs
    open into, nor the history.

    Raises InputError when the files are damaged or belong to other designs, SimulationFailure when
    an input design can't be simulated.
    """
    folder = as_path(folder)
    path = folder / "result.json"
    data = load_result(path)
    if not (folder / "states.npz").exists():
        raise InputError(
            "no such file: reports that are kept without the states of their designs can be read, "
            "but not taken further; kop optimize makes them again",
            source=folder / "states.npz",
        )
    states = load_states(folder / "states.npz")
    designs = _named(designs, [design["name"] for design in data["designs"]], path)
    kit = Kit.from_dict(data["kit"], source=str(path))
    designs = served_by(designs, kit.sizes)
    groups, offsets = stacked_groups(designs), parameter_offsets(designs)
    assignment = Assignment.from_dict(
        data["assignment"], groups, int(offsets[-1]), kit, source=str(path)
    )
    realised = np.split(assignment.realise(kit, stacked_parameters(designs)), offsets[1:-1])
    references = [_reference(design, states) for design in designs]
    try:
        weights = _weights(data["settings"], designs)
    except InputError as error:
        raise error.at(path) from None
    ends = [assignment.matrix(kit, upper) @ kit.vector for upper in (False, True)]
    _check_kit(designs, groups, states, ends, path)
    objectives = [
        DesignObjective(design, weights, reference=reference)
        for design, reference in zip(designs, references)
    ]
    result = KitResult(
        list(designs),
        references,
        {},
        settings=data["settings"],
        equilibria=data["equilibria"],
        newton_iterations=data["newton_iterations"],
        wall_s=data["wall_s"],
        peak_memory_mb=data["peak_memory_mb"],
        events=_history(data, path),
        clustering={
            k: ClusteringGap.from_dict(gap) for k, gap in data.get("clustering", {}).items()
        },
    )
    verdicts = [entry["buildable"] for entry in data["designs"] if "buildable" in entry]
    if len(verdicts) == len(designs):
        result.buildable, result.verdict = verdicts, data.get("verdict", ())
    given = [entry["input"].get("buildable") for entry in data["designs"] if "input" in entry]
    if len(given) == len(designs) and None not in given:
        result.given, result.warnings = given, data.get("warnings", ())
    for stage in STAGES:
        outcomes = [
            _outcome(objective, stage, states, entry, q if stage == _LAST else None)
            for objective, entry, q in zip(objectives, data["designs"], realised)
        ]
        if (found := _all(outcomes)) is not None:
            result.stages[stage] = StageResult(
                found,
                kit,
                assignment,
                data["steps"].get(stage, 0),
                data.get("objective", {}).get(stage),
                data.get("status", {}).get(stage, ""),
                _jumps(data, stage),
            )
    _check_stiffness(result, data)
    if _LAST not in result.stages:
        raise InputError(
            "lacks the states of the designs built from the kit",
            source=folder / "states.npz",
            field=_LAST,
        )
    result.redeployed = (
        _all(
            [
                _opened(objective, states, entry, q)
                for objective, entry, q in zip(objectives, data["designs"], realised)
            ]
        )
        or ()
    )
    return result


def _check_kit(
    designs: Sequence[Design],
    groups: Sequence[ElementGroup],
    states: Mapping[tuple[str, str, str], Any],
    ends: Sequence[np.ndarray],
    path: Path,
) -> None:
    """Raise InputError unless the last stage's states were found with the parts that the result
    names: files of two runs don't go together.

    groups : of all designs; ends : (n_q,) the least and the largest that the parts realise
    """
    of_parts = np.zeros(len(ends[0]), dtype=bool)
    for group in groups:
        of_parts[group.indices] = True
    start = 0
    for design in designs:
        own = slice(start, start := start + len(design.parameters))
        saved = _saved(design, _LAST, states)
        found = next(iter(saved.values())).get("parameters") if saved else None
        if found is None or found.shape != design.parameters.shape:
            continue  # of an earlier version, or refused where its states are read
        least, most = (end[own] for end in ends)
        near = 1e-6 * np.abs(np.concatenate([least, most])).max()
        if np.any(((found < least - near) | (found > most + near)) & of_parts[own]):
            raise InputError(
                f"its states are those of another kit than the one in {path.name}: keep the files "
                "of a run together",
                source=path.with_name("states.npz"),
                field=f"{design.name}/{_LAST}",
            )


def _check_stiffness(result: KitResult, data: Mapping[str, Any]) -> None:
    """Raise InputError for designs whose material has been changed since the run: with another
    modulus the states are the same, with another limit the whole result is."""
    if _LAST not in result.stages:
        return
    for number, (design, entry) in enumerate(zip(result.designs, data["designs"])):
        saved, found = entry.get(_LAST, {}), result.summary(_LAST, number)
        if "failed" in saved or "failed" in found:
            continue
        energies = (saved.get("elastic_energy"), found["elastic_energy"])
        pairs = {"elastic_energy": (*energies, result.references[number].energy)}
        for name in _JUDGED if saved.get("strength") else ():
            least = max((s[name] or 0.0 for s in found["strength"].values()), default=0.0)
            for role, strength in found["strength"].items():
                was = saved["strength"].get(role, {}).get(name)
                pairs[f"{role} {name}"] = (was, strength[name], least)
        for name, (was, now, size) in pairs.items():
            if was is None and now is None:
                continue
            if was is None or now is None or abs(now - was) > _SAME_FIGURE * max(now, was, size):
                raise InputError(
                    f"its material or section has been changed since the run ({name}: "
                    f"{_told(was)} then, {_told(now)} now): kop optimize judges it anew",
                    source=design.source or design.name,
                    field=_LAST,
                )


def _told(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.4g}"


def _all(outcomes: Sequence[Outcome | None]) -> list[Outcome] | None:
    """The outcomes, where there is one of every design."""
    found = [outcome for outcome in outcomes if outcome is not None]
    return found if len(found) == len(outcomes) else None


def _weights(settings: Mapping[str, Any], designs: Sequence[Design]) -> Weights:
    """The weights that the run was made with; those of its designs' class where it says nothing."""
    given = settings.get("weights")
    return Weights.of(given) if given else Weights.suiting(designs)


def _history(data: Mapping[str, Any], path: Path) -> list[StageEvent]:
    """The accepted steps; none in files of earlier versions."""
    try:
        return events_from_list(data.get("history", []))
    except InputError as error:
        raise error.at(path) from None


def _jumps(data: Mapping[str, Any], stage: str) -> list[Jump]:
    """The snaps before a stage; files of earlier versions don't tell of which stage theirs are."""
    return [
        Jump(jump["design"], jump["fraction"], jump["distance_percent"] / 100)
        for jump in data.get("jumps", [])
        if jump.get("stage") == stage
    ]


def _named(designs: Sequence[Design], names: Sequence[str], path: Path) -> list[Design]:
    """The designs of these names, each found once."""
    found = [[design for design in designs if design.name == name] for name in names]
    missing = [name for name, same in zip(names, found) if len(same) != 1]
    if missing:
        raise InputError(
            f"is of designs that aren't there, or not only once: {', '.join(missing)}",
            source=path,
            field="designs",
            value=[design.name for design in designs],
        )
    return [same[0] for same in found]


def _outcome(
    objective: DesignObjective,
    stage: str,
    states: Mapping[tuple[str, str, str], Any],
    entry: Mapping[str, Any],
    q: np.ndarray | None,
) -> Evaluation | SimulationFailure | None:
    """The objective's design after a stage, confirmed by Exudyn; None when the files don't say
    enough."""
    if "failed" in entry.get(stage, {}):
        return SimulationFailure(entry[stage]["failed"])
    found = _judged(objective, stage, states, q)
    return None if found is None else objective.confirm(found)


def _opened(
    objective: DesignObjective,
    states: Mapping[tuple[str, str, str], Any],
    entry: Mapping[str, Any],
    q: np.ndarray,
) -> Evaluation | SimulationFailure | None:
    """The state that the assigned design opens into from its assembly; None when the files don't
    have it."""
    if "failed" in entry.get(REDEPLOYED, {}):
        return SimulationFailure(entry[REDEPLOYED]["failed"])
    found = _judged(objective, REDEPLOYED, states, q)
    return None if found is None else objective.placed(found)


def _judged(
    objective: DesignObjective,
    stage: str,
    states: Mapping[tuple[str, str, str], Any],
    q: np.ndarray | None,
) -> Evaluation | None:
    """The objective at a stage's saved states."""
    design = objective.design
    saved = _saved(design, stage, states)
    if saved is None:
        return None
    q = next(iter(saved.values())).get("parameters", q)
    if q is None:
        return None
    equilibria = {
        role.name: saved_equilibrium(design, role, stage, q, saved[role.name])
        for role in design.roles
    }
    return objective.judge(q, equilibria)


def _reference(design: Design, states: Mapping[tuple[str, str, str], Any]) -> Reference:
    """The input design's equilibria, from their saved states where these are there."""
    saved = _saved(design, INPUT, states)
    if saved is None:
        return reference_of(design)
    equilibria = {
        role.name: saved_equilibrium(design, role, INPUT, design.parameters, saved[role.name])
        for role in design.roles
    }
    return Reference(design.target, equilibria[design.fitted_role.name].elastic_energy, equilibria)


def _saved(
    design: Design, stage: str, states: Mapping[tuple[str, str, str], Any]
) -> dict[str, Any] | None:
    """The saved arrays of a design's states by role, where there are all of them."""
    found = {
        role.name: states[key]
        for role in design.roles
        if (key := (design.name, stage, role.name)) in states
    }
    return found if len(found) == len(design.roles) else None


def saved_equilibrium(
    design: Design, role: Role, stage: str, q: np.ndarray, saved: Mapping[str, np.ndarray]
) -> Equilibrium:
    """The equilibrium that a saved state is.

    stage : for messages; q : (n_parameters,); saved : as `load_states` has it

    Raises InputError where it is damaged or none of this design, SimulationFailure where nothing is
    found from it.
    """
    scene = design.scene(role.name)
    try:
        state = State.of(saved, scene.n_bodies, scene.n_hinges)
        q = numbers_of({"parameters": q}, "parameters", (len(design.parameters),))
        torque = float(numbers_of(saved, "torque", ())) if "torque" in saved else 0.0
    except InputError as error:
        raise InputError(
            "the saved states are damaged, or of another version of this design: "
            f"{error.field} {error.message}",
            source=design.name,
            field=stage,
        ) from None
    found = solve(design.systems[role.name], q, Start(state, torque), role.opening)
    if np.abs(found.state.positions - state.positions).max() > _SAME_PLACE * scene.size:
        raise InputError(
            "the saved states are no equilibria of this design: its file has been changed since, "
            "or the program has; kop optimize makes them again",
            source=design.name,
            field=stage,
        )
    return found
