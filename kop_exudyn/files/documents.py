"""Documents of this project: JSON objects with a format name and a version, checked by their JSON
Schema."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from ..checks import LARGEST
from ..errors import InputError, did_you_mean

_LONGEST = 160  # characters of a message that quotes what it found
# Of numbers, whose powers stay within double precision, and of whole numbers.
SMALLEST, LARGEST_WHOLE = 1e-60, 2**53
_OURS = "kop_exudyn/"  # begins the names of our formats
_PREFIX = "urn:kop_exudyn:"
_FIELDS = ("additionalProperties", "unevaluatedProperties")  # what refuses unknown ones
_TYPES = {
    "object": "an object",
    "array": "a list",
    "string": "a text",
    "number": "a number",
    "integer": "an integer",
    "boolean": "true or false",
    "null": "null",
}


def is_own(data: Any) -> bool:
    """Whether a file's content says that it is of one of our own formats."""
    return isinstance(data, Mapping) and str(data.get("format", "")).startswith(_OURS)


def check_envelope(data: Any, name: str, version: int, source: Any = None) -> None:
    """Raise InputError unless the data is an object {"format": "kop_exudyn/NAME", "version": ...}
    that we can read."""
    format_name = f"{_OURS}{name}"
    if not isinstance(data, Mapping):
        raise InputError(f"expected an object of the format {format_name!r}", source=source)
    if data.get("format") != format_name:
        raise InputError(
            f"not a {name} file: expected {format_name!r}",
            source=source,
            field="format",
            value=data.get("format", "(missing)"),
        )
    given = data.get("version")
    if isinstance(given, bool) or not isinstance(given, int) or given < 1:
        known = "1" if version == 1 else f"1 to {version}"
        raise InputError(
            f"unknown version; this kop_exudyn reads {known}",
            source=source,
            field="version",
            value="(missing)" if given is None else given,
        )
    if given > version:
        raise InputError(
            f"written for a newer kop_exudyn; this one reads versions up to {version}: upgrade "
            f"with "
            "pip install --upgrade kop_exudyn",
            source=source,
            field="version",
            value=given,
        )


def check_schema(data: Any, schema: str, source: Any = None) -> None:
    """Raise InputError, with the field and the value that are wrong, unless the data meets a
    schema.

    schema : name, as `has_schema` knows it
    """
    if _is_accepted(data, schema):
        return
    from jsonschema.exceptions import best_match

    errors = _validator(schema).iter_errors(data)
    error = best_match(error for error in errors if not _is_a_consequence(error))
    if error is not None:
        raise _as_input_error(error, source)


def check_range(data: Any, source: Any = None) -> None:
    """Raise InputError for numbers that double precision can't work with: beyond 1e60, or below
    1e-60 without being zero, whose powers would leave its range, and whole numbers beyond 2^53.

    Coordinates may be as small as they like, since they are only added to others.
    """
    waiting: list[tuple[list[str | int], Any]] = [([], data)]
    while waiting:
        path, value = waiting.pop()
        if isinstance(value, Mapping):
            waiting += [([*path, key], item) for key, item in value.items()]
        elif isinstance(value, list):
            waiting += [([*path, k], item) for k, item in enumerate(value)]
        elif isinstance(value, (int, float)):
            largest = LARGEST if isinstance(value, float) else LARGEST_WHOLE
            if not -largest <= value <= largest:
                no_number = isinstance(value, float) and not math.isfinite(value)
                raise InputError(
                    "must be finite" if no_number else "is out of range",
                    source=source,
                    field=dotted(path),
                    value=_shown(value),
                )
            if 0 < abs(value) < SMALLEST and isinstance(path[-1], str):
                raise InputError(
                    "is too small to be told from 0", source=source, field=dotted(path), value=value
                )


def _shown(value: int | float) -> str | float:
    """The number, or words for an integer of more than twenty digits."""
    if isinstance(value, float) or abs(value) < 10**20:
        return value
    return f"an integer of {len(str(abs(value)))} digits"


def has_schema(schema: str) -> bool:
    """Whether there is a schema of that name: NAME.schema.json beside this module or among the
    structure classes."""
    return schema in _schemas()


@cache
def _schemas() -> dict[str, dict]:
    """All schemas by name."""
    found = {}
    package = files(__package__.rpartition(".")[0])
    classes = [folder for folder in (package / "structures").iterdir() if folder.is_dir()]
    for folder in (package / "io" / "schemas", *classes):
        for entry in folder.iterdir():
            if entry.name.endswith(".schema.json"):
                found[entry.name.removesuffix(".schema.json")] = json.loads(
                    entry.read_text(encoding="utf-8")
                )
    return found


def _is_accepted(data: Any, schema: str) -> bool:
    """Whether jsonschema-rs finds nothing wrong, in a thousandth of jsonschema's time; that one
    has to say what is wrong, in the words that we take up, and has the last word on it."""
    try:
        return bool(_quick_validator(schema).is_valid(data))
    except (ValueError, TypeError):  # what JSON doesn't have, as TOML's dates
        return False


