"""What scripts do wrong, or otherwise than the commands: one clear error, or the right result."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cached_property

import numpy as np
import pytest
from support.settings import ONE_STEP

import kop_exudyn as kop
from kop_exudyn.io.designs import load_design
from kop_exudyn.kit.stock import Stock
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.search.terms import base
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict

PARTS = {"linear": 3, "angular": 2}
SETTINGS = JobSettings(stages=ONE_STEP, jobs=1, baselines=False)


@pytest.fixture
def designs(repository):
    folder = repository / "models" / "small"
    return [load_design(folder / name) for name in ("01_sinh.json", "03_exp.json")]


def test_searches_in_threads_do_not_mix(designs):
    """Pools of one process shared their designs once: numbers were those of others."""

    def search(own):
        return kop.optimize_kit([own], PARTS, settings=SETTINGS).stages["assigned"].value

    alone = [search(own) for own in designs]
    fresh = [design_from_dict(d) for d in map(_content, designs)]
    with ThreadPoolExecutor(2) as threads:
        assert list(threads.map(search, fresh)) == alone


def _content(design):
    from kop_exudyn.files.json_files import read_json

    return read_json(design.source)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"designs": []}, "designs: expected one design or more"),
        ({"designs": "models"}, "designs: expected a list of designs"),
        ({"kit": "kit.json", "parts": None}, "kit = .*: expected a Kit"),
        ({"settings": ONE_STEP}, "settings = .*: expected JobSettings"),
        (
            {"settings": JobSettings(weights={"fit": 1.0})},
            "settings.weights = .*expected Weights",
        ),
        ({"settings": JobSettings(design_weights=(1.0,))}, "design_weights: are 1, for 2 designs"),
        ({"settings": JobSettings(design_weights=(1.0, 1.0, 5.0))}, "are 3, for 2 designs"),
        ({"start": [[1.0], [2.0]]}, "start = .*: expected the parameters of each design"),
    ],
)
def test_misuses_are_named_before_anything_is_simulated(designs, change, message):
    with pytest.raises(kop.InputError, match=message):
        kop.optimize_kit(**{"designs": designs, "parts": PARTS, "settings": SETTINGS} | change)


@pytest.mark.parametrize("as_stock", [False, True])
def test_parts_in_another_unit_are_refused(designs, as_stock):
    """A stock in millimetres, for designs in metres, ended in a simulation that failed."""
    q = designs[0].parameters
    sides = q[next(g.indices for g in designs[0].groups if g.kind == "linear")][:3, :2]
    for factor in (1000.0, 1e-3):
        kit = kop.Kit({"linear": factor * np.abs(sides[:, [0, -1]]), "angular": [0.1, 0.3]})
        counts = {kind: np.full(m, 500) for kind, m in kit.sizes.items()}
        given = Stock(kit, counts) if as_stock else kit
        with pytest.raises(kop.InputError, match="times as long as the designs' elements"):
            kop.optimize_kit(designs, kit=given, settings=SETTINGS)


def test_one_name_and_numbers_that_are_none(designs):
    twin = design_from_dict(_content(designs[1]) | {"name": designs[0].name})
    with pytest.raises(kop.InputError, match="two designs have this name"):
        kop.optimize_kit([designs[0], twin], PARTS, settings=SETTINGS)
    start = [design.parameters * np.nan for design in designs]
    with pytest.raises(kop.InputError, match="start: must be finite"):
        kop.optimize_kit(designs, PARTS, settings=SETTINGS, start=start)


def test_a_class_with_cached_properties_in_other_processes(designs, monkeypatch):
    """Of a script, as cloudpickle sends it; up to Python 3.11 they hold a lock."""
    base.term_names()  # which loads all of them, for the tests that follow too
    monkeypatch.setattr(base.TERMS, "items", dict(base.TERMS.items))

    class Total(base.Term):
        name = "total"

        @cached_property
        def ones(self):
            return np.ones(self.n)

        def __init__(self, design, reference):
            super().__init__(design, reference)
            self.n = len(design.parameters)

        def sees(self, role):
            return role.fitted

        def value(self, role, equilibrium, fit):
            return float(self.ones @ equilibrium.q)

        def gradient(self, role, sensitivities, fit):
            return self.ones

        def model(self, role, sensitivities, fit):
            return self.ones, np.zeros((self.n, self.n))

    Total.__module__ = "__main__"
    base.register_term(Total)
    with DesignPool(designs, 2) as pool:
        references = pool.prepare()
    assert len(references) == 2


def test_terms_that_can_not_be_registered(monkeypatch):
    """One called as an own one took its place in every later search."""
    base.term_names()  # which loads all of them, for the tests that follow too
    monkeypatch.setattr(base.TERMS, "items", dict(base.TERMS.items))
    whole = dict.fromkeys(("sees", "value", "gradient", "model"), lambda *given: 0.0)
    for fields, message in (
        ({"name": "stress", **whole}, "is a name of this package"),
        ({"name": "fit", **whole}, "is a name of this package"),
        ({"name": "share", **whole}, "is a name of this package"),
        (whole, "needs a name"),
        ({"name": "mine", "value": lambda *given: 0.0}, "lacks the methods gradient"),
    ):
        with pytest.raises(kop.InputError, match=message):
            base.register_term(type("Mine", (base.Term,), fields))
    mine = type("Mine", (base.Term,), {"name": "mine", **whole})
    assert base.register_term(mine) is mine and base.term_class("mine") is mine
    assert base.register_term(mine) is mine  # as a notebook's cell that runs again


@pytest.mark.parametrize("changed", ["young", "elastic_limit"])
def test_a_run_is_not_resumed_with_another_design(designs, tmp_path, changed):
    """Of other material, with the same parameters."""
    settings = {"parts": PARTS, "out": tmp_path / "out", "settings": SETTINGS}
    kop.optimize_and_report(designs[:1], **settings)
    data = _content(designs[0])
    data["material"] = data["material"] | {changed: 3 * data["material"][changed]}
    with pytest.raises(kop.InputError, match="content.small sinh was"):
        kop.optimize_and_report([design_from_dict(data)], **settings, resume=True)


def test_load_cases_keep_what_they_were_given():
    gravity = np.array([0.0, 0.0, -9.81])
    case = kop.LoadCase(gravity=gravity, deflection={"absolute": 0.1})
    gravity *= 0
    assert case.gravity[2] == -9.81 and case.deflection.allowed(1.0) == 0.1
    mask = np.zeros(16, bool)
    for wrong in (
        {"joints": mask, "forces": np.zeros((16, 3))},
        {"supports": [0.0, 3.0, 15.7]},
        {"deflection": 0.01},
        {"deflection": {"span": 200}},
        {"factor": "2"},
    ):
        with pytest.raises(kop.InputError, match=f"loads.{next(iter(wrong))}"):
            kop.LoadCase(**wrong)


def test_weights_are_numbers_of_any_sort():
    assert Weights(fit=np.float32(100.0)).fit == Weights(fit=np.int64(100)).fit == 100
    for wrong in ({"fit": True}, {"share": "x"}, {"share": 5}):
        with pytest.raises(kop.InputError, match=f"weights.{next(iter(wrong))}"):
            Weights(**wrong)


def test_numbers_of_steps_say_what_is_least(designs):
    with pytest.raises(kop.InputError, match="at least 0"):
        kop.fit_input(designs[0], max_steps=-1)
