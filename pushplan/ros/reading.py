"""Conversion of ROS 2 messages, of `rosbags` or of `rclpy`, into the types of pushplan."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pushplan.world import Drive, InvalidInputError, Plan, PriceMap, RobotModel, StaticMap, Twist
from pushplan.world.checks import FloatArray, IntArray, array
from pushplan.world.polyline import arc_lengths, goes_back, path_length

_TILT = math.cos(math.radians(15.0))  # steepest floor that still counts as a plane
_ROUNDED = 0.999  # of the least time of a step: stamps and poses of a path are rounded
_STAMP = 1e-6  # error of the time between two stamps [s]
_UNKNOWN = 255  # an unknown cell, -1, as an unsigned byte
_LATERAL = 1e-6  # speed that counts as none [m/s, rad/s]


def time_from(message: Any) -> float:
    """Time of a message with a header [s]."""
    stamp = _header(message).stamp
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def frame_of(message: Any) -> str:
    """The frame that a message with a header is in."""
    return str(_header(message).frame_id)


def pose_from(message: Any, frame: str | None = None) -> FloatArray:
    """(3,) x, y [m], theta [rad] of a ``Pose``, or of a message that has one.

    Args:
        message: a ``Pose``, ``PoseStamped``, one with covariance, ``Odometry``, ``Marker``...
        frame: the frame that it has to be in; any if None.

    Raises:
        InvalidInputError: if it is another message, in another frame, tilted by more than 15
            degrees, or its quaternion has not the length 1.
    """
    _in_frame(message, frame)
    pose = message
    while hasattr(pose, "pose"):
        pose = pose.pose
    if _name(pose) != "geometry_msgs/Pose":
        raise _wrong(_name(message), "geometry_msgs/Pose, or one that has a pose")
    return array("pose", [pose.position.x, pose.position.y, _heading(pose.orientation)], (3,))


def path_from(message: Any, frame: str | None = None) -> tuple[FloatArray, FloatArray]:
    """Times (N,) [s] and poses (N, 3) of a ``nav_msgs/Path``.

    Args:
        message: the path. Poses without a frame of their own are in that of the path.
        frame: the frame that it has to be in; any if None.

    Raises:
        InvalidInputError: if it is another message, empty, in another frame, or a pose is refused
            by `pose_from`.
    """
    _expect(message, "nav_msgs/Path")
    if not message.poses:
        raise InvalidInputError("a path needs at least one pose, got none")
    own = frame_of(message)
    _in_frame(message, frame)
    for pose in message.poses:
        _in_frame(pose, own if frame_of(pose) else None)
    times: FloatArray = array("path times", [time_from(pose) for pose in message.poses], (None,))
    poses: FloatArray = array("path", [pose_from(pose) for pose in message.poses], (None, 3))
    return times, poses


def plan_from(message: Any, robot: RobotModel, frame: str | None = None) -> Plan:
    """A plan to follow from a ``nav_msgs/Path``.

    The stamps of the poses are the times if the robot can drive from pose to pose in them. In the
    paths of Nav2 they are not: each pose has the time at which its leg was planned. The robot then
    drives as fast as it can and turns no faster than it can.

    Args:
        message: the path.
        robot: who is to drive it.
        frame: the frame that it has to be in; any if None.

    Raises:
        InvalidInputError: as `path_from`.
    """
    times, poses = path_from(message, frame)
    steps, lengths, turns = _driven(poses, robot, backs_up=True)
    moving = steps > 0.0  # legs may be joined at a pose that is there twice
    stamped = np.diff(times)
    if (stamped[moving] >= _ROUNDED * steps[moving] - _STAMP).all():
        steps = np.maximum(stamped, steps)
    else:
        if robot.drive is Drive.DIFFERENTIAL:
            poses = _with_turns(poses)
        steps, lengths, turns = _driven(poses, robot, backs_up=False)
        moving = steps > 0.0
    rates = np.zeros((2, len(poses)))
    rates[:, :-1][:, moving] = np.stack([lengths, turns])[:, moving] / steps[moving]
    return Plan(
        times=np.concatenate([[0.0], np.cumsum(steps)]),
        poses=poses,
        speeds=rates[0],
        turn_rates=rates[1],
        travel_cost=robot.mass * path_length(poses),
    )


def _driven(
    poses: FloatArray, robot: RobotModel, *, backs_up: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least time [s], length, negative for back [m], and turn [rad] of each step of a path.

    Args:
        poses: (N, 3) of the path.
        robot: who drives it.
        backs_up: steps against the heading are driven back; without times the headings of a path
            may say nothing of that.
    """
    lengths = np.diff(arc_lengths(poses))
    turns = (np.diff(poses[:, 2]) + np.pi) % (2.0 * np.pi) - np.pi
    if robot.drive is Drive.CAR:
        turns[lengths == 0.0] = 0.0  # where legs are joined: it cannot turn on the spot
    fastest = np.full(len(lengths), robot.max_speed)
    if backs_up and robot.min_speed < 0.0:
        fastest[goes_back(poses, robot.circumscribed_radius)[:-1]] = robot.min_speed
    steps = np.maximum(lengths / np.abs(fastest), np.abs(turns) / robot.max_turn_rate)
    return steps, np.copysign(lengths, fastest), turns


