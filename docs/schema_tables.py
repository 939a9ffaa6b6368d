"""The directive ``{fields} CLASS``: a table of a design file's fields, made from the class's JSON
Schema."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.resources import files
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive

_LIMITS = {
    "minimum": "≥ {}",
    "exclusiveMinimum": "> {:.4g}",
    "maximum": "≤ {}",
    "exclusiveMaximum": "< {:.4g}",
    "minItems": "at least {}",
    "maxItems": "at most {}",
}
_OPTIONAL = ", optional"
_SHARED = {
    "point2": "[x, y]",
    "point3": "[x, y, z]",
    "positive": "number > 0",
    "name": "text",
    "material": "object",
    "section": "object",
}


def schema(name: str) -> dict[str, Any]:
    """The schema of a structure class, or "design": what all of them have."""
    folder, suffix = (
        ("io", "schemas/design.schema.json")
        if name == "design"
        else (f"structures/{name}", f"{name}.schema.json")
    )
    return json.loads((files("kop_exudyn") / folder / suffix).read_text(encoding="utf-8"))


def rows(content: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, str, str]]:
    """(field, type and limits, description) of all fields; fields of a field have its name before a
    dot."""
    required = content.get("required", ())
    for name, value in content.get("properties", {}).items():
        if isinstance(value, dict):
            field = f"{prefix}{name}"
            yield (
                field,
                _kind(value) + ("" if name in required else _OPTIONAL),
                value.get("description", ""),
            )
            yield from rows(_defined(value), f"{field}.")
            if isinstance(items := value.get("items"), dict):
                yield from rows(items, f"{field}[].")


def _defined(value: dict[str, Any]) -> dict[str, Any]:
    """What a reference to the schema of all classes stands for; anything else itself."""
    address, _, name = value.get("$ref", "").partition("#/$defs/")
    if not address:
        return value
    common = files("kop_exudyn") / "io" / "schemas" / "common.schema.json"
    return json.loads(common.read_text(encoding="utf-8"))["$defs"][name]


def _kind(value: dict[str, Any]) -> str:
    if "enum" in value or "const" in value:
        return " | ".join(json.dumps(choice) for choice in value.get("enum", [value.get("const")]))
    if "$ref" in value:
        name = value["$ref"].rsplit("/", 1)[-1]
        return _SHARED.get(name, name)
    kind = value.get("type", "one of several")
    limits = [form.format(value[key]) for key, form in _LIMITS.items() if key in value]
    return ", ".join([" or ".join([kind] if isinstance(kind, str) else kind), *limits])


class Fields(Directive):
    """The table, with the fields of all designs first."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        found = {row[0]: row for row in rows(schema("design"))}
        for field, kind, meaning in rows(schema(self.arguments[0])):
            needed = field in found and not found[field][1].endswith(_OPTIONAL)
            found[field] = (field, kind.removesuffix(_OPTIONAL) if needed else kind, meaning)
        return [_table(("field", "value", "meaning"), found.values())]


def _table(head: tuple[str, ...], body) -> nodes.table:
    group = nodes.tgroup(cols=len(head))
    group += [nodes.colspec(colwidth=width) for width in (25, 30, 45)]
    group += nodes.thead("", _row(head))
    group += nodes.tbody("", *(_row(row, code=True) for row in body))
    return nodes.table("", group)


def _row(cells, code: bool = False) -> nodes.row:
    made = [
        nodes.literal(text=cell) if code and not k else nodes.Text(cell)
        for k, cell in enumerate(cells)
    ]
    return nodes.row("", *(nodes.entry("", nodes.paragraph("", "", cell)) for cell in made))


def setup(app) -> dict[str, Any]:
    app.add_directive("fields", Fields)
    return {"parallel_read_safe": True}
