"""A deployed design under loads: held at its supports, with its own weight and forces on joints.

The supports hold joints where the unloaded state has them, free to turn, instead of what fixes the
free design in space; so without loads nothing changes. What opens the design (the mean opening
angle of C-shells, an umbrella mesh's actuators) stays as it is. Loads grow in equal steps, so that
the state is the one that the unloaded one deforms into.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..equilibrium.engines import FAST
from ..equilibrium.engines import engine as solver_of
from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.exudyn_confirm import Confirmation, confirm
from ..equilibrium.newton import refine
from ..equilibrium.system import GRADIENT, System
from ..errors import InputError, SimulationFailure
from ..rods.sections import Section
from ..scene.loads import DeadForces, Scaled, with_self_weight
from ..scene.scene import Scene
from ..scene.terms import SceneTerm
from ..wording import counted
from .base import Design
from .loads import LoadCase, hold_in_place
from .strength import Strength, material_values, materials_of, rod_strength

_STEPS = 4
_LOWER = 0.5  # of the height: joints below are supports
_DOWN = np.array([0.0, 0.0, -1.0])  # where supports are looked for without gravity


@dataclass(frozen=True)
class LoadedState:
    """A design under a load case; lengths and forces in the design's units.

    supports : (k,) joints that are held
    total_force : (3,) sum of all loads
    displacements : (N, 3) of the rods' nodes against the unloaded state
    size : of the target, to which percentages refer
    equilibrium, confirmation : of the loaded scene; the state is Exudyn's
    reactions : (k, 3) forces of the supports on the structure
    """

    case: LoadCase
    supports: np.ndarray
    total_force: np.ndarray
    displacements: np.ndarray
    size: float
    equilibrium: Equilibrium
    confirmation: Confirmation
    strength: Strength
    joints: np.ndarray
    reactions: np.ndarray

    def __repr__(self) -> str:
        return (
            f"<LoadedState under {self.case.name!r}: deflection {self.deflections.max():.3g}, "
            f"{counted(len(self.supports), 'support')}>"
        )

    @property
    def deflections(self) -> np.ndarray:
        """(N,) how far the rods' nodes move."""
        return np.linalg.norm(self.displacements, axis=1)

    def to_dict(self) -> dict[str, Any]:
        """As `kop simulate --json` has it: lengths in the design's units, percentages of the
        target's size."""
        d, case = self.deflections, self.case
        known = np.linalg.norm(self.reactions[~np.isnan(self.reactions).any(axis=1)], axis=1)
        return {
            "gravity": None if case.gravity is None else case.gravity.tolist(),
            "total_force": self.total_force.tolist(),
            "supports": self.supports.tolist(),
            "reactions": [
                [None if np.isnan(v) else v for v in row] for row in self.reactions.tolist()
            ],
            "largest_reaction": float(known.max()) if len(known) else None,
            "deflection": {
                "max": float(d.max()),
                "mean": float(d.mean()),
                "max_percent": 100 * float(d.max()) / self.size,
                "mean_percent": 100 * float(d.mean()) / self.size,
            },
            "elastic_energy": self.equilibrium.elastic_energy,
            "stable": self.equilibrium.stable,
            "strength": self.strength.to_dict(),
            "exudyn": self.confirmation.to_dict(),
            "joints": self.joints.tolist(),
        }


def loaded_state(
    design: Design,
    unloaded: Equilibrium,
    case: LoadCase,
    scene: Scene | None = None,
    engine: str = FAST,
) -> LoadedState:
    """The state that the deployed design's equilibrium deforms into under a load case.

    scene : of the unloaded state; default: the design's own
    engine : what solves for it, see `simulate`
    Raises InputError where a density is missing or the supports don't hold the design,
    SimulationFailure when it finds no equilibrium under all of the load, or Exudyn doesn't confirm
    it.
    """
    supports, held = held_scene(design, unloaded, case, scene)
    found, scene, solve = unloaded, held, solver_of(engine)
    for share in np.linspace(0, 1, _STEPS + 1)[1:]:
        scene = loaded_scene(design, held, unloaded, case, share)
        try:
            found = solve(system := System(scene), unloaded.q, found, unloaded.opening)
        except SimulationFailure as failure:
            raise failure.within(f"{design.name}: under {share:.0%} of its loads") from None
    if engine == FAST:
        found = refine(system, found)
    try:
        confirmation = confirm(scene, found, unloaded.q, unloaded.opening)
    except SimulationFailure as failure:
        raise failure.within(f"{design.name}: under its loads") from None
    found = replace(found, state=confirmation.state)
    moved = scene.node_poses(found.state)[0] - scene.node_poses(unloaded.state)[0]
    return LoadedState(
        case,
        supports,
        _total_force(scene, unloaded),
        moved,
        design.target.size,
        found,
        confirmation,
        rod_strength(scene, found, materials_of(design)),
        design.report_positions(found.state),
        support_reactions(design, scene, found, supports),
    )


