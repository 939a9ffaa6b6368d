"""The curves of a DXF file's model space, in world coordinates, blocks included.

Read is what can be seen: not layers that are off or frozen, not entities that are hidden, not the
layer Defpoints, which never prints. Layers that are asked for by name are read in any case.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..fabrication.dxf import load_ezdxf
from ..files.documents import LARGEST
from .drawing import Drawing, DrawnCurve

_DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "SPLINE", "ARC", "CIRCLE", "ELLIPSE")
# of the drawing's size: how far points of arcs and splines may leave them between each other
_SAG = 1e-4
_BINARY = b"AutoCAD Binary DXF"
_DEEPEST = 20  # blocks within blocks
_MOST_ENTITIES = 200_000
# $INSUNITS -> name, metres
_UNITS = {
    1: ("in", 0.0254),
    2: ("ft", 0.3048),
    3: ("miles", 1609.344),
    4: ("mm", 1e-3),
    5: ("cm", 1e-2),
    6: ("m", 1.0),
    7: ("km", 1e3),
    10: ("yards", 0.9144),
    13: ("micrometres", 1e-6),
    14: ("dm", 0.1),
    21: ("US survey feet", 1200 / 3937),
}


def dxf_drawing(content: bytes, layers: Sequence[str]) -> Drawing:
    """The drawing in a DXF file's bytes. Raises InputError for what can't be read, and for layers
    that aren't there."""
    document = _document(load_ezdxf(), content)
    space = document.modelspace()
    wanted = {name.lower() for name in layers}
    frozen = {layer.dxf.name.lower() for layer in document.layers if layer.is_frozen()}
    entities = list(_exploded(space, frozen))
    known = {layer for _, layer, _ in entities} | {layer.dxf.name for layer in document.layers}
    for layer in layers:
        if layer.lower() not in {name.lower() for name in known}:
            used = sorted({layer for _, layer, _ in entities})
            raise InputError(
                f"no such layer (there are {', '.join(used) or 'none'})",
                field="layer",
                value=layer,
            )
    hidden = set() if layers else _hidden_layers(document)
    unseen: Counter[str] = Counter()
    others: Counter[str] = Counter()
    drawn = []
    for entity, layer, label in entities:
        if wanted and layer.lower() not in wanted:
            continue
        if layer.lower() in hidden or entity.dxf.get("invisible", 0) and not wanted:
            unseen[layer] += 1
        elif entity.dxftype() not in _DRAWN or _is_mesh(entity):
            others[entity.dxftype() + (" mesh" if _is_mesh(entity) else "")] += 1
        else:
            drawn.append((_path_of(entity, label), label))
    skipped = [
        f"{n} on the hidden layer {layer} (--layer {layer} reads them)"
        for layer, n in unseen.items()
    ]
    if others:
        skipped.append("no curves: " + ", ".join(f"{n} {name}" for name, n in others.items()))
    empty = sum(path is None for path, _ in drawn)
    if empty:
        skipped.append(f"{empty} curves of a single point")
    name, metres = _UNITS.get(document.header.get("$INSUNITS", 0), (None, None))
    paths = [(path, label) for path, label in drawn if path is not None]
    return Drawing(list(_flattened(paths)), name, metres, skipped)


def _document(ezdxf: Any, content: bytes) -> Any:
    try:
        if content.startswith(_BINARY):
            from ezdxf.document import Drawing as Document
            from ezdxf.lldxf.tagger import binary_tags_loader

            document = Document.load(binary_tags_loader(content))
            auditor = document.audit()
        else:
            from ezdxf import recover

            document, auditor = recover.read(io.BytesIO(content))
    except Exception as error:  # its readers raise whatever the broken file leads them to
        raise InputError(f"can't be read as DXF: {str(error)[:100]}") from None
    if auditor.has_errors:
        raise InputError(f"damaged DXF file: {auditor.errors[0].message}")
    return document


