"""The curves of a JSON file: those of COMPAS, alone, in lists or in dictionaries, whose keys are
layers; and bare lists of points, as scripts write them.

COMPAS has written an object's content under "data" since version 1.0, and under "value" before;
circles had planes, and frames names of types.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..checks import LARGEST
from ..errors import InputError
from ..geometry.nurbs import spline_points
from .drawing import Drawing
from .outlines import Outline, flattened

_COMPAS = b"compas.geometry"


def holds_curves(content: bytes) -> bool:
    """Whether a JSON file has curves that are read here; False where it can't be read at all."""
    if _COMPAS not in content and not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"["):
        return False
    try:
        return any(kind in _READERS for kind, _, _ in _objects(_parsed(content), ""))
    except InputError as error:
        return error.field is not None  # there are curves, and what isn't one is named when read
    except RecursionError:
        return False


def json_drawing(content: bytes, layers: Sequence[str]) -> Drawing:
    """The drawing in a JSON file's bytes.

    layers : keys of the outermost dictionary, those to read; default: all

    Raises InputError for what can't be read, and for layers that aren't there.
    """
    found = list(_objects(_parsed(content), ""))
    known = sorted({layer for _, _, layer in found if layer})
    for name in layers:
        if name not in known:
            there = ", ".join(known) or "none"
            raise InputError(f"no such key (there are {there})", field="layer", value=name)
    numbers = {len(points[0]) for points in _bare(found)}
    if len(numbers) > 1:
        raise InputError("has lists of points of two and of three numbers: are some no points?")
    outlines: list[tuple[Outline, str]] = []
    others: Counter[str] = Counter()
    for kind, data, layer in found:
        if layers and layer not in layers:
            continue
        if kind not in _READERS:
            others[kind] += 1
            continue
        label = f"{kind} {len(outlines) + 1}"
        outlines.append((_read(kind, data, layer, label), label))
    skipped = ["no curves: " + ", ".join(f"{n} {kind}" for kind, n in others.items())]
    return Drawing(list(flattened(outlines)), skipped=skipped if others else [])


def _parsed(content: bytes) -> Any:
    try:
        return json.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"can't be read as JSON: {str(error)[:100]}") from None


def _objects(data: Any, layer: str, outermost: bool = True) -> Iterator[tuple[str, Any, str]]:
    """Kind, content and layer of all objects of COMPAS, and of bare lists of points that stand in
    lists from the outside on: in dictionaries these might be anything."""
    if isinstance(data, Mapping):
        if isinstance(data.get("dtype"), str):
            name = data["dtype"].rpartition("/")[2]
            yield name, data.get("data", data.get("value")), layer
            return
        for key, item in data.items():
            yield from _objects(item, layer or str(key), False)
    elif isinstance(data, list):
        if outermost and _is_points(data):
            yield "Polyline", {"points": data}, layer
            return
        if outermost:
            _check_siblings(data)
        for item in data:
            yield from _objects(item, layer, outermost)


def _check_siblings(items: list[Any]) -> None:
    """Raise InputError, naming the item, for what is no curve in a list of others that are: it
    would be missing from the net."""
    curves = [_holds_points(item) for item in items]
    if not any(curves):
        return
    for k, item in enumerate(items):
        layer = isinstance(item, list) and item and all(map(_holds_points, item))
        if curves[k] or layer or isinstance(item, Mapping) and isinstance(item.get("dtype"), str):
            continue
        wrong, value = f"[{k}]", item
        if isinstance(item, list) and len(item) > 1:
            n = next((n for n, point in enumerate(item) if not _is_points([point] * 2)), None)
            # each a point for itself: of two and of three numbers
            wrong, value = (wrong, item) if n is None else (f"{wrong}[{n}]", item[n])
        raise InputError(
            "is no curve, as those beside it are: expected two or more points of two, or all of "
            "three, numbers",
            field=wrong,
            value=value,
        )


def _bare(found: Sequence[tuple[str, Any, str]]) -> Iterator[list[list[float]]]:
    """The points of polylines that are given as lists of numbers."""
    for kind, data, _ in found:
        points = data.get("points") if kind == "Polyline" and isinstance(data, Mapping) else None
        if isinstance(points, list) and points and isinstance(points[0], list):
            yield points


def _holds_points(item: Any) -> bool:
    return isinstance(item, list) and _is_points(item)


def _is_points(data: list[Any]) -> bool:
    """Whether a list has two or more points of two, or all of three, numbers."""
    lengths = {len(point) if isinstance(point, list) else 0 for point in data}
    return (
        len(data) > 1
        and lengths in ({2}, {3})
        and all(type(x) in (int, float) for point in data for x in point)
    )


