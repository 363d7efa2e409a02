"""Classes of ROS 2 messages: of `rosbags`, without ROS, or those that `rclpy` sends."""

from __future__ import annotations

import array
from functools import cache
from importlib import import_module
from typing import Any, Protocol

import numpy as np

from pushplan.imports.on_demand import need
from pushplan.world import MissingDependencyError, SchemaError, UnknownNameError
from pushplan.world.checks import IntArray

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
        return array.array("b", np.ascontiguousarray(values, dtype=np.int8).tobytes())


@cache
def _store() -> Any:
    typesys = need("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    for name, text in OWN_MESSAGES.items():
        store.register(typesys.get_types_from_msg(text, name))
    return store
