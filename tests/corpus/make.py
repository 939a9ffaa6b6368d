"""Writes the files of the corpus: python tests/corpus/make.py

Each file is what a CAD program might write; what must come out of it stands beside the function
that makes it, in the modules beside this one.
"""

from __future__ import annotations

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER))

import kinds as drawings  # noqa: E402
import meshes  # noqa: E402


def write(folder: Path) -> list[Path]:
    """Write all files; returns their paths. Needs rhino3dm."""
    folder.mkdir(exist_ok=True)
    done = []
    for cases in (drawings.CASES, meshes.CASES):
        for name, (make, _) in cases.items():
            path = folder / name
            path.write_bytes(make())
            done.append(path)
    return done


if __name__ == "__main__":
    print(f"{len(write(FOLDER / 'files'))} files")
