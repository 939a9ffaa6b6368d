"""How nets are drawn as CAD programs write them, as DXF and OBJ files, and what must come out of
each; the files themselves are in the modules that use this one.

Most show the same net: three lines along x, three along y, one apart, that go on by 0.2 beyond
their last joints: 6 curves, 9 joints, 12 units of length between the joints.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import ezdxf
import numpy as np
from ezdxf import units

_IMPERIAL = (units.IN, units.FT, units.MI, units.YD, 8, 9)


NET = [((-0.2, k), (2.2, k)) for k in range(3)] + [((k, -0.2), (k, 2.2)) for k in range(3)]


@dataclass(frozen=True)
class Net:
    """What must come out of a drawn net.

    curves, joints; length : of all spans, in the design's unit
    unit : of the design, None where it isn't known
    options : of `ReadingOptions`, besides "scale", "unit" and "space", which are asked for
    findings : kind -> how many findings
    """

    curves: int = 6
    joints: int = 9
    length: float = 12.0
    unit: str | None = None
    options: dict[str, Any] = field(default_factory=dict)
    findings: dict[str, int] = field(default_factory=dict)
    tolerance: float = 1e-6


@dataclass(frozen=True)
class Refused:
    """A file that is refused: words of the message, and the options under which it is read."""

    message: str
    options: dict[str, Any] = field(default_factory=dict)


CASES: dict[str, tuple[Callable[[], bytes], Net | Refused]] = {}


def case(name: str, expected: Net | Refused) -> Callable:
    """Decorator: a file of the corpus and what must come out of it."""

    def add(make: Callable[[], bytes | str]) -> Callable:
        def content() -> bytes:
            made = make()
            return made.encode() if isinstance(made, str) else made

        CASES[name] = (content, expected)
        return make

    return add


def size_doubts(metres: float) -> dict[str, int]:
    """The findings of the net, of 3.4 units, where no net is of such a size."""
    return {} if 0.02 < 3.4 * metres < 300 else {"suspicious": 1}


def in_metres(metres: float) -> Net:
    """The net in metres, of a file with another unit."""
    net = Net(unit="m", length=12 * metres, options={"unit": "m"})
    return replace(net, findings=size_doubts(metres))


def dxf(draw: Callable[[Any, Any], None], version: str = "R2010", unit: int | None = None) -> bytes:
    """The file that a function of document and model space draws."""
    ezdxf.options.write_fixed_meta_data_for_testing = True
    document = ezdxf.new(version)
    if unit is not None:
        document.units = unit
        if unit in _IMPERIAL:
            document.header["$MEASUREMENT"] = 0
    elif version != "R12":
        document.header["$INSUNITS"] = 0
    draw(document, document.modelspace())
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode(document.output_encoding)


def lines(space: Any, net: Any = NET, **attributes: Any) -> None:
    for start, end in net:
        space.add_line(start, end, dxfattribs=attributes)


def noise(space: Any, layer: str) -> None:
    """Lines that would make the net another one."""
    lines(space, [((-0.5, -0.5), (2.5, 2.5)), ((0.5, -0.2), (0.5, 2.2))], layer=layer)


def edges() -> list[tuple]:
    """Every piece of the net between its joints for itself, the ends beyond them too."""
    stops = (-0.2, 0.0, 1.0, 2.0, 2.2)
    along = [((a, k), (b, k)) for k in range(3) for a, b in zip(stops, stops[1:])]
    return along + [((y0, x0), (y1, x1)) for (x0, y0), (x1, y1) in along]


def mixed(pieces: list, seed: int = 1) -> list:
    """In another order, some of them the other way round."""
    rng = np.random.default_rng(seed)
    return [pieces[k][:: rng.choice([1, -1])] for k in rng.permutation(len(pieces))]


def obj(net: Any, head: str = "", numbers: str = "{} {}", z: float = 0.0) -> str:
    """Lines with vertices of their own."""
    text = [head] if head else []
    for k, line in enumerate(net):
        text += [f"v {x!r} {y!r} {z!r}" for x, y in np.asarray(line, float)[:, :2].tolist()]
        text.append("l " + numbers.format(2 * k + 1, 2 * k + 2))
    return "\n".join([*text, ""])
