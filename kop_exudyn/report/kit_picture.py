"""Pictures of a kit's designs as they stand: true sections, every rod in its part's colour, a scale
bar on the ground and, where the design is large enough, a person beside it."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from PIL import Image
from scipy.spatial import cKDTree

from ..compiled.library import library
from ..drawing.colours import kit_colours
from ..drawing.render import Body, Camera, Light, render
from ..drawing.style import INK, style, with_palette
from ..equilibrium.equilibria import Equilibrium
from ..errors import SimulationFailure
from ..exchange.meshes import sweep
from ..fabrication.pieces import DesignPieces, parts_list_of
from ..fabrication.placement import PlacedPieces
from ..search.evaluation import Evaluation
from ..search.result import KitResult
from ..structures.fitting import Placement
from ..units import Units, unit_of
from .surroundings import PERSON_HEIGHT, balls, ground, person, scale_bar, upright

_WOOD = (0.78, 0.68, 0.55)  # rods that belong to no part
_SLENDERNESS = 250  # size over breadth of rods that have no section of their own
_ANGLE, _RISE, _AZIMUTH = np.radians(26), np.radians(24), -1.0  # of the camera
_HANDY = (1.0, 2.0, 5.0)  # lengths of scale bars, times powers of ten
_BAR = 0.32  # of the plan's larger side: at most as long
# Times a design's size. A person beside it is neither smaller nor larger: one as tall as the design
# would take the picture from it, and the scale bar says as much.
_TALL, _SMALL = 0.45, 0.03
_FINE, _COARSE = Light(suns=5, skies=15, buffer=600), Light(suns=1, skies=1, buffer=200)
_FILLED = 0.82  # of the picture, by what is in it
_UP = np.array([0.0, 0.0, 1.0])
_COLOURS = 192  # of a picture's palette


@dataclass(frozen=True)
class Solid:
    """A design's rods as they stand, lowest point at z = 0, middle of the plan at the origin.

    rods : coloured by their parts; joints (n, 3)
    breadth : of the rods; footprint (2,), height : extents; all in the design's unit of length
    """

    rods: Body
    joints: np.ndarray
    breadth: float
    footprint: np.ndarray
    height: float

    @property
    def bodies(self) -> list[Body]:
        """Rods, and balls at joints that lie in them (those of umbrella meshes are the middles of
        cells)."""
        near = cKDTree(self.rods.vertices).query(self.joints)[0] < self.breadth
        return [self.rods, *([balls(self.joints[near], 0.62 * self.breadth)] if near.any() else [])]


def opened_state(result: KitResult, number: int) -> Evaluation | SimulationFailure:
    """The state that a design of a kit opens into; the kept one where that is not known."""
    opened = result.redeployed[number] if result.redeployed else None
    kept = result.stages["assigned"].designs[number]
    return opened if isinstance(opened, Evaluation) else kept


def kit_solids(result: KitResult, refinement: int = 3) -> list[Solid | SimulationFailure]:
    """All designs of a kit in their opened states; the failure of those that have none.

    refinement : rings an element
    """
    colours = kit_colours(result.kit.sizes)
    found: list[Solid | SimulationFailure] = []
    for n, pieces in enumerate(parts_list_of(result).designs):
        outcome = opened_state(result, n)
        if isinstance(outcome, SimulationFailure):
            found.append(outcome)
            continue
        equilibrium = outcome.equilibria[pieces.design.fitted_role.name]
        found.append(_solid(pieces, equilibrium, outcome.fit.placement, colours, refinement))
    return found


def kit_pictures(
    result: KitResult, width: int = 640, height: int = 460
) -> list[Image.Image | None]:
    """A picture of every design of a kit, None for one without an equilibrium.

    width, height : pixels

    Without compiled kernels pictures are coarse: they would take minutes.
    """
    fine = library() is not None
    return [
        None
        if isinstance(solid, SimulationFailure)
        else picture(solid, result.units, width, height, fine=fine)
        for solid in kit_solids(result, 3 if fine else 1)
    ]


def picture(
    solid: Solid, units: Units | None, width: int, height: int, *, fine: bool = True
) -> Image.Image:
    """One design on the ground, with its scale bar, seen by someone who stands on a rise.

    units : of the design
    width, height : pixels
    fine : with soft shadows and smooth edges
    """
    towards = np.array([np.cos(_AZIMUTH), np.sin(_AZIMUTH), 0.0])
    beside = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
    plan = solid.rods.vertices
    span = float(max(np.ptp(plan @ beside), np.ptp(plan @ towards), solid.height))
    front, right = float((plan @ towards).max()), float((plan @ beside).max())
    length = _handy(_BAR * span)
    start = (front + 0.06 * span) * towards - 0.5 * length * beside
    around = [ground(6 * span), scale_bar(start, beside, length, 0.012 * span)]
    human = 0.0 if units is None else PERSON_HEIGHT / units.metres
    if _SMALL * span < human < _TALL * span:
        place = 0.7 * front * towards + (right + 0.25 * human) * beside
        around.append(person(place, _AZIMUTH, human))
    seen = np.concatenate([around[1].vertices, *(b.vertices for b in (solid.rods, *around[2:]))])
    camera = _framing(seen, np.cos(_RISE) * towards + np.sin(_RISE) * _UP, width / height)
    pixels = render(
        [*solid.bodies, *around],
        camera,
        width,
        height,
        samples=2 if fine else 1,
        light=_FINE if fine else _COARSE,
    )
    at = _pixel(camera, start + 0.5 * length * beside, width, height)
    return _labelled(pixels, at, f"{length:g} {unit_of('length', units)}")


def joined(pictures: Sequence[Image.Image | None], names: Sequence[str]) -> bytes:
    """One PNG file of all pictures that there are, in rows of up to three, with their names."""
    shown = [(one, name) for one, name in zip(pictures, names) if one is not None]
    if not shown:
        return png(Image.new("RGB", (640, 460), "white"))
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    width, height = shown[0][0].size
    with style():
        figure = Figure(figsize=(columns * width / 100, rows * height / 100), facecolor="white")
        for k, (one, name) in enumerate(shown):
            ax = figure.add_axes(
                ((k % columns) / columns, 1 - (k // columns + 1) / rows, 1 / columns, 1 / rows)
            )
            ax.imshow(np.asarray(one), interpolation="none")
            ax.set_axis_off()
            ax.text(16, 14, name, size=16, weight="bold", va="top", color=INK)
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=100)
    return with_palette(file.getvalue(), _COLOURS)


def png(image: Image.Image) -> bytes:
    """A picture as the bytes of a PNG file with few colours."""
    file = io.BytesIO()
    image.save(file, format="png")
    return with_palette(file.getvalue(), _COLOURS)


def _solid(
    pieces: DesignPieces,
    equilibrium: Equilibrium,
    placement: Placement,
    colours: dict[str, np.ndarray],
    refinement: int,
) -> Solid:
    design = pieces.design
    role = design.fitted_role.name
    scene, state = design.scene(role), equilibrium.state
    half = 0.5 * scene.size / _SLENDERNESS
    plain = np.array([[half, half], [-half, half], [-half, -half], [half, -half]])
    mesh = sweep(scene, state, plain, refinement)
    of_chain = np.array(
        [
            _WOOD if piece is None else colours[piece.kind][piece.part]
            for piece in PlacedPieces.of(pieces, role).chain_pieces
        ]
    )
    placed = placement.apply(mesh.vertices)
    turn = upright(placed)
    rods = placed @ turn.T
    low, high = rods.min(axis=0), rods.max(axis=0)
    base = np.array([*(0.5 * (low + high)[:2]), low[2]])
    outline = next((c.section.outline for c in scene.chains if c.section is not None), plain)
    return Solid(
        Body(rods - base, mesh.faces, of_chain[mesh.chains[mesh.faces[:, 0]]]),
        placement.apply(state.positions[design.joints]) @ turn.T - base,
        float(np.ptp(outline, axis=0).max()),
        (high - low)[:2],
        float((high - low)[2]),
    )


def _framing(points: np.ndarray, direction: np.ndarray, aspect: float) -> Camera:
    """A camera in a direction (3,) from which points (n, 3) fill a picture as wide as `aspect`
    times its height."""
    half = float(np.tan(0.5 * _ANGLE))
    target = 0.5 * (points.min(axis=0) + points.max(axis=0))
    distance = 3 * float(np.linalg.norm(np.ptp(points, axis=0)))
    for _ in range(6):  # both settle: perspective changes little with the place
        camera = Camera(target + distance * direction, target, float(_ANGLE))
        right, up, forward = camera.axes()
        local = (points - camera.eye) @ np.stack([right, up, forward]).T
        shares = local[:, :2] / local[:, 2:] / (half * np.array([aspect, 1.0]))
        low, high = shares.min(axis=0), shares.max(axis=0)
        middle = 0.5 * (low + high) * distance * half
        target = target + middle[0] * aspect * right + middle[1] * up
        distance *= max(float(np.max(high - low)) / (2 * _FILLED), 0.3)
    return Camera(target + distance * direction, target, float(_ANGLE))


def _handy(most: float) -> float:
    """The largest handy length that is not above `most`."""
    unit = 10.0 ** np.floor(np.log10(most))
    return float(f"{max(k for k in _HANDY if k * unit <= most * (1 + 1e-9)) * unit:.6g}")


def _pixel(camera: Camera, point: np.ndarray, width: int, height: int) -> tuple[float, float]:
    x, y, z = camera.axes() @ (point - camera.eye)
    scale = 0.5 * height / np.tan(0.5 * camera.angle)
    return 0.5 * width + scale * x / z, 0.5 * height - scale * y / z


def _labelled(pixels: np.ndarray, at: tuple[float, float], text: str) -> Image.Image:
    """The picture with a text below a place."""
    height, width = pixels.shape[:2]
    with style():
        figure = Figure(figsize=(width / 100, height / 100))
        ax = figure.add_axes((0, 0, 1, 1))
        ax.imshow(pixels, interpolation="none")
        ax.set_axis_off()
        ax.text(at[0], min(at[1] + 9, height - 18), text, ha="center", va="top", size=11, color=INK)
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=100)
    return Image.open(io.BytesIO(file.getvalue())).convert("RGB")
