"""What a kit optimisation leaves in its folder: results for programs, figures, and a page that
shows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from ..analysis.verdict import Buildable
from ..checks import check_kind
from ..drawing.style import figure_bytes
from ..fabrication.pieces import parts_list_of
from ..files.files import make_folder, write_bytes
from ..io.kits import save_kit
from ..io.results import save_result, save_states
from ..kit.kinds import part_kind
from ..search.result import KitResult
from ..units import unit_of
from ..wording import counted, counted_parts
from .designs import draw_designs
from .environment import environment
from .history import draw_history
from .kit_cards import (
    design_cards,
    deviation_line,
    deviation_rows,
    deviation_words,
    percent_explained,
)
from .kit_drawings import (
    displaced_rows,
    drawn_designs,
    final_states,
    histories,
    part_spaces,
    remarks,
    stage_rows,
    summary_rows,
)
from .kit_picture import joined, kit_pictures
from .page import Drawing, Page
from .parameters import draw_parameters
from .part_drawings import PartDrawing, part_drawings, part_rows
from .verdicts import stopped, verdict_lines, verdict_rows
from .viewer import save_viewer
from .viewer_scenes import kit_scene

_FRAMES = 6  # states on the way to the opening in the viewer
_LEGEND = (
    "Opens within: how far from the state shown the design ends that its assembly opens into, % of "
    "the target's size. Utilisation: the largest equivalent stress over the elastic limit in all "
    "states without loads; stress under a load: under the load times its factor. Softest mode: its "
    "eigenvalue in the deployed state over the input design's. Spread: root mean square "
    "displacement of the joint that moves most under the workshop's errors. Snapped: of "
    "sets of such errors. A dash: not known."
)


def write_kit_report(
    result: KitResult,
    folder: str | Path,
    verdicts: Sequence[Buildable] = (),
    extend: Callable[[Page], object] = lambda page: None,
) -> Path:
    """Write result.json, kit.json, states.npz, picture.png, figures, viewer.html and index.html;
    files of those names are replaced.

    result : of a search
    folder : made where it isn't there yet
    verdicts : on its designs, which the page then begins with
    extend : adds sections of its own to the page, after those about the kit

    Returns the page's path. Raises InputError when a file can't be written.
    """
    check_kind("result", result, KitResult, "see optimize_kit and load_run")
    folder = make_folder(folder)
    content = result.to_dict() | {"environment": environment()}
    save_result(folder / "result.json", content, overwrite=True)
    save_kit(folder / "kit.json", result.kit, overwrite=True)
    save_states(folder / "states.npz", final_states(result), overwrite=True)
    # drawn once, for the page and for their own files: at print quality that takes a second each
    figures = {
        name: figure_bytes(figure, "svg")
        for name, figure in {
            "designs": draw_designs(drawn_designs(result)),
            "history": draw_history(histories(result)),
            "parameters": draw_parameters(part_spaces(result)),
        }.items()
    }
    for name, drawn in figures.items():
        write_bytes(folder / f"{name}.svg", drawn, overwrite=True)
    save_viewer(folder / "viewer.html", kit_scene(result, frames=_FRAMES), overwrite=True)
    pictures = kit_pictures(result)
    names = [design.name for design in result.designs]
    write_bytes(folder / "picture.png", joined(pictures, names), overwrite=True)
    page = _page(result, figures, pictures, verdicts, extend)
    return page.save(folder / "index.html", overwrite=True)


def _page(
    result: KitResult,
    figures: Mapping[str, bytes],
    pictures: Sequence[Image.Image | None],
    verdicts: Sequence[Buildable],
    extend: Callable[[Page], object],
) -> Page:
    elements = sum(design.n_elements for design in result.designs)
    designs = "a design" if len(result.designs) == 1 else f"{len(result.designs)} designs"
    title = (
        f"{'A stock' if 'stock' in result.settings else 'An existing kit'} for {designs}"
        if "kit" in result.settings
        else f"One kit of parts for {designs}"
    )
    verb = "realises" if sum(result.kit.sizes.values()) == 1 else "realise"
    about = (
        f"{counted_parts(result.kit.sizes)} {verb} the {counted(elements, 'element')} of "
        f"{', '.join(d.name for d in result.designs)}."
    )
    if verdicts:
        first, second = verdict_lines(verdicts, result.units)
        possible = _all_possible(verdicts)
        page = Page(title, f"{first.removesuffix('.')}: {_outcome(result)}" if possible else first)
        stops = [*_stops(verdicts), deviation_line(result)]
        page.text("\n\n".join([second] if possible else stops))
    else:
        page = Page(title, about)
    if result.warnings:
        page.text("\n\n".join(result.warnings))
    page.cards(design_cards(result, verdicts, pictures))
    page.text(
        f"{about if verdicts else ''}\n\nShown as they open, with their true sections; a colour is "
        f"a part, the same in all designs. {percent_explained(result)}"
    )
    page.links({"Turn the designs around in 3D": "viewer.html"})
    _parts(page, result)
    page.section("Deviations").table(
        *deviation_rows(result),
        "Joints: where rods cross or cells sit. Between joints: all points of the rods, corners "
        "too; where rods lie beside the target by design, the joints alone.",
    )
    if verdicts:
        page.section("Can they be built?").table(*verdict_rows(verdicts, result.units), _LEGEND)
    page.section("Energy and stress").table(
        *summary_rows(result),
        "Energy ratio: elastic energy over the input design's. Stress: the largest equivalent one "
        "(von Mises) in the rods, in all states; utilisation: the largest share of the material's "
        "elastic limit. A dash: no equilibrium found, or no section or limit known.",
    )
    page.section("How it was found").table(
        *stage_rows(result),
        _about_stages(result),
    )
    page.table(
        *displaced_rows(result),
        "Largest distance of the joints from their own places on the target, %, which the search "
        "looks at as well: joints that slide along the surface keep to it, but change the outline.",
    )
    page.text("\n\n".join(remarks(result, verdicts=bool(verdicts))))
    page.figure(
        figures["designs"],
        "Rods and joints at the best placement on the target, stage by stage; grey: the input "
        "design.",
        alt="Every design in 3D after the direct projection, the relaxed and the assigned stage",
    )
    page.figure(
        figures["history"],
        "The objective and its terms after every accepted step. At a dashed line the weight of the "
        "projection energy changes, and the objective with it.",
        alt="Objective against steps for both stages",
    )
    page.figure(
        figures["parameters"],
        "Elements before and after the relaxed stage, and the final parts.",
        alt="Elements and parts in the space of their parameters",
    )
    if "stock" in result.settings:
        page.section("The stock", _how_used(result)).table(*_stock_rows(result))
    for kind, parts in result.kit.to_dict().items():
        several = isinstance(parts[0], list)
        unit = unit_of("angle" if part_kind(kind).angular else "length", result.units)
        page.details(
            f"The {counted_parts({kind: len(parts)})}, {unit}",
            {str(k): part if several else [part] for k, part in enumerate(parts, 1)},
        )
    extend(page)
    page.section(
        "How it was made",
        f"{counted(result.equilibria, 'equilibrium', 'equilibria')} and "
        f"{counted(result.newton_iterations, 'Newton iteration')} in {result.wall_s:.0f} s.",
    )
    return page.details("Settings", result.settings).details("Versions and machine", environment())


def _parts(page: Page, result: KitResult) -> None:
    """Every part as a drawing, with its measures and how many pieces each design needs."""
    drawings, as_cut = part_drawings(result)
    names = [design.name for design in result.designs]
    rows = part_rows(drawings, parts_list_of(result))
    headings = ["part", "drawing", "mm" if as_cut else "measures", *names, "to make"]
    page.section("The parts").drawings(
        headings,
        [_part_row(one, len(names)) for one in rows],
        ("As they are cut, in mm. " if as_cut else "Axes only: no board is known. ")
        + "All at one scale but for the thinnest, which are enlarged. To make: enough for any one "
        "of the designs.",
    )
    if len(rows) < len(drawings):
        page.drawings(
            headings,
            [_part_row(one, len(names)) for one in drawings],
            folded="Every piece that is cut for them",
        )


def _part_row(one: PartDrawing, designs: int) -> list[Any]:
    return [
        one.label,
        Drawing(one.svg, one.width, f"{one.label}: {one.about}"),
        one.about,
        *(one.counts or [None] * designs),
        one.total,
    ]


def _all_possible(verdicts: Sequence[Buildable]) -> bool:
    return all(verdict.possible for verdict in verdicts)


def _outcome(result: KitResult) -> str:
    """Of how many parts, and how far off the worst design is at most."""
    one = sum(result.kit.sizes.values()) == 1
    keep = "keeps" if one else "keep"
    return f"{counted_parts(result.kit.sizes)} {keep} {deviation_words(result)}."


_STAGES = {
    "direct": "Direct: every input element replaced by its part.",
    "unrelaxed": "Unrelaxed: parts then tuned.",
    "published": "Published: by the published method, led and opened.",
    "relaxed": "Relaxed: elements still free.",
    "assigned": "Assigned: built from the kit.",
}


def _about_stages(result: KitResult) -> str:
    """What the columns are, of the stages that there are."""
    found = (about for name, about in _STAGES.items() if name in result.stages)
    return f"Largest deviation of the joints, %. Input: the designs as given. {' '.join(found)}"


def _stops(verdicts: Sequence[Buildable]) -> list[str]:
    """A sentence for each design that can't be built."""
    return [stopped(verdict) for verdict in verdicts if not verdict.possible]


def _how_used(result: KitResult) -> str:
    if result.settings["together"]:
        return "All designs stand at the same time; pieces are left when all of them are built."
    return "The designs are built one after the other, each from the whole stock."


def _stock_rows(result: KitResult) -> tuple[list[str], list[list[Any]]]:
    """Header and rows: every part of the stock, how many pieces there are, how many each design
    uses, and what is left."""
    used = result.pieces()
    rows: list[list[Any]] = []
    for kind, parts in result.kit.parts.items():
        there = result.settings["stock"][kind]
        for k, values in enumerate(parts):
            own = [int(counts[kind][k]) for counts in used]
            taken = sum(own) if result.settings["together"] else max(own)
            size = ", ".join(f"{value:.6g}" for value in values)
            rows.append([kind, k + 1, size, there[k], *own, there[k] - taken])
    names = [design.name for design in result.designs]
    return ["kind", "part", "parameters", "there", *names, "left"], rows
