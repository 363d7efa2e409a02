"""`Command`: what a robot drives now, and why; `RunLog`, which keeps it."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol

from pushplan.world import Plan, Twist, World


class CommandStatus(enum.StrEnum):
    """Purpose of a command."""

    DRIVING = "driving"
    """Command of the policy, within the robot's limits."""
    WAITING = "waiting"
    """The robot stands until a plan is there."""
    BLOCKED = "blocked"
    """Slowed down or stopped, because something static or fixed is in the way."""
    STUCK = "stuck"
    """Command of the policy, but the robot has not moved for 5 s though it was told to."""
    DONE = "done"
    """The robot, or every object, is surely where the goal wants it; final until `start`."""
    STALE = "stale"
    """A controlled stop, because the newest world is too old."""
    FAILED = "failed"
    """A controlled stop, because planning or the policy failed."""
    CANCELLED = "cancelled"
    """A controlled stop that was asked for."""


@dataclass(frozen=True)
class Command:
    """Command to send to the motors.

    Args:
        time: for which it was asked, by the clock of the worlds [s].
        twist: the velocity to drive; within speeds, turn rate and accelerations of the robot.
        status: what it is for.
        reason: why the robot is being stopped, waits or is stuck; empty where it is driven.
        plan: what is followed; None for policies without one.
        plan_age: time since that plan was taken up [s].
        world_age: time since the newest world was seen [s].
        late: the call came more than half a period after it was due.
    """

    time: float
    twist: Twist
    status: CommandStatus
    reason: str = ""
    plan: Plan | None = None
    plan_age: float = 0.0
    world_age: float = 0.0
    late: bool = False


class RunLog(Protocol):
    """Keeps what a `Runner` sees and does; a log that raises is not called again."""

    def world(self, world: World) -> None:
        """A snapshot has come in."""

    def plan(self, plan: Plan, time: float) -> None:
        """A plan was taken up, at a time [s]."""

    def command(self, command: Command) -> None:
        """A command was given."""
