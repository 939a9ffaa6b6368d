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
    "structures.base": ("Design", "ElementGroup", "design_from_dict"),
    "structures.load_case": ("LoadCase",),
    "kit.parts": ("Assignment", "Kit"),
    "kit.cluster": ("cluster",),
    "optimize.input_fit": ("fit_input",),
    "optimize.job": ("JobSettings", "run_job"),
    "optimize.objective": ("Weights",),
    "optimize.stages": ("StageSettings",),
    "equilibrium.sensitivities": ("Sensitivities",),
    "analysis.kit_result": ("KitResult",),
    "analysis.new_design": ("project_design",),
    "analysis.simulation": ("SimulationResult", "simulate"),
    "io.designs": ("load_design", "load_designs"),
    "io.export": ("export_desk", "export_workshop"),
    "io.kits": ("load_kit", "save_kit"),
    "io.pieces": ("parts_list_of",),
    "io.results": ("load_result",),
    "io.saved_runs": ("load_run",),
    "io.templates": ("CutOptions",),
    "report.kit_run": ("optimize_kit",),
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
