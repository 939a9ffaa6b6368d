"""Nets as OBJ files."""

from __future__ import annotations

import numpy as np
from drawings import (
    NET,
    Net,
    Refused,
    case,
    edges,
    mixed,
    obj,
)


@case("lines.obj", Net())
def _obj_lines() -> str:
    return obj(NET)


@case("negative_numbers.obj", Net())
def _negative() -> str:
    return obj(NET, numbers="-2 -1")


@case("textures_and_comments.obj", Net())
def _slashes() -> str:
    return obj(NET, "# a net\nmtllib net.mtl\no net\ng laths\nusemtl wood", "{}/1 {}/2 # a lath")


@case("windows_line_ends.obj", Net())
def _crlf() -> str:
    return obj(NET).replace("\n", "\r\n")


@case("continued_lines.obj", Net())
def _continued() -> str:
    return obj(NET, numbers="{} \\\n {}")


@case("vertices_first.obj", Net(findings={"joined": 1}))
def _shared_vertices() -> str:
    """As Blender writes edges: all vertices, then all edges between them."""
    points = sorted({point for piece in edges() for point in piece})
    number = {point: k + 1 for k, point in enumerate(points)}
    text = ["o Grid", *(f"v {x} {y} 0.0" for x, y in points)]
    text += [f"l {number[a]} {number[b]}" for a, b in mixed(edges())]
    return "\n".join([*text, ""])


@case("elevated.obj", Net())
def _obj_elevated() -> str:
    return obj(NET, z=12.5)


@case("map_coordinates.obj", Net(tolerance=1e-8))
def _obj_map() -> str:
    return obj([[(x + 2.6e6, y + 1.2e6) for x, y in line] for line in NET], z=430.0)


@case("in_millimetres.obj", Net(unit="m", options={"scale": 0.001, "unit": "m"}))
def _obj_mm() -> str:
    return obj(1000 * np.array(NET))


@case("tiny.obj", Net(length=12e-6))
def _obj_tiny() -> str:
    return obj(1e-6 * np.array(NET))


@case("huge.obj", Net(length=12e7))
def _obj_huge() -> str:
    return obj(1e7 * np.array(NET))


def rhombus(half_angle: float, n: int = 3) -> list[np.ndarray]:
    """Whole laths of a scissor net with tips, of n spans each."""
    u, v = (np.array([np.cos(a), np.sin(a)]) for a in (half_angle, -half_angle))
    laths = [np.array([k * v, k * v + n * u]) for k in range(n + 1)]
    return laths + [np.array([k * u, k * u + n * v]) for k in range(n + 1)]


for _degrees in (6, 15, 40, 50, 75, 84):
    case(f"scissor_tips_{_degrees}.obj", Net(8, 16, 24.0, findings={"hinged": 1}))(
        lambda degrees=_degrees: obj(rhombus(np.radians(degrees)))
    )


@case("scissor_edges_with_tips.obj", Net(8, 16, 24.0, findings={"hinged": 1, "joined": 1}))
def _scissor_edges() -> str:
    pieces = []
    for lath in rhombus(np.radians(15)):
        stops = np.linspace(lath[0], lath[1], 4)
        pieces += list(zip(stops[:-1].tolist(), stops[1:].tolist()))
    return obj(mixed(pieces))


@case(
    "scissor_never_joined.obj",
    Net(8, 16, 24.0, options={"join": "never"}, findings={"hinged": 1}),
)
def _never() -> str:
    return obj(rhombus(np.radians(15)))


@case(
    "scissor_joined_by_turns.obj",
    Net(
        6,
        14,
        24.0,
        options={"join": "always", "kind": "polyline"},
        findings={"hinged": 1, "joined": 1, "suspicious": 1},
    ),
)
def _always() -> str:
    """At the obtuse tips two laths become one, of both families."""
    return obj(rhombus(np.radians(15)))


@case(
    "ring_of_pieces.obj",
    Net(11, 24, 2 * np.pi * 5 + 8 * 1.5, findings={"joined": 1}, tolerance=1e-3),
)
def _ring() -> str:
    pieces: list = []
    angles = np.linspace(0, 2 * np.pi, 49)
    for radius in (1.5, 2.5, 1.0):
        points = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        pieces += list(zip(points[:-1].tolist(), points[1:].tolist()))
    for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False) + 0.01:
        direction = np.array([np.cos(angle), np.sin(angle)])
        pieces.append([(0.8 * direction).tolist(), (2.7 * direction).tolist()])
    return obj(pieces)


@case("saddle_in_space.obj", Net(options={"space": True}, length=12.0, tolerance=0.2))
def _saddle() -> str:
    text = []
    t = np.linspace(-0.2, 2.2, 13)
    for k in range(3):
        for x, y in ((t, np.full(13, float(k))), (np.full(13, float(k)), t)):
            z = 0.2 * (x - 1) * (y - 1)
            text += [f"v {a!r} {b!r} {c!r}" for a, b, c in np.stack([x, y, z], 1).tolist()]
            text.append("l " + " ".join(str(n - 13) for n in range(13)))
    return "\n".join([*text, ""])


@case("passing_in_space.obj", Refused("must lie in a plane"))
def _passing() -> str:
    lower = obj(NET[:3])
    upper = obj(NET[3:], numbers="-2 -1", z=0.5)
    return lower + upper


@case(
    "faces_only.obj",
    Refused("contains no curves (1 face, which is a surface's: --edges reads them"),
)
def _faces() -> str:
    return "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@case("surfaces_only.obj", Refused("contains no curves (1 surf element)"))
def _surface_only() -> str:
    head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\ncstype bezier\ndeg 1 1\n"
    return head + "surf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1\nend\n"


@case("bad_number.obj", Refused("expected three coordinates of a vertex"))
def _bad_number() -> str:
    return "v 0 0 0\nv 1,5 0 0\nl 1 2\n"


@case("bad_vertex.obj", Refused("no such vertex"))
def _bad_vertex() -> str:
    return "v 0 0 0\nv 1 0 0\nl 1 3\n"
