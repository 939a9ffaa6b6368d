"""The command ``kop``: parses arguments, and turns what can go wrong into one line and an exit
status."""

from __future__ import annotations

import argparse
import atexit
import gc
import logging
import os
import re
import sys
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from importlib import import_module
from keyword import iskeyword
from pathlib import Path
from typing import NoReturn

from .commands import NAMES
from .commands.colour import RED, LogFormatter, coloured
from .commands.help_text import HelpFormatter
from .errors import InputError, OccupiedError, SimulationFailure, did_you_mean
from .provenance import __version__

# Imports make many objects that stay. To look through them for garbage after every 700 new ones, as
# Python does by itself, takes 6 % of the processor time of `kop simulate`; to do so once more when
# the process ends takes 8 %, for memory that goes back to the system anyway.
_NEW_OBJECTS = 50_000

OK, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
_WRITTEN = ("out", "preview")  # what options and places for files are called that are written
_OPTION, _NEGATIVE = re.compile(r"--[a-z][a-z-]*"), re.compile(r"-\.?\d")
_ALIKE = 0.75  # of two names, from where on one may be meant by the other

_DESCRIPTION = (
    "Kits of parts for bending-active structures: one small set of pieces that builds many designs."
)
_STATUS = """exit status:
  0    success
  1    a simulation failed: no equilibrium was found
  2    unusable input: one line on standard error says what is wrong
  130  interrupted"""
_EPILOG = f"""examples:
  kop simulate models/conformals/01_sinh.json
  kop optimize models/conformals --designs 3 --parts linear=12,angular=5 --out out/kit
  kop COMMAND --help

{_STATUS}

All commands take --json, --quiet and --verbose. Messages are coloured on terminals, unless NO_COLOR
is set."""


class _Parser(argparse.ArgumentParser):
    """Errors in one line, like those about files."""

    def error(self, message: str) -> NoReturn:
        self.exit(BAD_INPUT, f"{self.prog}: {_suggesting(message)} (see {self.prog} --help)\n")

    def refuse(self, unknown: Sequence[str]) -> NoReturn:
        """End for arguments that aren't known, with the option that may have been meant."""
        first = unknown[0].partition("=")[0]
        hint = ""
        if first in self._option_string_actions:
            hint = f"it goes after the command, as in {self.prog} {first}"
        elif first.startswith("-"):
            hint = did_you_mean(first, self._option_string_actions)
        if not hint and os.path.exists(first) and "--designs" in self.options():
            hint = "several designs are one folder, or some of a folder by --designs NAME,NAME"
        self.error(f"unknown argument {' '.join(unknown)}{': ' if hint else ''}{hint.strip()}")

    def options(self) -> set[str]:
        """All options that it takes."""
        return set(self._option_string_actions)

    def inputs(self, args: argparse.Namespace) -> Iterator[tuple[Path, str]]:
        """What is read, "file" or "folder" as it looks: by places, then by options, which take
        files; not what is written to."""
        for action in (*self._get_positional_actions(), *self._get_optional_actions()):
            value = getattr(args, action.dest, None)
            if action.type is Path and action.dest not in _WRITTEN and value is not None:
                for path in value if isinstance(value, list) else [value]:
                    file = path.suffix or action.option_strings or action.dest == "file"
                    yield path, "file" if file else "folder"


def _suggesting(message: str) -> str:
    """argparse's message about a choice, with the one that may have been meant first."""
    found = re.search(r"invalid choice: '([^']*)' \(choose from (.*)\)", message)
    if not found:
        return message
    choices = found.group(2).replace("'", "").split(", ")
    hint = did_you_mean(found.group(1), choices)
    return message[: found.end(1) + 1] + f" ({hint}choose from {', '.join(choices)})"


def _as_typed(error: InputError, options: set[str]) -> str:
    """The error's text, a field without a file named as the option that it was given with."""
    text = str(error)
    if error.source is not None or error.field is None:
        return text
    head = re.split(r"[.\[]", error.field)[0]
    option = f"--{head.replace('_', '-')}"
    return f"--{option[2:]}{text[len(head) :]}" if option in options else text


