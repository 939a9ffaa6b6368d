"""Kits of neighbouring sizes: larger ones are never worse, and the smallest that will do."""

import copy
import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from support.settings import QUICK
from support.zigzags import zigzags

from kop_exudyn.analysis.sizes import KitCost, deviation, smallest_kit, trade_off, unmet
from kop_exudyn.errors import InputError
from kop_exudyn.io.results import load_result
from kop_exudyn.report.kit_report import write_kit_report
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.neighbours import resized
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights

STAGES = replace(
    QUICK,
    schedule=(1e3, 1e5),
    path_steps=4,
    leaps=0,
)
SETTINGS = JobSettings(jobs=1, stages=STAGES, baselines=False)


@pytest.fixture(scope="module")
def designs():
    return zigzags()


@pytest.fixture(scope="module")
def middle(designs):
    return optimize_kit(designs, {"linear": 3, "angular": 2}, settings=SETTINGS)


def test_a_split_kit_begins_no_worse_and_a_merged_one_serves_all(designs, middle):
    before = middle.stages["assigned"]
    with DesignPool(designs, 1) as pool:
        pool.prepare()
        dataset = Dataset.of_pool(pool, Weights.suiting(designs))
        stages = Stages(dataset, {"linear": 3, "angular": 2}, STAGES)
        larger = resized(stages, before, {"linear": 5, "angular": 2})
        assert larger.kit.sizes == {"angular": 2, "linear": 5}
        assert larger.value <= before.value * (1 + 1e-9)
        smaller = resized(stages, before, {"linear": 2, "angular": 1})
        assert smaller.kit.sizes == {"angular": 1, "linear": 2}
        q = smaller.assignment.matrix(smaller.kit) @ smaller.kit.vector
        np.testing.assert_array_equal(np.concatenate([e.q for e in smaller.evaluations]), q)
        # the parts that are left are better than any two of those that were there, as they stand
        assert smaller.value > before.value


def test_no_kit_of_a_trade_off_deviates_more_than_a_smaller_one(designs):
    seen = []
    sizes = [{"linear": n, "angular": 2} for n in (1, 2, 4)]
    kits = trade_off(designs, sizes, settings=SETTINGS, observer=seen.append)
    assert [kit.sizes["linear"] for kit in kits] == [1, 2, 4]
    values = [kit.max_percent for kit in kits]
    assert values == sorted(values, reverse=True) and values[0] > 2 * values[2]
    assert len(seen) >= 3 and seen[0].sizes["linear"] == 4 and seen[0].origin == "scratch"
    row = kits[1].row(KitCost(part=1.0, piece=0.1, cut=0.01))
    pieces = row["pieces"]
    corners = sum(np.max([counts["angular"] for counts in kits[1].result.pieces()], axis=0))
    assert row["cost"] == pytest.approx(4 + 0.1 * pieces + 0.02 * (pieces - corners))


def test_with_more_effort_each_size_is_sought_from_scratch_and_from_its_neighbour(
    designs, tmp_path
):
    """A kit merged from a larger one may be far from the best of its size."""
    sizes = [{"linear": n, "angular": 2} for n in (2, 3)]
    merged = trade_off(designs, sizes, settings=SETTINGS)
    again = replace(SETTINGS, stages=replace(STAGES, effort="normal"))
    kits = trade_off(designs, sizes, settings=again)
    assert merged[0].origin == "3 linear, 2 angular"
    assert "relaxed" in {one.origin for one in kits[0].result.tried}
    (neighbour,) = (one for one in kits[0].result.tried if one.origin == "neighbour")
    assert neighbour.optimised is not None
    assert "neighbour" not in {one.origin for one in kits[1].result.tried}
    assert {"direct", "relaxed", "assigned"} <= kits[0].result.stages.keys()
    kept = next(one.origin for one in kits[0].result.tried if one.kept)
    assert kits[0].origin == ("3 linear, 2 angular" if kept == "neighbour" else "scratch")
    ends = [kit[0].result.stages["assigned"].value for kit in (kits, merged)]
    assert ends[0] <= ends[1] * (1 + 1e-6)
    # files and page know what the kits began with
    for number, kit in enumerate(kits):
        page = write_kit_report(kit.result, tmp_path / str(number))
        assert "the one kept is " in page.read_text(encoding="utf-8")
        assert len(load_result(tmp_path / str(number) / "result.json")["tried"]) > 1


