"""Pictures of an environment: a drawing, the simulator's own camera, or a window on tkinter."""

from __future__ import annotations

import importlib.util
import os
import sys
import time
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pushplan.envs.simulators.base import Simulator
from pushplan.world import MissingDependencyError, UnknownNameError, World

RENDER_MODES = ("human", "rgb_array", "camera")
CAMERA_SIZE = (640, 480)
"""Width and height of a camera picture [px]."""
TICK = 0.02
"""Interval at which a waiting window handles input [s]."""


def has_display() -> bool:
    """Return True if a window can be expected to open here."""
    if importlib.util.find_spec("tkinter") is None or importlib.util.find_spec("_tkinter") is None:
        return False
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True


class Keys(Protocol):
    """Is told of every key of a window that goes down or up, by its name in tkinter."""

    def press(self, key: str) -> None:
        """A key went down."""

    def release(self, key: str, now: float) -> None:
        """A key went up at a time of `time.perf_counter` [s]."""

    def clear(self) -> None:
        """The window has lost the keyboard, and will not hear of releases."""


class Window:
    """One window. A person may close it; frames shown after that are dropped.

    Args:
        title: text in the title bar.
        keyboard: is told of keys.
        fps: frames are shown no faster than this, so that a person can follow; as fast as they
            come if None.

    Raises:
        MissingDependencyError: if no window can be opened.
    """

    def __init__(
        self, title: str, *, keyboard: Keys | None = None, fps: float | None = None
    ) -> None:
        try:
            import tkinter
        except ImportError as error:
            raise MissingDependencyError(
                "a window needs tkinter, which this Python lacks"
            ) from error
        try:
            self._root: Any = tkinter.Tk()
        except tkinter.TclError as error:
            raise MissingDependencyError(
                f"no window can be opened here: it needs a display ({error})"
            ) from error
        self.keyboard: Any = keyboard
        self._root.title(title)
        self._root.protocol("WM_DELETE_WINDOW", self.close)
        self._label: Any = tkinter.Label(self._root, borderwidth=0)
        self._label.pack()
        self._photo: Any = None
        self._pause = 1.0 / fps if fps else 0.0
        self._next = 0.0
        if keyboard is not None:
            self._listen(keyboard)

    def _listen(self, keyboard: Keys) -> None:
        self._root.bind("<KeyPress>", lambda event: keyboard.press(event.keysym))
        self._root.bind(
            "<KeyRelease>", lambda event: keyboard.release(event.keysym, time.perf_counter())
        )
        self._root.bind("<FocusOut>", lambda event: keyboard.clear())
        self._root.focus_force()

    @property
    def closed(self) -> bool:
        """True once the window is closed."""
        return self._root is None

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a frame (H, W, 3)."""
        if self._root is None:
            return
        from PIL import Image, ImageTk

        while (left := self._next - time.perf_counter()) > 0.0 and not self.closed:
            time.sleep(min(left, TICK))
            self.update()
        if self.closed:
            return
        self._next = time.perf_counter() + self._pause
        image = Image.fromarray(frame)
        if self._photo is None or (self._photo.width(), self._photo.height()) != image.size:
            self._photo = ImageTk.PhotoImage(image, master=self._root)
            self._label.configure(image=self._photo)
        else:
            self._photo.paste(image)
        self.update()

    def update(self) -> None:
        """Redraw, and take in what the person does; a person may close the window here."""
        if self._root is not None:
            self._root.update()

    def close(self) -> None:
        """Close the window; may be called again."""
        if self._root is not None:
            root = self._root
            self._root = None
            self._photo = None
            root.destroy()


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
