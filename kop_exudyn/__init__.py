"""Kits of parts for bending-active structures.

The names below are loaded at first use, so that ``import kop_exudyn`` costs milliseconds:

>>> import kop_exudyn as kop
>>> design = kop.load_design("models/conformals/01_sinh.json")  # doctest: +SKIP
>>> kop.simulate(design).fit.max_percent  # doctest: +SKIP
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .provenance import __version__ as __version__

if TYPE_CHECKING:  # the same names, for type checkers and editors
    from .analysis.model_sensitivities import ModelSensitivities as ModelSensitivities
    from .analysis.simulation import SimulationResult as SimulationResult
    from .analysis.simulation import simulate as simulate
    from .equilibrium.path import PathOptions as PathOptions
    from .equilibrium.path import trace_path as trace_path
    from .equilibrium.sensitivities import Sensitivities as Sensitivities
    from .errors import InputError as InputError
    from .errors import SimulationFailure as SimulationFailure
    from .exchange.export import export_desk as export_desk
    from .exchange.export import export_simulation as export_simulation
    from .exchange.objects import to_compas as to_compas
    from .exchange.objects import to_meshio as to_meshio
    from .exchange.objects import to_pandas as to_pandas
    from .fabrication.folder import export_workshop as export_workshop
    from .fabrication.options import CutOptions as CutOptions
    from .fabrication.pieces import parts_list_of as parts_list_of
    from .io.datasets import load_designs as load_designs
    from .io.designs import load_design as load_design
    from .io.kits import load_kit as load_kit
    from .io.kits import save_kit as save_kit
    from .io.results import load_result as load_result
    from .io.saved_runs import load_run as load_run
    from .kit.cluster import cluster as cluster
    from .kit.groups import ElementGroup as ElementGroup
    from .kit.parts import Assignment as Assignment
    from .kit.parts import Kit as Kit
    from .report.kit_report import write_kit_report as write_kit_report
    from .report.kit_run import optimize_and_report as optimize_and_report
    from .report.plot import plot as plot
    from .search.input_fit import fit_input as fit_input
    from .search.result import KitResult as KitResult
    from .search.run import optimize_kit as optimize_kit
    from .search.settings import JobSettings as JobSettings
    from .search.settings import StageSettings as StageSettings
    from .search.weights import Weights as Weights
    from .structures.base import Design as Design
    from .structures.base import design_from_dict as design_from_dict
    from .structures.loads import LoadCase as LoadCase

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
    "search.weights": ("Weights",),
    "search.settings": (
        "JobSettings",
        "StageSettings",
    ),
    "equilibrium.path": ("PathOptions", "trace_path"),
    "equilibrium.sensitivities": ("Sensitivities",),
    "search.result": ("KitResult",),
    "analysis.model_sensitivities": ("ModelSensitivities",),
    "analysis.simulation": ("SimulationResult", "simulate"),
    "io.datasets": ("load_designs",),
    "io.designs": ("load_design",),
    "exchange.export": ("export_desk", "export_simulation"),
    "exchange.objects": ("to_compas", "to_meshio", "to_pandas"),
    "report.plot": ("plot",),
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


if not TYPE_CHECKING:  # checkers would take every name for one of ours

    def __getattr__(name: str) -> Any:
        if name not in _MODULE_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
        globals()[name] = value  # found directly from now on
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
