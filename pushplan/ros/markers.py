"""Outlines of a world as ``visualization_msgs/Marker``, which 3D views show without plugins."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from pushplan.ros.ros_messages import Messages
from pushplan.world import GoalDisc, GoalPose, World
from pushplan.world.checks import FloatArray

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
