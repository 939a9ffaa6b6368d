"""Umbrella meshes: cells of two plates and crossing arms, deployed from a flat stack by pulling the
plates together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...checks import check_choice
from ...errors import InputError
from ...geometry.centring import middle_of, moved
from ...geometry.extent import size_of_points
from ...kit.groups import ElementGroup
from ...rods.sections import Material, material_from_dict
from ...units import Units
from ..base import (
    Design,
    Role,
    Solve,
    Target,
    register_centring,
    register_class,
)
from ..fitting import best_placement
from ..hardware import CellHardware
from ..loads import hold_in_place
from .bodies import RODS, joint_bodies
from .deployment import Deployment
from .hardware import cell_hardware
from .layout import BaseMesh, Plates, umbrella_mesh
from .mesh import UmbrellaMesh, UmbrellaTarget
from .pins import Anchor, Pins, anchor_on, pins_from_dict
from .release import centred_release, release_mesh

if TYPE_CHECKING:
    from ...equilibrium.equilibria import Equilibrium
    from ...scene.attraction import Attraction
    from ...scene.scene import Scene
    from ...scene.state import State
    from .scene import UmbrellaScene

# Shortest arms of the published designs, as a multiple of the plate edge.
_LEAST_LENGTH = 32 / 30
_MIN_ELEMENTS, _MAX_ELEMENTS = 1, 20


class Umbrella(Design):
    """An umbrella mesh. Its parameters are the arm lengths: top and bottom of every cell, one cell
    after the other.

    Where joints are pinned, their positions follow as further parameters, which belong to no
    element.

    Parameters
    ----------
    name : the design's name
    mesh : geometry in the compact state
    arms, plates : materials
    arm_elements, plate_elements : rod elements in an arm and in a plate rod
    plate_model : "rods", or "rigid": plates as bodies that don't bend, with fewer unknowns
    joint_limits : weight of the soft limits of the joints' turns, T joints 0 to 90, X joints 0 to
        180 degrees; 1 as published, 0 for joints that turn without limits
    least_length : lower bound of arm lengths, default 32/30 of the plate edge
    pins : supports in the final state; without them it is held without force (see `Anchor`)
    deployment : how it is opened
    """

    class_name = "umbrella"
    beside_target = True  # the plates lie on either side of it
    roles = (Role("deployed", fitted=True),)

    def __init__(
        self,
        name: str,
        mesh: UmbrellaMesh,
        *,
        arms: Material = Material(1400.0, 0.35),
        plates: Material = Material(14000.0, 0.35),
        arm_elements: int = 3,
        plate_elements: int = 1,
        plate_model: str = RODS,
        joint_limits: float = 1.0,
        least_length: float | None = None,
        pins: Pins | None = None,
        deployment: Deployment = Deployment(),
    ):
        self.name, self.mesh, self.pins, self.deployment = name, mesh, pins, deployment
        self.arms, self.plates = arms, plates
        self.arm_elements, self.plate_elements, self.plate_model = (
            arm_elements,
            plate_elements,
            plate_model,
        )
        self.joint_limits = joint_limits
        self._bodies = joint_bodies(mesh, plate_model)
        lengths = mesh.lengths.ravel()
        self.least_length = (
            _LEAST_LENGTH * mesh.plate_edge if least_length is None else least_length
        )
        self.parameters, self.free_scale = lengths, float(np.median(lengths))
        self.lower, self.upper = (
            np.minimum(self.least_length, lengths),
            np.full(len(lengths), np.inf),
        )
        if pins is not None:
            places = pins.positions.ravel()
            self.parameters = np.concatenate([lengths, places])
            self.lower = np.concatenate([self.lower, places - pins.reach])
            self.upper = np.concatenate([self.upper, places + pins.reach])
        self.groups = [ElementGroup("cell", np.arange(lengths.size).reshape(-1, 2))]
        self.joints = self._bodies.body[mesh.crossings]

    @classmethod
    def from_release(
        cls, data: Mapping[str, Any], source: str = "umbrella mesh", **options: Any
    ) -> Umbrella:
        """The design of a released file's content, in mm and N; options as for the class. Raises
        InputError."""
        near, origin = centred_release(data)
        mesh = release_mesh(near, source)
        design = cls(options.pop("name", _stem(source)), mesh.scaled(mesh.unit), **options)
        design.units, design.middle = Units("mm", "N"), mesh.unit * origin
        design.origin = design.middle
        return design

    @cached_property
    def model(self) -> UmbrellaScene:
        from .scene import UmbrellaModel, umbrella_scene

        return umbrella_scene(
            self.mesh,
            UmbrellaModel(
                self.arm_elements,
                self.plate_elements,
                self.arms,
                self.plates,
                self.plate_model,
                self.joint_limits,
            ),
            len(self.parameters),
        )

    def scene(self, role: str = "deployed") -> Scene:
        """The final state's scene: actuators of weight 1, no attraction, on pins or held in
        place."""
        check_choice("role", role, ("deployed",))
        return self.held if self.pins is None else self._pinned

    @cached_property
    def _pinned(self) -> Scene:
        """With the design's pins."""
        assert self.pins is not None
        return self.pins.scene(
            self.model.scene, self.joints[self.pins.joints], self.mesh.lengths.size
        )

    @cached_property
    def anchor(self) -> Anchor | None:
        """Where an unsupported mesh is held, by places in its target."""
        target = self.mesh.target
        return None if target is None else anchor_on(target, self.mesh.central_crossing)

    @cached_property
    def held(self) -> Scene:
        """Held at its anchor, or, without a target, with the central X joint in the compact
        state."""
        scene = self.model.scene
        if self.anchor is not None:
            return self.anchor.scene(scene, self.joints)
        pinned = np.zeros(scene.n_dofs, bool)
        centre = self.joints[self.mesh.central_crossing]
        pinned[6 * centre : 6 * centre + 6] = True
        return scene.with_pins(pinned)

    def deploy(
        self, q: np.ndarray | None = None, solve: Solve | None = None
    ) -> dict[str, Equilibrium]:
        """Open the mesh from its compact state, along the path that `deployment` describes.

        At its end the attraction is gone and the mesh moved, as it is, to where it is held, or laid
        on its pins. `escapes` of the equilibrium counts the unstable states that were left on the
        way: where there are any, the mesh may open to another shape. Raises SimulationFailure.
        """
        if q is None and solve is None:
            return {"deployed": self.deployed}  # solved for once, whoever asks
        return {"deployed": self._opened(self.checked(q), solve)}

    def _opened(self, q: np.ndarray, solve: Solve | None = None) -> Equilibrium:
        from .opening import Opening

        *done, final = Opening(self, q, solve).followed(self.deployment)
        return final.after(*done)

    def opened_through(
        self, q: np.ndarray, equilibria: Mapping[str, Equilibrium]
    ) -> dict[str, Equilibrium]:
        """The compact state and those at the stages of the deployment, by name; see
        `Opening.through`."""
        from .opening import Opening

        return Opening(self, q).through(equilibria.get("deployed"))

    def attractions(self) -> tuple[Attraction, ...]:
        """The attraction during deployment, of weight 1: X joints and cell midpoints to their
        places, as far as these are known.

        Energy: weight share / (2 l0^2 3 n) sum |x - x*|^2 over n points, l0 the compact mesh's
        bounding-box diagonal.
        """
        from ...scene.attraction import Attraction

        target = self.mesh.target
        if target is None or not self.deployment.attraction:
            return ()
        known, placed = (
            np.isfinite(places).all(axis=1) for places in (target.crossings, target.plates)
        )
        n = np.count_nonzero(known) + np.count_nonzero(placed)
        if not n:
            return ()
        weight = self.deployment.share / (3 * n) * self.model.energy_scale / self.mesh.size**2
        centres = self._bodies.body[self.mesh.centres]
        pulled = ((self.joints, target.crossings, known), (centres, target.plates, placed))
        return tuple(
            Attraction(bodies[which], targets=places[which], target_weight=weight)
            for bodies, places, which in pulled
            if which.any()
        )

    @cached_property
    def deployed(self) -> Equilibrium:
        """The input design's final state."""
        return self._opened(self.parameters)

    @cached_property
    def target(self) -> Target:
        """The mesh's target surface, or, where it has none, the one through its deployed X joints
        and midpoints."""
        state = self.deployed.state
        positions = state.positions[self.joints]
        if self.mesh.target is not None:
            vertices, faces = self.mesh.target.vertices, self.mesh.target.faces
            if self.pins is None:
                positions = _laid_on(self.mesh.target, positions)
        else:
            vertices, faces = self._own_surface(state)
        used = vertices[np.unique(faces)]
        return Target(vertices, faces, positions, size_of_points(used))

    def _own_surface(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Triangles between each cell's midpoint and its X joints, in pairs."""
        mesh = self.mesh
        place = np.full(len(mesh.positions), -1)
        place[mesh.crossings] = np.arange(len(mesh.crossings))
        arms = mesh.rods.arms
        at = place[mesh.rods.joints[arms]].max(axis=1)
        touching = np.unique(np.stack([mesh.rods.cells[arms], at], axis=1), axis=0)
        faces = [
            (len(self.joints) + a[0], a[1], b[1])
            for k, a in enumerate(touching)
            for b in touching[k + 1 :]
            if a[0] == b[0]
        ]
        middles = state.positions[self._bodies.body[mesh.centres]].mean(axis=1)
        return np.concatenate([state.positions[self.joints], middles]), np.array(faces, int)

    def report_positions(self, state: State) -> np.ndarray:
        """Positions of all joints, plates' included, in the order and the units of the design's own
        file."""
        return self.middle + self._bodies.positions(state)

    def file_with(self, data: Mapping[str, Any], q: np.ndarray) -> dict[str, Any]:
        n = self.mesh.lengths.size
        found = {**data, "lengths": q[:n].reshape(-1, 2).tolist()}
        if self.pins is not None:
            places = q[n:].reshape(-1, 3) + self.middle
            found["pins"] = {**data["pins"], "positions": places.tolist()}
        return found

    @property
    def hardware(self) -> CellHardware:
        return cell_hardware(self.mesh)

    def spacings(self, state: State) -> np.ndarray:
        """Distance (n_cells,) of the two plates of every cell."""
        return self.model.actuators.spacings(state)

    def with_plates(self, plate_model: str, young: float | None = None) -> Umbrella:
        """The same design with its plates modelled as "rods", perhaps of another modulus, or
        "rigid"."""
        plates = self.plates if young is None else replace(self.plates, young=young)
        return self._like(self.mesh, plate_model=plate_model, plates=plates)

    def _like(self, mesh: UmbrellaMesh, **changes: Any) -> Umbrella:
        options: dict[str, Any] = {
            "arms": self.arms,
            "plates": self.plates,
            "arm_elements": self.arm_elements,
            "plate_elements": self.plate_elements,
            "plate_model": self.plate_model,
            "joint_limits": self.joint_limits,
            "least_length": self.least_length,
            "pins": self.pins,
            "deployment": self.deployment,
        }
        design = Umbrella(self.name, mesh, **(options | changes))
        design.loads, design.load_cases = self.loads, self.load_cases
        return design


def _laid_on(target: UmbrellaTarget, positions: np.ndarray) -> np.ndarray:
    """X joints (n, 3), moved rigidly to fit their places in the target as well as they can: which
    joints an unsupported mesh is held at, and along which axes, doesn't count. As they are where
    the target doesn't know enough places."""
    known = np.isfinite(target.crossings).all(axis=1)
    if not hold_in_place(target.crossings[known]):
        return positions
    placement = best_placement(positions[known], target.crossings[known])
    return placement.apply(positions)


@register_centring("umbrella")
def centred_umbrella(data: Mapping[str, Any]) -> tuple[Mapping[str, Any], np.ndarray]:
    """The mesh with its base, and with its target and pins, each seen from its own middle: where
    the compact mesh lies doesn't matter where there is a target."""
    base, target, pins = data["base"], data.get("target"), data.get("pins", {})
    flat = middle_of(base["vertices"], "base.vertices")
    found, origin = dict(data), np.append(flat, 0.0)
    found["base"] = base | {"vertices": moved(base["vertices"], flat)}
    if target is not None:
        origin = middle_of(target["vertices"], "target.vertices")
        parts = {name: moved(target[name], origin) for name in ("vertices", "crossings", "plates")}
        found["target"] = target | parts
    elif "positions" in pins:
        origin = middle_of(pins["positions"], "pins.positions")
    if "positions" in pins:
        found["pins"] = pins | {"positions": moved(pins["positions"], origin)}
    return (found, origin) if origin.any() or flat.any() else (data, origin)


@register_class("umbrella")
def umbrella_from_dict(data: Mapping[str, Any], source: str = "design") -> Umbrella:
    """The design of a file of class "umbrella" (see umbrella.schema.json); raises InputError naming
    the field."""
    try:
        base = BaseMesh(
            data["base"]["vertices"],
            data["base"]["faces"],
            bool(data["base"].get("flipped", False)),
        )
        plates = Plates(**data.get("plates", {}))
        materials: dict[str, Any] = {
            key: material_from_dict(value) for key, value in data.get("materials", {}).items()
        }
        target = _target(data["target"], base) if "target" in data else None
        pins = pins_from_dict(data["pins"], base, target) if "pins" in data else None
        return Umbrella(
            data["name"],
            umbrella_mesh(base, data["lengths"], plates, target),
            **materials,
            pins=pins,
            arm_elements=_count(data, "arm_elements", 3),
            plate_elements=_count(data, "plate_elements", 1),
            plate_model=data.get("plate_model", RODS),
            joint_limits=float(data.get("joint_limits", 1.0)),
            least_length=data.get("least_length"),
        )
    except KeyError as error:
        raise InputError("a field is missing", source=source, field=str(error).strip("'")) from None
    except (TypeError, AttributeError) as error:
        raise InputError(f"wrong fields: {error}", source=source) from None
    except InputError as error:
        raise error.at(source) from None


def _target(data: Mapping[str, Any], base: BaseMesh) -> UmbrellaTarget:
    """The target of a design file; sizes are checked against the base mesh."""
    n_cells, n_edges = len(base.faces), len(base.cells)
    vertices, faces = np.array(data["vertices"], float), np.array(data["faces"], int)
    crossings = _places(data.get("crossings"), n_edges)
    plates = _places(data.get("plates"), n_cells)
    for field, array, shape in (
        ("vertices", vertices, (len(vertices), 3)),
        ("faces", faces, (len(faces), 3)),
        ("crossings", crossings, (n_edges, 3)),
        ("plates", plates, (n_cells, 3)),
    ):
        if array.shape != shape or np.isinf(array).any():
            raise InputError(f"expected finite numbers of shape {shape}", field=f"target.{field}")
    if faces.min(initial=0) < 0 or faces.max(initial=-1) >= len(vertices):
        raise InputError(
            f"names a vertex that doesn't exist (there are {len(vertices)})", field="target.faces"
        )
    return UmbrellaTarget(vertices, faces, crossings, plates)


def _places(given: Sequence[Any] | None, n: int) -> np.ndarray:
    """Places (n, 3); NaN for those that aren't known: all without a list, else those of null."""
    if given is None:
        return np.full((n, 3), np.nan)
    return np.array([[np.nan] * 3 if place is None else place for place in given], float)


def _count(data: Mapping[str, Any], field: str, default: int) -> int:
    value = data.get(field, default)
    if (
        isinstance(value, bool)
        or not isinstance(value, int)
        or not _MIN_ELEMENTS <= value <= _MAX_ELEMENTS
    ):
        raise InputError(
            f"expected an integer from {_MIN_ELEMENTS} to {_MAX_ELEMENTS}", field=field, value=value
        )
    return value


def _stem(source: str) -> str:
    name = str(source).replace("\\", "/").rsplit("/", 1)[-1]
    return name.removesuffix(".gz").removesuffix(".json")
