"""Random structures under worse conditions than any user's: what the stress suite simulates.

Every case follows from its seed alone. Three families: sheared grids of two layers of rods that are
hinged (or, at some crossings, rigidly joined) where they cross; spatial frames with hinges; trees
clamped at their root under dead forces far beyond their buckling loads. Lengths are changed piece
by piece, so that the pieces no longer fit together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kop_exudyn.equilibrium.stability import softest_mode
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.rods.rotations import exp_so3, rotation_z
from kop_exudyn.rods.sections import Material, Section, rectangle
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces
from kop_exudyn.scene.scene import Scene
from kop_exudyn.scene.state import State

FAMILIES = ("grid", "frame", "tree")
# Softer than this share of a rod's bending stiffness, in the unstressed state, is a mechanism: not
# a structure.
_MECHANISM = 1e-3
_ATTEMPTS = 200


@dataclass(frozen=True)
class Conditions:
    """Under which conditions a structure is simulated.

    slenderness : length of a typical rod piece / the section's smaller side
    ratio : of the section's sides
    unit : length of a typical rod piece
    young : Young's modulus
    change : largest relative change of a piece's length
    rotation : (3,) rotation vector of the whole structure, rad; shift (3,) translation / size
    disorder : rad, how far the start's free bodies are turned at most, each about its own axis
    """

    slenderness: float
    ratio: float
    unit: float = 1.0
    young: float = 1.0
    change: float = 0.2
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    disorder: float = 0.0


@dataclass(frozen=True)
class StressCase:
    """One simulation to be tried: solve(System(scene), q, start, opening).

    rests : (n_parameters,) parameters at which all rods are unstressed in the scene's initial state
    """

    seed: int
    family: str
    conditions: Conditions
    scene: Scene
    rests: np.ndarray
    q: np.ndarray
    start: State
    opening: float | None


def random_case(seed: int, **changes: Any) -> StressCase:
    """The case of a seed; `changes` replace some of its conditions, the structure stays the same.

    Raises SimulationFailure when no attempt gave a structure that stands without stress (none of
    the seeds in use).
    """
    family = FAMILIES[seed % len(FAMILIES)]
    conditions = replace(random_conditions(np.random.default_rng([seed, 0])), **changes)
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng([seed, 1, attempt])
        case = _MAKERS[family](rng, seed, conditions)
        if case is not None:
            return case
    raise SimulationFailure("only mechanisms were drawn", where=f"seed {seed}")


def random_conditions(rng: np.random.Generator) -> Conditions:
    """Slenderness 20 to 1e4, sides to 1 : 50, micrometres to kilometres, moduli over twelve
    decades."""
    slenderness = 10 ** rng.uniform(1.3, 4)
    return Conditions(
        slenderness=slenderness,
        ratio=50 ** rng.uniform() if slenderness > 200 else (slenderness / 4) ** rng.uniform(),
        unit=10 ** rng.uniform(-6, 3),
        young=10 ** rng.uniform(0, 12),
        change=0.2 * rng.uniform() ** 0.5,
        rotation=_vector(rng, 3.0),
        shift=_vector(rng, 2.0),
        disorder=rng.choice([0.0, 0.1, 1.0, 3.0]),
    )


def _vector(rng: np.random.Generator, longest: float) -> tuple[float, float, float]:
    direction = rng.normal(size=3)
    return tuple((longest * rng.uniform() * direction / np.linalg.norm(direction)).tolist())


# -- families ----------------------------------------------------------------------------------
def _grid(rng: np.random.Generator, seed: int, conditions: Conditions) -> StressCase | None:
    """Two layers of rods that cross at an angle, down to nearly closed; actuated, or held open by
    rigid crossings."""
    n, m = rng.integers(2, 5), rng.integers(3, 5)
    angle = np.pi / 2 * 10 ** rng.uniform(-2, 0)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    first = np.stack([np.ones_like(i), np.zeros_like(i)], axis=-1) * i[..., None]
    second = np.array([np.cos(angle), np.sin(angle)]) * j[..., None]
    flat = (first + second).reshape(-1, 2)
    frame = _Frame(rng, conditions, np.column_stack([flat, np.zeros(len(flat))]))
    rigid = rng.random(n * m) < rng.choice([0.0, 0.3])
    actuated = not rigid.any() or rng.random() < 0.5
    number = np.arange(n * m).reshape(n, m)
    hinged = ~rigid if not rigid.all() else np.arange(n * m) > 0
    for row in number.T:
        frame.path(row, behind=False, hinged=hinged)
    for row in number:
        frame.path(row, behind=True, hinged=hinged)
    opening = None
    if actuated and frame.hinge_of:
        hinges = np.array(sorted(frame.hinge_of.values()))
        frame.builder.mean_angle(hinges)
        opening = rng.uniform(-0.2, 0.5) * angle
    return frame.case(seed, "grid", opening)


def _frame(rng: np.random.Generator, seed: int, conditions: Conditions) -> StressCase | None:
    """Points in space, each joined to some of its neighbours; hinges about random axes at some of
    them."""
    count = int(rng.integers(4, 9))
    points = rng.normal(size=(count, 3)) * [1.0, 1.0, rng.choice([0.05, 0.6])]
    distance = np.linalg.norm(points[:, None] - points, axis=2) + np.diag(np.full(count, np.inf))
    if distance.min() < 0.3:
        return None
    points /= np.median(distance.min(axis=1))
    edges = _neighbours(rng, points, distance)
    frame = _Frame(rng, conditions, points, exp_so3(rng.normal(size=(count, 3))))
    hinged = rng.random(count) < rng.choice([0.0, 0.3, 0.7])
    for a, b in edges:
        ends = bool(hinged[a] and rng.random() < 0.5), bool(hinged[b] and rng.random() < 0.5)
        frame.piece(
            a,
            b,
            ends,
            curvature=rng.uniform(0, 1.0) * rng.normal(size=3) if rng.random() < 0.3 else None,
        )
    if rng.random() < 0.3:
        frame.load(rng, 10 ** rng.uniform(-1, 1))
    return frame.case(seed, "frame", None)


def _tree(rng: np.random.Generator, seed: int, conditions: Conditions) -> StressCase | None:
    """Pieces that branch off a clamped root, at rigid joints, with forces of up to ten times EI /
    L^2."""
    count = int(rng.integers(2, 10))
    points, edges = [np.zeros(3)], []
    for k in range(1, count):
        parent = int(rng.integers(max(0, k - 3), k))
        direction = rng.normal(size=3)
        points.append(
            points[parent] + rng.uniform(0.6, 1.4) * direction / np.linalg.norm(direction)
        )
        edges.append((parent, k))
    frame = _Frame(rng, conditions, np.array(points), exp_so3(rng.normal(size=(count, 3))))
    for a, b in edges:
        frame.piece(
            a,
            b,
            (False, False),
            curvature=rng.uniform(0, 2.0) * rng.normal(size=3) if rng.random() < 0.5 else None,
        )
    frame.load(rng, 10 ** rng.uniform(-1, 1))
    return frame.case(seed, "tree", None)


_MAKERS = {"grid": _grid, "frame": _frame, "tree": _tree}


def _neighbours(
    rng: np.random.Generator, points: np.ndarray, distance: np.ndarray
) -> list[tuple[int, int]]:
    """A tree that reaches all points, and further short edges."""
    reached = [0]
    edges: set[tuple[int, int]] = set()
    while len(reached) < len(points):
        rest = [k for k in range(len(points)) if k not in reached]
        part = distance[np.ix_(reached, rest)]
        a, b = np.unravel_index(np.argmin(part), part.shape)
        edges.add(_ordered(reached[a], rest[b]))
        reached.append(rest[b])
    for start, row in enumerate(distance):
        for end in np.argsort(row)[: int(rng.integers(1, 4))]:
            edges.add(_ordered(start, int(end)))
    return sorted(edges)


def _ordered(a: int, b: int) -> tuple[int, int]:
    return min(a, b), max(a, b)


class _Frame:
    """A structure in the making: straight or curved rod pieces between numbered bodies, in units of
    a piece."""

    def __init__(
        self, rng: np.random.Generator, conditions: Conditions, points: np.ndarray, axes: Any = None
    ):
        self.rng, self.conditions = rng, conditions
        unit = conditions.unit
        turn = exp_so3(np.array(conditions.rotation)[None])[0]
        size = np.linalg.norm(np.ptp(points, axis=0))
        self.points = (points @ turn.T + size * np.array(conditions.shift)) * unit
        self.axes = turn @ (
            np.broadcast_to(np.eye(3), (len(points), 3, 3)) if axes is None else axes
        )
        thin = unit / conditions.slenderness
        sides = (
            (conditions.ratio * thin, thin)
            if rng.random() < 0.5
            else (thin, conditions.ratio * thin)
        )
        self.section: Section = rectangle(*sides)
        self.stiffness = self.section.stiffness(Material(conditions.young, 0.3))
        self.bending = float(self.stiffness[4:].min())
        self.builder = SceneBuilder(10_000)
        self.bodies = self.builder.bodies(self.points, self.axes)
        self.hinge_of: dict[int, int] = {}
        self.rests: list[float] = []
        self.elements = int(rng.integers(3, 7))
        self.spin = rng.uniform(0, np.pi)  # the section's turn about the rod

    def path(self, row: np.ndarray, behind: bool, hinged: np.ndarray) -> None:
        """Pieces through a row of bodies; behind the hinge of those that have one."""
        for a, b in zip(row, row[1:]):
            self.piece(a, b, (behind and bool(hinged[a]), behind and bool(hinged[b])), spin=0.0)

    def piece(
        self,
        a: int,
        b: int,
        behind: tuple[bool, bool],
        curvature: Any = None,
        spin: float | None = None,
    ) -> None:
        """One rod piece from body a to body b, straight in the initial state."""
        k, unit = self.elements, self.conditions.unit
        ends = self.points[[a, b]]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        frame = _axes_along(
            (ends[1] - ends[0]) / length, self.axes[a], self.spin if spin is None else spin
        )
        inside = self.builder.bodies(
            ends[0] + np.arange(1, k)[:, None] / k * (ends[1] - ends[0]), frame
        )
        nodes = [
            self._node(a, behind[0], frame),
            *self.builder.nodes(inside),
            self._node(b, behind[1], frame),
        ]
        self.builder.rod(
            nodes,
            self.stiffness,
            parameter=len(self.rests),
            section=self.section,
            curvature=None if curvature is None else np.asarray(curvature) / unit,
        )
        self.rests.append(length)

    def load(self, rng: np.random.Generator, size: float) -> None:
        """Dead forces of about size EI / L^2 on some bodies."""
        loaded = rng.random(len(self.bodies)) < 0.5
        loaded[-1] = True
        forces = (
            size * self.bending / self.conditions.unit**2 * rng.normal(size=(int(loaded.sum()), 3))
        )
        turn = exp_so3(np.array(self.conditions.rotation)[None])[0]
        self.builder.term(DeadForces(self.bodies[loaded], forces @ turn.T))

    def case(self, seed: int, family: str, opening: float | None) -> StressCase | None:
        """The finished case; None for a mechanism."""
        rng, conditions = self.rng, self.conditions
        self.builder.pin(self.bodies[0])
        self.builder.n_parameters = len(self.rests)
        scene, rests = self.builder.build(), np.array(self.rests)
        q = rests * (1 + conditions.change * rng.uniform(-1, 1, len(rests)))
        turns = (
            conditions.disorder
            * rng.uniform(size=(scene.n_bodies, 1))
            * _unit(rng.normal(size=(scene.n_bodies, 3)))
        )
        turns[self.bodies[0]] = 0.0
        initial = scene.initial
        start = State(initial.positions, initial.rotations @ exp_so3(turns), initial.angles)
        if self._is_mechanism(scene, rests):
            return None
        return StressCase(seed, family, conditions, scene, rests, q, start, opening)

    def _is_mechanism(self, scene: Scene, rests: np.ndarray) -> bool:
        """Whether the unstressed structure, straight and without loads, is next to movable."""
        straight = np.tile([1.0, 0, 0, 0, 0, 0], (len(scene.elements), 1))
        system = System(replace(scene, rest_strain=straight, terms=()))
        system.set_parameters(rests)
        system.assemble(scene.initial)
        return softest_mode(system).eigenvalue * self.conditions.unit < _MECHANISM * self.bending

    def _node(self, body: int, behind: bool, frame: np.ndarray) -> int:
        hinge = -1
        if behind:
            if body not in self.hinge_of:
                self.hinge_of[body] = int(self.builder.hinges([0.0])[0])
            hinge = self.hinge_of[body]
        return int(self.builder.nodes(self.bodies[body], hinge, self.axes[body].T @ frame)[0])


def _axes_along(tangent: np.ndarray, body: np.ndarray, spin: float) -> np.ndarray:
    """Axes (3, 3): x along the tangent, z near the body's z axis (or its x axis), turned about x by
    the spin."""
    up = body[:, 2] if abs(body[:, 2] @ tangent) < 0.9 else body[:, 0]
    z = up - (up @ tangent) * tangent
    z /= np.linalg.norm(z)
    axes = np.column_stack([tangent, np.cross(z, tangent), z])
    return axes @ np.roll(rotation_z(spin), 1, axis=(0, 1))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
