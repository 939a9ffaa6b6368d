"""Compiles the kernels into the wheel. Without a compiler the package is installed all the same,
and uses NumPy; what else there is to say to setuptools stands in setup.cfg."""

import importlib.util
import shutil
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

FOLDER = Path("kop_exudyn") / "compiled"
# by its place: the package itself needs what isn't installed yet
_spec = importlib.util.spec_from_file_location("build_kernels", FOLDER / "build.py")
build_kernels = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(build_kernels)


class BuildWithKernels(build_py):
    def run(self):
        super().run()
        if self.editable_mode:
            self._compile(Path())
            return
        for file in sorted(Path("models").glob("*/*")):  # for `kop examples`
            if file.suffix in (".json", ".obj"):
                copy = Path(self.build_lib) / "kop_exudyn" / "examples" / file.parent.name
                copy.mkdir(parents=True, exist_ok=True)
                shutil.copy(file, copy)
        self._compile(Path(self.build_lib))

    def _compile(self, root):
        try:
            build_kernels.build(root / FOLDER / build_kernels.BUILT.name)
        except build_kernels.BuildError as error:
            self.warn(f"the kernels are not compiled, NumPy will be used instead: {error}")


class PlatformDistribution(Distribution):
    """A distribution with compiled files, unless there is nothing to compile them with."""

    def has_ext_modules(self):
        return build_kernels.compiler() is not None


class WheelWithKernels(bdist_wheel):
    """For this platform, but for any Python: the library knows nothing of Python."""

    def get_tag(self):
        tag = super().get_tag()
        return tag if self.root_is_pure else ("py3", "none", tag[2])


setup(
    distclass=PlatformDistribution,
    cmdclass={"build_py": BuildWithKernels, "bdist_wheel": WheelWithKernels},
)
