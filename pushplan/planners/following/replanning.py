"""When a plan is replaced, and by what: the replanning rule."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pushplan.core import motion as core
from pushplan.interaction import Interaction, InteractionModel
from pushplan.motion.collision import footprint, obstacles
from pushplan.world import GoalDisc, GoalLine, Plan, World
from pushplan.world.checked_fields import CheckedFields, Limits, NonNegativeFloat
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import arc_lengths, path_length

_SPACING = 0.15  # distance between the poses of a path that are looked at [R]


class Reason(enum.Enum):
    """Why a new plan is wanted."""

    NO_PLAN = "no plan"
    OBJECTS = "objects came or went"
    OFFSET = "the robot has left the path"
    USED_UP = "the plan is used up"
    TIGHT = "out of a tight place"
    JAM = "the robot would jam"
    BLOCKED = "the robot is about to jam"
    SURPRISE = "the plan costs more than was predicted"
    PERIOD = "it is time"

    @property
    def urgent(self) -> bool:
        """True where the old plan cannot be driven on."""
        return self not in (Reason.OBJECTS, Reason.TIGHT, Reason.SURPRISE, Reason.PERIOD)


_Endless = Annotated[float, Limits(0.0, open_low=True, finite=False)]


@dataclass(frozen=True)
class Replanning(CheckedFields):
    """When a plan no longer fits the world. Lengths in units of the circumscribed radius R.

    Args:
        offset: distance from the path that makes a new plan necessary [R].
        surprise: how much more the rest of the plan may cost than was predicted, in units of
            driving R further; infinite if that is no reason.
        look_ahead: how far along the rest of the plan that is looked at [R].
        interval: least time between two plans for the same reason [s of travel of R at full
            speed]; a plan on which the robot would jam is replaced at once.
        never: follow the first plan to its end, as the paper's RRT does.
        margin: how much cheaper than the rest of the old plan a new one has to be to replace it,
            in units of driving R; both are swept from the present world, and their travel, w times
            their interaction, and the straight way from their ends to the goal are compared. A
            plan that cannot be driven on is replaced anyway. None replaces without comparing.
        push_weight: w; None takes that of the planner's config, or 1 if it has none.
        every_seconds: plan again when the plan is this old [s].
        renewal: plan again when the robot is this far from where it planned [R].
        latency: time for which a planning call takes [s]. A plan then starts where the robot will
            be after it, and is joined to the part of the old plan up to there. None stands for 0
            where plans are there at once, and for what the last calls took in latency-aware
            simulation.
    """

    offset: NonNegativeFloat = 0.3
    surprise: Annotated[float, Limits(0.0, finite=False)] = 0.1
    interval: NonNegativeFloat = 0.5
    never: bool = False
    look_ahead: _Endless = math.inf
    margin: NonNegativeFloat | None = 0.1
    push_weight: NonNegativeFloat | None = None
    every_seconds: _Endless = math.inf
    renewal: _Endless = math.inf
    latency: NonNegativeFloat | None = None

    def weight(self, planner: object) -> float:
        """The weight w of interaction in comparisons of this planner's plans."""
        if self.push_weight is not None:
            return self.push_weight
        return float(getattr(getattr(planner, "config", None), "push_weight", 1.0))


def rest_of(plan: Plan, index: int, predicted: FloatArray | None) -> Plan:
    """Return the rest of a plan from its pose ``index`` on.

    Args:
        plan: the plan.
        index: of the last pose that the robot has passed.
        predicted: (N - index, K, 3) where the objects are expected to be from there on; those of
            the plan if None.
    """
    if index == 0 and predicted is None:
        return plan
    objects = plan.object_poses
    if predicted is None and objects is not None:
        predicted = objects[index:]
    length = plan.length
    mass = plan.travel_cost / length if length > 0.0 else 0.0
    rest = Plan(
        times=plan.times[index:] - plan.times[index],
        poses=plan.poses[index:],
        speeds=plan.speeds[index:],
        turn_rates=plan.turn_rates[index:],
        travel_cost=mass * path_length(plan.poses[index:]),
        interaction_cost=plan.interaction_cost if index == 0 else 0.0,
    )
    # checked already, and not copied: it may be millions of numbers
    object.__setattr__(rest, "object_poses", predicted)
    return rest


