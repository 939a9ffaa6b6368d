"""C-shells: planar networks of curved rods that open into space when their joints are turned.

The smooth design (pre-curved rods, unstressed in the plane) is deployed by its mean joint angle through the
out-of-plane bifurcation and gives the target. The straightened design (straight pieces, one corner between neighbouring
joints) has the element parameters; its deployed and its assembly ("rest") state enter the objective.

The rest state lies on the floor by default (planar: out-of-plane freedoms removed), at the network's own mean joint
angle: many networks are mechanisms in the plane, whose rest state would be undetermined without it. Option "imperfect"
lets it leave the plane instead, from a tiny imperfection that unfolds the pitchfork.
"""
from __future__ import annotations

from functools import cached_property
from typing import Any, Mapping

import numpy as np
from scipy.interpolate import CloughTocher2DInterpolator
from scipy.spatial import Delaunay

from ..equilibrium.newton import Equilibrium, NewtonOptions, Start, solve
from ..equilibrium.system import System
from ..errors import InputError, SimulationFailure
from ..rods.sections import material_from_dict, section_from_dict
from ..scene.scene import Scene
from ..scene.state import State
from .base import Design, Role, Target, register
from .c_shell_scenes import Layout, ShellScene, smooth_scene, straight_scene
from .curve_network import network_of
from .planar_curve import PlanarCurve
from .straight_network import straighten

_OPENING_STEP = 0.1  # rad of mean joint angle a step
_SHORTEST = 0.1  # of the median length: shorter pieces are no sensible parts
_LARGEST_CORNER = 2.5  # rad
_IMPERFECTION = 1e-3  # of the size, height of the rest state's imperfection
_SMOOTH_ELEMENTS = 4  # a span
_REFINEMENTS = 2  # of the target's triangles


class CShell(Design):
    """One C-shell.

    curves : the planar network; free_ends : rods go on beyond their outermost joints
    opening : rad, change of the mean joint angle from assembly to deployment
    side : 1 or -1, to which side of the plane it rises
    rest : "planar" or "imperfect", see the module
    elements_per_piece : rod elements of each straight piece
    """

    class_name = "c_shell"

    def __init__(self, name: str, curves: list[PlanarCurve], layout: Layout, opening: float, *, side: int = 1,
                 crossings: Any = "find", free_ends: bool = False, rest: str = "planar", elements_per_piece: int = 2):
        self.name, self.layout, self.side, self.rest, self.opening = name, layout, side, rest, opening
        self.free_ends = free_ends
        self.network = network_of(curves, crossings)
        self.straight = straighten(self.network, free_ends)
        self.parameters = self.straight.parameters
        lengths = self.straight.is_length
        shortest = _SHORTEST * float(np.median(self.parameters[lengths]))
        self.lower = np.where(lengths, shortest, -_LARGEST_CORNER)
        self.upper = np.where(lengths, np.inf, _LARGEST_CORNER)
        self.groups = self.straight.groups
        self._shells = {
            "deployed": straight_scene(self.network, self.straight, layout, elements_per_piece),
            "rest": straight_scene(self.network, self.straight, layout, elements_per_piece, planar=rest == "planar"),
        }
        deployed = self._shells["deployed"]
        self.joints = deployed.joints
        self.assembly_angle = float(deployed.scene.initial.angles[deployed.hinges].mean())
        self.roles = (Role("deployed", self.assembly_angle + opening, fitted=True), Role("rest", self.assembly_angle))

    def scene(self, role: str) -> Scene:
        return self._shells[role].scene

    @cached_property
    def smooth(self) -> ShellScene:
        """The smooth design's scene."""
        return smooth_scene(self.network, self.layout, _SMOOTH_ELEMENTS, self.free_ends)

    @cached_property
    def smooth_path(self) -> list[Equilibrium]:
        """The smooth design's equilibria from the flat network to the opening, in steps of about 0.1 rad."""
        return open_up(System(self.smooth.scene), self.smooth, self.opening, self.side)

    def deploy(self, q: np.ndarray | None = None) -> dict[str, Equilibrium]:
        """Deployed from the smooth design's deployed state (the same branch), rest from the flat network."""
        q = self.parameters if q is None else q
        path = self.smooth_path
        start = carry_over(self.smooth, path[-1].state, self._shells["deployed"], self.network.runs)
        try:
            deployed = solve(self.systems["deployed"], q, Start(start, path[-1].torque), self.roles[0].opening)
        except SimulationFailure as failure:
            raise failure.within("deployed state") from None
        try:
            rest = self._solve_rest(q)
        except SimulationFailure as failure:
            raise failure.within("rest state") from None
        return {"deployed": deployed.after(*path), "rest": rest}

    @cached_property
    def target(self) -> Target:
        """The surface through the smooth design's deployed rods: the flat network's triangles, refined and lifted.

        Lifted by the C1 Clough-Tocher interpolant of all rod nodes, it passes through every joint; the bare triangles
        between joints would have creases exactly where the joints are.
        """
        scene, state = self.smooth.scene, self.smooth_path[-1].state
        flat = scene.initial.positions[:, :2]
        joints = state.positions[self.smooth.joints]
        triangles = _faces(flat, 1.6 * self._longest_span())
        vertices, faces = flat, triangles
        for _ in range(_REFINEMENTS):
            vertices, faces = _split(vertices, faces)
        lifted = CloughTocher2DInterpolator(Delaunay(flat), state.positions, tol=1e-10)(vertices)
        lifted[: len(flat)] = state.positions  # exact there; the rest lies inside the flat hull
        used = np.unique(faces)
        faces = np.searchsorted(used, faces)
        return Target(lifted[used], faces, joints, float(np.linalg.norm(np.ptp(lifted[used], axis=0))))

    def _solve_rest(self, q: np.ndarray) -> Equilibrium:
        scene = self.scene("rest")
        start = scene.initial
        if self.rest == "imperfect":
            x = start.positions.copy()
            x[:, 2] += self.side * _IMPERFECTION * scene.size * _bulge(x)
            start = State(x, start.rotations, start.angles)
        return solve(self.systems["rest"], q, start, self.roles[1].opening)

    def _longest_span(self) -> float:
        return max(run.curve.length(u, v) for run in self.network.runs for _, _, u, v in run.spans)


