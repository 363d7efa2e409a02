"""Goals of the robot, or of what it pushes."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveFloat, Shape
from pushplan.world.checks import ArrayRecord, BoolArray, FloatArray, IntArray, array, frozen
from pushplan.world.outline import convex_outline, next_corner, signed_area

if TYPE_CHECKING:
    from pushplan.world.movables import Movables

_MOST_TURN = 1e3
"""Of a heading [rad]; beyond it rounding takes too much of it."""
Point = Annotated[FloatArray, Shape(2)]


@dataclass(frozen=True, eq=False)
class GoalDisc(ArrayRecord, CheckedFields):
    """Reached when the robot's origin is within ``radius`` of ``center``.

    Args:
        center: (2,) x, y [m], world frame.
        radius: [m], positive.
    """

    field_prefix = "goal."

    center: Point
    radius: PositiveFloat

    def distance(self, x: float, y: float) -> float:
        """Straight distance [m] from a point to the nearest point that counts, 0 inside."""
        gap = float(np.hypot(x - self.center[0], y - self.center[1])) - self.radius
        return max(0.0, gap)

    def contains(self, points: FloatArray) -> BoolArray:
        """Check which of the (..., 2) points [m] count as the goal."""
        offset = points - self.center
        inside: BoolArray = np.hypot(offset[..., 0], offset[..., 1]) <= self.radius
        return inside

    def reached_by(self, pose: FloatArray) -> bool:
        """True if a robot at a pose (3,) x, y [m], theta [rad] is at the goal."""
        return self.distance(float(pose[0]), float(pose[1])) == 0.0


@dataclass(frozen=True, eq=False)
class GoalPose(GoalDisc):
    """A disc in which the robot has to face a heading.

    Args:
        center: (2,) x, y [m], world frame.
        radius: tolerance of the position [m], positive.
        heading: direction of the robot's x axis [rad], world frame.
        heading_tolerance: to either side [rad], positive, at most π.
    """

    heading: Annotated[float, Limits(-_MOST_TURN, _MOST_TURN)]
    heading_tolerance: Annotated[float, Limits(0.0, math.pi, open_low=True)]

    @property
    def pose(self) -> FloatArray:
        """(3,) x, y [m], theta [rad] in the middle of the tolerances."""
        return np.append(self.center, self.heading)

    def heading_error(self, heading: float) -> float:
        """Turn [rad] from a heading to that of the goal, positive to the left, at most π."""
        return math.remainder(self.heading - heading, math.tau)

    def reached_by(self, pose: FloatArray) -> bool:
        """True if a robot at a pose (3,) x, y [m], theta [rad] is within both tolerances."""
        turned = abs(self.heading_error(float(pose[2]))) <= self.heading_tolerance
        return turned and super().reached_by(pose)

    def arrow(self, length: float) -> FloatArray:
        """(3, 2) corners of an arrow head [m] from the middle along the heading, to draw it."""
        ahead = length * np.array([np.cos(self.heading), np.sin(self.heading)])
        aside = 0.35 * np.array([-ahead[1], ahead[0]])
        return np.array([self.center + aside, self.center - aside, self.center + ahead])


@dataclass(frozen=True, eq=False)
class GoalLine(ArrayRecord, CheckedFields):
    """Reached when the robot's origin is on or beyond a line.

    Args:
        point: (2,) any point of the line [m], world frame.
        normal: (2,) direction in which the line is crossed; stored with unit length.
    """

    field_prefix = "goal."

    point: Point
    normal: Point

    def __post_init__(self) -> None:
        super().__post_init__()
        length = float(np.hypot(self.normal[0], self.normal[1]))
        if length == 0.0:
            raise InvalidInputError("goal.normal must not be zero")
        if abs(length - 1.0) > 1e-12:  # dividing a unit vector again could change its last digit
            unit = array("goal.normal", self.normal / length, (2,))
            object.__setattr__(self, "normal", unit)

    def distance(self, x: float, y: float) -> float:
        """Straight distance [m] from a point to the line, 0 on it or beyond."""
        return max(0.0, float(np.dot(self.point - np.array([x, y]), self.normal)))

    def contains(self, points: FloatArray) -> BoolArray:
        """Check which of the (..., 2) points [m] are on the line or beyond."""
        beyond: BoolArray = (points - self.point) @ self.normal >= 0.0
        return beyond

    def reached_by(self, pose: FloatArray) -> bool:
        """True if a robot at a pose (3,) x, y [m], theta [rad] is on the line or beyond."""
        return self.distance(float(pose[0]), float(pose[1])) == 0.0


class _AreaGoal(ArrayRecord, ABC):
    """A goal that objects share: an area that they have to be in, or off."""

    def done(self, movables: Movables) -> BoolArray:
        """(K,) which objects, as drawn, are where they should be."""
        return movables.within(self.contains_each)

    def contains(self, outline: FloatArray) -> bool:
        """True if an object with this convex outline, (N, 2) corners [m], is where it should be."""
        return bool(self.contains_each(outline, np.array([0, len(outline)]))[0])

    @abstractmethod
    def contains_each(self, vertices: FloatArray, offsets: IntArray) -> BoolArray:
        """(K,) which of several objects are where they should be.

        Args:
            vertices: (V, 2) convex counter-clockwise outlines [m], world frame, flattened.
            offsets: (K + 1,) where each outline starts.
        """


@dataclass(frozen=True, eq=False)
class Receptacle(_AreaGoal):
    """An object is delivered when all its corners are inside ``polygon``.

    Args:
        polygon: convex (N, 2) corners [m], world frame.
    """

    polygon: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "polygon", convex_outline("goal.polygon", self.polygon))

    def contains_each(self, vertices: FloatArray, offsets: IntArray) -> BoolArray:
        """(K,) which of several objects are delivered; a corner on the polygon's edge is inside."""
        if len(offsets) == 1:
            return np.zeros(0, dtype=bool)
        edge = np.roll(self.polygon, -1, axis=0) - self.polygon  # (N, 2)
        x, y = (vertices[:, None] - self.polygon).transpose(2, 0, 1)  # (V, N)
        inside = (edge[:, 0] * y - edge[:, 1] * x >= 0.0).all(axis=1)
        all_inside: BoolArray = np.logical_and.reduceat(inside, offsets[:-1])
        return all_inside


