"""Decisions of `gtsp-mpc` with a time limit: they end in time, and go on where they were left."""

import itertools
import math
import time
from dataclasses import replace

import numpy as np
import pytest
from test_rearrangement import AREA, scene

from pushplan.planners.rearrangement import GtspMpc, build_push_graph, push_order
from pushplan.planners.rearrangement.approach import approach_tree
from pushplan.planners.rearrangement.push_choice import select_push
from pushplan.planners.rearrangement.push_graph import reduce_to_gtsp
from pushplan.planners.rearrangement.relocation_search import RelocationSearch
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.world import ClearanceArea, Deadline, MaxIterations

BOXES = [(-1.0, 1.0, 0.3), (0.5, -0.5, 0.0), (1.5, 2.0, 0.8), (2.4, -1.0, 0.0)]


@pytest.fixture
def ticks(monkeypatch):
    """A clock that goes on by a millisecond at each look."""
    looks = itertools.count()
    monkeypatch.setattr(time, "perf_counter", lambda: 1e-3 * next(looks))
    return looks


def area():
    return scene(BOXES, ClearanceArea(AREA, [True] * 4))


def test_an_interrupted_decision_that_goes_on_ends_as_one_without_a_limit(ticks):
    whole = select_push(area())
    here = area()
    calls = 0
    while calls == 0 or here.budget.interrupted:
        before = next(ticks)
        here.budget.start(Deadline(0.06), math.inf, found=calls > 0)
        choice = select_push(here)
        assert next(ticks) - before < 60 + 40  # estimates and orders look at no clock

        calls += 1
        assert calls < 100
    assert calls > 3
    assert choice.first.cost == whole.first.cost
    assert np.array_equal(choice.first.push.poses, whole.first.push.poses)
    assert np.array_equal(choice.graph.costs, whole.graph.costs)


def test_a_first_push_is_found_long_before_all_of_them_are_simulated(ticks):
    here = area()
    here.budget.start(Deadline(0.1), math.inf)
    choice = select_push(here)
    assert choice.first is not None and here.budget.interrupted
    whole = area()
    select_push(whole)
    assert here.budget.used < 0.6 * whole.budget.used


@pytest.mark.slow
def test_a_search_for_relocations_goes_on_where_it_was_interrupted():
    here = replace(scene([(0.0, -4.49, 0.0)]), cache=RolloutCache())
    whole = RelocationSearch(here, 0, approach_tree(here), False).run()
    search = RelocationSearch(here, 0, approach_tree(here), False)
    calls = 0
    while search.interrupted:
        here.budget.start(MaxIterations(400), math.inf)
        found = search.run()
        calls += 1
        assert calls < 1000
    assert calls > 2
    for one, other in zip(whole, found, strict=True):
        assert np.array_equal(one[0], other[0]) and one[1] == other[1]


@pytest.mark.parametrize("pause", [0.0, 1.0])
def test_the_robot_stands_for_a_while_where_better_pushes_may_be_found(ticks, pause):
    world = area().world
    policy = GtspMpc(stop=Deadline(0.06), max_pause=pause)
    policy.reset(world, np.random.default_rng(0))
    first = next(
        step
        for step in range(40)
        if policy.act(replace(world, time=0.1 * step)).linear != 0.0
        or policy.current_plan is not None
    )
    assert policy.plan
    assert (first == 0) if pause == 0.0 else (0 < first <= 10)


def test_an_order_of_pushes_is_a_tour_of_the_reduced_problem():
    rng = np.random.default_rng(5)
    for _ in range(50):
        count = int(rng.integers(2, 8))
        masks = rng.integers(1, 16, count)
        costs = rng.random((count + 1, count))
        reduced = reduce_to_gtsp(costs, masks.tolist(), 4)
        order = rng.permutation(count).tolist()
        nodes = reduced.tour(order)
        if np.bitwise_or.reduce(masks) != 15:
            assert nodes is None
            continue
        made = reduced.order(nodes)
        assert made == [n for n in order if n in made]
        owners = [
            c for node in nodes for c, members in enumerate(reduced.clusters) if node in members
        ]
        assert sorted(owners) == list(range(5))


def test_a_search_with_a_time_limit_begins_with_an_order_that_is_known():
    boxes = [(x, y, 0.0) for x in (-2.2, -0.7, 0.8, 2.3) for y in (-2.2, -0.4, 1.4)]
    graph = build_push_graph(scene(boxes, ClearanceArea(AREA, [True] * 4), per_object=2))
    order, cost = push_order(graph, iterations=300)
    again, warm = push_order(graph, stop=Deadline(0.0), initial=order)
    assert warm <= cost and again == order
