"""Orthogonal grids: upright lamellas on a surface, hinged about its normal where they cross.

The design is a network of curves on a surface. Its lamellas are straightened (`lamellas`), and the
state is the equilibrium that is reached from the lamellas' places on the design surface: there is
no actuation. Parameters are the lengths from joints to corners, and the signed corner angles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...checks import check_choice
from ...errors import InputError, SimulationFailure
from ...geometry.centring import middle_of, moved
from ...geometry.extent import size_of_points
from ...geometry.mesh_files import read_mesh
from ...geometry.network import CurveNetwork
from ...geometry.surfaces import PLAN_AXES, AnalyticSurface, ScaledSurface, Surface
from ...rods.sections import Material, Section, material_from_dict, section_from_dict
from ..base import Design, Role, Solve, Target, register_class, register_rescaling
from ..loads import hold_in_place
from ..numbering import rescaled_values
from .grid_network import network_on
from .lamellas import straighten_on

if TYPE_CHECKING:
    from ...equilibrium.equilibria import Equilibrium
    from ...scene.scene import Scene
    from .scene import GridScene

_LARGEST_CORNER = 1.5  # rad
_TARGET_CELLS = 68  # along each parameter, four triangles a cell
_MARGIN = 0.75  # of the longest span, by which the target goes beyond the outermost joints


class Grid(Design):
    """One orthogonal grid.

    surface : the design surface
    network : curves in its parameter plane
    section : width across the lamella, in the tangent plane (thin); height along the normal
    elements_per_piece : rod elements of each straight piece
    held : joints that keep their places on the surface, by supports or an edge beam: their numbers,
        "corners" (where two lamellas end) or "boundary" (where one ends); default: none, the grid
        finds its own shape
    straightened : "lengths" and "angles" in place of those that follow from the curves, see
        `Numbering.replaced`: of a grid that was fitted to its surface

    Raises InputError for held joints that don't exist, or that lie on one line, and for values that
    are none of the straightened lamellas.
    """

    class_name = "grid"
    fit_weight = 1e5
    roles = (Role("deployed", fitted=True),)

    def __init__(
        self,
        name: str,
        surface: Surface,
        network: CurveNetwork,
        section: Section,
        material: Material,
        *,
        elements_per_piece: int = 2,
        held: str | Sequence[int] | None = None,
        straightened: Mapping[str, Any] | None = None,
    ):
        self.name, self.surface, self.network = name, surface, network
        self.section, self.material, self.elements_per_piece = section, material, elements_per_piece
        self.straight = straighten_on(surface, network)
        numbering = self.straight.numbering
        if straightened is not None:
            numbering = numbering.replaced(straightened, "straightened")
        self.parameters, self.groups = numbering.parameters, numbering.groups
        self.lower, self.upper = numbering.bounds(_LARGEST_CORNER)
        self.held = (
            None if held is None else _held_joints(network, surface.points(network.joints), held)
        )
        self.joints = self._model.joints

    @cached_property
    def _model(self) -> GridScene:
        from .scene import grid_scene

        return grid_scene(
            self.surface,
            self.network,
            self.straight,
            self.section,
            self.material,
            self.elements_per_piece,
            self.held,
        )

    def scene(self, role: str = "deployed") -> Scene:
        check_choice("role", role, ("deployed",))
        return self._model.scene

    def deploy(
        self, q: np.ndarray | None = None, solve: Solve | None = None
    ) -> dict[str, Equilibrium]:
        """The equilibrium nearest to the design surface: solved from the lamellas' places there."""
        from ...equilibrium.newton import solve as fast

        solve, q = fast if solve is None else solve, self.checked(q)
        try:
            return {"deployed": solve(self.systems["deployed"], q)}
        except SimulationFailure as failure:
            hint = (
                ""
                if self.held is not None
                else (
                    "; a grid that nothing holds may shear without resistance, as on a dome: see "
                    'the field "held" (kop import --held)'
                )
            )
            raise SimulationFailure(f"{failure.reason}{hint}", where="deployed state") from None

    def file_with(self, data: Mapping[str, Any], q: np.ndarray) -> dict[str, Any]:
        return {**data, "straightened": self.straight.numbering.split(q)}

    @property
    def cautions(self) -> list[str]:
        """That nothing holds a net which can collapse."""
        from .c_mesh import c_mesh_residuals

        joints, lamellas = self.network.joints, self.straight.lamellas
        free = self.held is None and c_mesh_residuals(self.surface, joints, lamellas).collapses
        told = (
            "its curves are close to a Chebyshev net on a surface of constant curvature, which can "
            'collapse to a flat strip: it may shear with little resistance; joints in the field "'
            'held" (kop import --held) stop that'
        )
        return [told] if free else []

    @cached_property
    def target(self) -> Target:
        """The design surface around the grid, finely triangulated; positions: the joints on it, as
        they were drawn.

        Its size is that of the joints: the surface itself may go on.
        """
        joints = self.surface.points(self.network.joints)
        vertices, faces = _triangulated(
            self.surface, self.network, joints, _MARGIN * self._longest_span()
        )
        return Target(vertices, faces, joints, size_of_points(joints))

    def _longest_span(self) -> float:
        return max(float(lamella.spans.lengths.max()) for lamella in self.straight.lamellas)


