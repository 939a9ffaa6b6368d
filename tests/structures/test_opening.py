"""Designs opened from their assembly, and ways followed to other parameters."""

from dataclasses import replace

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.errors import SimulationFailure
from kop_exudyn.io.designs import load_design
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.opening import SAME_STATE


@pytest.fixture(scope="module")
def shell(repository):
    return load_design(repository / "models" / "small" / "01_sinh.json")


def opened(shell, q):
    rest = solve(shell.systems["rest"], q, None, shell.roles[1].opening)
    return shell.way.opened(shell.systems, q, shell.assembled(q, {"rest": rest}))


@pytest.fixture(scope="module")
def states(shell):
    return opened(shell, shell.parameters)


def test_a_shell_opens_into_its_target(shell, states):
    way = shell.way
    assert [s.opening for s in way.stations] == pytest.approx(
        np.linspace(shell.roles[1].opening, shell.roles[0].opening, len(states) + 1)[1:-1]
    )
    heights = [np.ptp(state.state.positions[shell.joints, 2]) for state in states]
    assert heights[0] < 1e-9 < 0.01 * shell.target.size < heights[-1]
    lifted = [station.lifted is not None for station in (*way.stations, way.deployed)]
    assert any(lifted) and heights[lifted.index(True)] > 1e-4 * shell.target.size
    joints = states[-1].state.positions[shell.joints]
    assert np.abs(joints - shell.target.positions).max() < 0.05 * shell.target.size


def test_steps_that_leave_a_saddle_are_taken_in_parts(shell, states):
    """An engine that jumps off where a step is long follows the same way by shorter ones; one that
    leaves a saddle whatever the step does so in the shortest, and what it finds is kept."""
    longest, taken = 0.06, []

    def jumpy(always):
        def solving(system, q, before, to, options):
            found = solve(system, q, before, to, options)
            step = to - getattr(before, "opening", to)
            taken.append(step)
            return replace(found, escapes=1) if always or abs(step) > longest else found

        return solving

    q = shell.parameters
    rest = solve(shell.systems["rest"], q, None, shell.roles[1].opening)
    start = shell.assembled(q, {"rest": rest})
    found = shell.way.opened(shell.systems, q, start, jumpy(always=False))
    assert len(found) == len(states)
    assert max(map(shell.way.apart, found, states)) < 1e-6
    assert max(map(abs, taken)) > longest and found[-1].escapes == 0
    found = shell.way.opened(shell.systems, q, start, jumpy(always=True))
    assert shell.way.apart(found[-1], states[-1]) < 1e-6
    assert found[-1].escapes == 2 * 4  # both half-steps, in their shortest parts


def test_it_rises_to_the_side_that_is_asked_for(repository, shell, states):
    """Both sides are equivalent, and only the push of the builder tells them apart."""
    other = load_design(repository / "models" / "small" / "01_sinh.json")
    other.side = -shell.side
    mirrored = opened(other, other.parameters)[-1]
    z, w = (s.state.positions[shell.joints, 2] for s in (states[-1], mirrored))
    assert np.allclose(z, -w, atol=1e-6 * shell.target.size)


def test_it_is_lifted_until_it_stays_up(shell, states):
    """Where it falls back to the plane at first: else rounding chooses its way at the next one."""
    way = shell.way
    first = next(k for k, station in enumerate(way.stations) if station.lifted is not None)
    flat = next(k for k, s in enumerate(states) if not way.is_flat(s.state)) - 1
    assert flat == first - 1
    stations = list(way.stations)
    stations[flat] = replace(stations[flat], lifted=stations[first].lifted)  # falls back
    asked = []

    def counting(system, q, before, to, options):
        asked.append(before)
        return solve(system, q, before, to, options)

    q = shell.parameters
    rest = solve(shell.systems["rest"], q, None, shell.roles[1].opening)
    start = shell.assembled(q, {"rest": rest})
    other = replace(way, stations=tuple(stations))
    found = other.opened(shell.systems, q, start, counting)
    assert way.is_flat(found[flat].state) and way.apart(found[-1], states[-1]) < 1e-6
    lifts = [before for before in asked if before is stations[first].lifted]
    assert len(lifts) == 2  # and not a third time, once it is up
    assert way.apart(other.followed(shell.systems, q, found[:-1], found[-1])[-1], found[-2]) < 1e-6


def test_what_rises_too_early_is_lifted_to_its_side(repository):
    """Of parts that don't suit it a shell is up before the station at which it is lifted, perhaps
    to the wrong side; opening it and following its way agree."""
    design = load_design(repository / "models" / "small" / "06_moebius.json")
    found = cluster(design.groups, design.parameters, {"linear": 2, "angular": 1})
    q = found.assignment.matrix(found.kit) @ found.kit.vector
    states = opened(design, q)
    way = design.way
    first = [station.lifted is not None for station in way.stations].index(True)
    assert first > 0 and not way.is_flat(states[first - 1].state)
    again = way.followed(design.systems, q, states[:-1], states[-1])
    assert max(map(way.apart, again, states)) < 1e-6


def test_ways_are_followed_to_other_parameters(shell, states):
    q = shell.parameters * (1 + 2e-3 * np.random.default_rng(0).standard_normal(len(states[0].q)))
    fresh = opened(shell, q)
    followed = shell.way.followed(shell.systems, q, states[:-1], fresh[-1])
    # before it is lifted, an assembly that buckles may lie on either side
    first = [station.lifted is not None for station in shell.way.stations].index(True)
    for a, b in list(zip(followed, fresh))[first:]:
        assert shell.way.apart(a, b) < 1e-6


def test_a_way_that_leads_elsewhere_is_refused(shell, states):
    """The deployed state's mirror image is an equilibrium as well, on the other side."""
    positions = states[-1].state.positions * [1, 1, -1]
    flip = np.diag([1.0, 1.0, -1.0])
    rotations = flip @ states[-1].state.rotations @ flip
    mirror = replace(states[-1].state, positions=positions, rotations=rotations)
    deployed = solve(shell.systems["deployed"], shell.parameters, mirror, shell.roles[0].opening)
    assert shell.way.apart(deployed, states[-1]) > SAME_STATE
    with pytest.raises(SimulationFailure, match="another state"):
        shell.way.followed(shell.systems, shell.parameters, states[:-1], deployed)


def test_designs_assembled_in_place_have_no_way(repository):
    grid = load_design(repository / "models" / "grids" / "02_saddle.json")
    assert grid.way is None and grid.opened_through(grid.parameters, {}) == {}
