"""Umbrella meshes: cells of two plates and six arms that open to a surface."""

from . import design  # noqa: F401  # registers the class
