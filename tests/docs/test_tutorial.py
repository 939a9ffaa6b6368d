"""The tutorial, word by word: every command of its page succeeds, prints what the page shows, and
makes its figures."""

import contextlib
import csv
import importlib.util
import io
import re
import shlex
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import pytest

from kop_exudyn.cli import main

DOCS = Path(__file__).resolve().parents[2] / "docs"
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
MEASURED = ("solved in", "Exudyn")  # lines with times, versions and rounding errors


def _steps_of_the_page():
    spec = importlib.util.spec_from_file_location("tutorial_steps", DOCS / "tutorial_steps.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


tutorial = _steps_of_the_page()
PAGE = tutorial.PAGE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """The folder after all steps, and what the commands printed beside what the page says."""
    folder = tmp_path_factory.mktemp("tutorial")
    printed = []
    for step in tutorial.steps(PAGE):
        done = _done(step, folder)
        if done is not None:
            assert done.returncode == 0, f"{step.command}\n{done.stderr}"
            printed.append((step.command, step.text, done.stdout))
    return folder, printed


def _done(step, folder):
    """As the page's own program does it, but for `kop`: here, which starts no Python a command."""
    if step.command is None or not step.command.startswith("kop "):
        return tutorial.take(step, folder)
    out, told = io.StringIO(), io.StringIO()
    with contextlib.chdir(folder), redirect_stdout(out), redirect_stderr(told):
        status = main(shlex.split(step.command)[1:])
    return SimpleNamespace(returncode=status, stdout=out.getvalue(), stderr=told.getvalue())


def test_all_blocks_of_the_page_are_steps():
    assert PAGE.count("```{code-block}") == sum(
        1 for _ in re.finditer(r"^```\{code-block\} (?:python|console)", PAGE, re.M)
    )
    assert (
        sum(step.command is not None for step in tutorial.steps(PAGE))
        == len(re.findall(r"^\$ ", PAGE, re.M))
        > 8
    )


def test_commands_print_what_the_page_shows(followed):
    for command, shown, printed in followed[1]:
        shown_lines, lines = shown.strip().splitlines(), printed.strip().splitlines()
        assert len(shown_lines) == len(lines), f"{command}\n{printed}"
        if command.startswith("cat") and command.endswith(".csv"):
            _same_pieces(shown_lines, lines)
            continue
        for expected, line in zip(shown_lines, lines):
            assert NUMBER.sub("#", expected).split() == NUMBER.sub("#", line).split(), command
            if not expected.startswith(MEASURED):
                assert _numbers(line) == pytest.approx(_numbers(expected), rel=0.02), command


def test_every_file_that_the_page_names_is_there(followed):
    folder = followed[0]
    named = set(re.findall(r"`((?:designs|kit|files|plans|surfaces)/[\w./]+)`", PAGE))
    assert len(named) >= 8
    for name in named:
        assert (folder / name).exists(), name


def test_every_figure_is_made_by_the_commands_and_kept(followed):
    shown = re.findall(r"!\[.*?\]\((\S+?)\)", PAGE)
    figures = tutorial.figures(PAGE)
    assert sorted(shown) == sorted(f"tutorial/{figure}" for figure in figures) and len(shown) >= 4
    for figure, made in figures.items():
        assert (followed[0] / made).stat().st_size > 1000
        assert (tutorial.FIGURES / figure).stat().st_size > 1000


def test_pieces_that_the_text_counts(followed):
    straight, corners = re.search(r"has (\d+) straight pieces and (\d+) corners", PAGE).groups()
    with open(
        followed[0] / "files" / "workshop" / "assembly_vault.csv", newline="", encoding="utf-8"
    ) as file:
        kinds = [row["kind"] for row in csv.DictReader(file)]
    assert (kinds.count("linear"), kinds.count("angular")) == (int(straight), int(corners))


def _same_pieces(shown: list[str], printed: list[str]) -> None:
    """A cut list of as many parts and pieces. Which ones they are depends on rounding: kits are
    local minima."""
    expected, found = (list(csv.DictReader(lines)) for lines in (shown, printed))
    assert [(row["part"], row["kind"], *row) for row in found] == [
        (row["part"], row["kind"], *row) for row in expected
    ]
    for kind in ("angular", "linear"):
        for column in (name for name in expected[0] if name.startswith("in_")):
            counts = [
                sum(int(row[column]) for row in rows if row["kind"] == kind)
                for rows in (expected, found)
            ]
            assert counts[0] == counts[1] > 0, (kind, column)


def _numbers(line: str) -> list[float]:
    return [float(number) for number in NUMBER.findall(line)]
