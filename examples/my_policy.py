"""Two policies of one's own: a planner with another controller, and one that never plans.

``pushplan bench maze-2d-5 --policies straight,examples/my_policy.py:Pursuer --episodes 20``
"""

import numpy as np
from my_planner import GridAStar  # the file beside this one

from pushplan.control import PurePursuit
from pushplan.planners import PlanFollower
from pushplan.world import Twist


class Pursuer(PlanFollower):
    """Follows the plans of `my_planner.py` by pure pursuit, looking farther ahead."""

    def __init__(self):
        super().__init__(GridAStar(), PurePursuit(lookahead=1.5))


class Bull:
    """Drives at the goal, whatever is in the way: boxes move, walls end the episode."""

    actions = ("velocity", "turn_rate")  # what it asks an environment for, the preferred one first

    def reset(self, world, rng):
        """Forget the last episode: nothing to forget."""

    def act(self, world, observation):
        """The command for this step; ``world`` is what is there now."""
        x, y = world.goal.center - world.robot_pose[:2]
        error = np.arctan2(y, x) - world.robot_pose[2]
        error = np.arctan2(np.sin(error), np.cos(error))  # the short way round
        robot = world.robot
        turn = np.clip(2.0 * error, -robot.max_turn_rate, robot.max_turn_rate)
        return Twist(robot.max_speed * max(np.cos(error), 0.0), float(turn))
