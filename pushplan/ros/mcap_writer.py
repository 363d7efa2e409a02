"""`McapWriter`: worlds, plans and commands as messages of an MCAP file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.ros.markers import object_frame, object_markers, scene_markers, transforms
from pushplan.ros.message_types import RosbagsTypes
from pushplan.ros.messages import Messages
from pushplan.runtime import Command
from pushplan.world import InvalidInputError, Plan, StaticMap, World
from pushplan.world.checks import FloatArray
from pushplan.world.files import world_to_dict
from pushplan.world.libraries import need

WORLD, STATE, COMMAND, EPISODE = (
    f"/pushplan/{name}" for name in ("world", "state", "command", "episode")
)
"""Topics of JSON messages, in which numbers are exact; all others are messages of ROS 2."""
SCHEMA = "pushplan-log/1"
_ROS = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/scene": "visualization_msgs/msg/MarkerArray",
    "/objects": "visualization_msgs/msg/MarkerArray",
    "/plan": "nav_msgs/msg/Path",
    "/cmd_vel": "geometry_msgs/msg/TwistStamped",
}
_NUMBERS = {"type": "array", "items": {"type": "number"}}
_FIELDS: dict[str, dict[str, Any]] = {
    WORLD: {},
    STATE: {
        "time": {"type": "number"},
        "robot_pose": _NUMBERS,
        "robot_twist": _NUMBERS,
        "ids": _NUMBERS,
        "object_poses": {"type": "array", "items": _NUMBERS},
        "new": {"type": "array", "items": {"type": "object"}},
    },
    COMMAND: {
        **{key: {"type": "number"} for key in ("time", "linear", "angular")},
        **{key: {"type": "number"} for key in ("plan_age", "world_age")},
        "status": {"type": "string"},
        "reason": {"type": "string"},
        "late": {"type": "boolean"},
    },
    EPISODE: {"success": {"type": "boolean"}, "reason": {"type": "string"}},
}


class McapWriter:
    """Writes an MCAP file; one thread at a time.

    Args:
        path: the file; one that is there is replaced.
        frame_id: the world frame.

    Raises:
        InvalidInputError: if the file cannot be written.
        MissingDependencyError: if `mcap` or `rosbags` is not installed.
    """

    def __init__(self, path: str | Path, frame_id: str = "map") -> None:
        self._types = RosbagsTypes()
        self._messages = Messages(self._types, frame_id=frame_id)
        library = need("mcap.writer")
        try:
            self._file = Path(path).open("wb")
        except OSError as error:
            raise InvalidInputError(f"cannot write {path}: {error.strerror}") from error
        self._writer = library.Writer(self._file)
        self._writer.start(profile="ros2", library="pushplan")
        self._channels = {topic: self._channel(topic) for topic in (*_ROS, *_FIELDS)}
        self._counts = dict.fromkeys(self._channels, 0)
        self._scene: World | None = None
        self._known: set[int] = set()
        self._shown: dict[int, FloatArray] = {}

    def _channel(self, topic: str) -> int:
        if topic in _ROS:
            name, encoding, data = _ROS[topic], "ros2msg", self._types.definition(_ROS[topic])
        else:
            name, encoding = f"pushplan.{topic.rpartition('/')[2].title()}", "jsonschema"
            schema = {"title": name, "type": "object", "properties": _FIELDS[topic]}
            data = json.dumps(schema)
        schema_id = self._writer.register_schema(name, encoding, data.encode())
        coding = "cdr" if topic in _ROS else "json"
        metadata = {"schema": SCHEMA}
        return int(self._writer.register_channel(topic, coding, schema_id, metadata))

    def world(self, world: World) -> None:
        """Write a snapshot: the scene where it is another one, and where everything is."""
        self.scene(world)
        assert world.robot_twist is not None
        self.state(world.time, world.robot_pose, world.robot_twist, world)

    def scene(self, world: World) -> None:
        """Write robot, map, goal and objects, unless they are those of the last scene."""
        old = self._scene
        if old is not None and all(
            getattr(old, key) is getattr(world, key) or getattr(old, key) == getattr(world, key)
            for key in ("robot", "static", "goal", "margin")
        ):
            return
        self._scene = world
        self._known.update(world.movables.ids.tolist())
        self._put_json(WORLD, world.time, world_to_dict(world))
        self._put("/scene", world.time, scene_markers(self._messages, world))

    def state(self, time: float, robot_pose: FloatArray, twist: FloatArray, world: World) -> None:
        """Write where robot and objects are.

        Args:
            time: [s].
            robot_pose: (3,) x, y [m], theta [rad].
            twist: (3,) of the robot in the world frame [m/s, m/s, rad/s].
            world: holds the objects.
        """
        objects = world.movables
        ids = objects.ids.tolist()
        new = [k for k, number in enumerate(ids) if number not in self._known]
        self._known.update(ids)
        content = {
            "time": time,
            "robot_pose": robot_pose.tolist(),
            "robot_twist": twist.tolist(),
            "ids": ids,
            "object_poses": objects.poses.tolist(),
            "new": _described(world, new),
        }
        self._put_json(STATE, time, content)
        outlines = {number: objects.outline(k) for k, number in enumerate(ids)}
        changed = [
            k
            for k, number in enumerate(ids)
            if not np.array_equal(self._shown.get(number, ()), outlines[number])
        ]
        gone = self._shown.keys() - outlines.keys()
        if changed or gone:
            markers = object_markers(self._messages, world, changed, set(gone))
            self._put("/objects", time, markers)
        self._shown = outlines
        bodies = [(self._messages.base_frame, robot_pose)]
        bodies += [(object_frame(n), pose) for n, pose in zip(ids, objects.poses, strict=True)]
        self._put("/tf", time, transforms(self._messages, time, bodies))

    def plan(self, plan: Plan, time: float) -> None:
        """Write a plan that was taken up."""
        self._put("/plan", time, self._messages.path(plan, time))

    def command(self, command: Command) -> None:
        """Write a command, and how old it was what it rests on."""
        content = {
            "time": command.time,
            "linear": command.twist.linear,
            "angular": command.twist.angular,
            "status": command.status.value,
            "reason": command.reason,
            "plan_age": command.plan_age,
            "world_age": command.world_age,
            "late": command.late,
        }
        self._put_json(COMMAND, command.time, content)
        twist = self._messages.twist_stamped(command.twist, command.time)
        self._put("/cmd_vel", command.time, twist)

    def episode(self, time: float, content: dict[str, Any]) -> None:
        """Write what is known of an episode when it has ended."""
        self._put_json(EPISODE, time, content)

    def close(self) -> None:
        """Write the index that every reader needs, and close the file."""
        try:
            self._writer.finish()
        finally:
            self._file.close()

    def _put_json(self, topic: str, time: float, content: dict[str, Any]) -> None:
        self._add(topic, time, json.dumps(content, allow_nan=False).encode())

    def _put(self, topic: str, time: float, message: Any) -> None:
        self._add(topic, time, self._types.serialize(message))

    def _add(self, topic: str, time: float, data: bytes) -> None:
        if not 0.0 <= time < 2.0**31:
            raise InvalidInputError(f"times of an MCAP log must be 0 to 2^31 s, got {time:g} s")
        stamp, number = round(time * 1e9), self._counts[topic]
        self._counts[topic] += 1
        self._writer.add_message(self._channels[topic], stamp, data, stamp, number)


def _described(world: World, which: list[int]) -> list[Any]:
    """Some objects of a world as in a world file."""
    if not which:
        return []
    chosen = np.zeros(len(world.movables), dtype=np.bool_)
    chosen[which] = True
    bare = StaticMap.build(bounds=world.static.bounds)
    some = replace(world, static=bare, movables=world.movables.select(chosen))
    return list(world_to_dict(some)["movables"])
