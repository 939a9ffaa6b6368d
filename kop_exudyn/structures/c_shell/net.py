"""C-shells of drawn nets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..nets import NetClass, register_net


def _content(curves: Sequence[Mapping[str, Any]], options: Mapping[str, Any]) -> dict[str, Any]:
    """All curves are hinged wherever they cross."""
    opening = {"angle": options["opening"]}
    if options["side"] is not None:
        opening["side"] = options["side"]
    own = {
        "curves": list(curves),
        "crossings": "find",
        "free_ends": options["free_ends"],
        "opening": opening,
    }
    return own if options["target"] is None else own | {"target": options["target"]}


register_net(
    "c_shell",
    NetClass(
        "a C-shell",
        "C-shells",
        _content,
        options=("opening", "side", "target", "free_ends"),
        needed=("opening",),
    ),
)
