"""The check that Exudyn's rod is the one that is meant."""

import pytest

from kop_exudyn.equilibrium.exudyn_library import check_library, exu, rod_forces


def test_the_installed_library_fits():
    check_library(exu.__version__)


@pytest.mark.parametrize("version", ["1.13.5", "1.9.0"])
def test_older_releases_are_refused(version):
    with pytest.raises(ImportError, match=rf">= 1\.13\.6, found {version}"):
        check_library(version)


def test_a_rod_that_is_straight_without_stress_is_refused():
    """What older releases did: the shape of the reference coordinates didn't count."""

    def straight(reference, placed, length, stiffness):
        level = 0 * reference
        level[1, 0] = length
        return rod_forces(level, placed, length, stiffness)

    with pytest.raises(ImportError, match="another rod"):
        check_library("1.14.0", straight)


def test_moments_about_other_axes_are_refused():
    def otherwise(*arguments):
        forces = rod_forces(*arguments)
        forces[3:6] = forces[[4, 5, 3]]
        return forces

    with pytest.raises(ImportError, match="another rod"):
        check_library("1.14.0", otherwise)
