"""`World`: a frozen snapshot of everything that a planner may know, and its parts."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from pushplan.errors import InvalidInputError
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat, PositiveFloat, Shape
from pushplan.world.checks import ArrayRecord, BoolArray, FloatArray, array, number
from pushplan.world.goals import (
    AreaGoal,
    Goal,
    GoalPose,
    ManipulationGoal,
    NavigationGoal,
    ObjectGoals,
)
from pushplan.world.movables import Movables
from pushplan.world.outline import MOST_CORNERS, enclosing_outline, transform
from pushplan.world.robot import RobotModel
from pushplan.world.static_map import StaticMap

_MOST_PRICED = 99
"""Greatest value of a costmap that is a price: its inscribed cells [%]. 100 is lethal."""


@dataclass(frozen=True, eq=False)
class PriceMap(ArrayRecord, CheckedFields):
    """Prices of places, by the cell in which the robot's reference point is.

    A metre where the price is p counts as much as 1 + p metres elsewhere. `PushAware` and
    `KinodynamicRRT` minimise the sum; other planners do not read it.

    Args:
        prices: (rows, columns) at least 0, row 0 at the least y of the grid.
        resolution: side of a cell [m].
        origin: (3,) x, y [m], theta [rad] of the outer corner of cell (0, 0), world frame.

    Raises:
        InvalidInputError: if a price is negative, or a member has the wrong type or shape.
    """

    field_prefix = "price."

    prices: Annotated[FloatArray, Shape("rows", "columns")]
    resolution: PositiveFloat
    origin: Annotated[FloatArray, Shape(3)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.prices < 0.0).any():
            raise InvalidInputError(f"price.prices must not be negative, got {self.prices.min():g}")

    @classmethod
    def from_costmap(
        cls, grid: ArrayLike, resolution: float, origin: ArrayLike, *, most: float
    ) -> PriceMap:
        """Prices from a costmap of Nav2, as it publishes one as ``nav_msgs/OccupancyGrid``.

        Args:
            grid: (rows, columns) 0 to 100, -1 for unknown. Lethal (100) and unknown cells have no
                price: they are obstacles, which belong into a `StaticMap`.
            resolution: side of a cell [m].
            origin: (3,) as of the class.
            most: price of a cell of 99, from where the inscribed circle touches something.
        """
        cells = array("grid", grid, (None, None))
        wrong = cells[(cells < -1.0) | (cells > 100.0)]
        if len(wrong):
            raise InvalidInputError(f"grid must hold values from -1 to 100, got {wrong[0]:g}")
        priced = np.where((cells > 0) & (cells <= _MOST_PRICED), cells, 0)
        return cls(priced * (number("most", most, low=0.0) / _MOST_PRICED), resolution, origin)  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Unseen(ArrayRecord, CheckedFields):
    """Cells that no sensor has looked at. What stands there is not in the `World`.

    Args:
        cells: (rows, columns) True where nobody has looked, row 0 at the least y.
        resolution: side of a cell [m].
        origin: (2,) x, y [m] of the outer corner of cell (0, 0), world frame.

    Raises:
        InvalidInputError: if a member has the wrong type or shape.
    """

    field_prefix = "unseen."

    cells: Annotated[BoolArray, Shape("rows", "columns")]
    resolution: PositiveFloat
    origin: Annotated[FloatArray, Shape(2)]

    def centres(self, flags: BoolArray) -> FloatArray:
        """(N, 2) middles [m] of the cells that are flagged in (rows, columns)."""
        rows, columns = np.nonzero(flags)
        return self.origin + self.resolution * (np.column_stack([columns, rows]) + 0.5)


Triple = Annotated[FloatArray, Shape(3)]


@dataclass(frozen=True, eq=False)
class World(ArrayRecord, CheckedFields):
    """A scene at one instant, filled in by a simulator or by perception.

    SI units, radians, x forward and y left in body frames, one world frame for all poses.

    Args:
        robot: footprint, mass and limits.
        robot_pose: (3,) x, y [m], theta [rad].
        static: what never moves.
        movables: what may be pushed.
        goal: where the robot, or the objects, have to go.
        robot_twist: (3,) velocity in the world frame [m/s, m/s, rad/s]; at rest if None.
        time: [s].
        margin: distance that the robot keeps from what is static where it can [m]. A robot that
            is nearer may drive on and away; see `pushplan.motion.keep_out`.
        price: places that cost more to drive through. Files and logs leave it out.
        unseen: where nobody has looked yet; None where all is seen. Files and logs leave it out.

    Raises:
        InvalidInputError: if a member has the wrong type or shape or is not finite.
    """

    field_prefix = "world."

    robot: RobotModel
    robot_pose: Triple
    static: StaticMap
    movables: Movables
    goal: Goal
    robot_twist: Triple | None = None
    time: float = 0.0
    margin: NonNegativeFloat = 0.0
    price: PriceMap | None = None
    unseen: Unseen | None = None

    def __post_init__(self) -> None:
        if self.robot_twist is None:
            object.__setattr__(self, "robot_twist", np.zeros(3))
        super().__post_init__()
        if not isinstance(self.goal, Goal):
            raise InvalidInputError(
                "world.goal must be a GoalDisc, GoalPose, GoalLine, Receptacle, ClearanceArea or "
                f"ObjectGoals, got {type(self.goal).__name__}"
            )

    @property
    def goal_kind(self) -> Literal["robot", "objects"]:
        """Those who have to reach the goal."""
        if isinstance(self.goal, ManipulationGoal):
            return "objects"
        return "robot"

    @property
    def navigation_goal(self) -> NavigationGoal:
        """The goal, where it is one for the robot itself.

        Raises:
            InvalidInputError: if it is a goal for the objects.
        """
        if not isinstance(self.goal, NavigationGoal):
            raise self._needs("a goal for the robot (GoalDisc, GoalPose or GoalLine)")
        return self.goal

    def _needs(self, goal: str) -> InvalidInputError:
        return InvalidInputError(f"this needs {goal}, got {type(self.goal).__name__}")

    @property
    def place_goal(self) -> NavigationGoal:
        """The goal, where it is one for the robot itself that says nothing of its heading.

        Raises:
            InvalidInputError: if it is another one.
        """
        if isinstance(self.goal, GoalPose):
            raise InvalidInputError(
                "this goes to a GoalDisc or GoalLine at any heading, got a GoalPose; plan with "
                "straight, kinodynamic-rrt or push-aware"
            )
        return self.navigation_goal

    @property
    def manipulation_goal(self) -> ManipulationGoal:
        """The goal, where it is one for the objects.

        Raises:
            InvalidInputError: if it is a goal for the robot.
        """
        if not isinstance(self.goal, ManipulationGoal):
            raise self._needs("a goal for the objects (Receptacle, ClearanceArea or ObjectGoals)")
        return self.goal

    @property
    def area_goal(self) -> AreaGoal:
        """The goal, where it is an area that the objects have to be in, or off.

        Raises:
            InvalidInputError: if it is another one.
        """
        if not isinstance(self.goal, AreaGoal):
            raise self._needs(
                "a goal for the objects that is an area (Receptacle or ClearanceArea)"
            )
        return self.goal

    @property
    def wanted(self) -> BoolArray:
        """(K,) whether the goal says anything of each object.

        Raises:
            InvalidInputError: if the goal is one for the robot.
        """
        goal = self.manipulation_goal
        if isinstance(goal, ObjectGoals):
            return np.isin(self.movables.ids, goal.ids)
        return np.ones(len(self.movables), dtype=np.bool_)

    @property
    def goal_polygons(self) -> tuple[FloatArray, ...]:
        """Convex polygons (N, 2) [m] that show a goal of the objects: its area, or their parts.

        Those of goals of the robot are none.
        """
        goal = self.goal
        if isinstance(goal, AreaGoal):
            return (goal.polygon,)
        if not isinstance(goal, ObjectGoals):
            return ()
        objects = self.movables
        rows = {label: k for k, label in enumerate(objects.ids.tolist())}
        return tuple(
            transform(pose, part)
            for label, pose in zip(goal.ids.tolist(), goal.poses, strict=True)
            if label in rows
            for part in objects.parts(rows[label])
        )

    @property
    def completed(self) -> BoolArray:
        """(K,) whether each object, as drawn, is where the goal wants it: delivered, or off.

        Raises:
            InvalidInputError: if the goal is one for the robot.
        """
        return self.manipulation_goal.done(self.movables)

    def believing(self, fixed: ArrayLike) -> World:
        """The same scene with the objects flagged in (K,) held not to move, and no others."""
        return replace(self, movables=self.movables.holding_fixed(fixed))

    def with_fixed_as_static(self) -> World:
        """The same scene with the objects that are held not to move among what is static."""
        fixed = self.movables.fixed
        if not fixed.any():
            return self
        solid = _with_objects(self.static, self.movables.select(fixed))
        return replace(self, static=solid, movables=self.movables.select(~fixed))

    def for_planning(self) -> World:
        """The same scene as planners take it: what is fixed is static, outlines have few corners.

        See `pushplan.world.outline.enclosing_outline`.
        """
        world = self.with_fixed_as_static()
        if max(map(len, world.static.polygons), default=0) > MOST_CORNERS:
            world = replace(world, static=_with_few_corners(world.static))
        if np.diff(world.movables.drawn_offsets).max(initial=0) > MOST_CORNERS:
            world = replace(world, movables=world.movables.with_few_corners())
        return world

    @property
    def goal_reached(self) -> bool:
        """True if the robot, or every object, is where the goal wants it.

        While there are places that nobody has seen, nobody knows that of an area.
        """
        if isinstance(self.goal, NavigationGoal):
            return self.goal.reached_by(self.robot_pose)
        if isinstance(self.goal, ObjectGoals):
            robot = self.goal.robot
            here = robot is None or robot.reached_by(self.robot_pose)
            if not here or not np.isin(self.goal.ids, self.movables.ids).all():
                return False
        elif self.unseen is not None and self.unseen.cells.any():
            return False
        return bool(self.completed.all())

    def robot_outline_world(self) -> tuple[FloatArray, ...]:
        """Footprint parts, each (N, 2) corners in the world frame [m]."""
        return tuple(transform(self.robot_pose, part) for part in self.robot.contact_parts)

    def moved(
        self,
        *,
        robot_pose: ArrayLike | None = None,
        robot_twist: ArrayLike | None = None,
        movable_poses: ArrayLike | None = None,
        time: float | None = None,
    ) -> World:
        """The same scene with the robot or the objects elsewhere, or at another time.

        Args:
            robot_pose: (3,) x, y [m], theta [rad]; where it is if None.
            robot_twist: (3,) velocity in the world frame [m/s, m/s, rad/s]; as it is if None.
            movable_poses: (K, 3) of the objects, which are at rest there; where they are if None.
            time: [s]; as it is if None.
        """
        changes: dict[str, Any] = {
            "robot_pose": robot_pose,
            "robot_twist": robot_twist,
            "time": time,
        }
        if movable_poses is not None:
            changes["movables"] = self.movables.moved_to(movable_poses)
        return replace(self, **{key: value for key, value in changes.items() if value is not None})

    def updated(
        self,
        objects: Movables,
        *,
        removed: ArrayLike = (),
        **moved: Any,
    ) -> World:
        """The same scene with some objects changed, added or removed, at the cost of a copy.

        Args:
            objects: those that have changed, and new ones, by their ids; see `Movables.updated`.
            removed: (R,) ids of objects that are gone.
            moved: ``robot_pose``, ``robot_twist`` and ``time``, as in `moved`.

        Raises:
            InvalidInputError: if an id in ``removed`` is unknown, or in ``objects`` too.
        """
        return replace(self.moved(**moved), movables=self.movables.updated(objects, removed))


@functools.lru_cache(maxsize=8)
def _with_objects(static: StaticMap, objects: Movables) -> StaticMap:
    """A map with objects among what is static; the same one for the same objects."""
    parts = [part for k in range(len(objects)) for part in objects.parts_world(k)]
    polygons = (*static.polygons, *parts)
    return StaticMap(polygons, static.segments, static.radii, static.bounds)


@functools.lru_cache(maxsize=8)
def _with_few_corners(static: StaticMap) -> StaticMap:
    polygons = tuple(map(enclosing_outline, static.polygons))
    return StaticMap(polygons, static.segments, static.radii, static.bounds)
