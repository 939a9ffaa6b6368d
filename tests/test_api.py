"""The package's public names: all there, and none of them loaded before it is used."""

import ast
import inspect
import os
import re
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


def test_docstrings_tell_every_parameter():
    """Of each public function, and of the fields that results and settings are made of."""
    for name in set(kop_exudyn.__all__) - {"__version__", "InputError", "SimulationFailure"}:
        thing = getattr(kop_exudyn, name)
        told = " ".join(filter(None, (inspect.getdoc(thing), inspect.getdoc(thing.__init__))))
        missing = [
            parameter
            for parameter in inspect.signature(thing).parameters
            if parameter not in ("args", "kwargs") and not re.search(rf"\b{parameter}\b", told)
        ]
        assert missing == [], name


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


# A user's script, and misuses of every public name in it.
RIGHT = """
from pathlib import Path

import numpy as np

import kop_exudyn as kop

design: kop.Design = kop.load_design("a.json")
designs = kop.load_designs("models/small")
other = kop.design_from_dict({"class": "grid"})
loads = kop.LoadCase(gravity=np.array([0.0, 0.0, -9.81]), factor=1.5)
result: kop.SimulationResult = kop.simulate(design, loads)
print(result.fit.max_percent + 1.0, result.deployed.elastic_energy)
slopes = kop.ModelSensitivities(result, loaded=True).stress()
print(slopes.value + 1.0, slopes.rods[0].slopes["young"] + 1.0)
derivatives = kop.Sensitivities(design.systems["deployed"], result.deployed)
path = kop.trace_path(
    design.scene("deployed"),
    design.parameters,
    stop=lambda point: point.factor > 2.0,
    start=result.deployed,
    options=kop.PathOptions(),
)
weights = kop.Weights(fit=1e4)
settings = kop.JobSettings(stages=kop.StageSettings(seed=1), weights=weights, jobs=1)
found: kop.KitResult = kop.optimize_kit([design], {"linear": 3, "angular": 2}, settings=settings)
clustered = kop.cluster(design.groups, design.parameters, {"linear": 3})
assignment: kop.Assignment = clustered.assignment
group: kop.ElementGroup = design.groups[0]
print(group.kind.upper(), assignment.realise(clustered.kit, design.parameters))
kit: kop.Kit = found.kit
kop.save_kit("kit.json", kit)
print(kop.load_kit("kit.json").sizes["linear"] + 1)
print(kop.load_result("out/result.json")["designs"])
again = kop.load_run("out", designs)
report: Path = kop.write_kit_report(found, "out")
more = kop.optimize_and_report(designs, {"linear": 3}, out="out2")
pieces = kop.parts_list_of(found)
options = kop.CutOptions(kerf=3.2)
files = kop.export_workshop(pieces, "files", "m", options=options)
files += kop.export_desk(found, "desk") + kop.export_simulation(result, "desk")
kop.plot(result).savefig("a.png")
print(kop.to_compas(result)["mesh"], kop.to_meshio(result), kop.to_pandas(result)["rods"])
fitted = kop.fit_input(design)
try:
    kop.simulate(design)
except kop.InputError as error:
    print(error.field)
except kop.SimulationFailure as failure:
    print(failure.reason)
"""
WRONG = {
    "Assignment": "assignment.realize(kit, design.parameters)",
    "CutOptions": "kop.CutOptions(kerf='3.2')",
    "Design": "design.deply()",
    "ElementGroup": "group.kind + 1",
    "InputError": "kop.InputError(field='a')",
    "JobSettings": "kop.JobSettings(jobs='two')",
    "Kit": "found.kit + 1",
    "KitResult": "found.kits",
    "LoadCase": "kop.LoadCase(gravty=None)",
    "ModelSensitivities": "kop.ModelSensitivities(design)",
    "PathOptions": "kop.PathOptions(stepps=3)",
    "Sensitivities": "kop.Sensitivities(design, result.deployed)",
    "SimulationFailure": "kop.SimulationFailure()",
    "SimulationResult": "result.fit.max_percent.upper()",
    "StageSettings": "kop.StageSettings(sed=1)",
    "Weights": "kop.Weights(fit='much')",
    "cluster": "kop.cluster(design, {'linear': 3})",
    "design_from_dict": "kop.design_from_dict('a.json', 3)",
    "export_desk": "kop.export_desk(result, 'desk')",
    "export_simulation": "kop.export_simulation(found, 'desk')",
    "export_workshop": "kop.export_workshop(found, 'files', 'm')",
    "fit_input": "kop.fit_input('a.json')",
    "load_design": "kop.load_design(3)",
    "load_designs": "kop.load_designs('models').name",
    "load_kit": "kop.load_kit('kit.json').size",
    "load_result": "kop.load_result(found)",
    "load_run": "kop.load_run('out', 'models')",
    "optimize_and_report": "kop.optimize_and_report('models', {'linear': 3}, out='out')",
    "optimize_kit": "kop.optimize_kit(design, {'linear': 3})",
    "parts_list_of": "kop.parts_list_of(kit)",
    "plot": "kop.plot('a.json')",
    "save_kit": "kop.save_kit(found.kit, 'kit.json')",
    "simulate": "kop.simulate('a.json')",
    "to_compas": "kop.to_compas(design.name)",
    "to_meshio": "kop.to_meshio(3)",
    "to_pandas": "kop.to_pandas(kit)",
    "trace_path": "kop.trace_path(design, design.parameters, stop=print)",
    "write_kit_report": "kop.write_kit_report(kit, 'out')",
}


def test_misuses_in_a_users_script_are_found(tmp_path):
    """mypy --strict passes over a script that uses every public name, and finds a misuse of each;
    names that don't exist too."""
    assert set(WRONG) == set(kop_exudyn.__all__) - {"__version__"}
    script = tmp_path / "script.py"
    script.write_text(RIGHT)
    assert _mypy(script) == set()
    wrong = [*WRONG.values(), "kop.optimise_everything()"]
    script.write_text(RIGHT + "\n".join(wrong) + "\n")
    first = RIGHT.count("\n") + 1
    missed = set(range(first, first + len(wrong))) - _mypy(script)
    assert [wrong[line - first] for line in sorted(missed)] == []


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
