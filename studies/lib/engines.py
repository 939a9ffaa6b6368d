"""Designs solved by this package's solver and by Exudyn, from the same starts: states and times."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from kop_exudyn.compiled.library import library
from kop_exudyn.equilibrium.engines import EXUDYN, FAST, engine
from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import refine
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.files.json_files import read_json
from kop_exudyn.io.designs import load_design
from kop_exudyn.scene.actuators import LinearActuators
from kop_exudyn.structures.base import Design, design_from_dict
from kop_exudyn.structures.loading import loaded_state
from kop_exudyn.structures.loads import LoadCase

from .exudyn_alone import best_alone

Row = dict[str, Any]


def both_engines(file: Path, runs: int, seed: int = 0) -> dict[str, Any]:
    """One design deployed by both engines: how far apart their states are, times, confirmation.

    runs : of the fast solver and of a confirmation, for medians; Exudyn deploys once
    seed : of the random forces
    """
    library()
    times, fast, design = [], {}, load_design(file)
    for _ in range(runs):
        design = load_design(file)
        begin = process_time()
        fast = design.deploy()
        times.append(process_time() - begin)
    design.target  # a C-shell's is simulated
    row: Row = {
        "design": design.name,
        "class": design.class_name,
        "unknowns": design.systems[design.fitted_role.name].n_unknowns,
        "fast s": median(times),
        "fast iterations": sum(eq.iterations for eq in fast.values()),
    }
    begin = process_time()
    try:
        found = load_design(file).deploy(solve=engine(EXUDYN))
    except SimulationFailure as failure:
        return {"row": row | {"exudyn s": process_time() - begin, "failure": str(failure)}}
    row |= {
        "exudyn s": process_time() - begin,
        "exudyn steps": sum(eq.iterations for eq in found.values()),
    }
    apart, turned, confirming, steps = 0.0, 0.0, [], 0
    for role in design.roles:
        scene, name = design.scene(role.name), role.name
        refined = refine(design.systems[name], fast[name])
        for state in (refined, found[name]):
            confirmation = confirm(scene, state, opening=role.opening)
            steps = max(steps, confirmation.newton_steps)
        times = []
        for _ in range(runs):
            begin = process_time()
            confirm(scene, refined, opening=role.opening)
            times.append(process_time() - begin)
        confirming.append(median(times))
        a, b = refined.state, found[name].state
        apart = max(apart, float(np.abs(a.positions - b.positions).max()) / scene.size)
        turned = max(turned, float(np.abs(a.angles - b.angles).max(initial=0.0)))
    row |= {
        "apart": apart,
        "angles apart, rad": turned,
        "confirmation s": sum(confirming),
        "its steps": steps,
    }
    return {"row": row, "loaded": _loaded(design, found, seed)}


def _loaded(design: Design, found: dict[str, Any], seed: int) -> Row:
    """A random force on every tenth joint, solved for by both engines."""
    rng = np.random.default_rng(seed)
    joints = np.arange(0, len(design.joints), 10)
    role = design.fitted_role.name
    size = design.target.size
    # such that the rods' own energy is of the order of the forces' work over 0.1 % of the size
    force = found[role].elastic_energy / (1e-1 * size * len(joints))
    case = LoadCase(joints=joints, forces=force * rng.uniform(-1, 1, (len(joints), 3)))
    case = replace(case, supports=design.loads.supports)
    row: Row = {"design": design.name, "forces": len(joints)}
    states = {}
    for name in (FAST, EXUDYN):
        begin = process_time()
        try:
            states[name] = loaded_state(design, found[role], case, name)
        except SimulationFailure as failure:
            return row | {"failure": f"{name}: {failure}"}
        row[f"{name} s"] = process_time() - begin
    a, b = states[FAST], states[EXUDYN]
    row["deflection %"] = 100 * float(a.deflections.max()) / size
    row["apart"] = float(np.abs(a.joints - b.joints).max()) / size
    return row


def as_it_comes(file: Path, fine: int, runs: int) -> dict[str, Any]:
    """The final state of one design from its start, by Exudyn's static solver as it comes, by both
    engines too; errors of each one's own joints against the design with finer elements, % of the
    target's size."""
    library()
    design, exact = load_design(file), _finer(file, fine)
    role, size = design.fitted_role, design.target.size
    scene, q, system = design.scene(role.name), design.parameters, design.systems[role.name]
    start, opening = _start(design)
    rows = []

    def row(way: str, seconds: list[float], iterations: Any, joints: Any, settings: str) -> None:
        error = None
        if joints is not None:
            error = 100 * float(np.linalg.norm(joints - exact, axis=1).max()) / size
        rows.append(
            {
                "design": design.name,
                "unknowns": system.n_unknowns,
                "way": way,
                "iterations": iterations,
                "seconds": median(seconds),
                "least": min(seconds),
                "most": max(seconds),
                "error %": error,
                "settings": settings,
            }
        )

    for name in (FAST, EXUDYN):
        seconds: list[float] = []
        outcome: Any = None
        for _ in range(runs):
            begin = process_time()
            try:
                outcome = engine(name)(system, q, start, opening)
            except SimulationFailure as failure:
                outcome = failure
            seconds.append(process_time() - begin)
        failed = isinstance(outcome, SimulationFailure)
        joints = None if failed else outcome.state.positions[design.joints]
        row(name, seconds, str(outcome) if failed else outcome.iterations, joints, "")
    alone = best_alone(scene, q, start, opening, runs=runs)
    joints = None if alone.state is None else alone.state.positions[design.joints]
    steps = alone.steps if alone.state is not None else alone.reason
    row("Exudyn as it comes", list(alone.seconds), steps, joints, alone.settings)
    return {"rows": rows}


def _start(design: Design) -> tuple[Any, float | None]:
    """Where the final state is solved from: of a C-shell its state at 0.9 of the opening, of an
    umbrella mesh its state with 0.9 of the spacing; of a grid its design surface."""
    role = design.fitted_role
    state = design.deploy()[role.name]
    if role.opening is not None:
        rest = next(other.opening for other in design.roles if not other.fitted)
        near = engine(FAST)(
            design.systems[role.name],
            design.parameters,
            state,
            rest + 0.9 * (role.opening - rest),
        )
        return near.state, role.opening
    scene = design.scene(role.name)
    if not scene.terms:
        return scene.initial, None
    terms = []
    for term in scene.terms:
        if isinstance(term, LinearActuators):
            term = term.weighted(term.weight, 0.9 * term.spacing)
        terms.append(term)
    near = engine(FAST)(System(scene.with_terms(*terms)), design.parameters, state)
    return near.state, None


def _finer(file: Path, fine: int) -> np.ndarray:
    """Joints of the design with so many elements a piece."""
    data = read_json(file)
    field = "arm_elements" if data.get("class") == "umbrella" else "elements_per_piece"
    design = design_from_dict(data | {field: fine}, str(file))
    return design.deploy()[design.fitted_role.name].state.positions[design.joints]
