"""The package's public names: all there, and none of them loaded before it is used."""

import subprocess
import sys

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
