"""What stops a kit from being cut: the verdicts that came with the result, and the parts."""

import re
from dataclasses import replace

import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.readiness import obstacles, refuse
from kop_exudyn.search.result import KitResult

STRESS = {"cause": "stress", "why": "stressed to 133 % of its limit", "helps": "3 mm would do"}
CUT = {"cause": "fabrication", "why": "part L1 is too short for its holes", "helps": None}


def judged(shells, *stops):
    """A result of which only the verdicts are known, one list of stops a design."""
    verdicts = [{"verdict": "", "stops": list(found)} for found in stops]
    return KitResult(shells, [], {}, buildable=verdicts)


def test_verdicts_name_design_reason_and_help(shells):
    found = obstacles(judged(shells, [], [STRESS]))
    assert found == ["second: stressed to 133 % of its limit (3 mm would do)"]
    with pytest.raises(InputError, match="second: stressed to 133 %.*--force"):
        refuse(found)
    refuse(obstacles(judged(shells, [], [])))


def test_parts_are_asked_anew_with_the_options_at_hand(shells, parts):
    """What the verdict says of cutting was found with other holes and sheets."""
    result = judged(shells, [CUT], [])
    assert obstacles(result, Blanks(parts, "m")) == []
    small = CutOptions(sheet=(600.0, 400.0), stock=(700.0,), joint_hole=11.0)
    found = obstacles(result, Blanks(parts, "m", small))
    for words in ("joint hole of 11 mm", "larger than a sheet's", "longer than the longest bar"):
        assert any(words in sentence for sentence in found)
    assert all(sentence.startswith("part ") for sentence in found)
    # the sheet that is named holds every part
    named = re.search(r"--sheet (\d+),(\d+)", next(s for s in found if "--sheet" in s))
    larger = replace(small, sheet=(float(named[1]), float(named[2])))
    assert not any("--sheet" in s for s in obstacles(result, Blanks(parts, "m", larger)))
    # and so does the bar
    longer = replace(small, stock=(float(re.search(r"--stock (\d+)", " ".join(found))[1]),))
    assert not any("--stock" in s for s in obstacles(result, Blanks(parts, "m", longer)))
