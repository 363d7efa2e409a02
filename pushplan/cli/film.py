"""Pictures and films of an episode."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import repeat
from pathlib import Path

import numpy as np

from pushplan.cli.outputs import check_picture
from pushplan.cli.scoreboard import Scoreboard, closing_lines
from pushplan.drawing import draw_world, save_animation, save_image
from pushplan.drawing.files import Frame
from pushplan.world import Episode, Plan, Policy, ShowsPlan, World

ENDINGS = (".png", ".gif", ".mp4")
FRAMES = 240
"""A film has at most so many frames; longer episodes are shown faster."""
FPS = 20


class Camera:
    """Watches an episode and draws it when it is over.

    Raises:
        InvalidInputError: if the file cannot be written, or the ending is unknown.
    """

    def __init__(self, path: str) -> None:
        self.path = Path(path)
        check_picture(path, ENDINGS)
        self._steps: list[tuple[World, Plan | None]] = []

    def __call__(self, step: int, world: World, policy: Policy) -> None:
        """Note one step; what `run_episode` calls."""
        if step == 0:
            self._steps.clear()
        self._steps.append((world, policy.current_plan if isinstance(policy, ShowsPlan) else None))

    def write(self, episode: Episode) -> None:
        """Draw what was seen, with the scores so far."""
        count = len(self._steps)
        if self.path.suffix.lower() == ".png":
            *_, last = self._frames(episode, [count - 1])
            save_image(self.path, last)
            return
        stride = -(-count // FRAMES)
        chosen = [*range(0, count - 1, stride), count - 1]
        save_animation(self.path, self._frames(episode, chosen), FPS)

    def _frames(self, episode: Episode, chosen: list[int]) -> Iterator[Frame]:
        board, seen = Scoreboard(episode.world), 1
        for index in chosen:
            world, plan = self._steps[index]
            now = int(np.searchsorted(episode.times, world.time + 1e-9))
            board.advance(world, episode.robot_poses[seen:now], episode.object_poses[seen:now])
            seen, trail = now, episode.robot_poses[:now]
            text = board.lines()
            if index == chosen[-1]:
                text = [text[0], *closing_lines(episode)]
            frame = draw_world(world, plan=plan, trail=trail, text=text)
            yield frame
        if len(chosen) > 1:  # a second to look at the end
            yield from repeat(frame, FPS)