@dataclass(frozen=True, eq=False)
class ClearanceArea(_AreaGoal):
    """An object is cleared when its outline no longer touches ``polygon``.

    Args:
        polygon: convex (N, 2) corners [m], world frame; kept counter-clockwise.
        open_edges: (N,) flags of the edges from corner i to i + 1 that can be crossed; kept with
            their edges where corners are left out or turned round.
    """

    polygon: FloatArray
    open_edges: BoolArray

    def __post_init__(self) -> None:
        given = array("goal.polygon", self.polygon, (None, 2))
        polygon = convex_outline("goal.polygon", given)
        if (given[0] == given[-1]).all():
            given = given[:-1]
        edges = array("goal.open_edges", self.open_edges, (len(given),), dtype=np.bool_)
        if not np.array_equal(given, polygon):
            # of a repeated corner the last one is kept, so its edge is the one with a length
            last = {(x, y): i for i, (x, y) in enumerate(given.tolist())}
            at = [last[x, y] for x, y in polygon.tolist()]
            turned = signed_area(given) < 0.0
            edges = frozen(edges[np.array(at) - (1 if turned else 0)])
        object.__setattr__(self, "polygon", polygon)
        object.__setattr__(self, "open_edges", edges)

    def contains_each(self, vertices: FloatArray, offsets: IntArray) -> BoolArray:
        """(K,) which of several objects are cleared: some edge's line separates them strictly."""
        if len(offsets) == 1:
            return np.zeros(0, dtype=bool)
        starts = offsets[:-1]
        after = next_corner(offsets)
        mine = _gaps(self.polygon, np.roll(self.polygon, -1, axis=0), vertices)  # (V, N)
        from_area = np.minimum.reduceat(mine, starts).max(axis=1)  # (K,)
        theirs = _gaps(vertices, vertices[after], self.polygon).min(axis=0)  # (V,)
        cleared: BoolArray = np.maximum(from_area, np.maximum.reduceat(theirs, starts)) > 0.0
        return cleared


