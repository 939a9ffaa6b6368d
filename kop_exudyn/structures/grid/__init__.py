"""Orthogonal grids: lamellas on surfaces, joined at right angles to them."""

from . import design, net  # noqa: F401  # register the class and its import