def _with_turns(poses: FloatArray) -> FloatArray:
    """A path with a turn on the spot where it goes back by more than a right angle."""
    moves = np.diff(poses[:, :2], axis=0)
    driven = np.flatnonzero(moves.any(axis=1))
    headings = np.arctan2(moves[driven, 1], moves[driven, 0])
    sharp = (moves[driven][:-1] * moves[driven][1:]).sum(axis=1) < 0.0
    at = driven[1:][sharp]
    before = np.column_stack([poses[at, :2], headings[:-1][sharp]])
    turned = np.array(poses)
    turned[at, 2] = headings[1:][sharp]
    return np.insert(turned, at, before, axis=0)


def twist_from(message: Any) -> Twist:
    """The velocity in the body frame that a ``Twist`` or ``TwistStamped`` asks for.

    Raises:
        InvalidInputError: if it is another message, or asks for more than driving ahead and
            turning about z.
    """
    twist = _unstamped(message, "Twist")
    linear = twist.linear
    angular = twist.angular
    others = (linear.y, linear.z, angular.x, angular.y)
    if not max(abs(value) for value in others) <= _LATERAL:
        raise InvalidInputError(
            "a twist holds linear.x and angular.z alone, got linear.y, linear.z, angular.x, "
            f"angular.y = {', '.join(f'{value:g}' for value in others)}"
        )
    return Twist(linear.x, angular.z)


def polygon_from(message: Any, frame: str | None = None) -> FloatArray:
    """(N, 2) corners [m] of a ``PolygonStamped`` or ``Polygon``; heights do not count.

    Raises:
        InvalidInputError: if it is another message, or in another frame than ``frame``.
    """
    polygon = _unstamped(message, "Polygon")
    _in_frame(message, frame)
    corners = [[point.x, point.y] for point in polygon.points]
    return array("polygon", np.reshape(corners, (-1, 2)), (None, 2))


def static_map_from(
    message: Any, frame: str | None = None, *, occupied: int = 65, unknown: str = "obstacle"
) -> StaticMap:
    """The map of a ``nav_msgs/OccupancyGrid``; see `StaticMap.from_occupancy`.

    Raises:
        InvalidInputError: if it is another message, in another frame, its data have not the size
            that it states, or are refused.
    """
    cells, side, origin = _grid(message, frame)
    return StaticMap.from_occupancy(cells, side, origin, occupied=occupied, unknown=unknown)


