"""One planner behind all doors: C++ gives the plans of Python, to the byte."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import make_u_maze, scattered_boxes
from random_worlds import DRIVES, SIDE, driven_world, posts

from pushplan.core import navigation as core
from pushplan.errors import InvalidInputError
from pushplan.motion.path_planner import core_world
from pushplan.planners import make_planner
from pushplan.scenarios import generate_office
from pushplan.world import (
    MaxIterations,
    PlanResult,
    PlanStatus,
    PriceMap,
    World,
    load_world,
    turtlebot3_burger,
)

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = ("room", "blocked_door", "office_map")
ITERATIONS = 100
STATUSES = {PlanStatus.TIMED_OUT: "NO_PLAN"}


def options(search: str, seed: float) -> core.PlannerOptions:
    """The parameters of Python's planner; those of push-aware are C++'s defaults."""
    made = core.PlannerOptions()
    made.search = core.SearchKind[search]
    made.seed = int(seed)
    if search == "kinodynamic":
        made.push_weight, made.margin, made.turn_fraction = 3.0, 0.06, 0.9
        made.set_contact(0.0, 0.0, 1.0, 0.1, 12)
    return made


def in_python(search: str, world: World, seed: int, iterations: int = ITERATIONS) -> PlanResult:
    name = {"kinodynamic": "kinodynamic-rrt", "push_aware": "push-aware"}[search]
    rng = np.random.default_rng(seed)
    return make_planner(name).plan(world, stop=MaxIterations(iterations), rng=rng)


def difference(search: str, world: World, seed: int, iterations: int = ITERATIONS) -> str:
    """What C++ does otherwise in the world that it reads from a file; empty if nothing."""
    wanted = in_python(search, world, seed, iterations)
    read = core.read_world(core_world(world.for_planning()).written())
    got = core.plan(read, options(search, wanted.stats.detail["seed"]), iterations)
    if got.status.name != STATUSES.get(wanted.status, wanted.status.name):
        return f"{wanted.status.name} in Python, {got.status.name} in C++ ({got.message})"
    if wanted.plan is None:
        return ""
    pairs = {name: (getattr(wanted.plan, name), getattr(got, name)) for name in SAME}
    pairs["objects"] = wanted.plan.object_poses, got.objects
    return " ".join(
        name
        for name, (ours, theirs) in pairs.items()
        if np.asarray(ours).tobytes() != np.asarray(theirs).tobytes()
    )


SAME = ("times", "poses", "speeds", "turn_rates", "travel_cost", "interaction_cost")


def any_world(seed: int) -> World:
    """Mazes, halls, and random rooms with every drive, goal, margin and price."""
    rng = np.random.default_rng([seed, 11])
    if seed % 10 == 0:
        return make_u_maze(scattered_boxes(int(rng.integers(0, 11)), seed))
    if seed % 50 == 1:
        return posts(60, seed)
    world = driven_world(seed)
    if seed % 3 == 0:
        world = replace(world, margin=float(rng.uniform(0.0, 0.3)))
    if seed % 4 == 0:
        origin = [*rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.2, 0.2)]
        world = replace(world, price=PriceMap(rng.exponential(1.0, (25, 20)), SIDE / 20, origin))
    return world


@pytest.mark.parametrize("search", ["kinodynamic", "push_aware"])
def test_a_world_from_a_file_has_the_plan_of_python_to_the_byte(search: str) -> None:
    found = {seed: difference(search, any_world(seed), seed) for seed in range(190)}
    assert not {seed: what for seed, what in found.items() if what}


@pytest.mark.parametrize("search", ["kinodynamic", "push_aware"])
def test_so_has_a_world_of_the_examples_and_an_office(search: str) -> None:
    worlds = {name: load_world(EXAMPLES / f"{name}.yaml") for name in FILES}
    for seed in (0, 1):
        rng = np.random.default_rng(seed)
        worlds[f"office {seed}"] = generate_office(rng, robot=turtlebot3_burger())
    found = {name: difference(search, world, 5) for name, world in worlds.items()}
    assert not {name: what for name, what in found.items() if what}


def test_random_worlds_are_of_every_kind_and_have_plans() -> None:
    worlds = [any_world(seed) for seed in range(190)]
    assert {one.robot.drive.value for one in worlds} == {kind["drive"] for kind in DRIVES}
    assert {type(one.goal).__name__ for one in worlds} == {"GoalDisc", "GoalPose", "GoalLine"}
    objects = [one.movables for one in worlds]
    assert any((np.diff(one.first_parts) > 1).any() for one in objects)
    assert any(one.static.radii.any() for one in worlds)
    planned = [in_python("kinodynamic", one, 0, 20).status.has_plan for one in worlds[:40]]
    assert sum(planned) > 10


def test_written_worlds_lose_nothing() -> None:
    for seed in range(40):
        text = core_world(any_world(seed).for_planning()).written()
        assert core.read_world(text).written() == text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("margin ", "margins "), "line 8: 'margins' is unknown here"),
        (("margin 0", "margin zero"), "line 8: 'zero' is no number"),
        (("margin 0", "margin inf"), "line 8: it needs finite numbers"),
        (("margin 0", "margin"), "line 8: it needs 1 numbers, got 0"),
        (("pose 1", "pose 1 1"), "line 3: it needs 3 numbers, got 4"),
        (("polygon 1 1", "polygon 1"), "line 6: it needs x and y of three corners or more, got 5"),
        (("robot 0", "robot 4"), "line 1: a drive is 0, 1, 2 or 3"),
        (("polygon", "outline"), "line 6: 'outline' is unknown here"),
    ],
)
def test_wrong_lines_are_named(change: tuple[str, str], message: str) -> None:
    text = (
        "robot 0 0 1 1 0 1 0 inf inf\npart -.1 -.1 .1 -.1 .1 .1 -.1 .1\npose 1 1 0\ntwist 0 0 0\n"
        "bounds 0 0 5 5\npolygon 1 1 2 1 2 2\ngoal 0 4 4 0.5 0 nan 0\nmargin 0\n"
    )
    assert core.read_world(text).written().startswith("robot 0 0 1 1 0 1 0 inf inf\n")
    with pytest.raises(InvalidInputError) as caught:
        core.read_world(text.replace(*change))
    assert str(caught.value).startswith(message)
