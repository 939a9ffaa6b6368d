"""States don't depend on the units of length and force, nor on where in space and how turned a
structure is."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.equilibrium.equilibria import Start
from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.rods.rotations import exp_so3
from lib.stress.random_scenes import random_case
from lib.stress.trial import STABLE, run_case

SEEDS = range(24)
ONE = {"unit": 1.0, "young": 1.0}
HERE = ONE | {"rotation": (0.0, 0.0, 0.0), "shift": (0.0, 0.0, 0.0)}
THERE = ONE | {"rotation": (0.3, 2.0, -1.5), "shift": (1.0, 2.0, -3.0)}


@pytest.mark.parametrize("unit, young", [(2.0**-20, 2.0**38), (2.0**10, 2.0**-3)])
def test_powers_of_two_change_no_digit(unit, young):
    """With them all arithmetic is the same, so whatever differs is a tolerance that depends on
    units."""
    for seed in SEEDS:
        one, other = (
            run_case(random_case(seed, unit=u, young=y)) for u, y in ((1.0, 1.0), (unit, young))
        )
        assert (one.verdict, one.iterations) == (other.verdict, other.iterations), seed
        np.testing.assert_array_equal(
            unit * one.equilibrium.state.positions, other.equilibrium.state.positions
        )
        np.testing.assert_array_equal(
            one.equilibrium.state.rotations, other.equilibrium.state.rotations
        )
        assert other.equilibrium.elastic_energy == young * unit**3 * one.equilibrium.elastic_energy


@pytest.mark.parametrize("unit, young", [(1e-6, 1e12), (1e3, 1.0), (1e-6, 1.0), (1e3, 1e12)])
def test_micrometres_and_kilometres(unit, young):
    for seed in SEEDS[::3]:
        one = run_case(random_case(seed, **ONE))
        other = run_case(random_case(seed, unit=unit, young=young))
        assert one.verdict == other.verdict == STABLE, seed
        size = np.ptp(one.equilibrium.state.positions, axis=0).max()
        np.testing.assert_allclose(
            other.equilibrium.state.positions / unit,
            one.equilibrium.state.positions,
            atol=1e-5 * size,
            rtol=0,
        )


@pytest.mark.parametrize("unit, young", [(1e-6, 1.0), (1e3, 1e12)])
def test_exudyn_confirms_in_any_unit(unit, young):
    """Joint equations are lengths: beside forces of 1e-20 their round-off used to look like a
    residual."""
    case = random_case(6, unit=unit, young=young)
    confirmation = confirm(case.scene, run_case(case).equilibrium)
    assert confirmation.residual < 1e-7 and confirmation.moved < 1e-8


@pytest.mark.parametrize("seed", SEEDS)
def test_placement(seed):
    here, there = random_case(seed, **HERE), random_case(seed, **THERE)
    found = run_case(here)
    turn = exp_so3(np.array([THERE["rotation"]]))[0]
    shift = there.scene.initial.positions[0] - turn @ here.scene.initial.positions[0]
    expected = found.equilibrium.state.transformed(turn, shift)
    # the state found here is one there: nothing moves it
    moved = run_case(there, start=Start(expected, found.equilibrium.torque))
    assert found.verdict == moved.verdict == STABLE
    np.testing.assert_allclose(
        moved.equilibrium.state.positions, expected.positions, atol=1e-6 * here.scene.size
    )
    # and from the start there, the same state, or its mirror image where a flat net has two, is
    # found
    again = run_case(there)
    assert again.equilibrium.elastic_energy == pytest.approx(
        found.equilibrium.elastic_energy, rel=1e-6
    )
    np.testing.assert_allclose(again.softest, found.softest, rtol=1e-2)
