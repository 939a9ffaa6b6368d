"""Umbrella meshes: cells of two plates and six arms that open to a surface."""

from . import design, importer  # noqa: F401  # register the class and its format
