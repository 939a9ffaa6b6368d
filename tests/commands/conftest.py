"""What tests of several commands share: loggers, a design that only has a name, and a simulation
whose answer is known."""

from __future__ import annotations

import logging
from types import SimpleNamespace

import numpy as np
import pytest

from kop_exudyn.analysis import simulation
from kop_exudyn.structures import base

ANSWER = {
    "design": "arch",
    "unknowns": 120,
    "elements": 20,
    "engine": "fast",
    "newton_iterations": 12,
    "wall_s": 0.5,
    "elastic_energy": 1.25,
    "stable": True,
    "opening_angle": 0.6,
    "assembly_angle": 0.1,
    "exudyn": {
        "version": "1.13",
        "newton_steps": 1,
        "residual": 1e-12,
        "moved": 1e-12,
        "wall_s": 0.1,
    },
    "fit": {
        "max_percent": 1.5,
        "mean_percent": 0.5,
        "pieces_max_percent": 1.75,
        "pieces_mean_percent": 0.75,
        "max": 0.03,
        "mean": 0.01,
        "pieces_max": 0.035,
        "pieces_mean": 0.015,
    },
    "target_size": 1.0,
    "displaced_percent": 2.5,
    "joints": [[0.0, 0.0, 0.0]],
    "strength": {"deployed": {"equivalent_stress": 3e7, "utilisation": 0.75, "element": 3}},
}


@pytest.fixture(autouse=True)
def quiet_loggers():
    """Leaves the package's logger as it was."""
    logger = logging.getLogger("kop_exudyn")
    before = logger.level, logger.handlers[:]
    yield
    logger.setLevel(before[0])
    logger.handlers[:] = before[1]


@pytest.fixture
def design_file(monkeypatch, write_json_file):
    """A design of a class whose reader only keeps the name."""
    monkeypatch.setitem(
        base.CLASSES.items,
        "named",
        lambda data, source: SimpleNamespace(
            middle=np.zeros(3), name=data["name"], fit_weight=1e5, stress_weight=0.0, units=None
        ),
    )
    return write_json_file(
        "set/arch.json",
        {"format": "kop_exudyn/design", "version": 1, "class": "named", "name": "arch"},
    )


@pytest.fixture
def simulated(monkeypatch):
    """Replaces the simulation by a known answer, or by an error put into the dict."""
    outcome = {}

    def simulate(design, loads=None, engine="fast"):
        if "error" in outcome:
            raise outcome["error"]
        return SimpleNamespace(to_dict=lambda: ANSWER)

    monkeypatch.setattr(simulation, "simulate", simulate)
    return outcome


@pytest.fixture
def answer():
    """What `simulated` answers."""
    return ANSWER