def price_map_from(message: Any, frame: str | None = None, *, most: float) -> PriceMap:
    """The prices of a costmap of Nav2, which is a ``nav_msgs/OccupancyGrid``.

    What is lethal in it (100) is `static_map_from`'s, with ``occupied=100``.

    Args:
        message: the costmap.
        frame: the frame that it has to be in; any if None.
        most: see `PriceMap.from_costmap`.

    Raises:
        InvalidInputError: as `static_map_from`.
    """
    cells, side, origin = _grid(message, frame)
    return PriceMap.from_costmap(cells, side, origin, most=most)


def _grid(message: Any, frame: str | None) -> tuple[IntArray, float, FloatArray]:
    """(rows, columns) cells, their side [m], and (3,) their origin.

    Some bridges and logs show the bytes of the cells as unsigned: 255 is then an unknown cell.
    """
    _expect(message, "nav_msgs/OccupancyGrid")
    _in_frame(message, frame)
    height = int(message.info.height)
    width = int(message.info.width)
    data = message.data
    if isinstance(data, bytes | bytearray):
        data = memoryview(data)
    cells = np.asarray(data)
    odd = cells
    if cells.dtype.kind in "iu":
        odd = cells[(cells < -1) | ((cells > 100) & (cells != _UNKNOWN))]
    if odd.size:
        raise InvalidInputError(
            f"an OccupancyGrid holds whole numbers: -1 or, unsigned, {_UNKNOWN} for unknown, else "
            f"0 to 100 [%], got {odd.flat[0]}"
        )
    cells = np.where(cells == _UNKNOWN, -1, cells.astype(np.int64))
    if height * width != len(cells):
        raise InvalidInputError(
            f"an OccupancyGrid of height {height} and width {width} needs {height * width} cells, "
            f"got {len(cells)}"
        )
    side = float(str(np.float32(message.info.resolution)))  # 0.05 is meant, not 0.0500000007
    origin = pose_from(message.info.origin)
    return cells.reshape(height, width), side, origin


def _heading(q: Any) -> float:
    """Heading [rad] of a quaternion."""
    x = q.x
    y = q.y
    z = q.z
    w = q.w
    given = f"x, y, z, w = {x:g}, {y:g}, {z:g}, {w:g}"
    if not abs(math.sqrt(x * x + y * y + z * z + w * w) - 1.0) <= 1e-3:
        raise InvalidInputError(f"a quaternion must have length 1, got {given}")
    if 1.0 - 2.0 * (x * x + y * y) < _TILT:
        raise InvalidInputError(
            f"poses lie in the ground plane, got one tilted by more than 15 degrees: {given}"
        )
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _name(message: Any) -> str:
    """``package/Name`` of a message of `rosbags` or `rclpy`, or what it is instead."""
    kind = type(message)
    if hasattr(kind, "__msgtype__"):
        return str(kind.__msgtype__).replace("/msg/", "/")
    return f"{kind.__module__.partition('.')[0]}/{kind.__name__}"


def _wrong(name: str, wanted: str) -> InvalidInputError:
    return InvalidInputError(f"this takes a message {wanted}, got {name}")


def _expect(message: Any, wanted: str) -> None:
    if _name(message) != wanted:
        raise _wrong(_name(message), wanted)


def _unstamped(message: Any, kind: str) -> Any:
    """A message of ``geometry_msgs``, out of its form with a stamp if it has that."""
    name = _name(message)
    if name not in (f"geometry_msgs/{kind}", f"geometry_msgs/{kind}Stamped"):
        raise _wrong(name, f"geometry_msgs/{kind} or {kind}Stamped")
    return getattr(message, kind.lower(), message)


def _header(message: Any) -> Any:
    if not hasattr(message, "header"):
        raise _wrong(_name(message), "with a header")
    return message.header


def _in_frame(message: Any, frame: str | None) -> None:
    if frame is not None and frame_of(message) != frame:
        raise InvalidInputError(
            f"a message must be in frame {frame!r}, got one in {frame_of(message)!r}: transform it"
        )
