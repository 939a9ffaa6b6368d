"""Networks of planar curves: joints where two curves cross, and each curve's joints in order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InputError
from .crossings import TOLERANCE, Crossing, find_crossings, given_crossings, size_of
from .curves import Curve, curve_from_dict, direction

_RIGHT = np.radians(0.5)  # means of angles this close to 90 degrees count as right ones
_EQUAL = 1e-3  # mean difference of directions (their doubled cosines) that tells nothing
_LEAST_LOOP = 3  # joints: two corners can't close a loop of straight pieces


@dataclass(frozen=True)
class Strand:
    """One curve as the network uses it: from joint to joint, with or without free ends.

    joints (J,) : numbers of its joints, in order
    stations (J,) : their arc lengths; increasing
    angles (J,) : continuous directions of the tangent there, rad
    head, tail : lengths of the free ends before the first and after the last joint, 0 where trimmed
        or in a loop
    """

    curve: Curve
    joints: np.ndarray
    stations: np.ndarray
    angles: np.ndarray
    head: float = 0.0
    tail: float = 0.0

    @property
    def closed(self) -> bool:
        return self.curve.closed

    @property
    def n_spans(self) -> int:
        """Spans between neighbouring joints: J - 1, or J around a loop."""
        return len(self.joints) - (not self.closed)

    @cached_property
    def ends(self) -> np.ndarray:
        """(n_spans, 2) where each span begins and ends: index into `joints`; a loop's last one ends
        at the first."""
        places = np.arange(len(self.joints))
        return np.stack([places, np.roll(places, -1)], axis=1)[: self.n_spans]

    @cached_property
    def spans(self) -> np.ndarray:
        """(n_spans, 2) stations where each span begins and ends; a loop's last one ends beyond its
        length."""
        following = np.append(self.stations[1:], self.stations[0] + self.curve.length)
        return np.stack([self.stations, following], axis=1)[: self.n_spans]

    @property
    def lengths(self) -> np.ndarray:
        """(n_spans,) arc lengths between neighbouring joints."""
        return self.spans[:, 1] - self.spans[:, 0]

    @cached_property
    def turnings(self) -> np.ndarray:
        """(n_spans,) integrals of the curvature between neighbouring joints, rad."""
        following = np.append(self.angles[1:], self.angles[0] + self.curve.lap_turning)
        return (following - self.angles)[: self.n_spans]

    @property
    def tangents(self) -> np.ndarray:
        """(J, 2) unit tangents at the joints."""
        return direction(self.angles)


@dataclass(frozen=True)
class CurveNetwork:
    """Curves that are hinged to each other where they cross.

    joints (n, 2) : positions
    pairs (n, 2) : the two curves at each joint, the first the one that the joint's axes follow
    places (n, 2) : where on these curves' strands the joint stands: index into their `joints`
    strands : one a curve
    opens (n,) : whether the joint's angle counts as part of the opening, see `families`
    size : diagonal of the curves' bounding box
    """

    joints: np.ndarray
    pairs: np.ndarray
    places: np.ndarray
    strands: tuple[Strand, ...]
    opens: np.ndarray
    size: float

    @property
    def n_joints(self) -> int:
        return len(self.joints)

    @cached_property
    def directions(self) -> np.ndarray:
        """(n, 2) angles of the first and the second curve's tangent at each joint."""
        return np.array(
            [
                [self.strands[c].angles[k] for c, k in zip(pair, place)]
                for pair, place in zip(self.pairs, self.places)
            ]
        )

    @property
    def opening_angles(self) -> np.ndarray:
        """(n,) angle from the first to the second curve, counter-clockwise, in (0, pi), whichever
        way round the curves are drawn."""
        return np.mod(self.directions[:, 1] - self.directions[:, 0], np.pi)