def _nearby(path: Path) -> str:
    """What the folder of a path that isn't there has instead, if anything looks like it."""
    if os.path.islink(path):
        return f": a link to {os.readlink(path)}, which isn't there"
    try:
        names = sorted(os.listdir(path.parent))
    except OSError:
        return ""
    # endings are alike for all: names in front of them are compared
    stems = {name.split(".")[0].lower(): name for name in reversed(names)}
    near = get_close_matches(path.name.split(".")[0].lower(), list(stems), 1, _ALIKE)
    return f" (did you mean {str(path.parent / stems[near[0]])!r}?)" if near else ""


def _with_their_options(argv: Sequence[str]) -> list[str]:
    """Arguments with values as -1,0,-9.81 and -30deg joined to the options before them, which
    argparse takes for options of their own."""
    found: list[str] = []
    for value in argv:
        if found and _OPTION.fullmatch(found[-1]) and _NEGATIVE.match(value):
            found[-1] += f"={value}"
        else:
            found.append(value)
    return found


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``kop`` with these arguments (default: those of the process); returns the exit status."""
    given = sys.argv[1:] if argv is None else argv
    if sys.stdout is None:  # closed by who called
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    args, unknown = make_parser().parse_known_args(_with_their_options(given))
    if unknown:
        args.command.refuse(unknown)
    _set_up_logging(args)
    gc.set_threshold(_NEW_OBJECTS)
    atexit.unregister(gc.freeze)  # of a call before, in the same process
    atexit.register(gc.freeze)
    try:
        for path, kind in args.command.inputs(args):
            if not os.path.exists(path):
                raise InputError(f"no such {kind}{_nearby(path)}", source=path)
        status = args.run(args)
        sys.stdout.flush()  # here, where a reader that has gone can be dealt with
        return status
    except InputError as error:
        options = args.command.options()
        text = _as_typed(error, options)
        if isinstance(error, OccupiedError) and "--overwrite" in options:
            text += " (--overwrite replaces it)"
        return _complain(text, BAD_INPUT)
    except SimulationFailure as failure:
        return _complain(f"simulation failed: {failure}", FAILED)
    except KeyboardInterrupt:
        return _complain("interrupted", INTERRUPTED)
    except OSError as error:
        if error.filename is not None:  # files' errors name them
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):  # the reader has had enough, as in `kop ... | head`
            return OK
        from .files.files import reason_of

        return _complain(f"standard output can't be written: {reason_of(error)}", BAD_INPUT)


def make_parser() -> argparse.ArgumentParser:
    """The parser, with all subcommands."""
    verbosity = _Parser(add_help=False)
    group = verbosity.add_mutually_exclusive_group()
    group.add_argument("-q", "--quiet", action="store_true", help="no progress, errors only")
    group.add_argument(
        "-v",
        "--verbose",
        action="count",
        default=0,
        help="say what is being done; twice: every detail",
    )
    parser = _Parser(
        prog="kop",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=HelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"kop_exudyn {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in NAMES:
        command = import_module(f".commands.{name}{'_' if iskeyword(name) else ''}", __package__)
        subparser = commands.add_parser(
            name,
            parents=[verbosity],
            help=command.HELP,
            description=command.DESCRIPTION,
            epilog=f"{command.EXAMPLES}\n\n{_STATUS}",
            formatter_class=HelpFormatter,
        )
        command.arguments(subparser)
        subparser.set_defaults(run=command.run, parser=parser, command=subparser)
    return parser


def _set_up_logging(args: argparse.Namespace) -> None:
    level = (
        logging.ERROR
        if args.quiet
        else [logging.WARNING, logging.INFO, logging.DEBUG][min(args.verbose, 2)]
    )
    logger = logging.getLogger(__package__)
    logger.setLevel(level)
    handler = logging.StreamHandler()
    handler.setFormatter(LogFormatter(handler.stream))
    logger.handlers[:] = [handler]  # once only, also when main is called again


def _complain(message: str, status: int) -> int:
    sys.stderr.write(f"{coloured('kop:', RED, sys.stderr)} {' '.join(message.split())}\n")
    return status
