"""`Placer`: pushes every object to its place, one decision after the other."""

from __future__ import annotations

import math

import numpy as np

from pushplan.control import ImmediateExecutor, Legs, Recovery
from pushplan.geometry.object_ways import blocked_places
from pushplan.planners.rearrangement.placing.place_execution import PlaceExecution, Transit
from pushplan.planners.rearrangement.placing.place_order import PlaceChoice, first_push, way_to
from pushplan.planners.rearrangement.placing.place_push import PlacingHistory
from pushplan.planners.rearrangement.placing.place_pushes import PlacePushes
from pushplan.planners.rearrangement.placing.placing_scene import PlacingScene
from pushplan.planners.rearrangement.push import Push, push_plan
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import PendingResult, Plan, PlanningExecutor, Stop, Twist, World
from pushplan.world.checks import FloatArray

_MOST_ENDS = 3  # pushes and recoveries that may end in one step until the robot waits
_RETREAT = 0.3  # distance that the robot backs off where it is stuck [circumscribed radii]
_SLIPPED = 0.1  # way of an object on the bumper that shows too little grip [circumscribed radii]
_LESS_GRIP = 0.75  # part of the grip that is counted on from then on
_LEAST_GRIP = 0.4  # least part of that of the settings
_WAIT = 1.0  # time after which it looks again where there is no push [s]; then twice as long,
_LONGEST_WAIT = 60.0  # and at most so long [s]


class Placer:
    """Decides which object to push next, and by which push; drives it, and decides anew.

    Args:
        config: settings.
        stop: stop rule of each decision.
        rng: of a random order.

    Attributes:
        given_up: why nothing is tried with an object, by id.
        plan: the pushes planned last, in order.
        current_plan: the push in hand, with the way to it; None while there is none.
    """

    def __init__(
        self, config: RearrangementConfig, stop: Stop | None, rng: np.random.Generator
    ) -> None:
        self.config = config
        self._stop = stop
        self.executor: PlanningExecutor = ImmediateExecutor()
        self._call: PendingResult[PlaceChoice | Legs | FloatArray | None] | None = None
        self._execution: PlaceExecution | None = None
        self._to_goal: Transit | None = None
        self._history = PlacingHistory()
        self._rng = rng
        self._most_done = 0
        self._look_at = -math.inf
        self._wait = _WAIT
        self._grip = config.grip
        self._recovery: Recovery | None = None
        self._retreats = 0
        self.given_up: dict[int, str] = {}
        self.plan: tuple[Push, ...] = ()
        self.current_plan: Plan | None = None

    def command(self, world: World, held: float) -> Twist:
        """The velocity to drive now.

        Args:
            world: the scene now.
            held: for how long the command will be held [s].
        """
        for _ in range(_MOST_ENDS):
            if self._recovery is not None:
                twist = self._recovery.command(world, held)
                if twist is not None:
                    return twist
                self._recovery = None
            if self._execution is not None:
                twist = self._execution.command(world, held)
                if twist is not None:
                    return twist
                self._close(world, self._execution)
                continue
            if self._to_goal is not None:
                twist = self._to_goal.command(world, held)
                if twist is not None:
                    return twist
                if not self._to_goal.arrived:
                    self._recover(world)
                self._to_goal = None
                continue
            if world.goal_reached or world.time < self._look_at or not self._choose(world):
                break
        return Twist(0.0, 0.0)

    def abandon(self) -> None:
        """Wait no longer for a decision."""
        if self._call is not None:
            self._call.abandon()

    def _choose(self, world: World) -> bool:
        """Begin with a push; False if there is none, or it is not chosen yet."""
        if self._call is None:
            scene = PlacingScene(world, self._grip)
            self.given_up = {
                label: f"its place is {depth:.3g} m inside something static, so no push leads there"
                for label, depth in blocked_places(world).items()
            }
            self._call = self.executor.submit(
                lambda stop: self._best(scene, stop), world.time, self._stop
            )
        if not self._call.ready(world.time):
            return False
        choice = self._call.result()
        self._call = None
        if choice is None:
            self._give_up(world)
            return self._recovery is not None
        self._wait = _WAIT
        if not isinstance(choice, PlaceChoice):
            self.plan = ()
            self._to_goal = Transit(world.robot, choice, self.config)
            return True
        push = choice.push
        if push.label in world.movables.ids:
            if push.favours is not None:
                self._history.waits[push.label] = push.favours
            self._execution = PlaceExecution(choice, world.robot, self.config, self._grip)
            self.plan = tuple(each.predicted(world) for each in choice.order)
            self.current_plan = push_plan(world, choice.way, self.plan[0])
        return True

    def _give_up(self, world: World) -> None:
        """Wait, forget what has failed, and get off what the robot touches."""
        self._history.failures.clear()
        self._grip = self.config.grip
        self._look_at = world.time + self._wait
        self._wait = min(2.0 * self._wait, _LONGEST_WAIT)
        if not PlacingScene(world, self._grip).can_set_out:
            self._recover(world)

    def _best(
        self, scene: PlacingScene, stop: Stop | None
    ) -> PlaceChoice | Legs | FloatArray | None:
        """The next push, or the way to the robot's own goal."""
        if not scene.left and scene.goal.robot is None:
            return None
        if not scene.left:
            return way_to(scene, scene.robot_goal)
        check = None if stop is None else stop.start()
        pushes = PlacePushes(scene, self._history, check)
        thorough = PlacingScene(scene.world, scene.friction, thorough=True)
        more = PlacePushes(thorough, self._history, check)
        for options in (
            pushes.towards_places,
            pushes.making_room,
            more.towards_places,
            more.making_room,
            more.of_waiting,
            more.shoves,
        ):
            choice = first_push(scene, options(), self.config.order, self._rng)
            if choice is not None:
                return choice
        return None

    def _close(self, world: World, execution: PlaceExecution) -> None:
        """Note what the push has done."""
        self._execution = None
        self.current_plan = None
        push = execution.push
        missed = not world.completed[world.movables.ids == push.label].all()
        if missed and abs(execution.slip) > _SLIPPED * world.robot.circumscribed_radius:
            self._grip = max(_LESS_GRIP * self._grip, _LEAST_GRIP * self.config.grip)
        done = int(np.sum(world.completed))
        if done > self._most_done:
            self._most_done = done
            self._history.failures.clear()
            self._retreats = 0
        elif missed or not push.final:
            self._history.count(push)
        if execution.stuck:
            self._recover(world)

    def _recover(self, world: World) -> None:
        """Get off whatever the robot touches."""
        distance = _RETREAT * world.robot.circumscribed_radius
        self._recovery = Recovery(world, distance, skip=self._retreats, looks=False, searches=False)
        self._retreats += 1
