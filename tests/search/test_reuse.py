"""Fewer pieces to make as an aim of the search."""

import pytest
from support.zigzags import zigzags

from kop_exudyn.errors import InputError
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings


def test_results_tell_how_many_pieces_have_to_be_made():
    stages = StageSettings(
        schedule=(1e3, 1e5), path_steps=4, leaps=0, effort="quick", reuse=2.0, redeployments=0
    )
    job = JobSettings(jobs=1, stages=stages, baselines=False)
    result = optimize_kit(zigzags(), {"linear": 3, "angular": 2}, settings=job)
    counts = result.pieces()
    made = sum(
        max(own[kind][k] for own in counts)
        for kind in counts[0]
        for k in range(len(counts[0][kind]))
    )
    elements = sum(design.n_elements for design in result.designs)
    assert result.to_dict()["pieces"] == {"to_make": made, "elements": elements}
    stage = result.stages["assigned"]
    assert stage.merit == pytest.approx((stage.value + stage.penalty) * (made / elements) ** 2)


def test_negative_weights_are_refused():
    with pytest.raises(InputError, match="reuse = -1.0: must be a number that is not negative"):
        StageSettings(reuse=-1.0)
