"""Folders whose every module registers something: a structure class, a kind of parts, a term of the
objective."""

from __future__ import annotations

import pkgutil
from importlib import import_module


def load_folder(package: str) -> None:
    """Import every module of a package, so that something is added to it by adding its file."""
    for module in pkgutil.iter_modules(import_module(package).__path__):
        import_module(f"{package}.{module.name}")
