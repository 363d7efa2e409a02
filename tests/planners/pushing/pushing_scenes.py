"""Scenes in which a robot pushes boxes, for several tests."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pushplan.envs.registry import SIMULATORS
from pushplan.envs.simulators.base import Materials, Simulator
from pushplan.envs.tasks.presets import SOLIDS
from pushplan.imports.on_demand import look_up
from pushplan.planners.pushing import PushModel, PushPath, PushState
from pushplan.world import Episode, Movables, Receptacle, RobotModel, StaticMap, Twist, World

SQUARE = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
FAR = Receptacle([(90.0, 90.0), (91.0, 90.0), (91.0, 91.0), (90.0, 91.0)])
NOISE = np.array([0.01, 0.01, np.radians(2.0)])


def make_world(
    robot: RobotModel,
    robot_pose: object,
    boxes: object,
    side: float = 1.0,
    walls: tuple[object, ...] = (),
    mass: float | None = None,
) -> World:
    at = np.asarray(boxes, dtype=float).reshape(-1, 3)
    masses = None if mass is None else np.full(len(at), mass)
    return World(
        robot=robot,
        robot_pose=np.asarray(robot_pose, dtype=float),
        static=StaticMap.build(polygons=list(walls), bounds=[-60.0, -60.0, 60.0, 60.0]),
        movables=Movables.from_outlines([side * SQUARE] * len(at), at, masses=masses),
        goal=FAR,
    )


def in_front(
    robot: RobotModel,
    side: float,
    offset: float = 0.0,
    angle: float = 0.0,
    mass: float | None = None,
) -> tuple[World, PushModel]:
    """One box on the bumper of a robot at the origin."""
    model = PushModel(robot, side * SQUARE)
    box = model.box_pose(PushState(np.zeros(3), offset, angle))
    return make_world(robot, np.zeros(3), [box], side, mass=mass), model


def best_offset(model: PushModel, path: PushPath, speed: float) -> float:
    """Offset at which to begin, so that sliding in the path's turns leaves the box on the bumper.

    The middle of the range that it slides over lies on the middle of the bumper; of a path that
    needs too much of it only the beginning counts.
    """
    state = np.zeros(6)
    low = high = 0.0
    half = model.bumper.half
    lengths = path.lengths
    for i in range(1, len(path.poses)):
        length = float(lengths[i] - lengths[i - 1])
        if length < 1e-9:
            continue
        turn = math.remainder(float(path.poses[i, 2] - path.poses[i - 1, 2]), math.tau)
        command = [[speed, turn * speed / length]]
        state = model.rows(PushState.from_row(state), command, length / speed)[0][1]
        if max(high, state[3]) - min(low, state[3]) > 1.2 * half:
            break
        low, high = min(low, float(state[3])), max(high, float(state[3]))
        state[3] = min(max(state[3], -half), half)
    offset = -0.5 * (low + high)
    return min(max(offset, -0.6 * half), 0.6 * half)


def make_simulator(name: str, world: World, friction: float) -> Simulator:
    simulator: Simulator = look_up("simulator", SIMULATORS, name)()
    solids = SOLIDS["turtlebot3"] if world.robot.name == "turtlebot3" else None
    simulator.build(world, Materials(friction, friction, friction, solids=solids))
    return simulator


def run(
    simulator: Simulator,
    command: Callable[[World], Twist | None],
    period: float,
    steps: int,
    *,
    noise: np.random.Generator | None = None,
    delay: float = 0.0,
) -> Episode:
    """Drive until ``command`` returns None; the touch of walls is in ``about``."""
    start = simulator.world()
    times, robots, boxes = [0.0], [simulator.robot_pose.copy()], [simulator.object_poses.copy()]
    before, touched = Twist(0.0, 0.0), 0
    for step in range(steps):
        seen = simulator.world()
        if noise is not None:
            error = NOISE * noise.standard_normal((1 + len(boxes[0]), 3))
            seen = seen.moved(
                robot_pose=seen.robot_pose + error[0], movable_poses=seen.movables.poses + error[1:]
            )
        twist = command(seen)
        if twist is None:
            break
        if delay:
            simulator.step(before, delay)
            touched += simulator.touched_static
            before = twist
        simulator.step(twist, period - delay)
        touched += simulator.touched_static
        times.append((step + 1) * period)
        robots.append(simulator.robot_pose.copy())
        boxes.append(simulator.object_poses.copy())
    return Episode(
        world=start,
        times=np.array(times),
        robot_poses=np.array(robots),
        object_poses=np.array(boxes),
        success=True,
        reason="",
        about={"touched": touched},
    )
