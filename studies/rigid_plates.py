"""Umbrella meshes with rigid plates against plates of rods: what they save, and how far the deployed joints move.

    python studies/rigid_plates.py [--quick] [--released FOLDER] [--out reports/rigid_plates]

Every design is deployed twice from its compact state: plates as stars of three rods, ten times stiffer than the arms
(the model of the release), and plates as bodies of six unknowns that carry the hinges of their edges. Both final states
are confirmed by Exudyn. Joints are compared after the best rigid motion, in % of the bounding-box diagonal of those
between plates of rods. Times are medians of full deployments after compilation.
"""
from __future__ import annotations

import argparse
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from kop_exudyn.equilibrium.exudyn_model import ExudynModel
from kop_exudyn.equilibrium.newton import refine
from kop_exudyn.equilibrium.warm_up import warm_up
from kop_exudyn.io.designs import design_files, load_design
from kop_exudyn.io.json_files import write_json
from kop_exudyn.optimize.fitting import best_placement
from kop_exudyn.report.environment import environment
from kop_exudyn.report.page import Page
from kop_exudyn.report.style import FAINT, PALETTE, style
from kop_exudyn.structures.umbrella import Umbrella
from kop_exudyn.structures.umbrella_bodies import PLATE_MODELS, RIGID, RODS

ROOT = Path(__file__).resolve().parents[1]
RELEASED = ROOT.parent / "shared" / "data" / "umbrella"
NAMES = ("sphere_cap_0.3", "saddle_5t", "hemisphere_5t", "lilium")
STIFFER = (1, 10, 100, 1000)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two of our own designs, one run each")
    parser.add_argument("--released", type=Path, default=RELEASED, help="folder of released meshes; left out if absent")
    parser.add_argument("--out", type=Path, default=ROOT / "reports" / "rigid_plates")
    arguments = parser.parse_args()
    own = [load_design(path) for path in design_files(ROOT / "models" / "umbrellas")]
    runs = 1 if arguments.quick else 5
    released = [] if arguments.quick else [arguments.released / f"{name}.json.gz" for name in NAMES]
    designs = own[:2] if arguments.quick else own + [load_design(path) for path in released if path.exists()]
    warm_up()
    rows = [row for design in tqdm(designs, "designs") for row in compared(design, runs)]
    limit = approach(designs[0])
    page = report(rows, limit, designs[0].name)
    arguments.out.mkdir(parents=True, exist_ok=True)
    page.save(arguments.out / "index.html", overwrite=True)
    write_json(arguments.out / "rigid_plates.json", {"designs": rows, "stiffer": limit, "environment": environment()},
               overwrite=True)
    for row in rows:
        print(f"{row['design']:15s} {row['plates']:5s} {row['unknowns']:6d} unknowns {row['seconds']:6.3f} s "
              f"joints moved {row['moved max %']:.3f} % energy {row['energy %']:+.2f} %")


def compared(design: Umbrella, runs: int) -> list[dict[str, Any]]:
    """One row a model of the plates."""
    rows, joints, energies = [], {}, {}
    for model in PLATE_MODELS:
        own = design.with_plates(model)
        times = []
        for _ in range(runs):
            own.systems
            begin = perf_counter()
            equilibrium = own.deploy()["deployed"]
            times.append(perf_counter() - begin)
        confirmation = ExudynModel(own.scene()).confirm(refine(own.systems["deployed"], equilibrium))
        joints[model] = own.report_positions(confirmation.state)
        energies[model] = equilibrium.elastic_energy
        apart = distances(joints[model], joints[RODS])
        rows.append({
            "design": design.name, "plates": model, "cells": design.mesh.n_cells,
            "unknowns": own.systems["deployed"].n_unknowns, "iterations": equilibrium.iterations,
            "seconds": median(times), "moved max %": float(apart.max()), "moved mean %": float(apart.mean()),
            "energy %": 100 * (energies[model] / energies[RODS] - 1), "stable": equilibrium.stable,
            "Exudyn moved": confirmation.moved})
    return rows


