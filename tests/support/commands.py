"""Commands run in this process."""

from __future__ import annotations

from typing import Any

from kop_exudyn import cli


def status_of(*arguments: Any) -> int:
    """The exit status, whether main returns it or argparse exits with it."""
    try:
        return cli.main([str(argument) for argument in arguments])
    except SystemExit as end:
        return int(end.code or 0)
