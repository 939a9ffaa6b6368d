"""The 3D page: its data in Python; and, where Chromium is installed, what a browser makes of it."""

import base64
import hashlib
import json
import re
import shutil
import subprocess
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from support.settings import ONE_STEP
from support.shells import shell_data

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.report.viewer import (
    ViewerDesign,
    ViewerPart,
    ViewerRods,
    ViewerScene,
    ViewerState,
    save_viewer,
    scene_data,
    viewer_page,
)
from kop_exudyn.report.viewer_scenes import design_scene, kit_scene, opening_path
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.structures.base import design_from_dict

SECTION = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)


def two_rods(stage="input", opening=None, final=True, utilisation=0.5):
    """Two rods of two and three rings, one beside the other."""
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 1, 0], [1, 1, 0]], float)
    return ViewerState(
        stage,
        "deployed",
        x,
        np.broadcast_to(np.eye(3), (5, 3, 3)),
        deviation=np.linspace(0, 1.9, 5),
        utilisation=np.full(5, utilisation),
        opening=opening,
        final=final,
    )


def rods():
    return ViewerRods(np.array([2, 3]), np.array([0, 1]), [SECTION], np.array([0, 0]))


def plain_scene(**changes):
    parts = [
        ViewerPart("L1", "linear", (0.8, 0.2, 0.1), "l1 1", (1, 1)),
        ViewerPart("L2", "linear", (0.1, 0.3, 0.8)),
    ]
    designs = [
        ViewerDesign(
            name,
            {"deployed": rods()},
            [two_rods(), two_rods("assigned")],
            (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])),
        )
        for name in ("one", "two </script><b>")
    ]
    return ViewerScene("A <test> page", designs, parts, **changes)


@pytest.fixture(scope="module")
def result():
    designs = [design_from_dict(shell_data("flat")), design_from_dict(shell_data("bent", 0.16))]
    return optimize_kit(
        designs,
        {"linear": 2, "angular": 2},
        settings=JobSettings(jobs=1, baselines=False, stages=ONE_STEP),
    )


@pytest.fixture(scope="module")
def kit_page(result):
    return kit_scene(result, frames=3)


def decoded(packed):
    ((kind, text),) = packed.items()
    return np.frombuffer(base64.b64decode(text), {"f32": "<f4", "i32": "<i4"}[kind])


def data_on(page):
    return json.loads(
        re.search(r'<script type="application/json" id="scene">(.*?)</script>', page, re.S).group(1)
    )


def test_page_is_one_file_that_loads_nothing():
    page = viewer_page(plain_scene())
    assert not re.search(
        r"(src|href)\s*=|url\(|@import|https?://|import\s*\(|fetch\(|XMLHttpRequest", page
    )
    script = re.search(r"<script>(.*?)</script>", page, re.S).group(1)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'" in page
    assert "<title>A &lt;test&gt; page</title>" in page


def test_data_comes_through_whatever_names_are():
    data = data_on(viewer_page(plain_scene()))
    assert data == json.loads(json.dumps(scene_data(plain_scene())))
    assert data["designs"][1]["name"] == "two </script><b>"
    state = data["designs"][0]["states"][0]
    np.testing.assert_array_equal(decoded(state["places"]).reshape(-1, 3), two_rods().positions)
    np.testing.assert_array_equal(decoded(state["turns"]).reshape(-1, 4), [[0, 0, 0, 1]] * 5)
    np.testing.assert_array_equal(decoded(data["designs"][0]["rods"]["deployed"]["rings"]), [2, 3])


def test_scales_end_at_handy_numbers_of_the_last_stage():
    scene = plain_scene()
    assert scene_data(scene)["limits"] == {"deviation": 2.0, "utilisation": 0.6}
    assert scene_data(plain_scene(utilisation_limit=1.0))["limits"]["utilisation"] == 1.0
    bare = ViewerState("input", "deployed", np.zeros((5, 3)), np.broadcast_to(np.eye(3), (5, 3, 3)))
    data = scene_data(ViewerScene("bare", [ViewerDesign("one", {"deployed": rods()}, [bare])]))
    assert data["colourings"] == ["plain"] and data["designs"][0]["states"][0]["deviation"] is None


