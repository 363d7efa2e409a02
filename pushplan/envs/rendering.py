"""Pictures of an environment: a drawing, the simulator's own camera, or a window."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.envs.simulators.base import Simulator
from pushplan.envs.window import Window, has_display
from pushplan.world import MissingDependencyError, UnknownNameError, World

RENDER_MODES = ("human", "rgb_array", "camera")
CAMERA_SIZE = (640, 480)
"""Width and height of a camera picture [px]."""


class Renderer:
    """Shows the scene of one environment.

    Raises:
        UnknownNameError: if there is no such mode.
        MissingDependencyError: if there is no display for a window, or the simulator has no camera.
    """

    def __init__(self, mode: str | None, simulator: Simulator) -> None:
        if mode is not None and mode not in RENDER_MODES:
            raise UnknownNameError("render mode", mode, RENDER_MODES)
        if mode == "human" and not has_display():
            raise MissingDependencyError(
                "render mode 'human' needs tkinter and a display; 'rgb_array' works without"
            )
        if mode == "camera" and not simulator.has_camera:
            raise MissingDependencyError(
                f"simulator {simulator.name!r} has no camera; render mode 'rgb_array' draws the "
                "scene"
            )
        self._mode = mode
        self._simulator = simulator
        self._window: Window | None = None

    def __getstate__(self) -> dict[str, Any]:
        """A copy opens a window of its own."""
        return {**self.__dict__, "_window": None}

    @property
    def metadata(self) -> dict[str, Any]:
        """Render modes that work here: a window needs a display, a camera an engine with one."""
        works = {"rgb_array": True, "human": has_display(), "camera": self._simulator.has_camera}
        return {"render_modes": [mode for mode in works if works[mode]], "render_fps": 10}

    def render(self, world: World) -> NDArray[np.uint8] | None:
        """The scene as (H, W, 3) uint8; None where a window shows it."""
        if self._mode == "rgb_array":
            return _picture(world)
        if self._mode == "camera":
            return self._simulator.photograph(*CAMERA_SIZE)
        self.show(world)
        return None

    def show(self, world: World) -> None:
        """Show the scene in a window, if the mode asks for one."""
        if self._mode == "human":
            if self._window is None:
                self._window = Window("pushplan", fps=self.metadata["render_fps"])
            self._window.show(_picture(world))

    def close(self) -> None:
        """Close the window, if there is one; may be called again."""
        if self._window is not None:
            self._window.close()
            self._window = None


def _picture(world: World) -> NDArray[np.uint8]:
    from pushplan.drawing import draw_world  # most runs draw nothing

    return draw_world(world)
