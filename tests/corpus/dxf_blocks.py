"""Nets in blocks that are inserted: scaled, turned, mirrored, nested, in rows."""

from __future__ import annotations

from drawings import (
    NET,
    Net,
    case,
    dxf,
    lines,
)


@case("block.dxf", Net())
def _block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref("NET", (7, -3))

    return dxf(draw)


@case("block_scaled_and_turned.dxf", Net(length=30.0))
def _scaled_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref(
            "NET", (7, -3), dxfattribs={"xscale": 2.5, "yscale": 2.5, "rotation": 33}
        )

    return dxf(draw)


@case("block_mirrored.dxf", Net())
def _mirrored_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref("NET", (1, 1), dxfattribs={"xscale": -1.0})

    return dxf(draw)


@case("block_stretched.dxf", Net(length=6 * 2 + 6 * 3))
def _stretched_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("NET"))
        space.add_blockref("NET", (0, 0), dxfattribs={"xscale": 2.0, "yscale": 3.0})

    return dxf(draw)


@case("blocks_nested.dxf", Net(length=12 * 0.5))
def _nested() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("HALF"), NET[:3])
        whole = document.blocks.new("WHOLE")
        whole.add_blockref("HALF", (0, 0))
        whole.add_blockref("HALF", (2, 0), dxfattribs={"rotation": 90})
        space.add_blockref("WHOLE", (0, 5), dxfattribs={"xscale": 0.5, "yscale": 0.5})

    return dxf(draw)


@case("block_array.dxf", Net())
def _array() -> bytes:
    """One lath inserted as an array of three, in both directions."""

    def draw(document, space):
        document.blocks.new("LATH").add_line((-0.2, 0), (2.2, 0))
        rows = {"row_count": 3, "row_spacing": 1.0}
        space.add_blockref("LATH", (0, 0), dxfattribs=rows)
        space.add_blockref("LATH", (2, 0), dxfattribs={"rotation": 90} | rows)

    return dxf(draw)


@case("block_and_lines.dxf", Net())
def _half_block() -> bytes:
    def draw(document, space):
        lines(document.blocks.new("HALF"), NET[3:])
        lines(space, NET[:3])
        space.add_blockref("HALF", (0, 0))

    return dxf(draw)


@case("block_that_is_missing.dxf", Net(findings={"suspicious": 1}))
def _missing_block() -> bytes:
    def draw(document, space):
        lines(space)
        space.add_blockref("NOT_HERE", (0, 0))

    return dxf(draw)
