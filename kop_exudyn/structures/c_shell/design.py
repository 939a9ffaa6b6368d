"""C-shells: planar networks of curved rods that open into space when their joints are turned.

The smooth design (pre-curved rods, unstressed in the plane) is deployed by its mean joint angle
through the out-of-plane bifurcation and gives the target. The straightened design (straight pieces,
one corner between neighbouring joints) has the element parameters; its deployed and its assembly
("rest") state enter the objective.

The rest state lies on the floor by default (planar: out-of-plane freedoms removed), at the
network's own mean joint angle: many networks are mechanisms in the plane, whose rest state would be
undetermined without it. Option "imperfect" lets it leave the plane instead, from a tiny
imperfection that unfolds the pitchfork.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...checks import check_choice
from ...equilibrium.equilibria import Equilibrium, Start
from ...equilibrium.newton import solve as fast
from ...equilibrium.system import System
from ...errors import InputError, SimulationFailure
from ...geometry.centring import middle_of, moved
from ...geometry.extent import size_of_points
from ...geometry.linkage import refuse_loose_parts
from ...geometry.network import CurveNetwork, network_from_dict
from ...geometry.network_faces import triangulate
from ...geometry.triangles import TriangleSurface
from ...rods.sections import material_from_dict, section_from_dict
from ...scene.scene import Scene
from ...scene.state import State
from ..base import (
    Design,
    Role,
    Solve,
    Target,
    register_centring,
    register_class,
    register_rescaling,
)
from ..deviation import OFF_TARGET
from ..fitting import TargetFitting
from ..mesh_target import check_target_size, load_target_mesh, target_doubts, target_on_mesh
from ..numbering import rescaled_values
from ..opening import Station, Way
from .opening import check_hinges, check_opening, open_up
from .own_axes import untied
from .scene import RodModel, lay_out, shell_scene

log = logging.getLogger(__name__)

_STATION_STEP = 0.2  # rad of mean joint angle between the stations on the way
_FLAT = 1e-4  # of the size: less height is none
_LARGEST_CORNER = 2.5  # rad
_IMPERFECTION = 1e-3  # of the size, height of the shallow surface that imperfect rest shapes follow
_REFINEMENTS = 3  # of the target's triangles
_INWARD, _SLIVER = 1e-6, 1e-9  # of the way to the middle
_TOLD = 0.01  # %: less is no deviation that anyone would build
_NEARER = 0.6  # times as far off: what makes the other side the better one


class CShell(Design):
    """One C-shell.

    network : the planar network; model : how its rods are modelled
    opening : rad, change of the mean opening angle from assembly to deployment
    side : 1 or -1, to which side of the plane it rises
    rest : "planar" or "imperfect", see the module
    target_mesh : surface to keep to, instead of the surface through the smooth design's deployed
        rods
    straightened : "lengths" and "angles" in place of those that follow from the curves, see
        `Numbering.replaced`: of a design that was fitted to its target

    Raises InputError where one corner can't follow the curve between two joints, or the curves
    enclose no face, and for values that are none of the straightened curves.
    """

    class_name = "c_shell"
    stress_weight = 0.1

    def __init__(
        self,
        name: str,
        network: CurveNetwork,
        model: RodModel,
        opening: float,
        *,
        side: int = 1,
        rest: str = "planar",
        target_mesh: TriangleSurface | None = None,
        straightened: Mapping[str, Any] | None = None,
    ):
        self.name, self.network, self.model = name, network, model
        self.opening, self.side, self.rest, self.target_mesh = opening, side, rest, target_mesh
        self.layout = lay_out(network, model.elements)
        numbering = self.layout.numbering
        if straightened is not None:
            numbering = numbering.replaced(straightened, "straightened")
        self.parameters, self.groups, self.joints = (
            numbering.parameters,
            numbering.groups,
            self.layout.joints,
        )
        self.lower, self.upper = numbering.bounds(_LARGEST_CORNER)
        refuse_loose_parts(network)
        self._triangles = triangulate(network)
        flat, straight = self.layout.hinges[:, network.opens].mean(axis=1)
        self.flat_angle = float(flat)
        check_opening(self.flat_angle, opening)
        self.roles = (
            Role("deployed", self.flat_angle + opening, fitted=True),
            Role("rest", float(straight)),
        )

    def scene(self, role: str) -> Scene:
        check_choice("role", role, tuple(self._scenes))
        return self._scenes[role]

    @cached_property
    def _scenes(self) -> dict[str, Scene]:
        planar = self.rest == "planar"
        return {
            "deployed": shell_scene(self.layout, self.model, straight=True),
            "rest": shell_scene(
                self.layout,
                self.model,
                straight=True,
                planar=planar,
                imperfection=0.0 if planar else self.side * _IMPERFECTION,
            ),
        }

    @cached_property
    def smooth(self) -> Scene:
        """The smooth design's scene."""
        return shell_scene(self.layout, self.model, straight=False)

    @cached_property
    def smooth_path(self) -> list[Equilibrium]:
        """The smooth design's equilibria from the flat network to the opening, in steps of about
        0.1 rad."""
        return self._open_smooth(fast)

    def _open_smooth(self, engine: Solve) -> list[Equilibrium]:
        system = System(self.smooth)
        path = open_up(system, self.flat_angle, self.opening, self.side, engine)
        try:
            for equilibrium in path:
                check_hinges(self.network, equilibrium.state, self.middle)
        except SimulationFailure as failure:
            raise failure.within("smooth design") from None
        return path

    def deploy(
        self, q: np.ndarray | None = None, solve: Solve | None = None
    ) -> dict[str, Equilibrium]:
        """Rest from the flat network; deployed from there, as a builder opens it.

        Where no equilibrium is found on that way, the input's deployed state is the one that the
        smooth design's leads to.
        """
        solve, path = (fast, self.smooth_path) if solve is None else (solve, [])
        given, q = q is not None, self.checked(q)
        try:
            start = Start(self.scene("rest").initial)
            rest = solve(self.systems["rest"], q, start, self._rest_opening)
            self.check_state("rest", rest.state)
        except SimulationFailure as failure:
            raise failure.within("rest state") from None
        try:
            deployed = (self._opened if given else self._opened_or_led)(q, rest, solve)
            self.check_state("deployed", deployed.state)
        except SimulationFailure as failure:
            raise failure.within("deployed state") from None
        return {"deployed": deployed.after(*path), "rest": rest}

    def check_state(self, role: str, state: State) -> None:
        """See `check_hinges`."""
        check_hinges(self.network, state, self.middle)

    def _opened(self, q: np.ndarray, rest: Equilibrium, solve: Solve) -> Equilibrium:
        opened = self.way.opened(self.systems, q, self.assembled(q, {"rest": rest}), solve)
        return opened[-1].after(*opened[:-1])

    def _opened_or_led(self, q: np.ndarray, rest: Equilibrium, solve: Solve) -> Equilibrium:
        try:
            return self._opened(q, rest, solve)
        except SimulationFailure as failure:
            log.warning("%s doesn't open from its flat assembly: %s", self.name, failure)
        return self._led(q, solve)

    def _led(self, q: np.ndarray, solve: Solve) -> Equilibrium:
        """The deployed state that the smooth design's leads to."""
        path = self.smooth_path if solve is fast else self._open_smooth(solve)
        start = self.layout.straightened(path[-1].state, self.scene("deployed"))
        found = solve(
            self.systems["deployed"],
            q,
            Start(start, path[-1].torque),
            self.fitted_role.opening,
        )
        return found if solve is fast else found.after(*path)

    @cached_property
    def way(self) -> Way:
        """From the flat assembly by growing mean angles, to the side that the smooth design rises
        to; it is lifted to that one's shape from the first station on at which that isn't flat,
        until it stays up."""
        end = self.fitted_role.opening
        assert end is not None
        steps = max(1, int(np.ceil(abs(end - self._rest_opening) / _STATION_STEP - 1e-9)))
        stations = [
            Station(
                f"opened by {k / steps:.0%}",
                "deployed",
                self._rest_opening + (end - self._rest_opening) * k / steps,
            )
            for k in range(1, steps + 1)
        ]
        for number in range(steps):
            smooth = self._smooth_at((number + 1) / steps)
            if np.ptp(smooth.state.positions[:, 2]) > _FLAT * self.network.size:
                shape = self.layout.straightened(smooth.state, self.scene("deployed"))
                stations[number] = replace(stations[number], lifted=Start(shape, smooth.torque))
        *way, last = stations
        return Way(self._rest_opening, tuple(way), last, self.joints, self.target.size)

    def assembled(self, q: np.ndarray, equilibria: Mapping[str, Equilibrium]) -> Start:
        """The rest state, off the floor."""
        return Start(equilibria["rest"].state, equilibria["rest"].torque)

    def opened_through(
        self, q: np.ndarray, equilibria: Mapping[str, Equilibrium]
    ) -> dict[str, Equilibrium]:
        """The flat assembly, and the states at all stations."""
        return {"rest": equilibria["rest"], **super().opened_through(q, equilibria)}

    def file_with(self, data: Mapping[str, Any], q: np.ndarray) -> dict[str, Any]:
        return {**data, "straightened": self.layout.numbering.split(q)}

    @property
    def doubts(self) -> list[str]:
        """That the target mesh looks as if it were in another unit, or elsewhere."""
        if self.target_mesh is None:
            return []
        flat = self.network.joints
        return target_doubts(self.target_mesh, np.column_stack([flat, np.zeros(len(flat))]))

    @property
    def cautions(self) -> list[str]:
        """That a mesh suits the shape better which the design has when it rises to the other side:
        without weight, a plane net's two shapes are mirror images of each other."""
        if self.target_mesh is None:
            return []
        try:
            joints = self.smooth_path[-1].state.positions[self.joints]
        except SimulationFailure:  # which says more than this
            return []
        mirrored = joints * (1.0, 1.0, -1.0)
        own, other = (
            TargetFitting(target).minimum_zone(x).max_percent
            for target, x in (
                (self.target, joints),
                (target_on_mesh(self.target_mesh, mirrored), mirrored),
            )
        )
        if own <= OFF_TARGET or other > _NEARER * own:
            return []
        now, better = ("up", "down") if self.side > 0 else ("down", "up")
        then = f"{other:.2g} %" if other >= _TOLD else "right on it"
        return [
            f"it rises {now}, and is {own:.2g} % off the target mesh before anything is "
            f"straightened; rising {better} it would be {then}: opening.side "
            f'"{better}" in its file (kop import --side {better}) makes it rise there'
        ]

    @property
    def _rest_opening(self) -> float:
        """Mean angle of the assembly."""
        opening = next(role.opening for role in self.roles if role.name == "rest")
        assert opening is not None
        return opening

    def _smooth_at(self, share: float) -> Equilibrium:
        """The smooth design's state nearest to being opened by a share, or by more."""
        path = self.smooth_path
        wanted = (share - 1e-9) * abs(self.opening)
        opened = (e for e in path if abs((e.opening or 0.0) - self.flat_angle) >= wanted)
        return next(opened, path[-1])

    @cached_property
    def target(self) -> Target:
        """The surface through the smooth design's deployed rods: the network's faces, refined and
        lifted; or a mesh.

        Lifted by the C1 Clough-Tocher interpolant of all rod nodes, it passes through every joint;
        the bare triangles between joints would have creases exactly where the joints are.
        """
        from scipy.interpolate import CloughTocher2DInterpolator
        from scipy.spatial import Delaunay

        state = self.smooth_path[-1].state
        if self.target_mesh is not None:
            return target_on_mesh(self.target_mesh, state.positions[self.joints])
        vertices, faces = self.network.joints, self._triangles
        for _ in range(_REFINEMENTS):
            vertices, faces = _split(vertices, faces)
        flat = self.layout.smooth[:, :2]
        stretch = untied(flat)
        flat, vertices = flat @ stretch, vertices @ stretch
        lift = CloughTocher2DInterpolator(Delaunay(flat), state.positions, tol=1e-10)
        # straight outer curves have slivers of triangles, and points outside, made by rounding
        inward = flat.mean(axis=0) - vertices
        lifted = lift(vertices + _SLIVER * inward)
        joints = state.positions[self.joints]
        lifted[: len(joints)] = joints  # exact there
        outside = np.isnan(lifted).any(axis=1)
        lifted[outside] = lift((vertices + _INWARD * inward)[outside])
        used = np.unique(faces)
        faces = np.searchsorted(used, faces)
        return Target(lifted[used], faces, joints, size_of_points(lifted[used]))


