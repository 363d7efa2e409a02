"""`McapLog` and its `McapWriter`: worlds, plans and commands as messages of an MCAP file."""

from __future__ import annotations

import json
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np

from pushplan.imports.on_demand import need
from pushplan.ros.ros_messages import Messages, RosbagsTypes
from pushplan.runtime import Command
from pushplan.world import GoalDisc, GoalPose, InvalidInputError, Plan, World
from pushplan.world.checks import FloatArray, expect, integer
from pushplan.world.stored.world_files import world_to_dict

# of visualization_msgs/Marker: type, and actions
_TRIANGLES = 11
_ADD = 0
_DELETE = 2
_COLOURS = {
    "robot": (0.2, 0.5, 0.9, 1.0),
    "static": (0.35, 0.35, 0.38, 1.0),
    "goal": (0.3, 0.75, 0.4, 0.4),
    "object": (0.85, 0.6, 0.3, 1.0),
}
_CIRCLE = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
TOPICS = {
    "/pushplan/world": "pushplan_msgs/msg/World",
    "/pushplan/state": "pushplan_msgs/msg/State",
    "/pushplan/command": "pushplan_msgs/msg/Command",
    "/pushplan/episode": "pushplan_msgs/msg/Episode",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/scene": "visualization_msgs/msg/MarkerArray",
    "/objects": "visualization_msgs/msg/MarkerArray",
    "/plan": "nav_msgs/msg/Path",
    "/cmd_vel": "geometry_msgs/msg/TwistStamped",
}
"""Topic -> its type; an episode comes back from the first four, which are our own."""
WORLD, STATE, COMMAND, EPISODE, *_ = TOPICS
SCHEMA = "pushplan-log/1"
_STANDING = attrgetter("robot", "static", "goal", "margin")
DROPPED = "pushplan dropped"
"""Name of the metadata that say how much a log has lost."""


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
        self._channels: dict[str, int] = {}
        for topic, name in TOPICS.items():
            text = self._types.definition(name).encode()
            schema = self._writer.register_schema(name, "ros2msg", text)
            kept = {"schema": SCHEMA}
            self._channels[topic] = self._writer.register_channel(topic, "cdr", schema, kept)
        self._counts = Counter[str]()
        self._scene: World | None = None
        self._known: set[int] = set()
        self._shown: dict[int, Sequence[FloatArray]] = {}

    def scene(self, world: World) -> None:
        """Write robot, map, goal and objects, unless they are those of the last scene."""
        old = self._scene
        if old is not None and _STANDING(old) == _STANDING(world):
            return
        if old is None:
            self._known.update(world.movables.ids.tolist())
        self._scene = world
        content = json.dumps(world_to_dict(world), allow_nan=False)
        self._put_own(WORLD, world.time, json=content)
        self._put("/scene", world.time, scene_markers(self._messages, world))

    def world(self, world: World) -> None:
        """Write a snapshot: the scene where it is another one, and where everything is."""
        self.scene(world)
        time = world.time
        objects = world.movables
        ids = objects.ids.tolist()
        new = [k for k, number in enumerate(ids) if number not in self._known]
        self._known.update(ids)
        described = world_to_dict(world)["movables"] if new else []
        self._put_own(
            STATE,
            time,
            time=time,
            robot_pose=world.robot_pose,
            robot_twist=world.robot_twist,
            ids=objects.ids,
            object_poses=objects.poses.ravel(),
            new_objects=json.dumps([described[k] for k in new]),
        )
        outlines: dict[int, Sequence[FloatArray]] = {
            number: objects.parts(k) for k, number in enumerate(ids)
        }
        changed = [
            k
            for k, number in enumerate(ids)
            if not _same(self._shown.get(number, ()), outlines[number])
        ]
        gone = self._shown.keys() - outlines.keys()
        if changed or gone:
            markers = object_markers(self._messages, world, changed, set(gone))
            self._put("/objects", time, markers)
        self._shown = outlines
        bodies = [(self._messages.base_frame, world.robot_pose)]
        bodies += [(object_frame(n), pose) for n, pose in zip(ids, objects.poses, strict=True)]
        self._put("/tf", time, transforms(self._messages, time, bodies))

    def plan(self, plan: Plan, time: float) -> None:
        """Write a plan that was taken up."""
        self._put("/plan", time, self._messages.path(plan, time))

    def command(self, command: Command) -> None:
        """Write a command, and how old it was what it rests on."""
        self._put_own(
            COMMAND,
            command.time,
            time=command.time,
            linear=command.twist.linear,
            angular=command.twist.angular,
            status=command.status.value,
            reason=command.reason,
            plan_age=command.plan_age,
            world_age=command.world_age,
            late=command.late,
            lateral=command.twist.lateral,
        )
        twist = self._messages.twist_stamped(command.twist, command.time)
        self._put("/cmd_vel", command.time, twist)

    def episode(self, time: float, content: dict[str, Any]) -> None:
        """Write what is known of an episode when it has ended."""
        self._put_own(EPISODE, time, json=json.dumps(content, allow_nan=False))

    def close(self, dropped: int = 0) -> None:
        """Write the index that every reader needs, and how much was dropped; close the file."""
        try:
            if dropped:
                self._writer.add_metadata(DROPPED, {"notes": str(dropped)})
            self._writer.finish()
        finally:
            self._file.close()

    def _put_own(self, topic: str, stamp: float, **fields: Any) -> None:
        kind = self._types(TOPICS[topic])
        header = self._messages.header(stamp)
        self._put(topic, stamp, kind(header=header, **fields))

    def _put(self, topic: str, time: float, message: Any) -> None:
        data = self._types.serialize(message)
        stamp = round(time * 1e9)
        number = self._counts[topic]
        self._counts[topic] += 1
        self._writer.add_message(self._channels[topic], stamp, data, stamp, number)


