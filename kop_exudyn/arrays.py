"""Names of arrays with their shapes, for the signatures of the public interface.

Each is an ordinary NumPy array to type checkers; the shape stands beside it as a tuple, with a
letter for what is free: `typing.get_args(Points)` is (numpy.ndarray of float, ("n", 3)).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Whole = NDArray[np.int_]

NumbersLike = NDArray[Any] | Sequence[float]
"""What becomes an array of numbers: lists and tuples as well."""
RowsLike = NDArray[Any] | Sequence[Sequence[float] | NDArray[Any]]
"""What becomes an array of rows."""
Numbers = Annotated[_Floats, ("n",)]
"""One number each."""
Vector = Annotated[_Floats, (3,)]
"""One vector in space."""
Points = Annotated[_Floats, ("n", 3)]
"""Points or vectors in space, one a row."""
Indices = Annotated[_Whole, ("n",)]
"""Numbers of things, from 0, or how many there are of each."""
Triangles = Annotated[_Whole, ("n", 3)]
"""Corners of triangles, numbers of points."""
ElementIndices = Annotated[_Whole, ("n", "k")]
"""Where the k parameters of each of n elements stand among a design's parameters."""
Parameters = Annotated[_Floats, ("n_q",)]
"""The parameters q of one design, or of all designs after each other; a gradient in them."""
ParameterFlags = Annotated[NDArray[np.bool_], ("n_q",)]
"""Yes or no for each parameter."""
ParameterHessian = Annotated[_Floats, ("n_q", "n_q")]
"""Second derivatives in the parameters."""
ParameterRows = Annotated[_Floats, ("m", "n_q")]
"""Derivatives of m values in the parameters, one value a row."""
Parts = Annotated[_Floats, ("m", "k_p")]
"""The parameters of m parts of a kind, one part a row."""
KitVector = Annotated[_Floats, ("n_p",)]
"""The parameters of all parts of a kit, kind after kind."""
Stresses = Annotated[_Floats, ("n", 6)]
"""Of elements: axial force, two shear forces, torsion, two bending moments, one element a row."""
StressFactors = Annotated[_Floats, ("m", "r", 6)]
"""What m elements' generalised stresses are multiplied by, in r sums of each."""
StressRows = Annotated[_Floats, ("m", 6, "n_q")]
"""Derivatives of m elements' generalised stresses in the parameters."""
