"""Checkpoints and files of states with damaged arrays: all must be refused, or still be right.

Damage goes through the front, where a seal tells it, and, with a new seal or none, as files of
earlier versions have, behind it: there arrays of another kind, shape or size, and numbers that
aren't finite, must be refused before compiled code sees them, and a state that is taken must be an
equilibrium.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.files.arrays import load_arrays, save_arrays, sealed, unsealed
from kop_exudyn.io.saved_runs import saved_equilibrium
from kop_exudyn.search.dataset import Dataset, evaluations_from_arrays, evaluations_to_arrays
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.weights import Weights
from kop_exudyn.sqp.history import SQPState

from .arch import arches

Arrays = dict[str, np.ndarray]


def damaged(arrays: Mapping[str, np.ndarray], rng: np.random.Generator) -> Arrays:
    """A copy with one array, or several, that differ from what they were."""
    found = {name: np.array(array) for name, array in arrays.items()}
    for _ in range(int(rng.geometric(0.7))):
        name = list(found)[rng.integers(len(found))]
        kind, array = rng.integers(10), found[name]
        if kind == 0 and len(found) > 1:
            del found[name]
        elif kind == 1:
            found[name] = array.ravel()[: rng.integers(array.size + 1)]
        elif kind == 2:
            found[name] = array[..., None]
        elif kind == 3:
            found[name] = np.full(array.shape, "x")
        elif kind == 4:
            found[name] = np.zeros(tuple(rng.integers(0, 4, rng.integers(0, 4))))
        elif array.dtype.kind == "f" and array.size:
            flat = found[name] = array.copy()
            place = np.unravel_index(rng.integers(array.size), array.shape)
            values = (
                np.nan,
                np.inf,
                -np.inf,
                1e300,
                -1e-320,
                0.0,
                -flat[place],
                1e6 * rng.normal(),
            )
            flat[place] = values[rng.integers(len(values))]
            if kind > 7:
                flat += 10 ** rng.uniform(-12, 1) * rng.normal(size=flat.shape)
        elif array.dtype.kind == "U":
            text = str(array.ravel()[0]) if array.size else ""
            at = int(rng.integers(len(text) + 1))
            found[name] = np.array(
                text[:at] + ("", "9", "]", "NaN")[rng.integers(4)] + text[at + 1 :]
            )
    return found


def same(a: Mapping[str, np.ndarray], b: Mapping[str, np.ndarray]) -> bool:
    """Whether two sets of arrays are bit for bit the same."""
    return a.keys() == b.keys() and all(
        a[n].dtype == b[n].dtype and a[n].shape == b[n].shape and a[n].tobytes() == b[n].tobytes()
        for n in a
    )


@dataclass
class Findings:
    """counts : what became of the damaged sets; wrong : those that passed for good, or that ended
    in another error than those meant for it"""

    counts: Counter = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(self.counts.values())


class DamagedStates:
    """The checkpoint and the states of two small arches, to be damaged."""

    def __init__(self, folder: Path):
        self.folder, self.designs = folder, arches()
        self.pool = DesignPool(self.designs)
        self.dataset = Dataset.of_pool(self.pool, Weights.suiting(self.designs))
        self.pool.prepare()
        self.evaluations = self.dataset.evaluate(self.dataset.parameters, None)
        state = SQPState(np.linspace(0.5, 1, 6), 0.5, y=np.zeros(2), z=np.zeros(6))
        self.checkpoint = {
            **{f"sqp/{name}": value for name, value in state.to_arrays().items()},
            **{
                f"states/{name}": value
                for name, value in evaluations_to_arrays(self.evaluations).items()
            },
        }
        design, found = self.designs[0], self.evaluations[0]
        role = design.fitted_role
        equilibrium = found.equilibria[role.name]
        self.state = {
            **equilibrium.state.to_arrays(),
            "parameters": equilibrium.q,
            "torque": np.array(equilibrium.torque),
        }

    def run(self, seeds: Iterable[int]) -> Findings:
        """Damage by seed, and what became of it."""
        findings = Findings()
        for seed in seeds:
            rng = np.random.default_rng(seed)
            what = ("front", "checkpoint", "state")[seed % 3]
            try:
                findings.counts[f"{what}: {getattr(self, '_' + what)(rng)}"] += 1
            except Exception as error:
                findings.counts[f"{what}: wrong"] += 1
                findings.wrong.append(f"seed {seed}: {what}: {type(error).__name__}: {error}")
        return findings

    def _front(self, rng: np.random.Generator) -> str:
        """A file whose arrays were changed and whose seal was not."""
        whole = sealed(self.checkpoint if rng.random() < 0.5 else self.state)
        changed = damaged(whole, rng)
        path = save_arrays(self.folder / "sealed.npz", changed, overwrite=True)
        try:
            unsealed(load_arrays(path))
        except InputError:
            return "refused"
        if same(changed, whole):
            return "the same"
        raise AssertionError("passed for good")

    def _checkpoint(self, rng: np.random.Generator) -> str:
        """A checkpoint with a seal that fits what was damaged."""
        arrays = damaged(self.checkpoint, rng)
        try:
            SQPState.from_arrays({k[4:]: v for k, v in arrays.items() if k.startswith("sqp/")})
            evaluations = evaluations_from_arrays(
                self.dataset, {k[7:]: v for k, v in arrays.items() if k.startswith("states/")}
            )
        except (InputError, SimulationFailure):
            return "refused"
        for design, evaluation in zip(self.designs, evaluations):
            for role, equilibrium in evaluation.equilibria.items():
                system = design.systems[role]
                system.set_parameters(np.abs(equilibrium.q) + 1e-3)
                with np.errstate(all="ignore"):
                    system.assemble(equilibrium.state)
        return "assembled"

    def _state(self, rng: np.random.Generator) -> str:
        """A state of a file without a seal."""
        design, arrays = self.designs[0], damaged(self.state, rng)
        try:
            with np.errstate(all="ignore"):
                found = saved_equilibrium(
                    design, design.fitted_role, "damaged", arrays.get("parameters"), arrays
                )
        except (InputError, SimulationFailure):
            return "refused"
        system = design.systems[design.fitted_role.name]
        system.linearise(found.state, found.q)
        force, noise = system.force_scale()
        residual = np.abs(system.gradient[: system.n_unknowns] * system.force_weight).max()
        if not residual <= 1e-6 * force + 100 * noise:
            raise AssertionError(f"passed for good with a residual of {residual / force:.1e}")
        return "an equilibrium"
