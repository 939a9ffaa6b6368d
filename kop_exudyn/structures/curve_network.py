"""Networks of planar curves: where they cross, and the spans between neighbouring crossings."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..errors import InputError
from .planar_curve import PlanarCurve

_TOUCH = 1e-7  # of the network's size: ends this close to a curve lie on it
_NEAR_PARALLEL = 0.02  # rad: curves that meet at less have no well-defined crossing


@dataclass(frozen=True)
class Run:
    """One curve with its joints in order.

    curve : the curve; number : its place among the curves
    joints : (k,) joint numbers; of a closed curve the first one is not repeated
    parameters : (k,) where they lie, increasing
    """

    curve: PlanarCurve
    number: int
    joints: np.ndarray
    parameters: np.ndarray

    @property
    def spans(self) -> list[tuple[int, int, float, float]]:
        """(joint, next joint, parameter, next parameter) of neighbours; the last span of a closed curve runs on."""
        j, u = self.joints.tolist(), self.parameters.tolist()
        spans = list(zip(j, j[1:], u, u[1:]))
        if self.curve.closed:
            spans.append((j[-1], j[0], u[-1], u[0] + self.curve.end))
        return spans


@dataclass(frozen=True)
class CurveNetwork:
    """positions (J, 2) of the joints; runs: the curves; pairs (J, 2): the curves that cross at each joint, in the order
    (first, second) such that, where the curves fall into two families, the first is always of the same one."""

    positions: np.ndarray
    runs: list[Run]
    pairs: np.ndarray

    @property
    def size(self) -> float:
        """Bounding-box diagonal."""
        return float(np.linalg.norm(np.ptp(self.positions, axis=0)))


def network_of(curves: Sequence[PlanarCurve], crossings: Any = "find") -> CurveNetwork:
    """Build a network from curves and "find" or a list of {"curves": [a, b], "near": [x, y]}.

    Raises InputError for curves that cross no other, cross themselves, meet three at a point or nearly in parallel, and
    for networks in several pieces.
    """
    size = float(np.linalg.norm(np.ptp(np.concatenate([c.position(c.samples()) for c in curves]), axis=0)))
    found = _find(curves, size) if isinstance(crossings, str) else _given(curves, crossings, size)
    table = np.array(found, dtype=float).reshape(-1, 4)  # curve a, curve b, u on a, u on b
    for number, curve in enumerate(curves):
        if not (table[:, :2] == number).any():
            raise InputError("crosses no other curve", field=curve.field)
    positions = np.array([curves[int(a)].position(u) for a, _, u, _ in table])
    _check_distinct(curves, table, positions, size)
    _check_connected(curves, table)
    runs = [_run(curve, number, table) for number, curve in enumerate(curves)]
    family = _families(len(curves), table)
    order = [(a, b) if family[int(a)] <= family[int(b)] else (b, a) for a, b in table[:, :2].astype(int)]
    return CurveNetwork(positions, runs, np.array(order, int))


def _find(curves: Sequence[PlanarCurve], size: float) -> list[tuple[int, int, float, float]]:
    """All crossings: segments of sampled curves that meet, refined by Newton's method on the curves themselves."""
    samples = [c.samples() for c in curves]
    lines = [c.position(u) for c, u in zip(curves, samples)]
    boxes = [(x.min(0) - _TOUCH * size, x.max(0) + _TOUCH * size) for x in lines]
    found = []
    for a in range(len(curves)):
        _check_self(curves[a], lines[a], size)
        for b in range(a + 1, len(curves)):
            if (boxes[a][0] > boxes[b][1]).any() or (boxes[b][0] > boxes[a][1]).any():
                continue
            hits = [(samples[a][i] + s * (samples[a][i + 1] - samples[a][i]),
                     samples[b][j] + t * (samples[b][j + 1] - samples[b][j]))
                    for i, j, s, t in _segments_meet(lines[a], lines[b], size)]
            refined = [_refine(curves[a], curves[b], u, v, size) for u, v in hits]
            found += [(a, b, u, v) for u, v in _distinct(curves[a], refined, size)]
    return found


def _segments_meet(x: np.ndarray, y: np.ndarray, size: float) -> list[tuple[int, int, float, float]]:
    """(i, j, s, t) of segments of two polylines that meet, ends included with a small margin."""
    p, r = x[:-1, None], np.diff(x, axis=0)[:, None]
    q, d = y[None, :-1], np.diff(y, axis=0)[None]
    cross = r[..., 0] * d[..., 1] - r[..., 1] * d[..., 0]
    gap = q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (gap[..., 0] * d[..., 1] - gap[..., 1] * d[..., 0]) / cross
        t = (gap[..., 0] * r[..., 1] - gap[..., 1] * r[..., 0]) / cross
    # sampled segments cut corners of the curves: allow for their sagitta before the refinement decides
    margin_s = 0.05 + _TOUCH * size / np.linalg.norm(r, axis=-1)
    margin_t = 0.05 + _TOUCH * size / np.linalg.norm(d, axis=-1)
    hit = (s > -margin_s) & (s < 1 + margin_s) & (t > -margin_t) & (t < 1 + margin_t)
    return [(int(i), int(j), float(np.clip(s[i, j], 0, 1)), float(np.clip(t[i, j], 0, 1)))
            for i, j in np.argwhere(hit)]


