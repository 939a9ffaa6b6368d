"""Verdicts: each reason that stops a design is found alone, with what would help."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from support.grids import coarse_grid
from support.umbrellas import PLATES, hexagon

from kop_exudyn.analysis.verdict import Buildable, VerdictSettings, judge
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.search.objective import DesignObjective
from kop_exudyn.search.tolerance import Sample
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.strength import design_strength
from kop_exudyn.structures.umbrella.generator import design_on_surface, height_field

FEW = VerdictSettings(samples=2)


@pytest.fixture(scope="module")
def data(repository):
    return coarse_grid(repository)


def built(data):
    """A design's objective, and its evaluation as given."""
    objective = DesignObjective(design_from_dict(data))
    start = objective.reference.equilibria
    return objective, objective.judge(objective.design.parameters, dict(start))


@pytest.fixture(scope="module")
def sound(data):
    return built(data)


def causes(verdict: Buildable) -> list[str]:
    return [stop.cause for stop in verdict.stops]


def with_limit(data, limit):
    return {**data, "material": {**data["material"], "elastic_limit": limit}}


def test_a_sound_design(sound):
    objective, kept = sound
    verdict = judge(objective, kept, kept, FEW)
    told = verdict.to_dict()
    assert verdict.possible and told["verdict"] == "can be built" and told["stops"] == []
    assert told["opens"] == {"same_state": True, "moved_percent": pytest.approx(0, abs=1e-6)}
    strength = design_strength(objective.design, kept.equilibria)
    assert told["utilisation"] == {"deployed": strength["deployed"].largest}
    # it is the input design itself
    assert told["margin"]["softest"] == pytest.approx(1.0)
    assert told["margin"]["spread_percent"] > 0
    assert told["tolerance"]["samples"] == 2 and told["tolerance"]["snapped"] == 0
    assert told["tolerance"]["max_percent_p95"] > 0
    assert told["loads"] == {} and told["fabrication"] is None


def test_a_section_twice_too_thick(data, sound):
    """The verdict names stress, and half the thickness."""
    used = judge(*sound, settings=replace(FEW, samples=0)).largest
    thick = built(with_limit(data, 4e7 * used / 2))
    verdict = judge(*thick, settings=FEW)
    assert causes(verdict) == ["stress"] and verdict.largest == pytest.approx(2.0)
    (stop,) = verdict.stops
    assert "200 %" in stop.why and "design as given to 200 %" in stop.why
    named = float(re.search(r"a section ([\d.]+) mm instead of 4 mm", stop.helps).group(1))
    assert named == pytest.approx(2.0, rel=0.1)
    section = {**data["section"], "width": named / 1000}
    thin = built({**with_limit(data, 4e7 * used / 2), "section": section})
    assert judge(*thin, settings=FEW).possible


def test_a_safety_factor_is_counted(data, sound):
    used = judge(*sound, settings=replace(FEW, samples=0)).largest
    safety = replace(FEW, samples=0, safety=1.5 / used)
    (stop,) = judge(*sound, settings=safety).stops
    assert stop.cause == "stress" and "150 %" in stop.why


def test_a_load_that_it_cannot_carry(data):
    def loaded(force, **more):
        point = {"joint": 5, "force": [0, 0, -force]}
        return built({**data, "load_cases": [{"name": "snow", "points": [point], **more}]})

    heavy = judge(*loaded(50.0, deflection={"span_over": 100}), settings=FEW)
    assert causes(heavy) == ["load"]
    (stop,) = heavy.stops
    assert stop.why.startswith("under snow it deflects by") and "is allowed" in stop.why
    assert re.search(r"a section [\d.]+ mm instead of 4 mm thick would", stop.helps)
    assert heavy.to_dict()["loads"]["snow"]["deflection"] > 0
    light = judge(*loaded(0.01, deflection={"span_over": 100}), settings=FEW)
    assert light.possible
    hopeless = judge(*loaded(50.0, deflection={"absolute": 1e-7}), settings=FEW)
    (stop,) = hopeless.stops
    assert "not even four times the thickness" in stop.helps


def test_a_load_that_makes_it_give_way(repository):
    data = coarse_grid(repository, "01_dome", 0)
    case = {"points": [{"joint": 12, "force": [0, 0, -10]}], "factor": 3.0}
    verdict = judge(*built({**data, "load_cases": [case]}), settings=replace(FEW, samples=0))
    (stop,) = verdict.stops
    assert re.search(r"gives way at [\d.]+ times the load \(3 is asked for\)", stop.why)
    assert "thick would carry it" in stop.helps


def test_loads_without_density(data):
    material = {key: value for key, value in data["material"].items() if key != "density"}
    case = {"name": "weight", "gravity": [0, 0, -9.81]}
    verdict = judge(*built({**data, "material": material, "load_cases": [case]}), settings=FEW)
    assert causes(verdict) == ["load"] and "density" in verdict.stops[0].why


def test_a_design_that_opens_elsewhere(sound):
    objective, kept = sound
    q = kept.q * (1 + 0.02 * np.sin(np.arange(len(kept.q))))
    elsewhere = objective.evaluate(q, kept)
    verdict = judge(objective, kept, elsewhere, FEW)
    assert causes(verdict) == ["opening"] and verdict.moved_percent > 0.1
    assert set(verdict.utilisation) == {"deployed", "opened"}
    assert verdict.to_dict()["opens"]["same_state"] is False