def _same(parts: Sequence[FloatArray], others: Sequence[FloatArray]) -> bool:
    return len(parts) == len(others) and all(map(np.array_equal, parts, others))


class McapLog:
    """Keeps worlds, plans, commands and their ages; a `pushplan.runtime.RunLog`.

    Its methods may be called by any thread and never wait for the disk: another thread encodes
    and writes. What comes in while ``backlog`` notes are waiting is dropped and counted. A log
    holds one episode, and `pushplan.ros.load_episode` reads it.

    Args:
        path: the file; one that is there is replaced.
        frame_id: the world frame.
        backlog: how many notes may wait to be written.

    Attributes:
        dropped: how many notes were lost because the disk was too slow; the file says it too.

    Raises:
        InvalidInputError: if the file cannot be written; later also if writing has failed.
        MissingDependencyError: if `mcap` or `rosbags` is not installed.

    Example:
        >>> log = McapLog("run.mcap")  # doctest: +SKIP
        >>> with log, Runner("push-aware", period=0.05, log=log) as runner:  # doctest: +SKIP
        ...     runner.start(world)
    """

    def __init__(self, path: str | Path, *, frame_id: str = "map", backlog: int = 1000) -> None:
        self._backlog = integer("backlog", backlog, low=1)
        self.dropped = 0
        self._writer = McapWriter(path, frame_id)
        self._newest = -1.0
        self._error: Exception | None = None
        self._tasks: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._lock = threading.RLock()
        self._closed = False
        self._thread = threading.Thread(target=self._write, name="pushplan log", daemon=True)
        self._thread.start()

    def __enter__(self) -> McapLog:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def world(self, world: World) -> None:
        """Note a snapshot; one that is not later than the last is in the log already."""
        expect("world", world, World)
        with self._lock:
            if world.time <= self._newest:
                return
            self._newest = world.time
            self._put(partial(self._writer.world, world))

    def plan(self, plan: Plan, time: float) -> None:
        """Note a plan that was taken up, at a time [s]."""
        self._put(partial(self._writer.plan, expect("plan", plan, Plan), time))

    def command(self, command: Command) -> None:
        """Note a command."""
        self._put(partial(self._writer.command, expect("command", command, Command)))

    def close(self) -> None:
        """Write what is left and the index; a file that is not closed cannot be read.

        Raises:
            InvalidInputError: if writing has failed.
        """
        if not self._closed:
            self._closed = True
            self._tasks.put(None)
            self._thread.join()
            self._check()

    def _put(self, task: Callable[[], None]) -> None:
        if self._closed:
            raise InvalidInputError("the log is closed")
        self._check()
        with self._lock:
            if self._tasks.qsize() < self._backlog:
                self._tasks.put(task)
            else:
                self.dropped += 1

    def _check(self) -> None:
        if self._error is not None:
            raise InvalidInputError(f"cannot write the log: {self._error}") from self._error

    def _write(self) -> None:
        try:
            while (task := self._tasks.get()) is not None:
                task()
        except Exception as error:  # said by the next call
            self._error = error
        try:
            self._writer.close(self.dropped)
        except Exception as error:
            self._error = self._error or error