def _hidden_layers(document: Any) -> set[str]:
    """Names, in small letters, of layers that aren't shown."""
    hidden = {
        layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()
    }
    return hidden | {"defpoints"}


def _exploded(
    entities: Any,
    frozen: set[str],
    outer: str = "0",
    within: str = "",
    depth: int = 0,
    count: list[int] | None = None,
) -> Iterator[tuple[Any, str, str]]:
    """Entities with their layers and labels; those of inserted blocks instead of the insertions.

    What lies on layer 0 of a block is on the layer that the block is inserted on, and so is all of
    it where that layer is frozen.
    """
    count = [0] if count is None else count
    for entity in entities:
        count[0] += 1
        if count[0] > _MOST_ENTITIES:
            raise InputError(f"draws more than {_MOST_ENTITIES:,} entities, blocks included")
        # entities that only the drawing's program knows have no layer
        own = entity.dxf.layer if entity.dxf.is_supported("layer") else ""
        layer = outer if within and (own == "0" or outer.lower() in frozen) else own
        if entity.dxftype() != "INSERT":
            handle = entity.dxf.handle
            yield entity, layer, f"{entity.dxftype()} {handle or count[0]}{within}"
            continue
        if depth == _DEEPEST:
            raise InputError(f"has blocks within blocks, more than {_DEEPEST} deep")
        name = f" of block {entity.dxf.name}"
        for single in entity.multi_insert() if entity.mcount > 1 else (entity,):
            yield from _exploded(_content(single), frozen, layer, name, depth + 1, count)


def _content(insert: Any) -> list[Any]:
    """What an inserted block draws, in the coordinates outside of it."""
    if insert.block() is None:  # of another file
        return []
    try:
        return list(insert.virtual_entities())
    except Exception as error:
        raise InputError(
            f"its block can't be laid out: {str(error)[:100]}", field=f"INSERT {insert.dxf.name}"
        ) from None


def _is_mesh(entity: Any) -> bool:
    return entity.dxftype() == "POLYLINE" and (entity.is_polygon_mesh or entity.is_poly_face_mesh)


def _path_of(entity: Any, label: str) -> Any:
    """An entity as a path of lines and Bezier curves; None for one of a single point."""
    from ezdxf import path as paths

    try:
        path = paths.make_path(entity)
    except Exception as error:  # splines without knots, ...
        raise InputError(
            f"can't be read as a curve: {str(error)[:100]}", field=f"{label}{_begin(entity)}"
        ) from None
    points = np.array([tuple(point) for point in path.control_vertices()]).reshape(-1, 3)
    if not (np.abs(points) <= LARGEST).all():
        raise InputError("is no curve: expected points within 1e60", field=label)
    return path if len(points) > 1 and np.ptp(points, axis=0).any() else None


def _begin(entity: Any) -> str:
    """Where an entity begins, as far as it says so: handles mean nothing to who draws."""
    for name in ("start", "insert", "center"):
        place = entity.dxf.get(name) if entity.dxf.is_supported(name) else None
        if place is not None:
            return f" at {_place(place)}"
    return ""


def _place(point: Iterable[float]) -> str:
    return f"({', '.join(f'{value:.6g}' for value in point)})"


def _flattened(paths: Sequence[tuple[Any, str]]) -> Iterator[DrawnCurve]:
    """Points on the paths, dense enough for the size of all of them."""
    corners = [tuple(point) for path, _ in paths for point in path.control_vertices()]
    if not corners:
        return
    sag = _SAG * float(np.linalg.norm(np.ptp(np.array(corners), axis=0)))
    for path, label in paths:
        points = np.array(
            [tuple(point) for point in path.flattening(sag)]
            if path.has_curves
            else [tuple(point) for point in path.control_vertices()]
        )
        closed = path.is_closed and len(points) > 3
        kind, _, within = label.partition(" ")
        block = f" {within.partition(' ')[2]}" if " " in within else ""
        name = f"{kind}{block} from {_place(points[0])}"
        yield DrawnCurve(points[: len(points) - closed], closed, name)
