"""Friction from recorded pushes: ``python -m pushplan.planners.pushing.fit EPISODE.npz ...``."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from pushplan.planners.pushing import contact_kernels
from pushplan.planners.pushing.bumper import Bumper, contact_of, face_towards
from pushplan.planners.pushing.contact_kernels import Contact
from pushplan.planners.pushing.model import PushModel
from pushplan.planners.pushing.parameters import PushParameters
from pushplan.world import Episode, InvalidInputError, PushplanError
from pushplan.world.checks import FloatArray, expect

_TOUCH = 0.06  # greatest gap of a box that is being pushed [depth of the box]
_WINDOW = 0.4  # travel of the robot over which one prediction runs [L]
_LEAST_WINDOWS = 5
_STARTS = (0.02, 0.15, 0.3, 0.5, 0.8)
_SPREADS = (1.0, 1.8)
_BOUNDS = ((0.0, 0.1), (2.0, 5.0))
_ROBUST = 0.02  # residuals beyond this count less: another box or a wall was in the way [L, rad]


@dataclass(frozen=True)
class PushFit:
    """Outcome of `identify`.

    Args:
        parameters: that predict the recordings best.
        friction_error: standard error of the friction; inf where the recordings say nothing.
        spread_error: standard error of the spread, likewise.
        rms: of the predictions' errors, as fractions of the distance from axle to box, and in rad.
        windows: pieces of pushes that were used.
    """

    parameters: PushParameters
    friction_error: float
    spread_error: float
    rms: float
    windows: int


@dataclass(frozen=True)
class _Piece:
    """A stretch of one push, as the model sees it."""

    contact: Contact
    reach: float
    start: FloatArray
    twists: FloatArray
    steps: FloatArray
    end: tuple[float, float]
    uniform: float


def fit_push_model(episodes: Iterable[Episode]) -> PushParameters:
    """The friction with which the contact model predicts recorded pushes best, see `identify`."""
    return identify(episodes).parameters


def identify(episodes: Iterable[Episode]) -> PushFit:
    """Friction of the bumper and of the ground from recordings.

    Every stretch in which a box touches the bumper alone is cut into pieces; from the poses at the
    beginning of a piece and the motion of the robot the model predicts the box's offset and angle
    at its end, and the parameters are those that make the errors least (least squares with a soft
    loss). Pushes straight ahead say nothing: the robot has to turn while it pushes.

    Args:
        episodes: recordings of a robot that pushes.

    Raises:
        InvalidInputError: if there are too few pushes in them.
    """
    given = list(expect("episodes", episodes, Iterable))  # type: ignore[type-abstract]
    pieces = [piece for item in given for piece in _pieces(expect("episode", item, Episode))]
    if len(pieces) < _LEAST_WINDOWS:
        raise InvalidInputError(
            f"the recordings hold {len(pieces)} pieces of pushes, at least {_LEAST_WINDOWS} are "
            "needed: record a robot that pushes single boxes, with turns"
        )

    def errors(values: FloatArray) -> FloatArray:
        return _errors(pieces, float(values[0]), float(values[1]))

    def cost(values: tuple[float, float]) -> float:
        scaled = (errors(np.array(values)) / _ROBUST) ** 2
        return float((np.sqrt(1.0 + scaled) - 1.0).sum())

    start = min(product(_STARTS, _SPREADS), key=cost)
    found = least_squares(
        errors,
        np.array(start),
        bounds=_BOUNDS,
        loss="soft_l1",
        f_scale=_ROBUST,
        diff_step=(0.02, 0.02),
        x_scale=(0.1, 0.5),
        max_nfev=60,
    )
    left = errors(found.x)
    variance = float(left @ left) / max(len(left) - 2, 1)
    slopes: FloatArray = np.asarray(found.jac)
    matrix = slopes.T @ slopes
    spread = np.full(2, np.inf)
    told = np.diag(matrix) > 1e-12
    if told.any():
        inverse = np.linalg.pinv(matrix[np.ix_(told, told)])
        spread[told] = np.sqrt(np.maximum(np.diag(inverse) * variance, 0.0))
    return PushFit(
        PushParameters(float(found.x[0]), float(found.x[1])),
        float(spread[0]),
        float(spread[1]),
        float(np.sqrt((left**2).mean())),
        len(pieces),
    )


def _errors(pieces: Sequence[_Piece], friction: float, spread: float) -> FloatArray:
    """(2 N,) errors of the predicted offset [L] and angle [rad] of each piece."""
    left = np.empty((len(pieces), 2))
    for row, piece in zip(left, pieces, strict=True):
        contact = piece.contact._replace(friction=friction, spread=spread * piece.uniform)
        offset, angle = contact_kernels.predicted(contact, piece.start, piece.twists, piece.steps)
        row[:] = (offset - piece.end[0]) / piece.reach, angle - piece.end[1]
    return left.ravel()


def _pieces(episode: Episode) -> list[_Piece]:
    """Every usable piece of every push of an episode."""
    world = episode.world
    bumper = Bumper.of(world.robot)
    found: list[_Piece] = []
    for k in range(len(world.movables)):
        outline = world.movables.outline(k)
        boxes, robots = episode.object_poses[:, k], episode.robot_poses
        moving = np.hypot(*np.diff(boxes[:, :2], axis=0).T) > 1e-5 * world.movables.radii[k]
        alone = _alone(episode, k)
        i = 0
        while i < len(moving):
            if not (moving[i] and alone[i]):
                i += 1
                continue
            face = face_towards(outline, float(robots[i, 2] - boxes[i, 2]))
            contact = contact_of(bumper, outline, face, PushParameters())
            model = PushModel(bumper, outline, PushParameters(), face)
            j, travel, rows = i, 0.0, [model.state(robots[i], boxes[i])]
            while j < len(moving) and moving[j] and alone[j + 1] and travel < _WINDOW * model.reach:
                rows.append(model.state(robots[j + 1], boxes[j + 1]))
                step = robots[j + 1] - robots[j]
                travel += math.hypot(step[0], step[1]) + abs(step[2]) * model.reach
                j += 1
            touch = all(abs(row.gap) < _TOUCH * face.depth for row in rows)
            low, high = contact_kernels.line(contact, rows[0].offset)
            if touch and j > i and travel >= 0.5 * _WINDOW * model.reach and low < 0.0 < high:
                twists, steps = _commands(episode.times[i : j + 1], robots[i : j + 1])
                start = rows[0].row()
                start[5] = 0.0
                end = (rows[-1].offset, rows[-1].angle)
                uniform = contact.spread
                found.append(_Piece(contact, model.reach, start, twists, steps, end, uniform))
            i = max(j, i + 1)
    return found


def _alone(episode: Episode, k: int) -> FloatArray:
    """(T + 1,) whether nothing but the robot can touch object ``k``."""
    poses, radii = episode.object_poses[:, :, :2], episode.world.movables.radii
    away = np.hypot(*np.moveaxis(poses - poses[:, k : k + 1], 2, 0))  # (T + 1, K)
    near = away < 1.02 * (radii[k] + radii)
    near[:, k] = False
    alone: FloatArray = ~near.any(axis=1)
    return alone


def _commands(times: FloatArray, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Speeds and turn rates (N, 2) of arcs from pose to pose, and how long each took (N,) [s]."""
    steps = np.diff(times)
    turns = np.array([math.remainder(t, math.tau) for t in np.diff(poses[:, 2]).tolist()])
    moves = np.diff(poses[:, :2], axis=0)
    half = 0.5 * turns
    middle = poses[:-1, 2] + half
    chord = moves[:, 0] * np.cos(middle) + moves[:, 1] * np.sin(middle)
    bulge = np.where(np.abs(half) > 1e-9, half / np.where(half == 0.0, 1.0, np.sin(half)), 1.0)
    return np.stack([chord * bulge / steps, turns / steps], axis=1), steps


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the friction of recorded episodes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", metavar="EPISODE", help="as `Episode.save` writes them")
    options = parser.parse_args(arguments)
    try:
        fit = identify([Episode.load(path) for path in options.files])
    except PushplanError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    found = fit.parameters
    sys.stdout.write(
        f"friction {found.friction:.3f} ± {fit.friction_error:.3f}\n"
        f"spread   {found.spread:.2f} ± {fit.spread_error:.2f}\n"
        f"{fit.windows} pieces of pushes, rms error {fit.rms:.4f}\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