def scene_markers(messages: Messages, world: World) -> Any:
    """``MarkerArray`` of the robot, in its own frame, what is static, and the goal."""
    goal = world.goal
    area: list[FloatArray] = []
    if isinstance(goal, GoalDisc):
        area = [goal.center + goal.radius * np.stack([np.cos(_CIRCLE), np.sin(_CIRCLE)], axis=1)]
        if isinstance(goal, GoalPose):
            size = max(goal.radius, 0.5 * world.robot.circumscribed_radius)
            area.append(goal.arrow(size))
    else:
        area = list(world.goal_polygons)
    base = messages.base_frame
    frame = messages.frame_id
    time = world.time
    return messages.make(
        "visualization_msgs/MarkerArray",
        markers=[
            _marker(messages, "robot", 0, base, time, world.robot.contact_parts),
            _marker(messages, "static", 0, frame, time, world.static.convex_parts),
            _marker(messages, "goal", 0, frame, time, area),
        ],
    )


def object_markers(messages: Messages, world: World, which: Sequence[int], gone: set[int]) -> Any:
    """``MarkerArray`` of objects, each in its own frame.

    Args:
        messages: makes them.
        world: where they are.
        which: indices of those that are new or have another outline.
        gone: ids of those that are not there any more.
    """
    objects = world.movables
    outlines = {int(objects.ids[k]): objects.parts(k) for k in which}
    outlines |= {number: () for number in sorted(gone)}
    markers = [
        _marker(messages, "object", number, object_frame(number), world.time, some)
        for number, some in outlines.items()
    ]
    return messages.make("visualization_msgs/MarkerArray", markers=markers)


def object_frame(number: int) -> str:
    """The body frame of an object."""
    return f"object_{number}"


def transforms(messages: Messages, time: float, poses: Iterable[tuple[str, FloatArray]]) -> Any:
    """``tf2_msgs/TFMessage`` from the world frame to the frames of bodies at (3,) poses."""
    return messages.make(
        "tf2_msgs/TFMessage",
        transforms=[
            messages.make(
                "geometry_msgs/TransformStamped",
                header=messages.header(time),
                child_frame_id=name,
                transform=messages.make(
                    "geometry_msgs/Transform",
                    translation=messages.vector(float(pose[0]), float(pose[1]), 0.0),
                    rotation=messages.quaternion(float(pose[2])),
                ),
            )
            for name, pose in poses
        ],
    )


def _marker(
    messages: Messages,
    kind: str,
    number: int,
    frame: str,
    time: float,
    outlines: Iterable[FloatArray],
) -> Any:
    """Convex outlines, each (N, 2) [m], filled with triangles; without any, the marker goes."""
    make = messages.make
    corners = [
        make("geometry_msgs/Point", x=x, y=y, z=0.0)
        for outline in outlines
        for k in range(1, len(outline) - 1)
        for x, y in outline[[0, k, k + 1]].tolist()
    ]
    r, g, b, a = _COLOURS[kind]
    nothing = np.zeros(0, np.uint8)
    return make(
        "visualization_msgs/Marker",
        header=messages.header(time, frame),
        ns=kind,
        id=number,
        type=_TRIANGLES,
        action=_ADD if corners else _DELETE,
        pose=messages.pose((0.0, 0.0, 0.0)),
        scale=messages.vector(1.0, 1.0, 1.0),
        color=make("std_msgs/ColorRGBA", r=r, g=g, b=b, a=a),
        lifetime=make("builtin_interfaces/Duration", sec=0, nanosec=0),
        frame_locked=True,
        points=corners,
        colors=[],
        texture_resource="",
        texture=make(
            "sensor_msgs/CompressedImage", header=messages.header(0.0, ""), format="", data=nothing
        ),
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=make("visualization_msgs/MeshFile", filename="", data=nothing),
        mesh_use_embedded_materials=False,
    )