def _gaps(a: FloatArray, b: FloatArray, points: FloatArray) -> FloatArray:
    """(P, E) distance [m] of each of (P, 2) points in front of each edge from (E, 2) a to b."""
    nx = b[:, 1] - a[:, 1]
    ny = a[:, 0] - b[:, 0]
    length = np.sqrt(nx * nx + ny * ny)
    x, y = (points[:, None] - a).transpose(2, 0, 1)
    gaps: FloatArray = x * (nx / length) + y * (ny / length)
    return gaps


@dataclass(frozen=True, eq=False)
class ObjectGoals(ArrayRecord, CheckedFields):
    """A place for each of some objects; the others may be anywhere in the end.

    Args:
        ids: (G,) the objects, by their distinct ids.
        poses: (G, 3) where each belongs: x, y [m], theta [rad], world frame.
        radii: (G,) tolerances of the positions [m], positive.
        heading_tolerances: (G,) to either side [rad], positive, at most π, which takes any heading.
        symmetries: (G,) how many headings, evenly spread over a turn, are the same to each object:
            4 for a square without a front; 1 for all by default.
        groups: (G,) objects of one number may take one another's places; by default each has a
            number of its own.
        robot: where the robot has to be once all objects are done; anywhere if None.
    """

    field_prefix = "goal."

    ids: Annotated[IntArray, Shape("G")]
    poses: Annotated[FloatArray, Shape("G", 3)]
    radii: Annotated[FloatArray, Shape("G")]
    heading_tolerances: Annotated[FloatArray, Shape("G")]
    symmetries: Annotated[IntArray, Shape("G")] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    groups: Annotated[IntArray, Shape("G")] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    robot: GoalDisc | None = None

    def __post_init__(self) -> None:
        count = len(array("goal.ids", self.ids, (None,), dtype=np.int64))
        if not count:
            raise InvalidInputError("goal.ids must name at least one object")
        for name, default in (("symmetries", np.ones(count)), ("groups", np.arange(count))):
            if getattr(self, name) is None or np.array_equal(getattr(self, name), []):
                object.__setattr__(self, name, default.astype(np.int64))
        super().__post_init__()
        if len(np.unique(self.ids)) != count:
            raise InvalidInputError(f"goal.ids must be distinct, got {self.ids.tolist()}")
        for name, low, high in (
            ("radii", 0.0, math.inf),
            ("heading_tolerances", 0.0, math.pi),
            ("symmetries", 0, 360),
        ):
            values = getattr(self, name)
            wrong = values[~((values > low) & (values <= high))]
            if len(wrong):
                most = f" and at most {high:g}" if high < math.inf else ""
                raise InvalidInputError(f"goal.{name} must be positive{most}, got {wrong[0]:g}")
        if (np.abs(self.poses[:, 2]) > _MOST_TURN).any():
            most = np.abs(self.poses[:, 2]).max()
            raise InvalidInputError(
                f"goal.poses must turn by at most {_MOST_TURN:g} rad, got {most:g}"
            )
        for group in np.unique(self.groups):
            own = self.symmetries[self.groups == group]
            if (own != own[0]).any():
                raise InvalidInputError(
                    f"goal.symmetries must be equal within group {group}, got {own.tolist()}"
                )

    @cached_property
    def places(self) -> tuple[GoalPose, ...]:
        """Each place as a goal pose."""
        rows = zip(self.poses, self.radii.tolist(), self.heading_tolerances.tolist(), strict=True)
        return tuple(GoalPose(pose[:2], radius, pose[2], turn) for pose, radius, turn in rows)

    def errors(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance [m] and least turn [rad], up to symmetry, from (..., 1 or G, 3) poses."""
        away = poses - self.poses
        step = math.tau / self.symmetries
        turns = np.abs(away[..., 2] - step * np.round(away[..., 2] / step))
        return np.hypot(away[..., 0], away[..., 1]), turns

    def assigned(self, ids: IntArray, poses: FloatArray) -> IntArray:
        """(K,) the place of each object, by its number in this goal; -1 for those without one.

        Within a group as many objects as possible are where they belong, and the sum of the other
        distances is the least.

        Args:
            ids: (K,) of the objects.
            poses: (K, 3) of them.
        """
        found = np.full(len(ids), -1)
        rows = {int(label): k for k, label in enumerate(ids)}
        for group in np.unique(self.groups):
            places = np.flatnonzero(self.groups == group)
            objects = [rows[label] for label in self.ids[places].tolist() if label in rows]
            if objects:
                distances, turns = (
                    values[:, places] for values in self.errors(poses[objects, None])
                )
                missed = (distances > self.radii[places]) | (
                    turns > self.heading_tolerances[places]
                )
                penalty = 1.0 + float(distances.sum())
                costs = np.where(missed, penalty + distances, 0.0)
                found[objects] = places[least_pairing(costs)]
        return found

    def reached(self, ids: IntArray, poses: FloatArray) -> BoolArray:
        """(K,) which objects are within the tolerances of their places, or have none."""
        at = self.assigned(ids, poses)
        done = at < 0
        k = np.flatnonzero(~done)
        distances, turns = self.errors(poses[k, None])
        chosen = np.arange(len(k)), at[k]
        done[k] = (distances[chosen] <= self.radii[at[k]]) & (
            turns[chosen] <= self.heading_tolerances[at[k]]
        )
        return done

    def left(self, ids: IntArray, poses: FloatArray) -> ObjectGoals | None:
        """The goal of the objects that are not at their places, without the places of the others.

        Args:
            ids: (K,) of the objects.
            poses: (K, 3) of them.
        """
        at = self.assigned(ids, poses)
        there = self.reached(ids, poses) & (at >= 0)
        objects = np.flatnonzero(~np.isin(self.ids, ids[there]))
        places = np.flatnonzero(~np.isin(np.arange(len(self.ids)), at[there]))
        if not len(objects):
            return None
        objects = objects[np.argsort(self.groups[objects], kind="stable")]
        places = places[np.argsort(self.groups[places], kind="stable")]
        names = ("poses", "radii", "heading_tolerances", "symmetries", "groups")
        of_places: dict[str, Any] = {name: getattr(self, name)[places] for name in names}
        return ObjectGoals(self.ids[objects], **of_places, robot=self.robot)

    def done(self, movables: Movables) -> BoolArray:
        """(K,) which objects are where they should be; those without a place are."""
        return self.reached(movables.ids, movables.poses)


def least_pairing(costs: FloatArray) -> IntArray:
    """(N,) column for each row of (N, M >= N) costs, so that their sum is least.

    Costs that are infinite are taken only where a row has no other column left.
    """
    if costs.shape[1] == 1:
        return np.zeros(len(costs), dtype=np.int64)
    from scipy.optimize import linear_sum_assignment  # takes longer than the rest of this room

    finite = np.isfinite(costs)
    most = 1.0 + 2.0 * float(np.abs(costs[finite]).sum())
    columns: IntArray = linear_sum_assignment(np.where(finite, costs, most))[1].astype(np.int64)
    return columns


NavigationGoal = GoalDisc | GoalLine
AreaGoal = Receptacle | ClearanceArea
ManipulationGoal = AreaGoal | ObjectGoals
Goal = NavigationGoal | ManipulationGoal
