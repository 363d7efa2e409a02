"""Load the compiled kernels of a simulator before its steps are timed."""

from __future__ import annotations

import numpy as np

from pushplan.envs.simulators.base import Materials, Simulator
from pushplan.world import Twist, World


def warm_up_simulator(simulator: Simulator, world: World, materials: Materials) -> None:
    """Step once where the robot is, and once with an object right before it.

    Args:
        simulator: holds another scene afterwards.
        world: whose robot reaches no object yet.
        materials: as `Simulator.build` takes them.
    """
    robot, period = world.robot, 0.1 * world.robot.circumscribed_radius / world.robot.max_speed
    ahead = Twist(robot.max_speed, 0.0)
    simulator.build(world, materials)
    simulator.step(ahead, period)
    if len(world.movables):
        x, y, _ = world.movables.poses[0]
        gap = robot.circumscribed_radius + float(world.movables.radii[0])
        simulator.build(world.moved(robot_pose=np.array([x - gap, y, 0.0])), materials)
        for _ in range(5):
            simulator.step(ahead, period)
