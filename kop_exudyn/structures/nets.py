"""Structure classes whose designs are made of drawn nets of curves: what ``kop import`` asks of
them. A class registers its own in its folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..geometry.surfaces import Surface
from ..plugins import Registry
from .base import Design


@dataclass(frozen=True)
class NetClass:
    """How designs of a class are made of a net.

    one, many : as messages call one of them ("a C-shell") and several ("C-shells")
    content : makes the class's own fields of a design file, of the curves (entries of the field
        "curves") and of the options by name. Name, units, material and section are there already.
    options : the options of ``kop import``, as Python spells them, that are for some classes only,
        this among them
    needed : those that no design can be made without
    on_surface : makes the design of a surface and a file's content, while the surface's own file
        isn't written yet. Such classes' curves lie on a surface, in whose parameters they come, and
        the option "surface" is then the field of that name. None: curves come in a plane, and the
        option "target" is the field of that name, or None
    """

    one: str
    many: str
    content: Callable[[Sequence[Mapping[str, Any]], Mapping[str, Any]], dict[str, Any]]
    options: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    on_surface: Callable[[Surface, Mapping[str, Any]], Design] | None = None


NETS: Registry[NetClass] = Registry(__package__, "nets")


def register_net(class_name: str, net: NetClass) -> None:
    """Make ``kop import`` know how designs of a class are made of drawn nets.

    class_name : the field "class" of such files
    net : see `NetClass`
    """
    NETS.add(class_name, net)


def net_class(class_name: str) -> NetClass | None:
    """How designs of a class are made of nets; None where they aren't.

    class_name : the field "class" of such files
    """
    return NETS.get(class_name)


def net_classes() -> dict[str, NetClass]:
    """All classes whose designs are made of nets, by name."""
    return {name: net for name in NETS.names() if (net := NETS.get(name)) is not None}
