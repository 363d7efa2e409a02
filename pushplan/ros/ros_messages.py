"""`Messages`: what pushplan knows, as ROS 2 messages, whose classes need no ROS."""

from __future__ import annotations

import math
from array import array as machine_array
from functools import cache
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from pushplan.imports.on_demand import need
from pushplan.world import (
    InvalidInputError,
    MissingDependencyError,
    Plan,
    SchemaError,
    Twist,
    UnknownNameError,
)
from pushplan.world.checks import IntArray, array, expect, number, word

OWN_MESSAGES = {
    "pushplan_msgs/msg/World": "std_msgs/Header header\nstring json",
    "pushplan_msgs/msg/State": (
        "std_msgs/Header header\n"
        "float64 time\n"
        "float64[3] robot_pose\n"
        "float64[3] robot_twist\n"
        "int64[] ids\n"
        "float64[] object_poses\n"
        "string new_objects"
    ),
    "pushplan_msgs/msg/Command": (
        "std_msgs/Header header\n"
        "float64 time\n"
        "float64 linear\n"
        "float64 angular\n"
        "string status\n"
        "string reason\n"
        "float64 plan_age\n"
        "float64 world_age\n"
        "bool late\n"
        "float64 lateral"
    ),
    "pushplan_msgs/msg/Episode": "std_msgs/Header header\nstring json",
}
"""Messages of pushplan's logs, in which numbers are exact; a log holds their definitions."""


class MessageTypes(Protocol):
    """Gives the classes of messages by their names, such as ``nav_msgs/msg/Path``."""

    def __call__(self, name: str) -> Any:
        """The class of a message; it takes its fields by keyword.

        Raises:
            UnknownNameError: if there is no such message.
        """

    def cells(self, values: IntArray) -> Any:
        """A field ``int8[]`` from (N,) whole numbers of -128 to 127."""


class RosbagsTypes:
    """The messages of ROS 2 Jazzy in pure Python, and their CDR encoding.

    Raises:
        MissingDependencyError: if `rosbags` is not installed.
    """

    def __init__(self) -> None:
        self._store = _store()

    def __call__(self, name: str) -> Any:
        """See `MessageTypes`."""
        if name not in self._store.types:
            raise UnknownNameError("message", name, self._store.types)
        return self._store.types[name]

    def cells(self, values: IntArray) -> Any:
        """See `MessageTypes`."""
        return np.ascontiguousarray(values, dtype=np.int8)

    def serialize(self, message: Any) -> bytes:
        """The CDR bytes of a message of these classes, little-endian."""
        return bytes(self._store.serialize_cdr(message, message.__msgtype__))

    def deserialize(self, data: bytes, name: str) -> Any:
        """The message of that name that the CDR bytes hold.

        Raises:
            SchemaError: if they hold none.
            UnknownNameError: if there is no such message.
        """
        self(name)
        try:
            return self._store.deserialize_cdr(data, name)
        except Exception as error:  # of several kinds, by where the bytes end
            raise SchemaError(f"{len(data)} bytes are no {name}: {error}") from error

    def definition(self, name: str) -> str:
        """The text that defines a message, with those that it is made of."""
        return str(self._store.generate_msgdef(name, ros_version=2)[0])


class RclpyTypes:
    """The messages of a ROS 2 installation, as `rclpy` sends them."""

    def __call__(self, name: str) -> Any:
        """See `MessageTypes`.

        Raises:
            MissingDependencyError: if the package of the message is not installed.
            UnknownNameError: if the package has no such message.
        """
        package, _, kind = name.partition("/msg/")
        try:
            module = import_module(f"{package}.msg")
        except ModuleNotFoundError as error:
            raise MissingDependencyError(
                f"this needs the ROS 2 package {package}: install it, or source its workspace"
            ) from error
        if not hasattr(module, kind):
            raise UnknownNameError("message", name, [f"{package}/msg/{key}" for key in dir(module)])
        return getattr(module, kind)

    def cells(self, values: IntArray) -> Any:
        """See `MessageTypes`."""
        return machine_array("b", np.ascontiguousarray(values, dtype=np.int8).tobytes())