def _held_joints(
    network: CurveNetwork, points: np.ndarray, held: str | Sequence[int]
) -> np.ndarray:
    """(k,) the joints that keep their places, sorted. Raises InputError."""
    if isinstance(held, str):
        ends = np.bincount(
            [
                joint
                for strand in network.strands
                for joint in (strand.joints[0], strand.joints[-1])
                if not strand.closed
            ],
            minlength=len(points),
        )
        least = {"boundary": 1, "corners": 2}.get(held)
        if least is None:
            raise InputError(
                'expected numbers of joints, "corners" or "boundary"', field="held", value=held
            )
        found = np.flatnonzero(ends >= least)
    else:
        found = np.unique(np.asarray(held, int))
        unknown = found[(found < 0) | (found >= len(points))]
        if len(unknown):
            raise InputError(
                f"names a joint that doesn't exist (joints 0 to {len(points) - 1})",
                field="held",
                value=int(unknown[0]),
            )
    if not hold_in_place(points[found]):
        raise InputError("joints on one line don't hold a grid", field="held", value=found.tolist())
    return found


def _triangulated(
    surface: Surface, network: CurveNetwork, joints: np.ndarray, margin: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and faces (F, 3) of the surface where it is closer than 2 margins to a joint.

    The parameter rectangle of the joints is widened by about one margin where the surface goes on.
    """
    from scipy.spatial import cKDTree

    uv = network.joints
    metric = surface.at(uv).metric
    widening = margin / np.sqrt(metric[:, [0, 1], [0, 1]].min(axis=0))
    axes = [
        np.linspace(low, high, _TARGET_CELLS + 1)
        for low, high in zip(
            np.maximum(uv.min(axis=0) - widening, surface.lower),
            np.minimum(uv.max(axis=0) + widening, surface.upper),
        )
    ]
    corners = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    middles = 0.25 * (corners[:-1, :-1] + corners[1:, :-1] + corners[1:, 1:] + corners[:-1, 1:])
    plane = np.concatenate([corners.reshape(-1, 2), middles.reshape(-1, 2)])
    usable = surface.contains(plane)
    vertices = np.full((len(plane), 3), np.inf)
    vertices[usable] = surface.points(plane[usable])
    usable &= np.isfinite(vertices).all(axis=1)
    usable[usable] = cKDTree(joints).query(vertices[usable])[0] <= 2 * margin
    n = _TARGET_CELLS + 1
    number = np.arange(n * n).reshape(n, n)
    around = [
        k.ravel() for k in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    ]
    middle = n * n + np.arange(len(around[0]))
    # four triangles a cell: neither of its diagonals comes first, whichever way u and v run
    faces = np.concatenate([np.stack([around[k - 1], around[k], middle], axis=1) for k in range(4)])
    faces = faces[usable[faces].all(axis=1)]
    used = np.unique(faces)
    return vertices[used], np.searchsorted(used, faces)


@register_class("grid")
def read_grid(data: Mapping[str, Any], source: str) -> Grid:
    """The grid of a design file's content (see grid.schema.json). Raises InputError."""
    try:
        on = data["surface"]
        origin = np.array(data.get("origin", (0.0, 0.0, 0.0)), float)
        middle = _middle(on, source, origin)
        network = data["network"]
        if on.get("chart", "plane") == "plane":
            network = _moved_network(network, middle[PLAN_AXES[on.get("up", "z")]])
        grid = grid_on(_surface(on, source, origin + middle), {**data, "network": network})
        grid.middle = on.get("size", 1.0) * middle
        return grid
    except InputError as error:
        raise error.at(source) from None


def grid_on(surface: Surface, data: Mapping[str, Any]) -> Grid:
    """The grid of a design file's content on a surface that is at hand. Raises InputError."""
    return Grid(
        data["name"],
        surface,
        network_on(surface, data["network"]),
        section_from_dict(data["section"], half_lap=True),
        material_from_dict(data["material"]),
        elements_per_piece=data.get("elements_per_piece", 2),
        held=data.get("held"),
        straightened=data.get("straightened"),
    )


def _middle(data: Mapping[str, Any], source: str, origin: np.ndarray) -> np.ndarray:
    """The middle (3,) of a surface's mesh, less the design's origin, zero near it and for formulas
    (see `geometry.centring`)."""
    if data["type"] != "mesh":
        return np.zeros(3)
    vertices = float(data.get("scale", 1.0)) * read_mesh(Path(source).parent / data["file"])[0]
    return middle_of(vertices - origin, "surface.file")


def _moved_network(data: Mapping[str, Any], middle: np.ndarray) -> Mapping[str, Any]:
    """A design file's "network" with its parameters seen from a point (2,)."""
    if not middle.any():
        return data
    found = dict(data)
    for name, k in (("u", 0), ("v", 1)):
        if name in data:
            found[name] = (np.array(data[name], float) - middle[k]).tolist()
    for name in ("domain", "through", "points", "second_points"):
        if name in data:
            found[name] = moved(data[name], middle)
    if "curves" in data:
        found["curves"] = [
            curve | {"points": moved(curve["points"], middle)} for curve in data["curves"]
        ]
    return found


def _surface(data: Mapping[str, Any], source: str, origin: np.ndarray) -> Surface:
    """The surface of a design file's field; meshes lie in the coordinates of their files, an
    origin is taken off them."""
    options = {key: value for key, value in data.items() if key not in ("type", "size")}
    if "size" in data:
        whole = _surface({"type": data["type"], **options}, source, origin)
        return ScaledSurface(whole, float(data["size"]))
    if data["type"] == "analytic":
        return AnalyticSurface(options.pop("name"), options)
    if data["type"] == "mesh":
        from ...geometry.mesh_surface import load_mesh_surface

        return load_mesh_surface(
            Path(source).parent / options["file"],
            options.get("chart", "plane"),
            options.get("up", "z"),
            float(options.get("scale", 1.0)),
            origin,
        )
    raise InputError(
        "unknown kind of surface (known: analytic, mesh)", field="surface.type", value=data["type"]
    )


@register_rescaling("grid")
def rescaled_grid(data: Mapping[str, Any], factor: float) -> dict[str, Any]:
    """The grid at another size: its surface, with the curves at the same parameters."""
    size = factor * data["surface"].get("size", 1.0)
    resized = {**data, "surface": {**data["surface"], "size": size}}
    if (given := data.get("straightened")) is not None:
        resized["straightened"] = rescaled_values(given, factor)
    return resized
