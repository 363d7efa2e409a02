"""Pictures of a MuJoCo scene without a display."""

from __future__ import annotations

import math
import os
import sys
import warnings
import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.drawing.palette import FLOOR_PALETTE
from pushplan.envs.simulators.mujoco_library import mujoco, no_opengl
from pushplan.envs.simulators.mujoco_shapes import rgba
from pushplan.world import ClearanceArea, GoalDisc, GoalLine, World
from pushplan.world.checks import FloatArray, integer

_ELEVATION = -58.0
_FIELD_OF_VIEW = 40.0
_MOST_GEOMS = 20_000


class MujocoCamera:
    """A fixed camera that shows the whole scene from the south, with its own OpenGL context.

    The backend is what the environment variable ``MUJOCO_GL`` says, or EGL, which needs no display.
    What it holds is freed with the object.

    Raises:
        MissingDependencyError: if there is no OpenGL that draws into memory.
    """

    def __init__(self, model: Any, width: int, height: int) -> None:
        width = integer("photograph width", width, low=16, high=4096)
        height = integer("photograph height", height, low=16, high=4096)
        self.size = width, height
        self._model = model
        model.vis.global_.offwidth = width
        model.vis.global_.offheight = height
        model.vis.global_.fovy = _FIELD_OF_VIEW
        self._context, self._renderer = _open(model, width, height)
        self._scene = mujoco.MjvScene(model, maxgeom=_MOST_GEOMS)
        self._options = mujoco.MjvOption()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        self._view = mujoco.MjrRect(0, 0, width, height)
        self._data = mujoco.MjData(model)
        self._finalizer = weakref.finalize(self, _close, self._context, self._renderer)
        self._finalizer.atexit = False  # the display is gone by then, and all is freed anyway

    def take(self, qpos: FloatArray, world: World) -> NDArray[np.uint8]:
        """(H, W, 3) picture of the bodies, and of the goal."""
        model = self._model
        data = self._data
        data.qpos[:] = qpos
        self._aim(world)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        mujoco.mjv_updateScene(
            model,
            data,
            self._options,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        self._draw_goal(world)
        self._context.make_current()
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._renderer)
        mujoco.mjr_render(self._view, self._scene, self._renderer)
        width, height = self.size
        picture = np.empty((height, width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(picture, None, self._view, self._renderer)
        return np.ascontiguousarray(picture[::-1])

    def _aim(self, world: World) -> None:
        """Far enough away for the bounds to fit into the picture both ways."""
        low = world.static.bounds[:2]
        high = world.static.bounds[2:]
        width, depth = (float(side) for side in high - low)
        aspect = self.size[0] / self.size[1]
        half_view = math.tan(math.radians(0.5 * _FIELD_OF_VIEW))
        tilt = math.radians(-_ELEVATION)
        # the near edge is closer to the camera than the middle by half the depth along it
        nearer = 0.5 * depth * math.cos(tilt)
        across = 0.5 * width / (half_view * aspect)
        along = 0.5 * depth * math.sin(tilt) / half_view
        self._camera.lookat[:] = [*(0.5 * (low + high)), 0.0]
        self._camera.distance = 1.06 * (max(across, along) + nearer)
        self._camera.azimuth = 90.0
        self._camera.elevation = _ELEVATION

    def _draw_goal(self, world: World) -> None:
        goal = world.goal
        bounds = world.static.bounds
        thin = 1e-3 * float((bounds[2:] - bounds[:2]).max())
        if isinstance(goal, GoalDisc):
            size = np.array([goal.radius, thin, 0.0])
            self._mark(mujoco.mjtGeom.mjGEOM_CYLINDER, FLOOR_PALETTE.goal[0], size, goal.center)
            return
        if isinstance(goal, GoalLine):
            along = np.array([-goal.normal[1], goal.normal[0]])
            reach = 0.5 * float(abs(along) @ (bounds[2:] - bounds[:2]))
            middle = 0.5 * (bounds[:2] + bounds[2:])
            foot = middle + ((goal.point - middle) @ goal.normal) * goal.normal
            edges = [(foot - reach * along, foot + reach * along)]
        else:
            edges = [
                edge
                for corners in world.goal_polygons
                for edge in zip(corners, np.roll(corners, -1, axis=0), strict=True)
            ]
            if isinstance(goal, ClearanceArea):
                edges = [e for e, is_open in zip(edges, goal.open_edges, strict=True) if is_open]
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        for ends in edges:
            geom = self._mark(kind, FLOOR_PALETTE.goal[1], np.zeros(3), np.zeros(2))
            if geom is not None:
                mujoco.mjv_connector(geom, kind.value, 3.0 * thin, *np.pad(ends, ((0, 0), (0, 1))))

    def _mark(self, kind: Any, color: str, size: FloatArray, place: FloatArray) -> Any:
        """A further shape in the scene, at a place (2,) on the ground; None if it is full."""
        scene = self._scene
        if scene.ngeom >= scene.maxgeom:
            return None
        geom = scene.geoms[scene.ngeom]
        turn = np.eye(3).ravel()
        paint = np.array(rgba(color), dtype=np.float32)
        mujoco.mjv_initGeom(geom, kind.value, size, np.append(place, 0.0), turn, paint)
        scene.ngeom += 1
        return geom


def _open(model: Any, width: int, height: int) -> tuple[Any, Any]:
    """An OpenGL context that draws into memory, and MuJoCo's renderer in it."""
    with warnings.catch_warnings(record=True) as said:  # GLFW warns of why there will be an error
        try:
            if os.environ.get("MUJOCO_GL") or not sys.platform.startswith("linux"):
                context: Any = mujoco.GLContext(width, height)
            else:
                from mujoco.egl import GLContext

                context = GLContext(width, height)
            context.make_current()
            renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        except Exception as error:  # PyOpenGL and the drivers raise whatever they like
            cause = said[0].message if said else error
            raise no_opengl(cause, "; render mode 'rgb_array' works without") from error
    return context, renderer


def _close(context: Any, renderer: Any) -> None:
    context.make_current()
    renderer.free()
    context.free()