def supports_of(design: Design, unloaded: Equilibrium, case: LoadCase) -> np.ndarray:
    """(k,) joints that hold the design: those of the load case, those that the design is pinned at,
    or chosen ones.

    Chosen: corners of the joints' convex hull in plan (seen along gravity) that lie in the lower
    half of the height; all of these corners where the lower ones don't surround the joints' mean,
    around which they would tip over. Raises InputError when they lie on one line.
    """
    x = unloaded.state.positions[design.joints]
    pinned = _pinned_joints(design)
    if case.supports is not None:
        found = np.union1d(case.supports, pinned)
    elif len(pinned):
        found = pinned
    else:
        down = _DOWN if case.gravity is None or not case.gravity.any() else case.gravity
        down = down / np.abs(down).max()  # whose square may be too small for its norm
        found = _outermost(x, down / np.linalg.norm(down))
    if not hold_in_place(x[found]):
        raise InputError(
            "supports on one line don't hold a structure",
            source=design.source or design.name,
            field="supports",
            value=found.tolist(),
        )
    return found


def _pinned_joints(design: Design) -> np.ndarray:
    """Joints whose places the design itself prescribes, more than it takes to stop rigid
    motions."""
    scene = design.scene(design.fitted_role.name)
    dofs = scene.driven.dofs[scene.driven.dofs < 6 * scene.n_bodies]
    kept = scene.pinned[: 6 * scene.n_bodies].reshape(-1, 6)[design.joints, :3].all(axis=1)
    kept = kept if np.count_nonzero(kept) > 1 else np.zeros_like(kept)
    return np.flatnonzero(np.isin(design.joints, dofs // 6) | kept)


def _outermost(x: np.ndarray, down: np.ndarray) -> np.ndarray:
    """The lower ones of the joints x (n, 3) that are outermost in plan, or all outermost ones."""
    from scipy.spatial import ConvexHull, QhullError

    plan = np.linalg.svd(down[None])[2][1:]
    flat, height = x @ plan.T, -x @ down
    try:
        outer = np.sort(ConvexHull(flat).vertices)
    except QhullError:
        raise InputError(
            "joints on one line in plan can't hold a structure", field="supports"
        ) from None
    limit = height[outer].min() + _LOWER * np.ptp(height[outer])
    low = outer[height[outer] <= limit + 1e-9 * np.ptp(flat)]
    return low if _surround(flat[low], flat.mean(axis=0)) else outer


def _surround(points: np.ndarray, centre: np.ndarray) -> bool:
    """Whether the centre (2,) lies within the convex hull of points (k, 2)."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        sides = ConvexHull(points).equations
    except (QhullError, ValueError):
        return False
    return bool((sides[:, :2] @ centre + sides[:, 2] < 0).all())


def held_scene(
    design: Design, unloaded: Equilibrium, case: LoadCase, scene: Scene | None = None
) -> tuple[np.ndarray, Scene]:
    """The joints (k,) that hold a design under a load case, and its scene in the unloaded state,
    held there instead of by any other pins.

    scene : of the unloaded state; default: the design's own
    Raises InputError as `supports_of`, and for joints that don't exist.
    """
    case.check(len(design.joints), design.source or design.name)
    scene = design.scene(design.fitted_role.name) if scene is None else scene
    supports = supports_of(design, unloaded, case)
    bodies = design.joints[supports]
    pinned = scene.pinned.copy()
    pinned[: 6 * scene.n_bodies] = False
    free = np.setdiff1d((6 * bodies[:, None] + np.arange(3)).ravel(), scene.driven.dofs)
    pinned[free] = True
    return supports, replace(scene, pinned=pinned, initial=unloaded.state)


def loaded_scene(
    design: Design, scene: Scene, unloaded: Equilibrium, case: LoadCase, share: float
) -> Scene:
    """The held scene with a share of the loads, which may be more than all of them."""
    scene, acting = acting_loads(design, scene, unloaded, case, share)
    return scene.with_terms(*scene.terms, *(term for terms in acting.values() for term in terms))


def acting_loads(
    design: Design, scene: Scene, unloaded: Equilibrium, case: LoadCase, share: float
) -> tuple[Scene, dict[str, list[SceneTerm]]]:
    """The held scene with a share of the weights, and by the names of a case's fields the dead
    forces of what acts on joints and on pieces that don't bend, in the order in which
    `loaded_scene` adds them."""
    acting: dict[str, list[SceneTerm]] = {}
    if len(case.joints):
        forces = DeadForces(design.joints[case.joints], case.forces)
        acting["forces"] = [Scaled(forces, share)]
    if case.area is not None or case.plan is not None:
        spread = case.on_joints(*design.joint_areas)
        acting["area"] = [Scaled(DeadForces(design.joints, spread), share)]
    if case.line is not None:
        own = np.broadcast_to(share * case.line, (len(scene.elements), 3))
        scene = replace(scene, weight=own if scene.weight is None else scene.weight + own)
        acting["line"] = [*_on_rigid(scene, unloaded, lambda section: 1.0, share * case.line)]
    if case.gravity is not None and case.gravity.any():
        materials = materials_of(design)
        density = material_values(scene, materials, "density")
        if not np.isfinite(density).all():
            raise InputError(
                "self-weight needs the density of every material, in units of the design",
                source=design.source or design.name,
                field="material.density",
            )
        scene = with_self_weight(scene, density, share * case.gravity)
        stiffest = max(materials, key=lambda m: m.young)
        weight = _rigid_weight(scene, unloaded, stiffest.density, share * case.gravity)
        acting["gravity"] = [*weight]
    return scene, acting


def _rigid_weight(
    scene: Scene, unloaded: Equilibrium, density: float | None, gravity: np.ndarray
) -> list[DeadForces]:
    """The weight of pieces that don't bend, which are of the stiffest material."""

    def mass(section: Section) -> float:
        if density is None:
            raise InputError(
                "self-weight needs the density of every material", field="material.density"
            )
        return density * section.area

    return _on_rigid(scene, unloaded, mass, gravity)


def _on_rigid(
    scene: Scene,
    unloaded: Equilibrium,
    per_length: Callable[[Section], float],
    vector: np.ndarray,
) -> list[DeadForces]:
    """What acts along pieces that don't bend, at their middles: a vector (3,) times their length
    times a number that their section gives."""
    rigid = [
        (chain, chain.section)
        for chain in scene.chains
        if not len(chain.elements) and chain.section is not None
    ]
    if not rigid:
        return []
    x, arms = scene.node_poses(unloaded.state)[0], scene.node_arms(unloaded.state)[0]
    sizes = [
        per_length(section) * np.linalg.norm(x[chain.nodes[-1]] - x[chain.nodes[0]])
        for chain, section in rigid
    ]
    return [
        DeadForces(
            [scene.node_body[chain.nodes[0]] for chain, _ in rigid],
            np.outer(sizes, vector),
            [arms[chain.nodes[[0, -1]]].mean(axis=0) for chain, _ in rigid],
        )
    ]


def support_reactions(
    design: Design, scene: Scene, found: Equilibrium, supports: np.ndarray
) -> np.ndarray:
    """(k, 3) forces of the supports on the structure: the gradient of the energy by the joints'
    places, which is what holds them there. NaN where the design itself prescribes a place.

    scene : with supports and loads; supports (k,) : joints
    """
    dofs = 6 * design.joints[supports][:, None] + np.arange(3)
    pinned = scene.pinned.copy()
    pinned[dofs] = False
    system = System(replace(scene, pinned=pinned))
    system.set_parameters(found.q)
    system.assemble(found.state, GRADIENT)
    places = np.full(len(pinned), -1)
    places[system.sparsity.free] = np.arange(system.n_unknowns)
    at = places[dofs]
    return np.where(at >= 0, system.gradient[np.maximum(at, 0)], np.nan)


def _total_force(scene: Scene, unloaded: Equilibrium) -> np.ndarray:
    """(3,) weight and forces, summed."""
    total = np.zeros(3)
    if scene.weight is not None:
        total += scene.rest_lengths(unloaded.q) @ scene.weight
    for term in scene.terms:
        forces, factor = (term.term, term.factor) if isinstance(term, Scaled) else (term, 1.0)
        if isinstance(forces, DeadForces):
            total += factor * forces.forces.sum(axis=0)
    return total
