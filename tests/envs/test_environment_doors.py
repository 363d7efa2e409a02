"""What a user can get wrong at the doors of an environment, and odd requests that have to work."""

import numpy as np
import pytest

from pushplan.envs import PushEnv
from pushplan.envs.simulators.base import Materials
from pushplan.envs.simulators.pymunk_simulator import PymunkSimulator
from pushplan.scenarios import IceField, save_ice
from pushplan.world import (
    GoalDisc,
    InvalidInputError,
    Movables,
    PushplanError,
    StaticMap,
    Twist,
    World,
    maze_robot,
)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"preset": []}, "unknown preset of box_delivery"),
        ({"preset": 3}, "valid: benchmark, original, testbed"),
        ({"action": 3}, "unknown action"),
        ({"observation": 3}, "valid: image, lidar, spatial, state"),
        ({"variations": 5}, "variations must be a mapping, got 5"),
        ({"seed": "a"}, "seed must be a whole number, got 'a'"),
        ({"seed": -1}, "seed must be at least 0"),
        ({"variations": {"box_size": 1e-9}}, "box_size must be at least 0.0044 m"),
    ],
)
def test_wrong_arguments_are_one_clear_error(wrong, text):
    with pytest.raises(PushplanError, match=text):
        PushEnv(task="box_delivery", **wrong)


def test_areas_refuse_boxes_too_small_to_look_for_gaps_with():
    with pytest.raises(PushplanError, match=r"box_size must be at least 0\.01 m"):
        PushEnv(task="area_clearing", variations={"box_size": 1e-9})


@pytest.mark.parametrize("wrong", [{"seed": 1.5}, {"seed": -1}, {"options": 3}])
def test_wrong_resets_are_one_clear_error(wrong):
    with pytest.raises(InvalidInputError, match=r"seed must be|knows no options"):
        PushEnv(task="maze").reset(**wrong)


def test_numpy_seeds_are_seeds():
    env = PushEnv(task="maze", observation="state")
    first, _ = env.reset(seed=np.int64(3))
    assert (env.reset(seed=3)[0] == first).all()


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan, np.inf])
def test_time_goes_on(duration):
    world = World(
        robot=maze_robot(),
        robot_pose=[0.0, 0.0, 0.0],
        static=StaticMap.build(bounds=(-5, -5, 5, 5)),
        movables=Movables.empty(),
        goal=GoalDisc([4, 4], 0.5),
    )
    simulator = PymunkSimulator()
    simulator.build(world, Materials())
    with pytest.raises(InvalidInputError, match="duration must"):
        simulator.step(Twist(0.1, 0.0), duration)


@pytest.mark.parametrize("wrong", [{"water": 3}, {"solids": "x"}])
def test_materials_are_checked(wrong):
    with pytest.raises(
        InvalidInputError, match=r"materials\.(water must be a Water|solids must be a Solids), got"
    ):
        Materials(**wrong)


def test_a_speck_of_ice_does_not_stop_the_clock(tmp_path):
    speck = 1e-8
    floe = [[5.0, 5.0], [5.6, 5.0], [5.6, 5.6], [5.0, 5.6]]
    dust = [[6.0, 2.2], [6.0 + speck, 2.2], [6.0, 2.2 + speck]]
    path = tmp_path / "ice.json"
    save_ice(IceField([floe, dust], (0.0, 0.0, 12.0, 40.0)), path)
    env = PushEnv(task="ship_ice", variations={"ice_file": str(path), "start_x": 6.0})
    env.reset(seed=0)
    for _ in range(5):
        assert np.isfinite(env.step([0.0])[1])
