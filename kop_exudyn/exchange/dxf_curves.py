"""The curves of a DXF file's model space, in world coordinates, blocks included.

Read is what can be seen: not layers that are off or frozen, not entities that are hidden or in a
hidden block, not the layer Defpoints, which never prints. Layers that are asked for by name are
read in any case. What can't be read is named: blocks of other files, texts, solids.
"""

from __future__ import annotations

import codecs
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..fabrication.dxf import load_ezdxf
from ..wording import counted
from .drawing import Drawing
from .dxf_clips import Clip, clip_of, shown
from .dxf_outlines import outline_of
from .dxf_repair import with_classes
from .outlines import flattened

_DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "SPLINE", "HELIX", "ARC", "CIRCLE", "ELLIPSE", "MLINE")
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
    8: ("microinches", 2.54e-8),
    9: ("mils", 2.54e-5),
    10: ("yards", 0.9144),
    11: ("ångströms", 1e-10),
    12: ("nanometres", 1e-9),
    13: ("micrometres", 1e-6),
    14: ("dm", 0.1),
    15: ("decametres", 10.0),
    16: ("hectometres", 100.0),
    17: ("gigametres", 1e9),
    18: ("astronomical units", 149_597_870_700.0),
    19: ("light years", 9_460_730_472_580_800.0),
    20: ("parsecs", 648_000 / np.pi * 149_597_870_700.0),
    21: ("US survey feet", 1200 / 3937),
    22: ("US survey inches", 100 / 3937),
    23: ("US survey yards", 3600 / 3937),
    24: ("US survey miles", 5280 * 1200 / 3937),
}
_IMPERIAL = {1, 2, 3, 8, 9, 10}
# what the names of codes begin with, under which entities are left out as damaged
_LOST = ("REMOVED_INVALID_GRAPHIC", "REMOVED_ENTITY", "UNDEFINED_BLOCK", "INVALID_SPLINE")
_END = re.compile(rb"EOF\s*\0?\s*$")


@dataclass(frozen=True)
class _Placed:
    """An entity, as its block or the model space has it.

    matrix : from there into the drawing's coordinates; None: they are the drawing's
    layer : that it is seen on
    label : what messages call it
    invisible : whether it, or a block that it is of, is hidden
    clips : of the blocks that it is of
    """

    entity: Any
    matrix: Any
    layer: str
    label: str
    invisible: bool
    clips: tuple[Clip, ...] = ()


def dxf_drawing(content: bytes, layers: Sequence[str]) -> Drawing:
    """The drawing in a DXF file's bytes. Raises InputError for what can't be read, and for layers
    that aren't there."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        content = content.decode("utf-16", errors="replace").encode()
    document, doubts = _document(load_ezdxf(), content)
    space = document.modelspace()
    wanted = {name.lower() for name in layers}
    frozen = {layer.dxf.name.lower() for layer in document.layers if layer.is_frozen()}
    entities = list(_exploded(space, frozen))
    known = {e.layer for e in entities} | {layer.dxf.name for layer in document.layers}
    for layer in layers:
        if layer.lower() not in {name.lower() for name in known}:
            used = sorted({e.layer for e in entities})
            raise InputError(
                f"no such layer (there are {', '.join(used) or 'none'})",
                field="layer",
                value=layer,
            )
    hidden = set() if layers else _hidden_layers(document)
    unseen: Counter[str] = Counter()
    others: Counter[str] = Counter()
    elsewhere: Counter[str] = Counter()
    drawn = []
    for e in entities:
        if wanted and e.layer.lower() not in wanted:
            continue
        if e.layer.lower() in hidden or e.invisible and not wanted:
            what = "on the hidden layer" if e.layer.lower() in hidden else "hidden on the layer"
            unseen[f"{what} {e.layer} (--layer {e.layer} reads them)"] += 1
        elif e.entity.dxftype() == "INSERT":
            elsewhere[e.entity.dxf.name] += 1
        elif e.entity.dxftype() not in _DRAWN or _is_mesh(e.entity):
            others[e.entity.dxftype() + (" mesh" if _is_mesh(e.entity) else "")] += 1
        else:
            outline = outline_of(e.entity, e.label, e.matrix)
            if outline is None or shown(outline, e.clips, e.label):
                drawn.append((outline, e))
            else:
                unseen[f"outside the clip (XCLIP) of block {e.clips[-1].block}"] += 1
    skipped = [f"{n} {what}" for what, n in unseen.items()]
    skipped += [
        f"{counted(n, 'insertion')} of {name}, a block of another file: bind it to this one, or "
        "import that file"
        for name, n in elsewhere.items()
    ]
    if others:
        skipped.append("no curves: " + ", ".join(f"{n} {name}" for name, n in others.items()))
    empty = sum(outline is None for outline, _ in drawn)
    if empty:
        skipped.append(f"{counted(empty, 'curve')} of a single point")
    if not _END.search(content):
        doubts.append("the file has no end (EOF): it may be cut off, and curves missing")
    if not entities:
        skipped += _on_paper(document)
    code = document.header.get("$INSUNITS", 0)
    name, metres = _UNITS.get(code, (None, None))
    if name is None and code != 0:
        doubts.append(f"its unit of length has the number {code}, which isn't known: give --scale")
    if code in _IMPERIAL and document.header.get("$MEASUREMENT") == 1:
        doubts.append(
            f"its unit of length ($INSUNITS) is {name}, but its system ($MEASUREMENT) is metric: "
            "if its numbers are mm, say, give --scale and --unit"
        )
    outlines = [
        (replace(outline, layer=e.layer), e.label) for outline, e in drawn if outline is not None
    ]
    return Drawing(list(flattened(outlines)), name, metres, skipped, doubts)


def _document(ezdxf: Any, content: bytes) -> tuple[Any, list[str]]:
    """The document, and in words what was left out of it as damaged."""
    from ezdxf.audit import AuditError
    from ezdxf.lldxf.const import DXFStructureError

    try:
        if content.startswith(_BINARY):
            from ezdxf.document import Drawing as Document
            from ezdxf.lldxf.tagger import binary_tags_loader

            document = Document.load(binary_tags_loader(content))
            auditor = document.audit()
        else:
            from ezdxf import recover

            if b"\n" not in content:  # lines as old Macintosh programs end them
                content = content.replace(b"\r", b"\n")
            try:
                document, auditor = recover.read(io.BytesIO(content))
            except DXFStructureError as error:
                if "subclass" not in str(error):
                    raise
                document, auditor = recover.read(io.BytesIO(with_classes(content)))
    except Exception as error:  # its readers raise whatever the broken file leads them to
        raise InputError(f"can't be read as DXF: {str(error)[:100]}") from None
    if auditor.has_errors:
        raise InputError(f"damaged DXF file: {auditor.errors[0].message}")
    lost = [fix.message for fix in auditor.fixes if AuditError(fix.code).name.startswith(_LOST)]
    if not lost:
        return document, []
    return document, [
        f"{counted(len(lost), 'damaged entity is', 'damaged entities are')} left out: "
        f"{lost[0].rstrip('.')}"
    ]


def _on_paper(document: Any) -> list[str]:
    """What is drawn on sheets, in words."""
    counts = {layout.name: len(layout) for layout in document.layouts if not layout.is_modelspace}
    return [
        f"{counted(n, 'entity', 'entities')} on the sheet {name}: draw the net in model "
        "space, at its own size"
        for name, n in counts.items()
        if n
    ]


def _hidden_layers(document: Any) -> set[str]:
    """Names, in small letters, of layers that aren't shown."""
    hidden = {
        layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()
    }
    return hidden | {"defpoints"}


