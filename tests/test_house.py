"""The house: each folder knows only those before it, no modules import each other in a circle, and
no module is without a caller."""

import ast
from collections.abc import Iterator
from pathlib import Path

FOLDERS = (
    "arrays",
    "errors",
    "checks",
    "equality",
    "plugins",
    "provenance",
    "units",
    "wording",
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
            seen += 1
            # what the package's own face hands on is another module's
            if name not in FOLDERS or FOLDERS.index(name) > FOLDERS.index(own):
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


def modules_of(package: Path) -> dict[str, Path]:
    """Modules by dotted name within the package; a folder stands for its __init__. The package's
    own face only hands names on, and is left out."""
    found = {}
    for file in package.rglob("*.py"):
        parts = file.relative_to(package).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    del found[""]
    return found


def arrows(package: Path) -> dict[str, set[str]]:
    """What each module imports of the package, anywhere in it."""
    modules = modules_of(package)
    found: dict[str, set[str]] = {name: set() for name in modules}
    for name, file in modules.items():
        own = name.split(".") if file.stem == "__init__" else name.split(".")[:-1]
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom):
                continue
            start = own[: len(own) - node.level + 1] if node.level else []
            path = (node.module or "").split(".") if node.module else []
            if not node.level:
                if path[:1] != [package.name]:
                    continue
                path = path[1:]
            target = ".".join([*start, *path]).strip(".")
            for alias in node.names:
                inner = f"{target}.{alias.name}".strip(".")
                found[name].add(inner if inner in modules else target)
        found[name] &= modules.keys()
    return found


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that reach each other."""
    reach = {name: set(targets) for name, targets in graph.items()}
    changed = True
    while changed:
        changed = False
        for own in reach.values():
            more = set().union(own, *(reach[target] for target in own))
            changed |= len(more) > len(own)
            own |= more
    looping = {name for name in graph if name in reach[name]}
    groups = {
        tuple(sorted(other for other in looping if other in reach[name] and name in reach[other]))
        for name in looping
    }
    return sorted(list(group) for group in groups)


def test_no_modules_import_each_other_in_a_circle(repository):
    assert circles(arrows(repository / "kop_exudyn")) == []


def test_a_circle_is_seen(tmp_path):
    package = tmp_path / "toy"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "a.py").write_text("from .b import x\n")
    (package / "b.py").write_text("def f():\n    from toy.c import y\n")
    (package / "c.py").write_text("from . import a\n")
    (package / "d.py").write_text("from .a import x\n")
    assert circles(arrows(package)) == [["a", "b", "c"]]


def test_no_module_is_without_a_caller(repository):
    """Reached from the commands, the public names, or what a registry loads by its folder."""
    import kop_exudyn

    package = repository / "kop_exudyn"
    graph = arrows(package)
    registries = ("structures", "kit", "search.terms", "commands")
    start = {"cli", "__main__", *kop_exudyn._PUBLIC}
    start |= {name for name in graph if name.rpartition(".")[0] in registries}
    seen: set[str] = set()
    while start:
        name = start.pop()
        seen.add(name)
        folders = {name.rsplit(".", k)[0] for k in range(1, name.count(".") + 1)}
        start |= (graph[name] | folders) - seen
    assert sorted(graph.keys() - seen) == []