@cache
def _quick_validator(schema: str) -> Any:
    from jsonschema_rs import Draft202012Validator, Registry

    registry = Registry([(_PREFIX + name, content) for name, content in _schemas().items()])
    return Draft202012Validator({"$ref": _PREFIX + schema}, registry=registry)


@cache
def _validator(schema: str) -> Any:
    from jsonschema import Draft202012Validator
    from referencing import Registry
    from referencing.jsonschema import DRAFT202012

    registry = Registry().with_resources(
        (_PREFIX + name, DRAFT202012.create_resource(content))
        for name, content in _schemas().items()
    )
    return Draft202012Validator({"$ref": _PREFIX + schema}, registry=registry)


def _as_input_error(error: Any, source: Any) -> InputError:
    """Our words for a violation that jsonschema found."""
    path = list(error.absolute_path)
    if error.validator == "required":
        missing = next(name for name in error.validator_value if name not in error.instance)
        return InputError("is missing", source=source, field=dotted([*path, missing]))
    if error.validator in _FIELDS:
        known = sorted(_known_fields(error))
        unknown = _unknown_fields(error)[0]
        near = difflib.get_close_matches(unknown, known, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
        return InputError(f"unknown field ({hint})", source=source, field=dotted([*path, unknown]))
    return InputError(
        _message(error), source=source, field=dotted(path) or None, value=error.instance
    )


def _message(error: Any) -> str:
    limit = error.validator_value
    if error.validator == "type":
        types = [limit] if isinstance(limit, str) else limit
        return f"must be {' or '.join(_TYPES[name] for name in types)}"
    if error.validator == "const":
        return f"must be {json.dumps(limit)}"
    if error.validator == "enum":
        hint = did_you_mean(error.instance, limit) if isinstance(error.instance, str) else ""
        return f"must be one of {', '.join(map(json.dumps, limit))}{hint and f' ({hint.strip()})'}"
    if error.validator in ("oneOf", "anyOf"):
        return _choice(error) or _short(error.message)
    if error.validator == "exclusiveMinimum":
        return "must be positive" if limit == 0 else f"must be larger than {limit:g}"
    if error.validator == "exclusiveMaximum":
        return "must be negative" if limit == 0 else f"must be smaller than {limit:g}"
    if error.validator in ("minimum", "maximum"):
        return f"must be at {'least' if error.validator == 'minimum' else 'most'} {limit:g}"
    if error.validator in ("minItems", "maxItems"):
        return (
            f"must have at {'least' if error.validator == 'minItems' else 'most'} {limit} entries"
        )
    if error.validator == "uniqueItems":
        return "names something twice: leave the second one out"
    if error.validator == "minLength":
        return "must not be empty"
    return _short(error.message)


def _short(message: str) -> str:
    return message if len(message) <= _LONGEST else f"{message[:_LONGEST]}..."


def _choice(error: Any) -> str:
    """What a value of several forms may be; "" where a form has no short name."""
    forms: list[str] = []
    hint = ""
    for number, form in enumerate(error.validator_value):
        words = form.get("enum", [form["const"]] if "const" in form else [])
        if words:
            forms += map(json.dumps, words)
            if isinstance(error.instance, str):
                hint = did_you_mean(error.instance, words)
        elif form.get("type") == "array" and isinstance(error.instance, list):
            return next(_message(one) for one in error.context if one.schema_path[0] == number)
        elif isinstance(form.get("type"), str):
            forms.append(_TYPES[form["type"]])
        else:
            return ""
    return f"must be {', '.join(forms[:-1])} or {forms[-1]}{hint and f' ({hint.strip()})'}"


def _is_a_consequence(error: Any) -> bool:
    """Whether fields that the schema knows count as unknown ones, since another of them is wrong:
    then none of them is evaluated."""
    return error.validator in _FIELDS and not _unknown_fields(error)


def _unknown_fields(error: Any) -> list[str]:
    known = _known_fields(error)
    return [name for name in error.instance if name not in known]


def _known_fields(error: Any) -> set[str]:
    """Names that the schema at the error allows, those of the schemas it refers to included."""
    schema = error.schema
    names = set(schema.get("properties", {}))
    for part in (schema, *schema.get("allOf", ())):
        names |= set(_referred(part.get("$ref", "")).get("properties", {}))
    return names


def _referred(reference: str) -> Mapping[str, Any]:
    """The schema that another one refers to: a whole one, or a definition in any of them."""
    name, _, place = reference.partition("#/$defs/")
    if not place:
        return _schemas().get(name.removeprefix(_PREFIX), {})
    homes = [_schemas()[name.removeprefix(_PREFIX)]] if name else _schemas().values()
    return next((home["$defs"][place] for home in homes if place in home.get("$defs", {})), {})


def dotted(path: list[str | int]) -> str:
    """``curves[3].points`` for ["curves", 3, "points"]."""
    return "".join(
        f"[{step}]" if isinstance(step, int) else f".{step}" for step in path
    ).removeprefix(".")
