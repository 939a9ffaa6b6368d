"""The order of the package's folders: each knows only those before it."""

import ast
from collections.abc import Iterator
from pathlib import Path

FOLDERS = (
    "errors",
    "plugins",
    "units",
    "compiled",
    "geometry",
    "sqp",
    "files",
    "drawing",
    "kit",
    "rods",
    "scene",
    "equilibrium",
    "structures",
    "search",
    "analysis",
    "io",
    "fabrication",
    "exchange",
    "report",
    "commands",
    "cli",
)


def imported(file: Path, package: Path) -> Iterator[tuple[str, int]]:
    """What of the package's first level a module imports, anywhere in it, and in which line."""
    own = file.relative_to(package).with_suffix("").parts
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            module = (node.module or "").split(".") if node.module else []
            whole = [*own[: len(own) - node.level], *module] if node.level else module[1:]
            if node.level or node.module and node.module.split(".")[0] == package.name:
                for name in [whole[0]] if whole else [alias.name for alias in node.names]:
                    yield name, node.lineno
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith(f"{package.name}."):
                    yield alias.name.split(".")[1], node.lineno


def test_folders_know_only_those_before_them(repository):
    package = repository / "kop_exudyn"
    files = [
        file
        for file in package.rglob("*.py")
        if file.parent != package or file.stem not in ("__init__", "__main__")
    ]
    seen, wrong = 0, []
    for file in files:
        own = file.relative_to(package).with_suffix("").parts[0]
        for name, line in imported(file, package):
            if name in FOLDERS:
                seen += 1
                if FOLDERS.index(name) > FOLDERS.index(own):
                    wrong.append(f"{file.relative_to(repository)}:{line} imports {name}")
    assert not wrong and seen > 500


def test_every_folder_has_its_place(repository):
    package = repository / "kop_exudyn"
    names = {p.name for p in package.iterdir() if (p / "__init__.py").exists()} | {
        p.stem for p in package.glob("*.py")
    }
    assert names - {"__init__", "__main__"} == set(FOLDERS)


def test_an_import_from_a_later_folder_is_seen(tmp_path):
    package = tmp_path / "kop_exudyn"
    (package / "rods").mkdir(parents=True)
    file = package / "rods" / "section.py"
    file.write_text(
        "from ..kit.parts import Kit\nfrom .. import io\n"
        "def f():\n    import kop_exudyn.report.study\n    from kop_exudyn.analysis import reuse\n"
        "from .element import x\nimport numpy.kit\nfrom kit import y\n"
    )
    assert sorted(imported(file, package)) == [
        ("analysis", 5),
        ("io", 2),
        ("kit", 1),
        ("report", 4),
        ("rods", 6),
    ]
