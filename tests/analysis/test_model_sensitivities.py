"""Derivatives of a design's state in materials, sections and loads, against states solved again
with scenes of other rods and loads."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from support.grids import coarse_grid
from support.umbrellas import make

from kop_exudyn.analysis.model_sensitivities import ModelSensitivities
from kop_exudyn.analysis.simulation import simulate
from kop_exudyn.cli import main
from kop_exudyn.equilibrium.newton import NewtonOptions, refine, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import InputError
from kop_exudyn.rods.section_slopes import dimensions
from kop_exudyn.rods.sections import Section, circle, drilled, half_lapped, hole_of, rectangle
from kop_exudyn.structures import loading
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.loads import LoadCase
from kop_exudyn.structures.strength import rod_strength
from kop_exudyn.structures.stress_bound import places_of

STEPS = np.array([0.02, 0.01, 0.005])
EXACT = NewtonOptions(tolerance=1e-12)
DENSE = {"density": 600.0}
CASE = {"gravity": [0.0, 0.5, -9.81], "line": [0.1, 0.0, -0.2], "area": [0.2, 0.0, 0.0],
        "plan": [0.0, 0.0, -0.8], "joints": [2], "forces": [[0.05, 0.0, -0.2]]}  # fmt: skip


def grid(repository):
    data = coarse_grid(repository, "05_free_form")
    data["material"] = {**data["material"], **DENSE}
    return design_from_dict(data)


def shell(repository):
    data = json.loads((repository / "models/small/03_exp.json").read_text(encoding="utf-8"))
    data["material"] = {**data["material"], **DENSE}
    return design_from_dict(data)


def umbrella(repository):
    data = make("bowl", 1)
    materials = {name: {**own, "density": 9e-10} for name, own in data["materials"].items()}
    return design_from_dict({**data, "materials": materials, "plate_model": "rigid"})


def case_of(name, design):
    share = 1.0 if name == "grid" else 0.05
    case = LoadCase(**CASE)
    if any(m.density is None for m in loading.materials_of(design)):
        case = replace(case, gravity=None)
    if name == "umbrella":  # in mm and N: a little of all that acts, of its weight as well
        return replace(case.times(1e-6), gravity=np.array([0.0, 500.0, -3000.0]))
    return case.times(share)


@pytest.fixture(scope="module", params=[grid, shell, umbrella], ids=lambda made: made.__name__)
def simulated(request, repository):
    design = request.param(repository)
    return simulate(design, case_of(request.param.__name__, design))


def changed(section: Section, name: str, share: float) -> Section:
    """The section with one of its dimensions larger by a share."""
    given = dimensions(section)
    if name not in given:
        return section
    given[name] *= 1 + share
    if "radius" in given:
        return circle(**given)
    whole = rectangle(**given)
    if section.cut is None:
        return whole
    return half_lapped(whole) if hole_of(section) is None else drilled(whole, hole_of(section))


class Again:
    """The states of a simulated design with other rods, or another case of loads."""

    def __init__(self, result, rods, name="", share=0.0, case=None):
        self.result, self.design = result, result.design
        self.case = result.loaded.case if case is None else case
        self.rods, self.name, self.share = rods, name, share

    def material(self):
        own = self.rods.material
        if self.name not in ("young", "poisson", "density"):
            return own
        return replace(own, **{self.name: getattr(own, self.name) * (1 + self.share)})

    def scene(self, scene):
        if self.rods is None or not self.name:
            return scene
        section = changed(self.rods.section, self.name, self.share)
        stiffness = scene.stiffness.copy()
        stiffness[self.rods.elements] = section.stiffness(self.material())
        own = set(self.rods.elements.tolist())

        def is_own(chain):  # pieces that don't bend are rods of their own
            return chain.section is self.rods.section and (
                chain.elements[0] in own if len(chain.elements) else not own
            )

        chains = tuple(replace(c, section=section) if is_own(c) else c for c in scene.chains)
        return replace(scene, stiffness=stiffness, chains=chains)

    def states(self, monkeypatch, loaded):
        role = self.design.fitted_role
        scene = self.scene(self.design.scene(role.name))
        system, known = System(scene), self.result.deployed
        before = refine(system, solve(system, known.q, known, role.opening, EXACT))
        if not loaded:
            return scene, before, before
        materials = tuple(
            self.material() if self.rods is not None and m is self.rods.material else m
            for m in loading.materials_of(self.design)
        )
        monkeypatch.setattr(loading, "materials_of", lambda design: materials)
        supports, held = loading.held_scene(
            self.design, before, replace(self.case, supports=self.result.loaded.supports), scene
        )
        full = loading.loaded_scene(self.design, held, before, self.case, 1.0)
        monkeypatch.undo()
        system, near = System(full), self.result.loaded.equilibrium
        after = solve(system, near.q, near, role.opening, EXACT)
        return full, before, refine(system, after)


def numbers(design, scene, before, after, result, place):
    """All numbers that have derivatives, of states found again; the largest ones at their place."""
    from kop_exudyn.structures.fitting import TargetFitting

    fit = TargetFitting(design.target)(after.state.positions[design.joints])
    found = {"energy": after.elastic_energy, "deviation": fit.value}
    found["stress"] = equivalent_at(scene, after, place)
    moved = scene.node_poses(after.state)[0] - scene.node_poses(before.state)[0]
    node = int(np.argmax(np.linalg.norm(result.loaded.displacements, axis=1)))
    found["deflection"] = float(np.linalg.norm(moved[node]))
    return found


def equivalent_at(scene, after, place):
    """Equivalent stress at an element's place, of its section or of what a joint leaves of it."""
    element, ends, spot = place
    own = next(p for p in places_of(scene) if p.ends == ends and element in p.elements)
    i, lengths = int(np.flatnonzero(own.elements == element)[0]), scene.rest_lengths(after.q)
    return own.equivalent(after.stress[own.elements], lengths[own.elements])[i, spot]


