"""Tracking controllers compared: error and time per command, with and without noise and delay.

    python -m benchmarks.accuracy.tracking [--seeds 5]

Robots move in exact arcs. "Exact" is a controller that knows the pose and whose commands act at
once; "noisy" is position noise of 2 % of R and heading noise of 0.01 rad, and commands that act
100 ms after the pose was measured. Errors are distances of the true position from the path, in
percent of the circumscribed radius R. Times are processor time of the thread, so that other
processes on the machine do not count.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from benchmarks.reporting import command_line
from pushplan.control import MpcConfig, MpcTracker, PathFollower, PurePursuit
from pushplan.core import motion as core
from pushplan.envs import PushEnv
from pushplan.planners import KinodynamicRRT, MaxIterations, ShortestPath
from pushplan.world import Controller, Drive, Plan, RobotModel, StaticMap, World
from pushplan.world.checks import FloatArray

FLOOR = StaticMap.build(bounds=[-1e3, -1e3, 1e3, 1e3])
PERIOD = 0.1
DELAY = 0.1


def arcs(world: World, pieces: list[tuple[float, float]]) -> Plan:
    """A plan of arcs (length in R, curvature in 1 / R) from the robot's pose."""
    size = world.robot.circumscribed_radius
    poses = [np.array(world.robot_pose)]
    bends = []
    lengths = [0.0]
    for length, bend in pieces:
        steps = max(1, round(length / 0.15))
        for _ in range(steps):
            here = np.empty(3)
            core.along_arc(poses[-1], length * size / steps, bend / size, here)
            poses.append(here)
            bends.append(bend / size)
            lengths.append(lengths[-1] + length * size / steps)
    speed = world.robot.max_speed
    return Plan(
        times=np.array(lengths) / speed,
        poses=np.array(poses),
        speeds=np.full(len(poses), speed),
        turn_rates=np.array([*bends, 0.0]) * speed,
        travel_cost=world.robot.mass * lengths[-1],
    )


def robots() -> dict[str, RobotModel]:
    """Three robots: the Maze robot, one that cannot jerk its rudder, and a differential drive."""
    car = PushEnv(task="maze").task.robot
    ship = PushEnv(task="ship_ice").task.robot
    wheels = PushEnv(task="area_clearing", preset="testbed").task.robot
    assert car.drive is Drive.CONSTANT_SPEED and wheels.drive is Drive.DIFFERENTIAL
    slow = replace(ship, max_turn_acceleration=0.2 * ship.max_turn_rate)
    return {"maze": car, "ship, rudder 5 s": slow, "turtlebot": wheels}


def plans(robot: RobotModel) -> dict[str, tuple[World, Plan]]:
    """Named paths, each with the world that it starts from."""
    empty = PushEnv(task="maze")
    empty.reset(seed=0)
    scene = empty.world.moved(robot_pose=[0.0, 0.0, 0.0])
    start = replace(scene, robot=robot, static=FLOOR, movables=scene.movables.empty())
    bend = 0.8 * robot.circumscribed_radius / robot.turning_radius
    bend = min(bend, 0.8)
    half = math.pi / bend
    shapes = {
        "straight": [(12.0, 0.0)],
        "circle": [(3.0, 0.0), (2.0 * half, bend)],
        "S-curve": [(3.0, 0.0), (half / 2, bend), (half / 2, -bend), (3.0, 0.0)],
    }
    found = {name: (start, arcs(start, pieces)) for name, pieces in shapes.items()}
    if robot.drive is Drive.CONSTANT_SPEED and robot.name != "ship":
        for seed in range(3):
            empty.reset(seed=1000 + seed)
            world = empty.world
            result = KinodynamicRRT().plan(world, stop=MaxIterations(2000))
            assert result.plan is not None
            found[f"recorded {seed}"] = (world, result.plan)
        result = ShortestPath().plan(world)
        assert result.plan is not None
        found["corners"] = (world, result.plan)
    return found


