"""Texts that say what lies in a folder, for a reader who has nothing else."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from textwrap import fill

_WIDTH = 88
_WHOLE = "\xa0"  # in place of spaces within names, where lines don't end


def read_me_text(
    title: str,
    sentences: Iterable[str],
    files: Sequence[Path],
    of_files: Mapping[str, str],
    of_columns: Mapping[str, str],
) -> str:
    """The text of a folder's READ_ME.txt.

    Parameters
    ----------
    title : its first line
    sentences : paragraphs that hold for all of it; empty ones are left out
    files : that lie in the folder; those that end in .csv are tables, whose first line names their
        columns
    of_files, of_columns : patterns of names -> what these mean; the first that fits counts. Files'
        patterns fit the beginning of their names, columns' the whole

    Every file and every column of a table is explained; those that nothing is known of are listed
    by name.
    """
    lines = [title, ""]
    for sentence in filter(None, sentences):
        lines += [fill(sentence, _WIDTH), ""]
    lines += ["FILES", ""]
    lines += _entries({path.name: explained(path.name, of_files) for path in files})
    columns = dict.fromkeys(name for path in files for name in columns_of(path))
    if columns:
        lines += ["", "COLUMNS OF THE TABLES", ""]
        lines += _entries({name: explained(name, of_columns, whole=True) for name in columns})
    return "\n".join([*lines, ""])


def explained(name: str, known: Mapping[str, str], *, whole: bool = False) -> str:
    """What a name means, by the first pattern that fits its beginning, or all of it; or ""."""
    match = re.fullmatch if whole else re.match
    return next((text for pattern, text in known.items() if match(pattern, name)), "")


def columns_of(path: Path) -> list[str]:
    """Names of a table's columns; none of other files."""
    if path.suffix != ".csv":
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return next(csv.reader(file), [])


def _entries(texts: Mapping[str, str]) -> list[str]:
    """Names with what they mean below, those that mean the same together."""
    groups: dict[str, list[str]] = {}
    for name, text in texts.items():
        groups.setdefault(text, []).append(name.replace(" ", _WHOLE))
    lines, indent = [], "    "
    for text, names in groups.items():
        lines.append(fill(", ".join(names), _WIDTH, break_long_words=False).replace(_WHOLE, " "))
        if text:
            lines.append(fill(text, _WIDTH, initial_indent=indent, subsequent_indent=indent))
    return lines