@cache
def _store() -> Any:
    typesys = need("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    for name, text in OWN_MESSAGES.items():
        store.register(typesys.get_types_from_msg(text, name))
    return store


_LATEST = float(2**31)  # of the seconds of builtin_interfaces/Time


class Messages:
    """Makes messages in the units and frames of REP-103 and REP-105, which are those of pushplan.

    Positions lie in the ground plane (z = 0), headings are quaternions about z.

    Args:
        types: classes of the messages; those of `rosbags` by default.
        frame_id: the world frame of all poses; ``map`` in REP-105.
        base_frame: the robot's body frame; ``base_link`` in REP-105.

    Raises:
        MissingDependencyError: if `rosbags` is needed and not installed.

    Example:
        >>> messages = Messages()  # doctest: +SKIP
        >>> data = messages.types.serialize(messages.path(plan, world.time))  # doctest: +SKIP
    """

    def __init__(
        self,
        types: MessageTypes | None = None,
        *,
        frame_id: str = "map",
        base_frame: str = "base_link",
    ) -> None:
        self.types = RosbagsTypes() if types is None else types
        self.frame_id = word("frame_id", frame_id)
        self.base_frame = word("base_frame", base_frame)

    def make(self, name: str, **fields: Any) -> Any:
        """A message ``package/Name`` with all of its fields."""
        return self.types(name.replace("/", "/msg/"))(**fields)

    def stamp(self, time: float) -> Any:
        """``builtin_interfaces/Time`` of a time [s], to the nearest nanosecond.

        Raises:
            InvalidInputError: if the time is negative, or 2^31 s or later.
        """
        nanoseconds = round(number("time", time, low=0.0, high=_LATEST - 1.0) * 1e9)
        second, rest = divmod(nanoseconds, 10**9)
        return self.make("builtin_interfaces/Time", sec=second, nanosec=rest)

    def header(self, time: float, frame_id: str | None = None) -> Any:
        """``std_msgs/Header``, in the world frame by default."""
        frame = self.frame_id if frame_id is None else frame_id
        return self.make("std_msgs/Header", stamp=self.stamp(time), frame_id=frame)

    def vector(self, x: float, y: float, z: float) -> Any:
        """``geometry_msgs/Vector3``."""
        return self.make("geometry_msgs/Vector3", x=x, y=y, z=z)

    def quaternion(self, theta: float) -> Any:
        """``geometry_msgs/Quaternion`` of a heading [rad]."""
        z = math.sin(0.5 * theta)
        w = math.cos(0.5 * theta)
        return self.make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=z, w=w)

    def pose(self, pose: ArrayLike) -> Any:
        """``geometry_msgs/Pose`` of (3,) x, y [m], theta [rad]."""
        x, y, theta = array("pose", pose, (3,)).tolist()
        place = self.make("geometry_msgs/Point", x=x, y=y, z=0.0)
        return self.make("geometry_msgs/Pose", position=place, orientation=self.quaternion(theta))

    def pose_stamped(self, pose: ArrayLike, time: float) -> Any:
        """``geometry_msgs/PoseStamped`` of (3,) x, y [m], theta [rad]."""
        return self.make(
            "geometry_msgs/PoseStamped", header=self.header(time), pose=self.pose(pose)
        )

    def path(self, plan: Plan, time: float = 0.0) -> Any:
        """``nav_msgs/Path``; each pose is stamped with the time when it is to be reached.

        Args:
            plan: what to publish.
            time: of the snapshot that it was planned from [s].
        """
        expect("plan", plan, Plan)
        poses = [
            self.pose_stamped(pose, time + after)
            for pose, after in zip(plan.poses, plan.times.tolist(), strict=True)
        ]
        return self.make("nav_msgs/Path", header=self.header(time), poses=poses)

    def twist(self, twist: Twist) -> Any:
        """``geometry_msgs/Twist``, in the body frame: the ``cmd_vel`` of a robot."""
        expect("twist", twist, Twist)
        return self.make(
            "geometry_msgs/Twist",
            linear=self.vector(twist.linear, twist.lateral, 0.0),
            angular=self.vector(0.0, 0.0, twist.angular),
        )

    def twist_stamped(self, twist: Twist, time: float) -> Any:
        """``geometry_msgs/TwistStamped``, in the body frame."""
        header = self.header(time, self.base_frame)
        return self.make("geometry_msgs/TwistStamped", header=header, twist=self.twist(twist))

    def polygon(self, corners: ArrayLike, time: float, frame_id: str | None = None) -> Any:
        """``geometry_msgs/PolygonStamped`` of (N, 2) corners [m]; it holds single precision."""
        points = [
            self.make("geometry_msgs/Point32", x=x, y=y, z=0.0)
            for x, y in array("corners", corners, (None, 2)).astype(np.float32).tolist()
        ]
        outline = self.make("geometry_msgs/Polygon", points=points)
        header = self.header(time, frame_id)
        return self.make("geometry_msgs/PolygonStamped", header=header, polygon=outline)

    def occupancy(
        self,
        grid: ArrayLike,
        resolution: float,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        time: float = 0,
    ) -> Any:
        """``nav_msgs/OccupancyGrid``; the inverse of `pushplan.ros.static_map_from`'s reading.

        Args:
            grid: (rows, columns) whole numbers, -1 for unknown or 0 to 100 [%], row 0 at the
                least y.
            resolution: side of a cell [m], which the message holds in single precision.
            origin: (3,) x, y [m] and theta [rad] of the corner of cell (0, 0).
            time: [s].

        Raises:
            InvalidInputError: if a value is none of these.
        """
        cells = np.asarray(grid)
        if cells.dtype.kind not in "iu" or cells.ndim != 2 or 0 in cells.shape:
            raise InvalidInputError(
                "grid must be an array (rows, columns) of whole numbers, "
                f"got {cells.dtype} of shape {cells.shape}"
            )
        if cells.min() < -1 or cells.max() > 100:
            wrong = cells.min() if cells.min() < -1 else cells.max()
            raise InvalidInputError(f"grid holds -1 (unknown) and 0 to 100 [%], got {wrong}")
        side = number("resolution", resolution, low=0.0, open_low=True)
        info = self.make(
            "nav_msgs/MapMetaData",
            map_load_time=self.stamp(time),
            resolution=float(np.float32(side)),
            width=cells.shape[1],
            height=cells.shape[0],
            origin=self.pose(origin),
        )
        data = self.types.cells(cells.ravel())
        header = self.header(time)
        return self.make("nav_msgs/OccupancyGrid", header=header, info=info, data=data)
