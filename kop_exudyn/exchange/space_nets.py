"""Nets that are drawn in space: the surface that they lie on, and whether it can be laid flat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from scipy.interpolate import RBFInterpolator

from ..errors import InputError
from ..geometry.mesh_surface import MeshSurface
from .drawing import Finding, path_of
from .drawn_networks import DrawnNetwork

_MARGIN = 0.08  # of the plan's size, by which the mesh goes beyond the net
_MOST_POINTS = 700  # that the surface is put through: one dense system of equations
_APART = 0.02  # of the size: curves that cross in plan and are farther apart pass each other
_NOTED = 1e-3  # of the size: such distances are worth a word
_FLAT_CELLS = 100
_STRETCHED = 5e-3  # change of lengths up to which a net can be laid flat
UPS = {(0, 1): "z", (2, 0): "y", (1, 2): "x"}


def surface_through(drawn: DrawnNetwork, cells: int = 40) -> tuple[np.ndarray, np.ndarray, str]:
    """Vertices (V, 3) and faces (F, 3), in the design's units, of a smooth surface through a net
    that is drawn in space, and the axis ("x", "y" or "z") across which it is a height field.

    It is the thin-plate spline through the curves' points (Duchon 1977).

    cells : of the mesh, along each side

    Raises InputError where the net folds over, seen along that axis.
    """
    axes = drawn.frame.axes
    up = UPS[(int(np.argmax(axes[0])), int(np.argmax(axes[1])))]
    points = np.concatenate([_densely(curve.points, curve.closed) for curve in drawn.curves])
    local = drawn.options.scale * drawn.frame(points)
    plan, kept = np.unique(local[:, :2].round(12), axis=0, return_index=True)
    heights = local[kept, 2]
    centre, size = plan.mean(axis=0), float(np.linalg.norm(np.ptp(plan, axis=0)))
    near = _thinned((plan - centre) / size)
    spline = RBFInterpolator((plan[near] - centre) / size, heights[near])
    low, high = plan.min(axis=0) - _MARGIN * size, plan.max(axis=0) + _MARGIN * size
    u, v = (np.linspace(a, b, cells + 1) for a, b in zip(low, high))
    grid = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    z = spline((grid - centre) / size)
    if not np.isfinite(z).all():
        raise InputError("folds over, seen along its shortest side: give its --surface")
    vertices = np.column_stack([grid, z]) @ axes
    k = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return vertices, faces, up


def with_heights_checked(drawn: DrawnNetwork) -> DrawnNetwork:
    """The same net, with a finding where curves that cross in plan are apart in space.

    Raises InputError, naming the curves, where they pass each other.
    """
    net, scale = drawn.network, drawn.options.scale
    apart = []
    for joint, (pair, place) in enumerate(zip(net.pairs, net.places)):
        heights = [
            _height_at(drawn, int(c), float(net.strands[c].stations[k]))
            for c, k in zip(pair, place)
        ]
        apart.append(abs(heights[0] - heights[1]) * scale)
        if apart[-1] > _APART * net.size:
            first, second = (drawn.labels[c] for c in pair)
            raise InputError(
                f"passes {second} at a distance of {apart[-1]:.3g} where they cross in plan, at "
                "{place}: laths are hinged where they meet",
                field=first,
                places=[drawn.place(net.joints[joint])],
            )
    largest = max(apart)
    if largest <= _NOTED * net.size:
        return drawn
    text = f"curves are up to {largest:.3g} apart in space where they cross; hinged all the same"
    return replace(drawn, findings=[*drawn.findings, Finding("suspicious", text)])


def laid_flat(drawn: DrawnNetwork) -> DrawnNetwork:
    """A net that is drawn in space on a developable surface, a part of a cylinder or a cone, say,
    unrolled into the plane.

    The smooth surface through the curves is mapped to the plane conformally, which is without any
    change of lengths where the surface is developable.

    Raises InputError, with the change of lengths, where it isn't.
    """
    drawn = with_heights_checked(drawn)
    vertices, faces, _ = surface_through(drawn, _FLAT_CELLS)
    hull = shapely.MultiPoint(np.concatenate([e["points"] for e in drawn.entries])).convex_hull
    plan = vertices @ drawn.frame.axes.T[:, :2]
    cell = float(np.linalg.norm(plan[1] - plan[0]))
    near = shapely.distance(shapely.points(plan[faces].mean(axis=1)), hull) <= cell
    mesh = MeshSurface(vertices, faces[near], "conformal")
    space, flat = [], []
    for curve in drawn.curves:
        points = drawn.options.scale * _densely(curve.points, curve.closed)
        space.append(np.linalg.norm(np.diff(points, axis=0), axis=1))
        flat.append(np.linalg.norm(np.diff(mesh.parameters_of(points)[0], axis=0), axis=1))
    # lengths over a twentieth of a curve: the mesh's faces show in shorter ones
    lengths = np.array([_in_parts(a, 20) for a in space]).ravel()
    ratios = np.array([_in_parts(a, 20) for a in flat]).ravel() / lengths
    scale = 1.0 / float(np.average(ratios, weights=lengths))
    change = float(np.abs(scale * ratios - 1).max())
    if change > _STRETCHED:
        raise InputError(
            "the net is drawn in space, on a surface that can't be laid flat: lengths would change "
            f"by up to {100 * change:.2g} %. Draw the flat net, or import it as a grid (--as grid)"
        )
    entries = [
        entry | {"points": (scale * mesh.parameters_of(drawn.options.scale * c.points)[0]).tolist()}
        for entry, c in zip(drawn.entries, drawn.curves)
    ]
    text = f"drawn in space and laid flat; lengths change by up to {100 * change:.2g} %"
    return replace(drawn, entries=entries, findings=[*drawn.findings, Finding("cleaned", text)])


def _in_parts(lengths: np.ndarray, n: int) -> np.ndarray:
    """Lengths (n,) of a curve's parts, of the lengths (m,) of its pieces."""
    return np.array([part.sum() for part in np.array_split(lengths, n)])


def _height_at(drawn: DrawnNetwork, curve: int, station: float) -> float:
    """Height of a drawn curve over the plan's arc length, by its polyline."""
    local = drawn.frame(drawn.curves[curve].path)
    steps = np.linalg.norm(np.diff(local[:, :2], axis=0), axis=1)
    stations = np.concatenate([[0.0], np.cumsum(steps)])
    share = station / drawn.network.strands[curve].curve.length
    return float(np.interp(share * stations[-1], stations, local[:, 2]))


def _densely(points: np.ndarray, closed: bool) -> np.ndarray:
    """A curve's points and a few between each two, on the smooth curve through them."""
    from scipy.interpolate import CubicSpline

    points = path_of(points, closed)
    t = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if len(points) < 3:
        return points[0] + np.linspace(0, 1, 20)[:, None] * (points[1] - points[0])
    spline = CubicSpline(t, points, bc_type="periodic" if closed else "natural")
    inner = np.linspace(t[:-1], t[1:], max(2, 200 // len(points)), endpoint=False).T.ravel()
    return spline(np.append(inner, t[-1]))


def _thinned(plan: np.ndarray) -> np.ndarray:
    """Numbers of points (n, 2) no two of which share a cell of a grid, as fine as it can be."""
    step = 2e-3
    while True:
        cells = np.round(plan / step).astype(int)
        kept = np.sort(np.unique(cells, axis=0, return_index=True)[1])
        if len(kept) <= _MOST_POINTS:
            return kept
        step *= 1.3
