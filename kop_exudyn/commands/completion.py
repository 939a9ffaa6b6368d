"""``kop completion``: a script that completes commands, options and files in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from .output import add_json, report

HELP = "print a script with which a shell completes kop's commands and options"
DESCRIPTION = """Prints a completion script for bash, zsh, fish or tcsh."""
EXAMPLES = """examples:
  kop completion bash > ~/.local/share/bash-completion/completions/kop
  kop completion zsh > "${fpath[1]}/_kop"
  kop completion fish > ~/.config/fish/completions/kop.fish"""

SHELLS = ("bash", "zsh", "fish", "tcsh")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=SHELLS, metavar="SHELL", help="bash, zsh, fish or tcsh")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    import shtab

    for action in _actions(args.parser):
        if action.type is Path:
            action.complete = shtab.FILE  # type: ignore[attr-defined]  # where shtab looks for it
    script = shtab.complete(args.parser, shell=args.shell)
    report(
        args,
        {"shell": args.shell, "script": script},
        script if script.endswith("\n") else script + "\n",
    )
    return 0


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """All options and arguments, those of subcommands included."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for subparser in action.choices.values():
                yield from _actions(subparser)