def place_of(scene, after):
    """Where stress is largest: element, ends that are looked at, place."""
    lengths, best = scene.rest_lengths(after.q), (-1.0, (0, (), 0))
    for places in places_of(scene):
        if len(places.elements):
            u = places.equivalent(after.stress[places.elements], lengths[places.elements])
            i, k = np.unravel_index(int(np.argmax(u)), u.shape)
            best = max(best, (float(u[i, k]), (int(places.elements[i]), places.ends, int(k))))
    return best[1]


def order(values, at, slope):
    """At which the remainder falls; large where it is exact to round-off."""
    left = np.abs(values - at - STEPS * slope)
    if left.max() < 1e-9 * abs(at):
        return np.inf
    return float(np.polyfit(np.log(STEPS), np.log(left), 1)[0])


@pytest.mark.parametrize("loaded", [False, True], ids=["unloaded", "loaded"])
def test_slopes_in_materials_sections_and_loads_are_exact(simulated, loaded, monkeypatch):
    """What is left of a first-order prediction falls with the square of the step; not so with a
    slope that is off."""
    result, design = simulated, simulated.design
    sensitivities = ModelSensitivities(result, loaded=loaded)
    asked = {"energy": sensitivities.energy(), "deviation": sensitivities.deviation(),
             "stress": sensitivities.stress()}  # fmt: skip
    if loaded:
        asked["deflection"] = sensitivities.deflection()
    scene, before, after = Again(result, None).states(monkeypatch, loaded)
    place = place_of(scene, after)
    here = numbers(design, scene, before, after, result, place)
    largest = float(np.nanmax(rod_strength(scene, after).equivalent))
    assert here["stress"] == pytest.approx(largest, rel=1e-9)
    squared = {"deviation": 2 * asked["deviation"].value}  # smooth where it vanishes, too
    for name, slopes in asked.items():
        value = slopes.value**2 if name in squared else slopes.value
        assert value == pytest.approx(here[name], rel=1e-3), name

    def compare(parameter, value, slope_of, again):
        found = [
            numbers(design, *again(h).states(monkeypatch, loaded), result, place) for h in STEPS
        ]
        for name, slopes in asked.items():
            at, slope = here[name], value * slope_of(slopes) * squared.get(name, 1.0)
            values = np.array([one[name] for one in found])
            assert order(values, at, slope) > 1.6, (parameter, name)
            off = slope + 3 * np.abs(values - at).max() / STEPS[0] + 0.01 * at
            assert order(values, at, off) < 1.5, (parameter, name)

    for number, rods in enumerate(asked["energy"].rods):
        for parameter, value in rods.values.items():
            compare(
                parameter,
                value,
                lambda s, n=number, p=parameter: s.rods[n].slopes[p],
                lambda h, r=rods, p=parameter: Again(result, r, p, h),
            )
    if loaded:
        case = result.loaded.case
        compare(
            "factor",
            1.0,
            lambda s: float(s.loads["factor"]),
            lambda h: Again(result, None, case=case.times(1 + h)),
        )
        for name in set(asked["energy"].loads) - {"factor"}:
            own = getattr(case, name)
            compare(
                name,
                1.0,
                lambda s, n=name, v=own: float(np.sum(s.loads[n] * v)),
                lambda h, n=name, v=own: Again(
                    result, None, case=replace(case, **{n: (1 + h) * v})
                ),
            )


def test_what_is_asked_in_vain_is_named(repository):
    design = grid(repository)
    free = simulate(design)
    with pytest.raises(InputError, match="loads"):
        ModelSensitivities(free, loaded=True)
    sensitivities = ModelSensitivities(free)
    with pytest.raises(InputError, match="loaded=True"):
        sensitivities.deflection()
    with pytest.raises(InputError, match="expected shape"):
        sensitivities.joints(np.zeros((2, 3)))


def test_rows_and_a_number_of_ones_own(simulated):
    """The energy is homogeneous in Young's moduli where nothing else acts; a number of the joints
    that only sums their heights is what its gradient says."""
    sensitivities = ModelSensitivities(simulated)
    slopes = sensitivities.energy()
    assert "young" in repr(slopes) and slopes.loads == {}
    rows = slopes.rows()
    assert {"of", "parameter", "value", "d(energy)", "% for 1 %"} == set(rows[0])
    if simulated.design.class_name != "umbrella":  # nothing opens it but angles
        young = sum(row["% for 1 %"] for row in rows if row["parameter"] == "young")
        assert young == pytest.approx(1.0, rel=1e-6)
    up = np.tile([0.0, 0.0, 1.0], (len(simulated.design.joints), 1))
    one = sensitivities.joints(up, name="height")
    two = sensitivities.joints(2 * up)
    for first, second in zip(one.rods, two.rods):
        for name, slope in first.slopes.items():
            assert second.slopes[name] == pytest.approx(2 * slope, rel=1e-9)


def test_the_command_says_what_one_per_cent_more_does(repository, capsys):
    file = repository / "models" / "small" / "03_exp.json"
    assert main(["simulate", str(file), "--sensitivities"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("1 % more")]
    assert [line.split("(")[0].split()[-1] for line in lines] == [
        "young", "poisson", "width", "height",
    ]  # fmt: skip
    assert "energy +1.00 %, stress +1.00 %" in lines[0]
    assert main(["simulate", str(file), "--sensitivities", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["sensitivities"]
    assert rows[0]["parameter"] == "young" and rows[0]["energy"] == pytest.approx(1.0, rel=1e-6)
