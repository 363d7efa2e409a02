"""Parameters of planners that grow trees of arcs and shortcut what they find."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checks import integer, number


@dataclass(frozen=True)
class PathSearchConfig:
    """Parameters of random trees and shortcutting.

    Lengths are in units of the robot's circumscribed radius R.

    Args:
        push_weight: w, the weight of a unit of interaction work against a unit of travel work:
            the user's trade between E_nav and I_nav.
        margin: clearance kept from walls [R]; less where the robot starts nearer.
        turn_fraction: fraction of the greatest turn rate that plans use; the rest is for tracking.
        inset: how far into the goal a plan ends [R].
        spacing: distance between the poses of a path [R].
        edge: longest edge of a tree [R].
        coarse_path_fraction: fraction of targets near the coarse shortest path; the rest are
            uniform.
        coarse_path_spread: standard deviation of those targets about it [R].
        avoid_iterations: tree iterations that treat objects as obstacles, before they count as
            things that may be pushed.
        tree_iterations: iterations after which a tree is given up for a new one.
        shortcuts: shortcuts tried on a path before its gain is looked at.
        least_gain: fraction of its cost that a path must lose over ``shortcuts`` of them to be
            worked on further; otherwise new trees are grown.
        batch: shortcuts between two looks at the stop rule, fewer among many objects.
        default_iterations: budget where no stop rule is given; three times as much while there is
            no plan.
    """

    push_weight: float = 3.0
    margin: float = 0.06
    turn_fraction: float = 0.9
    inset: float = 0.05
    spacing: float = 0.15
    edge: float = 1.6
    coarse_path_fraction: float = 0.8
    coarse_path_spread: float = 0.5
    avoid_iterations: int = 200
    tree_iterations: int = 1500
    shortcuts: int = 400
    least_gain: float = 0.001
    batch: int = 10
    default_iterations: int = 4000

    def __post_init__(self) -> None:
        number("push_weight", self.push_weight, low=0.0)
        for name in ("margin", "inset", "least_gain"):
            number(name, getattr(self, name), low=0.0, high=1.0)
        for name in ("turn_fraction", "coarse_path_fraction"):
            number(name, getattr(self, name), low=0.0, high=1.0, open_low=name == "turn_fraction")
        for name in ("spacing", "edge", "coarse_path_spread"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        integer("avoid_iterations", self.avoid_iterations, low=0)
        for name in ("tree_iterations", "shortcuts", "batch", "default_iterations"):
            integer(name, getattr(self, name), low=1)
