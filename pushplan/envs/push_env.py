"""`PushEnv`: one Gymnasium environment for every task and every simulator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from pushplan.envs.actions import ActionMode
from pushplan.envs.registry import ACTIONS, SIMULATORS, TASKS, look_up
from pushplan.envs.simulators.base import Simulator
from pushplan.envs.tasks.base import ObservationBuilder, Task
from pushplan.envs.trace import Trace
from pushplan.envs.window import Window, has_display
from pushplan.scenarios import Scenario
from pushplan.world import (
    Action,
    InvalidInputError,
    MissingDependencyError,
    PushplanError,
    UnknownNameError,
    World,
    stream,
)
from pushplan.world.checks import frozen

RENDER_MODES = ("human", "rgb_array")
_SEED_LIMIT = 2**31


class EpisodeOverError(PushplanError, gymnasium.error.ResetNeeded):
    """`PushEnv.step` was called before `reset`, or after the end of an episode."""


class PushEnv(gymnasium.Env[NDArray[Any], NDArray[Any]]):
    """A robot that pushes things about, as a Gymnasium environment.

    Args:
        task: name of the task.
        simulator: name of the simulator.
        preset: set of dimensions of the task.
        variations: what departs from the preset, by name.
        observation: name of the observation.
        action: name of the action mode; the task's first if None.
        render_mode: ``"rgb_array"``, ``"human"`` (a window) or None.
        seed: of the first episode, where `reset` is given none.

    ``info`` of each step holds ``success`` (bool), ``reason`` (why the episode has ended, else
    ``""``), ``work`` (mass times path length of the objects in this step [kg m]) and ``held``
    (whether something kept the robot from moving as commanded).

    Raises:
        UnknownNameError: if a name is unknown; the message lists the valid ones.
        ScenarioError: if the value of a variation makes no sense.
        MissingDependencyError: if there is no display for a window.
    """

    def __init__(
        self,
        *,
        task: str,
        simulator: str = "pymunk",
        preset: str = "benchmark",
        variations: Mapping[str, object] | None = None,
        observation: str = "image",
        action: str | None = None,
        render_mode: str | None = None,
        seed: int | None = None,
    ) -> None:
        task_class: type[Task] = look_up("task", TASKS, task)
        engine: type[Simulator] = look_up("simulator", SIMULATORS, simulator)
        action = task_class.actions[0] if action is None else action
        if action not in task_class.actions:
            raise UnknownNameError(f"action of task {task!r}", action, task_class.actions)
        mode: type[ActionMode] = look_up("action", ACTIONS, action)
        self.metadata = _metadata()
        self.render_mode = _checked_render_mode(render_mode)
        self.task = task_class(preset=preset, variations=variations or {}, drive=mode.drive)
        self._builder = self.task.observation(observation)
        self._simulator = engine()
        self._mode = mode(self.task.robot)
        self._window: Window | None = None
        self._first_seed = seed
        self._world: World | None = None
        self._trace: Trace | None = None
        self._over = "reset() has not been called"
        self.action_space: Any = self._mode.space
        self.observation_space: Any = _space(self._builder, self.task.reach)

    @property
    def world(self) -> World:
        """A snapshot of the scene now.

        Raises:
            EpisodeOverError: before the first `reset`.
        """
        if self._world is None:
            raise EpisodeOverError("there is no world yet: call reset() first")
        return self._world

    @property
    def trace(self) -> Trace:
        """What moved in the last step, at the control rate or finer; the start after a reset."""
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
        """Start an episode.

        Args:
            seed: decides the start, alone; without it the next start of the sequence that the
                last seed began.
            options: none are known.
        """
        if options:
            raise InvalidInputError(f"reset() knows no options, got {sorted(options)}")
        if seed is None and self._first_seed is not None:
            seed = self._first_seed
        self._first_seed = None
        super().reset(seed=seed)
        layout = int(self.np_random.integers(_SEED_LIMIT)) if seed is None else int(seed)
        world = self.task.start(stream(layout, "layout"))
        self._simulator.build(world, self.task.materials)
        self._world = world
        self._trace = Trace(
            frozen(np.array([world.time])), world.robot_pose[None], world.movables.poses[None]
        )
        self._over = ""
        self._show()
        return self._builder.observe(world), _info(False, "", 0.0, False)

    def step(self, action: ArrayLike) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Carry out one action.

        Args:
            action: array of the action space; values beyond its bounds are clipped.

        Raises:
            EpisodeOverError: if the episode has ended or not begun.
            InvalidInputError: if the action is not finite or has the wrong shape.
        """
        if self._over:
            raise EpisodeOverError(f"{self._over}: call reset() before step()")
        before = self.world
        motion = self._mode.start(self._mode.read(action), before)
        world, traces = before, []
        touched = held = False
        while (command := motion(world)) is not None:
            traces.append(self._simulator.step(command, self.task.control_step))
            world = self._simulator.world()
            touched |= self._simulator.touched_static
            held |= self._simulator.held
        self._world, self._trace = world, Trace.join(traces)
        outcome = self.task.score(before, world, self._trace, touched_static=touched)
        if outcome.terminated or outcome.truncated:
            self._over = f"the episode has ended ({outcome.reason})"
        self._show()
        return (
            self._builder.observe(world),
            outcome.reward,
            outcome.terminated,
            outcome.truncated,
            _info(outcome.success, outcome.reason, outcome.work, held),
        )

    def render(self) -> NDArray[np.uint8] | None:
        """The scene now as (H, W, 3) uint8; None in ``"human"`` mode, which draws by itself."""
        if self.render_mode == "rgb_array":
            return _picture(self.world)
        self._show()
        return None

    def close(self) -> None:
        """Close the window, if there is one; may be called again."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def _show(self) -> None:
        if self.render_mode == "human":
            if self._window is None:
                self._window = Window("pushplan")
            self._window.show(_picture(self.world))


def make(
    scenario: Scenario,
    *,
    observation: str = "image",
    action: str | None = None,
    render_mode: str | None = None,
) -> PushEnv:
    """The environment of a scenario. Its first `reset` uses the scenario's seed.

    Args:
        scenario: what to run.
        observation: name of the observation.
        action: name of the action mode; the task's first if None.
        render_mode: ``"rgb_array"``, ``"human"`` or None.
    """
    return PushEnv(
        task=scenario.task,
        simulator=scenario.simulator,
        preset=scenario.preset,
        variations=scenario.variations,
        observation=observation,
        action=action,
        render_mode=render_mode,
        seed=scenario.seed,
    )


def make_env(
    *,
    task: str,
    simulator: str = "pymunk",
    preset: str = "benchmark",
    observation: str = "image",
    action: str | None = None,
    render_mode: str | None = None,
    **variations: object,
) -> PushEnv:
    """What ``gymnasium.make`` calls: variations are keyword arguments of their own."""
    return PushEnv(
        task=task,
        simulator=simulator,
        preset=preset,
        variations=variations,
        observation=observation,
        action=action,
        render_mode=render_mode,
    )


def _space(builder: ObservationBuilder, reach: float) -> Box:
    """The space of an observation; numbers are bounded by what the task can reach."""
    kind: Any = np.dtype(builder.dtype)
    low, high = (
        np.broadcast_to(np.clip(np.asarray(bound, dtype=np.float64), -reach, reach), builder.shape)
        if kind.kind == "f"
        else np.broadcast_to(np.asarray(bound, dtype=kind), builder.shape)
        for bound in (builder.low, builder.high)
    )
    return Box(low.astype(kind), high.astype(kind), builder.shape, kind)


def _picture(world: World) -> NDArray[np.uint8]:
    from pushplan.drawing import draw_world  # most runs draw nothing

    return draw_world(world)


def _info(success: bool, reason: str, work: float, held: bool) -> dict[str, Any]:
    return {"success": success, "reason": reason, "work": work, "held": held}


def _metadata() -> dict[str, Any]:
    """Render modes that work here: a window needs a display."""
    modes = list(RENDER_MODES) if has_display() else ["rgb_array"]
    return {"render_modes": modes, "render_fps": 10}


def _checked_render_mode(render_mode: str | None) -> str | None:
    if render_mode is not None and render_mode not in RENDER_MODES:
        raise UnknownNameError("render mode", render_mode, RENDER_MODES)
    if render_mode == "human" and not has_display():
        raise MissingDependencyError(
            "render mode 'human' needs tkinter and a display; 'rgb_array' works without"
        )
    return render_mode
