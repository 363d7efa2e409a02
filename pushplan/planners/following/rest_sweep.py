"""`RestSweep`: predicts the rest of a plan anew, a part of it in each command."""

from __future__ import annotations

import math

from pushplan.interaction import InteractionModel
from pushplan.planners.following.replanning import sweep_rest
from pushplan.world import Plan, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_lengths

_WALLS = 80  # objects that take as long for each pose of the robot as the walls
_WHOLE = 65_536  # poses times objects, walls included, that are swept in one command
_PART = 16_384  # and those of a part of a longer rest: about a millisecond
_LEAST = 32  # poses of a part


class RestSweep:
    """Sweeps the rest of a plan from where everything is, and compares that with its prediction.

    A long rest among many objects is swept in parts, so that a command takes bounded time: in turn
    the next part of the way, and one part farther on, from where the part before has left the
    objects.
    """

    def __init__(self) -> None:
        self._plan: Plan | None = None
        """The plan whose farther parts are being swept."""
        self._at = 0
        self._farther_next = False
        self._excess = 0.0
        self._objects: FloatArray

    def look(
        self,
        world: World,
        plan: Plan,
        index: int,
        end: int,
        interaction: InteractionModel,
        farther: bool,
    ) -> tuple[int, float]:
        """Return the number of poses ahead at which the robot would jam, and the excess of work.

        Args:
            world: the scene now.
            plan: the present plan, with predictions for the objects of the world.
            index: of its last pose that the robot has passed.
            end: index after the last pose to look at.
            interaction: predicts the objects.
            farther: go on with the farther parts of a long rest; if False the next part alone.

        Returns:
            -1 for no jam; and the work beyond what was predicted [kg m], -inf until the last part.
        """
        count = len(world.movables) + _WALLS
        near = end
        if (end - index) * count > _WHOLE:
            near = min(end, index + max(_PART // count, _LEAST))
        if farther and self._farther_next and self._plan is plan:
            return self._look_farther(world, plan, index, near - index, end, interaction)
        jammed_at, excess, objects = _part(world, plan, index, near, interaction)
        if near == end or jammed_at >= 0 or not farther:
            self._plan = None
            return jammed_at, excess if near == end else -math.inf
        if self._plan is not plan:
            self._plan = plan
            self._at = near - 1
            self._excess = excess
            self._objects = objects
        self._farther_next = True
        return -1, -math.inf

    def _look_farther(
        self,
        world: World,
        plan: Plan,
        index: int,
        count: int,
        end: int,
        interaction: InteractionModel,
    ) -> tuple[int, float]:
        """Take the next of the farther parts, of ``count`` poses."""
        self._farther_next = False
        first = self._at
        start = world.moved(robot_pose=plan.poses[first], movable_poses=self._objects)
        self._at = min(end, first + count) - 1
        jammed_at, excess, self._objects = _part(start, plan, first, self._at + 1, interaction)
        self._excess += excess
        if jammed_at < 0 and self._at + 1 < end:
            return -1, -math.inf
        self._plan = None
        if jammed_at >= 0:
            return first - index + jammed_at, -math.inf
        return -1, self._excess


def _part(
    world: World, plan: Plan, index: int, end: int, interaction: InteractionModel
) -> tuple[int, float, FloatArray]:
    """Pose at which a part of a plan jams, its excess of work, and the objects after it."""
    assert plan.object_poses is not None
    now, _ = sweep_rest(world, plan, index, interaction, end)
    masses = world.movables.masses
    excess = _work(now.object_poses, masses) - _work(plan.object_poses[index:end], masses)
    return now.jammed_at, excess, now.object_poses[-1]


def _work(objects: FloatArray, masses: FloatArray) -> float:
    """Sum over objects (K,) with poses (N, K, 3) of mass times path length [kg m]."""
    # what was pushed does not come back to the last bit, and most objects of an office rest
    moved = (objects[-1] != objects[0]).any(axis=1)
    return float(path_lengths(objects[:, moved]) @ masses[moved])
