"""The Exudyn model of a scene: built from the scene, set from its parameters, and nothing else.

Beams are `ObjectBeamGeometricallyExact` between `NodeRigidBodyRotVecLG`. Rigid attachments, corners
at their prescribed angles and held turns are `ObjectJointGeneric`, free hinges
`ObjectJointRevoluteZ`, held places `ObjectConnectorCoordinate`, self-weight `LoadForceVector`;
attraction, actuators, other loads and the prescribed mean angle are one `ObjectGenericODE2`. No
value of a state enters but as the start of an iteration.

Exudyn's rods, joints and loads make the residual, and Exudyn assembles and factorises the Jacobian
of a step. Two things are done here. Exudyn leaves the geometric stiffness of its joints out of the
Jacobian; it is added through the function that Exudyn calls for that. And the nodes' rotational
increments are body-frame ones, exp(hat(phi)) exp(hat(w)): Exudyn's Lie-group integrators compose
them so, its static solver adds them to phi, which spoils the convergence where rotations from the
global axes are large. So single steps are taken and composed here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..errors import SimulationFailure
from ..rods.rotations import exp_so3, log_so3
from ..scene.scene import Scene
from ..scene.state import State
from .exudyn_forces import SceneForces, angles_about
from .exudyn_joints import Joints
from .exudyn_layout import layout_of
from .exudyn_library import BEAM, MARKER_OF_NODE, NODE, exu, item, quiet_settings, rod_section


@dataclass(frozen=True)
class Point:
    """An iterate in Exudyn's coordinates, in the model's units.

    total : (n_nodes, 6) positions and rotation vectors, reference included
    torque : the actuation's multiplier (0 without actuation)
    reactions : (n_equations,) Exudyn's multipliers
    angles : (n_hinges,) rad, of the scene's hinges: rotations tell them but for full turns
    """

    total: np.ndarray
    torque: float
    reactions: np.ndarray
    angles: np.ndarray


@dataclass(frozen=True)
class Residual:
    """Exudyn's residual, in the model's units.

    balance : (6 n_nodes,) forces and moments
    gap : rad, of the mean angle (0 without actuation)
    equations : (n_equations,) of joints, prescribed angles and pins
    """

    balance: np.ndarray
    gap: float
    equations: np.ndarray


class ExudynModel:
    """Exudyn's model of all scenes of one topology; `set` gives it one of them and parameters.

    Attributes
    ----------
    scene : the one that was set last
    length, force : the model's units, in the scene's
    round_off : of the rods' forces, eps size EA / L, in the model's unit of force
    """

    def __init__(self, scene: Scene):
        self.scene = scene
        self.layout = layout_of(scene)
        self.length, self.force = _units_of(scene)
        self._container = exu.SystemContainer()
        self._mbs = self._container.AddSystem()
        self._add_nodes_and_beams()
        self.joints = Joints(self._mbs, scene, self.layout, self._nodes, self.length)
        self._add_weight()
        self._add_forces()
        self._mbs.Assemble()
        self.joints.index()
        self._settings = _settings()
        self._added = _AddedStiffness()
        self._mbs.SetSystemJacobianUserFunction(self._added.user_function())
        self.round_off = 0.0

    # -- model -------------------------------------------------------------------------------------
    def _add_nodes_and_beams(self) -> None:
        mbs, scene, layout = self._mbs, self.scene, self.layout
        self._lengths = scene.length_constant + np.where(
            scene.length_parameter >= 0, scene.length_scale, 0.0
        )
        self._reference = self._reference_coordinates(self._lengths)
        self._nodes = [
            mbs.AddNode(NODE(referenceCoordinates=row)) for row in self._reference.tolist()
        ]
        sections: dict[bytes, exu.BeamSection] = {}
        self._beams = []
        units = self.force * np.repeat([1.0, self.length**2], 3)
        lengths = (self._lengths / self.length).tolist()
        for nodes, K, length in zip(layout.element_nodes.tolist(), scene.stiffness, lengths):
            key = K.tobytes()
            if key not in sections:
                sections[key] = rod_section(K / units)
            beam = BEAM(
                nodeNumbers=[self._nodes[n] for n in nodes],
                length=length,
                sectionData=sections[key],
            )
            self._beams.append(mbs.AddObject(beam))

    def _add_weight(self) -> None:
        """Loads on the rods' nodes, whose values `set` fills in."""
        self._weights = []
        if self.scene.weight is not None:
            for node in np.unique(self.layout.element_nodes).tolist():
                marker = self._mbs.AddMarker(MARKER_OF_NODE(nodeNumber=self._nodes[node]))
                load = item.LoadForceVector(markerNumber=marker, loadVector=[0, 0, 0])
                self._weights.append((node, self._mbs.AddLoad(load)))

    def _add_forces(self) -> None:
        """The object of terms and actuation, where there is any."""
        self._forces: SceneForces | None = None
        if not self.scene.terms and self.scene.actuated is None:
            return
        self._forces = SceneForces(self.scene, self.layout, self.length, self.force)
        nodes = [self._nodes[n] for n in self._forces.nodes]
        if self._forces.actuated:
            torque = item.NodeGenericODE2(
                referenceCoordinates=[0.0],
                initialCoordinates=[0.0],
                initialCoordinates_t=[0.0],
                numberOfODE2Coordinates=1,
            )
            nodes.append(self._mbs.AddNode(torque))
        force, jacobian = self._forces.user_functions()
        self._mbs.AddObject(
            item.ObjectGenericODE2(
                nodeNumbers=nodes, forceUserFunction=force, jacobianUserFunction=jacobian
            )
        )

    def _reference_coordinates(self, lengths: np.ndarray) -> np.ndarray:
        """(n_nodes, 6) reference coordinates, in the model's units."""
        coordinates = self.layout.reference_coordinates(self.scene, lengths)
        coordinates[:, :3] /= self.length
        return coordinates

    def fits(self, scene: Scene) -> bool:
        """Whether a scene has this model's topology: the same items, with the same sections."""
        own = self.scene
        if scene is own:
            return True
        return (
            (scene.weight is None) == (own.weight is None)
            and len(scene.terms) == len(own.terms)
            and all(_same(getattr(scene, name), getattr(own, name)) for name in _TOPOLOGY)
            and _same(scene.driven.dofs, own.driven.dofs)
            and all(_same(a.dofs, b.dofs) for a, b in zip(scene.terms, own.terms))
            and _units_of(scene) == (self.length, self.force)
        )

    # -- values ------------------------------------------------------------------------------------
    def set(self, scene: Scene, q: np.ndarray, opening: float | None) -> None:
        """Take a scene of this model's topology, its parameters and its opening.

        Raises SimulationFailure unless all rest lengths are positive.
        """
        self.scene = scene
        lengths = scene.rest_lengths(q)
        if not np.array_equal(lengths, self._lengths):
            self._lengths, self._reference = lengths, self._reference_coordinates(lengths)
            for node, row in zip(self._nodes, self._reference.tolist()):
                self._mbs.SetNodeParameter(node, "referenceCoordinates", row)
            for beam, length in zip(self._beams, (lengths / self.length).tolist()):
                self._mbs.SetObjectParameter(beam, "length", length)
        self.joints.set(scene, q, self._reference)
        if scene.weight is not None:
            share = 0.5 * lengths[:, None] * scene.weight / self.force
            force = np.zeros((self.layout.n_nodes, 3))
            np.add.at(force, self.layout.element_nodes[:, 0], share)
            np.add.at(force, self.layout.element_nodes[:, 1], share)
            for node, load in self._weights:
                self._mbs.SetLoadParameter(load, "loadVector", force[node].tolist())
        self._opening = opening
        stretch = float((scene.stiffness[:, 0] / lengths).max()) / self.force
        self.round_off = float(np.finfo(float).eps * scene.size * stretch)

    def point(self, state: State, torque: float = 0.0) -> Point:
        """A state as an iterate, without reactions."""
        layout, scene = self.layout, self.scene
        x, R = scene.node_poses(state)
        beams = layout.scene_node >= 0
        turned = np.tile(np.eye(3), (layout.n_nodes, 1, 1))
        total = np.zeros((layout.n_nodes, 6))
        total[beams, :3] = x[layout.scene_node[beams]]
        turned[beams] = R[layout.scene_node[beams]]
        turns = scene.hinge_turns(state.angles)
        for carrier in layout.carriers.values():
            if carrier.rigid:
                position, rotation = state.positions[carrier.body], state.rotations[carrier.body]
                if carrier.hinge >= 0:
                    position = position + rotation @ scene.hinge_centre[carrier.hinge]
                    rotation = rotation @ turns[carrier.hinge]
                total[carrier.node, :3], turned[carrier.node] = position, rotation
        total[:, :3] /= self.length
        total[:, 3:] = log_so3(turned)
        reactions = np.zeros(len(self.joints.conditions))
        return Point(total, torque / (self.force * self.length), reactions, state.angles)

    def state(self, point: Point) -> State:
        """The scene's state at an iterate."""
        scene = self.scene
        bodies, hinges, nodes, own = self.layout.carrier_arrays
        frames = exp_so3(point.total[nodes, 3:]) @ own.transpose(0, 2, 1)
        hubs, turned = np.flatnonzero(hinges < 0), np.flatnonzero(hinges >= 0)
        positions, rotations = np.zeros((scene.n_bodies, 3)), np.zeros((scene.n_bodies, 3, 3))
        positions[bodies[hubs]] = point.total[nodes[hubs], :3] * self.length
        rotations[bodies[hubs]] = frames[hubs]
        turn = rotations[bodies[turned]].transpose(0, 2, 1) @ frames[turned]
        angles, at = point.angles.copy(), hinges[turned]
        angles[at] = angles_about(turn, scene.hinge_axis[at], point.angles[at])
        return State(positions, rotations, angles)

    def torque(self, point: Point) -> float:
        """The actuation's multiplier in the scene's units."""
        return point.torque * self.force * self.length

    # -- Exudyn's work -----------------------------------------------------------------------------
    def residual(self, point: Point) -> Residual:
        """Exudyn's residual at an iterate."""
        solver, data = exu.MainSolverStatic(), self._mbs.systemData
        self._near(point)
        solver.InitializeSolver(self._mbs, self._settings)
        data.SetODE2Coordinates(self._displacements(point))
        data.SetAECoordinates(point.reactions)
        solver.ComputeNewtonResidual(self._mbs, self._settings)
        return self._split(solver)

    def step(self, point: Point, added: Any = None) -> tuple[Point, Residual]:
        """One Newton step of Exudyn's static solver, and its residual at the end.

        Exudyn adds the rotational increments to the rotation vectors; that is the solution where
        the step is small, and otherwise `composed` makes a better iterate of it.

        added : what to add to the stiffness (n, n) of the nodes' coordinates, sparse, besides that
            of the joints' reactions
        Raises SimulationFailure when Exudyn finds none.
        """
        data, initial = self._mbs.systemData, exu.ConfigurationType.Initial
        before = self._displacements(point)
        self._near(point)
        self._added.take(self._geometric(point, added), len(before) + len(point.reactions))
        data.SetODE2Coordinates(before, configuration=initial)
        data.SetAECoordinates(np.zeros(len(point.reactions)), configuration=initial)
        # a new solver each time: one that is kept is quicker, but its steps depend, in their last
        # digits, on earlier ones
        solver = exu.MainSolverStatic()
        try:
            solver.SolveSystem(self._mbs, self._settings)
        except Exception as error:  # Exudyn raises its own types, some of them RuntimeErrors
            reason = str(error).splitlines()[0][:120]
            raise SimulationFailure(f"Exudyn's static solver failed: {reason}") from None
        after, reactions = data.GetODE2Coordinates(), np.array(data.GetAECoordinates())
        if not (np.isfinite(after).all() and np.isfinite(reactions).all()):
            raise SimulationFailure("Exudyn's static solver found no finite step")
        n = 6 * self.layout.n_nodes
        total = self._reference + after[:n].reshape(-1, 6)
        found = Point(total, float(after[n:].sum()), reactions, point.angles)
        return found, self._split(solver)

    def run(
        self, point: Point, settings: exu.SimulationSettings, ramp: float | None = None
    ) -> tuple[Point, int]:
        """Exudyn's static solver as it comes, with settings of one's own, from an iterate; and how
        many Newton steps it took. To measure against.

        ramp : mean angle from which the opening, and zero from which forces of terms grow with
            Exudyn's time from 0 to 1; None: all acts at once
        Raises SimulationFailure when it doesn't converge.
        """
        data, initial = self._mbs.systemData, exu.ConfigurationType.Initial
        self._near(point)
        self._added.take([], len(self._displacements(point)) + len(point.reactions))
        if self._forces is not None:
            self._forces.ramp = ramp
        data.SetODE2Coordinates(self._displacements(point), configuration=initial)
        data.SetAECoordinates(np.zeros(len(point.reactions)), configuration=initial)
        solver = exu.MainSolverStatic()
        try:
            converged = solver.SolveSystem(self._mbs, settings)
        except Exception as error:  # as in `step`
            raise SimulationFailure(str(error).splitlines()[0][:80]) from None
        finally:
            if self._forces is not None:
                self._forces.ramp = None
        if not converged:
            raise SimulationFailure("not converged")
        after, n = data.GetODE2Coordinates(), 6 * self.layout.n_nodes
        total = self._reference + after[:n].reshape(-1, 6)
        reactions = np.array(data.GetAECoordinates())
        found = Point(total, float(after[n:].sum()), reactions, point.angles)
        return found, int(solver.it.newtonStepsCount)

    def jacobian(self, point: Point) -> np.ndarray:
        """The Jacobian of a step as one dense array: for small models, to look at."""
        settings, solver = _settings(), exu.MainSolverStatic()
        settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
        self._near(point)
        size = len(self._displacements(point)) + len(point.reactions)
        self._added.take(self._geometric(point, None), size)
        solver.InitializeSolver(self._mbs, settings)
        self._mbs.systemData.SetODE2Coordinates(self._displacements(point))
        self._mbs.systemData.SetAECoordinates(point.reactions)
        solver.ComputeNewtonResidual(self._mbs, settings)
        solver.ComputeNewtonJacobian(self._mbs, settings)
        return np.array(solver.GetSystemJacobian())

    def composed(self, point: Point, found: Point, share: float = 1.0) -> Point:
        """A share of the step that leads from an iterate to what Exudyn found, on the rotations.

        The reactions and the torque are those of the whole step, to which they are linear.
        """
        change = share * (found.total - point.total)
        turned = exp_so3(point.total[:, 3:]) @ exp_so3(change[:, 3:])
        total = np.concatenate([point.total[:, :3] + change[:, :3], log_so3(turned)], axis=1)
        return Point(total, found.torque, found.reactions, point.angles)

    def largest_force(self) -> float:
        """Largest force, and moment, that a rod of Exudyn's exerts where its iteration is now."""
        what = exu.ComputeItemType.ODE2LHS
        return max(float(np.abs(self._mbs.ComputeItem(beam, what)).max()) for beam in self._beams)

    def _split(self, solver: exu.MainSolverStatic) -> Residual:
        found = np.array(solver.GetSystemResidual())
        n = 6 * self.layout.n_nodes
        m = n + self._has_torque
        return Residual(found[:n], float(found[n:m].sum()), found[m:])

    def _displacements(self, point: Point) -> np.ndarray:
        nodes = (point.total - self._reference).ravel()
        return np.append(nodes, point.torque) if self._has_torque else nodes

    @property
    def _has_torque(self) -> bool:
        return self._forces is not None and self._forces.actuated

    def _near(self, point: Point) -> None:
        if self._forces is not None:
            self._forces.set(self.scene, self._opening, point.angles, self._reference)

    def _geometric(self, point: Point, added: Any) -> list[tuple[np.ndarray, ...]]:
        """Triplets that are added to the derivative of the residual."""
        parts: list[tuple[np.ndarray, ...]] = []
        if point.reactions.any():
            R = exp_so3(point.total[:, 3:])
            parts.append(self.joints.geometric_stiffness(R, point.reactions))
        if added is not None:
            more = sp.coo_matrix(added)
            parts.append((more.row, more.col, -more.data))  # a residual is minus a gradient
        return parts


