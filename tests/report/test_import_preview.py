"""The plan of what was read of a drawing."""

import numpy as np
from matplotlib.text import Annotation

from kop_exudyn.exchange.drawing import Drawing, DrawnCurve
from kop_exudyn.exchange.drawn_networks import ReadingOptions, drawn_network
from kop_exudyn.report.import_preview import _plan_figure


def test_numbers_of_curves_that_begin_in_one_tip_stand_apart():
    t = np.linspace(0, 1, 9)[:, None]
    starts = np.array([[0.0, 0, 0], [0, 0, 0], [0, 300, 0], [300, 0, 0]])
    steps = np.array([[900.0, 40, 0], [40, 900, 0], [900, 40, 0], [40, 900, 0]])
    curves = [DrawnCurve(a + t * b, False, "line") for a, b in zip(starts, steps)]
    figure = _plan_figure(drawn_network(Drawing(curves), ReadingOptions()), [], "mm")
    numbers = [text for text in figure.axes[0].texts if isinstance(text, Annotation)]
    places: dict[tuple[float, ...], list[np.ndarray]] = {}
    for text in numbers:
        places.setdefault(tuple(np.round(text.xy, 6)), []).append(np.array(text.xyann))
    assert len(numbers) == 4 and max(map(len, places.values())) == 2
    for offsets in places.values():
        for k, offset in enumerate(offsets):
            assert all(np.linalg.norm(offset - other) > 7 for other in offsets[:k])  # points
