"""Reuse of parts: how much five C-shells share.

    python studies/part_reuse.py [--quick] [--out DIR] [--jobs N] [--scheduler ADDRESS] [--resume]

The kits of the study of kit sizes (conformals 1 to 5, 5 angular and 2 to 25 linear parts) are
looked at again: which design uses which part how often, and how much of its pieces any set of
designs shares.

The reuse of a set of designs is the number of pieces that all of them use over the number that any
of them uses; for two designs that is the Jaccard index of their multisets of pieces. The average is
over all sets of two or more designs. Kits that the other study left in the folder of runs are taken
from there.

Then a kit is sought with more and more weight on the pieces that have to be made so that the
designs can be built one after the other (`StageSettings.reuse`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kop_exudyn.analysis.reuse import counts_of, jaccard_matrix, part_users, reuse_figures
from kop_exudyn.io.datasets import select_files
from lib.repeated import repeated_task
from lib.reuse_drawing import draw_front, draw_reuse_over_size, draw_sharing, draw_subsets
from lib.size_kits import kits_by_size, sized_cases
from lib.study import Study
from lib.study_tasks import QUICK, changed
from lib.sweep import Task

MODELS = Path(__file__).resolve().parents[1] / "models"
SHOWN = 12  # linear parts of the kit that is shown in detail
WEIGHTS, QUICK_WEIGHTS = (0.0, 0.5, 1.0, 2.0, 4.0), (0.0, 4.0)
ALLOWED = 1.05  # of the deviation without a weight


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)

    # 1. The kits, from the folder of runs where the study of sizes has left them.
    case = sized_cases(MODELS, study.quick)[0]
    kits = {kit.size: kit for kit in kits_by_size(study, case)}

    # 2. The figures of each, and the details of one.
    found = {size: reuse_figures(kit.pieces()) for size, kit in kits.items()}
    rows = [
        {
            "linear": size,
            "pieces": f["pieces"],
            "kit size %": f["kit_size_percent"],
            "average reuse": f["average_reuse"],
            "linear reuse": f["by_kind"]["linear"],
            "angular reuse": f["by_kind"]["angular"],
            "parts of one design": f["parts_of_one_design"],
            "sets that share nothing": len(f["groups"]),
        }
        for size, f in found.items()
    ]
    size = min(kits, key=lambda s: abs(s - SHOWN))
    kit, detail = kits[size], found[size]
    pieces = kit.pieces()
    names = [design.name for design in kit.result.designs]
    labels = [
        f"{kind[0].upper()}{k + 1}"
        for kind in sorted(pieces[0])
        for k in range(kit.result.kit.sizes[kind])
    ]
    counts = counts_of(pieces)
    pairs = [
        (detail["jaccard"][i][j], names[i], names[j]) for i in range(len(names)) for j in range(i)
    ]
    most, least = max(pairs), min(pairs)
    shared = int(np.count_nonzero(part_users(counts) == len(names)))
    finding = (
        f"Of the {len(labels)} parts of the kit with {size} linear ones, {shared} are used by all "
        f"{len(names)} "
        f"designs; {most[1]} and {most[2]} share most ({most[0]:.0%} of their pieces), {least[1]} "
        f"and "
        f"{least[2]} least ({least[0]:.0%}). From {rows[0]['linear']} to {rows[-1]['linear']} "
        f"linear parts the "
        f"average reuse goes from {rows[0]['average reuse']:.2f} to "
        f"{rows[-1]['average reuse']:.2f}."
    )

    front = weighed(study)
    first = front[0]["max %"]
    near = [row for row in front if first and row["max %"] and row["max %"] <= ALLOWED * first]
    if near:
        fewest = min(near, key=lambda row: row["pieces"])
        saved = 1 - fewest["pieces"] / front[0]["pieces"]
        finding += (
            f" A weight of {fewest['weight']:g} on pieces saves {saved:.0%} of them, at a largest "
            f"deviation of {fewest['max %']:.2f} % instead of {first:.2f} %."
        )

    # 3. The report.
    report = study.report(finding)
    report.figure(
        "sharing",
        draw_sharing(names, counts, labels, jaccard_matrix(counts)),
        f"The kit with {size} linear parts (L) and its angular ones (A). Left: how many pieces of "
        f"each part "
        "a design is built of. Right: share of the pieces that two designs have in common.",
        alt="Pieces of each part by design, and the Jaccard index of each pair",
    )
    report.figure(
        "subsets",
        draw_subsets(detail["subsets"], names),
        "Every set of two or more designs.",
        alt="Reuse of all sets of designs, by their size",
    )
    groups = "; ".join(", ".join(names[k] for k in group) for group in detail["groups"])
    report.text(
        f"Sets of designs that share no part: {groups}."
        if len(detail["groups"]) > 1
        else "All designs are connected by common parts: no set of them has a kit of its own."
    )
    report.section(
        "Against the size of the kit", "The same figures for every number of linear parts."
    )
    report.figure(
        "sizes",
        draw_reuse_over_size(rows, "linear"),
        "Every kit of the study of sizes.",
        alt="Average reuse and kit size over linear parts",
    )
    report.table(
        "kits",
        rows,
        "Pieces: as many of each part as the design that needs most; parts of one design: that "
        "no other one uses; sets that share nothing: 1 means that all designs are connected.",
    )
    report.section(
        "Fewer pieces as an aim",
        "A kit of as many parts, searched with a weight on the pieces that have to be made.",
    )
    report.figure(
        "front",
        draw_front(front),
        "A point a weight, which stands beside it.",
        alt="Largest deviation and objective against pieces to make, for several weights",
    )
    report.table(
        "weights",
        front,
        "Weight: by how many % the objective may rise for 1 % less pieces. Max: the larger of the "
        "deviations as kept and as opened, % of the bounding box.",
    )
    report.save(
        {
            "finding": finding,
            "weights": front,
            "kits": rows,
            "details": {str(s): f for s, f in found.items()},
            "designs": names,
        }
    )


def weighed(study: Study) -> list[dict[str, Any]]:
    """Figures of one search a weight, the smallest weight first."""
    if study.quick:
        files, parts = select_files(MODELS / "small", 2), {"linear": 5, "angular": 2}
    else:
        files, parts = select_files(MODELS / "conformals", 5), {"linear": SHOWN, "angular": 5}
    jobs = 1 if study.scheduler else study.jobs  # workers of a cluster start no processes
    stages = changed(QUICK) if study.quick else {}
    tasks = {
        weight: Task(
            f"reuse weight {weight:g}",
            repeated_task,
            {"files": files, "parts": parts, "stages": {**stages, "reuse": weight}, "seed": 0},
            {"jobs": jobs},
        )
        for weight in (QUICK_WEIGHTS if study.quick else WEIGHTS)
    }
    values = study.sweep(list(tasks.values()), jobs=1)
    return [{"weight": weight, **values[task.name]} for weight, task in tasks.items()]


if __name__ == "__main__":
    main()