def approach(design: Umbrella) -> list[dict[str, float]]:
    """Joints between plates of ever stiffer rods against those between rigid plates."""
    rigid = design.with_plates(RIGID)
    wanted = rigid.report_positions(rigid.deployed.state)
    rows = []
    for factor in STIFFER:
        stiff = design.with_plates(RODS, young=factor * design.plates.young)
        apart = distances(stiff.report_positions(stiff.deployed.state), wanted)
        rows.append({"plates stiffer by": factor, "joints apart, max %": float(apart.max())})
    return rows


def distances(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n,) after a rigid alignment, % of the bounding-box diagonal of y."""
    placed = best_placement(x, y, np.full(len(x), 1 / len(x))).apply(x)
    return 100 * np.linalg.norm(placed - y, axis=1) / np.linalg.norm(np.ptp(y, axis=0))


def drawing(rows: list[dict[str, Any]]) -> Figure:
    """Joints moved, and times, design by design."""
    names = list(dict.fromkeys(row["design"] for row in rows))
    rods, rigid = ([row for row in rows if row["plates"] == model] for model in PLATE_MODELS)
    place = np.arange(len(names))[::-1]
    moved, mean = ([row[key] for row in rigid] for key in ("moved max %", "moved mean %"))
    before, after = ([row["seconds"] for row in side] for side in (rods, rigid))
    with style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(7.4, 0.9 + 0.3 * len(names)), sharey=True,
                                             layout="constrained")
        left.hlines(place, 0, moved, color=PALETTE["blue"], linewidth=5, alpha=0.35)
        left.plot(moved, place, "o", color=PALETTE["blue"], label="largest")
        left.plot(mean, place, "|", color=PALETTE["black"], markersize=11, label="mean")
        left.set(yticks=place, yticklabels=names, xlim=(0, None), title="Difference",
                 xlabel="joints moved, % of bounding box")
        right.hlines(place, after, before, color=FAINT, linewidth=2)
        right.plot(before, place, "s", color=PALETTE["vermillion"], label="rods")
        right.plot(after, place, "o", color=PALETTE["blue"], label="rigid")
        right.set(xlabel="full deployment, s", xscale="log", title="Time")
        for axes in (left, right):
            axes.legend(loc="best")
            axes.grid(axis="y", visible=False)
    return figure


def report(rows: list[dict[str, Any]], limit: list[dict[str, float]], name: str) -> Page:
    rods, rigid = ([row for row in rows if row["plates"] == model] for model in PLATE_MODELS)
    saved = [1 - b["unknowns"] / a["unknowns"] for a, b in zip(rods, rigid)]
    faster = [a["seconds"] / b["seconds"] for a, b in zip(rods, rigid)]
    moved, energy = ([row[key] for row in rigid] for key in ("moved max %", "energy %"))
    page = Page("Rigid plates", __doc__.split("\n\n")[2].replace("\n", " "))
    page.section("What comes out", (
        f"Rigid plates leave out {100 * min(saved):.0f} to {100 * max(saved):.0f} % of the unknowns; deployments are "
        f"{median(faster):.2f} times as fast (median). The joint that moves most moves by {min(moved):.3f} to "
        f"{max(moved):.3f} % of the bounding box, and the elastic energy is higher by {min(energy):.1f} to "
        f"{max(energy):.1f} %: what plates of rods give way, the arms have to bend."))
    page.figure(drawing(rows), "Left: distance of the joints between rigid plates from those between plates of rods. "
                "Right: time of a full deployment with either.", alt="joints moved and seconds for every design")
    headings = ["design", "cells", "unknowns", "rigid", "seconds", "rigid", "moved %", "mean %", "energy %"]
    page.table(headings, [[a["design"], a["cells"], a["unknowns"], b["unknowns"], a["seconds"], b["seconds"],
                           b["moved max %"], b["moved mean %"], b["energy %"]] for a, b in zip(rods, rigid)],
               "Plates of rods and, where it says so, rigid ones; how far joints move, most and on average")
    page.section("The limit", f"One design ({name}) with plates of stiffer and stiffer rods: its joints approach those "
                 "between rigid plates.")
    page.table(list(limit[0]), [list(row.values()) for row in limit])
    return page.details("Environment", environment())


if __name__ == "__main__":
    main()
