"""Orthogonal grids and C-meshes: lamellas on surfaces, joined at right angles to them."""

from . import c_mesh, design  # noqa: F401  # register the classes
