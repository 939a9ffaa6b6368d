"""Figures from made-up data: what is drawn is what was given. Their looks were judged by eye."""

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection
from matplotlib.patches import PathPatch

from kop_exudyn.drawing.style import deviation_colours, figure_bytes, save_figure
from kop_exudyn.errors import InputError
from kop_exudyn.report.designs import DrawnDesign, DrawnState, draw_designs, project
from kop_exudyn.report.history import History, HistoryStep, draw_history
from kop_exudyn.report.parameters import ElementCloud, PartSpace, _spread, draw_parameters


def arch(rise: float) -> list[np.ndarray]:
    s = np.linspace(-1, 1, 9)
    return [np.stack([s, np.full_like(s, y), rise * (1 - s**2)], axis=1) for y in (-0.5, 0.5)]


def drawn(title: str, rise: float, percent: float) -> DrawnState:
    chains = arch(rise)
    return DrawnState(title, chains, chains[0][::4], np.array([0.0, percent, 1.0]))


def text_of(figure) -> str:
    texts = [t.get_text() for ax in figure.axes for t in [ax.title, ax._left_title, *ax.texts]]
    return "\n".join(texts)


def lines_of(ax):
    """The lines that are drawn together, one list each."""
    paths = [one.get_path() for one in ax.get_children() if isinstance(one, PathPatch)]
    return [np.split(p.vertices, np.flatnonzero(p.codes == p.MOVETO)[1:]) for p in paths]


class TestDesigns:
    designs = [
        DrawnDesign("one", [drawn("direct", 0.5, 8.0), drawn("assigned", 0.4, 2.0)], arch(0.4)),
        DrawnDesign(
            "two", [DrawnState("direct", failed="it buckles"), drawn("assigned", 0.4, 3.0)]
        ),
    ]

    def test_rods_joints_and_words(self):
        figure = draw_designs(self.designs)
        panels = figure.axes[:4]
        wanted, *rods = lines_of(panels[0])
        # wanted shape by rod, drawn state by element
        assert len(wanted) == 2 and sum(map(len, rods)) == 16
        joints = next(c for c in panels[0].collections if isinstance(c, PathCollection))
        assert sorted(joints.get_array()) == [0.0, 1.0, 8.0]
        words = text_of(figure)
        for word in ("one", "two", "direct", "assigned", "max 8 %", "mean 3 %", "it buckles"):
            assert word in words

    def test_the_farther_is_lighter_and_drawn_first(self):
        rods = [
            patch
            for patch in draw_designs(self.designs).axes[0].get_children()
            if isinstance(patch, PathPatch)
        ][1:]
        greys = [patch.get_edgecolor()[0] for patch in rods]
        assert len(greys) > 3 and greys == sorted(greys, reverse=True)

    def test_one_scale_of_colours_for_all(self):
        figure = draw_designs(self.designs)
        limits = {
            c.get_clim()
            for ax in figure.axes[:4]
            for c in ax.collections
            if isinstance(c, PathCollection)
        }
        assert limits == {(0.0, 8.0)}

    def test_everything_lies_within_its_panel(self):
        figure = draw_designs(self.designs)
        for ax in figure.axes[:4]:
            for lines in lines_of(ax):
                points = np.concatenate(lines)
                assert np.all(
                    (points >= [ax.get_xlim()[0], ax.get_ylim()[0]])
                    & (points <= [ax.get_xlim()[1], ax.get_ylim()[1]])
                )

    def test_projection_keeps_parallel_lengths_and_looks_from_above(self):
        places, depths = project(np.vstack([np.zeros(3), np.eye(3)]))
        # three orthonormal directions seen in parallel projection: squared lengths add up to two
        # (Gauss's theorem)
        assert np.sum(places[1:] ** 2) == pytest.approx(2)
        assert np.sum(depths[1:] ** 2) == pytest.approx(1)
        assert places[3, 1] > 0 and depths[3] < 0

    def test_rows_of_different_states_have_their_titles_in_the_panels(self):
        rows = [
            DrawnDesign("", [drawn("a", 1.0, 2.0), drawn("b", 1.0, 2.0)]),
            DrawnDesign("", [drawn("c", 1.0, 2.0), drawn("d", 1.0, 2.0)]),
        ]
        figure = draw_designs(rows, 1.5, "displacement")
        for title, ax in zip("abcd", figure.axes):
            assert title in [text.get_text() for text in ax.texts] and not ax.get_title()
        assert "displacement, % of size" in [ax.get_ylabel() for ax in figure.axes]

    def test_flat_and_failed_designs_are_drawn(self):
        flat = DrawnDesign("flat", [drawn("rest", 0.0, 0.0)])
        nothing = DrawnDesign("none", [DrawnState("rest", failed="no")])
        assert figure_bytes(draw_designs([flat, nothing]), "svg")


