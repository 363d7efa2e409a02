"""A window that shows frames, on tkinter."""

from __future__ import annotations

import importlib.util
import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.world import MissingDependencyError


def has_display() -> bool:
    """Whether a window can be expected to open here."""
    if importlib.util.find_spec("tkinter") is None or importlib.util.find_spec("_tkinter") is None:
        return False
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True


class Window:
    """One window. A person may close it; frames shown after that are dropped.

    Args:
        title: text in the title bar.

    Raises:
        MissingDependencyError: if no window can be opened.
    """

    def __init__(self, title: str) -> None:
        try:
            import tkinter
        except ImportError as error:
            raise MissingDependencyError(
                "a window needs tkinter; render mode 'rgb_array' works without"
            ) from error
        try:
            self._root: Any = tkinter.Tk()
        except tkinter.TclError as error:
            raise MissingDependencyError(
                f"no window can be opened here ({error}); render mode 'rgb_array' works without"
            ) from error
        self._root.title(title)
        self._root.protocol("WM_DELETE_WINDOW", self.close)
        self._label: Any = tkinter.Label(self._root)
        self._label.pack()

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a frame (H, W, 3)."""
        if self._root is None:
            return
        from PIL import Image, ImageTk

        photo = ImageTk.PhotoImage(Image.fromarray(frame), master=self._root)
        self._label.configure(image=photo)
        self._label.image = photo  # tkinter keeps no reference of its own
        self._root.update_idletasks()
        self._root.update()

    def close(self) -> None:
        """Close the window; may be called again."""
        if self._root is not None:
            self._root.destroy()
            self._root = None
