"""Whether a network on a surface is close to a C-mesh: a grid that can collapse to a flat strip.

Liu, Pellis, Chiang, Rist, Wallner, Pottmann, "Deployable strip structures" (ACM TOG 42(4), 2023,
doi 10.1145/3592393): grids that collapse to a straight flat strip are Chebyshev nets on surfaces of
constant Gaussian curvature. Such grids have a soft or even free mechanism, so that an equilibrium
close to the design surface may not exist without supports.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Points
from ...geometry.surfaces import Surface
from .lamellas import Lamella

_CLOSE = 0.005  # of the residuals


@dataclass(frozen=True)
class CMeshResiduals:
    """Dimensionless residuals, 0 for the ideal; curvatures are measured at the joints.

    chebyshev : rms difference of opposite sides of the meshes, over their mean; 1 for nets without
        meshes
    gauss : rms deviation of the Gaussian curvature from its mean, over the mean square principal
        curvature
    """

    chebyshev: float
    gauss: float

    @property
    def collapses(self) -> bool:
        """Whether the net is close to one that collapses to a straight strip."""
        return max(self.chebyshev, self.gauss) <= _CLOSE


def c_mesh_residuals(
    surface: Surface, joints: Points, lamellas: Sequence[Lamella]
) -> CMeshResiduals:
    """How far a network and its surface are from those of a C-mesh.

    surface : that the net lies on
    joints : (n, 2) the joints in the surface's parameter plane
    lamellas : of the curves, with the lengths between their joints (units of the design)
    """
    local = surface.at(joints)
    square = max(float(np.mean(local.principal()[0] ** 2)), np.finfo(float).tiny)
    return CMeshResiduals(_chebyshev(lamellas), float((local.gauss / square).std()))


def _chebyshev(lamellas: Sequence[Lamella]) -> float:
    """rms relative difference of opposite sides; 1 without any quadrilateral mesh."""
    pairs = (pair for sides in _meshes(lamellas) for pair in (sides[::2], sides[1::2]))
    differences = [(s - t) / (0.5 * (s + t)) for s, t in pairs]
    return float(np.sqrt(np.mean(np.square(differences)))) if differences else 1.0


def _meshes(lamellas: Sequence[Lamella]) -> list[tuple[float, float, float, float]]:
    """Arc lengths of the sides, in order, of all quadrilaterals between four neighbouring
    joints."""
    # joint -> neighbour -> (curve, length)
    sides: dict[int, dict[int, tuple[int, float]]] = defaultdict(dict)
    for curve, lamella in enumerate(lamellas):
        strand = lamella.strand
        for (i, j), length in zip(strand.joints[strand.ends].tolist(), lamella.spans.lengths):
            sides[i][j] = sides[j][i] = (curve, float(length))
    found = {}
    for i, around in sides.items():
        for j, (first, s) in around.items():
            for m, (second, r) in around.items():
                if first >= second:
                    continue
                for k in (sides[j].keys() & sides[m].keys()) - {i}:
                    if sides[j][k][0] != first and sides[m][k][0] != second:
                        found[frozenset((i, j, k, m))] = (s, sides[j][k][1], sides[m][k][1], r)
    return list(found.values())
