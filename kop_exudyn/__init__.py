"""Kits of parts for bending-active structures.

The names below are loaded at first use, so that ``import kop_exudyn`` costs milliseconds:

>>> import kop_exudyn as kop
>>> design = kop.load_design("models/conformals/01_sinh.json")  # doctest: +SKIP
>>> kop.simulate(design).fit.max_percent  # doctest: +SKIP
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# module -> the public names that it holds
_PUBLIC = {
    "errors": ("InputError", "SimulationFailure"),
    "kit.groups": ("ElementGroup",),
    "structures.base": ("Design", "design_from_dict"),
    "structures.loads": ("LoadCase",),
    "kit.parts": ("Assignment", "Kit"),
    "kit.cluster": ("cluster",),
    "search.input_fit": ("fit_input",),
    "search.run": ("optimize_kit",),
    "search.objective": ("Weights",),
    "search.settings": (
        "JobSettings",
        "StageSettings",
    ),
    "equilibrium.sensitivities": ("Sensitivities",),
    "search.result": ("KitResult",),
    "analysis.simulation": ("SimulationResult", "simulate"),
    "io.datasets": ("load_designs",),
    "io.designs": ("load_design",),
    "exchange.export": ("export_desk", "export_simulation"),
    "fabrication.folder": ("export_workshop",),
    "io.kits": ("load_kit", "save_kit"),
    "fabrication.pieces": ("parts_list_of",),
    "io.results": ("load_result",),
    "io.saved_runs": ("load_run",),
    "fabrication.options": ("CutOptions",),
    "report.kit_report": ("write_kit_report",),
    "report.kit_run": ("optimize_and_report",),
}
_MODULE_OF = {name: module for module, names in _PUBLIC.items() for name in names}

__all__ = ["__version__", *sorted(_MODULE_OF)]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
    globals()[name] = value  # found directly from now on
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
