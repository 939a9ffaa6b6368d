"""Exudyn itself, imported only if it is the one that this package is written for.

Its rod has changed its meaning between releases: which data its stress-free shape comes from, and
whether the generalised forces on rotations belong to increments in the node's own axes. A release
in which either is different would give wrong equilibria without any error. So the version is
looked at, and the rod's own forces in a case that tells the meanings apart.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..rods.element import evaluate
from ..rods.rotations import exp_se3, exp_so3, log_so3

TESTED = (
    1,
    13,
    6,
)  # the first release with the rod, the markers' own frames and the user functions

try:
    import exudyn as exu
    import exudyn.itemInterface as item
except ImportError as error:
    raise ImportError("kop_exudyn needs exudyn >= 1.13.6 (pip install 'exudyn>=1.13.6')") from error

# A rod with no two stiffnesses alike, its rest length and its rest curvature (twist, y, z).
_STIFFNESS = np.array([300.0, 20.0, 15.0, 0.4, 0.5, 0.6])
_LENGTH, _CURVATURE = 0.8, (0.3, -0.5, 0.8)
_AGREEMENT = 1e-9  # of the largest force

RodForces = Callable[[np.ndarray, np.ndarray, float, np.ndarray], np.ndarray]


def quiet_settings() -> exu.SimulationSettings:
    """Settings of Exudyn's static solver without output: one step, all loads at once."""
    settings = exu.SimulationSettings()
    static = settings.staticSolver
    static.verboseMode = 0
    static.numberOfLoadSteps = 1
    static.adaptiveStep = False
    static.useLoadFactor = False  # a residual is that of the whole load, whenever it is asked for
    settings.solution.file.write = False
    return settings


class ItemKind:
    """Items of one kind, as a model has hundreds of: each is a sample's settings with some of its
    own, in a dictionary, which Exudyn takes like the item itself. To make an item's object takes
    several times as long.

    sample : an item, as `item.MarkerNodeRigid()`
    """

    def __init__(self, sample: Any):
        self._settings = dict(sample)

    def __call__(self, **own: Any) -> dict[str, Any]:
        """The settings of an item. KeyError for one that the kind doesn't have."""
        for name in own:
            self._settings[name]
        return {**self._settings, **own}


NODE = ItemKind(item.NodeRigidBodyRotVecLG())
BEAM = ItemKind(item.ObjectBeamGeometricallyExact())
RIGID_BODY = ItemKind(item.ObjectRigidBody(mass=1, inertia=[1, 1, 1, 0, 0, 0]))
MARKER_OF_BODY = ItemKind(item.MarkerBodyRigid())
MARKER_OF_NODE = ItemKind(item.MarkerNodeRigid())
MARKER_OF_COORDINATE = ItemKind(item.MarkerNodeCoordinate())
HELD_COORDINATE = ItemKind(item.ObjectConnectorCoordinate())
HINGE = ItemKind(item.ObjectJointRevoluteZ())
JOINT = ItemKind(item.ObjectJointGeneric())


def rod_section(stiffness: np.ndarray) -> exu.BeamSection:
    """Exudyn's section of stiffnesses (6,) against stretch, two shears, twist and two bendings."""
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag(stiffness)
    section.inertia, section.massPerLength = np.eye(3), 1.0  # unused: statics
    return section


def rod_forces(
    reference: np.ndarray, placed: np.ndarray, length: float, stiffness: np.ndarray
) -> np.ndarray:
    """Forces (12,) that Exudyn's rod exerts on its two nodes, by Exudyn's own residual.

    reference, placed : (2, 6) positions and rotation vectors of the nodes, unstressed and as they
        are
    """
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    nodes = [
        mbs.AddNode(item.NodeRigidBodyRotVecLG(referenceCoordinates=row.tolist()))
        for row in reference
    ]
    mbs.AddObject(
        item.ObjectBeamGeometricallyExact(
            nodeNumbers=nodes, length=length, sectionData=rod_section(stiffness)
        )
    )
    mbs.Assemble()
    solver, settings = exu.MainSolverStatic(), quiet_settings()
    solver.InitializeSolver(mbs, settings)
    mbs.systemData.SetODE2Coordinates((placed - reference).ravel())
    solver.ComputeNewtonResidual(mbs, settings)
    return np.array(solver.GetSystemResidual())


def check_library(version: str, forces: RodForces = rod_forces) -> None:
    """Raise ImportError for an Exudyn whose rod is not the one that this package means.

    version : of Exudyn, as "1.13.6"
    forces : of a rod, as `rod_forces`; other ones are for tests
    """
    if tuple(int(part) for part in version.split(".")[:3]) < TESTED:
        needed = ".".join(map(str, TESTED))
        raise ImportError(f"kop_exudyn needs exudyn >= {needed}, found {version}")
    rest = np.array([1.0, 0.0, 0.0, *_CURVATURE])
    p, R = exp_se3(_LENGTH * rest)
    reference = np.concatenate([np.zeros(6), p, log_so3(R)]).reshape(2, 6)
    # somewhere else, turned far and bent: what no rigid motion of the unstressed rod is
    placed = np.array([[0.1, -0.2, 0.3, 0.9, -0.4, 0.7], [0.5, 0.2, 0.6, 1.4, 0.3, 0.2]])
    ends = exp_so3(placed[:, 3:])
    expected = -evaluate(
        placed[:1, :3],
        ends[:1],
        placed[1:, :3],
        ends[1:],
        np.array([_LENGTH]),
        _STIFFNESS[None],
        rest[None],
    )[1][0]
    largest = np.abs(expected).max()
    unstressed = np.abs(forces(reference, reference, _LENGTH, _STIFFNESS)).max()
    different = np.abs(forces(reference, placed, _LENGTH, _STIFFNESS) - expected).max()
    if not max(unstressed, different) <= _AGREEMENT * largest:
        raise ImportError(
            f"exudyn {version} has another rod than the one that kop_exudyn means: its forces "
            f"differ by {different / largest:.1e}, those of its unstressed shape are "
            f"{unstressed / largest:.1e} of the largest; releases known to fit: 1.13.6"
        )


check_library(exu.__version__)