def _split(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every triangle into four, at the middles of its edges."""
    n = len(vertices)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, number = np.unique(edges, axis=0, return_inverse=True)
    m = n + number.reshape(-1, 3)
    a, b, c = faces.T
    parts = [
        np.stack(t, axis=1)
        for t in (
            (a, m[:, 0], m[:, 2]),
            (m[:, 0], b, m[:, 1]),
            (m[:, 2], m[:, 1], c),
            (m[:, 0], m[:, 1], m[:, 2]),
        )
    ]
    return np.concatenate([vertices, vertices[unique].mean(axis=1)]), np.concatenate(parts)


@register_class("c_shell")
def read_c_shell(data: Mapping[str, Any], source: str) -> CShell:
    """The C-shell of a design file's content (see c_shell.schema.json). Raises InputError."""
    try:
        model = RodModel(
            section_from_dict(data["section"]),
            material_from_dict(data["material"]),
            float(data.get("rod_offset", 0.0)),
            int(data.get("elements_per_piece", 2)),
        )
        opening = data["opening"]
        mesh = load_target_mesh(data["target"], Path(source).parent) if "target" in data else None
        network = network_from_dict(data)
        if mesh is not None:
            check_target_size(mesh, network.size, data["target"]["file"])
        return CShell(
            data["name"],
            network,
            model,
            float(opening["angle"]),
            side=-1 if opening.get("side") == "down" else 1,
            rest=data.get("rest", "planar"),
            target_mesh=mesh,
            straightened=data.get("straightened"),
        )
    except InputError as error:
        raise error.at(source) from None


@register_centring("c_shell")
def centred_c_shell(data: Mapping[str, Any]) -> tuple[Mapping[str, Any], np.ndarray]:
    """The C-shell with its curves, where they are joined and its target seen from the curves'
    middle."""
    curves = data["curves"]
    middle = middle_of([p for curve in curves for p in curve.get("points", ())], "curves")
    if len(middle) != 2 or not middle.any():
        return data, np.zeros(3)
    found = dict(data)
    found["curves"] = [curve | {"points": moved(curve["points"], middle)} for curve in curves]
    if not isinstance(data.get("crossings", "find"), str):
        found["crossings"] = [
            joint | {"near": moved([joint["near"]], middle)[0]} if "near" in joint else joint
            for joint in data["crossings"]
        ]
    origin = np.append(middle, 0.0)
    if "target" in data:
        target = data["target"]
        back = np.array(target.get("axes", np.eye(3)), float).T / float(target.get("scale", 1.0))
        own = np.array(target.get("origin", (0.0, 0.0, 0.0)), float)
        found["target"] = target | {"origin": (own + back @ origin).tolist()}
    return found, origin


@register_rescaling("c_shell")
def rescaled_c_shell(data: Mapping[str, Any], factor: float) -> dict[str, Any]:
    """The C-shell at another size: its curves, where they are joined, and its target."""

    def larger(points: Sequence[Sequence[float]]) -> list[list[float]]:
        return [[factor * x for x in point] for point in points]

    found = dict(data)
    found["curves"] = [curve | {"points": larger(curve["points"])} for curve in data["curves"]]
    if not isinstance(data.get("crossings", "find"), str):
        found["crossings"] = [
            joint | {"near": larger([joint["near"]])[0]} if "near" in joint else joint
            for joint in data["crossings"]
        ]
    if "straightened" in data:
        found["straightened"] = rescaled_values(data["straightened"], factor)
    if "target" in data:
        found["target"] = data["target"] | {"scale": factor * data["target"].get("scale", 1.0)}
    return found
