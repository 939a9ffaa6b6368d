"""Stress: conditions worse than any user's

    python studies/stress.py [--quick] [--out reports/stress]

The classical cases of geometrically exact rods against their references; a thousand random
structures, twice, to see how often a stable equilibrium is found and confirmed by Exudyn, how often
the solver says honestly that it failed, and whether anything wrong ever passes as good; the same
structures in other units and places; a hundred thousand damaged files; runs that are interrupted or
killed at random moments, and resumed.

The classical cases, and the first seeds of everything else, are in tests/stress. A line of the
tables is reproduced by its seed: run_case(random_case(238)), from lib.stress.trial and
random_scenes.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from tqdm import tqdm

from kop_exudyn.compiled.library import library
from kop_exudyn.drawing.style import PALETTE, style
from kop_exudyn.equilibrium.equilibria import Start
from kop_exudyn.report.environment import peak_memory_mb
from kop_exudyn.rods.rotations import exp_so3
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from lib.stress import kills
from lib.stress.arch import arches
from lib.stress.fuzz import FuzzResult, fuzz
from lib.stress.interruption import MemoryStore, fingerprint, resumed_at
from lib.stress.random_scenes import FAMILIES, StressCase, random_case
from lib.stress.trial import FAILED, FORBIDDEN, STABLE, Outcome, run_case
from lib.study import Study, StudyReport

ROOT = Path(__file__).resolve().parents[1]
CLASSICAL = ("planar_rods", "spatial_rods", "buckling", "snap_through")  # in tests/stress
SYMMETRIC = {"rotation": (0.0, 0.0, 0.0), "shift": (0.0, 0.0, 0.0), "disorder": 0.0}
ONE = {"unit": 1.0, "young": 1.0}
HERE = ONE | {"rotation": (0.0, 0.0, 0.0), "shift": (0.0, 0.0, 0.0)}
THERE = ONE | {"rotation": (0.3, 2.0, -1.5), "shift": (1.0, 2.0, -3.0)}
DISPLACED = 1e-6  # of the size: less is the same state
COMPARISONS = (
    "powers of two, bit for bit",
    "micrometres and 1e12 units of force",
    "found elsewhere from its start",
    "an equilibrium elsewhere",
)

Tried = list[tuple[StressCase, Outcome]]


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    share, effort = (500, "quick") if study.quick else (1, "normal")
    library()  # compiled now, where it has to be
    classical = classical_cases(CLASSICAL[:1] if study.quick else CLASSICAL)
    random = [tried(seed) for seed in tqdm(range(1000 // share), "random structures", disable=None)]
    symmetric = [
        tried(seed, **SYMMETRIC)
        for seed in tqdm(range(1000 // share), "symmetric starts", disable=None)
    ]
    invariance = invariances(range(300 // share))
    with tempfile.TemporaryDirectory() as folder:
        fuzzed = fuzz(tqdm(range(100_000 // share), "damaged files", disable=None), Path(folder))
        memory = peak_memory_mb()
        interrupted = interruptions(12 if study.quick else 1, effort)
        killed = kill_processes(Path(folder), max(1, 50 // share), effort)

    both = random + symmetric
    stable, forbidden = sum(o.verdict == STABLE for _, o in both), sum(o.forbidden for _, o in both)
    worst = max(abs(row["error %"]) for row in classical)
    failed = len(both) - stable - forbidden
    finding = (
        f"Of {len(both):,} random structures {100 * stable / len(both):.1f} % end in a stable "
        f"equilibrium that Exudyn confirms, {failed} in an honest failure, {forbidden} wrong, and "
        f"classical cases are within {worst:.2f} % of their references. Of "
        f"{fuzzed.count:,} damaged files {len(fuzzed.findings)} upset a reader. {killed['kills']} "
        f"kills in "
        f"{killed['runs']} runs: {killed['runs with the same result']} ended as undisturbed ones."
    )
    report = study.report(finding)
    report_classical(report, classical)
    report_structures(report, random, symmetric)
    report_placement(report, invariance)
    report_files(report, fuzzed, memory)
    report.section(
        "Interruptions",
        "A job stopped at each of its checkpoints, and the command line killed at random "
        "moments; resumed, each must give every number of the undisturbed run, bit for bit.",
    )
    report.table(
        "interruptions",
        [{"what": what, "count": count} for what, count in {**interrupted, **killed}.items()],
    )
    report.save(
        {
            "finding": finding,
            "classical": classical,
            "random": counts(random),
            "symmetric": counts(symmetric),
            "invariance": {
                name: {k: len(v) for k, v in found.items()} for name, found in invariance.items()
            },
            "fuzzing": {
                "files": fuzzed.count,
                "accepted": sum(fuzzed.accepted.values()),
                "refused": sum(fuzzed.refused.values()),
                "findings": [vars(f) for f in fuzzed.findings],
                "slowest_s": fuzzed.slowest[0],
                "peak_memory_mb": memory,
            },
            "interruptions": interrupted,
            "kills": killed,
        },
        {"share": f"1/{share}", "forbidden verdicts": list(FORBIDDEN)},
    )
    print(study.out / "index.html")


# -- what is tried -----------------------------------------------------------------------------
class Compared:
    """A pytest plugin that keeps what the classical cases in tests/stress compared."""

    def __init__(self) -> None:
        self.rows: list[dict] = []
        self.failed: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.failed.append(report.nodeid)
        if report.when == "call":
            self.rows += [value for name, value in report.user_properties if name == "classical"]


def classical_cases(names: Sequence[str]) -> list[dict]:
    """One row a case, its error in %; the tests hold them to at most 0.5 %.

    names : of the tests' files
    """
    compared = Compared()
    files = [str(ROOT / "tests" / "stress" / f"test_{name}.py") for name in names]
    with contextlib.redirect_stdout(io.StringIO()):
        pytest.main(
            [
                "-q",
                "-p",
                "no:cacheprovider",
                "--rootdir",
                str(ROOT),
                "-c",
                str(ROOT / "setup.cfg"),
                *files,
            ],
            plugins=[compared],
        )
    if compared.failed or not compared.rows:
        raise SystemExit(f"classical cases failed: {', '.join(compared.failed) or 'none ran'}")
    return [row | {"error %": 100 * (row["found"] / row["reference"] - 1)} for row in compared.rows]


def tried(seed: int, **changes) -> tuple[StressCase, Outcome]:
    case = random_case(seed, **changes)
    return case, run_case(case)


def counts(cases: Tried) -> dict[str, int]:
    return dict(Counter(outcome.verdict for _, outcome in cases))


def invariances(seeds: range) -> dict[str, dict[str, list[int]]]:
    """By comparison, the seeds with which the same state is found in other units and elsewhere in
    space, and others."""
    found: dict[str, dict[str, list[int]]] = {
        name: {"same": [], "another": [], "not compared": []} for name in COMPARISONS
    }
    for seed in tqdm(seeds, "units and placement", disable=None):
        here, first = tried(seed, **HERE)
        _, twos = tried(seed, **HERE | {"unit": 2.0**-20, "young": 2.0**38})
        _, micro = tried(seed, **HERE | {"unit": 1e-6, "young": 1e12})
        there, again = tried(seed, **THERE)
        if not first.verdict == twos.verdict == micro.verdict == again.verdict == STABLE:
            for seen in found.values():
                seen["not compared"].append(seed)
            continue
        state = first.equilibrium.state
        turn = exp_so3(np.array([THERE["rotation"]]))[0]
        expected = state.transformed(
            turn, there.scene.initial.positions[0] - turn @ here.scene.initial.positions[0]
        )
        warm = run_case(there, start=Start(expected, first.equilibrium.torque)).equilibrium
        exact = np.array_equal(2.0**-20 * state.positions, twos.equilibrium.state.positions)
        displaced = np.abs(1e6 * micro.equilibrium.state.positions - state.positions).max()
        moved = np.abs(warm.state.positions - expected.positions).max()
        energies = again.equilibrium.elastic_energy / first.equilibrium.elastic_energy
        for seen, same in zip(
            found.values(),
            (
                exact,
                displaced < 10 * DISPLACED * here.scene.size,
                abs(energies - 1) < DISPLACED,
                moved < DISPLACED * here.scene.size,
            ),
        ):
            seen["same" if same else "another"].append(seed)
    return found


def interruptions(every: int, effort: str) -> dict[str, int]:
    """A small job interrupted at every so many of its checkpoints, before and after it is kept, and
    gone on with."""
    settings = JobSettings(jobs=1, stages=StageSettings(schedule=(1e3, 1e5), effort=effort))
    store, events, found = MemoryStore(), [], Counter()
    expected = fingerprint(
        optimize_kit(
            arches(), {"linear": 2}, settings=settings, store=store, observer=events.append
        ),
        events,
    )
    for at in tqdm(range(1, store.saves + 1, every), "interruptions", disable=None):
        for after in (False, True):
            same = (
                fingerprint(*resumed_at(at, arches(), {"linear": 2}, settings, after)) == expected
            )
            found["same result" if same else "another result"] += 1
    return dict(found)


def kill_processes(folder: Path, wanted: int, effort: str) -> dict[str, int]:
    """SIGKILL at random moments, up to three a run, until at least so many have hit."""
    designs = kills.write_designs(folder / "designs")
    kills.finish(kills.start(designs, folder / "good", effort))
    expected, steps = kills.outcome(folder / "good"), kills.steps_kept(folder / "good")
    found, seed = Counter(), 0
    with tqdm(total=wanted, desc="kills", disable=None) as bar:
        while found["kills"] < wanted:
            out = folder / f"killed_{seed}"
            delays = kills.random_delays(seed, 1.5, min(3, wanted))
            hits, kept = kills.killed_and_resumed(designs, out, delays, effort)
            found["kills"] += hits
            found["of them between the first and the last step"] += sum(0 < k < steps for k in kept)
            found["runs"] += 1
            found["runs with the same result"] += kills.outcome(out) == expected
            found["runs that lost a checkpoint"] += kept != sorted(kept)
            bar.update(hits)
            seed += 1
    return dict(found)


# -- the report --------------------------------------------------------------------------------
def report_classical(report: StudyReport, rows: list[dict]) -> None:
    report.section(
        "Classical cases",
        "Values of the literature, or closed forms, and what is found with so many rod "
        "elements. Their tests, with sources and limits, are in tests/stress.",
    )
    report.table("classical", rows)


def report_structures(report: StudyReport, random: Tried, symmetric: Tried) -> None:
    report.section(
        "Random structures",
        (
            "Sheared grids with hinges or rigid crossings, down to nearly closed; spatial frames "
            "with hinges; clamped "
            "trees under dead forces. Sections of slenderness 20 to 10,000 and sides to 1 : 50, "
            "every piece's length "
            "changed by up to 20 %, units from micrometres to kilometres, moduli over twelve "
            "decades, turned by up to 3 rad; "
            "in three quarters of the cases every body's start is turned besides, by up to 0.1, 1 "
            "or 3 rad.\n\n"
            "A state counts as stable when a newly assembled residual, the pivots of the newly "
            "assembled stiffness, and "
            "its lowest eigenvalue say so, and Exudyn's static solver confirms it. The same "
            "structures are tried a second "
            "time along the axes and without disorder, where flat nets are exactly symmetric."
        ),
    )
    both = (("random", random), ("symmetric", symmetric))
    report.table(
        "structures",
        [
            {
                "starts": name,
                "family": family,
                "cases": len(own),
                "stable and confirmed": sum(o.verdict == STABLE for o in own),
                "honest failure": sum(o.verdict == FAILED for o in own),
                "wrong, exception or hang": sum(o.forbidden for o in own),
            }
            for name, cases in both
            for family in FAMILIES
            if (own := [o for case, o in cases if case.family == family])
        ],
    )
    failures = [
        {
            "starts": name,
            "seed": outcome.seed,
            "family": case.family,
            "verdict": outcome.verdict,
            "reason": outcome.reason,
        }
        for name, cases in both
        for case, outcome in cases
        if outcome.verdict != STABLE
    ]
    if failures:
        report.table("failures", failures, "Every case that did not end in a stable equilibrium.")
    report.figure(
        "conditions",
        _scatter(random),
        "Newton iterations from the start to the equilibrium, and the "
        "softest mode's eigenvalue in units of EI / length of a piece, against slenderness.",
        alt="Iterations and eigenvalues",
    )


def report_placement(report: StudyReport, found: dict[str, dict[str, list[int]]]) -> None:
    report.section(
        "Units and placement",
        "The same structure in other units, and turned and shifted in space. Where a "
        "flat net may buckle to either side, round-off chooses; the mirror images have the same "
        "energy.",
    )
    report.table(
        "placement",
        [
            {
                "comparison": name,
                **{what: len(seeds) for what, seeds in seen.items()},
                "seeds of others": ", ".join(map(str, seen["another"])),
            }
            for name, seen in found.items()
        ],
    )


def report_files(report: StudyReport, fuzzed: FuzzResult, memory: float) -> None:
    report.section(
        "Damaged files",
        f"{fuzzed.count:,} files with seeded damage to bytes, numbers, structure and array "
        f"headers. Each was read, or refused with one line; the slowest took "
        f"{fuzzed.slowest[0]:.2f} s, and "
        f"the process never used more than {memory:.0f} MB. No pickle was loaded.",
    )
    report.table(
        "files",
        [
            {"file": name, "read": fuzzed.accepted[name], "refused": fuzzed.refused[name]}
            for name in sorted(fuzzed.refused)
        ],
    )
    if fuzzed.findings:
        report.table(
            "findings",
            [
                {"seed": f.seed, "file": f.file, "kind": f.kind, "what": f.detail}
                for f in fuzzed.findings
            ],
            "What a reader did not take well.",
        )
    else:
        report.text(
            "Nothing else happened: no other exception, no hang, no message of more than a line."
        )


def _scatter(cases: Tried):
    good = [
        (case.conditions.slenderness, outcome)
        for case, outcome in cases
        if outcome.verdict == STABLE
    ]
    slenderness = [s for s, _ in good]
    with style():
        figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
        for ax, name, values in (
            (axes[0], "Newton iterations", [o.iterations for _, o in good]),
            (axes[1], "softest eigenvalue", [o.softest for _, o in good]),
        ):
            ax.loglog(slenderness, values, ".", ms=3, color=PALETTE["blue"])
            ax.set_xlabel("slenderness")
            ax.set_title(name)
    return figure


if __name__ == "__main__":
    main()
