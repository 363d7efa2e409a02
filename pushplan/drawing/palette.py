"""Colours of pictures: Okabe and Ito's, which colour-blind readers can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world import GoalLine, World

Color = str
"""``#rrggbb``, as Pillow, Matplotlib and pages take it."""


@dataclass(frozen=True)
class Palette:
    """Colours of what is drawn; pairs are a fill and an edge."""

    floor: Color = "#faf9f6"  # the ground
    wall: Color = "#545458"  # static obstacles
    unseen: Color = "#8c8a86"  # laid thinly over what nobody has seen
    robot: Color = "#0072b2"  # the chassis
    robot_edge: Color = "#00426e"  # outline of the robot
    bumper: Color = "#263242"  # its other parts
    box: tuple[Color, Color] = ("#925e34", "#5c381c")  # objects
    wheeled: tuple[Color, Color] = ("#e2c08c", "#96703e")  # objects on casters
    fixed: tuple[Color, Color] = ("#7e7a78", "#484646")  # objects held not to move
    box_edge_px: float = 1.5  # width of their edges at 600 px
    ghost: Color = "#d6a074"  # earlier places of objects
    prediction: Color = "#cc79a7"  # predicted places of objects
    goal: tuple[Color, Color] = ("#ceecde", "#009e73")  # goal of the robot or of objects
    plan: Color = "#d55e00"  # the planned path
    trail: Color = "#56b4e9"  # the path so far
    text: Color = "#28282c"  # letters


SERIES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C6D31")
"""Colours of policies, and of whatever else is told apart, in their order."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
"""Markers of the same, as print without colour tells them apart."""
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (6, 2, 1, 2)))
"""Styles of their lines, as Matplotlib takes them."""


FLOOR_PALETTE = Palette()
WATER_PALETTE = Palette(
    floor="#b0cee2",
    robot="#403c48",
    robot_edge="#18181e",
    box=("#f6fafc", "#809eb4"),
    wheeled=("#f6fafc", "#809eb4"),
    box_edge_px=1.0,
    ghost="#7896b4",
    goal=("#baded8", "#00825f"),
    trail="#0060a0",
)


def palette_of(world: World) -> Palette:
    """Water where the goal is a line and nothing is static, else a floor."""
    if world.static.is_empty and isinstance(world.goal, GoalLine):
        return WATER_PALETTE
    return FLOOR_PALETTE
