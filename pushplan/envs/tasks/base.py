"""Base class of tasks. A task uses only quantities of a `World`, so any engine can run it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np

from pushplan.envs.simulators.base import Materials
from pushplan.envs.tasks.presets import SOLIDS, Preset
from pushplan.envs.tasks.variations import TaskVariations
from pushplan.imports.on_demand import need
from pushplan.observation import ObservationBuilder, StateObservation
from pushplan.world import (
    Drive,
    InvalidInputError,
    Movables,
    RobotModel,
    ScenarioError,
    UnknownNameError,
    World,
)
from pushplan.world.checks import BoolArray, FloatArray, IntArray, choice
from pushplan.world.stored.robots import ROBOTS, make_robot, robots


@dataclass(frozen=True)
class StepOutcome:
    """Reward and end of one step of an episode.

    Args:
        reward: as the task defines it.
        success: the goal is reached.
        reason: why the episode ends, ``""`` while it goes on.
        terminated: the episode is over for the task.
        truncated: it was cut off.
        completed: (K,) True where the sub-task of an object of the start is done now; None where
            the goal is one for the robot itself.
    """

    reward: float
    success: bool
    reason: str = ""
    terminated: bool = False
    truncated: bool = False
    completed: BoolArray | None = None


FAILURE_REWARD = -50.0
"""Of a robot with a goal that runs into a wall, or leaves the map."""
SUCCESS_REWARD = 200.0


class Task(ABC):
    """One task with one preset and its variations.

    Args:
        preset: one of `presets`, the first if None.
        variations: what departs from the preset, by name.
        action: name of the action mode, one of `actions`, the first if None; `drive_of` says what
            the robot becomes.

    Raises:
        UnknownNameError: if there is no such preset, variation or action.
        ScenarioError: if the value of a variation makes no sense.
    """

    name: ClassVar[str]
    goal_kind: Literal["robot", "objects"] = "robot"
    """Who has a goal: decides which metrics apply."""
    preset_table: ClassVar[Mapping[str, Preset]] = {"benchmark": Preset()}
    """Dimensions by the name of the preset."""
    variation_class: ClassVar[type[TaskVariations]] = TaskVariations
    presets: ClassVar[tuple[str, ...]] = ("benchmark",)
    """Sets of dimensions; the first is the default."""
    solid_presets: ClassVar[tuple[str, ...]] = ()
    """Those with a third dimension; the first is the default of an engine that needs one."""
    actions: ClassVar[tuple[str, ...]]
    """Action modes that make sense; the first is the default."""
    observations: ClassVar[tuple[str, ...]] = ("state",)
    """Names of the observations; the first is the default."""

    control_step: float
    """Time between two commands to the robot [s]."""
    materials: Materials = Materials()
    robot: RobotModel
    state_objects: int = 20
    """Objects that the state observation has room for; the nearest where there are more."""
    reach: float
    """No coordinate and no distance that is observed exceeds this [m]."""
    slowness: float
    """Factor by which an episode may last longer than the preset allows, for a slower robot."""
    heading_step: float = 0.0
    """Distance that a heading action drives [m], where the task has it."""
    waypoint_window: float = 0.0
    """Side of the square around the robot that waypoint actions reach [m], where it has them."""

    preset: Preset
    """The dimensions, one of the values of `preset_table`."""
    variations: Any = TaskVariations()

    def __init__(
        self,
        *,
        preset: str | None = None,
        variations: Mapping[str, object] | None = None,
        action: str | None = None,
    ) -> None:
        preset = self.presets[0] if preset is None else preset
        self.action = self.actions[0] if action is None else action
        if preset not in self.preset_table:
            raise UnknownNameError(f"preset of {self.name}", preset, self.preset_table)
        if self.action not in self.actions:
            raise UnknownNameError(f"action of task {self.name!r}", self.action, self.actions)
        self.preset = self.preset_table[preset]
        self.variations = self.variation_class.read({} if variations is None else variations)
        self._steps = 0
        self._prepare()

    @classmethod
    def goal_kind_of(cls, variations: Mapping[str, object]) -> Literal["robot", "objects"]:
        """`goal_kind` with these variations."""
        return cls.goal_kind

    def _prepare(self) -> None:
        """Set what is the same in every start: the robot, the materials, the times, the goal."""
        raise NotImplementedError(f"task {self.name!r} has neither __init__ nor _prepare")

    def _make_robot(self) -> RobotModel:
        """Set the robot of the preset, with what is asked for, and all that `_drive` sets.

        Returns:
            It with the preset's own limits.

        Raises:
            ScenarioError: if there is no such robot, or the bumper does not fit it.
        """
        preset = self.preset
        wanted = self.variations
        name = getattr(wanted, "robot", None)
        bumper = getattr(wanted, "bumper", None)
        name = next(iter(preset.robots)) if name is None else name
        solid = preset.materials.solids is not None  # then heights and wheels are asked for
        others = () if solid else sorted(robots().keys() - ROBOTS)
        own = name in others or ":" in name
        try:
            if solid and ":" in name:
                raise InvalidInputError(
                    f"robot {name!r} has no third dimension, which this preset needs "
                    f"(valid: {', '.join(preset.robots)})"
                )
            if not own:
                choice("robot", name, (*preset.robots, *others))
            usual = preset.robots.get(name, {}).get("bumper", preset.bumper)
            if usual is None and bumper not in (None, "none"):
                raise InvalidInputError(
                    f"bumper {bumper!r} does not fit the robot of this preset: it has none, or "
                    "one of its own (valid: none)"
                )
        except InvalidInputError as error:
            raise ScenarioError(f"{self.name}: {error}") from error
        options = {}
        if usual is not None and not (own and bumper is None):
            options["bumper"] = bumper or usual
        make = make_robot if own else preset.robot
        robot: RobotModel = make(name, drive_of(self.action), **options)
        self._drive(robot)
        if self.materials.solids is not None and name in SOLIDS:
            self.materials = replace(self.materials, solids=SOLIDS[name])
        return robot

    def _drive(self, robot: RobotModel) -> None:
        """Set robot, materials, control step and slowness: the preset and what departs from it."""
        preset = self.preset
        wanted = self.variations
        self.materials = wanted.change_materials(preset.materials)
        if wanted.wheeled and self.materials.water is not None:
            raise ScenarioError(
                f"{self.name}: wheeled must be 0 in a preset with water, got {wanted.wheeled:g}"
            )
        self.robot = wanted.limit(robot)
        self.control_step = wanted.control_step or preset.control_step
        speed = robot.max_speed
        turn = robot.max_turn_rate
        self.slowness = max(1.0, speed / self.robot.max_speed, turn / self.robot.max_turn_rate)

    @property
    def _longest(self) -> float:
        """Default time limit of an episode [s]: longer for a slower robot."""
        seconds: float = self.preset.max_steps * self.preset.control_step * self.slowness
        return seconds

    @property
    def _max_steps(self) -> int:
        """Control steps until an episode is cut off."""
        limit = self.variations.time_limit
        limit = self._longest if limit is None else limit
        return math.ceil(limit / self.control_step - 1e-9)

    @abstractmethod
    def start(self, rng: np.random.Generator) -> World:
        """A new start, drawn from the task's distribution; also forgets the last episode.

        Raises:
            ScenarioError: if the request cannot be met, such as too many boxes.
        """

    def varied(
        self, world: World, rng: np.random.Generator, *, flat: bool
    ) -> tuple[World, Materials]:
        """Draw masses, limit surfaces, casters and friction as the variations ask for.

        Args:
            world: a new start.
            rng: the only source of randomness.
            flat: True in a planar simulator, the only kind that has limit surfaces.

        Returns:
            The start, and the materials that it has.
        """
        wanted = self.variations
        materials = wanted.vary_materials(self.materials, rng)
        self._nominal, objects = wanted.vary_objects(world.movables, rng, flat=flat)
        if objects is not world.movables:
            world = replace(world, movables=objects)
        return world, materials

    def told(self, world: World) -> World:
        """Return the scene that a policy gets to see.

        It is the true one, with nominal masses and limit surfaces where these are unknown.

        Args:
            world: the scene as the simulator has it.
        """
        if self.variations.parameters == "known" or self._nominal is None:
            return world
        objects = world.movables
        nominal = self._nominal.select(np.isin(self._nominal.ids, objects.ids))
        return replace(world, movables=nominal.moved_to(objects.poses, objects.twists))

    _nominal: Movables | None = None  # the objects of a start as the preset has them

    may_overlap: bool = False
    """True if objects of a start may overlap one another."""

    objects_leave: bool = False
    """True if objects can leave the floor, so that `leaving` has to be asked."""

    def leaving(self, ids: IntArray, poses: FloatArray) -> IntArray:
        """Ids of the objects that leave the floor now; asked after every control step.

        Args:
            ids: (K,) of the objects on the floor.
            poses: (K, 3) of them.
        """
        raise NotImplementedError(f"nothing ever leaves the floor in task {self.name!r}")

    @abstractmethod
    def score(
        self, before: World, after: World, *, work: float, touched_static: bool
    ) -> StepOutcome:
        """Score the step from ``before`` to ``after``, and tell whether the episode ends.

        Args:
            before: the world when the step began.
            after: the world when it ended, without the objects that have left the floor.
            work: sum over the objects of mass times path length in this step [kg m].
            touched_static: the robot touched something static.
        """

    def _driven(self, reward: float, after: World, *, failure: str = "") -> StepOutcome:
        """The outcome of a step where the goal is one for the robot.

        Args:
            reward: for the motion.
            after: the world when the step ended.
            failure: why the episode has failed, even where the goal is reached at once.
        """
        self._steps += 1
        if failure:
            return StepOutcome(reward + FAILURE_REWARD, False, failure, True)
        if after.navigation_goal.distance(*after.robot_pose[:2].tolist()) == 0.0:
            return StepOutcome(reward + SUCCESS_REWARD, True, "goal", True)
        if self._steps >= self._max_steps:
            return StepOutcome(reward, False, "time_limit", truncated=True)
        return StepOutcome(reward, False)

    @classmethod
    def observation_names(cls) -> tuple[str, ...]:
        """Names of all observations: those of the task, and the one that every task has."""
        return (*cls.observations, "lidar")

    def observation(self, name: str) -> ObservationBuilder:
        """The builder of an observation by name.

        Raises:
            UnknownNameError: if the task has no such observation.
        """
        if name == "lidar":
            builder: ObservationBuilder = need("pushplan.perception.lidar_observation").builder_for(
                self.robot, self.variations.view_range
            )
            return builder
        if name not in self.observations:
            raise UnknownNameError(
                f"observation of task {self.name!r}", name, self.observation_names()
            )
        if name == "state":
            return StateObservation(max_objects=self.state_objects)
        return self._image(name)

    def _image(self, name: str) -> ObservationBuilder:
        """The builder of any other observation than ``"state"``."""
        raise NotImplementedError(f"task {self.name!r} has neither observation nor _image")


def drive_of(action: str) -> Drive:
    """Return the drive of a robot that is commanded by an action mode."""
    if action == "turn_rate":
        return Drive.CONSTANT_SPEED
    if action == "omnidirectional":
        return Drive.OMNIDIRECTIONAL
    return Drive.DIFFERENTIAL
