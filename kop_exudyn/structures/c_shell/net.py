"""C-shells of drawn nets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..nets import NetClass, register_net


def _content(curves: Sequence[Mapping[str, Any]], options: Mapping[str, Any]) -> dict[str, Any]:
    """All curves are hinged wherever they cross."""
    own = {
        "curves": list(curves),
        "crossings": "find",
        "free_ends": options["free_ends"],
        "opening": {"angle": options["opening"]},
    }
    return own if options["target"] is None else own | {"target": options["target"]}


register_net(
    "c_shell",
    NetClass(
        "a C-shell",
        "C-shells",
        _content,
        options=("opening", "target", "free_ends"),
        needed=("opening",),
    ),
)