def test_a_design_that_does_not_open_or_was_not_found(sound):
    objective, kept = sound
    stuck = judge(objective, kept, SimulationFailure("stuck"), FEW)
    assert causes(stuck) == ["opening"] and "stuck" in stuck.stops[0].why
    lost = judge(objective, SimulationFailure("diverged"), None, FEW)
    assert causes(lost) == ["not found"] and lost.largest is None
    assert lost.to_dict()["margin"]["softest"] is None and lost.to_dict()["tolerance"] is None


def test_a_design_that_snaps(sound, monkeypatch):
    """Samples that snap down to a quarter of the errors: the verdict names an eighth of them."""
    objective, kept = sound
    usual = VerdictSettings().tolerance(objective.design).length

    def sampled(design, evaluation, tolerance, number, seed=0, objective=None):
        snaps = tolerance.length > 0.2 * usual
        return [Sample(np.zeros(1), None, 1.0, snapped=snaps) for _ in range(number)]

    for module in ("verdict", "mending"):
        monkeypatch.setattr(f"kop_exudyn.analysis.{module}.sample_spread", sampled)
    verdict = judge(objective, kept, kept, FEW)
    (stop,) = verdict.stops
    assert stop.cause == "tolerance" and "2 of 2 samples" in stop.why
    assert "0.2" in stop.why and f"{1000 * usual / 8:.2g} mm" in stop.helps


@pytest.mark.parametrize(
    ("snapping", "asked", "possible"),
    [((3,), [20, 100], True), ((3, 50), [20, 100], False), ((3, 4), [20], False), ((), [20], True)],
)
def test_one_set_of_twenty_is_told_by_a_hundred(sound, monkeypatch, snapping, asked, possible):
    """At most one in a hundred may snap, which twenty don't tell."""
    numbers = []

    def sampled(design, evaluation, tolerance, number, seed=0, objective=None):
        numbers.append(number)
        return [Sample(np.zeros(1), None, 1.0, snapped=k in snapping) for k in range(number)]

    for module in ("verdict", "mending"):
        monkeypatch.setattr(f"kop_exudyn.analysis.{module}.sample_spread", sampled)
    verdict = judge(*sound, sound[1], replace(FEW, samples=20))
    assert verdict.possible == possible and numbers[: len(asked)] == asked
    told = verdict.to_dict()["tolerance"]
    assert told["samples"] == asked[-1]
    assert told["snapped"] == sum(k < asked[-1] for k in snapping)


def test_parts_that_cannot_be_cut(sound):
    objective, kept = sound
    verdict = judge(objective, kept, kept, FEW)
    assert verdict.with_parts(None) is verdict
    assert verdict.with_parts(()).to_dict()["fabrication"] == {"possible": True, "problems": []}
    stopped = verdict.with_parts(("part L1: too short",))
    assert causes(stopped) == ["fabrication"] and not stopped.possible


@pytest.mark.parametrize(
    "wrong", [{"length": -1.0}, {"angle": np.nan}, {"samples": -1}, {"safety": 0.0}]
)
def test_settings(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        VerdictSettings(**wrong)


@pytest.fixture(scope="module")
def umbrella():
    """A saddle of two rings of cells, with elastic limits of arms and plates, N / mm^2."""
    saddle = height_field(lambda x, y: (x**2 - y**2) / 900, 900.0, 30)
    data = design_on_surface("saddle", hexagon(2), *saddle, plates=PLATES, limits=(100.0, 300.0))
    return design_from_dict(data)


def test_umbrella_meshes_are_looked_at_on_the_way(umbrella):
    objective = DesignObjective(umbrella)
    kept = objective.judge(umbrella.parameters, dict(objective.reference.equilibria))
    used = judge(objective, kept, objective.opened(kept), FEW).utilisation
    names = list(used)
    assert names[:2] == ["deployed", "compact"] and len(names) > 4
    assert all(name.startswith("stage ") for name in names[2:])
    # lightly guided, the mesh is strained on its way less than at its end
    assert 0 < max(used[name] for name in names[1:]) < used["deployed"]


def test_a_way_that_overstrains_the_rods_stops_the_mesh(umbrella, monkeypatch):
    """Guided by force, the mesh is strained beyond a limit that its deployed state keeps."""
    monkeypatch.setattr("kop_exudyn.structures.umbrella.opening._LIGHT", 1.0)
    objective = DesignObjective(umbrella)
    kept = objective.judge(umbrella.parameters, dict(objective.reference.equilibria))
    free = judge(objective, kept, objective.opened(kept), replace(FEW, samples=0))
    worst = max(free.utilisation, key=lambda name: free.utilisation[name])
    assert worst.startswith("stage ") and free.largest > 1.2 * free.utilisation["deployed"]
    strict = replace(FEW, samples=0, safety=1 / (0.9 * free.largest))
    (stop,) = judge(objective, kept, objective.opened(kept), strict).stops
    assert stop.cause == "stress" and f"({worst})" in stop.why
