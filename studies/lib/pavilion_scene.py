"""A design as a building: scaled up, on the ground, its rods coloured by their parts, with a person
beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib import rcParams
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from kop_exudyn.drawing.colours import kit_colours
from kop_exudyn.drawing.render import Body, Camera, Light, render
from kop_exudyn.drawing.style import style
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.exchange.meshes import sweep, tube
from kop_exudyn.fabrication.pieces import parts_list_of
from kop_exudyn.fabrication.placement import PlacedPieces
from kop_exudyn.report.surroundings import JOINT_COLOUR, balls, ground, person, upright
from kop_exudyn.search.result import KitResult

_WOOD = (0.78, 0.68, 0.55)  # rods that belong to no part
_SLENDERNESS = 250  # size over breadth of rods that have no section of their own
# of the camera: from top to bottom of the picture, above the ground
_ANGLE, _RISE = np.radians(26), np.radians(19)
_ROOM = 0.96  # of the picture is filled at most


@dataclass(frozen=True)
class Pavilion:
    """A design's final state in metres, standing on z = 0.

    bodies : to render; footprint : (2,) extent in plan, height : all in m
    scale : times the model; elements, parts : of the design, and how many different parts make it
    max_percent : the largest deviation of a joint, % of the target's bounding box
    """

    name: str
    bodies: list[Body]
    footprint: np.ndarray
    height: float
    scale: float
    elements: int
    parts: int
    max_percent: float


def pavilion(result: KitResult, number: int, span: float, clearance: float = 0.0) -> Pavilion:
    """One assigned design of a kit, scaled so that its larger side in plan is `span` (m).

    clearance : height of the lowest rod over the ground (m), on masts that only the picture has

    Scaled with its sections, a structure without weight keeps its shape. Raises SimulationFailure
    when the stage has no such design.
    """
    design, outcome = result.designs[number], result.stages["assigned"].designs[number]
    if isinstance(outcome, SimulationFailure):
        raise outcome
    role = design.fitted_role.name
    state, scene = outcome.equilibria[role].state, design.scene(role)
    half = 0.5 * scene.size / _SLENDERNESS
    plain = np.array([[half, half], [-half, half], [-half, -half], [half, -half]])
    mesh = sweep(scene, state, outline=plain, refinement=3)
    pieces = parts_list_of(result).designs[number]
    chains = PlacedPieces.of(pieces, role).chain_pieces
    colours = _chain_colours(result, chains)
    turn = upright(outcome.fit.placement.apply(mesh.vertices))
    rods = outcome.fit.placement.apply(mesh.vertices) @ turn.T
    joints = outcome.fit.placement.apply(state.positions[design.joints]) @ turn.T
    scale = span / np.ptp(rods[:, :2], axis=0).max()
    low, high = rods.min(axis=0), rods.max(axis=0)
    base = np.array([*(0.5 * (low + high)[:2]), low[2] - clearance / scale])
    rods, joints = scale * (rods - base), scale * (joints - base)
    breadth = scale * _breadth(scene, plain)
    # joints of umbrella meshes are the centres of their cells
    away, nearest = cKDTree(rods).query(joints)
    bodies = [Body(rods, mesh.faces, colours[mesh.chains[mesh.faces[:, 0]]])]
    bodies += [balls(joints[away < breadth], 0.62 * breadth)] if (away < breadth).any() else []
    bodies += _masts(rods[nearest]) if clearance else []
    return Pavilion(
        design.name,
        bodies,
        np.ptp(rods[:, :2], axis=0),
        float(rods[:, 2].max()),
        float(scale),
        design.n_elements,
        len({(piece.kind, piece.part) for piece in pieces.pieces}),
        outcome.fit.max_percent,
    )


def picture(
    building: Pavilion,
    width: int = 1600,
    height: int = 900,
    samples: int = 2,
    light: Light = Light(),
    azimuth: float = -1.0,
) -> np.ndarray:
    """(height, width, 3) the pavilion seen from `azimuth` (rad) by someone who stands back on a
    rise, sRGB."""
    reach = 0.5 * float(np.linalg.norm(building.footprint))
    towards, beside = (
        np.array([np.cos(azimuth), np.sin(azimuth)]),
        np.array([-np.sin(azimuth), np.cos(azimuth)]),
    )
    someone = person(np.array([*(0.62 * reach * towards + 0.52 * reach * beside), 0.0]), azimuth)
    target = np.array([0.0, 0.0, 0.42 * building.height])
    direction = np.array([*(np.cos(_RISE) * towards), np.sin(_RISE)])
    half = np.tan(0.5 * _ANGLE)
    distance = (
        max(0.90 * reach / (half * width / height), 0.62 * building.height / half) + 0.7 * reach
    )
    seen = np.concatenate([body.vertices for body in (*building.bodies, someone)])
    camera = Camera(target + distance * direction, target, _ANGLE)
    while not in_view(seen, camera, width / height):
        distance *= 1.03
        camera = Camera(target + distance * direction, target, _ANGLE)
    return render(
        [*building.bodies, someone, ground(9 * reach)],
        camera,
        width,
        height,
        samples=samples,
        light=light,
    )


def in_view(points: np.ndarray, camera: Camera, aspect: float) -> bool:
    """Whether a camera sees all points (n, 3), with a little room around them.

    aspect : of the picture, width over height
    """
    right, up, depth = camera.axes() @ (points - camera.eye).T
    half = np.tan(0.5 * camera.angle)
    beside = np.abs(right) <= _ROOM * half * aspect * depth
    return bool((beside & (np.abs(up) <= _ROOM * half * depth)).all())


def framed(image: np.ndarray) -> Figure:
    """The picture as a figure without frame, saved pixel by pixel."""
    with style():
        figure = Figure(
            figsize=(
                image.shape[1] / rcParams["savefig.dpi"],
                image.shape[0] / rcParams["savefig.dpi"],
            )
        )
        ax = figure.add_axes((0, 0, 1, 1))
        ax.imshow(image, interpolation="none")
        ax.set_axis_off()
    return figure


def _chain_colours(result: KitResult, chains: list) -> np.ndarray:
    """(n_chains, 3) the colour of every rod's part, as in the project's other pictures."""
    tables = kit_colours(result.kit.sizes)
    return np.array(
        [_WOOD if piece is None else tables[piece.kind][piece.part] for piece in chains]
    )


def _breadth(scene, plain: np.ndarray) -> float:
    outline = next(
        (chain.section.outline for chain in scene.chains if chain.section is not None), plain
    )
    return float(np.ptp(outline, axis=0).max())


def _masts(joints: np.ndarray, radius: float = 0.045) -> list[Body]:
    """Round masts under the four joints farthest out along the diagonals of the plan."""
    plan = joints[:, :2] / np.ptp(joints[:, :2], axis=0)
    feet = {int(np.argmax(plan @ diagonal)) for diagonal in ([1, 1], [1, -1], [-1, 1], [-1, -1])}
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    found = []
    for foot in sorted(feet):
        rings = [
            np.column_stack([ring + joints[foot, :2], np.full(12, z)])
            for z in (0.0, joints[foot, 2])
        ]
        found.append(Body.of(np.concatenate(rings), tube(2, ring), JOINT_COLOUR))
    return found
