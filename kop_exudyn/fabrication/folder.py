"""The folder for the workshop: lists, plans, sheets, and the book to print."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from ..checks import check_kind, choices
from ..errors import InputError
from ..files.files import file_stems, make_folder, write_text
from ..files.tables import write_csv
from ..io.stocks import stock_rows
from ..units import Units
from .assembly import joint_places, joint_table, write_assembly_plan
from .assembly_layout import assembly_drawing
from .assembly_order import assembly_steps, fasteners
from .assembly_pages import save_assembly_drawing
from .blanks import Blanks
from .book import workshop_book
from .cutlist import material, write_bill, write_cut_list
from .cutsheets import Sheet, cut_sheets, template_sheets
from .dxf import write_dxf
from .options import UNFIT, CutOptions, Tolerances
from .pieces import PartsList
from .read_me import read_me
from .stock import StockPlan, stock_plan
from .svg import write_svg

SHEET_FORMATS: dict[str, Callable[..., Path]] = {"svg": write_svg, "dxf": write_dxf}


def export_workshop(
    parts: PartsList,
    folder: str | Path,
    unit: str,
    *,
    options: CutOptions = CutOptions(),
    tolerances: Tolerances = Tolerances(),
    formats: Iterable[str] = tuple(SHEET_FORMATS),
    paper: str = "a3",
    title: str = "Kit of parts",
    warnings: Sequence[str] = (),
    force: bool = False,
    overwrite: bool = False,
) -> list[Path]:
    """Write all that a workshop needs; returns the files' paths.

    Tables (CSV): cut_list, material, fasteners, bars, stock; of every design its bill, assembly
    plan, steps and joints. Drawings: workshop.pdf to print, the assembly of every design (SVG), cut
    sheets and templates at true scale. READ_ME.txt says what each of these files is, and what the
    tables' columns mean.

    Parameters
    ----------
    parts : the kit and its pieces, see `parts_list_of`
    folder : made where it isn't there
    unit : the designs' unit of length
    options, tolerances : sizes of sheets, bars, holes and gaps; how exactly to cut
    formats : of the sheets, "svg" and "dxf"
    paper : of the book, "a4" or "a3"
    title : what the book is called
    warnings : what stops the kit from being built, in sentences: on every page, sheet and in
        READ_ME.txt, as whoever builds it sees nothing else
    force : write the files also where parts can't be cut as they are, with that as a warning

    Raises InputError when a file exists already and `overwrite` is false, for what can't be cut
    (see `Blanks.problems`), and for unknown formats or paper.
    """
    check_kind("parts", parts, PartsList, "see parts_list_of")
    check_kind("options", options, CutOptions)
    check_kind("tolerances", tolerances, Tolerances)
    writers = {name: SHEET_FORMATS[name] for name in choices("formats", formats, SHEET_FORMATS)}
    blanks = Blanks(parts, unit, options)
    if not force:
        blanks.check()
    warnings = list(dict.fromkeys([*warnings, *blanks.problems]))
    warning = f"{UNFIT}, see READ_ME.txt" if warnings else ""
    sheets = cut_sheets(blanks, force=force, warning=warning)
    bars = _bars(blanks, force)
    drawings = [assembly_drawing(parts, pieces.design.name, unit) for pieces in parts.designs]
    book = workshop_book(
        blanks,
        sheets,
        bars,
        drawings,
        paper=paper,
        title=title,
        tolerances=tolerances,
        warnings=warnings,
    )
    folder = make_folder(folder)
    done = [write_cut_list(folder / "cut_list.csv", blanks, tolerances, overwrite=overwrite)]
    units = parts.designs[0].design.units or Units(unit)
    tables = {
        "stock": stock_rows(parts.kit, parts.needed(), units),
        "material": material(blanks, sheets, bars),
        "fasteners": fasteners(blanks),
        "bars": bar_rows(bars),
    }
    stems = file_stems([pieces.design.name for pieces in parts.designs])
    for pieces in parts.designs:
        name, stem = pieces.design.name, stems[pieces.design.name]
        done.append(write_bill(folder / f"bill_{stem}.csv", parts, [name], overwrite=overwrite))
        path = folder / f"assembly_{stem}.csv"
        done.append(write_assembly_plan(path, parts, name, unit, overwrite=overwrite))
        tables[f"steps_{stem}"] = assembly_steps(blanks, name)
        tables[f"joints_{stem}"] = joint_table(parts, name, unit, joint_places(parts, name))
    done += [
        write_csv(folder / f"{name}.csv", rows, overwrite=overwrite)
        for name, rows in tables.items()
        if rows
    ]
    done.append(book.save(folder / "workshop.pdf", overwrite=overwrite))
    for drawing in drawings:
        done += save_assembly_drawing(drawing, folder, stems[drawing.name], overwrite=overwrite)
    for stem, found in {
        "cut_sheet": sheets,
        "templates": template_sheets(blanks, force=force, warning=warning),
    }.items():
        done += _write_sheets(found, folder / stem, writers, overwrite)
    text = read_me(title, blanks, [drawing.placed for drawing in drawings], done, warnings)
    return [*done, write_text(folder / "READ_ME.txt", text, overwrite=overwrite)]


def _bars(blanks: Blanks, force: bool) -> StockPlan | None:
    """The plan for bars; none where the files are wanted although a strip is too long for them."""
    try:
        return stock_plan(blanks)
    except InputError:
        if not force:
            raise
        return None


def bar_rows(plan: StockPlan | None) -> list[dict[str, object]]:
    """One row a piece that is sawn from a bar, in order: the bar, its length, the cut's place."""
    rows = []
    for number, bar in enumerate(plan.bars if plan is not None else (), 1):
        kerf = 0.0
        if len(bar.pieces) > 1:
            used = sum(length for _, length in bar.pieces)
            kerf = (bar.length - bar.left - used) / (len(bar.pieces) - 1)
        at = 0.0
        for label, length in bar.pieces:
            row = {"bar": number, "bar_mm": bar.length, "part": label, "from_mm": round(at, 3)}
            rows.append(row | {"to_mm": round(at + length, 3), "left_mm": round(bar.left, 1)})
            at += length + kerf
    return rows


def _write_sheets(
    sheets: list[Sheet], stem: Path, writers: dict[str, Callable[..., Path]], overwrite: bool
) -> list[Path]:
    return [
        write(stem.with_name(f"{stem.name}_{number}.{suffix}"), sheet, overwrite=overwrite)
        for number, sheet in enumerate(sheets, 1)
        for suffix, write in writers.items()
    ]
