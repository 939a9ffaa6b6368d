"""How a design's state depends on what it is made of and on what acts on it: exact derivatives in
materials, sections and loads, by adjoints.

The design keeps its parts, its target and its opening; what changes are moduli, densities, the
dimensions of sections, and loads. Springs that open a design (the actuators of umbrella meshes)
stay as they are. Under loads the supports stand where the unloaded design has its joints, which
moves with the material as well: with p their places,

    dJ/dm = J_m + J_p dp/dm,

both by one adjoint solve each, in the loaded and in the unloaded scene.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Indices, Numbers, Points, Stresses, Vector
from ..checks import check_kind
from ..equilibrium.model_gradient import ModelGradient, model_gradient
from ..equilibrium.sensitivities import Sensitivities
from ..equilibrium.system import System
from ..errors import InputError, SimulationFailure
from ..rods.section_slopes import dimensions, section_slopes, stiffness_slopes
from ..rods.sections import Material
from ..scene.loads import DeadForces
from ..scene.scene import Scene
from ..scene.state import State
from ..structures.fitting import TargetFitting
from ..structures.load_bound import with_places
from ..structures.loading import acting_loads, held_scene
from ..structures.loads import LoadCase
from ..structures.strength import materials_of
from ..structures.stress_bound import places_of
from .simulation import SimulationResult
from .slopes import Slopes, explicit_slopes, rods_of


class ModelSensitivities:
    """Derivatives of a simulated design's state in materials, sections and loads.

    result : of `simulate`
    loaded : whether the state under the result's loads is looked at, or the unloaded one

    Raises InputError where there are no loads, or rods whose material the design doesn't say;
    SimulationFailure where the state is too close to a bifurcation for derivatives.
    """

    def __init__(self, result: SimulationResult, loaded: bool = False):
        check_kind("result", result, SimulationResult, "see simulate")
        self.result, self._design = result, result.design
        self._unloaded = Sensitivities(
            self._design.systems[self._design.fitted_role.name], result.deployed
        )
        self._own, self._case = self._unloaded, LoadCase()
        self._moved = np.zeros(0, int)
        self._acting: dict[str, list[int]] = {}
        if loaded:
            self._load()
        if not self._own.trusted:
            raise SimulationFailure(
                "too close to a bifurcation, or under moments without potential: there are no "
                "derivatives",
                where=self._design.name,
            )
        scene = self._own.system.scene
        self._rods = rods_of(scene, materials_of(self._design), self._design.name)

    def __repr__(self) -> str:
        under = f" under {self._case.name!r}" if self._acting or not self._case.empty else ""
        return f"<ModelSensitivities of {self._design.name!r}{under}>"

    def energy(self) -> Slopes:
        """Of the elastic energy."""
        s, eq = self._own, self._own.equilibrium
        lengths, strain = s.system.lengths, s.system.strain
        # dW/dx = B^T sigma, as of a number of the stresses whose cotangent is the strain
        implicit = self._gradient(stresses=strain)
        explicit = -0.5 * strain**2 / lengths[:, None]
        return self._slopes("energy", eq.elastic_energy, implicit, explicit)

    def deviation(self) -> Slopes:
        """Of the root mean square distance of the joints from the target, at the best placement:
        the square root of the target fitting T that searches use (see `structures.fitting`)."""
        target, joints = self._design.target, self._design.joints
        fit = TargetFitting(target)(self._own.equilibrium.state.positions[joints])
        value = float(np.sqrt(fit.value))
        cotangent = fit.gradient / (2 * value) if value > 0 else 0 * fit.gradient
        return self._slopes("deviation", value, self._gradient(*_places(joints, cotangent)))

    def joints(self, gradient: Points, value: float = 0.0, name: str = "joints") -> Slopes:
        """Of a number of one's own of the joints' places: its gradient (n, 3) in them.

        value, name : of the number, for what is shown
        """
        joints, own = self._design.joints, np.asarray(gradient, float)
        if own.shape != (len(joints), 3):
            raise InputError(
                f"expected shape ({len(joints)}, 3)", field="gradient", value=own.shape
            )
        return self._slopes(name, value, self._gradient(*_places(joints, own)))

    def deflection(self) -> Slopes:
        """Of the largest distance by which a node of the rods moves under the loads; of that node,
        where another one is about to be farther. Raises InputError without loads."""
        if self._own is self._unloaded:
            raise InputError("needs the loaded state: loaded=True", field="loaded", value=False)
        assert self.result.loaded is not None
        moved = self.result.loaded.displacements
        node = int(np.argmax(np.linalg.norm(moved, axis=1)))
        value = float(np.linalg.norm(moved[node]))
        unit = moved[node] / value if value else np.zeros(3)
        scene, before = self._own.system.scene, self._unloaded.equilibrium.state
        here = _node(scene, self._own.equilibrium.state, node, unit)
        there = _node(scene, before, node, -unit)
        return self._slopes("deflection", value, self._gradient(*here, unloaded=there))

    def stress(self) -> Slopes:
        """Of the largest equivalent stress (see `structures.strength`); of its place, where
        another one is about to be stressed more."""
        eq, lengths = self._own.equilibrium, self._own.system.lengths
        value, at = -np.inf, None
        for places in places_of(self._own.system.scene):
            if len(places.elements):
                used = places.equivalent(eq.stress[places.elements], lengths[places.elements])
                if used.max() > value:
                    value = float(used.max())
                    at = places, divmod(int(used.argmax()), used.shape[1])
        if at is None:
            raise InputError("no rod has a section", source=self._design.name, field="section")
        places, (i, place) = at
        element = int(places.elements[i])
        cotangent = np.zeros_like(eq.stress)
        cotangent[element] = places.slopes(eq.stress[element], lengths[element], place)[0]
        explicit = explicit_slopes(
            self._rods, places, element, eq.stress[element], lengths[element], place
        )
        found = self._gradient(stresses=cotangent)
        return self._slopes("stress", value, found, of_rods=explicit)

    def table(self) -> list[dict[str, Any]]:
        """By how many % energy, stress and, under loads, deflection change for 1 % more of each
        parameter of the rods ("of", "parameter", "value") and of all loads together. The deviation,
        which may be next to zero, changes by so many % of the target's size."""
        asked = [self.energy(), self.stress(), self.deviation()]
        if self._own is not self._unloaded:
            asked.append(self.deflection())
        found: list[dict[str, Any]] = []
        for rows in zip(*(slopes.rows() for slopes in asked)):
            shares = {s.name: row["% for 1 %"] for s, row in zip(asked, rows)}
            shares["deviation"] *= asked[2].value / self._design.target.size
            found.append({k: rows[0][k] for k in ("of", "parameter", "value")} | shares)
        return found

    # -- how -----------------------------------------------------------------------------------
    def _load(self) -> None:
        """The state under the loads, in a scene whose supports' places are parameters."""
        result, design = self.result, self._design
        if result.loaded is None:
            raise InputError("no loads act", source=design.name, field="loads")
        self._case, unloaded = result.loaded.case, result.deployed
        supports, held = held_scene(design, unloaded, self._case)
        dofs = (6 * design.joints[supports][:, None] + np.arange(3)).ravel()
        self._moved = np.setdiff1d(dofs, held.driven.dofs)
        scene, acting = acting_loads(
            design, with_places(held, self._moved), unloaded, self._case, 1.0
        )
        first = len(scene.terms)
        for name, terms in acting.items():
            self._acting[name] = list(range(first, first + len(terms)))
            first += len(terms)
        scene = scene.with_terms(*scene.terms, *(t for terms in acting.values() for t in terms))
        places = unloaded.state.positions.reshape(-1)[3 * (self._moved // 6) + self._moved % 6]
        state = replace(result.loaded.equilibrium, q=np.concatenate([unloaded.q, places]))
        self._own = Sensitivities(System(scene), state)

    def _gradient(
        self,
        dofs: Indices = np.zeros(0, int),
        cotangent: Numbers = np.zeros(0),
        stresses: Stresses | None = None,
        unloaded: tuple[Indices, Numbers] = (np.zeros(0, int), np.zeros(0)),
    ) -> ModelGradient:
        """Of a number of the state looked at, and of the unloaded one."""
        found = model_gradient(self._own, dofs, cotangent, stresses)
        if self._own is self._unloaded:
            return found
        by_places = self._own.adjoint(dofs, cotangent)
        if stresses is not None:
            by_places = by_places + self._own.stress_adjoint(stresses)
        by_places = by_places[len(self._unloaded.equilibrium.q) :]
        before = model_gradient(
            self._unloaded,
            np.concatenate([self._moved, unloaded[0]]),
            np.concatenate([by_places, unloaded[1]]),
        )
        return replace(found, stiffness=found.stiffness + before.stiffness)

    def _slopes(
        self,
        name: str,
        value: float,
        gradient: ModelGradient,
        explicit: Stresses | None = None,
        of_rods: Mapping[int, Mapping[str, float]] | None = None,
    ) -> Slopes:
        """explicit : (E, 6) what is added to the gradient in the stiffnesses
        of_rods : what is added to slopes, by the number of the rods"""
        stiffness = gradient.stiffness if explicit is None else gradient.stiffness + explicit
        rigid = self._rigid(gradient)
        rods = []
        for number, one in enumerate(self._rods):
            values = {"young": one.material.young, "poisson": one.material.poisson}
            values |= dimensions(one.section)
            slopes = {
                key: float(np.sum(stiffness[one.elements] @ slope))
                for key, slope in stiffness_slopes(one.section, one.material).items()
            }
            for key, more in (of_rods or {}).get(number, {}).items():
                slopes[key] += more
            density = one.material.density
            if density is not None and self._gravity.any():
                values["density"], slopes["density"] = density, 0.0
                weight = float(np.sum(gradient.weight[one.elements] @ self._gravity))
                weight *= one.section.area
                weight += rigid.get((id(one.section), one.material), 0.0) / density
                slopes["density"] = weight
                for key, by in section_slopes(one.section).items():
                    slopes[key] += density * weight * by.area / one.section.area
            rods.append(replace(one, values=values, slopes=slopes))
        loads = self._loads(gradient) if self._own is not self._unloaded else {}
        return Slopes(name, value, tuple(rods), loads)

    @property
    def _gravity(self) -> Vector:
        return np.zeros(3) if self._case.gravity is None else self._case.gravity

    def _rigid(self, gradient: ModelGradient) -> dict[tuple[int, Material], float]:
        """By section and material, force times derivative of the weight of pieces that don't
        bend, which are of the stiffest material."""
        found: dict[tuple[int, Material], float] = {}
        scene = self._own.system.scene
        stiff = [c.section for c in scene.chains if not len(c.elements) and c.section is not None]
        materials = materials_of(self._design)
        for number in self._acting.get("gravity", ()):
            term = scene.terms[number]
            assert isinstance(term, DeadForces)
            shares = np.sum(term.forces * gradient.forces[number], axis=1)
            stiffest = max(materials, key=lambda m: m.young)
            for section, share in zip(stiff, shares.tolist()):
                key = id(section), stiffest
                found[key] = found.get(key, 0.0) + share
        return found

    def _loads(self, gradient: ModelGradient) -> dict[str, Numbers]:
        case, scene, found = self._case, self._own.system.scene, {}
        n = len(scene.elements)
        if case.gravity is not None:
            mass = np.zeros(n)
            for one in self._rods:
                mass[one.elements] = (one.material.density or 0.0) * one.section.area
            found["gravity"] = mass @ gradient.weight + self._along("gravity", gradient)
        if case.line is not None:
            found["line"] = gradient.weight.sum(axis=0) + self._along("line", gradient)
        if "area" in self._acting:
            moved = gradient.forces[self._acting["area"][0]]
            areas = self._design.joint_areas
            for name, own, vector in zip(("area", "plan"), areas, (case.area, case.plan)):
                if vector is not None:
                    found[name] = own @ moved
        if "forces" in self._acting:
            found["forces"] = gradient.forces[self._acting["forces"][0]]
        given = {name: getattr(case, name) for name in found}
        found["factor"] = np.array(sum(float(np.sum(given[k] * v)) for k, v in found.items()))
        return found

    def _along(self, name: str, gradient: ModelGradient) -> Vector:
        """(3,) of a vector that pieces that don't bend have times a size each."""
        vector, total = getattr(self._case, name), np.zeros(3)
        for number in self._acting.get(name, ()):
            term = self._own.system.scene.terms[number]
            assert isinstance(term, DeadForces)
            if vector.any():
                sizes = np.linalg.norm(term.forces, axis=1) / np.linalg.norm(vector)
                total = total + sizes @ gradient.forces[number]
        return total


def _places(bodies: Indices, cotangent: Points) -> tuple[Indices, Numbers]:
    """Unknowns of bodies' places, and the cotangent in them."""
    return (6 * bodies[:, None] + np.arange(3)).ravel(), np.asarray(cotangent, float).ravel()


def _node(scene: Scene, state: State, node: int, vector: Vector) -> tuple[Indices, Numbers]:
    """Unknowns that a node's place depends on, and the derivative of vector . place in them."""
    body, hinge = int(scene.node_body[node]), int(scene.node_hinge[node])
    arms, rates = scene.node_arms(state)
    own = state.rotations[body].T @ vector  # in the body's axes
    dofs = list(range(6 * body, 6 * body + 6))
    slopes = [*vector, *np.cross(arms[node], own)]
    if hinge >= 0:
        dofs.append(6 * scene.n_bodies + hinge)
        slopes.append(float(rates[node] @ own))
    return np.array(dofs), np.array(slopes)
