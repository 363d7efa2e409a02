"""Robots at rest at a goal pose: how many, how near, and how soon.

    python -m benchmarks.accuracy.goal_poses FOLDER [--worlds N]

FOLDER holds worlds of the BARN challenge, as `benchmarks.accuracy.real_maps` reads them; their
goals are poses, to 2 cm and 3°, at random headings. A `Runner` drives at 20 Hz with exact
velocities, and every planning call has 1,000 iterations at most.
"""

from __future__ import annotations

import math
from itertools import islice
from pathlib import Path

import numpy as np

from benchmarks.accuracy.real_maps import PLANNERS, barn_cases, drives
from benchmarks.reporting import command_line, head, origin, row, write
from pushplan.control import ImmediateExecutor
from pushplan.core import geometry
from pushplan.runtime import Runner
from pushplan.world import GoalPose, MaxIterations, World

PERIOD_S = 0.05
PATIENCE_S = 90.0  # of an episode
REST_S = 1.0  # after the runner has said that it is done
STOP = MaxIterations(1000)


def driven(world: World, planner: str) -> tuple[World, float]:
    """The world when the robot is at rest, and the time that it has driven; infinite if it does."""
    with Runner(
        planner, period=PERIOD_S, plan_stop=STOP, executor=ImmediateExecutor(STOP)
    ) as runner:
        command = runner.start(world)
        done = math.inf
        while world.time < min(PATIENCE_S, done + REST_S):
            speed, bearing = command.twist.course
            turn = command.twist.angular
            aside = np.array([0.0, 0.0, bearing])  # as if it drove ahead
            begin = world.robot_pose + aside
            end = np.array(geometry.arc_step(begin, speed * PERIOD_S, turn * PERIOD_S))
            twist = [speed * math.cos(end[2]), speed * math.sin(end[2]), turn]
            pose = end - aside
            world = world.moved(robot_pose=pose, robot_twist=twist, time=world.time + PERIOD_S)
            runner.update(world)
            command = runner.command(world.time)
            if command.status.value == "done":
                done = min(done, world.time)
    return world, done


def main() -> None:
    parser = command_line(__doc__, seed=0)
    parser.add_argument("barn", type=Path, metavar="FOLDER", help="of worlds.npz and paths.npz")
    parser.add_argument("--worlds", type=int, help="first ones that are taken; all by default")
    options = parser.parse_args()
    write(origin(), "")
    head("robot", "policy", "at rest at the pose", "farthest [mm]", "most turned [°]", "time [s]")
    for robot in drives():
        if not robot.can_stop:
            continue
        for planner in PLANNERS:
            cases = islice(barn_cases(options.barn, robot, options.seed), options.worlds)
            ends = [driven(case.world, planner) for case in cases]
            goals = [world.goal for world, _ in ends if isinstance(world.goal, GoalPose)]
            poses = np.array([world.robot_pose for world, _ in ends])
            off = [
                math.dist(pose[:2], goal.center) for pose, goal in zip(poses, goals, strict=True)
            ]
            errors = [goal.heading_error(pose[2]) for pose, goal in zip(poses, goals, strict=True)]
            row(
                robot.name,
                f"`{planner}`",
                f"{sum(world.goal_reached for world, _ in ends)} of {len(ends)}",
                f"{1e3 * max(off):.1f}",
                f"{math.degrees(np.abs(errors).max()):.2f}",
                f"{np.median([time for _, time in ends]):.1f}",
            )


if __name__ == "__main__":
    main()
