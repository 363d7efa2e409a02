"""Small stand-ins for environments and policies; the bad ones are bad on purpose."""

from __future__ import annotations

import csv
import ctypes
import functools
import os
import shutil
import signal
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from pushplan.evaluation import TIMING_COLUMNS, Job, JobSettings, parse_policies, run_batch
from pushplan.world import Drive, GoalDisc, Movables, RobotModel, StaticMap, Twist, World

HERE = __file__
SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@dataclass(frozen=True)
class LineScenario:
    """Drive 5 m along x to a goal; a box stands in the way."""

    seed: int
    task: str = "maze"
    simulator: str = "fake"

    @property
    def key(self) -> str:
        return f"line-{self.seed}"

    def to_dict(self) -> dict[str, Any]:
        return {"task": self.task, "simulator": self.simulator, "seed": self.seed}


class LineEnv:
    """The robot goes where it is told; a box within 1 m ahead is pushed along."""

    step_s = 1.0

    def __init__(self, scenario: LineScenario, observation: str = "state") -> None:
        self.scenario = scenario
        self.observation = observation
        self.action_space = SimpleNamespace(shape=(1,))

    def reset(self, *, seed: int) -> tuple[Any, dict[str, Any]]:
        rng = np.random.default_rng(seed)
        self.world = World(
            robot=RobotModel.from_outline(
                SQUARE, mass=1.0, drive=Drive.CONSTANT_SPEED, max_speed=0.5, max_turn_rate=1.0
            ),
            robot_pose=np.zeros(3),
            static=StaticMap.build(bounds=[-20.0, -20.0, 20.0, 20.0]),
            movables=Movables.from_outlines([SQUARE], [[3.0 + rng.uniform(), 0.0, 0.0]]),
            goal=GoalDisc(np.array([6.0, 0.0]), 1.0),
        )
        self.steps = 0
        return None, {}

    def encode(self, action: Any) -> np.ndarray:
        turn = action.angular if isinstance(action, Twist) else float(action[0])
        return np.clip(np.array([turn]), -1.0, 1.0)

    def step(self, command: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        pose = np.array(self.world.robot_pose)
        boxes = np.array(self.world.movables.poses)
        pose[2] += 0.1 * command[0]
        move = 0.5 * np.array([np.cos(pose[2]), np.sin(pose[2])])
        pose[:2] += move
        if np.hypot(*(boxes[0, :2] - pose[:2])) < 1.0:
            boxes[0, :2] += move
        self.steps += 1
        now = self.world.time + self.step_s
        self.world = self.world.moved(robot_pose=pose, movable_poses=boxes, time=now)
        self.trace = SimpleNamespace(
            times=np.array([now]), robot_poses=pose[None], object_poses=boxes[None]
        )
        success = self.world.navigation_goal.distance(pose[0], pose[1]) == 0.0
        cut = self.steps >= 40
        reason = "goal" if success else "time_limit" if cut else ""
        return None, 0.0, success, cut and not success, {"success": success, "reason": reason}


def make_env(scenario: LineScenario, observation: str = "state") -> LineEnv:
    return LineEnv(scenario, observation)


class Ahead:
    """Drives straight on, a little unsteadily."""

    def reset(self, world: World, rng: np.random.Generator) -> None:
        self.rng = rng
        self.steps = 0
        self.world = world

    def act(self, world: World, observation: Any) -> Any:
        self.steps += 1
        if self.steps == 4:
            self.misbehave()
        return Twist(0.5, 0.2 * self.rng.normal())

    def misbehave(self) -> None:
        """What the fourth step does."""


class SlowAhead(Ahead):
    def misbehave(self) -> None:
        time.sleep(0.05)


class Raises(Ahead):
    def misbehave(self) -> None:
        raise ValueError(f"no idea at {self!r}")


class Exits(Ahead):
    def misbehave(self) -> None:
        raise SystemExit(3)


class Nan(Ahead):
    def act(self, world: World, observation: Any) -> Any:
        return np.array([np.nan if super().act(world, observation) and self.steps > 3 else 0.0])


class WrongShape(Ahead):
    def act(self, world: World, observation: Any) -> Any:
        return np.zeros(3)


class Text(Ahead):
    def act(self, world: World, observation: Any) -> Any:
        return "left"


class Unmakeable:
    def __init__(self) -> None:
        raise RuntimeError("no weights")


class Sleeps(Ahead):
    def misbehave(self) -> None:
        time.sleep(3600.0)


class Swallows(Ahead):
    """Spins and catches whatever is thrown at it."""

    def misbehave(self) -> None:
        while True:
            try:
                while True:
                    pass
            except BaseException:
                pass


class HoldsGil(Ahead):
    """Sleeps in C without letting go of the interpreter."""

    def misbehave(self) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
        ctypes.PyDLL(None).sleep(3600)


class Killed(Ahead):
    def misbehave(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)


class HardExit(Ahead):
    def misbehave(self) -> None:
        os._exit(7)


class Segfaults(Ahead):
    def misbehave(self) -> None:
        ctypes.string_at(0)


class Greedy(Ahead):
    """Wants 8 GB."""

    def misbehave(self) -> None:
        self.hoard = np.ones(10**9)


class Logs(Ahead):
    """Keeps a log of planning calls."""

    def reset(self, world: World, rng: np.random.Generator) -> None:
        super().reset(world, rng)
        times = (0.001, 0.002, 0.009)
        self.plan_log = [SimpleNamespace(stats=SimpleNamespace(wall_time_s=t)) for t in times]


class BrokenEnv(LineEnv):
    def step(self, command: np.ndarray) -> Any:
        raise RuntimeError("the engine is broken")


def make_broken_env(scenario: LineScenario, observation: str = "state") -> BrokenEnv:
    return BrokenEnv(scenario, observation)


SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=30.0, dry_run=False)


def line_jobs(seeds: int, *names: str) -> list[Job]:
    """Policies of this file, ``Ahead`` and ``Raises`` by default, on so many scenarios."""
    specs = parse_policies([f"{HERE}:{name}" for name in names or ("Ahead", "Raises")])
    return [Job(spec, LineScenario(seed)) for seed in range(seeds) for spec in specs]


@functools.cache
def _stored_run(seeds: int) -> tempfile.TemporaryDirectory[str]:
    folder = tempfile.TemporaryDirectory(prefix="pushplan-stored-run-")
    run_batch(line_jobs(seeds), out=folder.name, workers=0, settings=SETTINGS)
    return folder


def stored_run(folder: Path, seeds: int = 3) -> Path:
    """A run directory with the results of `line_jobs`, which are run once for all tests."""
    return Path(shutil.copytree(_stored_run(seeds).name, folder))


def plain_policy() -> Ahead:
    return Ahead()


def timeless(path: Path) -> list[dict[str, str]]:
    """The lines of a run's ``results.csv`` without the columns that differ from run to run."""
    with (path / "results.csv").open() as file:
        return [
            {name: value for name, value in line.items() if name not in TIMING_COLUMNS}
            for line in csv.DictReader(file)
        ]
