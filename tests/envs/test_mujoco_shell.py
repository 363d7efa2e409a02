"""What one sees of a robot in MuJoCo touches and weighs nothing."""

from __future__ import annotations

import numpy as np
import pytest
from mujoco_scenes import GROUND, JACKAL_GROUND, built, jackal, room, turtlebot

from pushplan.envs.push_env import PushEnv
from pushplan.envs.simulators import mujoco_model
from pushplan.world import Drive, RobotModel, Twist

BOXES = [(0.25, 0.0, 0.2), (0.34, 0.03, 0.0), (-0.5, 0.5, 0.1), (0.2, 0.3, 0.7)]
NARROW = RobotModel(
    (np.array([(-0.03, -0.04), (0.03, -0.04), (0.05, 0.0), (0.03, 0.04), (-0.03, 0.04)]),),
    1.0,
    Drive.DIFFERENTIAL,
    max_speed=0.2,
    max_turn_rate=2.0,
    wheel_separation=0.08,
)


def driven(robot: RobotModel, ground: object) -> list[bytes]:
    simulator = built(room(BOXES, robot=robot), ground)
    states = []
    for turn in (0.0, 0.8, -1.5, 3.0, 0.0):
        for _ in range(8):
            simulator.step(Twist(0.2, turn), 0.1)
        states.append(simulator.save())
    return [part.tobytes() if hasattr(part, "tobytes") else part for part in states]


@pytest.mark.parametrize(
    ("robot", "ground"), [(turtlebot(), GROUND), (jackal(), JACKAL_GROUND), (NARROW, GROUND)]
)
def test_the_shell_changes_no_bit_of_a_trajectory(monkeypatch, robot, ground):
    with_shell = driven(robot, ground)
    mujoco_model.scene_model.cache_clear()
    monkeypatch.setattr(mujoco_model, "add_shell", lambda *arguments: None)
    bare = driven(robot, ground)
    mujoco_model.scene_model.cache_clear()
    assert with_shell == bare
    assert len(set(bare)) == len(bare)  # it does drive


@pytest.mark.slow
def test_the_house_of_a_ship_changes_no_bit_of_a_trajectory(monkeypatch):
    def driven_ship() -> bytes:
        mujoco_model.scene_model.cache_clear()
        env = PushEnv(task="ship_ice", simulator="mujoco", variations={"concentration": 0.1})
        env.reset(seed=3)
        for _ in range(40):
            env.step([0.3])
        return env.world.robot_pose.tobytes() + env.world.movables.poses.tobytes()

    with_house = driven_ship()
    monkeypatch.setattr(mujoco_model, "add_superstructure", lambda *arguments: None)
    assert driven_ship() == with_house
    mujoco_model.scene_model.cache_clear()


def test_the_shell_has_neither_contacts_nor_mass():
    model = built(room(BOXES))._scene.model
    seen = [model.geom(i) for i in range(model.ngeom) if not model.geom(i).contype[0]]
    assert len(seen) >= 10
    for geom in seen:
        assert geom.conaffinity[0] == 0 and geom.group[0] < 3
    assert model.body_mass[model.body("robot").id] == pytest.approx(1.07 * 0.94)
    felt = [model.geom(name) for name in ("robot 0", "left wheel")]
    assert all(geom.contype[0] and geom.group[0] == 3 for geom in felt)
