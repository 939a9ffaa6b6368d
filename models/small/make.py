"""Writes the designs of this folder: the middles of our C-shells, few joints each, for examples and
quick runs.

Run it from anywhere: python models/small/make.py
"""

from __future__ import annotations

import json
from pathlib import Path

MODELS = Path(__file__).resolve().parents[1]
JOINTS = 4  # a side
# So few joints leave the plane only when they are opened further than the whole net, and slender
# strips do so earlier. Here all three rise to about a tenth of their size.
OPENING = 1.0  # rad
SECTION = {"type": "rectangle", "width": 0.02, "height": 0.002, "joint_hole": 0.003}
NAMES = ("01_sinh", "03_exp", "06_moebius")


def middle(content: dict, joints: int) -> dict:
    """The design with so many of its curves each way, those in the middle."""
    side = len(content["curves"]) // 2
    first = (side - joints) // 2
    keep = [start + first + k for start in (0, side) for k in range(joints)]
    return content | {
        "name": f"small {content['name']}",
        "section": SECTION,
        "opening": {**content["opening"], "angle": OPENING},
        "curves": [content["curves"][k] for k in keep],
    }


def write(folder: Path) -> list[Path]:
    """Write all designs; returns their files."""
    files = []
    for name in NAMES:
        content = middle(
            json.loads((MODELS / "conformals" / f"{name}.json").read_text(encoding="utf-8")), JOINTS
        )
        curves = ",\n  ".join(json.dumps(curve) for curve in content.pop("curves"))
        path = folder / f"{name}.json"
        path.write_text(
            f'{json.dumps(content, indent=1)[:-2]},\n "curves": [\n  {curves}\n ]\n}}\n',
            encoding="utf-8",
        )
        files.append(path)
    return files


if __name__ == "__main__":
    write(Path(__file__).resolve().parent)
