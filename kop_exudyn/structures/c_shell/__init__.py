"""C-shells: planar networks of curved rods that open into space."""

from . import design  # noqa: F401  # registers the class
