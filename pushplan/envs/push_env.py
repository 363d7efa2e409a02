"""`PushEnv`: one Gymnasium environment for every task and every simulator."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from pushplan.control import clamp_twist
from pushplan.envs.action_modes import ActionMode, Motion, chosen_action, waiting
from pushplan.envs.registry import ACTIONS, SIMULATORS, default_preset, task_class
from pushplan.envs.simulators.base import Simulator, Trace
from pushplan.envs.start_checks import check_start
from pushplan.envs.tasks.base import StepOutcome, Task
from pushplan.envs.window import Renderer
from pushplan.imports.on_demand import look_up, need
from pushplan.observation import ObservationBuilder
from pushplan.world import (
    Action,
    InvalidInputError,
    Movables,
    PushplanError,
    ScenarioError,
    Twist,
    UnknownNameError,
    World,
    stream,
)
from pushplan.world.checks import IntArray, frozen, integer, number

_SEED_LIMIT = 2**31
_LONGEST = 5.0  # control steps for which a command stands that may touch something


class EpisodeOverError(PushplanError, gymnasium.error.ResetNeeded):
    """`PushEnv.step` was called before `reset`, or after the end of an episode."""


class PushEnv(gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """A robot that pushes things about, as a Gymnasium environment.

    Args:
        task: name of the task.
        simulator: name of the simulator, or one with numerical settings of its own.
        preset: set of dimensions of the task; the first that suits the simulator if None.
        variations: what departs from the preset, by name.
        observation: name of one of the task's observations, or a builder of one's own; the
            task's first if None.
        action: name of the action mode, or several, of which the first that the task has is
            taken; the task's first if None.
        render_mode: ``"rgb_array"`` (a drawing from above), ``"camera"`` (the simulator's own
            camera), ``"human"`` (a window) or None.
        seed: of the first episode, where `reset` is given none.

    ``info`` of each step holds ``success`` (bool), ``reason`` (why the episode has ended, else
    ``""``), ``work`` (mass times path length of the objects in this step [kg m]), ``held``
    (whether something kept the robot from moving as commanded) and, where the goal is one for the
    objects, ``completed`` ((K,) bool, whether the sub-task of each object is done).

    Raises:
        UnknownNameError: if a name is unknown; the message lists the valid ones.
        ScenarioError: if the value of a variation makes no sense, or if the simulator needs a
            third dimension that the preset has not.
        MissingDependencyError: if there is no display for a window.
    """

    observation_time_s = 0.0
    """Wall-clock time that the last observation took to make [s]."""

    def __init__(
        self,
        *,
        task: str,
        simulator: str | Simulator = "pymunk",
        preset: str | None = None,
        variations: Mapping[str, object] | None = None,
        observation: str | ObservationBuilder | None = None,
        action: str | Sequence[str] | None = None,
        render_mode: str | None = None,
        seed: int | None = None,
    ) -> None:
        kind = task_class(task)
        if isinstance(simulator, Simulator):
            self._simulator = simulator
            simulator = simulator.name
        else:
            self._simulator = look_up("simulator", SIMULATORS, simulator)()
        self._may_adapt = action is None
        action = chosen_action(kind, action)
        if preset is None:
            preset = default_preset(task, simulator)
        if preset not in kind.presets:
            raise UnknownNameError(f"preset of {task}", preset, kind.presets)
        self._renderer = Renderer(render_mode, self._simulator)
        self.metadata = self._renderer.metadata
        self.render_mode = render_mode
        variations = {} if variations is None else variations
        self._make_task = partial(kind, preset=preset, variations=variations)
        self._use_action(action)
        if self._simulator.needs_solids and self.task.materials.solids is None:
            raise ScenarioError(
                f"{task}: simulator {simulator!r} needs a third dimension, which preset "
                f"{preset!r} has not (valid: {', '.join(kind.solid_presets)})"
            )
        if observation is None or isinstance(observation, str):
            observation = self.task.observation(observation or kind.observations[0])
        if not hasattr(observation, "observe"):
            raise UnknownNameError(f"observation of {task}", observation, kind.observation_names())
        self._builder: ObservationBuilder = observation
        if seed is not None:
            seed = integer("seed", seed, low=0)
        self._first_seed = seed
        self._world: World | None = None
        self._sensing: Any = None  # a `SimulatedSensing` where not everything is seen
        self._trace: Trace | None = None
        self._over = "reset() has not been called"
        self.observation_space: Any = _space(self._builder, self.task.reach)

    def _use_action(self, name: str) -> None:
        mode: type[ActionMode] = look_up("action", ACTIONS, name)
        self.task: Task = self._make_task(action=name)
        self._mode = mode(self.task)
        self._mode_name = name
        self.action_space: Any = self._mode.space

    def take_velocities(self) -> bool:
        """Change to the first action mode of the task that takes a `Twist`, for the next reset.

        Returns:
            True if the mode has changed: it does not where it was asked for by name, or takes
            velocities already.
        """
        if not self._may_adapt or self._mode.takes_velocities:
            return False
        for name in self.task.actions:
            if look_up("action", ACTIONS, name).takes_velocities:
                self._use_action(name)
                self._over = "the action mode has changed"
                return True
        return False

    @property
    def action_mode(self) -> str:
        """The name of the action mode, such as ``"turn_rate"``."""
        return self._mode_name

    @property
    def observation_builder(self) -> ObservationBuilder:
        """Builder of the observations."""
        return self._builder

    def observed(self, builder: ObservationBuilder) -> NDArray[Any]:
        """The scene now as a builder observes it: what is known of it, or the last scan.

        Raises:
            EpisodeOverError: before the first `reset`.
        """
        sensor: Any = builder
        if not getattr(sensor, "is_sensor", False):
            return builder.observe(self.world)
        world = self.true_world
        if self._sensing is None:
            return builder.observe(world)
        scan: NDArray[Any] = sensor.observe_scan(self._sensing.scan, self.world)
        return scan

    @property
    def world(self) -> World:
        """A snapshot of the scene now, as far as a policy is told (`Task.told`) and has seen.

        Raises:
            EpisodeOverError: before the first `reset`.
        """
        if self._sensing is None:
            return self.task.told(self.true_world)
        world: World = self._sensing.world
        return world

    @property
    def true_world(self) -> World:
        """A snapshot of the scene now, as the simulator has it.

        Raises:
            EpisodeOverError: before the first `reset`.
        """
        if self._world is None:
            raise EpisodeOverError("there is no world yet: call reset() first")
        return self._world

    @property
    def trace(self) -> Trace:
        """Motion during the last step, at the control rate or finer; the start after a reset."""
        if self._trace is None:
            raise EpisodeOverError("there is no trace yet: call reset() first")
        return self._trace

    def encode(self, action: Action) -> NDArray[np.float32]:
        """The array in the action space for a command, clipped to the space.

        Raises:
            InvalidInputError: if it is not finite or has the wrong shape.
        """
        return self._mode.encode(action)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Start an episode; warns of bodies that overlap, see `pushplan.envs.start_checks`.

        Args:
            seed: decides the start, alone; without it the next start of the sequence that the
                last seed began.
            options: none are known.
        """
        if options:
            raise InvalidInputError(f"reset() knows no options, got {options!r:.80}")
        if seed is not None:
            seed = integer("seed", seed, low=0)
        else:
            seed = self._first_seed
        self._first_seed = None
        super().reset(seed=seed)
        layout = seed
        if layout is None:
            layout = int(self.np_random.integers(_SEED_LIMIT))
        world = self.task.start(stream(layout, "layout"))
        flat = not self._simulator.needs_solids
        world, materials = self.task.varied(world, stream(layout, "parameters"), flat=flat)
        check_start(world, overlaps=self.task.may_overlap)
        self._simulator.build(world, materials)
        self._world = world
        self._meanwhile = clamp_twist(world.robot, 0.0, 0.0)
        self._roster = _Roster(world.movables)
        self._trace = Trace(
            frozen(np.array([world.time])), world.robot_pose[None], world.movables.poses[None]
        )
        self._over = ""
        self._renderer.show(world)
        self._sensing = None
        if self.task.variations.sensing != "full":
            told = self.task.told(world)
            sensing = need("pushplan.envs.sensing").SimulatedSensing
            beams = getattr(self._builder, "beams", 0)
            self._sensing = sensing(self.task.variations, told, stream(layout, "sensing"), beams)
            self._sensing.look(told)
        info = _info(StepOutcome(0.0, False, "", False, False), 0.0, False)
        if world.goal_kind == "objects":
            info["completed"] = np.zeros(len(world.movables), dtype=bool)
        return self._observe(), info

    def step(self, action: ArrayLike) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Carry out one action.

        Args:
            action: array of the action space; values beyond its bounds are clipped.

        Raises:
            EpisodeOverError: if the episode has ended or not begun.
            InvalidInputError: if the action is not finite or has the wrong shape.
        """
        return self._carry_out(self._started(action))

    def step_late(
        self, action: ArrayLike, lag: float
    ) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Carry out one action that comes some time after the scene was observed.

        Until then the robot goes on as it was commanded last; a robot that was commanded to go to
        a point has stopped there. Before the first action a differential drive stands and a
        constant-speed robot goes straight on. The time is simulated, counts for the task like any
        other, and is part of this step's reward and trace.

        Args:
            action: as for `step`.
            lag: how late it comes [s].

        Raises:
            EpisodeOverError, InvalidInputError: as `step`.
        """
        motion = self._started(action)
        period = self.task.control_step
        whole, rest = divmod(number("lag", lag, low=0.0), period)
        steps = [*(waiting(self._meanwhile) for _ in range(int(whole))), motion]
        if rest > 1e-9 * period:
            steps[-1] = waiting(self._meanwhile, rest / period, then=motion)
        rewards = 0.0
        work = 0.0
        held = False
        traces = []
        for part in steps:
            observation, reward, terminated, truncated, info = self._carry_out(part)
            rewards = rewards + reward
            work = work + info["work"]
            held = held or info["held"]
            traces.append(self.trace)
            if terminated or truncated:
                break
        self._trace = Trace.join(traces)
        info = {**info, "work": work, "held": held}
        return observation, rewards, terminated, truncated, info

    def _started(self, action: ArrayLike) -> Motion:
        if self._over:
            raise EpisodeOverError(f"{self._over}: call reset() before step()")
        return self._mode.start(self._mode.read(action), self.true_world)

    def _carry_out(self, motion: Motion) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Simulate a motion to its end and score it."""
        before = self.true_world
        simulator = self._simulator
        roster = self._roster
        traces = []
        touched = held = now_held = False
        now = before.time
        while (wanted := motion(simulator.robot_pose, now, now_held)) is not None:
            command, periods = wanted
            duration = self._stands_for(command, periods)
            traces.append(roster.widen(simulator.step(command, duration)))
            now = float(traces[-1].times[-1])
            touched |= simulator.touched_static
            now_held = simulator.held
            held |= now_held
            if self.task.objects_leave:
                gone = self.task.leaving(roster.present, simulator.object_poses)
                if len(gone):
                    simulator.remove(gone.tolist())
                    roster.drop(gone)
            if self._sensing is not None:
                self._sensing.look(self.task.told(simulator.world()), command)
        self._meanwhile = self._mode.afterwards(command)
        after = simulator.world()
        self._world = after
        self._trace = Trace.join(traces)
        work = roster.work(self._trace)
        outcome = self.task.score(before, after, work=work, touched_static=touched)
        if outcome.terminated or outcome.truncated:
            self._over = f"the episode has ended ({outcome.reason})"
        self._renderer.show(after)
        return (
            self._observe(),
            outcome.reward,
            outcome.terminated,
            outcome.truncated,
            _info(outcome, work, held),
        )

    def _stands_for(self, command: Twist, periods: float) -> float:
        """Return the duration of a command that may last several control steps [s].

        Long where the robot touches nothing; otherwise the robot may be held, or an object leave.
        """
        period = self.task.control_step
        if periods <= 1.0 or not self._simulator.is_exact or self._sensing is not None:
            return period * min(periods, 1.0)
        clear = self._simulator.clear_for(command, period * periods)
        most = 1.0 if self.task.objects_leave else min(periods, _LONGEST)
        return period * max(most, math.floor(clear / period + 1e-9))

    def _observe(self) -> NDArray[Any]:
        began = time.perf_counter()
        observation = self.observed(self._builder)
        self.observation_time_s = time.perf_counter() - began
        return observation

    def render(self) -> NDArray[np.uint8] | None:
        """The scene now as (H, W, 3) uint8; None in ``"human"`` mode, which draws by itself."""
        if self.render_mode is None:
            return None
        return self._renderer.render(self.true_world)

    def close(self) -> None:
        """Close the window, if there is one; may be called again."""
        self._renderer.close()


class _Roster:
    """The objects of the start, some of which may have left the floor."""

    def __init__(self, movables: Movables) -> None:
        self.present: IntArray = movables.ids
        self._poses = np.array(movables.poses)
        self._before = self._poses
        self._masses = movables.masses
        self._rows = np.arange(len(movables))
        self._ids = movables.ids

    def widen(self, trace: Trace) -> Trace:
        """The trace of all objects of the start; one that has left keeps its last pose."""
        if len(self.present) == len(self._ids):
            self._poses = trace.object_poses[-1]
            return trace
        poses = np.repeat(self._poses[None], len(trace.times), axis=0)
        poses[:, self._rows] = trace.object_poses
        self._poses = poses[-1]
        return Trace(trace.times, trace.robot_poses, frozen(poses))

    def drop(self, ids: IntArray) -> None:
        """Objects have left the floor."""
        self._rows = self._rows[~np.isin(self.present, ids)]
        self.present = self._ids[self._rows]

    def work(self, trace: Trace) -> float:
        """Mass times path length [kg m] since the last call."""
        lengths = trace.object_lengths(self._before)
        self._before = self._poses
        return float(self._masses @ lengths)


def _space(builder: ObservationBuilder, reach: float) -> Box:
    """The space of an observation; numbers are bounded by what the task can reach."""
    kind: Any = np.dtype(builder.dtype)
    limits = []
    for bound in (builder.low, builder.high):
        limit = np.asarray(bound)
        if kind.kind == "f":
            limit = np.clip(np.asarray(bound, dtype=np.float64), -reach, reach)
        limits.append(np.broadcast_to(limit, builder.shape).astype(kind))
    low, high = limits
    return Box(low, high, builder.shape, kind)


def _info(outcome: StepOutcome, work: float, held: bool) -> dict[str, Any]:
    info = {"success": outcome.success, "reason": outcome.reason, "work": work, "held": held}
    if outcome.completed is not None:
        info["completed"] = outcome.completed
    return info
