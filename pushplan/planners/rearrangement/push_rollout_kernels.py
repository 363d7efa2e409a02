"""Compiled rollouts of pushes: the pushing controller in closed loop with quasi-static contacts.

A *line* push drives straight ahead until it has done what it can. A *path-following* push steers
one object along a path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pushplan.compiled import copy_into, kernel
from pushplan.geometry.transforms import arc_step
from pushplan.interaction.kernels import Bodies, Scratch, Settings, make_scratch
from pushplan.planners.rearrangement.controller_kernels import PushingController, steer_push
from pushplan.planners.rearrangement.goal_kernels import REMOVED, ObjectGoal, is_done
from pushplan.planners.rearrangement.short_arc_kernels import push_to
from pushplan.world.checks import BoolArray, FloatArray

STAGES = 8
"""Number of stages of one push that are kept."""


class RolloutLog(NamedTuple):
    """Arrays into which a rollout is written."""

    track: FloatArray  # (T, 3) the robot's poses
    steps: FloatArray  # (STAGES,) how many poses each stage has
    poses: FloatArray  # (STAGES, K, 3) the objects' poses at the end of each stage
    lengths: FloatArray  # (STAGES, K) their path lengths [m]
    box: FloatArray
    """(4,) x_min, y_min, x_max, y_max of all that moved, and of its surroundings [m]."""


class PushRollout(NamedTuple):
    """A push to roll out."""

    target: int  # Index of the object that follows the path, -1 for a line push
    path: FloatArray  # (M, 2) of the target object [m]
    shift: float  # See `steer_push`
    limit: float  # Greatest length of the robot's path [m]
    wanted: BoolArray  # (K,) objects that are to be done; the push ends when all are
    controller: PushingController
    bodies: Bodies
    settings: Settings
    goal: ObjectGoal


class _Memory(NamedTuple):
    """Memory of one rollout."""

    here: FloatArray  # (3,) the robot
    there: FloatArray  # (3,) where it goes
    poses: FloatArray  # (K, 3)
    saved: FloatArray  # (K, 3) before the step
    lengths: FloatArray  # (K,) path lengths [m]
    done: BoolArray  # (K,)
    scratch: Scratch


@kernel
def _enclose(box: FloatArray, pose: FloatArray, reach: float) -> None:
    """Make a box big enough for a disc."""
    box[0] = min(box[0], pose[0] - reach)
    box[1] = min(box[1], pose[1] - reach)
    box[2] = max(box[2], pose[0] + reach)
    box[3] = max(box[3], pose[1] + reach)


@kernel
def _write(log: RolloutLog, stages: int, used: int, poses: FloatArray, lengths: FloatArray) -> int:
    """Write a stage down; returns how many there are then."""
    log.steps[stages] = used
    copy_into(log.poses[stages], poses)
    copy_into(log.lengths[stages], lengths)
    return stages + 1


@kernel
def _update_done(memory: _Memory, problem: PushRollout, box: FloatArray, margin: float) -> bool:
    """Remove what is delivered after a step; returns whether one more object is done."""
    poses = memory.poses
    saved = memory.saved
    done = memory.done
    news = False
    for k in range(poses.shape[0]):
        if poses[k, 0] != saved[k, 0] or poses[k, 1] != saved[k, 1]:
            _enclose(box, poses[k], problem.bodies.radii[k] + margin)
            was = done[k]
            done[k] = is_done(k, poses, problem.bodies, problem.goal)
            news = news or (done[k] and not was)
            if done[k] and problem.goal.is_receptacle:
                poses[k, 0] = REMOVED * (1.0 + k)
    return news


@kernel
def _is_wanting(wanted: BoolArray, done: BoolArray) -> bool:
    """Return True if something that is wanted is not done."""
    for k in range(wanted.shape[0]):
        if wanted[k] and not done[k]:
            return True
    return False


@kernel(allocates=True)
def roll_out(
    start: FloatArray, poses: FloatArray, problem: PushRollout, log: RolloutLog
) -> tuple[int, int]:
    """Push until nothing that is wanted can come of it; returns how many stages and poses."""
    memory = _Memory(
        start.copy(),
        np.empty(3),
        poses.copy(),
        np.empty_like(poses),
        np.zeros(poses.shape[0]),
        np.empty(poses.shape[0], dtype=np.bool_),
        make_scratch(problem.bodies),
    )
    for k in range(poses.shape[0]):
        memory.done[k] = is_done(k, memory.poses, problem.bodies, problem.goal)
    return _roll(memory, problem, log)


@kernel
def _roll(memory: _Memory, problem: PushRollout, log: RolloutLog) -> tuple[int, int]:
    """`roll_out` in memory that is given; the last stage is kept however it ends."""
    here, there, poses, saved, lengths, done, scratch = memory
    controller = problem.controller
    bodies = problem.bodies
    copy_into(log.track[0], here)
    margin = 2.0 * controller.step
    log.box[0] = np.inf
    log.box[1] = np.inf
    log.box[2] = -np.inf
    log.box[3] = -np.inf
    _enclose(log.box, here, bodies.robot_radius + margin)
    stages = 0
    used = 1
    travelled = 0.0
    reached = 0.0
    while used < log.track.shape[0] and travelled < problem.limit:
        step = controller.step
        turn = 0.0
        target = problem.target
        if target >= 0:
            step, turn, reached, holds = steer_push(
                here, poses[target], problem.path, reached, problem.shift, controller
            )
            if not holds and not done[target]:
                break
        arc_step(here, step, turn, there)
        copy_into(saved, poses)
        if not push_to(here, there, poses, lengths, bodies, problem.settings, scratch):
            break
        copy_into(here, there)
        copy_into(log.track[used], here)
        used += 1
        travelled += step
        _enclose(log.box, here, bodies.robot_radius + margin)
        if _update_done(memory, problem, log.box, margin) and stages < STAGES - 1:
            stages = _write(log, stages, used, poses, lengths)
        if not _is_wanting(problem.wanted, done):
            break
    if stages == 0 or log.steps[stages - 1] != used:
        stages = _write(log, stages, used, poses, lengths)
    return stages, used