def drive(
    world: World,
    plan: Plan,
    controller: Controller,
    *,
    noise: float = 0.0,
    delay: float = 0.0,
    seed: int = 0,
) -> tuple[FloatArray, list[float]]:
    """Follow a plan to its end; positions (N, 2) and the time of each command [s]."""
    rng = np.random.default_rng(seed)
    robot = world.robot
    size = robot.circumscribed_radius
    late = round(delay / PERIOD)
    queue: list[tuple[float, float]] = [(max(robot.min_speed, 0.0), 0.0)] * late
    pose = np.array(world.robot_pose)
    points = []
    times = []
    angular = 0.0
    for step in range(round(plan.length / robot.max_speed / PERIOD)):
        error = noise * np.array([size * rng.normal(), size * rng.normal(), 0.5 * rng.normal()])
        seen = world.moved(robot_pose=pose + error, time=step * PERIOD)
        began = time.thread_time()
        twist = controller.command(seen, plan)
        times.append(time.thread_time() - began)
        queue.append((twist.linear, twist.angular))
        linear, wanted = queue.pop(0)
        reach = robot.max_turn_acceleration * PERIOD  # the rudder moves no faster than it can
        angular = min(max(wanted, angular - reach), angular + reach)
        half = 0.5 * angular * PERIOD
        chord = linear * PERIOD * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        course = pose[2] + half
        pose = pose + np.array([chord * math.cos(course), chord * math.sin(course), 2.0 * half])
        points.append(pose[:2])
    return np.array(points), times


def distances(plan: Plan, points: FloatArray) -> FloatArray:
    """Distance of each point (N, 2) from the path, which goes on straight at its end [m]."""
    best = np.full(len(points), np.inf)
    last = plan.poses[-1]
    for (x, y, theta), (u, v, phi) in pairwise(plan.poses.tolist()):
        turn = math.remainder(phi - theta, 2.0 * math.pi)
        chord = np.array([u - x, v - y])
        length = math.hypot(*chord)
        if length < 1e-12:
            continue
        along = (points - [x, y]) @ chord / length
        share = np.clip(along / length, 0.0, 1.0)
        normal = np.array([-chord[1], chord[0]]) / length
        smooth = abs(math.remainder(math.atan2(chord[1], chord[0]) - theta - turn / 2, math.tau))
        bulge = 0.5 * turn * length * share * (1 - share) if smooth < 0.1 * abs(turn) else 0.0
        across = (points - [x, y]) @ normal + bulge
        over = along - share * length
        if (u, v) == (last[0], last[1]):
            over = np.minimum(over, 0.0)
        best = np.minimum(best, np.hypot(across, over))
    return best


def controllers(delay: float) -> dict[str, Callable[[], Controller]]:
    """Fresh controllers by name."""
    return {
        "pure pursuit": PurePursuit,
        "path follower": PathFollower,
        "mpc": lambda: MpcTracker(MpcConfig(delay=delay)),
        "mpc, speed": lambda: MpcTracker(MpcConfig(delay=delay, optimise_speed=True)),
        **({"mpc, delay unknown": lambda: MpcTracker()} if delay else {}),
    }


def main() -> None:
    parser = command_line(__doc__, seeds=5)
    options = parser.parse_args()
    say = sys.stdout.write
    for robot_name, robot in robots().items():
        say(f"\n{robot_name}: R = {robot.circumscribed_radius:.3f} m, {robot.max_speed:g} m/s\n")
        for label, noise, delay in (("exact", 0.0, 0.0), ("noisy", 0.02, DELAY)):
            head = f"{'rms / max [% R], ' + label:22}"
            names = plans(robot)
            say(head + "".join(f"{name:>16}" for name in names) + "   ms median / p99\n")
            for name, make in controllers(delay).items():
                if "speed" in name and robot.drive is not Drive.DIFFERENTIAL:
                    continue
                cells = []
                times = []
                for world, plan in names.values():
                    errors = []
                    for seed in range(options.seeds if noise else 1):
                        points, took = drive(
                            world, plan, make(), noise=noise, delay=delay, seed=seed
                        )
                        errors.append(distances(plan, points))
                        times += took[3:]
                    found = 100.0 * np.concatenate(errors) / robot.circumscribed_radius
                    rms = float(np.sqrt((found**2).mean()))
                    cells.append(f"{rms:.2f} / {found.max():.1f}")
                clock = 1e3 * np.array(times)
                say(f"{name:22}" + "".join(f"{cell:>16}" for cell in cells))
                say(f"   {np.median(clock):.3f} / {np.percentile(clock, 99):.3f}\n")


if __name__ == "__main__":
    main()
