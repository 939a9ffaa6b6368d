"""The element against Exudyn's own residual of the same two-node system."""

from __future__ import annotations

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
import pytest
from support.elements import evaluate_compiled

from kop_exudyn.rods import element
from kop_exudyn.rods.rotations import exp_se3, exp_so3, log_so3

K = np.array([300.0, 20.0, 15.0, 0.4, 0.5, 0.6])
L = 0.8
CURVATURES = {
    "straight": [0.0, 0.0, 0.0],
    "pre-curved": [0.3, -0.5, 0.8],
    "nearly straight": [1e-7, 0.0, -2e-7],
}


class TwoNodes:
    """Exudyn's beam between two nodes, unstressed at rest strain gamma."""

    def __init__(self, gamma: np.ndarray):
        self._container = exu.SystemContainer()
        self._mbs = mbs = self._container.AddSystem()
        p, R = exp_se3(L * gamma)
        self._reference = np.concatenate([np.zeros(6), p, log_so3(R)])
        nodes = [
            mbs.AddNode(item.NodeRigidBodyRotVecLG(referenceCoordinates=half.tolist()))
            for half in self._reference.reshape(2, 6)
        ]
        section = exu.BeamSection()
        section.stiffnessMatrix = np.diag(K)
        section.inertia, section.massPerLength = np.eye(3), 1.0
        mbs.AddObject(
            item.ObjectBeamGeometricallyExact(nodeNumbers=nodes, length=L, sectionData=section)
        )
        mbs.Assemble()
        self._settings = exu.SimulationSettings()
        self._settings.solution.file.write = False
        self._solver = exu.MainSolverStatic()
        self._solver.InitializeSolver(mbs, self._settings)

    def forces(self, x0, R0, x1, R1) -> np.ndarray:
        """Internal forces (12,) on the nodes, moments in body axes: Exudyn's residual."""
        total = np.concatenate([x0, log_so3(R0), x1, log_so3(R1)])
        self._mbs.systemData.SetODE2Coordinates(total - self._reference)
        self._solver.ComputeNewtonResidual(self._mbs, self._settings)
        return np.array(self._solver.GetSystemResidual())


@pytest.mark.parametrize("curvature", CURVATURES.values(), ids=CURVATURES.keys())
def test_gradient_is_minus_exudyns_residual(curvature):
    """From no relative rotation to 3 rad, small angles and the limit of the series included."""
    gamma = np.array([1.0, 0, 0, *curvature])
    beam = TwoNodes(gamma)
    rng = np.random.default_rng(3)
    angles = np.concatenate(
        [[0.0, 1e-12, 1e-8, 1e-5, 0.4999999, 0.5, 0.5000001], rng.uniform(0, 3, 30), [3.0]]
    )
    for angle in angles:
        axis = rng.normal(size=3)
        R0 = exp_so3(rng.normal(size=3))
        R1 = R0 @ exp_so3(angle * axis / np.linalg.norm(axis))
        x0 = rng.normal(size=3)
        x1 = x0 + R0 @ (L * np.array([1.0, 0, 0]) + 0.1 * rng.normal(size=3))
        exudyn = beam.forces(x0, R0, x1, R1)
        arguments = (x0[None], R0[None], x1[None], R1[None], np.array([L]), K[None], gamma[None])
        for form in (element.evaluate, evaluate_compiled):
            gradient = form(*arguments)[1][0]
            assert np.abs(gradient + exudyn).max() < 1e-12 * np.abs(exudyn).max()
