"""The package's public names: all there, and none of them loaded before it is used."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import kop_exudyn


def test_every_public_name_is_found():
    for name in kop_exudyn.__all__:
        assert getattr(kop_exudyn, name) is not None
    assert set(kop_exudyn.__all__) <= set(dir(kop_exudyn))


def test_import_loads_no_library():
    libraries = ("numpy", "exudyn", "matplotlib")
    code = f"import sys, kop_exudyn; print(*(m for m in {libraries} if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_unknown_names():
    assert not hasattr(kop_exudyn, "optimise_everything")


def test_type_checkers_see_the_same_names():
    """The block under TYPE_CHECKING in __init__ lists what is loaded at first use."""
    tree = ast.parse(Path(kop_exudyn.__file__).read_text(encoding="utf-8"))
    blocks = [node for node in tree.body if isinstance(node, ast.If)]
    seen: dict[str, set[str]] = {}
    for node in blocks[0].body:
        assert isinstance(node, ast.ImportFrom) and node.module
        seen.setdefault(node.module, set()).update(alias.name for alias in node.names)
    assert seen == {module: set(names) for module, names in kop_exudyn._PUBLIC.items()}


def test_misuses_in_a_users_script_are_found(tmp_path):
    """mypy --strict passes over a right script, and finds every line of a wrong one."""
    right = """
import kop_exudyn as kop

design: kop.Design = kop.load_design("a.json")
result = kop.simulate(design)
print(result.fit.max_percent + 1.0, result.deployed.elastic_energy)
settings = kop.JobSettings(stages=kop.StageSettings(seed=1), jobs=1)
found = kop.optimize_kit([design], {"linear": 3, "angular": 2}, settings=settings)
kop.save_kit("kit.json", found.kit)
kop.write_kit_report(found, "out")
"""
    wrong = [
        "kop.load_design(3)",
        "kop.simulate('a.json')",
        "kop.optimize_kit([design], ['linear'])",
        "kop.optimize_kit(design, {'linear': 3})",
        "kop.StageSettings(sed=1)",
        "kop.JobSettings(jobs='two')",
        "found.kit + 1",
        "result.fit.max_percent.upper()",
        "kop.save_kit(found.kit, 'kit.json')",
        "kop.optimise_everything()",
    ]
    script = tmp_path / "script.py"
    script.write_text(right)
    assert _mypy(script) == set()
    script.write_text(right + "\n".join(wrong) + "\n")
    first = right.count("\n") + 1
    assert _mypy(script) == set(range(first, first + len(wrong)))


def _mypy(script: Path) -> set[int]:
    """The lines that mypy --strict complains of."""
    options = [
        "--strict",
        "--ignore-missing-imports",
        "--follow-imports",
        "silent",
        "--cache-dir",
        "cache",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, script.name],
        capture_output=True,
        text=True,
        cwd=script.parent,
        env=os.environ | {"MYPYPATH": str(Path(kop_exudyn.__file__).parents[1])},
    )
    assert done.returncode in (0, 1), done.stdout + done.stderr
    lines = (line.split(":") for line in done.stdout.splitlines() if ": error:" in line)
    return {int(parts[1]) for parts in lines if parts[0] == script.name}
