"""Time by phase and memory against size: gridshells of up to 100,000 unknowns, each in a process of
its own."""

from __future__ import annotations

import multiprocessing
import resource
import sys
from time import perf_counter, process_time
from typing import Any

import numpy as np

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.system import System

from .benchmark_scenes import gridshell

_SHRINK = 1e-3  # of all rest lengths: what the solve has to do
_PIECES = 3
PHASES = ("assembly", "factorisation", "rest")


def scaling(sizes: tuple[int, ...], runs: int) -> list[dict[str, Any]]:
    """One row a size (joints along a side). The processes are started anew: peak memory belongs to
    one size."""
    context = multiprocessing.get_context("spawn")
    rows = []
    for joints in sizes:
        with context.Pool(1) as pool:
            rows.append(pool.apply(measured, (joints, runs)))
    return rows


def measured(joints: int, runs: int) -> dict[str, Any]:
    """Seconds by phase of one size, and the process's peak memory in MiB."""
    solve(*_system(3))  # compiles
    before = _peak_mib()
    begin = process_time()
    scene, q = gridshell(joints, _PIECES, _SHRINK)
    scene_s = process_time() - begin
    begin = process_time()
    system = System(scene)
    maps_s = process_time() - begin
    system.set_parameters(q)
    system.assemble(scene.initial)
    first_s = _seconds(system.factorise)  # with the symbolic analysis
    times = []
    for _ in range(runs):
        system.counters.assembly_s = system.counters.factorisation_s = 0.0
        begin, wall = process_time(), perf_counter()
        equilibrium = solve(system, q)
        total, wall = process_time() - begin, perf_counter() - wall
        # shares of wall time
        spent = np.array([system.counters.assembly_s, system.counters.factorisation_s]) / wall
        times.append((total, *spent * total, (1 - spent.sum()) * total))
    total, assembly, factorisation, rest = sorted(times)[len(times) // 2]
    numeric_s = float(np.median([_seconds(system.factorise) for _ in range(runs)]))
    rhs = np.ones(system.n_unknowns)
    solve_s = float(np.median([_seconds(lambda: system.solve(rhs)) for _ in range(runs)]))
    return {
        "unknowns": system.n_unknowns,
        "elements": len(scene.elements),
        "iterations": equilibrium.iterations,
        "seconds": float(total),
        "assembly": float(assembly),
        "factorisation": float(factorisation),
        "rest": float(rest),
        "scene": scene_s,
        "assembly maps": maps_s,
        "symbolic": max(first_s - numeric_s, 0.0),
        "one numeric factorisation": numeric_s,
        "one solve": solve_s,
        "entries of the factor": system.factorisation.factor_entries,
        "peak MiB": _peak_mib(),
        "before MiB": before,
    }


def _system(joints: int) -> tuple[System, np.ndarray]:
    scene, q = gridshell(joints, _PIECES, _SHRINK)
    return System(scene), q


def _seconds(function) -> float:
    begin = process_time()
    function()
    return process_time() - begin


def _peak_mib() -> float:
    """Peak resident memory of this process; Linux counts KiB, macOS bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (
        2**20 if sys.platform == "darwin" else 2**10
    )
