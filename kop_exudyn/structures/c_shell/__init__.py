"""C-shells: planar networks of curved rods that open into space."""

from . import design, net  # noqa: F401  # register the class and its import
