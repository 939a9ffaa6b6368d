"""Whether a network on a surface is close to a C-mesh: a grid that can collapse to a flat strip.

Liu, Pellis, Chiang, Rist, Wallner, Pottmann, "Deployable strip structures" (ACM TOG 42(4), 2023,
doi 10.1145/3592393): grids that collapse to a straight flat strip are Chebyshev nets on surfaces of
constant Gaussian curvature; those that collapse to a circular one lie on linear Weingarten
surfaces, a K + b H + c = 0. Such grids have a soft or even free mechanism, so that an equilibrium
close to the design surface may not exist without supports.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ...geometry.network import Strand
from .design import Grid


@dataclass(frozen=True)
class CMeshResiduals:
    """Dimensionless residuals, 0 for the ideal; curvatures are measured at the joints.

    chebyshev : rms difference of opposite sides of the meshes, over their mean
    gauss : rms deviation of the Gaussian curvature from its mean, over the mean square principal
        curvature
    weingarten : rms of a K / k^2 + b H / k + c at the best a^2 + b^2 = 1, k the rms principal
        curvature
    coefficients : these (a, b, c)
    normal_curvature : rms deviation of the normal curvature from its mean along each lamella, over
        k
    straight : mean square normal curvature over k^2, rooted: 0 for asymptotic lines
    """

    chebyshev: float
    gauss: float
    weingarten: float
    coefficients: tuple[float, float, float]
    normal_curvature: float
    straight: float

    def collapses_straight(self, tolerance: float = 0.005) -> bool:
        """Chebyshev net, constant Gaussian curvature."""
        return max(self.chebyshev, self.gauss) <= tolerance

    def collapses_circular(self, tolerance: float = 0.005) -> bool:
        """Linear Weingarten surface; every small enough patch of a surface of revolution is close
        to one."""
        return self.weingarten <= tolerance


def c_mesh_residuals(grid: Grid) -> CMeshResiduals:
    """How far a grid's network and surface are from those of a C-mesh."""
    local = grid.surface.at(grid.network.joints)
    principal = local.principal()[0]
    k = max(float(np.sqrt(np.mean(principal**2))), np.finfo(float).tiny)
    K, H = local.gauss / k**2, local.mean / k
    pair = np.stack([K, H], axis=1)
    values, vectors = np.linalg.eigh(np.cov(pair.T, bias=True))
    a, b = vectors[:, 0]
    normal = [_normal_curvatures(grid, strand) / k for strand in grid.network.strands]
    return CMeshResiduals(
        chebyshev=_chebyshev(grid),
        gauss=float(K.std()),
        weingarten=float(np.sqrt(max(values[0], 0.0))),
        coefficients=(float(a), float(b), -float(pair.mean(axis=0) @ (a, b))),
        normal_curvature=float(
            np.sqrt(np.mean(np.concatenate([(c - c.mean()) ** 2 for c in normal])))
        ),
        straight=float(np.sqrt(np.mean(np.concatenate(normal) ** 2))),
    )


def _normal_curvatures(grid: Grid, strand: Strand) -> np.ndarray:
    """At the joints of one curve."""
    return grid.surface.at(grid.network.joints[strand.joints]).normal_curvatures(strand.tangents)


def _chebyshev(grid: Grid) -> float:
    """rms relative difference of opposite sides; 1 without any quadrilateral mesh."""
    differences = [
        (s - t) / (0.5 * (s + t)) for sides in _meshes(grid) for s, t in (sides[::2], sides[1::2])
    ]
    return float(np.sqrt(np.mean(np.square(differences)))) if differences else 1.0


def _meshes(grid: Grid) -> list[tuple[float, float, float, float]]:
    """Arc lengths of the sides, in order, of all quadrilaterals between four neighbouring
    joints."""
    # joint -> neighbour -> (curve, length)
    sides: dict[int, dict[int, tuple[int, float]]] = defaultdict(dict)
    for curve, lamella in enumerate(grid.straight.lamellas):
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
