"""Legend of the colours of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from pushplan.drawing.canvas import SMOOTHING
from pushplan.drawing.palette import FLOOR_PALETTE, Color, palette_of
from pushplan.drawing.top_view import Font, font_of, pushed
from pushplan.world import GoalDisc, Plan, World

_GREY = "#808080"


@dataclass(frozen=True)
class Entry:
    """One line of a legend.

    Args:
        label: what it is.
        fill: colour inside; None for an outline or a line.
        edge: colour of the outline, or of the line.
        line: it is a line, not an area.
        dashed: the line is dashed.
    """

    label: str
    fill: Color | None
    edge: Color
    line: bool = False
    dashed: bool = False


def legend_of(
    world: World,
    *,
    plan: Plan | bool | None = None,
    trail: bool = False,
    object_trails: bool = False,
    pushes: bool = False,
) -> list[Entry]:
    """Entries for all that a picture shows.

    Args:
        world: the scene.
        plan: that is drawn; True for one that predicts pushes.
        trail: the robot's path so far is drawn.
        object_trails: those of the objects are drawn.
        pushes: numbered pushes are drawn.
    """
    palette = palette_of(world)
    objects = world.movables
    goal = world.goal
    has_goal = True
    if isinstance(goal, GoalDisc):  # goals of tests may be far away
        nearest = np.clip(goal.center, world.static.bounds[:2], world.static.bounds[2:])
        has_goal = bool(np.hypot(*(goal.center - nearest)) < goal.radius)
    wheeled = objects.wheeled & ~objects.fixed
    fixed = objects.fixed
    has_walls = not world.static.is_empty
    predicted = plan is True or (not isinstance(plan, bool) and bool(pushed(world, plan)))
    entries = {
        Entry("robot", palette.robot, palette.robot_edge): True,
        Entry("goal", *palette.goal): has_goal,
        Entry("wall", palette.wall, palette.wall): has_walls,
        Entry("movable object", *palette.box): bool((~wheeled & ~fixed).any()),
        Entry("object on casters", *palette.wheeled): bool(wheeled.any()),
        Entry("fixed object", *palette.fixed): bool(fixed.any()),
        Entry("plan", None, palette.plan, line=True, dashed=True): bool(plan),
        Entry("predicted push", None, palette.prediction): predicted,
        Entry("path so far", None, palette.trail, line=True): trail,
        Entry("objects so far", None, palette.ghost, line=True): object_trails,
        Entry("on the way to a push", None, _GREY, line=True): pushes,
    }
    return [entry for entry, there in entries.items() if there]


def add_strips(
    picture: NDArray[np.uint8], lines: Sequence[str], entries: Sequence[Entry]
) -> NDArray[np.uint8]:
    """Put lines of text above a picture and a legend below it; nothing of the picture is covered.

    Args:
        picture: (H, W, 3).
        lines: text; pictures of a film need as many lines each.
        entries: of the legend.

    Returns:
        (H', W, 3) picture with even sides.
    """
    height, width = picture.shape[:2]
    k = SMOOTHING
    size = max(10, round(min(max(height, width) / 40, width / 24)))
    font = font_of(k * size)
    step = round(1.45 * size)
    cells = _cells(entries, font, size, width)
    top = step * len(lines) + size // 2
    rows = 1 + max((row for row, _ in cells), default=-1)
    bottom = rows * step + size // 2 if rows else 0
    total = height + top + bottom + (height + top + bottom) % 2
    image = Image.new("RGB", (k * width, k * total), (255, 255, 255))
    pen = ImageDraw.Draw(image)
    for n, line in enumerate(lines):
        place = (k * size // 2, k * (n * step + size // 4))
        pen.text(place, line, font=font, fill=FLOOR_PALETTE.text)
    for entry, (row, x) in zip(entries, cells, strict=True):
        y = height + top + size // 2 + row * step
        box = (k * x, k * y, k * (x + 2 * size), k * (y + size))
        middle = k * (y + size // 2)
        if entry.line:
            starts = range(box[0], box[2], 2 * k * size)
            length = 2 * k * size
            if entry.dashed:
                starts = range(box[0], box[2], k * size)
                length = k * round(0.6 * size)
            for at in starts:
                pen.line((at, middle, at + length, middle), fill=entry.edge, width=2 * k)
        else:
            pen.rectangle(box, fill=entry.fill, outline=entry.edge, width=2 * k)
        place = (k * (x + 2 * size + size // 2), middle)
        pen.text(place, entry.label, font=font, fill=FLOOR_PALETTE.text, anchor="lm")
    finished = image.reduce(k)
    finished.paste(Image.fromarray(picture), (0, top))
    return np.asarray(finished)


def _cells(entries: Sequence[Entry], font: Font, size: int, width: int) -> list[tuple[int, int]]:
    """Row and left edge [px] of each entry, as many in a row as fit."""
    found = []
    row = 0
    x = size // 2
    for entry in entries:
        wide = 3 * size + round(font.getlength(entry.label) / SMOOTHING) + size // 2
        if x + wide > width and x > size // 2:
            row = row + 1
            x = size // 2
        found.append((row, x))
        x += wide
    return found
