"""`NoiseAllowance`: what plans allow for, where poses are not exact."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pushplan.world import GoalDisc, RobotModel, World
from pushplan.world.checks import expect


@dataclass(frozen=True)
class NoiseAllowance:
    """How a world is changed before a policy plans in it.

    Args:
        place: standard deviation of the noise that is left in places [m].
        heading: the same of headings [rad].
        period: between two commands [s].
        margin: distance that plans keep from what is static [m]; if None that of the world, and
            twice what noise leaves at the robot's farthest point, whichever is more.
    """

    place: float
    heading: float
    period: float
    margin: float | None

    def noise_margin(self, robot: RobotModel) -> float:
        """Twice what noise leaves at the robot's farthest point [m]."""
        return 2.0 * (self.place + self.heading * robot.circumscribed_radius)

    def planning_world(self, world: World) -> World:
        """The world with the margin, and with a goal in which the robot is sure to be."""
        world = expect("world", world, World)
        goal = world.goal
        inset = 3.0 * self.place + world.robot.max_speed * self.period  # the last command acts
        if isinstance(goal, GoalDisc):
            world = replace(
                world, goal=GoalDisc(goal.center, max(goal.radius - inset, 0.5 * goal.radius))
            )
        margin = self.margin
        if margin is None:
            margin = max(world.margin, self.noise_margin(world.robot))
        return world if margin == world.margin else replace(world, margin=margin)