class _AddedStiffness:
    """What Exudyn's Jacobian gets besides what it assembles itself.

    Exudyn holds on to the function, so nothing here knows Exudyn's system (see `exudyn_forces`).
    """

    def __init__(self) -> None:
        self._matrix = exu.MatrixContainer()

    def take(self, parts: list[tuple[np.ndarray, ...]], size: int) -> None:
        """Triplets (rows, columns, values) for a system of some size."""
        rows, columns, values = (
            np.concatenate([np.asarray(part[k], float) for part in parts] or [np.zeros(0)])
            for k in range(3)
        )
        triplets = np.stack([rows, columns, values], axis=1)[values != 0.0]
        if not len(triplets):
            triplets = np.array([[0.0, 0.0, np.finfo(float).tiny]])
        self._matrix = exu.MatrixContainer()
        self._matrix.SetWithSparseMatrix(triplets, size, size)

    def user_function(self) -> Any:
        """The function as Exudyn calls it."""

        def added(mbs: Any, t: float, factor: float, factor_t: float, factor_1: float) -> Any:
            return self._matrix

        return added


_TOPOLOGY = (
    "n_bodies",
    "hinge_axis",
    "hinge_centre",
    "node_body",
    "node_hinge",
    "node_frame",
    "node_offset",
    "elements",
    "stiffness",
    "rest_strain",
    "pinned",
    "actuated",
)


def _same(a: Any, b: Any) -> bool:
    return a is b or (a is not None and b is not None and np.array_equal(a, b))


def _settings() -> exu.SimulationSettings:
    settings = quiet_settings()
    newton = settings.staticSolver.newton
    newton.maxIterations = 1  # see the module
    newton.relativeTolerance = newton.absoluteTolerance = np.finfo(float).tiny
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True
    return settings


def _units_of(scene: Scene) -> tuple[float, float]:
    """The model's units of length and force: those of a rod element, L and EI / L^2, rounded to
    powers of two.

    Forces and joint equations share one system of equations, so they have to be of similar size
    whatever the units of the scene. Powers of two cost no digit.
    """
    length = 2.0 ** round(np.log2(scene.length_scale))
    bending = np.median(scene.stiffness[:, 4:].min(axis=1))
    return length, 2.0 ** round(np.log2(bending / length**2))
