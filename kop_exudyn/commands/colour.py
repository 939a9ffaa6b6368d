"""Colours on terminals, and only there: not in files and pipes, and not where NO_COLOR is set
(no-color.org)."""

from __future__ import annotations

import logging
import os
from typing import TextIO

RED, YELLOW = "31", "33"

_LEVELS = {logging.ERROR: RED, logging.WARNING: YELLOW}


def coloured(text: str, colour: str, stream: TextIO) -> str:
    """The text in that colour (an ANSI number), where the stream shows colours."""
    return f"\033[{colour}m{text}\033[0m" if shows_colours(stream) else text


def shows_colours(stream: TextIO) -> bool:
    """Whether the stream is a terminal with colours, and its user wants them."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


class LogFormatter(logging.Formatter):
    """Messages in one line each, their level coloured."""

    def __init__(self, stream: TextIO):
        super().__init__()
        self.stream = stream

    def format(self, record: logging.LogRecord) -> str:
        level = record.levelname
        if record.levelno in _LEVELS:
            level = coloured(level, _LEVELS[record.levelno], self.stream)
        return f"kop: {level}: {record.getMessage()}"