class TestHistory:
    steps = [
        HistoryStep({"fit": 1.0 / k, "projection": 0.5 / k}, 1e3 if k < 4 else 2e4)
        for k in range(1, 8)
    ]

    def test_values_are_sums_of_terms(self):
        figure = draw_history([History("relaxed", self.steps)])
        lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
        np.testing.assert_allclose(lines["objective"], np.add(lines["fit"], lines["projection"]))

    def test_weights_are_marked_where_they_change(self):
        ax = draw_history([History("relaxed", self.steps)]).axes[0]
        marks = [line for line in ax.lines if len(line.get_xdata()) == 2]
        assert [line.get_xdata()[0] for line in marks] == [3.5]
        assert [t.get_text() for t in ax.texts] == ["$w_c$ = $10^{3}$", "$w_c$ = 20000"]

    def test_labels_of_short_stretches_do_not_cover_each_other(self):
        """Rounds of one step each: every line is drawn, those labels are left out that would."""
        rounds = [HistoryStep({"fit": 1.0}, round=200 + k) for k in range(40)]
        long = [HistoryStep({"fit": 1.0}, round=1)] * 30
        figure = draw_history([History("relaxed", self.steps), History("assigned", long + rounds)])
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        ax = figure.axes[1]
        boxes = sorted((t.get_window_extent(renderer) for t in ax.texts), key=lambda box: box.x0)
        assert all(a.x1 <= b.x0 for a, b in zip(boxes, boxes[1:])) and 5 < len(boxes) < 40
        assert len([line for line in ax.lines if len(line.get_xdata()) == 2]) == 40

    def test_stages_with_other_terms_or_no_steps(self):
        assigned = History("assigned", [HistoryStep({"fit": 0.5})])
        figure = draw_history([History("relaxed", self.steps), assigned, History("unrelaxed", [])])
        assert len(figure.axes) == 3 and "no steps" in text_of(figure)
        assert figure_bytes(figure, "png")


class TestParameters:
    pairs = np.sort(np.random.default_rng(0).uniform(1, 2, (50, 2)), axis=1)
    angles = np.random.default_rng(1).uniform(0, 1, (40, 1))

    def test_all_elements_and_parts_are_there(self):
        linear = PartSpace(
            "linear",
            ("l1", "l2"),
            self.pairs[:3],
            [ElementCloud("inputs", self.pairs, np.array([0.7]))],
        )
        angular = PartSpace(
            "angular", ("angle",), self.angles[:2], [ElementCloud("inputs", self.angles)]
        )
        plane, line = draw_parameters([linear, angular]).axes
        drawn = {entry.get_label(): entry for entry in plane.lines}
        np.testing.assert_array_equal(np.transpose(drawn["inputs"].get_data()), self.pairs)
        np.testing.assert_array_equal(np.transpose(drawn["parts"].get_data()), self.pairs[:3])
        np.testing.assert_array_equal(drawn["end elements"].get_xdata(), [0.7])
        assert plane.get_xlim()[0] < 0.7
        assert sum(patch.get_height() for patch in line.patches) == len(self.angles)
        assert sorted(t.get_text() for t in line.texts) == ["1", "2"]

    def test_identical_parts(self):
        same = PartSpace(
            "angular", ("angle",), np.ones((3, 1)), [ElementCloud("inputs", np.ones((4, 1)))]
        )
        assert figure_bytes(draw_parameters([same]), "svg")

    def test_labels_stand_apart_in_order_and_near_their_places(self):
        places = np.array([0.0, 0.01, 0.02, 1.0])
        spread = _spread(places, 0.1)
        np.testing.assert_allclose(np.diff(spread)[:2], 0.1)
        assert spread[:3].mean() == pytest.approx(0.01) and spread[3] == 1.0


def test_same_figure_same_bytes():
    first, second = (figure_bytes(draw_designs(TestDesigns.designs), "svg") for _ in range(2))
    assert first == second


def test_saving(tmp_path):
    figure = draw_history([History("relaxed", TestHistory.steps)])
    paths = save_figure(figure, tmp_path / "v1.2", ("svg", "png"))
    assert [path.name for path in paths] == ["v1.2.svg", "v1.2.png"]
    assert paths[1].read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match="exists already"):
        save_figure(figure, tmp_path / "v1.2")


def test_the_callers_settings_stay():
    before = dict(matplotlib.rcParams)
    figure_bytes(draw_designs(TestDesigns.designs), "png")
    assert dict(matplotlib.rcParams) == before


def test_darker_means_farther_off():
    red, green, blue, _ = deviation_colours()(np.linspace(0, 1, 50)).T
    brightness = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    assert np.all(np.diff(brightness) < 0)
