"""Confirmation of equilibria by Exudyn: every state that is kept is its own solution.

A state is offered as a start; what it has to be comes from the scene and its parameters alone. It
is refused where it breaks a condition of the scene (a joint, a prescribed angle, the mean opening,
a pin), where Exudyn's Newton steps lead away from it, and where forces aren't in balance. What is
small is told by Exudyn's own forces and by the scene's size.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ..errors import SimulationFailure
from ..rods.rotations import exp_so3, log_so3
from ..scene.scene import Scene
from ..scene.state import State
from .equilibria import Equilibrium
from .exudyn_joints import Condition
from .exudyn_library import exu
from .exudyn_model import ExudynModel, Point, Residual

# Residual, relative to the largest force in a rod, at which Exudyn's solution is accepted,
TOLERANCE = 1e-7
# and as a multiple of the round-off in the rods' forces: below it no solution could converge.
ROUND_OFF = 200.0
# Where the solution with added rotation vectors is as good as the composed one.
_SURELY = 1e-9
_MAX_STEPS = 4
# A solution further away than this, relative to the size or in rad, is another equilibrium and
# confirms nothing; and no condition may be broken by more.
_MAX_MOVE = 1e-6
_MAX_GAP = 1e-8
# Models are kept for scenes that come again, up to so many nodes in all.
_KEPT_NODES = 40_000

_NAMES = {Condition.JOINT: "joint", Condition.ANGLE: "prescribed angle", Condition.PIN: "pin"}


@dataclass(frozen=True)
class Confirmation:
    """What Exudyn's static solver made of an equilibrium.

    version : Exudyn's version
    newton_steps : steps that it took from the given state
    residual : largest force or moment out of balance, relative to the largest one in a joint, or,
        where that is small beside it, in a rod; all are Exudyn's
    gaps : by condition ("joint", "prescribed angle", "opening", "pin"), by how much Exudyn's
        solution breaks it: rad, lengths relative to the scene's size
    moved : largest displacement of a body, relative to the scene's size
    turned : largest rotation of a body, or change of a hinge's angle, rad
    wall_s : seconds, model update and solve
    state : Exudyn's solution
    """

    version: str
    newton_steps: int
    residual: float
    gaps: dict[str, float]
    moved: float
    turned: float
    wall_s: float
    state: State

    def to_dict(self) -> dict[str, float | int | str | dict[str, float]]:
        """The figures, as written in result files."""
        return {
            "version": self.version,
            "newton_steps": self.newton_steps,
            "residual": self.residual,
            "gaps": self.gaps,
            "moved": self.moved,
            "turned": self.turned,
            "wall_s": self.wall_s,
        }


def confirm(
    scene: Scene,
    equilibrium: Equilibrium,
    q: np.ndarray | None = None,
    opening: float | None = None,
    model: ExudynModel | None = None,
) -> Confirmation:
    """Have Exudyn confirm an equilibrium of a scene.

    Parameters
    ----------
    scene : what it has to be an equilibrium of
    equilibrium : whose state and torque are where Exudyn starts from
    q : (n_parameters,) parameters; default: those that the equilibrium claims to belong to
    opening : rad, prescribed mean angle of an actuated scene; default: as claimed
    model : of a scene of the same topology; default: one that is kept, or a new one

    Raises
    ------
    SimulationFailure
        the state breaks a condition of the scene, isn't in balance, or Exudyn's static solver
        leads away from it
    """
    begin = perf_counter()
    model = model_of(scene) if model is None else model
    model.set(
        scene,
        equilibrium.q if q is None else q,
        equilibrium.opening if opening is None else opening,
    )
    start = equilibrium.state
    point = model.point(start, equilibrium.torque)
    for step in range(1, _MAX_STEPS + 1):
        before, (point, residual) = point, model.step(point)
        # what joints transmit is quicker to have than what all rods do, and nearly as large
        force = max(float(np.abs(point.reactions).max(initial=0.0)), model.round_off)
        largest = float(np.abs(residual.balance).max())
        if not _small(model, largest, force, _SURELY):
            point = model.composed(before, point)
            largest, force = balance_of(model, residual := model.residual(point))
        elif largest > TOLERANCE * force:  # small beside round-off alone: joints transmit nothing
            _, force = balance_of(model, residual)
        state = model.state(point)
        moved, turned = _distance(start, state, scene.size)
        if not max(moved, turned) < _MAX_MOVE:
            given = model.point(start, equilibrium.torque)
            _check_gaps(gaps_of(model, model.residual(given), given))
            raise SimulationFailure(
                f"Exudyn's static solver moved the state by {moved:.2e} of the size and turned it "
                f"by {turned:.2e} rad"
            )
        if _small(model, largest, force):
            _check_gaps(gaps := gaps_of(model, residual, point))
            seconds = perf_counter() - begin
            return Confirmation(
                exu.__version__, step, largest / force, gaps, moved, turned, seconds, state
            )
    raise SimulationFailure(
        f"Exudyn's static solver did not confirm the state within {_MAX_STEPS} Newton steps "
        f"(residual {largest / force:.2e} of the largest force)"
    )


def _small(model: ExudynModel, largest: float, force: float, tolerance: float = TOLERANCE) -> bool:
    """Whether what is out of balance is small beside the forces, or nothing but round-off."""
    return largest <= max(tolerance * force, ROUND_OFF * model.round_off)


def balance_of(model: ExudynModel, residual: Residual) -> tuple[float, float]:
    """Largest force or moment out of balance, and the largest one in a rod, where Exudyn is."""
    return float(np.abs(residual.balance).max()), max(model.largest_force(), model.round_off)


def gaps_of(model: ExudynModel, residual: Residual, point: Point) -> dict[str, float]:
    """By how much each kind of condition is broken, rad or relative to the scene's size.

    point : the iterate that the residual is of
    """
    joints, size = model.joints, model.scene.size / model.length
    gaps = np.abs(residual.equations) / np.where(joints.is_length, size, 1.0)
    found = {
        _NAMES[kind]: float(gaps[joints.conditions == kind].max(initial=0.0))
        for kind in Condition
        if (joints.conditions == kind).any()
    }
    for kind, angle in joints.reversals(exp_so3(point.total[:, 3:])).items():
        found[_NAMES[kind]] = angle
    if turns := joints.whole_turns(point.angles):
        found[_NAMES[Condition.ANGLE]] = turns
    return found if model.scene.actuated is None else {**found, "opening": abs(residual.gap)}


def _check_gaps(gaps: dict[str, float]) -> None:
    for name, gap in gaps.items():
        if not gap <= _MAX_GAP:
            raise SimulationFailure(
                f"Exudyn refuses the state: its {name} is off by {gap:.2e} (rad, or of the size)"
            )


def _distance(start: State, state: State, size: float) -> tuple[float, float]:
    """Largest displacement, relative to the size, and largest rotation or change of angle."""
    moved = np.abs(state.positions - start.positions).max() / size
    turns = log_so3(np.swapaxes(start.rotations, 1, 2) @ state.rotations)
    bent = np.abs(state.angles - start.angles).max(initial=0.0)
    return float(moved), float(max(np.linalg.norm(turns, axis=1).max(), bent))


class _Kept(threading.local):
    """Models of scenes that may come again, the one used last at the end; each thread has its own,
    as a model can only be asked by one."""

    def __init__(self) -> None:
        self.models: list[ExudynModel] = []


_kept = _Kept()


def model_of(scene: Scene) -> ExudynModel:
    """A model for a scene: one of its topology that this thread keeps, or a new one."""
    models = _kept.models
    found = next((model for model in reversed(models) if model.fits(scene)), None)
    if found is None:
        found = ExudynModel(scene)
    else:
        models.remove(found)
    models.append(found)
    while len(models) > 1 and sum(model.layout.n_nodes for model in models) > _KEPT_NODES:
        models.pop(0)
    return found
