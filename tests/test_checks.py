"""What settings refuse: each value that makes no sense, with its field."""

from __future__ import annotations

import re
from dataclasses import fields

import numpy as np
import pytest

from kop_exudyn.analysis.verdict import VerdictSettings
from kop_exudyn.checks import (
    check_choice,
    check_flag,
    check_not_negative,
    check_positive,
    check_whole,
)
from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.options import CutOptions, Tolerances
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.tolerance import Tolerance
from kop_exudyn.sqp.options import SQPOptions

WORDS = ("schedule", "bounds", "constraints", "hessian", "effort", "requirements")
NUMBERS = [field.name for field in fields(StageSettings) if field.name not in WORDS]


@pytest.mark.parametrize(
    ("check", "taken", "refused"),
    [
        (check_whole, (0, 3, np.int32(2), 10**30), (-1, 1.0, True, "1", None, np.nan)),
        (check_positive, (1, 1e-300, np.float32(0.5)), (0, -1, True, "1", None, np.nan, np.inf)),
        (check_not_negative, (0, 0.0, np.float64(2)), (-1e-300, False, "0", None, np.nan, np.inf)),
        (check_flag, (True, False), (0, 1, "true", None)),
        (lambda f, v: check_choice(f, v, ("one", "two")), ("one",), ("oen", 1, None, ["one"])),
    ],
)
def test_single_values(check, taken, refused):
    for value in taken:
        check("field", value)
    for value in refused:
        with pytest.raises(InputError) as found:
            check("field", value)
        assert found.value.field == "field" and found.value.value is value


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [-1, np.nan, np.inf, "3", True, None])
def test_every_number_of_the_stages_is_looked_at(name, value):
    with pytest.raises(InputError, match=f"^{name}") as found:
        StageSettings(**{name: value})
    assert found.value.field == name and found.value.value is value


@pytest.mark.parametrize("name", [n for n in NUMBERS if n.endswith("_steps")] + ["restarts"])
def test_no_steps_at_all_are_refused(name):
    with pytest.raises(InputError, match=f"{name} = 0: must be a whole number, at least 1"):
        StageSettings(**{name: 0})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"schedule": ()}, "schedule: must be one number or more"),
        ({"schedule": 3.0}, "schedule = 3.0: expected a list of numbers"),
        ({"schedule": (1.0, -1.0)}, "schedule[1] = -1.0: must be a positive number"),
        ({"hessian": "exakt"}, "hessian = 'exakt': unknown (did you mean 'exact'? known: "),
        ({"effort": 3}, "effort = 3: unknown (known: quick, normal, thorough)"),
        ({"bounds": {"linera": (0.1, 1.0)}}, "bounds = 'linera': unknown (did you mean 'linear'"),
        ({"bounds": {"linear": (2.0, 1.0)}}, "bounds.linear = ([2.0, 2.0], [1.0, 1.0]): no part"),
        ({"bounds": {"linear": 1.0}}, "bounds.linear = 1.0: expected a lower and an upper bound"),
        ({"constraints": [1.0]}, "constraints = [1.0]: must be LinearConstraints"),
        ({"requirements": {"stress": False}}, "requirements = {'stress': False}: must be Require"),
    ],
)
def test_the_other_fields_of_the_stages(given, message):
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        StageSettings(**given)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: JobSettings(jobs=0), "jobs"),
        (lambda: JobSettings(jobs=1.5), "jobs"),
        (lambda: JobSettings(design_weights=(1.0, 0.0)), "design_weights[1]"),
        (lambda: JobSettings(baselines=1), "baselines"),
        (lambda: SQPOptions(max_steps=1.5), "max_steps"),
        (lambda: SQPOptions(max_trials=0), "max_trials"),
        (lambda: SQPOptions(radius=np.nan), "radius"),
        (lambda: SQPOptions(penalty=np.inf), "penalty"),
        (lambda: Requirements(samples=-1), "samples"),
        (lambda: Requirements(length=np.inf), "length"),
        (lambda: Tolerance(0.1, "0.2"), "angle"),
        (lambda: Tolerances(angle=True), "tolerance.angle"),
        (lambda: CutOptions(kerf=np.nan), "options.kerf"),
        (lambda: VerdictSettings(safety=0), "tolerance.safety"),
        (lambda: VerdictSettings(samples=2.5), "tolerance.samples"),
    ],
)
def test_other_settings(make, field):
    with pytest.raises(InputError) as found:
        make()
    assert found.value.field == field


def test_usual_settings_and_a_radius_without_limit_are_taken():
    JobSettings(design_weights=(1.0, 2), stages=StageSettings(schedule=(1, 10.0), seed=np.int64(3)))
    StageSettings(bounds={"linear": (0.0, np.inf)}, constraints=None)
    SQPOptions(radius=np.inf, max_steps=0)
