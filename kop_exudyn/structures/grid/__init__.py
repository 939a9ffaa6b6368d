"""Orthogonal grids: lamellas on surfaces, joined at right angles to them."""

from . import design  # noqa: F401  # registers the class
