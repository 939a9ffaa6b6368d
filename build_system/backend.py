"""Setuptools as the build backend, with a C compiler from a wheel where the machine has none.

Kernels are several times as fast as what takes their place. The package `ziglang` holds a whole C
compiler; it is needed while the package is built, and thrown away after that.
"""

import importlib.util
from pathlib import Path

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403  # all other hooks

_COMPILER = ["ziglang>=0.17"]


def get_requires_for_build_wheel(config_settings=None):
    return build_meta.get_requires_for_build_wheel(config_settings) + _compiler()


def get_requires_for_build_editable(config_settings=None):
    return build_meta.get_requires_for_build_editable(config_settings) + _compiler()


def _compiler():
    """What is needed to have a compiler."""
    file = Path(__file__).parents[1] / "kop_exudyn" / "compiled" / "build.py"
    spec = importlib.util.spec_from_file_location("build_kernels", file)
    kernels = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(kernels)
    return [] if kernels.compiler() else _COMPILER
