"""`GtspMpc`: observe, recover, choose, approach and push; then all of it again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pushplan.control import ImmediateExecutor, PoseFollower, Recovery
from pushplan.planners.rearrangement.placing import Placer
from pushplan.planners.rearrangement.push import Push, PushCost, PushHistory, push_plan, signature
from pushplan.planners.rearrangement.push_choice import (
    PendingChoice,
    PushChoice,
    choose_push,
    scene_after,
)
from pushplan.planners.rearrangement.push_controllers import ExecutionEnd, PushExecution
from pushplan.planners.rearrangement.push_graph import PushGraph
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.rearrangement.rearrangement_policy import (
    RearrangementPolicy,
)
from pushplan.planners.rearrangement.rollout_cache import RolloutCache
from pushplan.world import (
    Drive,
    InvalidInputError,
    ObjectGoals,
    Plan,
    PlanningExecutor,
    Stop,
    Twist,
    World,
)
from pushplan.world.checks import FloatArray, IntArray, expect

_SAME_OBJECTS = 0.05  # objects have not moved if all by less [circumscribed radii]
_SAME_PLACE = 0.02  # the robot has not moved if by less [circumscribed radii, rad]
_MOST_ENDS = 4  # pushes and recoveries that may end in one step until the robot waits
_COLLECTING = 0.5  # part of a pause in which pushes are simulated and no order is made
_SETTLING = 0.5  # time after which a robot that pauses stands, unless what it sees is noisy [s]
_PLACING_DRIVES = (Drive.DIFFERENTIAL, Drive.CAR, Drive.OMNIDIRECTIONAL)
_RETREAT = 0.3  # distance that the robot backs off where it makes no progress [circumscribed radii]


class GtspMpc(RearrangementPolicy):
    """Clears or delivers objects: which next, from which side, together with which others.

    After every push the push graph is built anew from what is seen, and the order of pushes
    solved anew; the first of them is carried out. No chance is involved. With an executor that
    takes time (`plan_with`) the next push is chosen while the present one is driven, for the scene
    that is expected after it.

    Args:
        config: settings.
        stop: stop rule of each decision, counted in simulated pushes. What a time limit interrupts
            goes on in the next step, while the robot stands (``max_pause`` of the config). By
            default ``max_rollouts`` of the config.
        costs: terms that are added to the cost by which pushes are chosen.
        overrides: fields of the default config to change, in place of ``config``.

    With a goal of `ObjectGoals` objects are brought to places of their own (docs/gtsp-mpc.md). Of
    the settings ``grip``, ``mpc``, ``order``, ``response`` and the noise count then; ``graph`` is
    empty.

    Attributes:
        given_up: why nothing more is tried with an object, by id.
        plan: the pushes planned last, in order.
        current_plan: the push in hand, with the route to it; None while there is none.
        graph: the graph that they come from.
    """

    def __init__(
        self,
        config: RearrangementConfig | None = None,
        *,
        stop: Stop | None = None,
        costs: Sequence[PushCost] = (),
        **overrides: Any,
    ) -> None:
        if config is not None and overrides:
            raise InvalidInputError("give either a config or fields of one, not both")
        if config is None:
            config = RearrangementConfig.of(**overrides)
        self.stop = None if stop is None else expect("stop", stop, Stop)  # type: ignore[type-abstract]
        self.costs = tuple(costs)
        for cost in self.costs:
            expect("costs", cost, PushCost)  # type: ignore[type-abstract]
        super().__init__(config)

    def _forget(self) -> None:
        super()._forget()
        self._executor: PlanningExecutor = ImmediateExecutor()
        self._placer = Placer(self.config, self.stop, np.random.default_rng(0))
        self._choosing: PendingChoice | None = None
        self._execution: PushExecution | None = None
        self._shown: Push | None = None
        self._unfinished: _Unfinished | None = None
        self._cache = RolloutCache()
        self._history = PushHistory()
        self._delivered: IntArray = np.zeros(0, dtype=np.int64)
        self._left = -1
        self._rounds = 0
        self._retreats = 0
        self._distance_at_end = math.inf
        self._recovered_from: FloatArray = np.full(3, np.inf)
        self._stopped_at: PushScene | None = None
        self.given_up: dict[int, str] = {}
        self.plan: tuple[Push, ...] = ()
        self.current_plan: Plan | None = None
        self.graph: PushGraph | None = None

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode; choices are made at once until `plan_with` says otherwise."""
        self._forget_choice()
        self._placer.abandon()
        if self._execution is not None:
            self._execution.abandon()
        super().reset(world, rng)
        self._placer = Placer(self.config, self.stop, rng)

    def plan_with(self, executor: PlanningExecutor) -> None:
        """See `pushplan.world.PlansBesideDriving`."""
        self._executor = self._placer.executor = executor

    def expect_noise(self, position: float, heading: float) -> None:
        """See `pushplan.world.ExpectsNoise`."""
        self.config = replace(self.config, position_noise=position, heading_noise=heading)
        self._placer.config = self.config

    def _check(self, world: World) -> None:
        if not isinstance(world.goal, ObjectGoals):
            super()._check(world)
        elif not (world.robot.min_speed < 0.0 and world.robot.drive in _PLACING_DRIVES):
            drives = ", ".join(drive.value for drive in _PLACING_DRIVES)
            raise InvalidInputError(
                "pushing objects to places needs a robot that can reverse, with min_speed below 0 "
                f"and one of the drives {drives}; got min_speed {world.robot.min_speed:g} and "
                f"{world.robot.drive.value}"
            )
        elif self.costs:
            raise InvalidInputError(
                "costs are for goals that objects share; with places of their own none counts"
            )

    def _act(self, world: World) -> Twist:
        if isinstance(world.goal, ObjectGoals):
            twist = self._placer.command(world, self._clock.held)
            self.given_up = self._placer.given_up
            self.plan = self._placer.plan
            self.current_plan = self._placer.current_plan
            return twist
        scene = self._observe(world)
        if not scene.left:
            self._execution = None
            self.given_up = {}
            self.plan = ()
            self.current_plan = None
            self._forget_choice()
            return Twist(0.0, 0.0)
        if self._stopped_at is not None and _alike(scene, self._stopped_at):
            return Twist(0.0, 0.0)
        for _ in range(_MOST_ENDS):
            command = self._recover(world)
            if command is None:
                if self._execution is None and not self._choose(scene):
                    break
                command = self._approach_and_push(scene)
            if command is not None:
                return command
        return Twist(0.0, 0.0)

    def _observe(self, world: World) -> PushScene:
        """Look at the scene, and notice what has been done since the last look."""
        scene = PushScene(world, self.config, self._cache, delivered=self._delivered)
        self._delivered = scene.movables.ids[scene.done]
        left = len(scene.left)
        if left != self._left:  # something was done, or has come back
            self._left = left
            self._rounds = 0
            self._stopped_at = None
            self._distance_at_end = math.inf
            self._history.count_progress(self.config)
        return scene

    def _choose(self, scene: PushScene) -> bool:
        """Choose a push and begin with it, or with a recovery.

        Returns:
            False if there is nothing to do, or the choice is not there yet.
        """
        if self._choosing is None:
            if "searched" in scene.progress:  # one search a step is enough
                return False
            scene.progress["searched"] = True
            searched = scene
            unfinished = self._unfinished
            if unfinished is not None:
                if _stands_still(scene, unfinished.scene):
                    searched = unfinished.scene  # the search goes on with what it has found
                elif (
                    unfinished.choice.first is not None
                    and scene.world.time - unfinished.began > _SETTLING
                ):
                    self._unfinished = None
                    return self._begin(scene, unfinished.choice)
            self._choosing = choose_push(
                searched,
                self._history,
                self._executor,
                self.stop,
                self.costs,
                last=self.plan,
                now=scene.world.time,
                collect=unfinished is not None
                and scene.world.time - unfinished.began < _COLLECTING * self.config.max_pause,
            )
        choosing = self._choosing
        if not choosing.fits(scene):
            self._forget_choice()
            return True
        if not choosing.call.ready(scene.world.time):
            return False
        self._choosing = None
        best: PushChoice | None = choosing.call.result()
        if best is not None and not choosing.ahead:
            best = self._best_so_far(scene, choosing.scene, best)
        return best is not None and self._begin(scene, best)

    def _best_so_far(
        self, scene: PushScene, searched: PushScene, choice: PushChoice
    ) -> PushChoice | None:
        """The choice to begin with; None if the robot stands while the search for a better goes on.

        Args:
            scene: as it is now.
            searched: for which the choice was made.
            choice: what has come of it.
        """
        before = self._unfinished
        self._unfinished = None
        if not choice.interrupted:
            return choice
        now = scene.world.time
        began = now if before is None else before.began
        if choice.first is None and before is not None and before.choice.first is not None:
            choice = before.choice
        late = searched.budget.out_of_time
        pauses = choice.first is not None and late and now - began < self.config.max_pause
        if pauses or choice.first is None:
            self._unfinished = _Unfinished(searched, choice, began)
        if not pauses:
            return choice
        self.graph = choice.graph
        self.plan = choice.plan
        return None

    def _approach_and_push(self, scene: PushScene) -> Twist | None:
        """The next command of the push in hand; None where there is none, or it has ended."""
        execution = self._execution
        if execution is None:
            return None
        command = execution.command(scene, self._clock.held)
        if isinstance(command, Twist):
            self._choose_ahead(scene, execution)
            self._show(scene.world, execution)
            return command
        self._close(scene, execution, command)
        return None

    def _show(self, world: World, execution: PushExecution) -> None:
        """Make `current_plan` that of the push in hand: of its route, then of the push."""
        push = execution.push
        if push is not self._shown and len(push.object_poses) == len(world.movables):
            self._shown = push
            route = None if execution.pushing else execution.route
            self.current_plan = push_plan(world, route, push)

    def _choose_ahead(self, scene: PushScene, execution: PushExecution) -> None:
        """Ask for the next push while one is driven, where that takes time."""
        ids = scene.movables.ids
        if not (self._executor.takes_time and execution.pushing) or execution.asked_for_next:
            return
        execution.asked_for_next = True
        if np.array_equal(ids, execution.ids):
            expected = scene_after(scene, execution.push)
            if not expected.done.all():
                self._choosing = choose_push(
                    expected,
                    self._history,
                    self._executor,
                    self.stop,
                    self.costs,
                    ahead=True,
                    last=self.plan,
                )

    def _forget_choice(self) -> None:
        if self._choosing is not None:
            self._choosing.call.abandon()
        self._choosing = None

    def _begin(self, scene: PushScene, choice: PushChoice) -> bool:
        """Take up the best push, or else recover; False if there is nothing to do."""
        self.graph = choice.graph
        self.plan = choice.plan
        self.given_up = dict(choice.graph.infeasible)
        if choice.first is not None:
            push = choice.first.push
            self._execution = PushExecution(
                push,
                choice.first.route,
                scene.world.robot,
                self.config,
                self._executor,
                predictive=self.config.mpc and signature(push) not in self._history.failures,
            )
            return True
        here = scene.world.robot_pose
        moved = np.abs(self._recovered_from - here).max() > _SAME_PLACE * scene.size
        if choice.recovery is not None and moved:
            self._recovered_from = here
            follower = PoseFollower(scene.world.robot, choice.recovery, self.config.response)
            self._recovery = follower.drive
            self._unfinished = None
            self._cache = RolloutCache()  # that nothing was found is no longer true out there
            return True
        if choice.interrupted:  # the next search begins with what is known by now
            return False
        if self._history.failures and self._rounds < self.config.max_rounds:
            self._history.failures.clear()
            self._rounds += 1
            return True
        if choice.searches < self.config.max_searches:  # else the search goes on
            return self._tries_anew(scene)
        return False

    def _tries_anew(self, scene: PushScene) -> bool:
        """Forget what was searched elsewhere, or tried when objects were farther away, or stop."""
        self._unfinished = None
        if self._cache.is_from_elsewhere(scene.robot_cell):
            self._cache = RolloutCache()
            return True
        remaining = scene.remaining_now[scene.left]
        distance = float(remaining[np.isfinite(remaining)].sum())
        tried = self._history.failures or self._history.relocations
        if not tried or distance >= self._distance_at_end - scene.size:
            self._stopped_at = scene
            return False
        self._distance_at_end = distance
        self._rounds = 0
        self._history = PushHistory()
        return True

    def _close(self, scene: PushScene, execution: PushExecution, end: ExecutionEnd) -> None:
        """Draw the conclusions from how an execution ended."""
        self._execution = None
        self.current_plan = None
        push = execution.push
        if end is ExecutionEnd.DONE and not push.relocates:
            self._retreats = 0
            return
        if end is not ExecutionEnd.OBSOLETE:  # also a relocation, so that another comes next
            self._history.failures[signature(push)] += 1
        if end is ExecutionEnd.DONE:
            self._history.count_relocation(push)
        if end is ExecutionEnd.STUCK:
            distance = _RETREAT * scene.size
            self._recovery = Recovery(
                scene.world, distance, skip=self._retreats, looks=False, searches=False
            ).command
            self._retreats += 1


@dataclass(frozen=True, eq=False)
class _Unfinished:
    """A decision that its stop rule has interrupted.

    Args:
        scene: for which it is made, with what was found so far.
        choice: the best one so far.
        began: when the first call began, by the clock of the world [s].
    """

    scene: PushScene
    choice: PushChoice
    began: float


def _stands_still(one: PushScene, other: PushScene) -> bool:
    """Return True if neither the robot nor an object has moved between two scenes."""
    moved = np.abs(one.world.robot_pose - other.world.robot_pose).max()
    return bool(moved <= _SAME_PLACE * one.size) and _alike(one, other)


def _alike(one: PushScene, other: PushScene) -> bool:
    """Return True if nothing has moved between two scenes."""
    same = np.array_equal(one.world.movables.ids, other.world.movables.ids)
    return same and bool(
        np.hypot(*(one.poses - other.poses)[:, :2].T).max() < _SAME_OBJECTS * one.size
    )
