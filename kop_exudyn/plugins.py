"""Registries: structure classes, kinds of parts, terms of the objective, each added by one file.

Three places are looked in, in this order: what was registered so far, the registry's own folder in
this package, and installed packages that name a module in the entry-point group ``kop_exudyn``:

    [options.entry_points]
    kop_exudyn =
        my_terms = my_package.terms
"""

from __future__ import annotations

import copyreg
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Generic, TypeVar

ENTRY_POINTS = "kop_exudyn"

T = TypeVar("T")


def _cached_property(function: Callable[..., Any], name: str | None) -> cached_property:
    made = cached_property(function)
    if name is not None:
        made.__set_name__(object, name)
    return made


# Classes of scripts are sent to other processes by value; up to Python 3.11 cached properties have
# a lock, which can't be sent.
copyreg.pickle(
    cached_property,
    lambda one: (_cached_property, (one.func, one.attrname)),
)


class Registry(Generic[T]):
    """Things by name.

    package : whose modules register what comes with this package
    what : what is registered, where a folder registers several sorts of things
    items : what was registered so far
    """

    _all: dict[str, Registry[Any]] = {}

    def __init__(self, package: str, what: str = ""):
        self.package = package
        self.items: dict[str, T] = {}
        self._loaded = False
        Registry._all[f"{package} {what}"] = self

    def add(self, name: str, item: T) -> None:
        """Make a thing known under a name."""
        self.items[name] = item

    def get(self, name: Any) -> T | None:
        """The thing of that name, None where there is none."""
        if name not in self.items:
            self._load_alone(name)
        if name not in self.items:
            self._load()
        return self.items.get(name)

    def names(self) -> list[str]:
        """All names, sorted."""
        self._load()
        return sorted(self.items)

    def _load_alone(self, name: Any) -> None:
        """Import the module that is named like the thing, if there is one: all of them take
        long."""
        if isinstance(name, str) and name.isidentifier():
            module = f"{self.package}.{name}"
            if find_spec(module):
                import_module(module)

    def _load(self) -> None:
        if self._loaded:
            return
        from importlib.metadata import entry_points

        self._loaded = True
        for module in pkgutil.iter_modules(import_module(self.package).__path__):
            import_module(f"{self.package}.{module.name}")
        for entry in entry_points(group=ENTRY_POINTS):
            entry.load()


def registered_elsewhere() -> dict[str, dict[str, Any]]:
    """By registry, what a user's own modules registered: what another process has to be told of."""
    return {package: dict(_foreign(registry.items)) for package, registry in Registry._all.items()}


def adopt(items: Mapping[str, Mapping[str, Any]]) -> None:
    """Make known here what `registered_elsewhere` told of another process."""
    for package, own in items.items():
        for name, item in own.items():
            Registry._all[package].add(name, item)


def _foreign(items: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Classes and functions of other packages, and all data: data don't tell where they are from,
    and do no harm where they are known already."""
    for name, item in items.items():
        if not (callable(item) and item.__module__.startswith(f"{__package__}.")):
            yield name, item
