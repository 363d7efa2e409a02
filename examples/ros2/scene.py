"""`Scene`: a map, objects and odometry that come in as messages, as a `World`."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.perception import ObjectTracker
from pushplan.ros import frame_of, pose_from, price_map_from, static_map_from, time_from
from pushplan.world import (
    GoalDisc,
    InvalidInputError,
    Movables,
    PriceMap,
    RobotModel,
    StaticMap,
    World,
)
from pushplan.world.checks import FloatArray, expect
from pushplan.world.outline import transform

_AHEAD = 0.5  # by which stamps of objects may be ahead of the clock [s]
_LETHAL = 100  # value of a costmap's cells that are obstacles
_CUBE = 1  # type of a visualization_msgs/Marker whose outline is its scale


class NavigationError(Exception):
    """Why a goal cannot be served.

    Args:
        code: name of an error code of the action's result, such as ``TIMEOUT``, or ``CANCELED``.
        reason: in words.
    """

    def __init__(self, code: str, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class Scene:
    """The newest map, objects and pose of the robot. Its methods may be called by any thread.

    Args:
        robot: footprint, mass and limits.
        frame: of the world.
        pose_of: the pose (3,) in that frame of the frame of a ``std_msgs/Header``, at its stamp; it
            raises `InvalidInputError` where that is not known. Without it all messages have to be
            in ``frame``; maps have to in any case.
        margin: distance that plans keep from what is static [m].
        tracker: keeps identity and shape of the objects.
    """

    def __init__(
        self,
        robot: RobotModel,
        *,
        frame: str = "map",
        pose_of: Callable[[Any], FloatArray] | None = None,
        margin: float = 0.0,
        tracker: ObjectTracker | None = None,
    ) -> None:
        self.robot, self.frame, self.margin = expect("robot", robot, RobotModel), frame, margin
        self._pose_of = pose_of
        self._tracker = ObjectTracker() if tracker is None else tracker
        self._lock = threading.Lock()
        self._static: StaticMap | None = None
        self._price: PriceMap | None = None
        self._movables = Movables.empty()
        self._objects_at = -math.inf
        self._robot: tuple[FloatArray, FloatArray, float] | None = None

    def take_map(self, message: Any) -> None:
        """Take a ``nav_msgs/OccupancyGrid``; the same map again changes nothing."""
        static = static_map_from(message, self.frame)
        if static != self._static:
            self._static = static

    def take_costmap(self, message: Any, most: float) -> None:
        """Take a costmap of Nav2 as ``nav_msgs/OccupancyGrid``, in place of a map.

        Args:
            message: lethal cells (100) and unknown ones are obstacles, others have a price.
            most: price of a cell of 99; see `pushplan.world.PriceMap`.
        """
        static = static_map_from(message, self.frame, occupied=_LETHAL)
        price = price_map_from(message, self.frame, most=most)
        with self._lock:
            self._price = price
            if static != self._static:
                self._static = static

    def pose(self, message: Any) -> FloatArray:
        """(3,) pose in the world frame of a message with a header and a pose.

        Raises:
            InvalidInputError: if it has none, or its frame cannot be transformed.
        """
        return self.placed(pose_from(message)[None], message)[0]

    def placed(self, poses: FloatArray, message: Any) -> FloatArray:
        """Poses (N, 3) in the frame of a message, in the world frame."""
        frame = frame_of(message)
        if frame == self.frame:
            return poses
        if self._pose_of is None:
            raise InvalidInputError(
                f"a message must be in frame {self.frame!r}, got one in {frame!r}, and there is no "
                "tf2 to transform it"
            )
        origin = self._pose_of(message.header)
        return np.column_stack([transform(origin, poses[:, :2]), origin[2] + poses[:, 2]])

    def take_odometry(self, message: Any) -> None:
        """Take a ``nav_msgs/Odometry``, whose velocity is in the body frame."""
        pose, twist = self.pose(message), message.twist.twist
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y = float(twist.linear.x), float(twist.linear.y)
        velocity = np.array([c * x - s * y, s * x + c * y, float(twist.angular.z)])
        self._robot = pose, velocity, time_from(message)

    def take_objects(self, message: Any, now: float) -> None:
        """Take a ``visualization_msgs/MarkerArray``: all objects that are seen at one time.

        Args:
            message: a marker an object, by its ``id``: a cube, or the corners of an outline in
                order.
            now: when an array without markers was seen, and before which all others were [s].

        Raises:
            InvalidInputError: if it cannot be read, or was seen later than now.
        """
        outlines = [self._outline(marker) for marker in message.markers]
        stamp = max((time_from(marker) for marker in message.markers), default=now)
        ids = [int(marker.id) for marker in message.markers]
        if stamp > now + _AHEAD:
            raise InvalidInputError(
                f"objects must not be seen later than now, got {stamp - now:.3g} s later"
            )
        with self._lock:
            if now < self._objects_at:  # the clock has stepped back: the tracker begins anew
                self._tracker.reset()
            self._objects_at = now
            self._movables = self._tracker.update(outlines, stamp, ids)

    def _outline(self, marker: Any) -> FloatArray:
        if marker.type == _CUBE:
            box = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
            corners = 0.5 * box * [marker.scale.x, marker.scale.y]
        else:
            corners = np.reshape([[p.x, p.y] for p in marker.points], (-1, 2))
        return transform(self.pose(marker), corners)

    def world(self, goal: GoalDisc) -> World:
        """Everything as it is known now.

        Raises:
            NavigationError: while there is no map, or no odometry.
        """
        static, robot = self._static, self._robot
        if static is None:
            raise NavigationError("UNKNOWN", "no map has come in yet")
        if robot is None:
            raise NavigationError("TF_ERROR", "no odometry has come in yet")
        pose, twist, time = robot
        return World(
            robot=self.robot,
            robot_pose=pose,
            robot_twist=twist,
            static=static,
            movables=self._movables,
            goal=goal,
            time=time,
            margin=self.margin,
            price=self._price,
        )
