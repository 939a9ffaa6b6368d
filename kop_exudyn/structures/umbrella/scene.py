"""Builds the scene of an umbrella mesh: bodies for joints or whole plates, rods between them,
actuators in cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...rods.sections import Material, rectangle
from ...scene.actuators import LinearActuators
from ...scene.builder import SceneBuilder
from ...scene.limits import HingeLimits
from ...scene.scene import Scene
from ...scene.state import State
from .bodies import RIGID, RODS, JointBodies, joint_bodies
from .mesh import UmbrellaMesh

# The published weights are for this modulus and for lengths divided by the compact mesh's
# bounding-box diagonal.
_PUBLISHED_YOUNG = 1400.0


@dataclass(frozen=True)
class UmbrellaModel:
    """How finely and how stiff an umbrella mesh is modelled.

    arm_elements, plate_elements : rod elements in an arm and in a plate rod
    arms, plates : materials
    plate_model : "rods" or "rigid", see `joint_bodies`; elements and material of rigid plates don't
        count
    joint_limits : weight of the hinges' limits, 1 as published; 0: hinges turn without limits
    """

    arm_elements: int = 3
    plate_elements: int = 1
    arms: Material = Material(1400.0, 0.35)
    plates: Material = Material(14000.0, 0.35)
    plate_model: str = RODS
    joint_limits: float = 1.0


@dataclass(frozen=True)
class UmbrellaScene:
    """A mesh's scene and what is needed to start it.

    bodies : where the joints are; nothing is pinned, the actuators have weight 1
    actuators : the scene's actuators
    limits : of its hinges: T joints turn from 0 to 90 degrees, X joints from 0 to 180
    energy_scale : energy of an actuator or attraction weight of 1
    interior_rod, interior_fraction (m,) : where the bodies inside the rods lie
    """

    mesh: UmbrellaMesh
    bodies: JointBodies
    scene: Scene
    actuators: LinearActuators
    limits: HingeLimits
    energy_scale: float
    interior_rod: np.ndarray
    interior_fraction: np.ndarray

    def compact(self, q: np.ndarray, angle: float) -> State:
        """The assembled mesh with arm lengths q, all hinges turned by an angle (rad) out of the
        upright arms."""
        initial = self.scene.initial
        joints = self.mesh.compact_positions(q[: self.mesh.lengths.size])
        ends = joints[self.mesh.rods.joints] + self.mesh.rods.offsets
        t = self.interior_fraction[:, None]
        inside = (1 - t) * ends[self.interior_rod, 0] + t * ends[self.interior_rod, 1]
        return State(
            np.concatenate([joints[self.bodies.origins], inside]),
            initial.rotations,
            np.full(self.scene.n_hinges, float(angle)),
        )


def umbrella_scene(
    mesh: UmbrellaMesh, model: UmbrellaModel = UmbrellaModel(), n_parameters: int = 0
) -> UmbrellaScene:
    """Build the scene; arm rest lengths are the first parameters (2 n_cells,) of q: top and bottom
    of every cell.

    n_parameters : length of q, where it goes on after the lengths
    """
    build, bodies = (
        SceneBuilder(max(n_parameters, mesh.lengths.size)),
        joint_bodies(mesh, model.plate_model),
    )
    build.bodies(mesh.positions[bodies.origins], mesh.frames[bodies.origins])
    hinge = np.full(len(mesh.positions), -1)
    hinged = mesh.hinged
    hinge[hinged] = build.hinges(
        np.zeros(np.count_nonzero(hinged)),
        axis=bodies.turns[hinged, :, 2],
        centre=bodies.offsets[hinged],
    )
    rods, ends = mesh.rods, mesh.rod_ends
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    frames = _rod_frames((ends[:, 1] - ends[:, 0]) / length[:, None], rods.normals)

    behind = np.where(rods.behind, hinge[rods.joints], -1)
    # (n, 2, 3, 3)
    to_body = np.swapaxes(mesh.frames[bodies.origins[bodies.body[rods.joints]]], 2, 3)
    offsets = np.einsum("neij,nej->nei", to_body, rods.offsets)
    offsets = np.where(behind[:, :, None] < 0, bodies.offsets[rods.joints] + offsets, offsets)
    end_nodes = build.nodes(
        bodies.body[rods.joints].ravel(),
        behind.ravel(),
        (to_body @ frames[:, None]).reshape(-1, 3, 3),
        offsets.reshape(-1, 3),
    ).reshape(-1, 2)
    rigid = ~rods.arms & (model.plate_model == RIGID)
    count = np.where(rods.arms, model.arm_elements, np.where(rigid, 1, model.plate_elements))
    rod_of = np.repeat(np.arange(len(count)), count - 1)
    step = np.concatenate([np.arange(1, k) for k in count]) if len(rod_of) else np.zeros(0)
    fraction = step / count[rod_of]
    inside = (1 - fraction[:, None]) * ends[rod_of, 0] + fraction[:, None] * ends[rod_of, 1]
    inner_nodes = (
        build.nodes(build.bodies(inside, frames[rod_of])) if len(rod_of) else np.zeros(0, int)
    )
    first = np.concatenate([[0], np.cumsum(count - 1)])

    section = rectangle(mesh.width, mesh.thickness)
    arm, plate = section.stiffness(model.arms), section.stiffness(model.plates)
    for k in range(len(count)):
        nodes = [end_nodes[k, 0], *inner_nodes[first[k] : first[k + 1]], end_nodes[k, 1]]
        if rigid[k]:
            build.rigid(nodes, section)
        elif rods.arms[k]:
            build.rod(nodes, arm, parameter=2 * rods.cells[k] + rods.sides[k], section=section)
        else:
            build.rod(nodes, plate, length=length[k], section=section)
    scale = model.arms.young / _PUBLISHED_YOUNG * mesh.size**3
    top, bottom = bodies.body[mesh.centres].T
    actuators = LinearActuators(
        top, bottom, mesh.spacing, scale, extension=mesh.size**-2, shear=mesh.size**-2
    )
    build.term(actuators)
    crossing = np.isin(np.flatnonzero(hinged), mesh.crossings)
    limits = HingeLimits(
        np.arange(len(crossing)),
        0.0,
        np.where(crossing, np.pi, np.pi / 2),
        model.joint_limits * scale,
        build.n_bodies,
    )
    if model.joint_limits:
        build.term(limits)
    return UmbrellaScene(mesh, bodies, build.build(), actuators, limits, scale, rod_of, fraction)


def _rod_frames(tangents: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Axes (n, 3, 3): x along the rod, z the thin side as near to the normal as it can be."""
    z = normals - np.einsum("ni,ni->n", normals, tangents)[:, None] * tangents
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([tangents, np.cross(z, tangents), z], axis=2)
