"""`PushLog`: a recorded push as numbers over time, for pictures and checks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.planners.pushing import contact_kernels
from pushplan.planners.pushing.bumper import face_towards
from pushplan.planners.pushing.model import PushModel
from pushplan.planners.pushing.parameters import PushParameters
from pushplan.planners.pushing.path import PushPath
from pushplan.world import Episode, InvalidInputError
from pushplan.world.checks import ArrayRecord, BoolArray, FloatArray, expect

_TOUCH = 0.05  # greatest gap of a box that touches the bumper [L]
_FLOOR = -1.0  # least margin that is told apart


@dataclass(frozen=True, eq=False)
class PushLog(ArrayRecord):
    """One box in front of the bumper over time.

    Args:
        times: (T,) [s].
        offset: (T,) of the box from the middle of the bumper, left positive [half bumpers].
        angle: (T,) of the pushed face against how it would lie on the bumper [rad].
        margin: (T,) fraction of the friction cone and of the line of contact that the robot's turn
            leaves unused, 1 straight ahead, negative where the box slips; -1 stands for all less.
        lateral: (T,) distance from the path, left positive [m]; NaN without a path.
        touching: (T,) whether the box is being pushed; the other entries mean nothing where not.
    """

    times: FloatArray
    offset: FloatArray
    angle: FloatArray
    margin: FloatArray
    lateral: FloatArray
    touching: BoolArray


def push_log(
    episode: Episode,
    box_id: int,
    parameters: PushParameters | None = None,
    path: PushPath | None = None,
) -> PushLog:
    """What happened to a box on the bumper in a recording.

    Args:
        episode: the recording.
        box_id: label of the box.
        parameters: friction; none if None.
        path: that the box should have taken.

    Raises:
        InvalidInputError: if there is no such box.
    """
    expect("episode", episode, Episode)
    if path is not None:
        expect("path", path, PushPath)
    found = np.flatnonzero(episode.world.movables.ids == box_id)
    if len(found) == 0:
        raise InvalidInputError(
            f"box_id {box_id} is not in the recording (valid: "
            f"{episode.world.movables.ids.tolist()})"
        )
    k, count = int(found[0]), len(episode.times)
    outline, robot = episode.world.movables.outline(k), episode.world.robot
    columns = np.full((4, count), np.nan)
    touching = np.zeros(count, dtype=bool)
    models: dict[float, PushModel] = {}
    for i in range(count):
        pose, box = episode.robot_poses[i], episode.object_poses[i, k]
        face = face_towards(outline, float(pose[2] - box[2]))
        model = models.setdefault(face.normal, PushModel(robot, outline, parameters, face))
        state = model.state(pose, box)
        low, high = contact_kernels.line(model.contact, state.offset)
        touching[i] = abs(state.gap) < _TOUCH * model.reach and low < 0.0 < high
        flush = contact_kernels.flush_angle(model.contact, state.offset)
        j = min(i, count - 2)
        margin = _margin(episode, j, model.stable_curvature(state.offset)) if count > 1 else 1.0
        columns[:3, i] = state.offset / model.bumper.half, state.angle - flush, margin
        if path is not None:
            columns[3, i] = _signed(path, box)
    offset, angle, margins, lateral = columns
    return PushLog(episode.times, offset, angle, margins, lateral, touching)


def _margin(episode: Episode, i: int, bound: float) -> float:
    """Unused fraction of the stable curvature between two recorded instants."""
    a, b = episode.robot_poses[i], episode.robot_poses[i + 1]
    turn = abs(math.remainder(float(b[2] - a[2]), math.tau))
    move = math.hypot(float(b[0] - a[0]), float(b[1] - a[1]))
    if turn < 1e-9:
        return 1.0
    return max(1.0 - turn / (bound * move), _FLOOR) if bound * move > 1e-12 else _FLOOR


def _signed(path: PushPath, box: FloatArray) -> float:
    """Distance of a box from the nearest piece of the path, left positive [m]."""
    along, _ = path.nearest(box[:2])
    i = max(int(np.searchsorted(path.lengths, along - 1e-9, side="left")) - 1, 0)
    a, b = path.poses[i, :2], path.poses[min(i + 1, len(path.poses) - 1), :2]
    chord = (b - a) / max(float(np.hypot(*(b - a))), 1e-12)
    return float(chord[0] * (box[1] - a[1]) - chord[1] * (box[0] - a[0]))
