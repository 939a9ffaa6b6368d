"""A Grasshopper script component that calls kop (Rhino 8: Maths, Script, Python 3 Script).

Inputs (right-click for type hint and access)
    kop : str, item : path of the program, as C:/kop/.venv/Scripts/kop.exe
    arguments : str, list : what follows it, one a line: simulate, C:/roof/designs/vault.json
    run : bool, item : a button
Outputs
    joints : points, where the answer has joints
    figures : "name: value", all plain values of the answer
    files : paths that were written
    error : what kop says is wrong; empty when all is well
"""

import json
import subprocess

_SECONDS = 3600  # a search may take its time


def call(program, given):
    """The answer of `kop ARGUMENTS --json` as plain data, and what it says is wrong."""
    command = [str(program), *map(str, given), "--json", "--quiet"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS)
    except (OSError, subprocess.TimeoutExpired) as problem:
        return {}, str(problem)
    answer = json.loads(done.stdout) if done.stdout.strip() else {}
    return answer, done.stderr.strip() if done.returncode else ""


def figures_of(answer, name=""):
    """ "name: value" of all plain values, those of objects as "object.name: value"."""
    found = []
    for key, value in answer.items():
        if isinstance(value, dict):
            found += figures_of(value, name + key + ".")
        elif not isinstance(value, list):
            found.append(f"{name}{key}: {value}")
    return found


def points_of(answer):
    """The joints as Rhino's points; outside of Rhino as tuples."""
    places = [tuple(place) for place in answer.get("joints", [])]
    try:
        from Rhino.Geometry import Point3d
    except ImportError:
        return places
    return [Point3d(*place) for place in places]


joints, figures, files, error = [], [], [], ""
if globals().get("run"):
    answer, error = call(kop, arguments)  # noqa: F821 (the component's inputs)
    joints, figures = points_of(answer), figures_of(answer)
    files = list(answer.get("files", []))
