"""Three C-shells, one kit: direct projection, unrelaxed baseline, and both stages.

    python studies/two_stage.py [--quick] [--out reports/two_stage]

Writes the same folder as `kop optimize models/conformals --designs 3 --parts linear=12,angular=5`,
and the picture that the README shows.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from kop_exudyn.io.datasets import load_designs, select_files
from kop_exudyn.provenance import usable_cores
from kop_exudyn.report.kit_run import optimize_and_report
from kop_exudyn.search.settings import JobSettings, StageSettings

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT / "models" / "conformals"

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument(
    "--quick", action="store_true", help="one design and few steps, to see that it works"
)
parser.add_argument("--out", type=Path, default=ROOT / "reports" / "two_stage")
parser.add_argument("--jobs", type=int, default=usable_cores())
parser.add_argument("--resume", action="store_true")
arguments = parser.parse_args()

# 1. The input designs: smooth C-shells, straightened, with one corner between neighbouring joints.
number = 1 if arguments.quick else 3
designs = load_designs(MODELS, number)

# 2. How many parts of each kind, and how long to optimise.
parts = {"linear": 6, "angular": 3} if arguments.quick else {"linear": 12, "angular": 5}
stages = (
    StageSettings(relaxed_steps=2, assigned_steps=2, reassignments=0, path_steps=4)
    if arguments.quick
    else StageSettings()
)

# 3. All stages; results, figures and index.html go to the folder.
result = optimize_and_report(
    designs,
    parts,
    out=arguments.out,
    settings=JobSettings(stages=stages, jobs=arguments.jobs),
    inputs=select_files(MODELS, number),
    resume=arguments.resume,
    overwrite=True,
    progress=True,
)

# 4. What came out: largest deviation of the joints from the target, in % of its bounding box.
for n, design in enumerate(designs):
    figures = {
        stage: result.summary(stage, n) for stage in ("direct", "unrelaxed", "relaxed", "assigned")
    }
    shown = {
        stage: f["failed"] if "failed" in f else f"{f['fit']['max_percent']:.2f} %"
        for stage, f in figures.items()
    }
    print(f"{design.name:12s}", shown)
