"""Driving a kinematic robot through a Pymunk space, substep by substep, without jamming it."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pushplan.envs.simulators.pymunk_bodies import PymunkBodies
from pushplan.world import InvalidInputError, RobotModel, Twist
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveInt
from pushplan.world.checks import FloatArray, IntArray

_Small = Annotated[float, Limits(0.0, 0.2, open_low=True)]


@dataclass(frozen=True)
class PymunkOptions(CheckedFields):
    """Numerical settings. Lengths are fractions of the objects' median radius.

    Where sizes differ much, four times the least radius counts instead, if that is smaller.

    Args:
        travel: how far the fastest point of the robot may move in one substep. At the default
            (2.8 mm for a 1 m box) boxes end where substeps ten times finer put them to 0.2 % of
            their size (median) and total work agrees to 0.1 %: docs/simulators.md has the table.
        slop: overlap that the contact solver leaves alone. It has to be small against an object,
            because an object rides that far inside its pusher, and not much smaller than
            ``travel``, because an object that is pushed out of contact in each substep is hit
            again in the next and chatters.
        tolerance: overlap at which the robot is held, when something static is involved.
        decay: fraction of its speed that a rolling or floating object may lose in one substep.
        iterations: sweeps of the contact solver in each substep.
        samples: poses recorded in each call of `PymunkSimulator.step`, at even intervals.
        holds_direction: the robot keeps the direction in the world that it had when a
            command began, and turns beside that, as in the code of the 2D benchmark; else its
            velocity turns with it, on an arc.
    """

    field_prefix = "pymunk "

    travel: _Small = 0.008
    slop: _Small = 0.002
    tolerance: _Small = 0.012
    decay: _Small = 0.04
    iterations: PositiveInt = 10
    samples: PositiveInt = 8
    holds_direction: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tolerance < self.travel + self.slop:
            raise InvalidInputError(
                f"pymunk tolerance must be at least travel + slop = "
                f"{self.travel + self.slop:g}, got {self.tolerance:g}"
            )


class _Moved(enum.Enum):
    """Part of the wanted motion that a substep has made."""

    ALL = enum.auto()
    SOME = enum.auto()
    NOTHING = enum.auto()


class PymunkDriver:
    """Moves the robot as commanded, or as nearly as it can.

    A kinematic robot has no limit of force, and would press an object through a wall. So a
    substep after which some overlap has grown past the tolerance, while something static is
    touched, is taken back. Until the next sample the robot then turns on the spot as commanded
    or, where that is no better, turns and gives way backwards; if it can do neither it stays where
    it is for the rest of the step.

    Args:
        bodies: the scene.
        robot: its limits.
        options: numerical settings.
        size: length [m] of which the options' lengths are fractions.
    """

    def __init__(
        self, bodies: PymunkBodies, robot: RobotModel, options: PymunkOptions, size: float
    ) -> None:
        self.held = False
        """True if the robot was kept from moving as commanded in the last run."""
        self._bodies = bodies
        self._radius = robot.circumscribed_radius
        self._limit = options.tolerance * size
        self._holds_direction = options.holds_direction
        self._deepest = 0.0
        self._measured = False
        self._yielding = 0.0

    @property
    def touched(self) -> bool:
        """True if the robot touched something static in the last run."""
        return self._bodies.contacts.robot_touched

    def run(
        self,
        command: Twist,
        duration: float,
        start: FloatArray,
        active: IntArray,
        counts: tuple[int, int],
        course: float,
        *,
        careful: bool = False,
    ) -> FloatArray:
        """Run the substeps of one step.

        Args:
            command: the velocity in the body frame.
            duration: of the step [s].
            start: (1 + A, 6) rows of the robot and the objects that are simulated.
            active: (A,) indices of those objects.
            counts: samples, and substeps between two of them.
            course: direction in the world [rad] that the robot keeps, if it keeps one.
            careful: keep a way back from every substep. Without care one is kept only where
                something static is touched already, which is enough nearly always; where it was
                missing, the step begins again, carefully.

        Returns:
            (samples, 1 + A, 6) rows.
        """
        bodies = self._bodies
        w = command.angular
        held = course if self._holds_direction else None
        samples, each = counts
        h = duration / (samples * each)
        half = 0.5 * w * h
        # the chord of an arc is shorter than the arc by sin(x) / x
        chord = command.linear * (math.sin(half) / half if half and held is None else 1.0)
        bodies.load(active, start)
        self.held = False
        rows = np.empty((samples, *start.shape))
        heading = float(start[0, 2])
        for i in range(samples):
            advancing = chord  # a robot that is held tries again after the next sample
            j = 0
            while j < each:
                first = i == 0 and j == 0
                # a jam needs something static, so most substeps do without a way back
                if not (first or careful or bodies.static_contacts):
                    done, heading = bodies.march(advancing, heading, held, w, h, each - j)
                    j += done
                    if not self._sound(self._limit):
                        return self.run(
                            command, duration, start, active, counts, course, careful=True
                        )
                    continue
                middle = heading + half if held is None else held
                vx = advancing * math.cos(middle)
                vy = advancing * math.sin(middle)
                outcome = self._substep(vx, vy, w, h, first=first)
                if outcome is _Moved.NOTHING:  # nor will it in the rest of the step
                    rows[i:] = bodies.read()
                    return rows
                if outcome is _Moved.SOME:
                    advancing = self._yielding
                    heading = float(bodies.robot.angle)
                else:
                    heading += w * h
                j += 1
            rows[i] = bodies.read()
        return rows

    def sweep(
        self,
        velocity: tuple[float, float, float],
        h: float,
        count: int,
        start: FloatArray,
        active: IntArray,
    ) -> FloatArray:
        """Move at one velocity in the world frame until done or held.

        Args:
            velocity: x, y [m/s] and turn rate [rad/s].
            h: length of a substep [s].
            count: number of substeps.
            start: as in `run`.
            active: as in `run`.

        Returns:
            (1, 1 + A, 6) rows at the end.
        """
        self._bodies.load(active, start)
        self.held = False
        for i in range(count):
            if self._substep(*velocity, h, first=i == 0) is not _Moved.ALL:
                break
        return self._bodies.read()[None]

    def _substep(self, vx: float, vy: float, w: float, h: float, *, first: bool) -> _Moved:
        """Move everything by ``h`` seconds, the robot at a velocity in the world frame."""
        bodies = self._bodies
        limit = self._limit
        packed = bodies.snapshot()
        unknown = first or not self._measured  # how deep the overlaps are that were there before
        allowed = limit if unknown else max(limit, self._deepest)
        if self._try(vx, vy, w, h, allowed):
            return _Moved.ALL
        before = bodies.unpack(packed)
        resting = bodies.slowed(before, h)
        if unknown:  # overlaps that were deeper before are no reason to hold the robot
            still = before.copy()
            still[:, 3:] = 0.0
            bodies.write(still)
            bodies.drive(0.0, 0.0, 0.0)
            bodies.advance(h)
            allowed = max(limit, bodies.depth)
            bodies.write(before)
            if self._try(vx, vy, w, h, allowed):
                return _Moved.ALL
        self.held = True
        heading = float(before[0, 2])
        for speed in (0.0, -abs(w) * self._radius) if w else ():
            bodies.write(resting)
            if self._try(speed * math.cos(heading), speed * math.sin(heading), w, h, allowed):
                self._yielding = speed
                return _Moved.SOME
        bodies.write(resting)
        if resting[1:, 3:].any() and self._try(0.0, 0.0, 0.0, h, allowed):
            self._yielding = 0.0
            return _Moved.SOME
        resting[:, 3:] = 0.0
        bodies.write(resting)
        return _Moved.NOTHING

    def _try(self, vx: float, vy: float, w: float, h: float, allowed: float) -> bool:
        """Advance by ``h`` [s]; whether no overlap beyond ``allowed`` [m] has come of it."""
        self._bodies.drive(vx, vy, w)
        self._bodies.advance(h)
        return self._sound(allowed)

    def _sound(self, allowed: float) -> bool:
        """Return True if the last substep caused no overlap beyond ``allowed`` [m]."""
        bodies = self._bodies
        measured = bodies.static_contacts > 0
        depth = bodies.depth if measured else 0.0
        if depth <= allowed:
            self._deepest = depth
            self._measured = measured
            return True
        return False
