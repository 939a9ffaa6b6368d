"""Other parts for elements: never worse under the model, best for every single element, better
designs in the end."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from support.settings import QUICK

from kop_exudyn.kit.kinds import part_kind
from kop_exudyn.kit.reuse import PieceCount
from kop_exudyn.kit.stock import Stock
from kop_exudyn.search import assigned as rounds
from kop_exudyn.search import descent
from kop_exudyn.search.assigned import assigned_stage
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.opening import opened_stage
from kop_exudyn.search.path import to_parts
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.problems import AssignedProblem
from kop_exudyn.search.reassign import LocalModel, keep_parts, reassign
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights
from kop_exudyn.sqp.constraints import on_elements
from kop_exudyn.structures.base import design_from_dict

PARTS = {"linear": 5, "angular": 3}


def shells(data):
    """Two small C-shells whose curves stand at different distances."""
    found = []
    for name, places in (("even", (0.0, 0.7, 1.4, 2.1)), ("uneven", (0.0, 0.6, 1.5, 2.0))):
        own = copy.deepcopy(data) | {"name": name}
        lines = [[[-0.2, y], [1.0, y + 0.15], [2.3, y]] for y in places]
        lines += [[[x, -0.2], [x + 0.1, 1.0], [x, 2.4]] for x in places]
        own["curves"] = [{"type": "spline", "points": points} for points in lines]
        found.append(design_from_dict(own, name))
    return found


@pytest.fixture(scope="module")
def stages():
    data = {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "c_shell",
        "name": "grid",
        "material": {"young": 2100.0, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.02, "height": 0.01},
        "curves": [],
        "crossings": "find",
        "free_ends": False,
        "rod_offset": 0.0,
        "opening": {"angle": 0.6, "side": "up"},
        "elements_per_piece": 2,
    }
    with DesignPool(shells(data), 1) as pool:
        pool.prepare()
        yield Stages(Dataset.of_pool(pool, Weights()), PARTS, StageSettings(schedule=(1e3, 1e5)))


@pytest.fixture(scope="module")
def direct(stages):
    return stages.direct()


@pytest.fixture(scope="module")
def derivatives(stages, direct):
    return stages.dataset.derivatives(direct.designs, hessian=True)


def model_at(stages, derivatives, damping):
    dataset = stages.dataset
    return LocalModel.of(
        derivatives, dataset.design_weights, dataset.split(dataset.scales()), damping
    )


def test_model_is_the_second_order_expansion(stages, direct, derivatives):
    model = model_at(stages, derivatives, 0.0)
    rng = np.random.default_rng(0)
    step = [rng.normal(size=len(q)) for q in model.base]
    values = model.values([q + s for q, s in zip(model.base, step)])
    for value, s, d in zip(values, step, derivatives):
        assert value == pytest.approx(s @ d.gradient + 0.5 * s @ d.hessian @ s)
    slopes = model.slopes([q + s for q, s in zip(model.base, step)])
    for slope, s, d in zip(slopes, step, derivatives):
        np.testing.assert_allclose(
            slope, d.gradient + d.hessian @ s, rtol=1e-10, atol=1e-12 * abs(slope).max()
        )


def test_a_stock_is_kept_to_and_used(stages, direct, derivatives, monkeypatch):
    """With few pieces the model still falls, by exchanges and by what is left; compiled or not."""
    model = model_at(stages, derivatives, 1e-4)
    pieces = direct.assignment.pieces(direct.kit)
    counts = {kind: own + (np.arange(len(own)) == 0) for kind, own in pieces.items()}
    for together in (False, True):
        # each design what it has, or both together what they have: one piece more of the first part
        stock = Stock(direct.kit, counts, together)
        problem = AssignedProblem(stages.dataset, direct.kit, direct.assignment, stock=stock)
        found = reassign(problem, model, move_parts=keep_parts)
        assert found.changes > 0 and found.predicted.sum() < 0
        for kind, used in found.assignment.pieces(found.kit).items():
            assert np.all(used <= counts[kind]) or not together
        monkeypatch.setattr(descent, "library", lambda: None)
        again = reassign(problem, model, move_parts=keep_parts)
        assert again.assignment.changes(found.assignment) == 0
        monkeypatch.undo()
    free = reassign(stages.assigned_problem(direct, range(2)), model, move_parts=keep_parts)
    assert free.predicted.sum() <= found.predicted.sum()


def test_exchanges_alone_leave_every_design_its_pieces(stages, direct, derivatives):
    model = model_at(stages, derivatives, 1e-4)
    stock = Stock(direct.kit, direct.assignment.pieces(direct.kit), True)
    problem = AssignedProblem(stages.dataset, direct.kit, direct.assignment, stock=stock)
    found = reassign(problem, model, move_parts=keep_parts)
    assert found.changes > 0 and found.predicted.sum() < 0
    for one, other in zip(found.assignment.part, direct.assignment.part):
        assert sorted(one) == sorted(other)
    q = found.assignment.matrix(found.kit) @ found.kit.vector
    reached = model.values(stages.dataset.split(q))
    np.testing.assert_allclose(reached, found.predicted, rtol=1e-9)


def test_no_element_gains_by_another_part(stages, direct, derivatives):
    model = model_at(stages, derivatives, 1e-4)
    problem = stages.assigned_problem(direct, range(2))
    found = reassign(problem, model)
    assert found.changes == found.assignment.changes(direct.assignment) > 0
    q = found.assignment.matrix(found.kit) @ found.kit.vector
    reached = model.values(stages.dataset.split(q)).sum()
    assert reached == pytest.approx(found.predicted.sum()) and reached < 0
    for group in problem.assignment.groups:
        ways = part_kind(group.kind).variants_of(group.indices.shape[1])
        for element in group.indices:
            for candidate in np.einsum("vek,mk->mve", ways.matrices, found.kit[group.kind]).reshape(
                -1, len(element)
            ):
                other = q.copy()
                other[element] = candidate
                assert model.values(stages.dataset.split(other)).sum() >= reached - 1e-9 * abs(
                    reached
                )


def test_parts_are_the_models_minimum(stages, direct, derivatives):
    model = model_at(stages, derivatives, 1e-4)
    found = reassign(stages.assigned_problem(direct, range(2)), model)
    matrix = found.assignment.matrix(found.kit)
    slope = matrix.T @ np.concatenate(model.slopes(stages.dataset.split(matrix @ found.kit.vector)))
    first = matrix.T @ np.concatenate(
        model.slopes(stages.dataset.split(np.concatenate(model.base)))
    )
    assert np.abs(slope).max() < 1e-3 * np.abs(first).max()


def test_frozen_designs_and_fixed_kits_stay(stages, direct, derivatives):
    model = model_at(stages, derivatives, 1e-4)
    problem = stages.assigned_problem(direct, range(2))
    found = reassign(problem, model, frozen=[0])
    own = len(stages.dataset.designs[0].groups)
    for old, new in zip(direct.assignment.part[:own], found.assignment.part[:own]):
        np.testing.assert_array_equal(old, new)
    fixed = reassign(problem, model, move_parts=keep_parts)
    np.testing.assert_array_equal(fixed.kit.vector, direct.kit.vector)
    assert reassign(problem, model, frozen=[0, 1]) is None


def test_rounds_only_improve(stages, direct):
    once = stages.assigned(direct)
    assert assigned_stage(stages, once).value <= once.value
    found = assigned_stage(stages, direct)
    assert found.value < 0.1 * direct.value
    for evaluation in found.designs:
        assert evaluation.confirmations["deployed"].moved < 1e-8
        assert evaluation.equilibria["deployed"].stable


def test_a_leap_is_kept_if_it_ends_lower_and_undone_otherwise(stages, direct, monkeypatch):
    low, high = sorted(
        [assigned_stage(leaping(stages, 0), direct), stages.assigned(direct)],
        key=lambda result: result.value,
    )
    assert low.value < 0.9 * high.value
    # rounds stay where they are
    monkeypatch.setattr(rounds, "_many_reassigned", lambda stages, best: best)
    monkeypatch.setattr(
        rounds,
        "_bold_trials",
        lambda stages, best: [low] if best.value > low.value else [],
    )
    kept = assigned_stage(leaping(stages, 3), high)
    assert kept.value <= low.value and kept.assignment.changes(low.assignment) == 0
    monkeypatch.setattr(rounds, "_bold_trials", lambda stages, best: [direct])
    undone = assigned_stage(leaping(stages, 1), low)
    assert undone.value <= low.value and undone.assignment.changes(low.assignment) == 0
    # the steps of leaps that are undone count, too
    assert undone.steps > assigned_stage(leaping(stages, 0), low).steps


def test_leaps_change_many_elements_at_once(stages, direct):
    found = rounds._bold_trials(stages, direct)
    values = [trial.value for trial in found]
    assert values and values == sorted(values)
    assert all(trial.assignment.changes(direct.assignment) >= 2 for trial in found)


def leaping(stages, leaps):
    return Stages(stages.dataset, PARTS, replace(stages.settings, leaps=leaps))


def test_rounds_with_a_fixed_kit_change_the_assignment_only(stages, direct):
    found = assigned_stage(Stages(stages.dataset, direct.kit, stages.settings), direct)
    np.testing.assert_array_equal(found.kit.vector, direct.kit.vector)
    assert found.value < direct.value and found.assignment.changes(direct.assignment) > 0


def test_redeployment_improves_what_designs_open_into(stages, direct):
    led = assigned_stage(stages, direct)
    settings = replace(stages.settings, redeployments=2)
    willing = Stages(stages.dataset, PARTS, settings)
    found = opened_stage(willing, led)

    def opened(result):
        return sum(outcome.value for outcome in stages.redeployed(result))

    assert opened(found) <= opened(led)
    assert found.assignment.changes(direct.assignment) > 0
    assert opened_stage(stages, led).kit is led.kit  # not asked for: nothing happens


def test_constraints_on_elements_hold_in_both_stages(stages):
    designs = stages.dataset.designs
    lengths = [d.groups[0].indices[0] for d in designs]

    def statement(q):
        """The first two lengths of both designs together keep their sum; one of them is given."""
        total = sum(float(d.parameters[k].sum()) for d, k in zip(designs, lengths))
        return [
            sum(q[d.name][int(i)] for d, k in zip(designs, lengths) for i in k) == total,
            q["even"][int(lengths[0][0])] == 1.02 * float(designs[0].parameters[lengths[0][0]]),
        ]

    constraints = on_elements(designs, statement)
    assert constraints.rows == 2
    settings = replace(
        QUICK,
        schedule=(1e3,),
        relaxed_steps=5,
        assigned_steps=5,
        round_steps=3,
        reassignments=1,
        leaps=0,
        redeployments=0,
        constraints=constraints,
    )
    outcome, free = (
        optimize_kit(designs, PARTS, settings=JobSettings(jobs=1, baselines=False, stages=own))
        for own in (settings, replace(settings, constraints=None))
    )
    scale = float(np.abs(constraints.upper).max())
    for stage in ("relaxed", "assigned"):
        q = np.concatenate([e.q for e in outcome.stages[stage].designs])
        assert constraints.violation(q) < 1e-7 * scale, stage
    q = np.concatenate([e.q for e in free.stages["assigned"].designs])
    assert constraints.violation(q) > 1e-3 * scale


def test_a_design_that_snaps_is_rescued_by_weight_then_by_parts(stages, direct, monkeypatch):
    """Every path seems to snap: w_c rises as often as allowed, then every kind gets one part more,
    as often."""
    from kop_exudyn.search import stages as module
    from kop_exudyn.search.stage_results import Jump

    monkeypatch.setattr(module, "find_jump", lambda design, *rest: Jump(design.name, 0.5, 0.1))
    settings = StageSettings(schedule=(1e3,), relaxed_steps=2, reassignments=0, rescues=1, growth=2)
    paper = Stages(stages.dataset, PARTS, settings)
    relaxed, at_parts = to_parts(paper, paper.relaxed(direct.kit))
    assert at_parts.kit.sizes == {kind: count + 2 for kind, count in PARTS.items()}
    assert len(relaxed.jumps) == 3 * 2 and len(at_parts.jumps) == 2
    assert np.isfinite(at_parts.value)


def test_pieces_that_cost_are_saved(stages, direct, derivatives):
    """The model rises by less than the pieces cost that are saved, and the dearer they are, the
    fewer are left."""
    plain = model_at(stages, derivatives, 1e-4)
    problem = stages.assigned_problem(direct, range(2))

    def pieces(assignment):
        return PieceCount(direct.kit, assignment, stages.dataset.group_designs).fabricated

    first = pieces(direct.assignment)
    left = [pieces(reassign(problem, plain, move_parts=keep_parts).assignment)]
    for cost in (0.01 * direct.value, direct.value):
        found = reassign(problem, replace(plain, piece_cost=cost), move_parts=keep_parts)
        left.append(pieces(found.assignment))
        assert found.predicted.sum() < cost * (first - left[-1])
    assert left[2] < left[0] and left == sorted(left, reverse=True)


def test_a_weight_on_pieces_changes_what_the_search_ends_in(stages, direct):
    few = Stages(stages.dataset, PARTS, replace(stages.settings, reuse=6.0, leaps=0))
    without = Stages(stages.dataset, PARTS, replace(stages.settings, leaps=0))
    ends = [assigned_stage(one, one.judged(direct)) for one in (without, few)]
    counts = [
        PieceCount(end.kit, end.assignment, stages.dataset.group_designs).fabricated for end in ends
    ]
    assert counts[1] < counts[0]
    assert ends[1].merit < ends[1].value and ends[0].merit == ends[0].value + ends[0].penalty
