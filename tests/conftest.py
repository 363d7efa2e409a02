"""Worlds that many tests start from."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from pushplan.world import Drive, GoalDisc, Movables, RobotModel, StaticMap, World

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
OCTAGON = np.array(
    [
        [0.7, 0.3],
        [0.4, 0.6],
        [-0.4, 0.6],
        [-0.7, 0.3],
        [-0.7, -0.3],
        [-0.4, -0.6],
        [0.4, -0.6],
        [0.7, -0.3],
    ]
)


def make_robot(**changes: object) -> RobotModel:
    limits: dict[str, object] = {
        "mass": 1.0,
        "drive": Drive.CONSTANT_SPEED,
        "max_speed": 0.15,
        "max_turn_rate": 0.105,
    }
    limits.update(changes)
    return RobotModel.from_outline(OCTAGON, **limits)


def make_boxes(poses: object) -> Movables:
    """Square boxes of 1 m at the given (K, 3) poses."""
    at = np.asarray(poses, dtype=float).reshape(-1, 3)
    return Movables.from_outlines([SQUARE] * len(at), at)


def make_u_maze(box_poses: object = (), **changes: object) -> World:
    """The U-shaped maze of the 2D benchmark."""
    walls = [
        [0, 0, 15, 0],
        [0, 0, 0, 15],
        [15, 0, 15, 15],
        [0, 15, 15, 15],
        [7.5, 0, 7.5, 10],
    ]
    fields: dict[str, object] = {
        "robot": make_robot(),
        "robot_pose": [11.25, 3.75, np.pi / 2],
        "static": StaticMap.build(segments=walls, radii=0.5),
        "movables": make_boxes(box_poses),
        "goal": GoalDisc([3.75, 3.75], 1.86),
    }
    fields.update(changes)
    return World(**fields)  # type: ignore[arg-type]


def scattered_boxes(count: int, seed: int) -> np.ndarray:
    """(count, 3) poses in the U-maze that overlap neither each other nor walls nor the start."""
    rng = np.random.default_rng(seed)
    found: list[np.ndarray] = []
    while len(found) < count:
        spot = rng.uniform(1.3, 13.7, 2)
        wall = abs(spot[0] - 7.5) < 1.3 and spot[1] < 11.3
        crowded = any(np.hypot(*(spot - other[:2])) < 1.45 for other in found)
        near_ends = any(np.hypot(*(spot - end)) < 1.9 for end in ([11.25, 3.75], [3.75, 3.75]))
        if not (wall or crowded or near_ends):
            found.append(np.array([*spot, 0.0]))
    return np.array(found).reshape(-1, 3)


@pytest.fixture(scope="session")
def warm() -> None:
    """Compiled kernels, for tests that look at the clock."""
    from pushplan.planners import warm_up

    warm_up()


def quickest(call: Callable[[], object], tries: int = 3) -> float:
    """Least time of some calls [s]: what the machine's other work leaves of it."""
    times = []
    for _ in range(tries):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return min(times)


@pytest.fixture
def u_maze() -> World:
    return make_u_maze([[4, 9, 0.3], [10, 12, 0.0], [13, 8, 0.7]])
