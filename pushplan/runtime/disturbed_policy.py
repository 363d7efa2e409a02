"""`DisturbedPolicy`: a policy in a `Runner`, behind simulated perception and actuators."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from pushplan.control import DelayedExecutor, clamp_twist
from pushplan.control.limits import driven_twist
from pushplan.runtime.runner import Runner
from pushplan.world import Planner, Policy, Twist, World
from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    PositiveFloat,
)
from pushplan.world.checks import BoolArray, FloatArray, number
from pushplan.world.policy_abilities import action_modes


@dataclass(frozen=True)
class Disturbances(CheckedFields):
    """Departures of perception and actuators from the ideal.

    Args:
        position_noise: standard deviation of every seen x and y, of robot and objects [m].
        heading_noise: the same of every heading [rad].
        delay: between the time that a world shows and the time when it comes in [s].
        loss: fraction of the worlds that never come in.
        burst: mean number of worlds lost one after another.
        rate: worlds seen in a second at most [Hz]; all by default.
        mass_factor: masses that are told over those that objects have.
        lag: time constant of the actuators [s].
        vanish: for what fraction of the time each object is not seen.
        vanish_time: for how long at a time, on average [s].
        jump: fraction of the worlds in which one object is seen elsewhere.
        jump_distance: how far [circumscribed radii of the robot].
    """

    position_noise: NonNegativeFloat = 0.0
    heading_noise: NonNegativeFloat = 0.0
    delay: NonNegativeFloat = 0.0
    loss: Annotated[float, Limits(0.0, 0.95)] = 0.0
    burst: Annotated[float, Limits(1.0)] = 4.0
    rate: Annotated[float, Limits(0.0, open_low=True, finite=False)] = math.inf
    mass_factor: PositiveFloat = 1.0
    lag: NonNegativeFloat = 0.0
    vanish: Annotated[float, Limits(0.0, 0.95)] = 0.0
    vanish_time: PositiveFloat = 2.0
    jump: Annotated[float, Limits(0.0, 0.95)] = 0.0
    jump_distance: NonNegativeFloat = 1.0

    field_prefix: ClassVar[str] = "disturbances "


class DisturbedPolicy:
    """Simulated robot that runs a policy by `Runner`; itself a policy, so that it fits any loop.

    Each call of ``act`` is one period of the robot's loop. All chance comes from the generator of
    the episode, and planning takes a fixed time, so that episodes repeat exactly.

    Args:
        policy: a policy, a planner, or a name, as for `Runner`.
        disturbances: what perception and actuators do.
        period: of the robot's loop, which is that of the environment [s].
        planning_time: what every planning call takes [s].
        runner: further arguments of `Runner`. By default it knows the noise and the delays of the
            actuators, as on a robot that has been measured.
    """

    def __init__(
        self,
        policy: Policy | Planner | str,
        disturbances: Disturbances | None = None,
        *,
        period: float,
        planning_time: float = 0.05,
        **runner: Any,
    ) -> None:
        self.disturbances = disturbances or Disturbances()
        number("planning_time", planning_time, low=0.0)
        d = self.disturbances
        known = {
            "delay": 0.7 * d.lag,
            "position_noise": d.position_noise,
            "heading_noise": d.heading_noise,
            "keep_unseen": 6.0 * d.vanish_time if d.vanish > 0.0 else 0.0,
        }
        self._options = {"max_age": 1.0, **known, **runner}
        self._policy = policy
        self._period = period
        self._planning_time = planning_time
        driven = self._make().policy
        self.actions = action_modes(driven) or ("velocity", "turn_rate")
        self.runner: Runner | None = None

    def _make(self) -> Runner:
        executor = DelayedExecutor(self._planning_time)
        return Runner(self._policy, period=self._period, executor=executor, **self._options)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Begin an episode; nothing is hidden in the first snapshot."""
        self._rng = rng
        self._inbox: deque[tuple[float, World]] = deque()
        self._applied = driven_twist(world)
        self._hidden = np.zeros(len(world.movables), dtype=np.bool_)
        self._seen_at = world.time
        self._acted_at = world.time
        self._lost = False
        self._start: World | None = world
        self.runner = None

    def act(self, world: World, observation: Any = None) -> Twist:
        """Return the velocity that the actuators drive in this period."""
        if self.runner is None:
            assert self._start is not None
            self.runner = self._make()
            every = np.ones(len(world.movables), dtype=np.bool_)
            command = self.runner.start(self._noisy(world, every))
        else:
            self._see(world)
            while self._inbox and self._inbox[0][0] <= world.time + 1e-9:
                self.runner.update(self._inbox.popleft()[1])
            command = self.runner.command(world.time)
        return self._actuate(world, command.twist)

    def _actuate(self, world: World, twist: Twist) -> Twist:
        held = world.time - self._acted_at
        self._acted_at = world.time
        lag = self.disturbances.lag
        if lag <= 0.0:
            return twist
        part = -math.expm1(-held / lag)
        last = self._applied
        self._applied = clamp_twist(
            world.robot,
            last.linear + part * (twist.linear - last.linear),
            last.angular + part * (twist.angular - last.angular),
            last.lateral + part * (twist.lateral - last.lateral),
        )
        return self._applied

    def _see(self, world: World) -> None:
        """Put what perception makes of the world into the inbox, unless it is lost."""
        d = self.disturbances
        rng = self._rng
        if world.time < self._seen_at + 1.0 / d.rate - 1e-9:
            return
        passed = world.time - self._seen_at
        self._seen_at = world.time
        if d.loss > 0.0:  # a chain with two states: mean length of a burst, and fraction lost
            chance = d.loss / (d.burst * (1.0 - d.loss))
            if self._lost:
                chance = 1.0 - 1.0 / d.burst
            self._lost = bool(rng.random() < chance)
        seen = self._noisy(world, self._visible(world, passed))
        if not self._lost:
            self._inbox.append((world.time + d.delay, seen))

    def _visible(self, world: World, passed: float) -> BoolArray:
        """(K,) which objects are seen."""
        d = self.disturbances
        movables = world.movables
        if d.vanish <= 0.0:
            return np.ones(len(movables), dtype=np.bool_)
        most = max(int(movables.ids.max(initial=-1)) + 1, len(self._hidden))
        self._hidden = np.pad(self._hidden, (0, most - len(self._hidden)))
        draw = self._rng.random(most)
        stays = math.exp(-passed / d.vanish_time)
        begins = (1.0 - stays) * d.vanish / (1.0 - d.vanish)
        self._hidden = np.where(self._hidden, draw < stays, draw < begins)
        return ~self._hidden[movables.ids]

    def _noisy(self, world: World, visible: BoolArray) -> World:
        d = self.disturbances
        rng = self._rng
        movables = world.movables
        scale = np.array([d.position_noise, d.position_noise, d.heading_noise])
        noise = scale * rng.normal(size=(1 + len(movables), 3))
        poses: FloatArray = movables.poses + noise[1:]
        if d.jump > 0.0 and len(movables) and rng.random() < d.jump:
            angle = rng.uniform(-math.pi, math.pi)
            far = d.jump_distance
            far *= world.robot.circumscribed_radius
            poses[rng.integers(len(movables)), :2] += far * np.array(
                [math.cos(angle), math.sin(angle)]
            )
        seen = movables.moved_to(poses)
        if d.mass_factor != 1.0:
            seen = replace(seen, masses=d.mass_factor * seen.masses)
        return replace(
            world,
            robot_pose=world.robot_pose + noise[0],
            movables=seen if visible.all() else seen.select(visible),
        )
