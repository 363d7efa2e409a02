"""How far robot and box stay from static things under a command."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pushplan.compiled import kernel
from pushplan.geometry.convex import convex_distance, convex_penetration
from pushplan.geometry.obstacles import Obstacles, obstacles_of
from pushplan.planners.pushing.kernels import Contact, advance, box_pose
from pushplan.world import RobotModel, StaticMap
from pushplan.world.checks import FloatArray, IntArray, frozen
from pushplan.world.outline import flatten

SAMPLES = 4
"""Poses checked along the way of one command."""
HALVINGS = 4
"""How often the piece in which it comes too near is halved."""
GRAZE = 0.1
"""How fast a box that is nearer than the clearance may come nearer, per travel of the bumper: it is
pushed along a wall, and lies against it in the end."""
_NEARER = 1e-6
"""What is nearer than the clearance already may come this much nearer [R]."""


class Clearance:
    """Keeps a robot, and the box in front of it, off a static map.

    Args:
        robot: its footprint.
        static: what must not be touched.
        least: distance to keep [m].
        outline: (N, 2) corners of the box [m]; None for the robot alone.
        face: direction of the pushed face's normal in the box's frame [rad].
    """

    def __init__(
        self,
        robot: RobotModel,
        static: StaticMap,
        least: float,
        outline: FloatArray | None = None,
        face: float = 0.0,
    ) -> None:
        parts = list(robot.parts)
        if outline is not None:
            c, s = math.cos(face), math.sin(face)
            parts.append(outline @ np.array([[c, -s], [s, c]]))  # in the frame of the face
        vertices, offsets = flatten(parts)
        reach = np.hypot(vertices[:, 0], vertices[:, 1])
        self._scene = _Scene(
            vertices,
            offsets,
            len(robot.parts),
            frozen(np.maximum.reduceat(reach, offsets[:-1])),
            least,
            _NEARER * robot.circumscribed_radius,
            obstacles_of(static),
        )

    def now(self, contact: Contact, state: FloatArray) -> float:
        """Least distance [m] of robot and box from static things, negative inside one."""
        return float(min(_gaps(contact, state, self._scene)))

    def free_share(
        self, contact: Contact, state: FloatArray, v: float, w: float, duration: float
    ) -> float:
        """Share of ``duration`` [s] for which a command may be driven, 0 to 1.

        Args:
            contact: bumper, face and friction.
            state: (6,) where it begins.
            v: [m/s].
            w: [rad/s].
            duration: how far to look ahead [s].
        """
        return float(_free_share(contact, state, v, w, duration, self._scene))


class _Scene(NamedTuple):
    """Footprint, box and obstacles, as the kernels read them."""

    vertices: FloatArray
    """(V, 2) corners of the robot's parts, then of the box, in their frames [m]."""
    offsets: IntArray
    own: int
    """How many of the parts are the robot's."""
    radii: FloatArray
    """(P,) of the disc about the origin that holds each part [m]."""
    least: float
    slack: float
    obstacles: Obstacles


@kernel(allocates=True)
def _gaps(contact: Contact, state: FloatArray, scene: _Scene) -> tuple[float, float]:
    """Least distance of the robot and of the box from static things [m], negative inside one."""
    found = np.full(2, np.inf)
    placed = np.empty_like(scene.vertices)
    box = np.empty(3)
    box_pose(contact, state, box)
    obstacles = scene.obstacles
    for p in range(scene.offsets.shape[0] - 1):
        kind = 1 if p >= scene.own else 0
        x, y, theta = state[0], state[1], state[2]
        if kind == 1:
            x, y, theta = box[0], box[1], box[2]
        first, last = scene.offsets[p], scene.offsets[p + 1]
        c, s = np.cos(theta), np.sin(theta)
        for i in range(first, last):
            placed[i, 0] = x + c * scene.vertices[i, 0] - s * scene.vertices[i, 1]
            placed[i, 1] = y + s * scene.vertices[i, 0] + c * scene.vertices[i, 1]
        for k in range(obstacles.radii.shape[0]):
            b = obstacles.boxes[k]
            dx = max(b[0] - x, x - b[2], 0.0)
            dy = max(b[1] - y, y - b[3], 0.0)
            if np.sqrt(dx * dx + dy * dy) - scene.radii[p] >= found[kind]:
                continue
            core = obstacles.vertices[obstacles.offsets[k] : obstacles.offsets[k + 1]]
            gap = convex_distance(placed[first:last], core)
            if gap <= 0.0:
                gap = -max(convex_penetration(placed[first:last], core)[0], 0.0)
            found[kind] = min(found[kind], gap - obstacles.radii[k])
    return found[0], found[1]


@kernel(allocates=True)
def _clear(
    contact: Contact, state: FloatArray, scene: _Scene, robot: float, box: float, travel: float
) -> bool:
    """Whether robot and box keep their distances; a box near a wall may graze along it."""
    here = _gaps(contact, state, scene)
    graze = GRAZE * travel if box < scene.least else 0.0
    return here[0] >= robot and here[1] >= box - graze


@kernel(allocates=True)
def _free_share(
    contact: Contact, start: FloatArray, v: float, w: float, duration: float, scene: _Scene
) -> float:
    here, before, detail = start.copy(), start.copy(), np.empty(6)
    now = _gaps(contact, here, scene)
    robot = min(scene.least, now[0] - scene.slack)
    box = min(scene.least, now[1] - scene.slack)
    pace = (abs(v) + abs(w) * (contact.front + contact.depth)) * duration
    for i in range(SAMPLES):
        before[:] = here
        advance(contact, here, v, w, duration / SAMPLES, detail)
        if _clear(contact, here, scene, robot, box, pace * (i + 1) / SAMPLES):
            continue
        free, step = i / SAMPLES, 0.5 / SAMPLES
        for _ in range(HALVINGS):
            here[:] = before
            advance(contact, here, v, w, step * duration, detail)
            if _clear(contact, here, scene, robot, box, pace * (free + step)):
                before[:] = here
                free += step
            step *= 0.5
        return free
    return 1.0
