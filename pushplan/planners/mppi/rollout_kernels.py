"""Compiled rollouts: what the robot, and what it pushes, does under many control sequences."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.transforms import arc_step
from pushplan.interaction.advance import advance_objects
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free, static_depth
from pushplan.motion.goal_region import in_goal
from pushplan.world.checks import FloatArray, IntArray

DRIVEN = 0
REACHED = 1
BLOCKED = 2
"""Ends of a rollout: at the horizon, in the goal, or at something static or jammed."""


class DriveLimits(NamedTuple):
    """Limits on the robot's motion within one step."""

    min_speed: float  # [m/s]
    max_speed: float
    max_turn_rate: float  # [rad/s]
    speed_change: float  # Greatest change of the speed from step to step [m/s]
    turn_change: float  # The same of the turn rate [rad/s]
    turning_radius: float  # Of a car, else 0 [m]


class RolloutProblem(NamedTuple):
    """Robot, static obstacles and goal of rollouts."""

    period: float  # Length of a step [s]
    substeps: int  # Poses in a step
    limits: DriveLimits
    footprint: Footprint
    walls: ConvexObstacles
    goal: FloatArray  # (5,) from `goal_numbers`
    has_goal: bool  # True if a rollout ends in ``goal``; False where objects have the goal
    allowed: float  # Depth in what is static at the start [m]; a rollout may get out of it


class Rollouts(NamedTuple):
    """S rollouts of N + 1 poses among K objects."""

    paths: FloatArray  # (S, N + 1, 3) poses of the robot; the last one again after the end
    twists: FloatArray  # (S, H, 2) speed [m/s] and turn rate [rad/s] of each step
    ends: IntArray  # (S,) index of the last pose that is reached
    outcomes: IntArray  # (S,) `DRIVEN`, `REACHED` or `BLOCKED`
    objects: FloatArray  # (S, K, 3) poses of the objects there
    works: FloatArray  # (S,) sum of mass times path length of the objects [kg m]


def make_rollouts(samples: int, steps: int, substeps: int, objects: int) -> Rollouts:
    """Memory for rollouts."""
    return Rollouts(
        np.empty((samples, steps * substeps + 1, 3)),
        np.empty((samples, steps, 2)),
        np.zeros(samples, np.int64),
        np.zeros(samples, np.int64),
        np.empty((samples, objects, 3)),
        np.zeros(samples),
    )


@kernel
def _towards(last: float, wanted: float, change: float) -> float:
    """The nearest value to ``wanted`` within ``change`` of the last one."""
    return min(max(wanted, last - change), last + change)


@kernel
def _blocked(pose: FloatArray, problem: RolloutProblem, corners: FloatArray) -> bool:
    """Return True if the robot cannot be at a pose."""
    if is_free(pose, problem.footprint, problem.walls, corners):
        return False
    if problem.allowed <= 0.0:
        return True
    return static_depth(pose, problem.footprint, problem.walls, corners) > problem.allowed


@kernel
def roll_robot(
    s: int,  # number of the rollout
    controls: FloatArray,  # (H, 2) speed and turn rate, as fractions of the greatest ones
    start: FloatArray,  # (3,) pose
    twist: FloatArray,  # (2,) speed [m/s] and turn rate [rad/s] before
    problem: RolloutProblem,
    corners: FloatArray,  # (V, 2) memory
    out: Rollouts,
) -> None:
    """Drive the robot by one control sequence until it is blocked or in the goal."""
    limits = problem.limits
    path = out.paths[s]
    speed = twist[0]
    rate = twist[1]
    part = problem.period / problem.substeps
    copy_into(path[0], start)
    out.outcomes[s] = DRIVEN
    at = 0
    for h in range(controls.shape[0]):
        speed = _towards(speed, controls[h, 0] * limits.max_speed, limits.speed_change)
        speed = min(max(speed, limits.min_speed), limits.max_speed)
        rate = _towards(rate, controls[h, 1] * limits.max_turn_rate, limits.turn_change)
        most = limits.max_turn_rate
        if limits.turning_radius > 0.0:
            most = min(most, abs(speed) / limits.turning_radius)
        rate = min(max(rate, -most), most)
        out.twists[s, h, 0] = speed
        out.twists[s, h, 1] = rate
        if out.outcomes[s] != DRIVEN:
            continue
        for _ in range(problem.substeps):
            arc_step(path[at], speed * part, rate * part, path[at + 1])
            if _blocked(path[at + 1], problem, corners):
                out.outcomes[s] = BLOCKED
                break
            at += 1
            if problem.has_goal and in_goal(path[at, 0], path[at, 1], problem.goal):
                out.outcomes[s] = REACHED
                break
    out.ends[s] = at


@kernel(allocates=True)
def roll_robots(
    controls: FloatArray,  # (S, H, 2)
    start: FloatArray,
    twist: FloatArray,
    problem: RolloutProblem,
    out: Rollouts,
) -> None:
    """`roll_robot` for S control sequences."""
    corners = np.empty_like(problem.footprint.vertices)
    for s in range(controls.shape[0]):
        roll_robot(s, controls[s], start, twist, problem, corners, out)


@kernel(allocates=True)
def roll_objects(
    model: Any,  # a compiled interaction model
    start: FloatArray,  # (K, 3) poses of the objects
    out: Rollouts,  # with the paths of the robot
) -> None:
    """Carry the objects along each path, which ends where the robot jams."""
    moved = np.empty(start.shape[0])
    for s in range(out.paths.shape[0]):
        path = out.paths[s]
        objects = out.objects[s]
        for k in range(start.shape[0]):
            copy_into(objects[k], start[k])
            moved[k] = 0.0
        for n in range(out.ends[s]):
            if not advance_objects(model, path[n], path[n + 1], objects, moved):
                out.ends[s] = n
                out.outcomes[s] = BLOCKED
                break
        out.works[s] = 0.0
        for k in range(start.shape[0]):
            out.works[s] += moved[k] / model.inverse_masses[k]