def network(
    curves: Sequence[Curve],
    crossings: str | Sequence[Mapping[str, Any]] = "find",
    free_ends: bool = False,
    *,
    acute: bool = False,
    ends_kept_by: str = "",
    tolerance: float = 0.0,
) -> CurveNetwork:
    """Join curves where they cross.

    crossings : "find" for all there are, or a list as for `crossings.given_crossings`
    free_ends : whether curves go on beyond their first and last joint
    acute : whether the first family is chosen by the shape of the net (see `acute_first`), so that
        the order in which the curves are given tells nothing; otherwise it is that of the first one
    ends_kept_by : what a reader sets so that free ends stay, for errors; "" where nothing does
    tolerance : a length within which points are the same

    Raises InputError, naming the curve, where no structure comes of it: a curve that crosses no
    other, crosses itself, touches or overlaps another, three curves through one point, parts that
    aren't connected.
    """
    if len(curves) < 2:
        raise InputError("a network needs at least two curves", field="curves")
    points = (
        find_crossings(curves) if isinstance(crossings, str) else given_crossings(curves, crossings)
    )
    _refuse_triple_points(curves, points, max(tolerance, TOLERANCE * size_of(curves)))
    _refuse_unconnected(curves, points)
    first_family, opens = families(len(curves), points)
    pairs = np.array([c.curves for c in points])
    pairs = np.where(first_family[:, None], pairs, pairs[:, ::-1])
    along: list[list[tuple[float, int]]] = [[] for _ in curves]
    for n, crossing in enumerate(points):
        for curve, station in zip(crossing.curves, crossing.stations):
            along[curve].append((station, n))
    strands = tuple(
        _strand(curve, sorted(own), free_ends, ends_kept_by) for curve, own in zip(curves, along)
    )
    place = [{joint: k for k, joint in enumerate(s.joints.tolist())} for s in strands]
    places = np.array([[place[c][n] for c in pair] for n, pair in enumerate(pairs.tolist())])
    found = CurveNetwork(
        np.array([c.position for c in points]), pairs, places, strands, opens, size_of(curves)
    )
    return acute_first(found) if acute else found


def network_from_dict(data: Mapping[str, Any]) -> CurveNetwork:
    """The network of a design file's fields `curves`, `crossings` and `free_ends`.

    Up to version 1 of the files the first curve was of the first family, whatever the shape.
    """
    curves = [curve_from_dict(entry, f"curves[{k}]") for k, entry in enumerate(data["curves"])]
    crossings, free_ends = data.get("crossings", "find"), bool(data.get("free_ends", False))
    acute = data.get("version", 1) > 1
    return network(curves, crossings, free_ends, acute=acute, ends_kept_by="free_ends")


def acute_first(network: CurveNetwork) -> CurveNetwork:
    """The same network, its opening measured across the acute angles of the whole net.

    The opening angle of a joint is that from the first family of curves to the second one, counter-
    clockwise. Of the two families the first one is that from which the mean angle is below 90
    degrees; so laths that turn towards each other close, and a positive opening opens the narrow
    sectors. Where the mean is 90 degrees (to half a degree), the first family is the one that runs
    rather along x; of nets that don't run either way, the one that runs rather along the diagonal
    x = y; of those that don't either, the longer one.
    """
    if not network.opens.any():
        return network
    mean = float(network.opening_angles[network.opens].mean())
    if mean < 0.5 * np.pi - _RIGHT:
        return network
    if mean > 0.5 * np.pi + _RIGHT or _second_leads(network):
        return replace(network, pairs=network.pairs[:, ::-1], places=network.places[:, ::-1])
    return network


def _second_leads(network: CurveNetwork) -> bool:
    """Whether the second family comes first among families at right angles."""
    twice = 2 * network.directions[network.opens]
    lengths = [
        sum(network.strands[c].curve.length for c in np.unique(network.pairs[network.opens, side]))
        for side in (0, 1)
    ]
    lead = [
        float(np.diff(np.cos(twice), axis=1).mean()),
        float(np.diff(np.sin(twice), axis=1).mean()),
        (lengths[1] - lengths[0]) / network.size,
    ]
    return next((value > 0 for value in lead if abs(value) > _EQUAL), False)


