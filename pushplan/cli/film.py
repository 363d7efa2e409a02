"""Pictures and films of an episode."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pushplan.drawing import draw_world, save_animation, save_image
from pushplan.world import Episode, InvalidInputError, Plan, Policy, World

ENDINGS = (".png", ".gif", ".mp4")
FRAMES = 240
"""A film has at most so many frames; longer episodes are shown faster."""
FPS = 20


class Camera:
    """Watches an episode and draws it when it is over.

    Args:
        path: where the picture or film goes; its ending says which.

    Raises:
        InvalidInputError: if the ending is unknown or the folder is missing.
    """

    def __init__(self, path: str) -> None:
        self.path = Path(path)
        if self.path.suffix.lower() not in ENDINGS:
            raise InvalidInputError(f"a picture ends in {', '.join(ENDINGS)}, got {path!r}")
        if not self.path.absolute().parent.is_dir():
            raise InvalidInputError(f"there is no folder {self.path.parent} for {path!r}")
        self._steps: list[tuple[World, Plan | None]] = []

    def __call__(self, step: int, world: World, policy: Policy) -> None:
        """Note one step; what `run_episode` calls."""
        self._steps.append((world, getattr(policy, "current_plan", None)))

    def write(self, episode: Episode) -> None:
        """Draw what was seen."""
        if self.path.suffix.lower() == ".png":
            save_image(self.path, self._frame(len(self._steps) - 1, episode))
            return
        stride = -(-len(self._steps) // FRAMES)
        chosen = [*range(0, len(self._steps) - 1, stride), len(self._steps) - 1]
        frames = [self._frame(i, episode) for i in chosen]
        frames += [frames[-1]] * FPS  # a second to look at the end
        save_animation(self.path, frames, FPS)

    def _frame(self, index: int, episode: Episode) -> Any:
        world, plan = self._steps[index]
        so_far = episode.times <= world.time + 1e-9
        trail = np.ascontiguousarray(episode.robot_poses[so_far])
        last = index == len(self._steps) - 1
        text = f"{world.time:.1f} s" + (f"  {episode.reason}" if last else "")
        return draw_world(world, plan=plan, trail=trail, text=text)
