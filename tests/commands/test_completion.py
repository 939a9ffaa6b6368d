"""Completion scripts: the shells themselves read them."""

import json
import shutil
import subprocess

import pytest

from kop_exudyn.cli import main
from kop_exudyn.commands import NAMES
from kop_exudyn.commands.completion import SHELLS


@pytest.mark.parametrize("shell", SHELLS)
def test_all_commands_are_in_the_script(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    for word in (*NAMES, "gravity", "redeployments"):
        assert word in script
    if shutil.which(shell):
        done = subprocess.run([shell, "-n"], input=script, text=True, capture_output=True)
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes(capsys):
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    function = script.rsplit("complete ", 1)[1].split("-F ")[1].split()[0]

    def completed(*words: str) -> set[str]:
        line = " ".join(f"'{word}'" for word in words)
        done = subprocess.run(
            ["bash", "--norc"],
            text=True,
            capture_output=True,
            check=True,
            input=(
                f"{script}\nCOMP_WORDS=({line})\nCOMP_CWORD={len(words) - 1}\n"
                f"COMP_LINE='{' '.join(words)}'\n"
                f'COMP_POINT=${{#COMP_LINE}}\n{function}\nprintf "%s\\n" "${{COMPREPLY[@]}}"\n'
            ),
        )
        return set(done.stdout.split())

    assert completed("kop", "") >= set(NAMES)
    assert completed("kop", "opt") == {"optimize"}
    assert completed("kop", "import", "--sc") == {"--scale"}
    # a class of another test's may be there as well
    classes = completed("kop", "import", "x.dxf", "--as", "")
    assert classes >= {"c_shell", "grid", "umbrella"}
    assert not any(name.startswith("-") for name in classes)


def test_json(capsys):
    assert main(["completion", "bash", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["script"].startswith("# AUTOMATICALLY GENERATED")