def families(n_curves: int, crossings: Sequence[Crossing]) -> tuple[np.ndarray, np.ndarray]:
    """Sort the curves into two families that cross only each other, as far as that goes.

    A scissor net opens by turning one family against the other; then every angle from the first
    family to the second grows, however the curves were drawn. Families are given out along
    crossings, from curve 0. Where two curves of one family cross (three families, say), the joint
    turns freely and is left out of the opening.

    Returns for each crossing whether its lower-numbered curve comes first, and whether it counts as
    opening.
    """
    neighbours: list[list[int]] = [[] for _ in range(n_curves)]
    for crossing in crossings:
        a, b = crossing.curves
        neighbours[a].append(b)
        neighbours[b].append(a)
    family = [0] + [-1] * (n_curves - 1)
    queue = [0]
    for curve in queue:
        for other in neighbours[curve]:
            if family[other] < 0:
                family[other] = 1 - family[curve]
                queue.append(other)
    pairs = np.array([c.curves for c in crossings])
    of = np.array(family)[pairs]
    return of[:, 0] <= of[:, 1], of[:, 0] != of[:, 1]


def middle_joint(positions: np.ndarray) -> int:
    """The joint nearest to the mean of all (n, 2 or 3); of equally near ones the first: round-off
    must not choose."""
    distances = np.linalg.norm(positions - positions.mean(axis=0), axis=1)
    return int(np.argmax(distances <= distances.min() + TOLERANCE * distances.max()))


def _strand(
    curve: Curve, own: Sequence[tuple[float, int]], free_ends: bool, ends_kept_by: str
) -> Strand:
    """A curve as the network uses it; own: stations and numbers of its joints, in order."""
    stations, joints = np.array([s for s, _ in own]), np.array([n for _, n in own])
    if curve.closed and len(own) < _LEAST_LOOP:
        raise InputError(
            f"a closed curve needs at least {_LEAST_LOOP} joints, this one has {len(own)}",
            field=curve.field,
        )
    if len(own) == 1 and not free_ends:
        how = f" ({ends_kept_by} keeps them)" if ends_kept_by else ""
        raise InputError(
            f"nothing is left of a curve with one joint when its free ends are cut off{how}",
            field=curve.field,
        )
    head, tail = (
        (0.0, 0.0) if curve.closed or not free_ends else (stations[0], curve.length - stations[-1])
    )
    negligible = TOLERANCE * curve.length
    strand = Strand(
        curve,
        joints,
        stations,
        curve.angle(stations),
        *(x if x > negligible else 0.0 for x in (head, tail)),
    )
    if len(strand.lengths) and strand.lengths.min() <= negligible:
        raise InputError("two joints at the same place", field=curve.field)
    return strand


def _refuse_triple_points(
    curves: Sequence[Curve], crossings: Sequence[Crossing], tolerance: float
) -> None:
    from scipy.spatial import cKDTree

    if not crossings:
        return
    for a, b in sorted(cKDTree([c.position for c in crossings]).query_pairs(tolerance)):
        *others, last = (
            curves[k].field for k in sorted({*crossings[a].curves, *crossings[b].curves})
        )
        raise InputError(
            f"passes through one point {{place}} with {', '.join(others)}: a joint holds two "
            "curves",
            field=last,
            places=[crossings[a].position],
        )


def _refuse_unconnected(curves: Sequence[Curve], crossings: Sequence[Crossing]) -> None:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs = np.array([c.curves for c in crossings], int).reshape(-1, 2)
    lonely = np.flatnonzero(np.bincount(pairs.ravel(), minlength=len(curves)) == 0)
    if len(lonely):
        raise InputError("crosses no other curve", field=curves[lonely[0]].field)
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(curves),) * 2)
    parts, label = connected_components(graph, directed=False)
    if parts > 1:
        stray = int(np.flatnonzero(label != label[0])[0])
        raise InputError(
            f"is not connected with {curves[0].field}: the network falls into {parts} parts",
            field=curves[stray].field,
        )
