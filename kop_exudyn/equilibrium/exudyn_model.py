"""The Exudyn model of a scene and its static solve: every equilibrium that is kept is Exudyn's own
solution.

The only module that sees Exudyn's item numbers. Beams are `ObjectBeamGeometricallyExact` between
`NodeRigidBodyRotVecLG`; corners and rigid attachments are `ObjectJointGeneric`, free hinges
`ObjectJointRevoluteZ`; the actuation torque is applied as equal and opposite body-fixed torques;
loads, attraction and actuators as the forces that they exert at the equilibrium. The model is built
once a topology; lengths, angles and loads are set in place.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from time import perf_counter, process_time

import numpy as np

from ..errors import SimulationFailure
from ..rods.rotations import axes_along_z, exp_so3, log_so3
from ..scene.scene import Scene
from ..scene.state import State
from .equilibria import Equilibrium
from .exudyn_layout import Carrier, layout_of

_TESTED = (1, 13, 6)

try:
    import exudyn as exu
    import exudyn.itemInterface as item
except ImportError as error:
    raise ImportError("kop_exudyn needs exudyn >= 1.13.6 (pip install 'exudyn>=1.13.6')") from error

if tuple(int(part) for part in exu.__version__.split(".")[:3]) < _TESTED:
    raise ImportError(
        f"kop_exudyn needs exudyn >= 1.13.6, found {exu.__version__}: older releases take the "
        f"rod's stress-free "
        "state from other data than the reference coordinates, and would give wrong equilibria"
    )

# Residual, relative to the largest internal force, at which Exudyn's solution is accepted. Its
# joints leave their geometric stiffness out of the Jacobian, so that where a mode is very soft
# further steps don't improve on it.
_TOLERANCE = 1e-7
# And as a multiple of the round-off in the rods' forces, eps size EA / L: below it no solution
# could converge.
_ROUND_OFF = 200.0
_MAX_STEPS = 4
# A solution further away than this, relative to the size, is another equilibrium and confirms
# nothing.
_MAX_MOVE = 1e-6


@dataclass(frozen=True)
class Confirmation:
    """What Exudyn's static solver made of an equilibrium.

    version : Exudyn's version
    newton_steps : steps that it took from the given state
    residual : norm of its final residual relative to the largest internal force
    moved : largest displacement of a body, relative to the scene's size
    wall_s : seconds, model update and solve
    state : Exudyn's solution
    """

    version: str
    newton_steps: int
    residual: float
    moved: float
    wall_s: float
    state: State

    def to_dict(self) -> dict[str, float | int | str]:
        """The figures, as written in result files."""
        return {
            "version": self.version,
            "newton_steps": self.newton_steps,
            "residual": self.residual,
            "moved": self.moved,
            "wall_s": self.wall_s,
        }


class ExudynModel:
    """Exudyn's model of one scene; `confirm` may be called for any equilibrium of that scene."""

    def __init__(self, scene: Scene):
        self.scene = scene
        self.layout = layout_of(scene)
        self._length, self._force = _units_of(scene)
        self._container = exu.SystemContainer()
        self._mbs = self._container.AddSystem()
        with warnings.catch_warnings():
            _accept_rotation_markers()
            self._add_nodes_and_beams()
            self._add_joints()
            self._add_pins()
            self._add_loads()
            self._mbs.Assemble()
        self._settings = self._solver_settings()

    def confirm(self, equilibrium: Equilibrium) -> Confirmation:
        """Solve with Exudyn, starting from the equilibrium: Newton steps of its static solver, its
        residual at the end.

        Raises SimulationFailure when Exudyn's static solver doesn't converge from there, or to
        another state.
        """
        begin = perf_counter()
        scene = self.scene
        lengths = scene.rest_lengths(equilibrium.q)
        reference = self._reference(lengths)
        with warnings.catch_warnings():
            _accept_rotation_markers()
            self._set_parameters(equilibrium, lengths, reference)
        force = np.abs(equilibrium.stress) / np.array([1, 1, 1] + 3 * [scene.length_scale])
        force = max(float(force.max()) / self._force, self._tiny)
        allowed = max(_TOLERANCE * force, _ROUND_OFF * self._tiny)
        total = self._coordinates(equilibrium.state)
        for step in range(1, _MAX_STEPS + 1):
            total, reactions = self._newton_step(total, reference)
            state = self._state(total, equilibrium.state)
            moved = np.abs(state.positions - equilibrium.state.positions).max() / scene.size
            if not moved < _MAX_MOVE:
                raise SimulationFailure(
                    f"Exudyn's static solver moved the state by {moved:.2e} of the size"
                )
            residual = self._residual(total - reference, reactions)
            if residual <= allowed:
                return Confirmation(
                    exu.__version__,
                    step,
                    residual / force,
                    float(moved),
                    perf_counter() - begin,
                    state,
                )
        raise SimulationFailure(
            f"Exudyn's static solver did not confirm the state within {_MAX_STEPS} Newton steps "
            f"(residual {residual / force:.2e} of the largest force)"
        )

    def _newton_step(
        self, total: np.ndarray, reference: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """One step of Exudyn's static solver: total coordinates (n_nodes, 6) and the joints'
        reactions.

        The nodes' rotational increments are body-frame ones, exp(hat(phi)) exp(hat(w)); Exudyn's
        Lie-group integrators compose them so, its static solver adds them to phi. Where rotations
        from the global axes are large that spoils the convergence, so single steps are taken and
        composed here.
        """
        data, initial = self._mbs.systemData, exu.ConfigurationType.Initial
        data.SetODE2Coordinates((total - reference).ravel(), configuration=initial)
        data.SetAECoordinates(np.zeros(data.AEsize()), configuration=initial)
        try:
            # a new solver each time: one that is kept is quicker, but its steps depend, in their
            # last digits, on earlier ones
            exu.MainSolverStatic().SolveSystem(self._mbs, self._settings)
        except Exception as error:  # Exudyn raises its own types, some of them plain RuntimeErrors
            raise SimulationFailure(
                f"Exudyn's static solver failed: {str(error).splitlines()[0][:120]}"
            ) from None
        increment = data.GetODE2Coordinates().reshape(-1, 6) - (total - reference)
        if not np.isfinite(increment).all():
            raise SimulationFailure("Exudyn's static solver found no finite step")
        turned = exp_so3(total[:, 3:]) @ exp_so3(increment[:, 3:])
        return np.concatenate(
            [total[:, :3] + increment[:, :3], log_so3(turned)], axis=1
        ), data.GetAECoordinates()

    def _residual(self, coordinates: np.ndarray, reactions: np.ndarray) -> float:
        """Norm of Exudyn's residual, equations of equilibrium and of joints, at coordinates
        (n_nodes, 6)."""
        solver, data = exu.MainSolverStatic(), self._mbs.systemData
        solver.InitializeSolver(self._mbs, self._settings)
        data.SetODE2Coordinates(coordinates.ravel())
        data.SetAECoordinates(reactions)
        solver.ComputeNewtonResidual(self._mbs, self._settings)
        return float(np.linalg.norm(solver.GetSystemResidual()))

    # -- model ---------------------------------------------------------------------------------
    def _add_nodes_and_beams(self) -> None:
        mbs, scene, layout = self._mbs, self.scene, self.layout
        lengths = scene.length_constant + np.where(
            scene.length_parameter >= 0, scene.length_scale, 0.0
        )
        self._nodes = [
            mbs.AddNode(item.NodeRigidBodyRotVecLG(referenceCoordinates=row.tolist()))
            for row in self._reference(lengths)
        ]
        sections: dict[bytes, exu.BeamSection] = {}
        self._beams = []
        for (tail, head), K, L in zip(layout.element_nodes, scene.stiffness, lengths):
            key = K.tobytes()
            if key not in sections:
                section = exu.BeamSection()
                section.stiffnessMatrix = np.diag(
                    K / self._force / np.repeat([1.0, self._length**2], 3)
                )
                section.inertia, section.massPerLength = np.eye(3), 1.0  # unused: statics
                sections[key] = section
            self._beams.append(
                mbs.AddObject(
                    item.ObjectBeamGeometricallyExact(
                        nodeNumbers=[self._nodes[tail], self._nodes[head]],
                        length=L / self._length,
                        sectionData=sections[key],
                    )
                )
            )

    def _add_joints(self) -> None:
        mbs, scene, layout = self._mbs, self.scene, self.layout
        self._ground = mbs.AddObject(item.ObjectGround())
        self._markers: dict[int, object] = {}
        self._bodies = {
            c.node: mbs.AddObject(
                item.ObjectRigidBody(
                    mass=1, inertia=[1, 1, 1, 0, 0, 0], nodeNumber=self._nodes[c.node]
                )
            )
            for c in layout.carriers.values()
            if c.rigid
        }
        for key, node, frame, offset in layout.ties:
            carrier = layout.carriers[key]
            mbs.AddObject(
                item.ObjectJointGeneric(
                    markerNumbers=[self._marker_at(carrier, offset), self._marker(node)],
                    constrainedAxes=[1] * 6,
                    rotationMarker0=carrier.frame.T,
                    rotationMarker1=frame.T,
                )
            )
        driven = set((scene.driven.dofs - 6 * scene.n_bodies).tolist())
        fixed = scene.pinned[6 * scene.n_bodies :]
        self._turned: list[tuple[int, int, Carrier]] = []
        for (body, hinge), carrier in layout.carriers.items():
            if hinge < 0:
                continue
            hub = layout.carriers[body, -1]
            markers = [self._marker_at(hub, scene.hinge_centre[hinge]), self._marker(carrier.node)]
            if hinge in driven or fixed[hinge]:
                joint = mbs.AddObject(
                    item.ObjectJointGeneric(
                        markerNumbers=markers,
                        constrainedAxes=[1] * 6,
                        rotationMarker0=hub.frame.T,
                        rotationMarker1=carrier.frame.T,
                    )
                )
                self._turned.append((joint, hinge, hub))
            else:
                along = axes_along_z(scene.hinge_axis[hinge])
                mbs.AddObject(
                    item.ObjectJointRevoluteZ(
                        markerNumbers=markers,
                        rotationMarker0=hub.frame.T @ along,
                        rotationMarker1=carrier.frame.T @ along,
                    )
                )

    def _add_pins(self) -> None:
        """Ground joints for pinned and driven coordinates; one body is held where the scene holds
        none.

        A scene that only an attraction holds is in balance under the attraction's forces, which act
        here as given forces: holding one body then takes no force.
        """
        scene = self.scene
        held = scene.pinned[: 6 * scene.n_bodies].reshape(-1, 6).copy()
        for dof in scene.driven.dofs[scene.driven.dofs < 6 * scene.n_bodies]:
            held[dof // 6, dof % 6] = True
        if not held.any():
            held[0] = True
        self._pins = []
        for body in np.flatnonzero(held.any(1)):
            ground = self._mbs.AddMarker(
                item.MarkerBodyRigid(bodyNumber=self._ground, localPosition=[0, 0, 0])
            )
            carrier = self.layout.carriers[int(body), -1]
            turning = held[body, 3:].any()
            joint = self._mbs.AddObject(
                item.ObjectJointGeneric(
                    markerNumbers=[ground, self._marker(carrier.node)],
                    constrainedAxes=held[body].astype(int).tolist(),
                    rotationMarker1=carrier.frame.T,
                )
            )
            self._pins.append((ground, joint, int(body), bool(turning and held[body, 3:].all())))

    def _add_loads(self) -> None:
        """Load items whose values `_set_parameters` fills in; only where something can act."""
        scene, layout = self.scene, self.layout
        self._torques, self._weights, self._wrenches = [], [], []
        if scene.actuated is not None:
            for hinge in scene.actuated:
                carrier = next(c for key, c in layout.carriers.items() if key[1] == hinge)
                hub = layout.carriers[carrier.body, -1]
                for owner, sign in ((hub, 1.0), (carrier, -1.0)):
                    load = self._load(item.LoadTorqueVector, owner.node, bodyFixed=True)
                    self._torques.append((load, sign * owner.frame.T @ scene.hinge_axis[hinge]))
        if scene.weight is not None:
            ends = np.unique(layout.element_nodes)
            self._weights = [(int(n), self._load(item.LoadForceVector, n)) for n in ends]
        for body in sorted(
            {
                int(d) // 6
                for term in scene.terms
                for d in np.unique(term.dofs)
                if d < 6 * scene.n_bodies
            }
        ):
            hub = layout.carriers[body, -1]
            self._wrenches.append(
                (
                    body,
                    hub,
                    self._load(item.LoadForceVector, hub.node),
                    self._load(item.LoadTorqueVector, hub.node, bodyFixed=True),
                )
            )
        self._springs = [
            (term, [self._spring(int(a), int(b)) for a, b in term.pairs])
            for term in scene.terms
            if hasattr(term, "pairs")
        ]
        self._hinge_wrenches = []
        for hinge in sorted(
            {
                int(d) - 6 * scene.n_bodies
                for term in scene.terms
                for d in np.unique(term.dofs)
                if 6 * scene.n_bodies <= d < scene.n_dofs
            }
        ):
            carrier = next(c for key, c in layout.carriers.items() if key[1] == hinge)
            hub = layout.carriers[carrier.body, -1]
            for owner, sign in ((hub, -1.0), (carrier, 1.0)):
                load = self._load(item.LoadTorqueVector, owner.node, bodyFixed=True)
                self._hinge_wrenches.append(
                    (hinge, load, sign * owner.frame.T @ scene.hinge_axis[hinge])
                )

    def _spring(self, first: int, second: int) -> tuple[object, int, int]:
        """A connector between two bodies that lends Exudyn's Jacobian the stiffness of what acts
        between them.

        It is unstressed at the equilibrium: the forces themselves are loads. Without it the rods
        alone would have to hold a mesh together that its actuators hold.
        """
        hubs = [self.layout.carriers[body, -1] for body in (first, second)]
        connector = self._mbs.AddObject(
            item.ObjectConnectorRigidBodySpringDamper(
                markerNumbers=[self._marker(hub.node) for hub in hubs],
                rotationMarker0=hubs[0].frame.T,
                # the other one leaves out the moment of its force about the first body
                intrinsicFormulation=True,
            )
        )
        return connector, first, second

    def _load(self, kind: type, node: int, **options: object) -> object:
        return self._mbs.AddLoad(
            kind(markerNumber=self._marker(node), loadVector=[0, 0, 0], **options)
        )

    def _marker_at(self, carrier: Carrier, offset: np.ndarray) -> object:
        """A marker off a carrier's origin, where the carrier is a rigid body, or in it."""
        if not offset.any():
            return self._marker(carrier.node)
        return self._mbs.AddMarker(
            item.MarkerBodyRigid(
                bodyNumber=self._bodies[carrier.node],
                localPosition=(offset / self._length).tolist(),
            )
        )

    def _marker(self, node: int) -> object:
        if node not in self._markers:
            self._markers[node] = self._mbs.AddMarker(
                item.MarkerNodeRigid(nodeNumber=self._nodes[node])
            )
        return self._markers[node]

    def _solver_settings(self) -> exu.SimulationSettings:
        settings = exu.SimulationSettings()
        static = settings.staticSolver
        static.verboseMode = 0
        static.numberOfLoadSteps = 1
        static.adaptiveStep = False
        static.newton.maxIterations = 1  # see _newton_step
        scene = self.scene
        largest = scene.stiffness[:, 0].max() / self._force
        self._tiny = float(np.finfo(float).eps * scene.size * largest / scene.length_scale)
        static.newton.relativeTolerance = static.newton.absoluteTolerance = np.finfo(float).tiny
        settings.solution.file.write = False
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        settings.linearSolver.reuseAnalyzedPattern = True
        return settings

    def _reference(self, lengths: np.ndarray) -> np.ndarray:
        """(n_nodes, 6) reference coordinates, in the model's units."""
        coordinates = self.layout.reference_coordinates(self.scene, lengths)
        coordinates[:, :3] /= self._length
        return coordinates

    # -- values --------------------------------------------------------------------------------
    def _set_parameters(self, eq: Equilibrium, lengths: np.ndarray, reference: np.ndarray) -> None:
        mbs, scene, layout = self._mbs, self.scene, self.layout
        for node, row in zip(self._nodes, reference):
            mbs.SetNodeParameter(node, "referenceCoordinates", row.tolist())
        for beam, length in zip(self._beams, lengths):
            mbs.SetObjectParameter(beam, "length", float(length / self._length))
        turns = scene.hinge_turns(eq.state.angles)
        for joint, hinge, hub in self._turned:
            mbs.SetObjectParameter(joint, "rotationMarker0", hub.frame.T @ turns[hinge])
        for ground, joint, body, turned in self._pins:
            mbs.SetMarkerParameter(
                ground, "localPosition", (eq.state.positions[body] / self._length).tolist()
            )
            if turned:
                mbs.SetObjectParameter(joint, "rotationMarker0", eq.state.rotations[body])
        if scene.actuated is not None:
            per_hinge = eq.torque / (self._force * self._length) / len(scene.actuated)
            for load, axis in self._torques:
                mbs.SetLoadParameter(load, "loadVector", (per_hinge * axis).tolist())
        if self._weights and scene.weight is not None:
            share = 0.5 * lengths[:, None] * scene.weight / self._force
            force = np.zeros((layout.n_nodes, 3))
            np.add.at(force, layout.element_nodes[:, 0], share)
            np.add.at(force, layout.element_nodes[:, 1], share)
            for node, load in self._weights:
                mbs.SetLoadParameter(load, "loadVector", force[node].tolist())
        if scene.terms:
            self._set_wrenches(eq.state)

    def _set_wrenches(self, state: State) -> None:
        """Forces that the terms exert at the state: minus their gradients."""
        scene = self.scene
        total = np.zeros(scene.n_dofs + 1)
        for term in scene.terms:
            _, g, H = term.gradient_hessian(state)
            np.subtract.at(total, term.dofs, g)
            for springs in (springs for owner, springs in self._springs if owner is term):
                self._set_springs(springs, H, state)
        total /= self._force
        for body, hub, force, torque in self._wrenches:
            part = total[6 * body : 6 * body + 6] / np.repeat([1.0, self._length], 3)
            self._mbs.SetLoadParameter(force, "loadVector", part[:3].tolist())
            self._mbs.SetLoadParameter(torque, "loadVector", (hub.frame.T @ part[3:]).tolist())
        for hinge, load, axis in self._hinge_wrenches:
            self._mbs.SetLoadParameter(
                load,
                "loadVector",
                (total[6 * scene.n_bodies + hinge] / self._length * axis).tolist(),
            )

    def _set_springs(
        self, springs: list[tuple[object, int, int]], hessians: np.ndarray, state: State
    ) -> None:
        """Connectors' stiffness from the second derivatives (m, 12, 12) of what acts between the
        two bodies.

        Seen from the first body's axes, the second one moves by R_0 dx and turns by R_0 theta.
        """
        unit = np.repeat([self._length, 1.0], 3)
        for (connector, first, second), H in zip(springs, hessians):
            R0, R1 = state.rotations[first], state.rotations[second]
            change = np.zeros((6, 6))
            change[:3, :3], change[3:, 3:] = R0, R1.T @ R0
            offset = np.zeros(6)
            offset[:3] = R0.T @ (state.positions[second] - state.positions[first]) / self._length
            frame = self.layout.carriers[second, -1].frame
            stiffness = H[6:, 6:] * np.outer(unit, unit) / (self._force * self._length)
            self._mbs.SetObjectParameter(connector, "stiffness", change.T @ stiffness @ change)
            self._mbs.SetObjectParameter(connector, "offset", offset.tolist())
            self._mbs.SetObjectParameter(connector, "rotationMarker1", frame.T @ R1.T @ R0)

    def _coordinates(self, state: State) -> np.ndarray:
        """Total coordinates (n_nodes, 6) of Exudyn's nodes at a state."""
        layout = self.layout
        x, R = self.scene.node_poses(state)
        beams = layout.scene_node >= 0
        out = np.zeros((layout.n_nodes, 6))
        out[beams, :3], out[beams, 3:] = (
            x[layout.scene_node[beams]],
            log_so3(R[layout.scene_node[beams]]),
        )
        out[beams, :3] /= self._length
        turns = self.scene.hinge_turns(state.angles)
        for carrier in layout.carriers.values():
            if carrier.rigid:
                position, rotation = state.positions[carrier.body], state.rotations[carrier.body]
                if carrier.hinge >= 0:
                    position = position + rotation @ self.scene.hinge_centre[carrier.hinge]
                    rotation = rotation @ turns[carrier.hinge]
                out[carrier.node, :3], out[carrier.node, 3:] = (
                    position / self._length,
                    log_so3(rotation),
                )
        return out

    def _state(self, solution: np.ndarray, near: State) -> State:
        """The scene's state of Exudyn's coordinates; hinge angles on the same turn as those of a
        state nearby."""
        positions, rotations, angles = (
            near.positions.copy(),
            near.rotations.copy(),
            near.angles.copy(),
        )
        bodies, hinges, nodes, own = self.layout.carrier_arrays
        frames = exp_so3(solution[nodes, 3:]) @ own.transpose(0, 2, 1)
        hubs, turned = np.flatnonzero(hinges < 0), np.flatnonzero(hinges >= 0)
        positions[bodies[hubs]] = solution[nodes[hubs], :3] * self._length
        rotations[bodies[hubs]] = frames[hubs]
        turn = rotations[bodies[turned]].transpose(0, 2, 1) @ frames[turned]
        sine = np.stack(
            [
                turn[:, 2, 1] - turn[:, 1, 2],
                turn[:, 0, 2] - turn[:, 2, 0],
                turn[:, 1, 0] - turn[:, 0, 1],
            ],
            axis=1,
        )
        cosine = np.trace(turn, axis1=1, axis2=2) - 1
        measured = np.arctan2(
            np.einsum("nk,nk->n", sine, self.scene.hinge_axis[hinges[turned]]), cosine
        )
        angles[hinges[turned]] += (
            np.remainder(measured - near.angles[hinges[turned]] + np.pi, 2 * np.pi) - np.pi
        )
        return State(positions, rotations, angles)


def _units_of(scene: Scene) -> tuple[float, float]:
    """The model's units of length and force: those of a rod element, L and EI / L^2, rounded to
    powers of two.

    Forces and joint equations share one system of equations and one residual, so they have to be of
    similar size whatever the units of the scene. Powers of two cost no digit.
    """
    length = 2.0 ** round(np.log2(scene.length_scale))
    return length, 2.0 ** round(np.log2(np.median(scene.stiffness[:, 4:].min(axis=1)) / length**2))


def _accept_rotation_markers() -> None:
    """Let joints and connectors be given the rotation of their markers, which 1.12.244 and later
    advise against."""
    warnings.simplefilter("ignore", DeprecationWarning)


def solve_alone(
    scene: Scene,
    q: np.ndarray,
    iterations: int = 50,
    *,
    residual: float | None = None,
    start: State | None = None,
) -> dict[str, float | int | str]:
    """Exudyn's static solver by itself: what the fast solver is measured against.

    For scenes without actuation and terms.
    residual : force at which it may stop; default: only at 1e-8 of the first residual
    start : state, default the scene's initial one

    Returns seconds (of the processor) and iterations, or why it stopped, and the positions reached,
    as plain data.
    """
    model = ExudynModel(scene)
    lengths = scene.rest_lengths(q)
    reference = model._reference(lengths)
    state = scene.with_driven(scene.initial if start is None else start, q)
    origin = Equilibrium(
        state=state,
        q=q,
        opening=None,
        torque=0.0,
        stress=np.zeros((len(lengths), 6)),
        elastic_energy=0.0,
        potential=0.0,
        iterations=0,
        residual=0.0,
        escapes=0,
        wall_s=0.0,
    )
    with warnings.catch_warnings():
        _accept_rotation_markers()
        model._set_parameters(origin, lengths, reference)
    data = model._mbs.systemData
    data.SetODE2Coordinates(
        (model._coordinates(state) - reference).ravel(), configuration=exu.ConfigurationType.Initial
    )
    static = model._settings.staticSolver
    static.newton.maxIterations, static.newton.relativeTolerance = iterations, 1e-8
    if residual is not None:
        static.newton.absoluteTolerance = residual / model._force
    solver, begin = exu.MainSolverStatic(), process_time()
    try:
        converged = solver.SolveSystem(model._mbs, model._settings)
    except Exception as error:  # Exudyn raises its own types
        return {
            "iterations": f"failed: {str(error).splitlines()[0][:80]}",
            "seconds": process_time() - begin,
        }
    steps = int(solver.it.newtonSteps)
    return {
        "iterations": steps if converged else f"not converged within {iterations}",
        "seconds": process_time() - begin,
    }
