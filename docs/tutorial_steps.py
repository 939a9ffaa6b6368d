"""The tutorial's steps, taken from its page: files to save and commands to run. As a program: makes
its figures anew.

Run it from anywhere: python docs/tutorial_steps.py
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "tutorial.md"
FIGURES = DOCS / "tutorial"  # named as the files that the commands write, with "_" for "/"
_BLOCK = re.compile(
    r"^```\{code-block\} (python|console)\n((?::\w+:[^\n]*\n)*)\n?(.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
_CAPTION = re.compile(r":caption: (\S+)")
_FIGURE = re.compile(r"\]\(tutorial/(\S+?)\)\n+\*`(\S+?)`")
_PROGRAMS = {
    "kop": [sys.executable, "-m", "kop_exudyn"],
    "python": [sys.executable],
    "mkdir": ["mkdir"],
    "cat": ["cat"],
}


@dataclass(frozen=True)
class Step:
    """A file to save (`command` is None, `text` its content), or a command and the output that the
    page shows."""

    command: str | None
    file: str
    text: str


def steps(page: str) -> list[Step]:
    """All steps of the page, in order."""
    found = []
    for language, options, body in _BLOCK.findall(page):
        if language == "python":
            found.append(Step(None, _CAPTION.search(options)[1], body))
        else:
            for part in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
                command, _, output = re.sub(r"\\\n\s*", "", part).partition("\n")
                found.append(Step(command, "", output))
    return found


def figures(page: str) -> dict[str, str]:
    """Figures of the page -> the files, made by the commands, that they show."""
    return dict(_FIGURE.findall(page))


def take(step: Step, folder: Path) -> subprocess.CompletedProcess | None:
    """Do what the page says, in that folder; returns what a command did."""
    if step.command is None:
        (folder / step.file).write_text(step.text, encoding="utf-8")
        return None
    program, *rest = shlex.split(step.command)
    path = os.pathsep.join(filter(None, (str(DOCS.parent), os.environ.get("PYTHONPATH"))))
    return subprocess.run(
        [*_PROGRAMS[program], *rest],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    )


def make_figures() -> None:
    """Run all steps and keep the figures; PNG files with a palette, which a page loads faster."""
    from PIL import Image

    page = PAGE.read_text(encoding="utf-8")
    FIGURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        for step in steps(page):
            done = take(step, Path(name))
            if done is not None:
                sys.stdout.write(
                    f"$ {step.command}\n{done.stdout}{done.stderr if done.returncode else ''}"
                )
                done.check_returncode()
        for figure, made in figures(page).items():
            source = Path(name) / made
            if source.suffix == ".png":
                Image.open(source).convert("RGB").quantize(256).save(
                    FIGURES / figure, optimize=True
                )
            else:
                (FIGURES / figure).write_bytes(source.read_bytes())


if __name__ == "__main__":
    make_figures()
