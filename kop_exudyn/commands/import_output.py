"""What all imports tell, and how they name what is wrong: by the option that it was given with."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .output import report

if TYPE_CHECKING:
    from ..errors import InputError

# Fields of a design file, and the options that they come from.
_FIELDS = {
    "opening.angle": "--opening",
    "held": "--held",
    "patch": "--patch",
    "section": "--section",
    "material.young": "--material",
    "material.poisson": "--material",
    "material.density": "--density",
    "material.elastic_limit": "--elastic-limit",
}


def tell(args: argparse.Namespace, data: dict[str, Any], rows: Sequence[tuple[str, str]]) -> None:
    """Files that were written, and the rows of what was understood; or all as data."""
    files = "".join(f"{path}\n" for path in (args.out, args.preview) if path is not None)
    lines = "" if args.quiet else "".join(f"{name:<10} {text}\n" for name, text in rows)
    report(args, data, files + lines)


def by_option(error: InputError) -> InputError:
    """The same error, its field named as the option that it was given with."""
    from ..errors import InputError

    option = next(
        (o for field, o in _FIELDS.items() if error.field and error.field.startswith(field)), None
    )
    if option is None:
        return error
    message = error.message
    if option == "--opening" and isinstance(error.value, float) and abs(error.value) > math.pi:
        given = math.degrees(error.value)
        message = f"{message} (pi, in radians): it is {given:.4g} degrees"
        if error.value > 2 * math.pi:
            message += f"; if degrees are meant, write {error.value:g}deg"
    return InputError(message, source=error.source, field=option, value=error.value)