def open_up(system: System, shell: ShellScene, opening: float, side: int) -> list[Equilibrium]:
    """Open a flat scene by its mean joint angle, through the bifurcation to the chosen side of the plane."""
    scene = shell.scene
    flat = float(scene.initial.angles[shell.hinges].mean())
    steps = max(1, int(np.ceil(abs(opening) / _OPENING_STEP - 1e-9)))
    heights = np.zeros(scene.n_dofs)
    heights[: 6 * scene.n_bodies].reshape(-1, 6)[:, 2] = side * _bulge(scene.initial.positions)
    options = NewtonOptions(side=heights[system.sparsity.free])
    path = [solve(system, np.empty(0), None, flat, options)]
    for step in range(1, steps + 1):
        angle = flat + opening * step / steps
        try:
            path.append(solve(system, np.empty(0), path[-1], angle, options))
        except SimulationFailure as failure:
            raise failure.within(f"smooth design, mean joint angle {angle:.3f} rad") from None
    return path


def carry_over(smooth: ShellScene, state: State, straight: ShellScene, runs: list) -> State:
    """A start for the straightened scene: its bodies where the smooth design's rods are, joints and angles alike."""
    target = straight.scene.initial
    positions, rotations, angles = target.positions.copy(), target.rotations.copy(), target.angles.copy()
    positions[straight.joints], rotations[straight.joints] = state.positions[smooth.joints], state.rotations[smooth.joints]
    angles[straight.hinges] = state.angles[smooth.hinges]
    flat = smooth.scene.initial
    for run, track, goal in zip(runs, smooth.tracks, straight.tracks):
        stations = _stations(run, track, smooth.joints)
        where = np.array([s for s, _ in stations])
        bodies = np.array([b for _, b in stations])
        at = np.array([span + fraction for span, fraction, _ in goal])
        goal_bodies = np.array([b for _, _, b in goal])
        for axis in range(3):
            positions[goal_bodies, axis] = np.interp(at, where, state.positions[bodies, axis])
        near = bodies[np.abs(where[None] - at[:, None]).argmin(axis=1)]
        # the turn out of the flat state, applied to the piece's own flat axes
        turn = state.rotations[near] @ np.swapaxes(flat.rotations[near], 1, 2)
        rotations[goal_bodies] = turn @ target.rotations[goal_bodies]
    return State(positions, rotations, angles)


def _stations(run: Any, track: list[tuple[int, float, int]], joints: np.ndarray) -> list[tuple[float, int]]:
    """(span + fraction, body) along a smooth curve, joints included, in order."""
    stations = [(span + fraction, body) for span, fraction, body in track]
    stations += [(float(k), int(joints[j])) for k, j in enumerate(run.joints)]
    if run.curve.closed:
        stations.append((float(len(run.joints)), int(joints[run.joints[0]])))
    return sorted(stations)


def _bulge(x: np.ndarray) -> np.ndarray:
    """A height field that is neither symmetric nor orthogonal to the usual buckling modes, for choosing a side."""
    y = (x[:, :2] - x[:, :2].mean(axis=0)) / np.ptp(x[:, :2], axis=0).max()
    r = (y**2).sum(axis=1)
    return r - r.mean() + 0.7 * (y[:, 0] ** 2 - y[:, 1] ** 2) + 0.3 * y[:, 0] * y[:, 1]


def _faces(flat: np.ndarray, longest: float) -> np.ndarray:
    """Triangles between rods: Delaunay without those that bridge the outline's bays."""
    triangles = Delaunay(flat).simplices
    corners = flat[triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    keep = (edges <= longest) & (np.abs(area) > 1e-6 * edges**2)
    return np.where((area > 0)[:, None], triangles, triangles[:, ::-1])[keep]


def _split(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every triangle into four, at the middles of its edges."""
    n = len(vertices)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, number = np.unique(edges, axis=0, return_inverse=True)
    m = n + number.reshape(-1, 3)
    a, b, c = faces.T
    parts = [np.stack(t, axis=1) for t in ((a, m[:, 0], m[:, 2]), (m[:, 0], b, m[:, 1]), (m[:, 2], m[:, 1], c),
                                           (m[:, 0], m[:, 1], m[:, 2]))]
    return np.concatenate([vertices, vertices[unique].mean(axis=1)]), np.concatenate(parts)


@register("c_shell")
def read_c_shell(data: Mapping[str, Any], source: str) -> CShell:
    """The C-shell of a design file's content (see c_shell.schema.json). Raises InputError."""
    try:
        curves = [PlanarCurve(c["points"], c.get("closed", False), c.get("type", "spline") == "spline",
                              field=f"curves[{k}]") for k, c in enumerate(data["curves"])]
        layout = Layout(section_from_dict(data["section"]), material_from_dict(data["material"]),
                        float(data.get("rod_offset", 0.0)))
        opening = data["opening"]
        return CShell(
            data["name"], curves, layout, float(opening["angle"]), side=-1 if opening.get("side") == "down" else 1,
            crossings=data.get("crossings", "find"), free_ends=data.get("free_ends", False),
            rest=data.get("rest", "planar"), elements_per_piece=data.get("elements_per_piece", 2))
    except InputError as error:
        raise error.at(source) from None
