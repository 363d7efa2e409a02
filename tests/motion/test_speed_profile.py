"""Speeds and times of a path."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import SQUARE

from pushplan.motion.speed_profile import SweptPath, timed_plan
from pushplan.world import GoalDisc, Movables, RobotModel, StaticMap, World


@pytest.mark.parametrize("min_speed", [0.0, -0.2])
def test_a_step_back_by_rounding_is_none(min_speed: float) -> None:
    robot = RobotModel.from_outline(
        SQUARE,
        mass=1.0,
        drive="differential",
        max_speed=0.5,
        min_speed=min_speed,
        max_turn_rate=1.0,
    )
    world = World(
        robot,
        (0.0, 0.0, 0.0),
        StaticMap.build(bounds=(-5, -5, 5, 5)),
        Movables.from_polygons([], masses=[]),
        GoalDisc((2.0, 0.0), 0.1),
    )
    poses = np.zeros((4, 3))
    poses[:, 0] = [0.0, 1.0, 1.0 - 1e-9, 2.0]
    lengths = np.array([0.0, 1.0, 1.0, 2.0])
    path = SweptPath(poses, np.zeros(4), np.empty((4, 0, 3)), lengths, np.zeros(4))
    plan = timed_plan(world, path, 0.9)
    assert plan.times[-1] == pytest.approx(4.0) and len(plan.stages) == 1
    assert (plan.speeds >= 0.0).all()