def _read(kind: str, data: Any, layer: str, label: str) -> Outline:
    try:
        corners, points = _READERS[kind](data)
        ends = points(np.inf)
    except InputError as error:
        raise InputError(error.message, field=label) from None
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise InputError(f"can't be read as a curve: {str(error)[:100]}", field=label) from None
    if len(corners) < 2 or not (np.abs(corners) <= LARGEST).all():
        raise InputError("is no curve: expected two or more points within 1e60", field=label)
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    closed = float(np.linalg.norm(ends[0] - ends[-1])) <= 1e-9 * size
    return Outline(corners, points, closed, layer or None)


_Read = tuple[np.ndarray, Callable[[float], np.ndarray]]


def _line(data: Mapping[str, Any]) -> _Read:
    return _straight(_points([data["start"], data["end"]]))


def _polyline(data: Mapping[str, Any]) -> _Read:
    return _straight(_points(data["points"]))


def _polygon(data: Mapping[str, Any]) -> _Read:
    points = _points(data["points"])
    return _straight(np.concatenate([points, points[:1]]))


def _straight(points: np.ndarray) -> _Read:
    return points, lambda sag: points


def _arc(data: Mapping[str, Any]) -> _Read:
    radius = float(data["radius"])
    return _round(data, radius, radius, float(data["start_angle"]), float(data["end_angle"]))


def _circle(data: Mapping[str, Any]) -> _Read:
    radius = float(data["radius"])
    return _round(data, radius, radius, 0.0, 2 * np.pi)


def _ellipse(data: Mapping[str, Any]) -> _Read:
    return _round(data, float(data["major"]), float(data["minor"]), 0.0, 2 * np.pi)


def _round(data: Mapping[str, Any], a: float, b: float, begin: float, end: float) -> _Read:
    """An ellipse's part between two parameters, half axes a and b."""
    if not (0 < a <= LARGEST and 0 < b <= LARGEST and 0 < abs(end - begin) <= 7):
        raise InputError("is no curve: expected positive radii, and angles apart")
    middle, x, y = _axes(data)

    def points(sag: float) -> np.ndarray:
        # the sag of a chord over an angle t is a t^2 / 8 at most
        step = min(0.5, float(np.sqrt(8 * sag / max(a, b))))
        t = np.linspace(begin, end, 2 + int(np.ceil(abs(end - begin) / step)))
        return middle + a * np.cos(t)[:, None] * x + b * np.sin(t)[:, None] * y

    return points(np.inf), points


def _axes(data: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle, and directions of a plane's two axes: of a frame, or of a plane by its normal."""
    frame = data["frame"] if "frame" in data else data["plane"]
    frame = frame.get("data", frame.get("value", frame))
    middle = _points([frame["point"]])[0]
    if "normal" in frame:
        n = _unit(_points([frame["normal"]])[0])
        x = _unit(np.cross(n, np.eye(3)[np.argmin(np.abs(n))]))
        return middle, x, np.cross(n, x)
    x, y = _points([frame["xaxis"], frame["yaxis"]])
    x = _unit(x)
    return middle, x, _unit(y - (y @ x) * x)


def _unit(vector: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if not 0 < length <= LARGEST:
        raise InputError("has an axis without direction")
    return vector / length


def _bezier(data: Mapping[str, Any]) -> _Read:
    control = _points(data["points"])
    return _spline(control, [0.0] * len(control) + [1.0] * len(control), len(control) - 1, None)


def _nurbs(data: Mapping[str, Any]) -> _Read:
    control, degree = _points(data["points"]), int(data["degree"])
    knots = np.repeat(np.array(data["knots"], float), data["multiplicities"]).tolist()
    if len(knots) == len(control) + degree - 1:  # Rhino leaves the first and the last one out
        knots = [*knots[:1], *knots, *knots[-1:]]
    return _spline(control, knots, degree, data.get("weights"))


def _spline(
    control: np.ndarray, knots: Sequence[float], degree: int, weights: Sequence[float] | None
) -> _Read:
    return control, lambda sag: spline_points(control, knots, degree, weights, sag)


def _points(points: Sequence[Any]) -> np.ndarray:
    """Points (n, 3), given as numbers or as objects; of two numbers in the plane z = 0."""
    bare = [p.get("data", p.get("value")) if isinstance(p, Mapping) else p for p in points]
    return np.array([[*map(float, p), 0.0][:3] for p in bare]).reshape(-1, 3)


_READERS: dict[str, Callable[[Any], _Read]] = {
    "Line": _line,
    "Polyline": _polyline,
    "Polygon": _polygon,
    "Arc": _arc,
    "Circle": _circle,
    "Ellipse": _ellipse,
    "Bezier": _bezier,
    "NurbsCurve": _nurbs,
}
