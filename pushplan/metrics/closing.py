"""Detection of robots that have closed their own path for good."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache

from pushplan.interaction import QuasiStatic
from pushplan.motion.keyholes import (
    KeyholeConfig,
    KeyholeSearch,
    nearest_free_pose,
    suits_keyholes,
)
from pushplan.motion.time_slicing import Stopped
from pushplan.world import Episode, GoalDisc, GoalLine, World

_CONFIG = KeyholeConfig()
PUSHES = 300
"""Simulated pushes after which a scene counts as unsolvable."""


def made_unsolvable(episode: Episode) -> float | None:
    """1 where the start could be solved and the end cannot be, else 0.

    A scene can be solved where the robot, as a disc of 1.06 circumscribed radii, gets to the goal
    without touching anything, or after pushes along a line, one after another, that
    `pushplan.motion.keyholes.KeyholeSearch` finds with its default parameters within `PUSHES`
    pushes, in the quasi-static model with friction 0.1 at the robot and 0.5 at walls. Objects that
    are fixed in the recorded start are static. An episode with success ends solved.

    Returns:
        None where the goal is one for the objects, there are no walls or no objects or too many,
        the robot does not turn on the spot and drive back, or the start counts as unsolvable.
    """
    world = episode.world
    if not isinstance(world.goal, GoalDisc | GoalLine):
        return None
    if not suits_keyholes(world, _CONFIG) or not _solvable(episode.world_at(0)):
        return None
    if episode.success or _solvable(episode.world_at(-1)):
        return 0.0
    return 1.0


@lru_cache(maxsize=64)
def _solvable(world: World) -> bool:
    """Return True if pushes open a path to the goal from the free place nearest to the robot."""
    world = world.with_fixed_as_static()
    search = KeyholeSearch(
        world.moved(robot_pose=nearest_free_pose(world, _CONFIG)),
        _CONFIG,
        QuasiStatic(friction=0.1, static_friction=0.5),
        lambda pushes: pushes >= PUSHES,
    )
    with suppress(Stopped):
        return search.run() is not None
    return False
