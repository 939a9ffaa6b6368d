"""Three pavilions, one of each class, built from the parts of their kits.

    python studies/pavilion.py [--quick] [--out reports/pavilion] [--jobs 2]

The kits of the study of direct and relaxed kits as architecture: one design of each class, enlarged
until a person can stand beneath it; two are lifted on masts, which belong to the picture only.
Every rod is the equilibrium shape that Exudyn confirmed, swept with its true section, and has the
colour of the part that it is cut as. Without weight, a structure that is enlarged together with its
sections keeps its shape; what self-weight adds is not shown. The pictures are rendered by the
package itself, with depth buffers for the eye and for eighty lights of sun and sky.
"""

from __future__ import annotations

from pathlib import Path

from kop_exudyn.drawing.render import Light
from lib.pavilion_scene import framed, pavilion, picture
from lib.study import Study
from lib.study_kits import kits

MODELS = Path(__file__).resolve().parents[1] / "models"
# Design, span in m, and how high above the ground on masts, m.
CHOICE = {
    "C-shells": ("exp", 9.0, 2.4),
    "grids": ("dome", 13.0, 0.0),
    "umbrella meshes": ("oval", 10.0, 2.3),
}


def main() -> None:
    study = Study.from_command_line(__doc__, __file__)
    coarse = {
        "width": 320,
        "height": 180,
        "samples": 1,
        "light": Light(suns=3, skies=6, buffer=300),
    }
    size = coarse if study.quick else {}

    # 1. One design of each kit (quick: of the first kit only), in metres.
    chosen = {}
    for name, result in list(kits(study, MODELS).items())[: 1 if study.quick else None]:
        wanted, span, clearance = CHOICE[name]
        numbers = [n for n, design in enumerate(result.designs) if design.name == wanted]
        chosen[name] = pavilion(result, numbers[0] if numbers else 0, span, clearance)

    # 2. Their pictures.
    rows = [
        {
            "class": name,
            "design": p.name,
            "elements": p.elements,
            "different parts": p.parts,
            "plan, m": f"{p.footprint[0]:.1f} x {p.footprint[1]:.1f}",
            "height, m": p.height,
            "m per model unit": p.scale,
            "max deviation %": p.max_percent,
        }
        for name, p in chosen.items()
    ]
    finding = (
        "; ".join(
            f"{p.name} ({name}): {p.elements} elements of {p.parts} different parts span "
            f"{max(p.footprint):.0f} m within {p.max_percent:.2g} % of the shape"
            for name, p in chosen.items()
        )
        + "."
    )
    report = study.report(finding)
    for name, building in chosen.items():
        report.figure(
            name.replace(" ", "_"),
            framed(picture(building, **size)),
            f"{building.name}, {building.elements} elements of {building.parts} parts; every "
            f"colour is one "
            "part. The person is 1.72 m tall.",
            alt=f"Rendering of {building.name} as a pavilion with a person",
            colours=None,
        )
    report.table(
        "pavilions",
        rows,
        "Deviation: largest distance of a joint from the target surface, in % of its size.",
    )
    report.save({"finding": finding, "pavilions": rows})


if __name__ == "__main__":
    main()
