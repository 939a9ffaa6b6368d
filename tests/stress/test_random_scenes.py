"""Random structures under bad conditions: a stable equilibrium or an honest failure, never anything
in between.

The first seeds of the study (studies/stress.py runs a thousand of them), and seeds that once showed
a weakness.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import NewtonOptions
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.scene.state import State
from lib.stress.random_scenes import FAMILIES, random_case
from lib.stress.trial import FAILED, STABLE, judge, run_case

SEEDS = range(60)
FLAT = {"rotation": (0.0, 0.0, 0.0), "shift": (0.0, 0.0, 0.0), "disorder": 0.0}


@pytest.fixture(scope="module")
def outcomes():
    return [run_case(random_case(seed)) for seed in SEEDS]


def test_nothing_passes_silently_wrong(outcomes):
    assert [(o.seed, o.verdict, o.reason) for o in outcomes if o.forbidden] == []


def test_nearly_all_stand(outcomes):
    assert sum(o.verdict == STABLE for o in outcomes) >= len(SEEDS) - 1
    assert all(o.softest > 0 for o in outcomes if o.verdict == STABLE)


def test_the_seeds_cover_what_they_are_for():
    cases = [random_case(seed) for seed in SEEDS]
    conditions = [case.conditions for case in cases]
    assert Counter(case.family for case in cases) == {
        family: len(SEEDS) // 3 for family in FAMILIES
    }
    assert max(c.slenderness for c in conditions) > 5e3 and max(c.ratio for c in conditions) > 25
    assert min(c.unit for c in conditions) < 1e-5 and max(c.unit for c in conditions) > 1e2
    assert np.ptp([np.log10(c.young) for c in conditions]) > 11
    assert max(np.linalg.norm(c.rotation) for c in conditions) > 2.8
    assert max(c.change for c in conditions) > 0.19 and {c.disorder for c in conditions} == {
        0.0,
        0.1,
        1.0,
        3.0,
    }
    assert (
        sum(case.scene.n_hinges > 0 for case in cases) > 15
        and sum(case.opening is not None for case in cases) > 5
    )
    for case, c in zip(cases, conditions):
        assert np.abs(case.q / case.rests - 1).max() <= c.change


def test_a_seed_gives_the_same_state_again(outcomes):
    again = run_case(random_case(7)).equilibrium
    np.testing.assert_array_equal(again.state.positions, outcomes[7].equilibrium.state.positions)


@pytest.mark.parametrize("seed", [10, 82, 96])
def test_disordered_starts_need_the_softened_scene(seed):
    """Elements that start turned by about pi: the plain iteration has nowhere to go from there."""
    case = random_case(seed)
    assert run_case(case).verdict == STABLE
    assert run_case(case, options=NewtonOptions(soften=False)).verdict == FAILED


@pytest.mark.parametrize("seed", [27, 78, 93, 126])
def test_flat_nets_buckle_out_of_their_plane(seed):
    """Symmetry keeps the residual in the plane: the iteration used to creep up to the flat,
    unstable state."""
    outcome = run_case(random_case(seed, **FLAT))
    assert outcome.verdict == STABLE
    assert np.ptp(outcome.equilibrium.state.positions[:, 2]) > 0


def test_an_element_that_turns_too_far_is_named():
    outcome = run_case(random_case(238))
    assert outcome.verdict == FAILED and "divide its rod more finely" in outcome.reason


@pytest.fixture(scope="module")
def solved():
    case = random_case(3)
    return case, run_case(case).equilibrium


class TestJudge:
    """The judge would notice."""

    def test_good(self, solved):
        assert judge(*solved) == (STABLE, "")

    def test_a_state_off_equilibrium(self, solved):
        case, eq = solved
        positions = eq.state.positions.copy()
        positions[-1] += 1e-6 * case.scene.length_scale
        state = State(positions, eq.state.rotations, eq.state.angles)
        assert judge(case, replace(eq, state=state))[0] == "unconverged"

    def test_a_saddle(self):
        """The flat state of a net that wants to buckle, found by holding it in its plane."""
        case = random_case(27, **FLAT)
        out_of_plane = case.scene.pinned.copy()
        out_of_plane[: 6 * case.scene.n_bodies].reshape(-1, 6)[:, 2:5] = True
        held = replace(case, scene=case.scene.with_pins(out_of_plane))
        saddle = run_case(held)
        assert saddle.verdict == STABLE
        assert judge(case, saddle.equilibrium)[0] == "unstable"

    def test_not_a_number(self, solved):
        case, eq = solved
        assert judge(case, replace(eq, torque=np.nan))[0] == "not finite"

    @pytest.mark.parametrize(
        "error, verdict",
        [
            (SimulationFailure("no luck"), FAILED),
            (ZeroDivisionError("x"), "exception"),
            (MemoryError(), "exception"),
        ],
    )
    def test_errors(self, solved, monkeypatch, error, verdict):
        def fail(*arguments):
            raise error

        monkeypatch.setattr("lib.stress.trial.solve", fail)
        outcome = run_case(solved[0])
        assert outcome.verdict == verdict and outcome.forbidden == (verdict != FAILED)

    def test_a_hang(self, solved, monkeypatch):
        def hang(*arguments):
            while True:
                pass

        monkeypatch.setattr("lib.stress.trial.solve", hang)
        assert run_case(solved[0], seconds=0.05).verdict == "hang"
