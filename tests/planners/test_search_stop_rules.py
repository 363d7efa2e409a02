"""Every planner keeps every stop rule, and a call is the same in another process."""

import hashlib
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import make_u_maze, scattered_boxes, solved_by
from ice_scenes import channel

from pushplan.motion import time_slicing
from pushplan.planners import make_planner, planner_names
from pushplan.planners.registry import PLANNERS
from pushplan.world import (
    Cancellation,
    Deadline,
    FirstSolution,
    MaxIterations,
    PlanStatus,
    World,
)

MAZE = ("straight", "geometric-rrt", "kinodynamic-rrt", "push-aware", "namo")
SHIP = tuple(name for name in planner_names() if name not in MAZE)
ONE_SHOT = ("straight", "skeleton")
"""They look for one path, all at once, and return it."""
LIMIT = 60
"""Iterations of calls that are compared."""


def start(name: str) -> World:
    """Three boxes in the maze, or a field of floes before the ship."""
    if name in MAZE:
        return make_u_maze(scattered_boxes(3, seed=2))
    rng = np.random.default_rng(5)
    square = np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
    at = [(x, y) for x in np.arange(-5.5, 5.6, 1.1) for y in np.arange(1.7, 9.0, 1.1)]
    return channel(
        [(square, [*(place + rng.uniform(-0.25, 0.25, 2)), rng.uniform(0, 6)]) for place in at]
    )


def digest(name: str, limit: int = LIMIT) -> str:
    """What a plan consists of, in one line."""
    result = make_planner(name).plan(
        start(name), stop=MaxIterations(limit), rng=np.random.default_rng(7)
    )
    found = hashlib.sha256(result.status.label.encode())
    if result.plan is not None:
        plan = result.plan
        for part in (plan.times, plan.poses, plan.speeds, plan.turn_rates, plan.object_poses):
            found.update(b"-" if part is None else part.tobytes())
    return f"{name} {result.status.label} {found.hexdigest()}"


def test_all_planners_are_here():
    assert {*MAZE, *SHIP} == set(PLANNERS)


@pytest.mark.parametrize("name", planner_names())
class TestEveryPlanner:
    def test_the_same_iterations_give_the_same_bytes(self, name):
        assert digest(name) == digest(name)

    def test_more_iterations_are_not_fewer_plans(self, name):
        found = [
            make_planner(name)
            .plan(start(name), stop=MaxIterations(limit), rng=np.random.default_rng(7))
            .plan
            is not None
            for limit in (0, 3, 30, 600)
        ]
        assert found == sorted(found)
        assert found[-1]

    @pytest.mark.usefixtures("cpu_time")
    def test_a_deadline_ends_the_call(self, name):
        began = time.perf_counter()
        result = make_planner(name).plan(start(name), stop=Deadline(0.05))
        took = time.perf_counter() - began
        others = (PlanStatus.APPROXIMATE, PlanStatus.TIMED_OUT)
        assert result.status in (*solved_by(name), *others)
        if name not in ONE_SHOT:
            assert took < 0.15

    def test_no_time_is_no_crash(self, name):
        result = make_planner(name).plan(start(name), stop=Deadline(0.0))
        assert (result.plan is not None) == result.status.has_plan

    def test_the_first_solution_is_enough(self, name):
        planner, world = make_planner(name), start(name)
        first = planner.plan(
            world, stop=FirstSolution() | MaxIterations(20_000), rng=np.random.default_rng(7)
        )
        assert first.plan is not None
        whole = planner.plan(world, rng=np.random.default_rng(7))
        assert first.stats.iterations <= max(whole.stats.iterations, 1)

    def test_another_thread_cancels(self, name):
        token = Cancellation()
        timer = threading.Timer(0.05, token.cancel)
        timer.start()
        planner, world = make_planner(name), start(name)
        result = planner.plan(world, stop=token | MaxIterations(10**9))
        timer.join()
        assert (result.plan is not None) == result.status.has_plan
        again = planner.plan(world, stop=token)
        if name not in ONE_SHOT[:1]:
            assert again.status is PlanStatus.CANCELLED and again.plan is None

    def test_a_rule_may_be_used_again(self, name):
        rule = MaxIterations(200)
        planner, world = make_planner(name), start(name)
        plans = [planner.plan(world, stop=rule, rng=np.random.default_rng(3)) for _ in range(2)]
        assert plans[0].plan == plans[1].plan


@pytest.mark.parametrize("limit", [*range(0, 12, 3), 37, 211])
@pytest.mark.parametrize("name", ["kinodynamic-rrt", "push-aware"])
def test_where_the_clock_cuts_changes_nothing(name, limit, monkeypatch):
    made = []
    for piece_s in (1e-9, 1e-4, 1e3):
        monkeypatch.setattr(time_slicing, "_PIECE_S", piece_s)
        made.append(digest(name, limit))
    assert len(set(made)) == 1


def test_no_piece_is_begun_after_a_stop():
    """One may be, and one may not, would let the length of pieces decide what is found."""
    assert list(time_slicing.Pace().pieces(10, lambda: True)) == []
    pieces = list(time_slicing.Pace().pieces(10, lambda: False))
    assert [k for first, last in pieces for k in range(first, last)] == list(range(10))


@pytest.mark.slow
def test_another_process_gives_the_same_bytes(request):
    code = (
        "import sys; sys.path[:0] = sys.argv[1:]; import test_search_stop_rules as t\n"
        "print('\\n'.join(t.digest(name) for name in t.planner_names()))"
    )
    tests = request.path.parents[1]
    folders = [str(tests), str(tests / "planners"), str(tests / "interaction")]
    made = subprocess.run(
        [sys.executable, "-c", code, *folders], capture_output=True, text=True, check=True
    )
    assert made.stdout.splitlines() == [digest(name) for name in planner_names()]
