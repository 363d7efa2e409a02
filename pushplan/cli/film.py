"""Pictures and films of an episode."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import repeat
from pathlib import Path

import numpy as np

from pushplan.cli.output_files import check_figure
from pushplan.cli.scoreboard import Scoreboard, closing_lines
from pushplan.drawing import (
    Entry,
    Panel,
    add_strips,
    draw_figure,
    draw_world,
    legend_of,
    save_animation,
    save_figure,
)
from pushplan.drawing.figure import FORMATS
from pushplan.drawing.files import Frame
from pushplan.drawing.top_view import film_view, pushed
from pushplan.interaction.path_sweepers import default_interaction
from pushplan.world import Episode, Plan, Policy, World
from pushplan.world.policy_abilities import shown_plan

FILMS = (".gif", ".mp4")
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
        check_figure(path, FILMS)
        self._steps: list[tuple[World, Plan | None]] = []

    def __call__(self, step: int, world: World, policy: Policy) -> None:
        """Note one step; what `run_episode` calls."""
        if step == 0:
            self._steps.clear()
        self._steps.append((world, shown_plan(policy)))

    def _predict(self) -> None:
        """Give plans that predict nothing what the default interaction model expects of them."""
        known: dict[int, Plan] = {}
        for step, (world, plan) in enumerate(self._steps):
            if plan is None or plan.object_poses is not None:
                continue
            if id(plan) not in known:
                swept = default_interaction(world).sweep(world, plan.poses)
                known[id(plan)] = replace(plan, object_poses=swept.object_poses)
            self._steps[step] = (world, known[id(plan)])

    def write(self, episode: Episode) -> None:
        """Draw what was seen, with the scores so far; a still shows the end."""
        self._predict()
        count = len(self._steps)
        if self.path.suffix.lower() in FORMATS:
            world, plan = self._steps[-1]
            text = "   ".join(closing_lines(episode))
            panel = Panel(world, plan=plan, trail=episode.robot_poses, title=text)
            save_figure(self.path, draw_figure(panel), title=text)
            return
        stride = -(-count // FRAMES)
        chosen = [*range(0, count - 1, stride), count - 1]
        save_animation(self.path, self._frames(episode, chosen), FPS)

    def _legend(self) -> list[Entry]:
        """Return the legend of everything that some frame shows; the same in all frames."""
        plans = [(world, plan) for world, plan in self._steps if plan is not None]
        predicted = any(pushed(world, plan) for world, plan in plans)
        first = self._steps[0][0]
        return legend_of(first, plan=predicted or (plans[0][1] if plans else None), trail=True)

    def _frames(self, episode: Episode, chosen: list[int]) -> Iterator[Frame]:
        board = Scoreboard(episode.world)
        seen = 1
        legend = self._legend()
        view = film_view(episode.world)
        for index in chosen:
            world, plan = self._steps[index]
            now = int(np.searchsorted(episode.times, world.time + 1e-9))
            board.advance(world, episode.robot_poses[seen:now], episode.object_poses[seen:now])
            seen = now
            trail = episode.robot_poses[:now]
            text = board.lines()
            if index == chosen[-1]:
                text = [text[0], "   ".join(closing_lines(episode))]
            if view is not None:
                text = [*text, "the picture follows the robot along the map"]
            picture = draw_world(world, view=view, plan=plan, trail=trail)
            frame = add_strips(picture, text, legend)
            yield frame
        yield from repeat(frame, FPS)  # a second to look at the end
