"""Colours of pictures: Okabe and Ito's, which colour-blind readers can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world import GoalLine, World

Color = tuple[int, int, int]


@dataclass(frozen=True)
class Palette:
    """Colours of what is drawn; pairs are a fill and an edge."""

    floor: Color = (250, 249, 246)  # the ground
    wall: Color = (84, 84, 88)  # what is static
    robot: Color = (0, 114, 178)  # the chassis
    robot_edge: Color = (0, 66, 110)  # outline of the robot
    bumper: Color = (38, 50, 66)  # its other parts
    box: tuple[Color, Color] = ((146, 94, 52), (92, 56, 28))  # objects
    wheeled: tuple[Color, Color] = ((226, 192, 140), (150, 112, 62))  # objects on casters
    fixed: tuple[Color, Color] = ((126, 122, 120), (72, 70, 70))  # objects held not to move
    box_edge_px: float = 1.5  # width of their edges at 600 px
    ghost: Color = (214, 160, 116)  # where objects were
    prediction: Color = (204, 121, 167)  # where objects will be
    goal: tuple[Color, Color] = ((206, 236, 222), (0, 158, 115))  # where something has to go
    plan: Color = (213, 94, 0)  # the planned path
    trail: Color = (86, 180, 233)  # the path so far
    text: Color = (40, 40, 44)  # letters


SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C6D31")
"""Colours of policies, and of whatever else is told apart, in their order."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
"""Markers of the same, as print without colour tells them apart."""
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (6, 2, 1, 2)))
"""Styles of their lines, as Matplotlib takes them."""


FLOOR_PALETTE = Palette()
WATER_PALETTE = Palette(
    floor=(176, 206, 226),
    robot=(64, 60, 72),
    robot_edge=(24, 24, 30),
    box=((246, 250, 252), (128, 158, 180)),
    wheeled=((246, 250, 252), (128, 158, 180)),
    box_edge_px=1.0,
    ghost=(120, 150, 180),
    goal=((186, 222, 216), (0, 130, 95)),
    trail=(0, 96, 160),
)


def palette_of(world: World) -> Palette:
    """Water where the goal is a line and nothing is static, else a floor."""
    static = world.static
    is_open = not len(static.polygons) and not len(static.segments)
    return WATER_PALETTE if is_open and isinstance(world.goal, GoalLine) else FLOOR_PALETTE
