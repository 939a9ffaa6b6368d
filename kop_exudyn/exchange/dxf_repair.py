"""DXF files whose entities lack the names of their classes (group code 100), as scripts write them:
CAD programs read them all the same."""

from __future__ import annotations

from collections.abc import Iterator

# The entities that can't be read without, and the name of their own class.
_CLASSES = {
    "LWPOLYLINE": "AcDbPolyline",
    "SPLINE": "AcDbSpline",
    "MLINE": "AcDbMline",
    "MTEXT": "AcDbMText",
    "LEADER": "AcDbLeader",
    "MESH": "AcDbSubDMesh",
}
_VERSION = "AC1015"  # of AutoCAD 2000
# Group codes that all entities have (DXF reference, Common Group Codes for Entities): those of
# the object, those of its look.
_OBJECT = {"5", "102", "330", "360"}
_LOOK = {"8", "6", "62", "48", "60", "67", "370", "410", "420", "430", "440", "390", "284", "347"}


def with_classes(content: bytes) -> bytes:
    """The text of a DXF file with the names of classes put in where entities have none."""
    lines = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n").decode("latin-1").split("\n")
    tags = _newer(list(zip(lines[::2], lines[1::2])))
    return "\n".join(f"{code}\n{value}" for code, value in _repaired(tags)).encode("latin-1")


def _newer(tags: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """With the version of files that have names of classes: in older ones they mean nothing."""
    for k, (_, value) in enumerate(tags[:-1]):
        if value.strip() == "$ACADVER":
            version = max(tags[k + 1][1].strip(), _VERSION)
            return [*tags[: k + 1], ("1", version), *tags[k + 2 :]]
    head = [("0", "SECTION"), ("2", "HEADER"), ("9", "$ACADVER"), ("1", _VERSION), ("0", "ENDSEC")]
    return head + tags


def _repaired(tags: list[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    start = 0
    for k in range(1, len(tags) + 1):
        if k < len(tags) and tags[k][0].strip() != "0":
            continue
        yield from _entity(tags[start:k])
        start = k


def _entity(tags: list[tuple[str, str]]) -> list[tuple[str, str]]:
    name = _CLASSES.get(tags[0][1].strip())
    if name is None or any(code.strip() == "100" for code, _ in tags):
        return tags
    head = [tag for tag in tags[1:] if tag[0].strip() in _OBJECT]
    look = [tag for tag in tags[1:] if tag[0].strip() in _LOOK]
    rest = [tag for tag in tags[1:] if tag[0].strip() not in _OBJECT | _LOOK]
    return [tags[0], *head, ("100", "AcDbEntity"), *look, ("100", name), *rest]
