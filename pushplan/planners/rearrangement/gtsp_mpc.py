"""`GtspMpc`: sequence, approach, push, look, sequence anew."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from pushplan.control import clamp_twist
from pushplan.planners.rearrangement.choose import choose
from pushplan.planners.rearrangement.drive import PathTracer
from pushplan.planners.rearrangement.graph import SubTaskGraph
from pushplan.planners.rearrangement.greedy import GreedyPusher
from pushplan.planners.rearrangement.job import Job, JobEnd
from pushplan.planners.rearrangement.push import Push, signature
from pushplan.planners.rearrangement.rearrangement_config import SubTaskConfig
from pushplan.planners.rearrangement.recovery import way_out
from pushplan.planners.rearrangement.rollout_cache import Recall
from pushplan.planners.rearrangement.scene import Scene, check_world
from pushplan.world import InvalidInputError, Twist, World
from pushplan.world.checks import FloatArray, expect

_SIMPLE = 60.0
"""How long the simple pusher works where nothing is found [circumscribed radii at full speed]."""
_TRIES = 6
"""How often it does so in vain before what is left is given up."""
_DEAREST = 3.0
"""What is added to the price of a push that has failed [circumscribed radii]."""
_ENOUGH = 3
"""After so many failures a push is not made again before something else has been done."""


class GtspMpc:
    """Clears or delivers objects: which next, from which side, together with which others.

    After every push the sub-task graph is built anew from what is seen, and the order of pushes
    solved anew; the first of them is carried out. Where no push is found, a `GreedyPusher` works
    until one more object is done. No chance is involved.

    Args:
        config: settings.
        price: the price of work alone, see `SubTaskConfig`; not together with ``config``.

    Attributes:
        given_up: why nothing more is tried with an object, by id.
        plan: the pushes planned last, in order.
        graph: the graph that they come from.
    """

    actions = ("velocity",)

    def __init__(self, config: SubTaskConfig | None = None, price: float | None = None) -> None:
        if config is not None and price is not None:
            raise InvalidInputError("give either a config or a price, not both")
        if config is None:
            config = SubTaskConfig() if price is None else SubTaskConfig(price=price)
        self.config = expect("config", config, SubTaskConfig)
        self._hopes = replace(config, static_friction=0.0)
        self._forget()

    def _forget(self) -> None:
        self._job: Job | None = None
        self._recalls = Recall(), Recall()
        self._hopeful = False
        self._penalties: dict[tuple[object, ...], float] = {}
        self._barred: set[tuple[object, ...]] = set()
        self._failures = 0
        self._leaving: PathTracer | None = None
        self._left_from: FloatArray | None = None
        self._escape: list[tuple[float, float]] = []
        self._last_time = math.inf
        self._simple = GreedyPusher()
        self._simple_until, self._simple_left, self._in_vain = -math.inf, -1, 0
        self._stopped_at: Scene | None = None
        self.given_up: dict[int, str] = {}
        self.plan: tuple[Push, ...] = ()
        self.graph: SubTaskGraph | None = None

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        self._forget()

    def act(self, world: World, observation: Any = None) -> Twist:
        """The velocity for this step; stops when nothing is left to be done.

        Raises:
            InvalidInputError: if the goal is one for the robot, or the robot cannot stop.
        """
        check_world(world)
        if world.time <= self._last_time != math.inf:
            self._forget()
        self._last_time = world.time
        scene = self._scene(world)
        left = int((~scene.done).sum())
        if left != self._simple_left:  # something was done, or has come back
            self._simple_left, self._in_vain, self._simple_until = left, 0, -math.inf
            self._stopped_at, self._hopeful = None, False
            self._barred.clear()
            for recall in self._recalls:
                recall.searches = 0
        if not left:
            self._job, self.given_up, self.plan = None, {}, ()
            return Twist(0.0, 0.0)
        if self._stopped_at is not None and _alike(scene, self._stopped_at):
            return Twist(0.0, 0.0)
        if world.time < self._simple_until:
            return self._simple.act(world, observation)
        return self._decide(scene) or self._fall_back(scene)

    def _scene(self, world: World) -> Scene:
        """What is planned with: after nothing was found, with objects that slide along walls."""
        if self._hopeful:
            return Scene(world, self._hopes, self._recalls[1])
        return Scene(world, self.config, self._recalls[0])

    def _decide(self, scene: Scene) -> Twist | None:
        """The next command of a push; None if none is found."""
        world, chosen = scene.world, None
        for _ in range(4):
            if self._escape:
                speed, turn = self._escape.pop(0)
                return clamp_twist(world.robot, speed, turn)
            if self._leaving is not None:
                leaving = self._leaving.command(world.robot_pose)
                if leaving is not None:
                    return leaving
                self._leaving = None
            if self._job is None:
                if chosen is not None:  # one search a step is enough
                    break
                self._recalls[self._hopeful].age()
                barred = dict.fromkeys(self._barred, math.inf)
                chosen = choose(scene, self._penalties | barred)
                self.graph, self.plan = chosen.graph, chosen.plan
                self.given_up = dict(chosen.graph.infeasible)
                if chosen.first is None:
                    return self._at_a_loss(scene)
                push = chosen.first.push
                self._job = Job(
                    world,
                    push,
                    chosen.first.route,
                    self.config.period,
                    predictive=self.config.mpc and signature(push) not in self._penalties,
                )
            command = self._job.command(scene)
            if isinstance(command, Twist):
                return command
            self._close(scene, self._job, command)
        return Twist(0.0, 0.0)

    def _at_a_loss(self, scene: Scene) -> Twist | None:
        """Where no push is found: get out of a tight place, or else hope for less friction."""
        here, path = scene.world.robot_pose, way_out(scene)
        known = self._left_from is not None and bool(
            np.abs(self._left_from - here).max() < 0.02 * scene.size
        )
        if path is not None and not known:  # else that has been tried, and it has not moved
            self._left_from = here
            self._leaving = PathTracer(scene.world.robot, path, self.config.period)
            return self._leaving.command(here)
        self._hopeful = not self._hopeful
        return Twist(0.0, 0.0) if self._hopeful else None

    def _close(self, scene: Scene, job: Job, end: JobEnd) -> None:
        """Draw the conclusions from how a job ended."""
        self._job = None
        if end is JobEnd.DONE and not job.push.frees:
            self._failures = 0
            return
        if end is not JobEnd.MOOT:  # also what was freed: if that was in vain, another way
            key = signature(job.push)
            dearer = self._penalties[key] = self._penalties.get(key, 0.0) + _DEAREST * scene.size
            if dearer > (_ENOUGH - 0.5) * _DEAREST * scene.size:
                self._barred.add(key)
        if end is JobEnd.STUCK:
            self._failures += 1
            self._escape = _back(scene, self._failures)

    def _fall_back(self, scene: Scene) -> Twist:
        """Let the simple pusher work for a while; stop where that has not helped either."""
        world, ids = scene.world, scene.world.movables.ids
        if self._in_vain >= _TRIES:
            why = "neither a push for it was found, nor has simple pushing moved it on"
            self.given_up = {int(i): why for i in ids[~scene.done]}
            self._stopped_at = scene
            return Twist(0.0, 0.0)
        if self._in_vain == 0:
            self._penalties.clear()
            self._barred.clear()
        self._in_vain += 1
        self._simple_until = world.time + _SIMPLE * scene.size / world.robot.max_speed
        return self._simple.act(world)


def _alike(one: Scene, other: Scene) -> bool:
    """Whether nothing has moved in between."""
    same = np.array_equal(one.world.movables.ids, other.world.movables.ids)
    return same and bool(np.hypot(*(one.poses - other.poses)[:, :2].T).max() < 0.05 * one.size)


def _back(scene: Scene, tries: int) -> list[tuple[float, float]]:
    """A few commands that get the robot away from where it is stuck."""
    robot = scene.world.robot
    share = ((-1.0, 0.0), (-0.5, 1.0), (-0.5, -1.0), (0.7, 0.0))[tries % 4]
    steps = max(2, int(0.3 * scene.size / (robot.max_speed * scene.config.period)))
    return [(share[0] * robot.max_speed, share[1] * robot.max_turn_rate)] * steps
