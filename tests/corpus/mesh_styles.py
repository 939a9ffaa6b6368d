"""A unit square of two triangles as STL and PLY files of many kinds."""

from __future__ import annotations

from drawings import Refused
from meshes import Surface, case

SQUARE = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
WELDED = Surface(4, 2, 1.0, notes=1)
PLAIN = Surface(4, 2, 1.0)
HEAD = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(
    f"property float {axis}\n" for axis in "xyz"
)
POINTS = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE)
FACES = "element face 2\nproperty list uchar int vertex_index\nend_header\n"


def facet(*corners: int) -> str:
    places = "".join("   vertex {} {} {}\n".format(*SQUARE[k]) for k in corners)
    return f" facet normal 0 0 1\n  outer loop\n{places}  endloop\n endfacet\n"


@case("two_solids.stl", WELDED)
def _two_solids() -> str:
    first = f"solid a\n{facet(0, 1, 2)}endsolid a\n"
    return first + f"solid b\n{facet(1, 3, 2)}endsolid b\n"


@case("capital_letters.stl", WELDED)
def _capitals() -> str:
    return f"solid a\n{facet(0, 1, 2)}{facet(1, 3, 2)}endsolid a\n".upper()


@case("without_its_end.stl", Refused("contains no faces"))
def _without_end() -> str:
    return f"solid a\n{facet(0, 1, 2)}{facet(1, 3, 2)}"


@case("not_a_number.stl", Refused("contains no faces between finite vertices"))
def _nan() -> str:
    body = facet(0, 1, 2).replace("vertex 1", "vertex nan")
    return f"solid a\n{body}{facet(1, 3, 2)}endsolid a\n"


@case("singular_name_of_faces.ply", PLAIN)
def _singular() -> str:
    return HEAD + FACES + POINTS + "3 0 1 2\n3 1 3 2\n"


@case("windows_line_ends.ply", PLAIN)
def _windows() -> str:
    return _singular().replace("\n", "\r\n")


@case("comments.ply", PLAIN)
def _comments() -> str:
    return _singular().replace("1.0\n", "1.0\ncomment made by hand\nobj_info x\n", 1)


@case("coordinates_in_another_order.ply", PLAIN)
def _order() -> str:
    head = HEAD.replace("float x", "float w").replace("float z", "float x")
    points = "".join(f"{z} {y} {x}\n" for x, y, z in SQUARE)
    return head.replace("float w", "float z") + FACES + points + "3 0 1 2\n3 1 3 2\n"


@case("polygon.ply", PLAIN)
def _polygon() -> str:
    return HEAD + FACES.replace("face 2", "face 1") + POINTS + "4 0 1 3 2\n"


@case("triangle_strips.ply", PLAIN)
def _strips() -> str:
    strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    return HEAD + strips + POINTS + "4 0 1 2 3\n"


@case("points_alone.ply", Refused("contains no faces"))
def _points() -> str:
    return HEAD + "end_header\n" + POINTS


@case("vertex_that_is_missing.ply", Refused("names a vertex that isn't there (there are 4)"))
def _missing() -> str:
    return HEAD + FACES.replace("face 2", "face 1") + POINTS + "3 0 1 9\n"


@case("mesh_byte_order_mark.obj", PLAIN)
def _bom() -> bytes:
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in SQUARE) + "f 1 2 3\nf -3 -1 -2\n"
    return b"\xef\xbb\xbf" + text.encode()
