"""Starts of the task namo: closed at first, and opened by the stored opening."""

from __future__ import annotations

import numpy as np
import pytest

from pushplan.envs import make
from pushplan.envs.tasks.namo import LAYOUTS, NamoTask, Opening, proves
from pushplan.scenarios import Scenario, suite, suite_names
from pushplan.world import ScenarioError, UnknownNameError, stream

PRESETS = ("benchmark", "testbed")


def task(preset: str = "benchmark", **variations: object) -> NamoTask:
    return NamoTask(preset=preset, variations=variations)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("preset", PRESETS)
def test_starts_are_closed_and_the_opening_opens_them(preset: str, layout: str) -> None:
    namo = task(preset, layout=layout)
    for seed in range(1):
        world = namo.start(stream(seed, "layout"))
        assert world == namo.start(stream(seed, "layout"))
        assert namo.opening and proves(world, namo.opening)
        assert not proves(world, namo.opening[:-1])  # every step is needed, or the way is closed
        moved = {box for step in namo.opening for box in step.boxes}
        assert not world.movables.fixed[list(moved)].any()


def test_a_proof_needs_room() -> None:
    namo = task(layout="one_box")
    world = namo.start(stream(0, "layout"))
    box = namo.opening[0].boxes
    assert not proves(world, [Opening(box, (0.3, 0.0))])  # not far enough
    assert not proves(world, [Opening(box, (0.0, 3.0))])  # through a wall
    open_already = world.moved(movable_poses=world.movables.poses + np.array([3.5, 0.0, 0.0]))
    assert not proves(open_already, [])


def test_what_a_policy_is_told_and_what_holds() -> None:
    told = {}
    for movability in ("known", "unknown", "wrong"):
        variations = {"layout": "fixed", "movability": movability}
        env = make(Scenario("namo", variations=variations, seed=3), observation="state")
        env.reset(seed=3)
        told[movability] = env.world.movables.fixed
        np.testing.assert_array_equal(env.true_world.movables.fixed, told["known"])
    assert told["known"].sum() == 1 and not told["unknown"].any()
    np.testing.assert_array_equal(told["wrong"], ~told["known"])


@pytest.mark.parametrize("simulator", ["pymunk", "mujoco"])
def test_a_fixed_box_stops_the_robot_and_does_not_move(simulator: str) -> None:
    preset = "benchmark" if simulator == "pymunk" else "testbed"
    env = make(
        Scenario("namo", simulator, preset, {"layout": "fixed"}, 5),
        observation="state",
        action="velocity",
    )
    env.reset(seed=5)
    world = env.true_world
    k = int(np.argmax(world.movables.fixed))
    before = world.movables.poses[k]
    unit = env.task.unit
    start = world.moved(robot_pose=[before[0] - 1.6 * unit, before[1], 0.0])
    env._simulator.build(start, env.task.materials)
    held = False
    for _ in range(40):
        _, _, over, _, info = env.step(env.action_space.high * [1.0, 0.0])
        held = held or info["held"]
        assert not over  # it is no wall
    np.testing.assert_allclose(env.true_world.movables.poses[k], before, atol=2e-3 * unit)
    assert held and env.true_world.robot_pose[0] < before[0] - 0.8 * unit


def test_wrong_variations_are_named() -> None:
    with pytest.raises(ScenarioError, match=r"layout must be one of|layout"):
        task(layout="maze")
    with pytest.raises(UnknownNameError, match="boxes"):
        task(boxes=3)
    with pytest.raises(ScenarioError, match="another size"):
        task(layout="one_box", box_size=2.5).start(stream(0, "layout"))


def test_every_layout_has_its_suites() -> None:
    for dimension in ("2d", "3d"):
        names = [name for name in suite_names() if name.startswith(f"namo-{dimension}-")]
        starts = [scenario for name in names for scenario in suite(name, episodes=3).scenarios]
        assert {scenario.variations["layout"] for scenario in starts} == set(LAYOUTS)
