"""`identify`: the parameters of a contact from observed pushes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pushplan.core import geometry
from pushplan.core import interaction as core
from pushplan.interaction.contact_parameters import ContactParameters
from pushplan.interaction.quasi_static import QuasiStatic
from pushplan.world import GoalDisc, InvalidInputError, Movables, RobotModel, StaticMap, World
from pushplan.world.checked_fields import CheckedFields, Shape
from pushplan.world.checks import ArrayRecord, FloatArray, expect
from pushplan.world.outline import convex_outline, transform

_ROUNDS = 4  # of draws; each but the first is centred on what the ones before have found
_DRAWS = 64  # of parameters in a round
_WIDER = 1.5  # deviation of a round's draws over that of the estimate [1]
_LEAST_DEVIATION = 0.02  # of a round's draws, of the logarithms
_STEPS_PER_RADIUS = 400.0  # of the predictions: small beside the misses of real pushes
_ROUNDING_M = 2e-4  # of logged places: zigzag of that size would reverse friction at each step
_EXACT = 1e-3  # miss of a perfect prediction, in radii of gyration
_COORDINATES = 2.0  # that count of an end's three, which go wrong together
_FEWEST = 3  # ends from which an overlap is taken
_FAR = 0.1  # gap after which a robot counts as having left the object, in radii of the object


@dataclass(frozen=True, eq=False)
class ObservedPush(ArrayRecord, CheckedFields):
    """One object that a robot has moved, and the path on which it did.

    Args:
        robot: what pushed; its footprint counts.
        outline: (V, 2) convex outline of the object, its centroid at the origin [m].
        robot_poses: (N, 3) x, y [m], theta [rad] of the robot from before or at the first contact
            to the end.
        object_before: (3,) pose of the object at the first of them.
        object_after: (3,) the same at the last of them.
        static: walls that the object may have touched; none if None.

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

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "outline", convex_outline("push.outline", self.outline))
        if len(self.robot_poses) < 2:
            raise InvalidInputError(
                f"push.robot_poses must hold at least two poses, got {len(self.robot_poses)}"
            )

    def world(self) -> World:
        """The scene before the push."""
        static = self.static
        start = self.robot_poses[0]
        if static is None:
            static = StaticMap.build(bounds=(*(start[:2] - 1e4), *(start[:2] + 1e4)))
        objects = Movables.from_outlines([self.outline], [self.object_before])
        goal = GoalDisc(start[:2], 1.0)  # a world needs one
        return World(self.robot, start, static, objects, goal)

    def path(self) -> FloatArray:
        """(M, 3) robot poses without the zigzag of rounded coordinates."""
        return _simplified(self.robot_poses, self.robot.circumscribed_radius)

    def miss(self, end: FloatArray) -> float:
        """Distance of a predicted pose (3,) from `object_after` [m].

        The difference of the headings counts with the radius of gyration of the outline.
        """
        turn = math.remainder(float(end[2] - self.object_after[2]), math.tau)
        distance = math.dist(end[:2], self.object_after[:2])
        return distance + math.sqrt(geometry.polygon_inertia(self.outline)) * abs(turn)

    def predicted(self, model: QuasiStatic) -> FloatArray:
        """(3,) pose of the object at the end by a model."""
        end: FloatArray = model.sweep(self.world(), self.path()).object_poses[-1, 0]
        return end


