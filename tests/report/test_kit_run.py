"""The whole job on a toy class with both kinds of parts: zigzags of beams and corners, held a
little too short."""

import json

import numpy as np
import pytest
from support.settings import FEW_ERRORS
from support.zigzags import Zigzag, zigzags

from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.io.checkpoint import CheckpointStore
from kop_exudyn.io.kits import load_kit
from kop_exudyn.io.results import load_result, load_states
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.kit.parts import Kit
from kop_exudyn.kit.stock import Stock
from kop_exudyn.report.kit_cards import deviation_rows, deviation_words
from kop_exudyn.report.kit_drawings import drawn_designs, histories, part_spaces
from kop_exudyn.report.kit_run import optimize_and_report
from kop_exudyn.report.part_drawings import part_drawings
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings

SETTINGS = JobSettings(
    jobs=1,
    stages=StageSettings(
        schedule=(1e3, 1e5), path_steps=4, effort="quick", requirements=FEW_ERRORS
    ),
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished run, and its folder."""
    out = tmp_path_factory.mktemp("run") / "out"
    return optimize_and_report(
        zigzags(), {"linear": 3, "angular": 2}, out=out, settings=SETTINGS
    ), out


def test_the_folder_holds_all_that_is_promised(finished):
    result, out = finished
    names = {path.name for path in out.iterdir()}
    assert names == {
        "designs.svg",
        "history.svg",
        "parameters.svg",
        "result.json",
        "kit.json",
        "states.npz",
        "viewer.html",
        "index.html",
        "picture.png",
        "checkpoints",
    }
    np.testing.assert_array_equal(load_kit(out / "kit.json").vector, result.kit.vector)
    state = load_states(out / "states.npz")["zigzag 1", "assigned", "deployed"]
    kept = result.stages["assigned"].designs[1].equilibria["deployed"].state
    np.testing.assert_array_equal(state["positions"], kept.positions)


def test_result_file(finished):
    result, out = finished
    data = load_result(out / "result.json")
    assert [design["name"] for design in data["designs"]] == ["zigzag 0", "zigzag 1"]
    assert data["designs"][0]["elements"] == 7
    assert (len(data["kit"]["linear"]), len(data["kit"]["angular"])) == (3, 2)
    assert data["settings"]["parts"] == {"linear": 3, "angular": 2}
    assert data["peak_memory_mb"] > 0
    gaps = data["clustering"]
    assert set(gaps) == {"linear", "angular"} and gaps["angular"]["exact"]
    assert gaps["angular"]["gap_percent"] == pytest.approx(0, abs=1e-6)
    for gap in gaps.values():
        assert 0 < gap["bound"] <= gap["energy"]
    strength = data["designs"][0]["assigned"]["strength"]
    # no sections
    assert strength == {
        "deployed": {"equivalent_stress": None, "utilisation": None, "element": None}
    }


def test_drawings_show_the_result(finished):
    result, out = finished
    for n, drawn in enumerate(drawn_designs(result)):
        assert [state.title for state in drawn.states] == ["direct", "relaxed", "assigned"]
        for state in drawn.states:
            fit = result.stages[state.title].designs[n].fit
            assert max(state.deviation_percent) == pytest.approx(fit.max_percent)
            assert len(state.chains) == len(drawn.wanted) == 8
    relaxed, assigned = histories(result)
    assert len(relaxed.steps) == result.stages["relaxed"].steps
    assert len(assigned.steps) == result.stages["assigned"].steps
    assert relaxed.steps[-1].value == pytest.approx(result.stages["relaxed"].value)
    spaces = {space.kind: space for space in part_spaces(result)}
    assert spaces["linear"].clouds[0].full.shape == (8, 2)
    assert spaces["angular"].clouds[1].full.shape == (6, 1)
    assert np.all(spaces["angular"].clouds[0].full >= 0)


def test_the_page_begins_with_pictures_and_parts(finished):
    """Before any table: a card a design; then a drawing of every part with its counts, which add up
    to the elements."""
    result, out = finished
    page = (out / "index.html").read_text(encoding="utf-8")
    cards, parts = page.index('<div class="cards">'), page.index("<h2>The parts</h2>")
    assert page.index("<h1>") < cards < parts < page.index("<table>")
    assert page[cards:parts].count('<article><div class="card"><img') == len(result.designs)
    for n, design in enumerate(result.designs):
        fit = result.summary("assigned", n)["fit"]
        assert f"<h3>{design.name} " in page and f"at most {fit['max_percent']:.2g}\xa0%" in page
    # the pieces between joints are farther off than these: the first sentence says so
    words = deviation_words(result)
    assert "the rods between them within" in words
    worst = max(result.summary("assigned", n)["fit"]["pieces_max_percent"] for n in (0, 1))
    assert f"{worst:.2g} %" in words
    drawings, as_cut = part_drawings(result)
    assert not as_cut  # the toys name no units
    assert [one.label for one in drawings] == ["A1", "A2", "L1", "L2", "L3"]
    for n, design in enumerate(result.designs):
        assert sum(one.counts[n] for one in drawings) == design.n_elements


def test_deviations_are_the_same_in_percent_and_units(finished):
    result, out = finished
    data = load_result(out / "result.json")
    headings, rows = deviation_rows(result)
    assert headings[2] == "joints, max units of length"  # the toys name no units
    for n, row in enumerate(rows):
        fit = data["designs"][n]["assigned"]["fit"]
        size = result.references[n].target.size
        assert row[1] == fit["max_percent"] == pytest.approx(100 * row[2] / size)
        assert row[4] == fit["pieces_max_percent"] == pytest.approx(100 * row[5] / size)


def test_the_page_names_designs_and_settings(finished):
    page = (finished[1] / "index.html").read_text(encoding="utf-8")
    for piece in (
        "One kit of parts for 2 designs",
        "zigzag 1",
        "2 angular",
        "relaxed_steps",
        "exudyn",
        "angular parts that the search began with are the best clustering of the inputs",
    ):
        assert piece in page


def test_killed_and_resumed_gives_the_same(finished, tmp_path, monkeypatch):
    result, out = finished
    save = CheckpointStore.save
    saved = []

    def dies_at_the_third(self, name, arrays):
        save(self, name, arrays)
        saved.append(name)
        if len(saved) == 3:
            raise KeyboardInterrupt

    arguments = {"out": tmp_path / "out", "settings": SETTINGS}
    with monkeypatch.context() as patch:
        patch.setattr(CheckpointStore, "save", dies_at_the_third)
        with pytest.raises(KeyboardInterrupt):
            optimize_and_report(zigzags(), {"linear": 3, "angular": 2}, **arguments)
    assert not (tmp_path / "out" / "result.json").exists()
    resumed = optimize_and_report(zigzags(), {"linear": 3, "angular": 2}, resume=True, **arguments)
    np.testing.assert_array_equal(resumed.kit.vector, result.kit.vector)
    volatile = {"wall_s", "peak_memory_mb", "exudyn", "seconds"}
    first, second = (
        json.loads(
            (folder / "result.json").read_text(),
            object_pairs_hook=lambda pairs: {
                key: value for key, value in pairs if key not in volatile
            },
        )
        for folder in (out, tmp_path / "out")
    )
    assert first == second


def test_the_result_names_the_confirmed_states(finished):
    """All of them, in all stages; not those of steps, which aren't in it."""
    data = json.loads((finished[1] / "result.json").read_text(encoding="utf-8"))
    result = finished[0]
    for design, written in zip(result.designs, data["designs"]):
        for stage in result.stages:
            assert written[stage]["confirmed"] == sorted(role.name for role in design.roles)
            assert written[stage]["exudyn"]["moved"] < 1e-6
    assert 0 < data["seconds"]["confirmation"] < data["wall_s"]  # one process


def test_a_stage_that_exudyn_refuses_is_a_failure_of_the_result(monkeypatch):
    """Its states were good enough to go on from, which doesn't make them results."""
    designs, asked = zigzags(), []

    def refusing(scene, equilibrium, q, opening):
        asked.append(q)
        if any(scene is designs[0].scene(role.name) for role in designs[0].roles):
            raise SimulationFailure("Exudyn refuses the state")
        return confirm(scene, equilibrium, q, opening)

    monkeypatch.setattr("kop_exudyn.search.objective.confirm", refusing)
    result = optimize_kit(designs, {"linear": 4, "angular": 3}, settings=SETTINGS)
    for stage in result.stages:
        assert "Exudyn refuses" in result.summary(stage, 0)["failed"]
        assert result.summary(stage, 1)["confirmed"]
    assert asked


def test_designs_from_a_kit_that_exists(finished, tmp_path):
    """The parts stay as they are; the page and the saved run know of it."""
    kit = load_kit(finished[1] / "kit.json")
    result = optimize_and_report(zigzags()[:1], out=tmp_path / "out", settings=SETTINGS, kit=kit)
    np.testing.assert_array_equal(result.kit.vector, kit.vector)
    evaluation = result.stages["assigned"].designs[0]
    assert "unrelaxed" not in result.stages and evaluation.confirmations
    np.testing.assert_array_equal(
        result.stages["assigned"].assignment.realise(kit, evaluation.q), evaluation.q
    )
    assert "<h1>An existing kit for a design</h1>" in (tmp_path / "out" / "index.html").read_text(
        encoding="utf-8"
    )
    data = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert data["settings"]["kit"] == kit.to_dict() and data["kit"] == kit.to_dict()
    assert load_run(tmp_path / "out", zigzags()[:1]).kit.to_dict() == kit.to_dict()
    with pytest.raises(
        InputError, match="kit = 'linear': the kit has no angular parts, which zigzag 0 is made of"
    ):
        optimize_and_report(zigzags()[:1], out=tmp_path / "no", kit=Kit({"linear": kit["linear"]}))
    assert not (tmp_path / "no").exists()


@pytest.fixture(scope="module")
def another_kit():
    """A kit for other designs of the class, and how many pieces of each part it takes to build
    these one after the other."""
    generator = np.random.default_rng(8)
    others = [
        Zigzag(f"other {k}", 0.3 + 0.1 * generator.random((9, 2)), 0.6 * generator.random(8) - 0.3)
        for k in range(2)
    ]
    result = optimize_kit(others, {"linear": 4, "angular": 3}, settings=SETTINGS)
    return result.kit, {
        kind: np.max([counts[kind] for counts in result.pieces()], axis=0)
        for kind in result.kit.parts
    }


def test_a_stock_of_60_percent_of_another_kits_pieces(another_kit, tmp_path):
    kit, needed = another_kit
    counts = {kind: np.floor(0.6 * n).astype(int) for kind, n in needed.items()}
    stock = Stock(kit, counts)
    out = tmp_path / "out"
    result = optimize_and_report(zigzags(), kit=stock, out=out, settings=SETTINGS)
    np.testing.assert_array_equal(result.kit.vector, kit.vector)
    for n, used in enumerate(result.pieces()):
        assert all(np.all(used[kind] <= counts[kind]) for kind in counts)
        assert used["linear"].sum() == 4 and used["angular"].sum() == 3
        assert result.stages["assigned"].designs[n].confirmations
    # there are fewer pieces than the nearest parts would take, and moving the designs to them gains
    free = optimize_kit(zigzags(), kit=kit, settings=SETTINGS)
    assert any(np.any(u[k] > counts[k]) for u in free.pieces() for k in counts)
    assert result.stages["assigned"].value < result.stages["direct"].value
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "<h1>A stock for 2 designs</h1>" in page and "one after the other" in page
    data = load_result(out / "result.json")
    assert data["settings"]["stock"] == stock.to_dict()


def test_a_stock_that_cannot_suffice(another_kit, tmp_path):
    kit, _ = another_kit
    counts = {"linear": np.array([1, 1, 0, 0]), "angular": np.array([2, 0, 3])}
    with pytest.raises(InputError, match="2 linear pieces are missing for zigzag 0") as caught:
        optimize_and_report(zigzags(), kit=Stock(kit, counts), out=tmp_path / "no")
    assert "best of the parts that are there: " in str(caught.value)
    assert not (tmp_path / "no").exists()
    together = Stock(kit, counts, together=True)
    with pytest.raises(InputError, match="1 angular piece .* together.*; 6 linear pieces"):
        optimize_kit(zigzags(), kit=together, settings=SETTINGS)


def test_designs_that_stand_together_share_the_stock(another_kit):
    kit, _ = another_kit
    counts = {"linear": np.array([2, 2, 2, 2]), "angular": np.array([2, 2, 2])}
    stock = Stock(kit, counts, together=True)
    result = optimize_kit(zigzags(), kit=stock, settings=SETTINGS)
    for kind, there in counts.items():
        np.testing.assert_array_equal(sum(used[kind] for used in result.pieces()), there)
    assert result.stages["assigned"].value < result.stages["direct"].value


def test_another_job_is_not_resumed(finished):
    with pytest.raises(InputError, match="different job: parts.linear was 3 and is now 4"):
        optimize_and_report(
            zigzags(), {"linear": 4, "angular": 2}, out=finished[1], settings=SETTINGS, resume=True
        )


@pytest.mark.parametrize(
    "parts, message",
    [
        ({"linear": 9, "angular": 2}, r"parts.linear = 9: more parts than elements \(8\)"),
        ({"linear": 3}, "parts.angular: the designs have elements of this kind"),
        (
            {"linear": 3, "angular": 2, "cell": 1},
            "parts.cell = 1: the designs have no elements of this kind",
        ),
    ],
)
def test_impossible_requests_fail_before_anything_is_written(tmp_path, parts, message):
    with pytest.raises(InputError, match=message):
        optimize_and_report(zigzags(), parts, out=tmp_path / "out", settings=SETTINGS)
    assert not (tmp_path / "out").exists()


def test_memory_counts_live_workers(c_shell_data):
    """Workers live on after a run and are no ended children: their memory would go unseen."""
    from kop_exudyn.search.memory import peak_memory_mb
    from kop_exudyn.search.pool import DesignPool
    from kop_exudyn.structures.base import design_from_dict

    designs = [design_from_dict(c_shell_data | {"name": name}, name) for name in "ab"]
    with DesignPool(designs, 2) as pool:
        pool.prepare()
        assert pool.peak_memory_mb() > peak_memory_mb() + 50