def test_kit_scene_has_all_stages_and_parts(result, kit_page):
    assert [p.label for p in kit_page.parts] == ["A1", "A2", "L1", "L2"]
    assert sum(p.uses[0] for p in kit_page.parts) == result.designs[0].n_elements
    for n, design in enumerate(kit_page.designs):
        final = [s for s in design.states if s.final]
        stages = ("input", "direct", "relaxed", "assigned")
        assert {(s.stage, s.role) for s in final} == {
            (stage, role) for stage in stages for role in ("deployed", "rest")
        }
        scene, rods = result.designs[n].scene("deployed"), design.rods["deployed"]
        assert rods.rings.sum() == sum(len(chain.nodes) for chain in scene.chains)
        counts = np.bincount(rods.corner_parts, minlength=4)[:2]
        np.testing.assert_array_equal(counts, [p.uses[n] for p in kit_page.parts[:2]])
        assigned = next(s for s in final if (s.stage, s.role) == ("assigned", "deployed"))
        outcome = result.stages["assigned"].designs[n]
        assert f"joints at most {outcome.fit.max_percent:.2g} %" in assigned.note
        wanted = outcome.fit.placement.apply(
            outcome.equilibria["deployed"].state.positions[result.designs[n].joints]
        )
        np.testing.assert_allclose(assigned.joints, wanted, atol=1e-6)


def test_rods_are_shown_with_the_part_that_makes_their_length(result, kit_page):
    """Every rod piece's rest length is one of its part's two lengths."""
    lengths, q = result.kit["linear"], result.stages["assigned"].designs[0].q
    scene, rods = result.designs[0].scene("deployed"), kit_page.designs[0].rods["deployed"]
    rest = scene.rest_lengths(q)
    for chain, part in zip(scene.chains, rods.parts):
        assert np.isclose(rest[chain.elements].sum(), lengths[part - 2], rtol=1e-9).any()


def test_shells_are_shown_opening_from_their_flat_assembly(result, kit_page):
    for design, outcome, shown in zip(
        result.designs, result.stages["assigned"].designs, kit_page.designs
    ):
        final = outcome.equilibria["deployed"]
        path = opening_path(design, outcome.equilibria, 3)
        openings = [final.opening] + [eq.opening for eq in path]
        closed = next(r.opening for r in design.roles if r.name == "rest")
        assert len(path) >= 2 and (np.diff(np.abs(np.array(openings) - closed)) < 0).all()
        assert openings[-1] == closed
        assert np.ptp(path[-1].state.positions[:, 2]) < 1e-6 * design.target.size
        assert sum(not s.final for s in shown.states) == len(path)
        assert len(opening_path(design, outcome.equilibria, 1)) == 1
        assert opening_path(design, outcome.equilibria, 0) == []


def test_a_design_that_opens_into_another_state_is_shown_closing_from_its_own(repository, caplog):
    """As far as it can be followed: here from the mirror image, which is as good an equilibrium."""
    design = load_designs(repository / "models" / "small", ["01_sinh"])[0]
    equilibria, flip = design.deploy(), np.diag([1.0, 1.0, -1.0])
    final = equilibria["deployed"]
    path = opening_path(design, equilibria, 3)
    assert len(path) == 3 and not caplog.text
    assert (np.diff([eq.elastic_energy for eq in (final, *path)]) < 0).all()
    state = replace(
        final.state,
        positions=final.state.positions @ flip,
        rotations=flip @ final.state.rotations @ flip,
    )
    mirrored = solve(design.systems["deployed"], final.q, state, final.opening)
    path = opening_path(design, equilibria | {"deployed": mirrored}, 3)
    assert "opens into another state" in caplog.text
    openings = [mirrored.opening] + [eq.opening for eq in path]
    closed = next(r.opening for r in design.roles if r.name == "rest")
    assert path and (np.diff(np.abs(np.array(openings) - closed)) < 0).all()


def test_umbrella_meshes_are_shown_opening_from_their_compact_state(repository):
    data = json.loads((repository / "models" / "umbrellas" / "dome.json").read_text())
    design = design_from_dict(data | {"plate_model": "rigid", "arm_elements": 1})
    equilibria = design.deploy()
    x = [eq.state.positions[design.joints] for eq in opening_path(design, equilibria, 4)]
    assert len(x) == 4
    heights = [np.linalg.svd(y - y.mean(axis=0))[1][2] for y in x]
    assert heights[-1] < 1e-2 * heights[0]  # the stack is flat
    steps = np.abs(np.diff([equilibria["deployed"].state.positions[design.joints], *x], axis=0))
    assert steps.max() < 0.5 * design.target.size  # it stays where it is held
    page = design_scene(design, equilibria, frames=4)
    frames = [s for s in page.designs[0].states if not s.final]
    assert len(frames) == 4 and all(s.opening is None for s in frames)