def sweep_rest(
    world: World, plan: Plan, index: int, interaction: InteractionModel, end: int | None = None
) -> tuple[Interaction, FloatArray]:
    """Predict the effect of driving from the robot's pose to the plan's poses after ``index``.

    Args:
        world: the world now.
        plan: the plan.
        index: of the last pose that the robot has passed.
        interaction: predicts the objects.
        end: index after the last pose that is looked at; all by default.

    Returns:
        The interaction, and the (N, 3) poses that were swept.
    """
    path = np.concatenate([world.robot_pose[None], plan.poses[index + 1 : end]])
    return interaction.sweep(world, path), path


def poses_at(at: FloatArray, along: FloatArray, path: FloatArray) -> FloatArray:
    """(M, 3) poses at places (M,) of a path (N, 3) whose own lie ``along`` (N,) it."""
    columns = (path[:, 0], path[:, 1], np.unwrap(path[:, 2]))
    return np.column_stack([np.interp(at, along, column) for column in columns])


def free_length(world: World, path: FloatArray) -> float:
    """Return the length of a path before the robot meets static obstacles [m]; inf if it does not.

    Args:
        world: the scene; half of its margin counts as met.
        path: (N, 3) poses, from that of the robot on.
    """
    size = world.robot.circumscribed_radius
    lengths = arc_lengths(path)
    turns = np.abs(np.diff(np.unwrap(path[:, 2])))
    along = lengths + size * np.concatenate([[0.0], np.cumsum(turns)])
    fine = np.linspace(0.0, along[-1], 1 + math.ceil(along[-1] / (_SPACING * size)))
    poses = poses_at(fine, along, path)
    shape = footprint(world.robot, 0.5 * world.margin)
    first = core.CollisionChecker(shape, obstacles(world.static)).first_blocked(poses)
    if first == len(fine):
        return math.inf
    return float(np.interp(fine[first], along, lengths))


def cost_of_rest(world: World, path: FloatArray, swept: Interaction, weight: float) -> float:
    """Travel, plus ``weight`` times interaction, plus the straight way to the goal [kg m].

    Infinite for a path on which the robot jams.
    """
    if swept.jammed_at >= 0:
        return math.inf
    length = path_length(path)
    if isinstance(world.goal, GoalDisc | GoalLine):
        length += world.goal.distance(float(path[-1, 0]), float(path[-1, 1]))
    return world.robot.mass * length + weight * swept.work


@dataclass(frozen=True)
class Comparison:
    """Compares a new plan with the rest of the present one, both from one world.

    Args:
        world: the scene when the new plan was asked for.
        plan: the present plan.
        index: of its last pose that the robot has passed.
        interaction: predicts the objects.
        weight: of interaction, w.
        margin: how much cheaper the new plan has to be [R].
    """

    world: World
    plan: Plan
    index: int
    interaction: InteractionModel
    weight: float
    margin: float

    def rest_unless_cheaper(self, new: Plan) -> Plan | None:
        """The rest of the present plan as it is predicted now; None if a new plan replaces it."""
        robot = self.world.robot
        swept, path = sweep_rest(self.world, self.plan, self.index, self.interaction)
        old_cost = cost_of_rest(self.world, path, swept, self.weight)
        swept_new, path = sweep_rest(self.world, new, 0, self.interaction)
        new_cost = cost_of_rest(self.world, path, swept_new, self.weight)
        if new_cost < old_cost - self.margin * robot.circumscribed_radius * robot.mass:
            return None
        if np.isinf(old_cost):
            return None
        # what is expected of it from now on
        return rest_of(self.plan, self.index, swept.object_poses)
