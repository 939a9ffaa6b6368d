"""Makes all reports anew, one study after the other, and the page that leads to them.

    python studies/make_all.py [--quick] [--only benchmark,robustness] [--jobs 2] [--resume]

Every study is a program of its own; one that fails is said and doesn't stop the others. With
--resume those whose report was made by the present code are left out, and an interrupted one goes
on where it was.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

from kop_exudyn.files.json_files import read_json
from kop_exudyn.provenance import code_digest, usable_cores

ROOT = Path(__file__).resolve().parents[1]
# Studies that others start from come first; the page that leads to all comes last.
FIRST, LAST = ("two_stage", "direct_vs_relaxed", "kit_size_tradeoff"), ("index",)


def studies() -> list[str]:
    """Names of all studies, in the order in which they are made."""
    names = {file.stem for file in (ROOT / "studies").glob("*.py")} - {Path(__file__).stem}
    first = [name for name in FIRST if name in names]
    last = [name for name in LAST if name in names]
    return [*first, *sorted(names - {*first, *last}), *last]


def is_present(name: str, reports: Path) -> bool:
    """Whether a report is there that the present code made."""
    for file in ("data.json", "result.json"):
        path = reports / name / file
        if path.exists() and (reports / name / "index.html").exists():
            found = read_json(path).get("environment") or {}
            return found.get("code") == code_digest()
    return False


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="smallest settings, to out/quick")
    parser.add_argument("--only", metavar="NAMES", help="names of studies, separated by commas")
    parser.add_argument("--jobs", type=int, default=usable_cores())
    parser.add_argument("--resume", action="store_true", help="leave out what is up to date")
    arguments = parser.parse_args()
    wanted = arguments.only.split(",") if arguments.only else studies()
    if unknown := sorted(set(wanted) - set(studies())):
        parser.error(f"no such study: {', '.join(unknown)} (there are {', '.join(studies())})")
    reports = ROOT / "out" / "quick" if arguments.quick else ROOT / "reports"
    failed = []
    for name in wanted:
        if arguments.resume and name not in LAST and is_present(name, reports):
            print(f"{name}: up to date", flush=True)
            continue
        begin = time.perf_counter()
        done = subprocess.run(command(name, arguments, reports), cwd=ROOT)
        word = "made" if done.returncode == 0 else f"FAILED (exit status {done.returncode})"
        print(f"{name}: {word} in {time.perf_counter() - begin:.0f} s", flush=True)
        failed += [name] if done.returncode else []
    if failed:
        print(f"not made: {', '.join(failed)}; run again with --only {','.join(failed)}")
    return 1 if failed else 0


def command(name: str, arguments: argparse.Namespace, reports: Path) -> list[str]:
    """The program of a study with its options; the page that leads to all has none of them."""
    script = [sys.executable, str(ROOT / "studies" / f"{name}.py")]
    if name in LAST:
        return script
    script += ["--out", str(reports / name), "--jobs", str(arguments.jobs)]
    script += ["--quick"] if arguments.quick else []
    return script + (["--resume"] if arguments.resume else [])


if __name__ == "__main__":
    sys.exit(main())
