"""Outlines of tens of thousands of corners: plans are made of few, and stop rules are kept."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pytest
import shapely
from conftest import SQUARE

from pushplan.planners import make_planner, planner_names
from pushplan.world import Deadline, GoalDisc, Movables, StaticMap, World
from pushplan.world.outline import enclosing_outline
from pushplan.world.stored.robots import jackal

MANY = 30_000
WALLS = [[0, 0, 20, 0], [20, 0, 20, 20], [20, 20, 0, 20], [0, 20, 0, 0]]


def circle(corners: int, radius: float = 3.0) -> np.ndarray:
    angles = np.arange(corners) * 2.0 * np.pi / corners
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def room(kind: str, radius: float) -> World:
    """A pillar, or an object like it, between the robot and its goal."""
    pillar = circle(MANY, radius)
    outlines, poses, pillars = [SQUARE], [[13.0, 4.0, 0.3]], []
    if kind == "pillar":
        pillars.append(pillar + 10.0)
    else:
        outlines.append(pillar)
        poses.append([10.0, 10.0, 0.0])
    static = StaticMap.build(pillars, WALLS, 0.05)
    goal = GoalDisc([17.0, 10.0], 0.5)
    return World(jackal(), [3, 10, 0.0], static, Movables.from_outlines(outlines, poses), goal)


@pytest.mark.usefixtures("cpu_time")
@pytest.mark.parametrize("kind", ["pillar", "object"])
@pytest.mark.parametrize("name", [n for n in planner_names() if not n.startswith("ship")])
def test_a_deadline_ends_the_call(name: str, kind: str) -> None:
    planner = make_planner(name)
    for deadline, radius in ((0.05, 3.0), (0.3, 3.1)):  # nothing is cached for either
        world = room(kind, radius)
        began = time.process_time()
        planner.plan(world, stop=Deadline(deadline))
        assert time.process_time() - began < deadline + 0.3


def test_what_a_process_does_once_is_not_done_in_a_call_of_namo() -> None:
    code = "import sys; from pushplan.planners import make_planner; make_planner('namo'); "
    code += "assert 'scipy.ndimage' in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("corners", [1001, 1500, MANY])
@pytest.mark.parametrize("stretched", [1.0, 0.1])
def test_fewer_corners_are_around_all(corners: int, stretched: float) -> None:
    rng = np.random.default_rng(corners)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    round_one = np.column_stack([np.cos(angles), np.sin(angles)])
    half = circle(2 * corners, 1.0)[: corners + 1]  # and a long straight side
    for outline in (circle(corners), round_one * [1.0, stretched], half):
        few = enclosing_outline(outline)
        before, after = shapely.Polygon(outline), shapely.Polygon(few)
        assert len(few) == 1000 and after.is_valid
        assert after.convex_hull.area == pytest.approx(after.area, rel=1e-12)
        assert before.difference(after).area < 1e-12 * before.area
        assert after.area < (1.0 + 1e-4) * before.area
        assert StaticMap.build([few]).polygons[0].shape == (1000, 2)


def test_what_has_few_corners_is_taken_as_it_is() -> None:
    outline = circle(1000)
    assert enclosing_outline(outline) is outline
    static = StaticMap.build([outline])
    world = World(jackal(), [9, 9, 0.0], static, Movables.empty(), GoalDisc([9.0, 0.0], 0.5))
    assert world.for_planning() is world


def test_an_object_of_many_corners_stays_the_same_object() -> None:
    world = room("object", 2.0)
    few, whole = world.for_planning().movables, world.movables
    assert len(few.outline(1)) == 1000 and len(few.outline(0)) == 4
    for name in ("ids", "poses", "masses", "fixed", "contact_radii"):
        assert getattr(few, name).tolist() == getattr(whole, name).tolist()
    moved = world.moved(movable_poses=whole.poses + 1.0)
    assert moved.for_planning().movables.poses.tolist() == (whole.poses + 1.0).tolist()
    fixed = World(
        world.robot, world.robot_pose, world.static, whole.holding_fixed([False, True]), world.goal
    )
    assert max(map(len, fixed.for_planning().static.polygons)) == 1000