def test_the_smallest_kit_that_will_do(designs, middle):
    limit = 1.5 * deviation(middle)
    found, tried = smallest_kit(designs, limit, {"linear": 3, "angular": 2}, settings=SETTINGS)
    assert found is not None and found.max_percent <= limit
    first = tried[0]
    assert sum(found.sizes.values()) <= sum(first.sizes.values())
    # with one part less of either kind it was tried, and was not good enough
    for kind in found.sizes:
        if found.sizes[kind] > 1:
            fewer = {**found.sizes, kind: found.sizes[kind] - 1}
            assert any(kit.sizes == fewer and kit.max_percent > limit for kit in tried)
    wide, _ = smallest_kit(designs, 50.0, {"linear": 2, "angular": 2}, settings=SETTINGS)
    assert wide.sizes == {"linear": 1, "angular": 1}


def test_a_kit_that_just_misses_is_sought_from_scratch_as_well(designs):
    """What a smaller kit ends at depends on the one it is merged from."""
    first = {"linear": 3, "angular": 2}
    far, tried = smallest_kit(designs, 1e3, first, settings=SETTINGS)
    assert far is not None and [kit.origin for kit in tried].count("scratch") == 1
    merged = next(kit for kit in tried if kit.origin != "scratch")
    limit = merged.max_percent / 1.1
    found, tried = smallest_kit(designs, limit, first, settings=SETTINGS)
    misses = [kit for kit in tried[1:] if limit < kit.max_percent <= 1.3 * limit]
    again = [kit for kit in tried[1:] if kit.origin == "scratch"]
    assert misses and again and again[0].sizes == misses[0].sizes
    assert found is None or found.max_percent <= limit
    # never twice: what was sought from scratch before would end as it did
    begun = [tuple(kit.sizes.items()) for kit in tried if kit.origin == "scratch"]
    assert len(set(begun)) == len(begun)


def test_requirements_that_are_missed_are_told(middle):
    none = Requirements.none()
    assert unmet(middle, none) == []
    opened = middle.redeployment(0)
    expected = [] if opened["same_state"] else ["zigzag 0 opens into another state"]
    assert unmet(middle, Requirements(stress=False))[: len(expected)] == expected
    # the second design's states in place of the first one's: then it opens into another state
    swapped = copy.copy(middle)
    swapped.redeployed = list(middle.redeployed)[::-1]
    swapped.stages = {**middle.stages}
    assert any("opens into another" in text for text in unmet(swapped, Requirements(stress=False)))
    swapped.stages = {"assigned": dataclasses.replace(middle.stages["assigned"], snapping=(1,))}
    snaps = [text for text in unmet(swapped, Requirements()) if "snaps" in text]
    assert snaps == ["zigzag 1 snaps with errors of the workshop"]
    assert unmet(swapped, none) == []


def test_a_kit_grows_until_it_is_good_enough_or_is_not(designs, middle):
    limit = 1.2 * deviation(middle)
    found, tried = smallest_kit(designs, limit, {"linear": 1, "angular": 1}, settings=SETTINGS)
    assert tried[0].max_percent > limit
    assert found is not None and found.max_percent <= limit
    none, tried = smallest_kit(
        designs[:1], 1.0, {"linear": 1, "angular": 1}, settings=SETTINGS, accepts=lambda kit: False
    )
    assert none is None and tried[-1].sizes == {"linear": 4, "angular": 3}
    with pytest.raises(InputError, match="positive deviation"):
        smallest_kit(designs, 0.0, {"linear": 1, "angular": 1})