def test_a_single_design_without_parts(result):
    scene = design_scene(result.designs[0], result.references[0].equilibria)
    data = scene_data(scene)
    assert (
        data["parts"] == []
        and "part" not in data["colourings"]
        and "utilisation" in data["colourings"]
    )
    assert (decoded(data["designs"][0]["rods"]["deployed"]["part"]) == -1).all()


# -- in a browser ------------------------------------------------------------------------------
browser = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


def run_chromium(page, tmp_path, *options, budget=3000):
    """budget : ms of the page's own time, which goes by at once; None: real time."""
    limit = [] if budget is None else [f"--virtual-time-budget={budget}"]
    return subprocess.run(
        [
            CHROMIUM,
            "--headless",
            "--no-sandbox",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--disable-background-networking",
            "--window-size=900,600",
            f"--user-data-dir={tmp_path / 'profile'}",
            *limit,
            *options,
            page,
        ],
        capture_output=True,
        text=True,
        timeout=600,
    )


@browser
def test_page_draws_in_chromium(kit_page, tmp_path):
    path = save_viewer(tmp_path / "view.html", kit_page)
    assert path.stat().st_size < 2e6
    done = run_chromium(
        f"{path.as_uri()}#design=0&stage=assigned&role=deployed&colour=part&target=0",
        tmp_path,
        "--dump-dom",
    )
    assert 'data-ready="1"' in done.stdout and "data-failed" not in done.stdout
    assert "Content Security Policy" not in done.stderr
    for piece in ("<b>flat</b>", ">L2</button>", "angular parts"):
        assert piece in done.stdout


@browser
@pytest.mark.parametrize("utilisation", [0.9, 1.3])
def test_sizes_labels_and_what_is_stressed_too_much(tmp_path, utilisation):
    """A scale bar in the scene's unit, axes, labels of the parts where asked for; red only where
    the elastic limit is passed."""
    plain = plain_scene()
    state = two_rods(utilisation=utilisation)
    design = replace(plain.designs[0], states=[state])
    scene = replace(plain, designs=[design], unit="mm")
    page = save_viewer(tmp_path / "page.html", scene)

    def shown(labels: int) -> str:
        address = f"{page.as_uri()}#labels={labels}"
        return run_chromium(address, tmp_path, "--dump-dom").stdout.split('id="message"')[0]

    with_labels = shown(1)
    assert re.search(r'class="scale-bar"[^>]*>[\d.]+ mm<', with_labels)
    assert with_labels.split('id="overlay"')[1].count("<line ") == 3
    assert re.findall(r'class="part-label"[^>]*>(\w+)<', with_labels)
    assert ("beyond the elastic limit" in with_labels) == (utilisation > 1)
    assert "part-label" not in shown(0).split('id="overlay"')[1]


@browser
def test_picture_has_the_parts_colours(kit_page, tmp_path):
    """Rods of one part coloured, the others pale; all coloured by value in the scale's colours."""
    from matplotlib.image import imread

    path = save_viewer(tmp_path / "view.html", kit_page)
    pictures = {}
    for view in ("part=L1&colour=part", "colour=deviation"):
        run_chromium(
            f"{path.as_uri()}#design=0&target=0&{view}",
            tmp_path,
            f"--screenshot={tmp_path / 'view.png'}",
        )
        pictures[view] = imread(tmp_path / "view.png")[60:, 300:, :3].reshape(-1, 3)
    for view, pixels in pictures.items():
        drawn = pixels[np.ptp(pixels, axis=1) > 0.25]
        assert len(drawn) > 300, view
    hue = pictures["part=L1&colour=part"]
    hue = hue[np.ptp(hue, axis=1) > 0.25]
    colour = np.array(next(p.colour for p in kit_page.parts if p.label == "L1"))
    alike = (hue - hue.mean(axis=1, keepdims=True)) @ (colour - colour.mean())
    assert (alike > 0).mean() > 0.95