def _refine(a: PlanarCurve, b: PlanarCurve, u: float, v: float, size: float) -> tuple[float, float] | None:
    """Newton's method for a(u) = b(v), parameters kept on the curves; None when they don't meet there."""
    for _ in range(30):
        gap = a.position(u) - b.position(v)
        J = np.column_stack([a.velocity(u), -b.velocity(v)])
        if abs(np.linalg.det(J)) < _NEAR_PARALLEL * np.linalg.norm(J[:, 0]) * np.linalg.norm(J[:, 1]):
            if np.linalg.norm(gap) < 1e-3 * size:
                raise InputError(f"runs nearly parallel to {b.field} where they meet, near {_shown(a.position(u))}",
                                 field=a.field)
            return None
        step = np.linalg.solve(J, gap)
        u, v = float(a.wrap(u - step[0])), float(b.wrap(v - step[1]))
        if np.abs(step).max() < 1e-15 * size:
            break
    return (u, v) if np.linalg.norm(a.position(u) - b.position(v)) <= _TOUCH * size else None


def _distinct(a: PlanarCurve, hits: list[tuple[float, float] | None], size: float) -> list[tuple[float, float]]:
    kept: list[tuple[float, float]] = []
    for hit in hits:
        if hit is not None and all(np.linalg.norm(a.position(hit[0]) - a.position(k[0])) > 1e-5 * size for k in kept):
            kept.append(hit)
    return kept


def _given(curves: Sequence[PlanarCurve], crossings: Any, size: float) -> list[tuple[int, int, float, float]]:
    found = []
    for k, entry in enumerate(crossings):
        field = f"crossings[{k}]"
        a, b = entry["curves"]
        if not (0 <= a < len(curves) and 0 <= b < len(curves) and a != b):
            raise InputError("names no two curves of this design", field=f"{field}.curves", value=[a, b])
        near = np.array(entry["near"], float)
        starts = []
        for number in (a, b):
            u = curves[number].samples()
            starts.append(float(u[np.argmin(np.linalg.norm(curves[number].position(u) - near, axis=1))]))
        hit = _refine(curves[a], curves[b], *starts, size)
        if hit is None:
            raise InputError("the curves don't cross near there", field=field, value=entry["near"])
        found.append((a, b, *hit) if a < b else (b, a, hit[1], hit[0]))
    return found


def _check_self(curve: PlanarCurve, line: np.ndarray, size: float) -> None:
    n = len(line) - 1
    for i, j, s, t in _segments_meet(line, line, size):
        apart = abs(i - j)
        if apart > 2 and not (curve.closed and apart >= n - 2) and -1e-9 < s < 1 + 1e-9 and -1e-9 < t < 1 + 1e-9:
            x, y = line[i] + s * (line[i + 1] - line[i]), line[j] + t * (line[j + 1] - line[j])
            if np.linalg.norm(x - y) < _TOUCH * size:
                raise InputError(f"crosses itself near {_shown(x)}", field=curve.field)


def _check_distinct(curves: Sequence[PlanarCurve], table: np.ndarray, positions: np.ndarray, size: float) -> None:
    for k in range(1, len(positions)):
        close = np.flatnonzero(np.linalg.norm(positions[:k] - positions[k], axis=1) < 1e-4 * size)
        if len(close):
            names = sorted({curves[int(c)].field for row in (table[k], table[close[0]]) for c in row[:2]})
            raise InputError(f"crossings of {', '.join(names)} lie on top of each other near {_shown(positions[k])}: "
                             "only two curves may meet in a joint", field=names[-1])


def _check_connected(curves: Sequence[PlanarCurve], table: np.ndarray) -> None:
    a, b = table[:, :2].astype(int).T
    count, label = connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(len(curves),) * 2), directed=False)
    if count > 1:
        other = int(np.argmax(label != label[0]))
        raise InputError("the network falls into separate pieces: this curve has no connection to the first",
                         field=curves[other].field)


def _run(curve: PlanarCurve, number: int, table: np.ndarray) -> Run:
    joints = np.concatenate([np.flatnonzero(table[:, 0] == number), np.flatnonzero(table[:, 1] == number)])
    u = np.where(table[joints, 0] == number, table[joints, 2], table[joints, 3])
    order = np.argsort(u)
    if len(joints) < 2:
        raise InputError("has only one joint: a rod needs two to be held", field=curve.field)
    return Run(curve, number, joints[order], u[order])


def _families(n: int, table: np.ndarray) -> list[int]:
    """A two-colouring of the curves where one exists, so that all hinges count angles in the same sense; else 0."""
    neighbours: list[list[int]] = [[] for _ in range(n)]
    for a, b in table[:, :2].astype(int):
        neighbours[a].append(b)
        neighbours[b].append(a)
    family = [-1] * n
    for start in range(n):
        stack = [start] if family[start] < 0 else []
        if stack:
            family[start] = 0
        while stack:
            k = stack.pop()
            for other in neighbours[k]:
                if family[other] < 0:
                    family[other] = 1 - family[k]
                    stack.append(other)
                elif family[other] == family[k]:
                    return [0] * n
    return family


def _shown(x: np.ndarray) -> str:
    return f"({x[0]:.4g}, {x[1]:.4g})"
