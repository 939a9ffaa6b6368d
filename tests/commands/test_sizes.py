"""Kits of several sizes: `kop tradeoff`, and `kop optimize --max-deviation`."""

import argparse

import pytest
from support.commands import status_of

from kop_exudyn.commands.values import kit_cost, part_ranges
from kop_exudyn.io.kits import save_kit
from kop_exudyn.kit.parts import Kit
from kop_exudyn.report import sizes_run


def test_ranges():
    assert part_ranges("linear=2:6:2,angular=5") == {"linear": [2, 4, 6], "angular": [5]}
    assert kit_cost("part=1,piece=0.5") == {"part": 1.0, "piece": 0.5}
    assert kit_cost("piece=1") == {"part": 0.0, "piece": 1.0}  # parts cost 1 each besides, once
    with pytest.raises(argparse.ArgumentTypeError, match="above 0"):
        kit_cost("part=0")


@pytest.mark.parametrize(
    "command, message",
    [
        (("tradeoff", "--parts", "linear=6:2"), "expected A:B or A:B:STEP"),
        (("tradeoff", "--parts", "linear=0:2"), "at least 1"),
        (("tradeoff", "--parts", "linear=2:4,angular=2:3"), "need as many numbers"),
        (("optimize", "--max-deviation", "0"), "positive number"),
        (("optimize", "--max-deviation", "0.5 %", "--kit", "KIT"), "without --kit and --stock"),
        (("optimize", "--max-deviation", "1", "--cost", "colour=1"), "expected part=W"),
        (("optimize", "--parts", "linear=2,angular=2", "--cost", "part=1"), "give it with"),
        (("optimize", "--max-deviation", "1", "--kit", "KIT"), "without --kit and --stock"),
        (("optimize", "--kit", "KIT", "--published"), "--published: finds a kit of as many"),
        (
            ("optimize", "--max-deviation", "1", "--published"),
            "--published: finds a kit of as many",
        ),
    ],
)
def test_what_makes_no_sense(command, message, design_file, tmp_path, capsys):
    kit = save_kit(tmp_path / "kit.json", Kit({"linear": [[0.1, 0.2]], "angular": [0.2]}))
    name, *options = (kit if word == "KIT" else word for word in command)
    arguments = (name, design_file.parent, "--out", tmp_path / "out", *options)
    assert status_of(*arguments) == 2
    assert message in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_the_effort_of_a_trade_off_is_the_searches(design_file, tmp_path, monkeypatch):
    asked = []

    def searched(designs, sizes, *, settings, **others):
        asked.append(settings.stages)
        raise KeyboardInterrupt

    monkeypatch.setattr(sizes_run, "tradeoff_and_report", searched)
    options = ("--parts", "linear=2:3,angular=2", "--out", tmp_path / "out")
    given = ("--effort", "quick", "--leaps", "1", "--seed", "7")
    for more in ((), given):
        assert status_of("tradeoff", design_file.parent, *options, *more) == 130
    plain, quick = asked
    assert (plain.effort, plain.seed) == ("normal", 0)
    assert (quick.effort, quick.leaps, quick.seed) == ("quick", 1, 7)