def _exploded(
    entities: Any,
    frozen: set[str],
    outer: _Placed | None = None,
    within: str = "",
    depth: int = 0,
    count: list[int] | None = None,
) -> Iterator[_Placed]:
    """Entities with their layers and labels; those of inserted blocks instead of the insertions,
    but for those of blocks of other files.

    What lies on layer 0 of a block is on the layer that the block is inserted on, and so is all of
    it where that layer is frozen; and all of it is hidden where the insertion is. Blocks within
    stretched and turned ones are sheared, so the maps of all insertions are multiplied: an
    insertion alone can't say that.

    outer : the insertion whose block the entities are of
    """
    count = [0] if count is None else count
    for entity in entities:
        if entity.dxftype() == "ATTDEF":  # a form, which insertions fill in
            continue
        count[0] += 1
        _refuse_many(count[0])
        # entities that only the drawing's program knows have neither
        own = entity.dxf.layer if entity.dxf.is_supported("layer") else ""
        hidden = entity.dxf.is_supported("invisible") and entity.dxf.get("invisible", 0)
        of_outer = outer is not None and (own == "0" or outer.layer.lower() in frozen)
        placed = _Placed(
            entity,
            None if outer is None else outer.matrix,
            outer.layer if outer is not None and of_outer else own,
            f"{entity.dxftype()} {entity.dxf.handle or count[0]}{within}",
            bool(hidden) or outer is not None and outer.invisible,
            () if outer is None else outer.clips,
        )
        if entity.dxftype() != "INSERT" or _elsewhere(entity):
            yield placed
            continue
        if depth == _DEEPEST:
            raise InputError(f"has blocks within blocks, more than {_DEEPEST} deep")
        name = f" of block {entity.dxf.name}"
        # an array is refused before it is spread out: of nothing, it would never end
        contents = len(entity.block())
        if not contents:
            continue
        _refuse_many(count[0] + entity.mcount * contents)
        for single in entity.multi_insert() if entity.mcount > 1 else (entity,):
            matrix = single.matrix44()
            matrix = matrix if placed.matrix is None else matrix * placed.matrix
            clip = clip_of(single, placed.matrix)
            clips = placed.clips if clip is None else (*placed.clips, clip)
            inner = replace(placed, matrix=matrix, clips=clips)
            yield from _exploded(entity.block(), frozen, inner, name, depth + 1, count)


def _refuse_many(entities: int) -> None:
    """Raises InputError where there are too many."""
    if entities > _MOST_ENTITIES:
        raise InputError(f"draws more than {_MOST_ENTITIES:,} entities, blocks included")


def _elsewhere(insert: Any) -> bool:
    """Whether an inserted block is of another file."""
    block = insert.block()
    return block is None or block.block.is_xref or block.block.is_xref_overlay


def _is_mesh(entity: Any) -> bool:
    return entity.dxftype() == "POLYLINE" and (entity.is_polygon_mesh or entity.is_poly_face_mesh)
