"""Layers, sheets and what else a DXF file holds beside the net."""

from __future__ import annotations

from typing import Any

from drawings import (
    Net,
    Refused,
    case,
    dxf,
    lines,
    noise,
)


def with_layers(document: Any) -> None:
    document.layers.add("LATHS")
    document.layers.add("FROZEN").freeze()
    document.layers.add("OFF").off()


@case("layers_hidden.dxf", Net(findings={"skipped": 2}))
def _hidden() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space, layer="LATHS")
        noise(space, "FROZEN")
        noise(space, "OFF")

    return dxf(draw)


@case("layers_hidden_asked_for.dxf", Net(7, 12, 14.0, options={"layers": ["LATHS", "off"]}))
def _asked_for() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space, layer="LATHS")
        lines(space, [((0.5, -0.2), (0.5, 2.2))], layer="OFF")

    return dxf(draw)


@case("layer_unknown.dxf", Refused("no such layer", {"layers": ["RODS"]}))
def _unknown_layer() -> bytes:
    return dxf(lambda document, space: lines(space))


@case("layer_chosen.dxf", Net(options={"layers": ["laths"]}))
def _chosen() -> bytes:
    def draw(document, space):
        with_layers(document)
        document.layers.add("FRAME")
        lines(space, layer="LATHS")
        noise(space, "FRAME")

    return dxf(draw)


@case("layer_defpoints.dxf", Net(findings={"skipped": 1}))
def _defpoints() -> bytes:
    def draw(document, space):
        lines(space)
        noise(space, "Defpoints")

    return dxf(draw)


@case("block_on_a_frozen_layer.dxf", Net(findings={"skipped": 1}))
def _frozen_block() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space)
        noise(document.blocks.new("EXTRA"), "LATHS")
        space.add_blockref("EXTRA", (0, 0), dxfattribs={"layer": "FROZEN"})

    return dxf(draw)


@case("block_on_layer_0_inserted_on_a_hidden_layer.dxf", Net(findings={"skipped": 1}))
def _layer_0() -> bytes:
    def draw(document, space):
        with_layers(document)
        lines(space)
        noise(document.blocks.new("EXTRA"), "0")
        space.add_blockref("EXTRA", (0, 0), dxfattribs={"layer": "OFF"})

    return dxf(draw)


@case("entities_invisible.dxf", Net(findings={"skipped": 1}))
def _invisible() -> bytes:
    def draw(document, space):
        lines(space)
        lines(space, [((0.5, -0.2), (0.5, 2.2))], invisible=1)

    return dxf(draw)


@case("paper_space.dxf", Net())
def _paper() -> bytes:
    def draw(document, space):
        lines(space)
        noise(document.paperspace(), "0")

    return dxf(draw)


@case("paper_space_only.dxf", Refused("entities on the sheet Layout1: draw the net in model"))
def _paper_only() -> bytes:
    return dxf(lambda document, space: lines(document.paperspace()))


@case("texts_dimensions_hatches.dxf", Net(findings={"skipped": 1}))
def _annotated() -> bytes:
    def draw(document, space):
        lines(space)
        space.add_text("LATH 1")
        space.add_mtext("two\nlines")
        space.add_point((1, 1))
        space.add_linear_dim(base=(0, -1), p1=(0, 0), p2=(2, 0)).render()
        space.add_hatch().paths.add_polyline_path([(0, 0), (1, 0), (1, 1)])
        space.add_3dface([(0, 0), (1, 0), (1, 1), (0, 1)])
        space.add_xline((0.5, 0), (0, 1))

    return dxf(draw)


@case("texts_only.dxf", Refused("contains no curves (no curves: 1 TEXT)"))
def _texts() -> bytes:
    return dxf(lambda document, space: space.add_text("nothing drawn"))


@case("polyface_mesh.dxf", Net(findings={"skipped": 1}))
def _polyface() -> bytes:
    def draw(document, space):
        lines(space)
        mesh = space.add_polyface()
        mesh.append_faces([[(0, 0, 0), (1, 0, 0), (1, 1, 1)]])

    return dxf(draw)
