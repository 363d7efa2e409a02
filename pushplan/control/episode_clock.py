"""`EpisodeClock`: the time between the snapshots of one episode."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pushplan.world import InvalidInputError, Twist, World
from pushplan.world.checks import number


class EpisodeClock:
    """Knows for how long commands are held, and when a snapshot is no news.

    Whoever drives step by step asks it first. A snapshot with the time of the last one is the
    same instant, for which there is one command. Only `reset` forgets.

    Args:
        period: for which the first command is held [s]; later ones are held for as long as the
            times of the snapshots show.
    """

    def __init__(self, period: float) -> None:
        self._period = number("period", period, low=0.0, open_low=True)
        self.reset()

    def reset(self) -> None:
        """Forget the episode."""
        self._seen: World | None = None
        self.command = Twist(0.0, 0.0)
        """Command that was sent last."""
        self.held = self._period
        """Time from the snapshot before the present one to that [s]."""

    def command_for(self, world: World, choose: Callable[[World], Twist]) -> Twist:
        """The command for a snapshot: chosen at a later instant, else the same again.

        Args:
            world: the scene now.
            choose: chooses a command for it, with the objects that are fixed among what is
                static; `command` and `held` tell of the one before.

        Raises:
            InvalidInputError: as `advance`.
        """
        world = world.with_fixed_as_static()
        if self.advance(world):
            self.command = choose(world)
        return self.command

    def advance(self, world: World) -> bool:
        """Take a snapshot.

        Args:
            world: the scene now.

        Returns:
            Whether it is of a later instant than the one before; `command` stands where it is not.

        Raises:
            InvalidInputError: if its time is before that of the last one, or is the same although
                the robot or an object has moved.
        """
        seen = self._seen
        if seen is not None and world.time <= seen.time:
            if world.time < seen.time:
                raise InvalidInputError(
                    f"world.time went back from {seen.time:g} s to {world.time:g} s within an "
                    "episode: call reset() where another one begins"
                )
            if _has_moved(seen, world):
                raise InvalidInputError(
                    f"world.time stands at {world.time:g} s while things move: give each snapshot "
                    "the time at which it was taken, or call reset() where an episode begins"
                )
            return False
        if seen is not None:
            self.held = world.time - seen.time
        self._seen = world
        return True


def _has_moved(before: World, after: World) -> bool:
    if before is after:
        return False
    one = before.movables
    other = after.movables
    same = np.array_equal(before.robot_pose, after.robot_pose)
    return not (same and len(one) == len(other) and np.array_equal(one.poses, other.poses))
