"""`identify`: the parameters of a contact from pushes, and `find_pushes` in a log."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Annotated

import numpy as np

from pushplan.core import interaction as core
from pushplan.geometry import convex_penetration, gyration_squares
from pushplan.interaction.contact_parameters import ContactParameters
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import (
    Episode,
    GoalDisc,
    InvalidInputError,
    Movables,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.checked_fields import CheckedFields, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, IntArray, expect
from pushplan.world.outline import convex_outline, transform

_ROUNDS = 5  # of draws; each but the first is centred on what the ones before have found
_DRAWS = 48  # of parameters in a round
_EFFECTIVE = 12.0  # draws that count: fewer would let a round collapse onto one of them
_FLATTER = 0.8  # factor on the logarithms of weights where too few count
_WIDER = 1.5  # deviation of a round's draws over that of the estimate [1]
_CERTAIN = 1e-6  # deviation of a logarithm that a prior gives as 0
_LEAST_DEVIATION = 0.02  # of a round's draws, of the logarithms
_STEPS_PER_RADIUS = 200.0  # of predictions: small beside the misses of real pushes
_FLOOR_M = 1e6  # half side of a floor without walls
_ROUNDING_M = 2e-4  # of logged places: zigzag of that size would reverse friction at each step
_EXACT = 1e-3  # miss of a perfect prediction, in radii of gyration
_COORDINATES = 2.0  # that count of an end's three, which go wrong together
_FEWEST = 3  # ends from which an overlap is taken
_FAR = 0.2  # gap at which a robot has left the object, in radii of gyration
_MOVING = 1e-3  # motion between two records that is no noise, in radii of the object
_NOISE = 3.0  # motion that is none, over that of the object while the robot is out of reach
_LEAST_PUSH = 0.05  # motion of the object in a push, in its radii: less says nothing
_LONGEST_PUSH = 1.0  # drive of the robot after which a push is cut, in radii of the object
_PAUSE = 2  # records of an object at rest that do not end a push
_REACH = 1.1  # distance of the robot at which it may touch, over the sum of the radii


@dataclass(frozen=True, eq=False)
class ObservedPush(ArrayRecord, CheckedFields):
    """One object that a robot has moved, and the path on which it did.

    Args:
        robot: what pushed; its footprint counts.
        outline: (V, 2) convex outline of the object, or its hull, in its body frame [m].
        robot_poses: (N, 3) x, y [m], theta [rad] of the robot from before or at the first contact
            to the end.
        object_before: (3,) pose of the object at the first of them.
        object_after: (3,) the same at the last of them.
        static: walls that the object may have touched; none if None.
        movable: the one object itself, where it is more than its outline, which then has its
            centroid at the origin; wherever it is.

    Raises:
        InvalidInputError: if a value has the wrong shape or is not finite, or there are fewer than
            two robot poses.
    """

    field_prefix = "push."

    robot: RobotModel
    outline: Annotated[FloatArray, Shape(None, 2)]
    robot_poses: Annotated[FloatArray, Shape(None, 3)]
    object_before: Annotated[FloatArray, Shape(3)]
    object_after: Annotated[FloatArray, Shape(3)]
    static: StaticMap | None = None
    movable: Movables | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "outline", convex_outline("push.outline", self.outline))
        if self.movable is None:
            made = Movables.from_outlines([self.outline], np.zeros((1, 3)))
            object.__setattr__(self, "movable", made)
        elif len(self.movable) != 1:
            raise InvalidInputError(f"push.movable must be one object, got {len(self.movable)}")
        if len(self.robot_poses) < 2:
            raise InvalidInputError(
                f"push.robot_poses must hold at least two poses, got {len(self.robot_poses)}"
            )

    @cached_property
    def gyration(self) -> float:
        """Radius of gyration of the object [m]."""
        assert self.movable is not None
        return math.sqrt(gyration_squares(self.movable)[0])

    def world(self) -> World:
        """The scene before the push."""
        static = self.static
        start = self.robot_poses[0]
        if static is None:
            static = _open_floor()
        assert self.movable is not None
        objects = self.movable.moved_to([self.object_before])
        goal = GoalDisc(start[:2], 1.0)  # a world needs one
        return World(self.robot, start, static, objects, goal)

    def path(self) -> FloatArray:
        """(M, 3) robot poses without the zigzag of rounded coordinates."""
        from shapely import LineString

        x, y, theta = self.robot_poses.T
        reach = self.robot.circumscribed_radius  # the foremost point shows every turn as well
        rows = np.arange(len(theta))
        line = np.column_stack([x + reach * np.cos(theta), y + reach * np.sin(theta), rows])
        kept = np.array(LineString(line).simplify(_ROUNDING_M, preserve_topology=False).coords)
        return self.robot_poses[kept[:, 2].astype(np.int64)]

    def miss(self, end: FloatArray) -> float:
        """Distance of a predicted pose (3,) from `object_after` [m].

        The difference of the headings counts with the radius of gyration of the outline.
        """
        turn = math.remainder(float(end[2] - self.object_after[2]), math.tau)
        return math.dist(end[:2], self.object_after[:2]) + self.gyration * abs(turn)

    def predicted(self, model: QuasiStatic) -> FloatArray:
        """(3,) pose of the object at the end by a model."""
        end: FloatArray = model.sweep(self.world(), self.path()).object_poses[-1, 0]
        return end


@cache
def _open_floor() -> StaticMap:
    return StaticMap.build(bounds=(-_FLOOR_M, -_FLOOR_M, _FLOOR_M, _FLOOR_M))


def identify(
    pushes: Sequence[ObservedPush], prior: ContactParameters | None = None
) -> ContactParameters:
    """Find friction and pressure from observed pushes.

    Parameters are drawn from the prior, then from ever better approximations of the posterior
    (adaptive importance sampling). The misses of the predicted ends are
    Laplace distributed, with an unknown scale that is integrated out, so that a few pushes that
    went wrong count little. Deterministic.

    Args:
        pushes: of one kind of object, by one robot, on one floor.
        prior: what is known before; the defaults of `ContactParameters` if None.

    Raises:
        InvalidInputError: if there is no push.
    """
    pushes = [expect(f"pushes[{k}]", push, ObservedPush) for k, push in enumerate(pushes)]
    if not pushes:
        raise InvalidInputError("pushes must hold at least one push, got none")
    prior = prior or ContactParameters()
    overlap, overlap_deviation = _overlap(pushes)
    misses = _Misses(pushes, overlap)
    free = 3 if misses.depend_on_walls(prior) else 2
    rng = np.random.default_rng(0)
    start = np.log(prior.values)
    mean = start[:free]
    spread = prior.log_covariance[:free, :free] + _CERTAIN**2 * np.eye(free)
    proposals = [(mean, spread)]
    draws = np.zeros((0, free))
    heights = np.zeros(0)
    for _ in range(_ROUNDS):
        centre, width = proposals[-1]
        new = centre + rng.standard_normal((_DRAWS, free)) @ np.linalg.cholesky(width).T
        likely = [misses.log_likelihood(np.append(row, start[free:])) for row in new]
        draws = np.vstack([draws, new])
        heights = np.append(heights, likely + _log_normal(new, mean, spread))
        mixture = np.logaddexp.reduce([_log_normal(draws, *one) for one in proposals])
        weights = _weights(heights - mixture)
        found = weights @ draws
        off = draws - found
        covariance = (weights[:, None] * off).T @ off
        proposals.append((found, _WIDER**2 * covariance + _LEAST_DEVIATION**2 * np.eye(free)))
    best = np.append(found, start[free:])
    total = np.diag(np.diag(prior.log_covariance))
    total[:free, :free] = covariance
    return ContactParameters(
        *np.exp(best).tolist(),
        log_covariance=total,  # type: ignore[misc]
        overlap=overlap,
        overlap_deviation=overlap_deviation,
        miss=float(misses.of(best).mean()),
        pushes=len(pushes),
        saw_walls=free == 3,
    )


class _Misses:
    """Misses of the predicted ends of pushes, as a function of the parameters."""

    def __init__(self, pushes: Sequence[ObservedPush], overlap: float) -> None:
        robots: dict[int, RobotModel] = {}  # by identity: pushes that share one share its model
        correction = ContactParameters(overlap=overlap)
        self._scenes = []
        for push in pushes:
            if id(push.robot) not in robots:
                robots[id(push.robot)] = correction.fitted(push.robot)
            world = replace(push.world(), robot=robots[id(push.robot)])
            self._scenes.append((push, world, push.path()))
        self._exact = _EXACT * float(np.mean([push.gyration for push in pushes]))

    def of(self, logs: FloatArray) -> FloatArray:
        """Return (P,) misses [m] for the logarithms (3,) of the parameters."""
        friction, scale, static_friction = np.exp(logs).tolist()
        model = QuasiStatic(friction, scale, static_friction=static_friction)
        found = np.empty(len(self._scenes))
        for k, (push, world, path) in enumerate(self._scenes):
            step = float(world.movables.radii[0]) / _STEPS_PER_RADIUS
            settings = model.settings(world)._replace(max_step=step)
            out = np.empty((len(path), 1, 3))
            poses = world.movables.poses.copy()
            core.QuasiStatic(model.bodies(world), *settings).sweep(path, poses, out)
            found[k] = push.miss(poses[0])
        return found

    def log_likelihood(self, logs: FloatArray) -> float:
        """Up to a constant: Laplace, with the scale integrated out."""
        misses = self.of(logs) + self._exact
        return -_COORDINATES * len(misses) * math.log(float(misses.sum()))

    def depend_on_walls(self, prior: ContactParameters) -> bool:
        """Return True if friction at walls changes a prediction."""
        logs = np.log(prior.values)
        change = self.of(logs) - self.of(logs * [1.0, 1.0, 0.0])  # 0: a friction of 1
        return bool(np.abs(change).max() > self._exact)


def _weights(logs: FloatArray) -> FloatArray:
    """Return (N,) weights of sum 1, flattened until enough of the draws count."""
    while True:
        weights: FloatArray = np.exp(logs - logs.max())
        weights /= weights.sum()
        if not weights @ weights > 1.0 / _EFFECTIVE:
            return weights
        logs = _FLATTER * logs


def _log_normal(points: FloatArray, mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """(N,) logarithm of a normal density, up to a constant."""
    off = points - mean
    squares = (off * np.linalg.solve(covariance, off.T).T).sum(axis=1)
    density: FloatArray = -0.5 * (squares + np.linalg.slogdet(covariance)[1])
    return density


def _overlap(pushes: Sequence[ObservedPush]) -> tuple[float, float]:
    """Median overlap of robot and object where pushes end, and its deviation [m]."""
    found = []
    for push in pushes:
        outline = transform(push.object_after, push.outline)
        parts = [transform(push.robot_poses[-1], part) for part in push.robot.contact_parts]
        depth = max(convex_penetration(outline, part)[0] for part in parts)
        if depth > -_FAR * push.gyration:
            found.append(depth)
    if len(found) < _FEWEST:
        return 0.0, 0.0
    middle = float(np.median(found))
    spread = 1.4826 * float(np.median(np.abs(np.array(found) - middle)))
    return middle, 1.2533 * spread / math.sqrt(len(found))  # of a median of normal values


def find_pushes(episode: Episode, objects: Sequence[int] | None = None) -> list[ObservedPush]:
    """Find the intervals in which the robot alone moves one object.

    An object counts as pushed while it moves within reach of the robot and no other object moves;
    those on wheels are left out, as they roll on. Long pushes are cut, so that an early miss does
    not spoil what follows.

    Args:
        episode: what was recorded.
        objects: ids of those to look at; all if None.

    Raises:
        InvalidInputError: if there is no object of an id, or no push.
    """
    objects_there = expect("episode", episode, Episode).world.movables
    ids = objects_there.ids.tolist()
    for one in objects or ():
        if one not in ids:
            known = ", ".join(map(str, ids)) or "none"
            raise InvalidInputError(f"the log holds no object {one}, its objects: {known}")
    radii = objects_there.radii
    turns = np.diff(np.unwrap(episode.object_poses[..., 2], axis=0), axis=0)
    steps = np.linalg.norm(np.diff(episode.object_poses[..., :2], axis=0), axis=-1)
    steps += radii * np.abs(turns)
    gaps = np.linalg.norm((episode.object_poses - episode.robot_poses[:, None])[1:, :, :2], axis=-1)
    far = gaps > _REACH * (radii + episode.world.robot.circumscribed_radius)
    noise = np.zeros(len(ids))
    for k in np.flatnonzero(far.any(axis=0)).tolist():
        noise[k] = np.quantile(steps[far[:, k], k], 0.8)
    moving = ~far & (steps > np.maximum(_MOVING * radii, _NOISE * noise))
    alone = moving.sum(axis=1) == 1
    found: list[ObservedPush] = []
    for k, one in enumerate(ids):
        if (objects is None or one in objects) and not objects_there.wheeled[k]:
            pushed = np.flatnonzero(moving[:, k] & alone)
            for run in np.split(pushed, np.flatnonzero(np.diff(pushed) > _PAUSE + 1) + 1):
                found += _cut(episode, k, run)
    if not found:
        raise InvalidInputError(
            "the log holds no push: no object without wheels was moved by the robot alone, by more "
            f"than {_LEAST_PUSH:g} of its radius"
        )
    return found


def _cut(episode: Episode, k: int, steps: IntArray) -> Iterator[ObservedPush]:
    """Pushes of object k within some steps from a record to the next, each short enough."""
    if not len(steps):
        return
    world = episode.world
    radius = float(world.movables.radii[k])
    robot = episode.robot_poses[steps[0] : steps[-1] + 2]
    objects = episode.object_poses[steps[0] : steps[-1] + 2, k]
    driven = np.append(0.0, np.linalg.norm(np.diff(robot[:, :2], axis=0), axis=1).cumsum())
    pieces = max(1, round(float(driven[-1]) / (_LONGEST_PUSH * radius)))
    cuts = np.searchsorted(driven, np.linspace(0.0, driven[-1], pieces + 1))
    for first, last in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        move = objects[last] - objects[first]
        moved = float(np.hypot(move[0], move[1])) + radius * abs(float(move[2]))
        if moved > _LEAST_PUSH * radius:
            yield ObservedPush(
                world.robot,
                world.movables.outline(k),
                robot[first : last + 1],
                objects[first],
                objects[last],
                world.static,
                world.movables.select([k]),
            )
