"""Load the compiled kernels of a simulator before its steps are timed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pushplan.envs.simulators.base import Materials, Simulator
from pushplan.world import Twist, World


def warm_up_simulator(simulator: Simulator, world: World, materials: Materials) -> None:
    """Step where the robot is, with an object right before it, and with something static there.

    Args:
        simulator: holds another scene afterwards.
        world: whose robot reaches nothing yet.
        materials: as `Simulator.build` takes them.
    """
    robot = world.robot
    radius, ahead = robot.circumscribed_radius, Twist(robot.max_speed, 0.0)
    alone = replace(world, movables=world.movables.select(np.zeros(0, dtype=np.int64)))
    worlds = [world, alone]
    if len(world.movables):
        x, y, _ = world.movables.poses[0]
        gap = radius + float(world.movables.radii[0])
        worlds.append(world.moved(robot_pose=np.array([x - gap, y, 0.0])))
    for part in world.static.convex_parts[:1]:
        (x, _), (_, y) = part.min(axis=0), part.mean(axis=0)
        worlds.append(world.moved(robot_pose=np.array([x - radius, y, 0.0])))
    for scene in worlds:
        simulator.build(scene, materials)
        for _ in range(5):
            simulator.step(ahead, 0.2 * radius / robot.max_speed)
