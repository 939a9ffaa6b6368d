"""The stress study in its quick mode, in a process of its own: it runs the classical cases' tests
itself, in this mode those of planar rods; all are in tests/stress."""

import json
import subprocess
import sys
from pathlib import Path

STUDY = Path(__file__).resolve().parents[2] / "studies" / "stress.py"


def test_the_quick_mode_finds_nothing_wrong(tmp_path):
    done = subprocess.run(
        [sys.executable, STUDY, "--quick", "--out", tmp_path], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "data.json").read_text(encoding="utf-8"))
    assert (
        len(data["classical"]) >= 10 and max(abs(row["error %"]) for row in data["classical"]) < 0.5
    )
    assert set(data["random"]) | set(data["symmetric"]) <= {"stable", "failed"}
    assert data["fuzzing"]["files"] == 200 and data["fuzzing"]["findings"] == []
    assert set(data["interruptions"]) == {"same result"}
    assert data["kills"]["runs with the same result"] == data["kills"]["runs"] >= 1
