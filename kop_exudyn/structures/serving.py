"""Designs whose elements are made of another kind of parts than they say, such as linear ones of
slit parts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import replace

from ..errors import InputError
from ..kit.kinds import part_kind
from .base import MADE_ANEW, Design


def served_by(designs: Sequence[Design], kinds: Collection[str]) -> list[Design]:
    """The designs as a kit with these kinds of parts builds them.

    Elements of a kind that the kit has no parts of are given to the kind that serves them too (see
    `PartKind.serves`); designs without such elements are returned as they are.

    Raises InputError where a kit has parts of both kinds: which elements are for which of them
    isn't decided by any search.
    """
    instead: dict[str, str] = {}
    for kind in kinds:
        served = part_kind(kind).serves
        if served is None:
            continue
        if served in kinds:
            raise InputError(
                f"{served} elements are made of {served} parts or of {kind} parts, not of both: "
                "ask for one of them",
                field=f"parts.{kind}",
            )
        instead[served] = kind
    return [_with_kinds(design, instead) for design in designs]


def _with_kinds(design: Design, instead: dict[str, str]) -> Design:
    if not any(group.kind in instead for group in design.groups):
        return design
    other = copy(design)
    for name in MADE_ANEW:
        other.__dict__.pop(name, None)
    other.groups = [
        replace(group, kind=instead.get(group.kind, group.kind)) for group in design.groups
    ]
    return other
