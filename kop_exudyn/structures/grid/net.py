"""Grids over drawn nets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..nets import NetClass, register_net
from .design import grid_on


def _content(curves: Sequence[Mapping[str, Any]], options: Mapping[str, Any]) -> dict[str, Any]:
    """A lamella along each curve, over a surface."""
    own = {
        "surface": options["surface"],
        "network": {"type": "curves", "curves": list(curves)},
    }
    return own if options["held"] is None else own | {"held": options["held"]}


register_net(
    "grid",
    NetClass("a grid", "grids", _content, options=("surface", "chart", "held"), on_surface=grid_on),
)
