"""One design in several threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import numpy as np

import kop_exudyn as kop
from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.sensitivities import Sensitivities

MODELS = Path(__file__).parents[2] / "models" / "small"


def test_threads_that_share_a_design_dont_meet_in_its_workspaces():
    """Each thread solves at parameters of its own, waits for the others, then differentiates."""
    design = kop.load_design(MODELS / "01_sinh.json")
    role = design.fitted_role
    base = design.deploy()[role.name]
    scales = [1.0, 1.003, 1.006]
    barrier = Barrier(len(scales))

    def gradient(scale: float, wait: bool = True) -> np.ndarray:
        system = design.systems[role.name]
        eq = solve(system, design.parameters * scale, base, role.opening)
        sensitivities = Sensitivities(system, eq)
        if wait:
            barrier.wait(timeout=60)
        return sensitivities.energy_gradient

    expected = [gradient(scale, wait=False) for scale in scales]
    with ThreadPoolExecutor(len(scales)) as pool:
        found = list(pool.map(gradient, scales))
    for a, b in zip(found, expected):
        assert np.array_equal(a, b)
    assert not np.allclose(expected[0], expected[1], rtol=1e-6)