@browser
def test_a_click_highlights_the_part(kit_page, tmp_path):
    """Clicks all over the drawing until one meets a rod; the label of its part is pressed then."""
    clicks = """<script>addEventListener("load", () => setTimeout(() => {
      const canvas = document.getElementById("canvas"), box = canvas.getBoundingClientRect();
      const found = new Set();
      for (let y = 40; y < box.height && found.size < 3; y += 23) for (let x = 20; x < box.width && found.size < 3; x += 31) {
        for (const name of ["pointerdown", "pointerup"])
          canvas.dispatchEvent(new PointerEvent(
            name, {pointerId: 1, button: 0, clientX: box.left + x, clientY: box.top + y}));
        const part = new URLSearchParams(location.hash.slice(1)).get("part");
        const pressed = document.querySelector("#legend button[aria-pressed=true]");
        if (part) found.add(part + "/" + (pressed ? pressed.textContent : "none"));
      }
      document.body.dataset.found = [...found].sort().join(" ");
    }, 300));</script>"""  # noqa: E501  # a command on one line can be copied
    page = re.sub(r"<meta http-equiv=.*?>", "", viewer_page(kit_page)).replace(
        "</body>", clicks + "</body>"
    )
    # only real pointers can be captured
    page = page.replace("canvas.setPointerCapture(e.pointerId);", "")
    path = tmp_path / "clicked.html"
    path.write_text(page, encoding="utf-8")
    for _ in range(3):  # on a busy machine the browser may be asked before its first frame is drawn
        done = run_chromium(f"{path.as_uri()}#design=-1&role=rest", tmp_path, "--dump-dom")
        match = re.search(r'data-found="([^"]*)"', done.stdout)
        found = match.group(1).split() if match else []
        if len(found) >= 3:
            break
    assert len(found) >= 3 and set(found) <= {f"{p.label}/{p.label}" for p in kit_page.parts}


@browser
def test_the_slider_opens_the_designs(kit_page, tmp_path):
    """Moved to three openings, it says so, redraws, and keeps the opening in the address."""
    moves = """<script>addEventListener("load", () => setTimeout(() => {
      const slider = document.getElementById("opening"), found = [];
      for (const value of ["0", "0.25", "1"]) {
        slider.value = value;
        slider.dispatchEvent(new Event("input"));
        found.push([document.getElementById("opening-value").textContent,
                    new URLSearchParams(location.hash.slice(1)).get("opening")]);
      }
      document.body.dataset.found = JSON.stringify(found);
    }, 300));</script>"""
    page = re.sub(r"<meta http-equiv=.*?>", "", viewer_page(kit_page)).replace(
        "</body>", moves + "</body>"
    )
    path = tmp_path / "moved.html"
    path.write_text(page, encoding="utf-8")
    done = run_chromium(f"{path.as_uri()}#design=0&role=deployed", tmp_path, "--dump-dom")
    found = json.loads(unescape(re.search(r'data-found="([^"]*)"', done.stdout).group(1)))
    openings = [
        state.opening
        for state in kit_page.designs[0].states
        if (state.stage, state.role) == ("assigned", "deployed")
    ]
    first, last = np.degrees(openings[-1]), np.degrees(openings[0])
    shown = [float(text.rstrip("°")) for text, _ in found]
    assert shown == pytest.approx([first, first + 0.25 * (last - first), last], abs=0.06)
    assert [address for _, address in found] == ["0", "0.25", "1"]


@browser
def test_pictures_follow_the_slider(kit_page, tmp_path):
    """A design that is half closed covers other pixels."""
    from matplotlib.image import imread

    path = save_viewer(tmp_path / "view.html", kit_page)
    covered = []
    for opening in ("0", "1"):
        run_chromium(
            f"{path.as_uri()}#design=0&role=deployed&target=0&opening={opening}",
            tmp_path,
            f"--screenshot={tmp_path / 'view.png'}",
        )
        pixels = imread(tmp_path / "view.png")[60:, 300:, :3]
        covered.append(np.ptp(pixels, axis=2) > 0.25)
    assert min(c.sum() for c in covered) > 300
    assert (covered[0] & covered[1]).sum() < 0.6 * covered[0].sum()


@browser
def test_five_designs_of_full_size_load(repository, tmp_path):
    """As a run of five C-shells leaves them: five stages, eight states on the way to the
    opening."""
    designs = []
    for design in load_designs(repository / "models" / "conformals", 5):
        drawn = design_scene(design, design.deploy(), frames=8).designs[0]
        stages = ViewerScene("", ()).stages
        states = [
            replace(s, stage=stage)
            for stage in stages
            for s in drawn.states
            if s.final or stage == stages[-1]
        ]
        designs.append(replace(drawn, states=states))
    path = save_viewer(tmp_path / "five.html", ViewerScene("Five designs", designs))
    assert 3e6 < path.stat().st_size < 1e7
    done = run_chromium(path.as_uri(), tmp_path, "--dump-dom")
    assert "data-failed" not in done.stdout
    assert re.search(r'data-first-frame="\d+"', done.stdout)