def identify(
    pushes: Sequence[ObservedPush], prior: ContactParameters | None = None
) -> ContactParameters:
    """Find friction and pressure from observed pushes.

    Parameters are drawn from the prior, then from ever better approximations of the posterior
    (adaptive importance sampling, Bugallo et al. 2017). The misses of the predicted ends are
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
    overlap, deviation = _overlap(pushes)
    start = ContactParameters(overlap=overlap)
    misses = _Misses(pushes, start)
    free = 3 if misses.depend_on_walls(prior) else 2
    rng = np.random.default_rng(0)
    mean = np.log(prior.values)
    spread = prior.log_covariance
    draws = np.zeros((0, free))
    heights = np.zeros(0)
    densities = []
    centre = mean[:free]
    width = spread[:free, :free]
    for _ in range(_ROUNDS):
        densities.append((centre, width))
        root = np.linalg.cholesky(width)
        new = centre + rng.standard_normal((_DRAWS, free)) @ root.T
        values = np.exp(np.column_stack([new, np.full((_DRAWS, 3 - free), mean[free:])]))
        height = [misses.log_likelihood(*row) for row in values.tolist()]
        draws = np.vstack([draws, new])
        heights = np.append(heights, height + _log_normal(new, mean[:free], spread[:free, :free]))
        mixture = np.logaddexp.reduce([_log_normal(draws, *one) for one in densities])
        weights = np.exp(heights - mixture - (heights - mixture).max())
        weights /= weights.sum()
        found = weights @ draws
        off = draws - found
        covariance = (weights[:, None] * off).T @ off
        width = _WIDER**2 * covariance + _LEAST_DEVIATION**2 * np.eye(free)
        centre = found
    total = np.array(spread)
    total[:free, :free] = covariance
    total[:free, free:] = total[free:, :free] = 0.0
    best = np.append(found, mean[free:])
    values = np.exp(best)
    friction, scale, static_friction = values.tolist()
    return ContactParameters(
        friction=friction,
        gyration_scale=scale,
        static_friction=static_friction,
        log_covariance=total,
        overlap=overlap,
        overlap_deviation=deviation,
        miss=float(misses.of(friction, scale, static_friction).mean()),
        pushes=len(pushes),
        saw_walls=free == 3,
    )


class _Misses:
    """How far predicted ends of pushes are from the observed ones, as a function of parameters."""

    def __init__(self, pushes: Sequence[ObservedPush], overlap: ContactParameters) -> None:
        self._pushes = pushes
        self._paths = [push.path() for push in pushes]
        groups: dict[object, World] = {}  # pushes that share shapes and walls share a model
        self._keys = []
        for push in pushes:
            key = (id(push.robot), push.outline.tobytes(), id(push.static))
            if key not in groups:
                world = push.world()
                groups[key] = World(
                    overlap.fitted(world.robot),
                    world.robot_pose,
                    world.static,
                    world.movables,
                    world.goal,
                )
            self._keys.append(key)
        self._groups = groups
        lengths = [math.sqrt(geometry.polygon_inertia(push.outline)) for push in pushes]
        self._exact = _EXACT * float(np.mean(lengths))

    def of(self, friction: float, scale: float, static_friction: float) -> FloatArray:
        """Return (P,) misses [m]."""
        model = QuasiStatic(friction, scale, static_friction=static_friction)
        compiled = {}
        for key, world in self._groups.items():
            step = float(world.movables.radii[0]) / _STEPS_PER_RADIUS
            settings = model.settings(world)._replace(max_step=step)
            compiled[key] = core.QuasiStatic(model.bodies(world), *settings)
        found = np.empty(len(self._pushes))
        for k, (push, path) in enumerate(zip(self._pushes, self._paths, strict=True)):
            out = np.empty((len(path), 1, 3))
            compiled[self._keys[k]].sweep(path, push.object_before[None].copy(), out)
            found[k] = push.miss(out[-1, 0])
        return found

    def log_likelihood(self, *values: float) -> float:
        """Up to a constant: Laplace, with the scale integrated out."""
        misses = self.of(*values) + self._exact
        return -_COORDINATES * len(misses) * math.log(float(misses.sum()))

    def depend_on_walls(self, prior: ContactParameters) -> bool:
        """Return True if friction at walls changes a prediction."""
        if all(push.static is None for push in self._pushes):
            return False
        friction, scale, _ = prior.values.tolist()
        change = np.abs(self.of(friction, scale, 0.0) - self.of(friction, scale, 1.0))
        return bool(change.max() > self._exact)


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
        gap = min(max(_gap(outline, part), _gap(part, outline)) for part in parts)
        if gap < _FAR * float(np.hypot(*push.outline.T).max()):
            found.append(-gap)
    if len(found) < _FEWEST:
        return 0.0, 0.0
    middle = float(np.median(found))
    spread = 1.4826 * float(np.median(np.abs(np.array(found) - middle)))
    return middle, 1.2533 * spread / math.sqrt(len(found))  # of a median of normal values


def _gap(a: FloatArray, b: FloatArray) -> float:
    """The widest gap from an edge of ``a`` to ``b`` [m]; both counter-clockwise."""
    edges = np.roll(a, -1, axis=0) - a
    normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.hypot(*edges.T)[:, None]
    distances = np.einsum("ek,evk->ev", normals, b[None] - a[:, None])
    return float(distances.min(axis=1).max())


def _simplified(poses: FloatArray, radius: float) -> FloatArray:
    """Poses (N, 3) without those within a rounding of the straight line between others.

    Douglas and Peucker 1973; headings count by the motion of a corner of the robot.
    """
    points = np.column_stack([poses[:, :2], radius * np.unwrap(poses[:, 2])])
    kept = {0, len(points) - 1}
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        chord = points[last] - points[first]
        off = points[first + 1 : last] - points[first]
        along = np.clip(off @ chord / max(float(chord @ chord), 1e-30), 0.0, 1.0)
        far = np.linalg.norm(off - along[:, None] * chord, axis=1)
        worst = int(far.argmax())
        if far[worst] > _ROUNDING_M:
            middle = first + 1 + worst
            kept.add(middle)
            spans += [(first, middle), (middle, last)]
    return np.ascontiguousarray(poses[sorted(kept)])
