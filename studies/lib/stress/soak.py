"""Random designs, here and in another place, must be the same structure: same outcome, same state,
same percentages, same energy; and its equilibria must be found again from beside them."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from kop_exudyn.cli import main
from kop_exudyn.equilibrium.equilibria import Equilibrium, Start
from kop_exudyn.equilibrium.newton import refine, solve
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.geometry.centring import FARTHEST, TooFarError
from kop_exudyn.structures.base import Design, design_from_dict
from kop_exudyn.structures.fitting import FitResult, TargetFitting, best_placement

from .random_designs import CLASSES, HERE, Place, random_design, random_place, written

# Of the size: what states may differ by, and for each size that they are away from the origin,
# where coordinates are rounded to 2e-16 of that distance before we see them.
SAME, ROUNDED = 1e-9, 4e-15
NUDGE, BACK = 1e-5, 1e-6  # of the size, and rad: from where a state is found again, how closely
# What percentages and energies, relatively, may differ by, over what the states may: bending comes
# from second differences of coordinates.
_LEVER = 1e3


class Found:
    """A design and what it deploys into. Raises SimulationFailure."""

    def __init__(self, design: Design):
        self.design, role = design, design.fitted_role
        self.equilibrium: Equilibrium = refine(
            design.systems[role.name], design.deploy()[role.name]
        )
        self.joints = design.report_positions(self.equilibrium.state)
        inside = self.equilibrium.state.positions[design.joints]
        self.fit: FitResult = TargetFitting(design.target)(inside)


def soak_cases(first: int, count: int) -> dict[str, Any]:
    """The cases of so many seeds, see `soak_case`."""
    return {"cases": [soak_case(seed) for seed in range(first, first + count)]}


def soak_case(seed: int) -> dict[str, Any]:
    """One case: its class and place, its outcome, how far the states in both places are apart (of
    the size; None without them), what is wrong ("" where nothing is), and the seconds it took."""
    begin = perf_counter()
    rng = np.random.default_rng(seed)
    class_name = CLASSES[seed % len(CLASSES)]
    data = random_design(rng, class_name)
    sizes = 0.0 if rng.random() < 0.25 else float(10 ** rng.uniform(0, 7.5))
    place = random_place(rng, class_name, sizes)
    row: dict[str, Any] = {
        "seed": seed,
        "class": class_name,
        "sizes away": sizes,
        "unit": place.unit,
        "mirrored": bool(np.linalg.det(place.rotation) < 0),
    }
    with tempfile.TemporaryDirectory() as folder:
        try:
            found = compared(rng, data, place, sizes, Path(folder))
        except Exception as error:  # whatever it is: nothing else may leave the library
            found = {"outcome": "exception", "wrong": f"{type(error).__name__}: {error}"}
    return row | {"apart": None} | found | {"seconds": perf_counter() - begin}


def compared(
    rng: np.random.Generator, data: dict[str, Any], place: Place, sizes: float, folder: Path
) -> dict[str, Any]:
    """Outcome, what is wrong, and how far the states are apart, of a design file's content here and
    in a place so many sizes away."""
    here = _read(data, HERE, folder / "here")
    try:
        there = _read(data, place, folder / "there")
    except InputError as error:
        if sizes > 0.5 * FARTHEST and isinstance(error, TooFarError):
            return {"outcome": "refused as too far away", "wrong": ""}
        return {"outcome": "refused", "wrong": f"refused there: {error}"}
    if sizes > 10 * FARTHEST:
        return {"outcome": "taken", "wrong": "not refused, though coordinates are too coarse"}
    results = []
    for design in (here, there):
        try:
            results.append(Found(design))
        except SimulationFailure as failure:
            results.append(failure)
    if any(isinstance(found, SimulationFailure) for found in results):
        if all(isinstance(found, SimulationFailure) for found in results):
            wrong = _command(folder / "there" / "design.json", stable=False)
            return {"outcome": "failed", "wrong": wrong}
        failed = next(f for f in results if isinstance(f, SimulationFailure))
        return {"outcome": "failed in one place", "wrong": str(failed)}
    first, second = results
    apart = _apart(first, second, place)
    wrong = [*_differences(first, second, apart, place, sizes), *_found_again(rng, second)]
    if rng.random() < 0.3:
        wrong.append(_command(folder / "there" / "design.json", stable=True))
    text = "; ".join(text for text in wrong if text)
    return {"outcome": "stable", "wrong": text, "apart": apart}


def _read(data: dict[str, Any], place: Place, folder: Path) -> Design:
    folder.mkdir()
    path = folder / "design.json"
    content = written(data, place, folder)
    path.write_text(json.dumps(content), encoding="utf-8")
    return design_from_dict(content, str(path))


def _apart(first: Found, second: Found, place: Place) -> float:
    """How far the joints in both places are apart, of the size."""
    x, y = (joints - joints.mean(axis=0) for joints in (first.joints, second.joints / place.unit))
    if first.design.class_name == "umbrella":  # laid where its anchor says, by the axes
        x = best_placement(x, y).apply(x)
    else:
        x = x @ place.rotation.T
    if first.design.class_name == "grid":  # whose families change places with the axes
        y = y[cKDTree(y).query(x)[1]]
    return float(np.abs(x - y).max()) / first.design.target.size


def _differences(
    first: Found, second: Found, apart: float, place: Place, sizes: float
) -> Sequence[str]:
    """What isn't the same in both places."""
    size, allowed, found = first.design.target.size, SAME + ROUNDED * sizes, []
    if apart > allowed:
        found.append(f"states {apart:.1e} of the size apart, allowed {allowed:.1e}")
    for name in ("max_percent", "mean_percent"):
        a, b = (getattr(result.fit, name) for result in (first, second))
        if abs(a - b) > _LEVER * allowed:
            found.append(f"{name} {a:.9g} and {b:.9g}")
    a, b = first.equilibrium.elastic_energy, second.equilibrium.elastic_energy / place.unit
    if abs(a - b) > _LEVER * allowed * abs(a):
        found.append(f"energies {a:.9g} and {b:.9g}")
    a, b = size, second.design.target.size / place.unit
    if abs(a - b) > allowed * a:
        found.append(f"sizes {a:.12g} and {b:.12g}")
    return found


def _found_again(rng: np.random.Generator, found: Found) -> Sequence[str]:
    """Solved anew from a state beside the equilibrium."""
    design, role, eq = found.design, found.design.fitted_role, found.equilibrium
    system = design.systems[role.name]
    scene = system.scene
    nudge = NUDGE * rng.normal(size=scene.n_dofs)
    nudge[: 6 * scene.n_bodies].reshape(-1, 6)[:, :3] *= design.target.size
    nudge[np.setdiff1d(np.arange(scene.n_dofs), system.sparsity.free)] = 0.0
    try:
        again = refine(
            system, solve(system, eq.q, Start(eq.state.moved(nudge), eq.torque), role.opening)
        )
    except SimulationFailure as failure:
        return [f"not found again from beside it: {failure}"]
    x, y = (e.state.positions[design.joints] for e in (eq, again))
    apart = np.abs(best_placement(y, x).apply(y) - x).max() / design.target.size
    return [f"found again {apart:.1e} of the size away"] if apart > BACK else []


def _command(path: Path, stable: bool) -> str:
    """What is wrong with ``kop simulate`` of a file."""
    errors = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
        status = main(["simulate", str(path)])
    if status not in ((0, 1) if stable else (1,)):
        last = errors.getvalue().strip().splitlines()[-1:]
        return f"kop simulate ends with {status}: {' '.join(last)}"
    return ""
